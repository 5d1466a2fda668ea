"""Common parts of all evidence: tables, the output of a command, and measurements that alternate."""

import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeVar

from matplotlib.figure import Figure

from study_app.errors import StudyError
from study_app.figure_style import PLOT_SETTINGS, file_bytes
from study_app.store.files import csv_text_of, write_files

TURN_S: Final = 0.25
"""Duration of a turn of each loop [s]."""
_MIN_S: Final = 0.5
_MAX_S: Final = 3600.0

_Arm = TypeVar("_Arm")
_Result = TypeVar("_Result")


@dataclass(frozen=True)
class Table:
    """Rows of cells below headings; the first ``left`` columns, or those with these indices, are text, left-aligned."""

    headings: Sequence[str]
    rows: Sequence[Sequence[object]]
    left: int | tuple[int, ...] = 0

    def text(self) -> str:
        cells = [[str(cell) for cell in row] for row in (self.headings, *self.rows)]
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        aligned = [
            f"{'<' if is_text else '>'}{width}" for is_text, width in zip(self._are_text_columns(), widths, strict=True)
        ]
        lines = ("  ".join(map(format, row, aligned)).rstrip() for row in cells)
        return "\n".join(lines)

    def markdown(self) -> str:
        marks = ["---" if is_text else "--:" for is_text in self._are_text_columns()]
        return "\n".join(f"| {' | '.join(map(str, row))} |" for row in (self.headings, marks, *self.rows))

    def csv(self) -> str:
        return csv_text_of([self.headings, *self.rows])

    def _are_text_columns(self) -> list[bool]:
        text_columns = range(self.left) if isinstance(self.left, int) else self.left
        return [k in text_columns for k in range(len(self.headings))]


@dataclass(frozen=True)
class Evidence:
    """The output of an evidence command: printed text, files, and whether a limit is missed or undecided.

    ``files`` are texts by file name; ``figures`` draws the others; ``closing`` is printed last.
    """

    text: str
    files: Mapping[str, str]
    figures: Callable[[], Mapping[str, bytes]] = dict
    missed: bool = False
    undecided: bool = False
    closing: str = ""

    def write(self, to: Path) -> tuple[Path, ...]:
        """Write all files into the folder ``to``, or none; return their paths.

        Raises
        ------
        AnalysisError
            The folder cannot be written.
        """
        contents = {name: text.encode() for name, text in self.files.items()}
        return write_files(to, {**contents, **self.figures()})


def plot_files(name: str, title: str, draw: Callable[..., Figure], *data: Any) -> Callable[[], Mapping[str, bytes]]:
    """Return a function that draws a figure as ``name.png`` and ``name.svg``."""

    def files() -> Mapping[str, bytes]:
        figure = draw(*data)
        return {f"{name}.{kind}": file_bytes(figure, kind, title, PLOT_SETTINGS) for kind in ("png", "svg")}

    return files


def duration(ns: float) -> str:
    """Return a time as an axis label: 10 ns, 1 µs, 100 s."""
    for unit, size in (("s", 1e9), ("ms", 1e6), ("µs", 1e3)):
        if ns >= size:
            return f"{ns / size:g} {unit}"
    return f"{ns:g} ns"


def run(
    measure: Callable[..., _Result],
    cases: Iterable[Sequence[Any]],
    executor: Executor | None = None,
    progress: Callable[[int], object] = lambda _done: None,
) -> tuple[_Result, ...]:
    """Return the results of ``measure`` for each case; in parallel with an executor.

    ``progress`` is called with the number of finished cases.
    """
    rows: list[_Result] = []
    for row in (map if executor is None else executor.map)(measure, *zip(*cases, strict=True)):
        rows.append(row)
        progress(len(rows))
    return tuple(rows)


def check_seconds(seconds: float, subject: str) -> None:
    """Raise an error if a duration is out of range.

    Raises
    ------
    StudyError
        The duration is out of range.
    """
    if not _MIN_S <= seconds <= _MAX_S:
        raise StudyError(f"{subject} for {_MIN_S:g} to {_MAX_S:g} s, not {seconds:g}")


def take_turns(
    arms: Mapping[_Arm, Callable[[int], _Result]],
    rounds: int,
    *,
    ending: threading.Event,
    progress: Callable[[str], object] = lambda _line: None,
    alternating: bool = False,
) -> dict[_Arm, list[_Result]]:
    """Run each arm once per round, so that other load affects all alike; return the results by arm.

    An arm is called with the number of the round; with ``alternating``, every second round is in reverse order.
    """
    rows: dict[_Arm, list[_Result]] = {arm: [] for arm in arms}
    for number in range(rounds):
        for arm in reversed(tuple(arms)) if alternating and number % 2 else arms:
            if ending.is_set():
                raise KeyboardInterrupt
            rows[arm].append(arms[arm](number))
        if number * 10 // rounds < (number + 1) * 10 // rounds:
            progress(f"{100 * (number + 1) // rounds:3} %")
    return rows


def paced_steps(
    seconds: float, every_s: float, *, ending: threading.Event, progress: Callable[[str], object]
) -> Iterator[int]:
    """Yield 0, 1, 2 … for ``seconds``, with a pause after each, and report progress once per percent."""
    began_s, shown, number = time.perf_counter(), -1, 0
    while (proportion := (time.perf_counter() - began_s) / seconds) < 1:
        if ending.is_set():
            raise KeyboardInterrupt
        if int(100 * proportion) > shown:
            shown = int(100 * proportion)
            progress(f"{shown:3} %")
        yield number
        number += 1
        time.sleep(every_s)
