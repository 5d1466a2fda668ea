"""Questionnaires: questions that are answered together, standard ones, and the scores computed from the answers."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

from pydantic import Field, model_validator

from study_app.haptics.model.ranges import later, within
from study_app.protocol.questions import KINDS, STATEMENT, AnyQuestion, Context, Question, Scale, Statement
from study_app.protocol.source.document import entries
from study_app.protocol.source.problems import Fault, unknown
from study_app.protocol.table import Id, Localised, Table, invalid

Weight = Annotated[float, within(-1e6, 1e6, "no instrument has larger weights")]


class Score(Table):
    """One score: ``offset`` + ``factor`` × the sum or mean of the items' answers, some of them reversed or weighted.

    A reversed answer a of an item from l to h counts as l + h − a, times −1 where the item has no bounds. With
    ``weights_from`` an item's weight is how often its id was chosen in these items (Hart & Staveland 1988, paired
    comparisons), and a ``mean`` is divided by the sum of the weights.
    """

    items: Annotated[tuple[Id, ...], Field(min_length=1)] = Field(description="The items that are combined.")
    reverse: tuple[Id, ...] = Field(default=(), description="Of these, the items whose answers are reversed.")
    combine: Literal["mean", "sum"] = Field(default="mean", description="mean: their mean; sum: their sum.")
    factor: Weight = Field(default=1, description="Factor by which the result is multiplied.")
    offset: Weight = Field(default=0, description="Number that is then added.")
    weights: dict[Id, Weight] = Field(default_factory=dict, description="Weight of an item; left out: 1.")
    weights_from: tuple[Id, ...] = Field(
        default=(), description="Choices between items: each item's weight is how often it was chosen."
    )

    @model_validator(mode="after")
    def _names_its_items(self) -> Self:
        for key in ("reverse", "weights"):
            for name in getattr(self, key):
                if name not in self.items:
                    raise invalid(f'"{name}" is not among the items of the score', key)
        return self


def score(
    rule: Score, answers: Mapping[str, float | str], bounds: Mapping[str, tuple[float, float] | None]
) -> float | None:
    """Return a score; None where an answer that it needs is missing.

    ``answers`` are by item the number it was answered with, or the option that was chosen; ``bounds`` its smallest and
    largest answer, for reversed items.
    """
    if any(name not in answers for name in (*rule.items, *rule.weights_from)):
        return None
    chosen = [answers[name] for name in rule.weights_from]
    total = weight_sum = 0.0
    for name in rule.items:
        value = float(answers[name])
        if name in rule.reverse:
            ends = bounds.get(name)
            value = -value if ends is None else ends[0] + ends[1] - value
        weight = float(chosen.count(name)) if rule.weights_from else rule.weights.get(name, 1.0)
        total += weight * value
        weight_sum += weight
    if rule.combine == "mean":
        if weight_sum == 0:
            return None
        total /= weight_sum
    return rule.factor * total + rule.offset


class Questionnaire(Table):
    """Questions that are answered after a trial, or on their own where ``sequence`` names the questionnaire."""

    title: Localised | None = Field(default=None, description="Heading; left out: the name of the setting.")
    intro: Localised = Field(description="The question above the statements.")
    scale: Id | None = Field(default=None, description="The scale of all statements; left out where there are none.")
    item_order: Literal["fixed", "shuffled"] = Field(
        default="fixed", description="fixed: as written; shuffled: anew in every trial."
    )
    items: tuple[AnyQuestion, ...] = Field(
        min_length=1, description="The questions; one without kind is a statement on the questionnaire's scale."
    )
    instrument: str | None = later(
        default=None, description="The standard questionnaire whose items and scoring are used."
    )
    scores: dict[Id, Score] = later(default_factory=dict, description="Numbers computed from the answers.")

    @property
    def statements(self) -> tuple[Question, ...]:
        """The items that are rated on the questionnaire's scale."""
        return tuple(item for item in self.items if isinstance(item, Statement))

    def item(self, item_id: str) -> Question:
        """Return the item of that id (KeyError if there is none)."""
        return {item.id: item for item in self.items}[item_id]

    def context(self, scales: Mapping[str, Scale], language: str) -> Context:
        """Return what its items are asked with."""
        return Context(scales, self.scale, language)


FOLDER: Final = Path(__file__).parent / "instruments"
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
            wrong = str(table["instrument"])
            faults.append(unknown(path, f'there is no instrument "{wrong}"', wrong, instruments()))
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
        unknown((*place, "items", index, "id"), f'"{item["id"]}" is not an item of {of}', item["id"], known)
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
        fields = KINDS[item.get("kind", STATEMENT)].model_fields
        if any(key in fields and fields[key].is_required() and key not in made for key in _TEXTS):
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
    scores = {
        name: {key: tuple(value) if isinstance(value, list) else value for key, value in score.items()}
        for name, score in source["scores"].items()
    }
    return {**texts, "scores": scores, **table, "items": tuple(items)}, faults


def _own_items(table: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    for _, item in entries(table, "items.*"):
        if isinstance(item, Mapping) and isinstance(item.get("id"), str):
            yield item


def _in_languages(item: Mapping[str, Any], languages: tuple[str, ...]) -> dict[str, Any]:
    """Return an item or option with its texts in these languages, without those that lack one of them."""
    found = {}
    for key, value in item.items():
        if key not in _TEXTS:
            found[key] = value
        elif all(language in value for language in languages):
            found[key] = {language: value[language] for language in languages}
    return found
