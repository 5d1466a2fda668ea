"""Recording in the background: samples at 1 kHz are queued, and a separate thread writes them.

Queueing never waits for the disk. If the disk is too slow for two minutes, or rejects all writes, samples are dropped
and counted and the session continues, because answers matter more than recordings. Any other failure loses only that
trial's recording, even if it ends the thread, because the next trial starts a new one. `Recorder.lost` reports it at
once. In a rehearsal, which runs in simulated time, queueing waits instead, and nothing is lost.
"""

from __future__ import annotations

import contextlib
import threading
import time
from array import array
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from study_app.errors import StoreError
from study_app.store.files.atomic import sync_folder, system_message
from study_app.store.journals.journal_events import Recorded, RecordingLost, Which

if TYPE_CHECKING:
    from study_app.store.recordings import WrittenFile
    from study_app.video.frames import VideoFrame

ROOM = 120_000  # capacity of the queue [samples]: two minutes at 1 kHz, 37 MB
_WAKE_SAMPLES = 5_000  # smallest number of queued samples that wakes the thread
PATIENCE_S = 30.0  # time that the end of a session waits for the disk [s]
LEAVING_S = 2.0  # the same when the program ends during a session, which must not take long [s]


Kept: TypeAlias = Recorded | RecordingLost


@dataclass(frozen=True, slots=True)
class _Begin:
    which: Which
    rate_hz: float


@dataclass(frozen=True, slots=True)
class _End:
    frames: array[int]
    dropped: int


class Recorder:
    """Write the recordings of one session, one trial at a time: `start`, `append` and `frame`, `stop`.

    All but `close` return at once; use it from one thread.

    Parameters
    ----------
    folder : Path
        The folder of the files, created with the first one.
    facts : mapping
        Metadata of every file.
    secret : bytes, optional
        The key that seals the files until the study is unblinded; None: they are not sealed.
    waits : bool
        Whether `append` waits for room in the queue instead of dropping samples; for rehearsals.
    room : int
        Capacity of the queue in samples.

    Attributes
    ----------
    thread : threading.Thread or None
        The writing thread; None before the first trial, and after it ended by a failure.
    changed : threading.Condition
        Notified when a recording was kept or lost.
    """

    def __init__(
        self,
        folder: Path,
        facts: Mapping[str, Any],
        *,
        secret: bytes | None = None,
        waits: bool = False,
        room: int = ROOM,
    ) -> None:
        # Loads the Parquet library, which takes a while, before the participant sits down, and only if it is needed.
        from study_app.store import recordings  # noqa: PLC0415

        self._files = recordings
        self._folder = folder
        self._facts = dict(facts)
        self._secret = secret
        self._waits = waits
        self._room = room
        self.thread: threading.Thread | None = None
        self.changed = threading.Condition()
        self._queue: deque[Any] = deque()
        self._waiting = 0
        self._closing = False
        self._patient_until_s = 0.0
        self._kept: list[Kept] = []
        self._lost: list[RecordingLost] = []
        self._current: Which | None = None
        self._expected: dict[Which, None] = {}
        self._frames = array("q")
        self._dropped = 0

    def start(self, trial: int, attempt: int, rate_hz: float, interval: int | None = None) -> None:
        """Begin the recording of a trial, or of one of its intervals; stop a running one first.

        The first appended sample should be the last one before the trial, from the previous scene: a replay starts
        from the force that was then on the hand.
        """
        self.stop()
        self._current = trial, attempt, interval
        self._frames, self._dropped = array("q"), 0
        with self.changed:
            if self._closing:
                self._current = None
                return
            self._expected[trial, attempt, interval] = None
            self._queue.append(_Begin((trial, attempt, interval), rate_hz))
            if not self._is_running():
                self.thread = threading.Thread(target=self._run_writer, name="recorder", daemon=True)
                try:
                    self.thread.start()
                except RuntimeError as error:
                    self._lose_all(f"its thread cannot be started: {error}")
            self.changed.notify_all()

    def append(self, samples: Any) -> None:
        """Queue the next samples, in order (array of ``layout.SAMPLE``), which must not be changed afterwards."""
        count = len(samples)
        if self._current is None or count == 0:
            return
        with self.changed:
            while self._waits and self._waiting and self._waiting + count > self._room and self._is_running():
                self.changed.wait()
            if self._waiting and self._waiting + count > self._room:
                self._dropped += count
                return
            self._queue.append(samples)
            self._waiting += count
            if self._waiting >= min(_WAKE_SAMPLES, self._room):
                self.changed.notify_all()

    def frame(self, painted_ns: int, sample_ns: int, video: VideoFrame | None = None) -> None:
        """Record when a frame was painted, the time of the sample it shows [ns, servo clock] and its video frame."""
        if self._current is not None:
            number, due_ns, age_ns = (-1, 0, None) if video is None else (video.number, video.due_ns, video.age_ns)
            self._frames.extend((painted_ns, sample_ns, number, due_ns, -1 if age_ns is None else age_ns))

    def stop(self) -> None:
        """End the running recording, if any; `collect_results` reports when it is on the disk."""
        if self._current is None:
            return
        self._current = None
        with self.changed:
            self._queue.append(_End(self._frames, self._dropped))
            self.changed.notify_all()

    @property
    def dropped(self) -> int:
        """The number of samples dropped from the running or last recording."""
        return self._dropped

    @property
    def lost(self) -> tuple[RecordingLost, ...]:
        """All recordings lost so far, updated as soon as one is lost."""
        with self.changed:
            return tuple(self._lost)

    def collect_results(self) -> tuple[Kept, ...]:
        """Return the recordings completed or lost since the last call."""
        with self.changed:
            completed, self._kept = tuple(self._kept), []
        return completed

    def end_without_waiting(self) -> bool:
        """End the running recording; return, without waiting, whether it is written or the time limit has passed.

        Once it returns True, `close` returns at once.
        """
        self._request_end()
        return not self._is_running() or time.perf_counter() >= self._patient_until_s

    def _request_end(self, patience_s: float = PATIENCE_S) -> None:
        self.stop()
        with self.changed:
            if not self._closing:
                self._patient_until_s = time.perf_counter() + patience_s
            self._closing = True
            self.changed.notify_all()

    def close(self, patience_s: float = PATIENCE_S) -> None:
        """End the running recording and wait up to ``patience_s`` until it is written; see `collect_results`."""
        self._request_end(patience_s)
        if self.thread is not None:
            self.thread.join(max(0.0, min(patience_s, self._patient_until_s - time.perf_counter())))
        with self.changed:
            reason = "the disk was too slow" if self._is_running() else "its thread had ended"
            self._kept += [lost_event(which, reason) for which in self._expected]
            self._expected.clear()

    def _is_running(self) -> bool:
        return self.thread is not None and self.thread.is_alive()

    def _run_writer(self) -> None:
        """Write queued data; runs in the recorder's thread, which the next trial restarts after a failure."""
        try:
            self._process_queue()
        except BaseException as error:
            with self.changed:
                self._lose_all(f"its thread ended ({type(error).__name__}: {error})")
            raise

    def _lose_all(self, reason: str) -> None:
        """Count all running and queued recordings as lost; the caller holds the lock."""
        lost = [lost_event(which, reason) for which in self._expected]
        self._kept += lost
        self._lost += lost
        self._expected.clear()
        self._queue.clear()
        self._waiting, self._current, self.thread = 0, None, None
        self.changed.notify_all()

    def _process_queue(self) -> None:
        """Process the queue until it is empty and closed."""
        while (begin := self._next_item()) is not None:
            if not isinstance(begin, _Begin):
                continue  # data of a trial that was lost with an earlier thread
            kept = self._record(begin)
            with self.changed:
                if begin.which in self._expected:
                    del self._expected[begin.which]
                    self._kept.append(kept)
                    if isinstance(kept, RecordingLost):
                        self._lost.append(kept)
                    self.changed.notify_all()
                else:  # `close` has given up: a file without a line in the journal must not remain
                    for path in recording_files(self._folder, *begin.which):
                        path.unlink(missing_ok=True)

    def _record(self, begin: _Begin) -> Kept:
        """Write one trial's files and consume its queue items up to the trial's end, even after a failure."""
        samples_path, frames_path = recording_files(self._folder, *begin.which)
        trial, attempt, interval = begin.which
        facts = {**self._facts, "trial": trial, "attempt": attempt}
        if interval is not None:
            facts["interval"] = interval
        frames_file: WrittenFile | None = None
        end: _End | None = None
        try:
            if not self._folder.is_dir():
                self._folder.mkdir()
                sync_folder(self._folder.parent)  # so that it survives a power cut
            file = self._files.SamplesFile(samples_path, facts, begin.rate_hz, self._secret)
            end = self._consume_samples(file.write)
            frames = np.frombuffer(end.frames, np.int64).reshape(-1, 5)
            seconds = (file.received_rows + end.dropped) / begin.rate_hz
            frames_file = self._files.write_frames(frames_path, frames, facts, seconds, self._secret)
            return recorded_event(begin.which, file.finish(end.dropped), frames_file, end.dropped)
        except Exception as error:  # noqa: BLE001 - after any error the next trial's recording is still written
            with contextlib.suppress(Exception):  # `verify` reports files that cannot be removed
                if frames_file is not None:
                    frames_file.path.unlink(missing_ok=True)
            if end is None:
                self._consume_samples(lambda _: None)
            cause = error.__cause__ if isinstance(error, StoreError) else error
            reason = system_message(cause) if isinstance(cause, OSError) else f"{type(error).__name__}: {error}"
            return lost_event(begin.which, reason)

    def _consume_samples(self, consume: Callable[[Any], object]) -> _End:
        """Pass the queued samples of a trial to ``consume``; return the trial's end, or an empty one if it has none."""
        while (item := self._next_item()) is not None:
            if isinstance(item, _End):
                return item
            consume(item)
        return _End(array("q"), 0)

    def _next_item(self) -> Any:
        """Wait for the next item of the queue and return it; None when the queue is closed and empty."""
        with self.changed:
            while not self._queue and not self._closing:
                self.changed.wait()
            if not self._queue:
                return None
            item = self._queue.popleft()
            if not isinstance(item, _Begin | _End):
                self._waiting -= len(item)
                self.changed.notify_all()
            return item


def recorded_event(which: Which, samples: WrittenFile, frames: WrittenFile, dropped: int) -> Recorded:
    """Return the journal's event for a complete recording, with paths relative to the session's folder."""
    trial, attempt, interval = which
    return Recorded(
        trial=trial,
        attempt=attempt,
        interval=interval,
        recording=f"{samples.path.parent.name}/{samples.path.name}",
        recording_frames=f"{frames.path.parent.name}/{frames.path.name}",
        samples_recorded=samples.rows,
        samples_unrecorded=dropped,
        frames_recorded=frames.rows,
        sha256=samples.sha256,
        frames_sha256=frames.sha256,
        opened_sha256=samples.opened_sha256,
        opened_frames_sha256=frames.opened_sha256,
    )


def lost_event(which: Which, reason: str) -> RecordingLost:
    """Return the journal's event for a recording that could not be stored."""
    trial, attempt, interval = which
    return RecordingLost(trial=trial, attempt=attempt, interval=interval, reason=reason)


def recording_files(folder: Path, trial: int, attempt: int, interval: int | None = None) -> tuple[Path, Path]:
    """Return the files of samples and of frames, such as trial-003.parquet and trial-003_interval-2_frames.parquet."""
    attempt_part = f"_attempt-{attempt}" if attempt > 1 else ""
    interval_part = "" if interval is None else f"_interval-{interval}"
    name = f"trial-{trial:03d}{attempt_part}{interval_part}"
    return folder / f"{name}.parquet", folder / f"{name}_frames.parquet"
