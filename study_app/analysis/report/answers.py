"""The three answers of the first page: which liquids were distinguished, which delay is noticed, which is not relevant.

An answer is a sentence, then directions, sizes and intervals; the p that decide stand in the sections that follow.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final, Literal, TypeAlias

from study_app.analysis.decided import Decided
from study_app.analysis.liquids_found import smallest_of_pairs
from study_app.analysis.report.words import all_of, beyond, counted, interval, listed, ms, name, number, percent, short
from study_app.analysis.results import Against, BlockFound, Named, Results, Tested
from study_app.analysis.statistics.families import holm
from study_app.analysis.statistics.outcome import Interval
from study_app.analysis.statistics.paired import Paired

Question: TypeAlias = Literal["distinguished", "noticed from", "unchanged up to"]

ASKED: Final[dict[Question, str]] = {
    "distinguished": "Which liquids were distinguished?",
    "noticed from": "From which delay do participants notice a difference?",
    "unchanged up to": "Up to which delay do answers not change by a relevant amount?",
}
NO_EVIDENCE: Final = "That is not evidence that there is nothing."
FOUND: Final = ("shown", "suggested")


@dataclass(frozen=True, slots=True)
class Answer:
    """An answer to one question about one block (its id).

    ``claims`` says whether it claims that settings differ or that a delay is noticed, which would be false in a study
    where nothing differs; ``exploratory`` whether that was not decided on before the study. ``at_ms`` is the shortest
    delay that it says is noticed.
    """

    question: Question
    block: str
    title: str
    told: str
    sizes: tuple[str, ...]
    claims: bool = False
    exploratory: bool = False
    at_ms: float | None = None


def answers(results: Results) -> tuple[Answer, ...]:
    """Return the answers that a study gives, block by block.

    They claim something about a block only where the one test over all its statements finds a difference, corrected
    by Holm over the blocks: in a study where nothing differs they then claim anything at most so often as alpha says.
    """
    overall = holm([None if found.overall is None else found.overall.p for found in results.blocks])
    return tuple(
        _unless_claimed_alone(one, p, results.decided.alpha)
        for found, p in zip(results.blocks, overall, strict=True)
        for one in _of_block(found, results.decided)
    )


def _unless_claimed_alone(answer: Answer, p_over_all: float | None, alpha: float) -> Answer:
    """Return an answer without its claim where the test over all statements does not find a difference."""
    if not answer.claims or (p_over_all is not None and p_over_all <= alpha):
        return answer
    told = (
        "Nothing is claimed here: single tests in the sections below find something, but the test over all statements "
        f"does not find a difference. {NO_EVIDENCE}"
    )
    return replace(answer, told=told, sizes=(), claims=False, exploratory=False, at_ms=None)


def _of_block(found: BlockFound, decided: Decided) -> tuple[Answer, ...]:
    """Return the answers that a block gives: none before anybody's answers count."""
    if not found.n:
        return ()
    questions: tuple[Question, ...] = (
        ("noticed from", "unchanged up to") if found.kind == "delays" else ("distinguished",)
    )
    if not found.revealed:
        waits = "This waits for the key to be opened: until then settings are codes."
        return tuple(Answer(question, found.id, found.title, waits, ()) for question in questions)
    if found.kind == "delays":
        return _noticed_from(found, decided), _unchanged(found)
    return (_distinguished(found, decided),)


def recognised(named: Named) -> tuple[int, ...]:
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


def given(named: Named, label: str) -> float:
    """Return the share of all answers that gave a name: what is right by chance."""
    place = named.labels.index(label)
    asked = sum(sum(row[:-1]) for row in named.found.table)
    return sum(row[place] for row in named.found.table) / asked if asked else 0.0


def _distinguished(found: BlockFound, decided: Decided) -> Answer:
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


def _of_names(found: BlockFound, named: Named, known: Sequence[int]) -> str:
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


def _instead(found: BlockFound, named: Named, place: int) -> str:
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


def _hits(found: BlockFound, named: Named) -> str:
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


def _share(of: Interval | None) -> str:
    return "" if of is None else f" ({100 * of.low:.0f} to {100 * of.high:.0f} %)"


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
    of = outcome.interval
    if of is None or (outcome.effect or 0.0) > 0:
        return interval(of)
    return interval(Interval(-of.high, -of.low, of.level, of.method))


def _noticed_from(found: BlockFound, decided: Decided) -> Answer:
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


def _shortest(found: BlockFound, lowest: Mapping[str, float], different: Sequence[Against]) -> tuple[float, str] | None:
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
    found: BlockFound, decided: Decided, lowest: Mapping[str, float], different: Sequence[Against], *, mark: bool
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


def _first_of_each(different: Iterable[Against]) -> Iterator[Against]:
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


def _difference(one: Against) -> str:
    effect, of = one.found.effect or 0.0, one.found.interval
    return f"{'+' if effect > 0 else ''}{number(effect)} {'(no interval)' if of is None else interval(of)} points"


def _level(against: Sequence[Against]) -> str:
    """Return what the differences and their intervals are, said once."""
    first = against[0]
    return f"Points: mean difference to {ms(first.control_ms)}, {percent(1 - 2 * first.found.alpha)} interval"


def common_ms(found: BlockFound) -> float | None:
    """Return the longest delay up to which every statement is equivalent at every delay."""
    delays = list((found.equivalent_up_to or {}).values())
    known = [delay for delay in delays if delay is not None]
    return min(known) if known and len(known) == len(delays) else None


def _unchanged(found: BlockFound) -> Answer:
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


def _first_upper(words: str) -> str:
    return words[:1].upper() + words[1:]


def _first_lower(words: str) -> str:
    return words[:1].lower() + words[1:]
