"""What the results window shows, as one frozen value: widgets only draw it. No Qt here."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from types import MappingProxyType
from typing import Literal, TypeAlias

from study_app.gui.sessions.session_facts import SessionFacts
from study_app.number_text import counted

NAMED: int = 5
"""Of so many sessions that are not in the figures each is named."""

Remedy: TypeAlias = Literal["again", "home", "read", "stop"]
"""What the button of a sentence does: look again, go home, go on reading, stop."""

NOTHING: Mapping[tuple[str, int], tuple[tuple[int, str], ...]] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class StudyChoice:
    """A study one can choose: its folder, and what it is where it holds no participants' data."""

    folder: Path
    kind: Literal["", "simulated", "pilot"] = ""

    @property
    def name(self) -> str:
        """The folder's name, and what it is where it holds no participants' data."""
        return f"{self.folder.name}  ·  {self.kind}" if self.kind else self.folder.name


@dataclass(frozen=True, slots=True)
class Opened:
    """Who opened the key, when and why."""

    at: datetime | None
    by: str
    reason: str

    @property
    def words(self) -> str:
        """A line: "Unblinded 19 Nov by AK: collection closed"."""
        day = "" if self.at is None else f" {self.at.day} {self.at:%b}"
        return f"Unblinded{day} by {self.by}: {self.reason}"


@dataclass(frozen=True, slots=True)
class FigureShown:
    """A figure as SVG in print's colours; without one, ``caption`` says why."""

    name: str
    title: str
    caption: str
    svg: bytes = field(default=b"", repr=False)


@dataclass(frozen=True, slots=True)
class LeftOut:
    """What is excluded from the analysis, by which rule or person, why and when.

    ``which`` is participant, session and trial (None: the whole session).
    """

    what: str
    by: str
    reason: str
    at: datetime | None
    which: tuple[str, int, int | None]


@dataclass(frozen=True, slots=True)
class Going:
    """What is being done, and which share of all is done (0 to 1)."""

    what: str
    share: float


@dataclass(frozen=True, slots=True)
class Trouble:
    """Why there is nothing to show, in one sentence, with the words on the button and what it does."""

    title: str
    sentence: str
    button: str
    remedy: Remedy


@dataclass(frozen=True, slots=True)
class ResultsView:
    """Everything the window shows.

    ``trials`` are the main trials of each session (participant, number), with the words for them. ``colours`` are the
    figures' colours in print, by the role in the theme that takes their place. ``sealed`` is None while it is not
    known; ``listed`` says whether the study's sessions are read. ``drawing`` goes on where there are no figures yet,
    ``testing`` besides those there are; ``untested`` says that this was stopped.
    """

    studies: tuple[StudyChoice, ...] = ()
    chosen: Path | None = None
    sessions: tuple[SessionFacts, ...] = ()
    listed: bool = False
    sealed: bool | None = None
    opened: Opened | None = None
    left_out: tuple[LeftOut, ...] = ()
    exclusions_file: Path | None = None
    trials: Mapping[tuple[str, int], tuple[tuple[int, str], ...]] = field(default_factory=lambda: NOTHING)
    doubts: tuple[str, ...] = ()
    figures: tuple[FigureShown, ...] = ()
    colours: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    drawing: Going | None = None
    testing: Going | None = None
    untested: bool = False
    trouble: Trouble | None = None

    @property
    def kind(self) -> Literal["", "simulated", "pilot"]:
        """What the chosen study is where it holds no participants' data."""
        return next((study.kind for study in self.studies if study.folder == self.chosen), "")

    @property
    def without_sessions(self) -> str:
        """What stands in place of sessions where none are shown."""
        if self.listed:
            return "No sessions."
        return "" if self.trouble is not None else "Reading the sessions …"

    @property
    def can_be_written(self) -> bool:
        """Whether there is a study that tables and a report can be made of."""
        return self.chosen is not None and bool(self.sessions)


def in_figures(sessions: Sequence[SessionFacts]) -> tuple[str, str]:
    """Return how many sessions are in the figures, and why the others are not; empty without sessions."""
    inside = [one for one in sessions if one.counts]
    head = f"{len(inside)} of {counted(len(sessions), 'session')} in the figures"
    if not sessions:
        return "", ""
    excluded = [one.name for one in sessions if one.excluded is not None]
    open_ones = [one.name for one in sessions if one.excluded is None and not one.counts]
    parts = [_are(open_ones, "not complete"), _are(excluded, "excluded")]
    line = "; ".join(filter(None, parts))
    return head, f"{line}." if line else ""


def _are(names: Sequence[str], what: str) -> str:
    """Return "P007 is excluded", "P007, P009 and 12 others are excluded"; empty without names."""
    if not names:
        return ""
    if len(names) > NAMED:
        return f"{', '.join(names[: NAMED - 1])} and {len(names) - NAMED + 1} others are {what}"
    return f"{', '.join(names)} {'is' if len(names) == 1 else 'are'} {what}"
