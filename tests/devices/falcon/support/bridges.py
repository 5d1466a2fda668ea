"""Bridges made up for tests: a pyusb backend and FTDI's library, each scripted."""

import ctypes
from types import SimpleNamespace

import numba
import numpy as np
import pytest
import usb.core

from study_app.devices.emulators.falcon import EmulatedBackend
from study_app.devices.falcon import constants
from study_app.devices.falcon.failures import usb_failure


class Backend(EmulatedBackend):
    """A bus with Falcons on it: ``serials`` names them; ``fails`` maps a method's name to the error it raises."""

    def __init__(self, *serials, fails=None, configured=True, kernel_driver=None):
        super().__init__(*(SimpleNamespace(serial=serial, number=at) for at, serial in enumerate(serials)))
        self.fails = dict(fails or {})
        self.configured = configured
        self.kernel_driver = kernel_driver
        self.calls = []
        self.incoming = []  # what the next reads give; nothing left: a time-out
        self.most_written = 1 << 20

    def _called(self, name, *arguments, is_recorded=True):
        self.calls += [(name, *arguments)] * is_recorded
        if name in self.fails:
            raise self.fails[name]

    def enumerate_devices(self):
        self._called("enumerate_devices", is_recorded=False)
        return iter(self.emulators)

    def get_device_descriptor(self, dev):
        described = super().get_device_descriptor(dev)
        described.iSerialNumber = 3 if dev.serial else 0
        return described

    def open_device(self, dev):
        self._called("open_device", dev.number)
        return dev

    def close_device(self, dev_handle):
        self._called("close_device", dev_handle.number)

    def get_configuration(self, dev_handle):
        self._called("get_configuration", is_recorded=False)
        return int(self.configured)

    def set_configuration(self, dev_handle, config_value):
        self._called("set_configuration", config_value)
        self.configured = True

    def claim_interface(self, dev_handle, intf):
        self._called("claim_interface", dev_handle.number)

    def release_interface(self, dev_handle, intf):
        self._called("release_interface", dev_handle.number)

    def is_kernel_driver_active(self, dev_handle, intf):
        if self.kernel_driver is None:
            raise NotImplementedError
        return self.kernel_driver

    def detach_kernel_driver(self, dev_handle, intf):
        self._called("detach_kernel_driver")
        self.kernel_driver = False

    def ctrl_transfer(self, dev_handle, bmRequestType, bRequest, wValue, wIndex, data, timeout):  # noqa: N803
        if bmRequestType == 0x80:  # a string: languages first
            text = b"\x09\x04" if wValue & 0xFF == 0 else dev_handle.serial.encode("utf-16-le")
            answer = bytes([len(text) + 2, 3]) + text
            data[: len(answer)] = type(data)("B", answer)
            return len(answer)
        self._called("ctrl_transfer", bmRequestType, bRequest, wValue, wIndex)
        return 0

    def bulk_write(self, dev_handle, ep, intf, data, timeout):
        self._called("bulk_write", ep, bytes(data), timeout)
        return min(len(data), self.most_written)

    def bulk_read(self, dev_handle, ep, intf, buff, timeout):
        self._called("bulk_read", ep, len(buff), timeout)
        if not self.incoming:
            raise usb.core.USBTimeoutError("timed out", constants.ERROR_TIMEOUT, 110)
        data = self.incoming.pop(0)[: len(buff)]
        buff[: len(data)] = type(buff)("B", data)
        return len(data)


DWORD, POINTER = ctypes.c_uint32, ctypes.c_void_p


class D2xx:
    """FTDI's library with ``devices``, each (serial, description): C functions around a queue of bytes."""

    def __init__(self, *devices):
        self.devices = devices
        self.calls = []
        self.waiting = bytearray()  # has come already
        self.coming = bytearray()  # comes when one waits
        self.written = bytearray()
        self.most_written = 1 << 20
        self.status = 0
        move = ctypes.CFUNCTYPE(DWORD, POINTER, POINTER, DWORD, ctypes.POINTER(DWORD))
        self.FT_Read, self.FT_Write = move(self._read), move(self._write)
        self.FT_GetQueueStatus = ctypes.CFUNCTYPE(DWORD, POINTER, ctypes.POINTER(DWORD))(self._queue)
        self.FT_CreateDeviceInfoList = ctypes.CFUNCTYPE(DWORD, ctypes.POINTER(DWORD))(self._list)
        self.FT_Open = ctypes.CFUNCTYPE(DWORD, DWORD, ctypes.POINTER(POINTER))(self._open)
        self.FT_SetTimeouts = ctypes.CFUNCTYPE(DWORD, POINTER, DWORD, DWORD)(self._set_timeouts)

    def __getattr__(self, name):
        if not name.startswith("FT_"):
            raise AttributeError(name)

        def function(handle, *arguments):
            self.calls.append((name, *arguments))
            return self.status

        return function

    def _list(self, count):
        count[0] = len(self.devices)
        return self.status

    def FT_GetDeviceInfoDetail(self, index, flags, kind, ids, place, serial, description, handle):  # noqa: N802 - the library's name
        serial.value, description.value = (text.encode() for text in self.devices[index])
        return self.status

    def _open(self, index, handle):
        self.calls.append(("FT_Open", index))
        handle[0] = 0x1234
        return self.status

    def _read(self, handle, data, length, count):
        assert handle == 0x1234
        if not self.waiting:
            self.waiting, self.coming = self.coming, bytearray()
        chunk = bytes(self.waiting[:length])
        del self.waiting[:length]
        ctypes.memmove(data, chunk, len(chunk))
        count[0] = len(chunk)
        return self.status

    def _write(self, handle, data, length, count):
        length = min(length, self.most_written)
        self.written += ctypes.string_at(data, length)
        count[0] = length
        return self.status

    def _queue(self, handle, count):
        count[0] = len(self.waiting)
        return self.status

    def _set_timeouts(self, handle, read_ms, write_ms):
        self.calls.append(("FT_SetTimeouts", read_ms, write_ms))
        return self.status


compiled = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="a C function is compiled")


class Python:
    """The transport's own transfers."""

    def __init__(self, transport):
        self._transport = transport

    def write(self, data, timeout_s=0.01):
        self._transport.write(data, timeout_s)

    def read(self, timeout_s=0.01):
        return self._transport.read(64, timeout_s)


class Compiled:
    """The transfers that compiled code makes, made to fail as the transport's own do."""

    def __init__(self, transport):
        self.calls = transport.calls()
        self._count = np.zeros(1, np.int32)
        kinds = (ctypes.c_ssize_t, ctypes.c_uint8, ctypes.c_ssize_t, ctypes.c_int32, ctypes.c_ssize_t, ctypes.c_uint32)
        self._transfer = ctypes.CFUNCTYPE(ctypes.c_int32, *kinds)(self.calls.transfer)

    def transfer(self, endpoint, data, timeout_s):
        address, count = data.ctypes.data, self._count.ctypes.data
        return self._transfer(self.calls.handle, endpoint, address, data.size, count, round(timeout_s * 1000))

    def write(self, data, timeout_s=0.01):
        code = self.transfer(constants.ENDPOINT_OUT, np.frombuffer(bytearray(data), np.uint8), timeout_s)
        if code != 0:
            raise usb_failure(code, "sending")
        assert self._count[0] == len(data)

    def read(self, timeout_s=0.01, size=64):
        buffer = np.full(size + 8, 0xEE, np.uint8)
        code = self.transfer(constants.ENDPOINT_IN, buffer[:size], timeout_s)
        assert (buffer[size:] == 0xEE).all()
        if code not in {constants.SUCCESS, constants.ERROR_TIMEOUT}:
            raise usb_failure(code, "receiving")
        return bytes(buffer[: self._count[0]])


both = pytest.mark.parametrize("kind", [Python, pytest.param(Compiled, marks=compiled)])
