"""The force of a scene's liquid for the estimators, linear in the drag coefficient.

With the constant law of drag the force is C_d·g + h: g depends on the wake, h is that of effects without drag. The wake
does not depend on C_d, so one run along a motion serves every C_d.
"""

from typing import Final

import numpy as np

from study_app.errors import StudyError
from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.scene import Given, Scene
from study_app.haptics.runtime.offline import ModelAlong
from study_app.lab.estimation.rows import Floats, Rows

DRAG: Final = "drag_coefficient"
LENGTH: Final = "length"
SCALING: Final = "scaling"
WAKE: Final = (LENGTH, SCALING)
NAMES: Final = (DRAG, *WAKE)
PLACES: Final = {DRAG: "body.drag_coefficient", LENGTH: "wake.length", SCALING: "wake.scaling"}
"""Their names in the lab (``lab.parameters``)."""
_DRAG_ALONE: Final = {"drag", "wake", "local_wake", "current", "surface"}
"""Effects that exert no force themselves, and drag."""


def prepare() -> None:
    """Compile the model, or load it from the cache."""
    nowhere = np.zeros((1, 3))
    ModelAlong(Scene(), given=True).follow(np.zeros(1), nowhere, nowhere)


def refusal(scene: Scene, names: tuple[str, ...]) -> str:
    """Return why parameters of a scene cannot be estimated, "" if they can."""
    if len(scene.liquids) != 1:
        return f"a force is estimated of one liquid at a time, not of {len(scene.liquids)}: choose one of them"
    liquid = resolve(scene).liquids[0]
    if "drag" not in liquid.effects:
        return "the liquid has no effect drag: the drag coefficient does not change its force"
    if liquid.drag.law != "constant":
        return f'the drag law "{liquid.drag.law}" does not use the drag coefficient: choose the law "constant"'
    if set(names) & set(WAKE) and "wake" not in liquid.effects:
        return "the liquid has no effect wake: estimate the drag coefficient alone"
    return ""


class LiquidModel:
    """A scene's liquid along a motion given in pieces.

    Parameters
    ----------
    scene : Scene
        With one liquid, whose effects are named or chosen by the gate.

    Raises
    ------
    StudyError
        Its force does not depend on the drag coefficient.
    """

    def __init__(self, scene: Scene, rate_hz: float) -> None:
        scene = resolve(scene)
        if why := refusal(scene, (DRAG,)):
            raise StudyError(why)
        self._runs = [
            ModelAlong(_with_drag(scene, drag_coefficient, rate_hz), given=True)
            for drag_coefficient in ((1.0,) if set(scene.liquids[0].effects) <= _DRAG_ALONE else (1.0, 2.0))
        ]

    def follow(self, rows: Rows) -> tuple[Floats, Floats]:
        """Return g and h (n, 3) [N] along the next rows."""
        forces_n = [run.follow(rows.t_s, rows.position_m, rows.velocity_mps).force_n for run in self._runs]
        if len(forces_n) == 1:
            return np.asarray(forces_n[0]), np.zeros((len(rows), 3))
        g_n: Floats = forces_n[1] - forces_n[0]
        return g_n, forces_n[0] - g_n


def with_wake(scene: Scene, length: int, scaling: float) -> Scene:
    """Return the scene with another length and scaling of its wake."""
    (liquid,) = scene.liquids
    wake = Wake(**(liquid.wake.model_dump() | {"length": length, "scaling": max(scaling, float(length))}))
    return scene.model_copy(update={"liquids": (liquid.model_copy(update={"wake": wake}),)})


def values_of(scene: Scene) -> dict[str, float]:
    """Return the values of `NAMES` that the scene has."""
    wake = resolve(scene).liquids[0].wake
    found = {DRAG: scene.body.drag_coefficient}
    return found if wake is None else found | {LENGTH: float(wake.length), SCALING: wake.scaling}


def _with_drag(scene: Scene, drag_coefficient: float, rate_hz: float) -> Scene:
    body = scene.body.model_copy(update={"drag_coefficient": drag_coefficient})
    return scene.model_copy(update={"body": body, "rate_hz": rate_hz, "velocity": Given()})
