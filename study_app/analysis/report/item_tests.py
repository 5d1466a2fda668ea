"""How tests of single statements are printed: their table, and sentences about them."""

from collections.abc import Iterator, Sequence

from study_app.analysis.report.html_page import heading, paragraph, table
from study_app.analysis.results.block_results import BlockFound
from study_app.analysis.results.item_test import Tested
from study_app.analysis.results.words import (
    counted,
    higher,
    interval,
    lead,
    listed,
    number,
    p_equals,
    p_value,
    short,
    statistic,
    test_name,
)
from study_app.analysis.statistics.paired import Paired

TESTS = ("Statement", "n", "Statistic", "p", "adjusted p", "smallest p", "Effect", "Interval", "Verdict")


def table_of_tests(
    title: str, found: BlockFound, tests: Sequence[Tested], compared: Sequence[str] = ()
) -> Iterator[str]:
    """Yield a table of tests; ``compared`` are the names of what each of them compares."""
    if not tests:
        return
    yield heading(3, title)
    yield table(TESTS, [_row(found, one) for one in tests], last=1)
    first = tests[0]
    families = dict.fromkeys(
        f"{one.members} in the family “{one.family}”, p adjusted by {one.correction}" for one in tests
    )
    intervals = dict.fromkeys(one.outcome.interval.method for one in tests if one.outcome.interval is not None)
    yield paragraph(
        f"{test_name(first.outcome)}; effect: {first.outcome.effect_name}{_above(first, compared)}. Found by: "
        f"{'; '.join(dict.fromkeys(one.outcome.method for one in tests if one.outcome.p is not None)) or 'none'}. "
        f"{'; '.join(families)}. " + (f"Intervals: 95 %, {'; '.join(intervals)}." if intervals else ""),
        "soft",
    )
    reasons = dict.fromkeys(one.outcome.no_interval for one in tests if one.outcome.no_interval)
    if reasons and not intervals:
        yield paragraph(f"Intervals: {'; '.join(reasons)}.", "soft")


def _above(one: Tested, compared: Sequence[str]) -> str:
    """Say which of two an effect above 0 stands for."""
    if not isinstance(one.outcome, Paired) or len(compared) != 2:
        return ""
    return f", above 0 where {compared[0]} was rated higher than {compared[1]}"


def _row(found: BlockFound, one: Tested) -> list[str]:
    outcome = one.outcome
    dropped = f" (−{outcome.dropped})" if outcome.dropped else ""
    return [
        short(found, one.item),
        f"{outcome.n}{dropped}",
        statistic(outcome),
        p_value(outcome.p),
        p_value(one.p_adjusted),
        p_value(outcome.smallest_p),
        number(outcome.effect),
        interval(outcome.interval),
        one.verdict + (f" ({outcome.note})" if one.verdict == "not tested" and outcome.note else ""),
    ]


def tests_in_words(found: BlockFound, tests: tuple[Tested, ...], showing: str, nothing: str) -> Iterator[str]:
    """Yield in which statements tests show something, or that they show ``nothing``; no sentence without tests."""
    if statements := _shown(found, tests):
        yield f"{lead(found)}: {showing} {statements}."
    elif tests:
        yield f"{lead(found)}: {_nothing_shown(tests, nothing)}."


def first_tested(tests: Sequence[Tested]) -> Tested:
    """Return the first test that gave a p-value, or the first of all."""
    return next((one for one in tests if one.outcome.p is not None), tests[0])


def _shown(found: BlockFound, tests: tuple[Tested, ...]) -> str:
    """List the statements in which something was shown, and apart those in which it is suggested."""
    shown = [_with_p(found, one) for one in tests if one.verdict == "shown"]
    suggested = [_with_p(found, one) for one in tests if one.verdict == "suggested"]
    parts = [listed(shown)] if shown else []
    if suggested:
        parts.append(f"{listed(suggested)} (exploratory)")
    return "; ".join(parts)


def _with_p(found: BlockFound, one: Tested) -> str:
    p = f"adjusted {p_equals(one.p_adjusted)}" if one.p_adjusted is not None else ""
    return f"“{short(found, one.item)}” ({higher(found, one.outcome)}{p})"


def _nothing_shown(tests: tuple[Tested, ...], what: str) -> str:
    """Return that ``what`` is shown, none being there, or why nothing could be tested."""
    if any(one.outcome.p is not None for one in tests):
        return f"{what} is shown"
    return f"no statement could be tested ({'; '.join(dict.fromkeys(one.outcome.note for one in tests))})"


def families(tests: Sequence[Tested]) -> str:
    """Return what is corrected together: primary statements, and apart from them the exploratory ones."""
    families = sorted({(not one.primary, one.members, one.correction) for one in tests})
    methods = [
        f"over {counted(members, 'statement')} by {correction}"
        + ("" if len(families) == 1 else " (exploratory)" if exploratory else " (primary)")
        for exploratory, members, correction in families
    ]
    return f"p adjusted {listed(methods)}"
