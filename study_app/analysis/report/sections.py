"""Sections and texts of the report: findings, limitations, conclusions, blocks, and how the study was run."""

import math
import statistics
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final, NamedTuple

import pandas as pd

from study_app.analysis.contrasts import answer, question
from study_app.analysis.data.measures import LEVELS, number_or_none
from study_app.analysis.data.study_tables import By, Study, group_assignment, group_counts, group_means
from study_app.analysis.findings import all_findings
from study_app.analysis.findings.finding import FOUND, Answer, Finding
from study_app.analysis.html_page import bullets, drawn_figure, heading, paragraph, table, table_of, try_part
from study_app.analysis.levels.evaluate import level_findings, level_limits, level_section
from study_app.analysis.page_layout import Picture
from study_app.analysis.planned_exclusions import PlannedExclusions, rule_sentences
from study_app.analysis.planning import WANTED
from study_app.analysis.planning.power_curves import interval as share_interval
from study_app.analysis.planning.smallest_differences import MOST_SD, detectable_difference
from study_app.analysis.questions import MEASURES
from study_app.analysis.report.background_table import background_table
from study_app.analysis.report.methods import language_text, late_exclusions
from study_app.analysis.report.motion_section import within_limits_text
from study_app.analysis.report.questions_in_full import changed_questions
from study_app.analysis.results import (
    VERDICTS_MEAN,
    BlockResult,
    Delivered,
    Failures,
    QuestionResult,
    Results,
    ScoreResult,
    incomplete_answers_sentence,
    lead_phrase,
    missing_sentences,
    name,
    presentation_sentences,
    settings_noun,
    short_text,
)
from study_app.analysis.statistics.outcome import FEW
from study_app.analysis.wording import counted, listed, ms, number, significant
from study_app.discovery import by_name
from study_app.number_text import capitalised
from study_app.protocol.descriptions import limit_label
from study_app.protocol.model import RULES
from study_app.protocol.orders import Evenness
from study_app.protocol.participants import RecordedSessions
from study_app.protocol.quantities import quoted_title
from study_app.store.exclusions import dated_reversals, describe_exclusion
from study_app.store.merged import folders_of
from study_app.store.session_progress import MISSING_PERCENT, MissingTrials, broken_limits
from study_app.store.unblinding import RULES as AUTOMATIC_RULES
from study_app.store.unblinding import reveals_of
from study_app.store.versions import recorded_contents


def level_sentences(results: Results) -> tuple[str, ...]:
    """Return sentences on the findings in blocks of levels."""
    return tuple(line for level in results.levels for line in level_findings(level))


def no_findings_sentence(results: Results) -> str:
    """Return a sentence on the reason why there are no findings."""
    if results.blocks:
        return "No answers are included yet."
    if not (results.questions or results.levels):
        return "The study does not ask questions; the sections below show how participants moved."
    return "The study does not ask participants to rate statements after trials; the sections below show the answers."


def limits(study: Study, results: Results) -> tuple[str, ...]:
    """Return the limitations of the study, one sentence each."""
    lines = list(_general_sentences(study, results))
    for result in results.blocks:
        if not result.n:
            lines.append(f"{lead_phrase(result)}: no answers are included yet.")
            continue
        if len(result.names) == 1:
            if any(item.id in results.decided.primary for item in result.items):
                noun = settings_noun(result)
                lines.append(f"{result.title} presents only one {noun}, so its ratings are not compared.")
            continue
        lines += [f"{lead_phrase(result)}: {sentence}" for sentence in missing_sentences(result)]
        tests = [test for finding in all_findings() if finding.statements for test in finding.value_in(result)]
        out_of_reach = [f"“{short_text(result, test.item)}”" for test in tests if test.verdict == "out of reach"]
        if out_of_reach:
            lines.append(
                f"{lead_phrase(result)}: the test{'s' * (len(out_of_reach) > 1)} for {listed(out_of_reach)} could not "
                "have been significant with so few participants, because no rearrangement of the answers within "
                "participants gives a small enough adjusted p value."
            )
        untested: dict[str, list[str]] = {}
        for test in tests:
            if test.verdict == "not tested":
                untested.setdefault(test.outcome.note, []).append(f"“{short_text(result, test.item)}”")
        lines += [
            f"{lead_phrase(result)}: {listed(items)} could not be tested ({why})." for why, items in untested.items()
        ]
        lines += _repeated_position_sentences(result, results)
        lines += [sentence for finding in all_findings() for sentence in finding(result, results).limits()]
    lines += [sentence for level in results.levels for sentence in level_limits(level)]
    return tuple(lines)


def _general_sentences(study: Study, results: Results) -> Iterator[str]:
    decided = results.decided
    if not study.revealed:
        key, shown = _sealed_key_text(study), "only counts and comparisons that do not depend on their order"
        if study.own_codes or study.sites:
            shown = "only counts"
        yield (
            f"{key}: conditions appear as codes, and the report shows {shown}. Hypotheses are tested after "
            "unblinding. Using these numbers to decide whether to continue makes chance findings more likely. To open "
            "the key, use Unblind in Results or the command liquid-study unblind RESULTS --by NAME --reason TEXT."
        )
        if study.own_codes:
            yield "Until unblinding, each participant has a separate set of codes, so conditions cannot be compared."
        if study.sites:
            yield (
                "Codes differ between sites until all keys are open, so conditions are not counted or compared across "
                "sites."
            )
    if study.simulated:
        yield "The participants were SIMULATED, so this report is not evidence about people."
    if study.pilot:
        yield "These are pilot sessions, so do not report them as results of the study."
    if study.doubts:
        files = len({doubt.path for doubt in study.doubts})
        verbs = "is missing or has" if files == 1 else "are missing or have"
        yield (
            f"{capitalised(counted(files, 'file'))} {verbs} changed since recording, so numbers may be wrong. The "
            "command liquid-study verify RESULTS checks all files."
        )
    if not decided.made:
        yield "No analysis was planned in the study file, so all results are exploratory."
    elif decided.changed:
        yield (
            "The decisions about the analysis changed between sessions, so all results are exploratory; the decisions "
            "from the first session are used."
        )
    hypotheses = [contrast.contrast for contrast in results.contrasts]
    if len({contrast.groups is None for contrast in hypotheses}) == 2 and not any(
        contrast.is_interaction for contrast in hypotheses
    ):
        yield "No hypothesis tests an interaction between groups and blocks or conditions."
    yield from _low_power_sentences(results)
    yield from _chance_level_sentences(results)
    yield from _fixed_order_sentences(study, results)
    if any(contrast.groups for contrast in hypotheses) and group_assignment(study) == "pre-existing":
        yield (
            "Participants were not assigned to groups at random, so a difference between groups may have other causes."
        )
    if results.questions and not (results.blocks or results.levels):
        lead = "Apart from the hypotheses, the answers" if hypotheses else "The answers"
        if not study.revealed:
            lead = "Apart from any hypotheses, the answers"
        yield (
            f"{lead} to these questions are summarised but not tested. The intervals are not corrected for the number "
            "of questions, so if there are many questions, some differences are to be expected by chance."
        )
    if study.contents > len(study.versions):
        yield (
            "The study file was changed between sessions without a new version number, so "
            f"{study.contents} different files were used. Compare the protocols in the receipts; report.json lists "
            "each session's protocol_hash."
        )
    yield from changed_questions(recorded_contents(study.folder))
    if study.late:
        yield (
            "Some decisions were made after the key was opened, when their effect on the results was visible: "
            f"{late_exclusions(study)}. To see their influence, reverse these decisions in a copy of the study "
            "(`include` or `exclude`) and compare the two reports."
        )
    yield from _late_device_sentence(study)
    if study.n == 1:
        yield "There is only one participant, so the results do not generalise to other people."
    if study.n < FEW and results.blocks:
        yield (
            "Intervals for mean rank correlations and exploratory tests of means need at least "
            f"{FEW} participants; this study has {study.n}. Effects that this report does not show may still exist."
        )


def _sealed_key_text(study: Study) -> str:
    """Return a clause on the sealed key or, in a merged study, on the keys that are open and sealed."""
    if not study.sites:
        return "The key is sealed"
    opened = {reveal.get("site") for reveal in reveals_of(study.folder)}

    def keys(sites: Sequence[str]) -> str:
        return f"key of {sites[0]} is" if len(sites) == 1 else f"keys of {listed(sites)} are"

    sealed_sites = [site for site in study.sites if site not in opened] or ["a site without sessions"]
    open_sites = [site for site in study.sites if site in opened]
    return f"The {keys(sealed_sites)} sealed{f' (the {keys(open_sites)} open)' if open_sites else ''}"


def _late_device_sentence(study: Study) -> Iterator[str]:
    """Yield a sentence on the main trials in which the device answered later than assumed, if there are any."""
    rows = study.trials[study.trials["counted"] & (study.trials["phase"] == "main")]
    late = rows[rows["device_delay_ticks"].notna()] if "device_delay_ticks" in rows else rows[:0]
    if len(late):
        assumed = " or ".join(f"{ticks:g}" for ticks in sorted(set(late["loop_delay_ticks"])))
        yield (
            f"In {len(late)} of {counted(len(rows), 'trial')} in the main blocks, the device responded later than the "
            f"servo assumed: in the worst case after at least {late['device_delay_ticks'].max():g} ticks instead of "
            f"{assumed}. In these trials, the force acted too late and was reduced by the passivity controller."
        )


def _low_power_sentences(results: Results) -> Iterator[str]:
    """Yield a sentence on the smallest difference with 80 % power for each hypothesis that was not shown."""
    for place, result in enumerate(results.contrasts, start=1):
        sides = [(len(side.values), side.sd) for side in result.sides if side.sd]
        compares_groups = result.contrast.groups is not None
        if result.p_adjusted is None or result.verdict in (*FOUND, "equivalent") or len(sides) < 2:
            continue
        sizes, freedom = [n for n, _ in sides], sum(n - 1 for n, _ in sides)
        sd = (
            math.sqrt(sum((n - 1) * (side_sd or 0.0) ** 2 for n, side_sd in sides) / freedom)
            if compares_groups
            else result.sd
        )
        if sd and result.standard_error is not None and not compares_groups:
            sd = result.standard_error * math.sqrt(result.n)  # as in the test, which may weight participants
        if not sd:
            continue
        groups, alpha = sizes if compares_groups else sizes[:1], results.decided.alpha / result.members
        smallest = math.inf
        if min(sizes) > 2:
            _, smallest = detectable_difference(*groups, alpha=alpha, expected=result.contrast.expected)
        lead = f"Hypothesis{f' {place}' if len(results.contrasts) > 1 else ''}"
        people, power = counted(result.n, "participant"), f"{100 * WANTED:.0f} % power"
        largest = result.largest or math.inf
        beyond = f"a difference of {MOST_SD:g} SD" if smallest > MOST_SD else "the largest difference on the scale"
        smallest *= sd
        if smallest > min(MOST_SD * sd, largest):
            yield f"{lead}: with {people}, even {beyond} cannot be detected with {power}."
            continue
        kind, size = ("difference", number(smallest))
        if result.ratio:
            kind, size = "ratio", f"{number(math.exp(smallest))} (or at most {number(math.exp(-smallest))})"
        yield (
            f"{lead}: with {people} and the observed standard deviation, the true mean {kind} must be at least {size} "
            f"to be detected with {power}; the confidence interval shows which {kind}s are compatible with the data."
        )


def _chance_level_sentences(results: Results) -> Iterator[str]:
    """Yield a sentence for each hypothesis about d′ with conditions in which participants may have guessed."""
    for place, result in enumerate(results.contrasts, start=1):
        if result.contrast.measure != "d_prime" or result.contrast.is_interaction or result.verdict in FOUND:
            continue
        sides = [
            quoted_title(side.name)
            for side in result.sides
            if side.low is not None and side.high is not None and side.low <= 0 <= side.high
        ]
        lead = f"Hypothesis{f' {place}' if len(results.contrasts) > 1 else ''}"
        if sides:
            yield (
                f"{lead}: the interval of the mean d′ in {listed(sides)} includes 0 (chance). If the participants "
                "guessed, d′ cannot show a difference."
            )


def _fixed_order_sentences(study: Study, results: Results) -> Iterator[str]:
    """Yield a sentence for each hypothesis on two blocks that all participants completed in the same order."""
    if study.protocol.get("study", {}).get("block_order", "fixed") != "fixed":
        return
    for place, result in enumerate(results.contrasts, start=1):
        blocks = result.contrast.blocks
        if len(blocks) < 2 or result.contrast.groups is not None:
            continue
        orders = {
            tuple(step for step in steps if step in blocks)
            for steps in RecordedSessions.model_validate(study.protocol).every_session()
        }
        if len(orders) == 1 and len(order := orders.pop()) == 2:
            names = dict(zip(blocks, result.compared, strict=True))
            lead = f"Hypothesis{f' {place}' if len(results.contrasts) > 1 else ''}"
            yield (
                f"{lead}: all participants completed {quoted_title(names[order[0]])} before "
                f"{quoted_title(names[order[1]])}, so the difference cannot be distinguished from effects of the "
                "order, such as practice."
            )


def _repeated_position_sentences(result: BlockResult, results: Results) -> Iterator[str]:
    """Yield a sentence for each setting that had the same position for all participants."""
    counts = results.orders.get(result.id)
    if counts is None or counts.orders < 2 or len(counts.codes) < 2:
        return
    for place, line in enumerate(counts.positions, start=1):
        for code, count in zip(counts.codes, line, strict=True):
            if count == counts.orders:
                yield (
                    f"{lead_phrase(result)}: {name(result, code)} was in position {place} for all participants, so its "
                    "effect cannot be distinguished from the effect of that position."
                )


CLAIMS: Final[dict[int, tuple[int, int]]] = {5: (4, 2000), 12: (47, 3000), 24: (42, 3000)}
"""By number of participants: how many reports of simulated studies without effects claimed one, and of how many.

The studies were simulated with the answer model and with the ordinal probit model, by
``liquid-study validate-report --studies 1000``.
"""


def conclusions(results: Results) -> list[tuple[str, ...]]:
    """Return the conclusions as tuples of subject, question, verdict and text."""
    questions = {finding.key: finding.question for finding in all_findings() if finding.question}
    kinds = {result.id: result.kind for result in results.blocks}
    hypotheses = [
        ("Hypothesis", question(contrast), contrast.verdict, answer(contrast)) for contrast in results.contrasts
    ]
    return hypotheses + [
        (given.title, questions[given.question].format(kind=kinds[given.block]), given.verdict, given.text)
        for given in answers(results)
    ]


def planned_section(planned: PlannedExclusions | None, *, sealed: bool = False) -> Iterator[str]:
    """Yield the sessions that meet a planned rule and, once the key is open, the conclusions that depend on them."""
    if planned is None:
        return
    yield heading(2, "Planned exclusions")
    yield table_of(
        planned.proposals,
        ("Session", lambda proposal: f"{proposal.participant}, session {proposal.session}"),
        ("rule", lambda proposal: proposal.rule.replace("_", " ")),
        ("reason", lambda proposal: proposal.why),
        ("decision", lambda proposal: ", ".join(filter(None, [proposal.decision, proposal.by]))),
        words=4,
    )
    if sealed:
        yield paragraph("Conclusions with and without these sessions are compared after unblinding.")
        return
    included, left_out = map(_conclusions_by_question, (planned.included, planned.left_out))
    differing = [name for name in {**included, **left_out} if included.get(name) != left_out.get(name)]
    if not differing:
        yield paragraph("No conclusion depends on whether these sessions are analysed.")
        return
    yield table_of(
        differing,
        ("Conclusion", lambda name: name),
        ("with these sessions", lambda name: included.get(name, "–")),
        ("without these sessions", lambda name: left_out.get(name, "–")),
        words=3,
    )


def _conclusions_by_question(results: Results) -> dict[str, str]:
    by_question = {
        f"{part}: {question_text}": f"{verdict}: {text}" for part, question_text, verdict, text in conclusions(results)
    }
    sentences = (sentence.partition(": ") for sentence in level_sentences(results))
    return by_question | {subject: text for subject, _, text in sentences}


def answers(results: Results) -> tuple[Answer, ...]:
    """Return the answers of all findings, block by block; none for blocks without valid answers or with one setting.

    They claim an effect in a block only if the test over all its statements is significant.
    """
    return tuple(
        _answer_or_sealed(finding(result, results))
        for result in results.blocks
        for finding in all_findings()
        if result.n and len(result.names) > 1 and finding.question and result.kind in finding.kinds
    )


def _answer_or_sealed(finding: Finding[Any]) -> Answer:
    """Return the answer of a finding, or that it is sealed."""
    if not finding.result.revealed:
        return finding.make_answer("sealed", "This question is answered after unblinding.")
    return finding.answer()


def false_claims_sentence(participants: int) -> str:
    """Return a sentence on the proportion of reports that falsely claim an effect, for this sample size."""
    n = min(CLAIMS, key=lambda size: abs(size - participants))
    claims, studies = CLAIMS[n]
    proportion, low, high = (
        number(100 * value, 1) for value in (claims / studies, *share_interval(claims / studies, studies))
    )
    return (
        f"In {studies} simulated studies with {n} participants, three liquids, seven delays and no true effect, "
        f"{proportion} % of the reports claimed a difference or a noticed delay ({claims} reports, 95 % confidence "
        f"interval {low} to {high} %; liquid-study validate-report)."
    )


def block(
    result: BlockResult, results: Results, drawn: Sequence[Picture], failures: Failures | None = None
) -> Iterator[str]:
    """Yield the section of one block; a part that fails is replaced by its reason and added to ``failures``."""
    title = heading(2, lead_phrase(result))
    if not result.n:
        yield title
        untested = any(failure.block == result.id for failure in results.failures)
        none = paragraph("No answers are included yet.")
        yield bullets(missing_sentences(result)) if untested else none
        return
    collected = Failures() if failures is None else failures
    pictures = {picture.name.split("-")[0]: picture for picture in drawn if picture.block == result.id}
    parts = [
        part
        for part_title, make in _block_parts(result, results, pictures)
        for part in try_part(collected, part_title, heading(3, part_title.capitalize()), make, block=result.id)
    ]
    yield from [title, *parts] if parts else []


def _block_parts(
    result: BlockResult, results: Results, pictures: Mapping[str, Picture]
) -> Iterator[tuple[str, Callable[[], Iterable[str]]]]:
    """Yield the titles of a block's parts and the functions that make them."""
    if sentences := presentation_sentences(result):
        yield "presentations", lambda: [paragraph(" ".join(sentences))]
    if result.incomplete:
        yield "missing answers", lambda: [paragraph(incomplete_answers_sentence(result), "soft")]
    effects, *others = all_findings()
    yield effects.what, effects(result, results, pictures).section
    yield "figure showing the answers", lambda: drawn_figure(pictures, result.kind)
    for finding in others:
        yield finding.what or finding.figure_title, finding(result, results, pictures).section
    if result.absent and len(result.names) > 1:
        lines = [f"{line[:1].upper()}{line[1:]}" for line in missing_sentences(result)]
        yield "missing parts", lambda: (heading(3, "What could not be computed, and why"), bullets(lines))


def verdicts_mean(results: Results) -> Iterator[str]:
    """Yield the section that explains the verdicts in all tables; nothing without blocks of statements."""
    if not results.blocks:
        return
    yield heading(2, "What the verdicts mean")
    yield paragraph(VERDICTS_MEAN.format(alpha=significant(results.decided.alpha)))


def counts_of_answers(results: Results) -> Iterator[str]:
    """Yield the counts of all answers, block by block; nothing without blocks of statements."""
    if not results.blocks:
        return
    yield heading(2, "Counts of answers")
    for result in results.blocks:
        if result.measures:
            yield heading(3, lead_phrase(result))
            yield _counts_table(result)


def _counts_table(result: BlockResult) -> str:
    order = [item.id for item in result.items]
    return table_of(
        sorted(result.measures, key=lambda row: order.index(str(row["item"]))),
        ("Statement", lambda row: short_text(result, str(row["item"]))),
        (settings_noun(result).capitalize(), lambda row: name(result, str(row["code"]))),
        *((str(level), lambda row, level=level: str(row[f"count_{level}"])) for level in LEVELS),
        ("n", lambda row: str(row["n"])),
        ("missing", lambda row: str(row["missing"] + row["cannot_judge"])),
        ("mean", lambda row: number(_mean_and_sd(row)[0])),
        ("SD", lambda row: number(_mean_and_sd(row)[1])),
        ("median", lambda row: number(row["median"], 1)),
        ("quartiles", lambda row: "–" if row["q1"] is None else f"{number(row['q1'], 1)} – {number(row['q3'], 1)}"),
        ("agree %", lambda row: number(row["agree_percent"], 0)),
        words=2,
    )


def _mean_and_sd(row: Mapping[str, Any]) -> tuple[float | None, float | None]:
    """Return the mean and the standard deviation of the answers in a row of counts; None if there are too few."""
    answers = [level for level in LEVELS for _ in range(int(row[f"count_{level}"]))]
    return statistics.mean(answers) if answers else None, statistics.stdev(answers) if len(answers) > 1 else None


def places(results: Results) -> dict[str, str]:
    """Return the titles of the sections on questions by the ID of their place, in session order."""
    levels = {
        level.block: "discrimination" if level.revealed and level.vary is None else "levels" for level in results.levels
    }

    rated = {result.id for result in results.blocks}

    def kind(result: QuestionResult) -> str:
        questions = "other questions" if result.where in rated else "questions"
        return "form" if result.is_form else levels.get(result.where, questions)

    return {result.where: f"{place_title(result, results)}: {kind(result)}" for result in results.questions}


def place_title(result: QuestionResult, results: Results) -> str:
    """Return the title of the place of a question, with a note if it is a form after every main block."""
    others = {other.where for other in results.questions if not other.is_form}
    main = {result_block.id for result_block in results.blocks} | {level.block for level in results.levels} | others
    is_repeated = result.is_form and len(main) > 1 and {group.code for group in result.groups} == main
    return f"{result.title}, after each block" if is_repeated else result.title


def question_section(where: str, study: Study, results: Results, pictures: Sequence[Picture]) -> Iterator[str]:
    """Yield the section of a form, or of a block's other questions."""
    yield heading(2, places(results)[where])
    placed_questions = {
        (placed_question.where.id, placed_question.id): placed_question for placed_question in study.others.questions
    }
    levels = [level for level in results.levels if level.block == where]
    yield from _score_table([score for score in results.scores if score.where == where])
    for result in results.questions:
        if result.where != where:
            continue
        yield heading(3, "Answers" if levels else result.short)
        yield paragraph(result.text)
        if any(block.id == where and block.design.first is not None for block in study.levels):
            yield paragraph("The counts include the answers to the modulus.", "soft")
        if any(level.summary == "settings" for level in levels):
            continue  # starting levels differ, so a summary of raw answers has no meaning
        if not result.n:
            yield paragraph("No answers are included yet.")
            continue
        measure = by_name(MEASURES, result.measure)
        if measure.cells is None:
            for group in result.groups:
                if len(result.groups) > 1:
                    yield paragraph(f"{group.name}:")
                yield bullets(group.numbers["texts"])
            continue
        rows = [
            (group.name, measure.cells(placed_questions[where, result.item], group.numbers)) for group in result.groups
        ]
        first = "Answers" if result.is_form else "Condition"
        yield table((first, *rows[0][1]), [[name, *cells.values()] for name, cells in rows])
        yield from drawn_figure({picture.name: picture for picture in pictures}, f"question-{where}-{result.item}")
    for level in levels:
        yield from level_section(level, pictures, study.estimator)


def _score_table(scores: Sequence[ScoreResult]) -> Iterator[str]:
    if not scores:
        return
    yield heading(3, "Scores")

    def ends(numbers: Mapping[str, Any]) -> str:
        low, high = numbers["smallest"], numbers["largest"]
        return "–" if low is None else f"{number(low, 1)} – {number(high, 1)}"

    yield table_of(
        [(score.name, group.name, group.numbers) for score in scores for group in score.groups],
        ("Score", lambda row: row[0]),
        ("Answers", lambda row: row[1]),
        ("n", lambda row: str(row[2]["n"])),
        ("mean", lambda row: number(row[2]["mean"], 1)),
        ("SD", lambda row: number(row[2]["sd"], 1)),
        ("SE", lambda row: number(None if row[2]["sd"] is None else row[2]["sd"] / math.sqrt(row[2]["n"]))),
        ("range", lambda row: ends(row[2])),
        words=2,
    )
    yield from (paragraph(source, "soft") for source in dict.fromkeys(score.source for score in scores) if source)


def _reversed_exclusion_sentences(study: Study) -> Iterator[str]:
    """Yield a sentence on each reversed exclusion; sessions kept despite a rule are listed with the rules."""
    for prefix, place in folders_of(study.folder).items():
        for reversal in dated_reversals(place):
            exclusion = replace(reversal.exclusion, participant=f"{prefix}{reversal.exclusion.participant}")
            if exclusion.rule_or_person not in RULES or exclusion.excluded_at != reversal.at:
                yield (
                    f"{describe_exclusion(exclusion)}: {exclusion.reason} ({exclusion.rule_or_person}, "
                    f"{exclusion.excluded_at[:10]}). {reversal.by} included it again on {reversal.at[:10]} "
                    f"({reversal.reason})."
                )


_SHOWN: Final = 20
"""The most exclusions, doubts and sessions that the page lists; report.json lists all of them."""


def conduct(study: Study, results: Results) -> Iterator[str]:
    """Yield the section on sessions and on the conduct of the study."""
    yield heading(2, "How the study was run")
    states = Counter(map(str, study.participants["status"]))
    yield paragraph(
        f"{counted(len(study.participants), 'session').capitalize()}: "
        f"{listed([f'{count} {status}' for status, count in states.most_common()])}. The analysis includes "
        f"{counted(study.n, 'participant')}."
    )
    if study.sites:
        people_by_site = Counter(map(study.site_of, study.people))
        people = listed([f"{site} ({counted(people_by_site[site], 'participant')})" for site in study.sites])
        yield paragraph(f"The results from these sites are merged: {people}.")
    if study.withdrawn:
        people = counted(len(study.withdrawn), "participant").capitalize()
        yield paragraph(f"{people} withdrew; their data were erased.")
        yield bullets(
            [f"{tombstone.at[:10]}, recorded by {tombstone.by}: {tombstone.reason}" for tombstone in study.withdrawn]
        )
    if languages := language_text(study):
        yield paragraph(f"Languages of the participants' texts: {languages}.")
    masking = Counter(map(str, study.participants["motors_masked"].dropna()))
    if masking:
        answers = [f"{means} in {counted(count, 'session')}" for means, count in masking.most_common()]
        yield paragraph(f"Motors masked: {listed(answers)}.")
    yield heading(3, "Exclusions")
    exclusions = [
        f"{describe_exclusion(exclusion)}: {exclusion.reason} ("
        f"{'rule ' if exclusion.rule_or_person in AUTOMATIC_RULES else ''}{exclusion.rule_or_person}, "
        f"{exclusion.excluded_at}"
        f"{', after the key was opened' if exclusion in study.late else ''})"
        for exclusion in study.exclusions
    ]
    if study.left_out:
        verb = "was" if study.left_out == 1 else "were"
        exclusions.append(f"{counted(study.left_out, 'session')} {verb} not completed and therefore not analysed")
    if study.damaged_sessions:
        verb, receipts = ("is", "its receipt is") if study.damaged_sessions == 1 else ("are", "their receipts are")
        sessions = counted(study.damaged_sessions, "session")
        exclusions.append(f"{sessions} {verb} not included because {receipts} missing or damaged")
    yield bullets(_first_lines(exclusions)) if exclusions else paragraph("There are no exclusions.")
    if rules := rule_sentences(study, results):
        yield bullets(rules)
    if reversals := [*_reversed_exclusion_sentences(study)]:
        yield heading(3, "Exclusions that were reversed")
        yield bullets(_first_lines(reversals))
    yield from _missing_trials_part(study)
    if study.doubts:
        yield heading(3, "Files that have changed since recording")
        yield bullets(
            _first_lines([f"{doubt.path.relative_to(study.folder).as_posix()} {doubt.what}" for doubt in study.doubts])
        )
    yield from _delivered_delays_part(study, results)
    yield from _trial_orders_part(results)
    yield from _block_orders_part(results)


def groups(study: Study, results: Results, by: By = "group") -> Iterator[str]:
    """Yield the section on groups or sites: their sizes, and the answers in each block; nothing without any."""
    counts = group_counts(study, by)
    if not counts:
        return
    yield heading(2, f"{by.capitalize()}s")
    yield table((by.capitalize(), "participants"), [[group, str(count)] for group, count in counts.items()])
    yield from background_table(study, list(counts), by)
    means = group_means(study, by)
    for result in results.blocks:
        if rows := [mean for mean in means if mean.block == result.id]:
            yield heading(3, result.title)
            yield _group_means_table(result, rows, by)
    if not results.blocks:
        return
    compared = by == "group" and any(contrast.contrast.groups for contrast in results.contrasts)
    tests_note = (
        f"Differences between {by}s are tested only if a hypothesis states them."
        if compared
        else (f"Differences between {by}s are not tested.")
    )
    preexisting = by == "group" and group_assignment(study) == "pre-existing"
    yield paragraph(
        "The table shows the mean and standard deviation, across participants, of each participant's mean answer. "
        f"{tests_note}{' The groups were not randomised, so a difference may have other causes.' * preexisting}",
        "soft",
    )


def _group_means_table(result: BlockResult, rows: Sequence[Any], by: By) -> str:
    return table_of(
        rows,
        ("Statement", lambda row: short_text(result, row.item)),
        (settings_noun(result).capitalize(), lambda row: name(result, row.code)),
        (by.capitalize(), lambda row: row.group),
        ("n", lambda row: str(row.n)),
        ("mean", lambda row: number(row.mean, 2)),
        ("SD", lambda row: number(number_or_none(row.sd), 2)),
        words=3,
    )


class _MissingTrialsRow(NamedTuple):
    """The missing trials of a session, and whether the session is included."""

    session: str
    counted: bool
    missing: MissingTrials


def _missing_trials_part(study: Study) -> Iterator[str]:
    """Yield a table of the missing interval trials of each session, with reasons; nothing without blocks of levels."""
    if not study.levels:
        return
    yield heading(3, "Trials that were not delivered")
    sessions: Iterable[Any] = study.participants.itertuples()
    rows = [
        _MissingTrialsRow(f"{row.participant}, session {row.session}", bool(row.counted), row.missing)
        for row in sessions
        if row.missing is not None and row.missing.count
    ]
    if rows:
        yield table_of(
            rows[:_SHOWN],
            ("Session", lambda lost_trials: lost_trials.session),
            ("missing", lambda lost_trials: f"{lost_trials.missing.count} of {lost_trials.missing.asked}"),
            (
                "of which",
                lambda lost_trials: listed(
                    [f"{_setting_text(study, *track)}: {n}" for track, n in lost_trials.missing.tracks.items()]
                ),
            ),
            ("reason", lambda lost_trials: listed(lost_trials.missing.reason_texts)),
            ("session", lambda lost_trials: "included" if lost_trials.counted else "not included"),
            words=5,
        )
    else:
        yield paragraph("All trials were presented as planned.")
    if len(rows) > _SHOWN:
        yield paragraph(f"report.json lists {counted(len(rows) - _SHOWN, 'more session')}.")
    permitted = study.protocol.get("limits", {}).get(MISSING_PERCENT)
    if permitted is not None:
        yield paragraph(
            f"The study permits up to {permitted:g} % of a session's trials to be missing. A session with more missing "
            "trials counts as incomplete and is excluded, unless it has been included again.",
            "soft",
        )


def _setting_text(study: Study, block: str, code: str) -> str:
    """Return the name of a setting of a block of levels, or its code while the key is sealed."""
    titles = {level.id: level.title for level in study.levels}
    setting = study.settings.get((block, code))
    return f"{titles.get(block, block)}, {code if setting is None or setting.condition is None else setting.condition}"


def _first_lines(lines: list[str]) -> list[str]:
    more = len(lines) - _SHOWN
    return [*lines[:_SHOWN], *([f"and {more} more, listed in report.json"] if more > 0 else [])]


def _delivered_delays_part(study: Study, results: Results) -> Iterator[str]:
    if not results.delivered:
        return
    yield heading(3, "Were the delays presented as specified?")
    blocks = {result.id: result for result in results.trial_blocks}

    def shown(cell: Callable[[Delivered], str]) -> Callable[[Delivered], str]:
        return cell if study.revealed else lambda _delivered: "sealed"

    def trials(delivered: Delivered) -> str:
        whole = delivered.measured == delivered.trials or not study.revealed
        return str(delivered.trials) if whole else f"{delivered.trials}, {delivered.measured} measured"

    yield table_of(
        results.delivered,
        ("Block", lambda delivered: blocks[delivered.block].title),
        (
            "Condition",
            lambda delivered: "all" if delivered.code is None else name(blocks[delivered.block], delivered.code),
        ),
        ("requested", shown(lambda delivered: "–" if delivered.delay_ms is None else ms(delivered.delay_ms))),
        (
            "achieved",
            shown(lambda delivered: "–" if delivered.achieved_ms is None else f"{number(delivered.achieved_ms, 1)} ms"),
        ),
        ("mean error", shown(lambda delivered: _signed_ms(delivered.error_mean_ms))),
        ("worst trial", shown(lambda delivered: _signed_ms(delivered.error_worst_ms))),
        ("trials", trials),
        ("within limits", within_limits_text),
        words=2,
    )
    limits = study.protocol.get("limits", {})
    yield paragraph(
        "Delay error is the age of the drawn position minus the requested delay. The table shows the mean across "
        "trials and the trial with the largest mean error. Times are from the program's clock and do not include "
        "display latency. "
        + (f"Limits: {'; '.join(_limit_text(what, limit) for what, limit in limits.items())}. " if limits else "")
        + f"{_violated_limits_sentence(study, limits)}Trials that exceed a limit are included, unless they are "
        "excluded above."
        + (
            ""
            if study.revealed
            else " Until unblinding, the delay error and the proportion of force held back are sealed and cannot be "
            "checked."
        ),
        "soft",
    )


def _violated_limits_sentence(study: Study, limits: Mapping[str, float]) -> str:
    """Return a sentence on the limits that trials violated; "" if there are none."""
    rows = study.trials[study.trials["counted"] & (study.trials["phase"] == "main")]
    broken = [
        broken_limits({str(name): value for name, value in row.items() if pd.notna(value)}, limits)
        for row in rows.to_dict("records")
    ]
    if not any(broken):
        return ""
    counts = Counter(limit for limits_of_trial in broken for limit in limits_of_trial)
    limit_counts = "; ".join(
        f"{_limit_text(limit, limits[limit])} ({counted(count, 'trial')})" for limit, count in counts.items()
    )
    return f"{sum(map(bool, broken))} of {len(rows)} trials exceeded a limit: {limit_counts}. "


def _limit_text(name: str, limit: float) -> str:
    """Return a limit as text: "time between two ticks at most 20 ms"."""
    words, _, unit = name.rpartition("_")
    bound, _, quantity = limit_label(name).partition(" ")
    value = f"at {'least' if bound == 'minimum' else 'most'} {limit:g}"
    value += {"percent": " %", "ms": " ms"}.get(unit, "" if quantity else f" {unit}")
    return f"{quantity or words.replace('_', ' ')} {value}".lstrip()


def _signed_ms(value: float | None) -> str:
    return "–" if value is None else f"{'+' if value > 0 else ''}{number(value, 1)} ms"


def _trial_orders_part(results: Results) -> Iterator[str]:
    blocks = [
        (result, counts) for result in results.trial_blocks if (counts := results.orders.get(result.id)) is not None
    ]
    blocks = [(result, counts) for result, counts in blocks if counts.orders and len(counts.codes) >= 2]
    if not blocks:
        return
    yield heading(3, "Trial orders")
    for result, counts in blocks:
        names = [name(result, code) if result.revealed else code for code in counts.codes]
        yield paragraph(f"{result.title} ({counted(counts.orders, 'order')}): {_evenness_sentence(counts)}")
        lines = enumerate(counts.positions, start=1)
        yield table(("Position", *names), [[str(place), *map(str, line)] for place, line in lines])
    yield paragraph("The tables show how often each condition occurred in each position of its block.", "soft")


def _block_orders_part(results: Results) -> Iterator[str]:
    counts = results.block_orders
    if counts is None:
        return
    titles = {result.id: result.title for result in results.trial_blocks}
    titles |= {level.block: level.title for level in results.levels}
    yield heading(3, "Block orders")
    yield paragraph(f"{counted(counts.orders, 'order').capitalize()}: {_evenness_sentence(counts, 'block')}")
    lines = enumerate(counts.positions, start=1)
    yield table(
        ("Position", *(titles[block] for block in counts.codes)),
        [[str(place), *map(str, line)] for place, line in lines],
    )


def _evenness_sentence(counts: Evenness, noun: str = "condition") -> str:
    cells, after = [count for line in counts.positions for count in line], counts.after_another
    places = f"positions were not balanced; each {noun} occurred {min(cells)} to {max(cells)} times in each position"
    if counts.positions_even:
        places = f"each {noun} occurred {counted(cells[0], 'time')} in each position"
    times = "equally often" if counts.follows_even else f"{min(after)} to {max(after)} times"
    return f"{places} and followed every other {noun} {times}."
