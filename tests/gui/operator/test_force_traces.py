"""What the operator of a single-blind study sees of force, wake and limiters."""

from typing import Any

import numpy as np
import pytest

from study_app.gui.operator.servo_health import ROWS, STEP_NS, TRACE_WINDOW_S, Forces
from study_app.haptics.model.layout import (
    LIMITER_FADE,
    LIMITER_NORM,
    LIMITER_SLEW,
    LIMITER_SLOPE,
    LIMITER_STOP,
    SAMPLE,
    records,
)

MS = 1_000_000


def samples(count: int, *, first: int = 0, scene: int = 1, force_n: Any = (0.0, 0.0, 0.0), limiters: int = 0) -> Any:
    made = records(SAMPLE, count)
    made.tick = np.arange(first, first + count)
    made.time_ns = made.tick * MS
    made.scene = scene
    made.device_force_n = force_n
    made.limiters = limiters
    return made


@pytest.mark.slow
def test_a_peak_of_one_tick_is_not_missed_however_it_came_in() -> None:
    pushed = samples(4000, force_n=(0.1, 0.0, 0.0))
    pushed.device_force_n[1234] = (0.0, -7.5, 0.0)
    traces = []
    for batch in (4000, 17, 16, 1):
        forces = Forces(8.0)
        for first in range(0, 4000, batch):
            forces.take(pushed[first : first + batch])
        traces.append(forces.trace(4000 * MS))
    for times_s, forces_n, _ in traces:
        assert forces_n[:, 3].max() == 7.5
        at = int(forces_n[:, 3].argmax())
        assert forces_n[at].tolist() == [0.0, -7.5, 0.0, 7.5]
        assert times_s[at] == pytest.approx(-(4000 - 1234) / 1000, abs=STEP_NS * 1e-9)
    for other in traces[1:]:
        for one, another in zip(traces[0], other, strict=True):
            np.testing.assert_array_equal(one, another)


def test_the_trace_is_in_order_and_no_longer_than_its_window() -> None:
    forces = Forces(8.0)
    for first in range(0, 31_000, 613):
        forces.take(samples(613, first=first))
    times_s, forces_n, wakes_mps = forces.trace(31_263 * MS)
    assert len(times_s) == len(forces_n) == len(wakes_mps) <= ROWS
    assert np.all(np.diff(times_s) > 0)
    assert -TRACE_WINDOW_S <= times_s[0] < -TRACE_WINDOW_S + 0.1


def test_the_speed_of_the_wake_is_of_the_same_ticks() -> None:
    moved = samples(100)
    moved.wake_mps = (0.3, 0.0, -0.4)
    forces = Forces(8.0)
    forces.take(moved)
    assert forces.trace(100 * MS)[2] == pytest.approx(0.5)


def test_shares_are_of_the_limit_now_and_at_most_in_this_trial() -> None:
    forces = Forces(6.0)
    forces.take(samples(100, force_n=(0.0, 4.5, 0.0)))
    forces.take(samples(100, first=100, force_n=(1.5, 0.0, 0.0)))
    assert (forces.figures().share, forces.figures().most) == (0.25, 0.75)
    forces.take(samples(100, first=200, scene=0))
    assert (forces.figures().share, forces.figures().most) == (0.0, 0.75)
    forces.take(samples(100, first=300, scene=2, force_n=(0.6, 0.0, 0.0)))
    assert forces.figures().most == pytest.approx(0.1)


def test_limiters_are_counted_by_tick_in_this_trial_and_those_that_say_nothing_are_not() -> None:
    forces = Forces(8.0)
    forces.take(samples(500, limiters=LIMITER_FADE))
    assert forces.figures().limiters == ()
    forces.take(samples(30, first=500, limiters=LIMITER_SLOPE | LIMITER_SLEW))
    forces.take(samples(5, first=530, limiters=LIMITER_NORM | LIMITER_STOP))
    assert dict(forces.figures().limiters) == {"slope": 30, "force": 5, "slew": 30}
    mixed = samples(20, first=535, limiters=LIMITER_NORM)
    mixed.scene[12:] = 2
    forces.take(mixed)
    assert forces.figures().limiters == (("force", 8),)
