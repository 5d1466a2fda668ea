"""The first page: an answer to each question of a study, in order, beside the figure that shows it."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np
from markupsafe import Markup

from study_app import number_text
from study_app.analysis.contrasts import RATIOS, answer, mean_words, question
from study_app.analysis.data.blocks import AFTER, Block, LevelBlock, Setting, name_in_sentence
from study_app.analysis.data.measures import AGREEMENT
from study_app.analysis.data.study_tables import Study
from study_app.analysis.figures.people_figures import Mean, mean_of, panel_rows
from study_app.analysis.figures.summary_figures import MOST_PANELS, Numbers, estimates_of, place_of
from study_app.analysis.findings import all_findings
from study_app.analysis.html_page import picture, render
from study_app.analysis.page_layout import Picture
from study_app.analysis.report.sections import answers, empty_studies, none_found, place_title
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
from study_app.protocol.model import quoted_title

_BREAKS: Final = re.compile(r"\[[^\]]*\]| %|\b[np] [=<>] |\b(?:d_z|g) (?=[−\d])")
"""Where a line must not break: in an interval, before a percent sign, in "n = 12" and "p < .001"."""
_IN_PARENTHESES: Final = re.compile(r" \(([^()]*)\)\.$")
"""The end of a limitation that applies to some participants."""


class Presented(NamedTuple):
    """What a block presented: a sentence, and by condition ("": all of them) its liquids, delays and displays."""

    sentence: str
    of: Mapping[str, tuple[str, ...]] = MappingProxyType({})


_NO_NUMBERS: Final[Mapping[str, Sequence[Numbers]]] = MappingProxyType({})
_NOT_PRESENTED: Final[Mapping[str, Presented]] = MappingProxyType({})


@dataclass(frozen=True, slots=True, kw_only=True)
class Card:
    """An answer on the first page: its question, verdict and sentences, and the names of possible figures.

    The first of the ``figures`` that was drawn is shown; ``block`` is their block. Two small ones are placed side by
    side.
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
    """Return, by block, what its conditions presented; sealed blocks have nothing."""
    presented: dict[str, Presented] = {}
    blocks: list[Block | LevelBlock] = [*study.blocks, *study.levels]
    for block in blocks:
        stimulus, reference = (block.stimulus, block.reference) if isinstance(block, LevelBlock) else (None, None)
        conditions = [setting.of or setting for setting in (*block.settings, reference) if setting is not None]
        liquids, delays, displays = _liquids(conditions), _delays(conditions), _displays(conditions)
        if not liquids:
            continue
        delay = f"visual delays of {listed([f'{delay_ms:g}' for delay_ms in delays])} ms"
        if len(delays) < 2:
            delay = "a varied visual delay" if not delays else f"a visual delay of {ms(delays[0])}"
        details = []
        if stimulus is not None and delays:
            details.append(f"varied {stimulus.quantity}{_standards(block)}")
        details.append("no visual delay" if delays == [0.0] else delay)
        design = f" ({block.design.paper_name}{_trials(study, block)})" if isinstance(block, LevelBlock) else ""
        by_condition: dict[str, list[Setting]] = {"": [*conditions]}
        for condition in conditions:
            by_condition.setdefault(condition.condition or "", []).append(condition)
        presented[block.id] = Presented(
            f"In the block “{block.title}”{design}, the liquid{'s were' if len(liquids) > 1 else ' was'} "
            f"{listed(liquids)}{f', with {listed(details)}' if details else ''}"
            f"{''.join(f', {words}' for words in displays)}.",
            {name: _presented_words(of) for name, of in by_condition.items()},
        )
    return presented


def _trials(study: Study, block: LevelBlock) -> str:
    """Return how many trials each participant had in a block, after a comma."""
    counted = study.trials[study.trials["counted"] & (study.trials["block"] == block.id)]
    trials = counted.groupby("participant").size()
    if trials.empty:
        return ""
    least, most = int(trials.min()), int(trials.max())
    return f", {number_text.counted(most, 'trial') if least == most else f'{least} to {most} trials'} per participant"


def _liquids(conditions: Sequence[Setting]) -> list[str]:
    return [
        f"“{liquid.replace('_', ' ')}”"
        for liquid in dict.fromkeys(condition.liquid for condition in conditions)
        if liquid
    ]


def _delays(conditions: Sequence[Setting]) -> list[float]:
    return sorted({condition.delay_ms for condition in conditions if condition.delay_ms is not None})


def _displays(conditions: Sequence[Setting]) -> list[str]:
    return list(dict.fromkeys(words for condition in conditions for words in (condition.link, condition.view) if words))


def _presented_words(conditions: Sequence[Setting]) -> tuple[str, ...]:
    """Return the liquids, delays and displays of conditions in the words that tell two names apart."""
    delays = [f"{delay_ms:g}" for delay_ms in _delays(conditions)]
    delay = f"{listed(delays)} ms of visual delay" if delays != ["0"] else "no visual delay"
    return listed(_liquids(conditions)), delay if delays else "", listed(_displays(conditions))


def _distinguish_names(names: Sequence[str], presented: Sequence[tuple[str, ...]]) -> list[str]:
    """Return, for each name, its differing liquids, delays and displays in parentheses unless the name says them.

    Each result has a leading space; it is "" if there is nothing to add.
    """
    differing = [len({*words}) > 1 for words in zip(*presented, strict=False)]
    added = []
    for name, of in zip(names, presented, strict=True):
        words = [
            part for part, differs in zip(of, differing, strict=False) if differs and part and not _is_said(part, name)
        ]
        added.append(f" ({', '.join(words)})" if words else "")
    return added


def _is_said(part: str, name: str) -> bool:
    """Return whether a name says a liquid or delay: "60 ms late" says "60 ms of visual delay"."""
    if part == "no visual delay":
        said = r"\b(no|without|zero)\b.*\b(delay|latency|lag)\b|(?<![\d.])0 ms\b"
    else:
        said = rf"(?<![\w.]){re.escape(part.removesuffix(' of visual delay').strip('“”'))}\b"
    return re.search(said, name, re.IGNORECASE) is not None


def _standards(block: Block | LevelBlock) -> str:
    """Return the standards of a block of levels, with a leading space; "" if it has none."""
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
    """Return the answers of a study, those to its hypotheses first.

    ``numbers`` are those of `numbers_of` and ``presented`` those of `presented_in`.
    """
    return (
        *_hypotheses(results, numbers, presented),
        *_statements(results, presented),
        *_levels(results, presented),
        *_questions(results, numbers, presented),
    )


def _hypotheses(
    results: Results, numbers: Mapping[str, Sequence[Numbers]], presented: Mapping[str, Presented]
) -> Iterator[Card]:
    told: set[str] = set()
    for place, contrast in enumerate(results.contrasts, start=1):
        blocks = contrast.contrast.blocks
        new = [presented[block].sentence for block in blocks if block in presented and block not in told]
        told.update(blocks)
        lead = f"Hypothesis{f' {place}' if len(results.contrasts) > 1 else ''}"
        yield Card(
            question=f"{lead}: {_question_words(contrast, presented)}",
            verdict=contrast.verdict,
            sentences=(
                f"{answer(contrast)}{_scale_words(contrast, results, numbers)}",
                *_cell_words(contrast),
                *filter(None, [" ".join(new)]),
            ),
            block=blocks[0],
            figures=(f"hypothesis-{place}",),
        )


def _question_words(contrast: ContrastResult, presented: Mapping[str, Presented]) -> str:
    """Return the hypothesis, with the liquids and delays that distinguish what it compares."""
    of = contrast.contrast
    names = (contrast.within_names or of.within or ("", "")) if of.is_interaction else contrast.compared
    if of.within is None:
        return question(contrast)
    blocks = of.blocks if len(of.blocks) == 2 else of.blocks * 2
    by_condition = [presented[block].of if block in presented else {} for block in blocks]
    sides = [held.get(name, ()) for held, name in zip(by_condition, of.conditions or ("", ""), strict=True)]
    added = _distinguish_names(names, sides)
    first, second = (f"{quoted_title(name)}{words}" for name, words in zip(names, added, strict=True))
    if of.is_interaction:
        return question(replace(contrast, within_names=(first, second)))
    return question(replace(contrast, compared=(first, second)))


def _scale_words(contrast: ContrastResult, results: Results, numbers: Mapping[str, Sequence[Numbers]]) -> str:
    """Return a sentence on the unit or scale of the compared values, with a leading space; "" if there is none."""
    of = contrast.contrast
    levels = [level for level in results.levels if level.block in of.blocks]
    level = levels[0] if levels else None
    if level is not None and of.measure in RATIOS:
        if level.level_kind == "weber":
            criteria = {(level.guess_rate, level.counts) for level in levels}
            rate = level.guess_rate if len(criteria) == 1 else None
            at = "" if rate is None else f" at {50 * (1 + rate):.3g} % {level.counts}"
            meaning = f"{at}; lower values mean better discrimination" if of.measure == "threshold" else ""
            return f" Values are Weber fractions{meaning}."
        return f" Values are in {level.unit}." if level.unit else ""
    if level is not None and of.measure == "d_prime":
        return " At chance, d′ is 0."
    bounds = [scale.bounds for scale in numbers.get(of.form or "", ()) if scale.id == of.measure]
    if bounds and bounds[0] is not None:
        return " The scale ranges from {:g} to {:g}.".format(*bounds[0])
    return ""


def _cell_words(contrast: ContrastResult) -> Iterator[str]:
    """Yield the means of each group under each condition of an interaction."""
    for place, group in enumerate(contrast.compared):
        own = contrast.cells[2 * place : 2 * place + 2]
        means = [f"{mean_words(cell)} in {quoted_title(cell.name)}" for cell in own if cell.mean is not None]
        if means:
            yield f"Mean{'s' * (len(means) > 1)} in the group {group} (95 % intervals): {listed(means)}."


def _statements(results: Results, presented: Mapping[str, Presented]) -> Iterator[Card]:
    told = {block for contrast in results.contrasts for block in contrast.contrast.blocks}
    findings = {finding.key: finding for finding in all_findings() if finding.question}
    kinds = {block.id: block.kind for block in results.blocks}
    for given in answers(results):
        finding = findings[given.question]
        new = [presented[given.block].sentence] if given.block in presented and given.block not in told else []
        yield Card(
            question=f"{given.title}: {finding.question.format(kind=kinds[given.block])}",
            verdict=given.verdict,
            sentences=(given.text, *new),
            block=given.block,
            figures=finding.answer_figures,
        )
        told.add(given.block)
    for result in results.blocks:
        if result.n and len(result.names) == 1:
            yield Card(
                question=f"{result.title}: statements",
                verdict="",
                sentences=tuple(_agreement_words(result)),
                block=result.id,
                figures=(result.kind,),
            )


def _agreement_words(result: BlockResult) -> Iterator[str]:
    """Yield how many answers to each statement of a block with one setting express agreement."""
    once = result.presentations == (1, 1)
    for item, row in zip(result.items, result.measures, strict=True):
        n, agreed = int(row["n"]), sum(int(row[f"count_{level}"]) for level in AGREEMENT)
        if not n:
            continue
        share = clopper_pearson(agreed, n)
        ends = f", 95 % confidence interval [{100 * share.low:.0f}, {100 * share.high:.0f}] %" if once else ""
        who = "participants agreed" if once else "answers expressed agreement"
        yield f"{agreed} of {n} {who} with “{item.short}” ({100 * agreed / n:.0f} %{ends}; median {row['median']:g})."


def _levels(results: Results, presented: Mapping[str, Presented]) -> Iterator[Card]:
    """Yield the estimates of blocks of levels, except those that a hypothesis already shows; one card if sealed."""
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
                    *_estimate_words(level, estimates.group, estimates.attribute, estimates.words),
                    *([presented[level.block].sentence] if level.block in presented else ()),
                ),
                block=level.block,
                figures=(f"estimates-{level.block}",),
            )


def _estimate_words(result: LevelsResult, group: Sequence[Any], attribute: str, words: str) -> Iterator[str]:
    """Yield the mean of the group for each standard or comparison, with its interval."""
    of_level, is_weber = attribute in ("threshold", "pse"), result.level_kind == "weber"
    before = "a Weber fraction of " if of_level and is_weber else ""
    after = f" {result.unit}" if of_level and not is_weber and result.unit else ""
    for estimate in group:
        place = place_of(estimate)
        where = "" if place is None or len(group) == 1 else f" for {str(place).replace('_', ' ')}"
        if isinstance(place, float) and len(group) > 1:
            unit = "" if result.level_kind == "weber" and attribute == "value" else result.unit or ""
            where = f" at {place:g} {unit}".rstrip()
        ends = (
            "no interval"
            if None in (estimate.low, estimate.high)
            else f"95 % interval {_ends(estimate.low, estimate.high)}"
        )
        people = f"n = {getattr(estimate, 'participants', estimate.n)}"
        value = f"{before}{significant(getattr(estimate, attribute))}{after}"
        yield f"The mean {words}{where} was {value} ({ends}, {people})."


def _ends(low: float, high: float) -> str:
    return f"[{significant(low)}, {significant(high)}]"


def _questions(
    results: Results, numbers_at: Mapping[str, Sequence[Numbers]], presented: Mapping[str, Presented]
) -> Iterator[Card]:
    """Yield the answers to questions other than statements, by place; scores replace their questions.

    Numbers that a hypothesis already shows are left out.
    """
    levels, scores = {level.block for level in results.levels}, {score.where for score in results.scores}
    asked_at = [result for result in results.questions if result.where not in levels]
    in_order = sorted(asked_at, key=lambda result: result.is_form + (result.is_form and result.where not in scores))
    for where in dict.fromkeys(result.where for result in in_order):
        asked = [result for result in results.questions if result.where == where and result.n]
        numbers = [entry for entry in numbers_at.get(where, ()) if not _is_in_hypotheses(entry, where, results)]
        if not asked:
            continue
        sentences = [
            _number_words(entry, presented if place == 0 else _NOT_PRESENTED)
            for place, entry in enumerate(numbers[:MOST_PANELS])
        ]
        chosen = [result for result in asked if result.measure == "counts" and not result.weighs]
        sentences += [_choice_words(result) for result in chosen]
        if sentences:
            yield Card(
                question=place_title(asked[0], results),
                verdict="",
                sentences=tuple(sentences),
                block=where,
                figures=(
                    *([f"answers-{where}"] if numbers else ()),
                    *(f"question-{where}-{result.item}" for result in chosen),
                ),
                is_small=asked[0].is_form or all(len(entry.by_setting) < 2 for entry in numbers),
            )


def _is_in_hypotheses(numbers: Numbers, where: str, results: Results) -> bool:
    """Return whether hypotheses show a number of a form after all blocks, and for all its participants."""
    shown = [
        contrast
        for contrast in results.contrasts
        if (contrast.contrast.form, contrast.contrast.measure) == (where, numbers.id)
        and any(side.values for side in contrast.sides)
    ]
    blocks = {block for contrast in shown for block in contrast.contrast.blocks}
    people = {
        who
        for contrast in shown
        for who in (*contrast.left_out, *(who for side in contrast.sides for who in side.values))
    }
    held = {who for _, values in numbers.by_setting for who in values}
    return bool(shown) and blocks >= {*numbers.codes} and people >= held


def _number_words(numbers: Numbers, presented: Mapping[str, Presented] = _NOT_PRESENTED) -> str:
    """Return the means of a score or question by setting, and for two settings the mean difference.

    A number that is entered once describes the sample, so its SD and range are stated instead of an interval.
    """
    what = f"The mean {numbers.title} score" if numbers.is_score else f"The mean of “{numbers.title}”"
    blocks = [presented[code].of[""] if code in presented else () for code in numbers.codes]
    added = (
        _distinguish_names([name for name, _ in numbers.by_setting], blocks)
        if blocks
        else [""] * len(numbers.by_setting)
    )
    means = [
        (f" {_setting_words(name)}{words}" if name else "", mean, len(held))
        for (name, held), words in zip(numbers.by_setting, added, strict=True)
        if (mean := mean_of(held.values()))
    ]
    parts = [f"{number(mean.value)}{_mean_ends(mean)}{where}" for where, mean, _ in means]
    n = max(count for *_, count in means)
    if numbers.bounds is None and not numbers.is_score and len(means) == 1:
        values = [*next(held for _, held in numbers.by_setting if held).values()]
        spread = f"SD {number(float(np.std(values, ddof=1)))}, " if n > 1 else ""
        low, high = (f"{end:g}" if float(end).is_integer() else number(end) for end in (min(values), max(values)))
        return f"{what} was {number(means[0][1].value)} ({spread}range {low} to {high}, n = {n})."
    scale = "" if numbers.bounds is None else " on a scale from {:g} to {:g}".format(*numbers.bounds).replace("-", "−")
    text = f"{what} was {listed(parts)}{scale} (95 % confidence interval{'s' * (len(parts) > 1)}, n = {n})."
    if len(means) != 2:
        return text
    (first, one), (second, other) = numbers.by_setting
    away = mean_of(np.array([one[who] - other[who] for who in one if who in other]))
    if away is None or away.low is None:
        return text
    pair = " − ".join(_setting_words(name).removeprefix("for ") for name in (first, second))
    return f"{text} The mean difference ({pair}) was {number(away.value)}{_mean_ends(away)}."


def _setting_words(name: str) -> str:
    """Return the name of a setting in a sentence: "for water", or "after “80 ms late”" for a form after a block."""
    block = name.removeprefix(AFTER)
    return f"for {name_in_sentence(name)}" if block == name else f"{AFTER.lower()}{quoted_title(block)}"


def _mean_ends(mean: Mean) -> str:
    return "" if mean.low is None or mean.high is None else f" {interval(_Ends(mean.low, mean.high))}"


@dataclass(frozen=True, slots=True)
class _Ends:
    low: float
    high: float


def _choice_words(result: QuestionResult) -> str:
    """Return how many participants chose the most frequent options."""
    parts = []
    for group in result.groups:
        n, counts = int(group.numbers["n"]), group.numbers["counts"]
        if not n:
            continue
        most = int(max(counts.values()))
        first, *tied = [f"“{result.options.get(option, option)}”" for option, count in counts.items() if count == most]
        equal = f", and as many chose {listed(tied)}" if tied else ""
        share = clopper_pearson(most, n)
        of = f" ({name_in_sentence(group.name)})" if len(result.groups) > 1 else ""
        ends = f"[{100 * share.low:.0f}, {100 * share.high:.0f}] %"
        parts.append(
            f"{most} of {n} participants chose {first}{equal}{of} ({100 * most / n:.0f} %, 95 % confidence interval "
            f"{ends})"
        )
    return f"“{result.short}”: {'; '.join(parts)}."


def first_page(
    results: Results,
    limits: Sequence[str],
    numbers: Mapping[str, Sequence[Numbers]] = _NO_NUMBERS,
    drawn: Sequence[Picture] = (),
    presented: Mapping[str, Presented] = _NOT_PRESENTED,
) -> Markup:
    """Return the answers next to their figures, the limitations, and the error rate of the page."""
    given = cards(results, numbers, presented)
    shown = [(card, card.figure_of(drawn)) for card in given]
    claimed = any(block.n for block in results.blocks) and bool(answers(results))
    look = results.decided.look_words(len(results.people))
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
            for (card, figure), is_small in zip(shown, _find_paired_cards(given), strict=True)
        ],
        sentences=[*filter(None, [look]), *(() if given else (none_found(results),))],
        limits=_limits_by_subject(limits, results),
        empty=empty_studies(max(block.n for block in results.blocks)) if claimed and not results.decided.looks else "",
    )


def _with_fixed_spaces(sentence: str) -> str:
    return _BREAKS.sub(lambda match: match[0].replace(" ", "\u00a0"), sentence)


def _find_paired_cards(given: Sequence[Card]) -> list[bool]:
    """Return which cards stand side by side: of successive small ones each pair with figures of one height."""
    paired: list[bool] = []
    for place, card in enumerate(given):
        if len(paired) == place:
            is_pair = card.is_small and any(
                after.is_small and panel_rows(len(after.sentences)) == panel_rows(len(card.sentences))
                for after in given[place + 1 : place + 2]
            )
            paired += [True, True] if is_pair else [False]
    return paired


def _limits_by_subject(limits: Sequence[str], results: Results) -> list[tuple[str, list[str]]]:
    """Return each hypothesis or block ("": the study) with its limitations, those of several blocks once."""
    blocks = [words for block in results.blocks for words in (lead_phrase(block), block.title)]
    hypotheses = [f"Hypothesis {place}" for place, _ in enumerate(results.contrasts, start=1)]
    subjects = [*blocks, *(level.title for level in results.levels), "Hypothesis", *hypotheses]
    alike: dict[str, list[tuple[str, str]]] = {}
    for line in limits:
        subject = max((subject for subject in subjects if line.startswith(f"{subject}: ")), key=len, default="")
        words = line.removeprefix(f"{subject}: ") if subject else line
        some = _IN_PARENTHESES.search(words) if subject else None
        alike.setdefault(words[: some.start()] if some else words, []).append((subject, some[1] if some else ""))
    by_subject: dict[str, list[str]] = {}
    for words, of in alike.items():
        is_same = len({some for _, some in of}) == 1
        each = [of[0][1]] if is_same else [f"{subject}: {some}" for subject, some in of]
        some_words = f" ({'; '.join(each)})." if of[0][1] else ""
        subject = listed(list(dict.fromkeys(subject for subject, _ in of)))
        by_subject.setdefault(subject, []).append(f"{capitalised(words)}{some_words}")
    alone = [("", [line]) for line in by_subject.pop("", [])]
    return [*alone, *by_subject.items()]


def figures_shown(given: Sequence[Card], drawn: Sequence[Picture]) -> set[str]:
    """Return the names of the figures on the first page, which later sections omit."""
    figures = (card.figure_of(drawn) for card in given)
    return {figure.name for figure in figures if figure is not None}
