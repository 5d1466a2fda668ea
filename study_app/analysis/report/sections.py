"""The parts of the page: the first page, tests of each block, other questions, and how the study was run."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, Final

from markupsafe import Markup

from study_app.analysis.data.motion import OF_REACHES, OF_TRIALS, REACH_DEFINITIONS, TRIAL_DEFINITIONS, Performance
from study_app.analysis.data.questions import MEASURES
from study_app.analysis.data.study_tables import By, Study, group_counts, group_means
from study_app.analysis.figures.page_layout import Picture
from study_app.analysis.findings import all_findings
from study_app.analysis.findings.finding import NO_EVIDENCE, Answer, Finding
from study_app.analysis.findings.statement_tests import OverAll
from study_app.analysis.levels.results import QuestionFound, ScoreFound
from study_app.analysis.planning.power_curves import interval as share_interval
from study_app.analysis.report import level_sections
from study_app.analysis.report.html_page import (
    attempted,
    bullets,
    drawn,
    heading,
    paragraph,
    picture,
    render,
    table,
    table_of,
)
from study_app.analysis.report.sentences import none_found, of_levels
from study_app.analysis.results import (
    VERDICTS_MEAN,
    BlockFound,
    Delivered,
    Failures,
    Results,
    counted,
    lead,
    listed,
    missing,
    ms,
    name,
    number,
    p_value,
    said_of_presentations,
    settings_noun,
    short,
    statistic,
    test_name,
)
from study_app.analysis.statistics.outcome import holm
from study_app.protocol.orders.balance import Evenness
from study_app.store.exclusions import named

STUDIES: Final = 2000
CLAIMS: Final[dict[int, int]] = {5: 11, 12: 33, 24: 36}
"""Participants → in how many of so many empty studies the first page claims something, half of them by the answer model
and half by the ordinal probit model: ``liquid-study validate-report --studies 1000``."""

LIMITS_SHOWN: Final = 6
"""So many limits are listed on the first page; the others are folded."""


def first_page(results: Results, limits: Sequence[str]) -> Markup:
    """Return the table of verdicts, the limits below it, and how often the table is wrong."""
    asked = {one.key: one.question for one in all_findings() if one.question}
    kinds = {found.id: found.kind for found in results.blocks}
    given = answers(results)
    verdicts = table_of(
        given,
        ("Part", lambda one: one.title),
        ("Question", lambda one: asked[one.question].format(kind=kinds[one.block])),
        ("Verdict", lambda one: one.verdict),
        ("What can be said", lambda one: one.text),
        words=4,
    )
    return render(
        "first_page.html",
        verdicts=verdicts if given else "",
        without_findings=() if given else of_levels(results) or (none_found(results),),
        limits=list(limits),
        shown=LIMITS_SHOWN,
        empty=empty_studies(max(found.n for found in results.blocks)) if given else "",
    )


def answers(results: Results) -> tuple[Answer, ...]:
    """Return the answers that a study gives, block by block; none of a block in which nobody's answers count.

    They claim something about a block only where the one test over all its statements finds a difference, corrected
    by Holm over the blocks: in a study where nothing differs they then claim anything at most so often as alpha says.
    """
    overall = holm([None if (one := OverAll.of(found)) is None else one.p for found in results.blocks])
    return tuple(
        _answer(finding(found, results), differs=p is not None and p <= results.decided.alpha)
        for found, p in zip(results.blocks, overall, strict=True)
        for finding in all_findings()
        if found.n and finding.question and found.kind in finding.kinds
    )


def _answer(finding: Finding[Any], *, differs: bool) -> Answer:
    """Return the answer of a finding; without its claim unless the test over all statements ``differs``."""
    if not finding.found.revealed:
        return finding.answered("sealed", "This waits for the key to be opened: until then settings are codes.")
    answer = finding.answer()
    if differs or not answer.claims:
        return answer
    text = f"Single tests find something, but the test over all statements does not find a difference. {NO_EVIDENCE}"
    return finding.answered("not shown", text)


def empty_studies(participants: int) -> str:
    """Return in how many of a hundred empty studies the first page claims something; ``participants`` take part."""
    n = min(CLAIMS, key=lambda size: abs(size - participants))
    share, low, high = (100 * one for one in (CLAIMS[n] / STUDIES, *share_interval(CLAIMS[n] / STUDIES, STUDIES)))
    return (
        f"Of simulated studies of three liquids and seven delays in which nothing differs, with {n} participants, this "
        f"table claims a difference or a noticed delay in {share:.1f} of a hundred ({CLAIMS[n]} of {STUDIES} studies, "
        f"95 % interval {low:.1f} to {high:.1f}; liquid-study validate-report)."
    )


def block(
    found: BlockFound, results: Results, drawn: Sequence[Picture], failures: Failures | None = None
) -> Iterator[str]:
    """Yield the section of one block; a part that fails is said in its place, and kept in ``failures``."""
    yield heading(2, lead(found))
    if not found.n:
        untested = any(one.block == found.id for one in results.failures)
        yield (
            bullets(missing(found))
            if untested
            else paragraph("No answers count yet: there is nothing to test or to plot.")
        )
        return
    held = Failures() if failures is None else failures
    for what, make in _parts(found, results, {one.name.split("-")[0]: one for one in drawn if one.block == found.id}):
        yield from attempted(held, what, heading(3, what.capitalize()), make, block=found.id)


def _parts(
    found: BlockFound, results: Results, pictures: Mapping[str, Picture]
) -> Iterator[tuple[str, Callable[[], Iterable[str]]]]:
    """Yield what the parts of a block's section are, and how each is made."""
    yield "presentations", lambda: _presentations(found)
    yield "figure of answers", lambda: drawn(pictures, found.kind)
    for finding in all_findings():
        yield finding.part, finding(found, results, pictures).section
    yield "what is not here", lambda: _absent(found)


def _presentations(found: BlockFound) -> Iterator[str]:
    """Say what one answer stands for, where it is more than one presentation."""
    lines = said_of_presentations(found)
    if lines:
        yield paragraph(" ".join(lines))


def _absent(found: BlockFound) -> Iterator[str]:
    if found.absent:
        yield heading(3, "What is not here, and why")
        yield bullets(f"{line[:1].upper()}{line[1:]}" for line in missing(found))


def verdicts_mean(results: Results) -> Iterator[str]:
    """Yield what the words of verdicts mean, once for all tables; nothing where nothing was tested."""
    if not results.blocks:
        return
    yield heading(2, "What the words of verdicts mean")
    yield paragraph(VERDICTS_MEAN.format(alpha=f"{results.decided.alpha:g}"))


def counts_of_answers(results: Results) -> Iterator[str]:
    """Yield the counts of all answers, block by block; nothing without blocks of statements."""
    if not results.blocks:
        return
    yield heading(2, "Answers, counted")
    for found in results.blocks:
        if found.measures:
            yield heading(3, lead(found))
            yield _measures(found)


def _measures(found: BlockFound) -> str:
    levels = [str(level) for level in range(1, 8)]
    order = [item.id for item in found.items]
    return table_of(
        sorted(found.measures, key=lambda row: order.index(str(row["item"]))),
        ("Statement", lambda row: short(found, str(row["item"]))),
        (settings_noun(found).capitalize(), lambda row: name(found, str(row["code"]))),
        *((str(level), partial(_count_of, level)) for level in levels),
        ("n", lambda row: str(row["n"])),
        ("missing", lambda row: str(row["missing"] + row["cannot_judge"])),
        ("median", lambda row: number(row["median"], 1)),
        ("quartiles", lambda row: "–" if row["q1"] is None else f"{number(row['q1'], 1)} – {number(row['q3'], 1)}"),
        ("agree %", lambda row: number(row["agree_percent"], 0)),
        words=2,
    )


def _count_of(level: str, row: Mapping[str, Any]) -> str:
    return str(row[f"count_{level}"])


def places(results: Results) -> dict[str, str]:
    """Return where questions were asked: id → title of the section, in the order of the session."""
    levels = {one.block for one in results.levels}

    def kind(one: QuestionFound) -> str:
        return "form" if one.is_form else "levels" if one.where in levels else "other questions"

    return {one.where: f"{one.title}: {kind(one)}" for one in results.questions}


def question_section(where: str, study: Study, results: Results, drawn: Sequence[Picture]) -> Iterator[str]:
    """Yield the section of a form, or of a block's other questions."""
    yield heading(2, places(results)[where])
    pictures = {one.name: one for one in drawn}
    asked = {(one.where.id, one.id): one for one in study.others.questions}
    yield from _scores([one for one in results.scores if one.where == where])
    steps = {one.block for one in results.levels if one.summary == "settings"}  # each from another start
    for found in results.questions:
        if found.where == where:
            yield heading(3, "Answers" if where in {one.block for one in results.levels} else found.short)
            yield paragraph(found.text)
            if where in steps:
                continue
            if not found.n:
                yield paragraph("No answers count yet.")
                continue
            measure = MEASURES[found.measure]
            if measure.cells is None:
                yield from _texts(found)
                continue
            question = asked[found.where, found.item]
            rows = [(group.name, measure.cells(question, group.numbers)) for group in found.groups]
            yield _table(rows)
            name = f"question-{found.where}-{found.item}"
            if name in pictures:
                yield picture(pictures[name].files["png"], pictures[name].caption)
    for levels in results.levels:
        if levels.block == where:
            yield from level_sections.level_section(levels, drawn, study.estimator)


def _table(rows: Sequence[tuple[str, Mapping[str, str]]]) -> str:
    head = ("Answers", *rows[0][1])
    return table(head, [[name, *cells.values()] for name, cells in rows])


def _texts(found: QuestionFound) -> Iterator[str]:
    """List the texts, by participant."""
    for group in found.groups:
        if len(found.groups) > 1:
            yield paragraph(f"{group.name}:")
        yield bullets(group.numbers["texts"])


def _scores(scores: Sequence[ScoreFound]) -> Iterator[str]:
    if not scores:
        return
    yield heading(3, "Scores")
    yield table(
        ("Score", "Setting", "n", "mean", "SD", "range"),
        [
            [
                one.name,
                group.name,
                str(group.numbers["n"]),
                number(group.numbers["mean"], 1),
                number(group.numbers["sd"], 1),
                "–"
                if group.numbers["smallest"] is None
                else f"{number(group.numbers['smallest'], 1)} – {number(group.numbers['largest'], 1)}",
            ]
            for one in scores
            for group in one.groups
        ],
        words=2,
    )
    yield from (paragraph(source, "soft") for source in dict.fromkeys(one.source for one in scores) if source)


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
            measures = (*(_label(one) for one in _motion_measures(found, measured)), "trials within limits")
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
    measures = _motion_measures(found, measured)
    return [
        [name(found, code), str(people[code]), *(cells[code].get(measure, "–") for measure in measures), kept[code]]
        for code in [setting.code for setting in found.settings]
        if code in cells
    ]


def _motion_measures(found: BlockFound, measured: Performance) -> list[str]:
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
