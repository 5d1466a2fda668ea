"""What a delay in milliseconds can and cannot mean: the sentence that is most easily said too strongly."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from study_app.analysis.report.words import counted, interval, listed, ms, number, short
from study_app.analysis.results import Against, BlockFound, Delivered, Results

VERDICTS: Final = ("equivalent", "different", "inconclusive")


def tempting_ms(found: BlockFound) -> float | None:
    """Return the delay of which one would most like to say that it does not matter.

    It is the longest at which no statement differs from the shortest delay; without any, the shortest that was added.
    """
    if len(found.delays_ms) < 2:
        return None
    different = {one.delay_ms for one in found.against if one.verdict == "different"}
    calm = [delay for delay in found.delays_ms[1:] if delay not in different]
    return max(calm) if calm and found.against else found.delays_ms[1]


def meaning(found: BlockFound, results: Results) -> tuple[str, ...]:
    """Return the paragraphs on that delay."""
    delay_ms = tempting_ms(found)
    if delay_ms is None:
        return ()
    return (_as_number(found, results, delay_ms), *_as_lowest(found, delay_ms), *_as_claim(found, delay_ms))


def by_delay(found: BlockFound) -> list[list[str]]:
    """Return a row a delay: in which statements it is equivalent, different, inconclusive, and what that lets say."""
    rows = []
    for delay_ms in dict.fromkeys(one.delay_ms for one in found.against):
        here = [one for one in found.against if one.delay_ms == delay_ms]
        told = [
            ", ".join(short(found, one.item) for one in here if one.verdict == verdict) or "–" for verdict in VERDICTS
        ]
        rows.append([ms(delay_ms), *told, _said(found, here)])
    return rows


def _as_number(found: BlockFound, results: Results, delay_ms: float) -> str:
    by_delay_ms = {one.delay_ms: one for one in results.delivered if one.block == found.id}
    at, control = by_delay_ms.get(delay_ms), by_delay_ms.get(found.delays_ms[0])
    presented = listed([f"{delay:g}" for delay in found.delays_ms])
    return (
        f"As a number. {ms(delay_ms)} is what was asked for. {_achieved(at, control)} The display's own latency "
        "comes on top of it and is not in these numbers; only a photodiode at the corner of the screen tells it. Only "
        f"{presented} ms were presented: nothing was asked about delays between them."
    )


def _achieved(at: Delivered | None, control: Delivered | None) -> str:
    if at is None or at.achieved_ms is None:
        return "What was achieved was not measured."
    told = f"What was drawn was {number(at.achieved_ms, 1)} ms old on average, on the program's own clock"
    if control is None or control.achieved_ms is None:
        return f"{told}."
    return f"{told}, and {number(control.achieved_ms, 1)} ms at the shortest delay, with which it is compared."


def _as_lowest(found: BlockFound, delay_ms: float) -> Iterator[str]:
    lowest = {one.item: one.steps.lowest_ms for one in found.lowest}
    at = [f"“{short(found, item)}”" for item, lowest_ms in lowest.items() if lowest_ms == delay_ms]
    below = [f"“{short(found, item)}”" for item, lowest_ms in lowest.items() if (lowest_ms or delay_ms) < delay_ms]
    people = counted(found.n, "participant")
    told = ""
    if below:
        told += f" For {listed(below)} a trend shows already below {ms(delay_ms)}."
    if at:
        told += f" For {listed(at)} it is the lowest delay up to which these {people} suffice to show a trend."
    yield (
        f"As a limit.{told or ' No statement has its lowest delay with a trend here.'} Such a delay depends on how "
        "many take part: more participants tend to find a lower one. It is an upper bound of what is noticed, and says "
        "nothing about what lies below it."
    )


def _as_claim(found: BlockFound, delay_ms: float) -> Iterator[str]:
    here = [one for one in found.against if one.delay_ms == delay_ms]
    if not here:
        yield (
            f"As a claim. That answers at {ms(delay_ms)} are not significantly different would be no evidence that "
            "they are the same. To show that takes a bound of equivalence, decided before the study; there is none."
        )
        return
    first = here[0]
    bound = f"±{first.found.bound:g} {'point' if first.found.bound == 1 else 'points'}"
    verdicts = _by_verdict(found, here)
    yield (
        f"As a claim. A comparison that is not significant is no evidence that {ms(delay_ms)} goes unnoticed. What "
        f"would be is equivalence to {ms(first.control_ms)} within {bound}: {verdicts}{_needed(here)} "
        f"{_said(found, here)}"
    )


def _by_verdict(found: BlockFound, here: list[Against]) -> str:
    parts = []
    for verdict in VERDICTS:
        told = [f"“{short(found, one.item)}” ({_difference(one)})" for one in here if one.verdict == verdict]
        if told:
            parts.append(f"{verdict} for {listed(told)}")
    return "; ".join(parts) + "."


def _difference(one: Against) -> str:
    found = one.found
    doubted = ", but not without normality" if one.verdict != found.verdict else ""
    if found.interval is None:
        return f"{number(found.effect)}, no interval: {found.no_interval}"
    return f"{number(found.effect)}, {100 * found.interval.level:.0f} % interval {interval(found.interval)}{doubted}"


def _needed(here: list[Against]) -> str:
    needed = [one.found.n_needed for one in here if one.verdict != "equivalent" and one.found.n_needed]
    if not needed:
        return ""
    span = f"{min(needed)}" if min(needed) == max(needed) else f"{min(needed)} to {max(needed)}"
    return (
        f" With answers that spread as these do, showing it with 80 % power would take about {span} participants, if "
        "there were truly no difference; a spread estimated from few is itself uncertain."
    )


def _said(found: BlockFound, here: list[Against]) -> str:
    delay = ms(here[0].delay_ms)
    if all(one.verdict == "equivalent" for one in here):
        return (
            f"What can be said: at {delay} the mean answers to these statements stay within the bound. Not that "
            "nothing changes within it, not that no single person notices it, and not for other tasks or statements."
        )
    if _speaks_against(found, here[0].delay_ms):
        return f"These data speak against the sentence “delays up to {delay} do not matter”."
    return (
        f"So these data do not support the sentence “delays up to {delay} do not matter”, and do not refute it: they "
        "are too few or too scattered to tell."
    )


def _speaks_against(found: BlockFound, delay_ms: float) -> bool:
    """Return whether a delay up to this one differs from the shortest, or a trend shows already up to it."""
    differs = any(one.verdict == "different" and one.delay_ms <= delay_ms for one in found.against)
    return differs or any(one.steps.lowest_ms is not None and one.steps.lowest_ms <= delay_ms for one in found.lowest)
