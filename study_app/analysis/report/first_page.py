"""The first page of the report: an answer to each question of a study, in order, next to its figure."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np
from markupsafe import Markup

from study_app import number_text
from study_app.analysis.contrasts import RATIOS, answer, mean_text, question
from study_app.analysis.data.blocks import AFTER, AT_THE_START, Block, LevelBlock, Setting, name_in_sentence
from study_app.analysis.data.measures import AGREEMENT
from study_app.analysis.data.study_tables import Study
from study_app.analysis.figures.people_figures import Mean, mean_of, panel_rows
from study_app.analysis.figures.summary_figures import MOST_PANELS, Numbers, estimates_of, place_of
from study_app.analysis.findings import all_findings
from study_app.analysis.html_page import picture, render
from study_app.analysis.page_layout import Picture
from study_app.analysis.report.sections import answers, false_claims_sentence, no_findings_sentence, place_title
from study_app.analysis.results import (
    BADGES,
    BlockResult,
    ContrastResult,
    LevelsResult,
    QuestionResult,
    Results,
    lead_phrase,
)
from study_app.analysis.statistics.outcome import clopper_pearson
from study_app.analysis.wording import interval, listed, ms, number, significant
from study_app.number_text import capitalised
from study_app.protocol.quantities import quoted_title

_BREAKS: Final = re.compile(r"\[[^\]]*\]| %|\b[np] [=<>] |\b(?:d_z|g) (?=[−\d])")
"""Spaces at which a line must not break: in intervals, before percent signs, in "n = 12" and "p < .001"."""
_IN_PARENTHESES: Final = re.compile(r" \(([^()]*)\)\.$")
"""The end of a limitation, with the participants to whom it applies in parentheses."""


class Presented(NamedTuple):
    """The stimuli of a block: a sentence, and the liquids, delays and displays by condition ("": all conditions)."""

    sentence: str
    of: Mapping[str, tuple[str, ...]] = MappingProxyType({})


_NO_NUMBERS: Final[Mapping[str, Sequence[Numbers]]] = MappingProxyType({})
_NOT_PRESENTED: Final[Mapping[str, Presented]] = MappingProxyType({})


@dataclass(frozen=True, slots=True, kw_only=True)
class Card:
    """An answer on the first page: its question, verdict and sentences, and the names of possible figures.

    The card shows the first of its ``figures`` that was drawn; ``block`` is their block. Two small cards are placed
    side by side.
    """

    question: str
    verdict: str
    sentences: tuple[str, ...]
    block: str
    figures: tuple[str, ...]
    is_small: bool = False

    @property
    def badge(self) -> str:
        """The text of the badge that shows the verdict."""
        return BADGES.get(self.verdict, self.verdict)

    def figure_of(self, drawn: Sequence[Picture]) -> Picture | None:
        """Return the figure that shows the answer; None if there is none."""
        for name in self.figures:
            for figure in drawn:
                if figure.name == name or (figure.block == self.block and figure.name.partition("-")[0] == name):
                    return figure
        return None


def presented_in(study: Study) -> dict[str, Presented]:
    """Return the stimuli of each block by its ID; blocks with a sealed key are omitted."""
    presented: dict[str, Presented] = {}
    blocks: list[Block | LevelBlock] = [*study.trial_blocks, *study.levels]
    for block in blocks:
        stimulus, reference = (block.stimulus, block.reference) if isinstance(block, LevelBlock) else (None, None)
        conditions = [setting.of or setting for setting in (*block.settings, reference) if setting is not None]
        liquids, delays, displays = _liquid_names(conditions), _delays_ms(conditions), _display_names(conditions)
        if not liquids:
            continue
        delay = f"visual delays of {listed([f'{delay_ms:g}' for delay_ms in delays])} ms"
        if len(delays) < 2:
            delay = "a varied visual delay" if not delays else f"a visual delay of {ms(delays[0])}"
        details = []
        if stimulus is not None and delays:
            details.append(f"varied {stimulus.quantity}{_standards_phrase(block)}")
        details.append("no visual delay" if delays == [0.0] else delay)
        design = f" ({block.design.paper_name}{_trials_phrase(study, block)})" if isinstance(block, LevelBlock) else ""
        by_condition: dict[str, list[Setting]] = {"": [*conditions]}
        for condition in conditions:
            by_condition.setdefault(condition.condition or "", []).append(condition)
        presented[block.id] = Presented(
            f"In the block “{block.title}”{design}, the liquid{'s were' if len(liquids) > 1 else ' was'} "
            f"{listed(liquids)}{f', with {listed(details)}' if details else ''}"
            f"{''.join(f', {words}' for words in displays)}.",
            {name: _stimulus_phrases(of) for name, of in by_condition.items()},
        )
    return presented


def _trials_phrase(study: Study, block: LevelBlock) -> str:
    """Return a phrase on the trials of each participant in a block without the modulus, with a leading comma, or ""."""
    counted = study.trials[study.trials["counted"] & (study.trials["block"] == block.id)]
    if block.design.first is not None:
        counted = counted[counted["index"] > 1]
    trials = counted.groupby("participant").size()
    if trials.empty:
        return ""
    minimum, maximum = int(trials.min()), int(trials.max())
    trials_text = number_text.counted(maximum, "trial") if minimum == maximum else f"{minimum} to {maximum} trials"
    return f", {trials_text} per participant"


def _liquid_names(conditions: Sequence[Setting]) -> list[str]:
    return [
        f"“{liquid.replace('_', ' ')}”"
        for liquid in dict.fromkeys(condition.liquid for condition in conditions)
        if liquid
    ]


def _delays_ms(conditions: Sequence[Setting]) -> list[float]:
    return sorted({condition.delay_ms for condition in conditions if condition.delay_ms is not None})


def _display_names(conditions: Sequence[Setting]) -> list[str]:
    return list(dict.fromkeys(words for condition in conditions for words in (condition.link, condition.view) if words))


def _stimulus_phrases(conditions: Sequence[Setting]) -> tuple[str, ...]:
    """Return the liquids, delays and displays of conditions as phrases; "" for each that they do not have."""
    delays = [f"{delay_ms:g}" for delay_ms in _delays_ms(conditions)]
    delay = f"{listed(delays)} ms of visual delay" if delays != ["0"] else "no visual delay"
    return listed(_liquid_names(conditions)), delay if delays else "", listed(_display_names(conditions))


def _distinguish_names(names: Sequence[str], presented: Sequence[tuple[str, ...]]) -> list[str]:
    """Return additions in parentheses that distinguish names by liquids, delays and displays.

    Properties that all names share, or that a name already states, are omitted. Each addition has a leading space; it
    is "" if nothing is to be added.
    """
    differing = [len({*parts}) > 1 for parts in zip(*presented, strict=False)]
    additions = []
    for name, properties in zip(names, presented, strict=True):
        parts = [
            part
            for part, differs in zip(properties, differing, strict=False)
            if differs and part and not _is_stated(part, name)
        ]
        additions.append(f" ({', '.join(parts)})" if parts else "")
    return additions


def _is_stated(part: str, name: str) -> bool:
    """Return whether a name states a liquid or delay: "60 ms late" states "60 ms of visual delay"."""
    if part == "no visual delay":
        pattern = r"\b(no|without|zero)\b.*\b(delay|latency|lag)\b|(?<![\d.])0 ms\b"
    else:
        pattern = rf"(?<![\w.]){re.escape(part.removesuffix(' of visual delay').strip('“”'))}\b"
    return re.search(pattern, name, re.IGNORECASE) is not None


def _standards_phrase(block: Block | LevelBlock) -> str:
    """Return a phrase on the standards of a block of levels, with a leading space; "" if it has none."""
    if not isinstance(block, LevelBlock) or block.stimulus is None:
        return ""
    standards = sorted({float(setting.standard) for setting in block.settings if setting.standard is not None})
    values = listed([f"{standard:g}" for standard in standards])
    unit = block.stimulus.unit
    return f" (standard{'s' * (len(standards) > 1)}: {values} {unit})" if standards else ""


def cards(
    results: Results,
    numbers: Mapping[str, Sequence[Numbers]] = _NO_NUMBERS,
    presented: Mapping[str, Presented] = _NOT_PRESENTED,
) -> tuple[Card, ...]:
    """Return the answers of a study, beginning with its hypotheses.

    ``numbers`` is the result of `numbers_of`, ``presented`` that of `presented_in`.
    """
    return (
        *_hypothesis_cards(results, presented),
        *_statement_cards(results, presented),
        *_level_cards(results, presented),
        *_question_cards(results, numbers, presented),
    )


def _hypothesis_cards(results: Results, presented: Mapping[str, Presented]) -> Iterator[Card]:
    introduced: set[str] = set()
    for place, contrast in enumerate(results.contrasts, start=1):
        blocks = contrast.contrast.blocks
        introductions = [
            presented[block].sentence for block in blocks if block in presented and block not in introduced
        ]
        introduced.update(blocks)
        lead = f"Hypothesis{f' {place}' if len(results.contrasts) > 1 else ''}"
        yield Card(
            question=f"{lead}: {_question_text(contrast, presented)}",
            verdict=contrast.verdict,
            sentences=(
                f"{answer(contrast)}{_scale_text(contrast, results)}",
                *_cell_sentences(contrast),
                *filter(None, [" ".join(introductions)]),
            ),
            block=blocks[0],
            figures=(f"hypothesis-{place}",),
        )


def _question_text(contrast: ContrastResult, presented: Mapping[str, Presented]) -> str:
    """Return the hypothesis, with the liquids and delays that distinguish the compared conditions."""
    hypothesis = contrast.contrast
    names = (contrast.within_names or hypothesis.within or ("", "")) if hypothesis.is_interaction else contrast.compared
    if hypothesis.within is None:
        return question(contrast)
    blocks = hypothesis.blocks if len(hypothesis.blocks) == 2 else hypothesis.blocks * 2
    by_condition = [presented[block].of if block in presented else {} for block in blocks]
    sides = [
        by_name.get(name, ()) for by_name, name in zip(by_condition, hypothesis.conditions or ("", ""), strict=True)
    ]
    additions = _distinguish_names(names, sides)
    first, second = (f"{quoted_title(name)}{words}" for name, words in zip(names, additions, strict=True))
    if hypothesis.is_interaction:
        return question(replace(contrast, within_names=(first, second)))
    return question(replace(contrast, compared=(first, second)))


def _scale_text(contrast: ContrastResult, results: Results) -> str:
    """Return a sentence on the unit or scale of the compared values, with a leading space; "" if there is none."""
    hypothesis = contrast.contrast
    levels = [level for level in results.levels if level.block in hypothesis.blocks]
    level = levels[0] if levels else None
    if level is not None and hypothesis.measure in RATIOS:
        if level.level_kind == "weber":
            criteria = {(level.guess_rate, level.counts) for level in levels}
            rate = level.guess_rate if len(criteria) == 1 else None
            at = "" if rate is None else f" at {50 * (1 + rate):.3g} % {level.counts}"
            meaning = f"{at}; lower values mean better discrimination" if hypothesis.measure == "threshold" else ""
            return f" Values are Weber fractions{meaning}."
        return f" Values are in {level.unit}." if level.unit else ""
    if level is not None and hypothesis.measure == "d_prime":
        return " At chance, d′ is 0."
    return (
        ""
        if contrast.scale is None
        else " The scale ranges from {:g} to {:g}.".format(*contrast.scale).replace("-", "−")
    )


def _cell_sentences(contrast: ContrastResult) -> Iterator[str]:
    """Yield a sentence for each group with its means in the conditions of an interaction."""
    for place, group in enumerate(contrast.compared):
        cells = contrast.cells[2 * place : 2 * place + 2]
        means = [f"{mean_text(cell)} in {quoted_title(cell.name)}" for cell in cells if cell.mean is not None]
        if means:
            yield f"Mean{'s' * (len(means) > 1)} in the group {group} (95 % intervals): {listed(means)}."


def _statement_cards(results: Results, presented: Mapping[str, Presented]) -> Iterator[Card]:
    introduced = {block for contrast in results.contrasts for block in contrast.contrast.blocks}
    findings = {finding.key: finding for finding in all_findings() if finding.question}
    kinds = {block.id: block.kind for block in results.blocks}
    for finding_answer in answers(results):
        finding = findings[finding_answer.question]
        introductions = (
            [presented[finding_answer.block].sentence]
            if finding_answer.block in presented and finding_answer.block not in introduced
            else []
        )
        yield Card(
            question=f"{finding_answer.title}: {finding.question.format(kind=kinds[finding_answer.block])}",
            verdict=finding_answer.verdict,
            sentences=(finding_answer.text, *introductions),
            block=finding_answer.block,
            figures=finding.answer_figures,
        )
        introduced.add(finding_answer.block)
    for result in results.blocks:
        if result.n and len(result.names) == 1:
            yield Card(
                question=f"{result.title}: statements",
                verdict="",
                sentences=tuple(_agreement_sentences(result)),
                block=result.id,
                figures=(result.kind,),
            )


def _agreement_sentences(result: BlockResult) -> Iterator[str]:
    """Yield a sentence on agreement with each statement of a block with a single setting."""
    once = result.presentations == (1, 1)
    for item, row in zip(result.items, result.measures, strict=True):
        n, agreed = int(row["n"]), sum(int(row[f"count_{level}"]) for level in AGREEMENT)
        if not n:
            continue
        proportion = clopper_pearson(agreed, n)
        ends = f", 95 % confidence interval [{100 * proportion.low:.0f}, {100 * proportion.high:.0f}] %" if once else ""
        who = "participants agreed" if once else "answers expressed agreement"
        yield f"{agreed} of {n} {who} with “{item.short}” ({100 * agreed / n:.0f} %{ends}; median {row['median']:g})."


def _level_cards(results: Results, presented: Mapping[str, Presented]) -> Iterator[Card]:
    """Yield cards of estimates that no hypothesis shows, and one card for all sealed blocks of levels."""
    if sealed := [level for level in results.levels if not level.revealed]:
        yield Card(
            question=listed([level.title for level in sealed]),
            verdict="sealed",
            sentences=("The standards, levels and correct answers are shown after unblinding.",),
            block=sealed[0].block,
            figures=(),
        )
    shown = {(block, contrast.contrast.measure) for contrast in results.contrasts for block in contrast.contrast.blocks}
    for level in results.levels:
        estimates = estimates_of(level) if level.revealed else None
        if estimates is not None and (level.block, estimates.attribute) not in shown:
            yield Card(
                question=f"{level.title}: {estimates.words}",
                verdict="",
                sentences=(
                    *_estimate_sentences(level, estimates.group, estimates.attribute, estimates.words),
                    *([presented[level.block].sentence] if level.block in presented else ()),
                ),
                block=level.block,
                figures=(f"estimates-{level.block}",),
            )


def _estimate_sentences(result: LevelsResult, group: Sequence[Any], attribute: str, words: str) -> Iterator[str]:
    """Yield a sentence on the group mean for each standard or comparison, with its interval."""
    of_level, is_weber = attribute in ("threshold", "pse"), result.level_kind == "weber"
    before = "a Weber fraction of " if of_level and is_weber else ""
    after = f" {result.unit}" if of_level and not is_weber and result.unit else ""
    for estimate in group:
        place = place_of(estimate)
        place_phrase = "" if place is None or len(group) == 1 else f" for {str(place).replace('_', ' ')}"
        if isinstance(place, float) and len(group) > 1:
            unit = "" if result.level_kind == "weber" and attribute == "value" else result.unit or ""
            place_phrase = f" at {place:g} {unit}".rstrip()
        ends = (
            "no interval"
            if None in (estimate.low, estimate.high)
            else f"95 % interval {_interval_text(estimate.low, estimate.high)}"
        )
        people = f"n = {getattr(estimate, 'participants', estimate.n)}"
        value = f"{before}{significant(getattr(estimate, attribute))}{after}"
        yield f"The mean {words}{place_phrase} was {value} ({ends}, {people})."


def _interval_text(low: float, high: float) -> str:
    return f"[{significant(low)}, {significant(high)}]"


def _question_cards(
    results: Results, numbers_at: Mapping[str, Sequence[Numbers]], presented: Mapping[str, Presented]
) -> Iterator[Card]:
    """Yield cards of questions other than statements, by place; scores replace their questions.

    Values that a hypothesis already shows are omitted.
    """
    levels, scores = {level.block for level in results.levels}, {score.where for score in results.scores}
    placed = [result for result in results.questions if result.where not in levels]
    ordered = sorted(placed, key=lambda result: result.is_form + (result.is_form and result.where not in scores))
    for where in dict.fromkeys(result.where for result in ordered):
        answered = [result for result in results.questions if result.where == where and result.n]
        numbers = [entry for entry in numbers_at.get(where, ()) if not _is_in_hypotheses(entry, where, results)]
        if not answered:
            continue
        sentences = [
            _number_text(entry, presented if place == 0 else _NOT_PRESENTED)
            for place, entry in enumerate(numbers[:MOST_PANELS])
        ]
        chosen = [result for result in answered if result.measure == "counts" and not result.weighs]
        sentences += [_choice_text(result) for result in chosen]
        if sentences:
            yield Card(
                question=place_title(answered[0], results),
                verdict="",
                sentences=tuple(sentences),
                block=where,
                figures=(
                    *([f"answers-{where}"] if numbers else ()),
                    *(f"question-{where}-{result.item}" for result in chosen),
                ),
                is_small=answered[0].is_form or all(len(entry.by_setting) < 2 for entry in numbers),
            )


def _is_in_hypotheses(numbers: Numbers, where: str, results: Results) -> bool:
    """Return whether hypotheses show the values of a form after all blocks, or in all conditions, of all people."""
    shown = [
        contrast
        for contrast in results.contrasts
        if contrast.contrast.measure == numbers.id
        and where in ((contrast.contrast.form,) if contrast.contrast.form else contrast.contrast.blocks)
        and any(side.values for side in contrast.sides)
    ]
    settings = {name for contrast in shown for name in contrast.contrast.conditions or contrast.contrast.blocks}
    people = {
        person
        for contrast in shown
        for person in (*contrast.left_out, *(person for side in contrast.sides for person in side.values))
    }
    participants = {person for _, values in numbers.by_setting for person in values}
    has_all_settings = settings >= {*numbers.conditions} or (where in settings and len(numbers.conditions) == 1)
    return bool(shown) and has_all_settings and people >= participants


def _number_text(numbers: Numbers, presented: Mapping[str, Presented] = _NOT_PRESENTED) -> str:
    """Return sentences on the means of a score or question by setting, and on the difference of two settings.

    A number that is entered only once describes the sample, so the sentence has its SD and range, not an interval.
    """
    subject = f"The mean {numbers.title} score" if numbers.is_score else f"The mean of “{numbers.title}”"
    blocks = [presented[code].of[""] if code in presented else () for code in numbers.codes]
    additions = (
        _distinguish_names([name for name, _ in numbers.by_setting], blocks)
        if blocks
        else [""] * len(numbers.by_setting)
    )
    means = [
        (f" {_setting_text(name)}{addition}" if name else "", mean, len(values))
        for (name, values), addition in zip(numbers.by_setting, additions, strict=True)
        if (mean := mean_of(values.values()))
    ]
    unit = f" {numbers.unit}" if numbers.unit else ""
    parts = [f"{number(mean.value)}{_mean_ends(mean)}{unit}{where}" for where, mean, _ in means]
    n = max(count for *_, count in means)
    if numbers.bounds is None and not numbers.is_score and len(means) == 1:
        values = [*next(by_person for _, by_person in numbers.by_setting if by_person).values()]
        spread = f"SD {number(float(np.std(values, ddof=1)))}, " if n > 1 else ""
        low, high = (f"{end:g}" if float(end).is_integer() else number(end) for end in (min(values), max(values)))
        return f"{subject} was {number(means[0][1].value)}{unit} ({spread}range {low} to {high}, n = {n})."
    scale = "" if numbers.bounds is None else " on a scale from {:g} to {:g}".format(*numbers.bounds).replace("-", "−")
    details = f"95 % confidence interval{'s' * (len(parts) > 1)}, n = {n}"
    if all(mean.low is None for _, mean, _ in means):
        details = f"n = {n}{'; no confidence interval because all values are equal' * (n > 1)}"
    text = f"{subject} was {listed(parts)}{scale} ({details})."
    if len(means) != 2:
        return text
    (first, first_values), (second, second_values) = numbers.by_setting
    difference = mean_of(
        np.array([value - second_values[person] for person, value in first_values.items() if person in second_values])
    )
    if difference is None or difference.low is None:
        return text
    pair = " − ".join(_setting_text(name).removeprefix("for ") for name in (first, second))
    return f"{text} The mean difference ({pair}) was {number(difference.value)}{_mean_ends(difference)}{unit}."


def _setting_text(name: str) -> str:
    """Return the name of a setting in a sentence: "for water", or "after “80 ms late”" for a form after a block."""
    if name.startswith(AT_THE_START):
        return name_in_sentence(name)
    block, comma, session = name.removeprefix(AFTER).rpartition(", session ")
    block, where = (block, f" in session {session}") if comma else (session, "")
    return f"{AFTER.lower()}{quoted_title(block)}{where}" if name.startswith(AFTER) else f"for {name_in_sentence(name)}"


def _mean_ends(mean: Mean) -> str:
    return "" if mean.low is None or mean.high is None else f" {interval(_Ends(mean.low, mean.high))}"


@dataclass(frozen=True, slots=True)
class _Ends:
    low: float
    high: float


def _choice_text(result: QuestionResult) -> str:
    """Return a sentence on the most frequent options and how often they were chosen.

    There is an interval only if each participant answered once, since the answers of one person are not independent.
    """
    parts = []
    for group in result.groups:
        n, people, counts = int(group.numbers["n"]), int(group.numbers["participants"]), group.numbers["counts"]
        if not n:
            continue
        most = int(max(counts.values()))
        first, *tied = [f"“{result.options.get(option, option)}”" for option, count in counts.items() if count == most]
        setting = f"{_setting_text(group.name)}, " if len(result.groups) > 1 else ""
        if n > people:
            given = f"{most} of {n} answers by {number_text.counted(people, 'participant')}"
            chosen = f"{listed([first, *tied])} were each chosen in {given}" if tied else f"{given} were {first}"
            parts.append(f"{setting}{chosen} ({100 * most / n:.0f} %)")
            continue
        tied_note = f", and as many chose {listed(tied)}" if tied else ""
        proportion = clopper_pearson(most, n)
        ends = f"[{100 * proportion.low:.0f}, {100 * proportion.high:.0f}] %"
        parts.append(
            f"{setting}{most} of {n} participants chose {first}{tied_note} ({100 * most / n:.0f} %, 95 % "
            f"confidence interval {ends})"
        )
    return f"“{result.short}”: {'; '.join(parts)}."


def first_page(
    results: Results,
    limits: Sequence[str],
    numbers: Mapping[str, Sequence[Numbers]] = _NO_NUMBERS,
    drawn: Sequence[Picture] = (),
    presented: Mapping[str, Presented] = _NOT_PRESENTED,
) -> Markup:
    """Return the HTML of the first page: answers next to their figures, limitations, and the rate of false claims."""
    answer_cards = cards(results, numbers, presented)
    cards_with_figures = [(card, card.figure_of(drawn)) for card in answer_cards]
    kinds = {block.kind for block in results.blocks if block.n}
    has_claims = kinds >= {"liquids", "delays"} and bool(answers(results))
    look = results.decided.look_text(len(results.people))
    return render(
        "first_page.html",
        cards=[
            {
                "question": card.question,
                "verdict": card.badge,
                "state": card.verdict.replace(" ", "-"),
                "small": is_small,
                "sentences": [_with_fixed_spaces(line) for line in card.sentences],
                "figure": "" if figure is None else picture(figure, beside=True),
                "caption": "" if figure is None else figure.caption,
            }
            for (card, figure), is_small in zip(cards_with_figures, _find_paired_cards(answer_cards), strict=True)
        ],
        sentences=[*filter(None, [look]), *(() if answer_cards else (no_findings_sentence(results),))],
        limits=_limits_by_subject(limits, results),
        empty=false_claims_sentence(max(block.n for block in results.blocks))
        if has_claims and not results.decided.looks
        else "",
    )


def _with_fixed_spaces(sentence: str) -> str:
    return _BREAKS.sub(lambda match: match[0].replace(" ", "\u00a0"), sentence)


def _find_paired_cards(answer_cards: Sequence[Card]) -> list[bool]:
    """Return whether each card is in a pair side by side: small consecutive cards with figures of the same height."""
    paired: list[bool] = []
    for place, card in enumerate(answer_cards):
        if len(paired) == place:
            is_pair = card.is_small and any(
                after.is_small and panel_rows(len(after.sentences)) == panel_rows(len(card.sentences))
                for after in answer_cards[place + 1 : place + 2]
            )
            paired += [True, True] if is_pair else [False]
    return paired


def _limits_by_subject(limits: Sequence[str], results: Results) -> list[tuple[str, list[str]]]:
    """Return subjects with their limitations: hypotheses, blocks, or "" for the study.

    A limitation that applies to several subjects is listed once, with all of them as its subject.
    """
    blocks = [words for block in results.blocks for words in (lead_phrase(block), block.title)]
    hypotheses = [f"Hypothesis {place}" for place, _ in enumerate(results.contrasts, start=1)]
    subjects = [*blocks, *(level.title for level in results.levels), "Hypothesis", *hypotheses]
    by_text: dict[str, list[tuple[str, str]]] = {}
    for line in limits:
        subject = max((subject for subject in subjects if line.startswith(f"{subject}: ")), key=len, default="")
        words = line.removeprefix(f"{subject}: ") if subject else line
        some = _IN_PARENTHESES.search(words) if subject else None
        by_text.setdefault(words[: some.start()] if some else words, []).append((subject, some[1] if some else ""))
    by_subject: dict[str, list[str]] = {}
    for words, uses in by_text.items():
        is_same = len({some for _, some in uses}) == 1
        participants = [uses[0][1]] if is_same else [f"{subject}: {some}" for subject, some in uses]
        some_words = f" ({'; '.join(participants)})." if uses[0][1] else ""
        subject = listed(list(dict.fromkeys(subject for subject, _ in uses)))
        by_subject.setdefault(subject, []).append(f"{capitalised(words)}{some_words}")
    of_study = [("", [line]) for line in by_subject.pop("", [])]
    return [*of_study, *by_subject.items()]


def figures_shown(answer_cards: Sequence[Card], drawn: Sequence[Picture]) -> set[str]:
    """Return the names of the figures on the first page, which later sections omit."""
    figures = (card.figure_of(drawn) for card in answer_cards)
    return {figure.name for figure in figures if figure is not None}
