"""The sections on how the study was run: sessions, exclusions, delays achieved, orders, motion and force."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Final

from study_app.analysis.report.html_page import bullets, heading, paragraph, table
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.delivered_delay import Delivered
from study_app.analysis.results.words import (
    counted,
    listed,
    ms,
    name,
    number,
    p_value,
    settings_noun,
    short,
    statistic,
    test_name,
)
from study_app.analysis.tables.group_means import By, group_counts, group_means
from study_app.analysis.tables.performance import DEFINITIONS as TRIAL_DEFINITIONS
from study_app.analysis.tables.performance import OF_REACHES, OF_TRIALS, Performance
from study_app.analysis.tables.reaches import DEFINITIONS as REACH_DEFINITIONS
from study_app.analysis.tables.study_tables import Study
from study_app.protocol.orders.balance import Evenness
from study_app.store.exclusions import named

TESTED_BY_BLOCK: Final = "Sites are compared in the section of each block."
UNITS: Final = {"s": "s", "m": "m", "mm": "mm", "n": "N", "percent": "%"}
SHOWN: Final = 20
"""So many exclusions and doubts are listed; all of them stand in report.json."""


def conduct(study: Study, results: Results) -> Iterator[str]:
    """Yield the section on sessions and on how the study was run."""
    yield heading(2, "How it was run")
    states = Counter(map(str, study.participants["status"]))
    yield paragraph(
        f"{counted(len(study.participants), 'session').capitalize()}: "
        f"{listed([f'{count} {status}' for status, count in states.most_common()])}. Counted: "
        f"{counted(study.n, 'participant')}."
    )
    if study.sites:
        here = Counter(map(study.site_of, study.people))
        people = listed([f"{site} with {counted(here[site], 'participant')}" for site in study.sites])
        yield paragraph(f"Merged sites: {people}, counted.")
    if study.withdrawn:
        yield paragraph(f"{counted(study.withdrawn, 'participant').capitalize()} withdrew; their data were erased.")
    masked = Counter(map(str, study.participants["motors_masked"].dropna()))
    if masked:
        answers = [f"{means} in {counted(count, 'session')}" for means, count in masked.most_common()]
        yield paragraph(f"Motors masked: {listed(answers)}.")
    yield heading(3, "Exclusions")
    gone = [f"{named(one)}: {one.reason} ({one.rule_or_person}, {one.excluded_at})" for one in study.exclusions]
    if study.left_out:
        gone.append(f"{counted(study.left_out, 'session')} not completed: left out of every number")
    yield bullets(_first(gone)) if gone else paragraph("Nothing is excluded: every completed session counts whole.")
    if study.doubts:
        yield heading(3, "Files that are not as they were recorded")
        yield bullets(
            _first([f"{doubt.path.relative_to(study.folder).as_posix()} {doubt.what}" for doubt in study.doubts])
        )
    yield from _delivered(study, results)
    yield from _orders(results)


def groups(study: Study, results: Results, by: By = "group") -> Iterator[str]:
    """Yield the section on groups, or sites: their sizes, and the answers in each block; nothing without any."""
    counts = group_counts(study, by)
    if not counts:
        return
    yield heading(2, f"{by.capitalize()}s")
    yield table((by.capitalize(), "participants"), [[group, str(count)] for group, count in counts.items()])
    means = list(group_means(study, by))
    for found in results.blocks:
        rows = [
            [
                short(found, one.item),
                name(found, one.code),
                one.group,
                str(one.n),
                number(one.mean, 2),
                "–" if one.sd is None else number(one.sd, 2),
            ]
            for one in means
            if one.block == found.id
        ]
        if rows:
            yield heading(3, found.title)
            head = ("Statement", settings_noun(found).capitalize(), by.capitalize(), "n", "mean", "SD")
            yield table(head, rows, words=3)
    if by == "site":
        yield from _site_thresholds(results)
    if not results.blocks:
        return
    yield paragraph(
        "Mean and standard deviation over participants, each with the mean of their answers. "
        + ("Differences between groups are described, not tested." if by == "group" else TESTED_BY_BLOCK),
        "soft",
    )


def _site_thresholds(results: Results) -> Iterator[str]:
    """Yield the thresholds of blocks of levels by site, with their comparison."""
    if not results.site_thresholds:
        return
    yield heading(3, "Thresholds")
    rows = []
    for one in results.site_thresholds:
        each = [
            f"{site}: {median:.3g} (n = {size})"
            for site, median, size in zip(one.sites, one.medians, map(one.of_sites.count, one.sites), strict=True)
        ]
        where = "–" if one.standard is None else f"{one.standard:g}"
        tested = one.outcome
        rows.append([one.title, "; ".join(each), where, statistic(tested), p_value(tested.p), number(tested.effect)])
    yield table(("Block", "Median by site", "Standard", "Statistic", "p", "Share between sites"), rows, words=2)
    methods = dict.fromkeys(one.outcome.method for one in results.site_thresholds if one.outcome.p is not None)
    yield paragraph(
        f"Median of the participants' thresholds; {test_name(results.site_thresholds[0].outcome)} "
        f"({'; '.join(methods) or 'not computed'}), exploratory, p not adjusted.",
        "soft",
    )


def _first(lines: list[str]) -> list[str]:
    more = len(lines) - SHOWN
    return [*lines[:SHOWN], *([f"and {more} more, in report.json"] if more > 0 else [])]


def _delivered(study: Study, results: Results) -> Iterator[str]:
    if not results.delivered:
        return
    yield heading(3, "Were delays displayed as specified?")
    blocks = {found.id: found for found in results.blocks}
    yield table(
        ("Block", "Setting", "asked", "achieved", "mean error", "worst trial", "trials", "within limits"),
        [
            [
                blocks[one.block].title,
                "all" if one.code is None else name(blocks[one.block], one.code),
                *(_delays(one) if study.revealed else ["sealed"] * 4),
                _trials(one) if study.revealed else str(one.trials),
                _within(one),
            ]
            for one in results.delivered
        ],
        words=2,
    )
    limits = study.protocol.get("limits", {})
    yield paragraph(
        "Age of what was drawn, less the delay asked for: mean over trials of each trial's mean, and the trial whose "
        "mean was farthest off; on the program's clock, without the display's own latency. Within limits: "
        + "; ".join(_limit(what, limit) for what, limit in limits.items())
        + ". Trials beyond them are counted all the same, unless they are excluded above."
        + ("" if study.revealed else " Until unblinding delay error and force withheld are sealed, and not judged."),
        "soft",
    )


def _delays(one: Delivered) -> list[str]:
    """Return the cells on the delay asked for, the one achieved and the errors."""
    return [
        "–" if one.delay_ms is None else ms(one.delay_ms),
        "–" if one.achieved_ms is None else f"{number(one.achieved_ms, 1)} ms",
        _ms(one.error_mean_ms),
        _ms(one.error_worst_ms),
    ]


def _limit(what: str, limit: float) -> str:
    """Return a limit in words: "frame gap at most 250 ms"."""
    name, _, unit = what.rpartition("_")
    if not name:
        return f"at most {limit:g} {unit}"
    return f"{name.replace('_', ' ')} at most {limit:g} {'%' if unit == 'percent' else unit}"


def _within(one: Delivered) -> str:
    return f"{one.valid} of {one.judged}" if one.judged else "not measured"


def _ms(value: float | None) -> str:
    return "–" if value is None else f"{'+' if value > 0 else ''}{number(value, 1)} ms"


def _trials(one: Delivered) -> str:
    return str(one.trials) if one.measured == one.trials else f"{one.trials}, {one.measured} measured"


def _orders(results: Results) -> Iterator[str]:
    several = [
        (found, counts)
        for found in results.blocks
        if (counts := results.orders.get(found.id)) is not None and counts.orders and len(counts.codes) >= 2
    ]
    if not several:
        return
    yield heading(3, "Orders as run")
    for found, counts in several:
        names = {code: name(found, code) if found.revealed else code for code in counts.codes}
        yield paragraph(f"{found.title}, {counted(counts.orders, 'order')}: {_evenness(counts)}")
        yield table(
            ("Place", *names.values()),
            [[str(place), *(str(count) for count in line)] for place, line in enumerate(counts.positions, start=1)],
        )
    yield paragraph("How often each setting came at each place of its block.", "soft")


def _evenness(counts: Evenness) -> str:
    cells = [count for line in counts.positions for count in line]
    after = counts.after_another
    places = (
        f"each came at each place {counted(cells[0], 'time')}"
        if counts.positions_even
        else f"a setting came at a place {min(cells)} to {max(cells)} times, so that settings and places mix unevenly"
    )
    follows = (
        "each followed each other one equally often"
        if counts.follows_even
        else f"one followed another {min(after)} to {max(after)} times"
    )
    return f"{places}; {follows}."


def motion(results: Results) -> Iterator[str]:
    """Yield the section on motion and force; nothing without blocks of statements."""
    if not results.blocks:
        return
    yield heading(2, "Motion and force")
    measured = results.performance
    if measured is None:
        yield paragraph("After unblinding: a thick liquid is known by its force, and a delay by the motion.")
        return
    for found in results.blocks:
        rows = _motion_rows(found, measured, results.delivered)
        if rows:
            yield heading(3, found.title)
            measures = (*(_label(one) for one in _measures(found, measured)), "trials within limits")
            yield table((settings_noun(found).capitalize(), "n", *measures), rows)
            if found.id not in measured.reaching:
                yield paragraph(
                    "No reaching task in this block: movement time, overshoot and submovements do not exist here.",
                    "soft",
                )
            elif not measured.recorded_in(found.id):
                yield paragraph("No measures of reaches in this block: none of its recordings could be read.", "soft")
    yield paragraph(_recordings(measured))
    yield bullets(
        f"{_label(measure)}: {words}." for measure, words in {**TRIAL_DEFINITIONS, **REACH_DEFINITIONS}.items()
    )
    yield paragraph(
        "Median over participants (quartiles); each participant counts by his or her own median. Within limits: trials "
        "that kept to the protocol's limits of timing, of those of which it is known; the others are in these numbers "
        "too. These measures are described and not tested.",
        "soft",
    )


def _motion_rows(found: BlockFound, measured: Performance, delivered: Sequence[Delivered]) -> list[list[str]]:
    kept = {one.code: _within(one) for one in delivered if one.block == found.id}
    cells: dict[str, dict[str, str]] = {}
    people: dict[str, int] = {}
    for one in measured.moved:
        if one.block == found.id and one.n:
            digits = 2 if one.measure.endswith(("_s", "_n", "_m", "percent")) else 1
            cells.setdefault(one.code, {})[one.measure] = (
                f"{number(one.median, digits)} ({number(one.q1, digits)}–{number(one.q3, digits)})"
            )
            people[one.code] = max(people.get(one.code, 0), one.n)
    measures = _measures(found, measured)
    return [
        [name(found, code), str(people[code]), *(cells[code].get(measure, "–") for measure in measures), kept[code]]
        for code in [setting.code for setting in found.settings]
        if code in cells
    ]


def _measures(found: BlockFound, measured: Performance) -> list[str]:
    there = {one.measure for one in measured.moved if one.block == found.id}
    return [measure for measure in (*OF_TRIALS, *OF_REACHES) if measure in there]


def _label(measure: str) -> str:
    words, _, unit = measure.rpartition("_")
    if unit not in UNITS:
        return measure.replace("_", " ")
    return f"{words.replace('_', ' ')}, {UNITS[unit]}"


def _recordings(measured: Performance) -> str:
    if not measured.trials:
        return "No trial that counts was one of reaching, so that there are no measures of reaches."
    text = f"Reaches: from the recordings of {measured.recorded} of {measured.trials} trials of reaching"
    if measured.unread:
        text += f"; of the others: {'; '.join(measured.unread)}"
    if not measured.judged:
        return f"{text}. Whether trials kept to the protocol's limits of timing was not measured."
    invalid = (
        f" {counted(measured.invalid, 'trial').capitalize()} exceeded the protocol's limits of timing and "
        f"{'is' if measured.invalid == 1 else 'are'} in these numbers."
        if measured.invalid
        else " No trial that counts exceeded the protocol's limits of timing."
    )
    return f"{text}.{invalid}"
