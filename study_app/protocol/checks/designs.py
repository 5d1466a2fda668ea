"""Checks of blocks with a design: names, methods that answers cannot control, levels that cannot be presented.

These checks need a valid protocol.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any, Final

from study_app.errors import StudyError
from study_app.haptics.model.overrides import number_names, override_value
from study_app.protocol.blocks import Block
from study_app.protocol.model import RULES, Contrast, Protocol, Published
from study_app.protocol.orders.block_orders import order_of
from study_app.protocol.orders.tracks import tracks_of
from study_app.protocol.quantities import can_vary
from study_app.protocol.source.document import Path, entries, names
from study_app.protocol.source.problems import Fault, unknown_name
from study_app.protocol.source.table import Table
from study_app.protocol.trials.designs import DESIGN_KINDS
from study_app.protocol.trials.methods import METHOD_KINDS
from study_app.protocol.trials.stimuli import DELAY, OF_CONDITION, OF_LINK, Stimulated, Stimulus

_LEAST_MS: Final = 1e-3
"""Smallest difference between two times that counts as different [ms]: a thousandth of a tick. [choice]"""
_LEAST_SHARE: Final = 1e-6
"""Smallest difference between two other numbers that counts as different, as a proportion of the standard. [choice]"""


def check_kinds(document: Mapping[str, Any]) -> Iterator[Fault]:
    """Check that every block's design and method is a table, or a kind without required keys."""
    sections: tuple[tuple[str, str, Mapping[str, type[Table]]], ...] = (
        ("design", "designs", DESIGN_KINDS),
        ("method", "methods", METHOD_KINDS),
    )
    for key, section, known in sections:
        tables = names(document, section)
        for path, name in entries(document, f"blocks.*.{key}"):
            if not isinstance(name, str) or name in tables:
                continue
            if name not in known:
                yield unknown_name(path, f'there is no {key} "{name}"', name, {*tables, *known})
            elif required := [
                field_name for field_name, field in known[name].model_fields.items() if field.is_required()
            ]:
                listed = ", ".join(required)
                example = f'add a table [{section}.NAME] with kind = "{name}" and {listed}, and write {key} = "NAME"'
                yield Fault(path, f'the kind "{name}" does not have a default for {listed}', example)


def check_designs(protocol: Protocol) -> Iterator[Fault]:
    """Yield the faults of blocks with a design and of their stimuli."""
    faults = [
        fault for name, stimulus in protocol.stimuli.items() for fault in _check_varied_number(protocol, name, stimulus)
    ]
    if faults:
        yield from faults
        return
    for block in protocol.blocks.values():
        if block.design is not None:
            yield from _check_block(protocol, block)
    for number, published in enumerate(protocol.analysis.published if protocol.analysis is not None else ()):
        yield from _check_published(protocol, published, ("analysis", "published", number))
    for number, contrast in enumerate(protocol.analysis.contrasts if protocol.analysis is not None else ()):
        yield from _check_contrast(protocol, contrast, ("analysis", "contrasts", number))
    for number, rule in enumerate(protocol.analysis.exclusions if protocol.analysis is not None else ()):
        if (missing := _missing_for_rule(protocol, rule.rule)) is not None:
            yield Fault(("analysis", "exclusions", number, "rule"), f'"{rule.rule}" never applies: {missing}')


def _missing_for_rule(protocol: Protocol, rule: str) -> str | None:
    """Return the reason why an exclusion rule can never apply to the study; None if it can."""
    blocks = [block for block in protocol.main_blocks if block.design is not None]
    if rule == "constant_answers":
        questionnaires = filter(None, (protocol.questionnaire_of(block.id) for block in protocol.main_blocks))
        return (
            None
            if any(questionnaire.statements for questionnaire in questionnaires)
            else "no main block has statements"
        )
    if rule == "threshold_beyond_levels":
        return None if any(block.stimulus is not None for block in blocks) else "no main block has levels"
    stimuli = {block.id: None if block.stimulus is None else protocol.stimuli[block.stimulus] for block in blocks}
    if rule == "below_chance" and not any(
        protocol.design_of(block).can_be_correct(stimuli[block.id]) for block in blocks
    ):
        return "no main block has questions with a correct answer"
    return None


def fitting_rules(protocol: Protocol) -> tuple[str, ...]:
    """Return the exclusion rules that can apply to the study."""
    return tuple(rule for rule in RULES if _missing_for_rule(protocol, rule) is None)


def _check_block(protocol: Protocol, block: Block) -> Iterator[Fault]:
    design, place = protocol.design_of(block), ("blocks", block.id)
    can_be_correct = design.can_be_correct(None if block.stimulus is None else protocol.stimuli[block.stimulus])
    for key in ("until", "catch"):
        if not can_be_correct and getattr(block, key) is not None:
            is_forced_choice = design.has_correct_answer
            subject = 'a forced choice with level = "value"' if is_forced_choice else f'a design "{block.design}"'
            yield Fault((*place, key), f"{subject} does not have a correct answer", kind="surplus")
    if not can_be_correct and design.feedback not in {None, "never"}:
        yield Fault(
            ("designs", str(block.design), "feedback"),
            "its answers are neither correct nor incorrect, so feedback is not possible",
            'write feedback = "never"',
            kind="surplus",
        )
    if block.break_every is not None and not (order := order_of(protocol, block)).breaks:
        message = f"is {block.break_every}, but the block has only {order.trials} trials, so there would be no break"
        yield Fault((*place, "break_every"), message)
    if fault := next(_check_design_and_method(protocol, block), None):
        yield fault
        return
    if block.stimulus is None:
        if not design.has_standard:
            yield Fault(
                (*place, "design"),
                "has one interval, so there is nothing to compare",
                'specify stimulus = "…" instead of conditions',
            )
        return
    if design.has_standard and protocol.standards_of(block) == (None,):
        message = f'"{block.design}" needs a standard for noise trials, but level = "value" does not define one'
        yield Fault((*place, "design"), message, 'level = "weber" or "difference"')
        return
    if not design.adaptive and protocol.method_of(block).adaptive:
        message = f'is adaptive, but cannot choose levels from answers to "{block.design}"'
        yield Fault((*place, "method"), message, 'method = "constant"')
    elif protocol.method_of(block).adaptive and not protocol.stimuli[block.stimulus].rises(design):
        message = (
            f'"{block.design}" with level = "value" has correct answers both above and below the standard, so '
            "there is no threshold"
        )
        yield Fault((*place, "method"), message, 'method = "constant", or level = "weber" or "difference"')
    if unknown := [
        standard for standard in block.standards if standard not in protocol.stimuli[block.stimulus].standards
    ]:
        listed = ", ".join(f"{standard:g}" for standard in protocol.stimuli[block.stimulus].standards)
        yield Fault(
            (*place, "standards"),
            f"the stimulus does not have the standard {unknown[0]:g}",
            f"standards of the stimulus: {listed or 'none'}",
        )
    if design.first is not None and len(tracks_of(protocol, block)) > 1:
        yield Fault(
            ("designs", str(block.design), "modulus"),
            f'needs a single standard, but block "{block.id}" has several',
            "use a separate block for each standard",
            kind="surplus",
        )
    yield from _check_levels(protocol, block)


def _check_published(protocol: Protocol, published: Published, place: Path) -> Iterator[Fault]:
    """Check that a published value refers to a block with levels and to one of its standards."""
    blocks_with_levels = [block.id for block in protocol.blocks.values() if block.stimulus is not None]
    if published.block not in blocks_with_levels:
        message = f'there is no block "{published.block}" with levels'
        if blocks_with_levels:
            yield unknown_name((*place, "block"), message, published.block, blocks_with_levels)
        else:
            yield Fault(place, message, kind="surplus")
        return
    standards = [
        standard for standard in protocol.standards_of(protocol.blocks[published.block]) if standard is not None
    ]
    if published.standard is not None and published.standard not in standards:
        listed = ", ".join(f"{standard:g}" for standard in standards)
        yield Fault(
            (*place, "standard"),
            f"the block does not have the standard {published.standard:g}",
            f"choose one of these: {listed}" if listed else "",
            kind="surplus",
        )
    ends = (
        published.value if published.low is None else published.low,
        published.value,
        published.value if published.high is None else published.high,
    )
    if list(ends) != sorted(ends):
        yield Fault((*place, "low"), "low, value and high must be in ascending order", "sort them")


def _check_contrast(protocol: Protocol, contrast: Contrast, place: Path) -> Iterator[Fault]:
    """Check that the blocks of a contrast have its measure and its conditions, and that its bound can be reached."""
    yield from _check_bound(protocol, contrast, place)
    yield from _check_scales(protocol, contrast, place)
    for name in contrast.blocks:
        block, questionnaire = protocol.blocks[name], protocol.questionnaire_of(name)
        if block.phase != "main":
            yield Fault((*place, "blocks"), f"{name} is not a main block, so it is not analysed", "choose a main block")
            continue
        if contrast.form is not None:
            yield from _check_form(protocol, contrast, contrast.form, name, place)
            continue
        measures = () if questionnaire is None else questionnaire.numeric_measures
        known = measures if block.design is None else protocol.measures_of(block)
        kinds = {} if questionnaire is None else {item.id: item.kind_id for item in questionnaire.items}
        if contrast.measure not in known and contrast.measure in kinds:
            yield Fault(
                (*place, "measure"),
                f"{contrast.measure} is a {kinds[contrast.measure]}, but hypotheses compare numbers",
                "choose a statement, rating, slider, number or score",
            )
        elif "threshold" in known and contrast.measure in _other_terms(protocol, block):
            yield Fault(
                (*place, "measure"),
                f'is "{contrast.measure}", but block "{name}" measures it as its threshold',
                'measure = "threshold"',
            )
        elif contrast.measure not in known:
            yield unknown_name(
                (*place, "measure"), f'block "{name}" does not measure {contrast.measure}', contrast.measure, known
            )
        missing = [condition for condition in contrast.conditions or () if condition not in block.conditions]
        if missing:
            yield unknown_name(
                (*place, "conditions"), f"block {name} does not have {missing[0]}", missing[0], block.conditions
            )
        if contrast.conditions is not None and block.design is not None:
            message = f"block {name} has one result for all its conditions, because it has a design"
            yield Fault((*place, "conditions"), message, "compare two blocks instead")


def _other_terms(protocol: Protocol, block: Block) -> tuple[str, ...]:
    """Return the terms that people use for the threshold of a block with a stimulus."""
    stimulus = protocol.stimulus_of(block)
    if stimulus.has_pse(protocol.design_of(block)):
        return ("pse",)
    return {"weber": ("weber", "jnd"), "difference": ("jnd",)}.get(stimulus.level_kind, ())


def _check_bound(protocol: Protocol, contrast: Contrast, place: Path) -> Iterator[Fault]:
    """Check that the bound of a contrast is a ratio above 1, or a difference that the scale of a statement permits."""
    bound, path = contrast.bound, (*place, "bound")
    if bound is None:
        return
    blocks = [protocol.blocks[name] for name in contrast.blocks]
    spacings = {protocol.stimulus_of(block).spacing for block in blocks if block.stimulus is not None}
    if contrast.measure in ("threshold", "pse") and spacings == {"log"} and bound <= 1:
        ratio = f"{1 / bound:.3g}" if bound < 1 else "1.25"
        yield Fault(path, f"is {bound:g}, but the bound of a ratio must be greater than 1", f"for example {ratio}")
    if protocol.compares_statement(contrast) and bound > contrast.largest_difference:
        message = f"is {bound:g}, but differences on seven points are at most {contrast.largest_difference}"
        yield Fault(path, message, "choose the largest difference that you consider negligible")


def _check_scales(protocol: Protocol, contrast: Contrast, place: Path) -> Iterator[Fault]:
    """Check that two blocks measure the answer to a question after trials, or a score, on the same scale."""
    questionnaires = [] if contrast.form else [*filter(None, map(protocol.questionnaire_of, contrast.blocks))]
    scales: set[object] = {
        (item.kind_id, item.bounds(asked.context(protocol.scales, protocol.study.languages[0])))
        for asked in questionnaires
        for item in asked.items
        if item.id == contrast.measure
    }
    scales |= {
        asked.scores[contrast.measure].model_dump_json() for asked in questionnaires if contrast.measure in asked.scores
    }
    if len(scales) > 1:
        message = f"the two blocks measure {contrast.measure} on different scales"
        yield Fault((*place, "measure"), message, "use the same questionnaire in both blocks")


def _check_form(protocol: Protocol, contrast: Contrast, form: str, block: str, place: Path) -> Iterator[Fault]:
    """Check that a form is asked after a block of a contrast, and has its measure."""
    if block not in protocol.blocks_followed_by(form):
        yield Fault((*place, "form"), f"{form} does not always follow {block}", f"add it after {block} in the sequence")
    questionnaire = protocol.questionnaires[form]
    known = questionnaire.numeric_measures
    if contrast.measure not in known:
        message = f'"{form}" does not have a numeric question or score {contrast.measure}'
        yield unknown_name((*place, "measure"), message, contrast.measure, known)


def _check_varied_number(protocol: Protocol, name: str, stimulus: Stimulus) -> Iterator[Fault]:
    """Check that a stimulus varies one number of one condition."""
    place = ("stimuli", name)
    if stimulus.condition is None and len(protocol.conditions) > 1:
        listed = f"known: {', '.join(protocol.conditions)}"
        yield Fault((*place, "condition"), "is missing, but the study has several conditions", listed)
        return
    condition = protocol.condition_of(stimulus)
    liquids = protocol.conditions[condition].liquid_ids
    if stimulus.vary in OF_CONDITION:
        return
    if len(liquids) > 1:
        message = f"has {len(liquids)} liquids: only one can be varied"
        yield Fault((*place, "condition"), message, "choose a condition with one liquid")
    elif protocol.liquids[liquids[0]].effects == "auto":
        message = f'the effects of "{liquids[0]}" would be selected separately at every level'
        yield Fault((*place, "vary"), message, 'list them: effects = ["drag"]')
    else:
        try:
            protocol.present_value(stimulus)
        except StudyError:
            known = {*OF_CONDITION, *filter(can_vary, number_names(protocol.scene_for(condition)))}
            message = f'there is no parameter "{stimulus.vary}" in condition "{condition}"'
            yield unknown_name((*place, "vary"), message, stimulus.vary, known, cutoff=0.6)
        else:
            if not can_vary(stimulus.vary):
                message = f"{stimulus.vary} is not a parameter of a liquid: it applies to the whole session"
                hint = f"use a parameter of the liquid, or {', '.join(OF_CONDITION)}"
                yield Fault((*place, "vary"), message, hint)


def _check_levels(protocol: Protocol, block: Block) -> Iterator[Fault]:
    """Check that a block can present every level with each of its standards."""
    stimulus = protocol.stimuli[str(block.stimulus)]
    method = protocol.method_of(block)
    place = ("methods", str(block.method))
    faults = [Fault((*place, key), message, hint) for key, message, hint in method.faults(stimulus)]
    if faults:
        yield from faults
        return
    lowest, highest = stimulus.levels
    levels = sorted((*method.levels_of(stimulus), *([highest] if block.catch else [])))
    if levels[0] < lowest * (1 - 1e-9) or levels[-1] > highest * (1 + 1e-9):
        beyond = levels[0] if levels[0] < lowest * (1 - 1e-9) else levels[-1]
        message = f"{beyond:g} is outside the stimulus's levels"
        yield Fault(("methods", str(block.method), "levels"), message, f"choose levels from {lowest:g} to {highest:g}")
        return
    for standard in protocol.standards_of(block):
        if standard is not None and (fault := _standard_fault(protocol, block, stimulus, standard, lowest)) is not None:
            yield fault
            return
        for level in (levels[-1], levels[0]):
            value = stimulus.comparison(standard, level)
            if stimulus.vary in OF_CONDITION and not 0 <= value <= OF_CONDITION[stimulus.vary]:
                yield _out_of_range_fault(block, stimulus, standard, level)
                return
            if (reason := _presentation_problem(protocol, stimulus, value)) is not None:
                subject = (
                    f"a standard of {standard:g} at level {level:g} gives" if standard is not None else "the level"
                )
                yield Fault(("stimuli", str(block.stimulus), "levels"), f"{subject} {value:g}: {reason}")
                return
    yield from _check_adjustment(protocol, block)


def _standard_fault(
    protocol: Protocol, block: Block, stimulus: Stimulus, standard: float, level: float
) -> Fault | None:
    """Return a fault if a standard cannot be presented or equals the comparison at the smallest level."""
    place = ("stimuli", str(block.stimulus))
    if stimulus.vary in OF_CONDITION and not 0 <= standard <= OF_CONDITION[stimulus.vary]:
        permitted = f"choose a standard from 0 to {OF_CONDITION[stimulus.vary]:g}"
        return Fault((*place, "standards"), f"{standard:g} is not permitted for {stimulus.vary}", permitted)
    if (reason := _presentation_problem(protocol, stimulus, standard)) is not None:
        return Fault((*place, "standards"), f"{standard:g}: {reason}")
    least_difference = _LEAST_MS if stimulus.vary.endswith("_ms") else _LEAST_SHARE * (abs(standard) or 1.0)
    if (
        level == 0
        or stimulus.level_kind == "value"
        or abs(stimulus.comparison(standard, level) - standard) >= least_difference
    ):
        return None
    message = f"at level {level:g} the comparison equals the standard of {standard:g}, so the intervals do not differ"
    return Fault((*place, "levels"), message, f"the comparison must differ by at least {least_difference:g}")


def _out_of_range_fault(block: Block, stimulus: Stimulus, standard: float | None, level: float) -> Fault:
    """Return the fault that a number of the condition, such as a visual delay, is out of range."""
    place, value = ("stimuli", str(block.stimulus), "levels"), stimulus.comparison(standard, level)
    name, limit = stimulus.vary, OF_CONDITION[stimulus.vary]
    unit = " ms" if name.endswith("_ms") else ""
    permitted = f"at most {limit:g}" if value > 0 else "at least 0"
    if standard is None or stimulus.level_kind != "difference":
        return Fault(
            place,
            f"level {level:g} gives {value:g}{unit}, but {name} must be {permitted}",
            f"choose levels that give {permitted}{unit}",
        )
    above = "above" if stimulus.direction == "up" else "below"
    most = limit - standard if stimulus.direction == "up" else standard
    message = f"{level:g}{unit} {above} a standard of {standard:g} is {value:g}, but {name} must be {permitted}"
    return Fault(place, message, f"choose levels up to {most:g}")


def _presentation_problem(protocol: Protocol, stimulus: Stimulus, value: float) -> str | None:
    """Return the reason why a value of the varied number cannot be presented; None if it can."""
    if stimulus.vary in OF_CONDITION:
        return None
    try:
        override_value(protocol.scene_for(protocol.condition_of(stimulus)), stimulus.vary, value)
    except StudyError as error:
        return str(error)
    return None


def _check_design_and_method(protocol: Protocol, block: Block) -> Iterator[Fault]:
    """Yield faults for a design without a method or a method without a design."""
    design, place = protocol.design_of(block), ("blocks", block.id)
    if block.stimulus is None:
        if design.adjusts:
            message = "lets participants adjust a parameter, but the block does not vary one"
            yield Fault((*place, "design"), message, 'specify stimulus = "…" instead of conditions')
    elif design.adjusts and not protocol.method_of(block).adjusts:
        yield Fault(
            (*place, "method"), f'with "{block.design}" the participant sets the levels', 'method = "adjustment"'
        )
    elif protocol.method_of(block).adjusts and not design.adjusts:
        message = f'"{block.method}" is only for designs in which participants set the level, not for "{block.design}"'
        yield Fault((*place, "method"), message, 'design = "adjustment", or method = "constant"')


def _check_adjustment(protocol: Protocol, block: Block) -> Iterator[Fault]:
    """Yield a fault if a number cannot be adjusted during a presentation, or a standard cannot be matched."""
    design, stimulus = protocol.design_of(block), protocol.stimulus_of(block)
    if not design.adjusts:
        return
    for standard in protocol.standards_of(block):
        values = sorted(stimulus.comparison(standard, level) for level in stimulus.levels)
        if standard is not None and design.intervals > 1 and not values[0] < standard < values[1]:
            yield Fault(
                ("stimuli", str(block.stimulus), "levels"),
                f"the settings ({values[0]:g} to {values[1]:g}) do not bracket the standard, {standard:g}",
                'level = "value", with levels below and above the standard',
            )
            return
        if stimulus.vary != DELAY and not _can_change(protocol, protocol.condition_of(stimulus), stimulus.vary, values):
            yield Fault(
                ("methods", str(block.method), "step_size"),
                f'"{stimulus.vary}" cannot be changed during a presentation',
                "vary a parameter that can be changed, such as drag.coefficient, or use a different method",
            )
            return


def _can_change(protocol: Protocol, condition: str, vary: str, values: list[float]) -> bool:
    """Return whether the servo can change from each value to the next one while keeping its state.

    A delay of the force cannot change, since forces in transit belong to the previous delay.
    """
    from study_app.haptics.runtime.pack import is_built_alike  # noqa: PLC0415 - loads numpy

    if vary in OF_LINK:
        return False
    scenes = [protocol.presented_scene(Stimulated(condition, vary, value)) for value in values]
    return all(is_built_alike(scene, other) for scene, other in pairwise(scenes))
