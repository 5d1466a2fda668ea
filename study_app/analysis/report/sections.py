"""The parts of the page: the first page, tests of each block, other questions, and how the study was run."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

from markupsafe import Markup

from study_app.analysis.data.motion import (
    OF_REACHES,
    OF_TRIALS,
    REACH_DEFINITIONS,
    TRIAL_DEFINITIONS,
    Moved,
    Performance,
)
from study_app.analysis.data.questions import MEASURES
from study_app.analysis.data.study_tables import By, GroupMean, Study, group_counts, group_means
from study_app.analysis.figures.page_layout import Picture
from study_app.analysis.findings import all_findings
from study_app.analysis.findings.finding import NO_EVIDENCE, Answer, Finding
from study_app.analysis.findings.statement_tests import OverAll
from study_app.analysis.levels.evaluate import level_section
from study_app.analysis.planning.power_curves import interval as share_interval
from study_app.analysis.report.html_page import attempted, bullets, drawn, heading, paragraph, render, table, table_of
from study_app.analysis.report.sentences import none_found, of_levels
from study_app.analysis.results import (
    VERDICTS_MEAN,
    BlockFound,
    Delivered,
    Failures,
    QuestionFound,
    Results,
    ScoreFound,
    SiteThresholds,
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
        none = paragraph("No answers count yet: there is nothing to test or to plot.")
        yield bullets(missing(found)) if untested else none
        return
    held = Failures() if failures is None else failures
    pictures = {one.name.split("-")[0]: one for one in drawn if one.block == found.id}
    for what, make in _parts(found, results, pictures):
        yield from attempted(held, what, heading(3, what.capitalize()), make, block=found.id)


def _parts(
    found: BlockFound, results: Results, pictures: Mapping[str, Picture]
) -> Iterator[tuple[str, Callable[[], Iterable[str]]]]:
    """Yield what the parts of a block's section are, and how each is made."""
    if said := said_of_presentations(found):
        yield "presentations", lambda: [paragraph(" ".join(said))]
    yield "figure of answers", lambda: drawn(pictures, found.kind)
    for finding in all_findings():
        yield finding.part, finding(found, results, pictures).section
    if found.absent:
        lines = [f"{line[:1].upper()}{line[1:]}" for line in missing(found)]
        yield "what is not here", lambda: (heading(3, "What is not here, and why"), bullets(lines))


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
    order = [item.id for item in found.items]
    return table_of(
        sorted(found.measures, key=lambda row: order.index(str(row["item"]))),
        ("Statement", lambda row: short(found, str(row["item"]))),
        (settings_noun(found).capitalize(), lambda row: name(found, str(row["code"]))),
        *((str(level), lambda row, level=level: str(row[f"count_{level}"])) for level in range(1, 8)),
        ("n", lambda row: str(row["n"])),
        ("missing", lambda row: str(row["missing"] + row["cannot_judge"])),
        ("median", lambda row: number(row["median"], 1)),
        ("quartiles", lambda row: "–" if row["q1"] is None else f"{number(row['q1'], 1)} – {number(row['q3'], 1)}"),
        ("agree %", lambda row: number(row["agree_percent"], 0)),
        words=2,
    )


def places(results: Results) -> dict[str, str]:
    """Return where questions were asked: id → title of the section, in the order of the session."""
    levels = {one.block for one in results.levels}

    def kind(one: QuestionFound) -> str:
        return "form" if one.is_form else "levels" if one.where in levels else "other questions"

    return {one.where: f"{one.title}: {kind(one)}" for one in results.questions}


def question_section(where: str, study: Study, results: Results, drawn_: Sequence[Picture]) -> Iterator[str]:
    """Yield the section of a form, or of a block's other questions."""
    yield heading(2, places(results)[where])
    asked = {(one.where.id, one.id): one for one in study.others.questions}
    levels = [one for one in results.levels if one.block == where]
    yield from _scores([one for one in results.scores if one.where == where])
    for found in results.questions:
        if found.where != where:
            continue
        yield heading(3, "Answers" if levels else found.short)
        yield paragraph(found.text)
        if any(one.summary == "settings" for one in levels):
            continue  # each from another start
        if not found.n:
            yield paragraph("No answers count yet.")
            continue
        measure = MEASURES[found.measure]
        if measure.cells is None:
            for group in found.groups:
                if len(found.groups) > 1:
                    yield paragraph(f"{group.name}:")
                yield bullets(group.numbers["texts"])
            continue
        rows = [(group.name, measure.cells(asked[where, found.item], group.numbers)) for group in found.groups]
        yield table(("Answers", *rows[0][1]), [[name, *cells.values()] for name, cells in rows])
        yield from drawn({one.name: one for one in drawn_}, f"question-{where}-{found.item}")
    for one in levels:
        yield from level_section(one, drawn_, study.estimator)


def _scores(scores: Sequence[ScoreFound]) -> Iterator[str]:
    if not scores:
        return
    yield heading(3, "Scores")

    def ends(numbers: Mapping[str, Any]) -> str:
        low, high = numbers["smallest"], numbers["largest"]
        return "–" if low is None else f"{number(low, 1)} – {number(high, 1)}"

    yield table_of(
        [(score.name, group.name, group.numbers) for score in scores for group in score.groups],
        ("Score", lambda one: one[0]),
        ("Setting", lambda one: one[1]),
        ("n", lambda one: str(one[2]["n"])),
        ("mean", lambda one: number(one[2]["mean"], 1)),
        ("SD", lambda one: number(one[2]["sd"], 1)),
        ("range", lambda one: ends(one[2])),
        words=2,
    )
    yield from (paragraph(source, "soft") for source in dict.fromkeys(one.source for one in scores) if source)


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
        if rows := [one for one in means if one.block == found.id]:
            yield heading(3, found.title)
            yield _means(found, rows, by)
    if by == "site":
        yield from _site_thresholds(results)
    if not results.blocks:
        return
    yield paragraph(
        "Mean and standard deviation over participants, each with the mean of their answers. "
        + (
            "Differences between groups are described, not tested."
            if by == "group"
            else "Sites are compared in the section of each block."
        ),
        "soft",
    )


def _means(found: BlockFound, rows: Sequence[GroupMean], by: By) -> str:
    return table_of(
        rows,
        ("Statement", lambda one: short(found, one.item)),
        (settings_noun(found).capitalize(), lambda one: name(found, one.code)),
        (by.capitalize(), lambda one: one.group),
        ("n", lambda one: str(one.n)),
        ("mean", lambda one: number(one.mean, 2)),
        ("SD", lambda one: number(one.sd, 2)),
        words=3,
    )


def _site_thresholds(results: Results) -> Iterator[str]:
    """Yield the thresholds of blocks of levels by site, with their comparison."""
    if not results.site_thresholds:
        return
    yield heading(3, "Thresholds")

    def medians(one: SiteThresholds) -> str:
        sizes = map(one.of_sites.count, one.sites)
        each = zip(one.sites, one.medians, sizes, strict=True)
        return "; ".join(f"{site}: {median:.3g} (n = {size})" for site, median, size in each)

    yield table_of(
        results.site_thresholds,
        ("Block", lambda one: one.title),
        ("Median by site", medians),
        ("Standard", lambda one: "–" if one.standard is None else f"{one.standard:g}"),
        ("Statistic", lambda one: statistic(one.outcome)),
        ("p", lambda one: p_value(one.outcome.p)),
        ("Share between sites", lambda one: number(one.outcome.effect)),
        words=2,
    )
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

    def shown(cell: Callable[[Delivered], str]) -> Callable[[Delivered], str]:
        return cell if study.revealed else lambda _one: "sealed"

    def trials(one: Delivered) -> str:
        whole = one.measured == one.trials or not study.revealed
        return str(one.trials) if whole else f"{one.trials}, {one.measured} measured"

    yield table_of(
        results.delivered,
        ("Block", lambda one: blocks[one.block].title),
        ("Setting", lambda one: "all" if one.code is None else name(blocks[one.block], one.code)),
        ("asked", shown(lambda one: "–" if one.delay_ms is None else ms(one.delay_ms))),
        ("achieved", shown(lambda one: "–" if one.achieved_ms is None else f"{number(one.achieved_ms, 1)} ms")),
        ("mean error", shown(lambda one: _signed_ms(one.error_mean_ms))),
        ("worst trial", shown(lambda one: _signed_ms(one.error_worst_ms))),
        ("trials", trials),
        ("within limits", _within),
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


def _limit(what: str, limit: float) -> str:
    """Return a limit in words: "frame gap at most 250 ms"."""
    words, _, unit = what.rpartition("_")
    most = f"at most {limit:g} {'%' if words and unit == 'percent' else unit}"
    return f"{words.replace('_', ' ')} {most}" if words else most


def _within(one: Delivered) -> str:
    return f"{one.valid} of {one.judged}" if one.judged else "not measured"


def _signed_ms(value: float | None) -> str:
    return "–" if value is None else f"{'+' if value > 0 else ''}{number(value, 1)} ms"


def _orders(results: Results) -> Iterator[str]:
    several = [(found, counts) for found in results.blocks if (counts := results.orders.get(found.id)) is not None]
    several = [(found, counts) for found, counts in several if counts.orders and len(counts.codes) >= 2]
    if not several:
        return
    yield heading(3, "Orders as run")
    for found, counts in several:
        names = [name(found, code) if found.revealed else code for code in counts.codes]
        yield paragraph(f"{found.title}, {counted(counts.orders, 'order')}: {_evenness(counts)}")
        lines = enumerate(counts.positions, start=1)
        yield table(("Place", *names), [[str(place), *map(str, line)] for place, line in lines])
    yield paragraph("How often each setting came at each place of its block.", "soft")


def _evenness(counts: Evenness) -> str:
    cells, after = [count for line in counts.positions for count in line], counts.after_another
    places = f"a setting came at a place {min(cells)} to {max(cells)} times, so that settings and places mix unevenly"
    if counts.positions_even:
        places = f"each came at each place {counted(cells[0], 'time')}"
    follows = f"one followed another {min(after)} to {max(after)} times" if not counts.follows_even else ""
    return f"{places}; {follows or 'each followed each other one equally often'}."


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
        measures = [one for one in (*OF_TRIALS, *OF_REACHES) if any(_of(measured, found, measure=one))]
        rows = _motion_rows(found, measured, measures, results.delivered)
        if rows:
            yield heading(3, found.title)
            head = (settings_noun(found).capitalize(), "n", *map(_label, measures), "trials within limits")
            yield table(head, rows)
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


def _of(measured: Performance, found: BlockFound, **wanted: str) -> Iterator[Moved]:
    """Yield the measures of a block, by code or by name."""
    for one in measured.moved:
        if one.block == found.id and all(getattr(one, field) == value for field, value in wanted.items()):
            yield one


def _motion_rows(
    found: BlockFound, measured: Performance, measures: Sequence[str], delivered: Sequence[Delivered]
) -> list[list[str]]:
    kept = {one.code: _within(one) for one in delivered if one.block == found.id}
    rows = []
    for setting in found.settings:
        here = {one.measure: one for one in _of(measured, found, code=setting.code) if one.n}
        if here:
            n = max(one.n for one in here.values())
            cells = [_quartiles(here[measure]) if measure in here else "–" for measure in measures]
            rows.append([name(found, setting.code), str(n), *cells, kept[setting.code]])
    return rows


def _quartiles(one: Moved) -> str:
    digits = 2 if one.measure.endswith(("_s", "_n", "_m", "percent")) else 1
    return f"{number(one.median, digits)} ({number(one.q1, digits)}–{number(one.q3, digits)})"


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
    if not measured.invalid:
        return f"{text}. No trial that counts exceeded the protocol's limits of timing."
    verb = "is" if measured.invalid == 1 else "are"
    invalid = f"{counted(measured.invalid, 'trial').capitalize()} exceeded the protocol's limits of timing and {verb}"
    return f"{text}. {invalid} in these numbers."
