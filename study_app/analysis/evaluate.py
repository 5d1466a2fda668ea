"""From a study to all that can be said about it: the one place that decides which tests apply to which block."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final, TypeAlias

from study_app.analysis.designs.block_tests import Asked, asked, sealed
from study_app.analysis.designs.delays import delays_found
from study_app.analysis.designs.liquids import liquids_found
from study_app.analysis.findings.block_results import BlockFound, Results
from study_app.analysis.findings.conduct import delivered, orders
from study_app.analysis.findings.not_tested import NotTested
from study_app.analysis.findings.section_failures import Ended, Failure, Failures
from study_app.analysis.tables.compared_blocks import Block
from study_app.analysis.tables.performance import Performance, performance
from study_app.analysis.tables.study import Study

Progress: TypeAlias = Callable[[str, float], object]
"""Is told what is being done, and which share of all is done (0 to 1); what it raises ends the evaluation."""

SEED: Final = 1
"""Of all random rearrangements and resamples: the same results give the same numbers."""


def silent(_what: str, _share: float) -> None:
    """Tell nobody."""


def evaluate(study: Study, *, seed: int = SEED, progress: Progress = silent, planning: bool = True) -> Results:
    """Test everything that the answers and recordings of a study can answer.

    While the key is sealed only counts and comparisons of codes are there; ``BlockFound.absent`` says what waits, and
    what so few participants could not show. A part that fails is in ``Results.failures`` and, with the reason, in its
    block's ``absent``; everything else is there. ``planning``: whether to
    compute how many participants each comparison would need, which is most of the work.
    """
    failures = Failures()
    try:
        return _evaluated(study, seed, failures, partial(_ending, progress), planning=planning)
    except Ended as ended:
        raise ended.error from None


def _ending(progress: Progress, what: str, share: float) -> None:
    """Tell of progress; what that raises ends the evaluation."""
    try:
        progress(what, share)
    except BaseException as error:
        raise Ended(error) from error


def _evaluated(study: Study, seed: int, failures: Failures, progress: Progress, *, planning: bool) -> Results:
    blocks = []
    for number, block in enumerate(study.blocks):
        each = partial(_testing, progress, 0.5 * number / len(study.blocks))
        found = failures.attempt(
            "all tests", partial(_block, study, block, seed, each, failures, planning=planning), block=block.id
        )
        blocks.append(_without_tests(block, found) if isinstance(found, Failure) else found)
    shown = failures.attempt("the delays as they were shown", lambda: delivered(study))
    run = failures.attempt("the orders as run", lambda: orders(study))
    moved = failures.attempt("motion and force", lambda: _performance(study, progress))
    return Results(
        decided=study.decided,
        people=study.people,
        blocks=tuple(blocks),
        delivered=() if isinstance(shown, Failure) else shown,
        orders={} if isinstance(run, Failure) else run,
        performance=None if isinstance(moved, Failure) else moved,
        seed=seed,
        failures=tuple(failures.found),
    )


def _testing(progress: Progress, share: float, what: str) -> None:
    progress(f"testing: {what}", share)


def _block(
    study: Study, block: Block, seed: int, each: Callable[[str], object], failures: Failures, *, planning: bool
) -> BlockFound:
    answers = asked(study, block, seed, each, failures, planning=planning)
    return found_in(study, answers) if block.revealed else sealed(study, answers)


def found_in(study: Study | None, answers: Asked) -> BlockFound:
    """Test everything that a block's answers can answer, its settings being known; without a study no measures."""
    return delays_found(study, answers) if answers.block.kind == "delays" else liquids_found(study, answers)


def _without_tests(block: Block, failure: Failure) -> BlockFound:
    """Return a block of which nothing could be computed."""
    return BlockFound(
        id=block.id,
        title=block.title,
        kind=block.kind,
        revealed=block.revealed,
        n=0,
        settings=block.settings,
        names=tuple(block.name(setting) for setting in block.settings),
        items=block.items,
        labels=block.labels,
        measures=(),
        absent=(NotTested(failure.what, failure.why),),
    )


def _performance(study: Study, progress: Progress) -> Performance | None:
    """Measure motion and force; None while sealed, since a thick liquid is known by its force."""
    if not study.revealed:
        return None
    return performance(
        study, lambda done, total: progress(f"reading recordings: {done} of {total}", 0.5 + 0.3 * done / total)
    )
