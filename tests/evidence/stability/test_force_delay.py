"""A delayed force: its lateness, its limits, and the table of the proportion that is sent."""

import itertools

import numpy as np
import pytest

from study_app.evidence.stability.bench import Bench
from study_app.evidence.stability.case_groups import evenly_chosen
from study_app.evidence.stability.force_delay import LIQUIDS, delayed_trace, measure_force_delays
from study_app.evidence.stability.stability_cases import Case, parse_case
from study_app.haptics.model.force_rules import CURRENT
from study_app.protocol.warnings.delayed_force import stored_table
from tests.haptics.scenes import COMPILED

compiled = pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")


def imposed_trace(case, *, safe=True, rules=CURRENT):
    """Return the trace of a position that is imposed: circles of 20 mm at 0.1 m/s, begun within 0.2 s."""
    t_s = np.arange(1500) / 1000
    angle = 5 * (t_s + 0.2 * np.expm1(-t_s / 0.2))
    path_m = 0.02 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    return Bench(case, safe=safe, rules=rules).follow(path_m, rigid=True)


@compiled
@pytest.mark.slow
@pytest.mark.parametrize("delay", [1, 7, 20])
@pytest.mark.parametrize(
    ("liquid", "scale"), [("water", 1.0), ("physical2_honey", 1.0), ("physical_tar", 1.0), ("slime_cornstarch", 3.0)]
)
@pytest.mark.parametrize("more", [{}, {"lost": 0.1}, {"estimator": "kalman"}])
def test_the_force_of_the_effects_comes_so_late(delay, liquid, scale, more):
    """Tar and cornstarch are beyond the limit of the slope, with "kalman" honey's inertia is: both act before.

    The known force is not used with a delayed force, so the other loop does not use it either.
    """
    case = Case(liquid=liquid, scale=scale, quantum_um=1.0, delay=0, **more)
    prompt = imposed_trace(case, rules=CURRENT._replace(known_force_ticks=99))
    late = imposed_trace(parse_case(f"{case} force_delay_ms={delay}"))
    assert late.withheld_n.max() < 1e-3  # the controller has nothing to do: another force would not be the prompt one
    shifted_n = np.zeros_like(prompt.sent_n)
    shifted_n[delay:] = prompt.sent_n[:-delay]
    assert np.abs(prompt.sent_n).max() > 0.01
    within = 0.01 if "estimator" in more else 1e-9  # the filter knows the force sent
    assert late.sent_n[300:] == pytest.approx(shifted_n[300:], abs=within)  # the fade-in is over


@compiled
@pytest.mark.slow
def test_the_force_comes_so_late_without_safety_too():
    case = Case(liquid="physical_tar", scale=1.0, quantum_um=1.0, delay=0)
    prompt, late = (imposed_trace(it, safe=False).sent_n for it in (case, parse_case(f"{case} force_delay_ms=7")))
    assert np.abs(prompt).max() > 1
    assert late[7:] == pytest.approx(prompt[:-7], abs=1e-9)


@compiled
@pytest.mark.slow
def test_a_delayed_force_gives_energy_that_the_controller_withholds():
    """A damper that is late by T acts as a mass of -B T; the remaining energy stays bounded."""
    case = Case(liquid="light_oil", scale=10.0, hand="light", force_delay_ms=100.0)
    trace = delayed_trace(case)
    assert np.linalg.norm(trace.sent_n, axis=1).max() <= 8.0 * (1 + 1e-9)
    assert np.abs(trace.velocity_mps).max() < 1.0
    (entry,) = measure_force_delays(["light_oil"], ["ewma"], ["light"], [100])
    assert 0 < entry.left_percent < 30
    assert entry.withheld_percent > 70


@compiled
@pytest.mark.slow
def test_the_shipped_table_is_the_one_that_is_measured():
    rows = evenly_chosen(stored_table(), 40)
    for row in rows:
        (measured,) = measure_force_delays([row.liquid], [row.estimator], [row.hand], [row.delay_ms])
        within = 0.3 if row.withheld_percent == 0 else 15.0  # micrometres decide whether a loop oscillates
        assert measured.left_percent == pytest.approx(row.left_percent, abs=within), row
        assert measured.withheld_percent == pytest.approx(row.withheld_percent, abs=within), row
    assert sum(row.withheld_percent > 5 for row in rows) > 5


def test_the_shipped_table_has_each_liquid_estimator_hand_and_delay():
    keys = [(row.liquid, row.estimator, row.hand, row.delay_ms) for row in stored_table()]
    delays_ms = (0, 1, 2, 5, 10, 20, 50, 100, 200)
    assert keys == list(itertools.product(LIQUIDS, ("ewma", "kalman"), ("light", "middle", "firm"), delays_ms))
