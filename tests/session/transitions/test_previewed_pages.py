"""The pages of a preview: those that a session of the same seed shows, one after the other."""

from dataclasses import replace
from typing import Any

import pytest

from study_app.protocol.load import load
from study_app.session.pages import EndPage, PausePage, QuestionnairePage, TaskPage, TextPage
from study_app.session.resume import FIRST
from study_app.session.simulated.preview import preview
from study_app.session.transitions.commands import ShowPage
from study_app.session.transitions.events import Begin, Chosen, Continue, ItemShown, Submitted, TaskDone, TimeUp
from study_app.session.transitions.previewed_pages import Moment, moments, previewed_page
from study_app.session.transitions.state import Phase
from study_app.session.transitions.table import advance, open_session


def pages_of_session(shown: Any, language: str) -> list[Any]:
    """Return every page of a session, each once."""
    plan = (shown.protocol, shown.schedule, shown.codes, language, FIRST, shown.secret)
    state, found, at_s = open_session(*plan), [], 0.0
    event: Any = Begin(at_s)
    while True:
        state, commands = advance(state, event)
        found += [command.page for command in commands if isinstance(command, ShowPage)]
        at_s += 1000.0
        page = found[-1]
        if isinstance(page, EndPage):
            return found[:-1]
        if state.phase is Phase.READING:
            event = Continue(at_s)
        elif state.phase is Phase.TASK:
            event = TaskDone(at_s, "complete", {"duration_s": 1.5})
        elif state.phase in {Phase.RESTING, Phase.FEEDBACK}:
            event = TimeUp(at_s)
        else:
            for question in state.questions:
                value = question.view(1, state.context).simulated(5.0, lambda: 0.5)
                state, _ = advance(state, ItemShown(at_s, question.id))
                state, commands = advance(state, Chosen(at_s, question.id, value))
                found += [command.page for command in commands if isinstance(command, ShowPage)]
            event = Submitted(at_s)
            if state.phase is not Phase.ANSWERING:
                event = TimeUp(at_s) if state.phase in {Phase.RESTING, Phase.FEEDBACK} else event


def plain(page: Any) -> Any:
    """Return a page without what depends on the time and the pages around it."""
    if isinstance(page, TextPage):
        return replace(page, coming=None, stays_until_s=None)
    return page


@pytest.mark.parametrize("name", ["demo", "rek2024"])
@pytest.mark.parametrize("language", ["en", "nl"])
def test_every_page_of_a_preview_is_that_of_a_session_with_its_seed(name: str, language: str) -> None:
    shown = preview(load(name))
    if language not in shown.protocol.study.languages:
        pytest.skip("not in this language")
    previewed = [
        previewed_page(shown, index, moment, language)
        for index in range(len(shown.schedule.steps))
        for moment in moments(shown, index)
    ]
    held = pages_of_session(shown, language)
    assert {type(page) for page in held} == {TextPage, TaskPage, QuestionnairePage}
    assert [plain(page) for page in previewed] == [plain(page) for page in held]


def test_a_trial_of_intervals_has_a_page_for_each_its_question_and_its_feedback() -> None:
    shown = preview(load("viscosityjnd"))
    blocks = shown.protocol.blocks
    index, trial = next((at, one) for at, one in enumerate(shown.schedule.steps)
                        if getattr(one, "block", "") and blocks[one.block].design is not None)  # fmt: skip
    found = moments(shown, index)
    assert found[:3] == (Moment("tank", 1), Moment("tank", 2), Moment("questions"))
    pages = [previewed_page(shown, index, moment, "en") for moment in found]
    assert [page.interval.number for page in pages[:2]] == [1, 2]
    assert pages[2].trial == trial.number
    assert not any(isinstance(page, PausePage) for page in pages)


def test_answers_that_a_question_no_longer_accepts_are_left_out() -> None:
    shown = preview(load("demo"))
    index = next(at for at, step in enumerate(shown.schedule.steps) if getattr(step, "block", "") == "liquids")
    answers = {"feels_liquid": 6, "like_honey": 99, "removed": 3}
    page = previewed_page(shown, index, Moment("questions"), "en", answers)
    assert page.chosen == (("feels_liquid", 6),)
