"""The Inverse3's driver beyond the contract: settings of the service, missing states, and its addresses."""

import itertools
import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from study_app.devices.emulators import inverse3_service, inverse3_stream
from study_app.devices.emulators.inverse3 import EmulatedInverse3
from study_app.devices.emulators.inverse3_service import Service
from study_app.devices.registry import open_device
from study_app.errors import DeviceError, DeviceNotFound, ServoFault
from study_app.haptics.kernels.c_functions import READ_LOST, READ_NEW, READ_NOTHING_NEW
from study_app.haptics.model.layout import LIMITER_GLITCH, MEASURED_VELOCITY, STATUS_OK
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.load import load
from tests.compiled import needs_servo
from tests.devices.subjects import Ticks

pytestmark = needs_servo


def zero_force(device_id: str) -> dict[str, Any]:
    """Return a command that a service answers without its full state."""
    vector = dict.fromkeys("xyz", 0.0)
    return {"inverse3": [{"device_id": device_id, "commands": {"set_cursor_force": {"vector": vector}}}]}


@pytest.fixture
def service() -> Service:
    return Service(tremor_m=0.0, quantum_m=0.0)


@pytest.fixture
def device(service: Service) -> Iterator[EmulatedInverse3]:
    with EmulatedInverse3(service=service) as inverse3:
        yield inverse3


def recorded_messages(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
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
        self, service: Service, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        messages = recorded_messages(monkeypatch)
        with EmulatedInverse3(service=service) as device:
            settings = device.describe()["service_settings"]
        (first, second) = messages
        (device_message,) = first["inverse3"]
        assert device_message["device_id"] == "EMU1"
        assert device_message["configure"] == {
            "preset": {"preset": "arm_front_centered"},
            "damping": {"scalar": 0.0, "vector": {"x": 0.0, "y": 0.0, "z": 0.0}},
            "force_gate": {"gain": 0.0},
        }
        assert first["session"]["configure"]["basis"] == {"permutation": "XYZ"}
        assert device_message["commands"] == {"set_cursor_force": {"vector": {"x": 0.0, "y": 0.0, "z": 0.0}}}
        assert list(second["session"]) == ["force_render_full_state"]
        assert settings["found"]["filters"] == {"force_gate": {"gain": 0.3}, "damping": {"scalar": 0.0}}
        assert settings["found"]["preset"] == "defaults"
        assert settings["in_force"]["filters"]["force_gate"] == {"gain": 0.0}
        assert settings["in_force"]["preset"] == "arm_front_centered"
        assert settings["in_force"]["gravity_compensation"] == {"enabled": True, "scaling_factor": 1.0}
        assert settings["in_force"]["torque_scaling"] == {"enabled": True}
        assert settings["confirmed"] is True

    def test_settings_that_differ_are_named_with_their_value(self, service: Service) -> None:
        service.config["torque_scaling"]["enabled"] = False
        with pytest.raises(DeviceError, match=r"torque_scaling\.enabled is False, but must be True"):
            EmulatedInverse3(service=service).open()

    def test_a_service_without_confirmation_is_used_and_noted_in_the_receipt(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr("study_app.devices.inverse3.opening.full_state_request", zero_force)
        lines: list[str] = []
        with EmulatedInverse3(progress=lines.append) as device:
            assert device.describe()["service_settings"]["confirmed"] is False
        assert lines == ["The service did not confirm its settings: check them in Haply Hub."]

    @pytest.mark.parametrize("device_id", ["A" * 65, "A" * 4000, "", 'A"B', "A\\B", "A B", "é1"])
    def test_an_id_that_does_not_fit_into_a_command_is_refused_in_a_line(
        self, service: Service, device_id: str, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        message = service.inventory()
        message["inverse3"][0]["device_id"] = device_id
        monkeypatch.setattr(service, "inventory", lambda: message)
        words = rf"ID .* \({len(device_id)} characters\); an ID must have 1 to 64 "
        with pytest.raises(DeviceError, match=words) as refused:
            EmulatedInverse3(service=service).open()
        assert "\n" not in str(refused.value)
        assert len(str(refused.value)) < 250
        assert (service.state.ended, service.state.commands) == (1, 0)

    def test_entries_without_an_id_are_passed_over(self, service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
        message = service.inventory()
        monkeypatch.setattr(service, "inventory", lambda: message)
        (mine,) = message["inverse3"]
        message["inverse3"] = [7, {}, mine]
        with EmulatedInverse3(service=service) as device:
            assert device.describe()["device_id"] == mine["device_id"]
        message["inverse3"] = [7, {}]
        with pytest.raises(DeviceNotFound, match="listed: none"):
            EmulatedInverse3(service=service).open()

    def test_no_service_is_one_line_with_its_address_and_the_cure(self) -> None:
        with pytest.raises(DeviceNotFound, match=r"Inverse Service does not respond.*start Haply Hub") as refused:
            open_device("inverse3:127.0.0.1:9")
        assert "127.0.0.1:9" in str(refused.value)
        assert "\n" not in str(refused.value)

    def test_a_workspace_beyond_its_reach_is_refused(self) -> None:
        with pytest.raises(DeviceError, match="a workspace of 200 x 60 x 60 mm exceeds an Inverse3's reach"):
            EmulatedInverse3(workspace_m=(0.1, 0.03, 0.03))

    def test_an_address_names_host_port_and_device(self) -> None:
        for where, said in (("", "127.0.0.1:10001"), ("049D", "127.0.0.1:10001"), ("localhost:9:049D", "localhost:9")):
            with pytest.raises(DeviceNotFound, match=rf"does not respond \({said}:"):
                open_device(f"inverse3:{where}")
        for where in (":1", "a:b", "a:0", "a:65536", "a:1:b:c", "a:-1"):
            with pytest.raises(DeviceError, match="is not a valid address for the Inverse Service"):
                open_device(f"inverse3:{where}")


class TestTicks:
    def test_a_tick_gives_the_state_of_the_command_before_in_the_hand_frame(
        self, service: Service, device: EmulatedInverse3
    ) -> None:
        ticks = Ticks(device)
        service.hold(0.01, 0.02, -0.03)
        assert ticks.take()[0] == READ_NOTHING_NEW  # nothing was asked for yet
        assert {ticks.take()[0] for _ in range(400)} == {READ_NEW}
        assert ticks.position_m == pytest.approx([0.01, 0.02, -0.03], abs=3e-4)
        assert ticks.reading[0].delay_ticks == 1
        service.reach_to(0.01, 0.04, -0.03, duration_s=0.2)
        ticks.after(100)
        assert ticks.reading[0].measured == MEASURED_VELOCITY
        velocity = ticks.reading[0].velocity_mps
        assert velocity[1] > 0.1
        assert np.abs(velocity[[0, 2]]).max() < 0.01

    @pytest.mark.parametrize("force_n", [(0.0, 0.0, 3.125), (-7.999999, 0.000001, 0)])
    def test_a_force_reaches_the_handle_as_it_was_written(
        self, service: Service, device: EmulatedInverse3, force_n: tuple[float, float, float]
    ) -> None:
        assert tuple(Ticks(device).take(force_n)[1]) == force_n
        assert service.force_n == pytest.approx(force_n, abs=5e-7)

    def test_no_further_force_is_sent_while_replies_stay_out_but_zero_is(
        self, service: Service, device: EmulatedInverse3
    ) -> None:
        ticks = Ticks(device)
        ticks.take()
        service.set_fault("silent")
        before = int(service.state.commands)
        for k in range(20):
            _answer, sent_n = ticks.take((0.1 * k, 0.0, 0.0))
        assert service.state.commands - before == 4
        assert device.counters["skipped"] == 20 - 4
        assert sent_n[0] == service.force_n[0]  # it says which force still acts
        assert ticks.take((0.0, 0.0, 0.0))[1][0] == 0.0
        assert service.force_n == (0.0, 0.0, 0.0)

    def test_weaker_forces_are_sent_while_replies_stay_out(self, service: Service, device: EmulatedInverse3) -> None:
        ticks = Ticks(device)
        ticks.take((4.0, 0.0, 0.0))
        service.set_fault("silent")
        for k in range(45):
            force_n = (4.0 - 0.08 * (k + 1), 0.0, 0.0)
            assert ticks.take(force_n)[1][0] == force_n[0] == pytest.approx(service.force_n[0])
        for k in range(100):
            ticks.take((0.4 - 0.001 * k, 0.0, 0.0))
        assert device.exchange.sent - device.exchange.answered == 60
        assert ticks.take()[1][0] == service.force_n[0] == 0.0

    def test_a_state_that_waited_for_longer_than_20_ms_is_not_given(self, device: EmulatedInverse3) -> None:
        ticks = Ticks(device)
        ticks.take()
        assert ticks.take()[0] == READ_NEW
        assert ticks.take(pause_ns=21_000_000)[0] == READ_NOTHING_NEW
        assert device.counters["late"] == 1
        assert ticks.take()[0] == READ_NEW

    def test_close_sends_zero_force_and_a_close_frame_and_then_nothing(
        self, service: Service, device: EmulatedInverse3
    ) -> None:
        ticks = Ticks(device)
        ticks.take((2.0, 0.0, 0.0))
        commands = int(service.state.commands)
        device.close()
        assert service.state.commands == commands + 1
        assert tuple(service.state.force_n) == (0.0, 0.0, 0.0)
        assert service.state.close_frames == 1
        assert ticks.take((2.0, 0.0, 0.0))[0] == READ_LOST
        assert service.state.commands == commands + 1


def stroke(device: EmulatedInverse3, service: Service) -> Servo:
    """Return a servo in the middle of a reach through honey."""
    servo = Servo(device, clock=VirtualClock())
    servo.load(load("rek2024").scene_for("honey"))
    servo.advance(800)
    service.reach_to(0.04, 0.0, 0.0, duration_s=0.6)
    servo.advance(300)
    return servo


def test_the_force_fades_at_the_handle_while_replies_stay_out(service: Service, device: EmulatedInverse3) -> None:
    servo = stroke(device, service)
    before_n = np.linalg.norm(service.force_n)
    service.set_fault("silent")
    sizes_n = []
    while servo.advance(1):
        sizes_n.append(np.linalg.norm(service.force_n))
    assert 45 < len(sizes_n) < 60
    assert sizes_n[4] == pytest.approx(before_n, rel=0.2)
    assert all(after <= before for before, after in itertools.pairwise(sizes_n[4:]))
    assert sizes_n[25] < 0.7 * before_n
    assert sizes_n[44] < 0.2 * before_n
    servo.stop()


@pytest.mark.parametrize(("fault", "delay_ticks"), [("slow", 2), ("torn", 1)])
def test_states_that_come_slowly_or_in_pieces_are_used_and_their_delay_is_measured(
    service: Service, fault: str, delay_ticks: int
) -> None:
    service.set_fault(fault)
    with EmulatedInverse3(service=service) as device:
        servo = stroke(device, service)
        reader = servo.telemetry.reader()
        servo.advance(100)
        samples = reader.read()
        assert (samples["status"] == STATUS_OK).all()
        assert samples["fresh"].mean() > 0.95
        assert samples["delay_ticks"][-1] == delay_ticks
        assert np.linalg.norm(service.force_n) > 1.0
        servo.stop()


def test_a_position_far_away_is_rejected_while_the_force_fades_and_the_servo_ends(
    service: Service, device: EmulatedInverse3, monkeypatch: pytest.MonkeyPatch
) -> None:
    far_away = inverse3_service.faulty_bytes("infinite", service._message()).replace(b"1e999", b"1e300")
    monkeypatch.setattr(inverse3_service, "faulty_bytes", lambda *_: far_away)
    servo = stroke(device, service)
    reader = servo.telemetry.reader()
    before_n = np.linalg.norm(service.force_n)
    service.set_fault("infinite")
    assert 40 < servo.advance(100) < 60
    samples = reader.read()
    sizes_n = np.linalg.norm(samples["device_force_n"], axis=1)
    assert (samples["position_m"][-40:, 0] == 1e300).all()
    assert (samples["limiters"][-40:] & LIMITER_GLITCH).all()
    assert (sizes_n <= 1.05 * before_n).all()  # nor NaN
    assert sizes_n[-1] == np.linalg.norm(service.force_n) == 0.0
    with pytest.raises(ServoFault, match="sent no usable data for 50 ms"):
        servo.check()


def test_the_emulated_device_becomes_idle_100_ms_after_the_last_command() -> None:
    service, time_ns = Service(tremor_m=0.0), np.array([5_000_000_000])
    service.follow_clock(int(time_ns.ctypes.data))
    inverse3_stream.advance_handle(service.state)
    inverse3_stream.apply_force(service.state, 1.0, 2.0, 3.0)
    for pause_ms, force_n in ((100, (1.0, 3.0, -2.0)), (101, (0.0, 0.0, 0.0))):
        time_ns += pause_ms * 1_000_000
        inverse3_stream.advance_handle(service.state)
        assert service.force_n == force_n, pause_ms
        assert service.state.last_ns == time_ns[0]
