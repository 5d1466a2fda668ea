"""The transition table, row by row: refused where there is no row."""

from dataclasses import replace

import pytest

from study_app.errors import SessionError
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.session.pages import EndPage, QuestionnairePage, TaskPage, TextPage, TroublePage
from study_app.session.transitions.events import (
    ForceStopped,
    Rest,
    StartTrial,
    StopForce,
    StopTrial,
    Write,
    WriteCompleted,
    WriteFailed,
    WriteRetried,
)
from study_app.session.transitions.moves import STOPPABLE
from study_app.session.transitions.state import FINAL, Phase
from study_app.session.transitions.table import advance, open_session
from tests.session import small
from tests.session.transitions.states import LEFT, shown, state_in


def test_a_session_goes_through_its_schedule_and_ends_complete() -> None:
    state, pages, trials = small.opened(), [], []
    while state.phase not in FINAL:
        state, commands = advance(state, small.next_event(state, 1.0))
        page = shown(commands)
        if page is not None:
            pages.append(page)
        trials += [
            command.line.fields() for command in commands if isinstance(command, Write) and hasattr(command.line, "of")
        ]
    assert state.phase is Phase.COMPLETE
    assert [type(page) for page in pages] == [
        TextPage,
        TaskPage,  # practice: no questionnaire
        *[TaskPage, QuestionnairePage] * 2,
        TaskPage,  # baseline: no questionnaire
        *[TaskPage, QuestionnairePage] * 2,
        TextPage,
        EndPage,
    ]
    goodbye, end = pages[-2:]
    assert (end.title, end.paragraph) == (goodbye.title, "The session is complete."), "one goodbye, not two"
    schedule = state.plan.schedule
    assert [trial["code"] for trial in trials] == [trial.code for trial in schedule.trials]
    assert [trial["trial"] for trial in trials] == [1, 2, 3, 4, 5, 6]
    assert trials[1] == {
        "trial": 2,
        "attempt": 1,
        "block": "feeling",
        "phase": "main",
        "part": 1,
        "index": 1,
        "of": 2,
        "code": schedule.trials[1].code,
    }


def test_a_delayed_trial_starts_with_its_delay_and_its_page_says_nothing_of_it() -> None:
    state, delays, pages = small.opened(), {}, []
    while state.phase not in FINAL:
        state, commands = advance(state, small.next_event(state, 1.0))
        if isinstance(shown(commands), TaskPage) and state.trial.block == "seeing":
            (start,) = [command for command in commands if isinstance(command, StartTrial)]
            delays[state.trial.code] = start.delay_s
            pages.append(replace(shown(commands), trial=0, progress=None))
    key = small.opened().plan.key["seeing"]
    late = small.ODD_DELAY_MS / 1000
    assert delays == {code: late if condition == "is_late" else 0.0 for code, condition in key.items()}
    assert pages == pages[:1] * 2


@pytest.mark.parametrize("phase", [phase for phase in Phase if phase is not Phase.STALLED])
def test_a_disk_that_takes_nothing_stops_the_force_and_keeps_what_is_left_from_every_phase(phase: Phase) -> None:
    before = state_in(phase)
    stalled, commands = advance(before, WriteFailed(9.0, "disk full", (LEFT,)))
    assert commands[:3] == (StopForce(), StopTrial(), Rest())
    assert isinstance(shown(commands), EndPage if phase in FINAL else TroublePage)
    assert (stalled.phase, stalled.over) == (Phase.STALLED, phase in FINAL)
    assert advance(stalled, WriteRetried(9.0)) == (stalled, (LEFT,))
    after, commands = advance(stalled, WriteCompleted(10.0))
    if phase in STOPPABLE:
        assert (after, commands) == advance(before, ForceStopped(10.0, "program"))
    else:
        assert (after, commands) == (before, ())


def test_a_language_that_the_study_is_not_written_in_is_refused(protocol: Protocol) -> None:
    with pytest.raises(SessionError, match="written in en"):
        open_session(protocol, build_schedule(protocol, "P001", 1), {}, "nl")


def test_nothing_that_is_printed_names_a_condition_a_liquid_or_a_delay() -> None:
    state, printed = small.opened(), []
    while state.phase not in FINAL:
        state, commands = advance(state, small.next_event(state, 1.0))
        page = shown(commands)
        printed.append(f"{state!r} {commands!r} {page!r} {page}")
        printed += [str(command.line.fields()) for command in commands if isinstance(command, Write)]
    text = " ".join(printed)
    words = ["is_thin", "is_thick", "on_time", "is_late", "0.137", "137", "1013", "1450"]
    assert [word for word in words if word in text] == []
