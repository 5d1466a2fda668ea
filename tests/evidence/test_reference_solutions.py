"""The truths themselves: closed forms, sums in another precision, and the tables of a fluid solver."""

import math
from fractions import Fraction

import numpy as np
import pytest
from scipy.integrate import quad

from study_app.evidence import reference_solutions
from study_app.evidence.reference_model import respond, wakes
from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.estimators import Given
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Liquid, MotionBox, Scene

HONEY = Liquid(id="honey", density_kg_m3=1420, viscosity_pa_s=10)
BOX = MotionBox(speed_mps=0.6, acceleration_mps2=6)
RADIUS_M = 0.034


def scene(liquid=HONEY, **fields):
    return Scene(**{"liquids": (liquid,), "velocity": Given(), "motion": BOX, **fields})


def test_the_exact_sums_equal_those_of_fractions():
    """A straight motion whose speeds span fifteen decades: one segment, so Σ|e|/S by exact arithmetic."""
    speeds = np.tile([1e6, 1e-2, 3e-3, 1e5 / 3], 60)
    v = np.column_stack([speeds, np.zeros((len(speeds), 2))])
    interval_s = np.full(len(v), 1e-3)
    wake = Wake(length=200, scaling=200, breaking_angle_deg=90, breaking_span_m=0, decay=1)
    exact, size = wakes(v, v * 0, interval_s, wake)
    wanted = float(sum(map(Fraction, speeds[-201:-1].tolist()))) / 200
    assert size[-1] == wanted
    assert exact[-1, 0] == pytest.approx(wanted, rel=3e-16)


def test_the_definition_knows_every_law_of_drag():
    motion = Motion(np.arange(2) / 1000, np.zeros((2, 3)), velocity_mps=np.tile([0.5, 0.0, 0.0], (2, 1)))
    reynolds = 1420 * 0.5 * 0.068 / 10
    stokes_n = 6 * math.pi * 10 * RADIUS_M * 0.5
    for law, over_stokes in (
        ("schiller-naumann", 1 + 0.15 * reynolds**0.687),
        ("haider-levenspiel", 1 + 0.1806 * reynolds**0.6459 + 0.4251 / 24 * reynolds / (1 + 6880.95 / reynolds)),
        ("brown-lawler", 1 + 0.15 * reynolds**0.681 + 0.407 / 24 * reynolds / (1 + 8710 / reynolds)),
    ):
        force_n = respond(scene(HONEY.model_copy(update={"drag": Drag(law=law)})), motion).force_n
        assert force_n[1, 0] == pytest.approx(-stokes_n * over_stokes)


def test_measured_drag_goes_through_the_points_and_is_smooth_between_them():
    per_mps = 1420 * 0.068 / 10
    area_m2 = math.pi * RADIUS_M**2
    for reynolds, coefficient in reference_solutions.DRAG_POINTS:
        v = reynolds / per_mps
        force_n = reference_solutions.measured_drag_n(HONEY, 0.068, np.array([v]))
        assert force_n[0] == pytest.approx(0.5 * 1420 * coefficient * area_m2 * v**2)
    v = np.geomspace(1e-4, 1e5, 20_000)
    steepness = np.diff(np.log(reference_solutions.measured_drag_n(HONEY, 0.068, v))) / np.diff(np.log(v))
    assert steepness.min() > 0.5
    assert steepness.max() < 2.5
    assert steepness[0] == pytest.approx(1)
    assert steepness[-1] == pytest.approx(2)


def test_steady_drag_is_compared_only_where_experiments_are_known():
    truth = reference_solutions.steady_truth(scene())
    speeds = [case.motion.velocity_mps[-1, 0] for case in truth.cases]
    assert max(speeds) == pytest.approx(0.6)
    assert min(speeds) * 1420 * 0.068 / 10 >= 0.1585
    oseen = 24 / 0.1585 * (1 + 3 / 16 * 0.1585)
    assert f"up to {100 * (169.8 / oseen - 1):.0f} % above Oseen's law" in truth.source
    assert (
        "Oseen" not in reference_solutions.steady_truth(scene(HONEY.model_copy(update={"viscosity_pa_s": 0.01}))).source
    )
    slow = scene(HONEY.model_copy(update={"viscosity_pa_s": 1e4}))
    assert reference_solutions.steady_truth(slow) is None


def test_the_oscillation_is_stokes_added_mass_and_the_basset_integral():
    """The history of a sine that never began, ∫ cos ω(t − s) s^(−½) ds, by quadrature with its oscillating tail."""
    subject = scene()
    truth = reference_solutions.oscillation_truth(subject)
    (case,) = truth.cases
    omega, speed_mps = reference_solutions.strokes_per_s(subject), reference_solutions.creeping_mps(subject)
    assert omega == 10
    k = 3111
    t = case.motion.t_s[k]

    def kernel(root):  # s = root², which takes the pole away
        return 2 * math.cos(omega * (t - root**2)) * math.exp(-1e-4 * root**4)

    integral, _ = quad(kernel, 0, 25, limit=5000)
    rho, mu, v, dv = 1420, 10, speed_mps * math.sin(omega * t), speed_mps * omega * math.cos(omega * t)
    history_n = 6 * RADIUS_M**2 * math.sqrt(math.pi * rho * mu) * speed_mps * omega * integral
    added_n = 0.5 * rho * 4 / 3 * math.pi * RADIUS_M**3 * dv
    wanted_n = -(6 * math.pi * mu * RADIUS_M * v + added_n + history_n)
    assert case.force_n[k, 0] == pytest.approx(wanted_n, rel=1e-3)


def test_the_start_has_the_published_factors():
    """1 + R/√(πνt) of a 68 mm ball in honey of ν = 10/1400: 1.723, 1.323, 1.229 after 0.1, 0.5, 1 s."""
    subject = scene(HONEY.model_copy(update={"density_kg_m3": 1400}))
    (case,) = reference_solutions.starting_truth(subject).cases
    stokes_n = 6 * math.pi * 10 * RADIUS_M * reference_solutions.creeping_mps(subject)
    half_tick = 0.5e-3
    for after_s, factor in ((0.1, 1.723), (0.5, 1.323), (1.0, 1.229)):
        k = round((after_s + half_tick) * 1000)
        assert -case.force_n[k, 0] / stokes_n == pytest.approx(factor, abs=5e-3)
    assert not case.counted[:10].any()
    assert case.counted[10:].all()
