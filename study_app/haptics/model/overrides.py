"""Parameters of a scene set by name, as ``simulate --set`` does."""

import difflib
import tomllib
from collections.abc import Mapping
from typing import Any, TypeAlias

from pydantic import ValidationError

from study_app.errors import StudyError
from study_app.haptics.model.effects import EFFECTS
from study_app.haptics.model.scene import Scene

Tables: TypeAlias = "dict[str, list[dict[str, Any]]]"

_SHOWN = 200  # characters of a bad value shown in messages

# The tables a parameter may be in, in the order in which a plain name is looked up.
_OF_A_LIQUID = ("region", *(it.name for it in EFFECTS if it.model is not None and not it.with_liquid))
_OF_THE_SCENE = ("body", "velocity", "knee", "accuracy", "motion")
_FIXED = {"id", "liquids", "link"}


def override_value(scene: Scene, name: str, value: object) -> Scene:
    """Return ``scene`` with the one parameter called ``name`` set to ``value``; see `override_all`."""
    return override_all(scene, {name: value})


def override_all(scene: Scene, values: Mapping[str, object]) -> Scene:
    """Return ``scene`` with parameters set by name, validated once all are set.

    A name is that of a field of the liquid, one of its tables (``wake``, ``drag``, ``region``, ...), a table of the
    scene (``body``, ``velocity``, ...) or the scene itself. Where several share one, the first found in this order
    counts, unless the table is named: ``density_kg_m3`` is the liquid's, ``body.density_kg_m3`` the body's. A whole
    table may be set as an inline table of TOML: ``current={kind="uniform", velocity_mps=[1, 0, 0]}``; a new ``kind``
    brings its own defaults. With several liquids all that have the parameter get it. Text is read as the field's type;
    tuples are split at commas.

    Raises
    ------
    StudyError
        A name is unknown, or a value is out of range.
    """
    tree = _tree(scene)
    for name, value in values.items():
        for table, field in _places(_tables(tree), name):
            _set_field(table, field, value)
    try:
        return Scene.model_validate(tree)
    except ValidationError as error:
        named = ", ".join(f"{_shorten_value(name)} = {_shorten_value(value)}" for name, value in values.items())
        reasons = "; ".join(_reason(problem["loc"], problem["msg"]) for problem in error.errors())
        raise StudyError(f"cannot set {named}: {reasons}") from error


def value_of(scene: Scene, name: str) -> float:
    """Return the number called ``name`` in a scene; see `override_all` for names.

    Raises
    ------
    StudyError
        The name is unknown, or its value is not a number.
    """
    table, field = _places(_tables(_tree(scene)), name)[0]
    value = table[field]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise StudyError(f"{_shorten_value(name)} must be a number, not {_shorten_value(value)}")
    return float(value)


def number_names(scene: Scene) -> tuple[str, ...]:
    """Return the plain names of a scene's numbers, sorted."""
    leaves = {key: value for rows in _tables(_tree(scene)).values() for row in rows for key, value in row.items()}
    numbers = (name for name, value in leaves.items() if isinstance(value, int | float) and not isinstance(value, bool))
    return tuple(sorted(numbers))


def _shorten_value(value: object) -> str:
    text = str(value)
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}…"


def _reason(place: tuple[int | str, ...], message: str) -> str:
    name = ".".join(str(part) for part in place if part != "liquids" and not isinstance(part, int))
    said = message.removeprefix("Value error, ").split(", unable to parse")[0].replace("Input should be", "must be")
    if "valid dictionary" in said:
        said = "is a table of parameters: set one parameter by its name, such as --set drag_coefficient=0.42"
    return f"{name}{' ' if said.startswith(('must ', 'is ')) else ': '}{said}" if name else said


def _tree(scene: Scene) -> dict[str, Any]:
    """Return a scene as tables, with every table that a liquid may have."""
    tree = scene.model_dump()
    tree["accuracy"].setdefault("without", ())
    for liquid in tree["liquids"]:
        for name in _OF_A_LIQUID:
            liquid.setdefault(name, None)
    return tree


def _tables(tree: dict[str, Any]) -> Tables:
    """Return the tables of a scene by name, in the search order for plain names."""
    liquids = list(tree["liquids"])
    tables = {"liquid": liquids}
    for name in _OF_A_LIQUID:
        tables[name] = [liquid[name] for liquid in liquids if liquid[name] is not None]
    for name in _OF_THE_SCENE:
        tables[name] = [tree[name]]
    for effect in EFFECTS:
        if effect.with_liquid:  # after the knee, whose law a plain name means
            tables[effect.name] = [liquid[effect.name] for liquid in liquids]
    return {**tables, "scene": [tree]}


def _places(tables: Tables, name: str) -> list[tuple[dict[str, Any], str]]:
    """Return the (table, field) pairs to which ``name`` refers."""
    place, _, field = name.rpartition(".")
    for table_name, rows in tables.items():
        places = [(row, field) for row in rows if field in row and place in {"", table_name}]
        if places and field not in _FIXED and (place or field != "kind"):
            return places
    leaves = {key for rows in tables.values() for row in rows for key in row}
    known = sorted(leaves - _FIXED - {"kind"} - tables.keys())
    near = difflib.get_close_matches(field, known, n=1)
    meant = f"did you mean {near[0]!r}? " if near else ""
    raise StudyError(
        f"this scene does not have the parameter {_shorten_value(name)!r}: {meant}its parameters are {', '.join(known)}"
    )


def _set_field(table: dict[str, Any], field: str, value: object) -> None:
    """Set one field; a table of another kind begins with the defaults of that kind."""
    if isinstance(value, str):
        value = _parse_value(value, table[field], field)
    if field == "kind" and value != table[field]:
        table.clear()
    table[field] = value


def _parse_value(text: str, present: object, field: str) -> object:
    """Return the value of a text whose type does not follow from the field's type alone."""
    if text.startswith("{"):
        try:
            return tomllib.loads(f"table = {text}")["table"]
        except tomllib.TOMLDecodeError as error:
            example = f'{field}={{kind="uniform", velocity_mps=[1, 0, 0]}}'
            raise StudyError(
                f"cannot read {field} = {_shorten_value(text)}: write a table such as {example}"
            ) from error
    several = isinstance(present, tuple) or field == "effects" or "," in text
    return tuple(text.split(",")) if several and text != "auto" else text
