"""The operator's window and strip in their states."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from study_app.gui.operator.servo_health import Forces
from study_app.gui.operator.session_panels import Strip
from study_app.gui.operator.window import OperatorWindow
from study_app.haptics.model.layout import LIMITER_NORM, SAMPLE, records
from tests.gui.operator.session import measured_health, new_session
from tests.gui.transcript import Actions, clicked, in_turn, typed
from tests.gui.windows import show_window


def pushes(limiters: int) -> Any:
    """Return samples of a hand that is pushed to and fro by at most 2 N."""
    samples = records(SAMPLE, 4000)
    samples.tick = np.arange(4000)
    samples.time_ns = samples.tick * 1_000_000
    samples.scene = 1
    turn = samples.tick / 300
    samples.device_force_n = np.column_stack((2 * np.sin(turn), -np.cos(turn), 0.5 * np.sin(2 * turn)))
    samples.limiters = np.where(samples.tick < 1500, limiters, 0)
    samples.permitted_n, samples.withheld_n = 2.0, 0.1
    return samples


def operator(qtbot: Any, **more: Any) -> OperatorWindow:
    window: Any = OperatorWindow("demo", lateness_limit_s=0.002, reach_m=0.05, pointer=True, **more)
    qtbot.addWidget(window, before_close_func=lambda window: setattr(window, "may_close", True))
    window.demo_session, window.health, window.forces = new_session(), measured_health(), Forces(6.0)
    window.force_limited = "force_limit_n" in more
    if window.force_limited:
        window.demo_session.make_single_blind()
        window.forces.add_samples(pushes(LIMITER_NORM))
    show_window(qtbot, window, (1366, 768))
    tell_and_show()(window)
    return window  # type: ignore[no-any-return]


def tell_and_show(*happened: Any, beyond: Mapping[str, Any] | None = None, **said: Any) -> Callable[[Any], None]:
    """Return an action that tells the session events, then shows its view; ``beyond`` changes fields of the view."""

    def act(window: Any) -> None:
        for happening in happened:
            if callable(happening):
                happening(window.demo_session)
            else:
                event, fields = happening
                window.demo_session.tell(event, 5.0, **fields)
        figures = {"forces": window.forces.figures()} if window.force_limited else {}
        window.show_view(replace(window.demo_session.view(window.health, **figures, **said), **beyond or {}))
        window.show_traces(window.health, 4.0)
        window.show_lateness(window.health)
        window.show_forces(window.forces, 4_000_000_000)

    return act


def give_reason(ask: str) -> Callable[[Any], None]:
    """Return an action that enters a blank reason, then a valid one, and confirms the question."""

    def act(window: Any) -> None:
        getattr(window, ask)()
        for reason in ("  ", "phone rang"):
            window.question.editors["reason"].control.setText(reason)
            if reason.strip() or ask != "ask_to_end":  # an end needs none
                window.question.go_on.click()

    return act


def slow_down(window: Any) -> None:
    """Simulate late ticks, missed frames, a hand outside the tank and a slower device."""
    samples = records(SAMPLE, 3000)
    samples.tick = np.arange(3000, 6000)
    samples.time_ns = samples.tick * 1_250_000
    samples.lateness_ns, samples.delay_ticks = 9_000_000, 4
    window.health.add_samples(samples)
    window.health.overruns = 17
    window.health.add_frame(4_000_000_000)
    window.health.add_hand_position(100.0, (0.09, 0.0, 0.0))
    tell_and_show(
        ("note", {"kind": "mark", "text": ""}), dropped=1200, outlets_lost={"Serial port": "it was unplugged"}
    )(window)
    window.show_traces(window.health, 100.0)


def plot_push(peak_n: float) -> Callable[[Any], None]:
    """Return an action that plots a push of this force [N] alone."""

    def act(window: Any) -> None:
        window.forces = Forces(6.0)
        samples = pushes(0)
        samples.device_force_n = samples.device_force_n * (peak_n / 2)
        window.forces.add_samples(samples)
        tell_and_show()(window)

    return act


PAUSED = ("paused", {"by": "operator"})
RECONNECTS = {"may_reconnect": True, "reconnects": True, "reconnection": "Opening"}
RUNNING: Actions = {
    "trial 1": tell_and_show(lambda it: it.welcome(), lambda it: it.start(1)),
    "two notes": tell_and_show(
        *(("note", {"kind": "note", "text": text}) for text in ("Left-handed", "A long note " * 9))
    ),
    "answering": tell_and_show(lambda it: it.end(1, worst_gap_ms=31.0, lateness_p99_ms=9.5)),
    "trial 2": tell_and_show(lambda it: it.answer(1), lambda it: it.start(2)),
    "pressed": in_turn(
        clicked("buttons.pause", "notes.mark", "notes.add", "device.diagnose", "stop.stop", "header.page"),
        typed("notes.field", "left-handed"),
        *(give_reason(f"ask_to_{what}") for what in ("repeat", "end")),
    ),
    "paused": tell_and_show(PAUSED),
    "resumed": in_turn(
        clicked("buttons.pause"), tell_and_show(("resumed", {"by": "operator"}), ("note", {"kind": "mark", "text": ""}))
    ),
    "force off": tell_and_show(("force_stopped", {"by": "operator"}), PAUSED, force_on=False),
    "device lost": in_turn(
        clicked("stop.fade_in"),
        tell_and_show(
            ("broke", {"what": "the device 'falcon' stopped responding"}),
            beyond={"may_reconnect": True, "reconnection": "Not connected: no arm found its index"},
            force_on=False,
            device_ready=False,
            faults=2,
        ),
    ),
    "reconnecting": in_turn(clicked("banner.reconnect"), tell_and_show(beyond=RECONNECTS, force_on=False)),
    "in the dark theme": lambda window: window.header.theme_button.click(),
    "a part failed": lambda window: window.show_guarded(lambda: 1 / 0),
}
DISK: Actions = {
    "a form": tell_and_show(lambda it: it.welcome()),
    "late": lambda window: (tell_and_show(lambda it: it.start(3))(window), slow_down(window)),
    "targets": tell_and_show(
        *(("target_reached", {"trial": 3, "target": target, "t_task_s": 1.0}) for target in (0, 1))
    ),
    "pushed to the limit": plot_push(5.8),
    "hardly pushed": plot_push(0.02),
    "track": tell_and_show(
        beyond={
            "main_trials": (3, 9),
            "track": ("Track V1: 9 of at most 24 trials answered", "longest run 8, unusually long"),
        }
    ),
    "waiting for the disk": tell_and_show(force_on=False, trouble="no space left on the disk: free some", waits=True),
    "recording lost": tell_and_show(
        ("recording_lost", {"trial": 3, "attempt": 1, "reason": "No space left on device"})
    ),
    "asks to repeat": lambda window: window.ask_to_repeat(),
    "asks to end": lambda window: window.ask_to_end(),
    "says something": lambda window: window.show_message("It cannot be", "The disk is full."),
    "small": lambda window: window.resize(window.minimumSize()),
    "large": lambda window: window.resize(1920, 1080),
    "complete": tell_and_show(("session_ended", {"status": "completed", "reason": "", "fingerprint": "wwww-mmmm"})),
    "may be closed": lambda window: window.close(),
}


def strip(qtbot: Any) -> Strip:
    window: Any = show_window(qtbot, Strip(), (900, 52))
    window.demo_session = new_session()
    return window  # type: ignore[no-any-return]


def of_strip(**fields: Any) -> Callable[[Any], None]:
    return lambda window: window.show_view(window.demo_session.view(**fields))


STRIP: Actions = {
    "preparing": of_strip(),
    "running": lambda window: (window.demo_session.welcome(), window.demo_session.start(1), of_strip()(window)),
    "force off": of_strip(force_on=False),
    "trouble": of_strip(trouble="The disk is full"),
    "narrow": lambda window: window.resize(420, 52),
}
