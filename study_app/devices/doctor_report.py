"""The result of a device's diagnosis: what was tested, and what was found."""

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
    """One mode of failure: ``number`` in the list, and whether it is there.

    ``tested`` says what holds where it is not, ``symptom`` what a user sees where it is.
    ``cause``, ``cure`` and ``known_by`` are of every mode; ``paste`` is what a terminal here takes, "" where nothing.
    ``says_itself`` where the failure's own sentence says cause and cure better.
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
        """The symptom where it was found, else what is tested."""
        return self.symptom if self.state == "found" else self.tested


@dataclass(frozen=True, slots=True)
class Report:
    """What was ``seen``, in words; all ``findings`` in their order; the driver's own ``failure`` (None: it went on)."""

    seen: tuple[str, ...]
    findings: tuple[Finding, ...]
    failure: str | None

    @property
    def found(self) -> tuple[Finding, ...]:
        """What is wrong."""
        return tuple(finding for finding in self.findings if finding.state == "found")

    @property
    def in_order(self) -> tuple[Finding, ...]:
        """Every finding: what is wrong first, then what could not be looked at."""
        return tuple(sorted(self.findings, key=lambda finding: ORDER.index(finding.state)))

    @property
    def unseen(self) -> tuple[Finding, ...]:
        """What could not be looked at."""
        return tuple(finding for finding in self.findings if finding.state == "not checked")

    @property
    def well(self) -> bool:
        """Whether nothing wrong was found."""
        return not self.found and self.failure is None

    @property
    def conclusion(self) -> str:
        """What it comes to, in a sentence."""
        if not self.well:
            return f"Found: {len(self.found)}."
        if self.unseen:
            return f"Nothing wrong was found. Not checked: {'; '.join(one.tested for one in self.unseen)}."
        return NOTHING_WRONG


def lines(found: Report) -> list[str]:
    """Return a report as text of 100 columns; what is to be pasted stands in one line."""
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
