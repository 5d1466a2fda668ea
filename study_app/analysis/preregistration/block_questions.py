"""What the blocks of a protocol ask, and how each is analysed, in sentences for a preregistration."""

from collections.abc import Iterator
from typing import Final

from study_app.analysis.results.words import listed
from study_app.protocol.analysis_plan import Analysis
from study_app.protocol.blocks import Block
from study_app.protocol.checks.expected_precision import threshold_plan
from study_app.protocol.model import Protocol
from study_app.protocol.quantities import quantity, quantity_words
from study_app.protocol.table import text_in
from study_app.protocol.trials.stimuli import Family, family_of
from study_app.protocol.trials.tracks import design_of, method_of, standards_of, stimulus_of

DEFAULTS: Final = Analysis()
FAMILIES: Final[dict[Family, str]] = {"weibull": "Weibull", "normal": "cumulative normal", "logistic": "logistic"}


def hypotheses(protocol: Protocol, language: str) -> Iterator[str]:
    """Yield what each main block asks; what a test would show is marked as a hypothesis."""
    for block in protocol.main_blocks:
        if block.design is not None:
            yield from _of_intervals(protocol, block)
        else:
            yield from _of_statements(protocol, block, language)
    for one in () if protocol.analysis is None else protocol.analysis.published:
        yield f"Published value to compare with: {one.described()}."


def _of_intervals(protocol: Protocol, block: Block) -> Iterator[str]:
    design = design_of(protocol, block)
    if block.stimulus is None:
        yield f"Block {block.id}: how well can {listed(block.conditions)} be discriminated from {block.standard} (d′)?"
        return
    stimulus = stimulus_of(protocol, block)
    what, unit = quantity_words(stimulus.vary), quantity(stimulus.vary).unit
    standards = [one for one in standards_of(protocol, block) if one is not None]
    if threshold_plan(protocol, block) is None:
        asked = {"number": "With which exponent do estimates grow with", "rating": "How do ratings change with"}
        yield f"Block {block.id}: {asked.get(design.reply, 'How do answers change with')} {what}?"
        return
    at = f" at {listed([f'{one:g}' for one in standards])} {unit}".rstrip() if standards else ""
    kind = "Weber fraction" if stimulus.level_kind == "weber" else "threshold"
    yield f"Block {block.id}: what is the {kind} of {what}{at}? An estimate with its interval; no test."
    if len(standards) > 1:
        yield (
            f"Block {block.id}: is the just-noticeable difference proportional to the standard (exponent 1, Weber's "
            "law) or constant (exponent 0)?"
        )


def _of_statements(protocol: Protocol, block: Block, language: str) -> Iterator[str]:
    questionnaire, decided = protocol.questionnaire_of(block.id), protocol.analysis or DEFAULTS
    if questionnaire is None or len(block.conditions) < 2:
        return
    texts = {item.id: text_in(item.text, language) for item in questionnaire.statements}
    if protocol.compared_in(block.id) == "delays":
        for name, words in texts.items():
            if name in decided.rising or name in decided.falling:
                moves = "rises" if name in decided.rising else "falls"
                yield f"Hypothesis, block {block.id}: agreement with “{words}” ({name}) {moves} with the delay."
        if decided.noticed in texts:
            yield f"Block {block.id}: from which delay on is it noticed (agreement, 5 to 7, with {decided.noticed})?"
        if decided.equivalence_bound is not None:
            yield (
                f"Block {block.id}: which delays are equivalent to none, within ±{decided.equivalence_bound:g} points?"
            )
        return
    primary = [name for name in texts if not decided.primary or name in decided.primary]
    yield (
        f"Hypothesis, block {block.id}: {listed(block.conditions)} differ in agreement with "
        f"{listed([f'“{texts[name]}” ({name})' for name in primary])}."
    )
    labels = [f"{name} by {one.label}" for name, one in protocol.conditions.items() if one.label in texts]
    if labels and protocol.analysis is not None:
        yield f"Block {block.id}: are the liquids recognised ({listed(labels)}) more often than by chance?"


def analyses(protocol: Protocol) -> Iterator[str]:
    """Yield how each block is analysed."""
    for block in protocol.main_blocks:
        plan = threshold_plan(protocol, block)
        if plan is not None:
            stimulus, design = stimulus_of(protocol, block), design_of(protocol, block)
            method = method_of(protocol, block)
            yield (
                f"Block {block.id} ({design.paper_name}, {method.paper_name}): for each participant and standard the "
                f"posterior median of the threshold ({FAMILIES[family_of(stimulus, design)]} function) with its "
                "equal-tailed 95 % interval, at the delivered levels; the median under a flat prior of the width is "
                "reported, too; goodness of fit by 999 simulated sets of answers, drift over trials."
            )
            yield (
                f"Block {block.id}, group: random-effects mean of logarithmic thresholds (Paule–Mandel) with the "
                "Hartung–Knapp 95 % interval."
            )
            if plan.standards > 1:
                yield f"Block {block.id}, exponent: slope of ln JND over ln standard of each participant, t interval."
        elif block.design is not None and block.stimulus is not None:
            yield (
                f"Block {block.id}: answers at each level, as means of participants' (of logarithms, where numbers are "
                "estimated; the exponent is the slope over the logarithm of the level) with Student's 95 % interval."
            )
            if design_of(protocol, block).reply == "rating":
                yield f"Block {block.id}: d_a of each level against the lowest, from the area under the ROC curve."
        elif block.design is not None:
            yield f"Block {block.id}: d′ of each participant, from rates with the log-linear correction."
    asked = [block for block in protocol.main_blocks if block.design is None and block.questionnaire is not None]
    if not asked:
        return
    decided = protocol.analysis or DEFAULTS
    kinds = {protocol.compared_in(block.id) for block in asked}
    if "delays" in kinds:
        yield (
            "Delays: Page's permutation test in the stated direction, stepping down from the longest delay; "
            "equivalence to no delay by two one-sided tests, where a bound is given; the detection threshold from "
            "agreement."
        )
    if others := kinds - {None, "delays"}:
        yield (
            f"{' and '.join(sorted(map(str, others))).capitalize()}: Friedman's permutation test of each statement, "
            "signed ranks where two conditions are compared."
        )
    yield (
        f"α = {decided.alpha:g}; primary statements ({', '.join(decided.primary) or 'all'}) are corrected by Holm, the "
        "others, exploratory, by Benjamini and Hochberg."
        if protocol.analysis is not None
        else "Nothing is decided (there is no table [analysis]): all results are exploratory."
    )
