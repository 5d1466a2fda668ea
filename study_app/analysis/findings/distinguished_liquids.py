"""The first page's answer to which liquids, or views, were distinguished."""

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Final

from matplotlib.axes import Axes

from study_app import figure_style as style
from study_app.analysis.figures.page_layout import Sheet
from study_app.analysis.findings.liquid_recognition import FINDING as RECOGNITION
from study_app.analysis.findings.liquid_recognition import RecognitionResult
from study_app.analysis.findings.pair_comparison import FINDING as PAIRS
from study_app.analysis.findings.pair_comparison import smallest_of_pairs
from study_app.analysis.findings.settings_differ import FINDING as OMNIBUS
from study_app.analysis.report.first_page.answer import FOUND, NO_EVIDENCE, Answer
from study_app.analysis.report.first_page.pictures import FOOT_PT, HEIGHT_PT, WIDTH_PT, foot
from study_app.analysis.results.block_results import BlockFound
from study_app.analysis.results.finding import Finding, Question
from study_app.analysis.results.item_test import Tested
from study_app.analysis.results.words import counted, interval, listed, name, number, short
from study_app.analysis.statistics.outcome import Interval
from study_app.analysis.statistics.paired import Paired
from study_app.analysis.tables.planned_analysis import Decided

KEY: Final = "distinguished"
OTHERS: Final = ("#c9d1d8", "#aab5be", "#dfe5ea", "#b9c3cb", "#d3dae0")
"""Grounds of the wrong names, with the dark text on each of them at a contrast of at least 7."""

UNDECIDED: Final = "undecided"


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
    """Return which liquids were recognised by name, and which of them, or of the views, were rated differently."""
    apart = {pair: tests for pair, tests in _compared(found).items() if tests}
    differing = [one for one in OMNIBUS.of(found) if one.verdict in FOUND]
    decisive = [one for tests in apart.values() for one in tests] or differing
    named = RECOGNITION.of(found)
    if named is not None and named.found.p is None:
        named = None
    known = () if named is None else recognised(named)
    exploratory = _suggested(decisive) and (named is None or not known or named.verdict == "suggested")
    of_pairs = _of_pairs(found, apart, differing, decided, mark=not exploratory)
    text = of_pairs if named is None else _of_names(found, named, known)
    claims = bool(decisive or known)
    if not claims:
        text = f"{text} {NO_EVIDENCE}"
    sizes = (
        *(() if named is None else (_hits(found, named), of_pairs)),
        *(_largest(found, apart) if apart else _agreement(found, differing)),
    )
    return Answer(KEY, found.id, found.title, text, sizes, claims, claims and exploratory)


def _suggested(tests: Sequence[Tested]) -> bool:
    """Return whether no test of a primary statement is among these."""
    return all(one.verdict == "suggested" for one in tests)


def _of_names(found: BlockFound, named: RecognitionResult, known: Sequence[int]) -> str:
    """Return which liquids were recognised and which were not, with the name that was given instead."""
    yes = [found.names[place].lower() for place in known]
    no = [rate.setting for rate in named.found.rates if rate.setting not in known]
    text = [f"{listed(yes)} {'was' if len(yes) == 1 else 'were'} recognised above chance"] if yes else []
    if no:
        of_no = listed([found.names[place].lower() for place in no])
        others = [words for place in no if (words := _instead(found, named, place))]
        verb = "was" if len(no) == 1 else "were"
        rest = "" if yes else " recognised above chance"
        text.append(f"{of_no} {verb} not shown to be{rest}{f' ({listed(others)})' if others else ''}")
    return f"{_first_upper('; '.join(text))}."


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
    text = []
    for rate in named.found.rates:
        label = named.right[rate.setting]
        if label is not None:
            text.append(
                f"{found.names[rate.setting].lower()} {rate.hits} of {rate.n}{_share(rate.interval)}, "
                f"{100 * given(named, label):.0f} % by chance"
            )
    return f"Named right (95 % intervals): {'; '.join(text)}."


def _share(ends: Interval | None) -> str:
    return "" if ends is None else f" ({100 * ends.low:.0f} to {100 * ends.high:.0f} %)"


def _compared(found: BlockFound) -> dict[tuple[str, str], list[Tested]]:
    """Return in which statements each two settings (codes) were rated differently."""
    codes = [setting.code for setting in found.settings]
    if len(codes) == 2:
        return {(codes[0], codes[1]): [one for one in OMNIBUS.of(found) if one.verdict in FOUND]}
    return {
        (first, second): [
            one.tested
            for one in PAIRS.of(found)
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
        return f"The {found.kind} were rated differently in {items}; which ones {rest}."
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


def _picture(sheet: Sheet, found: BlockFound, _answer: Answer) -> str | None:
    named = RECOGNITION.of(found)
    return _ratings(sheet, found) if named is None else _names(sheet, named, found)


def _names(sheet: Sheet, named: RecognitionResult, found: BlockFound) -> str:
    """Draw a bar a liquid: how many gave it its right name, and which other names it was given."""
    left = 4 + max(sheet.text_width(words, 9) for words in found.names)
    height = (HEIGHT_PT - FOOT_PT) / len(found.names)
    axes = sheet.axes(left + 6, 4, WIDTH_PT - left - 10, HEIGHT_PT - FOOT_PT)
    most = max(sum(row) for row in named.found.table) or 1
    axes.set_xlim(0, most)
    axes.set_ylim(len(found.names), 0)
    called = [*(_called(named, found, label) for label in named.labels), UNDECIDED, "no answer"]
    for place, row in enumerate(named.found.table):
        sheet.text(left, 4 + height * (place + 0.5) + 2.5, found.names[place], size=9, ha="right")
        right = named.right[place]
        own = None if right is None else named.labels.index(right)
        order = sorted(range(len(row)), key=lambda at: -row[at] if at != own else -most - 1)
        begun = 0
        for rank, at in enumerate(order):
            if not row[at]:
                continue
            colour = style.ACCENT if at == own else OTHERS[rank % len(OTHERS)]
            axes.barh(place + 0.5, row[at], left=begun, height=0.62, color=colour, edgecolor="white", linewidth=0.8)
            words = f"{called[at]} {row[at]}"
            room = row[at] / most * (WIDTH_PT - left - 10) - 6
            fits = words if sheet.text_width(words, 8) <= room else str(row[at])
            ink = "white" if at == own else style.TEXT
            axes.text(
                begun + row[at] / 2,
                place + 0.5,
                fits if sheet.text_width(fits, 8) <= room + 4 else "",
                fontproperties=sheet.font(8),
                color=ink,
                ha="center",
                va="center",
            )
            begun += row[at]
    foot(sheet, "Names given, number of people; blue: the right one")
    return "How many people gave each liquid which name; blue is the right one"


def _called(named: RecognitionResult, found: BlockFound, label: str) -> str:
    at = next((place for place, other in enumerate(named.right) if other == label), None)
    return found.names[at].lower() if at is not None else short(found, label).lower().removeprefix("like ")


def _ratings(sheet: Sheet, found: BlockFound) -> str | None:
    """Draw medians and quartiles of the liquids in the statement that differs most."""
    tested = [one for one in OMNIBUS.of(found) if one.outcome.effect is not None]
    if not tested:
        return None
    item = max(tested, key=lambda one: abs(one.outcome.effect or 0.0)).item
    rows = {str(row["code"]): row for row in found.measures if row["item"] == item and row["median"] is not None}
    codes = [setting.code for setting in found.settings if setting.code in rows]
    if not codes:
        return None
    left = 4 + max(sheet.text_width(name(found, code), 9) for code in codes)
    axes = sheet.axes(left + 6, 4, WIDTH_PT - left - 14, HEIGHT_PT - FOOT_PT - 10)
    axes.set_xlim(0.7, 7.3)
    axes.set_ylim(len(codes), 0)
    height = (HEIGHT_PT - FOOT_PT - 10) / len(codes)
    _levels(sheet, axes)
    for place, code in enumerate(codes):
        row = rows[code]
        sheet.text(left, 4 + height * (place + 0.5) + 2.5, name(found, code), size=9, ha="right")
        axes.plot([row["q1"], row["q3"]], [place + 0.5] * 2, color=style.BAND, linewidth=7, solid_capstyle="butt")
        axes.plot([row["median"]], [place + 0.5], "o", markersize=6, color=style.ACCENT)
    foot(sheet, f"“{short(found, item)}”, 1 to 7: median and middle half")
    return f"Median and middle half of the answers to “{short(found, item)}” for each setting"


def _levels(sheet: Sheet, axes: Axes) -> None:
    axes.set_xticks(range(1, 8), [str(level) for level in range(1, 8)])
    for label in axes.get_xticklabels():
        label.set_fontproperties(sheet.font(8))
    for level in range(1, 8):
        axes.axvline(level, color=style.GRID, linewidth=0.6, zorder=0)


FINDING: Final[Finding[None]] = Finding(
    key=KEY,
    place=20,
    empty=None,
    kinds=("liquids", "views"),
    question=Question(words="Which {kind} were distinguished?", answer=distinguished, picture=_picture),
)
