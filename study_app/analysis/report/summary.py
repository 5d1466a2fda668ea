"""The findings in a few sentences: what is shown, and what these participants could not show."""

from __future__ import annotations

from collections.abc import Iterator

from study_app.analysis.findings.block_results import BlockFound, Results
from study_app.analysis.findings.item_test import Tested
from study_app.analysis.findings.words import (
    all_of,
    counted,
    enough,
    higher,
    interval,
    lead,
    listed,
    missing,
    ms,
    name,
    number,
    p_equals,
    settings_noun,
    short,
)
from study_app.analysis.statistics.equivalence.tost import fewest
from study_app.analysis.statistics.outcome import FEW
from study_app.analysis.tables.study import Study


def findings(results: Results) -> tuple[str, ...]:
    """Return what was found, a sentence each."""
    return tuple(line for found in results.blocks if found.n for line in _of_block(found, results.decided.alpha))


def limits(study: Study, results: Results) -> tuple[str, ...]:
    """Return what cannot be shown, a sentence each."""
    lines = list(_in_general(study, results))
    for found in results.blocks:
        if not found.n:
            lines.append(f"{lead(found)}: nobody's answers count yet, so that nothing can be said.")
            continue
        lines += [f"{lead(found)}: {sentence}" for sentence in missing(found)]
        out = [
            f"“{short(found, one.item)}”" for one in (*found.omnibus, *found.trends) if one.verdict == "out of reach"
        ]
        if out:
            lines.append(
                f"{lead(found)}: so few participants, with the ties in their answers and the other p of the family as "
                f"they came out, could not have shown anything in {listed(out)}, even had they all agreed."
            )
        lines += _untested(found)
        lines += _mixed_up(found, results)
        lines += _of_equivalence(found)
    return tuple(lines)


def _in_general(study: Study, results: Results) -> Iterator[str]:
    decided = results.decided
    if not study.revealed:
        yield (
            "The key is sealed: settings are codes, and only counts and comparisons without an order are shown. Who "
            "decides by them to go on or to stop makes chance findings likelier."
        )
    if study.simulated:
        yield "These participants were SIMULATED: nothing here is evidence about people."
    if study.pilot:
        yield "These are pilot sessions: nothing here belongs into the results of the study."
    if not decided.made:
        yield (
            "The protocol decided nothing about the analysis beforehand (it has no table [analysis]): everything "
            "found is exploratory, and a reason to look again."
        )
    elif decided.changed:
        yield (
            "Not all sessions were run under the same decisions about the analysis: everything found is exploratory; "
            "the first session's decisions are used."
        )
    if study.n == 1:
        yield "One participant: whatever is shown is about this person alone, and says nothing about anybody else."
    if study.n < FEW:
        people = counted(study.n, "participant")
        yield (
            f"{people[:1].upper()}{people[1:]}: below {FEW} no bootstrap interval and no mixed model is given, since "
            "they do not hold there. What is not shown here may well be there."
        )


def _untested(found: BlockFound) -> Iterator[str]:
    """Name the statements that gave nothing to test, with the reason."""
    reasons: dict[str, list[str]] = {}
    for one in (*found.omnibus, *found.trends):
        if one.verdict == "not tested":
            reasons.setdefault(one.outcome.note, []).append(f"“{short(found, one.item)}”")
    for reason, items in reasons.items():
        yield f"{lead(found)}: {listed(items)} could not be tested: {reason}."


def _mixed_up(found: BlockFound, results: Results) -> Iterator[str]:
    """Name the settings that everybody met at the same place, where more than one order was to be expected."""
    counts = results.orders.get(found.id)
    if counts is None or counts.orders < 2 or len(counts.codes) < 2:
        return
    for place, line in enumerate(counts.positions, start=1):
        for code, count in zip(counts.codes, line, strict=True):
            if count == counts.orders:
                yield (
                    f"{lead(found)}: {name(found, code)} came at place {place} for everybody, so that what it did "
                    "cannot be distinguished from the effect of that place."
                )


def _of_equivalence(found: BlockFound) -> Iterator[str]:
    if found.against and found.n < fewest(found.against[0].found.alpha):
        yield f"{lead(found)}: equivalence needs {enough(found.against[0].found.alpha)}. This study has {found.n}."
    undecided = [one for one in found.against if one.verdict in ("inconclusive", "out of reach")]
    if undecided:
        yield (
            f"{lead(found)}: inconclusive or out of reach: {len(undecided)} of {len(found.against)} comparisons with "
            f"{ms(undecided[0].control_ms)}, which show neither a difference nor that it stays within the bound."
        )


def _of_block(found: BlockFound, alpha: float) -> Iterator[str]:
    noun = settings_noun(found)
    overall = found.overall
    if overall is not None and overall.p is not None:
        yield (
            f"{lead(found)}: one test over {all_of(len(found.items), 'statement')} "
            f"{'finds' if overall.p <= alpha else 'does not find'} a difference between the {noun}s "
            f"({p_equals(overall.p)}, n = {overall.n})."
        )
    told = _shown(found, found.omnibus)
    if told:
        yield f"{lead(found)}: the {noun}s differ in {told}."
    elif found.omnibus:
        yield f"{lead(found)}: {_nothing(found.omnibus, f'in no single statement a difference between the {noun}s')}."
    yield from _recognised(found)
    yield from _delays(found)


def _nothing(tests: tuple[Tested, ...], what: str) -> str:
    """Return that ``what`` is shown, none being there, or why nothing could be tested."""
    if any(one.outcome.p is not None for one in tests):
        return f"{what} is shown"
    return f"no statement could be tested ({'; '.join(dict.fromkeys(one.outcome.note for one in tests))})"


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


def _recognised(found: BlockFound) -> Iterator[str]:
    named = found.named
    if named is None or named.found.p is None or named.found.expected is None or named.found.statistic is None:
        return
    rates = [f"{found.names[rate.setting]} {rate.hits} of {rate.n}" for rate in named.found.rates]
    answers = named.found.decided + named.found.undecided
    verdict = {
        "shown": "recognition above chance is shown",
        "suggested": "recognition above chance is suggested (exploratory)",
        "out of reach": "recognition above chance was out of reach of these answers",
    }.get(named.verdict, "recognition above chance is not shown")
    yield (
        f"{lead(found)}: {verdict}: {named.found.statistic:g} of {answers} names were right, "
        f"{number(named.found.expected, 1)} expected by chance ({p_equals(named.found.p)}). This is "
        f"about all liquids together; by liquid: {listed(rates)}."
    )


def _delays(found: BlockFound) -> Iterator[str]:
    if not found.delays_ms:
        return
    told = _shown(found, found.trends)
    if told:
        yield f"{lead(found)}: answers follow the delay, in the direction stated before the study, in {told}."
    elif found.trends:
        yield f"{lead(found)}: {_nothing(found.trends, 'in no statement a trend over the delay')}."
    lowest = [
        f"“{short(found, one.item)}” {ms(one.over_all_ms)}" for one in found.lowest if one.over_all_ms is not None
    ]
    if lowest:
        yield (
            f"{lead(found)}: the lowest delay at which the answers of {_used(found)} show a trend, "
            f"corrected for {all_of(found.lowest[0].members, 'statement')}: {listed(lowest)}. Each is an upper bound: "
            "shorter delays may be noticed too."
        )
    threshold = found.threshold
    if threshold is not None and threshold.effect is not None:
        yield (
            f"{lead(found)}: the detection threshold is {threshold.effect:.0f} ms (95 % interval "
            f"{interval(threshold.interval, 0)} ms, n = {threshold.n}), if agreeing counts as noticing; "
            f"{'; '.join(words for words in (threshold.no_interval, threshold.note) if words)}."
        )
    yield from _equivalent(found)


def _used(found: BlockFound) -> str:
    """Return of how many participants, all whose answers are complete, the lowest delays are."""
    used = {one.steps.steps[0].page.n for one in found.lowest}
    return counted(max(used), "participant") if len(used) == 1 else f"{min(used)} to {max(used)} participants"


def _equivalent(found: BlockFound) -> Iterator[str]:
    if not found.against:
        return
    bound, control = found.against[0].found.bound, ms(found.against[0].control_ms)
    within = f"within ±{bound:g} {'point' if bound == 1 else 'points'} of those at {control}"
    up_to = [
        f"“{short(found, item)}” up to {ms(delay)}"
        for item, delay in (found.equivalent_up_to or {}).items()
        if delay is not None
    ]
    if up_to:
        yield f"{lead(found)}: mean answers {within} are shown for {listed(up_to)}."
    elif all(one.found.p is None for one in found.against):
        reasons = "; ".join(dict.fromkeys(one.found.note for one in found.against))
        yield f"{lead(found)}: no delay could be compared with {control} ({reasons})."
    else:
        nearest = ms(found.against[0].delay_ms)
        yield f"{lead(found)}: mean answers {within} are shown in no statement, not even at {nearest}."
