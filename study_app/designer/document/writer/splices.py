"""Splices: replacements of pieces of a text, applied together and undone backwards."""

from collections.abc import Iterable
from typing import NamedTuple, TypeAlias


class Splice(NamedTuple):
    """``before`` at position ``at`` of a text becomes ``after``."""

    at: int
    before: str
    after: str


Splices: TypeAlias = tuple[Splice, ...]
"""Splices of one text, in order of their places, which do not overlap."""


class Editor:
    """Collects replacements of one text; insertions at one place keep their order."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._found: list[Splice] = []

    def replace(self, start: int, end: int, after: str) -> None:
        """Replace the text from ``start`` to ``end``; nothing is kept of a replacement that changes nothing."""
        if (before := self.text[start:end]) != after:
            self._found.append(Splice(start, before, after))

    def insert(self, at: int, after: str) -> None:
        """Insert a text."""
        self.replace(at, at, after)

    def delete(self, start: int, end: int) -> None:
        """Delete a piece; of pieces that overlap, what they cover together."""
        self.replace(start, end, "")

    @property
    def splices(self) -> Splices:
        """What was collected, overlapping deletions joined."""
        joined: list[Splice] = []
        for one in sorted(self._found, key=lambda splice: splice.at):
            if joined and one.at < (end := joined[-1].at + len(joined[-1].before)):
                last = joined.pop()
                whole = self.text[last.at : max(end, one.at + len(one.before))]
                one = Splice(last.at, whole, last.after + one.after)  # noqa: PLW2901
            joined.append(one)
        return tuple(joined)


def applied(text: str, splices: Iterable[Splice]) -> str:
    """Return a text with splices applied.

    Raises
    ------
    ValueError
        The text does not hold what a splice replaces.
    """
    parts: list[str] = []
    end = 0
    for at, before, after in splices:
        if at < end or text[at : at + len(before)] != before:
            raise ValueError("these splices belong to another text")
        parts += (text[end:at], after)
        end = at + len(before)
    return "".join((*parts, text[end:]))


def reverted(splices: Splices) -> Splices:
    """Return the splices that undo these in the text that they produced."""
    shift, found = 0, list[Splice]()
    for at, before, after in splices:
        found.append(Splice(at + shift, after, before))
        shift += len(after) - len(before)
    return tuple(found)
