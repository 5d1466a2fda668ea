"""Sets one parameter of a scene by its name: returns a new scene, or raises an error of one line.

Unlike ``haptics.model.overrides`` it supports vector components, single effects, and the default values of a table that
the liquid does not have yet.
"""

import math
from typing import Any, Final

from study_app.errors import StudyError
from study_app.haptics.model.effect import Parameter, Value
from study_app.haptics.model.effects import EFFECTS, NAMED
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.overrides import override_all
from study_app.haptics.model.scene import Scene
from study_app.lab.parameters import AUTO, AXES, ON, parameter, read, the_liquid, value_of

_HALF_HAND_M: Final = 0.05
_KINDS: Final = ("kind", "law")
"""Fields that determine which other fields a table has."""


def changed(scene: Scene, name: str, value: Value) -> Scene:
    """Return the scene with one parameter (``lab.parameters``) set.

    Raises
    ------
    StudyError
        The scene has no such parameter, or the value is not permitted.
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
    chosen = place in NAMED and NAMED[place].choose is not None
    by_hand = _named(scene) if chosen else {}  # the gate would choose another
    if field in _KINDS and (place == "region" or place in NAMED):
        if value == read(scene, name):
            return scene
        return override_all(scene, by_hand | {f"liquid.{place}": _begun(scene, place, str(value))})
    if read(scene, name) is None and value == value_of(scene, name):  # an unset value, unchanged
        return scene
    return override_all(scene, by_hand | _without_replaced(scene, place, field) | {name: value})


def _without_replaced(scene: Scene, place: str, field: str) -> dict[str, None]:
    """Return the tables of disabled effects that a field of the liquid replaces, which are to be cleared."""
    taken = resolve(scene).liquids[0].effects
    replaced = (it.name for it in EFFECTS if place == "liquid" and field in it.replaces and it.name not in taken)
    return {f"liquid.{name}": None for name in replaced}


def _checked(it: Parameter, value: Value) -> Value:
    """Return the value converted and checked for its parameter."""
    if it.choices:
        if value not in {choice for choice, _ in it.choices}:
            words = ", ".join(repr(choice) for choice, _ in it.choices)
            raise StudyError(f"{it.label} must be one of {words}, not {value!r}")
        return value
    if isinstance(value, str) or value is None or not math.isfinite(value):
        raise StudyError(f"{it.label} must be a number, not {value!r}")
    slack = 1e-9 * (abs(it.least) + abs(it.most))  # of a number in other units
    if not it.least - slack <= value <= it.most + slack:
        raise StudyError(f"{it.label} must be {it.shown(it.least)} to {it.shown(it.most)}, not {it.shown(value)}")
    value = min(max(float(value), it.least), it.most)
    return round(value) if it.whole else value


def _with_effect(scene: Scene, effect: str, *, on: bool) -> Scene:
    """Return the scene with an effect on or off, and the effects that it requires."""
    liquid = the_liquid(scene)
    wanted = set(resolve(scene).liquids[0].effects)
    if on:
        carriers = NAMED[effect].through
        wanted |= {effect} if set(carriers) & wanted else {effect, *carriers[:1]}
        for name in (*carriers, effect):
            if name in wanted:
                wanted -= {it.name for it in EFFECTS if name in it.excludes or it.name in NAMED[name].excludes}
    wanted -= set() if on else {effect}
    wanted -= {it.name for it in EFFECTS if it.through and not set(it.through) & wanted}
    values = _named(scene) | {"effects": tuple(it for it in NAMED if it in wanted)}
    if on and NAMED[effect].model is not None and getattr(liquid, effect) is None:
        values[f"liquid.{effect}"] = _begun(scene, effect, "")
    if on:
        values |= {f"liquid.{name}": None for name in NAMED[effect].replaces}
    try:
        return override_all(scene, values)
    except StudyError as error:
        label, reason = NAMED[effect].label, str(error).partition(": ")[2]
        raise StudyError(f"{label} cannot be turned {'on' if on else 'off'}: {reason}") from error


def _named(scene: Scene) -> dict[str, object]:
    """Return effects and tables as the gate chooses them, by name."""
    taken = resolve(scene).liquids[0]
    tables = {f"liquid.{it.name}": getattr(taken, it.name).model_dump() for it in EFFECTS if it.choose is not None}
    return {"effects": taken.effects, **tables}


def _begun(scene: Scene, place: str, kind: str) -> dict[str, Any]:
    """Return the initial table of a region or an effect: around the middle of the hand's reach, as large as that."""
    centre_m, reach_m = scene.origin_m, scene.scale * _HALF_HAND_M
    if place in NAMED:
        start = NAMED[place].start
        return {} if start is None else dict(start(kind, centre_m, reach_m))
    begun: dict[str, dict[str, Any]] = {
        "everywhere": {},
        "box": {"centre_m": centre_m, "size_m": (2 * reach_m,) * 3},
        "cylinder": {"centre_m": centre_m, "radius_m": reach_m, "height_m": 2 * reach_m},
    }
    return {"kind": kind, **begun[kind]}
