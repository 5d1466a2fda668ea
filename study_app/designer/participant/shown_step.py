"""Which step of which session shows the selected element, and which of its pages."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final, Literal, NamedTuple, TypeAlias

from study_app.designer.participant.first_step import first_step
from study_app.protocol.model import Protocol
from study_app.protocol.orders.durations import variants
from study_app.protocol.orders.schedule import FormStep, PageStep, Step, Trial, build_schedule
from study_app.protocol.source.document import Path
from study_app.session.transitions.page_builder import PARTICIPANT, SEED, Preview, preview

Side: TypeAlias = Literal["tank", "questions"]

STANDALONE: Final = "standalone"
_SIDES: Final[dict[str, Side]] = {
    "liquids": "tank", "tasks": "tank", "stimuli": "tank", "methods": "tank",
    "questionnaires": "questions", "scales": "questions", "designs": "questions",
}  # fmt: skip
"""On which page of a trial the elements of a section are seen; others on either."""


class StepPosition(NamedTuple):
    """Where a preview is: a page, form or block by its id, which of the block's trials (from 1), language and seed.

    Without a name it is the first step that shows the selected element.
    """

    name: str = ""
    trial: int = 1
    language: str = ""
    seed: int = SEED


@dataclass(frozen=True, slots=True)
class Found:
    """A step of a session; ``session`` names the session where it is not the first participant's first, "" there."""

    shown: Preview
    index: int
    session: str = ""


def step_name(step: Step) -> str:
    """Return the id of a step's page, form or block."""
    return step.block if isinstance(step, Trial) else step.page_id if isinstance(step, PageStep) else step.form


def previews(study: Protocol) -> Iterator[tuple[str, Preview]]:
    """Yield each kind of session with what it is called: that of the first participant first, without a name."""
    first = preview(study)
    yield "", first
    for variant in variants(study):
        if variant.protocol != first.protocol:
            schedule = build_schedule(variant.protocol, PARTICIPANT, SEED)
            yield variant.name, replace(first, protocol=variant.protocol, schedule=schedule)


def showing(study: Protocol, path: Path) -> Found | None:
    """Return the first step that shows an element, None where none does.

    A page or questionnaire that is in no session is shown on its own.
    """
    for session, shown in previews(study):
        if (index := _index(shown, path)) is not None:
            return Found(shown, index, session)
    if len(path) > 1 and path[0] in {"pages", "questionnaires"}:
        name = str(path[1])
        shown = preview(study)
        step: Step | None = None
        if path[0] == "pages" and name in study.pages:
            step = PageStep(name)
        elif path[0] == "questionnaires" and name in study.questionnaires:
            step = FormStep(name, tuple(item.id for item in study.questionnaires[name].items))
        if step is not None:
            return Found(replace(shown, schedule=replace(shown.schedule, steps=(step,))), 0, STANDALONE)
    return None


def same_step(study: Protocol, name: str, trial: int, session: str) -> Found | None:
    """Return the step of a name, of a block the trial of that index or its last; None where it is no longer there."""
    for called, shown in previews(study):
        if called != session:
            continue
        named = [(at, step) for at, step in enumerate(shown.schedule.steps) if step_name(step) == name]
        exact = [at for at, step in named if isinstance(step, Trial) and step.index == trial]
        if named:
            return Found(shown, (exact or [named[-1][0] if trial > 1 else named[0][0]])[0], session)
    return None


def side_of(path: Path) -> Side | None:
    """Return on which page of a trial an element is seen; None: on either."""
    return _SIDES.get(str(path[0])) if path else None


def _index(shown: Preview, path: Path) -> int | None:
    index = first_step(shown, path)
    return index if index or _is_first(shown, path) else None


def _is_first(shown: Preview, path: Path) -> bool:
    """Return whether the first step is about an element: `first_step` returns it for what no step shows, too."""
    first = shown.schedule.steps[0]
    alone = replace(shown, schedule=replace(shown.schedule, steps=(PageStep(""), first)))
    return first_step(alone, path) == 1
