"""The base class of findings: what is asked, how it is tested, and what each output of the analysis says of it.

The p that decide stand in the sections that follow.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Final, Generic, Literal, TypeAlias, TypeVar, cast

from study_app.analysis.data.blocks import KINDS, Kind
from study_app.analysis.figures.page_layout import Drawing, Picture
from study_app.analysis.findings.block_tests import Asked
from study_app.analysis.report.html_page import drawn
from study_app.analysis.results import BlockFound, NotTested, Results

NO_EVIDENCE: Final = "That is not evidence that there is nothing."
FOUND: Final = ("shown", "suggested")


@dataclass(frozen=True, slots=True)
class Answer:
    """A row of the first page: the verdict on one question (the key of a finding) about one block (its id), in words.

    ``claims`` says whether it claims that settings differ or that a delay is noticed, which would be false in a study
    where nothing differs.
    """

    question: str
    block: str
    title: str
    verdict: str
    text: str
    claims: bool = False


R = TypeVar("R")
Absent: TypeAlias = tuple[NotTested, ...]
Row: TypeAlias = dict[str, Any]


class Finding(Generic[R]):
    """A finding of the analysis; an instance says what outputs state of it in one block.

    A subclass with a ``key`` in a module of this folder is in every output. It overrides what it has to say; the others
    say nothing. ``R`` is the type of its value.

    Attributes
    ----------
    key : str
        Its name in `BlockFound.findings`, in report.json and among the answers of the first page.
    place : float
        Its place among the others in the report's section of a block, in texts and in report.json.
    row_place : float
        Its place in tests.csv.
    what : str
        What names it where it fails or is missing; empty where nothing is tested, so that there is no value.
    part : str
        What its part of the report's section of a block is called where it fails.
    kinds, sealed, waits : tuple of str
        The kinds of blocks in which it is tested once the key is open, in which it is tested while the key is sealed,
        and in which it is named as waiting for the key.
    about : str
        Whether settings or sessions are compared.
    statements : bool
        Whether the value is tests of single statements whose verdicts belong to the limits of the study.
    empty : R
        The value where nothing was tested.
    figure_name, figure_title : str
        The name as a file and the title of its figure; empty where it has none.
    question : str
        The question of the first page that it answers ("{kind}": what is compared); empty where it answers none.
    """

    key: ClassVar[str]
    place: ClassVar[float]
    row_place: ClassVar[float] = 100
    what: ClassVar[str] = ""
    part: ClassVar[str] = ""
    kinds: ClassVar[tuple[Kind, ...]] = KINDS
    sealed: ClassVar[tuple[Kind, ...]] = ()
    waits: ClassVar[tuple[Kind, ...]] = ()
    about: ClassVar[Literal["settings", "sessions"]] = "settings"
    statements: ClassVar[bool] = False
    empty: ClassVar[Any] = None
    figure_name: ClassVar[str] = ""
    figure_title: ClassVar[str] = ""
    question: ClassVar[str] = ""

    def __init__(self, found: BlockFound, results: Results, pictures: Mapping[str, Picture] | None = None) -> None:
        self.found = found
        self.results = results
        self.value = self.of(found)
        self._pictures = pictures or {}

    @classmethod
    def of(cls, found: BlockFound) -> R:
        """Return the value that was found in a block."""
        return cast("R", found.findings.get(cls.key, cls.empty))

    @classmethod
    def add_to(cls, found: BlockFound, value: R) -> BlockFound:
        """Return a block's findings with this value."""
        return replace(found, findings={**found.findings, cls.key: value})

    @classmethod
    def test(cls, answers: Asked, found: BlockFound) -> tuple[R, Absent]:
        """Return the value, of a block's answers and the findings with lower places, and what was not tested."""
        raise NotImplementedError

    @classmethod
    def entries(cls, found: BlockFound) -> Mapping[str, Any]:
        """Return the entries of report.json."""
        return {cls.key: cls.of(found)}

    @classmethod
    def common_methods(cls, blocks: Sequence[BlockFound]) -> Iterable[str]:
        """Return the sentences of the methods paragraph about all blocks together."""
        return ()

    def rows(self) -> Iterable[Row]:
        """Return the rows of tests.csv."""
        return ()

    def section(self) -> Iterable[str]:
        """Return the HTML of its part of the report's section of the block."""
        return ()

    def sentences(self) -> Iterable[str]:
        """Return the sentences of the summary."""
        return ()

    def limits(self) -> Iterable[str]:
        """Return the sentences about what was not shown."""
        return ()

    def methods(self) -> Iterable[str]:
        """Return the sentences of the methods paragraph."""
        return ()

    def calls(self, codes: str) -> Iterable[str]:
        """Return the calls of the script in R; ``codes`` are the settings as its arguments."""
        return ()

    def figure(self, drawing: Drawing) -> Picture | None:
        """Draw its figure; None where there is nothing to draw."""
        raise NotImplementedError

    def drawn(self) -> Iterable[str]:
        """Return the HTML of its figure, where it was drawn."""
        return drawn(self._pictures, self.figure_name)

    def answer(self) -> Answer:
        """Return the answer to its question of the first page, once the key is open."""
        raise NotImplementedError

    def answered(self, verdict: str, text: str, *, claims: bool = False) -> Answer:
        """Return an answer to its question in this block."""
        return Answer(self.key, self.found.id, self.found.title, verdict, text, claims)
