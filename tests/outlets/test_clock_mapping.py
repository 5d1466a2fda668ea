"""The offset of two clocks lies within the bounds that readings give, and follows a drift."""

import itertools
from collections.abc import Callable

import pytest

from study_app.outlets.clock_mapping import ClockMapping


class Clocks:
    """Two clocks whose readings take time: each call moves both."""

    def __init__(self, offset_s: float, steps_ns: Callable[[], int]) -> None:
        self.ns, self.offset_s, self._steps_ns = 10**9, offset_s, steps_ns

    def now_ns(self) -> int:
        self.ns += self._steps_ns()
        return self.ns

    def other_s(self) -> float:
        self.ns += self._steps_ns()
        return 1e-9 * self.ns + self.offset_s


def test_the_offset_is_within_its_uncertainty_and_better_with_quick_readings() -> None:
    slow = itertools.cycle((9_000, 400_000, 3_000, 70_000, 2_000, 1_000, 150_000))
    clocks = Clocks(1234.5, lambda: next(slow))
    mapping = ClockMapping(clocks.now_ns, clocks.other_s)
    assert mapping.offset_s == pytest.approx(1234.5, abs=mapping.uncertainty_s)
    assert mapping.uncertainty_s < 20e-6


def test_readings_that_take_long_on_one_side_do_not_bias_beyond_the_bound() -> None:
    turns = itertools.cycle((1_000, 1_000, 5_000_000))  # the other clock is read 1 µs after ours, ours 5 ms after it
    clocks = Clocks(0.0, lambda: next(turns))
    mapping = ClockMapping(clocks.now_ns, clocks.other_s)
    assert abs(mapping.offset_s) <= mapping.uncertainty_s


def test_a_drift_is_followed() -> None:
    clocks = Clocks(2.0, lambda: 1_000)
    mapping = ClockMapping(clocks.now_ns, clocks.other_s)
    clocks.offset_s = 2.001
    mapping.measure()
    assert mapping.offset_s == pytest.approx(2.001, abs=mapping.uncertainty_s)
    assert mapping.uncertainty_s < 2e-6


def test_it_is_measured_again_when_it_is_due(monkeypatch: pytest.MonkeyPatch) -> None:
    clocks = Clocks(2.0, lambda: 1_000)
    mapping = ClockMapping(clocks.now_ns, clocks.other_s)
    clocks.offset_s = 3.0
    mapping.measure_if_due()
    assert mapping.offset_s == pytest.approx(2.0, abs=1e-5)
    monkeypatch.setattr("study_app.outlets.clock_mapping.time.monotonic", lambda: float("inf"))
    mapping.measure_if_due()
    assert mapping.offset_s == pytest.approx(3.0, abs=1e-5)
