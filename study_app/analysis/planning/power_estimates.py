"""The power of a study from an increasing number of simulated studies: power of tests, or precision of estimates."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, TypeAlias

from study_app.analysis.planning import MOST_PARTICIPANTS, SIZES, STUDIES, THRESHOLD_STUDIES
from study_app.analysis.planning.power_curves import Powers, power_markdown, powers
from study_app.analysis.planning.simulated_studies import (
    ConditionFeatures,
    compares_statements,
    plan,
    unsimulated_contrasts,
)
from study_app.analysis.planning.simulated_studies import sweep as sweep_statements
from study_app.analysis.planning.threshold_studies import Precisions, plans, threshold_markdown
from study_app.analysis.planning.threshold_studies import sweep as sweep_thresholds

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from study_app.protocol.model import Protocol

PowerEstimate: TypeAlias = Powers | Precisions


def planned_sizes(study: Protocol) -> tuple[int, ...]:
    """Return the numbers of participants to simulate: the planned looks, or the usual numbers and the planned one."""
    if study.analysis is None:
        return SIZES
    planned = study.analysis.participants or 0
    return study.analysis.looks or tuple(sorted({*SIZES, *([planned] if 1 < planned <= MOST_PARTICIPANTS else ())}))


def estimate_power(
    study: Protocol,
    executor: Executor,
    *,
    sizes: tuple[int, ...],
    trials: tuple[int, ...] = (),
    studies: int | None = None,
    seed: int = 1,
    rehearse: Callable[[], ConditionFeatures],
    progress: Callable[[str], object],
) -> Iterator[PowerEstimate]:
    """Yield the estimate after every batch of simulated studies; the last one is complete.

    ``rehearse`` returns the features of rehearsed trials of each condition, if the study compares statements. A study
    that compares only answers that are not simulated has a single estimate, without simulated studies.

    Raises
    ------
    AnalysisError
        The study makes no comparison and measures no threshold, or a method cannot have so few ``trials``.
    """
    thresholds = plans(study, trials)
    if thresholds and (trials or not compares_statements(study)):
        asked = studies or THRESHOLD_STUDIES
        progress("simulating observers")
        for done, found in sweep_thresholds(thresholds, sizes, asked, seed, executor):
            yield Precisions(protocol=study, sizes=sizes, studies=done, asked=asked, seed=seed, found=found)
        return
    if unsimulated_contrasts(study) and not compares_statements(study):
        yield Precisions(protocol=study, sizes=sizes, studies=0, asked=0, seed=seed, found={})
        return
    asked = studies or STUDIES
    progress("simulating all conditions")
    planned = plan(study, rehearse())
    for done, counts in sweep_statements(planned, sizes, asked, seed, executor):
        yield powers(planned, sizes, done, asked, seed, counts)


def estimate_markdown(estimate: PowerEstimate) -> str:
    """Return the tables that ``power`` prints."""
    return power_markdown(estimate) if isinstance(estimate, Powers) else threshold_markdown(estimate)
