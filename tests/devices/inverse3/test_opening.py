"""Opening a session at the Inverse Service: the chosen device, its requirements, and its description."""

from types import SimpleNamespace
from typing import Any

import numba
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("devices are C functions", allow_module_level=True)

from study_app.devices.doctor import DeviceFailure
from study_app.devices.inverse3.device import address
from study_app.devices.inverse3.opening import _check_status, _find_device, _measure_round_trip, open_session

SCOPED: dict[str, Any] = {
    "preset": "arm_front_centered",
    "basis": {"permutation": "XYZ"},
    "filters": {"force_gate": {"gain": 0.0}, "damping": {"scalar": 0.0}},
}
GLOBAL: dict[str, Any] = {
    "gravity_compensation": {"enabled": True, "scaling_factor": 1.0},
    "torque_scaling": {"enabled": True},
}
FOUND = GLOBAL | {"preset": "defaults", "filters": {"force_gate": {"gain": 0.3}}, "device_info": {"major": 7}}
FOUND |= {"extended_firmware_version": "fw-9", "other": 5}
STATUS = {"power_supply": True, "ready": True, "calibrated": True, "in_use": False}


def device(name: str, **changes: Any) -> dict[str, Any]:
    return {"device_id": name, "config": FOUND, "status": STATUS} | changes


@pytest.mark.parametrize(
    ("where", "host", "port", "device_id"),
    [
        ("", "127.0.0.1", 10001, ""),
        ("049D", "127.0.0.1", 10001, "049D"),
        ("lab:9", "lab", 9, ""),
        ("lab:65535:049D", "lab", 65535, "049D"),
    ],
)
def test_an_address_has_host_port_and_device(where: str, host: str, port: int, device_id: str) -> None:
    assert address(where) == (host, port, device_id)


def test_the_first_device_is_chosen_or_the_one_with_the_wanted_id() -> None:
    first, second = device("A1"), device("B2")
    message = {"inverse3": [7, {}, first, second]}
    assert _find_device(message) is first
    assert _find_device(message, "B2") is second
    with pytest.raises(DeviceFailure, match=r"listed: \['A1', 'B2'\]") as failure:
        _find_device(message, "C3")
    assert failure.value.mode == "no-device"
    state = {"device_id": "A1", "state": {}}
    assert _find_device({"inverse3": [state]}, "A1", inventory=False) is state
    for wrong in (state, device("A1", config={}), device("A1", status=[])):
        with pytest.raises(DeviceFailure) as failure:
            _find_device({"inverse3": [wrong]}, "A1")
        assert failure.value.mode == "version"


@pytest.mark.parametrize(
    ("status", "at_opening", "mode"),
    [
        ({"power_supply": False}, False, "not-ready"),
        ({"ready": False}, False, "not-ready"),
        ({"calibrated": False}, False, "uncalibrated"),
        ({"in_use": True}, True, "in-use"),
        ({"in_use": True}, False, None),
        ({"ready": None}, True, None),
        (STATUS, True, None),
        ({}, True, None),
    ],
)
def test_a_device_that_cannot_be_used_is_refused(status: dict[str, Any], at_opening: bool, mode: str | None) -> None:
    if mode is None:
        _check_status(status, at_opening=at_opening)
        return
    with pytest.raises(DeviceFailure) as failure:
        _check_status(status, at_opening=at_opening)
    assert failure.value.mode == mode


class Played:
    """Scripted answers of a service; each zero force takes a millisecond longer than the last."""

    def __init__(self, *answers: Any) -> None:
        self.answers = list(answers)
        self.asked: list[Any] = []
        self.at_s = 0.0
        self.link: Any = SimpleNamespace(now_s=lambda: self.at_s)

    def receive(self) -> Any:
        return self.answers.pop(0)

    def ask(self, message: Any) -> Any:
        self.asked.append(message)
        if not self.answers:
            self.at_s += 0.001 * len(self.asked)
        return self.answers.pop(0) if self.answers else {}


def test_the_round_trip_is_that_which_nine_of_ten_do_not_exceed() -> None:
    """Of 50 round trips of 1, 2 … 50 ms it is the 46th."""
    messages: Any = Played()
    assert _measure_round_trip(messages, messages.link, "A1") == pytest.approx(0.046)
    zero = {"vector": {"x": 0.0, "y": 0.0, "z": 0.0}}
    assert messages.asked == [
        {"inverse3": [{"device_id": "A1", "commands": {"set_cursor_force": zero}}]},
    ] * 50  # fmt: skip


def test_a_session_is_described_with_the_settings_found_and_those_in_force() -> None:
    in_force = GLOBAL | SCOPED | {"mount": "table", "other": 5}
    messages: Any = Played({"inverse3": [device("A1")]}, {}, {"inverse3": [{"device_id": "A1", "config": in_force}]})
    session = open_session(messages, messages.link)
    assert (session.device_id, session.round_trip_s) == ("A1", pytest.approx(0.048))
    assert session.described == {
        "device_id": "A1", "serial": "A1", "device_info": {"major": 7}, "firmware": "fw-9", "round_trip_ms": 48.0,
        "service_settings": {
            "found": GLOBAL | {"preset": "defaults", "filters": {"force_gate": {"gain": 0.3}}},
            "in_force": GLOBAL | SCOPED | {"mount": "table"},
            "confirmed": True,
        },
    }  # fmt: skip
    first, second = messages.asked[:2]
    assert first["session"]["configure"]["profile"] == {"name": "liquid-study:study"}
    assert "configure" in first["inverse3"][0]
    assert (second["session"], "configure" in second["inverse3"][0]) == ({"force_render_full_state": {}}, False)


@pytest.mark.parametrize(
    ("in_force", "found_settings", "words"),
    [
        ({"preset": "defaults"}, {}, "preset is 'defaults', but must be 'arm_front_centered'"),
        ({"filters": {"force_gate": {"gain": 0.0}, "damping": 5}}, {}, "filters.damping.scalar is None, but must be 0"),
        ({"torque_scaling": {"enabled": False}}, {}, "torque_scaling.enabled is False, but must be True"),
        (None, {"gravity_compensation": 5}, "gravity_compensation.enabled is None, but must be True; gravity_compens"),
        (None, {"preset": "defaults"}, None),
    ],
)  # fmt: skip
def test_settings_that_change_the_force_are_required(
    in_force: dict[str, Any] | None, found_settings: dict[str, Any], words: str | None
) -> None:
    """Without a confirmation only the settings that a message cannot set are required of those found."""
    state: dict[str, Any] = {"device_id": "A1"}
    if in_force is not None:
        state["config"] = GLOBAL | SCOPED | in_force
    messages: Any = Played({"inverse3": [device("A1", config=FOUND | found_settings)]}, {}, {"inverse3": [state]})
    if words is None:
        assert open_session(messages, messages.link).described["service_settings"]["confirmed"] is False
        return
    with pytest.raises(DeviceFailure, match=words) as failure:
        open_session(messages, messages.link)
    assert failure.value.mode == "settings"
