import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from study_app.store import recordings
from study_app.store.journals.journal_events import Recorded, RecordingLost
from study_app.store.recorder import Recorder, lost_event, recorded_event, recording_files
from study_app.store.recordings import SamplesFile, WrittenFile, read_facts, read_frames, read_samples
from tests.platforms import files_up_to
from tests.store.conftest import Make

pytestmark = pytest.mark.slow


FACTS = {"participant": "P007", "session": 1}


@pytest.fixture
def recorder(tmp_path: Path) -> Iterator[Recorder]:
    open_recorder = Recorder(tmp_path / "recordings", FACTS)
    yield open_recorder
    open_recorder.close()


class Disk:
    """Files that are written only while the disk is let to."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.works = threading.Event()
        self.asked = threading.Event()
        disk = self

        class SlowFile(SamplesFile):
            def write(self, samples: Any) -> None:
                disk.asked.set()
                assert disk.works.wait(20)
                super().write(samples)

        monkeypatch.setattr(recordings, "SamplesFile", SlowFile)


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Disk:
    return Disk(monkeypatch)


def record(
    recorder: Recorder, samples: Any, *, trial: int = 3, attempt: int = 1, chunk: int = 17, video: Any = None
) -> None:
    recorder.start(trial, attempt, 1000.0)
    for first in range(0, len(samples), chunk):
        recorder.append(samples[first : first + chunk])
    recorder.frame(2_000, 1_000)
    recorder.frame(3_000, 1_500, video)
    recorder.stop()


def test_a_trial_is_on_the_disk_under_its_name_after_its_end(
    tmp_path: Path, recorder: Recorder, samples_of: Make
) -> None:
    samples = samples_of(70_001)
    record(recorder, samples, chunk=1_234, video=SimpleNamespace(number=5, due_ns=1_400, age_ns=70))
    recorder.close()
    (recording,) = recorder.collect_results()
    assert isinstance(recording, Recorded)
    videos = read_frames(tmp_path / recording.recording_frames)[["video_frame", "video_ns", "video_age_ns"]]
    assert [tuple(row) for row in videos.tolist()] == [(-1, 0, -1), (5, 1_400, 70)]
    assert (
        recording.trial,
        recording.attempt,
        recording.samples_unrecorded,
        recording.samples_recorded,
        recording.frames_recorded,
    ) == (3, 1, 0, 70_001, 2)
    assert sorted(path.name for path in (tmp_path / "recordings").iterdir()) == [
        "trial-003.parquet",
        "trial-003_frames.parquet",
    ]
    assert np.array_equal(read_samples(tmp_path / recording.recording)["position_m"], samples["position_m"])
    assert read_frames(tmp_path / recording.recording_frames)["age_ns"].tolist() == [1_000, 1_500]
    assert (
        read_facts(tmp_path / recording.recording).items() >= {**FACTS, "trial": 3, "attempt": 1, "dropped": 0}.items()
    )
    assert recorder.collect_results() == ()


def test_beginning_the_next_trial_ends_the_one_before(recorder: Recorder, samples_of: Make) -> None:
    recorder.start(1, 1, 1000.0)
    recorder.append(samples_of(10))
    recorder.start(2, 1, 1000.0)
    recorder.append(samples_of(20))
    recorder.close()
    assert [
        recording.samples_recorded for recording in recorder.collect_results() if isinstance(recording, Recorded)
    ] == [10, 20]
    record(recorder, samples_of(10))  # after its end
    recorder.close()
    assert recorder.collect_results() == ()


def test_a_stalled_disk_does_not_block_and_dropped_samples_are_counted(
    tmp_path: Path, samples_of: Make, disk: Disk
) -> None:
    """Samples are handed over while the other thread waits for the disk; samples without room are counted."""
    recorder = Recorder(tmp_path / "recordings", FACTS, room=40_000)
    recorder.start(1, 1, 1000.0)
    samples = samples_of(100_000)
    recorder.append(samples[:30_000])
    assert disk.asked.wait(20)
    for first in range(30_000, 100_000, 10_000):
        recorder.append(samples[first : first + 10_000])
    assert recorder.dropped == 30_000
    disk.works.set()
    recorder.close()
    (recording,) = recorder.collect_results()
    assert isinstance(recording, Recorded)
    assert (recording.samples_unrecorded, recording.samples_recorded) == (30_000, 70_000)
    assert read_samples(tmp_path / recording.recording)["tick"].tolist() == list(range(70_000))
    assert read_facts(tmp_path / recording.recording)["dropped"] == 30_000


def test_in_a_rehearsal_handing_over_waits_for_room_instead(tmp_path: Path, samples_of: Make) -> None:
    recorder = Recorder(tmp_path / "recordings", FACTS, waits=True, room=500)
    record(recorder, samples_of(90_000), chunk=700)
    recorder.close()
    (recording,) = recorder.collect_results()
    assert isinstance(recording, Recorded)
    assert (recording.samples_unrecorded, recording.samples_recorded) == (0, 90_000)


@pytest.mark.parametrize("size", [200, 500_000], ids=["from the first byte", "after a while"])
def test_a_full_disk_loses_a_recording_with_its_reason_and_the_next_is_kept(
    tmp_path: Path, samples_of: Make, size: int
) -> None:
    recorder = Recorder(tmp_path / "recordings", FACTS, waits=True)
    with files_up_to(size):
        record(recorder, samples_of(70_000), trial=1)
        with recorder.changed:
            assert recorder.changed.wait_for(lambda: recorder.lost, 20)
    assert recorder.collect_results() == (lost_event((1, 1, None), "File too large"),)
    record(recorder, samples_of(200), trial=2)
    recorder.close()
    (recording,) = recorder.collect_results()
    assert isinstance(recording, Recorded)
    assert sorted(path.name for path in (tmp_path / "recordings").iterdir()) == [
        "trial-002.parquet",
        "trial-002_frames.parquet",
    ]


def test_the_folder_is_on_the_disk_before_its_first_file(
    tmp_path: Path, recorder: Recorder, samples_of: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    flushed: list[tuple[Path, list[str]]] = []
    monkeypatch.setattr(
        "study_app.store.recorder.sync_folder",
        lambda path: flushed.append((path, [file.name for file in (path / "recordings").iterdir()])),
    )
    record(recorder, samples_of(200), trial=1)
    record(recorder, samples_of(200), trial=2)
    recorder.close()
    assert flushed == [(tmp_path, [])]


def test_the_end_of_a_session_does_not_wait_for_ever(tmp_path: Path, samples_of: Make, disk: Disk) -> None:
    recorder = Recorder(tmp_path / "recordings", FACTS)
    record(recorder, samples_of(40_000), chunk=5_000)
    assert disk.asked.wait(20)
    recorder.close(patience_s=0.0)
    assert recorder.collect_results() == (lost_event((3, 1, None), "the disk was too slow"),)
    disk.works.set()
    recorder.close()
    assert recorder.collect_results() == ()
    assert recorder.thread is not None
    recorder.thread.join(20)
    assert list((tmp_path / "recordings").iterdir()) == [], "it was said to be lost"


def test_a_permanently_stalled_disk_is_abandoned_without_waiting(
    tmp_path: Path, samples_of: Make, disk: Disk, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = Recorder(tmp_path / "recordings", FACTS)
    record(recorder, samples_of(40_000), chunk=5_000)
    assert disk.asked.wait(20)
    assert not recorder.end_without_waiting()
    later = time.perf_counter() + 31
    monkeypatch.setattr("study_app.store.recorder.time.perf_counter", lambda: later)
    assert recorder.end_without_waiting()
    recorder.close()
    assert recorder.collect_results() == (lost_event((3, 1, None), "the disk was too slow"),)
    disk.works.set()
    assert recorder.thread is not None
    recorder.thread.join(20)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_thread_that_ends_loses_its_trial_at_once_and_the_next_trial_starts_another(
    recorder: Recorder, samples_of: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Ended(BaseException):
        """What no guard for exceptions holds back."""

    threads = []

    def ends(*_arguments: Any) -> None:
        threads.append(threading.current_thread())
        raise Ended("pulled")

    with monkeypatch.context() as patched:
        patched.setattr(recordings, "SamplesFile", ends)
        patched.setattr(threading, "excepthook", lambda _arguments: None)
        recorder.start(1, 1, 1000.0)
        with recorder.changed:
            assert recorder.changed.wait_for(lambda: recorder.lost, 10.0)
        threads[0].join(10.0)
        assert recorder.lost == (lost_event((1, 1, None), "its thread ended (Ended: pulled)"),)
        recorder.append(samples_of(10))
        recorder.stop()
    record(recorder, samples_of(20), trial=2)
    recorder.close()
    missing, recording = recorder.collect_results()
    assert missing == lost_event((1, 1, None), "its thread ended (Ended: pulled)")
    assert isinstance(recording, Recorded)
    assert (recording.trial, recording.samples_recorded) == (2, 20)


def test_a_thread_that_cannot_be_started_loses_recordings_and_not_the_session(
    recorder: Recorder, samples_of: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuses(thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    with monkeypatch.context() as patched:
        patched.setattr(threading.Thread, "start", refuses)
        record(recorder, samples_of(10), trial=1)
    assert [lost_recording.trial for lost_recording in recorder.lost] == [1]
    assert "can't start new thread" in recorder.lost[0].reason
    record(recorder, samples_of(20), trial=2)
    recorder.close()
    assert [type(result) for result in recorder.collect_results()] == [RecordingLost, Recorded]


def test_the_journal_lists_files_rows_and_hashes_of_each_attempt(tmp_path: Path) -> None:
    folder = tmp_path / "recordings"
    samples = WrittenFile(folder / "a.parquet", 900, "aa", "bb")
    frames = WrittenFile(folder / "a_frames.parquet", 54, "cc", "dd")
    assert recorded_event((3, 2, 1), samples, frames, 7) == Recorded(
        trial=3,
        attempt=2,
        interval=1,
        recording="recordings/a.parquet",
        recording_frames="recordings/a_frames.parquet",
        samples_recorded=900,
        samples_unrecorded=7,
        frames_recorded=54,
        sha256="aa",
        frames_sha256="cc",
        opened_sha256="bb",
        opened_frames_sha256="dd",
    )
    assert lost_event((3, 2, 1), "no space") == RecordingLost(trial=3, attempt=2, interval=1, reason="no space")
    for which, name in (
        ((3, 1), "trial-003"),
        ((3, 2), "trial-003_attempt-2"),
        ((12, 1, 2), "trial-012_interval-2"),
        ((1234, 3, 1), "trial-1234_attempt-3_interval-1"),
    ):
        assert recording_files(folder, *which) == (folder / f"{name}.parquet", folder / f"{name}_frames.parquet")


def test_without_a_running_recording_samples_and_frames_are_dropped(recorder: Recorder, samples_of: Make) -> None:
    recorder.append(samples_of(10))
    recorder.frame(2_000, 1_000)
    recorder.stop()
    assert (recorder.thread, recorder.dropped, recorder.lost) == (None, 0, ())
    assert recorder.end_without_waiting(), "there is nothing to wait for"
    recorder.start(1, 1, 1000.0)
    recorder.append(samples_of(10))
    recorder.stop()
    assert (recorder.thread, recorder.collect_results()) == (None, ()), "and it stays closed"


def test_the_facts_of_a_recording_state_its_interval_and_its_frames_start_anew(
    tmp_path: Path, recorder: Recorder, samples_of: Make
) -> None:
    for interval in (1, 2):
        recorder.start(3, 2, 1000.0, interval)
        recorder.append(samples_of(20 * interval))
        recorder.append(samples_of(0))
        recorder.frame(2_000, 2_000 - interval)
    recorder.close()
    first, second = recorder.collect_results()
    assert isinstance(first, Recorded)
    assert isinstance(second, Recorded)
    counts = [(recording.which, recording.samples_recorded, recording.frames_recorded) for recording in (first, second)]
    assert counts == [
        ((3, 2, 1), 20, 1), ((3, 2, 2), 40, 1),
    ]  # fmt: skip
    for recording, interval in ((first, 1), (second, 2)):
        assert (
            read_facts(tmp_path / recording.recording).items()
            >= {"trial": 3, "attempt": 2, "interval": interval}.items()
        )
        assert read_frames(tmp_path / recording.recording_frames)["age_ns"].tolist() == [interval]
    assert (recorder.lost, recorder.dropped) == ((), 0)
