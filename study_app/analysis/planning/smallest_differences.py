"""Tables of the smallest difference that 80 % of studies detect, for each hypothesis and number of participants."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Final

from scipy.special import stdtrit

from study_app.analysis.planning import WANTED
from study_app.analysis.planning.simulated_studies import IF_EQUAL
from study_app.analysis.statistics.mean_tests import equivalence_power, smallest_shift
from study_app.analysis.wording import inclusion_text, whole_percent
from study_app.protocol.model import Contrast
from study_app.protocol.participants import fewest_participants

MOST_SD: Final = 3.0
"""The largest detectable difference [SD] that is reported; sample sizes that need a larger one are too few. [choice]"""


def question_differences(
    contrast: Contrast,
    sizes: Sequence[int],
    alpha: float,
    members: int,
    proportions: tuple[float, float] | None,
    planned: int | None,
    titles: Mapping[str, str],
    *,
    bounds: int,
    setting: str = "",
) -> Iterator[str]:
    """Yield the table of a contrast of answers, scores or settings that are not simulated, in standard deviations.

    ``setting`` is the measure of settings in words, "" for answers and scores. For the other parameters see
    `smallest_differences`.
    """
    values_noun = "participants' mean settings" if setting else "answers or scores"
    if contrast.within is not None:
        values_noun = "within-participant differences"
    logarithms = ", or of their logarithms if levels are spaced logarithmically" * bool(setting)
    description = (
        f"{'Settings' if setting else 'Answers to this question'} are not simulated. Differences are expressed in "
        f"standard deviations (SD) of the {values_noun}{logarithms}; you can obtain the SD from pilot sessions or "
        "published data."
    )
    rows = [(setting or contrast.measure, "1", 1.0)]
    yield from smallest_differences(
        contrast,
        sizes,
        alpha,
        members,
        rows,
        "measure" if setting else "question or score",
        description,
        "±{:.2f} SD".format,
        proportions,
        bounds=bounds,
        planned=planned,
        titles=titles,
        measure=setting or ("" if contrast.form is not None else f"“{contrast.measure}”"),
    )


def _proportions_sentence(first: float, second: float) -> str:
    """Return the sentence on the proportions of participants in two groups."""
    if whole_percent(first) == whole_percent(second):
        return f"Each group contains {whole_percent(first)} of the participants."
    return f"The two groups contain {whole_percent(first)} and {whole_percent(second)} of the participants."


def smallest_differences(
    contrast: Contrast,
    sizes: Sequence[int],
    alpha: float,
    members: int,
    rows: Sequence[tuple[str, str, float]],
    first: str,
    description: str,
    format_difference: Callable[[float], str],
    proportions: tuple[float, float] | None = None,
    bound: float | None = None,
    *,
    bounds: int = 1,
    largest: float | None = None,
    planned: int | None = None,
    assumed: tuple[str, float] | None = None,
    unit: str = "",
    titles: Mapping[str, str],
    measure: str = "",
) -> Iterator[str]:
    """Yield a Markdown table of the smallest difference in a contrast that 80 % of studies detect.

    The contrast is one of ``members`` hypotheses and is tested at the strictest alpha of Holm's correction. Each of
    ``rows`` has the first cell, below the heading ``first``, and the standard deviation as text and as a number;
    ``description`` explains the standard deviation. ``proportions`` are the proportions of
    participants in the two groups, or None for a comparison within participants. ``bound`` is the equivalence bound on
    the scale of the standard deviation, and ``bounds`` the number of hypotheses with a bound; ``largest`` is the
    largest difference of a participant that the scale permits, None without a limit. A verdict on ``planned``
    participants precedes the table. ``assumed`` is a measure that can fall to 0, with its simulated mean; ``unit``
    follows the difference in the verdict; ``titles`` are block titles; ``measure`` is the measure in words, if the
    contrast cannot tell.
    """

    def with_titles(names: tuple[str, str] | None) -> tuple[str, str] | None:
        return None if names is None else (titles.get(names[0], names[0]), titles.get(names[1], names[1]))

    def directed_text(end: float) -> str:
        """Return a difference without the sign of the other direction, which a one-sided test cannot detect."""
        if contrast.expected is None:
            return format_difference(end)
        return format_difference(end).replace("×/÷", "×" if contrast.expected == "higher" else "÷").removeprefix("±")

    def group_sizes(n: int) -> list[int]:
        return [n] if proportions is None else [int(n * proportion + 1e-9) for proportion in proportions]

    def differences(n: int, spread: float) -> tuple[float | None, float | None]:
        """Return the half-width and the smallest difference; None if there are too few participants."""
        if min(groups := group_sizes(n)) < 3:
            return None, None
        half, minimum = detectable_difference(*groups, alpha=strictest, expected=contrast.expected)
        return half * spread, None if minimum > MOST_SD else minimum * spread

    equal = [] if bound is None else [f"shown to be equivalent {IF_EQUAL}"]
    headings = (first, "participants", "SD", "half-width of the 95 % interval", "smallest difference", *equal)
    sides, strictest = "two-sided" if contrast.expected is None else "one-sided", alpha / members
    corrected = "" if members == 1 else f" ({alpha:.2g} divided by {members} hypotheses)"
    groups_note = "" if proportions is None else f" {_proportions_sentence(*proportions)}"
    hypothesis = contrast.described(with_titles(contrast.compared), with_titles(contrast.within), measure)
    yield from ("", f"## Contrast: {hypothesis}", "")
    test_note = f"{sides}, α = {strictest:.2g}{corrected}"
    equivalence_note = (
        ""
        if contrast.bound is None
        else f"Equivalence requires at least {fewest_participants(alpha / bounds, bound or contrast.bound, largest)} "
        f"participants{' in each group' if proportions else ''}, at α = {alpha / bounds:.2g}. "
    )
    has_too_few = any(differences(n, spread)[1] is None for n in sizes for *_, spread in rows)
    too_few_note = (
        f"“Too few” means that fewer than {whole_percent(WANTED)} of studies would detect even a difference of "
        f"{MOST_SD:g} SD. " * has_too_few
    )
    yield (
        f"{description}{groups_note} The “smallest difference” is the difference that {whole_percent(WANTED)} of "
        f"studies detect ({test_note}). {too_few_note}{equivalence_note}{inclusion_text([contrast])}"
    )
    if planned is not None:
        name, _, spread = rows[0]
        row_note = f" ({first}: {name})" if len(rows) > 1 else ""
        yield from (
            "",
            _verdict(
                contrast,
                planned,
                row_note,
                differences(planned, spread)[1],
                lambda end: directed_text(end) + unit,
                assumed,
            ),
        )
    yield from ("", f"| {' | '.join(headings)} |", "|---:" * len(headings) + "|")
    for name, sd_text, spread in rows:
        for n in sizes:
            (half, minimum), groups = differences(n, spread), group_sizes(n)
            ends = [
                "too few" if half is None else format_difference(half),
                "too few" if minimum is None else directed_text(minimum),
            ]
            if bound is not None:
                enough_people = min(groups) >= fewest_participants(alpha / bounds, bound, largest)
                proportion = (
                    equivalence_power(*groups, alpha=alpha / bounds, bound=bound / spread) if enough_people else 0.0
                )
                ends.append(whole_percent(proportion))
            yield f"| {name} | {size_text(n, planned)} | {sd_text} | {' | '.join(ends)} |"


def _verdict(
    contrast: Contrast,
    planned: int,
    row_note: str,
    least: float | None,
    format_difference: Callable[[float], str],
    assumed: tuple[str, float] | None,
) -> str:
    """Return a sentence on the smallest difference that the planned sample detects."""
    in_measure = "" if assumed is None else f" in {assumed[0]}"
    too_few = f"The planned {planned} participants{row_note} are too few to find a difference{in_measure}"
    if least is None:
        return f"**{too_few} of {MOST_SD:g} SD with {whole_percent(WANTED)} power.**"
    verdict = f"**{too_few} smaller than {format_difference(least)} with {whole_percent(WANTED)} power.**"
    if assumed is None or least <= assumed[1]:
        return verdict
    measure, mean = assumed
    where = "one group" if contrast.within is None else "one block of one group" if contrast.groups else "one block"
    return (
        f"{verdict} Fewer than {whole_percent(WANTED)} of studies would detect even a decrease in {measure} from "
        f"{mean:g} to 0 in {where} (a difference of {mean:g})."
    )


def size_text(n: int, planned: int | None) -> str:
    """Return a number of participants for a table, with a mark if it is the planned one."""
    return f"{n} (planned)" if n == planned else str(n)


def detectable_difference(
    n: int, second: int | None = None, *, alpha: float, expected: str | None
) -> tuple[float, float]:
    """Return the half-width of the 95 % interval and the smallest mean difference that 80 % of studies detect [SD].

    The studies have ``n`` pairs, or two groups of ``n`` and ``second`` participants, whose t has the degrees of freedom
    of the smaller group; a hypothesis without an ``expected`` direction is tested on both sides. A difference above
    `MOST_SD` may be returned as infinite.
    """
    sizes, alternative = (n,) if second is None else (n, second), "two-sided" if expected is None else "greater"
    half = float(stdtrit(min(sizes) - 1, 0.975)) * math.sqrt(sum(1 / size for size in sizes))
    return half, smallest_shift(*sizes, alpha=alpha, alternative=alternative, power=WANTED, most=MOST_SD)
