"""The base class of statistics of levels, from which all outputs are generated, and texts that they share.

The coordinate u of a level is its decimal logarithm if levels are spaced logarithmically, otherwise the level itself.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any, ClassVar, Final, Generic, TypeAlias, TypeVar

import numpy as np
import pandas as pd

from study_app.analysis import levels
from study_app.analysis.data.blocks import LevelBlock, published_text
from study_app.analysis.data.study_tables import Study
from study_app.analysis.html_page import drawn_figure, heading, paragraph, table_of
from study_app.analysis.levels.columns import RESULTS
from study_app.analysis.page_layout import Picture
from study_app.analysis.results import LevelsResult
from study_app.analysis.statistics.outcome import student_interval
from study_app.analysis.wording import listed, number
from study_app.discovery import modules_of

_R = TypeVar("_R")
TableColumn: TypeAlias = tuple[str, Callable[[Any], str]] | None
"""A column of a table in the report: its heading and a function from row to cell; None is omitted."""

MOTORS: Final = "the sound of the motors was not masked, so participants may have relied on it."


class LevelStatistic(Generic[_R]):
    """A statistic of blocks of levels; an instance provides its output for one block.

    All outputs include every subclass with a ``key`` in the modules of this folder. ``_R`` is the type of its rows; the
    ``participant`` of a group's row is None. Figures are listed in `level_figures.FIGURES`.

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
        self.result = result
        self.rows = self.rows_in(result)
        self.pictures = pictures or {}
        self.estimator = estimator

    @classmethod
    def rows_in(cls, result: LevelsResult) -> tuple[_R, ...]:
        """Return the statistic's rows in a block's result."""
        return result.statistics.get(cls.key, ())

    @classmethod
    def participant_rows(cls, result: LevelsResult) -> tuple[_R, ...]:
        """Return the rows of single participants in a block's result."""
        return tuple(row for row in cls.rows_in(result) if getattr(row, "participant", None) is not None)

    @classmethod
    def is_exported_in(cls, study: Study) -> bool:
        """Return whether its table is exported for a study."""
        return bool(cls.table)

    @classmethod
    def common_methods(cls, blocks: Sequence[LevelsResult]) -> Iterable[str]:
        """Return the sentences of the methods paragraph that concern all blocks together."""
        return ()

    def export_rows(self) -> Iterable[Mapping[str, Any]]:
        """Return the rows of its exported table, each with its participant."""
        names = ["participant", *(column.name for column in RESULTS[self.table].columns)]
        for row in self.participant_rows(self.result):
            yield {name: getattr(row, name, None) for name in names} | {"block": self.result.block}

    def section(self) -> Iterator[str]:
        """Yield the HTML of its section in the report."""
        if not self.rows:
            return
        yield heading(3, self.heading())
        columns = [column for column in self.table_columns() if column is not None]
        yield table_of(self.rows, *columns, words=int(columns[0][0] == "Participant"))
        if words := self.explanation():
            yield paragraph(words, "soft")
        if published := [
            published_text(published, self.result.unit)
            for published in self.result.published
            if self.is_comparable_with(published.measure)
        ]:
            yield paragraph(f"Published: {'; '.join(published)}.")
        for name in self.figures:
            yield from drawn_figure(self.pictures, f"{name}-{self.result.block}")

    def heading(self) -> str:
        """Return the heading of its section in the report."""
        return self.title

    def table_columns(self) -> Sequence[TableColumn]:
        """Return the columns of its table in the report."""
        raise NotImplementedError

    def explanation(self) -> str:
        """Return the text below the table."""
        return ""

    def is_comparable_with(self, measure: str) -> bool:
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

    def standard_column(self) -> TableColumn:
        """Return the column of standards if there are several; otherwise None."""

        def standard(row: Any) -> float | None:
            return row["standard"] if isinstance(row, dict) else row.standard  # type: ignore[no-any-return]

        if len(set(map(standard, self.rows))) < 2:
            return None
        return f"Standard{unit(self.result)}", lambda row: digits(standard(row), 4)


@cache
def statistics() -> tuple[type[LevelStatistic[Any]], ...]:
    """Return all statistics in this folder's modules, ordered by their places."""
    types = {var for module in modules_of(levels) for var in vars(module).values() if isinstance(var, type)}
    classes = {cls for cls in types if issubclass(cls, LevelStatistic) and hasattr(cls, "key")}
    return tuple(sorted(classes, key=lambda cls: cls.place))


def digits(value: float | None, count: int = 3) -> str:
    """Return a number with the given number of digits; a dash for None."""
    return "–" if value is None else f"{value:.{count}g}".replace("-", "−")


def signed(value: float | None) -> str:
    """Return a number with three digits and its sign; a dash for None."""
    return "–" if value is None else f"{value:+.3g}".replace("-", "−")


def cell_text(value: float | str | None) -> str:
    """Return a level, a standard or a condition as a cell."""
    return value.replace("_", " ") if isinstance(value, str) else digits(value, 4)


def interval_text(low: float | None, high: float | None, format_number: Callable[[float], str] = digits) -> str:
    """Return an interval as text; a dash for None."""
    return "–" if low is None or high is None else f"{format_number(low)} – {format_number(high)}"


def unit(result: LevelsResult) -> str:
    """Return the unit of the varied number in brackets."""
    return f" [{result.unit}]" if result.unit else ""


PARTICIPANT_COLUMNS: Final[tuple[tuple[str, Callable[[Any], str]], ...]] = (
    ("Participant", lambda row: row.participant or f"group of {row.n}"),
    ("n", lambda row: "–" if row.participant is None else str(row.n)),
)
"""The columns that identify the participant or the group of a row."""
INTERVAL: Final[TableColumn] = ("95 % interval", lambda row: interval_text(row.low, row.high))
INTERVAL_2: Final[TableColumn] = ("95 % interval", lambda row: interval_text(row.low, row.high, number))
"""The interval with two decimals."""

KINDS: Final = {"weber": "Weber fractions", "difference": "differences", "value": "values"}
_LEVELS: Final[Mapping[str | None, str]] = {"weber": "Weber fraction for ", "difference": "difference in ", "value": ""}


def level_text(result: LevelsResult) -> str:
    """Return the name of a level with its unit: "Weber fraction for viscosity", "Viscosity [Pa·s]", "Condition"."""
    if result.quantity is None:
        return "Condition"
    words = f"{_LEVELS[result.level_kind]}{result.quantity}"
    return words[:1].upper() + words[1:] + ("" if result.level_kind == "weber" else unit(result))


def with_unit(result: LevelsResult, value: float) -> str:
    """Return a value of the varied number with its unit."""
    return f"{value:g} {result.unit or ''}".rstrip()


def standards_phrase(result: LevelsResult, rows: Iterable[Any]) -> str:
    """Return the standards of rows as a phrase: " for standards of 4 and 8 N·s/m"; "" without any."""
    standards = sorted({row.standard for row in rows if row.standard is not None})
    noun = "a standard" if len(standards) == 1 else "standards"
    values = listed([f"{standard:g}" for standard in standards])
    return f" for {noun} of {values} {result.unit}".rstrip() if standards else ""


def interval_phrase(row: Any, format_number: Callable[[float], str]) -> str:
    """Return the interval of a row as text."""
    if row.low is None or row.high is None:
        return "no interval"
    return f"95 % interval {format_number(row.low)} to {format_number(row.high)}"


def analysed_rows(block: LevelBlock, opened: pd.DataFrame, answer: str = "response") -> pd.DataFrame:
    """Return the analysed rows of a block with a value in the column ``answer``."""
    return opened[(opened["block"] == block.id) & opened["analysed"] & opened[answer].notna()]


def group_mean_row(
    rows: Sequence[_R],
    centre: str,
    *others: str,
    coordinate: Callable[[float], float] = float,
    level_of: Callable[[float], float] = float,
    **group: Any,
) -> _R:
    """Return the group's row: means over the participants whose value is known; ``group`` overrides fields.

    The field ``centre`` is averaged in the coordinate u and has Student's 95 % interval.
    """
    known_values = {
        name: [value for row in rows if (value := getattr(row, name)) is not None] for name in (centre, *others)
    }
    means: dict[str, Any] = {name: float(np.mean(values)) if values else None for name, values in known_values.items()}
    u = np.array([coordinate(value) for value in known_values.pop(centre)])
    ends = student_interval(u) if len(u) else (None, None)
    low, high = (None if end is None else level_of(end) for end in ends)
    means[centre] = level_of(float(u.mean())) if len(u) else None
    first: Any = rows[0]
    return replace(first, participant=None, n=len(rows), low=low, high=high, **means, **group)  # type: ignore[no-any-return]
