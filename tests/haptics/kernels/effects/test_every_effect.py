"""Properties that every effect of the registry has."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from study_app.errors import StudyError
from study_app.haptics.model.effects import NAMED
from study_app.haptics.model.gate import bounds
from study_app.haptics.model.layout import LIMITER_ENERGY
from study_app.haptics.model.motion import Motion
from study_app.haptics.runtime.offline import simulate
from study_app.haptics.runtime.pack import pack
from study_app.lab.parameters import parameter, sections, with_parameter
from tests.haptics.scenes import COMPILED, moving, vectors
from tests.haptics.single_effects import NAMES, all_forces, force_n, in_lab, wandering, with_given_velocity

TICKS = 1500 if COMPILED else 80
FELT_AT_REST = {"buoyancy", "current"}


def without_effect(scene, name):
    """Return the scene without this effect, with those that carry it."""
    (liquid,) = scene.liquids
    effects = tuple(it for it in liquid.effects if it != name)
    return scene.model_copy(update={"liquids": (liquid.model_copy(update={"effects": effects}),)})


@pytest.mark.parametrize("name", NAMES)
def test_the_effect_is_packed_by_its_bit_and_changes_the_force_by_its_bound_at_most(name):
    scene = with_given_velocity(in_lab(name))
    assert pack(scene).liquids[0].effects & NAMED[name].bit
    assert not pack(without_effect(scene, name)).liquids[0].effects & NAMED[name].bit
    missing_n = force_n(scene, wandering(TICKS)) - force_n(without_effect(scene, name), wandering(TICKS))
    greatest_n = np.linalg.norm(missing_n, axis=1).max()
    assert greatest_n <= bounds(scene, scene.liquids[0])[name] * 1.001
    assert greatest_n > 0 or name == "surface"  # of a surface alone nothing is felt


@pytest.mark.parametrize("name", NAMES)
def test_a_body_at_rest_feels_only_weight_and_current(name):
    deep = Motion(np.arange(30) / 1000, np.tile([0.1, -0.3, 0.0], (30, 1)), velocity_mps=np.zeros((30, 3)))
    resting_n = force_n(with_given_velocity(in_lab(name)), deep)
    assert resting_n.any() == (name in FELT_AT_REST)
    assert resting_n == pytest.approx(np.tile(resting_n[-1], (30, 1)))


@pytest.mark.parametrize("angle", [0.4, np.pi / 2, np.pi])
@pytest.mark.parametrize("name", [name for name in NAMES if name != "current"])
def test_turning_the_motion_about_the_vertical_turns_the_force(name, angle):
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    motion, scene = wandering(TICKS), with_given_velocity(in_lab(name))
    turned = Motion(motion.t_s, motion.position_m @ turn.T, velocity_mps=motion.velocity_mps @ turn.T)
    expected = force_n(scene, motion) @ turn.T
    assert force_n(scene, turned) == pytest.approx(expected, abs=1e-9 * max(abs(expected).max(), 1e-3))


@pytest.mark.skipif(not COMPILED, reason="seconds of motion are for compiled code")
@pytest.mark.parametrize("rate_hz", [500, 2000])
@pytest.mark.parametrize("name", NAMES)
def test_half_and_double_the_rate_feel_the_same(name, rate_hz):
    scene = with_given_velocity(in_lab(name))
    usual, other = wandering(1500), wandering(1500 * rate_hz // 1000, rate_hz)
    for motion in (usual, other):
        motion.position_m[:, 1] -= 0.3  # below the surface, which is met a tick sooner or later
    expected = force_n(scene, usual)[::2]
    resampled_n = force_n(scene.model_copy(update={"rate_hz": float(rate_hz)}), other)[:: rate_hz // 500]
    assert abs(resampled_n - expected).max() <= 0.02 * max(abs(expected).max(), 1e-3)


@pytest.mark.parametrize("name", [name for name in NAMES if name != "current"])
def test_out_of_the_liquid_the_past_is_forgotten(name):
    velocity = np.zeros((260, 3))
    velocity[20:100, 0] = 0.5
    motion = moving(velocity)
    motion.position_m[:, 1] = -0.3
    motion.position_m[100:160, 0] = 2.0
    motion.position_m[160:, 0] = 0.0
    forces_n = force_n(with_given_velocity(in_lab(name)), motion)
    assert forces_n[99, 0] < 0 or name in {"surface", "buoyancy", "added_mass"}
    assert not forces_n[125:, 0].any()


@pytest.mark.parametrize("name", NAMES)
def test_the_smallest_and_the_fastest_motions_have_a_finite_force(name):
    for speed_mps in (5e-324, 1e-310, 1e-160, 1e-9, 100.0):
        table = simulate(
            with_given_velocity(in_lab(name)), moving([(speed_mps, -speed_mps, 0.0)] * 5 + [(0.0, 0.0, 0.0)] * 3)
        )
        assert np.isfinite(vectors(table, "force")).all()
        assert (np.linalg.norm(vectors(table, "device"), axis=1) <= 8 * (1 + 1e-12)).all()


@pytest.mark.parametrize("name", NAMES)
def test_both_ends_of_each_range_in_the_lab_give_forces_within_the_limits(name):
    scene, motion = in_lab(name), wandering(60)
    shown_now = {it.name for section in sections(scene) for it in section.parameters}
    for control in (it for it in NAMED[name].controls if it.name in shown_now):
        control_parameter = parameter(scene, control.name)
        for end in [choice for choice, _ in control_parameter.choices] or [
            control_parameter.least,
            control_parameter.most,
        ]:
            try:
                there = with_parameter(scene, control.name, end)
            except StudyError as error:
                assert any(word in str(error) for word in ("outrun", "viscosity", "less than")), error  # noqa: PT017
                continue
            table = simulate(with_given_velocity(there), motion)
            assert np.isfinite(vectors(table, "force")).all(), (control.name, end)
            assert (np.linalg.norm(vectors(table, "device"), axis=1) <= 8 * (1 + 1e-12)).all(), (control.name, end)


@pytest.mark.skipif(not COMPILED, reason="thousands of ticks are for compiled code")
@pytest.mark.parametrize("name", NAMES)
def test_the_passivity_controller_does_not_act_on_strokes_and_stops(name):
    t_s = np.arange(4000) / 1000
    swell = np.minimum(t_s, 1) * np.clip(3 - t_s, 0, 1)
    scene = in_lab(name).model_copy(update={"scale": 3.0, "origin_m": (0.0, -0.3, 0.0)})
    for hertz, reach_m in ((0.5, 0.03), (1.6, 0.02), (3.0, 0.01)):
        counts = np.rint(np.outer(reach_m * np.sin(2 * np.pi * hertz * t_s) * swell / 38e-6, [1.0, 0.0, 0.3]))
        sent = simulate(scene, Motion(t_s, 3 * 38e-6 * counts - [0.0, 0.3, 0.0]))
        assert sent.device_fx_n.any() or name in FELT_AT_REST | {"surface"}
        assert not (sent.limiters & LIMITER_ENERGY).any()


@pytest.mark.slow
@pytest.mark.skipif(not COMPILED, reason="compares with compiled code")
def test_plain_python_computes_the_same_as_compiled_code(tmp_path):
    command = [sys.executable, "-m", "tests.haptics.single_effects", str(tmp_path / "plain.npy")]
    plain_python = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    subprocess.run(command, env=plain_python, cwd=Path(__file__).parents[4], check=True)
    plain = np.load(tmp_path / "plain.npy")
    for plain_n, compiled_n in zip(plain, all_forces(len(plain[0])), strict=True):
        assert plain_n == pytest.approx(compiled_n, rel=1e-9, abs=1e-9 * max(abs(compiled_n).max(), 1e-3))
