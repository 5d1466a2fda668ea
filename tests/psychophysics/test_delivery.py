"""The delivered level: exact for a force that is exact, with the estimator's known biases through the compiled tick."""

import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.estimators import Ewma, Kalman
from study_app.haptics.model.motion import Motion as Path
from study_app.haptics.model.scene import ForceLink, Liquid, Scene, Velocity
from study_app.haptics.runtime.offline import samples_along
from study_app.psychophysics.delivery import (
    EARLIER,
    Motion,
    damping,
    difference,
    interpolate_vectors,
    lag,
    motion,
    sent_share,
)
from tests.compiled import needs_servo

RATE_HZ = 1000.0
COUNT_M = 38e-6
"""An encoder count of a Falcon at the handle."""


def swing(frequency_hz: float = 1.0, amplitude_m: float = 0.02, lasts_s: float = 3.0) -> tuple[Any, Any]:
    """Return times (n,) [s] and positions (n, 3) [m] of an even swing along x."""
    t_s = np.arange(round(lasts_s * RATE_HZ)) / RATE_HZ
    return t_s, np.column_stack((amplitude_m * np.sin(2 * np.pi * frequency_hz * t_s), 0 * t_s, 0 * t_s))


def damper(b_nspm: float, scale: float, velocity: Velocity) -> Scene:
    drag = Drag(law="linear", damping_nspm=b_nspm)
    liquid = Liquid(id="damper", density_kg_m3=1000, effects=("drag",), drag=drag)
    return Scene(liquids=(liquid,), scale=scale, velocity=velocity)


def samples_through_damper(
    b_nspm: float, t_s: Any, position_m: Any, scale: float = 1.0, velocity: Velocity | None = None
) -> Any:
    """Return the samples of a hand's motion through a damper, with its positions in the hand frame."""
    samples = samples_along(damper(b_nspm, scale, velocity or Ewma()), Path(t_s, scale * position_m))
    samples.position_m = position_m
    return samples


def fitted_damping(samples: Any, t_s: Any, from_s: float = 1.0) -> tuple[float, float]:
    hand_motion = motion(t_s, samples.position_m, 1 / RATE_HZ).after(from_s)
    fit = damping(interpolate_vectors(hand_motion.times_s, t_s, samples.device_force_n), hand_motion)
    assert fit is not None
    return fit


def test_damping_and_mass_of_an_exact_force_are_found() -> None:
    t_s, position_m = swing()
    position_m[:, 1] = 0.01 * np.cos(2 * np.pi * 1.7 * t_s)
    hand_motion = motion(t_s, position_m, 1 / RATE_HZ)
    force_n = -8.0 * hand_motion.velocity_mps - 0.2 * hand_motion.acceleration_mps2
    assert damping(force_n, hand_motion) == pytest.approx((8.0, 0.2), rel=1e-12)
    true_mps = 2 * np.pi * 0.02 * np.cos(2 * np.pi * hand_motion.times_s)
    assert hand_motion.velocity_mps[:, 0] == pytest.approx(true_mps, abs=1e-5)


def test_a_cubic_is_differentiated_exactly_at_uneven_times_to_the_error_of_interpolation() -> None:
    t_s = np.arange(400) / RATE_HZ
    cubic = np.column_stack((t_s**3, 2 * t_s - t_s**2, 0 * t_s))
    even = motion(t_s, cubic, 1 / RATE_HZ)
    assert even.velocity_mps[:, 0] == pytest.approx(3 * even.times_s**2, abs=1e-10)
    assert even.acceleration_mps2[:, 1] == pytest.approx(np.full(len(even.times_s), -2.0), rel=1e-8)
    late_s = t_s + 1e-4 * np.random.default_rng(1).uniform(size=len(t_s))
    uneven = motion(late_s, np.column_stack((late_s**3, 0 * t_s, 0 * t_s)), 1 / RATE_HZ)
    assert uneven.velocity_mps[:, 0] == pytest.approx(3 * uneven.times_s**2, abs=1e-4)


@pytest.mark.parametrize("position_m", [np.zeros((2000, 3)), np.zeros((30, 3)), np.zeros((0, 3))])
def test_the_damping_of_a_resting_hand_is_unknown(position_m: Any) -> None:
    hand_motion = motion(np.arange(len(position_m)) / RATE_HZ, position_m, 1 / RATE_HZ)
    assert damping(np.ones((len(hand_motion.times_s), 3)), hand_motion) is None
    assert hand_motion.rms_speed_mps == 0


def test_the_damping_of_a_barely_moving_hand_is_unknown() -> None:
    for amplitude_m, rests in ((1e-5, True), (5e-5, False)):
        hand_motion = motion(*swing(amplitude_m=amplitude_m), 1 / RATE_HZ)
        assert (damping(-8.0 * hand_motion.velocity_mps, hand_motion) is None) == rests


@needs_servo
@pytest.mark.parametrize(("frequency_hz", "low"), [(1.0, 0.005), (2.0, 0.014)])
def test_the_lag_of_ewma_takes_its_share_through_the_compiled_tick(frequency_hz: float, low: float) -> None:
    t_s, position_m = swing(frequency_hz)
    b_nspm, _ = fitted_damping(samples_through_damper(8, t_s, position_m), t_s)
    assert 1 - b_nspm / 8 == pytest.approx(low, abs=0.002)


@needs_servo
@pytest.mark.parametrize("b_nspm", [4.0, 32.0])
def test_the_same_lag_acts_as_a_negative_mass_of_9_ms_times_the_damping(b_nspm: float) -> None:
    t_s, position_m = swing()
    assert fitted_damping(samples_through_damper(b_nspm, t_s, position_m), t_s)[1] == pytest.approx(
        -9.4e-3 * b_nspm, rel=0.05
    )


@needs_servo
def test_encoder_counts_of_a_falcon_scatter_the_damping_by_a_fifth_of_a_percent() -> None:
    dampings = []
    for phase in range(20):
        t_s, position_m = swing(amplitude_m=0.02 + 1e-5 * phase)
        counted_m = np.rint((position_m + 1e-6 * phase) / COUNT_M) * COUNT_M
        dampings.append(fitted_damping(samples_through_damper(8, t_s, counted_m), t_s)[0] / 8)
    assert np.std(dampings) < 0.004
    assert 1 - np.mean(dampings) == pytest.approx(0.005, abs=0.003)


@pytest.mark.slow
@needs_servo
@pytest.mark.parametrize("velocity", [Ewma(), Scene.model_fields["velocity"].get_default(call_default_factory=True)])
def test_a_linear_law_is_a_damper_at_the_hand_at_any_scale(velocity: Velocity) -> None:
    t_s, position_m = swing()
    forces = [samples_through_damper(8, t_s, position_m, scale, velocity) for scale in (0.5, 1.0, 3.0, 10.0)]
    forces_n = [samples.device_force_n for samples in forces]
    for scale, samples, force_n in zip((0.5, 1.0, 3.0, 10.0), forces, forces_n, strict=True):
        assert force_n == pytest.approx(-8.0 * samples.velocity_mps / scale, abs=1e-9)
        assert force_n == pytest.approx(forces_n[1], abs=1e-6)
    assert fitted_damping(forces[2], t_s)[0] == pytest.approx(8.0, rel=0.01)


@pytest.mark.slow
def test_the_package_loads_only_numpy_and_itself() -> None:
    program = (
        "import sys, study_app.psychophysics.delivery\n"
        "print(sorted(name for name in sys.modules if name.startswith(('study_app.', 'scipy', 'pandas', 'numba'))))"
    )
    process = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert process.stdout.strip() == "['study_app.psychophysics', 'study_app.psychophysics.delivery']"


def shifted(rows: float, lasts_s: float = 3.0) -> tuple[Any, Any]:
    """Return a force of the model (n, 3) and the same ``rows`` later."""
    t_s = np.arange(round(lasts_s * RATE_HZ)) / RATE_HZ
    prompt, late = (
        np.column_stack((np.cos(2 * np.pi * t), 0.3 * np.sin(2 * np.pi * 1.7 * t), 0 * t))
        for t in (t_s, t_s - rows / RATE_HZ)
    )
    return late, prompt


@pytest.mark.parametrize("rows", [-2, 0, 1, 7, 80.5, 200.25, 259])
def test_the_lag_of_a_force_is_found_within_a_tenth_of_a_row(rows: float) -> None:
    sent, model = shifted(rows)
    assert lag(sent, model, 260) == pytest.approx(rows, abs=0.1)
    assert lag(0.4 * sent, model, 260) == pytest.approx(rows, abs=0.1)  # a share of it is as late
    noisy = sent + np.random.default_rng(3).normal(0, 0.05, sent.shape)
    assert lag(noisy, model, 260) == pytest.approx(rows, abs=1.0)


def test_the_sent_share_of_a_force_ignores_perpendicular_components() -> None:
    model = np.array([[2.0, 0.0, 1.0], [0.0, 3.0, 0.0]])
    across = np.array([[1.0, 5.0, -2.0], [4.0, 0.0, 7.0]])
    assert sent_share(0.4 * model + across, model) == pytest.approx(0.4)
    assert sent_share(-0.3 * model, model) == pytest.approx(-0.3)
    assert sent_share(model, 0 * model) is None


def test_the_error_of_the_comparison_is_relative_to_that_of_the_standard() -> None:
    errors, comparisons = [0.5, 0.7, None, 0.1, 1.0], [True, False, True, True, False]
    assert difference(errors, comparisons) == pytest.approx(0.3 - 0.85)
    assert difference(errors[:1], comparisons[:1]) is None
    assert difference(errors[1:3], comparisons[1:3]) is None


def test_a_part_of_a_motion_has_both_of_its_ends() -> None:
    vectors = np.arange(12.0).reshape(4, 3)
    part = Motion(np.array([0.1, 0.2, 0.4, 0.8]), vectors, 100 + vectors).after(0.2, 0.4)
    assert part.times_s.tolist() == [0.2, 0.4]
    assert part.velocity_mps.tolist() == [[3, 4, 5], [6, 7, 8]]
    assert part.acceleration_mps2.tolist() == [[103, 104, 105], [106, 107, 108]]
    assert part.rms_speed_mps == pytest.approx(np.sqrt((9 + 16 + 25 + 36 + 49 + 64) / 2))


def test_the_lag_of_an_opposite_or_zero_force_is_unknown() -> None:
    sent, model = shifted(0, lasts_s=1.0)
    assert lag(0 * sent, model, 100) is None
    assert lag(sent, 0 * model, 100) is None
    assert lag(sent[: EARLIER + 100], model[: EARLIER + 100], 100) is None
    straight = np.ones((500, 3))
    assert lag(-straight, straight, 100) is None


@needs_servo
@pytest.mark.parametrize("delay_ms", [0, 15, 100, 200])
@pytest.mark.parametrize("velocity", [Ewma(), Kalman()])
def test_the_lag_of_a_link_is_found_through_the_compiled_tick(delay_ms: int, velocity: Velocity) -> None:
    t_s, position_m = swing(lasts_s=4.0)
    linked = damper(0.3, 1.0, velocity).model_copy(update={"link": ForceLink(delay_s=delay_ms / 1000)})
    samples = samples_along(linked, Path(t_s, position_m))
    lag_found = lag(samples.device_force_n[500:], samples.force_n[500:], 260)
    assert lag_found == pytest.approx(delay_ms, abs=0.05)
