import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

if numba.config.DISABLE_JIT:
    pytest.skip("devices are C functions", allow_module_level=True)

from study_app.devices.spacemouse import hid as spacemouse_hid
from study_app.devices.spacemouse.device import SpaceMouseDevice
from study_app.devices.spacemouse.hid import (
    FULL_SPEED_MPS,
    Buttons,
    Displacement,
    find_space_mice,
    parse_report,
    program_buttons,
    velocity_mps,
)
from study_app.errors import DeviceError, DeviceNotFound
from study_app.haptics.model.layout import BUTTON_STOP
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from tests.devices.spacemouse.fake_hid import HELD_S, MODEL, FakeHid, interface

RIGHT = bytes([1, 0x5E, 0x01, 0, 0, 0, 0])  # 350 to the right
REST = bytes([1, 0, 0, 0, 0, 0, 0])


def open_with_reports(*reports, **options):
    hid = FakeHid(*reports, **options)
    device = SpaceMouseDevice(hid=hid, now_s=hid.now_s)
    device.open()
    assert hid.idle.wait(10) or hid.gone.is_set()
    return device, hid


class TestReports:
    def test_the_displacement_is_read_byte_by_byte(self):
        assert parse_report(bytes([1, 0x5E, 0x01, 0xA2, 0xFE, 0x07, 0x00])) == Displacement(
            right=350, toward=-350, down=7
        )
        assert parse_report(bytes([1, 0xFF, 0xFF, 0x00, 0x01, 0x00, 0x80])) == Displacement(
            right=-1, toward=256, down=-32768
        )

    def test_buttons_are_bits_over_as_many_bytes_as_there_are(self):
        assert parse_report(bytes([3, 0x02, 0x00])) == Buttons(0b10)
        assert parse_report(bytes([3, 0, 0, 0x40, 0])) == Buttons(1 << 22)

    @pytest.mark.parametrize(
        "report", [b"", b"\x01", b"\x01\x00\x00\x00\x00\x00", b"\x03", b"\x02" + bytes(6), b"\x17abc"]
    )
    def test_rotation_half_reports_and_other_reports_are_ignored(self, report):
        assert parse_report(report) is None

    @given(st.binary(max_size=64))
    def test_no_bytes_upset_it(self, report):
        said = parse_report(report)
        if isinstance(said, Displacement):
            assert all(abs(speed) <= FULL_SPEED_MPS for speed in velocity_mps(said))

    def test_push_right_is_x_lift_is_y_and_pull_is_z(self):
        assert velocity_mps(Displacement(right=350, toward=0, down=0)) == (FULL_SPEED_MPS, 0, 0)
        assert velocity_mps(Displacement(right=0, toward=0, down=-350)) == (0, FULL_SPEED_MPS, 0)
        assert velocity_mps(Displacement(right=0, toward=350, down=0)) == (0, 0, FULL_SPEED_MPS)

    def test_a_cap_at_rest_is_at_rest_and_speed_grows_without_a_step(self):
        speeds = np.array([velocity_mps(Displacement(right=v, toward=0, down=0))[0] for v in range(-500, 501)])
        assert (speeds[480:521] == 0).all()
        assert np.diff(speeds).max() < FULL_SPEED_MPS / 300
        assert (np.diff(speeds) >= 0).all()
        assert speeds == pytest.approx(-speeds[::-1])

    @pytest.mark.parametrize(
        ("model", "held", "buttons"),
        [
            ("SpaceNavigator", 0b01, 0b01),
            ("SpaceNavigator", 0b10, 0b10),
            ("SpaceNavigator", 0b11, BUTTON_STOP | 0b11),
            ("SpaceNavigator", 1 << 3, 0),
            ("SpaceMouse Pro", 1 << 22, BUTTON_STOP),
            ("SpaceMouse Pro", 1 << 3, 0),
            ("SpaceExplorer", 1 << 6, BUTTON_STOP),
            ("SpacePilot", 1 << 10, BUTTON_STOP),
        ],
    )
    def test_only_the_stop_buttons_of_each_model_stop_the_force(self, model, held, buttons):
        assert program_buttons(held, MODEL[model]) == buttons


class TestMoving:
    def test_how_far_it_is_pushed_is_how_fast_it_goes(self):
        device, _ = open_with_reports(RIGHT, *[RIGHT] * 12, REST, REST, REST)
        with device, Servo(device, clock=VirtualClock()) as servo:
            servo.advance(500)
            expected = 13 * HELD_S * FULL_SPEED_MPS
            assert servo.telemetry.latest().position_m == pytest.approx([expected, 0, 0], abs=2e-4)

    def test_it_does_not_leave_the_workspace_nor_remember_how_far_it_was_pushed_beyond(self):
        device, hid = open_with_reports(*[RIGHT] * 100, bytes([1, 0xA2, 0xFE, 0, 0, 0, 0]), *[REST] * 2)
        with device, Servo(device, clock=VirtualClock()) as servo:
            servo.advance(500)
            assert servo.telemetry.latest().position_m[0] == pytest.approx(0.05 - HELD_S * FULL_SPEED_MPS, abs=2e-4)
            assert hid.now > 0.8

    def test_one_that_falls_silent_is_not_followed_for_ever(self):
        slow = bytes([1, 41, 0, 0, 0, 0, 0])
        device, hid = open_with_reports(slow, *[b""] * 200, REST)
        with device, Servo(device, clock=VirtualClock()) as servo:
            servo.advance(500)
            went_m = 0.5 * velocity_mps(Displacement(right=41, toward=0, down=0))[0]
            assert hid.now > 1.5
            assert servo.telemetry.latest().position_m[0] == pytest.approx(went_m, rel=0.05)

    def test_each_direction_of_the_cap_moves_the_pointer_and_a_gap_counts_as_50_ms(self):
        """Half of the travel beyond the dead zone gives half the speed."""
        half = (350 - 20) // 2 + 20
        report = bytes([1, *(half).to_bytes(2, "little"), 0, 0, *(-350).to_bytes(2, "little", signed=True)])
        device, hid = open_with_reports(report, REST)
        with device, Servo(device, clock=VirtualClock()) as servo:
            hid.say(bytes([1, 0, 0, 0x5E, 0x01, 0, 0]))
            hid.now += 0.4
            hid.say(REST)
            servo.advance(500)
            right_m, up_m, toward_m = servo.telemetry.latest().position_m
            assert right_m == pytest.approx(HELD_S * FULL_SPEED_MPS / 2, abs=1e-4)
            assert up_m == pytest.approx(HELD_S * FULL_SPEED_MPS, abs=1e-4)
            assert 0.0498 <= toward_m / FULL_SPEED_MPS <= 0.0502 + HELD_S, "and once more until the cap rests"

    def test_its_buttons_are_the_programs_until_it_is_opened_again(self):
        device, hid = open_with_reports(bytes([3, 0b10, 0]), listed=[interface("SpaceMouse Pro")])
        assert device.state.buttons == 0b10
        hid.say(bytes([3, 0b01, 0, 0x40, 0]))
        assert device.state.buttons == BUTTON_STOP | 0b01
        device.open()
        assert hid.open_count == 1, "it is open"
        device.close()
        device.open()
        assert device.state.buttons == 0
        device.close()

    def test_a_model_without_a_light_is_sent_nothing(self):
        device, hid = open_with_reports(listed=[interface("SpaceMouse (USB)")])
        device.close()
        assert hid.written == []

    def test_its_light_is_on_while_it_is_used(self):
        device, hid = open_with_reports()
        assert hid.written == [b"\x04\x01"]
        device.close()
        assert hid.written[-1] == b"\x04\x00"
        assert hid.open_count == 0
        device.close()


class TestComingAndGoing:
    def test_a_missing_device_is_reported_with_the_supported_models(self):
        other = {"vendor_id": 0x046D, "product_id": 0xC52B, "path": b"a mouse", "usage_page": 1, "usage": 2}
        hid = FakeHid(listed=[other])
        assert find_space_mice(hid) == []
        with pytest.raises(DeviceNotFound, match=r"no SpaceMouse is connected.*SpaceNavigator"):
            SpaceMouseDevice(hid=hid).open()

    def test_of_a_receivers_interfaces_the_one_that_reports_motion_is_taken(self):
        listed = [
            interface("Universal Receiver", b"keys", (1, 6)),
            interface("Universal Receiver", b"vendor", (0xFF00, 1)),
            interface("Universal Receiver", b"motion", (1, 8)),
        ]
        device, hid = open_with_reports(listed=listed)
        device.close()
        assert hid.path == b"motion"
        with pytest.raises(DeviceError, match=r"usage page 1, usage 8.*pair it"):
            SpaceMouseDevice(hid=FakeHid(listed=listed[:2])).open()

    def test_one_that_does_not_tell_its_usage_is_tried(self):
        device, hid = open_with_reports(listed=[interface(path=b"silent", usage=None)])
        device.close()
        assert hid.path == b"silent"

    @pytest.mark.parametrize(
        ("platform", "words"),
        [
            ("linux", r"KERNELS==.*uaccess.*udevadm control --reload"),
            ("darwin", "quit 3DconnexionHelper"),
            ("win32", "close that program and 3DxWare"),
        ],
    )
    def test_a_refused_device_names_the_remedy_for_this_system(self, platform, words, monkeypatch):
        monkeypatch.setattr("sys.platform", platform)
        with pytest.raises(DeviceError, match=words):
            SpaceMouseDevice(hid=FakeHid(opens=False)).open()

    def test_without_hidapi_the_error_names_the_package(self, monkeypatch):
        def missing(name):
            raise ImportError(f"no {name} here")

        monkeypatch.setattr(spacemouse_hid, "import_module", missing)
        with pytest.raises(DeviceError, match=r"no hid.* here.*pip install hidapi"):
            SpaceMouseDevice().open()


def test_the_receipt_names_the_model():
    device, _ = open_with_reports(listed=[interface("SpaceMouse Pro")])
    described = device.describe()
    device.close()
    assert described["name"] == "spacemouse"
    assert described["model"] == "SpaceMouse Pro"
    assert (described["full_speed_mps"], described["dead_share"]) == (0.25, 20 / 350)
    assert SpaceMouseDevice(hid=FakeHid()).describe()["model"] is None
