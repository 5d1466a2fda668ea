"""The numbers of a liquid that a fit may vary: found by name, within the ranges of the scene's own models."""

import dataclasses
import difflib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from pydantic import BaseModel, ValidationError

from study_app.errors import StudyError
from study_app.haptics.model.effects import EFFECTS, Effect
from study_app.haptics.model.scene import Liquid, Scene

_THRESHOLDS: Final = tuple(name for effect in EFFECTS for name in effect.thresholds)
"""Thresholds, which cannot be fitted: the force does not change with them, or jumps."""
NO_LESS_THAN: Final = {"scaling": "length", "thickened_viscosity_pa_s": "zero_shear_viscosity_pa_s"}
"""Fields that must not be less than another of the same table."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """One number of a scene.

    ``name`` is its requested name, ``table`` and ``field`` its place: "liquid", "body" or an effect's table. ``least``
    and ``most`` are the limits of its model (``least`` excluded if ``above``) and of the parameters in `NO_LESS_THAN`
    that are not fitted. ``whole`` numbers are integers.
    """

    name: str
    table: str
    field: str
    value: float
    least: float
    most: float
    above: bool
    whole: bool


def find_parameters(scene: Scene, liquid_id: str, names: Sequence[str]) -> tuple[Parameter, ...]:
    """Return the parameters called ``names`` of a scene whose liquids name their effects.

    A name is a field of the liquid, of the tables of its effects or of the body, such as ``drag_coefficient``; if two
    share a name, the first in this order is used, unless the table is named: ``body.density_kg_m3``.

    Raises
    ------
    StudyError
        There is no such liquid or parameter, or a parameter is named twice or cannot be fitted.
    """
    tables = dict(_tables(scene, _liquid(scene, liquid_id)))
    if not names:
        raise StudyError("specify at least one parameter to fit, such as drag_coefficient")
    parameters = tuple(_parameter(tables, name) for name in names)
    for k, parameter in enumerate(parameters):
        for other in parameters[:k]:
            if (parameter.table, parameter.field) == (other.table, other.field):
                raise StudyError(f"{other.name} and {parameter.name} are the same parameter: specify it once")
    return tuple(_narrow_range(it, tables[it.table], parameters) for it in parameters)


def _narrow_range(it: Parameter, table: BaseModel, fitted: Sequence[Parameter]) -> Parameter:
    """Return a parameter with its range limited by the fixed fields of `NO_LESS_THAN`."""
    fields = {parameter.field for parameter in fitted if parameter.table == it.table}
    for greater, less in NO_LESS_THAN.items():
        if it.field == greater and less not in fields:
            return dataclasses.replace(it, least=float(getattr(table, less)), above=False)
        if it.field == less and greater not in fields and hasattr(table, greater):
            return dataclasses.replace(it, most=float(getattr(table, greater)))
    return it


def replace_values(scene: Scene, liquid_id: str, parameters: Sequence[Parameter], values: Sequence[float]) -> Scene:
    """Return the scene with new values; integers are rounded."""
    tree = scene.model_dump()
    for parameter, value in zip(parameters, values, strict=True):
        rows = [tree["body"]] if parameter.table == "body" else [it for it in tree["liquids"] if it["id"] == liquid_id]
        for row in rows:
            table = row if parameter.table in {"body", "liquid"} else row[parameter.table]
            table[parameter.field] = round(value) if parameter.whole else float(value)
    try:
        return Scene.model_validate(tree)
    except ValidationError as error:
        said = ", ".join(f"{it.name} = {value:g}" for it, value in zip(parameters, values, strict=True))
        raise StudyError(f"{said} is not permitted: {error.errors()[0]['msg']}") from error


def _liquid(scene: Scene, liquid_id: str) -> Liquid:
    for liquid in scene.liquids:
        if liquid.id == liquid_id:
            return liquid
    liquids = ", ".join(liquid.id for liquid in scene.liquids) or "none"
    raise StudyError(f"the scene does not contain the liquid {liquid_id!r}; its liquids are {liquids}")


def _tables(scene: Scene, liquid: Liquid) -> Iterator[tuple[str, BaseModel]]:
    """Yield the tables that affect the force, in the search order for plain names."""
    yield "liquid", liquid
    for effect in EFFECTS:
        if effect.model is not None and effect.name in liquid.effects:
            yield effect.name, _fill_open_values(scene, effect, getattr(liquid, effect.name))
    yield "body", scene.body


def _fill_open_values(scene: Scene, effect: Effect, table: BaseModel) -> BaseModel:
    """Return a table with unset parameters computed from the scene."""
    values = {name: of(scene) for name, of in effect.open_values.items() if getattr(table, name) is None}
    return table.model_copy(update=values)


def _parameter(tables: Mapping[str, BaseModel], name: str) -> Parameter:
    place, _, field = name.rpartition(".")
    if field in _THRESHOLDS:
        raise StudyError(
            f"{name} is a threshold and cannot be fitted, because the force does not change smoothly with it: set "
            "it with --set and compare the residuals"
        )
    numbers = {name: dict(_numbers(table)) for name, table in tables.items()}
    for table, fields in numbers.items():
        if field in fields and place in {"", table}:
            least, most, above, whole = fields[field]
            value = getattr(tables[table], field)
            if value is None:
                raise StudyError(
                    f"the scene does not contain an initial value for {name}: specify one with --set {name}=VALUE"
                )
            return Parameter(
                name=name,
                table=table,
                field=field,
                value=float(value),
                least=least,
                most=most,
                above=above,
                whole=whole,
            )
    known = sorted({field for fields in numbers.values() for field in fields} - set(_THRESHOLDS))
    near = difflib.get_close_matches(field, known, n=1)
    meant = f"did you mean {near[0]!r}? " if near else ""
    raise StudyError(
        f"unknown parameter {name!r}: {meant}the parameters of this liquid and its effects are {', '.join(known)}"
    )


def _numbers(table: BaseModel) -> Iterator[tuple[str, tuple[float, float, bool, bool]]]:
    """Yield every numeric field with its limits, whether the least is excluded, and whether it is an integer."""
    for field, schema in type(table).model_json_schema()["properties"].items():
        for kind in schema.get("anyOf", [schema]):
            if kind.get("type") in {"number", "integer"}:
                yield field, (*_range(kind), kind["type"] == "integer")


def _range(kind: Mapping[str, Any]) -> tuple[float, float, bool]:
    above = "exclusiveMinimum" in kind
    least = float(kind.get("exclusiveMinimum", kind.get("minimum", -math.inf)))
    return least, float(kind.get("exclusiveMaximum", kind.get("maximum", math.inf))), above
