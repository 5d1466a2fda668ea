"""The force of each kind of scene, with each estimator and device, is safe and repeatable along a motion with faults.

The motion is a stroke in three dimensions with ticks without sample, repeated and damaged ones, jumps and late ticks.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.scene import Box, Knee
from study_app.haptics.runtime.pack import is_built_alike
from study_app.lab.parameters import with_parameter
from study_app.protocol.load import load_scenes
from tests.golden import compare
from tests.haptics.scenes import EVERYTHING, THESIS, TICK_NS, UNBENT, Hand, stroke
from tests.haptics.single_effects import EMPTY, ESTIMATOR_NAMES, NAMES, in_lab

GOLDEN = Path(__file__).parent / "golden"
TICKS = 150
MIRRORED = ("drag", "wake", "added_mass", "history", "unsteady_drag", "honey", "water")
"""Effects and liquids that no direction distinguishes."""
WATER = THESIS["water"]
DEVICES = {
    "light": Dynamics(mass_kg=0.05, delay_s=2e-3, count_m=20e-6),
    "heavy": Dynamics(mass_kg=1.0, delay_s=5e-3, count_m=100e-6),
}
CASES: dict[str, tuple[Any, dict[str, Any]]] = {
    **{f"effect {name}": (in_lab(name), {}) for name in NAMES},
    **{f"velocity {name}": (with_parameter(EMPTY, "velocity.kind", name), {}) for name in ESTIMATOR_NAMES},
    **{f"several {name}": (scene, {}) for name, scene in EVERYTHING.items()},
    **{f"slime {name}": (scene, {}) for name, scene in load_scenes("slime").items()},
    **{f"device {name}": (EVERYTHING["tail"], {"dynamics": dynamics}) for name, dynamics in DEVICES.items()},
    "thin": (WATER, {"faded_in": False}),
    "no knee": (WATER.model_copy(update={"knee": UNBENT}), {}),
    "square knee": (WATER.model_copy(update={"knee": Knee(law="square", threshold_mps=0.5)}), {}),
    "low limit": (EVERYTHING["tail"].model_copy(update={"force_limit_n": 0.5}), {}),
    "slow fade": (THESIS["honey"].model_copy(update={"fade_s": 0.2}), {"faded_in": False}),
}
VECTORS = ("velocity_mps", "wake_mps", "force_n", "command_n", "device_force_n", "device_velocity_mps")
SCALARS = ("permitted_n", "withheld_n", "delay_ticks", "limiters", "status")


def follow(hand: Hand, mirror: Any = 1.0) -> Any:
    """Return the samples along the stroke, or its mirror image, with faults on the way."""
    places, samples = 1.3 * stroke(4 * TICKS)[3 * TICKS :] * mirror, []
    for number, place_m in enumerate(places[:TICKS]):
        sample_m: Any = place_m
        late_ns = 0
        if number in range(44, 53) or number in (60, 61):
            sample_m = None  # no new sample: the force fades, then none for two ticks
        elif number == 72:
            sample_m = place_m + np.array([0.0, 0.05, 0.0])
        elif number == 74:
            sample_m = np.array([0.0, np.nan, 0.0])
        elif number in range(84, 92):
            sample_m = places[84]  # a rest
        elif number in (97, 98):
            late_ns = (2 + 9 * (number == 98)) * TICK_NS
        elif number > 130:
            sample_m = place_m + np.array([0.03, 0.0, 0.0]) * mirror  # the device's zero is another one
        samples.append(hand.tick(sample_m, after_ns=TICK_NS + late_ns).copy())
    return np.array(samples)


@pytest.mark.parametrize("name", CASES)
def test_whatever_goes_wrong_the_force_is_safe_and_the_same_again(name: str) -> None:
    scene, options = CASES[name]
    samples = follow(Hand(scene, **options))
    again = follow(Hand(scene, **options))
    size_n = np.linalg.norm(samples["command_n"], axis=1)
    assert np.isfinite(size_n).all()
    assert (size_n <= scene.force_limit_n * (1 + 1e-9)).all()
    assert np.linalg.norm(samples["device_force_n"], axis=1).max() <= scene.force_limit_n * (1 + 1e-9)
    assert (np.diff(size_n[48:53]) <= 1e-12).all(), "without news of the hand the force fades"
    assert size_n[52] < size_n[48] or size_n[48] == 0
    assert np.isnan(samples["position_m"][74]).any(), "a position that is no number came and moved no force"
    for column in (*VECTORS, *SCALARS):
        assert np.array_equal(samples[column], again[column], equal_nan=True), column
    if name.startswith(("effect", "slime")) and name != "effect surface":
        assert size_n[:44].max() > 0, "the liquid is felt"


@pytest.mark.parametrize("name", [name for name in CASES if name.partition(" ")[2] in MIRRORED])
def test_a_mirrored_motion_is_answered_by_the_mirrored_force(name: str) -> None:
    scene, options = CASES[name]
    mirror = np.array([-1.0, 1.0, 1.0])
    forces = follow(Hand(scene, **options))["command_n"], follow(Hand(scene, **options), mirror)["command_n"]
    assert np.allclose(forces[0], mirror * forces[1], rtol=1e-6, atol=1e-9)


def variants(scene: Any) -> dict[str, Any]:
    """Return scenes that differ in one parameter."""
    (liquid, *others) = scene.liquids
    heavier = liquid.model_copy(update={"density_kg_m3": 1.1 * liquid.density_kg_m3})
    moved = liquid.model_copy(update={"region": Box(centre_m=(0.0, 0.1, 0.0), size_m=(1.0, 1.0, 1.0))})
    changes: dict[str, dict[str, Any]] = {
        "same": {}, "density": {"liquids": (heavier, *others)}, "region": {"liquids": (moved, *others)},
        "drag only": {"liquids": (liquid.model_copy(update={"effects": ("drag",)}), *others)},
        "two": {"liquids": (liquid, heavier)}, "scale": {"scale": 5.0}, "origin": {"origin_m": (0.0, 0.01, 0.0)},
        "body": {"body": scene.body.model_copy(update={"diameter_m": 0.05, "drag_coefficient": 0.6})},
        "knee": {"knee": UNBENT}, "threshold": {"knee": Knee(threshold_mps=1.0)}, "limit": {"force_limit_n": 2.0},
        "fade": {"fade_s": 0.1}, "rate": {"rate_hz": 500.0},
    }  # fmt: skip
    return {name: scene.model_copy(update=change) for name, change in changes.items()}


def test_which_scenes_keep_their_state(pytestconfig: pytest.Config) -> None:
    bases = {name: CASES[name][0] for name in ("effect drag", "effect history", "several tail", "no knee")}
    lines = []
    for name, scene in bases.items():
        kept = [what for what, other in variants(scene).items() if is_built_alike(scene, other)]
        estimators = [
            estimator
            for estimator in ESTIMATOR_NAMES
            if is_built_alike(scene, with_parameter(scene, "velocity.kind", estimator))
        ]
        others = [what for what, other in bases.items() if what != name and is_built_alike(scene, other)]
        lines.append(f"{name}: {', '.join(kept)} | {', '.join(estimators)} | {', '.join(others)}")
    compare(GOLDEN / "kept_state.txt", lines, pytestconfig)
