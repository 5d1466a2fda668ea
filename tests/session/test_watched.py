"""A recorded trial at any moment, from four samples and a few lines of a journal."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from study_app.errors import StoreError
from study_app.haptics.model.layout import LIMITER_GLITCH
from study_app.protocol.load import load
from study_app.session import watch
from study_app.session.pages import Interval, Progress
from study_app.session.watch import Mark, Watched
from tests import studies
from tests.journal_lines import event_of
from tests.session import small

TIMES_S = np.array([-0.5, 0.0, 1.0, 2.0])
PLACES_M = [(0.0, 0.0, 0.0), (0.01, 0.0, 0.0), (0.03, 0.02, 0.0), (0.03, 0.02, 0.04)]


def watched(**more: Any) -> Watched:
    """Return a trial whose task began at 10 s on the servo's clock."""
    fields: Any = {"page": None, "tracker": SimpleNamespace(at=lambda time_ns: time_ns), "marks": ()}
    about: Any = {"language": "en", "blinded": False, "presented": "", "intervals": 0}
    return Watched(**about, samples=small.samples(TIMES_S + 10, PLACES_M), times_s=TIMES_S, **(fields | more))


def test_a_moment_has_the_newest_sample_the_interpolated_hand_and_the_frame_that_was_visible() -> None:
    marks = (Mark(2.75, "event", "paused"), Mark(1.0, "answer", "thick: 5"))
    trial = watched(marks=marks, painted_s=np.array([0.1, 0.6]), shown_s=np.array([0.05, 0.4]))
    assert (trial.begins_s, trial.ends_s, watched().ends_s) == (-0.5, 2.75, 2.0)
    assert [trial.index(at_s) for at_s in (-9.0, 0.0, 0.99, 2.5)] == [0, 1, 1, 3]
    assert [trial.drawn_s(at_s) for at_s in (0.0, 0.1, 0.59, 0.6)] == [0.0, 0.05, 0.05, 0.4]
    view = trial.view(0.5)
    assert view.position_m == pytest.approx([0.02, 0.01, 0.0])
    assert view.task == view.sample_time_ns == 10_500_000_000
    assert list(trial.steps_s("sample")) == list(TIMES_S)
    assert list(trial.steps_s("frame")) == [0.1, 0.6]
    assert list(watched().steps_s("frame")[:2]) == pytest.approx([-0.5, -0.5 + 1 / 60])


def test_marks_are_on_the_clock_of_the_task_which_begins_with_the_first_frame() -> None:
    which = {"trial": 4, "attempt": 1}
    ended: Any = event_of("trial_ended", n=8, t_s=104.0, outcome="complete", first_frame_gap_ms=250.0, **which)
    start_line, *lines = (
        event_of("trial_started", n=3, t_s=100.0, **which),
        event_of("note", n=2, t_s=100.5, kind="note", text="before"),
        event_of("paused", n=4, t_s=101.0, by="operator"),
        event_of("target_reached", n=5, t_s=102.0, trial=4, target=2, t_task_s=1.7),
        event_of("choice", n=6, t_s=103.0, trial=4, item="thick", value=5),
        event_of("interval_ended", n=7, t_s=103.5, interval=1, outcome="timeout", **which),
        ended,
        event_of("note", n=9, t_s=110.0, kind="note", text="of the next interval"),
    )
    assert list(watch._marks(lines, start_line, ended, 110.0)) == [
        Mark(0.75, "event", "paused"), Mark(1.7, "target", "target 3 reached"), Mark(2.75, "answer", "thick: 5"),
        Mark(3.75, "event", "task ended: complete"),
    ]  # fmt: skip
    task: Any = SimpleNamespace(targets_m=("left", "right"))
    sealed: Any = SimpleNamespace(reached_s=[1.5, 2.5, 4.0])
    assert list(watch._target_marks(sealed, task)) == [
        Mark(at_s, "target", f"target {number} reached") for at_s, number in ((1.5, 1), (2.5, 2), (4.0, 1))
    ]
    assert list(watch._target_marks(None, task)) == []


@pytest.mark.parametrize(("last", "begins_s"), [(True, 12.0), (False, 14.0)])
def test_times_begin_with_the_scene_of_the_task_before_its_adjustments(last: bool, begins_s: float) -> None:
    """The first sample's place is unknown and the fourth was rejected; a step made scene 6 of scene 5."""
    times_s, places_m = np.arange(10.0, 16.0), np.zeros((6, 3))
    places_m[0] = np.nan
    limiters = np.where(times_s == 13, LIMITER_GLITCH, 0)
    recorded = small.samples(times_s, places_m, scene=[4, 4, 5, 5, 6, 6], limiters=limiters)
    lines = [event_of("stepped", trial=4, attempt=1, steps=2, scene=6)]
    samples, task_s = watch._timed_samples(recorded, lines, last=last)
    assert list(samples["time_ns"] // 10**9) == [11, 12, 14, 15]
    assert list(task_s) == [at_s - begins_s for at_s in (11, 12, 14, 15)]


def test_the_contents_are_named_once_the_study_is_unblinded() -> None:
    key: Any = SimpleNamespace(condition=lambda block, code: f"{block} {code}")
    fields: Any = SimpleNamespace(block="stir", code="L2", arrangement="CS")
    assert [watch._presented_condition(fields, number, key) for number in (None, 1, 2)] == [
        "stir L2", "comparison", "standard",
    ]  # fmt: skip
    assert [watch._presented_condition(fields, number, None) for number in (None, 1)] == ["", ""]


OTHERS = {"duration_s": 2.0, "first_frame_gap_ms": 0.0}
WHICH = {"trial": 4, "attempt": 2}
LINES = (
    event_of("session_started", n=0, t_s=0.0, language="nl", device="falcon", session=1),
    event_of("trial_started", n=1, t_s=90.0, trial=4, attempt=1, arrangement="CS"),
    event_of("note", n=2, t_s=91.0, kind="note", text="of the first attempt"),
    event_of("trial_started", n=3, t_s=100.0, arrangement="SC", block="stir", code="L2", **WHICH),
    event_of("interval_started", n=4, t_s=101.0, interval=1, **WHICH),
    event_of("note", n=5, t_s=101.5, kind="note", text="in the first interval"),
    event_of("interval_ended", n=6, t_s=104.0, interval=1, outcome="timeout", **WHICH, **OTHERS),
    event_of("interval_started", n=7, t_s=110.0, interval=2, **WHICH),
    event_of("note", n=8, t_s=110.5, kind="note", text="in the second interval"),
    event_of("interval_ended", n=9, t_s=113.0, interval=2, outcome="complete", **WHICH, **OTHERS),
    event_of("trial_started", n=10, t_s=200.0, trial=5, attempt=1, arrangement="SC"),
    event_of("note", n=11, t_s=201.0, kind="note", text="of the next trial"),
    *(
        event_of("recorded", n=12 + number, t_s=300.0, trial=4, attempt=attempt, interval=number,
                 recording=f"{attempt}-{number}", recording_frames=f"frames of {attempt}-{number}")
        for attempt in (1, 2) for number in (1, 2)
    ),
    event_of("recording_lost", n=17, t_s=300.0, trial=5, attempt=1, interval=1, reason="the disk is full"),
)  # fmt: skip
NAMES = {f"{attempt}-{number}": attempt * 10 + number for attempt in (1, 2) for number in (1, 2)}


@pytest.fixture
def session(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """Return a session with two attempts at a trial of two intervals; each recording has its own scene and place."""
    key = SimpleNamespace(nonce=b"secret", condition=lambda block, code: f"{block} {code}")
    session_files = SimpleNamespace(path=Path("ses"), journal=LINES, receipt=None, key=key, has_frames=True)

    def samples(path: Path, secret: bytes | None) -> Any:
        assert secret == (None if session_files.key is None else b"secret")
        scene = NAMES[path.name]
        places_m = [(scene * 1e-3, 0.0, 0.0)] * 5
        return small.samples([9.0, 10.0, 11.0, 12.0, 13.0], places_m, scene=[3, *[scene] * 4])

    def frames(path: Path, _secret: bytes | None) -> Any:
        if not session_files.has_frames:
            raise StoreError("frames.parquet is damaged")
        assert path.name == "frames of 2-2"
        return {"painted_ns": np.array([10.25e9, 10.5e9]), "sample_ns": np.array([10.125e9, 10.375e9])}

    page = SimpleNamespace(task=SimpleNamespace(targets_m=()))
    fed: list[int] = []
    tracker = SimpleNamespace(feed=lambda samples: fed.extend(samples["time_ns"].tolist()), fed=fed)
    for name, function in {
        "locate_session": lambda _folder: ("study", session_files),
        "opened_key": lambda _study: session_files.key,
        "open_events": lambda lines, _key: lines,
        "new_tracker": lambda _task: tracker,
        "_page": lambda *_arguments: page,
    }.items():
        monkeypatch.setattr(watch, name, function)
    monkeypatch.setattr(watch.journal, "read", lambda lines: lines)
    monkeypatch.setattr("study_app.store.recordings.read_samples", samples)
    monkeypatch.setattr("study_app.store.recordings.read_frames", frames)
    return session_files


@pytest.mark.usefixtures("session")
def test_an_interval_is_read_from_its_own_attempt_recording_and_lines() -> None:
    watched = watch.read_watched(Path("ses"), 4, attempt=2, interval=2)
    assert (watched.language, watched.blinded, watched.presented, watched.intervals) == ("nl", False, "comparison", 2)
    assert list(watched.times_s) == [-1.0, 0.0, 1.0, 2.0, 3.0]
    assert (watched.samples["position_m"][:, 0] == 0.022).all()
    assert watched.tracker.fed == [10_000_000_000, 11_000_000_000, 12_000_000_000], "of the task alone: 2 s"  # type: ignore[attr-defined]
    assert [(mark.at_s, mark.text) for mark in watched.marks] == [
        (0.5, "note: in the second interval"), (3.0, "task ended: complete"),
    ]  # fmt: skip
    assert watched.painted_s == pytest.approx([0.25, 0.5])
    assert watched.shown_s == pytest.approx([0.125, 0.375])


def test_a_sealed_interval_has_neither_contents_nor_frames_and_missing_frames_are_named(
    session: SimpleNamespace,
) -> None:
    session.has_frames = False
    watched = watch.read_watched(Path("ses"), 4, attempt=2, interval=2)
    assert (watched.lacking, len(watched.painted_s)) == (
        "The frames of the participant's screen are missing: frames.parquet is damaged.", 0,
    )  # fmt: skip
    session.key = None
    watched = watch.read_watched(Path("ses"), 4, attempt=2, interval=1)
    assert (watched.blinded, watched.presented, watched.lacking, len(watched.painted_s)) == (True, "", "", 0)
    assert (watched.samples["position_m"][:, 0] == 0.021).all()
    assert [mark.text for mark in watched.marks] == ["note: in the first interval", "task ended: timeout"]


def test_a_trial_without_a_recording_is_refused_with_the_reason(session: SimpleNamespace) -> None:
    for trial, attempt, interval, reason in (
        (4, 3, 1, "does not contain attempt 3 of trial 4: choose another trial"),
        (4, 2, 3, r"no recording was requested, or the recording was interrupted\): choose another trial"),
        (5, 1, 1, r"trial 5 does not have a recording \(the disk is full\)"),
    ):
        with pytest.raises(StoreError, match=reason):
            watch.read_watched(Path("ses"), trial, attempt=attempt, interval=interval)
    session.key = None
    session.journal = (event_of("session_started", device="scripted", language="nl"), *LINES[1:])
    with pytest.raises(StoreError, match="Hidden while the study is blinded"):
        watch.read_watched(Path("ses"), 4, attempt=2, interval=1)


@pytest.mark.parametrize(
    ("study", "block", "interval", "label", "of_scene"),
    [("demo", "delays", None, "Delay setting 2", 10.0), ("viscosityjnd", "viscosity", 2, "Pair 2", 3.0)],
)
def test_the_tank_of_a_recorded_trial_is_that_of_its_block_with_the_ball_of_the_scene(
    tmp_path: Path, study: str, block: str, interval: int | None, label: str, of_scene: float
) -> None:
    """The scene is of_scene times as large as the tank; its ball has a diameter of 68 mm."""
    protocol = load(study)
    with studies.begun(tmp_path / study, "P001", study) as store:
        start_line: Any = event_of(
            "trial_started", trial=7, attempt=3, block=block, phase="main", part=1, index=2, of=5, code="V2"
        )
        lines = [store.lines[0], event_of("language_chosen", language="nl"), start_line]
        page = watch._page(store.place.study_folder, store.folder.receipt, lines, start_line, interval)
        assert page.task == protocol.tasks[protocol.blocks[block].task]
        assert (page.trial, page.workspace_m) == (7, (0.1, 0.06, 0.06))
        assert page.body_radius_m == pytest.approx(0.034 / of_scene)
        assert page.interval == (None if interval is None else Interval(2, 2, resting=False, announced=""))
        assert page.progress == Progress(part=1, parts=2 if study == "demo" else 1, label=label, index=2, of=5)
