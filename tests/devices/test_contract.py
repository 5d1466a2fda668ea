"""The device contract (docs/device-contract.md), over every device of the program and the template."""

import ctypes
import json
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from study_app.devices import driver
from study_app.devices.descriptors import DEVICES
from study_app.devices.doctor import DeviceFailure, report_lines
from study_app.devices.falcon.failures import FAILURES as FALCON
from study_app.devices.force_dimension.library import FAILURES as FORCE_DIMENSION
from study_app.devices.force_dimension.library import OPTION
from study_app.devices.inverse3.service import FAILURES as INVERSE3
from study_app.devices.registry import descriptor_of, doctor_of, list_devices, open_device
from study_app.errors import DeviceError, DeviceLost, DeviceNotFound, ServoFault
from study_app.haptics.kernels.c_functions import READ_LOST, READ_NEW
from study_app.haptics.model.layout import BUTTON_STOP
from study_app.protocol.load import load
from tests.compiled import needs_servo
from tests.devices.subjects import (
    FELT,
    MOVING,
    PATIENCE_S,
    UNFELT,
    Subject,
    falcon,
    force_dimension,
    force_dimension_library,
    inverse3,
    over,
    spacemouse,
    until,
    write,
)

pytestmark = needs_servo

ROOT = Path(__file__).parents[2]


@pytest.fixture
def subject(make_subject: Callable[..., Subject], request: pytest.FixtureRequest) -> Iterator[Subject]:
    subject = make_subject(request)
    yield subject
    subject.device.close()


def virtual_servo(device: Any) -> Any:
    from study_app.haptics.runtime.clocks import VirtualClock
    from study_app.haptics.runtime.servo import Servo

    return Servo(device, clock=VirtualClock())


def stroke(subject: Subject) -> Any:
    """Return a servo in the middle of a stroke through honey."""
    assert subject.move is not None
    servo = virtual_servo(subject.device)
    servo.load(load("rek2024").scene_for("honey"))
    servo.advance(800)
    subject.move()
    servo.advance(subject.stroke_ticks)
    assert np.linalg.norm(subject.acting_n()) > 0.5
    return servo


@over(*UNFELT, *FELT)
def test_a_receipt_can_store_the_description_of_a_device(
    make_subject: Callable[..., Subject], request: pytest.FixtureRequest
) -> None:
    device = make_subject(request, workspace_m=(0.04, 0.03, 0.02), force_limit_n=3.0).device
    described = device.describe()
    assert json.loads(json.dumps(described)) == described
    assert described["name"] == device.name
    assert (described["force_limit_n"], device.force_limit_n) == (3.0, 3.0)
    assert tuple(described["workspace_m"]) == device.workspace_m == (0.04, 0.03, 0.02)
    assert device.failure is None
    assert tempfile.gettempdir() not in json.dumps(described)
    device.close()


@over(*UNFELT, *FELT)
def test_a_force_acts_in_the_hand_frame_until_the_device_is_closed(subject: Subject) -> None:
    force_n = (0.5, -1.0, 1.5)
    ticks = subject.push(force_n)
    assert ticks.take(force_n)[1] == pytest.approx(force_n, abs=subject.exact_n)
    subject.device.close()
    assert subject.is_quiet()
    if subject.device.context and subject.device.name not in {"mouse", "scripted", "spacemouse"}:
        answer, _ = ticks.take(force_n)
        assert answer == READ_LOST
        assert subject.is_quiet()
    subject.device.close()


@over(*FELT)
@pytest.mark.parametrize(
    "asked_n", [(3.0, 0.0, 4.0), (np.nan, 0.0, 1.0), (0.0, np.inf, 0.0)], ids=["too great", "nan", "inf"]
)
def test_no_force_is_beyond_the_limit_or_not_finite(
    make_subject: Callable[..., Subject], asked_n: tuple[float, float, float], request: pytest.FixtureRequest
) -> None:
    subject = make_subject(request, force_limit_n=2.0)
    with subject.device:
        ticks = subject.push()
        sent_n = ticks.take(asked_n)[1]
        ticks.after(20, asked_n)
        assert np.linalg.norm(subject.acting_n()) <= 2.0 * 1.001
        assert np.linalg.norm(sent_n) <= 2.0 * 1.001
        until(lambda: np.allclose(subject.acting_n(), ticks.take(asked_n)[1], atol=subject.exact_n), "another force")


@over(*UNFELT, *FELT)
def test_a_lost_device_stays_lost_until_it_is_opened_again(subject: Subject) -> None:
    ticks = subject.push()
    subject.lose()
    ticks.after(3, (0.5, -1.0, 1.5))
    assert ticks.read() == READ_LOST
    assert write(subject.device, (1.0, 0.0, 0.0))[0] == READ_LOST
    failure = subject.device.failure
    assert failure is None or "\n" not in failure
    subject.device.close()
    subject.restore()
    subject.device.open()
    assert subject.is_quiet()
    assert subject.device.failure is None
    again = subject.ticks(ticks.now_ns if subject.device.name == "falcon-emulated" else None)
    until(lambda: again.after(5) == READ_NEW, "it gives no position")


@over(falcon, inverse3, force_dimension, spacemouse)
def test_its_descriptor_names_a_stop_button_if_one_of_its_buttons_stops_the_force(subject: Subject) -> None:
    assert subject.press is not None
    ticks, stops = subject.ticks(), False
    for held in range(16):
        subject.press(held)
        ticks.after(5)
        stops |= bool(ticks.reading[0].buttons & BUTTON_STOP)
    assert stops == bool(descriptor_of(subject.device.name).stop_button)


@over(*MOVING)
def test_a_servo_that_stops_leaves_no_force(subject: Subject) -> None:
    servo = stroke(subject)
    servo.check()
    servo.stop_force()
    servo.advance(1)
    subject.elapse()
    assert subject.is_quiet()
    servo.fade_in()
    servo.advance(300)
    servo.stop()
    subject.elapse()
    assert subject.is_quiet()


@over(*MOVING)
def test_a_device_lost_in_a_stroke_ends_the_servo_without_force(subject: Subject) -> None:
    servo = stroke(subject)
    subject.lose()
    assert servo.advance(100) < 60  # ended by the driver, or after 50 ms by the servo
    with pytest.raises(DeviceLost, match=f"the device '{subject.device.name}' stopped.*; the force is zero"):
        servo.check()
    servo.stop()
    assert subject.is_quiet() or subject.device.name == "falcon-emulated"  # without its cable: its guard waits


STREAM = [
    *((falcon, fault, "power") for fault in ("power-off", "drop=1")),
    (falcon, "unplugged", "unplugged"),
    *((inverse3, fault, "no-reply") for fault in ("late", "silent")),
    *((inverse3, fault, "closed") for fault in ("closes", "drops")),
    *((inverse3, fault, "not-json") for fault in ("nan", "bad-json")),
    *((inverse3, fault, "not-finite") for fault in ("null", "infinite")),
    (inverse3, "no-position", "no-position"),
    (inverse3, "gone", "no-device"),
    (inverse3, "power-off", "not-ready"),
    (inverse3, "calibration-lost", "uncalibrated"),
    *((inverse3, fault, "protocol") for fault in ("binary", "masked", "fragment", "too-long")),
    (force_dimension, "error", "error"),
    (force_dimension, "nan", "not-finite"),
    (force_dimension, "force-off", "force-off"),
    (force_dimension, "time-guard", "rate"),
    (force_dimension_library, "error", "error"),
    (force_dimension_library, "nan", "not-finite"),
    (force_dimension_library, "turns-off", "force-off"),
    (force_dimension_library, "write-error", "error"),
    (force_dimension_library, "status-error", "error"),
]


def words_of(make_subject: Callable[..., Subject], mode: str) -> tuple[str, str]:
    """Return cause and cure of a mode of failure."""
    known = {falcon: FALCON, inverse3: INVERSE3}.get(make_subject, FORCE_DIMENSION).mode(mode)
    return known.symptom, known.cure


@pytest.mark.parametrize(
    ("make_subject", "fault", "mode"), STREAM, ids=[f"{make.__name__}-{fault}" for make, fault, _ in STREAM]
)
def test_a_fault_in_a_stroke_ends_in_its_message_zero_force_and_silence(
    subject: Subject, make_subject: Callable[..., Subject], fault: str, mode: str, request: pytest.FixtureRequest
) -> None:
    device, servo = subject.device, stroke(subject)
    if make_subject is force_dimension_library:
        request.getfixturevalue("standin").fault(fault)
    else:
        (device.emulated if make_subject is force_dimension else device.hand).set_fault(fault)
    assert servo.advance(100) < 60
    with pytest.raises((DeviceLost, ServoFault)) as ended:
        servo.check()
    message, (known, cure) = str(ended.value), words_of(make_subject, mode)
    assert message.startswith(f"the device '{device.name}' stopped: ")
    assert message.endswith("; the force is zero")
    assert known in message
    assert cure in message
    if make_subject is force_dimension_library:  # write-error: it takes no force, not the last zero either
        state = request.getfixturevalue("standin").state
        assert (state["stopped"], state["force_on"]) == (1.0, 0.0)
        assert fault != "turns-off" or "(velocity threshold)" in message
        request.getfixturevalue("standin").loaded.standin_reset()
    elif make_subject is not falcon:  # its cable or its power is out: its guard waits
        assert subject.is_quiet()  # before anything is closed
    if make_subject is inverse3:
        commands, pushes = int(device.hand.state.commands), int(device.hand.state.pushes)
        servo.stop()
        device.close()
        assert device.hand.state.pushes == pushes
        assert mode == "no-reply" or device.hand.state.commands == commands
    if make_subject is falcon:
        device.hand.faults.off("unplugged")
        device.hand.power(False)


def refused(make_subject: Callable[..., Subject], fault: str, request: pytest.FixtureRequest) -> DeviceError:
    """Open a device with a fault; return its error, after checking that no force acts and nothing stays open."""
    if make_subject is inverse3:
        from study_app.devices.emulators.inverse3 import EmulatedInverse3
        from study_app.devices.emulators.inverse3_service import Service

        service = Service()
        service.set_fault(fault)
        with pytest.raises(DeviceFailure) as caught:
            EmulatedInverse3(service=service).open()
        assert (service.state.pushes, service.state.ended, service.force_n) == (0, 1, (0.0, 0.0, 0.0))
        return caught.value
    standin = request.getfixturevalue("standin")
    standin.fault(fault)
    with pytest.raises(DeviceFailure) as caught:
        open_device("force-dimension", options={"dhd-library": standin.path})
    state = standin.state
    assert (state["force_n"], state["open"]) == ([0.0, 0.0, 0.0], 0.0)
    assert fault == "no-device" or (state["stopped"], state["force_on"]) == (1.0, 0.0)
    return caught.value


OPENING = [
    (inverse3, "not-websocket", "not-websocket"),
    (inverse3, "version-3.0", "version"),
    (inverse3, "version-3.1", "version"),
    (inverse3, "no-device", "no-device"),
    (inverse3, "off", "not-ready"),
    (inverse3, "uncalibrated", "uncalibrated"),
    (inverse3, "in-use", "in-use"),
    (inverse3, "gravity-off", "settings"),
    (inverse3, "disobeys", "settings"),
    (inverse3, "force-scale", "settings"),
    (inverse3, "unknown-scale", "unknown-scale"),
    (force_dimension_library, "no-device", "no-device"),
    (force_dimension_library, "uncalibrated", "uncalibrated"),
    (force_dimension_library, "no-threshold", "safety"),
    (force_dimension_library, "weak", "max-force"),
    (force_dimension_library, "stays-off", "force-off"),
]


@pytest.mark.parametrize(
    ("make_subject", "fault", "mode"), OPENING, ids=[f"{make.__name__}-{fault}" for make, fault, _ in OPENING]
)
def test_a_fault_of_opening_is_refused_with_cause_and_cure_and_without_force(
    make_subject: Callable[..., Subject], fault: str, mode: str, request: pytest.FixtureRequest
) -> None:
    error = refused(make_subject, fault, request)
    known = (INVERSE3 if make_subject is inverse3 else FORCE_DIMENSION).mode(mode)
    assert error.mode == mode
    assert "\n" not in str(error)
    assert known.cause in str(error)
    assert str(error).endswith(known.cure)
    if make_subject is force_dimension_library:
        options = {OPTION: request.getfixturevalue("standin").path}
        report = doctor_of("force-dimension").examine("force-dimension", options=options, progress=str)
        assert [finding.id for finding in report.found] == [mode]


def test_the_tables_of_faults_are_complete() -> None:
    from tests.devices.force_dimension.standin import FAULTS as STANDIN

    tried = {
        make_subject: {fault for maker, fault, _ in (*STREAM, *OPENING) if maker is make_subject}
        for make_subject in MOVING
    }
    for make_subject, name, others in (
        (force_dimension, "force-dimension", set()),
        (inverse3, "inverse3", {"slow", "torn"}),
    ):
        with open_device(f"{name}-emulated") as device, pytest.raises(DeviceError) as refused:
            device.take_fault("none of them")
        assert tried[make_subject] | others == set(str(refused.value).partition("choose from: ")[2].split(", "))
    elsewhere = {"none", "slow", "hangs", "guarded", "saturated", "unwatched", "deaf", "unmodelled", "plain"}
    assert tried[force_dimension_library] | elsewhere == set(STANDIN)


def _hang_falcon(device: Any, until_released: Callable[[], None]) -> Any:
    from study_app.devices.falcon.constants import ENDPOINT_IN, ERROR_TIMEOUT
    from tests.devices.falcon.support.scripted_bridge import BULK_CALL

    bridge = BULK_CALL(int(device.exchange.transfer))

    def transfer(handle: int, endpoint: int, *rest: int) -> int:
        if endpoint != ENDPOINT_IN:
            return int(bridge(handle, endpoint, *rest))
        until_released()
        return int(ERROR_TIMEOUT)

    hanging = BULK_CALL(transfer)
    device.exchange.transfer = ctypes.cast(hanging, ctypes.c_void_p).value
    return hanging


def _hang_inverse3(device: Any, until_released: Callable[[], None]) -> Any:
    def receive(*_arguments: int) -> int:
        until_released()
        return -1  # nothing came

    kinds = (ctypes.c_ssize_t, ctypes.c_ssize_t, ctypes.c_size_t, ctypes.c_int32)
    hanging = ctypes.CFUNCTYPE(ctypes.c_ssize_t, *kinds)(receive)
    device.exchange.receive = ctypes.cast(hanging, ctypes.c_void_p).value
    return hanging


def _hang_force_dimension(device: Any, until_released: Callable[[], None]) -> Any:
    def get_position(*_arguments: int) -> int:
        until_released()
        return 1  # by the time guard

    hanging = ctypes.CFUNCTYPE(ctypes.c_int32, *(ctypes.c_ssize_t,) * 4)(get_position)
    device.exchange.get_position = ctypes.cast(hanging, ctypes.c_void_p).value
    return hanging


@pytest.mark.parametrize(
    ("make_subject", "hang"),
    [
        (falcon, _hang_falcon),
        (inverse3, _hang_inverse3),
        (force_dimension, _hang_force_dimension),
        (force_dimension_library, _hang_force_dimension),
    ],
)
def test_a_call_that_outlasts_closing_ends_the_force_when_it_returns(
    subject: Subject, hang: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(driver, "LEAVE_S", 0.05)
    ticks = subject.push()
    entered, release = threading.Event(), threading.Event()

    def until_released() -> None:
        entered.set()
        assert release.wait(30)

    kept = hang(subject.device, until_released)
    call = threading.Thread(target=ticks.read)
    call.start()
    assert entered.wait(30)
    subject.device.close()
    assert not subject.is_quiet()  # what the call uses is still there
    with pytest.raises(DeviceError, match="has not returned"):
        subject.device.open()
    release.set()
    call.join(30)
    subject.elapse()
    assert subject.is_quiet()
    subject.device.close()
    assert kept
    subject.device.open()
    again = subject.ticks(ticks.now_ns if subject.device.name == "falcon-emulated" else None)
    until(lambda: again.after(5) == READ_NEW, "it gives no position")


PUSHES = """
import json, sys, time
from study_app.devices.registry import open_device
from tests.devices.subjects import Ticks
device = open_device(sys.argv[1], options=json.loads(sys.argv[2]))
print("pushes", flush=True)
ticks = Ticks(device, time.perf_counter_ns(), 0.001)
while True:
    ticks.take((0.0, 0.0, 2.0))
"""


@contextmanager
def _served_falcon(
    tmp_path: Path, request: pytest.FixtureRequest
) -> Iterator[tuple[str, dict[str, str], Callable[[], Any]]]:
    from study_app.devices.emulators.falcon_emulator import Emulator
    from tests.devices.falcon.served import Server

    request.getfixturevalue("falcon_socket")
    emulator = Emulator(running=True)
    with Server(tmp_path / "falcon", emulator) as server:
        yield f"falcon-socket:{server.path}", {}, lambda: emulator.force_n
        assert emulator.homed == 0b111


@contextmanager
def _served_inverse3(_tmp_path: Path, _request: Any) -> Iterator[tuple[str, dict[str, str], Callable[[], Any]]]:
    from study_app.devices.emulators.inverse3_service import Service
    from tests.devices.inverse3.server import ServiceServer

    service = Service(tremor_m=0.0)
    with ServiceServer(service) as server:
        yield f"inverse3:127.0.0.1:{server.port}", {}, lambda: service.force_n


@contextmanager
def _served_force_dimension(
    _tmp_path: Path, request: pytest.FixtureRequest
) -> Iterator[tuple[str, dict[str, str], Callable[[], Any]]]:
    unwatched = request.getfixturevalue("unwatched")
    yield "force-dimension", {OPTION: str(unwatched.path)}, lambda: unwatched.state["force_n"]


@pytest.mark.slow
@pytest.mark.flaky(reruns=2)  # on a busy machine an answer may come later than the driver waits for it
@pytest.mark.parametrize("served", [_served_falcon, _served_inverse3, _served_force_dimension])
def test_a_program_that_is_killed_while_it_pushes_leaves_no_force(
    served: Any, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    with served(tmp_path, request) as (name, options, acting):
        command = [sys.executable, "-c", PUSHES, name, json.dumps(options)]
        with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE) as running:
            assert running.stdout is not None
            try:
                assert running.stdout.readline() == b"pushes\n"
                until(lambda: np.abs(acting()).max() > 1.0, "it does not push", 3 * PATIENCE_S)
            finally:
                running.kill()
        until(lambda: not np.any(acting()), "the force goes on", 3 * PATIENCE_S)


@pytest.mark.parametrize(
    ("name", "options", "doctor", "by_itself", "simulated", "shows_force"),
    [
        ("mouse", [], False, False, False, True),
        ("spacemouse", [], False, False, False, True),
        ("scripted", [], False, True, True, None),
        ("falcon", ["firmware"], True, False, False, None),
        ("falcon:FT1", ["firmware"], True, False, False, None),
        ("falcon-emulated", ["firmware"], True, True, True, None),
        ("inverse3", [], True, False, False, False),
        ("inverse3:lab:10001:049D", [], True, False, False, False),
        ("inverse3-emulated", [], True, True, True, False),
        ("force-dimension:10233", [OPTION], True, False, False, None),
        ("force-dimension-emulated", [], True, True, True, None),
    ],
)
def test_a_name_determines_the_options_and_properties_of_a_device(
    name: str, options: list[str], doctor: bool, by_itself: bool, simulated: bool, shows_force: bool | None
) -> None:
    device = descriptor_of(name)
    assert [option.name for option in device.options] == options
    assert (device.doctor is not None, device.moves_by_itself, device.simulated) == (doctor, by_itself, simulated)
    assert shows_force in {None, device.motion_shows_force}


@pytest.mark.parametrize(
    "name", ["falcn", "mouse:2", "falcon-emulated:x", "inverse3-emulated:x", "falcon-sockets:x", ":"]
)
def test_an_unknown_name_is_refused_with_the_known_ones(name: str) -> None:
    with pytest.raises(DeviceNotFound, match="is not known; choose one of: mouse, falcon, "):
        open_device(name)
    assert list_devices()[0] == "mouse"


def test_a_device_without_a_doctor_is_refused_with_those_that_have_one() -> None:
    with pytest.raises(DeviceError, match="the doctor command does not support 'mouse', only ") as refused:
        doctor_of("mouse")
    listed = str(refused.value).partition("', only ")[2].partition(": see ")[0].split(", ")
    assert sorted(listed) == sorted(device.usage for device in DEVICES if device.doctor is not None)


@pytest.mark.parametrize("name", ["falcon", "inverse3", "force-dimension"])
def test_every_finding_of_a_doctor_has_a_cause_a_cure_and_how_it_is_known(name: str) -> None:
    doctor = doctor_of(name)
    findings = doctor.findings()
    assert len({finding.id for finding in findings}) == len(findings)
    assert [finding.number for finding in findings] == list(range(1, len(findings) + 1))
    for finding in findings:
        assert finding.state in {"not checked", "ok"}
        assert all((finding.tested, finding.symptom, finding.cause, finding.known_by))
        assert "\n" not in finding.tested + finding.symptom + finding.cause + finding.cure
    with pytest.raises(DeviceError, match="faults can be simulated only with"):
        doctor.examine(name, options={}, faults=["nan"], progress=str)
    with pytest.raises(DeviceError, match="fault 'thirst' is not known; choose from: "):
        doctor.examine(f"{name}-emulated", options={}, faults=["thirst"], progress=str)


@pytest.mark.parametrize(
    ("name", "fault", "mode"),
    [
        ("inverse3", None, None),
        ("inverse3", "off", "not-ready"),
        ("inverse3", "force-scale", "settings"),
        ("inverse3", "closes", "closed"),
        ("inverse3", "nan", "not-json"),
        ("force-dimension", None, None),
        ("force-dimension", "error", "error"),
        ("force-dimension", "nan", "not-finite"),
        ("force-dimension", "force-off", "force-off"),
        ("force-dimension", "time-guard", "rate"),
    ],
)
def test_a_doctor_finds_exactly_the_simulated_fault(name: str, fault: str | None, mode: str | None) -> None:
    report = doctor_of(name).examine(f"{name}-emulated", options={}, faults=[fault] if fault else [], progress=str)
    assert [finding.id for finding in report.found] == ([mode] if mode else [])
    if mode is None:
        assert report.well
        assert report.conclusion == "No problems were found."
        assert "new positions per second: 1000" in " ".join(report.seen)
    else:
        assert report.failure is None or report.found[0].cure in report.failure
        order = [finding.state for finding in report.findings]
        assert "found" not in order[order.index("found") + 1 :]
        lines = report_lines(report)
        for finding in report.findings:
            text = finding.symptom if finding.id == mode else finding.tested
            assert any(line.startswith(f"{finding.number:>2}  ") and line.endswith(f"  {text}") for line in lines)
