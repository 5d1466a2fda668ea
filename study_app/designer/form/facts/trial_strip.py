"""One trial of a block with a design: its intervals, pauses, question and feedback, with their durations."""

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from study_app.designer.document.edited_study import Study
from study_app.designer.document.fields import Row, label_of
from study_app.designer.form.row_facts import RowFacts
from study_app.number_text import duration, exact_duration
from study_app.protocol.model import Follow, Reach
from study_app.protocol.orders.durations import ANSWER_S, CHOICE_S
from study_app.protocol.source.document import Path
from study_app.protocol.trials.designs import ORDINALS
from study_app.protocol.trials.methods import Adjustment
from study_app.protocol.trials.tasks import AnyTask
from study_app.protocol.trials.tracks import design_of, method_of

PhaseKind: TypeAlias = Literal["interval", "pause", "question", "feedback"]


@dataclass(frozen=True, slots=True)
class Phase:
    """A phase of a trial.

    Attributes
    ----------
    kind : {"interval", "pause", "question", "feedback"}
        What it is.
    name, words : str
        Its name, and what is written in its picture.
    duration_s : float
        How long it takes [s].
    field : tuple of str or int
        Where the file says so; () where the program does.
    about : bool
        Whether it takes about as long.
    """

    kind: PhaseKind
    name: str
    words: str
    duration_s: float
    field: Path = ()
    about: bool = False

    @property
    def opens(self) -> str:
        """The label of its field; "" where it has none."""
        return label_of(self.field[-1]) if self.field else ""

    @property
    def duration(self) -> str:
        """The duration in words."""
        exact = not self.about and bool(self.field) and str(self.field[-1]).endswith("_s")
        found = exact_duration(self.duration_s, self.duration_s) if exact else duration(self.duration_s, tenths=True)
        return f"{'about ' if self.about else ''}{found}"


@dataclass(frozen=True, slots=True)
class TrialStrip:
    """A trial: its phases, and how long it takes with the pause after it [s]."""

    phases: tuple[Phase, ...]
    duration_s: float

    @property
    def sentence(self) -> str:
        """The trial in a sentence."""
        listed = ", ".join(f"{phase.name} {phase.duration}" for phase in self.phases)
        return f"One trial of {self.duration}: {listed}."

    @property
    def duration(self) -> str:
        """How long it takes, in words."""
        return duration(self.duration_s, tenths=True)


def trial_strip(study: Study, row: Row) -> TrialStrip | None:
    """Return a trial of a block with a design; None where the study has faults."""
    protocol = study.formed
    block = None if protocol is None else protocol.blocks.get(str(row.path[1]))
    if protocol is None or block is None or block.design is None:
        return None
    design, task = design_of(protocol, block), protocol.tasks[block.task]
    phases: list[Phase] = []
    free = task.expected_s != task.limit_s

    def of_design(key: str) -> Path:
        return ("designs", str(block.design), key) if block.design in protocol.designs else ()

    for number in range(design.intervals):
        if number:
            phases.append(Phase("pause", label_of("pause_s"), "", design.pause_s, of_design("pause_s")))
        words = ORDINALS[number] if design.intervals > 1 else ""
        phases.append(Phase("interval", "Interval", words, task.expected_s, ("tasks", block.task, _length(task)), free))
    method = method_of(protocol, block) if block.stimulus is not None else None
    if isinstance(method, Adjustment):
        field = ("methods", str(block.method), "most_s") if block.method in protocol.methods else ()
        phases.append(Phase("question", "Setting", "", method.most_s / 2, field, about=True))
    else:
        reply_s = CHOICE_S if design.reply == "choice" else ANSWER_S
        phases.append(Phase("question", "Question", design.reply, reply_s, of_design("question"), about=True))
    if design.shows_feedback(block.phase == "practice"):
        phases.append(Phase("feedback", "Feedback", "", design.feedback_s, of_design("feedback_s")))
    phases.append(Phase("pause", label_of("between_s"), "", design.between_s, of_design("between_s")))
    return TrialStrip(tuple(phases), sum(phase.duration_s for phase in phases))


def _length(task: AnyTask) -> str:
    """Return the key that says how long a task takes."""
    if isinstance(task, Reach):
        return "duration_s" if task.count is None else "count"
    return "cycles" if isinstance(task, Follow) else "max_s"


FACTS: Final = RowFacts((("Block", "design"),), trial_strip)
