"""One parameter of a scene set by its name: a new scene, or one line that says why not.

Beyond ``haptics.model.overrides`` it knows components of vectors, effects one by one, and the default values of a table
that the liquid does not have yet.
"""

from __future__ import annotations

import math
from typing import Any, Final

from study_app.errors import StudyError
from study_app.haptics.model.gate import ORDER, resolve
from study_app.haptics.model.overrides import override_all
from study_app.haptics.model.scene import Scene
from study_app.lab.parameters import (
    AUTO,
    AXES,
    EFFECT_WORDS,
    ON,
    Parameter,
    Value,
    parameter,
    read,
    the_liquid,
    value_of,
)

_WAKE: Final = {"length": 1700, "scaling": 1700.0}  # the thesis' water
_TABLES: Final[dict[str, dict[str, Any]]] = {
    "wake": _WAKE,
    "local_wake": _WAKE,
    "current": {"kind": "uniform", "velocity_mps": (0.5, 0.0, 0.0)},
}
_THROUGH_DRAG: Final = ("wake", "local_wake", "current")
_HALF_HAND_M: Final = 0.05
_SPEED_MPS: Final = 0.5


def changed(scene: Scene, name: str, value: Value) -> Scene:
    """Return the scene with one parameter (``lab.parameters``) set.

    Raises
    ------
    StudyError
        The scene has no such parameter, or it cannot be this.
    """
    it = parameter(scene, name)
    value = _checked(it, value)
    if name == "effects":
        return override_all(scene, {"effects": AUTO} if value == AUTO else _named(scene))
    if name.startswith("effects."):
        return _with_effect(scene, name.partition(".")[2], on=value == ON)
    place, field, *axis = name.split(".")
    if axis:
        whole = list(read(scene, f"{place}.{field}"))
        whole[AXES.index(axis[0])] = value
        return override_all(scene, {f"{place}.{field}": tuple(whole)})
    if field == "kind" and place in {"region", "current"}:
        if value == read(scene, name):
            return scene
        return override_all(scene, {f"liquid.{place}": _begun(scene, str(value))})
    if read(scene, name) is None and value == value_of(scene, name):  # what is left open, and is so already
        return scene
    by_hand = _named(scene) if name == "drag.law" else {}  # the gate would choose another
    return override_all(scene, by_hand | {name: value})


def _checked(it: Parameter, value: Value) -> Value:
    """Return the value as its parameter takes it."""
    if it.choices:
        if value not in {choice for choice, _ in it.choices}:
            words = ", ".join(repr(choice) for choice, _ in it.choices)
            raise StudyError(f"{it.label} must be one of {words}, not {value!r}")
        return value
    if isinstance(value, str) or value is None or not math.isfinite(value):
        raise StudyError(f"{it.label} must be a number, not {value!r}")
    slack = 1e-9 * (abs(it.least) + abs(it.most))  # of a number that was written in other units
    if not it.least - slack <= value <= it.most + slack:
        raise StudyError(f"{it.label} must be {it.shown(it.least)} to {it.shown(it.most)}, not {it.shown(value)}")
    value = min(max(float(value), it.least), it.most)
    return round(value) if it.whole else value


def _with_effect(scene: Scene, effect: str, *, on: bool) -> Scene:
    """Return the scene with an effect on or off, and what it cannot do without."""
    liquid = the_liquid(scene)
    wanted = set(resolve(scene).liquids[0].effects)
    if on:
        wanted |= {effect, "drag"} if effect in _THROUGH_DRAG else {effect}
        wanted -= {"wake": {"local_wake"}, "local_wake": {"wake"}}.get(effect, set())
    else:
        wanted -= {effect, *_THROUGH_DRAG} if effect == "drag" else {effect}
    values = _named(scene) | {"effects": tuple(it for it in ORDER if it in wanted)}
    if on and effect in _TABLES and getattr(liquid, effect) is None:
        values[f"liquid.{effect}"] = _TABLES[effect]
    try:
        return override_all(scene, values)
    except StudyError as error:
        words, reason = EFFECT_WORDS[effect], str(error).partition(": ")[2]
        raise StudyError(f"{words} cannot be turned {'on' if on else 'off'}: {reason}") from error


def _named(scene: Scene) -> dict[str, object]:
    """Return effects and law of drag as the gate takes them, to be set by name."""
    taken = resolve(scene).liquids[0]
    return {"effects": taken.effects, "drag.law": taken.drag.law}


def _begun(scene: Scene, kind: str) -> dict[str, Any]:
    """Return what a region or a current of a kind begins with: as large as the hand reaches, around its middle."""
    centre_m, reach_m = scene.origin_m, scene.scale * _HALF_HAND_M
    begun: dict[str, dict[str, Any]] = {
        "everywhere": {"kind": kind},
        "box": {"kind": kind, "centre_m": centre_m, "size_m": (2 * reach_m,) * 3},
        "cylinder": {"kind": kind, "centre_m": centre_m, "radius_m": reach_m, "height_m": 2 * reach_m},
        "uniform": {"kind": kind, "velocity_mps": (_SPEED_MPS, 0.0, 0.0)},
        "channel": {"kind": kind, "centre_m": centre_m, "width_m": 2 * reach_m, "peak_mps": _SPEED_MPS},
        "vortex": {"kind": kind, "centre_m": centre_m, "core_m": reach_m / 2, "peak_mps": _SPEED_MPS},
    }
    return begun[kind]
