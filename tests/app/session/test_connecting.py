"""Windows and parts of a session follow from the operator's choices, the study, the device and the store."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from study_app.app.session import bridge as bridge_module
from study_app.devices.simulated import MouseDevice, ScriptedDevice
from study_app.gui.theme.theme import DARK
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.trials.tasks import Explore
from study_app.protocol.wording.languages import words
from study_app.session.pages import Interval, TaskPage, TextPage
from study_app.session.resume import FIRST, Start
from tests.journal_lines import event_of
from tests.session import small

CHOSEN = replace(small.CHOSEN, participant="P007", language="nl", windowed=False)
STUDY = load("demo")
SEEN = STUDY.model_copy(
    update={
        "limits": STUDY.limits.model_copy(update={"lateness_ms": 3.5}),
        "device": STUDY.device.model_copy(update={"force_limit_n": 6.5}),
    }
)


def collected_arguments(*values: Any, **named: Any) -> tuple[tuple[Any, ...], dict[str, Any]]:
    return values, named


@pytest.mark.parametrize(
    ("device", "blinding", "options"),
    [
        ("mouse", "single", {"pointer": True, "felt": False, "stop_button": "", "force_limit_n": 6.5}),
        ("falcon", "double", {"pointer": False, "felt": True, "stop_button": "device button 4", "force_limit_n": None}),
    ],
)
def test_the_operators_window_has_the_limits_of_the_study_and_its_device(
    monkeypatch: pytest.MonkeyPatch, device: str, blinding: str, options: dict[str, Any]
) -> None:
    monkeypatch.setattr(bridge_module, "OperatorWindow", collected_arguments)
    study = SEEN.model_copy(update={"study": SEEN.study.model_copy(update={"blinding": blinding})})
    rig: Any = SimpleNamespace(device=SimpleNamespace(workspace_m=(0.05, 0.07, 0.03)))
    window = bridge_module.make_operator_window(replace(CHOSEN, device=device), study, rig, DARK)
    assert window == (("demo",), {"lateness_limit_s": 0.0035, "reach_m": 0.07, "theme": DARK, **options})


@pytest.mark.parametrize("shares_screen", [True, False])
def test_the_participants_window_is_in_the_chosen_language_and_has_a_strip_on_a_shared_screen(
    monkeypatch: pytest.MonkeyPatch, shares_screen: bool
) -> None:
    monkeypatch.setattr(bridge_module, "ParticipantWindow", collected_arguments)
    monkeypatch.setattr(bridge_module, "Strip", lambda *, played: f"strip, played {played}")
    monkeypatch.setattr(bridge_module, "has_graphics_card", lambda: True)
    for pilot, device, in_step in ((True, "falcon", True), (False, "mouse", False)):
        chosen = replace(CHOSEN, pilot=pilot, device=device, windowed=not pilot, played=pilot)
        values, named = bridge_module.make_participant_window(
            chosen, float, shares_screen=shares_screen, text_scale=1.25, photodiode=in_step, in_step=in_step
        )  # type: ignore[misc]
        assert values == (words("nl"),)
        assert named == {
            "clock": float,
            "windowed": not pilot,
            "captures_pointer": device == "mouse",
            "pilot": pilot,
            "on_card": in_step,
            "text_scale": 1.25,
            "photodiode": in_step,
            "strip": f"strip, played {pilot}" if shares_screen else None,
        }


@pytest.mark.parametrize(
    ("device_name", "device", "moves", "points"),
    [("mouse", MouseDevice(), False, True), ("scripted", ScriptedDevice(), True, False)],
)
def test_a_session_is_connected_with_the_parts_of_its_rig_and_its_store(
    monkeypatch: pytest.MonkeyPatch, device_name: str, device: Any, moves: bool, points: bool
) -> None:
    monkeypatch.setattr(bridge_module, "SessionBridge", collected_arguments)
    monkeypatch.setattr(bridge_module, "open_events", lambda lines, key: lines if key.nonce else [])
    servo = SimpleNamespace(fault=None, describe=lambda: {"priority": "real-time (SCHED_FIFO 60)"})
    rig: Any = SimpleNamespace(device=device, servo=servo)
    key = SimpleNamespace(codes={"liquids": {"L1": "thin"}}, nonce=b"secret")
    clock, lines = SimpleNamespace(seconds=lambda: 12.5), [event_of("session_started", language="nl")]
    store: Any = SimpleNamespace(clock=clock, key=key, lines=lines, recorder="recorder", outlets="outlets")
    schedule, start = build_schedule(SEEN, "P007", 41), Start(step=3)
    chosen = replace(CHOSEN, device=device_name)
    (parts, *windows), named = bridge_module.connect_windows(
        chosen, (SEEN, schedule, start), store, rig, "operator", "participant", refresh_hz=75.0, videos="videos"
    )  # type: ignore[arg-type, misc]
    assert (windows, named) == (["participant", "operator"], {"refresh_hz": 75.0})
    assert (parts.key, parts.secret, parts.language, parts.start) == (key.codes, b"secret", "nl", start)
    assert (parts.recorder, parts.outlets, parts.videos) == ("recorder", "outlets", "videos")
    assert (parts.servo, parts.clock(), parts.reconnect is None) == (servo, 12.5, False)
    assert (parts.aim_m(), parts.journal.progress.language) == (device.aim_m, "nl")
    assert (parts.point_to, parts.press) == ((device.point_to, device.press) if points else (None, None))
    assert (parts.hand_for is not None) == moves
    session = parts.session
    assert (session.protocol, session.schedule, session.who) == (SEEN, schedule, chosen.who)
    assert (session.lateness_limit_s, session.device_rows) == (0.0035, (("Priority", "real-time"),))
    assert session.answers_of == sum(len(trial.items) for trial in schedule.trials if trial.phase == "main")
    title = "Mouse" if points else "Scripted hand"
    assert (session.device_name, session.device_icon) == (title, "mouse" if points else "fast_forward")


def test_a_simulated_hand_rests_on_pages_and_between_intervals_and_acts_in_tasks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    actions: list[Any] = []
    monkeypatch.setattr(bridge_module, "hand_behaviour", lambda task, hand, draw, now_s: ("acts", task, hand, now_s))
    monkeypatch.setattr(bridge_module, "rest_hand", lambda task, hand: actions.append((task, hand)))
    hand: Any = SimpleNamespace(rest=lambda: actions.append("rests"))
    task = Explore(kind="explore", instruction="Move", min_s=1, max_s=60)
    text = TextPage(id="a", kind="break", title="", paragraphs=(), button="")
    tank = TaskPage(trial=1, instruction="", task=task, workspace_m=(0.1, 0.1, 0.1), body_radius_m=0.01, progress=None)
    hand_for_page = bridge_module._make_hand_for_page(hand, CHOSEN, lambda: 4.5)
    assert hand_for_page(text) is None
    assert hand_for_page(replace(tank, interval=Interval(2, 2, resting=True, announced=""))) is None
    assert actions == ["rests", (task, hand)]
    for interval in (None, Interval(2, 2, resting=False, announced="")):
        assert hand_for_page(replace(tank, interval=interval)) == ("acts", task, hand, 4.5)
    assert len(actions) == 2


@pytest.mark.parametrize(("device", "is_forceless"), [("mouse", True), ("scripted", False)])
def test_the_plan_of_a_session_resumes_where_it_was_and_has_no_force_without_a_device_for_it(
    monkeypatch: pytest.MonkeyPatch, device: str, is_forceless: bool
) -> None:
    requests: list[Any] = []
    monkeypatch.setattr(
        bridge_module, "session_protocol", lambda folder, *arguments: requests.append(arguments) or arguments[0]
    )
    monkeypatch.setattr(bridge_module, "start_of", lambda lines: lines[0])
    monkeypatch.setattr(bridge_module, "begun_schedule", lambda _protocol, first, key: f"schedule of {first}, {key}")
    monkeypatch.setattr(bridge_module, "without_force", lambda _protocol: "without force")
    monkeypatch.setattr(
        bridge_module, "resume_at", lambda _protocol, _schedule, lines, key, *, exactly: (lines, key, exactly)
    )
    lines = ["first", "last"]
    store: Any = SimpleNamespace(as_recorded=lambda protocol: f"recorded {protocol}", lines=lines, key="key")
    protocol: Any = "study"
    for resumes, played, start in (
        (None, False, FIRST),
        (Path("ses-02"), False, (lines, "key", False)),
        (Path("ses-02"), True, (lines, "key", True)),
    ):
        chosen = replace(CHOSEN, device=device, session=2, resumes=resumes, played=played)
        assert bridge_module.session_plan(chosen, protocol, store) == (
            "without force" if is_forceless else "recorded study", "schedule of first, key", start,
        )  # fmt: skip
        assert requests.pop() == ("recorded study", "P007", 2)
