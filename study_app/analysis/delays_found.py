"""What was found where delays were compared: trends, the lowest delay that shows, equivalence, the threshold."""

from __future__ import annotations

import numpy as np

from study_app.analysis.answered import MANY, Asked, asked_again, head, over_all
from study_app.analysis.judging import judged
from study_app.analysis.results import Against, BlockFound, Lowest, Tested, Waiting, p_of_difference
from study_app.analysis.statistics.equivalence import tost
from study_app.analysis.statistics.families import holm
from study_app.analysis.statistics.threshold import Threshold, noticed
from study_app.analysis.statistics.trend import page, step_down
from study_app.analysis.tables import Study


def delays_found(study: Study, of: Asked) -> BlockFound:
    """Return the tests of a block of delays whose settings are known, shortest delay first."""
    delays_ms = [setting.delay_ms or 0.0 for setting in of.block.settings]
    trends, no_trends = _trends(of)
    lowest, no_lowest = _lowest(of, trends, delays_ms)
    against, no_against = _against(of, delays_ms)
    threshold, no_threshold = _threshold(of, delays_ms)
    per_100_ms = np.array(delays_ms)[:, None] / 100
    mixed, incomplete, not_again = asked_again(of, per_100_ms, "the delay")
    return BlockFound(
        **head(study, of),
        overall=over_all(of),
        trends=trends,
        lowest=lowest,
        against=against,
        equivalent_up_to=_up_to(against),
        threshold=threshold,
        mixed=mixed,
        incomplete=incomplete,
        absent=(*no_trends, *no_lowest, *no_against, *no_threshold, *not_again),
    )


def _trends(of: Asked) -> tuple[tuple[Tested, ...], tuple[Waiting, ...]]:
    outcomes = {}
    for item in of.block.items:
        direction = of.decided.direction(item.id)
        if direction is not None:
            of.each(item.short)
            outcomes[item.id] = page(of.values[item.id], direction, seed=of.seed)
    undirected = [item.short for item in of.block.items if item.id not in outcomes]
    why = f"the protocol does not say whether answers should rise or fall with delay ({', '.join(undirected)})"
    found = judged(outcomes, of.decided, f"{of.block.id}: trend over delay")
    return found, (Waiting("test of a trend (Page)", why),) if undirected else ()


def _lowest(
    of: Asked, trends: tuple[Tested, ...], delays_ms: list[float]
) -> tuple[tuple[Lowest, ...], tuple[Waiting, ...]]:
    """Step down in the statements whose trend is there at all."""
    showing = [one for one in trends if one.verdict in ("shown", "suggested")]
    found = []
    for one in showing:
        direction = of.decided.direction(one.item) or "increasing"
        steps = step_down(of.values[one.item], delays_ms, direction, alpha=of.decided.alpha)
        found.append(Lowest(one.item, steps, one.members))
    if trends and not showing:
        why = "no statement shows a trend over all delays; that is not evidence that none is noticed"
        return (), (Waiting("lowest delay that shows", why),)
    return tuple(found), ()


def _against(of: Asked, delays_ms: list[float]) -> tuple[tuple[Against, ...], tuple[Waiting, ...]]:
    """Compare every delay with the shortest one, by the bound that was decided."""
    bound = of.decided.equivalence_bound
    if bound is None:
        why = "the protocol decided no bound of equivalence, and one chosen now would be chosen by the answers"
        return (), (Waiting("test of equivalence", why),)
    found = []
    for item in of.block.items:
        of.each(item.short)
        values = of.values[item.id]
        for place, delay_ms in enumerate(delays_ms[1:], start=1):
            differences = values[:, place] - values[:, 0]
            tested = tost(differences, bound, alpha=of.decided.alpha, seed=of.seed, checks=of.n <= MANY)
            found.append((item.id, delay_ms, tested))
    adjusted = holm([p_of_difference(tested) for _, _, tested in found])
    return tuple(
        Against(item, delay_ms, delays_ms[0], tested, p, len(found), of.decided.direction(item))
        for (item, delay_ms, tested), p in zip(found, adjusted, strict=True)
    ), ()


def _up_to(against: tuple[Against, ...]) -> dict[str, float | None]:
    """Return the longest delay up to which all are equivalent, by statement: a fixed order, so nothing is corrected.

    Equivalent counts only where the tests without normality agree.
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


def _threshold(of: Asked, delays_ms: list[float]) -> tuple[Threshold | None, tuple[Waiting, ...]]:
    item = of.decided.noticed
    if item is None or item not in of.values:
        return None, (Waiting("detection threshold", "the protocol names no statement that asks for it"),)
    of.each("detection threshold")
    return noticed(of.values[item], delays_ms), ()
