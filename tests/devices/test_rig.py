"""Device and servo opened together: what is cancelled meanwhile is let go of before a servo runs."""

from typing import Any

import pytest

from study_app.devices import rig
from study_app.errors import DeviceError
from study_app.protocol.streams import stream
from tests.compiled import needs_servo

SETTINGS = rig.RigSettings(workspace_m=(0.1, 0.06, 0.06), force_limit_n=8.0, elements=100, random=stream(1, "tremor"))


@needs_servo
def test_a_device_cancelled_while_it_opens_is_closed_and_gets_no_servo(monkeypatch: Any) -> None:
    opened: list[Any] = []
    closed: list[str] = []

    def open_device(*words: Any, **named: Any) -> Any:
        device = open_before(*words, **named)
        opened.append(device)
        close = device.close
        monkeypatch.setattr(device, "close", lambda: (closed.append(device.name), close()))
        return device

    open_before = rig.open_device
    monkeypatch.setattr(rig, "open_device", open_device)
    with pytest.raises(DeviceError, match="'scripted' was cancelled"):
        rig.open_rig("scripted", SETTINGS, cancelled=lambda: bool(opened))
    assert closed == ["scripted"]


@needs_servo
def test_a_device_is_closed_if_asking_whether_to_cancel_fails(monkeypatch: Any) -> None:
    opened: list[Any] = []
    open_before = rig.open_device

    def open_device(*words: Any, **named: Any) -> Any:
        device = open_before(*words, **named)
        opened.append(device)
        monkeypatch.setattr(device, "close", lambda: opened.append("closed"))
        return device

    def fail() -> bool:
        raise RuntimeError("the window is gone")

    monkeypatch.setattr(rig, "open_device", open_device)
    with pytest.raises(RuntimeError, match="the window is gone"):
        rig.open_rig("scripted", SETTINGS, cancelled=fail)
    assert opened[1:] == ["closed"]
