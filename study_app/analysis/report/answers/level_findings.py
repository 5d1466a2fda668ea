"""What was found in blocks of levels, a sentence each: thresholds of the group, and its exponent."""

from __future__ import annotations

from collections.abc import Iterator

from study_app.analysis.figures.levels.level_figure import level_words, with_unit
from study_app.analysis.results.level_results import ExponentFound, LevelsFound, ThresholdFound
from study_app.analysis.results.words import counted, number


def level_findings(found: LevelsFound) -> Iterator[str]:
    """Yield the findings of a block with n and interval; none while the key is sealed."""
    for one in found.thresholds:
        if one.participant is None:
            where = "" if one.standard is None else f", standard {with_unit(found, one.standard)}"
            percent = "" if found.guess_rate is None else f" at {50 * (1 + found.guess_rate):.3g} % {found.counts}"
            if one.compared is not None:
                percent += f", {one.compared:.3g} at {found.compared_percent:g} %"
            yield (
                f"{found.title}{where}: threshold {one.threshold:.3g}{percent} ({level_words(found)}; "
                f"{_interval(one, 3)}; {counted(one.n, 'participant')})."
            )
    for exponent in found.exponents:
        if exponent.participant is None:
            meaning = "; 1 is Weber’s law, 0 a constant JND" if found.thresholds else f" over {found.quantity}"
            yield (
                f"{found.title}: {found.exponent_name} {number(exponent.exponent)} ({_interval(exponent)}; "
                f"{counted(exponent.n, 'participant')}){meaning}."
            )
    if (found.thresholds or found.exponents) and found.published:
        yield f"{found.title}: published values: {'; '.join(one.in_words() for one in found.published)}."


def _interval(one: ThresholdFound | ExponentFound, digits: int | None = None) -> str:
    if one.low is None or one.high is None:
        return "no interval"
    low, high = (number(end) if digits is None else f"{end:.{digits}g}" for end in (one.low, one.high))
    return f"95 % interval {low} to {high}"
