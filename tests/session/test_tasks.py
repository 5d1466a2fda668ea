"""The tasks in closed form: when a target is entered, left and reached, and what was to be seen at any moment."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.protocol.model import Reach
from study_app.protocol.trials.tasks import Explore, Follow
from study_app.session.tasks import TargetReached, TaskView, Tracker, track
from tests.session.small import samples

LEFT, RIGHT, AWAY = (-0.02, 0.0, 0.0), (0.02, 0.0, 0.0), (0.0, 0.01, 0.0)


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


def feed(tracker: Tracker, *visits: tuple[float, float, Any]) -> list[TargetReached]:
    """Feed 1 kHz samples: at a place from one time [s] until just before another."""
    found = []
    for begin, end, place in visits:
        times = np.arange(round(begin * 1000), round(end * 1000)) / 1000
        found += tracker.feed(samples(times, np.tile(place, (len(times), 1))))
    return found


def ns(seconds: float) -> int:
    return round(seconds * 1e9)


def test_a_target_is_reached_by_the_first_sample_that_completes_the_dwell() -> None:
    tracker = track(reach())
    assert feed(tracker, (5.0, 5.2, AWAY), (5.2, 5.3, LEFT)) == []
    assert feed(tracker, (5.3, 5.301, LEFT)) == [TargetReached(0, pytest.approx(0.3))]


def test_the_border_of_a_target_belongs_to_it_and_what_lies_beyond_does_not() -> None:
    inside, outside = (-0.02, 0.0, 0.005), (-0.02, 0.0, np.nextafter(0.005, 1))
    assert len(feed(track(reach()), (0, 0.2, inside))) == 1
    assert feed(track(reach()), (0, 0.2, outside)) == []


def test_a_radius_is_measured_in_all_three_directions() -> None:
    assert feed(track(reach()), (0, 0.2, (-0.02, 0.004, 0.004))) == []
    assert len(feed(track(reach()), (0, 0.2, (-0.02, 0.003, 0.003)))) == 1


def test_the_count_completes_the_task_at_that_very_sample() -> None:
    tracker = track(reach(count=1))
    feed(tracker, (0, 3, LEFT))
    assert (tracker.outcome, tracker.end_ns) == ("complete", ns(0.1))
    assert tracker.summary() == {"duration_s": pytest.approx(0.1), "targets_reached": 1, "targets": 1}


def test_samples_after_the_end_change_nothing() -> None:
    tracker = track(reach(count=1))
    feed(tracker, (0, 0.5, LEFT))
    before = tracker.summary()
    assert feed(tracker, (0.5, 2, RIGHT)) == []
    assert tracker.summary() == before


def test_a_task_of_a_given_length_is_complete_when_that_has_passed() -> None:
    tracker = track(reach(count=None, duration_s=2))
    feed(tracker, (1, 3, AWAY))
    assert not tracker.done
    feed(tracker, (3, 3.001, AWAY))
    assert (tracker.outcome, tracker.end_ns) == ("complete", ns(3))
    assert tracker.summary()["targets"] is None


def test_a_task_that_runs_out_of_time_says_so() -> None:
    tracker = track(reach(timeout_s=2))
    feed(tracker, (0, 5, AWAY))
    assert (tracker.outcome, tracker.end_ns) == ("timeout", ns(2))


def test_a_position_that_is_no_number_is_outside() -> None:
    tracker = track(reach())
    feed(tracker, (0, 0.09, LEFT), (0.09, 0.091, (np.nan, 0, 0)), (0.091, 0.15, LEFT))
    assert tracker.now().reached == 0


def test_before_its_first_sample_a_task_looks_like_its_beginning() -> None:
    tracker = track(reach())
    assert tracker.at(ns(99)) == TaskView(lit=0, reached=0, of=3, dwell=0.0, elapsed_s=0.0)
    feed(tracker, (5, 6, LEFT))
    assert tracker.at(ns(4.9)) == TaskView(lit=0, reached=0, of=3, dwell=0.0, elapsed_s=0.0)


def test_the_past_can_be_drawn_as_it_was() -> None:
    tracker = track(reach())
    feed(tracker, (1, 1.05, AWAY), (1.05, 1.11, LEFT), (1.11, 1.2, AWAY), (1.2, 1.5, LEFT))
    assert tracker.at(ns(1.049)).dwell == 0.0
    assert tracker.at(ns(1.08)).dwell == pytest.approx(0.3)
    assert tracker.at(ns(1.15)) == TaskView(lit=0, reached=0, of=3, dwell=0.0, elapsed_s=pytest.approx(0.15))
    assert tracker.at(ns(1.2999)).lit == 0
    assert tracker.at(ns(1.3)) == TaskView(lit=1, reached=1, of=3, dwell=0.0, elapsed_s=pytest.approx(0.3))


def test_what_has_not_been_sampled_yet_is_not_drawn() -> None:
    tracker = track(reach())
    feed(tracker, (0, 0.051, LEFT))
    assert tracker.at(ns(5)) == tracker.at(ns(0.05))
    assert tracker.at(ns(5)).dwell == pytest.approx(0.5)


def test_when_all_targets_are_reached_none_is_lit() -> None:
    tracker = track(reach(count=1))
    feed(tracker, (0, 0.2, LEFT))
    assert tracker.now() == TaskView(lit=None, reached=1, of=1, dwell=0.0, elapsed_s=pytest.approx(0.1))


def test_an_exploration_ends_at_its_longest_time() -> None:
    tracker = track(explore())
    feed(tracker, (2, 5, AWAY))
    assert not tracker.done
    feed(tracker, (5, 5.1, AWAY))
    assert (tracker.outcome, tracker.end_ns) == ("complete", ns(5))
    assert tracker.summary() == {"duration_s": 3.0, "targets_reached": None, "targets": None}


def test_an_exploration_can_be_left_from_its_least_time_on() -> None:
    tracker = track(explore())
    assert not tracker.leave()
    feed(tracker, (0, 1.0, AWAY))  # the newest sample is of 0.999 s
    assert not tracker.leave()
    feed(tracker, (1.0, 1.001, AWAY))
    assert tracker.leave()
    assert tracker.outcome == "complete"
    assert not tracker.leave()


def test_a_reaching_task_cannot_be_left() -> None:
    tracker = track(reach())
    feed(tracker, (0, 5, AWAY))
    assert not tracker.leave()
    assert not tracker.done


def test_no_samples_are_no_news() -> None:
    tracker = track(reach())
    assert tracker.feed(samples([], np.zeros((0, 3)))) == []
    assert tracker.summary()["duration_s"] == 0.0


def slowly(task: Reach, rows: Any) -> tuple[list[tuple[int, int]], Any]:
    """Follow a reaching task sample by sample, in plain Python."""
    start, reached, entered, found = int(rows.time_ns[0]), 0, None, []
    for row in rows:
        time = int(row.time_ns)
        if reached == task.count:
            break
        target = task.targets_m[reached % len(task.targets_m)]
        inside = sum((a - b) ** 2 for a, b in zip(row.position_m.tolist(), target, strict=True)) <= task.radius_m**2
        entered = (time if entered is None else entered) if inside else None
        if entered is not None and time - entered >= round(task.dwell_s * 1e9):
            found.append((reached % len(task.targets_m), time))
            reached, entered = reached + 1, None
        if reached != task.count and time - start >= round(task.timeout_s * 1e9):
            break
    return found, start


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
    tracker, found, first = track(task), [], 0
    for cut in [*cuts, len(rows)]:
        found += tracker.feed(rows[first : first + cut])
        first += cut
    expected, start = slowly(task, rows)
    assert [(reached.target, round(reached.t_task_s * 1e9)) for reached in found] == [
        (target, time - start) for target, time in expected
    ]


def test_a_moving_target_is_where_it_was_at_the_time_that_is_drawn() -> None:
    task = Follow(kind="follow", amplitude_mm=20, frequency_hz=1, cycles=2)
    tracker = track(task)
    assert tracker.at(0) == TaskView(0, 0, None, 0.0, 0.0, (0.0, 0.0, 0.0))
    assert feed(tracker, (5.0, 7.3, AWAY)) == []
    for elapsed_s in (0.0, 0.4, 1.25, 2.0):
        seen = tracker.at(ns(5 + elapsed_s))
        assert (seen.lit, seen.elapsed_s) == (0, elapsed_s)
        assert seen.target_m == pytest.approx(task.target_m(elapsed_s))
    assert tracker.at(ns(9)) == tracker.now()  # as far as it is known
    assert not tracker.leave()


def test_time_alone_ends_a_moving_target() -> None:
    tracker = track(Follow(kind="follow", frequency_hz=2, cycles=3, lead_s=0.5))
    feed(tracker, (1.0, 3.0, AWAY))
    assert not tracker.done
    feed(tracker, (3.0, 3.001, AWAY))
    assert (tracker.outcome, tracker.end_ns) == ("complete", ns(3.0))
    assert tracker.summary() == {"duration_s": 2.0, "targets_reached": None, "targets": None}
