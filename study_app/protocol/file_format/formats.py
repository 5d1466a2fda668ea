"""The format of study and scene files: its number, and the keys that a file may omit."""

from __future__ import annotations

import string
from collections.abc import Mapping
from typing import Any, Final

from study_app.protocol.model import FORMAT
from study_app.protocol.source.document import entries, names
from study_app.protocol.source.problems import Fault
from study_app.protocol.wording.languages import words_or_english

_LEVEL_LIMITS: Final = {
    "level_error_percent": 2,
    "level_error_ms": 2,
    "pace_error_percent": 40,
    "attempts": 3,
    "missing_percent": 5,
}
"""Default limits for delivered intervals and missing trials, in studies with a design."""


ESTIMATOR: Final = "kalman"
_WORKSPACE_MM: Final = (100.0, 60.0, 60.0)
_DENSITY_KG_M3: Final = 1000.0


def format_fault(document: Mapping[str, Any]) -> Fault | None:
    """Return the fault of a file in another format, whose content cannot be checked, or None."""
    stated = document.get("format")
    if type(stated) is not int or stated < 1 or stated == FORMAT:
        return None
    newer = stated > FORMAT
    hint = "use a newer version of liquid-study" if newer else "run liquid-study upgrade FILE"
    return Fault(("format",), f"is {stated}, but this program reads format {FORMAT}", hint)


def with_omitted_keys(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return a study's document with its omitted keys filled in; invalid parts are unchanged."""
    completed = dict(document)
    study_table = completed.get("study", {})
    if isinstance(study_table, dict):
        completed["study"] = {"version": "1", "languages": ("en",), **study_table}
        if isinstance(study_table.get("name"), str):
            completed["study"].setdefault("title", dict.fromkeys(_languages(completed), study_table["name"]))
    completed["device"] = _add_defaults(completed.get("device", {}), workspace_mm=_WORKSPACE_MM)
    if any(
        "stimulus" in block or "design" in block
        for _, block in entries(completed, "blocks.*")
        if isinstance(block, Mapping)
    ):
        completed["limits"] = _add_defaults(completed.get("limits", {}), **_LEVEL_LIMITS)
    completed = with_scene_defaults(completed)
    if isinstance(liquids := completed.get("liquids", {}), dict):
        completed.setdefault("conditions", {name: {"liquid": name} for name in liquids})
    if isinstance(blocks := completed.get("blocks", {}), dict) and blocks:
        completed["blocks"] = _add_block_defaults(blocks, names(completed, "tasks"), _languages(completed))
        sequence_keys = {"sequence", "sequences"}  # the study needs none if each group has its own
        groups = [
            isinstance(group, Mapping) and group.keys() & sequence_keys for _, group in entries(completed, "groups.*")
        ]
        if "sequences" not in completed and not (groups and all(groups)):
            completed.setdefault("sequence", tuple(blocks))
    return completed


def with_scene_defaults(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return a study's or scene's document with an omitted estimator, and omitted densities of dampers, filled in."""
    completed = dict(document)
    completed["scene"] = _add_defaults(completed.get("scene", {}), velocity={"kind": ESTIMATOR})
    if isinstance(liquids := completed.get("liquids"), dict):
        completed["liquids"] = {name: _add_density(table) for name, table in liquids.items()}
    return completed


_OMITTED: Final = {
    "": ("device", "conditions", "sequence"),
    "study": ("title", "version", "languages"),
    "device": ("workspace_mm",),
    "blocks": ("title", "setting_label", "task"),
}
"""Keys of the whole file ("") and of its tables that may be omitted."""


def relax_schema(schema: dict[str, Any]) -> None:
    """Remove the keys of `_OMITTED` from those that a protocol's JSON Schema requires."""
    tables = {"study": "StudyHead", "device": "DeviceNeeds", "blocks": "Block"}
    for section, keys in _OMITTED.items():
        node = schema["$defs"][tables[section]] if section else schema
        node["required"] = [key for key in node["required"] if key not in keys]
    questions = schema["$defs"]["Questionnaire"]
    questions["if"] = {"not": {"required": ["instrument"]}}
    statement = {"type": "object", "not": {"required": ["kind"]}}
    questions["then"] = {
        "required": questions.pop("required"),
        "if": {"properties": {"items": {"contains": statement}}, "required": ["items"]},
        "then": {"required": ["scale"]},
    }


def _add_defaults(table: Any, **defaults: Any) -> Any:
    return {**defaults, **table} if isinstance(table, dict) else table


def _languages(document: Mapping[str, Any]) -> tuple[str, ...]:
    return tuple(name for _, name in entries(document, "study.languages.*") if isinstance(name, str)) or ("en",)


def _add_density(liquid: Any) -> Any:
    """Add a density, which has no effect, to a liquid that is only a linear damper."""
    if not isinstance(liquid, dict):
        return liquid
    drag = liquid.get("drag")
    is_damper = (
        isinstance(drag, Mapping) and drag.get("law") == "linear" and liquid.get("effects", ("drag",)) == ("drag",)
    )
    return _add_defaults(liquid, density_kg_m3=_DENSITY_KG_M3) if is_damper else liquid


def _add_block_defaults(
    blocks: Mapping[str, Any], tasks: tuple[str, ...], languages: tuple[str, ...]
) -> dict[str, Any]:
    """Return the blocks with default titles and trial labels, and with parts and code letters for main blocks."""
    used_letters = [table.get("code_prefix") for table in blocks.values() if isinstance(table, Mapping)]
    letters = (letter for letter in string.ascii_uppercase if letter not in used_letters)
    completed: dict[str, Any] = {}
    part = 0
    for name, table in blocks.items():
        if not isinstance(table, dict):
            completed[name] = table
            continue
        defaults: dict[str, Any] = {
            "title": name.replace("_", " ").capitalize(),
            "setting_label": {language: words_or_english(language).trial for language in languages},
        }
        if len(tasks) == 1:
            defaults["task"] = tasks[0]
        if "stimulus" in table:
            defaults |= {"design": "2ifc", "method": "questplus"}
        if table.get("phase", "main") == "main":
            part = table["part"] if isinstance(table.get("part"), int) else part + 1
            defaults["part"] = part
            if "code_prefix" not in table:
                defaults["code_prefix"] = next(letters, "Z")
        if len(languages) > 1:
            defaults["title"] = dict.fromkeys(languages, defaults["title"])
        completed[name] = {**defaults, **table}
    return completed
