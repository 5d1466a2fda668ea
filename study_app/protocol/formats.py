"""The formats of a study's file: what belongs to format 2, and what a file of format 2 may leave out.

Format 1 is frozen: a file of format 1 that uses anything newer has a fault, and nothing is filled in.
"""

from __future__ import annotations

import string
from collections.abc import Iterator, Mapping
from typing import Any, Final

from study_app.haptics.model.scene import FADE_S, Scene
from study_app.protocol.blocks import Block
from study_app.protocol.model import Analysis
from study_app.protocol.source.document import entries, names
from study_app.protocol.source.problems import Fault
from study_app.protocol.table import Table
from study_app.protocol.trials.stimuli import OF_LINK
from study_app.protocol.wording.languages import LANGUAGES, words

LATEST: Final = 2
TABLES: Final = ("stimuli", "designs", "methods", "groups", "sequences")
_LEVEL_LIMITS: Final = {
    "level_error_percent": 2,
    "level_error_ms": 2,
    "pace_error_percent": 40,
    "attempts": 3,
    "missing_percent": 5,
}
"""Limits of what an interval delivers, and of how many trials may be missing, with their defaults."""


def _later_keys(table: type[Table]) -> list[str]:
    """Return the sorted keys of a table that format 1 lacks."""
    return sorted(name for name, field in table.model_fields.items() if field.exclude_if is not None)


_NEW_KEYS: Final = (
    "study.codes",
    "study.credits",
    "study.block_order",
    "questionnaires.*.instrument",
    "questionnaires.*.scores",
    "questionnaires.*.items.*.kind",
    "questionnaires.*.items.*.show_if",
    "liquids.*.drag.damping_nspm",
    "liquids.*.non_newtonian",
    "scene.fade_s",
    "conditions.*.ball",
    "conditions.*.view",
    "conditions.*.overlay",
    *(f"conditions.*.{key}" for key in OF_LINK),
    *TABLES,
    "simulated_participants",
    *(f"limits.{key}" for key in _LEVEL_LIMITS),
    *(f"blocks.*.{key}" for key in _later_keys(Block)),
    *(f"analysis.{key}" for key in _later_keys(Analysis)),
)
"""Keys that belong to format 2, as patterns of places in the file."""
_NEW_VALUES: Final = {
    "liquids.*.drag.law": ("linear",),
    "liquids.*.effects.*": ("unsteady_drag", "non_newtonian"),
    "tasks.*.kind": ("follow",),
}
"""Values of earlier keys that belong to format 2."""

_HINT: Final = 'write format = 2; only effects = "auto" and an omitted scene.velocity change their meaning'
ESTIMATOR: Final = "kalman"
_WORKSPACE_MM: Final = (100.0, 60.0, 60.0)
_DENSITY_KG_M3: Final = 1000.0


def is_unknown_format(document: Mapping[str, Any]) -> bool:
    """Return whether a file has an unknown format, so that its other content cannot be checked."""
    stated = document.get("format")
    return isinstance(stated, int) and stated > LATEST


def is_format_2(document: Mapping[str, Any]) -> bool:
    """Return whether a file has format 2."""
    return bool(document.get("format") == 2 and not isinstance(document["format"], bool))


def newer_keys(document: Mapping[str, Any]) -> Iterator[Fault]:
    """Yield a fault for every part of a format 1 file that belongs to format 2."""
    for pattern in _NEW_KEYS:
        for path, _ in entries(document, pattern):
            yield Fault(path, "belongs to format 2", _HINT, kind="surplus")
    for pattern, values in _NEW_VALUES.items():
        for path, stated in entries(document, pattern):
            if stated in values:
                yield Fault(path, f'"{stated}" belongs to format 2', _HINT, kind="surplus")
    known = {*names(document, "pages"), *names(document, "blocks")}
    for path, name in entries(document, "sequence.*"):
        if name in names(document, "questionnaires") and name not in known:
            yield Fault(path, "a questionnaire outside a block requires format 2", _HINT, kind="surplus")


def upgrade(document: Mapping[str, Any]) -> tuple[dict[str, Any], list[Fault]]:
    """Return a study's document with the defaults of format 2, and faults for newer keys in format 1."""
    if is_format_2(document):
        return _with_omitted_keys(document), []
    return dict(document), [] if is_unknown_format(document) else list(newer_keys(document))


def _with_omitted_keys(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return a format 2 document with its omitted keys filled in; invalid parts are unchanged."""
    completed = dict(document)
    head = completed.get("study", {})
    if isinstance(head, dict):
        completed["study"] = {"version": "1", "languages": ("en",), **head}
        if isinstance(head.get("name"), str):
            completed["study"].setdefault("title", dict.fromkeys(_languages(completed), head["name"]))
    completed["device"] = _with_defaults(completed.get("device", {}), workspace_mm=_WORKSPACE_MM)
    if any(
        "stimulus" in block or "design" in block
        for _, block in entries(completed, "blocks.*")
        if isinstance(block, Mapping)
    ):
        completed["limits"] = _with_defaults(completed.get("limits", {}), **_LEVEL_LIMITS)
    completed = with_scene_defaults(completed)
    if isinstance(liquids := completed.get("liquids", {}), dict):
        completed.setdefault("conditions", {name: {"liquid": name} for name in liquids})
    if isinstance(blocks := completed.get("blocks", {}), dict) and blocks:
        completed["blocks"] = _with_numbers(blocks, names(completed, "tasks"), _languages(completed))
        own = {"sequence", "sequences"}  # if each group has one, the study needs none
        groups = [isinstance(group, Mapping) and group.keys() & own for _, group in entries(completed, "groups.*")]
        if "sequences" not in completed and not (groups and all(groups)):
            completed.setdefault("sequence", tuple(blocks))
    return completed


def with_scene_defaults(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return a format 2 document with the omitted estimator and densities of dampers."""
    completed = dict(document)
    completed["scene"] = _with_defaults(completed.get("scene", {}), velocity={"kind": ESTIMATOR})
    if isinstance(liquids := completed.get("liquids", {}), dict):
        completed["liquids"] = {name: _with_density(table) for name, table in liquids.items()}
    return completed


def format_of_scene(scene: Scene) -> int:
    """Return the format in which a scene file must be written."""
    newer = any(
        liquid.drag.law == "linear" or "unsteady_drag" in liquid.effects or liquid.non_newtonian is not None
        for liquid in scene.liquids
    )
    return 2 if newer or scene.fade_s != FADE_S else scene.format


_OMITTED: Final = {
    "": ("device", "conditions", "sequence"),
    "study": ("title", "version", "languages"),
    "device": ("workspace_mm",),
    "blocks": ("title", "setting_label", "task"),
}
"""Keys of the file and of its tables that a file of format 2 may leave out."""


def relax_schema(schema: dict[str, Any]) -> None:
    """Require the keys of `_OMITTED` in a protocol's JSON Schema for format 1 only."""
    tables = {"study": "StudyHead", "device": "DeviceNeeds", "blocks": "Block"}
    asked: dict[str, Any] = {}
    for section, keys in _OMITTED.items():
        node = schema["$defs"][tables[section]] if section else schema
        node["required"] = [key for key in node["required"] if key not in keys]
        if section:
            inner = {"required": list(keys)}
            asked[section] = {"patternProperties": {"": inner}} if section == "blocks" else inner
    schema["if"] = {"properties": {"format": {"const": 1}}}
    schema["then"] = {"required": list(_OMITTED[""]), "properties": asked}
    questions = schema["$defs"]["Questionnaire"]
    questions["if"] = {"not": {"required": ["instrument"]}}
    questions["then"] = {"required": questions.pop("required")}


def _with_defaults(table: Any, **defaults: Any) -> Any:
    return {**defaults, **table} if isinstance(table, dict) else table


def _languages(document: Mapping[str, Any]) -> tuple[str, ...]:
    return tuple(
        name for _, name in entries(document, "study.languages.*") if isinstance(name, str) and name in LANGUAGES
    ) or ("en",)


def _with_density(liquid: Any) -> Any:
    """Add a density, which has no effect, to a liquid that is only a linear damper."""
    if not isinstance(liquid, dict):
        return liquid
    drag = liquid.get("drag")
    damper = isinstance(drag, Mapping) and drag.get("law") == "linear" and liquid.get("effects", ("drag",)) == ("drag",)
    return _with_defaults(liquid, density_kg_m3=_DENSITY_KG_M3) if damper else liquid


def _with_numbers(blocks: Mapping[str, Any], tasks: tuple[str, ...], languages: tuple[str, ...]) -> dict[str, Any]:
    """Return the blocks with numbers and unused code letters for the main ones, and names for all blocks and trials."""
    taken = [table.get("code_prefix") for table in blocks.values() if isinstance(table, Mapping)]
    letters = (letter for letter in string.ascii_uppercase if letter not in taken)
    numbered: dict[str, Any] = {}
    part = 0
    for name, table in blocks.items():
        if not isinstance(table, dict):
            numbered[name] = table
            continue
        defaults: dict[str, Any] = {
            "title": name.replace("_", " ").capitalize(),
            "setting_label": {language: words(language).trial for language in languages},
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
        numbered[name] = {**defaults, **table}
    return numbered
