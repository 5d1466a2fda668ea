"""What is planned: the blocks of a protocol, what their conditions feel like, and what was decided to be tested."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from study_app.analysis.tables import planned_analysis as decided
from study_app.analysis.tables.compared_blocks import Item, Kind, spoken
from study_app.analysis.tables.planned_analysis import Decided
from study_app.errors import AnalysisError
from study_app.protocol.blocks import Block
from study_app.protocol.groups import groups_with
from study_app.protocol.model import Protocol
from study_app.protocol.questions import POINTS, Question
from study_app.protocol.simulated_observer import OPINIONS, TrialFeatures
from study_app.protocol.table import text_in

ConditionFeatures: TypeAlias = Mapping[tuple[str, str], Sequence[TrialFeatures]]
"""(Block, condition) → what was felt there in rehearsed trials."""


@dataclass(frozen=True)
class Planned:
    """A main block that asks something.

    ``names`` are of its settings, in the order of the tests: delays ascending. ``delays_ms`` is None where liquids are
    compared. ``felt`` has what was felt in each setting. ``groups`` are those that have the block, where not all do.
    """

    id: str
    title: str
    kind: Kind
    names: tuple[str, ...]
    delays_ms: tuple[float, ...] | None
    items: tuple[Item, ...]
    felt: tuple[tuple[TrialFeatures, ...], ...]
    repetitions: int
    groups: tuple[str, ...] = ()

    @property
    def k(self) -> int:
        """How many settings there are."""
        return len(self.names)


@dataclass(frozen=True)
class Plan:
    """A study that is planned."""

    name: str
    title: str
    version: str
    blocks: tuple[Planned, ...]
    decided: Decided

    @property
    def unknown(self) -> tuple[str, ...]:
        """The items that the answer model knows nothing of, so that no effect on them is simulated."""
        return tuple(item.id for block in self.blocks for item in block.items if item.id not in OPINIONS)


def plan(protocol: Protocol, felt: ConditionFeatures) -> Plan:
    """Return what can be planned of a protocol.

    Raises
    ------
    AnalysisError
        No block of it compares settings and asks about them.
    """
    language = spoken({"study": {"languages": protocol.study.languages}})
    asked = _compared(protocol)
    if not asked:
        raise AnalysisError(
            f"{protocol.study.name} compares nothing: power needs a main block of two or more conditions and a "
            "questionnaire with statements"
        )
    table = None if protocol.analysis is None else protocol.analysis.model_dump(mode="json")
    return Plan(
        protocol.study.name,
        text_in(protocol.study.title, language),
        protocol.study.version,
        tuple(_planned(protocol, block, felt, language) for block in asked),
        decided.read([table]),
    )


def compares_statements(protocol: Protocol) -> bool:
    """Return whether a main block compares conditions by statements."""
    return bool(_compared(protocol))


def _compared(protocol: Protocol) -> list[Block]:
    return [block for block in protocol.main_blocks if _statements(protocol, block) and len(block.conditions) > 1]


def _planned(protocol: Protocol, block: Block, felt: ConditionFeatures, language: str) -> Planned:
    conditions = list(block.conditions)
    delays = {name: protocol.conditions[name].delay_ms for name in conditions}
    kind = protocol.compared_in(block.id)
    assert kind is not None  # noqa: S101 - a main block
    having = groups_with(protocol, block.id)
    if kind == "delays":
        conditions.sort(key=delays.__getitem__)
    return Planned(
        id=block.id,
        title=text_in(block.title, language),
        kind=kind,
        names=tuple(f"{delays[name]:g} ms" if kind == "delays" else name.replace("_", " ") for name in conditions),
        delays_ms=tuple(delays[name] for name in conditions) if kind == "delays" else None,
        items=tuple(
            Item(item.id, text_in(item.text, language), text_in(item.short, language))
            for item in _statements(protocol, block)
        ),
        felt=tuple(tuple(felt[block.id, name]) for name in conditions),
        repetitions=block.repetitions,
        groups=having if len(having) < len(protocol.groups) else (),
    )


def _statements(protocol: Protocol, block: Block) -> tuple[Question, ...]:
    """Return the statements that a block asks about; power is planned for no other questions."""
    questionnaire = protocol.questionnaire_of(block.id)
    return () if questionnaire is None else questionnaire.statements


LOWEST, HIGHEST = 1, POINTS
