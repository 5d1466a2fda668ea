"""The transition table driven at random: no answer is lost, every trial is ended."""

import copy
from contextlib import suppress
from dataclasses import replace
from itertools import product
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.errors import SessionError
from study_app.protocol.load import load, parse
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Trial, build_schedule, draw_key, stream
from study_app.protocol.trials.stimuli import Stimulated
from study_app.session.pages import EndPage, PausePage, QuestionnairePage, TaskPage, TextPage
from study_app.session.resume import FIRST
from study_app.session.transitions.events import (
    Begin,
    Broke,
    Chosen,
    Continue,
    EndRequested,
    Event,
    FadeIn,
    Finish,
    ForceStopped,
    ItemShown,
    PauseRequested,
    RepeatRequested,
    Rest,
    ResumeRequested,
    Retracted,
    ShowPage,
    StartTrial,
    StopForce,
    StopTrial,
    Submitted,
    TaskDone,
    TimeUp,
    Write,
    WriteCompleted,
    WriteTables,
)
from study_app.session.transitions.page_builder import Moment, build_page, pages_of_step, preview, previewed_page
from study_app.session.transitions.state import FINAL, Phase, SessionState
from study_app.session.transitions.table import advance, initial_state
from study_app.store.journals.journal_events import Answer
from tests.protocol.edited_studies import text_of
from tests.session import small
from tests.session.transitions.states import EVENTS, event_of, shown, state_in

CHOICES = st.one_of(st.integers(1, 7), st.none())
ANY_EVENT = st.one_of(
    *(st.just(event_of(kind)) for kind in EVENTS if kind not in (Chosen, ItemShown, Broke, EndRequested, Retracted)),
    st.builds(Chosen, st.just(0.0), st.sampled_from(["liquid", "strong", "spare", "different"]), CHOICES),
    st.builds(ItemShown, st.just(0.0), st.sampled_from(["liquid", "strong", "spare", "different"])),
    st.builds(Retracted, st.just(0.0), st.sampled_from(["liquid", "strong", "spare", "different"])),
)
INCIDENTS = st.one_of(ANY_EVENT, st.sampled_from([event_of(Broke), event_of(EndRequested)]))


@settings(max_examples=150, deadline=None)
@given(st.lists(st.one_of(st.none(), st.none(), ANY_EVENT), max_size=120), st.lists(INCIDENTS, max_size=5))
@pytest.mark.slow
def test_answers_survive_any_events_and_the_session_can_be_ended(events: list[Any], late: list[Any]) -> None:
    """None stands for continuing without an incident."""
    state = small.opened()
    latest: dict[tuple[int, int], dict[str, Any]] = {}
    answers_kept: dict[int, dict[str, Any]] = {}
    disk: list[Any] = []
    for drawn in [*events, *late]:
        event = _going_on(state) if drawn is None else drawn
        before = replace(state)
        try:
            after, commands = advance(state, event)
        except SessionError:
            assert state == before
            continue
        _check_order(commands)
        disk += [command for command in commands if isinstance(command, Write)]
        if isinstance(event, Chosen):
            latest.setdefault((before.trial.number, before.attempt), {})[event.item] = event.value
        if isinstance(event, Retracted):
            latest.setdefault((before.trial.number, before.attempt), {}).pop(event.item, None)
        if isinstance(event, Submitted) and before.phase is Phase.ANSWERING:
            answers_kept[before.trial.number] = latest[before.trial.number, before.attempt]
        state = after
    confirmed = {write.line.trial: write.line.items for write in disk if write.line.event == "responses"}
    assert {
        trial: {row.item: row.value for row in rows if row.given} for trial, rows in confirmed.items()
    } == answers_kept
    choices = [write for write in disk if write.line.event == "choice"]
    assert len(choices) >= sum(len(answers) for answers in answers_kept.values())
    if state.phase is Phase.STALLED:
        state, _ = advance(state, WriteCompleted(998.0))
    if state.phase not in FINAL:
        state, commands = advance(state, EndRequested(999.0, "aborted", ""))
        assert any(isinstance(command, Finish) for command in commands)
    assert state.phase in FINAL


def _going_on(state: SessionState) -> Any:
    if state.phase is Phase.STALLED:
        return WriteCompleted(1.0)
    waiting = state.phase in {Phase.PAUSED, Phase.TROUBLE, *FINAL}
    return ResumeRequested(1.0, "operator") if waiting else small.next_event(state, 1.0)


def _check_order(commands: tuple[Any, ...]) -> None:
    """Check the order of commands: force, then disk, then scenes and windows, and the page last."""
    rank = {StopForce: 0, StopTrial: 0, Rest: 0, Write: 1, WriteTables: 1, FadeIn: 1, Finish: 1, StartTrial: 2}
    ranks = [rank.get(type(command), 3) for command in commands]
    assert ranks == sorted(ranks)
    assert sum(isinstance(command, ShowPage) for command in commands) <= 1


@pytest.mark.slow
@given(st.integers(0, 2**32), st.data())
@settings(max_examples=30, deadline=None)
def test_every_trial_that_was_begun_is_ended_once_per_attempt(seed: int, data: st.DataObject) -> None:
    state = small.opened(seed)
    open_trials: list[tuple[int, int]] = []
    ended: list[tuple[int, int]] = []
    while state.phase not in FINAL:
        if state.phase is Phase.PAUSED:
            event: Any = ResumeRequested(1.0, "operator")
        elif state.phase is Phase.TASK and data.draw(st.booleans()):
            event = data.draw(
                st.sampled_from([event_of(PauseRequested), event_of(ForceStopped), event_of(RepeatRequested)])
            )
        else:
            event = small.next_event(state, 1.0)
        state, commands = advance(state, event)
        for command in commands:
            if isinstance(command, Write) and command.line.event in {"trial_started", "trial_ended"}:
                which = (command.line.trial, command.line.attempt)
                (open_trials if command.line.event == "trial_started" else ended).append(which)
    assert open_trials == ended
    assert len(set(open_trials)) == len(open_trials)
    steps = state.plan.schedule.steps
    assert {trial for trial, _ in open_trials} == {step.number for step in steps if isinstance(step, Trial)}


def test_the_page_that_an_event_shows_is_that_of_the_state_after_it() -> None:
    phases = set()
    for phase, kind in product(Phase, EVENTS):
        with suppress(SessionError):
            after, commands = advance(state_in(phase), event_of(kind))
            _check_order(commands)
            if (page := shown(commands)) is not None:
                assert page == build_page(after), (phase, kind)
                phases.add(phase)
    assert phases == set(Phase)
    assert {phase for phase in Phase if state_in(phase).lost_device} == {Phase.TROUBLE}


def pages_of_session(shown: Any, language: str) -> list[Any]:
    """Return every page of a session, each once."""
    plan = (shown.protocol, shown.schedule, shown.codes, language, FIRST, shown.secret)
    state, pages, at_s = initial_state(*plan), [], 0.0
    event: Any = Begin(at_s)
    while True:
        state, commands = advance(state, event)
        pages += [command.page for command in commands if isinstance(command, ShowPage)]
        at_s += 1000.0
        page = pages[-1]
        if isinstance(page, EndPage):
            return pages[:-1]
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
                pages += [command.page for command in commands if isinstance(command, ShowPage)]
            event = Submitted(at_s)
            if state.phase is not Phase.ANSWERING:
                event = TimeUp(at_s) if state.phase in {Phase.RESTING, Phase.FEEDBACK} else event


def test_each_trial_starts_with_its_task_and_delay_and_stays_for_the_longest_delay_of_its_block() -> None:
    tables = copy.deepcopy(small.TABLES)
    for name, delay_ms in (("is_thin", 53.0), ("is_thick", 29.0), ("on_time", 71.0)):
        tables["conditions"][name]["delay_ms"] = delay_ms
    study = Protocol.model_validate(tables)
    codes = draw_key(study, stream(1, "key").random)
    state, starts = initial_state(study, build_schedule(study, "P001", 1), codes, "en"), list[StartTrial]()
    trials = {step.number: step for step in state.plan.schedule.steps if isinstance(step, Trial)}
    while state.phase is not Phase.COMPLETE:
        state, commands = advance(state, small.next_event(state, state.since_s))
        starts += [command for command in commands if isinstance(command, StartTrial)]
    assert [command.trial for command in starts] == sorted(trials)
    for command in starts:
        block = study.blocks[trials[command.trial].block]
        condition = codes[block.id][trials[command.trial].code]
        longest_ms = max(tables["conditions"][name]["delay_ms"] for name in block.conditions)
        assert command.linger_s == pytest.approx(longest_ms / 1000 + 0.1)
        assert replace(command, linger_s=0.0) == StartTrial(
            trial=command.trial,
            attempt=1,
            task=study.tasks[block.task],
            presented=Stimulated(condition),
            delay_s=tables["conditions"][condition]["delay_ms"] / 1000,
            linger_s=0.0,
        )


@pytest.mark.parametrize("event", [ItemShown(9.0, "lquid"), Chosen(9.0, "lquid", 3), Retracted(9.0, "lquid")])
def test_an_unknown_item_is_named_with_the_items_of_the_page(event: Event) -> None:
    with pytest.raises(SessionError, match="'lquid' is not on this page, which contains the items liquid, strong, sp"):
        advance(state_in(Phase.ANSWERING), event)


def plain(page: Any) -> Any:
    """Return a page without what depends on the time and the pages around it."""
    if isinstance(page, TextPage):
        return replace(page, coming=None, stays_until_s=None)
    return page


@pytest.mark.parametrize("name", ["demo", "rek2024"])
@pytest.mark.parametrize("language", ["en", "nl"])
def test_every_page_of_a_preview_is_that_of_a_session_with_its_seed(name: str, language: str) -> None:
    previewed_session = preview(load(name))
    if language not in previewed_session.protocol.study.languages:
        pytest.skip("not in this language")
    previewed = [
        previewed_page(previewed_session, index, moment, language)
        for index in range(len(previewed_session.schedule.steps))
        for moment in pages_of_step(previewed_session, index)
    ]
    session_pages = pages_of_session(previewed_session, language)
    assert {type(page) for page in session_pages} == {TextPage, TaskPage, QuestionnairePage}
    assert [plain(page) for page in previewed] == [plain(page) for page in session_pages]
    intros = {
        previewed_session.protocol.text(form.intro, language)
        for form in previewed_session.protocol.questionnaires.values()
    }
    forms = [page for page in session_pages if isinstance(page, QuestionnairePage)]
    assert {page.intro for page in forms} <= intros
    assert all([item.number for item in page.items] == [*range(1, len(page.items) + 1)] for page in forms)


def test_each_time_a_form_is_asked_its_simulated_answers_have_a_stream_of_their_own() -> None:
    page = next(page for page in pages_of_session(preview(load("demo")), "en") if isinstance(page, QuestionnairePage))
    again = [replace(page, trial=None, form="load", time=time).stream for time in (1, 2)]
    assert [page.stream, *again] == [f"{page.trial}/answers", "form/load/answers", "form/load/2/answers"]


@pytest.mark.parametrize("name", ["viscosityjnd", "compared"])
def test_a_trial_of_intervals_has_a_page_for_each_its_question_and_its_feedback(name: str) -> None:
    previewed_session = preview(parse(text_of(name).encode(), "study.toml"))
    blocks = previewed_session.protocol.blocks
    index, trial = next((at, step) for at, step in enumerate(previewed_session.schedule.steps)
                        if getattr(step, "block", "") and blocks[step.block].design is not None)  # fmt: skip
    step_pages = pages_of_step(previewed_session, index)
    count = previewed_session.protocol.design_of(blocks[trial.block]).intervals
    assert step_pages[: count + 1] == (*(Moment("tank", number) for number in range(1, count + 1)), Moment("questions"))
    pages = [previewed_page(previewed_session, index, moment, "en") for moment in step_pages]
    assert [(page.interval.number, page.interval.of) for page in pages[:count]] == [
        (number, count) for number in range(1, count + 1)
    ]
    assert pages[count].trial == trial.number
    assert not any(isinstance(page, PausePage) for page in pages)


@pytest.mark.parametrize(
    ("name", "has_feedback"),
    [("forcedelay", {"practice", "main"}), ("delaydetect", {"practice"}), ("thickness", set()), ("matching", set())],
)
def test_feedback_follows_the_question_of_the_phases_that_have_it(name: str, has_feedback: set[str]) -> None:
    previewed_session, phases = preview(parse(text_of(name).encode(), "study.toml")), set()
    for index, step in enumerate(previewed_session.schedule.steps):
        if isinstance(step, Trial) and previewed_session.protocol.blocks[step.block].design is not None:
            kinds = [moment.kind for moment in pages_of_step(previewed_session, index) if moment.kind != "tank"]
            expected_pages = [] if name == "matching" else ["questions"]
            assert kinds == expected_pages + ["feedback"] * (step.phase in has_feedback), step
            tanks = [moment for moment in pages_of_step(previewed_session, index) if moment.kind == "tank"]
            for moment in tanks:
                page = previewed_page(previewed_session, index, moment, "en")
                assert page.adjusts == (name == "matching" and moment == tanks[-1])
                assert page.said == (page.question if page.adjusts else page.instruction) != ""
            phases.add(step.phase)
    assert phases >= has_feedback


def test_answers_that_a_question_no_longer_accepts_are_omitted() -> None:
    previewed_session = preview(load("demo"))
    index = next(
        at for at, step in enumerate(previewed_session.schedule.steps) if getattr(step, "block", "") == "liquids"
    )
    answers = {"feels_liquid": 6, "like_honey": 99, "removed": 3}
    page = previewed_page(previewed_session, index, Moment("questions"), "en", answers)
    assert page.chosen == (("feels_liquid", 6),)


@pytest.mark.parametrize(("hand", "numbers"), [("left", [1, 2, 4]), ("both", [1, 2, 3, 4])])
def test_answers_have_the_numbers_of_their_questions_although_some_are_hidden(hand: str, numbers: list[int]) -> None:
    study = parse(text_of("mixed").encode(), "mixed.toml")
    key = draw_key(study, stream(1, "key").random)
    state, _ = advance(initial_state(study, build_schedule(study, "P001", 1), key, "en"), Begin(0.0))
    answers_given = {"age": 31, "hand": hand, "since": 7, "used": ["mouse"]}
    assert state.items == tuple(answers_given)
    answers = {item: Answer(onset_s=0.0, first_s=1.0, last_s=2.0, value=value) for item, value in answers_given.items()}
    _, commands = advance(replace(state, answers=answers), Submitted(3.0))
    (line,) = (
        command.line for command in commands if isinstance(command, Write) and command.line.event == "form_answered"
    )
    assert line.form == "start"
    assert [(item.number, item.item, item.value) for item in line.items] == [
        (number, item, value) for number, (item, value) in enumerate(answers_given.items(), 1) if number in numbers
    ]


def test_only_answers_to_questions_that_are_hidden_now_are_removed() -> None:
    study = parse(text_of("mixed").encode(), "mixed.toml")
    key = draw_key(study, stream(1, "key").random)
    state, _ = advance(initial_state(study, build_schedule(study, "P001", 1), key, "en"), Begin(0.0))
    answers_given = {"age": 31, "hand": "both", "since": 7, "used": ["mouse"]}
    answers = {item: Answer(onset_s=0.0, first_s=1.0, last_s=2.0, value=value) for item, value in answers_given.items()}
    state, commands = advance(replace(state, answers=answers), Chosen(3.0, "hand", "left"))
    assert [item for item, answer in state.answers.items() if answer.given] == ["age", "hand", "used"]
    removed = [
        command.line for command in commands if isinstance(command, Write) and command.line.event == "answer_removed"
    ]
    assert [line.item for line in removed] == ["since"]
