"""Liquids identified from motion and force: parameters, intervals, and warnings about doubtful ones."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import t as student

from study_app.errors import StudyError
from study_app.haptics.model import motion as paths
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.overrides import override_all
from study_app.haptics.model.scene import Box, Liquid, Scene
from study_app.lab.identify import measured_force
from study_app.lab.identify.fit import fit
from tests.haptics.scenes import COMPILED
from tests.lab.identify.measurements import (
    BALL,
    OIL,
    REACH,
    REVERSE,
    SEED,
    TANK,
    force_of,
    noisy_force,
    some_rows,
    write_csv,
)

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")]


def test_without_noise_they_are_found_exactly():
    names = ["length", "scaling", "exponent"]
    start = override_all(TANK, {"length": 100, "scaling": 100, "exponent": 0.7})
    result = fit(start, "tank", names, REVERSE, force_of(TANK, REVERSE))
    assert result.values["length"] == 300
    assert result.values["scaling"] == pytest.approx(400, rel=1e-6)
    assert result.values["exponent"] == pytest.approx(1, rel=1e-6)
    assert result.rms_n < 1e-6


def test_one_linear_parameter_is_the_quotient_of_linear_regression():
    """F = C_d g: C_d = Σ F·g / Σ g·g, its interval by Student's t with one degree of freedom less than numbers."""
    force_n = noisy_force(BALL, REACH, 0.05)
    result = fit(BALL, "tank", ["drag_coefficient"], REACH, force_n)
    unit_n = force_of(override_all(BALL, {"drag_coefficient": 1}), REACH)
    true = np.sum(force_n * unit_n) / np.sum(unit_n**2)
    residuals_n = (force_n - true * unit_n)[:, [0, 2]]
    assert result.axes == (0, 2)
    assert result.autocorrelation < 0.05
    widened = math.sqrt((1 + max(result.autocorrelation, 0)) / (1 - max(result.autocorrelation, 0)))
    half = student.ppf(0.975, residuals_n.size - 1) * math.sqrt(
        np.sum(residuals_n**2) / (residuals_n.size - 1) / np.sum(unit_n**2)
    )
    assert result.values["drag_coefficient"] == pytest.approx(true, rel=1e-9)
    lower, upper = result.intervals["drag_coefficient"]
    assert (upper - lower) / 2 == pytest.approx(half * widened, rel=1e-3)
    assert (upper + lower) / 2 == pytest.approx(true, rel=1e-9)


def test_a_viscosity_an_order_away_and_an_added_mass():
    start = override_all(OIL, {"viscosity_pa_s": 14.0, "added_mass.coefficient": 0.0})
    result = fit(start, "oil", ["viscosity_pa_s", "added_mass.coefficient"], REACH, noisy_force(OIL, REACH, 0.05))
    assert result.values["viscosity_pa_s"] == pytest.approx(1.41, rel=0.01)
    assert result.values["added_mass.coefficient"] == pytest.approx(0.5, rel=0.05)
    assert result.distinguishable


def test_slower_and_uneven_rows_tell_the_same():
    motion = REACH
    force_n, rng = noisy_force(TANK, motion, 0.005), np.random.default_rng(SEED)
    some = np.sort(rng.choice(len(motion.t_s), len(motion.t_s) // 5, replace=False))
    result = fit(
        override_all(TANK, {"length": 100}), "tank", ["drag_coefficient", "length"], *some_rows(motion, force_n, some)
    )
    assert result.values["drag_coefficient"] == pytest.approx(0.42, rel=0.02)
    assert result.values["length"] == pytest.approx(300, rel=0.05)
    assert len(result.fitted_n) == len(some)


@pytest.mark.parametrize("velocities", [True, False])
@pytest.mark.parametrize("rate_hz", [50, 100, 333])
def test_a_slow_sensor_does_not_bias_drag_and_added_mass(rate_hz, velocities):
    """The force of both laws on three sines is computed here; a tick of 1 ms still delays the acceleration by half."""
    rng = np.random.default_rng(rate_hz)
    t_s, w = np.arange(0, 12, 1 / rate_hz)[:, None], 2 * np.pi * np.array([0.7, 1.1, 1.9])
    phases, sizes_m = w * t_s + rng.uniform(0, 6, 3), np.array([0.05, 0.03, 0.012])
    x_m, v_mps = np.sin(phases) @ sizes_m, np.cos(phases) @ (w * sizes_m)
    drag_n = -0.5 * 1000 * 0.55 * math.pi / 4 * 0.068**2 * np.abs(v_mps) * v_mps
    force_n = drag_n + 0.7 * 1000 * math.pi / 6 * 0.068**3 * np.sin(phases) @ (w**2 * sizes_m)
    along = np.outer(x_m, [0, 1, 0]), np.outer(v_mps, [0, 1, 0])
    motion = Motion(t_s[:, 0], along[0], velocity_mps=along[1] if velocities else None)
    ball = BALL.model_copy(update={"liquids": (Liquid(id="tank", density_kg_m3=1000, effects=("drag", "added_mass")),)})
    measured_n = np.outer(force_n + rng.normal(0, 0.01, len(force_n)), [0, 1, 0])
    moved = measured_force.with_centred_velocity(motion)
    fitted = fit(ball, "tank", ("drag_coefficient", "coefficient"), moved, measured_n).scene
    assert fitted.body.drag_coefficient == pytest.approx(0.55, rel=0.025)
    assert fitted.liquids[0].added_mass.coefficient == pytest.approx(0.7, rel=0.025)


def test_a_measured_force_does_not_lag_so_velocities_from_places_do_not(tmp_path):
    """Through the filter of a device the added mass of a real ball would be felt 9.5 ms late, as less of it."""
    force_n = noisy_force(OIL, REACH, 0.01)
    read = measured_force.read_measurement(write_csv(tmp_path / "measured.csv", REACH, force_n, velocities=False))
    assert read.motion.velocity_mps is None
    names = ["viscosity_pa_s", "added_mass.coefficient"]
    centred = fit(OIL, "oil", names, measured_force.with_centred_velocity(read.motion), read.force_n)
    late = fit(OIL, "oil", names, read.motion, read.force_n)
    assert centred.values["viscosity_pa_s"] == pytest.approx(1.41, rel=0.005)
    assert centred.values["added_mass.coefficient"] == pytest.approx(0.5, rel=0.1)
    assert late.rms_n > 5 * centred.rms_n


def test_centred_velocities_equal_those_of_a_parabola():
    t_s = np.arange(60) / 500
    place = np.column_stack([3 * t_s**2 - t_s, 0 * t_s, 2 - t_s])
    slopes = measured_force.with_centred_velocity(Motion(t_s, place)).velocity_mps
    assert slopes == pytest.approx(np.column_stack([6 * t_s - 1, 0 * t_s, -np.ones(60)]), abs=1e-9)


@pytest.mark.nightly
@pytest.mark.parametrize("following", [0.0, 0.9])
def test_nineteen_of_twenty_intervals_hold_the_truth(following):
    """This includes correlated sensor noise; taken for white, only one interval in three would contain the truth."""
    motion, names = (
        paths.programmed_motion("reach", reaches=1, reach_s=0.5, dwell_s=0.1),
        ["viscosity_pa_s", "added_mass.coefficient"],
    )
    scene = override_all(OIL, {"effects": ("drag", "added_mass")})
    held = np.zeros(2)
    repeats = 100
    for seed in range(repeats):
        result = fit(scene, "oil", names, motion, noisy_force(scene, motion, 0.2, following=following, seed=seed))
        for k, true in enumerate((1.41, 0.5)):
            lower, upper = result.intervals[names[k]]
            held[k] += lower < true < upper
    # Two deviations of the binomial distribution to both sides of 0.95; intervals too wide would hold all.
    assert (held >= 91).all()
    assert (held <= 99).all()


def test_two_factors_of_the_same_force_cannot_be_distinguished():
    names = ["drag_coefficient", "density_kg_m3"]
    result = fit(BALL, "tank", names, REACH, noisy_force(BALL, REACH, 0.02))
    assert not result.distinguishable
    assert result.correlation[0, 1] == pytest.approx(-1, abs=1e-6)
    (warning,) = result.warnings
    assert "drag_coefficient and density_kg_m3 cannot be distinguished" in warning
    assert result.intervals["drag_coefficient"] == (0, 10)
    known_kg_m3 = result.values["drag_coefficient"] * result.values["density_kg_m3"]
    assert known_kg_m3 == pytest.approx(470, rel=0.01)
    alone = fit(BALL, "tank", ["drag_coefficient"], REACH, noisy_force(BALL, REACH, 0.02))
    assert alone.distinguishable


def test_a_parameter_without_effect_is_named_and_kept():
    names = ["drag_coefficient", "viscosity_pa_s"]
    result = fit(OIL, "oil", names, REACH, noisy_force(OIL, REACH, 0.02))
    assert not result.distinguishable
    assert any("drag_coefficient does not affect the force" in warning for warning in result.warnings)
    assert result.values["drag_coefficient"] == 0.47
    assert np.isnan(result.correlation[0]).all()
    lower, upper = result.intervals["viscosity_pa_s"]
    assert lower < 1.41 < upper


def test_a_length_beyond_the_measurement_ends_at_the_edge():
    short = paths.programmed_motion("line", moving_s=0.2)
    result = fit(override_all(TANK, {"length": 100}), "tank", ["length"], short, force_of(TANK, short))
    assert result.values["length"] == 200
    assert any("reached the end of its range, 200 (limited by the scaling" in warning for warning in result.warnings)


def test_a_missing_effect_shows_in_residuals_that_follow_one_another():
    lacking = override_all(OIL, {"effects": ("drag",)})
    result = fit(lacking, "oil", ["viscosity_pa_s"], REACH, noisy_force(OIL, REACH, 0.01))
    assert result.autocorrelation > 0.9
    assert any("are autocorrelated" in warning for warning in result.warnings)
    white = fit(OIL, "oil", ["viscosity_pa_s"], REACH, noisy_force(OIL, REACH, 0.01))
    widths = [upper - lower for lower, upper in (result.intervals["viscosity_pa_s"], white.intervals["viscosity_pa_s"])]
    assert widths[0] > 20 * widths[1]


def test_a_reversed_sign_is_detected_and_the_explained_share_is_stated():
    force_n = noisy_force(OIL, REACH, 0.01)
    right, wrong = (fit(OIL, "oil", ["viscosity_pa_s"], REACH, sign * force_n) for sign in (1, -1))
    assert right.warnings == ()
    assert right.explained == pytest.approx(1 - np.sum(right.residual_n**2) / np.sum(force_n**2))
    assert right.explained > 0.99
    assert f"the law explains {100 * right.explained:.1f} % of the mean squared force" in right.summary()
    assert wrong.explained < 0.01
    comparison = f"{100 * right.share:.0f} % of the force instead of {100 * wrong.share:.0f} %"
    assert any(comparison in warning and "opposite sign" in warning for warning in wrong.warnings)
    weight_n = 30 * np.linalg.norm(force_n, axis=1).max() * np.array([0.6, -0.8, 0.0])
    for sign in (1, -1):
        result = fit(OIL, "oil", ["viscosity_pa_s"], REACH, sign * force_n + weight_n)
        assert any("accelerate the body" in warning for warning in result.warnings) == (sign == -1)


@pytest.mark.parametrize(
    ("metres", "newtons", "warning"),
    [
        (1000, 1, "m/s, faster than a hand can move it: specify positions in metres and times in seconds"),
        (1, 1e5, "N, more than a hand can exert: specify forces in newtons"),
    ],
)
def test_millimetres_and_millinewtons_are_noticed(metres, newtons, warning):
    force_n = newtons * force_of(TANK, REACH)
    moved = Motion(REACH.t_s, metres * REACH.position_m, velocity_mps=metres * REACH.velocity_mps)
    speed_mps = np.linalg.norm(moved.velocity_mps, axis=1).max() / BALL.scale
    value = speed_mps if metres > 1 else np.linalg.norm(force_n, axis=1).max()
    warnings = fit(BALL, "tank", ["drag_coefficient"], moved, force_n).warnings
    assert sum(line.endswith(f" {value:.3g} {warning}") for line in warnings) == 1
    usual = fit(BALL, "tank", ["drag_coefficient"], REACH, force_of(TANK, REACH)).warnings
    assert not [line for line in usual if "specify" in line]


def test_values_unrelated_to_the_motion_are_not_taken_for_a_force_on_the_body():
    torque = np.random.default_rng(SEED).normal(0, 0.3, (len(REACH.t_s), 3))
    result = fit(OIL, "oil", ["viscosity_pa_s"], REACH, torque)
    assert result.explained < 0.05
    assert any("velocity and acceleration explain only 0 %" in warning for warning in result.warnings)
    assert not any("opposite sign" in warning for warning in result.warnings)


def test_a_sharp_turn_that_velocities_from_places_blur_is_doubted():
    """The force is wrong for 25 ms at a turn: residuals follow one another little, but more than noise would."""
    places = measured_force.with_centred_velocity(Motion(REVERSE.t_s, REVERSE.position_m))
    force_n = noisy_force(TANK, REVERSE, 0.06)
    blurred = fit(TANK, "tank", ["drag_coefficient"], places, force_n)
    assert blurred.autocorrelation < 0.5
    assert any("blur sharp turns" in warning for warning in blurred.warnings)
    assert fit(TANK, "tank", ["drag_coefficient"], REVERSE, force_n).warnings == ()


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ([], "specify at least one parameter to fit"),
        (["drag_coeficient"], "did you mean 'drag_coefficient'"),
        (["viscosity_pa_s"], "does not contain an initial value for viscosity_pa_s"),
        (["breaking_angle_deg"], "is a threshold"),
        (["alpha"], "unknown parameter 'alpha'"),
        (["axes"], "unknown parameter 'axes'"),
        (["reach_m"], "unknown parameter 'reach_m'"),
        (["length", "wake.length"], "are the same parameter"),
    ],
)
def test_impossible_fits_are_refused(names, said):
    with pytest.raises(StudyError, match=said):
        fit(TANK, "tank", names, REVERSE, force_of(TANK, REVERSE))
    with pytest.raises(StudyError, match="does not contain the liquid 'lake'; its liquids are tank"):
        fit(TANK, "lake", ["drag_coefficient"], REVERSE, force_of(TANK, REVERSE))
    with pytest.raises(StudyError, match="it is a device, so reading may never end"):
        measured_force.read_measurement(Path("/dev/null"))  # /dev/zero would fill the memory


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda m, f: (m, 0 * f), "is always zero"),
        (lambda m, f: (m, f[:-1]), r"finite and have the shape \(n, 3\)"),
        (lambda m, f: (m, f * math.nan), "finite"),
        (lambda m, f: some_rows(m, f, [0]), "one row is not enough"),
        (lambda m, f: some_rows(m, f, [0, 1, 2, 99, 100]), "row 4 is 0.097 s after the previous row"),
    ],
)
def test_missing_measurements_are_refused(change, said):
    motion, force_n = change(REVERSE, force_of(TANK, REVERSE))
    with pytest.raises(StudyError, match=said):
        fit(TANK, "tank", ["drag_coefficient"], motion, force_n)


def test_effects_left_to_choice_are_chosen_once_and_named():
    box = Box(size_m=(9, 9, 9))
    auto = Scene(liquids=(Liquid(id="oil", density_kg_m3=900, viscosity_pa_s=0.1, region=box, effects="auto"),))
    result = fit(auto, "oil", ["density_kg_m3"], REACH, force_of(auto, REACH))
    assert result.scene.liquids[0].effects != "auto"
    assert result.values["density_kg_m3"] == pytest.approx(900)
