"""The transition table driven at random: no answer is lost, every trial is ended."""

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.errors import SessionError
from study_app.protocol.orders.schedule import Trial
from study_app.session.transitions.commands import (
    FadeIn,
    Finish,
    Rest,
    ShowPage,
    StartTrial,
    StopForce,
    StopTrial,
    Write,
    WriteTables,
)
from study_app.session.transitions.events import (
    Broke,
    Chosen,
    EndAsked,
    ForceStopped,
    ItemShown,
    PauseAsked,
    RepeatAsked,
    ResumeAsked,
    Retracted,
    Submitted,
    WriteCompleted,
)
from study_app.session.transitions.state import FINAL, Phase, SessionState
from study_app.session.transitions.table import advance
from tests.session import small
from tests.session.transitions.states import EVENTS, event_of

CHOICES = st.one_of(st.integers(1, 7), st.none())


ANY_EVENT = st.one_of(
    *(st.just(event_of(kind)) for kind in EVENTS if kind not in (Chosen, ItemShown, Broke, EndAsked, Retracted)),
    st.builds(Chosen, st.just(0.0), st.sampled_from(["liquid", "strong", "spare", "different"]), CHOICES),
    st.builds(ItemShown, st.just(0.0), st.sampled_from(["liquid", "strong", "spare", "different"])),
    st.builds(Retracted, st.just(0.0), st.sampled_from(["liquid", "strong", "spare", "different"])),
)


INCIDENTS = st.one_of(ANY_EVENT, st.sampled_from([event_of(Broke), event_of(EndAsked)]))


@settings(max_examples=150, deadline=None)
@given(st.lists(st.one_of(st.none(), st.none(), ANY_EVENT), max_size=120), st.lists(INCIDENTS, max_size=5))
@pytest.mark.slow
def test_whatever_happens_no_answer_is_lost_and_the_session_can_be_ended(events: list[Any], late: list[Any]) -> None:
    """None stands for going on as if nothing had happened."""
    state = small.opened()
    latest: dict[tuple[int, int], dict[str, Any]] = {}
    kept: dict[int, dict[str, Any]] = {}
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
            kept[before.trial.number] = latest[before.trial.number, before.attempt]
        state = after
    confirmed = {write.fields["trial"]: write.fields["items"] for write in disk if write.event == "responses"}
    assert {
        trial: {row["item"]: row["value"] for row in rows if row["first_s"] is not None}
        for trial, rows in confirmed.items()
    } == kept
    chosen = [write for write in disk if write.event == "choice"]
    assert len(chosen) >= sum(len(answers) for answers in kept.values())
    if state.phase is Phase.STALLED:
        state, _ = advance(state, WriteCompleted(998.0))
    if state.phase not in FINAL:
        state, commands = advance(state, EndAsked(999.0, "aborted", ""))
        assert any(isinstance(command, Finish) for command in commands)
    assert state.phase in FINAL


def _going_on(state: SessionState) -> Any:
    if state.phase is Phase.STALLED:
        return WriteCompleted(1.0)
    waiting = state.phase in {Phase.PAUSED, Phase.TROUBLE, *FINAL}
    return ResumeAsked(1.0, "operator") if waiting else small.next_event(state, 1.0)


def _check_order(commands: tuple[Any, ...]) -> None:
    """Safety of the hand, then the disk, then what is felt and seen; nothing after the page."""
    rank = {StopForce: 0, StopTrial: 0, Rest: 0, Write: 1, WriteTables: 1, FadeIn: 1, Finish: 1, StartTrial: 2}
    ranks = [rank.get(type(command), 3) for command in commands]
    assert ranks == sorted(ranks)
    assert sum(isinstance(command, ShowPage) for command in commands) <= 1


@pytest.mark.slow
@given(st.integers(0, 2**32), st.data())
@settings(max_examples=30, deadline=None)
def test_every_trial_that_was_begun_is_ended_once_per_attempt(seed: int, data: st.DataObject) -> None:
    state = small.opened(seed)
    begun: list[tuple[int, int]] = []
    ended: list[tuple[int, int]] = []
    while state.phase not in FINAL:
        if state.phase is Phase.PAUSED:
            event: Any = ResumeAsked(1.0, "operator")
        elif state.phase is Phase.TASK and data.draw(st.booleans()):
            event = data.draw(st.sampled_from([event_of(PauseAsked), event_of(ForceStopped), event_of(RepeatAsked)]))
        else:
            event = small.next_event(state, 1.0)
        state, commands = advance(state, event)
        for command in commands:
            if isinstance(command, Write) and command.event in {"trial_started", "trial_ended"}:
                which = (command.fields["trial"], command.fields["attempt"])
                (begun if command.event == "trial_started" else ended).append(which)
    assert begun == ended
    assert len(set(begun)) == len(begun)
    steps = state.plan.schedule.steps
    assert {trial for trial, _ in begun} == {step.number for step in steps if isinstance(step, Trial)}
