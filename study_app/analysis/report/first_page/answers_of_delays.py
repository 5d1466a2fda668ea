"""The answers of the first page about delays: from which one is noticed, and up to which nothing relevant changes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from study_app.analysis.findings.block_results import BlockFound
from study_app.analysis.findings.contrast_with_control import ContrastWithControl
from study_app.analysis.findings.words import all_of, beyond, interval, listed, ms, number, percent, short
from study_app.analysis.report.first_page.answer import NO_EVIDENCE, Answer
from study_app.analysis.tables.planned_analysis import Decided


def noticed_from(found: BlockFound, decided: Decided) -> Answer:
    """Return from which delay a change shows: by primary statements, exploratory ones after them and marked."""
    lowest = {one.item: one.over_all_ms for one in found.lowest if one.over_all_ms is not None}
    different = [one for one in found.against if one.verdict == "different"]
    threshold = found.threshold
    of_primary, of_others = (
        _shortest(
            found,
            {item: at for item, at in lowest.items() if decided.is_primary(item) == primary},
            [one for one in different if decided.is_primary(one.item) == primary],
        )
        for primary in (True, False)
    )
    fitted = None
    if threshold is not None and threshold.effect is not None:
        fitted = None, "More people notice a difference with longer delays, but no single delay is shown to be noticed."
    primary_threshold = decided.noticed is not None and decided.is_primary(decided.noticed)
    confirmed = of_primary or (fitted if primary_threshold else None)
    headline = confirmed or of_others or fitted
    at_ms, told = headline or (None, f"No delay was shown to be noticed. {NO_EVIDENCE}")
    if confirmed and of_others:
        told += f" In exploratory statements, {_first_lower(of_others[1])}"
    exploratory = headline is not None and confirmed is None
    sizes = _noticed_sizes(found, decided, lowest, different, mark=confirmed is not None)
    return Answer("noticed from", found.id, found.title, told, tuple(sizes), headline is not None, exploratory, at_ms)


def _shortest(
    found: BlockFound, lowest: Mapping[str, float], different: Sequence[ContrastWithControl]
) -> tuple[float, str] | None:
    """Return the shortest delay that changes a statement of those given and the sentence of it; None without any."""
    if lowest:
        at = min(lowest.values())
        first = [f"“{short(found, item)}”" for item, delay in lowest.items() if delay == at]
        return at, (
            f"From {ms(at)} on at the latest: {listed(first)} {'changes' if len(first) == 1 else 'change'} with the "
            "delay up to there. Shorter delays may be noticed too."
        )
    if different:
        at = min(one.delay_ms for one in different)
        return at, f"No trend is shown, but answers at {ms(at)} differ from those at {ms(different[0].control_ms)}."
    return None


def _noticed_sizes(
    found: BlockFound,
    decided: Decided,
    lowest: Mapping[str, float],
    different: Sequence[ContrastWithControl],
    *,
    mark: bool,
) -> list[str]:
    """Return the changes of all statements and the threshold; ``mark``: say which of them are exploratory."""

    def marked(item: str | None) -> str:
        return "Exploratory: " if mark and (item is None or not decided.is_primary(item)) else ""

    sizes = [
        f"{marked(item)}“{short(found, item)}” from {ms(delay)} on at the latest{_change(found, item, delay)}"
        for item, delay in sorted(lowest.items(), key=lambda one: one[1])
    ]
    sizes += [
        f"{marked(one.item)}“{short(found, one.item)}” differs at {ms(one.delay_ms)}"
        f"{_change(found, one.item, one.delay_ms)}{'' if one.as_expected else ', against the direction stated'}"
        for one in _first_of_each(different)
        if one.item not in lowest
    ]
    if sizes and found.against:
        sizes[-1] += f". {_level(found.against)}"
    threshold = found.threshold
    if threshold is not None and threshold.effect is not None:
        ends = "no interval" if threshold.interval is None else f"95 % interval {interval(threshold.interval, 0)} ms"
        sizes.append(
            f"{marked(decided.noticed)}Detection threshold, half-way between guesses and lapses: "
            f"{threshold.effect:.0f} ms ({ends})."
        )
    elif threshold is not None:
        sizes.append(f"No detection threshold: {threshold.note}.")
    return sizes


def _first_of_each(different: Iterable[ContrastWithControl]) -> Iterator[ContrastWithControl]:
    """Yield of each statement the comparison at the shortest delay."""
    seen = set()
    for one in sorted(different, key=lambda one: one.delay_ms):
        if one.item not in seen:
            seen.add(one.item)
            yield one


def _change(found: BlockFound, item: str, delay_ms: float) -> str:
    """Return how far the mean answer at a delay is from that at the shortest, with its interval."""
    for one in found.against:
        if one.item == item and one.delay_ms == delay_ms and one.found.effect is not None:
            return f": {_difference(one)}"
    return ""


def _difference(one: ContrastWithControl) -> str:
    effect, ends = one.found.effect or 0.0, one.found.interval
    return f"{'+' if effect > 0 else ''}{number(effect)} {'(no interval)' if ends is None else interval(ends)} points"


def _level(against: Sequence[ContrastWithControl]) -> str:
    """Return what the differences and their intervals are, said once."""
    first = against[0]
    return f"Points: mean difference to {ms(first.control_ms)}, {percent(1 - 2 * first.found.alpha)} interval"


def common_ms(found: BlockFound) -> float | None:
    """Return the longest delay up to which every statement is equivalent at every delay."""
    delays = list((found.equivalent_up_to or {}).values())
    known = [delay for delay in delays if delay is not None]
    return min(known) if known and len(known) == len(delays) else None


def unchanged(found: BlockFound) -> Answer:
    """Return up to which delay mean answers are equivalent to those at the shortest."""
    up_to = {item: delay for item, delay in (found.equivalent_up_to or {}).items() if delay is not None}
    if not found.against:
        why = next((one.why for one in found.absent if "equivalence" in one.what), "nothing was compared")
        return Answer("unchanged up to", found.id, found.title, f"No answer: {why}.", ())
    first = found.against[0]
    points = "point" if first.found.bound == 1 else "points"
    within = f"within ±{first.found.bound:g} {points} of those at {ms(first.control_ms)}"
    at = common_ms(found)
    if at is not None:
        told = f"Up to {ms(at)}: mean answers to {all_of(len(up_to), 'statement')} stay {within}."
    elif up_to:
        single = listed([f"“{short(found, item)}” up to {ms(delay)}" for item, delay in up_to.items()])
        told = f"For no delay is it shown in all statements. In single ones mean answers stay {within}: {single}."
    else:
        told = (
            f"For no delay, not even {ms(first.delay_ms)}, are mean answers shown to stay {within}. That is not "
            "evidence that something changes."
        )
    here = [one for one in found.against if one.delay_ms <= (at or first.delay_ms) and one.found.effect is not None]
    sizes = []
    if here:
        largest = max(here, key=lambda one: abs(one.found.effect or 0.0))
        level = percent(1 - 2 * largest.found.alpha)
        sizes.append(
            f"The largest difference {'up to' if at is not None else 'at'} {ms(at or first.delay_ms)}: "
            f"“{short(found, largest.item)}”, {_difference(largest)} ({level} interval); "
            f"people beyond the bound: {beyond(largest.found)}."
        )
    sizes.append("This is about means: single people may notice, and what is within the bound may still change.")
    return Answer("unchanged up to", found.id, found.title, told, tuple(sizes))


def _first_lower(words: str) -> str:
    return words[:1].lower() + words[1:]
