"""Standard questionnaires: a study names one, and its items, scales and scoring are put in its place.

Texts are shipped where their licence permits it; of the others a study writes them, by the ids of the items.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final

from study_app.protocol.forms.kinds import KINDS, STATEMENT
from study_app.protocol.source.document import entries
from study_app.protocol.source.problems import Fault, did_you_mean

FOLDER: Final = Path(__file__).parent
_TEXTS: Final = ("text", "short", "low", "high")


def instruments() -> tuple[str, ...]:
    """Return the ids of the standard questionnaires, sorted."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


@cache
def instrument(name: str) -> Mapping[str, Any]:
    """Return a standard questionnaire as its file holds it (OSError if there is none)."""
    return tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))


def with_instruments(document: Mapping[str, Any]) -> tuple[dict[str, Any], list[Fault]]:
    """Return a study's document with the items of its standard questionnaires, and what is missing of them."""
    found, faults = dict(document), list[Fault]()
    tables = document.get("questionnaires")
    if not isinstance(tables, Mapping):
        return found, faults
    languages = tuple(name for _, name in entries(document, "study.languages.*") if isinstance(name, str))
    written = document.get("scales", {})
    filled, scales = dict(tables), dict(written) if isinstance(written, Mapping) else {}
    for name, table in tables.items():
        if not isinstance(table, Mapping) or "instrument" not in table:
            continue
        path = ("questionnaires", name, "instrument")
        if table["instrument"] not in instruments():
            known = did_you_mean(str(table["instrument"]), instruments())
            faults.append(Fault(path, f'there is no instrument "{table["instrument"]}"', known))
            continue
        missing = _missing_scales(table["instrument"], languages, scales)
        filled[name], lacking = _filled(name, table, languages)
        faults += lacking
        for scale, points in missing.items():
            message = f"the labels of its scale may not be shipped, or not in {', '.join(languages)}"
            faults.append(Fault(path, message, f"write [scales.{scale}] with {points} labels"))
    kept = {"scales": scales} if scales else {}
    return {**found, "questionnaires": filled, **kept}, faults


def scale_name(of: str, scale: str) -> str:
    """Return what a study calls a scale of a standard questionnaire."""
    return f"{of.replace('-', '_')}_{scale}"


def _missing_scales(of: str, languages: tuple[str, ...], scales: dict[str, Any]) -> dict[str, int]:
    """Add the scales of a standard questionnaire; return those whose labels are not shipped, with their points."""
    missing = {}
    for name, table in instrument(of).get("scales", {}).items():
        own = scale_name(of, name)
        labels = table.get("labels", {})
        if own in scales:
            continue
        if all(language in labels for language in languages):
            scales[own] = {"labels": {language: tuple(labels[language]) for language in languages}}
        else:
            missing[own] = table["points"]
    return missing


def _filled(name: str, table: Mapping[str, Any], languages: tuple[str, ...]) -> tuple[dict[str, Any], list[Fault]]:
    """Return a questionnaire with the items of its instrument, in which those that the study writes come first."""
    of = str(table["instrument"])
    source = instrument(of)
    own = {item["id"]: item for item in _own_items(table)}
    known = [item["id"] for item in source["items"]]
    place = ("questionnaires", name)
    faults = [
        Fault((*place, "items", index, "id"), f'"{item["id"]}" is not an item of {of}', did_you_mean(item["id"], known))
        for index, item in enumerate(_own_items(table))
        if item["id"] not in known
    ]
    items, missing = [], []
    for item in source["items"]:
        made = {**_in_languages(item, languages), **own.get(item["id"], {})}
        made.setdefault("short", dict.fromkeys(languages, item["id"].replace("_", " ").capitalize()))
        if "scale" in item:
            made["scale"] = scale_name(of, item["scale"])
        if "options" in item and "options" not in own.get(item["id"], {}):
            made["options"] = tuple(_in_languages(option, languages) for option in item["options"])
        if any(key not in made for key in _needed(item)):
            missing.append(item["id"])
        items.append(made)
    if missing:
        shipped = ", ".join(source["languages"])
        why = f'the texts of "{of}" exist in {shipped}' if shipped else f'the texts of "{of}" may not be shipped'
        message = f"{why}: {len(missing)} item{'s need' if len(missing) > 1 else ' needs'} a text"
        faults.append(Fault((*place, "instrument"), message, f"items with these ids: {', '.join(missing)}"))
    texts = {
        key: {language: source[key][language] for language in languages}
        for key in ("title", "intro")
        if all(language in source.get(key, {}) for language in languages)
    }
    scores = {"scores": {key: _as_tuples(value) for key, value in source["scores"].items()}}
    return {**texts, **scores, **table, "items": tuple(items)}, faults


def _own_items(table: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    for _, item in entries(table, "items.*"):
        if isinstance(item, Mapping) and isinstance(item.get("id"), str):
            yield item


def _needed(item: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the texts that a question of its kind cannot do without."""
    fields = KINDS[item.get("kind", STATEMENT)].model_fields
    return tuple(name for name in _TEXTS if name in fields and fields[name].is_required())


def _in_languages(item: Mapping[str, Any], languages: tuple[str, ...]) -> dict[str, Any]:
    """Return an item or option with its texts in these languages, without those that lack one of them."""
    found = {}
    for key, value in item.items():
        if key not in _TEXTS:
            found[key] = value
        elif all(language in value for language in languages):
            found[key] = {language: value[language] for language in languages}
    return found


def _as_tuples(score: Mapping[str, Any]) -> dict[str, Any]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in score.items()}
