"""The base class of statistics of levels: one declaration from which all outputs follow, and the words they share.

The coordinate u of a level is its logarithm to the base of ten where levels are spaced so, otherwise the level itself.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any, ClassVar, Final, Generic, TypeAlias, TypeVar

import numpy as np
import pandas as pd

from study_app.analysis import levels
from study_app.analysis.data.blocks import LevelBlock, published_words
from study_app.analysis.data.study_tables import Study
from study_app.analysis.html_page import drawn_figure, heading, paragraph, table_of
from study_app.analysis.levels.columns import RESULTS
from study_app.analysis.page_layout import Picture
from study_app.analysis.results import LevelsResult
from study_app.analysis.statistics.outcome import student_interval
from study_app.analysis.wording import listed, number
from study_app.discovery import modules_of

_R = TypeVar("_R")
Shown: TypeAlias = tuple[str, Callable[[Any], str]] | None
"""A column of a table of the report: its heading and what makes a cell of a row; None is one that is left out."""

MOTORS: Final = "the sound of the motors was not masked, so participants may have relied on it."


class LevelStatistic(Generic[_R]):
    """A statistic of blocks of levels; an instance provides its output for one block.

    A subclass with a ``key`` in a module of this folder is in every output. ``_R`` is the type of its rows; the
    ``participant`` of a group's row is None. A figure is a row of `level_figures.FIGURES`.

    Attributes
    ----------
    key : str
        Its name in report.json.
    place : float
        Its place in the order: statistics with lower places are computed first.
    since : int
        The first format of the study's file whose report.json has it even if there are no rows.
    compute : callable
        Returns the rows of a block from the block, the rows of `tracks`, the study, and the earlier results.
    title : str
        The heading of its part of the report.
    figures : tuple of str
        The names of the figures below its table.
    table : str
        The name of the exported table (CSV, Parquet, SPSS, codebook) in `columns.RESULTS`, whose columns are attributes
        of rows of participants; empty if none is exported.
    """

    key: ClassVar[str]
    place: ClassVar[float]
    since: ClassVar[int] = 1
    compute: "ClassVar[staticmethod[[LevelBlock, pd.DataFrame, Study, LevelsResult], Iterable[Any]]]"
    title: ClassVar[str] = ""
    figures: ClassVar[tuple[str, ...]] = ()
    table: ClassVar[str] = ""

    def __init__(
        self, result: LevelsResult, pictures: Mapping[str, Picture] | None = None, estimator: str | None = None
    ) -> None:
        self.found = result
        self.rows = self.of(result)
        self.pictures = pictures or {}
        self.estimator = estimator

    @classmethod
    def of(cls, result: LevelsResult) -> tuple[_R, ...]:
        """Return its rows in a block."""
        return result.statistics.get(cls.key, ())

    @classmethod
    def own(cls, result: LevelsResult) -> tuple[_R, ...]:
        """Return its rows of single participants in a block."""
        return tuple(one for one in cls.of(result) if getattr(one, "participant", None) is not None)

    @classmethod
    def exported_in(cls, study: Study) -> bool:
        """Return whether its table is exported for a study."""
        return bool(cls.table)

    @classmethod
    def common_methods(cls, blocks: Sequence[LevelsResult]) -> Iterable[str]:
        """Return the sentences of the methods paragraph that concern all blocks together."""
        return ()

    def exported(self) -> Iterable[Mapping[str, Any]]:
        """Return the rows of its exported table, each with its participant."""
        names = ["participant", *(column.name for column in RESULTS[self.table].columns)]
        for one in self.own(self.found):
            yield {name: getattr(one, name, None) for name in names} | {"block": self.found.block}

    def section(self) -> Iterator[str]:
        """Yield the HTML of its section in the report."""
        if not self.rows:
            return
        yield heading(3, self.heading())
        columns = [column for column in self.shown() if column is not None]
        yield table_of(self.rows, *columns, words=int(columns[0][0] == "Participant"))
        if words := self.explained():
            yield paragraph(words, "soft")
        if published := [
            published_words(published, self.found.unit)
            for published in self.found.published
            if self.compares(published.measure)
        ]:
            yield paragraph(f"Published: {'; '.join(published)}.")
        for name in self.figures:
            yield from drawn_figure(self.pictures, f"{name}-{self.found.block}")

    def heading(self) -> str:
        """Return the heading of its section in the report."""
        return self.title

    def shown(self) -> Sequence[Shown]:
        """Return the columns of its table in the report."""
        raise NotImplementedError

    def explained(self) -> str:
        """Return the text below the table."""
        return ""

    def compares(self, measure: str) -> bool:
        """Return whether it can be compared with published values of a measure."""
        return False

    def sentences(self) -> Iterable[str]:
        """Return its sentences in the summary."""
        return ()

    def limits(self) -> Iterable[str]:
        """Return sentences about its limitations."""
        return ()

    def methods(self, block: LevelBlock) -> Iterable[str]:
        """Return the sentences of the methods paragraph about the block."""
        return ()

    def standard(self) -> Shown:
        """Return the column of standards if there are several; otherwise None."""

        def standard(one: Any) -> float | None:
            return one["standard"] if isinstance(one, dict) else one.standard  # type: ignore[no-any-return]

        if len(set(map(standard, self.rows))) < 2:
            return None
        return f"Standard{unit(self.found)}", lambda row: digits(standard(row), 4)


@cache
def statistics() -> tuple[type[LevelStatistic[Any]], ...]:
    """Return all statistics in this folder's modules, ordered by their places."""
    held = {var for module in modules_of(levels) for var in vars(module).values() if isinstance(var, type)}
    classes = {one for one in held if issubclass(one, LevelStatistic) and hasattr(one, "key")}
    return tuple(sorted(classes, key=lambda one: one.place))


def digits(value: float | None, count: int = 3) -> str:
    """Return a number with the given number of digits; a dash for None."""
    return "–" if value is None else f"{value:.{count}g}"


def signed(value: float | None) -> str:
    """Return a number with three digits and its sign; a dash for None."""
    return "–" if value is None else f"{value:+.3g}".replace("-", "−")


def cell_text(value: float | str | None) -> str:
    """Return a level, a standard or a condition as a cell."""
    return value.replace("_", " ") if isinstance(value, str) else digits(value, 4)


def interval_text(low: float | None, high: float | None, written: Callable[[float], str] = digits) -> str:
    """Return an interval as text; a dash for None."""
    return "–" if low is None or high is None else f"{written(low)} – {written(high)}"


def unit(result: LevelsResult) -> str:
    """Return the unit of the varied number in brackets."""
    return f" [{result.unit}]" if result.unit else ""


OF_WHOM: Final[tuple[tuple[str, Callable[[Any], str]], ...]] = (
    ("Participant", lambda row: row.participant or f"group of {row.n}"),
    ("n", lambda row: "–" if row.participant is None else str(row.n)),
)
"""The columns that say of whom a row is."""
INTERVAL: Final[Shown] = ("95 % interval", lambda row: interval_text(row.low, row.high))
INTERVAL_2: Final[Shown] = ("95 % interval", lambda row: interval_text(row.low, row.high, number))
"""With two decimals."""

KINDS: Final = {"weber": "Weber fractions", "difference": "differences", "value": "values"}
_LEVELS: Final[Mapping[str | None, str]] = {"weber": "Weber fraction for ", "difference": "difference in ", "value": ""}


def level_words(result: LevelsResult) -> str:
    """Return the name of a level with its unit: "Weber fraction for viscosity", "Viscosity [Pa·s]", "Condition"."""
    if result.quantity is None:
        return "Condition"
    words = f"{_LEVELS[result.level_kind]}{result.quantity}"
    return words[:1].upper() + words[1:] + ("" if result.level_kind == "weber" else unit(result))


def with_unit(result: LevelsResult, value: float) -> str:
    """Return a value of the varied number with its unit."""
    return f"{value:g} {result.unit or ''}".rstrip()


def standards_of(result: LevelsResult, rows: Iterable[Any]) -> str:
    """Return the standards of rows as a phrase: " for standards of 4 and 8 N·s/m"; "" without any."""
    standards = sorted({row.standard for row in rows if row.standard is not None})
    noun = "a standard" if len(standards) == 1 else "standards"
    values = listed([f"{standard:g}" for standard in standards])
    return f" for {noun} of {values} {result.unit}".rstrip() if standards else ""


def interval_words(one: Any, written: Callable[[float], str]) -> str:
    """Return the interval of a row as text."""
    if one.low is None or one.high is None:
        return "no interval"
    return f"95 % interval {written(one.low)} to {written(one.high)}"


def analysed(block: LevelBlock, opened: pd.DataFrame, answer: str = "response") -> pd.DataFrame:
    """Return the analysed rows of a block in which this column is known."""
    return opened[(opened["block"] == block.id) & opened["analysed"] & opened[answer].notna()]


def mean_over(
    own: Sequence[_R],
    middle: str,
    *others: str,
    coordinate: Callable[[float], float] = float,
    level_of: Callable[[float], float] = float,
    **group: Any,
) -> _R:
    """Return the group's row: means over the participants with a known value; ``group`` overrides fields.

    The field ``middle`` is a mean in the coordinate u with Student's 95 % interval.
    """
    known = {name: [value for one in own if (value := getattr(one, name)) is not None] for name in (middle, *others)}
    means: dict[str, Any] = {name: float(np.mean(values)) if values else None for name, values in known.items()}
    u = np.array([coordinate(value) for value in known.pop(middle)])
    ends = student_interval(u) if len(u) else (None, None)
    low, high = (None if end is None else level_of(end) for end in ends)
    means[middle] = level_of(float(u.mean())) if len(u) else None
    first: Any = own[0]
    return replace(first, participant=None, n=len(own), low=low, high=high, **means, **group)  # type: ignore[no-any-return]
