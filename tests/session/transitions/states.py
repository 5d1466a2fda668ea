"""A session in each of its phases, an event of each kind, and what a transition commands."""

from functools import cache
from typing import Any

from study_app.session.transitions import events
from study_app.session.transitions.events import (
    Broke,
    Chosen,
    EndRequested,
    Event,
    ForceStopped,
    ItemShown,
    LanguageChosen,
    Note,
    PauseRequested,
    Reconnected,
    RepeatRequested,
    ResumeRequested,
    Retracted,
    ShowPage,
    Stepped,
    TaskDone,
    Write,
    WriteFailed,
)
from study_app.session.transitions.state import Phase, SessionState
from study_app.session.transitions.table import advance
from tests.journal_lines import event_of as line_of
from tests.session import pairs, small

EVENTS = tuple(kind for kind in vars(events).values() if isinstance(kind, type) and Event in kind.__bases__)
LEFT = Write(line_of("choice", trial=2, item="liquid", value=5), waits=True)


@cache
def state_in(phase: Phase) -> SessionState:
    """Return a session in that phase, in its first main trial if the phase has one."""
    if phase is Phase.OPENING:
        return small.opened()
    if phase is Phase.COMPLETE:
        return small.walk(small.opened(), Phase.COMPLETE)
    answering = small.walk(small.opened(), Phase.ANSWERING)
    match phase:
        case Phase.READING:
            return small.walk(small.opened(), Phase.READING)
        case Phase.TASK:
            return small.walk(small.opened(), Phase.TASK, times=2)
        case Phase.ANSWERING:
            for item in answering.trial.items:
                answering, _ = advance(answering, Chosen(9.0, item, 5))
            return answering
        case Phase.RESTING:
            return pairs.walk(pairs.opened(), Phase.RESTING)
        case Phase.FEEDBACK:
            return pairs.walk(pairs.opened(), Phase.FEEDBACK)
        case Phase.PAUSED:
            return advance(answering, PauseRequested(9.0, "operator"))[0]
        case Phase.STALLED:
            return advance(answering, WriteFailed(9.0, "disk full", (LEFT,)))[0]
        case Phase.TROUBLE:
            return advance(answering, Broke(9.0, "cable", "device"))[0]
        case _:
            return advance(answering, EndRequested(9.0, "withdrawn", ""))[0]


def event_of(kind: type[Any]) -> Any:
    """Return a valid event of that kind."""
    more: dict[type[Any], tuple[Any, ...]] = {
        TaskDone: ("complete", {"duration_s": 2.0}),
        Stepped: (1,),
        ItemShown: ("liquid",),
        Chosen: ("liquid", 3),
        Retracted: ("liquid",),
        LanguageChosen: ("en",),
        PauseRequested: ("participant",),
        ResumeRequested: ("operator",),
        ForceStopped: ("device",),
        Note: ("note", "spilled, coffee"),
        RepeatRequested: ("a call",),
        EndRequested: ("aborted", "fire drill"),
        Broke: ("no sample for 50 ms",),
        WriteFailed: ("disk full", ()),
        Reconnected: ({"name": "memory"},),
    }
    return kind(50.0, *more.get(kind, ()))


def written(commands: tuple[Any, ...]) -> list[str]:
    return [command.line.event for command in commands if isinstance(command, Write)]


def shown(commands: tuple[Any, ...]) -> Any:
    return next((command.page for command in commands if isinstance(command, ShowPage)), None)
