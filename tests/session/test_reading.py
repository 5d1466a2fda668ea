"""Pages to read: in which language, how long a break lasts, and where they say one is."""

from copy import deepcopy
from typing import Any

import pytest
from pydantic import ValidationError

from study_app.errors import SessionError
from study_app.protocol.load import load
from study_app.protocol.model import Protocol
from study_app.protocol.orders.durations import expected_duration_s
from study_app.protocol.orders.schedule import build_schedule, draw_key, stream
from study_app.session.pages import Progress, TextPage
from study_app.session.transitions.commands import ShowPage, Write
from study_app.session.transitions.events import (
    Begin,
    Continue,
    ForceStopped,
    LanguageChosen,
    PauseAsked,
    ResumeAsked,
    TaskDone,
)
from study_app.session.transitions.state import FINAL, Phase, SessionState
from study_app.session.transitions.table import advance, open_session
from tests.session import small


def opened(protocol: Protocol, language: str = "en") -> SessionState:
    key = draw_key(protocol, stream(1, "key").random)
    return open_session(protocol, build_schedule(protocol, "P001", 1), key, language)


def with_break(**changed: Any) -> Protocol:
    tables = deepcopy(small.TABLES)
    tables["pages"]["rest"] = {"kind": "break", "title": "Rest", "body": "Breathe.", "min_s": 60, **changed}
    tables["blocks"]["feeling"] |= {"break_every": 1, "break_page": "rest"}
    return Protocol.model_validate(tables)


def shown(commands: tuple[Any, ...]) -> Any:
    return next((command.page for command in commands if isinstance(command, ShowPage)), None)


def written(commands: tuple[Any, ...]) -> list[tuple[str, dict[str, Any]]]:
    return [(command.event, dict(command.fields)) for command in commands if isinstance(command, Write)]


def to_page(state: SessionState, page_id: str) -> tuple[SessionState, Any]:
    """Walk to a page; return the state and the page."""
    while not (state.phase is Phase.READING and state.page_id == page_id):
        state, commands = advance(state, small.next_event(state, 100.0))
    return state, shown(commands)


def test_a_language_is_offered_until_the_consent_is_given_and_all_pages_are_in_it() -> None:
    state, commands = advance(opened(load("rek2024")), Begin(0.0))
    assert (shown(commands).language, shown(commands).languages) == ("en", ("en", "nl"))
    state, commands = advance(state, LanguageChosen(2.0, "nl"))
    assert written(commands) == [("language_chosen", {"language": "nl"})]
    page = shown(commands)
    assert (page.title, page.language, page.languages) == ("Welkom", "nl", ("en", "nl"))
    state, commands = advance(state, Continue(3.0))
    assert (shown(commands).title, shown(commands).languages) == ("Hoe het werkt", ())
    _, instruction = to_task(state)
    assert instruction.startswith("Beweeg de bal")


def to_task(state: SessionState) -> tuple[SessionState, str]:
    while state.phase is not Phase.TASK:
        state, commands = advance(state, small.next_event(state, 9.0))
    return state, shown(commands).instruction


def test_after_the_consent_the_language_stays() -> None:
    state, _ = advance(opened(load("rek2024")), Begin(0.0))
    state, _ = advance(state, Continue(3.0))
    with pytest.raises(SessionError, match="chosen before the consent"):
        advance(state, LanguageChosen(4.0, "nl"))


def test_a_language_that_the_study_does_not_have_is_refused_and_the_same_one_is_no_event() -> None:
    state, _ = advance(opened(load("rek2024")), Begin(0.0))
    with pytest.raises(SessionError, match="choose en or nl"):
        advance(state, LanguageChosen(2.0, "fr"))
    assert advance(state, LanguageChosen(2.0, "en")) == (state, ())


def test_a_study_in_one_language_offers_none() -> None:
    _, commands = advance(small.opened(), Begin(0.0))
    assert shown(commands).languages == ()


def test_a_break_with_a_least_time_is_not_left_before_whoever_presses() -> None:
    state, page = to_page(opened(with_break()), "rest")
    assert page.stays_until_s == pytest.approx(160.0)
    assert advance(state, Continue(159.9)) == (state, ())
    assert advance(state, Continue(160.0))[0].phase is Phase.TASK


def test_a_pause_in_a_break_neither_lengthens_nor_shortens_it() -> None:
    state, page = to_page(opened(with_break()), "rest")
    paused, _ = advance(state, PauseAsked(120.0, "participant"))
    again, commands = advance(paused, ResumeAsked(150.0, "participant"))
    assert shown(commands) == page
    stopped, _ = advance(again, ForceStopped(151.0, "participant"))
    again, _ = advance(stopped, ResumeAsked(161.0, "participant"))
    assert advance(again, Continue(162.0))[0].phase is Phase.TASK


def test_a_break_without_a_time_is_the_participants_own() -> None:
    state, page = to_page(opened(with_break(min_s=None)), "rest")
    assert page.stays_until_s is None
    assert advance(state, Continue(100.0))[0].phase is Phase.TASK


def test_a_break_counts_in_how_long_a_session_is_expected_to_take() -> None:
    longer = expected_duration_s(with_break()) - expected_duration_s(with_break(min_s=None))
    assert 50 < longer < 60  # the reading alone takes some seconds of the 60


def test_only_a_break_can_last() -> None:
    with pytest.raises(ValidationError, match="belongs to a page of kind break"):
        with_break(kind="instructions")


def test_pages_between_the_trials_say_which_part_it_is_and_how_far() -> None:
    state = opened(load("rek2024"))
    told: dict[str, Progress | None] = {}
    while state.phase not in FINAL:
        if state.phase is Phase.TASK:
            event: Any = TaskDone(100.0, "complete", {})
        else:
            event = small.next_event(state, 100.0)
        state, commands = advance(state, event)
        page = shown(commands)
        if isinstance(page, TextPage):
            told[page.id] = page.progress
    assert told == {
        "consent": None,
        "instructions": None,
        "part_1": Progress(1, 2, "", 1, 3),
        "rest": Progress(1, 2, "", 4, 3),
        "part_2": Progress(2, 2, "", 1, 1),
        "delays_intro": Progress(2, 2, "", 1, 7),
        "debrief": None,
    }


def test_a_break_within_a_block_says_how_many_settings_are_done() -> None:
    _, page = to_page(opened(with_break()), "rest")
    assert page.progress == Progress(1, 2, "", 2, 2)
