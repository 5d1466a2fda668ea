"""Simulates all cells by an executor: batches of the cells alternate, so that partial results are balanced."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from functools import partial
from typing import Final, TypeAlias

from study_app.evidence.report_rates import single_test_rates, study_rates
from study_app.evidence.report_rates.known_effects import EXTENTS, GENERATORS, Simulated
from study_app.evidence.report_rates.rates import Rate
from study_app.evidence.report_rates.study_rates import BATCH, Cell

SIZES: Final = (5, 12, 24)

ROUNDS: Final = 4
"""A cell with an undecided rate is continued until it has so many times the studies that were asked for."""

Key: TypeAlias = tuple[str, int]
"""The name of a cell and its number of participants."""

Count: TypeAlias = Callable[[int, int, int], tuple[Rate, ...]]
"""Returns the rates of a batch: seed, number of the batch, studies in it."""


def cells(sizes: Sequence[int] = SIZES) -> tuple[Cell, ...]:
    """Return every kind of study by every generator at every size."""
    return tuple(Cell(generator, extent, n) for generator in GENERATORS for extent in EXTENTS for n in sizes)


def validate(
    simulation: Simulated,
    studies: int,
    executor: Executor,
    *,
    seed: int = 1,
    sizes: Sequence[int] = SIZES,
    progress: Callable[[str], object] = str,
) -> Iterator[tuple[int, tuple[Rate, ...]]]:
    """Yield after every batch how many studies were simulated so far in all, and the rates of them.

    Cells with an undecided rate are continued with as many further studies, up to ``ROUNDS`` times as many in all. A
    continued cell counts all of its rates on, those that hold included; ``progress`` is called with a line for it.
    Every batch draws from a stream of its own, so what is counted does not depend on the executor.
    """
    counts = cell_counts(simulation, sizes)
    done, total = 0, dict[tuple[str, int, str], Rate]()
    for finished in range(ROUNDS):
        waiting = [
            executor.submit(count, seed, batch, many)
            for batch, many in _batches(studies, finished)
            for count in counts.values()
        ]
        for future in waiting:
            rates = future.result()
            done += rates[0].studies
            for rate in rates:
                key = (rate.cell, rate.participants, rate.what)
                total[key] = total[key] + rate if key in total else rate
            yield done, tuple(total.values())
        undecided = [rate for rate in total.values() if rate.holds == "too few studies"]
        counts = {key: counts[key] for key in dict.fromkeys((rate.cell, rate.participants) for rate in undecided)}
        if not counts:
            return
        if finished + 1 < ROUNDS:
            for rate in undecided:
                progress(f"continued: {rate}")


def cell_counts(simulation: Simulated, sizes: Sequence[int]) -> Mapping[Key, Count]:
    """Return how the rates of every cell are counted."""
    every = cells(sizes)
    kinds = {(cell.generator, cell.extent): cell for cell in every}
    truths = {kind: study_rates.truth(simulation, cell) for kind, cell in kinds.items()}
    return {
        **{
            (cell.name, cell.participants): partial(
                study_rates.count, simulation, cell, truths[cell.generator, cell.extent]
            )
            for cell in every
        },
        **{case: partial(single_test_rates.count, case) for case in single_test_rates.cases()},
    }


def _batches(studies: int, finished: int) -> list[tuple[int, int]]:
    """Return the numbers and sizes of the batches of so many studies, after so many finished rounds of them."""
    starts = range(0, studies, BATCH)
    return [(number, min(BATCH, studies - start)) for number, start in enumerate(starts, start=finished * len(starts))]
