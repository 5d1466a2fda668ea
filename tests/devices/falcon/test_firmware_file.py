"""A firmware file word by word, the order of requests to a bridge, and the diagnosis of a device."""

import hashlib
from types import SimpleNamespace
from typing import Any

import numba
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("emulators are C functions", allow_module_level=True)

import numpy as np

from study_app.devices.doctor import DeviceFailure
from study_app.devices.falcon import boot, constants
from study_app.devices.falcon.boot import Block, BootFailure, check_firmware
from study_app.devices.falcon.device import FalconDevice
from study_app.devices.falcon.failures import FalconLost, FalconNotFound, UsbFailure, usb_failure
from tests.devices.falcon.support.firmware_stream import stream, words

SMALL = stream(((0x3F8123, 3), (0x93A2, 1)), entry=0x3F9002)
"""22 bytes of head, blocks of 12 and 8 bytes, and an end marker of 2."""
HEAD = words(0x08AA, *[0] * 8, 0x3F, 0x9002)


def test_a_firmware_has_an_entry_and_blocks_with_their_places(monkeypatch: pytest.MonkeyPatch) -> None:
    digest = hashlib.sha256(SMALL).hexdigest()
    firmware = check_firmware(SMALL)
    assert (firmware.size, firmware.sha256, firmware.entry, firmware.name) == (44, digest, 0x3F9002, None)
    assert firmware.blocks == (Block(0x3F8123, 3), Block(0x93A2, 1))
    monkeypatch.setitem(boot.KNOWN, (digest[:16], digest[-8:]), "own.bin")
    assert check_firmware(SMALL).name == "own.bin"


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "it is empty"),
        (b" \n<!DOCTYPE html>", "it is a web page"),
        (b"<html>", "it is a web page"),
        (b"<?xml version", "it is a web page"),
        (b"version https://git-lfs.github.com/spec/v1", "it is only a Git LFS pointer"),
        (b":10000000", "it is a hex dump"),
        (b"AA 08 00 00 AA 08 00 00 AA 08 00 00", "it is a hex dump"),
        (HEAD[:21], "it is truncated: it has 21 bytes, but the header alone needs 22"),
        (words(0xAA08, *[0] * 10), "the two bytes in each of its words are swapped"),
        (words(0x1234, *[0] * 10), "it begins with the key 0x1234, not 0x08AA"),
        (stream(reserved=(0,) * 7 + (1,)), "its header has non-zero values in fields that must be zero"),
        (HEAD, "it is truncated: it ends at byte 22, after 0 blocks, without an end marker"),
        (SMALL[:34], "it is truncated: it ends at byte 34, after 1 blocks, without an end marker"),
        (SMALL[:33], "it is truncated in block 1: it has 33 bytes, but that block ends at byte 34"),
        (SMALL[:40], "it is truncated in block 2: it has 40 bytes, but that block ends at byte 42"),
        (HEAD + words(0), "it does not contain any blocks to load"),
        (SMALL + b"xyz", "3 bytes follow the end marker at byte 42"),
    ],
)
def test_invalid_firmware_is_refused_with_the_byte(data: bytes, reason: str) -> None:
    with pytest.raises(DeviceFailure) as refused:
        check_firmware(data)
    assert refused.value.mode == "not-firmware"
    assert reason in str(refused.value)


class Bridge:
    """A bridge that records requests and does not answer."""

    def __init__(self) -> None:
        self.asked: list[tuple[Any, ...]] = []
        self.at_s = 0.0

    def control(self, request: int, value: int) -> None:
        self.asked.append((request, value))

    def now_s(self) -> float:
        return self.at_s


PURGED = [(0, 1), (0, 2)]


def test_a_bridge_is_purged_before_and_after_it_is_set_up_for_a_running_falcon() -> None:
    bridge: Any = Bridge()
    boot.configure(bridge)
    fast = [(3, 0x0002), (4, 0x0008), (2, 0)]
    assert bridge.asked == [*PURGED, (9, 1), *fast, *PURGED]
    bridge.asked.clear()
    for on in (True, False):
        boot.set_event_character(bridge, on)
    assert bridge.asked == [(6, 0x013E), (6, 0x003E)]


@pytest.mark.parametrize(
    ("without_s", "with_s", "is_shorter"), [(0.004, 0.001, True), (0.001, 0.004, False), (0.002, 0.002, False)]
)
def test_the_event_character_stays_on_if_it_shortens_the_round_trip(
    monkeypatch: pytest.MonkeyPatch, without_s: float, with_s: float, is_shorter: bool
) -> None:
    trips = [without_s, with_s]
    monkeypatch.setattr(boot, "measure_round_trip", lambda _bridge: trips.pop(0))
    bridge: Any = Bridge()
    shorter_s, facts = boot.choose_event_character(bridge)
    assert shorter_s == min(without_s, with_s)
    assert facts == {
        "event_character": is_shorter, "round_trip_ms": {"with": 1000 * with_s, "without": 1000 * without_s},
    }  # fmt: skip
    assert bridge.asked[-1] == (6, 0x013E if is_shorter else 0x003E)
    assert [value for _, value in bridge.asked[:2]] == [0x003E, 0x013E]


@pytest.mark.parametrize(("silent", "is_running", "purges"), [(0, True, 0), (9, True, 9), (10, False, 10)])
def test_a_falcon_runs_if_it_answers_one_of_ten_packets(
    monkeypatch: pytest.MonkeyPatch, silent: int, is_running: bool, purges: int
) -> None:
    replies = [False] * silent + [True] * 10
    timeouts_s: list[float] = []
    monkeypatch.setattr(
        boot, "_Line", lambda _bridge: SimpleNamespace(gets_reply=lambda s: timeouts_s.append(s) or replies.pop(0))
    )
    bridge: Any = Bridge()
    assert boot.is_running(bridge) == is_running
    assert (bridge.asked, set(timeouts_s)) == (PURGED * purges, {0.05})


def test_a_round_trip_is_the_median_of_50_and_a_missing_reply_counts_as_50_ms(monkeypatch: pytest.MonkeyPatch) -> None:
    bridge: Any = Bridge()
    trips = iter([0.001] * 20 + [0.002] * 20 + [None] * 10)

    def gets_reply(_timeout_s: float) -> bool:
        trip_s = next(trips)
        bridge.at_s += trip_s or 9.0
        return trip_s is not None

    monkeypatch.setattr(boot, "_Line", lambda _bridge: SimpleNamespace(gets_reply=gets_reply))
    assert boot.measure_round_trip(bridge) == pytest.approx(0.002)
    assert bridge.asked == PURGED * 10
    trips = iter([None] * 50)
    assert boot.measure_round_trip(bridge) == 0.05


@pytest.mark.parametrize(
    ("step", "attempt", "words_of_it"),
    [
        ("start", 1, "in 1 attempt: no reply; check that the file contains Falcon firmware"),
        ("echo", 10, "in 10 attempts: no reply"),
    ],
)
def test_a_boot_that_fails_tells_its_attempts_and_reason(step: str, attempt: int, words_of_it: str) -> None:
    failure = BootFailure(step, attempt, "no reply")
    assert (failure.step, failure.attempt, failure.reason, failure.mode) == (step, attempt, "no reply", "upload")
    assert words_of_it in str(failure)
    assert ("check that the file" in str(failure)) == (step == "start")


@pytest.mark.parametrize(
    ("echo", "reason"),
    [
        (b"abcd", None),
        (b"abXd", "byte 102 of the firmware came back as 58, not 63"),
        (b"abc", "the bridge returned nothing from byte 103 of the firmware onwards"),
        (b"abcde", "the bridge returned extra data after byte 103 of the firmware"),
    ],
)
def test_an_echo_is_compared_byte_by_byte(echo: bytes, reason: str | None) -> None:
    line: Any = SimpleNamespace(read_until=lambda complete, timeout_s: echo)
    if reason is None:
        boot._expect_echo(line, b"abcd", 100)
        return
    with pytest.raises(boot._StepFailed, match=f"^{reason}$") as failed:
        boot._expect_echo(line, b"abcd", 100)
    assert failed.value.step == "echo"


@pytest.mark.parametrize(
    ("code", "kind", "kind_of_error"),
    [
        (constants.ERROR_NO_DEVICE, "no-device", FalconLost),
        (constants.ERROR_NOT_FOUND, "not-found", FalconNotFound),
        (constants.ERROR_ACCESS, "access", UsbFailure),
        (constants.ERROR_TIMEOUT, "timeout", UsbFailure),
        (-99, "io", UsbFailure),
    ],
)
def test_a_libusb_error_is_reported_with_its_number_and_action(
    code: int, kind: str, kind_of_error: type[UsbFailure], monkeypatch: pytest.MonkeyPatch
) -> None:
    failure = usb_failure(code, "reading")
    assert (type(failure), failure.kind, failure.code) == (kind_of_error, kind, code)
    assert f"while reading, libusb error {code}" in str(failure)
    assert "libusb error" not in str(UsbFailure(kind, "opening"))
    modes = {"no-device": "unplugged", "not-found": "not-connected", "access": "permission"}
    for platform in ("linux", "win32"):
        monkeypatch.setattr("sys.platform", platform)
        expected = "busy" if (kind, platform) == ("access", "win32") else modes.get(kind, "transfer")
        assert usb_failure(code, "reading").mode == expected


def test_firmware_is_loaded_only_if_none_is_running(monkeypatch: pytest.MonkeyPatch, tmp_path: Any) -> None:
    calls: list[Any] = []
    monkeypatch.setattr(boot, "configure", lambda bridge: calls.append(("configure", bridge)))
    monkeypatch.setattr(boot, "is_running", lambda _bridge: running)
    monkeypatch.setattr(
        boot, "boot_falcon", lambda bridge, data, progress: calls.append((bridge, data)) or check_firmware(data)
    )
    file = tmp_path / "firmware.bin"
    file.write_bytes(SMALL)
    device: Any = SimpleNamespace(_firmware=file, _progress=calls.append)
    running = True
    bridge: Any = "bridge"
    assert FalconDevice._run_firmware(device, bridge) == "already running"
    assert calls == [("configure", "bridge")]
    running = False
    digest = hashlib.sha256(SMALL).hexdigest()
    assert FalconDevice._run_firmware(device, bridge) == digest
    assert calls[2:] == [
        f"Loading the Falcon's firmware, an unrecognised version (SHA-256 {digest[:16]}…).", ("bridge", SMALL),
    ]  # fmt: skip
    for firmware, reason in ((None, ""), (tmp_path / "none.bin", f"{tmp_path / 'none.bin'} cannot be read: No such")):
        device._firmware = firmware
        with pytest.raises(DeviceFailure) as refused:
            FalconDevice._run_firmware(device, bridge)
        assert refused.value.mode == "firmware-file"
        assert reason in str(refused.value)


@pytest.mark.parametrize(
    ("changes", "share", "lines"),
    [
        (
            {}, 0.0123,
            ("opened, serial number FT1", "program: already running", "round trip 0.31 ms; event character kept",
             "calibration: 2026-11-20", "incomplete replies: 1.23%"),
        ),
        (
            {"serial": None, "event_character": False, "calibration": "none"}, 0.0,
            ("opened", "program: already running", "round trip 0.31 ms; event character not used",
             "calibration: none", "incomplete replies: 0.00%"),
        ),
    ],
)  # fmt: skip
def test_each_observation_of_a_falcon_is_one_line(
    changes: dict[str, Any], share: float, lines: tuple[str, ...]
) -> None:
    facts = {
        "serial": "FT1", "firmware": "already running", "round_trip_ms": {"with": 0.31, "without": 1.9},
        "event_character": True, "calibration": {"measured": "2026-11-20"},
    }  # fmt: skip
    device: Any = SimpleNamespace(found=facts | changes, _broken_share=share)
    assert FalconDevice.observed(device) == lines


@pytest.mark.parametrize(
    ("counters", "share"),
    [((101, 90), 10 / 101), ((101, 100), 0.0), ((101, 101), 0.0), ((0, 0), 0.0), ((1, 0), 0.0), ((2, 0), 0.5)],
)
def test_the_reply_to_the_last_packet_is_not_missing_yet(counters: tuple[int, int], share: float) -> None:
    device: Any = SimpleNamespace(counters=dict(zip(("requests", "replies"), counters, strict=True)))
    assert FalconDevice._broken_share.fget(device) == pytest.approx(share)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("moved_m", "share", "trip_ms", "failure", "modes"),
    [
        (5.1e-6, 0.005, 1.99, None, set()),
        (5e-6, 0.005, 1.99, None, {"frozen"}),
        (1.0, 0.0051, 1.99, None, {"broken-packets"}),
        (1.0, 0.0, 2.0, None, {"slow"}),
        (0.0, 1.0, 9.0, None, {"frozen", "broken-packets", "slow"}),
        (0.0, 1.0, 9.0, "unplugged", {"unplugged"}),
    ],
)
def test_faults_of_a_falcon_appear_in_its_samples_and_replies(
    moved_m: float, share: float, trip_ms: float, failure: str | None, modes: set[str]
) -> None:
    """The first hundred samples are those before it is gripped."""
    places_m = np.zeros((300, 3))
    places_m[:100, 0], places_m[200, 1] = 0.3, moved_m
    facts = {"round_trip_ms": {"with": trip_ms, "without": trip_ms + 3}}
    device: Any = SimpleNamespace(failure_mode=failure, found=facts, _broken_share=share)
    assert FalconDevice.appeared(device, {"position_m": places_m}) == modes
