"""The tasks in closed form: when a target is entered, left and reached, and what was to be seen at any moment."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.protocol.model import Reach
from study_app.protocol.trials.tasks import Explore, Follow
from study_app.session.tasks import TaskView, Tracker, new_tracker
from tests.golden import compare
from tests.session.small import samples
from tests.transcripts import acts, played, value_of

LEFT, RIGHT, AWAY = (-0.02, 0.0, 0.0), (0.02, 0.0, 0.0), (0.0, 0.01, 0.0)
BORDER, BEYOND, NOWHERE = (-0.02, 0.0, 0.005), (-0.02, 0.0, np.nextafter(0.005, 1)), (np.nan, 0.0, 0.0)


def reach(**changes: Any) -> Reach:
    keys = {
        "kind": "reach",
        "targets_mm": [[-20, 0, 0], [20, 0, 0]],
        "radius_mm": 5,
        "dwell_s": 0.1,
        "count": 3,
        "timeout_s": 10,
        "instruction": "Reach.",
    }
    return Reach.model_validate(keys | changes)


def explore(min_s: float = 1.0, max_s: float = 3.0) -> Explore:
    return Explore.model_validate({"kind": "explore", "min_s": min_s, "max_s": max_s, "instruction": "Explore."})


class Played:
    """A tracked task with a command for each event."""

    def __init__(self, task: Any) -> None:
        self.tracker = new_tracker(task)

    def stay(self, begin: float, end: float, place: Any) -> Iterator[str]:
        """Feed 1 kHz samples at a position from one time [s] until just before another."""
        times = np.arange(round(begin * 1000), round(end * 1000)) / 1000
        reaches = self.tracker.feed(samples(times, np.tile(place, (len(times), 1))))
        yield from (f"reached {reach.target} after {reach.t_task_s:g} s" for reach in reaches)
        if self.tracker.done:
            yield f"{self.tracker.outcome} at {self.tracker.end_ns / 1e9:g} s: {self.tracker.summary()}"

    def seen(self, at_s: float) -> Iterator[str]:
        """Yield the view of the task at a time."""
        view = self.tracker.at(round(at_s * 1e9))
        target = (
            ""
            if view.target_m is None
            else f", target at {[round(1000 * coordinate_m, 3) for coordinate_m in view.target_m]} mm"
        )
        yield f"lit {view.lit}, {view.reached} of {view.of}, dwell {view.dwell:.4g}, {view.elapsed_s:.4g} s{target}"

    def leave(self) -> Iterator[str]:
        yield f"left: {self.tracker.leave()}, {self.tracker.outcome}"


def begun(start: str) -> Played:
    return Played(value_of(start, {"reach": reach, "explore": explore, "follow": partial(Follow, kind="follow")}))


PLACES = {"LEFT": LEFT, "RIGHT": RIGHT, "AWAY": AWAY, "BORDER": BORDER, "BEYOND": BEYOND, "NOWHERE": NOWHERE}


def test_events_of_each_task_are_as_recorded(pytestconfig: pytest.Config) -> None:
    file = Path(__file__).parent / "golden" / "tasks.txt"
    compare(file, played(file, acts(begun, PLACES)), pytestconfig)


def stay(tracker: Tracker, begin_s: float, end_s: float, place: Any) -> list[tuple[int, float]]:
    """Feed 1 kHz samples at a position; return the reached targets and their times."""
    times = np.arange(round(begin_s * 1000), round(end_s * 1000)) / 1000
    reached = tracker.feed(samples(times, np.tile(place, (len(times), 1))))
    return [(target.target, round(target.t_task_s, 9)) for target in reached]


def test_targets_light_up_in_turn_and_each_moment_is_drawn_as_it_was() -> None:
    """Two targets, 0.1 s in each, three times; the first target is left too early once."""
    tracker = new_tracker(reach())
    assert (tracker.at(5_000_000_000).elapsed_s, tracker.now().lit, tracker.done) == (0.0, 0, False)
    assert tracker.summary() == {"duration_s": 0.0, "targets_reached": 0, "targets": 3}
    for begin_s, end_s, place, reached in (
        (5.0, 5.2, AWAY, []), (5.2, 5.25, LEFT, []), (5.25, 5.3, BEYOND, []), (5.3, 5.45, BORDER, [(0, 0.4)]),
        (5.45, 5.5, RIGHT, []), (5.5, 5.6, LEFT, []), (5.6, 5.8, RIGHT, [(1, 0.7)]),
    ):  # fmt: skip
        assert stay(tracker, begin_s, end_s, place) == reached
    assert tracker.summary() == {"duration_s": 0.799, "targets_reached": 2, "targets": 3}
    views = ((at_s, tracker.at(round(at_s * 1e9))) for at_s in (4.0, 5.225, 5.27, 5.375, 5.4, 5.475, 5.55, 5.65, 9.0))
    assert [(at_s, view.lit, view.reached, round(view.dwell, 9), view.elapsed_s) for at_s, view in views] == [
        (4.0, 0, 0, 0.0, 0.0), (5.225, 0, 0, 0.25, 0.225), (5.27, 0, 0, 0.0, 0.27), (5.375, 0, 0, 0.75, 0.375),
        (5.4, 1, 1, 0.0, 0.4), (5.475, 1, 1, 0.25, 0.475), (5.55, 1, 1, 0.0, 0.55), (5.65, 1, 1, 0.5, 0.65),
        (9.0, 0, 2, 0.0, 0.799),
    ]  # fmt: skip
    assert tracker.now() == tracker.at(9_000_000_000)
    assert (tracker.leave(), tracker.outcome, tracker.end_ns) == (False, None, None)
    assert stay(tracker, 5.8, 6.0, LEFT) == [(0, 0.9)]
    assert stay(tracker, 6.0, 6.2, RIGHT) == []
    assert (tracker.done, tracker.outcome, tracker.end_ns) == (True, "complete", 5_900_000_000)
    assert tracker.summary() == {"duration_s": 0.9, "targets_reached": 3, "targets": 3}
    assert tracker.now() == TaskView(lit=None, reached=3, of=3, dwell=0.0, elapsed_s=0.9)


def test_the_radius_is_measured_in_all_directions_and_a_zero_dwell_draws_no_ring() -> None:
    tracker = new_tracker(reach(dwell_s=0.0, count=None, duration_s=1.0))
    assert stay(tracker, 2.0, 2.1, (-0.02, 0.004, 0.0031)) == []
    assert stay(tracker, 2.1, 2.2, (-0.02, 0.0, -0.0051)) == stay(tracker, 2.2, 2.3, NOWHERE) == []
    assert stay(tracker, 2.3, 2.4, (-0.02, 0.004, 0.003)) == [(0, 0.3)]
    assert tracker.at(2_350_000_000) == TaskView(lit=1, reached=1, of=None, dwell=0.0, elapsed_s=0.35)


@pytest.mark.parametrize(
    ("task", "asks", "leaves", "outcome", "end_s"),
    [
        (explore(1.0, 3.0), 0.999, False, "complete", 3.0),
        (explore(1.0, 3.0), 1.0, True, "complete", 1.0),
        (explore(0.0, 3.0), 0.002, True, "complete", 0.002),
        (reach(count=2, timeout_s=2), 1.5, False, "timeout", 2.0),
        (reach(count=None, duration_s=2), 1.5, False, "complete", 2.0),
        (Follow(kind="follow", lead_s=0.5, frequency_hz=2, cycles=3), 1.5, False, "complete", 2.0),
    ],
)
def test_a_task_ends_at_its_limit_or_earlier_if_the_participant_may_leave(
    task: Any, asks: float, leaves: bool, outcome: str, end_s: float
) -> None:
    """Samples come every millisecond from 7 s on."""
    tracker = new_tracker(task)
    assert not tracker.leave(), "it has not begun"
    stay(tracker, 7.0, 7.001 + asks, AWAY)
    assert (tracker.leave(), tracker.done) == (leaves, leaves)
    for begin_s, last_s in ((7.001 + asks, 6.999 + end_s), (6.999 + end_s, 7.0 + end_s)):
        stay(tracker, begin_s, last_s, AWAY)
        assert tracker.done == leaves
    stay(tracker, 7.0 + end_s, 12.0, AWAY)
    assert (tracker.outcome, tracker.end_ns, tracker.leave()) == (outcome, round((7 + end_s) * 1e9), False)
    assert tracker.summary()["duration_s"] == tracker.now().elapsed_s == tracker.at(20_000_000_000).elapsed_s == end_s
    assert tracker.summary()["targets_reached"] == (0 if isinstance(task, Reach) else None)


def test_a_moving_target_is_drawn_where_it_was() -> None:
    """20 mm at a quarter of a hertz: 3 s after the begin three quarters of a period have passed."""
    tracker = new_tracker(Follow(kind="follow", lead_s=1, frequency_hz=0.25, amplitude_mm=20))
    stay(tracker, 7.0, 11.0, AWAY)
    view = tracker.at(10_000_000_000)
    assert (view.lit, view.reached, view.of, view.dwell, view.elapsed_s) == (0, 0, None, 0.0, 3.0)
    assert view.target_m == pytest.approx((-0.02, 0.0, 0.0))
    assert new_tracker(explore()).at(0) == TaskView(lit=None, reached=0, of=None, dwell=0.0, elapsed_s=0.0)


def slowly(task: Reach, rows: Any) -> tuple[list[tuple[int, int]], tuple[str | None, int | None]]:
    """Return the reached targets with their times, and the end of the task, computed sample by sample."""
    start, reached, entered, reaches = int(rows.time_ns[0]), 0, None, []
    for row in rows:
        time = int(row.time_ns)
        target = task.targets_m[reached % len(task.targets_m)]
        inside = sum((a - b) ** 2 for a, b in zip(row.position_m.tolist(), target, strict=True)) <= task.radius_m**2
        entered = (time if entered is None else entered) if inside else None
        if entered is not None and time - entered >= round(task.dwell_s * 1e9):
            reaches.append((reached % len(task.targets_m), time - start))
            reached, entered = reached + 1, None
        if reached == task.count:
            return reaches, ("complete", time)
        if time - start >= round(task.timeout_s * 1e9):
            return reaches, ("timeout", time)
    return reaches, (None, None)


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(
    st.lists(st.tuples(st.integers(1, 40), st.sampled_from([LEFT, RIGHT, AWAY])), min_size=1, max_size=40),
    st.sampled_from([0.0, 0.001, 0.013, 0.02]),
    st.sampled_from([1, 2, 5, 14]),
    st.lists(st.integers(1, 60), max_size=30),
)
def test_however_the_samples_are_cut_the_result_is_that_of_one_at_a_time(
    visits: list[tuple[int, Any]], dwell_s: float, count: int, cuts: list[int]
) -> None:
    task = reach(dwell_s=dwell_s, count=count, timeout_s=0.3)
    places = [place for length, place in visits for _ in range(length)]
    rows = samples(np.arange(len(places)) / 1000 + 7, places)
    tracker, reaches, first = new_tracker(task), [], 0
    for cut in [*cuts, len(rows)]:
        reaches += tracker.feed(rows[first : first + cut])
        first += cut
    came = [(reached.target, round(reached.t_task_s * 1e9)) for reached in reaches]
    assert (came, (tracker.outcome, tracker.end_ns)) == slowly(task, rows)
