"""All actions of a session's bridge at each signal of its windows: calls of servo and journal, pages, views."""

import logging
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

import numpy as np
import pytest
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication
from shiboken6 import isValid

from study_app.app.session import bridge as bridge_module
from study_app.errors import DeviceNotFound, ServoFault, VideoError
from study_app.gui.operator.session_panels import Strip
from study_app.haptics.model.layout import LIMITER_FADE, LIMITER_NORM, SAMPLE, records
from study_app.program_log import DEVICE_FAILED
from study_app.session.transitions.events import Continue, ForceStopped
from tests.app.world import World
from tests.golden import compare, masked
from tests.golden_values import changed, value_lines

GOLDEN = Path(__file__).parent / "golden"


class Recorded(World):
    """A world with a servo that may fault, which also records the calls of its parts."""

    tables_written = 0

    def write_tables(self) -> None:
        self.tables_written += 1

    def call(self, name: str, result: Any = None) -> Any:
        def called(*values: Any) -> Any:
            self.done.append((name, values))
            return result

        return called


def push(bridge: Any, world: World) -> None:
    """Add half a second of samples with a force of 3 N, some limited."""
    count = 500
    samples = records(SAMPLE, count)
    world.now_s += count / 1000
    samples.tick = np.arange(count)
    samples.time_ns = round(world.now_s * 1e9) - np.arange(count)[::-1] * 1_000_000
    samples.scene, samples.fresh = world.serial, 1
    samples.position_m = np.linspace((-0.03, 0.0, 0.0), (0.04, 0.02, -0.01), count)
    samples.device_force_n, samples.wake_mps = (1.5, 0.0, 2.5), (0.3, 0.0, 0.4)
    samples.permitted_n, samples.withheld_n, samples.limiters = 4.0, 0.25, LIMITER_FADE
    samples.limiters[:7] |= LIMITER_NORM
    world.samples = samples
    bridge.draw_frame()
    world.samples = records(SAMPLE, 0)


def emit(name: str, *values: Any) -> Any:
    return lambda bridge, _world: getattr(bridge.participant, name).emit(*values)


def ask(what: str, *details: Any) -> Any:
    return lambda bridge, _world: bridge.operator.ask(what, *details)


def event(kind: Any, *values: Any) -> Any:
    return lambda bridge, world: bridge.participant.event.emit(kind(world.now_s, *values))


def shown_at(bridge: Any, world: World) -> None:
    bridge.runner.frame_shown(world.now_ns(), world.now_ns())


def let(**values: Any) -> Any:
    return lambda _bridge, world: vars(world).update(values)


def waited(bridge: Any, world: World) -> None:
    world.now_s += 2.0
    bridge.draw_frame()
    bridge.show_tiles()
    bridge.show_traces()
    bridge.show_forces()


def fail(error: Exception) -> Any:
    return lambda bridge, _world: bridge.fail(error)


def reconnected(bridge: Any, world: World) -> None:
    world.fault = None
    assert bridge.reconnecting.wait(20)
    QApplication.sendPostedEvents(None, QEvent.Type.MetaCall)


STEPS: dict[str, Any] = {
    "wait": waited,
    "go on": event(Continue),
    "shown": shown_at,
    "push": push,
    "pointer": emit("pointer", 0.01, 0.02, 0.03),
    "buttons": emit("buttons", 2),
    "painted": emit("painted", 5_000_000),
    "left": emit("left"),
    "note": ask("note", "left-handed"),
    "mark": ask("mark"),
    "pause": ask("pause"),
    "resume": ask("resume"),
    "repeat": ask("repeat", "phone rang"),
    "stop": ask("stop"),
    "fade in": ask("resume"),
    "participant stops": event(ForceStopped, "participant"),
    "part fails": ask("failed", "ValueError: no plot", ValueError("no plot")),
    "thread ends": lambda bridge, _: bridge._thread_exceptions.ended.emit("the writer ended"),
    "diagnose": ask("diagnose"),
    "disk is full": let(full=True),
    "disk has space": let(full=False),
    "servo stops": let(fault="the servo stopped: no samples"),
    "device error": fail(DeviceNotFound("no device is plugged in")),
    "servo error": fail(ServoFault("the loop ended")),
    "second error": fail(ValueError("second")),
    "bug": fail(RuntimeError("out of ideas")),
    "no clip": fail(VideoError("the clip ended")),
    "reconnect": ask("reconnect"),
    "line": lambda bridge, _: bridge.show_device_line("press the button"),
    "reconnected": reconnected,
    "not reconnected": lambda bridge, _: bridge.reconnecting.failed.emit(DeviceNotFound("still none")),
    "late": let(overruns=3, rate_hz=900.0, worst_gap_s=0.004),
    "withdraw": ask("end", "withdrawn", "felt unwell"),
    "abort": ask("end", "aborted", "broken"),
    "close": ask("close"),
    "accept": lambda bridge, _: bridge.operator.question.accept(),
    "leave": lambda bridge, _: bridge.leave_without_asking(),
}
WORDS = re.compile(r"# \+ +((?:title|state_word|heading|setting_line|part_line|notes|question|trouble|page): .*)")
BEGUN = "wait, go on, shown, push"
PLAYS = {
    "requests": f"{BEGUN}, pointer, buttons, painted, left, note, mark, pause, resume, shown, repeat, shown, stop, "
    "push, fade in, shown, participant stops, fade in, shown, "
    "part fails, thread ends, diagnose, late, wait, withdraw, note, thread ends, wait, diagnose, close",
    "full disk": f"{BEGUN}, disk is full, mark, note, stop, wait, diagnose, disk has space, wait, fade in, shown, "
    "wait, disk is full, abort, close, close",
    "lost device": f"{BEGUN}, line, reconnect, servo stops, wait, device error, second error, reconnect, line, "
    "not reconnected, reconnect, reconnected, wait, fade in, shown, push, servo stops, wait, abort, close",
    "bug": f"{BEGUN}, bug, second error, wait, reconnect, resume, push, abort, wait, close",
    "video": f"{BEGUN}, no clip, wait, reconnect, reconnected, wait, resume, shown, close, accept, close",
    "servo": f"{BEGUN}, servo error, wait, leave, leave",
    "closed twice": f"{BEGUN}, close, close, leave",
}


def words_of(call: Any) -> str:
    """Return a call as text, or a line with its values."""
    if isinstance(call, str):
        return call
    name, values = call
    told_values = [values[key] for key in TOLD if values.get(key)] if isinstance(values, dict) else values
    return " ".join(map(str, (name, *told_values)))


TOLD = ("page", "trial", "attempt", "code", "by", "kind", "text", "reason", "what", "status", "device")
STOP = (
    "stop_force, stop_force, stop_force, recorder.stop, rest, trial_ended 1 {}, force_stopped operator, paused operator"
)
BEGIN = "load, recorder.start 1 {} 1000.0 None, recorder.frame {} {} None"
FADE_IN = "resumed operator, force_restored operator, fade_in, trial_started 1 {} L1"
BROKE = "recorder.stop, rest, trial_ended 1 {}, broke the servo stopped: no samples"
CALLS = {
    "requests": {
        "go on": ["page_left welcome, trial_started 1 1 L1"],
        "shown": [BEGIN.format(attempt, *[at_ns] * 2) for attempt, at_ns in (
            (1, 2_750_000_000), (2, 5_750_000_000), (3, 6_250_000_000), (4, 7_750_000_000), (5, 8_500_000_000))],
        "pointer": ["point_to 0.01 0.02 0.03"],
        "buttons": ["press 2"],
        "painted": ["recorder.frame 4250000000 5000000 None"],
        "left": ["operator.bring_forward"],
        "note": ["note note left-handed", ""],
        "mark": ["note mark"],
        "pause": ["recorder.stop, rest, trial_ended 1 1, paused operator"],
        "resume": ["resumed operator, trial_started 1 2 L1"],
        "repeat": ["recorder.stop, rest, trial_ended 1 2, repeat 1 phone rang, trial_started 1 3 L1"],
        "stop": [STOP.format(3)],
        "fade in": [FADE_IN.format(4), FADE_IN.format(5)],
        "participant stops": [STOP.format(4).replace("operator", "participant")],
        "part fails": ["note note part of the operator's window stopped working: ValueError: no plot"],
        "diagnose": [f"{STOP.format(5)}, diagnose_asked", "stop_force, diagnose_asked"],
        "late": [""],
        "withdraw": ["session_ended felt unwell withdrawn"],
        "close": ["done"],
    },
    "lost device": {
        "servo stops": ["", ""],
        "wait": ["", f"stop_force, {BROKE.format(1)}", "note note the program stalled for 4.0 s",
                 f"stop_force, {BROKE.format(2)}"],
        "device error": ["stop_force, stop_force, broke no device is plugged in"],
        "second error": ["stop_force"],
        "reconnect": ["", "reconnect", ""],
        "reconnected": ["stop_force, device_reconnected mouse, paused program"],
        "fade in": [FADE_IN.format(2)],
        "abort": ["session_ended broken broken"],
        "close": ["done"],
    },
}  # fmt: skip


def view_words(view: Any) -> str:
    """Return the operator's information on device and disk."""
    faults = f"{dict(view.device.rows)['Safety faults']} faults"
    conditions = {"waits": view.waits, "force on": view.force_on, "device ready": view.device.ready, faults: True,
            "may reconnect": view.may_reconnect, "reconnects": view.reconnects, view.reconnection: view.reconnection,
            f"trouble {view.trouble}": view.trouble}  # fmt: skip
    return ", ".join([view.state, *(words for words, holds in conditions.items() if holds)])


RUNS, OFF = "running, force on, device ready, {} faults", "force off, device ready, {} faults"
FULL = "trouble, waits, device ready, 0 faults, trouble no space left on the disk: free some"
LOST = "trouble, {} faults, may reconnect{}, trouble {}"
VIEWS = {
    "lost device": [
        ("wait", RUNS.format(0)),
        ("servo stops", "trouble, force on, 1 faults, trouble the servo stopped: no samples"),
        ("wait", LOST.format(1, "", "the servo stopped: no samples")),
        ("device error", LOST.format(1, "", "no device is plugged in")),
        ("reconnect", LOST.format(1, ", reconnects, Connecting the device…", "no device is plugged in")),
        ("line", LOST.format(1, ", reconnects, press the button", "no device is plugged in")),
        ("not reconnected", LOST.format(1, ", reconnects, Not connected: still none.", "no device is plugged in")),
        ("reconnected", OFF.format(1)),
        ("fade in", RUNS.format(1)),
        ("servo stops", "trouble, force on, 2 faults, trouble the servo stopped: no samples"),
        ("wait", LOST.format(2, "", "the servo stopped: no samples")),
        ("abort", "ended, 2 faults, trouble the servo stopped: no samples"),
    ],
    "full disk": [
        ("wait", RUNS.format(0)),
        ("mark", FULL),
        ("wait", OFF.format(0)),
        ("fade in", RUNS.format(0)),
        ("wait", "paused, force on, device ready, 0 faults"),
        ("abort", FULL.replace("trouble", "ended", 1)),
    ],
}
LOGGED = {
    "full disk": [
        *("the session waits: no space left on the disk: free some", "the disk accepts data again"),
        "the session waits: no space left on the disk: free some",
    ],
    "lost device": [
        DEVICE_FAILED % "the servo stopped: no samples",
        *("the session failed: no device is plugged in", "the device was not reconnected: still none"),
        DEVICE_FAILED % "the servo stopped: no samples",
    ],
}
"""Where what the operator is told changes: the first ``wait`` is the beginning."""


def page_summary(page: Any) -> list[str]:
    """Return a page's kind and values, without the page that follows."""
    return list(value_lines(replace(page, coming=None) if getattr(page, "coming", None) else page, "page"))


def calls_and_words(lines: list[str]) -> Iterator[str]:
    """Yield every call, and each new text of the views once; numbers as #."""
    known_texts = set[str]()
    for line in lines:
        if not line.startswith("# "):
            yield masked(line)
        elif (word := WORDS.match(line)) and (text := masked(word[1])) not in known_texts:
            known_texts.add(text)
            yield f"  {text}"


def test_a_place_is_the_newest_one_or_a_simulated_hands_aim() -> None:
    at_ns: Any = SimpleNamespace(position_at=lambda time_ns: (np.array((1.0, 2.0, 3.0)) * time_ns, time_ns))
    servo: Any = SimpleNamespace(now_ns=lambda: 7, telemetry=at_ns)
    hand: Any = SimpleNamespace(aim_m=(4.0, 5.0, 6.0))
    assert bridge_module._make_position_reader(None, servo)() == (7.0, 14.0, 21.0)
    assert bridge_module._make_position_reader(hand, servo)() == (4.0, 5.0, 6.0)


@pytest.mark.parametrize(("has_videos", "fault", "called"), [
    (False, None, ["rig"]), (False, "lost", ["rig"]), (True, None, ["videos"]), (True, "lost", ["rig", "videos"])
])  # fmt: skip
def test_failed_devices_are_reconnected(has_videos: bool, fault: str | None, called: list[str]) -> None:
    reconnected: list[str] = []
    rig: Any = SimpleNamespace(
        servo=SimpleNamespace(fault=fault), reconnect=lambda: reconnected.append("rig"), described={"name": "mouse"}
    )
    videos: Any = SimpleNamespace(reopen=lambda: reconnected.append("videos")) if has_videos else None
    assert bridge_module._make_reconnect(rig, videos)() == {"name": "mouse"}
    assert reconnected == called


@pytest.mark.parametrize(("described", "rows"), [
    ({}, ()), ({"calibration": {"measured": "2026-11-20"}}, (("Calibration", "of 2026-11-20"),)),
    ({"calibration": "factory"}, (("Calibration", "none"),)),
])  # fmt: skip
def test_the_calibration_of_a_device_is_shown_with_its_day(described: dict[str, Any], rows: Any) -> None:
    device: Any = SimpleNamespace(describe=lambda: described)
    assert bridge_module._calibration_rows(device) == rows


@pytest.mark.parametrize(
    ("name", "blinding"),
    [
        *(
            pytest.param(name, "single", marks=[pytest.mark.slow] if name in ("servo", "video") else [])
            for name in PLAYS
        ),
        pytest.param("requests", "double", marks=pytest.mark.slow),
    ],
)
def test_every_signal(make: Any, name: str, blinding: str, pytestconfig: Any, caplog: Any, monkeypatch: Any) -> None:
    caplog.set_level(logging.INFO)
    world, computer = Recorded(), mock.Mock()
    for part in ("Awake", "ThreadPriority"):
        monkeypatch.setattr(bridge_module, part, lambda: computer)
    for call in ("freeze_garbage", "unfreeze_garbage"):
        monkeypatch.setattr(bridge_module, call, getattr(computer, call))
    recorder = SimpleNamespace(
        start=world.call("recorder.start"), append=lambda *_: None, frame=world.call("recorder.frame"),
        stop=world.call("recorder.stop"), end_without_waiting=lambda: True, lost=(), dropped=2,
    )  # fmt: skip
    bridge = make(
        blinding, servo=world, journal=world, clock=world.seconds, point_to=world.call("point_to"), recorder=recorder,
        press=world.call("press"), reconnect=world.call("reconnect", {"name": "mouse"}),
        strip=Strip() if name == "bug" else None, force_limit_n=6.0 if blinding == "single" else None,
    )  # fmt: skip
    for signal in ("done", "diagnose_asked"):
        getattr(bridge, signal).connect(world.call(signal))
    monkeypatch.setattr(bridge.operator, "bring_forward", world.call("operator.bring_forward"))
    monkeypatch.setattr(bridge.participant, "bring_forward", world.call("participant.bring_forward"))
    monkeypatch.setattr(bridge.operator, "show_message", world.call("show_message"))
    lines, before, calls, views = [], list[str](), dict[str, list[str]](), list[tuple[str, str]]()
    logged: list[str] = []
    for step in PLAYS[name].split(", "):
        world.now_s += 0.25
        world.done.clear()
        caplog.clear()
        STEPS[step](bridge, world)
        logged += [
            record.getMessage()
            for record in caplog.records
            if record.levelno >= logging.WARNING or record.msg == DEVICE_FAILED
        ]
        calls.setdefault(step, []).append(", ".join(map(words_of, world.done)))
        if isValid(bridge) and not bridge._has_left and name in VIEWS:
            words = view_words(bridge.view())
            views += [(step, words)] if not views or words != views[-1][1] else []
        lines += [
            f"== {step}",
            *map(str, world.done),
            *(
                f"log {record.levelname} {record.getMessage()}"
                for record in caplog.records
                if record.levelno >= logging.WARNING
            ),
        ]
        if isValid(bridge) and not bridge._has_left:
            after = [
                *page_summary(bridge.participant.page),
                *value_lines(bridge.view(), "view"),
                f"trouble: {bridge.trouble}",
            ]
            lines += (f"# {line}" for line in changed(before, after))
            before = after
    caplog.clear()
    assert world.tables_written > 0
    began, left = ["freeze_garbage", "raise_priority", "begin"], ["restore", "end", "unfreeze_garbage"]
    assert [call for call, *_ in computer.method_calls] == began + left
    assert logged == LOGGED.get(name, logged)
    assert {step: calls[step] for step in CALLS.get(name, ())} == CALLS.get(name, {})
    assert views == VIEWS.get(name, [])
    compare(GOLDEN / f"bridge_{name.replace(' ', '_')}_{blinding}.txt", calls_and_words(lines), pytestconfig)
