"""The device's buttons: their events, and the steps of an adjustment while a button is held."""

from collections.abc import Callable, Iterator
from typing import Any, Final

import numpy as np

from study_app.haptics.model.layout import BUTTON_STOP
from study_app.session.transitions.events import STEP_S, Chosen, Continue, Event, ForceStopped, Stepped, Submitted
from study_app.session.transitions.state import Phase, SessionState

CONTINUE: Final = 1 << 0
ANSWERS: Final = (1 << 1, 1 << 2)
"""Bits of the device's second button (first answer, or "less") and third button (second answer, or "more")."""


class DeviceButtons:
    """Detects presses of the device's buttons in telemetry."""

    def __init__(self) -> None:
        self._down = 0
        self._next_ns: dict[int, int] = {}  # time of the next step by button [ns]

    def events(
        self, samples: Any, since_ns: int, now_s: float, read_state: Callable[[], tuple[SessionState, bool]]
    ) -> Iterator[Event]:
        """Yield the events for the buttons pressed in ``samples`` (n,) of telemetry.

        Presses before ``since_ns``, when the current page was presented, are ignored. ``read_state`` returns the
        session's current state, which each yielded event may change, and whether an interval can be adjusted.
        """
        down = np.concatenate(([self._down], samples["buttons"]))
        self._down = int(down[-1])
        pressed = down[1:] & ~down[:-1]  # the buttons pressed at each sample, as bits
        if (pressed & BUTTON_STOP).any():
            yield ForceStopped(now_s, "device")
        pressed = pressed[samples["time_ns"] >= since_ns]
        continue_pressed = bool((pressed & CONTINUE).any())
        if read_state()[1]:
            if steps := self._due_steps(pressed, int(samples["time_ns"][-1])):
                yield Stepped(now_s, steps)
            if continue_pressed:
                yield Submitted(now_s)
            return
        self._next_ns.clear()
        state = read_state()[0]
        # a press leaves a text page, but does not give consent
        if (
            continue_pressed
            and state.phase is Phase.READING
            and state.plan.protocol.pages[state.page_id].kind != "consent"
        ):
            yield Continue(now_s)
        yield from _answers(read_state()[0], pressed, now_s)

    def _due_steps(self, pressed: Any, now_ns: int) -> int:
        """Return the sum of the due steps: one for each press, and one every `STEP_S` while a button is held."""
        steps = 0
        for bit, direction in zip(ANSWERS, (-1, 1), strict=True):
            if (pressed & bit).any():
                self._next_ns[bit] = now_ns
            if now_ns >= self._next_ns.get(bit, now_ns + 1):
                self._next_ns[bit] += round(STEP_S * 1e9)
                steps += direction
            if not self._down & bit:
                self._next_ns.pop(bit, None)
        return steps


def _answers(state: SessionState, pressed: Any, now_s: float) -> Iterator[Event]:
    """Yield the answer to a choice between two: the second button chooses the first answer, the third the second."""
    if state.phase is not Phase.ANSWERING or state.due is None or state.design is None:
        return
    answers = state.design.answers
    pressed_answers = [index for index, bit in enumerate(ANSWERS) if (pressed & bit).any()]
    if len(answers) == len(ANSWERS) and len(pressed_answers) == 1:
        yield Chosen(now_s, state.design.name, answers[pressed_answers[0]])
        yield Submitted(now_s)
