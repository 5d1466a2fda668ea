"""Warnings about questions: display conditions without effect, rankings of trials in random order, preferences."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import order_of
from study_app.protocol.questionnaires import Questionnaire
from study_app.protocol.questions import Context, Question, Rated, ShowIf


def question_warnings(protocol: Protocol) -> Iterator[str]:
    """Yield warnings about questions that are valid but may be mistakes, one sentence each."""
    for name, questionnaire in protocol.questionnaires.items():
        yield from _ineffective_conditions(protocol, name, questionnaire)
    yield from dict.fromkeys(_ranked_trials(protocol))
    yield from _compared_conditional_items(protocol)
    yield from _preferences(protocol)


def _ineffective_conditions(protocol: Protocol, name: str, questionnaire: Questionnaire) -> Iterator[str]:
    """Yield warnings about bounds of display conditions that every number satisfies, or none."""
    context = questionnaire.context(protocol.scales, protocol.study.languages[0])
    questions = {item.id: item for item in questionnaire.items}
    for number, item in enumerate(questionnaire.items, start=1):
        rule = item.show_if
        if rule is None or rule.permitted or (ends := questions[rule.item].bounds(context)) is None:
            continue
        low, high = ends
        place = f"questionnaires.{name}.items.{number}.show_if"
        bounds = {"at_least": rule.at_least, "at_most": rule.at_most}
        stated = " and ".join(f"{key} = {value:g}" for key, value in bounds.items() if value is not None)
        numbers = f'answers to "{rule.item}" are {low:g} to {high:g}'
        if (rule.at_most is not None and rule.at_most < max(low, _or(rule.at_least, low))) or (
            rule.at_least is not None and rule.at_least > high
        ):
            yield f"{place}: {numbers}, so with {stated} this item is never shown"
        elif _includes_all_numbers(rule, low, high) and not _is_shown_to_some(
            questions[rule.item], rule, ends, context
        ):
            yield f"{place}: {numbers}, so {stated} includes all of them and the condition has no effect"


def _or(value: float | None, default: float) -> float:
    return default if value is None else value


def _includes_all_numbers(rule: ShowIf, low: float, high: float) -> bool:
    return _or(rule.at_least, low) <= low and _or(rule.at_most, high) >= high


def _is_shown_to_some(earlier: Question, rule: ShowIf, ends: tuple[float, float], context: Context) -> bool:
    """Return whether bounds equal to the ends hide an item from participants who did not answer with a number."""
    can_abstain = isinstance(earlier, Rated) and earlier.scale_of(context).cannot_judge is not None
    has_exact_bounds = {rule.at_least, rule.at_most} <= {None, *ends}
    return has_exact_bounds and (can_abstain or not earlier.required or earlier.show_if is not None)


def _ranked_trials(protocol: Protocol) -> Iterator[str]:
    """Yield warnings about options that number the trials of a block whose order differs between participants."""
    for steps in protocol.every_session():
        block: Block | None = None
        for step in steps:
            block = protocol.blocks.get(step, block)
            if step not in protocol.questionnaires or block is None or not _has_random_order(block):
                continue
            trials = order_of(protocol, block).trials
            asked = protocol.questionnaires[step]
            context = asked.context(protocol.scales, protocol.study.languages[0])
            for number, item in enumerate(asked.items, start=1):
                options = [*item.levels(context).values()] if item.value_type == "text" else []
                if len(options) == trials and _are_numbered(options):
                    yield (
                        f"questionnaires.{step}.items.{number}.options: “{options[0]}” is a different condition for "
                        f"each participant, because the order of block {block.id} is {block.order}, so counts across "
                        f'participants mean nothing; write order = "fixed" in the block, or name the conditions'
                    )


def _has_random_order(block: Block) -> bool:
    return block.design is None and block.order != "fixed" and len(block.conditions) > 1


def _are_numbered(options: list[str]) -> bool:
    """Return whether options are one text with consecutive numbers, such as "Trial 1" and "Trial 2"."""
    found = [re.fullmatch(r"(.*?)\s*(\d+)", option) for option in options]
    prefixes = {match[1] for match in found if match}
    return len(prefixes) == 1 and [match and int(match[2]) for match in found] == [*range(1, len(options) + 1)]


def _compared_conditional_items(protocol: Protocol) -> Iterator[str]:
    """Yield warnings about hypotheses on items that are shown only after certain answers."""
    for number, contrast in enumerate(() if protocol.analysis is None else protocol.analysis.contrasts, start=1):
        asked = (
            [protocol.questionnaire_of(block) for block in contrast.blocks]
            if contrast.form is None
            else [protocol.questionnaires[contrast.form]]
        )
        rules: Mapping[str, ShowIf] = {
            item.id: item.show_if
            for questionnaire in asked
            if questionnaire
            for item in questionnaire.items
            if item.show_if is not None
        }
        if (rule := rules.get(contrast.measure)) is not None:
            both = "" if contrast.within is None else " both times"
            yield (
                f"analysis.contrasts.{number}.measure: {contrast.measure} depends on the answer to {rule.item}, so "
                f"only participants to whom it is shown{both} are compared"
            )


def _preferences(protocol: Protocol) -> Iterator[str]:
    """Yield warnings about a forced choice between conditions with the study's own question."""
    for block in protocol.main_blocks:
        if block.design is None or block.standard is None:
            continue
        design = protocol.design_of(block)
        if design.asks_for_more and design.question is not None:
            yield (
                f"designs.{block.design}.question: the report counts an answer as correct if it is not the interval "
                f"with the standard {block.standard}; if the question asks for a preference, d′ = 0 means that both "
                "are equally liked, and a negative d′ that the standard is preferred"
            )
