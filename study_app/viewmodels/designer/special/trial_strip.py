"""One trial of a block with a design: its intervals, pauses, question and feedback, with their durations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from study_app.authoring.edited_study import Study
from study_app.authoring.fields import Row
from study_app.protocol.orders.durations import ANSWER_S, CHOICE_S
from study_app.protocol.trials.design import ORDINALS
from study_app.protocol.trials.methods.adjustment import Adjustment
from study_app.protocol.trials.tracks import design_of, method_of
from study_app.viewmodels.designer.form.row_facts import RowFacts

PhaseKind: TypeAlias = Literal["interval", "pause", "question", "feedback"]


@dataclass(frozen=True, slots=True)
class Phase:
    """A phase of a trial: what it is, its name, what is written in its picture, and how long it takes [s]."""

    kind: PhaseKind
    name: str
    words: str
    duration_s: float
    about: bool = False

    @property
    def duration(self) -> str:
        """The duration in words."""
        return f"{'about ' if self.about else ''}{self.duration_s:.3g} s"


@dataclass(frozen=True, slots=True)
class TrialStrip:
    """A trial: its phases, and how long it takes with the pause after it [s]."""

    phases: tuple[Phase, ...]
    duration_s: float

    @property
    def sentence(self) -> str:
        """The trial in a sentence."""
        listed = ", ".join(f"{phase.name} {phase.duration}" for phase in self.phases)
        return f"One trial of {self.duration_s:.3g} s: {listed}."


def trial_strip(study: Study, row: Row) -> TrialStrip | None:
    """Return a trial of a block with a design; None where the study has faults."""
    protocol = study.formed
    block = None if protocol is None else protocol.blocks.get(str(row.path[1]))
    if protocol is None or block is None or block.design is None:
        return None
    design, task = design_of(protocol, block), protocol.tasks[block.task]
    phases: list[Phase] = []
    free = task.expected_s != task.limit_s
    for number in range(design.intervals):
        if number:
            phases.append(Phase("pause", "Pause", "", design.pause_s))
        words = ORDINALS[number] if design.intervals > 1 else ""
        phases.append(Phase("interval", "Interval", words, task.expected_s, free))
    method = method_of(protocol, block) if block.stimulus is not None else None
    if isinstance(method, Adjustment):
        phases.append(Phase("question", "Setting", "", method.most_s / 2, about=True))
    else:
        reply_s = CHOICE_S if design.reply == "choice" else ANSWER_S
        phases.append(Phase("question", "Question", design.reply, reply_s, about=True))
    if design.shows_feedback(block.phase == "practice"):
        phases.append(Phase("feedback", "Feedback", "", design.feedback_s))
    whole_s = sum(phase.duration_s for phase in phases) + design.between_s
    return TrialStrip((*phases, Phase("pause", "Inter-trial", "", design.between_s)), whole_s)


FACTS: Final = RowFacts((("Block", "design"),), trial_strip)
