"""Contrasts: the hypotheses that a study states, tested on one number of each participant.

Within participants the differences between the two settings are tested by Student's t (of thresholds, the differences
of logarithms, whose mean is a ratio), between groups the participants' numbers by Welch's. Equivalence is shown where
the interval of 1 − 2·alpha lies within the bound.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np
from scipy.stats import ttest_1samp, ttest_ind

from study_app.analysis.data.study_tables import Study, group_members
from study_app.analysis.findings.finding import HOLM, TESTS, BlockAnswers, verdict
from study_app.analysis.html_page import heading, paragraph, table_of
from study_app.analysis.levels.answers import Settings
from study_app.analysis.levels.sensitivities import Sensitivities
from study_app.analysis.levels.statistic import LevelStatistic
from study_app.analysis.levels.thresholds import Exponents, Thresholds
from study_app.analysis.results import ContrastResult, LevelsResult, Results, interval, number, p_equals, p_value
from study_app.analysis.statistics.outcome import SIDES, Interval, holm
from study_app.protocol.model import Contrast

STATISTICS: Final[Mapping[str, tuple[type[LevelStatistic[Any]], str]]] = {
    "threshold": (Thresholds, "threshold"),
    "exponent": (Exponents, "exponent"),
    "d_prime": (Sensitivities, "d_prime"),
    "pse": (Settings, "pse"),
}
"""Of each measure the statistic that has it, and its attribute."""

RATIOS: Final = ("threshold", "pse")
"""Measures that are compared as ratios where the levels of all blocks are spaced by ratios."""

Values = Mapping[str, float]
"""Participant → number, on the scale of the test: its logarithm where a ratio is tested."""


def contrast_results(
    study: Study, answers: Sequence[BlockAnswers], levels: Sequence[LevelsResult]
) -> tuple[ContrastResult, ...]:
    """Test the contrasts of a study, corrected together by Holm; none while the key is sealed."""
    found = [_tested(study, one, answers, levels) for one in study.contrasts]
    tests = [test for test, _ in found]
    adjusted = holm([None if test is None else float(test.pvalue) for test in tests])
    return tuple(
        _result(study, one, levels, test, values, p, len(found))
        for one, (test, values), p in zip(study.contrasts, found, adjusted, strict=True)
    )


def _tested(
    study: Study, one: Contrast, answers: Sequence[BlockAnswers], levels: Sequence[LevelsResult]
) -> tuple[Any, tuple[np.ndarray[Any, Any], ...]]:
    """Return the test (None: there is none), and the differences within people or the numbers of both groups."""
    side = SIDES[one.expected]
    if one.groups is not None:
        values = _values(one, one.blocks[0], None, answers, levels)
        members = group_members(study)
        groups = tuple(
            np.array([number for person, number in values.items() if members.get(person) == group])
            for group in one.groups
        )
        enough = min(map(len, groups)) > 1 and any(np.ptp(group) > 0 for group in groups)
        return ttest_ind(*groups, equal_var=False, alternative=side) if enough else None, groups
    pairs = [
        _values(one, block, condition, answers, levels)
        for block, condition in zip(
            one.blocks if len(one.blocks) == 2 else one.blocks * 2, one.conditions or (None, None), strict=True
        )
    ]
    away = np.array([pairs[0][person] - pairs[1][person] for person in pairs[0] if person in pairs[1]])
    enough = len(away) > 1 and np.ptp(away) > 1e-12
    return ttest_1samp(away, 0.0, alternative=side) if enough else None, (away,)


def _values(
    one: Contrast, block: str, condition: str | None, answers: Sequence[BlockAnswers], levels: Sequence[LevelsResult]
) -> Values:
    """Return each participant's number in a block: the mean over standards, or over the conditions of statements."""
    if one.measure not in STATISTICS:
        asked = next(found for found in answers if found.block.id == block)
        codes = [setting.code for setting in asked.block.settings if condition in (None, setting.condition)]
        rows = asked.values[one.measure][:, sorted({asked.block.columns[code] for code in codes})].mean(axis=1)
        return {person: float(row) for person, row in zip(asked.people, rows, strict=True) if not math.isnan(row)}
    found = next(level for level in levels if level.block == block)
    statistic, attribute = STATISTICS[one.measure]
    ratio = _is_ratio(one, levels)
    numbers: dict[str, list[float]] = {}
    for row in statistic.own(found):
        value = getattr(row, attribute)
        if value is not None and getattr(row, "beyond", None) is None:
            numbers.setdefault(str(row.participant), []).append(math.log(value) if ratio else value)
    return {person: float(np.mean(each)) for person, each in numbers.items()}


def _is_ratio(one: Contrast, levels: Sequence[LevelsResult]) -> bool:
    return one.measure in RATIOS and all(level.spacing == "log" for level in levels if level.block in one.blocks)


def _result(
    study: Study,
    one: Contrast,
    levels: Sequence[LevelsResult],
    test: Any,
    values: tuple[Any, ...],
    p_adjusted: float | None,
    members: int,
) -> ContrastResult:
    ratio, alpha = _is_ratio(one, levels), study.decided.alpha
    effect = ends = equivalent = None
    said: Any = verdict(p_adjusted, None, alpha, primary=study.decided.binding)
    untested = "fewer than two participants have both numbers, or all differences are equal"
    if test is not None:
        two_sided = ttest_ind(*values, equal_var=False) if one.groups else ttest_1samp(values[0], 0.0)
        low, high = (float(end) for end in two_sided.confidence_interval(0.95))
        mean = float(values[0].mean() - (values[1].mean() if one.groups else 0.0))
        effect, low, high = (math.exp(end) if ratio else end for end in (mean, low, high))
        ends = Interval(low=low, high=high, level=0.95, method="Welch's t" if one.groups else "Student's t")
        if one.bound is not None:
            reach = abs(math.log(one.bound)) if ratio else one.bound
            within = two_sided.confidence_interval(1 - 2 * alpha)
            equivalent = bool(-reach <= within.low and within.high <= reach)
            said = "equivalent" if equivalent and said == "not shown" else said
    n = sum(map(len, values))
    return ContrastResult(
        test="contrast, Welch's t" if one.groups else "contrast, paired t",
        n=n,
        dropped=study.n - n,
        statistic_name="t",
        statistic=None if test is None else float(test.statistic),
        p=None if test is None else float(test.pvalue),
        method="none" if test is None else f"t({float(test.df):.4g}), {_sides(one)}",
        effect_name="ratio" if ratio else "difference",
        effect=effect,
        interval=ends,
        no_interval=untested if ends is None else "",
        note=untested if test is None else "",
        contrast=one,
        compared=one.words({block.id: block.stimulus.condition for block in study.levels if block.stimulus}),
        ratio=ratio,
        p_adjusted=p_adjusted,
        members=members,
        verdict=said,
        equivalent=equivalent,
    )


def _sides(one: Contrast) -> str:
    return "two-sided" if one.expected is None else f"one-sided ({one.expected})"


def question(one: ContrastResult) -> str:
    """Return the hypothesis in words."""
    words = one.contrast.described(one.compared)
    return f"{words[:1].upper()}{words[1:]}"


def answer(one: ContrastResult) -> str:
    """Return what is found, in a sentence."""
    if one.p_adjusted is None:
        return f"Not tested: {one.note}."
    first, second = one.compared
    what = one.contrast.measure.replace("_", " ").capitalize()
    side = "below" if (one.effect or 0.0) < 0 else "above"
    amount = f"{number(one.effect)} times" if one.ratio else f"{number(abs(one.effect or 0.0))} {side}"
    near = {None: "", True: " It stays within the bound.", False: " It is not shown to stay within the bound."}
    return (
        f"{what} in {first} is {amount} that in {second}, 95 % interval {interval(one.interval)}, "
        f"{p_equals(one.p_adjusted)}, n = {one.n}.{near[one.equivalent]}"
    )


def contrast_section(results: Results) -> Iterator[str]:
    """Yield the section on the study's hypotheses; nothing without any."""
    if not results.contrasts:
        return
    yield heading(2, "Hypotheses")
    yield table_of(
        results.contrasts,
        ("Hypothesis", question),
        ("n", lambda one: str(one.n)),
        ("effect", lambda one: f"{one.effect_name} {number(one.effect)}"),
        ("95 % interval", lambda one: interval(one.interval)),
        ("p", lambda one: p_value(one.p)),
        ("adjusted p", lambda one: p_value(one.p_adjusted)),
        ("Verdict", lambda one: one.verdict),
        words=1,
        last=1,
    )
    yield paragraph(
        "Contrasts that the study file states: t tests of one number of each participant, p adjusted by Holm over "
        f"{len(results.contrasts)}. Equivalent: the {100 - 200 * results.decided.alpha:g} % interval lies within the "
        "bound that was stated. Left out: participants without both numbers, or with a threshold beyond the levels.",
        "soft",
    )


def contrast_rows(results: Results) -> Iterator[dict[str, Any]]:
    """Yield the rows of tests.csv."""
    for one in results.contrasts:
        ends = one.interval
        yield dict.fromkeys(column.name for column in TESTS) | {
            **{name: getattr(one, name) for name in ("test", "n", "dropped", "statistic_name")},
            **{name: getattr(one, name) for name in ("statistic", "p", "effect_name", "effect", "method")},
            "block": one.contrast.blocks[0],
            "question": question(one),
            "item": None if one.contrast.measure in STATISTICS else one.contrast.measure,
            "p_adjusted": one.p_adjusted,
            "low": None if ends is None else ends.low,
            "high": None if ends is None else ends.high,
            "level": None if ends is None else ends.level,
            "interval": one.no_interval or (None if ends is None else ends.method),
            "family": "hypotheses",
            "members": one.members,
            "correction": HOLM,
            "primary": results.decided.binding,
            "verdict": one.verdict,
            "note": one.note or None,
            "codes": "",
        }
