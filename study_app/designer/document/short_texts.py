"""The short text of a question, which names it in figures and tables: it follows the text until it is edited."""

from collections.abc import Mapping
from typing import Any, Final

from study_app.designer.document.edited_study import Study
from study_app.designer.document.writer.edits import Edit, Set
from study_app.protocol.source.document import Path, value_at

LONGEST: Final = 40


def short_of(text: str) -> str:
    """Return the initial short text of a question: the beginning of its text."""
    return " ".join(text.split())[:LONGEST].rstrip(" ?.!:")


def followed(study: Study, path: Path, language: str, text: str) -> tuple[Edit, ...]:
    """Return the edit of the short text of a question whose text is typed; none if it was edited separately.

    Parameters
    ----------
    study : Study
        The study before the text is typed.
    path : tuple of str or int
        The text.
    language, text : str
        Its language, and the new text.
    """
    place = (*path[:-1], "short")
    before, short = value_at(study.document, path), value_at(study.document, place)
    if path[-1] != "text" or isinstance(before, Mapping) != isinstance(short, Mapping):
        return ()
    old, own = _in(before, language), _in(short, language)
    if old is None or own is None or own != short_of(old):
        return ()
    return (Set((*place, language) if isinstance(short, Mapping) else place, short_of(text)),)


def _in(value: Any, language: str) -> str | None:
    found = value.get(language) if isinstance(value, Mapping) else value
    return found if isinstance(found, str) else None
