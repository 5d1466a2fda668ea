"""What questions need of each other and of their scales: earlier items, permitted answers, points, scores."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pydantic import ValidationError

from study_app.protocol import formats
from study_app.protocol.questions import POINTS, Context, Question, Scale, ShowIf, Statement, question_of
from study_app.protocol.source.document import Path, entries
from study_app.protocol.source.problems import Fault, did_you_mean

Document = Mapping[str, Any]


def questions(document: Document) -> Iterator[Fault]:
    """Check the items of every questionnaire: their scales, when they are shown, and what is computed of them."""
    scales = {str(path[1]): scale for path, table in entries(document, "scales.*") if (scale := _scale(table))}
    for name, scale in scales.items():
        if formats.is_second(document) and len(counts := {len(labels) for labels in scale.labels.values()}) > 1:
            listed = " and ".join(map(str, sorted(counts)))
            yield Fault(("scales", name, "labels"), f"has {listed} points", "every language has the same points")
    languages = [name for _, name in entries(document, "study.languages.*") if isinstance(name, str)]
    for path, table in entries(document, "questionnaires.*"):
        if isinstance(table, Mapping):
            items = [(place, _question(item)) for place, item in entries(table, "items.*")]
            context = Context(scales, table.get("scale"), languages[0] if languages else "en")
            sound = [((*path, *place), item) for place, item in items if item is not None]
            rated = scales if formats.is_second(document) else {}  # format 1 has one length, checked before
            yield from _statements(path, table, [item for _, item in sound], rated)
            yield from _show_ifs(table, sound, context)
            yield from _scores(path, table, [item for _, item in sound])


def _scale(table: Any) -> Scale | None:
    try:
        return Scale.model_validate(table)
    except ValidationError:
        return None


def _question(table: Any) -> Question | None:
    """Return a question that is sound by itself."""
    try:
        return question_of(table) if isinstance(table, Mapping) else None
    except (KeyError, ValidationError):
        return None


def _statements(path: Path, table: Document, items: Sequence[Question], scales: Mapping[str, Scale]) -> Iterator[Fault]:
    if not any(isinstance(item, Statement) for item in items):
        return
    if "scale" not in table:
        yield Fault((*path, "scale"), "is missing", "statements are rated on it; other items have a kind")
    elif (scale := scales.get(str(table["scale"]))) is not None and scale.points != POINTS:
        message = f"has {scale.points} points, and statements need {POINTS}"
        yield Fault((*path, "scale"), message, f'write kind = "rating" and scale = "{table["scale"]}" in the items')


def _show_ifs(table: Document, items: Sequence[tuple[Path, Question]], context: Context) -> Iterator[Fault]:
    earlier: dict[str, Question] = {}
    ids = [item.id for _, item in items]
    for path, item in items:
        if (asked := item.show_if) is not None:
            place = (*path, "show_if")
            if asked.item not in earlier:
                yield _not_earlier(place, asked.item, ids, tuple(earlier))
            elif table.get("item_order", "fixed") != "fixed":
                hint = 'item_order = "fixed": an item comes after the one that it depends on'
                yield Fault(place, "item_order is shuffled", hint)
            else:
                yield from _answers(place, asked, earlier[asked.item], context)
        earlier[item.id] = item


def _not_earlier(place: Path, name: str, ids: Sequence[str], earlier: tuple[str, ...]) -> Fault:
    if name in ids:
        return Fault(place, f'"{name}" comes later', "name an earlier item")
    return Fault(place, f'there is no item "{name}" in this questionnaire', did_you_mean(name, earlier))


def _answers(place: Path, asked: ShowIf, earlier: Question, context: Context) -> Iterator[Fault]:
    """Check that the earlier item can be answered so."""
    try:
        levels = list(earlier.levels(context))
    except KeyError:  # its scale, or a text in the language, is missing: another check says so
        levels = []
    for value in asked.permitted:
        if levels and str(value) not in levels:
            yield Fault(place, f'"{value}" is not one of its answers', f"these are: {', '.join(levels)}")
        elif earlier.value_type != "text" and isinstance(value, str):
            yield Fault(place, f'"{value}" is not one of its answers', "give a number")
    if not asked.permitted and earlier.value_type == "text":
        yield Fault(place, f'the answer to "{asked.item}" is not a number', 'write is = "…"')


def _scores(path: Path, table: Document, items: Sequence[Question]) -> Iterator[Fault]:
    """Check that scores are computed of items there are, whose answers are numbers."""
    numbers = [item.id for item in items if item.value_type != "text"]
    choices = [item.id for item in items if item.value_type == "text"]
    for key, known in (("items", numbers), ("weights_from", choices)):
        for place, name in entries(table, f"scores.*.{key}.*"):
            if isinstance(name, str) and name not in known:
                message = (
                    f'there is no item "{name}" that is answered with {"a number" if key == "items" else "a choice"}'
                )
                yield Fault((*path, *place), message, did_you_mean(name, known))
