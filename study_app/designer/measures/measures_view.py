"""What the tab Measures shows for the selected element, and the cards below the other tabs."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from study_app.designer.document.study import Study
from study_app.designer.document.study_facts import Facts
from study_app.designer.measures import session_cards as cards
from study_app.designer.measures.level_plots import (
    Controls,
    forces_plot,
    function_plot,
    level_block,
    number_cards,
    track_plot,
)
from study_app.designer.measures.level_words import LevelWords, rounded
from study_app.designer.measures.number_cards import Card, ControlValues, LinesCard, MeasuresView, people
from study_app.designer.measures.planned import Simulated
from study_app.designer.measures.valid_part import valid_part
from study_app.designer.problems.problems import ProblemRow
from study_app.protocol.blocks import Block
from study_app.protocol.checks.expected_precision import ThresholdPlan, threshold_plan
from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import order_of
from study_app.protocol.source.document import Path

BELOW: Final = 4
"""So many cards stay below the other tabs."""
_NAMED_BY: Final = {"stimuli": "stimulus", "methods": "method", "designs": "design", "questionnaires": "questionnaire",
                    "tasks": "task"}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Focus:
    """What the measures are of: the block, and what its tracks are simulated by; None where it has none.

    Attributes
    ----------
    block : Block or None
        The selected block, or the first one that uses what is selected.
    plan : ThresholdPlan or None
        What decides how precise its thresholds are.
    compares : bool
        Whether its statements compare conditions, so that studies of it are simulated.
    """

    block: Block | None = None
    plan: ThresholdPlan | None = None
    compares: bool = False


def focus_of(protocol: Protocol | None, path: Path) -> Focus:
    """Return what the measures of an element are of."""
    if protocol is None or len(path) < 2:
        return Focus()
    block = protocol.blocks.get(str(path[1])) if path[0] == "blocks" else None
    if (key := _NAMED_BY.get(str(path[0]))) is not None:
        users = [one for one in protocol.blocks_in_order if getattr(one, key) == path[1]]
        block = next((one for one in users if one.phase == "main"), next(iter(users), None))
    if block is None:
        return Focus()
    questionnaire = protocol.questionnaire_of(block.id)
    statements = () if questionnaire is None else questionnaire.statements
    compares = block.phase == "main" and bool(statements) and len(block.conditions) > 1
    return Focus(block, threshold_plan(protocol, block), compares)


def control_values(protocol: Protocol | None, focus: Focus, controls: Controls) -> ControlValues:
    """Return what the controls show: threshold and lapses only where observers are simulated."""
    unit = "planned" if controls.planned == controls.participants else f"({controls.planned or 'none'} planned)"
    values = ControlValues(controls.participants, unit)
    if protocol is None or focus.plan is None:
        return values
    words = LevelWords(focus.plan.stimulus, focus.plan.design)
    return replace(
        values, threshold=words.number(controls.threshold), threshold_words=f"simulated {words.name}",
        threshold_unit=words.unit, lapses=rounded(100 * controls.lapses),
    )  # fmt: skip


def measures_view(
    study: Study,
    facts: Facts,
    path: Path,
    controls: Controls,
    simulated: Simulated,
    problems: Mapping[ProblemRow, tuple[str, ...]],
    parts: int | None = None,
) -> MeasuresView:
    """Return what is shown of the selected element.

    Parameters
    ----------
    study : Study
        The study.
    facts : Facts
        Its facts.
    path : tuple of str or int
        The selected element.
    controls : Controls
        What is simulated.
    simulated : Simulated
        What simulations answered.
    problems : mapping
        The problems of the study, each with the words of its repairs as far as they were found.
    parts : int, optional
        On how many parts the questions stand on a small screen, where that is known.
    """
    valid = valid_part(study)
    protocol, focus = valid.protocol, focus_of(valid.protocol, path)
    block, values = focus.block, control_values(protocol, focus, controls)
    blocks = None
    if protocol is not None:
        words = {one.id: _measured(protocol, one) for one in protocol.blocks_in_order}
        shown_of = "" if block is None else block.id
        blocks = cards.blocks_card(study, protocol, facts, path, words, shown_of)
    of = None if protocol is None or block is None else level_block(protocol, block, forces=valid.forces)
    if protocol is not None and block is not None and of is not None and focus.plan is not None:
        numbers = number_cards(
            of, simulated, controls, facts.steps_s.get(block.id, 0.0), order_of(protocol, block),
        )  # fmt: skip
        return MeasuresView(
            values, numbers, function_plot(of, simulated), track_plot(of, simulated),
            forces_plot(of, problems), (), tuple(_others(study, facts, path, simulated)), simulated.waiting,
            bool(simulated.failed), blocks=blocks,
        )  # fmt: skip
    shown = tuple(_cards(study, facts, path, focus, controls, simulated, parts))
    forces = None if of is None else forces_plot(of, problems)
    return MeasuresView(
        values, forces=forces, cards=shown, below=shown[:BELOW], waiting=simulated.waiting, blocks=blocks
    )


def _measured(protocol: Protocol, block: Block) -> str:
    """Return what a block measures."""
    focus = focus_of(protocol, ("blocks", block.id))
    if focus.plan is None:
        return "smallest differences" if focus.compares else ""
    return f"{LevelWords(focus.plan.stimulus, focus.plan.design).name}s"


def _others(study: Study, facts: Facts, path: Path, simulated: Simulated) -> list[Card]:
    session: list[Card] = [cards.session_card(study, facts, path)]
    warned = cards.warnings_card(facts, simulated.warnings)
    return session if warned is None else [*session, warned]


def _cards(
    study: Study, facts: Facts, path: Path, focus: Focus, controls: Controls, simulated: Simulated, parts: int | None
) -> list[Card]:
    """Return the cards of an element without simulated tracks, those that concern it first."""
    valid, block = valid_part(study), focus.block
    protocol = valid.protocol
    asked = path[0] == "questionnaires" and protocol is not None and path[1:2] and path[1] in protocol.questionnaires
    found: list[Card] = [cards.session_card(study, facts, path, None if asked else parts)]
    if protocol is None:
        return found if study.unreadable else [*found, cards.texts_card(study)]
    if asked:
        found = [cards.questions_card(protocol, str(path[1]), parts), cards.texts_card(study), *found]
    if block is not None and (
        balance := cards.balance_card(study, protocol, block, controls.participants, controls.planned)
    ):
        found.append(balance)
    if block is not None and focus.compares:
        known = simulated.detectable
        who = people(controls.participants if known is None else known.participants, controls.planned)
        found.append(cards.detectable_card(study, block, who, simulated))
    found.append(cards.force_card(study, facts, protocol, _liquids(protocol, path, block)))
    if path[0] == "liquids" and len(path) > 1 and path[1] in protocol.liquids and valid.forces:
        found.insert(0, cards.effects_card(study, protocol, str(path[1])))
    if block is not None and path[0] == "blocks":
        found.append(cards.block_card(study, facts, protocol, block))
    if not asked:
        found.append(cards.texts_card(study))
    warned: LinesCard | None = cards.warnings_card(facts, simulated.warnings)
    return found if warned is None else [*found, warned]


def _liquids(protocol: Protocol, path: Path, block: Block | None) -> list[str]:
    """Return the liquids of an element, of most elements all."""
    if path[0] == "liquids" and len(path) > 1 and path[1] in protocol.liquids:
        return [str(path[1])]
    names = () if block is None else protocol.conditions_in(block.id)
    if path[0] == "conditions" and len(path) > 1 and path[1] in protocol.conditions:
        names = (str(path[1]),)
    found = dict.fromkeys(liquid for name in names for liquid in protocol.conditions[name].liquid_ids)
    return list(found) or list(protocol.liquids)
