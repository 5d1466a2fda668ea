"""Two texts side by side: lines that belong together in one row, with what differs marked."""

from dataclasses import dataclass
from difflib import SequenceMatcher
from typing import Final, Literal, TypeAlias

from study_app.viewmodels.designer.file_text import shown

Mark: TypeAlias = Literal["same", "changed", "gone", "new", "gap"]
LONG: Final = 2000
"""From so many differing lines on, frequent lines are left out of the search for equal ones."""


@dataclass(frozen=True, slots=True)
class SideLine:
    """A line of one side.

    Attributes
    ----------
    number : int or None
        Its number from 1; None for a gap opposite to a line of the other side.
    text : str
        What it says.
    mark : str
        How it differs from the line opposite.
    spans : tuple of (int, int)
        First and last place (exclusive) of what differs within a changed line.
    """

    number: int | None
    text: str
    mark: Mark = "same"
    spans: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True, slots=True)
class Hunk:
    """Lines that differ: the row where they begin, and the lines of the later text (from 0) with what they replace."""

    row: int
    first: int
    last: int
    before: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SideBySide:
    """Two texts, row by row, and where they differ."""

    left: tuple[SideLine, ...] = ()
    right: tuple[SideLine, ...] = ()
    hunks: tuple[Hunk, ...] = ()


def side_by_side(before: str, after: str) -> SideBySide:
    """Return two texts line by line."""
    old, new = shown(before).split("\n"), shown(after).split("\n")
    left: list[SideLine] = []
    right: list[SideLine] = []
    hunks: list[Hunk] = []
    for kind, first, last, begin, end in _parts(old, new):
        if kind == "equal":
            left += [SideLine(first + at + 1, line) for at, line in enumerate(old[first:last])]
            right += [SideLine(begin + at + 1, line) for at, line in enumerate(new[begin:end])]
            continue
        hunks.append(Hunk(len(left), begin, end, tuple(old[first:last])))
        for at in range(max(last - first, end - begin)):
            one = old[first + at] if first + at < last else None
            other = new[begin + at] if begin + at < end else None
            left.append(_line(first + at + 1, one, other, "gone"))
            right.append(_line(begin + at + 1, other, one, "new"))
    return SideBySide(tuple(left), tuple(right), tuple(hunks))


def reverted(text: str, hunk: Hunk) -> str:
    """Return a text, with line feeds alone, in which the lines of a hunk are as they were before."""
    lines = shown(text).split("\n")
    return "\n".join([*lines[: hunk.first], *hunk.before, *lines[hunk.last :]])


def _parts(old: list[str], new: list[str]) -> list[tuple[str, int, int, int, int]]:
    shortest, first, last = min(len(old), len(new)), 0, 0
    while first < shortest and old[first] == new[first]:
        first += 1
    while last < shortest - first and old[-1 - last] == new[-1 - last]:
        last += 1
    middle, other = old[first : len(old) - last], new[first : len(new) - last]
    matcher = SequenceMatcher(None, middle, other, autojunk=max(len(middle), len(other)) > LONG)
    found = [("equal", 0, first, 0, first)] if first else []
    found += [(kind, a + first, b + first, c + first, d + first) for kind, a, b, c, d in matcher.get_opcodes()]
    if last:
        found.append(("equal", len(old) - last, len(old), len(new) - last, len(new)))
    return found


def _line(number: int, text: str | None, opposite: str | None, alone: Mark) -> SideLine:
    if text is None:
        return SideLine(None, "", "gap")
    if opposite is None:
        return SideLine(number, text, alone)
    first, last, shortest = 0, 0, min(len(text), len(opposite))
    while first < shortest and text[first] == opposite[first]:
        first += 1
    while last < shortest - first and text[-1 - last] == opposite[-1 - last]:
        last += 1
    span = (first, len(text) - last)
    return SideLine(number, text, "changed", (span,) if span[0] < span[1] else ())
