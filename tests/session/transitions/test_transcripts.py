"""What each event of a session commands: whole sequences, as files that people review."""

from pathlib import Path
from typing import Any

import pytest

from study_app.errors import SessionError
from study_app.protocol.load import load
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.source.table import text_in
from study_app.session.pages import EndPage, TroublePage
from study_app.session.resume import FIRST
from study_app.session.transitions.events import (
    Begin,
    Continue,
    FadeIn,
    ForceStopped,
    LanguageChosen,
    PauseRequested,
    Rest,
    ResumeRequested,
    StopForce,
    StopTrial,
    Write,
    WriteCompleted,
    WriteFailed,
    WriteRetried,
    WriteTables,
)
from study_app.session.transitions.page_builder import preview
from study_app.session.transitions.state import FINAL, Phase
from study_app.session.transitions.table import advance, initial_state
from tests.golden import compare
from tests.session import small
from tests.session.transitions.states import LEFT, shown, state_in, written
from tests.session.transitions.transcribed import FOLDER, play
from tests.transcripts import every, played

STOPPABLE = {Phase.READING, Phase.TASK, Phase.RESTING, Phase.ANSWERING, Phase.FEEDBACK, Phase.PAUSED}


@pytest.mark.parametrize("file", every(FOLDER, "intervals reading settings table"), ids=lambda file: file.stem)
def test_events_cause_the_recorded_commands(file: Path, pytestconfig: pytest.Config) -> None:
    compare(file, played(file, play), pytestconfig)


@pytest.mark.parametrize("phase", [phase for phase in Phase if phase is not Phase.STALLED])
def test_a_full_disk_stops_the_force_and_keeps_pending_writes_in_every_phase(phase: Phase) -> None:
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


@pytest.mark.parametrize(
    ("paused_by", "stopped_by", "refusal"),
    [
        (None, "operator", "the force was stopped"),
        (None, "program", ""),
        ("participant", "operator", "the force was stopped"),
        ("participant", "program", ""),
        ("operator", "participant", "the force was stopped"),
        ("operator", "program", "the operator paused the session"),
    ],
)
def test_resuming_requires_whoever_paused_or_stopped(paused_by: Any, stopped_by: Any, refusal: str) -> None:
    state = state_in(Phase.READING)
    if paused_by:
        state, _ = advance(state, PauseRequested(1.0, paused_by))
    state, _ = advance(state, ForceStopped(2.0, stopped_by))
    if refusal:
        with pytest.raises(SessionError, match=f"{refusal}: only the operator can resume it, not the participant"):
            advance(state, ResumeRequested(3.0, "participant"))
    state, commands = advance(state, ResumeRequested(4.0, "operator" if refusal else "participant"))
    assert (state.phase, state.force_off, FadeIn() in commands) == (Phase.READING, False, True)


def test_the_operator_takes_over_a_pause_once_and_the_tables_are_written() -> None:
    state, _ = advance(state_in(Phase.READING), PauseRequested(1.0, "participant"))
    state, commands = advance(state, PauseRequested(2.0, "operator"))
    assert (written(commands), WriteTables() in commands) == (["paused"], True)
    assert advance(state, PauseRequested(3.0, "operator")) == (state, ())


def test_a_chosen_language_is_that_of_the_page_and_of_all_after_it() -> None:
    shown_study = preview(load("rek2024"))
    plan = (shown_study.protocol, shown_study.schedule, shown_study.codes, "en", FIRST, shown_study.secret)
    state, commands = advance(initial_state(*plan), Begin(0.0))
    english = shown(commands)
    state, commands = advance(state, LanguageChosen(1.0, "nl"))
    assert (english.language, shown(commands).language) == ("en", "nl")
    assert shown(commands).title == text_in(shown_study.protocol.pages[english.id].title, "nl") != english.title
    state, commands = advance(state, Continue(2.0))
    assert shown(commands).language == "nl"
    for phase in (Phase.TASK, Phase.ANSWERING):
        while state.phase is not phase:
            state, commands = advance(state, small.next_event(state, 3.0))
        labels = {code: state.trial.label(shown_study.protocol, code) for code in ("nl", "en")}
        assert shown(commands).progress.label == labels["nl"] != labels["en"]


def test_a_language_that_the_study_is_not_written_in_is_refused(protocol: Protocol) -> None:
    with pytest.raises(SessionError, match="available only in en"):
        initial_state(protocol, build_schedule(protocol, "P001", 1), {}, "nl")


def test_printed_states_do_not_name_a_condition_liquid_or_delay() -> None:
    state, printed = small.opened(), []
    while state.phase not in FINAL:
        state, commands = advance(state, small.next_event(state, 1.0))
        page = shown(commands)
        printed.append(f"{state!r} {commands!r} {page!r} {page}")
        printed += [str(command.line.fields()) for command in commands if isinstance(command, Write)]
    text = " ".join(printed)
    words = ["is_thin", "is_thick", "on_time", "is_late", "0.137", "137", "1013", "1450"]
    assert [word for word in words if word in text] == []
