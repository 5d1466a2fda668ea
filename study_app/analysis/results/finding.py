"""The descriptor of a finding: what was asked, how it is tested, and what each output of the analysis says of it."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, Literal, TypeAlias, TypeVar, cast

from study_app.analysis.designs.block_tests import Asked
from study_app.analysis.figures.page_layout import Sheet
from study_app.analysis.figures.picture import Drawing, Picture
from study_app.analysis.report.first_page.answer import Answer
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.not_tested import NotTested
from study_app.analysis.tables.compared_blocks import KINDS, Kind
from study_app.analysis.tables.planned_analysis import Decided

R = TypeVar("R")
Tests: TypeAlias = Callable[[Asked, BlockFound], tuple[R, tuple[NotTested, ...]]]
Section: TypeAlias = Callable[[BlockFound, Results, Mapping[str, Picture]], Iterable[str]]
Row: TypeAlias = dict[str, Any]


def nothing(*_context: object) -> tuple[()]:
    """Return nothing: what a finding says where its descriptor does not state otherwise."""
    return ()


@dataclass(frozen=True, kw_only=True)
class Question:
    """A question of the report's first page: its words ("{kind}": what is compared), its answer, and its picture.

    ``picture`` draws on a sheet and returns what it shows in words, or None where there is nothing to show.
    """

    words: str
    answer: Callable[[BlockFound, Decided], Answer]
    picture: Callable[[Sheet, BlockFound, Answer], str | None]


@dataclass(frozen=True, kw_only=True)
class BlockFigure:
    """A figure of a block: its name as a file, its title, and how it is drawn (None: there is nothing to draw)."""

    name: str
    title: str
    draw: Callable[[Drawing], Picture | None]


@dataclass(frozen=True, kw_only=True)
class Finding(Generic[R]):
    """A finding of the analysis; ``what`` names it where it fails or is missing.

    Attributes
    ----------
    key : str
        Its name in `BlockFound.findings`, in report.json and among the answers of the first page.
    place : float
        Its place among the others in the report's section of a block, in texts and in report.json.
    tests : callable, optional
        Computes the value from a block's answers and the findings with lower places; without it there is no value.
    empty : R
        The value where nothing was tested.
    kinds, sealed, waits : tuple of str
        The kinds of blocks in which it is tested once the key is open, in which it is tested while the key is sealed,
        and in which it is named as waiting for the key.
    about : str
        Whether settings or sessions are compared.
    statements : bool
        Whether the value is tests of single statements whose verdicts belong to the limits of the study.
    numbers : callable, optional
        The entries of report.json; without it the value under ``key``.
    rows : callable
        The rows of tests.csv, at ``row_place`` among those of the other findings.
    part, section
        What the part of the report's section is called, and its HTML.
    sentences, limits, methods, calls : callable
        The sentences of the summary, of the limits and of the methods paragraph, and the calls of the script in R.
    common_methods : callable
        The sentences of the methods paragraph about all blocks together.
    """

    key: str
    place: float
    empty: R
    what: str = ""
    tests: Tests[R] | None = None
    kinds: tuple[Kind, ...] = KINDS
    sealed: tuple[Kind, ...] = ()
    waits: tuple[Kind, ...] = ()
    about: Literal["settings", "sessions"] = "settings"
    statements: bool = False
    numbers: Callable[[BlockFound], Mapping[str, Any]] | None = None
    row_place: float = 100
    rows: Callable[[BlockFound], Iterable[Row]] = nothing
    part: str = ""
    section: Section = nothing
    figure: BlockFigure | None = None
    question: Question | None = None
    sentences: Callable[[BlockFound, Decided], Iterable[str]] = nothing
    limits: Callable[[BlockFound], Iterable[str]] = nothing
    methods: Callable[[BlockFound, Results], Iterable[str]] = nothing
    common_methods: Callable[[Sequence[BlockFound]], Iterable[str]] = nothing
    calls: Callable[[BlockFound, str], Iterable[str]] = nothing

    def of(self, found: BlockFound) -> R:
        """Return the value that was found in a block."""
        return cast("R", found.findings.get(self.key, self.empty))

    def add_to(self, found: BlockFound, value: R) -> BlockFound:
        """Return a block's findings with this value."""
        return replace(found, findings={**found.findings, self.key: value})

    def entries(self, found: BlockFound) -> Mapping[str, Any]:
        """Return the entries of report.json."""
        return {self.key: self.of(found)} if self.numbers is None else self.numbers(found)
