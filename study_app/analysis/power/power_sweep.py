"""The sweep over simulated studies: the same counts whichever executor computes them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from functools import partial

from study_app.analysis.power.batch_counts import BATCH, Counts, count
from study_app.analysis.power.plan import Plan


def sweep(
    plan: Plan, sizes: Sequence[int], studies: int, seed: int, executor: Executor
) -> Iterator[tuple[int, Counts]]:
    """Yield after every batch how many studies of each size were simulated so far, and what was counted in them all.

    Every batch draws from a stream of its own, so the counts do not depend on the executor.
    """
    starts = range(0, studies, BATCH)
    sizes_of_batches = [min(BATCH, studies - first) for first in starts]
    counted = executor.map(partial(count, plan, tuple(sizes), seed), range(len(starts)), sizes_of_batches)
    done, total = 0, Counts()
    for many, numbers in zip(sizes_of_batches, counted, strict=True):
        done += many
        total = {what: total.get(what, 0) + number for what, number in numbers.items()}
        yield done, total
