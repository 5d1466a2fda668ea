"""The audit of a soak: every broken promise is counted, and good samples break none."""

import math

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("the servo exists compiled only", allow_module_level=True)

from study_app.haptics.model.layout import LIMITER_ENERGY, LIMITER_STOP, SAMPLE, STATUS_DEVICE_LOST, records
from study_app.validation.soak.sample_audit import Audit

PERIOD_NS = 1_000_000


def samples(count=10):
    """Return good samples: a steady force, tick after tick."""
    made = records(SAMPLE, count)
    made.tick = np.arange(count)
    made.time_ns = np.arange(count) * PERIOD_NS + 100
    made.lateness_ns = 100
    made.device_force_n = (3.0, 0.0, 4.0)
    made.fresh = 1
    return made


def audited(made):
    audit = Audit(8.0, 1.5, PERIOD_NS, 0.05)
    audit.take(made[: len(made) // 2])
    audit.take(made[len(made) // 2 :])
    return audit.counts


BROKEN = ("excess", "no_number", "steps", "unstopped", "believed", "drift_ns", "missing", "overruns")


def broken(counts):
    return {name: int(counts[name]) for name in BROKEN if counts[name]}


def test_good_samples_break_no_promise():
    counts = audited(samples())
    assert broken(counts) == {}
    assert (counts.samples, counts.most_n, counts.first_tick) == (10, 5.0, -1)


@pytest.mark.parametrize(
    ("field", "value", "promise"),
    [
        ("device_force_n", (3.0, 1.51, 4.0), {"steps": 2}),
        ("device_force_n", (3.0, 1.5, 4.0), {}),
        ("device_force_n", (8.01, 0.0, 4.0), {"excess": 1, "steps": 2}),
        ("device_force_n", (3.0, math.nan, 4.0), {"no_number": 1}),
        ("device_force_n", (math.inf, 0.0, 0.0), {"no_number": 1, "steps": 1}),
        ("position_m", (0.0, math.nan, 0.0), {"believed": 1}),
        ("position_m", (-math.inf, 0.0, 0.0), {"believed": 1}),
        ("limiters", LIMITER_STOP, {"unstopped": 1}),
        ("lateness_ns", 99, {"drift_ns": 1}),
        ("busy_ns", 3_500_000, {"overruns": 2, "drift_ns": 2_000_000}),
    ],
)
def test_a_broken_promise_is_counted(field, value, promise):
    made = samples()
    made[field][7] = value
    assert broken(audited(made)) == promise


def test_the_energy_account_and_stops_may_let_go_at_once():
    for limiters in (LIMITER_ENERGY, LIMITER_STOP):
        made = samples()
        made.device_force_n[7:] = 0.0
        made.limiters[7] = limiters
        counts = audited(made)
        assert broken(counts) == {}
        assert max(counts.let_go_n, counts.paid_n) == 5.0


def test_a_lost_device_begins_another_run():
    made = samples()
    made.status[6] = STATUS_DEVICE_LOST
    made.fresh[6] = 0
    made.time_ns[7:] += 123_456
    made.device_force_n[7:] = (0.0, 0.1, 0.0)
    counts = audited(made)
    assert broken(counts) == {}
    assert (counts.lost, counts.silent) == (1, 0)
