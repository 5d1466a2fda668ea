"""Stable, noisy or unstable: signals whose grade follows by hand, and loops that are known to oscillate."""

import numpy as np
import pytest

from study_app.evidence.stability import verdict
from study_app.evidence.stability.bench import Bench
from study_app.evidence.stability.stability_cases import parse_case
from study_app.evidence.stability.verdict import compare_fast, judge, reasons_of, worst_of
from tests.haptics.scenes import COMPILED

T_S = np.arange(1200) / 1000
FIRST = 200
SECONDS = T_S - 0.2
SILENCE = np.zeros((len(T_S), 3))


def sine_force(amplitude_n, hz=100):
    """Return a force [N] along x; above 40 Hz, 100 Hz passes to 99 % and 5 Hz to 2 %."""
    return np.outer(amplitude_n * np.sin(2 * np.pi * hz * T_S), [1, 0, 0])


def burst_force(seconds):
    return sine_force(1.0 * (abs(T_S - 0.7) < seconds / 2))


@pytest.mark.parametrize(
    ("force_n", "reasons"),
    [
        (sine_force(0.1), ("sustained force",)),  # 0.07 N RMS
        (sine_force(0.04 * np.exp(SECONDS)), ("sustained force",)),  # from 0.03 to 0.08 N RMS
        (sine_force(0.6 * np.exp(-2 * SECONDS)), ("noise",)),  # in 0.3 s it falls to 0.55
        (burst_force(0.2), ("noise",)),
        (burst_force(0.09), ()),  # the strongest 0.1 s does not count
        (sine_force(0.06), ()),  # 0.04 N RMS
        (sine_force(2.0, hz=5), ()),
    ],
)
def test_force_above_40_hz_is_graded_by_its_excess(force_n, reasons):
    fast_force = compare_fast(force_n, [SILENCE], 1000.0, FIRST)
    assert reasons_of(limit=False, energy=False, oscillation=False, fast_force=fast_force) == reasons
    as_controlled = compare_fast(force_n, [SILENCE, force_n], 1000.0, FIRST)
    assert reasons_of(limit=False, energy=False, oscillation=False, fast_force=as_controlled) == ()


def test_fast_part_of_a_tone_is_its_rms():
    fast_force = compare_fast(sine_force(0.1), [sine_force(0.03)], 1000.0, FIRST)
    assert fast_force.fast_n == pytest.approx(0.1 / np.sqrt(2), rel=0.02)
    assert fast_force.control_n == pytest.approx(0.03 / np.sqrt(2), rel=0.02)


def test_late_force_may_exceed_its_control_by_a_share():
    force_n, control_n = sine_force(1.15), sine_force(1.0)
    assert compare_fast(force_n, [control_n], 1000.0, FIRST).sustained
    assert not compare_fast(force_n, [control_n], 1000.0, FIRST, late_share=0.2).sustained


def test_sustained_force_counts_in_an_interval_that_is_not_the_worst():
    sustained = compare_fast(sine_force(0.1), [SILENCE], 1000.0, FIRST)
    worst = worst_of([sustained, compare_fast(burst_force(0.2), [SILENCE], 1000.0, FIRST)])
    assert worst.fast_n > sustained.fast_n
    assert worst.sustained


class WithoutObserver(Bench):
    """A loop with the safety layer, but without the passivity observer's balances."""

    def run(self, trace, first, until_s):
        passivity = self.safety[0].passivity
        row, end = first, -1
        while row != end and row < len(trace):
            passivity.balance_j = passivity.late_balance_j = passivity.later_balance_j = np.inf
            passivity.fast.balance_j, passivity.gain = np.inf, 1.0
            end, row = row, super().run(trace[: row + 1], row, until_s)
        return row


@pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")
@pytest.mark.slow
def test_loops_that_oscillate_are_unstable(monkeypatch):
    """A linear loop beyond its boundary, and a delay three ticks longer than believed that nothing observes."""
    case = parse_case("liquid=honey delay=4 believed=1 hand=thrown motion=stroke speed_mps=0.6")
    assert judge(case, safe=True).grade == "stable"
    assert judge(case, safe=False).grade == "unstable"
    monkeypatch.setattr(verdict, "Bench", WithoutObserver)
    assert judge(case, safe=True).reasons == ("energy", "oscillation", "sustained force")
