"""Equivalence of each delay to the shortest one, and difference from it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from study_app.analysis.designs.block_tests import MANY, Asked
from study_app.analysis.designs.verdicts import HOLM
from study_app.analysis.figures.picture import Picture
from study_app.analysis.findings.delay_trend import ONE_DELAY
from study_app.analysis.report.html_page import heading, paragraph, table
from study_app.analysis.report.r_syntax import r_number, r_text
from study_app.analysis.report.test_rows import rows_alone, test_row
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.finding import Finding, Row
from study_app.analysis.results.not_tested import NotTested
from study_app.analysis.results.words import (
    beyond,
    counted,
    enough,
    interval,
    lead,
    least,
    ms,
    number,
    p_value,
    percent,
    short,
)
from study_app.analysis.statistics.equivalence.power import MOST, STUDIES, participants_needed
from study_app.analysis.statistics.equivalence.tost import Equivalence, fewest, tost
from study_app.analysis.statistics.equivalence.tost import Verdict as Nearness
from study_app.analysis.statistics.multiple_comparisons import holm
from study_app.analysis.tables.planned_analysis import Direction

EQUIVALENCE: Final = "test of equivalence"
AGAINST = (
    *("Statement", "Delay", "n", "difference", "interval", "people beyond the bound", "p equivalent"),
    "p without normality",
    *("p different, adjusted", "n for 80 %", "Verdict"),
)


@dataclass(frozen=True, slots=True)
class ContrastWithControl:
    """One delay compared with the shortest in one statement.

    ``found`` holds the verdict; ``p_adjusted`` is p of a difference, corrected over the ``members`` comparisons of
    the block; ``expected`` the direction that was stated before the study, None where none was.
    """

    item: str
    delay_ms: float
    control_ms: float
    found: Equivalence
    p_adjusted: float | None
    members: int
    expected: Direction | None = None

    @property
    def verdict(self) -> Nearness:
        """What may be said: "equivalent" where every test shows it, "different" by the corrected p."""
        return self.found.verdict

    @property
    def as_expected(self) -> bool:
        """Whether answers went where they were expected to, or nothing was expected."""
        away = self.found.effect or 0.0
        return self.expected is None or (away > 0) == (self.expected == "increasing")


def _tested(answers: Asked, _found: BlockFound) -> tuple[tuple[ContrastWithControl, ...], tuple[NotTested, ...]]:
    """Compare every delay with the shortest one, by the bound that was decided."""
    bound, delays_ms = answers.decided.equivalence_bound, answers.block.delays_ms
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


def equivalent_up_to(against: tuple[ContrastWithControl, ...]) -> dict[str, float | None]:
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


def _numbers(found: BlockFound) -> dict[str, Any]:
    against = FINDING.of(found)
    up_to = equivalent_up_to(against) if FINDING.key in found.findings else None
    return {FINDING.key: against, "equivalent_up_to": up_to}


def _rows(found: BlockFound) -> Iterator[Row]:
    for against in FINDING.of(found):
        row = test_row(found, "a delay is equivalent", against.found) | {"item": against.item}
        compared = f"{against.delay_ms:g} ms − {against.control_ms:g} ms"
        row |= rows_alone(found, f"{against.item} at {against.delay_ms:g} ms")
        yield row | {"comparison": compared, "verdict": against.verdict}
        yield _differs(found, against) | {"item": against.item, "comparison": compared, "verdict": against.verdict}


def _differs(found: BlockFound, against: ContrastWithControl) -> dict[str, Any]:
    """Return the row of the same comparison asked the other way: whether the delay differs at all."""
    outcome = against.found
    by = "the larger p of a t test and of exact signed ranks, two-sided"
    return test_row(found, "a delay differs", outcome) | {
        "test": "difference, paired",
        "statistic": outcome.t,
        "p": outcome.p_difference,
        "method": "t test, two-sided" if outcome.p_different_ranks is None else by,
        "p_adjusted": against.p_adjusted,
        "smallest_p": None if outcome.p_different_ranks is None else 0.5 ** (outcome.n - 1),
        "family": f"{found.id}: each delay against the shortest",
        "members": against.members,
        "correction": HOLM,
        "note": None if outcome.t is not None else outcome.note,
    }


def _section(found: BlockFound, _results: Results, _pictures: Mapping[str, Picture]) -> Iterator[str]:
    """Yield the comparisons of each delay with the shortest."""
    if not FINDING.of(found):
        return
    control = ms(FINDING.of(found)[0].control_ms)
    yield heading(3, f"Each delay against {control}")
    yield table(
        AGAINST,
        [
            [
                short(found, one.item),
                ms(one.delay_ms),
                str(one.found.n),
                number(one.found.effect),
                interval(one.found.interval),
                beyond(one.found),
                p_value(one.found.p),
                p_value(_without_normality(one.found)),
                _p_different(one),
                _needed(one),
                one.verdict + (" *" if one.found.checks_agree is False else ""),
            ]
            for one in FINDING.of(found)
        ],
        words=2,
        last=1,
    )
    yield paragraph(" ".join(_about_against(FINDING.of(found))), "soft")


def _without_normality(tested: Equivalence) -> float | None:
    """Return the largest p of the tests for equivalence that do not ask for normality."""
    return max((p for p in (tested.p_permutation, tested.p_ranks, tested.p_bootstrap) if p is not None), default=None)


def _p_different(one: ContrastWithControl) -> str:
    """Return the adjusted p of a difference, unless no answers of so many participants could have shown one."""
    out = min(1.0, 2 * 0.5**one.found.n) * one.members > one.found.alpha
    return "out of reach" if out and one.p_adjusted is not None else p_value(one.p_adjusted)


def _needed(one: ContrastWithControl) -> str:
    """Return how many participants equivalence would take, and a dash where this is unknown."""
    if one.found.n_needed is not None:
        return str(one.found.n_needed)
    return f"> {MOST}" if one.found.sd is not None else "–"


def _about_against(against: Sequence[ContrastWithControl]) -> Iterator[str]:
    """Yield how the comparisons with the shortest delay were made, and what they could not show."""
    first = against[0].found
    yield (
        f"Two one-sided t tests with a bound of ±{first.bound:g}, intervals of {percent(1 - 2 * first.alpha)}. "
        "Equivalent: the t tests, changes of signs, signed ranks and the bootstrap-t (for answers that lean to one "
        "side) all show that the mean lies within the bound; each comparison stands for itself, so that a single one "
        "among many is weak. "
        f"It needs {enough(first.alpha)}. It is about the mean: the table also states how many people differ by more "
        "than the bound, with a 95 % Clopper-Pearson interval of their share. Different: the larger p of a two-sided "
        f"t test and of exact signed ranks, Holm-adjusted over the {len(against)} comparisons of this table, is at "
        f"most {first.alpha:g}. Where "
        "all differences are equal, signs and ranks decide. Inconclusive: neither. Out of reach: no answers of so "
        "many participants could have given either. n for 80 %: participants with whom all these tests would show "
        f"equivalence in 80 % of simulated studies ({STUDIES} for each number, differences about 0 with this spread, "
        "rounded as these are); a spread estimated from few is itself uncertain."
    )
    least = first.smallest_check_p
    if least is not None:
        yield f"By signs and ranks the smallest p for equivalence is {p_value(least)}."
    differing = 0.5 ** (first.n - 1) if first.n else 1.0
    if differing * len(against) > first.alpha:
        yield (
            f"For a difference the signed ranks of {counted(first.n, 'pair')} give {p_value(differing)} at least, so "
            "that after the correction no comparison here can be called different, however clear it is; a trend over "
            "all delays can be shown."
        )
    disagree = sum(one.found.checks_agree is False for one in against)
    if disagree:
        yield f"*: p with and without normality decide differently ({disagree}); equivalent is only what all show."


def _limits(found: BlockFound) -> Iterator[str]:
    if FINDING.of(found) and found.n < fewest(FINDING.of(found)[0].found.alpha):
        yield f"{lead(found)}: equivalence needs {enough(FINDING.of(found)[0].found.alpha)}. This study has {found.n}."
    against = FINDING.of(found)
    undecided = [one for one in FINDING.of(found) if one.verdict in ("inconclusive", "out of reach")]
    if undecided:
        yield (
            f"{lead(found)}: inconclusive or out of reach: {len(undecided)} of {len(against)} comparisons with "
            f"{ms(undecided[0].control_ms)}, which show neither a difference nor that it stays within the bound."
        )


def _methods(found: BlockFound, results: Results) -> Iterator[str]:
    if FINDING.of(found):
        bound, level = FINDING.of(found)[0].found.bound, percent(1 - 2 * results.decided.alpha)
        points = "point" if bound == 1 else "points"
        beforehand = ", decided before the first session" if results.decided.binding else ""
        yield (
            f"Equivalence to {found.delays_ms[0]:g} ms was tested by two one-sided t tests on paired differences with "
            f"a bound of ±{bound:g} {points}{beforehand}, and {level} intervals, and called equivalent only "
            "where changes of signs, signed ranks and the bootstrap-t agreed, and with "
            f"{least(results.decided.alpha)}; it was called different where "
            "the larger p of a t test and of exact signed ranks, Holm-adjusted over all these comparisons, was at most "
            "alpha, and otherwise inconclusive."
        )


def _calls(found: BlockFound, codes: str) -> Iterator[str]:
    by_delay = {setting.delay_ms: setting.code for setting in found.settings}
    for one in FINDING.of(found):
        interval = one.found.interval
        if one.found.p is None or one.found.p_different is None or interval is None:
            continue
        first, second = r_text(by_delay[one.control_ms]), r_text(by_delay[one.delay_ms])
        what = r_text(f"{one.item}, {one.delay_ms:g} ms")
        numbers = (one.found.bound, one.found.p, interval.low, interval.high, interval.level, one.found.p_different)
        values = ", ".join(r_number(value) for value in numbers)
        yield f"equivalent({what}, wide({r_text(found.id)}, {r_text(one.item)}, {codes}), {first}, {second}, {values})"


FINDING: Final[Finding[tuple[ContrastWithControl, ...]]] = Finding(
    key="against",
    place=7,
    what=EQUIVALENCE,
    empty=(),
    tests=_tested,
    kinds=("delays",),
    waits=("delays",),
    numbers=_numbers,
    row_place=10,
    rows=_rows,
    part="comparisons with the shortest delay",
    section=_section,
    limits=_limits,
    methods=_methods,
    calls=_calls,
)
