"""Questionnaires: questions that are answered together, standard questionnaires, and scores of the answers."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from functools import cache, cached_property
from pathlib import Path as File
from typing import Annotated, Any, Final, Literal, NamedTuple, Self

from pydantic import Field, model_validator

from study_app.haptics.model.ranges import later, within
from study_app.protocol.questions import KINDS, STATEMENT, AnyQuestion, Context, Question, Scale, Statement
from study_app.protocol.source.document import Path, entries, frozen
from study_app.protocol.source.problems import Fault, unknown_name
from study_app.protocol.source.table import Id, Localised, Table, invalid
from study_app.protocol.wording.languages import language_name, missing_text

_Weight = Annotated[float, within(-1e6, 1e6, "weights in questionnaires are smaller than this")]


class Score(Table):
    """One score: ``offset`` + ``factor`` × the sum or mean of the items' answers, some of them reversed or weighted.

    A reversed answer a to an item from l to h counts as l + h − a, or as −a if the item has no bounds. With
    ``weights_from``, an item's weight is how often its id was chosen in the paired comparisons (Hart & Staveland 1988),
    and a ``mean`` is divided by the sum of the weights.
    """

    items: Annotated[tuple[Id, ...], Field(min_length=1)] = Field(description="The items to combine.")
    reverse: tuple[Id, ...] = Field(default=(), description="Which of these items are reverse-scored.")
    combine: Literal["mean", "sum"] = Field(
        default="mean", description="mean: the mean of the items; sum: the sum of the items."
    )
    factor: _Weight = Field(default=1, description="Factor by which the result is multiplied.")
    offset: _Weight = Field(default=0, description="Number added to the result.")
    weights: dict[Id, _Weight] = Field(default_factory=dict, description="Weight of an item; default: 1.")
    weights_from: tuple[Id, ...] = Field(
        default=(),
        description="Questions in which participants choose between items. Each item's weight is the "
        "number of times it was chosen.",
    )

    @model_validator(mode="after")
    def _check_item_names(self) -> Self:
        for key in ("reverse", "weights"):
            for name in getattr(self, key):
                if name not in self.items:
                    raise invalid(f'"{name}" is not an item of the score', key)
        return self

    def compute(
        self, answers: Mapping[str, float | str], bounds: Mapping[str, tuple[float, float] | None]
    ) -> float | None:
        """Return a score; None if a required answer is missing.

        ``answers`` has the number or the chosen option of each item, ``bounds`` its smallest and largest answer, which
        reversed items need.
        """
        if any(name not in answers for name in (*self.items, *self.weights_from)):
            return None
        chosen = [answers[name] for name in self.weights_from]
        total = weight_sum = 0.0
        for name in self.items:
            value = float(answers[name])
            if name in self.reverse:
                ends = bounds.get(name)
                value = -value if ends is None else ends[0] + ends[1] - value
            weight = float(chosen.count(name)) if self.weights_from else self.weights.get(name, 1.0)
            total += weight * value
            weight_sum += weight
        if self.combine == "mean":
            if weight_sum == 0:
                return None
            total /= weight_sum
        return self.factor * total + self.offset

    def range_of(self, bounds: Mapping[str, tuple[float, float] | None]) -> tuple[float, float] | None:
        """Return the lowest and the highest possible score; None if an item or a weighted sum has no bounds.

        ``bounds`` has the smallest and the largest answer of each item.
        """
        ends = [bounds.get(name) for name in self.items]
        known = [pair for pair in ends if pair is not None]
        if len(known) < len(ends) or (self.weights_from and self.combine == "sum"):
            return None
        if self.weights_from:
            low, high = min(low for low, _ in known), max(high for _, high in known)
        else:
            weights = [self.weights.get(name, 1.0) for name in self.items]
            total = sum(weights) if self.combine == "mean" else 1.0
            if total == 0:
                return None
            weighted = [
                sorted(weight * end / total for end in pair) for weight, pair in zip(weights, known, strict=True)
            ]
            low, high = (sum(side) for side in zip(*weighted, strict=True))
        low, high = sorted(self.factor * end + self.offset for end in (low, high))
        return low, high


class Questionnaire(Table):
    """Questions asked after a trial, or separately if ``sequence`` lists the questionnaire."""

    title: Localised | None = Field(default=None, description="Heading; default: the trial's name.")
    intro: Localised = Field(description="Text shown above the questions.")
    scale: Id | None = Field(default=None, description="The scale for all statements, if there are any.")
    item_order: Literal["fixed", "shuffled"] = Field(
        default="fixed", description="fixed: as written; shuffled: a new order for every trial."
    )
    items: tuple[AnyQuestion, ...] = Field(
        min_length=1, description="Questions; a question without a kind is a statement on the questionnaire's scale."
    )
    instrument: str | None = later(
        default=None, description="The standard questionnaire whose items and scoring are used."
    )
    scores: dict[Id, Score] = later(default_factory=dict, description="Scores calculated from the answers.")

    @property
    def statements(self) -> tuple[Question, ...]:
        """The items that are rated on the questionnaire's scale."""
        return tuple(item for item in self.items if isinstance(item, Statement))

    @property
    def numeric_measures(self) -> tuple[str, ...]:
        """The IDs of the items whose answers are numbers, and the names of the scores."""
        return (*(item.id for item in self.items if item.value_type != "text"), *self.scores)

    def ranges(self, scales: Mapping[str, Scale], language: str) -> dict[str, float]:
        """Return the difference between the largest and the smallest value of each limited `numeric_measures`."""
        context = self.context(scales, language)
        bounds = {item.id: item.bounds(context) for item in self.items}
        ends = bounds | {name: score.range_of(bounds) for name, score in self.scores.items()}
        return {name: pair[1] - pair[0] for name, pair in ends.items() if pair is not None}

    def item(self, item_id: str) -> Question:
        """Return the item with an ID; raise KeyError if there is none."""
        return self._items_by_id[item_id]

    @cached_property
    def _items_by_id(self) -> dict[str, Question]:
        return {item.id: item for item in self.items}

    def context(self, scales: Mapping[str, Scale], language: str) -> Context:
        """Return the context of its items: scales and language."""
        return Context(scales, self.scale, language)


FOLDER: Final = File(__file__).parent / "instruments"
_TEXTS: Final = ("text", "short", "low", "high", "title", "intro", "labels")


@cache
def _instrument_table(name: str) -> Mapping[str, Any]:
    table: Mapping[str, Any] = frozen(tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8")))
    return table


class Instrument(NamedTuple):
    """A standard questionnaire, by its id."""

    name: str

    @staticmethod
    def names() -> tuple[str, ...]:
        """Return the ids of the standard questionnaires, sorted."""
        return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))

    @property
    def table(self) -> Mapping[str, Any]:
        """The content of its file; raises OSError if there is none."""
        return _instrument_table(self.name)

    @property
    def published_name(self) -> str:
        """The name under which it was published, which is also the default heading."""
        return self.name.upper().removesuffix("-WEIGHTED")

    def scale_name(self, scale: str) -> str:
        """Return a study's name for one of its scales."""
        return f"{self.name.replace('-', '_')}_{scale}"

    def tables_in(self, languages: tuple[str, ...]) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return the table and the scales to add to a study; they include its texts if a language lacks some."""
        table: dict[str, Any] = {"instrument": self.name}
        filled, faults = _fill_in((), table, languages, {})
        if not faults:
            return table, {}
        scales = {
            self.scale_name(name): _merge_table({"labels": scale.get("labels", {})}, {}, languages)
            for name, scale in self.table.get("scales", {}).items()
        }
        table |= {key: filled[key] for key in ("intro", "items") if key in filled}
        return table, {name: scale for name, scale in scales.items() if scale}


def with_instruments(document: Mapping[str, Any]) -> tuple[dict[str, Any], list[Fault]]:
    """Return a study's document with standard questionnaires filled in, and faults for missing parts.

    The study's own keys and texts override those of the instrument, key by key and language by language.
    """
    completed, faults = dict(document), list[Fault]()
    tables = document.get("questionnaires")
    if not isinstance(tables, Mapping):
        return completed, faults
    languages = tuple(name for _, name in entries(document, "study.languages.*") if isinstance(name, str))
    stated_scales = document.get("scales", {})
    filled, scales = dict(tables), dict(stated_scales) if isinstance(stated_scales, Mapping) else {}
    for name, table in tables.items():
        if not isinstance(table, Mapping) or "instrument" not in table:
            continue
        if table["instrument"] in Instrument.names():
            filled[name], missing_faults = _fill_in(("questionnaires", name), table, languages, scales)
            faults += missing_faults
        else:
            path, unknown = ("questionnaires", name, "instrument"), str(table["instrument"])
            faults.append(unknown_name(path, f'there is no instrument "{unknown}"', unknown, Instrument.names()))
    return {**completed, "questionnaires": filled, **({"scales": scales} if scales else {})}, faults


def _fill_in(
    place: Path, table: Mapping[str, Any], languages: tuple[str, ...], scales: dict[str, Any]
) -> tuple[dict[str, Any], list[Fault]]:
    """Return a questionnaire completed from its instrument, and faults; its scales are added to ``scales``."""
    instrument = str(table["instrument"])
    standard = Instrument(instrument)
    source = standard.table
    known = {item["id"]: item for item in source["items"]}
    own_items = _tables_by_id(table, "items")
    faults = [
        unknown_name((*place, *path, "id"), f'"{name}" is not an item of {instrument}', name, known)
        for name, (path, _) in own_items.items()
        if name not in known
    ]
    # (key, owner) of texts that neither has
    missing_by_language = {language: list[tuple[str, str]]() for language in languages}

    def note_missing_texts(path: Path | None, owner: str, part: Mapping[str, Any], *keys: str) -> None:
        """Record the languages that lack texts of a table; ``path`` is None for a table of the instrument."""
        for key in keys:
            text = part.get(key, {})
            missing_codes = [code for code in languages if code not in text] if isinstance(text, Mapping) else []
            if path is None:
                for language in missing_codes:
                    missing_by_language[language].append((key, owner))
            elif len(missing_codes) == len(languages):
                faults.append(Fault((*place, *path, key), "is missing", kind="missing"))
            else:
                faults.extend(missing_text((*place, *path, key), language) for language in missing_codes)

    completed = _merge_table({key: source[key] for key in ("title", "intro") if key in source}, table, languages)
    if "title" not in table and set(completed.get("title", ())) != set(languages):
        completed["title"] = dict.fromkeys(languages, standard.published_name)
    note_missing_texts(() if "intro" in table else None, instrument, completed, "intro")
    items = []
    for name, item in known.items():
        path, own_item = own_items.get(name, (None, {}))
        merged_item = _merge_table(item, own_item, languages)
        if isinstance(short := merged_item.get("short", {}), Mapping):
            merged_item["short"] = {**dict.fromkeys(languages, name.replace("_", " ").capitalize()), **short}
        if "scale" in item and "scale" not in own_item:
            merged_item["scale"] = standard.scale_name(item["scale"])
        kind = item.get("kind", STATEMENT)
        if merged_item.get("kind", kind) != kind:
            fault = f'must be "{kind}", as in {instrument}'
            faults.append(Fault((*place, *(path or ()), "kind"), fault, kind="surplus"))
            merged_item["kind"] = kind
        fields = KINDS[kind].model_fields
        note_missing_texts(path, name, merged_item, *(key for key in ("text", "low", "high") if key in fields))
        if "options" in item and isinstance(own_item.get("options", ()), list | tuple):
            own_options, option_ids = _tables_by_id(own_item, "options"), [option["id"] for option in item["options"]]
            faults += [
                unknown_name(
                    (*place, *(path or ()), *option_path, "id"),
                    f'"{option_id}" is not an option of {name}',
                    option_id,
                    option_ids,
                )
                for option_id, (option_path, _) in own_options.items()
                if option_id not in option_ids
            ]
            merged_item["options"] = tuple(
                _merge_table(option, own_options.get(option["id"], ((), {}))[1], languages)
                for option in item["options"]
            )
            for option in merged_item["options"]:
                if path is not None and option["id"] in own_options:
                    note_missing_texts((*path, *own_options[option["id"]][0]), name, option, "text")
                else:
                    note_missing_texts(None, name, {"options": option.get("text", {})}, "options")
        items.append(merged_item)
    for scale, scale_table in source.get("scales", {}).items():
        own_name = standard.scale_name(scale)
        known_labels = _merge_table({key: scale_table[key] for key in ("labels",) if key in scale_table}, {}, languages)
        if own_name in scales and isinstance(scales[own_name], Mapping):
            scales[own_name] = {**scales[own_name], **_merge_table(known_labels, scales[own_name], languages)}
        elif set(known_labels.get("labels", ())) == set(languages):
            scales[own_name] = known_labels
        else:
            note_missing_texts(
                None, f"the {scale_table['points']} points of [scales.{own_name}]", known_labels, "labels"
            )
    faults += [
        _unpublished_fault((*place, "instrument"), instrument, language, missing)
        for language, missing in missing_by_language.items()
        if missing
    ]
    scores = {name: dict(score) for name, score in source["scores"].items()}
    return {"scores": scores, **completed, "items": tuple(items)}, faults


def _merge_table(published: Mapping[str, Any], own: Mapping[str, Any], languages: tuple[str, ...]) -> dict[str, Any]:
    """Return an instrument's table in these languages, overridden by the study's own keys."""
    merged = dict(published)
    for key in merged.keys() & set(_TEXTS):
        merged[key] = {language: published[key][language] for language in languages if language in published[key]}
    for key, value in own.items():
        merged[key] = {**merged.get(key, {}), **value} if key in _TEXTS and isinstance(value, Mapping) else value
    return {key: value for key, value in merged.items() if value or key not in _TEXTS}


def _tables_by_id(table: Mapping[str, Any], key: str) -> dict[str, tuple[Path, Mapping[str, Any]]]:
    """Return the tables of a list that have an id, with their paths."""
    return {
        entry["id"]: (path, entry)
        for path, entry in entries(table, f"{key}.*")
        if isinstance(entry, Mapping) and isinstance(entry.get("id"), str)
    }


def _unpublished_fault(path: Path, instrument: str, language: str, missing: Sequence[tuple[str, str]]) -> Fault:
    """Return the fault that texts in a language exist neither in the program nor in the study."""
    keys: dict[str, list[str]] = {}
    for key, owner in dict.fromkeys(missing):
        keys.setdefault(owner, []).append(key)
    owners_by_keys = {
        tuple(texts): [owner for owner, other in keys.items() if other == texts] for texts in keys.values()
    }
    listed = "; ".join(
        f"{', '.join(texts)} of {', '.join(names)}".removesuffix(f" of {instrument}")
        for texts, names in owners_by_keys.items()
    )
    source = Instrument(instrument).table
    translation = source.get("published", {}).get(language)
    published = f", although a translation has been published ({translation})" if translation else ""
    reason = (
        f"the program does not include {instrument} in {language_name(language)}{published}"
        if source["languages"]
        else f"the licence of {instrument} does not permit its texts to be included"
    )
    message = f"{reason}: write {listed}"
    hint = f'items = [{{ id = "{source["items"][0]["id"]}", text = {{ {language} = "…" }} }}, …]'
    return Fault(path, message, hint, missing_language=language)
