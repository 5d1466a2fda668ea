"""The parameters of a liquid that can be fitted, by name, with the ranges that the scene's models permit."""

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
"""Thresholds, which cannot be fitted, since the force does not change smoothly with them."""
NO_LESS_THAN: Final = {"scaling": "length", "thickened_viscosity_pa_s": "zero_shear_viscosity_pa_s"}
"""Fields that must not be less than another field of the same table."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A numeric parameter of a scene.

    ``name`` is the requested name. ``table`` is "liquid", "body" or the name of an effect, and ``field`` the field
    there. ``least`` and ``most`` are the limits of its model (``least`` excluded if ``above``) and of the parameters in
    `NO_LESS_THAN` that are not fitted. ``whole`` means that it is an integer.
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
    """Return the parameters with these names in a scene whose liquids name their effects.

    A name is a field of the liquid, of its effects or of the body, such as ``drag_coefficient``. If several fields have
    this name, the first in this order is used; ``body.density_kg_m3`` selects the field of a table.

    Raises
    ------
    StudyError
        There is no such liquid or parameter, or a parameter is named twice or cannot be fitted.
    """
    tables = dict(_effective_tables(scene, _find_liquid(scene, liquid_id)))
    if not names:
        raise StudyError("specify at least one parameter to fit, such as drag_coefficient")
    parameters = tuple(_find_parameter(tables, name) for name in names)
    for k, parameter in enumerate(parameters):
        for other in parameters[:k]:
            if (parameter.table, parameter.field) == (other.table, other.field):
                raise StudyError(f"{other.name} and {parameter.name} are the same parameter: specify it once")
    return tuple(_narrow_range(parameter, tables[parameter.table], parameters) for parameter in parameters)


def _narrow_range(parameter: Parameter, table: BaseModel, fitted: Sequence[Parameter]) -> Parameter:
    """Return a parameter with its range limited by the fixed fields of `NO_LESS_THAN`."""
    fields = {other.field for other in fitted if other.table == parameter.table}
    for greater, less in NO_LESS_THAN.items():
        if parameter.field == greater and less not in fields:
            return dataclasses.replace(parameter, least=float(getattr(table, less)), above=False)
        if parameter.field == less and greater not in fields and hasattr(table, greater):
            return dataclasses.replace(parameter, most=float(getattr(table, greater)))
    return parameter


def replace_values(scene: Scene, liquid_id: str, parameters: Sequence[Parameter], values: Sequence[float]) -> Scene:
    """Return the scene with new values; integers are rounded."""
    tree = scene.model_dump()
    for parameter, value in zip(parameters, values, strict=True):
        rows = (
            [tree["body"]] if parameter.table == "body" else [row for row in tree["liquids"] if row["id"] == liquid_id]
        )
        for row in rows:
            table = row if parameter.table in {"body", "liquid"} else row[parameter.table]
            table[parameter.field] = round(value) if parameter.whole else float(value)
    try:
        return Scene.model_validate(tree)
    except ValidationError as error:
        new_values = ", ".join(
            f"{parameter.name} = {value:g}" for parameter, value in zip(parameters, values, strict=True)
        )
        raise StudyError(f"{new_values} is not permitted: {error.errors()[0]['msg']}") from error


def _find_liquid(scene: Scene, liquid_id: str) -> Liquid:
    for liquid in scene.liquids:
        if liquid.id == liquid_id:
            return liquid
    liquids = ", ".join(liquid.id for liquid in scene.liquids) or "none"
    raise StudyError(f"the scene does not contain the liquid {liquid_id!r}; its liquids are {liquids}")


def _effective_tables(scene: Scene, liquid: Liquid) -> Iterator[tuple[str, BaseModel]]:
    """Yield the tables that affect the force, in the order in which a name is searched."""
    yield "liquid", liquid
    for effect in EFFECTS:
        if effect.model is not None and effect.name in liquid.effects:
            yield effect.name, _fill_open_values(scene, effect, getattr(liquid, effect.name))
    yield "body", scene.body


def _fill_open_values(scene: Scene, effect: Effect, table: BaseModel) -> BaseModel:
    """Return a table with unset parameters computed from the scene."""
    values = {name: value_in(scene) for name, value_in in effect.open_values.items() if getattr(table, name) is None}
    return table.model_copy(update=values)


def _find_parameter(tables: Mapping[str, BaseModel], name: str) -> Parameter:
    prefix, _, field = name.rpartition(".")
    if field in _THRESHOLDS:
        raise StudyError(
            f"{name} is a threshold and cannot be fitted, because the force does not change smoothly with it: set "
            "it with --set and compare the residuals"
        )
    numbers = {name: dict(_numeric_fields(table)) for name, table in tables.items()}
    for table, fields in numbers.items():
        if field in fields and prefix in {"", table}:
            minimum, maximum, above, whole = fields[field]
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
                least=minimum,
                most=maximum,
                above=above,
                whole=whole,
            )
    known = sorted({field for fields in numbers.values() for field in fields} - set(_THRESHOLDS))
    similar = difflib.get_close_matches(field, known, n=1)
    suggestion = f"did you mean {similar[0]!r}? " if similar else ""
    raise StudyError(
        f"unknown parameter {name!r}: {suggestion}the parameters of this liquid and its effects are {', '.join(known)}"
    )


def _numeric_fields(table: BaseModel) -> Iterator[tuple[str, tuple[float, float, bool, bool]]]:
    """Yield each numeric field with its limits, whether the lower one is excluded, and whether it is an integer."""
    for field, schema in type(table).model_json_schema()["properties"].items():
        for kind in schema.get("anyOf", [schema]):
            if kind.get("type") in {"number", "integer"}:
                yield field, (*_range(kind), kind["type"] == "integer")


def _range(kind: Mapping[str, Any]) -> tuple[float, float, bool]:
    above = "exclusiveMinimum" in kind
    minimum = float(kind.get("exclusiveMinimum", kind.get("minimum", -math.inf)))
    return minimum, float(kind.get("exclusiveMaximum", kind.get("maximum", math.inf))), above
