"""The answer of the first page about liquids: which were recognised, and which were rated differently."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

from study_app.analysis.designs.liquids import smallest_of_pairs
from study_app.analysis.findings.block_results import BlockFound
from study_app.analysis.findings.item_test import Tested
from study_app.analysis.findings.liquid_recognition import RecognitionResult
from study_app.analysis.findings.words import counted, interval, listed, name, number, short
from study_app.analysis.report.first_page.answer import FOUND, NO_EVIDENCE, Answer
from study_app.analysis.statistics.outcome import Interval
from study_app.analysis.statistics.paired import Paired
from study_app.analysis.tables.planned_analysis import Decided


def recognised(named: RecognitionResult) -> tuple[int, ...]:
    """Return the places of the settings that were recognised.

    Only where names are right more often than by chance as a whole; then those whose share of right names, by the
    lower end of its interval, is above the share of all settings that were given that name.
    """
    if named.verdict not in FOUND:
        return ()
    found = []
    for rate in named.found.rates:
        label = named.right[rate.setting]
        if label is not None and rate.interval is not None and rate.interval.low > given(named, label):
            found.append(rate.setting)
    return tuple(found)


def given(named: RecognitionResult, label: str) -> float:
    """Return the share of all answers that gave a name: what is right by chance."""
    place = named.labels.index(label)
    asked = sum(sum(row[:-1]) for row in named.found.table)
    return sum(row[place] for row in named.found.table) / asked if asked else 0.0


def distinguished(found: BlockFound, decided: Decided) -> Answer:
    """Return which liquids were recognised by name, and which were rated differently."""
    apart = {pair: tests for pair, tests in _compared(found).items() if tests}
    differing = [one for one in found.omnibus if one.verdict in FOUND]
    decisive = [one for tests in apart.values() for one in tests] or differing
    named = found.named if found.named is not None and found.named.found.p is not None else None
    known = () if named is None else recognised(named)
    exploratory = _suggested(decisive) and (named is None or not known or named.verdict == "suggested")
    of_pairs = _of_pairs(found, apart, differing, decided, mark=not exploratory)
    told = of_pairs if named is None else _of_names(found, named, known)
    claims = bool(decisive or known)
    if not claims:
        told = f"{told} {NO_EVIDENCE}"
    sizes = (
        *(() if named is None else (_hits(found, named), of_pairs)),
        *(_largest(found, apart) if apart else _agreement(found, differing)),
    )
    return Answer("distinguished", found.id, found.title, told, sizes, claims, claims and exploratory)


def _suggested(tests: Sequence[Tested]) -> bool:
    """Return whether no test of a primary statement is among these."""
    return all(one.verdict == "suggested" for one in tests)


def _of_names(found: BlockFound, named: RecognitionResult, known: Sequence[int]) -> str:
    """Return which liquids were recognised and which were not, with the name that was given instead."""
    yes = [found.names[place].lower() for place in known]
    no = [rate.setting for rate in named.found.rates if rate.setting not in known]
    told = [f"{listed(yes)} {'was' if len(yes) == 1 else 'were'} recognised above chance"] if yes else []
    if no:
        of_no = listed([found.names[place].lower() for place in no])
        others = [words for place in no if (words := _instead(found, named, place))]
        verb = "was" if len(no) == 1 else "were"
        rest = "" if yes else " recognised above chance"
        told.append(f"{of_no} {verb} not shown to be{rest}{f' ({listed(others)})' if others else ''}")
    return f"{_first_upper('; '.join(told))}."


def _instead(found: BlockFound, named: RecognitionResult, place: int) -> str:
    """Return the wrong name that a setting was given most, if it was given more often than the right one."""
    counts = named.found.table[place]
    right = named.right[place]
    hits = counts[named.labels.index(right)] if right is not None else 0
    most = max(counts[: len(named.labels)])
    label = named.labels[counts.index(most)]
    if most <= hits:
        return ""
    called = next((found.names[at].lower() for at, other in enumerate(named.right) if other == label), "")
    return f"{found.names[place].lower()} was called {called or short(found, label).lower()} by {most} of {sum(counts)}"


def _hits(found: BlockFound, named: RecognitionResult) -> str:
    """Return how many gave each liquid its right name, with the interval of the share, and what chance would give."""
    told = []
    for rate in named.found.rates:
        label = named.right[rate.setting]
        if label is not None:
            told.append(
                f"{found.names[rate.setting].lower()} {rate.hits} of {rate.n}{_share(rate.interval)}, "
                f"{100 * given(named, label):.0f} % by chance"
            )
    return f"Named right (95 % intervals): {'; '.join(told)}."


def _share(ends: Interval | None) -> str:
    return "" if ends is None else f" ({100 * ends.low:.0f} to {100 * ends.high:.0f} %)"


def _compared(found: BlockFound) -> dict[tuple[str, str], list[Tested]]:
    """Return in which statements each two settings (codes) were rated differently."""
    codes = [setting.code for setting in found.settings]
    if len(codes) == 2:
        return {(codes[0], codes[1]): [one for one in found.omnibus if one.verdict in FOUND]}
    return {
        (first, second): [
            one.tested
            for one in found.pairs
            if (one.first, one.second) == (first, second) and one.tested.verdict in FOUND
        ]
        for first, second in combinations(codes, 2)
    }


def _of_pairs(
    found: BlockFound,
    apart: dict[tuple[str, str], list[Tested]],
    differing: Sequence[Tested],
    decided: Decided,
    *,
    mark: bool,
) -> str:
    """Return which settings were rated differently in some statement, and which were not.

    ``mark``: say of single pairs and statements that they are exploratory.
    """
    pairs = list(combinations([setting.code for setting in found.settings], 2))
    if not pairs:
        return "There is only one setting, and nothing to compare it with."
    yes = [f"{_pair(found, pair)}{_mark(apart[pair], mark)}" for pair in pairs if pair in apart]
    no = [_pair(found, pair) for pair in pairs if pair not in apart]
    if not yes and differing:
        items = listed([f"“{short(found, one.item)}”{_mark([one], mark)}" for one in differing])
        out_of_reach = smallest_of_pairs(len(found.settings), found.n) > decided.alpha
        rest = f"cannot be shown with {counted(found.n, 'participant')}" if out_of_reach else "is not shown"
        return f"The liquids were rated differently in {items}; which ones {rest}."
    if not yes:
        return "In no statement were two of them shown to be rated differently."
    rest = f"; not shown to be: {listed(no)}" if no else ""
    return f"Rated differently: {listed(yes)}{rest}."


def _mark(tests: Sequence[Tested], mark: bool) -> str:
    return " (exploratory)" if mark and _suggested(tests) else ""


def _agreement(found: BlockFound, differing: Sequence[Tested]) -> Iterator[str]:
    """Yield of each statement in which the settings differ how much, over all of them."""
    for one in differing:
        if one.outcome.effect is not None:
            yield f"“{short(found, one.item)}”: {one.outcome.effect_name} {number(one.outcome.effect)}."


def _pair(found: BlockFound, pair: tuple[str, str]) -> str:
    between = " and " if len(found.settings) == 2 else " – "
    return between.join(name(found, code).lower() for code in pair)


def _largest(found: BlockFound, apart: dict[tuple[str, str], list[Tested]]) -> Iterator[str]:
    """Yield for each two settings that differ the statement in which they differ most."""
    for pair, tests in apart.items():
        largest = max(tests, key=lambda one: abs(one.outcome.effect or 0.0))
        outcome = largest.outcome
        if not isinstance(outcome, Paired) or not outcome.effect:
            continue
        higher = name(found, pair[0] if outcome.effect > 0 else pair[1]).lower()
        away = outcome.median_difference
        points = "" if away is None else f" by {_points(away)} (median)"
        one_way = abs(outcome.effect) == 1.0
        size = (
            f"all {outcome.n - outcome.zeros} who differ"
            if one_way
            else f"rank-biserial {number(abs(outcome.effect))}, 95 % interval {_either(outcome)}"
        )
        yield (
            f"{_first_upper(_pair(found, pair))}: in {len(tests)} of {counted(len(found.items), 'statement')}, most in "
            f"“{short(found, largest.item)}”: {higher} higher{points}, {size}."
        )


def _points(difference: float) -> str:
    size = abs(difference)
    return f"{size:g} {'point' if size == 1 else 'points'}"


def _either(outcome: Paired) -> str:
    """Return the interval of an effect in the direction of its sign."""
    ends = outcome.interval
    if ends is None or (outcome.effect or 0.0) > 0:
        return interval(ends)
    return interval(Interval(-ends.high, -ends.low, ends.level, ends.method))


def _first_upper(words: str) -> str:
    return words[:1].upper() + words[1:]
