"""What was found where delays were compared: trends, the lowest delay that shows, equivalence, the threshold."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from study_app.analysis.designs.block_tests import AGAIN, MANY, OVER_ALL, Asked, asked_again, head, over_all
from study_app.analysis.designs.verdicts import judged
from study_app.analysis.findings.block_results import BlockFound
from study_app.analysis.findings.contrast_with_control import ContrastWithControl
from study_app.analysis.findings.item_test import Tested
from study_app.analysis.findings.lowest_delay import Lowest
from study_app.analysis.findings.not_tested import NotTested
from study_app.analysis.statistics.equivalence.power import participants_needed
from study_app.analysis.statistics.equivalence.tost import tost
from study_app.analysis.statistics.multiple_comparisons import holm
from study_app.analysis.statistics.psychometrics.threshold import Threshold, noticed
from study_app.analysis.statistics.trend import page, step_down
from study_app.analysis.tables.study import Study

TREND: Final = "test of a trend (Page)"
LOWEST: Final = "lowest delay that shows"
EQUIVALENCE: Final = "test of equivalence"
ONE_DELAY: Final = "the block has one delay: there is nothing to compare it with"
THRESHOLD: Final = "detection threshold"


def delays_found(study: Study | None, answers: Asked) -> BlockFound:
    """Return the tests of a block of delays whose settings are known, shortest delay first."""
    delays_ms = list(answers.block.delays_ms)
    overall, failed = answers.attempt(OVER_ALL, lambda: over_all(answers), None)
    (trends, no_trends), failed_trends = answers.attempt(TREND, lambda: _trends(answers), ((), ()))
    (lowest, no_lowest), failed_lowest = answers.attempt(LOWEST, lambda: _lowest(answers, trends, delays_ms), ((), ()))
    (against, no_against), failed_against = answers.attempt(EQUIVALENCE, lambda: _against(answers, delays_ms), ((), ()))
    (threshold, no_threshold), failed_threshold = answers.attempt(
        THRESHOLD, lambda: _threshold(answers, delays_ms), (None, ())
    )
    per_100_ms = np.array(delays_ms)[:, None] / 100
    (mixed, incomplete, not_again), failed_again = answers.attempt(
        AGAIN, lambda: asked_again(answers, per_100_ms, "the delay"), ((), (), ())
    )
    told = head(study, answers)
    return BlockFound(
        **{name: value for name, value in told.items() if name != "absent"},
        overall=overall,
        trends=trends,
        lowest=lowest,
        against=against,
        equivalent_up_to=_up_to(against),
        threshold=threshold,
        mixed=mixed,
        incomplete=incomplete,
        absent=(
            *told["absent"],
            *(*failed, *failed_trends, *failed_lowest, *failed_against, *failed_threshold, *failed_again),
            *(*no_trends, *no_lowest, *no_against, *no_threshold, *not_again),
        ),
    )


def _trends(answers: Asked) -> tuple[tuple[Tested, ...], tuple[NotTested, ...]]:
    if answers.k < 2:
        return (), (NotTested(TREND, ONE_DELAY),)
    outcomes = {}
    for item in answers.block.items:
        direction = answers.decided.direction(item.id)
        if direction is not None:
            answers.each(item.short)
            outcomes[item.id] = page(answers.values[item.id], direction, seed=answers.intervals)
    undirected = [item.short for item in answers.block.items if item.id not in outcomes]
    why = f"the protocol does not say whether answers should rise or fall with delay ({', '.join(undirected)})"
    found = judged(outcomes, answers.decided, f"{answers.block.id}: trend over delay")
    return found, (NotTested(TREND, why),) if undirected else ()


def _lowest(
    answers: Asked, trends: tuple[Tested, ...], delays_ms: list[float]
) -> tuple[tuple[Lowest, ...], tuple[NotTested, ...]]:
    """Step down in the statements whose trend is there at all."""
    showing = [one for one in trends if one.verdict in ("shown", "suggested")]
    found = []
    for one in showing:
        direction = answers.decided.direction(one.item) or "increasing"
        steps = step_down(answers.values[one.item], delays_ms, direction, alpha=answers.decided.alpha)
        found.append(Lowest(one.item, steps, one.members))
    if trends and not showing:
        why = "no statement shows a trend over all delays; that is not evidence that none is noticed"
        return (), (NotTested(LOWEST, why),)
    return tuple(found), ()


def _against(answers: Asked, delays_ms: list[float]) -> tuple[tuple[ContrastWithControl, ...], tuple[NotTested, ...]]:
    """Compare every delay with the shortest one, by the bound that was decided."""
    bound = answers.decided.equivalence_bound
    if answers.k < 2:
        return (), (NotTested(EQUIVALENCE, ONE_DELAY),)
    if bound is None:
        why = "the protocol decided no bound of equivalence, and one chosen now would be chosen by the answers"
        return (), (NotTested(EQUIVALENCE, why),)
    found = []
    for item in answers.block.items:
        answers.each(item.short)
        values = answers.values[item.id]
        for place, delay_ms in enumerate(delays_ms[1:], start=1):
            differences = values[:, place] - values[:, 0]
            tested = tost(
                differences,
                bound,
                alpha=answers.decided.alpha,
                seed=answers.seed,
                checks=answers.n <= MANY,
                verdict_only=answers.verdicts_only,
            )
            if answers.planning:
                tested = replace(tested, n_needed=participants_needed(differences, bound, answers.decided.alpha))
            found.append((item.id, delay_ms, tested))
    adjusted = holm([tested.p_difference for _, _, tested in found])
    return tuple(
        ContrastWithControl(
            item, delay_ms, delays_ms[0], tested.judged(p, len(found)), p, len(found), answers.decided.direction(item)
        )
        for (item, delay_ms, tested), p in zip(found, adjusted, strict=True)
    ), ()


def _up_to(against: tuple[ContrastWithControl, ...]) -> dict[str, float | None]:
    """Return the longest delay up to which all are equivalent, by statement: a fixed order, so nothing is corrected.

    Equivalent is only what every test shows.
    """
    found: dict[str, float | None] = {}
    stopped = set()
    for one in against:
        found.setdefault(one.item, None)
        if one.verdict != "equivalent":
            stopped.add(one.item)
        elif one.item not in stopped:
            found[one.item] = one.delay_ms
    return found


def _threshold(answers: Asked, delays_ms: list[float]) -> tuple[Threshold | None, tuple[NotTested, ...]]:
    item = answers.decided.noticed
    if item is None or item not in answers.values:
        return None, (NotTested(THRESHOLD, "the protocol names no statement that asks for it"),)
    answers.each("detection threshold")
    return noticed(answers.single[item], delays_ms, alpha=answers.decided.alpha, seed=answers.seed), ()
