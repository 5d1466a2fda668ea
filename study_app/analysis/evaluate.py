"""From a study to all that can be said about it: the one place that decides which tests apply to which block."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final, TypeAlias

from study_app.analysis.answered import asked, sealed
from study_app.analysis.conduct import delivered, orders
from study_app.analysis.delays_found import delays_found
from study_app.analysis.liquids_found import liquids_found
from study_app.analysis.performance import Performance, performance
from study_app.analysis.questions import Block
from study_app.analysis.results import BlockFound, Results
from study_app.analysis.tables import Study

Progress: TypeAlias = Callable[[str, float], object]
"""Is told what is being done, and which share of all is done (0 to 1); what it raises ends the evaluation."""

SEED: Final = 1
"""Of all random rearrangements and resamples: the same results give the same numbers."""


def silent(_what: str, _share: float) -> None:
    """Tell nobody."""


def evaluate(study: Study, *, seed: int = SEED, progress: Progress = silent) -> Results:
    """Test everything that the answers and recordings of a study can answer.

    While the key is sealed only counts and comparisons of codes are there; ``BlockFound.absent`` says what waits, and
    what so few participants could not show.
    """
    blocks = []
    for number, block in enumerate(study.blocks):
        each = partial(_testing, progress, 0.5 * number / len(study.blocks))
        blocks.append(_block(study, block, seed, each))
    return Results(
        decided=study.decided,
        people=study.people,
        blocks=tuple(blocks),
        delivered=delivered(study),
        orders=orders(study),
        performance=_performance(study, progress),
        seed=seed,
    )


def _testing(progress: Progress, share: float, what: str) -> None:
    progress(f"testing: {what}", share)


def _block(study: Study, block: Block, seed: int, each: Callable[[str], object]) -> BlockFound:
    of = asked(study, block, seed, each)
    if not block.revealed:
        return sealed(study, of)
    return delays_found(study, of) if block.kind == "delays" else liquids_found(study, of)


def _performance(study: Study, progress: Progress) -> Performance | None:
    """Measure motion and force; None while sealed, since a thick liquid is known by its force."""
    if not study.revealed:
        return None
    return performance(study, lambda done, of: progress(f"reading recordings: {done} of {of}", 0.5 + 0.3 * done / of))
