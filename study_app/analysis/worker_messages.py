"""Messages to and from the worker process that reads and evaluates studies, and its client.

The libraries for an evaluation and its tables are only loaded in that process.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

from study_app.store.exclusions import Exclusion
from study_app.workers.client import WorkerClient


@dataclass(frozen=True, slots=True)
class FindStudies:
    """Find the studies; answered by `StudiesFound`."""

    results: Path


@dataclass(frozen=True, slots=True)
class ReadStudy:
    """Read a study and draw its figures; answered by `SessionsFound`, `StudyFound`, `FigureDrawn` and progress."""

    folder: Path


@dataclass(frozen=True, slots=True, kw_only=True)
class LeaveOut:
    """Exclude a session or a trial, or a session that meets a ``rule`` (see ``store.exclusions.exclude``)."""

    folder: Path
    participant: str
    session: int
    trial: int | None
    by: str
    reason: str
    rule: str = ""


@dataclass(frozen=True, slots=True)
class TakeBack(LeaveOut):
    """Reverse the exclusion of a session or a trial, or keep a session that meets a ``rule``."""


@dataclass(frozen=True, slots=True)
class OpenKey:
    """Open the sealed key (see ``store.blinded.blinding.reveal``)."""

    folder: Path
    by: str
    reason: str


@dataclass(frozen=True, slots=True)
class WriteTables:
    """Write the tables that ``analysis.export_study`` writes, with its ``extras``."""

    folder: Path
    to: Path
    extras: tuple[Any, ...] = ()


@dataclass(frozen=True, slots=True)
class WriteReport:
    """Write the report (see ``analysis.report.write_report``)."""

    folder: Path
    to: Path


Order: TypeAlias = FindStudies | ReadStudy | LeaveOut | TakeBack | OpenKey | WriteTables | WriteReport


@dataclass(frozen=True, slots=True)
class StudyAt:
    """A study's folder, the type of its first session, and the start of the last one [s since the epoch]."""

    folder: Path
    simulated: bool
    pilot: bool
    newest_s: float


@dataclass(frozen=True, slots=True)
class StudiesFound:
    """The studies in a results folder, sorted by name."""

    studies: tuple[StudyAt, ...]


@dataclass(frozen=True, slots=True)
class SessionsFound:
    """The sessions of a study as rows of ``store.tables.study_files``, exclusions, and the last opening of the key."""

    folder: Path
    rows: tuple[dict[str, Any], ...]
    exclusions: tuple[Exclusion, ...]
    reveal: Mapping[str, str] | None


@dataclass(frozen=True, slots=True)
class StudyFound:
    """A study that could be read.

    ``trials`` are the main trials of each session (participant, number): number and description, by code while the key
    is sealed. ``doubts`` are files that differ from their recorded state. ``colours`` maps purposes to the colours of
    figures. ``groups`` are the groups by which figures can be split.
    """

    name: str
    title: str
    n: int
    blocks: int
    revealed: bool
    trials: Mapping[tuple[str, int], tuple[tuple[int, str], ...]]
    doubts: tuple[str, ...]
    colours: Mapping[str, str] = field(default_factory=dict)
    groups: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ProposedExclusions:
    """Exclusions that rules propose and that await a decision; their time is empty.

    ``rules`` are sentences: each planned rule, and how many sessions met it.
    """

    exclusions: tuple[Exclusion, ...]
    rules: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class FigureDrawn:
    """A figure as SVG, which replaces an earlier one of the same ``key``: its ``name`` and ``split``.

    ``split`` is "" for all participants, the only group shown, or `EACH_GROUP` if the figure compares the groups.
    If there is no ``svg``, ``caption`` gives the reason. ``numbers`` are its data as tab-separated lines. A figure on
    the first page has the ``question`` that it answers, the ``verdict`` and the ``answer`` as sentences.
    """

    name: str
    title: str
    caption: str
    svg: bytes = b""
    numbers: str = ""
    question: str = ""
    verdict: str = ""
    answer: str = ""
    split: str = ""

    @property
    def key(self) -> tuple[str, str]:
        """The figure's identity."""
        return self.name, self.split


@dataclass(frozen=True, slots=True)
class FirstPage:
    """The names of the figures of the first page in order."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Progress:
    """The current activity, the proportion of all work that is done (0 to 1), and whether it can be stopped."""

    what: str
    share: float
    stops: bool = True


@dataclass(frozen=True, slots=True)
class Done:
    """A completed order: the written files, and warnings."""

    files: tuple[Path, ...] = ()
    warnings: tuple[str, ...] = ()


Answer: TypeAlias = (
    StudiesFound | SessionsFound | StudyFound | ProposedExclusions | FigureDrawn | FirstPage | Progress | Done
)


AnalysisClient: TypeAlias = WorkerClient[Order, Answer]


def start_analysis_worker() -> AnalysisClient:
    """Start a worker process for orders about studies (see `study_app.analysis.study_worker.carry_out`)."""
    return WorkerClient("study_app.analysis.study_worker:carry_out", name="analysis")
