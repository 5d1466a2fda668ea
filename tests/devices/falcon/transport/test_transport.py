"""The transports to the Falcon's bridge: their calls and bytes, and their failure messages."""

import ctypes
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import libusb_package
import pytest
import usb.core

from study_app.devices.falcon import constants, transport
from study_app.devices.falcon.failures import FURTHER_KINDS, KINDS, FalconNotFound, UsbFailure, usb_failure
from study_app.devices.falcon.transport import (
    PACKETS,
    FtdiTransport,
    PyUsbTransport,
    end_torque,
    libusb_calls,
    open_transport,
)
from study_app.errors import DeviceError
from tests.devices.falcon.support.bridges import Backend, D2xx, both
from tests.golden import compare
from tests.platforms import needs_posix

GOLDEN = Path(__file__).parents[1] / "golden"


def usb_error(code: int | None, number: int | None = None) -> usb.core.USBError:
    return usb.core.USBError("what libusb says", code, number)


class Recorded:
    """A record of a bridge as lines: each call of its library, its result or its failure."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def __call__(self, what: str, bridge: Any, do: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
        bridge.calls.clear()
        result = None
        try:
            result = do(*arguments, **named)
            said = repr(result) if isinstance(result, bytes) else f"{getattr(result, 'name', '')}"
        except UsbFailure as failure:
            said = f"{type(failure).__name__}, {failure.kind}"
        except ValueError as error:
            said = f"{error}"
        self.lines.append(f"{what} -> {said}")
        self.lines += [f"    {call}" for call in bridge.calls if call[0] != "close_device" or result is None]
        return result  # pyusb closes the others that it looked at when it forgets them


FAILURES = {
    "access": usb_error(constants.ERROR_ACCESS),
    "errno 13": usb_error(None, 13),
    "busy": usb_error(constants.ERROR_BUSY),
    "not supported": usb_error(constants.ERROR_NOT_SUPPORTED),
    "not implemented": NotImplementedError("what pyusb makes of it"),
    "no device": usb_error(constants.ERROR_NO_DEVICE),
    "I/O": usb_error(constants.ERROR_IO),
    "unknown": usb_error(-99),
}
CHOSEN: tuple[tuple[tuple[str | None, ...], dict[str, Any]], ...] = (
    (("A", "B", "C"), {}),
    (("A", "B", "C"), {"index": 1}),
    (("A", "B", "C"), {"serial": "C"}),
    ((None,), {}),
    ((), {}),
    (("A",), {"index": 1}),
    (("A",), {"serial": "B"}),
    (("A", None), {"serial": "B"}),
)


def opening(recorded: Recorded) -> None:
    for serials, chosen in CHOSEN:
        backend = Backend(*serials)
        transport = recorded(f"open {chosen} of {serials}", backend, PyUsbTransport, backend, **chosen)
        if transport is not None:
            recorded("close", backend, transport.close)
            recorded("close", backend, transport.close)
            recorded("write", backend, transport.write, b"a", 1.0)
            transport.reopen()
            recorded.lines.append(f"open again -> {transport.serial}")
            backend.fails = dict.fromkeys(("release_interface", "close_device"), FAILURES["no device"])
            recorded("close what has gone", backend, transport.close)
            backend.fails.clear()
    for method in ("open_device", "claim_interface", "get_configuration"):
        for name, error in FAILURES.items():
            for chosen in ({}, {"serial": "A"}):
                backend = Backend("A", fails={method: error})
                recorded(f"{method}: {name} {chosen}", backend, PyUsbTransport, backend, **chosen)
    for name, how in {
        "unconfigured": {"configured": False},
        "driver of the system": {"kernel_driver": True},
        "driver that stays": {"kernel_driver": True, "fails": {"detach_kernel_driver": FAILURES["access"]}},
    }.items():
        backend = Backend("A", **how)
        recorded(name, backend, PyUsbTransport, backend)


def transfers(recorded: Recorded) -> None:
    backend = Backend("A")
    transport = PyUsbTransport(backend)
    ways: tuple[tuple[str, Callable[..., Any], tuple[Any, ...]], ...] = (
        ("control", transport.control, (constants.REQUEST_BAUD, constants.BAUD_1500000)),
        ("write", transport.write, (b"hello, a Falcon!", 0.25)),
        ("read at once", transport.read, (128, 0.0)),  # a time-out of 0 would wait for ever
        ("read", transport.read, (64, 1.0)),
        ("read nothing", transport.read, (64, 1.0)),
        *((f"read {size}", transport.read, (size, 1.0)) for size in (0, 16, 65, -64)),
    )
    backend.incoming = [b"\x01\x60abc", b"\x01\x60"]
    for error in (None, usb_error(constants.ERROR_NO_DEVICE, 19), usb_error(None, 75)):
        backend.fails = dict.fromkeys(("ctrl_transfer", "bulk_write", "bulk_read"), error) if error else {}
        for name, use, arguments in ways:
            recorded(f"{name}, {error}", backend, use, *arguments)
    backend.fails.clear()
    backend.most_written = 15
    recorded("write in part", backend, transport.write, b"hello, a Falcon!", 0.25)


FTDI_REQUESTS = {
    "REQUEST_RESET": ("RESET_ALL", "PURGE_RX", "PURGE_TX"),
    "REQUEST_MODEM": ("DTR_LOW", "DTR_HIGH", "RTS_LOW", "RTS_HIGH"),
    "REQUEST_FLOW": (0,),
    "REQUEST_BAUD": ("BAUD_142857",),
    "REQUEST_LINE": ("LINE_8N1",),
    "REQUEST_EVENT_CHARACTER": (constants.EVENT_ENABLED | constants.STOP, constants.STOP),
    "REQUEST_LATENCY": (16,),
}


def ftdi(recorded: Recorded) -> None:
    falcon, cable = ("A1", "FALCON HAPTIC"), ("B9", "USB SERIAL")
    for devices, serial in (((), None), ((cable,), None), ((falcon,), "B"), ((cable, falcon), None)):
        library = D2xx(*devices)
        transport = recorded(f"open {serial} of {devices}", library, FtdiTransport, library, serial=serial)
    for request, values in FTDI_REQUESTS.items():
        for value in values:
            number = getattr(constants, value) if isinstance(value, str) else value
            recorded(f"{request} {value}", library, transport.control, getattr(constants, request), number)
    recorded("close", library, transport.close)
    recorded("close", library, transport.close)
    recorded("write", library, transport.write, b"a", 1.0)


@pytest.mark.parametrize("scenario", [opening, pytest.param(transfers, marks=needs_posix), ftdi])
def test_calls(scenario: Callable[[Recorded], None], pytestconfig: pytest.Config) -> None:
    recorded = Recorded()
    scenario(recorded)
    compare(GOLDEN / f"transport_{scenario.__name__}.txt", recorded.lines, pytestconfig)


@pytest.mark.slow
@both
def test_ftdis_library_moves_bytes_as_a_bridge_would(kind: Any, pytestconfig: pytest.Config) -> None:
    """Transfers of compiled code are those of the transport: one golden holds both."""
    library, recorded = D2xx(("A1", "FALCON HAPTIC")), Recorded()
    way = kind(FtdiTransport(library))
    for waiting, coming in ((b"abcd", b""), (b"", b"waited for"), (b"", b"x"), (b"", b""), (bytes(range(100)), b"")):
        library.waiting += waiting
        library.coming += coming
        recorded("read", library, way.read)
    recorded("read the rest", library, way.read)
    for timeout_s in (0.02, 0.02, 0.005, 0.005):
        recorded(f"read {timeout_s}", library, way.read, timeout_s)
        recorded(f"write {timeout_s}", library, way.write, b"a", timeout_s)
    library.most_written = 3
    recorded("write in part", library, way.write, b"abcd")
    recorded.lines.append(f"written {library.written!r}")
    for status in (4, 1, 5, 18):
        library.status = status
        recorded(f"read: status {status}", library, way.read)
        recorded(f"write: status {status}", library, way.write, b"a")
    compare(GOLDEN / "transport_ftdi_bytes.txt", recorded.lines, pytestconfig)


def test_missing_libraries_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(libusb_package, "get_libusb1_backend", lambda: None)
    with pytest.raises(UsbFailure, match="libusb-package") as caught:
        PyUsbTransport()
    assert caught.value.kind == "no-libusb"
    if os.name != "nt":  # there the library may be installed
        with pytest.raises(UsbFailure, match="D2XX") as caught:
            FtdiTransport()
        assert caught.value.kind == "no-ftd2xx"


def test_libusb_finds_no_device_and_compiled_code_calls_its_function() -> None:
    backend = libusb_package.get_libusb1_backend()
    if backend is None:
        pytest.skip("libusb cannot be loaded here")
    with pytest.raises(FalconNotFound):
        open_transport("no such number")
    function = ctypes.CDLL(str(libusb_package.get_library_path())).libusb_bulk_transfer
    address = ctypes.cast(function, ctypes.c_void_p).value
    assert libusb_calls(backend.lib, ctypes.c_void_p(0x1234)) == (0x1234, address)


@pytest.mark.parametrize("accepts", [True, False])
def test_the_guard_sends_zero_torque_to_its_bridge_and_closes_it(
    monkeypatch: pytest.MonkeyPatch, *, accepts: bool
) -> None:
    calls: list[object] = []

    class Bridge:
        def write(self, packet: bytes, _timeout_s: float) -> None:
            calls.append(packet)
            if not accepts:
                raise DeviceError("gone")

        def pause(self, _lasting_s: float) -> None: ...

        def close(self) -> None:
            calls.append("closed")

    monkeypatch.setattr(transport, "open_transport", lambda name: calls.append(name) or Bridge())
    with nullcontext() if accepts else pytest.raises(DeviceError, match="does not accept packets"):
        end_torque("A7")
    assert calls == ["A7", *[constants.quiet_packet(constants.FLAG_HOMING)] * PACKETS, "closed"]


@pytest.mark.parametrize(("serials", "name"), [(("A", "B"), "B"), ((None,), "")])
def test_the_name_of_a_bridge_opens_it_again(serials: tuple[str | None, ...], name: str) -> None:
    assert PyUsbTransport(Backend(*serials), serial=name or None).name == name


def test_every_failure_is_one_line_with_its_action() -> None:
    for kind in (*KINDS.values(), *FURTHER_KINDS):
        said = str(UsbFailure(kind, "trying"))
        assert said.startswith("the Falcon cannot be used: ")
        assert "(while trying)" in said
        assert "\n" not in said
    assert "libusb error -3" in str(usb_failure(constants.ERROR_ACCESS, "trying"))


@pytest.mark.slow
def test_importing_the_ways_to_the_bridge_loads_no_compiler() -> None:
    code = "import sys; from study_app.devices.falcon import transport; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
