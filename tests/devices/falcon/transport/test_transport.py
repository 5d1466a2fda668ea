"""The ways to the Falcon's bridge, call by call and byte by byte: pyusb, and FTDI's library."""

import ctypes
import os
import subprocess
import sys

import libusb_package
import pytest
import usb.core

from study_app.devices.falcon import constants
from study_app.devices.falcon.failures import FURTHER_KINDS, KINDS, FalconLost, FalconNotFound, UsbFailure, usb_failure
from study_app.devices.falcon.transport import FtdiTransport, PyUsbTransport, libusb_calls, open_transport
from study_app.errors import DeviceError, DeviceLost, DeviceNotFound
from tests.devices.falcon.support.bridges import Backend, D2xx, both


def usb_error(code, number=None):
    return usb.core.USBError("what libusb says", code, number)


class TestPyusb:
    @pytest.mark.parametrize(
        ("chosen", "device"), [({"index": 1}, 1), ({"serial": "C"}, 2), ({"serial": "A"}, 0), ({}, 0)]
    )
    def test_opening_claims_the_one_that_is_chosen_and_resets_nothing(self, chosen, device):
        backend = Backend("A", "B", "C")
        transport = PyUsbTransport(backend, **chosen)
        serial = "ABC"[device]
        assert (transport.serial, transport.name) == (serial, serial)
        assert [call for call in backend.calls if call[0] == "claim_interface"] == [("claim_interface", device)]
        assert not {"set_configuration", "ctrl_transfer", "bulk_write"} & {call[0] for call in backend.calls}
        transport.close()
        assert backend.calls[-2:] == [("release_interface", device), ("close_device", device)]
        transport.close()
        with pytest.raises(FalconLost):
            transport.write(b"a", 1.0)
        transport.reopen()
        assert transport.serial == serial
        transport.write(b"a", 1.0)
        backend.fails = dict.fromkeys(("release_interface", "close_device"), usb_error(constants.ERROR_NO_DEVICE))
        transport.close()  # it has gone
        backend.fails.clear()

    def test_a_falcon_without_a_number_has_no_name(self):
        transport = PyUsbTransport(Backend(None))
        assert (transport.serial, transport.name) == (None, "")

    @pytest.mark.parametrize(
        ("backend", "chosen"),
        [
            (Backend(), {}),
            (Backend("A"), {"index": 1}),
            (Backend("A"), {"serial": "B"}),
            (Backend("A", None), {"serial": "B"}),
        ],
    )
    def test_where_there_is_none_it_is_not_found(self, backend, chosen):
        with pytest.raises(FalconNotFound) as caught:
            PyUsbTransport(backend, **chosen)
        assert caught.value.kind == "not-found"
        assert isinstance(caught.value, DeviceNotFound)

    @pytest.mark.parametrize("method", ["open_device", "claim_interface", "get_configuration"])
    @pytest.mark.parametrize(
        ("error", "kind"),
        [
            (usb_error(constants.ERROR_ACCESS), "access"),
            (usb_error(None, 13), "access"),
            (usb_error(constants.ERROR_BUSY), "busy"),
            (usb_error(constants.ERROR_NOT_SUPPORTED), "not-supported"),
            (NotImplementedError("what pyusb makes of it"), "not-supported"),
            (usb_error(constants.ERROR_NO_DEVICE), "no-device"),
            (usb_error(constants.ERROR_IO), "io"),
            (usb_error(-99), "io"),
        ],
    )
    def test_what_keeps_it_from_being_opened_is_said_by_kind(self, method, error, kind):
        for chosen in ({}, {"serial": "A"}):
            backend = Backend("A", fails={method: error})
            with pytest.raises(UsbFailure, match="opening it") as caught:
                PyUsbTransport(backend, **chosen)
            assert caught.value.kind == kind
            if method != "open_device":
                assert backend.calls[-1][0] == "close_device"  # nothing is left open

    def test_an_unconfigured_one_is_configured_and_a_driver_of_the_system_sent_away(self):
        backend = Backend("A", configured=False, kernel_driver=True)
        PyUsbTransport(backend)
        assert ("set_configuration", 1) in backend.calls
        names = [call[0] for call in backend.calls]
        assert names.index("detach_kernel_driver") < names.index("claim_interface")
        stays = {"detach_kernel_driver": usb_error(constants.ERROR_ACCESS)}
        with pytest.raises(UsbFailure, match="ftdi_sio") as caught:
            PyUsbTransport(Backend("A", kernel_driver=True, fails=stays))
        assert (caught.value.kind, caught.value.code) == ("kernel-driver", constants.ERROR_ACCESS)

    def test_requests_and_transfers_go_out_as_they_are(self):
        backend = Backend("A")
        transport = PyUsbTransport(backend)
        backend.calls.clear()
        backend.incoming = [b"\x01\x60abc", b"\x01\x60"]
        transport.control(constants.REQUEST_BAUD, constants.BAUD_1500000)
        transport.write(b"hello", 0.25)
        assert transport.read(128, 0.0) == b"\x01\x60abc"
        assert transport.read(64, 1.0) == b"\x01\x60"
        assert transport.read(64, 1.0) == b""
        assert backend.calls == [
            ("ctrl_transfer", 0x40, 3, 2, 0),
            ("bulk_write", 0x02, b"hello", 250),
            ("bulk_read", 0x81, 128, 1),  # a time-out of 0 would wait for ever
            ("bulk_read", 0x81, 64, 1000),
            ("bulk_read", 0x81, 64, 1000),
        ]
        for size in (0, 16, 65, -64):
            with pytest.raises(ValueError, match="multiple of 64"):
                transport.read(size, 1.0)

    def test_what_fails_on_the_way_is_said_by_kind(self):
        backend = Backend("A")
        transport = PyUsbTransport(backend)
        ways = (lambda: transport.control(0, 0), lambda: transport.write(b"a", 1.0), lambda: transport.read(64, 1.0))
        gone = usb_error(constants.ERROR_NO_DEVICE, 19)
        backend.fails = dict.fromkeys(("ctrl_transfer", "bulk_write", "bulk_read"), gone)
        for use in ways:
            with pytest.raises(FalconLost, match="plug it in again") as caught:
                use()
            assert isinstance(caught.value, DeviceLost)
        backend.fails = {"bulk_read": usb_error(None, 75)}
        backend.most_written = 15
        for use, kind in ((ways[2], "overflow"), (lambda: transport.write(bytes(16), 1.0), "timeout")):
            with pytest.raises(UsbFailure) as caught:
                use()
            assert caught.value.kind == kind  # what went out in part did not go out
        backend.fails.clear()

    def test_without_libusb_it_says_so(self, monkeypatch):
        monkeypatch.setattr(libusb_package, "get_libusb1_backend", lambda: None)
        with pytest.raises(UsbFailure, match="libusb-package") as caught:
            PyUsbTransport()
        assert caught.value.kind == "no-libusb"

    def test_libusb_finds_none_and_its_function_is_the_one_that_compiled_code_calls(self):
        backend = libusb_package.get_libusb1_backend()
        if backend is None:
            pytest.skip("libusb cannot be loaded here")
        with pytest.raises(FalconNotFound):
            open_transport("no such number")
        function = ctypes.CDLL(str(libusb_package.get_library_path())).libusb_bulk_transfer
        address = ctypes.cast(function, ctypes.c_void_p).value
        assert libusb_calls(backend.lib, ctypes.c_void_p(0x1234)) == (0x1234, address)


def test_every_failure_is_one_line_that_says_what_to_do():
    for kind in (*KINDS.values(), *FURTHER_KINDS):
        failure = UsbFailure(kind, "trying")
        assert isinstance(failure, DeviceError)
        assert str(failure).startswith("the Falcon cannot be used: ")
        assert "(trying)" in str(failure)
        assert "\n" not in str(failure)
    assert "libusb error -3" in str(usb_failure(constants.ERROR_ACCESS, "trying"))


@pytest.mark.slow
def test_importing_the_ways_to_the_bridge_loads_no_compiler():
    code = "import sys; from study_app.devices.falcon import transport; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False, env={**os.environ}).returncode == 0


class TestFtdisLibrary:
    @pytest.fixture
    def library(self):
        return D2xx(("B9", "USB SERIAL"), ("A1", "FALCON HAPTIC"))

    def test_it_opens_the_falcon_among_what_it_lists(self, library):
        transport = FtdiTransport(library)
        assert ("FT_Open", 1) in library.calls
        assert (transport.serial, transport.name) == ("A1", "A1")
        transport.close()
        transport.close()
        assert [call[0] for call in library.calls].count("FT_Close") == 1
        with pytest.raises(FalconLost):
            transport.write(b"a", 1.0)

    @pytest.mark.parametrize(
        ("devices", "serial"), [([], None), ([("A", "USB SERIAL")], None), ([("A", "FALCON HAPTIC")], "B")]
    )
    def test_without_the_falcon_that_is_meant_it_is_not_found(self, devices, serial):
        with pytest.raises(FalconNotFound):
            FtdiTransport(D2xx(*devices), serial=serial)

    @pytest.mark.parametrize(
        ("request_value", "call"),
        [
            ((constants.REQUEST_RESET, constants.RESET_ALL), ("FT_ResetDevice",)),
            ((constants.REQUEST_RESET, constants.PURGE_RX), ("FT_Purge", 1)),
            ((constants.REQUEST_RESET, constants.PURGE_TX), ("FT_Purge", 2)),
            ((constants.REQUEST_MODEM, constants.DTR_LOW), ("FT_ClrDtr",)),
            ((constants.REQUEST_MODEM, constants.DTR_HIGH), ("FT_SetDtr",)),
            ((constants.REQUEST_MODEM, constants.RTS_LOW), ("FT_ClrRts",)),
            ((constants.REQUEST_MODEM, constants.RTS_HIGH), ("FT_SetRts",)),
            ((constants.REQUEST_FLOW, 0), ("FT_SetFlowControl", 0, 0, 0)),
            ((constants.REQUEST_BAUD, constants.BAUD_142857), ("FT_SetDivisor", 0x15)),
            ((constants.REQUEST_LINE, constants.LINE_8N1), ("FT_SetDataCharacteristics", 8, 0, 0)),
            (
                (constants.REQUEST_EVENT_CHARACTER, constants.EVENT_ENABLED | constants.STOP),
                ("FT_SetChars", 0x3E, 1, 0, 0),
            ),
            ((constants.REQUEST_EVENT_CHARACTER, constants.STOP), ("FT_SetChars", 0x3E, 0, 0, 0)),
            ((constants.REQUEST_LATENCY, 16), ("FT_SetLatencyTimer", 16)),
        ],
    )
    def test_each_control_request_has_its_function(self, library, request_value, call):
        FtdiTransport(library).control(*request_value)
        assert library.calls[-1] == call

    @pytest.mark.slow
    @both
    def test_it_writes_and_reads_as_a_bridge_would_and_is_told_a_time_out_once(self, library, kind):
        way = kind(FtdiTransport(library))
        way.write(b"hello")
        assert library.written == b"hello"
        library.waiting += b"abcd"
        assert way.read() == b"\0\0abcd"
        for coming in (b"waited for", b"x"):
            library.coming += coming
            assert way.read() == b"\0\0" + coming
        assert way.read() == b""
        library.waiting += bytes(range(100))
        assert way.read() == b"\0\0" + bytes(range(62))
        assert way.read() == b"\0\0" + bytes(range(62, 100))
        library.calls.clear()
        for timeout_s in (0.02, 0.02, 0.005, 0.005):
            way.read(timeout_s)
            way.write(b"a", timeout_s)
        told = [call for call in library.calls if call[0] == "FT_SetTimeouts"]
        assert told == [("FT_SetTimeouts", 20, 20), ("FT_SetTimeouts", 5, 5)]
        library.most_written = 3
        with pytest.raises(UsbFailure) as caught:
            way.write(b"abcd")
        assert caught.value.kind == "timeout"

    @both
    @pytest.mark.parametrize(("status", "kind_of_failure"), [(4, "no-device"), (1, "no-device"), (5, "io"), (18, "io")])
    def test_it_says_what_failed(self, library, kind, status, kind_of_failure):
        way = kind(FtdiTransport(library))
        library.status = status
        for use in (way.read, lambda: way.write(b"a")):
            with pytest.raises(UsbFailure) as caught:
                use()
            assert caught.value.kind == kind_of_failure

    @pytest.mark.skipif(os.name == "nt", reason="here the library may be installed")
    def test_where_it_is_not_installed_it_says_so(self):
        with pytest.raises(UsbFailure, match="D2XX") as caught:
            FtdiTransport()
        assert caught.value.kind == "no-ftd2xx"
