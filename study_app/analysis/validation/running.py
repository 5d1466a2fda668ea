"""All cells in parallel processes: batches of every cell in turn, so that any part of them is a smaller whole."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from typing import Final

from joblib import Parallel, delayed

from study_app.analysis.validation import counting, single
from study_app.analysis.validation.counting import BATCH, Cell
from study_app.analysis.validation.rates import Rate
from study_app.analysis.validation.studies import EXTENTS, GENERATORS, Simulated

SIZES: Final = (5, 12, 24)


def cells(sizes: Sequence[int] = SIZES) -> tuple[Cell, ...]:
    """Return every kind of study by every generator at every size."""
    return tuple(Cell(generator, extent, n) for generator in GENERATORS for extent in EXTENTS for n in sizes)


def validate(
    of: Simulated, studies: int, seed: int = 1, *, jobs: int = -1, sizes: Sequence[int] = SIZES
) -> Iterator[tuple[int, tuple[Rate, ...]]]:
    """Yield after every batch how many studies were simulated so far in all, and the rates of them.

    Parameters
    ----------
    studies : how many of each cell
    jobs : how many processes work at once; -1: as many as there are cores. What is counted does not depend on it.
    """
    batches = [(first // BATCH, min(BATCH, studies - first)) for first in range(0, studies, BATCH)]
    every = cells(sizes)
    kinds = {(cell.generator, cell.extent): cell for cell in every}
    truths = {kind: counting.truth(of, cell) for kind, cell in kinds.items()}
    work = [
        task
        for batch, many in batches
        for task in (
            *(
                delayed(counting.count)(of, cell, truths[cell.generator, cell.extent], seed, batch, many)
                for cell in every
            ),
            *(delayed(single.count)(case, seed, batch, many) for case in single.cases()),
        )
    ]
    done, total = 0, dict[tuple[str, int, str], Rate]()
    with ExitStack() as running:
        results = Parallel(n_jobs=jobs, return_as="generator", pre_dispatch="3*n_jobs", batch_size=1)(work)
        running.callback(results.close)
        for rates in results:
            done += rates[0].of
            for rate in rates:
                key = (rate.cell, rate.participants, rate.what)
                before = total.get(key, Rate(rate.cell, rate.participants, rate.what, rate.limit, 0, 0))
                total[key] = Rate(*key, rate.limit, before.hits + rate.hits, before.of + rate.of)
            yield done, tuple(total.values())
