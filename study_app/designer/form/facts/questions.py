"""The questions of a questionnaire: kind, text in each language, and when each is shown."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from study_app.designer.document.edited_study import Study
from study_app.designer.document.fields import Row, label_of
from study_app.designer.form.row_facts import RowFacts
from study_app.protocol.source.document import Path, entries, value_at
from study_app.protocol.wording.languages import language_name

ICONS: Final = {"rating": "scale", "slider": "slider", "number": "number", "choice": "list", "text": "letter"}
STATEMENT: Final = "statement"


@dataclass(frozen=True, slots=True)
class QuestionLine:
    """One question.

    Attributes
    ----------
    path : tuple of str or int
        Its place.
    number : int
        Its place in the questionnaire, from 1.
    kind, icon : str
        Its kind, and the name of its icon.
    texts : tuple of str
        Its text in each language of the study, "" where it is missing.
    note : str
        When it is shown, "" where it always is.
    faults : int
        How many faults it has.
    """

    path: Path
    number: int
    kind: str
    icon: str
    texts: tuple[str, ...]
    note: str = ""
    faults: int = 0


@dataclass(frozen=True, slots=True)
class QuestionLines:
    """Names of the study's languages, and the questions."""

    languages: tuple[str, ...]
    lines: tuple[QuestionLine, ...]


def question_lines(study: Study, path: Path) -> QuestionLines:
    """Return a line for each question of the list at ``path``."""
    codes = [str(code) for _, code in entries(study.document, "study.languages.*")] or ["en"]
    listed = value_at(study.document, path)
    items = listed if isinstance(listed, tuple) else ()
    numbers = {str(item.get("id")): at for at, item in enumerate(items, start=1) if isinstance(item, Mapping)}
    lines = tuple(
        _line(study, (*path, at), item, codes, numbers) for at, item in enumerate(items) if isinstance(item, Mapping)
    )
    return QuestionLines(tuple(language_name(code) for code in codes), lines)


def _line(
    study: Study, path: Path, item: Mapping[str, Any], codes: list[str], numbers: Mapping[str, int]
) -> QuestionLine:
    kind, text = str(item.get("kind", STATEMENT)), item.get("text", "")
    texts = [text.get(code, "") for code in codes] if isinstance(text, Mapping) else [text, *[""] * (len(codes) - 1)]
    faults = sum(fault.path[: len(path)] == path for fault in study.faults)
    shown = tuple(one.strip() if isinstance(one, str) else "" for one in texts)
    number = path[-1] + 1 if isinstance(path[-1], int) else 0
    return QuestionLine(path, number, kind, ICONS.get(kind, "scale"), shown, _note(item, numbers), faults)


def _note(item: Mapping[str, Any], numbers: Mapping[str, int]) -> str:
    rule = item.get("show_if")
    if not isinstance(rule, Mapping):
        return ""
    name, values = str(rule.get("item")), rule.get("is", ())
    words = [label_of(str(value)) for value in (values if isinstance(values, tuple) else (values,))]
    limits = [f"{label_of(key).lower()} {rule[key]:g}" for key in ("at_least", "at_most")
              if isinstance(rule.get(key), int | float)]  # fmt: skip
    return f"shown if {numbers.get(name, name)} is {' or '.join(words) if words else ' and '.join(limits)}"


def _of_row(study: Study, row: Row) -> QuestionLines:
    return question_lines(study, row.path)


FACTS: Final = RowFacts((("Questionnaire", "items"),), _of_row)
