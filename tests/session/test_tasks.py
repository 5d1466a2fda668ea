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
from study_app.session.tasks import new_tracker
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
    """A task that is followed, and a command for whatever happens to it."""

    def __init__(self, task: Any) -> None:
        self.tracker = new_tracker(task)

    def stay(self, begin: float, end: float, place: Any) -> Iterator[str]:
        """Let samples of 1 kHz come, at a place from one time [s] until just before another."""
        times = np.arange(round(begin * 1000), round(end * 1000)) / 1000
        found = self.tracker.feed(samples(times, np.tile(place, (len(times), 1))))
        yield from (f"reached {one.target} after {one.t_task_s:g} s" for one in found)
        if self.tracker.done:
            yield f"{self.tracker.outcome} at {self.tracker.end_ns / 1e9:g} s: {self.tracker.summary()}"

    def seen(self, at_s: float) -> Iterator[str]:
        """Tell what was to be seen at a time."""
        view = self.tracker.at(round(at_s * 1e9))
        target = "" if view.target_m is None else f", target at {[round(1000 * each, 3) for each in view.target_m]} mm"
        yield f"lit {view.lit}, {view.reached} of {view.of}, dwell {view.dwell:.4g}, {view.elapsed_s:.4g} s{target}"

    def leave(self) -> Iterator[str]:
        yield f"left: {self.tracker.leave()}, {self.tracker.outcome}"


def begun(start: str) -> Played:
    return Played(value_of(start, {"reach": reach, "explore": explore, "follow": partial(Follow, kind="follow")}))


PLACES = {"LEFT": LEFT, "RIGHT": RIGHT, "AWAY": AWAY, "BORDER": BORDER, "BEYOND": BEYOND, "NOWHERE": NOWHERE}


def test_what_happens_in_a_task(pytestconfig: pytest.Config) -> None:
    file = Path(__file__).parent / "golden" / "tasks.txt"
    compare(file, played(file, acts(begun, PLACES)), pytestconfig)


def slowly(task: Reach, rows: Any) -> tuple[list[tuple[int, int]], tuple[str | None, int | None]]:
    """Return what is reached and when, and how and when the task ends, sample by sample in plain Python."""
    start, reached, entered, found = int(rows.time_ns[0]), 0, None, []
    for row in rows:
        time = int(row.time_ns)
        target = task.targets_m[reached % len(task.targets_m)]
        inside = sum((a - b) ** 2 for a, b in zip(row.position_m.tolist(), target, strict=True)) <= task.radius_m**2
        entered = (time if entered is None else entered) if inside else None
        if entered is not None and time - entered >= round(task.dwell_s * 1e9):
            found.append((reached % len(task.targets_m), time - start))
            reached, entered = reached + 1, None
        if reached == task.count:
            return found, ("complete", time)
        if time - start >= round(task.timeout_s * 1e9):
            return found, ("timeout", time)
    return found, (None, None)


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
    tracker, found, first = new_tracker(task), [], 0
    for cut in [*cuts, len(rows)]:
        found += tracker.feed(rows[first : first + cut])
        first += cut
    came = [(reached.target, round(reached.t_task_s * 1e9)) for reached in found]
    assert (came, (tracker.outcome, tracker.end_ns)) == slowly(task, rows)
