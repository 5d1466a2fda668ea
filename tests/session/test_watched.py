"""A recorded trial at any moment, from four samples and a few lines of a journal."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from study_app.haptics.model.layout import LIMITER_GLITCH
from study_app.session import watch
from study_app.session.watch import Mark, Watched
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
    begun, *lines = (
        event_of("trial_started", n=3, t_s=100.0, **which),
        event_of("note", n=2, t_s=100.5, kind="note", text="before"),
        event_of("paused", n=4, t_s=101.0, by="operator"),
        event_of("target_reached", n=5, t_s=102.0, trial=4, target=2, t_task_s=1.7),
        event_of("choice", n=6, t_s=103.0, trial=4, item="thick", value=5),
        event_of("interval_ended", n=7, t_s=103.5, interval=1, outcome="timeout", **which),
        ended,
        event_of("note", n=9, t_s=110.0, kind="note", text="of the next interval"),
    )
    assert list(watch._marks(lines, begun, ended, 110.0)) == [
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
    started: Any = SimpleNamespace(block="stir", code="L2", arrangement="CS")
    assert [watch._presented_condition(started, number, key) for number in (None, 1, 2)] == [
        "stir L2", "comparison", "standard",
    ]  # fmt: skip
    assert [watch._presented_condition(started, number, None) for number in (None, 1)] == ["", ""]
