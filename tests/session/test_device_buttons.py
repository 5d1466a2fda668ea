"""Presses of a device's buttons: what each means in which phase, sample by sample."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from study_app.haptics.model.layout import BUTTON_STOP
from study_app.session.device_buttons import ANSWERS, CONTINUE, DeviceButtons
from study_app.session.transitions.events import Chosen, Continue, Event, ForceStopped, Stepped, Submitted
from study_app.session.transitions.state import Phase, SessionState

LESS, MORE = ANSWERS
NOW_S = 7.5


def samples(*buttons: int, from_ns: int = 1000, step_ns: int = 1_000_000) -> Any:
    """Return samples with these button states, `step_ns` apart."""
    records = np.zeros(len(buttons), [("buttons", np.int64), ("time_ns", np.int64)])
    records["buttons"], records["time_ns"] = buttons, from_ns + step_ns * np.arange(len(buttons))
    return records


def state(phase: Phase, kind: str = "text", answers: tuple[str, ...] | None = None) -> SessionState:
    """Return the parts of a session state that buttons depend on: page and possible answers."""
    pages = {"here": SimpleNamespace(kind=kind)}
    plan = SimpleNamespace(protocol=SimpleNamespace(pages=pages))
    design = None if answers is None else SimpleNamespace(name="which", answers=answers)
    due = None if answers is None else object()
    return cast("SessionState", SimpleNamespace(phase=phase, plan=plan, page_id="here", design=design, due=due))


def events(
    buttons: DeviceButtons, pressed: Any, of: SessionState, *, adjusts: bool = False, since_ns: int = 0
) -> list[Event]:
    return list(buttons.events(pressed, since_ns, NOW_S, lambda: (of, adjusts)))


def test_a_press_leaves_a_text_page_and_gives_no_consent() -> None:
    reading = state(Phase.READING)
    buttons = DeviceButtons()
    assert events(buttons, samples(0, CONTINUE, CONTINUE), reading) == [Continue(NOW_S)]
    assert events(buttons, samples(CONTINUE, CONTINUE), reading) == [], "it is held"
    assert events(buttons, samples(0, CONTINUE, 0, CONTINUE), reading) == [Continue(NOW_S)], "twice is once"
    assert events(DeviceButtons(), samples(LESS, MORE, 0), reading) == []
    assert events(DeviceButtons(), samples(CONTINUE), state(Phase.READING, "consent")) == []
    for phase in set(Phase) - {Phase.READING}:
        assert events(DeviceButtons(), samples(CONTINUE), state(phase)) == []


def test_buttons_pressed_before_the_page_appeared_are_ignored() -> None:
    pressed = samples(0, CONTINUE, CONTINUE, from_ns=0)
    assert events(DeviceButtons(), pressed, state(Phase.READING), since_ns=1_000_001) == []
    assert events(DeviceButtons(), pressed, state(Phase.READING), since_ns=1_000_000) == [Continue(NOW_S)]


@pytest.mark.parametrize("phase", Phase)
def test_the_stop_button_stops_the_force_whenever_it_is_pressed(phase: Phase) -> None:
    buttons, pressed = DeviceButtons(), samples(0, BUTTON_STOP, BUTTON_STOP)
    assert events(buttons, pressed, state(phase), since_ns=10**12) == [ForceStopped(NOW_S, "device")]
    assert events(buttons, samples(BUTTON_STOP), state(phase)) == []
    both = events(DeviceButtons(), samples(BUTTON_STOP | CONTINUE), state(Phase.READING))
    assert both == [ForceStopped(NOW_S, "device"), Continue(NOW_S)], "the force comes first"


@pytest.mark.parametrize(("button", "answer"), [(LESS, "first"), (MORE, "second")])
def test_a_choice_between_two_is_made_and_confirmed_by_one_press(button: int, answer: str) -> None:
    answering = state(Phase.ANSWERING, answers=("first", "second"))
    expected = [Chosen(NOW_S, "which", answer), Submitted(NOW_S)]
    assert events(DeviceButtons(), samples(0, button, 0), answering) == expected
    assert events(DeviceButtons(), samples(0, LESS, MORE), answering) == [], "both tell nothing"
    assert events(DeviceButtons(), samples(CONTINUE), answering) == []
    for other in (
        state(Phase.ANSWERING, answers=("first", "second", "third")),
        state(Phase.ANSWERING),
        state(Phase.FEEDBACK, answers=("first", "second")),
    ):
        assert events(DeviceButtons(), samples(button), other) == []


def test_a_level_is_adjusted_by_a_step_at_once_and_every_eighth_of_a_second_and_set_by_the_first_button() -> None:
    task, buttons = state(Phase.TASK), DeviceButtons()

    def steps(button: int, at_ms: int) -> list[Event]:
        return events(buttons, samples(button, from_ns=at_ms * 1_000_000), task, adjusts=True)

    assert steps(MORE, 1000) == [Stepped(NOW_S, 1)]
    assert [at_ms for at_ms in range(1001, 1500) if steps(MORE, at_ms)] == [1125, 1250, 1375]
    assert steps(MORE | LESS, 1500) == [], "one more and one less"
    assert steps(LESS, 1501) == []
    assert steps(LESS, 1625) == [Stepped(NOW_S, -1)]
    assert steps(LESS | CONTINUE, 1626) == [Submitted(NOW_S)]
    assert steps(0, 1627) == []
    assert [steps(0, at_ms) for at_ms in (1750, 1875)] == [[], []]
    assert steps(MORE, 1876) == [Stepped(NOW_S, 1)]
    assert events(buttons, samples(MORE, from_ns=1_900_000_000), task) == [], "it can no longer be adjusted"
    assert [steps(MORE, at_ms) for at_ms in (2001, 2126)] == [[], []], "and begins with the next press"
    short = events(buttons, samples(0, MORE, 0, from_ns=2_200_000_000), task, adjusts=True)
    assert short == [Stepped(NOW_S, 1)], "a press as short as a sample"
    assert steps(0, 2400) == []
