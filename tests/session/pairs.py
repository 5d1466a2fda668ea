"""A study of pairs, with practice to a criterion and feedback, and the steps to walk through it."""

from typing import Any

from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.session.resume import FIRST, Start
from study_app.session.transitions.events import Begin, Chosen, Continue, Finish, Submitted, TaskDone, TimeUp, Write
from study_app.session.transitions.state import FINAL, Phase, SessionState
from study_app.session.transitions.table import advance, initial_state
from tests.protocol.trials.level_studies import BLOCK, HEAD, SECRET, key_of, study

PRACTICE = """
[pages.rest]
kind = "break"
title = "Break"
body = "Have a rest."

[blocks.training]
phase = "practice"
title = "Training"
setting_label = "Pair"
task = "stir"
stimulus = "viscosity"
standards = [1]
design = "2ifc"
method = "few"
break_every = 2
break_page = "rest"
until = { right = 2, of = 3 }
"""
EDITS = (('sequence = ["viscosity"]', 'sequence = ["training", "viscosity"]'), ("repetitions = 8", "repetitions = 2"))


def short_text() -> str:
    """Return the study as the text of a file, with few trials and tasks of a third of a second."""
    text = HEAD + BLOCK + PRACTICE
    for old, new in (*EDITS, ("repetitions = 2", "repetitions = 1"), ("right = 2, of = 3", "right = 1, of = 1")):
        assert old in text
        text = text.replace(old, new)
    return text.replace("min_s = 1", "min_s = 0.3")


def protocol(*edits: tuple[str, str], more: str = PRACTICE) -> Protocol:
    """Return the study with edits of its text."""
    return study(*EDITS, *edits, more=more)


def opened(one: Protocol | None = None, *, start: Start = FIRST, secret: bytes = SECRET) -> SessionState:
    """Return a session before its first event."""
    one = protocol() if one is None else one
    key = key_of(one, secret)
    return initial_state(one, build_schedule(one, "P001", 1), key.codes, "en", start, key.secret)


def answer_of(state: SessionState, right: bool = True) -> str:
    """Return a correct or an incorrect answer to the current trial."""
    assert state.design is not None
    assert state.due is not None
    correct = state.design.correct(state.due.arrangement)
    assert correct is not None
    return correct if right else next(answer for answer in state.design.answers if answer != correct)


def next_event(state: SessionState, at_s: float, right: bool = True) -> Any:
    """Return the event that advances a session without incidents by one step."""
    match state.phase:
        case Phase.OPENING:
            return Begin(at_s)
        case Phase.READING:
            return Continue(at_s)
        case Phase.TASK:
            return TaskDone(at_s, "complete", {"duration_s": 1.5, "worst_gap_ms": 1.0, "overruns": 1})
        case Phase.RESTING | Phase.FEEDBACK:
            return TimeUp(max(at_s, state.until_s or 0.0))
        case Phase.ANSWERING:
            item = state.items[0]
            return Submitted(at_s) if item in state.answers else Chosen(at_s, item, answer_of(state, right))
        case _:
            raise AssertionError(state.phase)


def walk(state: SessionState, until: Phase, *, times: int = 1, right: bool = True) -> SessionState:
    """Walk on without incidents until ``until`` was entered ``times`` times."""
    at_s = state.since_s
    while times:
        before = state.phase, state.index, state.interval
        state, _ = advance(state, next_event(state, at_s, right))
        at_s += 100.0
        times -= state.phase is until and (state.phase, state.index, state.interval) != before
    return state


def whole(state: SessionState, right: bool = True) -> list[dict[str, Any]]:
    """Return the journal's lines of a session without incidents, to its end."""
    lines: list[dict[str, Any]] = []
    at_s = 0.0
    while state.phase not in FINAL:
        state, commands = advance(state, next_event(state, at_s, right))
        lines += [
            {"event": command.line.event, "t_s": at_s, **command.line.fields()}
            for command in commands
            if isinstance(command, Write)
        ]
        lines += [{"event": "end", "status": command.status} for command in commands if isinstance(command, Finish)]
        at_s += 100.0
    return lines
