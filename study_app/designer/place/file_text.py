"""The file as the pane shows it: lines that end in line feeds, the lines of the selected element, and faulty lines."""

import re
from dataclasses import dataclass
from typing import Final

from study_app.designer.document.edited_study import Study
from study_app.designer.document.writer.spans import spans_of
from study_app.protocol.source.document import Path

_ENDS: Final = re.compile("\r\n|\r|\u2029")
"""What an editor takes as the end of a line beyond line feeds."""


@dataclass(frozen=True, slots=True)
class FileText:
    """The text of the pane; lines count from 0.

    Attributes
    ----------
    name : str
        The name of the file.
    text : str
        Its text with line feeds alone.
    selected : tuple of (int, int)
        First and last line of each part of the selected element.
    faulty : tuple of int
        Lines with a fault.
    """

    name: str = ""
    text: str = ""
    selected: tuple[tuple[int, int], ...] = ()
    faulty: tuple[int, ...] = ()


def file_text(study: Study, name: str, path: Path) -> FileText:
    """Return the file with the lines of the element at ``path`` marked."""
    faulty = tuple(sorted({problem.line - 1 for problem in study.problems if problem.line}))
    selected: tuple[tuple[int, int], ...] = ()
    if study.is_toml and path:
        pieces = spans_of(study.text).pieces(path)
        lines = [
            (_line(study.text, piece.start), _line(study.text, max(piece.start, piece.end - 1))) for piece in pieces
        ]
        selected = tuple(lines)
    return FileText(name, shown(study.text), selected, faulty)


def shown(text: str) -> str:
    """Return a text with line feeds alone."""
    return _ENDS.sub("\n", text)


def retyped(text: str, typed: str) -> str:
    """Return a text with its own ends of lines after what was typed in the pane.

    Parameters
    ----------
    text : str
        The file's text.
    typed : str
        The text of the pane after typing.
    """
    old, newline = shown(text), "\r\n" if "\r\n" in text else "\n"
    shortest, first, last = min(len(old), len(typed)), 0, 0
    while first < shortest and old[first] == typed[first]:
        first += 1
    while last < shortest - first and old[-1 - last] == typed[-1 - last]:
        last += 1
    begin, end = _original(text, first), _original(text, len(old) - last)
    return text[:begin] + typed[first : len(typed) - last].replace("\n", newline) + text[end:]


def _original(text: str, place: int) -> int:
    """Return where a place of the shown text is in the file's text."""
    for match in _ENDS.finditer(text):
        if match.start() >= place:
            break
        place += len(match[0]) - 1
    return place


def _line(text: str, place: int) -> int:
    return text.count("\n", 0, place)
