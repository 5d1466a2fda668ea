"""The preregistration of a study in Markdown, generated from its protocol, and the deviations of the study from it."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from pydantic import TypeAdapter

from study_app import __version__, number_text
from study_app.analysis.contrasts import RATIOS, t_test_name
from study_app.analysis.data.blocks import TRENDS, Decided, decisions
from study_app.analysis.data.study_tables import Study
from study_app.analysis.html_page import bullets, heading, paragraph
from study_app.analysis.levels.thresholds import FAMILIES, REMOVED
from study_app.analysis.planned_exclusions import unmet_exclusion_sentences
from study_app.analysis.planning.simulated_studies import compares_statements, question_contrasts, unsimulated_contrasts
from study_app.analysis.results import min_sample
from study_app.analysis.statistics.outcome import FEW
from study_app.analysis.statistics.thresholds import FEWEST
from study_app.analysis.wording import bound_text, counted, inclusion_text, listed, percent, significant
from study_app.errors import AnalysisError
from study_app.protocol import descriptions, load
from study_app.protocol.blocks import Block, block_titles, display_language
from study_app.protocol.model import SPENDINGS, Analysis, Contrast, Protocol
from study_app.protocol.orders import block_orders_by_group, variants
from study_app.protocol.participants import fewest_participants
from study_app.protocol.questionnaires import Questionnaire
from study_app.protocol.questions import Question
from study_app.protocol.source import text_in
from study_app.protocol.trials import Design
from study_app.protocol.warnings import (
    PRECISION,
    ThresholdPlan,
    expected_of,
    precision_plan,
    precision_rows,
    threshold_plan,
)
from study_app.psychophysics.people import BETWEEN_PEOPLE
from study_app.store.exclusions import MISSING_RULE, describe_exclusion
from study_app.store.files import PREREGISTRATION
from study_app.store.merged import DASH, folders_of

FILE: Final = PREREGISTRATION
CATCH: Final = "catch"
"""The exclusion rule that `unblind` applies."""
_BLOCK: Final = re.compile(r"^```json\n(\{.*?\})\n```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True, slots=True, kw_only=True)
class Commitment:
    """The preregistered commitments: participants, precision of the group's mean, and exclusion rules."""

    study: str
    version: str
    protocol_hash: str
    participants: int | None
    precision: float | None
    rules: tuple[str, ...]


def commitment(protocol: Protocol, protocol_hash: str) -> Commitment:
    """Return the commitments of a protocol."""
    decided = protocol.analysis
    return Commitment(
        study=protocol.study.name,
        version=protocol.study.version,
        protocol_hash=protocol_hash,
        participants=None if decided is None else decided.participants,
        precision=None if decided is None else decided.precision,
        rules=(
            *([CATCH] if any(block.catch is not None for block in protocol.main_blocks) else []),
            *([MISSING_RULE] if any(block.design is not None for block in protocol.main_blocks) else []),
            *(rule.rule for rule in (() if decided is None else decided.exclusions)),
        ),
    )


def commitment_lines(committed: Commitment) -> str:
    """Return the commitments as the last lines of a preregistration."""
    return f"```json\n{json.dumps(asdict(committed), indent=1)}\n```\n"


def read_commitment(folder: Path) -> Commitment | None:
    """Return the commitments in a study folder's preregistration, or None if there is no preregistration."""
    path = folder / FILE
    try:
        blocks = _BLOCK.findall(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError) as error:
        raise AnalysisError(f"{path} cannot be read ({error}): restore it from a backup") from error
    try:
        return TypeAdapter(Commitment).validate_json(blocks[-1], strict=True)
    except (IndexError, ValueError) as error:
        raise AnalysisError(
            f"{path} does not end with the block that `liquid-study preregister` writes ({type(error).__name__}): "
            "restore the file from a backup, or remove it"
        ) from error


def _language(protocol: Protocol) -> str:
    return display_language({"study": {"languages": protocol.study.languages}})


def _title(protocol: Protocol, block: str) -> str:
    """Return the title of a block in quotation marks, with its ID if another block has this title."""
    blocks = {name: {"phase": other.phase, "title": other.title} for name, other in protocol.blocks.items()}
    titles = block_titles({"study": {"languages": protocol.study.languages}, "blocks": blocks})
    return f"“{titles[block]}”"


def _form_title(protocol: Protocol, form: str) -> str:
    title = protocol.forms[form].title
    form_title = (
        number_text.capitalised(form.replace("_", " ")) if title is None else protocol.text(title, _language(protocol))
    )
    return f"“{form_title}”"


def _measure_text(protocol: Protocol, contrast: Contrast, language: str) -> str:
    """Return a phrase on the measure, with the short text of its statement or question if it has one."""
    questionnaire = (
        protocol.questionnaire_of(contrast.blocks[0]) if contrast.form is None else protocol.forms[contrast.form]
    )
    if questionnaire is not None and contrast.measure in questionnaire.scores:
        of_form = "" if contrast.form is None else f" of {_form_title(protocol, contrast.form)}"
        return f"{contrast.measure} score{of_form}"
    item = next((item for item in (questionnaire.items if questionnaire else ()) if item.id == contrast.measure), None)
    if item is None:
        return protocol.measure_text(contrast) if contrast.is_of_levels else ""
    short = f"“{protocol.text(item.short, language)}”"
    if contrast.form is not None:
        return f"{short} in {_form_title(protocol, contrast.form)}"
    return f"agreement with {short}" if protocol.compares_statement(contrast) else short


def hypotheses(protocol: Protocol, language: str) -> Iterator[str]:
    """Yield the contrasts and the questions of each main block; predictions are marked as hypotheses."""
    stimuli = {block.id: protocol.stimulus_of(block) for block in protocol.main_blocks if block.stimulus}
    for contrast in () if protocol.analysis is None else protocol.analysis.contrasts:
        titled = contrast.model_copy(update={"blocks": tuple(_title(protocol, block) for block in contrast.blocks)})
        compared = titled.words(
            {_title(protocol, block): protocol.condition_of(stimulus) for block, stimulus in stimuli.items()}
        )
        described = titled.described(compared, measure=_measure_text(protocol, contrast, language))
        ratio = contrast.measure in RATIOS and all(stimuli[block].spacing == "log" for block in contrast.blocks)
        test = t_test_name(contrast, ratio=ratio)
        test += " and the degrees of freedom of the smaller group" if contrast.groups else ""
        sides = "two-sided" if contrast.expected is None else "one-sided"
        weights_note = " Participants are weighted as in the group mean." if contrast.measure == "threshold" else ""
        yield (
            f"Hypothesis: {described}. We test it with a {sides} {test}, using one value per participant"
            f"{_reduction_text(protocol, contrast)}.{weights_note} We also use a bootstrap that includes one "
            "hypothetical participant as extreme as the most extreme participant in the sample (Gaffke 2005), and a t "
            "test corrected for skewness (Hall 1992). The p value is the largest of the three, Holm-adjusted across "
            f"all hypotheses of this kind.{_equivalence_sentences(protocol, contrast)}"
        )
    if protocol.analysis is not None and protocol.analysis.contrasts:
        yield inclusion_text(protocol.analysis.contrasts)
    for block in protocol.main_blocks:
        if block.design is not None:
            yield from _interval_lines(protocol, block)
        else:
            yield from _statement_lines(protocol, block, language)
    for published in () if protocol.analysis is None else protocol.analysis.published:
        titled_value = published.model_copy(update={"block": _title(protocol, published.block)})
        stimulus = stimuli.get(published.block)
        yield f"Published value for comparison, block {titled_value.described(stimulus.unit if stimulus else '')}."


def _reduction_text(protocol: Protocol, contrast: Contrast) -> str:
    """Return how several answers or estimates of a participant are reduced to one value; "" for a single estimate."""
    if contrast.is_of_levels:
        blocks = [protocol.blocks[name] for name in contrast.blocks]
        is_averaged = any(block.stimulus is not None and len(protocol.standards_of(block)) > 1 for block in blocks)
        return " (the mean over the standards)" if is_averaged and contrast.measure != "exponent" else ""
    reduced = "median" if protocol.compares_statement(contrast) else "mean"
    has_several = any(len(protocol.blocks[name].conditions) > 1 for name in contrast.blocks)
    is_averaged = has_several and contrast.form is None and contrast.conditions is None
    return f" (the {reduced} of repeated answers{', averaged over the conditions of a block' if is_averaged else ''})"


def _equivalence_sentences(protocol: Protocol, contrast: Contrast) -> str:
    """Return sentences on the equivalence test and the number of participants that it needs; "" without a bound."""
    if contrast.bound is None or protocol.analysis is None:
        return ""
    bounds = sum(contrast.bound is not None for contrast in protocol.analysis.contrasts)
    largest = contrast.largest_difference if protocol.compares_statement(contrast) else None
    people = "participants in each group" if contrast.groups else "participants"
    alpha = decisions(protocol).alphas[-1] / bounds
    adjusted = "" if bounds == 1 else f", with Holm's adjustment for the {bounds} hypotheses that have a bound"
    return (
        f" We test equivalence with two one-sided t tests and a bootstrap{adjusted}. This requires at least "
        f"{fewest_participants(alpha, contrast.bound, largest)} {people}."
    )


def _interval_lines(protocol: Protocol, block: Block) -> Iterator[str]:
    design, title = protocol.design_of(block), _title(protocol, block.id)
    if block.stimulus is None:
        others = [name for name in block.conditions if name != block.standard]
        if design.asks_for_more:
            verb = "is" if len(others) == 1 else "are"
            yield (
                f"Block {title}: how often {verb} {listed(others)} chosen rather than {block.standard} (d′, which is "
                f"negative if {block.standard} is chosen more often)?"
            )
        else:
            yield f"Block {title}: how well can {listed(others)} be discriminated from {block.standard} (d′)?"
        return
    stimulus = protocol.stimulus_of(block)
    quantity, unit = stimulus.quantity, stimulus.unit
    standards = [standard for standard in protocol.standards_of(block) if standard is not None]
    standards_text = f"{listed([f'{standard:g}' for standard in standards])} {unit}".rstrip()
    if threshold_plan(protocol, block) is None:
        compared = bool(standards) and design.intervals > 1
        questions = {
            "number": f"what is the exponent of the power law for {quantity}",
            "rating": f"how do ratings change with {quantity}",
            "setting": f"which settings of {quantity} {f'match {standards_text}' if compared else 'are chosen'}",
        }
        yield f"Block {title}: {questions.get(design.reply, f'how do answers change with {quantity}')}?"
        return
    at = f" at {standards_text}" if standards else ""
    kind = "Weber fraction" if stimulus.level_kind == "weber" else stimulus.threshold_term(design)
    yield (
        f"Block {title}: what is the {kind} for {quantity}{at}? We report an estimate with a 95 % interval but no test."
    )
    if len(standards) > 1:
        yield (
            f"Block {title}: is the just-noticeable difference proportional to the standard (exponent 1, Weber's "
            "law) or constant (exponent 0)?"
        )


def _statement_lines(protocol: Protocol, block: Block, language: str) -> Iterator[str]:
    questionnaire, decided = protocol.questionnaire_of(block.id), protocol.analysis or Analysis()
    title = _title(protocol, block.id)
    if questionnaire is None or len(block.conditions) < 2:
        return
    texts = {item.id: text_in(item.text, language) for item in questionnaire.statements}
    if protocol.compared_in(block.id) == "delays":
        for name, text in texts.items():
            if name in decided.rising or name in decided.falling:
                verb = "increases" if name in decided.rising else "decreases"
                yield f"Hypothesis, block {title}: agreement with “{text}” ({name}) {verb} with the delay."
        if decided.noticed in texts:
            yield (
                f"Block {title}: at what delay do participants notice a difference (answers of 5 to 7 to the "
                f"statement “{texts[decided.noticed]}”)?"
            )
        if decided.equivalence_bound is not None:
            yield (
                f"Block {title}: which delays are equivalent to the shortest one, within "
                f"{bound_text(decided.equivalence_bound)}?"
            )
        return
    primary = [name for name in texts if not decided.primary or name in decided.primary]
    if primary:
        yield (
            f"Hypothesis, block {title}: agreement differs between {listed(block.conditions)} for "
            f"{listed([f'“{texts[name]}” ({name})' for name in primary])}."
        )
    labels = [
        f"“{condition.label}” for {name}" for name, condition in protocol.conditions.items() if condition.label in texts
    ]
    if labels and protocol.analysis is not None:
        yield f"Block {title}: are the liquids recognised above chance (statements: {listed(labels)})?"


def analyses(protocol: Protocol) -> Iterator[str]:
    """Yield sentences on the analysis of each block."""
    for block in protocol.main_blocks:
        plan, title = threshold_plan(protocol, block), _title(protocol, block.id)
        if block.stimulus is not None and (
            tracks := protocol.method_of(block).track_phrase(protocol.stimulus_of(block))
        ):
            yield f"Block {title}: levels are chosen {tracks}."
        if plan is not None:
            stimulus, design = protocol.stimulus_of(block), protocol.design_of(block)
            method, family = protocol.method_of(block), FAMILIES[stimulus.assumed(design).family]
            yield (
                f"Block {title} ({design.paper_name}, {method.paper_name}): for each participant and standard, we "
                f"estimate the {stimulus.threshold_term(design)} as the posterior median ({family} function) with its "
                "equal-tailed 95 % interval, using the delivered levels, and also report the median under a flat prior "
                "on the width. Goodness of fit is tested with 999 simulated data sets, and drift over the trials is "
                "reported." + (f" {REMOVED.format('is')}" if design.kind == "2ifc" else "")
            )
            yield (
                f"Block {title}, group: we report the random-effects mean of the "
                f"{'logarithmic ' if stimulus.spacing == 'log' else ''}{plan.estimated} (Paule–Mandel), with the "
                f"Hartung–Knapp 95 % interval if there are at least {FEWEST} participants. Each participant's variance "
                "is replaced by the geometric mean of that variance and the median variance."
            )
            if plan.standards > 1:
                yield (
                    f"Block {title}, exponent: we report the mean of the participants' slopes of ln JND on ln "
                    "standard, with a 95 % confidence interval (Student's t)."
                )
        elif block.design is not None and block.stimulus is not None:
            yield from _answer_sentences(protocol.design_of(block), title)
        elif block.design is not None:
            yield (
                f"Block {title}: we report d′ for each participant, calculated from rates with the log-linear "
                "correction."
            )
    yield from _description_sentences(protocol)
    yield from _statement_sentences(protocol)


def _answer_sentences(design: Design, title: str) -> Iterator[str]:
    """Yield sentences on the analysis of answers that enter no psychometric function."""
    reply = design.reply
    if reply == "setting":
        reported = (
            "the mean of the settings (the point of subjective equality), their standard deviation, the constant error,"
            if design.intervals > 1
            else "the mean of the settings, their standard deviation,"
        )
        yield (
            f"Block {title}: for each participant{' and standard' * (design.intervals > 1)}, we report {reported} and "
            "the difference between settings reached from above and from below. Settings that the time limit ended, or "
            "that lie at an end of the range, are included, and we report how many there are. For the group, we report "
            "means with 95 % confidence intervals (Student's t). If levels are spaced logarithmically, we use the "
            "logarithms of the settings."
        )
        return
    answers = "logarithmic answers" if reply == "number" else "answers"
    exponent = " The exponent is the slope of these logarithms on the logarithm of the level." * (reply == "number")
    yield (
        f"Block {title}: for each level, we report the mean across participants of their mean {answers}, with a 95 % "
        f"confidence interval (Student's t).{exponent}"
    )
    if reply == "rating":
        yield (
            f"Block {title}: we report d_a for each level relative to the lowest level, calculated from the area "
            "under the ROC curve."
        )


def _statement_sentences(protocol: Protocol) -> Iterator[str]:
    """Yield sentences on the tests of statements, and alpha."""
    blocks = [block for block in protocol.blocks_with_statements if len(block.conditions) > 1]
    decided = decisions(protocol)
    if delayed := [block for block in blocks if protocol.compared_in(block.id) == "delays"]:
        yield (
            f"{_blocks_text(protocol, delayed)}: we test for trends with {TRENDS[decided.trends]}. The test is "
            "one-sided if a direction is stated, otherwise two-sided. If the answers to a statement show a trend, we "
            f"drop the longest delay and repeat the test until no trend remains. {_equivalence_text(decided)}We "
            "estimate the detection threshold from agreement if agreement shows a trend."
        )
    others = [block for block in blocks if block not in delayed]
    if pairs := [block for block in others if len(block.conditions) == 2]:
        yield f"{_blocks_text(protocol, pairs)}: we test each statement with Wilcoxon's signed-rank test."
    if several := [block for block in others if len(block.conditions) > 2]:
        yield (
            f"{_blocks_text(protocol, several)}: we test each statement with Friedman's test (permutation). If a "
            "statement shows a difference, we compare pairs of conditions with Wilcoxon's signed-rank test, "
            "Holm-adjusted across all pairs in the block."
        )
    if blocks:
        yield (
            "We claim a difference for a statement only if the permutation test over all statements in its block is "
            "significant (Holm-adjusted across the blocks). Intervals for mean rank correlations and exploratory tests "
            f"of means require at least {FEW} participants."
        )
    if protocol.analysis is None:
        yield "The protocol does not have an [analysis] table, so all results are exploratory."
    elif blocks:
        yield (
            f"Alpha is {decided.alpha:g}. The p values of primary statements ({', '.join(decided.primary) or 'all'}) "
            "are Holm-adjusted; those of other statements, which are exploratory, are adjusted with the "
            "Benjamini–Hochberg method."
        )
    elif protocol.analysis.contrasts:
        yield f"Alpha is {decided.alpha:g}."


def _blocks_text(protocol: Protocol, blocks: Sequence[Block]) -> str:
    """Return the titles of blocks as the beginning of a sentence."""
    return f"Block{'s' * (len(blocks) > 1)} {listed([_title(protocol, block.id) for block in blocks])}"


def _described_answers(protocol: Protocol) -> list[str]:
    """Return phrases for the answers that are described but, except in hypotheses, not tested."""
    places, mixed = [_form_title(protocol, form) for form in protocol.forms], []
    for block in protocol.main_blocks:
        asked = protocol.questionnaire_of(block.id) if block.design is None else None
        if asked is None:
            continue
        title = f"block {_title(protocol, block.id)}"
        if not asked.statements or len(block.conditions) == 1:
            places.append(title)
        elif len(asked.statements) < len(asked.items):
            mixed.append(title)
    return [
        f"to the questions {other}in {listed(in_places)}"
        for other, in_places in (("", places), ("other than statements ", mixed))
        if in_places
    ]


def _description_sentences(protocol: Protocol) -> Iterator[str]:
    """Yield sentences on the description of answers to forms and to questions that are not statements."""
    if not (described := _described_answers(protocol)):
        return
    contrasts = () if protocol.analysis is None else protocol.analysis.contrasts
    of_single = any(
        len(protocol.blocks[name].conditions) == 1
        for contrast in contrasts
        if protocol.compares_statement(contrast)
        for name in contrast.blocks
    )
    hypotheses = " except in the hypotheses above" * (of_single or bool(question_contrasts(protocol)))
    yield " ".join(
        (
            f"We describe the answers {listed(described)}, but do not test them{hypotheses}.",
            *_summary_sentences([*_described_items(protocol)]),
        )
    )


def _described_items(protocol: Protocol) -> Iterator[tuple[Questionnaire, Question]]:
    """Yield each question whose answers are described, with its questionnaire."""
    for questionnaire in protocol.forms.values():
        yield from ((questionnaire, item) for item in questionnaire.items)
    for block in protocol.main_blocks:
        asked = protocol.questionnaire_of(block.id) if block.design is None else None
        tested = asked.statements if asked is not None and len(block.conditions) > 1 else ()
        yield from ((asked, item) for item in (asked.items if asked else ()) if asked and item not in tested)


def _summary_sentences(described: Sequence[tuple[Questionnaire, Question]]) -> Iterator[str]:
    """Yield how scores, numbers and choices are summarised, for those that are described."""
    interval = "with its 95 % confidence interval (Student's t)"
    has_scores = any(questionnaire.scores for questionnaire, _ in described)
    if has_scores:
        yield f"We report the mean score of each questionnaire across participants {interval}."
    if any(item.value_type != "text" and not questionnaire.scores for questionnaire, item in described):
        yield (
            "If a questionnaire is not scored, we report the means of its ratings and numbers."
            if has_scores
            else f"We report the mean of each rating and number across participants {interval}."
        )
    if any(item.measure == "counts" for _, item in described):
        yield "We count how often each option is chosen."


def _equivalence_text(decided: Decided) -> str:
    """Return a sentence on the equivalence test of delays; "" without a bound."""
    if (bound := decided.equivalence_bound) is None:
        return ""
    return (
        "We test equivalence to the shortest delay with two one-sided t tests and with a bootstrap; both must show "
        f"equivalence, which requires {min_sample(decided.alphas[-1], bound)}. "
    )


def preregistration_of(source: str, power: str | None = None) -> str:
    """Return the preregistration of a protocol file, or of a study by name."""
    content = load.source_bytes(source)
    return preregistration(load.parse(content, source), load.protocol_hash(content), power)


def preregistration(protocol: Protocol, protocol_hash: str, power: str | None = None) -> str:
    """Return a preregistration: hypotheses, design, sample size, exclusions, analysis, description of the protocol.

    ``power`` is the Markdown that ``liquid-study power`` wrote.
    """
    committed = commitment(protocol, protocol_hash)
    study = protocol.study
    language = _language(protocol)
    description = " ".join(study.description.split())
    lines = [
        f"# Preregistration: {text_in(study.title, language)}",
        "",
        f"Study {study.name}, version {study.version}; protocol file with SHA-256 `{protocol_hash}`. liquid-study "
        f"{__version__} generated this text from that file alone. Register the text before the first session.",
        "",
        *([description, ""] if description else []),
        "## Hypotheses and questions",
        "",
        *(f"- {line}" for line in list(hypotheses(protocol, language)) or [_without_hypothesis(protocol)]),
        "",
        "## Design",
        "",
        *(f"- {line}" for line in _design_lines(protocol)),
        "",
        "## Participants",
        "",
        *_participant_lines(protocol, committed, power),
        "",
        "## Exclusions",
        "",
        *(f"- {line}" for line in _exclusion_lines(protocol)),
        "",
        "## Analysis",
        "",
        *(f"- {line}" for line in [*analyses(protocol)] or [_WITHOUT_TESTS]),
        "",
        "## The protocol in words",
        "",
        "```text",
        *(line for line in descriptions.describe(protocol).splitlines() if not line.startswith(f"  {PRECISION}")),
        "```",
        "",
        "## Values that the report checks",
        "",
        commitment_lines(committed),
    ]
    return "\n".join(lines)


_WITHOUT_TESTS: Final = (
    "No test is planned. We report the medians and quartiles of duration, path length and force in each condition."
)


def _without_hypothesis(protocol: Protocol) -> str:
    """Return a sentence on what a study without hypotheses and questions describes."""
    described = _described_answers(protocol)
    return "No hypothesis is stated." + (f" The study describes the answers {listed(described)}." if described else "")


def _design_lines(protocol: Protocol) -> Iterator[str]:
    study = protocol.study
    yield (
        "Conditions are identified only by codes until the key is opened. The study is "
        + (
            "double-blind: the operator does not see the force."
            if study.blinding == "double"
            else "single-blind: the operator sees the force and the wake."
        )
    )
    names, ratio = listed(list(protocol.shares)), ":".join(map(str, protocol.shares.values()))
    if protocol.randomises:
        yield (
            f"Participants are randomised in permuted blocks to the groups {names}, with an allocation ratio of "
            f"{ratio}."
        )
    elif protocol.asks_group:
        yield (
            f"Participants are assigned to the groups {names} by an existing attribute, which is recorded at the "
            f"start of their first session; the planned ratio is {ratio}. The groups are not randomised, so a "
            "difference between them may have other causes."
        )
    yield from _block_order_lines(protocol)
    for block in protocol.main_blocks:
        compared = listed(list(block.conditions))
        if block.stimulus is not None:
            compared = f"levels of {protocol.stimulus_of(block).quantity}"
        alone, title = block.stimulus is None and len(block.conditions) == 1, _title(protocol, block.id)
        yield (
            f"Block {title} {'presents' if alone else 'compares'} {compared}.{_trial_order_sentence(protocol, block)}"
            f"{_criterion_and_feedback_sentences(protocol, block)}"
        )
    for block in protocol.blocks_in_order:
        if block.phase != "main":
            yield (
                f"The {block.phase} block {_title(protocol, block.id)} has "
                f"{descriptions.trials_text(protocol, block)}, which are not analysed."
                f"{_criterion_and_feedback_sentences(protocol, block)}"
            )


def _criterion_and_feedback_sentences(protocol: Protocol, block: Block) -> str:
    """Return sentences on the criterion that ends a block early and on feedback, each after a space."""
    until = block.until
    ends = "" if until is None else f" The block ends {until.condition_text()}; {until.missed_text}."
    return ends + " Feedback is given after every trial." * descriptions.shows_feedback(protocol, block)


def _trial_order_sentence(protocol: Protocol, block: Block) -> str:
    """Return a sentence on how the trial order of a block arises; "" for a single condition."""
    squares = {"latin": "a Latin square", "williams": "a Williams design"}
    if block.design is None and len(block.conditions) < 2:
        return ""
    if block.design is None and block.order == "fixed":
        return " The trial order is the same for all participants."
    if block.design is None and block.order in squares:
        by = "participant's position in the group" if protocol.groups else "number in the participant's ID"
        return f" The trial order follows a row of {squares[block.order]}, assigned by the {by}."
    return " The trial order is drawn for each session."


def _block_order_lines(protocol: Protocol) -> Iterator[str]:
    """Yield the order of blocks; that of each group or session if these have different fixed orders."""
    titles = {
        variant.name: tuple(_title(protocol, block.id) for block in variant.protocol.main_blocks)
        for variant in variants(protocol)
        if len(variant.protocol.main_blocks) > 1
    }
    if protocol.study.block_order == "fixed" and len({*titles.values()}) > 1:
        for name, in_order in titles.items():
            yield f"The order of blocks in {name} is fixed: {listed(list(in_order))}."
        return
    for group, words in block_orders_by_group(protocol).items():
        yield f"The order of blocks{f' in group {group}' if group else ''} is {words}."


def _participant_lines(protocol: Protocol, committed: Commitment, power: str | None) -> Iterator[str]:
    """Yield sentences on the planned number of participants and its justification."""
    sample_size = "The number of participants has not been decided, and there is no stopping rule."
    if committed.participants is not None:
        decided = decisions(protocol)
        counts = [protocol.session_count(group) or 1 for group in protocol.groups or (None,)]
        one_session = max(counts) == 1
        each = "" if one_session else f", with {descriptions.number_range(counts)} sessions each"
        complete = "completed a valid session" if one_session else "completed all of their sessions with valid data"
        planned = f"We plan to include {number_text.counted(committed.participants, 'participant')}{each}. "
        sample_size = planned + (
            f"The study ends when this number of participants have {complete}; only then are the data unblinded and "
            "tested."
            if not decided.looks
            else "The data are unblinded and all tests are run when "
            f"{listed([str(look) for look in decided.looks])} participants have {complete}; adjusted p values of "
            f"up to {listed([significant(level) for level in decided.alphas])} are significant at these looks "
            f"({SPENDINGS[decided.spending]} alpha spending, Lan & DeMets 1983). The study ends at the first look at "
            "which all primary statements and hypotheses are supported, or otherwise at the last look."
        )
    precision_goal = (
        ""
        if committed.precision is None
        else f" The goal is a 95 % interval for the group mean no wider than ±{percent(committed.precision)}."
    )
    yield sample_size + precision_goal
    if power is None or not power.startswith(f"# {PRECISION}"):  # otherwise the tables state the precision
        reasons = [f"- {line}" for block in protocol.main_blocks for line in _precision_lines(protocol, block)]
        yield from ("", *reasons) if reasons else ()
    if power is not None:
        yield from ("", *(f"##{line}" if line.startswith("#") else line for line in power.rstrip().splitlines()))
    elif compares_statements(protocol) or unsimulated_contrasts(protocol):
        yield ""
        yield (
            f"Power was not computed for this text: `liquid-study power {protocol.study.name} --to DIR` computes it, "
            "and `--power DIR` includes it here."
        )


def _precision_lines(protocol: Protocol, block: Block) -> Iterator[str]:
    """Yield the expected precision of a block's estimates and how many participants the goal requires."""
    if (plan := precision_plan(protocol, block)) is None:
        return
    ((label, reached),) = precision_rows(protocol, block)
    expected, enough, title = expected_of(plan), "", _title(protocol, block.id)
    goal = None if protocol.analysis is None else protocol.analysis.precision
    if goal is not None and expected.measured and (needed := expected.participants_for(goal)) is not None:
        enough = f" The goal requires at least {number_text.counted(needed, 'participant')}."
    between = f"a factor of {BETWEEN_PEOPLE:g}"
    if isinstance(plan, ThresholdPlan) and plan.has_pse:
        between = f"{plan.between_people * plan.value:.2g}{plan.unit} (one standard deviation)"
    yield (
        f"Block {title}: we simulated {expected.trials} trials{plan.per}, with {plan.estimated} that differ between "
        f"people by {between}. {label}{', ' if plan.words else ': '}{reached}.{enough}"
    )


def _exclusion_lines(protocol: Protocol) -> Iterator[str]:
    yield "Incomplete sessions are not analysed."
    for block in protocol.main_blocks:
        if block.catch is not None:
            yield (
                f'Rule "catch": a session with more than {100 * block.catch.wrong_most:g} % incorrect answers to the '
                f"catch trials of block {_title(protocol, block.id)} is excluded; the program applies this rule when "
                "the data are unblinded."
            )
    limits = "; ".join(f"{limit} ({value})" for value, limit in descriptions.limit_rows(protocol))
    has_intervals = any(block.design is not None for block in protocol.main_blocks)
    if has_intervals:
        attempts = protocol.limits.attempts
        attempts_note = (
            "" if attempts is None else f", for up to {number_text.counted(attempts, 'presentation')} in total"
        )
        yield (
            "If any interval in a trial exceeds one of the limits below, no question is asked and the trial is "
            f"repeated{attempts_note}."
        )
        if (permitted := protocol.limits.missing_percent) is not None:
            yield (
                f'Rule "missing": a session is excluded as incomplete if more than {permitted:g} % of the '
                "interval trials in its main blocks remain unanswered because none of their presentations met the "
                "limits for valid trials."
            )
    if any(block.design is None for block in protocol.main_blocks):
        trials = "Other trials" if has_intervals else "Trials"
        yield f"{trials} that exceed a limit are included in the analysis, and their number is reported."
    for rule in () if protocol.analysis is None else protocol.analysis.exclusions:
        yield (
            f'Rule "{rule.rule}": a session is proposed for exclusion if {rule.words}. The researchers decide '
            "whether to exclude it; the report lists the session and the decision, and gives the conclusions with and "
            "without all such sessions."
        )
    yield f"Limits: {limits}."
    yield "Any other exclusion is a deviation from this preregistration; the report lists it with its reason and date."


_SHOWN = 20


@dataclass(frozen=True, slots=True)
class Deviations:
    """The preregistered commitments, and each deviation of the study from them as text.

    ``commitment`` is None without a preregistration; then only the planned number of participants is compared.
    """

    commitment: Commitment | None
    found: tuple[str, ...]


def preregistration_folders(study: Study) -> dict[str, Path]:
    """Return the folder of the preregistration by site; the only key of a study that is not merged is "".

    For a rehearsal or pilot without its own file, it is the study's folder.
    """
    folders = {prefix.removesuffix(DASH): folder for prefix, folder in folders_of(study.folder).items()}
    if [*folders] == [""] and not (folders[""] / FILE).exists():
        folders[""] = study.folder.resolve().with_name(study.name)
    return folders


def deviations(study: Study) -> Deviations | None:
    """Return the deviations from the preregistration; None without one and without a planned number of participants."""
    sites = {site: read_commitment(folder) for site, folder in preregistration_folders(study).items()}
    committed = next(filter(None, sites.values()), None)
    planned = (study.protocol.get("analysis") or {}).get("participants")
    if committed is None:
        return None if planned is None else Deviations(None, tuple(_sample_size_difference(study, planned)))
    return Deviations(committed, tuple(_deviation_lines(study, sites, committed)))


def _deviation_lines(study: Study, sites: Mapping[str, Commitment | None], committed: Commitment) -> Iterator[str]:
    """Yield the deviations of a study, and differences between the preregistrations of its sites, as text."""
    for site, site_commitment in sites.items():
        if site_commitment is None:
            yield f"site {site} does not have the file {FILE}"
        elif site_commitment != committed:
            yield (f"the preregistration at site {site} differs from the one at the first site, which is used here")
    if study.name != committed.study:
        yield f"the preregistration belongs to a different study, {committed.study}"
    rows = study.participants
    other = rows[rows["counted"] & (rows["protocol_hash"] != committed.protocol_hash)]
    if len(other):
        versions = listed(sorted(set(map(str, other["protocol_version"]))))
        sessions = listed([f"{row.participant}/{row.session}" for row in other.head(_SHOWN).itertuples()])
        more = "" if len(other) <= _SHOWN else f" and {len(other) - _SHOWN} more"
        yield (
            f"{counted(len(other), 'session')} used a protocol (version {versions}) that differs from the "
            f"preregistered protocol (version {committed.version}, SHA-256 {committed.protocol_hash[:12]}…): "
            f"{sessions}{more}"
        )
    yield from _sample_size_difference(study, committed.participants)
    by_person = [exclusion for exclusion in study.exclusions if exclusion.rule_or_person not in committed.rules]
    for exclusion in by_person[:_SHOWN]:
        yield (
            f"there is an exclusion without a preregistered rule ({describe_exclusion(exclusion)}; {exclusion.reason}; "
            f"{exclusion.rule_or_person})"
        )
    if len(by_person) > _SHOWN:
        yield f"report.json lists {len(by_person) - _SHOWN} more exclusions without a preregistered rule"
    yield from unmet_exclusion_sentences(study)
    if study.decided.changed:
        yield "the decisions about the analysis differ between sessions, so all results are exploratory"


def _sample_size_difference(study: Study, planned: int | None) -> Iterator[str]:
    if planned is not None and study.n not in (planned, *study.decided.looks):
        kind = "fewer" if study.n < planned else "more"
        yield f"there are {kind} participants than planned ({study.n} instead of {planned})"


def deviations_section(study: Study) -> Iterator[str]:
    """Yield the report's section on deviations; nothing without a plan."""
    plan_deviations = deviations(study)
    if plan_deviations is None:
        return
    yield heading(2, "Preregistration")
    if (committed := plan_deviations.commitment) is None:
        missing = (
            f"The study's folder does not contain {FILE}. To create this file, use “Write preregistration” in the "
            "designer or liquid-study preregister --to. If you already have the file, copy it to the folder. "
        )
        missing_note = "" if study.simulated else missing
        yield paragraph(f"{missing_note}Only the number of participants is compared with the plan in the protocol.")
    else:
        yield paragraph(
            f"Preregistered: {committed.study}, version {committed.version}, protocol with SHA-256 "
            f"{committed.protocol_hash}."
        )
    if plan_deviations.found:
        plan = "preregistration" if committed is not None else "plan"
        yield paragraph(f"The study differs from the {plan} as follows:")
        yield bullets(plan_deviations.found)
    else:
        yield paragraph(
            "The protocol, the number of participants, the exclusions and the decisions match the preregistration."
            if plan_deviations.commitment is not None
            else "The number of participants is as planned."
        )
