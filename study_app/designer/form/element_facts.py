"""What elements and their places in the file are called, what tells elements apart, and how many others use them."""

from collections import Counter
from collections.abc import Mapping
from typing import Any, Final

from study_app.designer.document.elements import title_of
from study_app.designer.document.fields import label_of
from study_app.designer.document.initial_values import counted_elements, singular
from study_app.designer.document.names import ITEMS, uses
from study_app.number_text import counted, exact_duration
from study_app.protocol.source.document import Path, value_at

USED: Final = frozenset({"liquids", "conditions", "tasks", "questionnaires", "scales", "stimuli", "designs", "methods"})
"""Sections whose elements other elements use; pages and blocks are steps of the session."""


def kind_of(path: Path) -> str:
    """Return what an element is: "Block"; "" of a table that is the only one of its kind."""
    if isinstance(path[-1], int):
        return label_of(singular(path[-2]))
    return label_of(singular(path[0])) if len(path) > 1 else ""


def kind_and_title(document: Mapping[str, Any], path: Path) -> str:
    """Return "Condition Water"; the title alone where it says what the element is."""
    kind, title = kind_of(path), title_of(document, path)
    return title if title.casefold().startswith(kind.casefold()) else f"{kind} {title}"


def place_words(path: Path, line: int | None) -> str:
    """Return a place in the file with its line, if that is known: "blocks.liquids.order · line 385"."""
    place = ".".join(str(step + 1) if isinstance(step, int) else step for step in path)
    return " · ".join(filter(None, (place, "" if line is None else f"line {line}")))


def brief(document: Mapping[str, Any], path: Path) -> str:
    """Return how long a task takes, or how many questions a questionnaire has; "" of other elements.

    Parameters
    ----------
    document : mapping
        The study, sound or not.
    path : tuple of str or int
        The element.
    """
    value = value_at(document, path)
    if not isinstance(value, Mapping) or len(path) != 2:
        return ""
    if path[0] == "questionnaires" and isinstance(items := value.get("items"), tuple | list):
        return counted(len(items), "question")
    if path[0] != "tasks":
        return ""
    numbers = {key: one for key, one in value.items() if isinstance(one, int | float)}
    for least, most in (("min_s", "max_s"), ("duration_s", "duration_s")):
        if least in numbers and most in numbers:
            return exact_duration(numbers[least], numbers[most])
    return f"{numbers['count']:g} targets" if "count" in numbers else ""


def used_by(document: Mapping[str, Any], path: Path) -> str:
    """Return how many elements use an element, by its name or as the only one: "used by 3 conditions", "not used".

    It is "" of steps and settings.
    """
    if len(path) != 2 or path[0] not in USED:
        return ""
    users = {_user(place) for place, used in uses(document) if used == path} - {path}
    counts = Counter(user[-2] for user in users)
    words = (
        counted(count, "step") if section == "sequence" else counted_elements(count, section)
        for section, count in sorted(counts.items())
    )
    return f"used by {', '.join(words)}" if counts else "not used"


def _user(place: Path) -> Path:
    """Return the element that a place belongs to: a question, a table of a section or a step."""
    return place[:4] if place[2:3] == (ITEMS,) else place[:2]
