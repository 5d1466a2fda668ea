"""All that the servo's tick computes in each kind of scene, with each estimator and device, along a motion with faults.

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
from tests.golden_values import value_lines
from tests.haptics.scenes import EVERYTHING, THESIS, TICK_NS, UNBENT, Hand, stroke
from tests.haptics.single_effects import EMPTY, ESTIMATOR_NAMES, NAMES, in_lab

GOLDEN = Path(__file__).parent / "golden"
TICKS = 150
SEEN = (3, 30, 49, 62, 75, 88, 101, 120, 149)
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


def follow(hand: Hand) -> Any:
    """Return the samples along the stroke, with what goes wrong on the way."""
    places, samples = 1.3 * stroke(4 * TICKS)[3 * TICKS :], []
    for number, place_m in enumerate(places[:TICKS]):
        given: Any = place_m
        late_ns = 0
        if number in range(44, 53) or number in (60, 61):
            given = None  # no new sample: the force fades, then none for two ticks
        elif number == 72:
            given = place_m + np.array([0.0, 0.05, 0.0])
        elif number == 74:
            given = np.array([0.0, np.nan, 0.0])
        elif number in range(84, 92):
            given = places[84]  # a rest
        elif number in (97, 98):
            late_ns = (2 + 9 * (number == 98)) * TICK_NS
        elif number > 130:
            given = place_m + np.array([0.03, 0.0, 0.0])  # the device's zero is another one
        samples.append(hand.tick(given, after_ns=TICK_NS + late_ns).copy())
    return np.array(samples)


@pytest.mark.parametrize("name", CASES)
def test_forces(name: str, pytestconfig: pytest.Config) -> None:
    scene, given = CASES[name]
    hand = Hand(scene, **given)
    lines = [*value_lines(hand.model.parameters[0], "parameters")]
    for number in range(hand.model.parameters[0].liquids):
        lines += value_lines(hand.model.liquids[number], f"liquid {number}")
    samples = follow(hand)
    for column in (*VECTORS, *SCALARS):
        values = samples[column].reshape(TICKS, -1).astype(float)
        shown = "  ".join(" ".join(f"{one:.6g}" for one in values[tick]) for tick in SEEN)
        lines.append(f"{column}: {shown}  sums {' '.join(f'{one:.6g}' for one in np.abs(values).sum(axis=0))}")
    compare(GOLDEN / f"{name.replace(' ', '_')}.txt", lines, pytestconfig, rel=2e-5, abs_=1e-7)


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
            one for one in ESTIMATOR_NAMES if is_built_alike(scene, with_parameter(scene, "velocity.kind", one))
        ]
        others = [what for what, other in bases.items() if what != name and is_built_alike(scene, other)]
        lines.append(f"{name}: {', '.join(kept)} | {', '.join(estimators)} | {', '.join(others)}")
    compare(GOLDEN / "kept_state.txt", lines, pytestconfig)
