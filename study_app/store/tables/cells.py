"""The format of a column's cells: a pattern, and a schema.org description of the column."""

from typing import Any

from study_app.store.tables.column import MISSING, Column, Kind


def variable(column: Column) -> dict[str, Any]:
    """Return ``column`` as a schema.org PropertyValue for ``dataset_description.json``."""
    meanings = "; ".join(f"{level}: {meaning}" for level, meaning in column.levels)
    described: dict[str, Any] = {
        "@type": "PropertyValue",
        "name": column.name,
        "description": f"{column.description} Levels: {meanings}." if meanings else column.description,
    }
    if column.unit:
        described["unitText"] = column.unit
    if column.minimum is not None:
        described["minValue"] = column.minimum
    if column.maximum is not None:
        described["maxValue"] = column.maximum
    return described


_PATTERNS: dict[Kind, str] = {
    "text": r"[\s\S]*",
    "integer": r"-?[0-9]+",
    "number": r"-?[0-9]+(\.[0-9]+)?(e[+-]?[0-9]+)?",
    "flag": "true|false",
    "time": r"[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{2}:[0-9]{2}:[0-9]{2}\.[0-9]{3}[+-][0-9]{2}:[0-9]{2}",
}


def cell_pattern(column: Column) -> str:
    """Return the regular expression of a whole cell."""
    value = "|".join(level for level, _ in column.levels) if column.levels else _PATTERNS[column.kind]
    return f"({value}|{MISSING})" if column.may_miss else f"({value})"
