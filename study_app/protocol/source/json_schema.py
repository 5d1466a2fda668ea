"""The JSON Schema of a protocol file."""

from __future__ import annotations

from copy import deepcopy
from functools import cache
from typing import Any, Final

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import to_jsonable_python

from study_app.protocol.formats import relax
from study_app.protocol.model import Protocol

LIQUID_FILE = "A liquid file with one liquid, in place of the keys of this table: its path, relative to this file."


LINEAR_DRAG: Final = {"properties": {"law": {"const": "linear"}}, "required": ["law"]}
NEED_NO_DENSITY: Final = [{"required": ["file"]}, {"properties": {"drag": LINEAR_DRAG}, "required": ["drag"]}]
"""Liquids without a density: those of a file, and in format 2 dampers."""


class _Generator(GenerateJsonSchema):
    """Writes defaults as they are; pydantic would make a validator for the type of each."""

    def encode_default(self, dft: Any) -> Any:
        """Return a default as JSON."""
        return to_jsonable_python(dft)


@cache
def schema(of: type[BaseModel] = Protocol) -> dict[str, Any]:
    """Return the JSON Schema of a protocol file: what each key may be, and what it means."""
    described = of.model_json_schema(schema_generator=_Generator)
    for node in described["properties"].values():
        if "patternProperties" in node:
            node["additionalProperties"] = False
    for table in ("Liquid", "Block"):  # their id is the name of their table
        for part in described["$defs"].values():
            if part.get("title") == table:
                part["properties"].pop("id")
                part["required"].remove("id")
                if "body" in part["properties"]:  # a liquid of a study may be that of a file instead
                    part["properties"]["file"] = {"type": "string", "description": LIQUID_FILE}
                    part["if"], part["then"] = {"not": {"anyOf": NEED_NO_DENSITY}}, {"required": part.pop("required")}
    if of is Protocol:
        relax(described)
        items = described["$defs"]["Questionnaire"]["properties"]["items"]["items"]
        items["anyOf"] = items.pop("oneOf")  # a statement, which has no kind, is a text too, whose kind has a default
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **described}


def editor_schema() -> dict[str, Any]:
    """Return the JSON Schema for editors that complete and check while one writes.

    Unlike `schema` it asks for whole questions only where no instrument supplies what a study leaves out of them.
    """
    described = deepcopy(schema())
    tables = described["$defs"]
    questions = tables["Questionnaire"]
    items = questions["properties"]["items"]["items"]
    whole = items["anyOf"]
    partial = [{**tables[kind["$ref"].rsplit("/", 1)[-1]], "required": ["id"]} for kind in whole]
    items["anyOf"] = [*whole, *partial]
    questions["then"]["properties"] = {"items": {"items": {"anyOf": whole}}}
    return described
