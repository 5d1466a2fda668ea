"""The result of a device's diagnosis: tests and findings."""

from dataclasses import dataclass
from textwrap import fill
from typing import TYPE_CHECKING, Final, Literal

if TYPE_CHECKING:
    pass


State = Literal["ok", "found", "not checked"]
ORDER: Final[tuple[State, ...]] = ("found", "not checked", "ok")
WIDTH: Final = 100
NOTHING_WRONG: Final = "No problem was found."


@dataclass(frozen=True, slots=True)
class Finding:
    """One failure mode: its ``number`` in the list, and whether it is present.

    ``tested`` describes the state without it, ``symptom`` its sign for the user. Every mode has ``cause``, ``cure`` and
    ``known_by``; ``paste`` is a terminal command of this system, "" if none. ``says_itself``: the failure's own message
    has better cause and cure.
    """

    number: int
    id: str
    tested: str
    symptom: str
    state: State
    cause: str
    cure: str
    known_by: str
    paste: str = ""
    says_itself: bool = False

    @property
    def words(self) -> str:
        """The symptom if it was found, else the tested state."""
        return self.symptom if self.state == "found" else self.tested


@dataclass(frozen=True, slots=True)
class Report:
    """Observations (``seen``) in words; all ``findings`` in order; the driver's ``failure`` (None: there was none)."""

    seen: tuple[str, ...]
    findings: tuple[Finding, ...]
    failure: str | None

    @property
    def found(self) -> tuple[Finding, ...]:
        """The failures found."""
        return tuple(finding for finding in self.findings if finding.state == "found")

    @property
    def in_order(self) -> tuple[Finding, ...]:
        """All findings: failures first, then those that could not be checked."""
        return tuple(sorted(self.findings, key=lambda finding: ORDER.index(finding.state)))

    @property
    def unseen(self) -> tuple[Finding, ...]:
        """The findings that could not be checked."""
        return tuple(finding for finding in self.findings if finding.state == "not checked")

    @property
    def well(self) -> bool:
        """Whether no failure was found."""
        return not self.found and self.failure is None

    @property
    def conclusion(self) -> str:
        """The summary, in a sentence."""
        if not self.well:
            return f"Found: {len(self.found)}."
        if self.unseen:
            return f"Nothing wrong was found. Not checked: {'; '.join(one.tested for one in self.unseen)}."
        return NOTHING_WRONG


def lines(found: Report) -> list[str]:
    """Return a report as text of 100 columns; commands to paste are on one line."""
    lines = ["", *(f"seen: {words}" for words in found.seen), ""]
    for finding in found.in_order:
        word = "FOUND" if finding.state == "found" else finding.state
        lines.append(f"{finding.number:>2}  {word:<13}  {finding.words}")
        if finding.state == "found" and not finding.says_itself:
            lines.append(_indented(f"cause: {finding.cause}", 19))
            lines.append(_indented(f"cure: {finding.cure}", 19))
            lines.append(_indented(f"known by: {finding.known_by}", 19))
            if finding.paste:
                lines += ["", finding.paste, ""]  # in one line, to be copied
    lines.append("")
    if found.failure is not None:
        lines.append(_indented(found.failure, 0))
    lines.append(_indented(found.conclusion, 0))
    return lines


def _indented(words: str, by: int) -> str:
    space = " " * by
    return fill(words, WIDTH, initial_indent=space, subsequent_indent=space, break_long_words=False)
