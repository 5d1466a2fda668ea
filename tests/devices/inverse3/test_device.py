"""The Inverse3's driver: what it sends and records when it is opened, how it ends, and what it reads."""

import ctypes
import json
import threading
from typing import Any

import numpy as np
import pytest

from study_app.devices import call_gate
from study_app.devices.inverse3 import service_settings
from study_app.devices.inverse3.device import Inverse3Device, address
from study_app.devices.inverse3.doctor import examine
from study_app.devices.inverse3.emulated import EmulatedInverse3, EmulatedLink
from study_app.devices.inverse3.emulator.service import Service
from study_app.devices.inverse3.exchange import MOST_UNANSWERED, MOST_WEAKER, new_exchange
from study_app.devices.inverse3.opening import find_device
from study_app.devices.registry import open_device
from study_app.errors import DeviceError, DeviceNotFound
from study_app.haptics.kernels.c_functions import READ_LOST, READ_NEW, READ_NOTHING_NEW
from study_app.haptics.model.layout import MEASURED_VELOCITY, new_reading
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.load import load
from tests.compiled import needs_servo
from tests.devices.contract import write

pytestmark = needs_servo

RECEIVE = ctypes.CFUNCTYPE(ctypes.c_ssize_t, ctypes.c_ssize_t, ctypes.c_ssize_t, ctypes.c_size_t, ctypes.c_int32)


class Ticks:
    """Calls a device as the servo does."""

    def __init__(self, device: Any) -> None:
        self.device = device
        self.reading = new_reading()
        self.now_ns = int(device.exchange.now_ns)

    def take(self, force_n: tuple[float, float, float] = (0.0, 0.0, 0.0), pause_ns: int = 1_000_000) -> tuple[int, Any]:
        """Take a tick; return what the read answered and which force the write says that it sent."""
        self.now_ns += pause_ns
        self.reading[0].measured = 0
        answer = self.device.read.ctypes(self.device.context, self.now_ns, self.reading.ctypes.data)
        return answer, write(self.device, force_n)[1]


def exchanged(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """Return a list that gets every message that a client sends while it opens a session, as the service reads it."""
    messages: list[dict[str, Any]] = []
    answer = Service._answer_message

    def note(service: Service, message: dict[str, Any]) -> None:
        messages.append(json.loads(json.dumps(message)))
        answer(service, message)

    monkeypatch.setattr(Service, "_answer_message", note)
    return messages


class TestOpening:
    def test_the_first_message_neutralises_every_setting_that_a_message_can_set(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        messages = exchanged(monkeypatch)
        service = Service()
        with EmulatedInverse3(service=service):
            pass
        (first, second) = messages
        (device,) = first["inverse3"]
        assert device["device_id"] == "EMU1"
        assert device["configure"] == {
            "preset": {"preset": "arm_front_centered"},
            "damping": {"scalar": 0.0, "vector": {"x": 0.0, "y": 0.0, "z": 0.0}},
            "force_gate": {"gain": 0.0},
        }
        assert first["session"]["configure"]["basis"] == {"permutation": "XYZ"}
        assert device["commands"] == {"set_cursor_force": {"vector": {"x": 0.0, "y": 0.0, "z": 0.0}}}
        assert list(second["session"]) == ["force_render_full_state"]
        assert service.config["filters"]["force_gate"] == {"gain": 0.0}

    def test_the_receipt_has_the_settings_as_found_and_in_force(self) -> None:
        with EmulatedInverse3() as device:
            described = device.describe()
        found, in_force = (described["service_settings"][key] for key in ("found", "in_force"))
        assert found["filters"] == {"force_gate": {"gain": 0.3}, "damping": {"scalar": 0.0}}
        assert found["preset"] == "defaults"
        assert in_force["filters"]["force_gate"] == {"gain": 0.0}
        assert in_force["preset"] == "arm_front_centered"
        assert in_force["gravity_compensation"] == {"enabled": True, "scaling_factor": 1.0}
        assert in_force["torque_scaling"] == {"enabled": True}
        assert described["service_settings"]["confirmed"] is True
        assert described["force_scale"] == 1.0
        assert json.loads(json.dumps(described)) == described

    def test_settings_that_differ_are_named_with_their_value(self) -> None:
        service = Service()
        service.config["torque_scaling"]["enabled"] = False
        with pytest.raises(DeviceError, match=r"torque_scaling\.enabled is False, and True is required"):
            EmulatedInverse3(service=service).open()

    def test_a_service_that_does_not_confirm_is_used_and_the_receipt_says_so(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(service_settings, "full_state_request", service_settings.zero_force)
        monkeypatch.setattr("study_app.devices.inverse3.opening.full_state_request", service_settings.zero_force)
        lines: list[str] = []
        with EmulatedInverse3(progress=lines.append) as device:
            assert device.describe()["service_settings"]["confirmed"] is False
        assert lines == ["The service did not confirm its settings: compare them in Haply Hub."]

    @pytest.mark.parametrize("device_id", ["A" * 65, "A" * 4000, "", 'A"B', "A\\B", "A B", "é1"])
    def test_an_id_that_does_not_fit_into_a_command_is_refused_in_a_line(
        self, device_id: str, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        service = Service()
        message = service.inventory()
        message["inverse3"][0]["device_id"] = device_id
        monkeypatch.setattr(service, "inventory", lambda: message)
        with pytest.raises(
            DeviceError, match=rf"id .* has {len(device_id)} characters; 1 to 64 .* permitted"
        ) as refused:
            EmulatedInverse3(service=service).open()
        assert "\n" not in str(refused.value)
        assert len(str(refused.value)) < 250
        assert service.state.ended == 1
        assert service.state.commands == 0

    def test_the_longest_id_fits_into_a_command(self) -> None:
        memory = new_exchange("A" * 64, 8.0, 1)
        assert memory[0].prefix_size + 80 < memory[0].text.size

    def test_entries_without_an_id_are_passed_over(self) -> None:
        mine = {"device_id": "049D", "config": {"filters": {}}}
        assert find_device({"inverse3": [7, {}, {"device_id": "0000"}, mine]}, "049D") == mine
        with pytest.raises(DeviceNotFound, match="listed: none"):
            find_device({"inverse3": [7, {}]})

    def test_a_refused_device_leaves_no_connection_open(self) -> None:
        service = Service()
        service.take("uncalibrated")
        device = EmulatedInverse3(service=service)
        with pytest.raises(DeviceError):
            device.open()
        assert service.state.ended == 1
        service.status["calibrated"] = True
        with device:  # once it is cured, the same device opens
            assert Ticks(device).take()[0] == READ_NOTHING_NEW

    def test_no_service_is_one_line_with_its_address_and_the_cure(self) -> None:
        with pytest.raises(DeviceNotFound, match=r"Inverse Service does not answer.*start Haply Hub") as refused:
            open_device("inverse3:127.0.0.1:9")
        assert "127.0.0.1:9" in str(refused.value)
        assert "\n" not in str(refused.value)

    def test_a_workspace_beyond_its_reach_is_refused(self) -> None:
        with pytest.raises(DeviceError, match="a workspace of 200 x 60 x 60 mm is more than an Inverse3 reaches"):
            EmulatedInverse3(workspace_m=(0.1, 0.03, 0.03))

    @pytest.mark.parametrize(
        ("where", "found"),
        [
            ("", ("127.0.0.1", 10001, "")),
            ("049D", ("127.0.0.1", 10001, "049D")),
            ("lab-3:10002", ("lab-3", 10002, "")),
            ("lab-3:10002:049D", ("lab-3", 10002, "049D")),
        ],
    )
    def test_an_address_names_host_port_and_device(self, where: str, found: tuple[str, int, str]) -> None:
        assert address(where) == found

    @pytest.mark.parametrize("where", [":1", "a:b", "a:0", "a:65536", "a:1:b:c", "a:-1"])
    def test_a_wrong_address_is_refused(self, where: str) -> None:
        with pytest.raises(DeviceError, match="is not an address of the Inverse Service"):
            Inverse3Device(where)


class TestTicks:
    def test_a_tick_gives_the_state_of_the_command_before_in_the_hand_frame(self) -> None:
        service = Service(tremor_m=0.0, quantum_m=0.0)
        with EmulatedInverse3(service=service) as device:
            ticks = Ticks(device)
            service.hold(0.01, 0.02, -0.03)
            assert ticks.take()[0] == READ_NOTHING_NEW  # nothing was asked for yet
            for _ in range(400):
                answer, _sent = ticks.take()
                assert answer == READ_NEW
            assert ticks.reading[0].position_m == pytest.approx([0.01, 0.02, -0.03], abs=3e-4)
            assert ticks.reading[0].delay_ticks == 1
            service.reach_to(0.01, 0.04, -0.03, duration_s=0.2)
            for _ in range(100):
                ticks.take()
            assert ticks.reading[0].measured == MEASURED_VELOCITY
            velocity = ticks.reading[0].velocity_mps
            assert velocity[1] > 0.1
            assert np.abs(velocity[[0, 2]]).max() < 0.01

    @pytest.mark.parametrize(
        "force_n", [(1.5, 0.0, 0.0), (0.0, -2.25, 0.0), (0.0, 0.0, 3.125), (-7.999999, 0.000001, 0)]
    )
    def test_a_force_reaches_the_handle_as_it_was_written(self, force_n: tuple[float, float, float]) -> None:
        service = Service()
        with EmulatedInverse3(service=service) as device:
            ticks = Ticks(device)
            _answer, sent_n = ticks.take(force_n)
            assert service.force_n == pytest.approx(force_n, abs=5e-7)
            assert tuple(sent_n) == force_n

    @pytest.mark.parametrize("force_n", [(9.0, 0.0, 0.0), (6.0, 6.0, 0.0), (np.nan, 0.0, 0.0), (0.0, np.inf, 0.0)])
    def test_a_force_beyond_the_limit_or_not_finite_is_sent_as_zero(self, force_n: tuple[float, float, float]) -> None:
        service = Service()
        with EmulatedInverse3(service=service) as device:
            ticks = Ticks(device)
            ticks.take((1.0, 0.0, 0.0))
            assert tuple(ticks.take(force_n)[1]) == (0.0, 0.0, 0.0)
            assert service.force_n == (0.0, 0.0, 0.0)

    def test_no_further_force_is_sent_while_replies_stay_out_but_zero_is(self) -> None:
        service = Service()
        with EmulatedInverse3(service=service) as device:
            ticks = Ticks(device)
            ticks.take()
            service.take("silent")
            before = int(service.state.commands)
            for k in range(20):
                _answer, sent_n = ticks.take((0.1 * k, 0.0, 0.0))
            assert service.state.commands - before == MOST_UNANSWERED
            assert device.counters["skipped"] == 20 - MOST_UNANSWERED
            assert sent_n[0] == service.force_n[0]  # it says which force still acts
            assert ticks.take((0.0, 0.0, 0.0))[1][0] == 0.0
            assert service.force_n == (0.0, 0.0, 0.0)

    def test_weaker_forces_are_sent_while_replies_stay_out(self) -> None:
        service = Service()
        with EmulatedInverse3(service=service) as device:
            ticks = Ticks(device)
            ticks.take((4.0, 0.0, 0.0))
            service.take("silent")
            for k in range(45):
                force_n = (4.0 - 0.08 * (k + 1), 0.0, 0.0)
                assert ticks.take(force_n)[1][0] == force_n[0] == pytest.approx(service.force_n[0])
            for k in range(100):
                ticks.take((0.4 - 0.001 * k, 0.0, 0.0))
            assert device.exchange.sent - device.exchange.answered == MOST_WEAKER
            assert ticks.take()[1][0] == service.force_n[0] == 0.0

    def test_a_state_that_waited_for_longer_than_20_ms_is_not_given(self) -> None:
        with EmulatedInverse3() as device:
            ticks = Ticks(device)
            ticks.take()
            assert ticks.take()[0] == READ_NEW
            assert ticks.take(pause_ns=21_000_000)[0] == READ_NOTHING_NEW
            assert device.counters["late"] == 1
            assert ticks.take()[0] == READ_NEW

    def test_the_buttons_of_the_grip_are_read(self) -> None:
        service = Service()
        with EmulatedInverse3(service=service) as device:
            ticks = Ticks(device)
            for buttons in (0b001, 0b110, 0):
                service.press(buttons)
                ticks.take()
                ticks.take()
                assert ticks.reading[0].buttons == buttons


class TestClosing:
    def test_close_sends_zero_force_and_a_close_frame_and_then_nothing(self) -> None:
        service = Service()
        device = EmulatedInverse3(service=service)
        device.open()
        ticks = Ticks(device)
        ticks.take((2.0, 0.0, 0.0))
        assert service.force_n[0] == 2.0
        commands = int(service.state.commands)
        device.close()
        assert service.force_n == (0.0, 0.0, 0.0)
        assert service.state.commands == commands + 1
        assert tuple(service.state.force_n) == (0.0, 0.0, 0.0)
        assert service.state.close_frames == 1
        device.close()
        assert ticks.take((2.0, 0.0, 0.0))[0] == READ_LOST
        assert service.state.commands == commands + 1
        assert service.force_n == (0.0, 0.0, 0.0)

    def test_a_servo_that_stops_leaves_zero_force(self) -> None:
        service = Service(tremor_m=0.0)
        with EmulatedInverse3(service=service) as device:
            servo = Servo(device, clock=VirtualClock())
            servo.load(load("rek2024").scene_for("honey"))
            servo.advance(800)
            service.reach_to(0.04, 0.0, 0.0)
            servo.advance(300)
            assert np.linalg.norm(service.force_n) > 1.0
            servo.stop_force()
            servo.advance(1)
            assert service.force_n == (0.0, 0.0, 0.0)
            servo.fade_in()
            servo.advance(300)
            servo.stop()
            assert service.force_n == (0.0, 0.0, 0.0)

    def test_a_service_without_commands_for_long_lets_its_device_idle(self) -> None:
        service = Service()
        with EmulatedInverse3(service=service) as device:
            ticks = Ticks(device)
            ticks.take((2.0, 0.0, 0.0))
            link = EmulatedLink(service)  # whoever comes next
            assert service.force_n[0] == 2.0
            link.close()
            assert service.force_n == (0.0, 0.0, 0.0)

    def test_it_opens_again_after_it_was_closed(self) -> None:
        service = Service()
        device = EmulatedInverse3(service=service)
        for _ in range(2):
            with device:
                ticks = Ticks(device)
                ticks.take()
                assert ticks.take()[0] == READ_NEW


class TestDoctor:
    def test_a_device_in_order_passes_everything(self) -> None:
        report = examine("inverse3-emulated", progress=str)
        assert report.well
        assert report.unseen == ()
        assert report.conclusion == "No problem was found."
        assert "new positions per second: 1000" in " ".join(report.seen) or "99" in " ".join(report.seen)

    @pytest.mark.parametrize(
        ("fault", "mode"),
        [("off", "not-ready"), ("force-scale", "settings"), ("closes", "closed"), ("nan", "not-json")],
    )
    def test_a_fault_is_found_with_cause_and_cure(self, fault: str, mode: str) -> None:
        report = examine("inverse3-emulated", faults=[fault], progress=str)
        assert [one.id for one in report.found] == [mode]
        assert report.failure is not None
        assert report.found[0].cure in report.failure
        assert all(one.state != "ok" for one in report.findings if one.number > report.found[0].number) or mode in {
            "closed",
            "not-json",
        }

    def test_only_the_emulated_one_can_have_faults(self) -> None:
        with pytest.raises(DeviceError, match="'inverse3' cannot be given faults: only inverse3-emulated can"):
            examine("inverse3", faults=["nan"], progress=str)


def test_a_handle_that_the_hand_lets_go_follows_the_force() -> None:
    service = Service(tremor_m=0.0)
    with EmulatedInverse3(service=service) as device:
        ticks = Ticks(device)
        service.held = False
        for _ in range(100):
            ticks.take((0.5, 0.0, 0.0))
        assert not service.held
        assert ticks.reading[0].position_m[0] > 0.005
        ticks.take()


def test_a_call_that_outlasts_closing_ends_the_force_when_it_returns(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(call_gate, "LEAVE_S", 0.05)
    service, entered, release = Service(), threading.Event(), threading.Event()

    def receive(*_arguments: int) -> int:
        entered.set()
        release.wait(30.0)
        return -1  # nothing came

    hanging = RECEIVE(receive)
    device = EmulatedInverse3(service=service)
    device.open()
    Ticks(device).take((2.0, 0.0, 0.0))
    device.exchange.receive = ctypes.cast(hanging, ctypes.c_void_p).value
    reading = new_reading()
    call = threading.Thread(target=device.read.ctypes, args=(device.context, 1, reading.ctypes.data))
    call.start()
    assert entered.wait(30.0)
    device.close()
    assert service.state.ended == 0  # what the call uses is still there
    with pytest.raises(DeviceError, match="a call to the device 'inverse3-emulated' does not return"):
        device.open()
    assert service.force_n[0] == 2.0
    release.set()
    call.join(30.0)
    assert service.force_n == (0.0, 0.0, 0.0)
    assert service.state.close_frames == 1
    device.close()
    with device:
        assert Ticks(device).take((1.0, 0.0, 0.0))[1][0] == 1.0
