"""Emulated Falcons as a backend of pyusb, with its ``find``, ``write``, ``read`` and ``ctrl_transfer``.

The USB descriptors are those of an FT232R with the Falcon's ids: one configuration, one interface of the vendor's
class, two bulk endpoints. Rejected calls raise what pyusb's libusb backend would raise.

The driver that uses this backend is the real one, including pyusb and the C function; only the USB bus is replaced.
Once the device is open, the emulator's time is that of the servo's ticks, so that it runs as fast as a rehearsal.
"""

import errno
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random
from types import SimpleNamespace
from typing import Any, Final, Self

import usb.backend  # type: ignore[import-untyped]
import usb.core  # type: ignore[import-untyped]

from study_app.devices.descriptor import OpenRequest
from study_app.devices.emulators.falcon_emulator import Emulator
from study_app.devices.falcon import constants
from study_app.devices.falcon.bulk import BulkCalls
from study_app.devices.falcon.device import FalconDevice
from study_app.devices.falcon.transport import PyUsbTransport, Transport

_STRINGS: Final = {1: "Novint", 2: constants.PRODUCT}
_SERIAL_STRING: Final = 3
_GET_DESCRIPTOR, _STRING_DESCRIPTOR, _ENGLISH = 6, 3, 0x0409
_DEVICE_TO_HOST: Final = 0x80

_ERRORS: Final = {
    constants.ERROR_IO: (errno.EIO, "Input/Output Error"),
    constants.ERROR_ACCESS: (errno.EACCES, "Access denied (insufficient permissions)"),
    constants.ERROR_NO_DEVICE: (errno.ENODEV, "No such device (it may have been disconnected)"),
    constants.ERROR_NOT_FOUND: (errno.ENOENT, "Entity not found"),
    constants.ERROR_BUSY: (errno.EBUSY, "Resource busy"),
    constants.ERROR_TIMEOUT: (errno.ETIMEDOUT, "Operation timed out"),
    constants.ERROR_OVERFLOW: (errno.EOVERFLOW, "Overflow"),
    constants.ERROR_PIPE: (errno.EPIPE, "Pipe error"),
}

_CONFIGURATION_VALUE: Final = 1
_DEVICE: Final = {
    "bLength": 18,
    "bDescriptorType": 1,
    "bcdUSB": 0x0200,
    "bDeviceClass": 0,
    "bDeviceSubClass": 0,
    "bDeviceProtocol": 0,
    "bMaxPacketSize0": 8,
    "idVendor": constants.VENDOR_ID,
    "idProduct": constants.PRODUCT_ID,
    "bcdDevice": 0x0600,
    "iManufacturer": 1,
    "iProduct": 2,
    "iSerialNumber": _SERIAL_STRING,
    "bNumConfigurations": 1,
    "port_number": 1,
    "port_numbers": (1,),
    "speed": 2,
}
_CONFIGURATION: Final = {
    "bLength": 9,
    "bDescriptorType": 2,
    "wTotalLength": 32,
    "bNumInterfaces": 1,
    "bConfigurationValue": _CONFIGURATION_VALUE,
    "iConfiguration": 0,
    "bmAttributes": 0xA0,
    "bMaxPower": 45,
    "extra_descriptors": [],
}
_INTERFACE: Final = {
    "bLength": 9,
    "bDescriptorType": 4,
    "bInterfaceNumber": 0,
    "bAlternateSetting": 0,
    "bNumEndpoints": 2,
    "bInterfaceClass": 0xFF,
    "bInterfaceSubClass": 0xFF,
    "bInterfaceProtocol": 0xFF,
    "iInterface": 2,
    "extra_descriptors": [],
}
_ENDPOINTS: Final = (constants.ENDPOINT_IN, constants.ENDPOINT_OUT)


@dataclass(slots=True, eq=False)
class _Handle:
    emulator: Emulator
    open: bool = True


def _raise_for_code(code: int) -> None:
    if code >= 0:
        return
    if code == constants.ERROR_NOT_SUPPORTED:
        raise NotImplementedError("Operation not supported or unimplemented on this platform")
    number, message = _ERRORS[code]
    error_class = usb.core.USBTimeoutError if code == constants.ERROR_TIMEOUT else usb.core.USBError
    raise error_class(message, code, number)


class EmulatedBackend(usb.backend.IBackend):  # type: ignore[misc]
    """A USB bus with the given Falcons; its time is that of the first one."""

    def __init__(self, *emulators: Emulator) -> None:
        self.emulators = emulators
        self._claims: dict[int, _Handle] = {}

    # What this program's transport needs besides the interface of pyusb.

    def c_calls(self, handle: _Handle) -> BulkCalls:
        return handle.emulator.calls()

    def now_s(self) -> float:
        return self.emulators[0].now_ns * 1e-9

    def pause(self, seconds: float) -> None:
        for emulator in self.emulators:
            emulator.pause(seconds)

    def follow_clock(self, address: int) -> None:
        """Use the int64 [ns] at this address as the time of all Falcons; 0: their own time."""
        for emulator in self.emulators:
            emulator.follow_clock(address)

    # The interface of pyusb.

    def enumerate_devices(self) -> Iterator[Emulator]:
        return (emulator for emulator in self.emulators if not emulator.faults.is_on("unplugged"))

    def get_device_descriptor(self, dev: Emulator) -> Any:
        return SimpleNamespace(**_DEVICE, bus=1, address=1 + self.emulators.index(dev))

    def get_configuration_descriptor(self, dev: Emulator, config: int) -> Any:
        if config != 0:
            raise IndexError(f"a Falcon has only configuration 0, not {config}")
        return SimpleNamespace(**_CONFIGURATION)

    def get_interface_descriptor(self, dev: Emulator, intf: int, alt: int, config: int) -> Any:
        if (intf, alt) != (0, 0):
            raise IndexError(f"a Falcon has only interface 0, setting 0, not interface {intf}, setting {alt}")
        return SimpleNamespace(**_INTERFACE)

    def get_endpoint_descriptor(self, dev: Emulator, ep: int, intf: int, alt: int, config: int) -> Any:
        return SimpleNamespace(
            bLength=7,
            bDescriptorType=5,
            bEndpointAddress=_ENDPOINTS[ep],
            bmAttributes=2,
            wMaxPacketSize=constants.USB_PACKET,
            bInterval=0,
            bRefresh=0,
            bSynchAddress=0,
            extra_descriptors=[],
        )

    def get_parent(self, dev: Emulator) -> None:
        """Return None: the device is connected without a hub."""

    def open_device(self, dev: Emulator) -> _Handle:
        if dev.faults.is_on("unplugged"):
            _raise_for_code(constants.ERROR_NO_DEVICE)
        if dev.faults.is_on("access_denied"):
            _raise_for_code(constants.ERROR_ACCESS)
        if dev.faults.is_on("not_supported"):
            _raise_for_code(constants.ERROR_NOT_SUPPORTED)
        return _Handle(dev)

    def close_device(self, dev_handle: _Handle) -> None:
        """Close the handle and release its claims; nothing else changes."""
        dev_handle.open = False
        if self._claims.get(id(dev_handle.emulator)) is dev_handle:
            del self._claims[id(dev_handle.emulator)]

    def set_configuration(self, dev_handle: _Handle, config_value: int) -> None:
        self._connected_emulator(dev_handle)

    def get_configuration(self, dev_handle: _Handle) -> int:
        self._connected_emulator(dev_handle)
        return _CONFIGURATION_VALUE

    def claim_interface(self, dev_handle: _Handle, intf: int) -> None:
        emulator = self._connected_emulator(dev_handle)
        if intf != 0:
            _raise_for_code(constants.ERROR_NOT_FOUND)
        owner = self._claims.get(id(emulator))
        if emulator.faults.is_on("busy") or emulator.faults.is_on("kernel_driver") or owner not in {None, dev_handle}:
            _raise_for_code(constants.ERROR_BUSY)
        self._claims[id(emulator)] = dev_handle
        emulator.note_claim()

    def release_interface(self, dev_handle: _Handle, intf: int) -> None:
        emulator = self._connected_emulator(dev_handle)
        if self._claims.get(id(emulator)) is not dev_handle:
            _raise_for_code(constants.ERROR_NOT_FOUND)
        del self._claims[id(emulator)]

    def is_kernel_driver_active(self, dev_handle: _Handle, intf: int) -> bool:
        return self._connected_emulator(dev_handle).faults.is_on("kernel_driver")

    def detach_kernel_driver(self, dev_handle: _Handle, intf: int) -> None:
        faults = self._connected_emulator(dev_handle).faults
        if faults.is_on("kernel_driver_stays"):
            _raise_for_code(constants.ERROR_ACCESS)
        faults.off("kernel_driver")

    def bulk_write(self, dev_handle: _Handle, ep: int, intf: int, data: Any, timeout: int) -> int:
        code, moved = self._claimed_emulator(dev_handle).write(bytes(data), timeout)
        if (
            moved == 0 or code != constants.ERROR_TIMEOUT
        ):  # the bytes transferred before the time-out are reported, as by libusb
            _raise_for_code(code)
        return moved

    def bulk_read(self, dev_handle: _Handle, ep: int, intf: int, buff: Any, timeout: int) -> int:
        code, data = self._claimed_emulator(dev_handle).read(len(buff) * buff.itemsize, timeout)
        if not data or code != constants.ERROR_TIMEOUT:
            _raise_for_code(code)
        buff[: len(data)] = type(buff)("B", data)
        return len(data)

    def ctrl_transfer(
        self,
        dev_handle: _Handle,
        bmRequestType: int,  # noqa: N803 - pyusb's names
        bRequest: int,  # noqa: N803
        wValue: int,  # noqa: N803
        wIndex: int,  # noqa: N803
        data: Any,
        timeout: int,
    ) -> int:
        emulator = self._connected_emulator(dev_handle)
        if bmRequestType == constants.REQUEST_TYPE:
            _raise_for_code(emulator.control(bRequest, wValue))
            return len(data)
        if (bmRequestType, bRequest, wValue >> 8) != (_DEVICE_TO_HOST, _GET_DESCRIPTOR, _STRING_DESCRIPTOR):
            _raise_for_code(constants.ERROR_PIPE)
        descriptor = _string_descriptor(wValue & 0xFF, emulator.serial)[: len(data)]
        data[: len(descriptor)] = type(data)("B", descriptor)
        return len(descriptor)

    def reset_device(self, dev_handle: _Handle) -> None:
        """Reset the bridge's port; the device behind it continues."""
        _raise_for_code(self._connected_emulator(dev_handle).control(constants.REQUEST_RESET, constants.RESET_ALL))

    def clear_halt(self, dev_handle: _Handle, ep: int) -> None:
        """Continue after a stall of an endpoint, which never happens."""
        self._connected_emulator(dev_handle)

    def _connected_emulator(self, handle: _Handle) -> Emulator:
        """Return the Falcon of an open handle; raise an error if its cable is unplugged."""
        if not handle.open or handle.emulator.faults.is_on("unplugged"):
            _raise_for_code(constants.ERROR_NO_DEVICE)
        return handle.emulator

    def _claimed_emulator(self, handle: _Handle) -> Emulator:
        emulator = self._connected_emulator(handle)
        if self._claims.get(id(emulator)) is not handle:
            _raise_for_code(constants.ERROR_IO)
        return emulator


def _string_descriptor(index: int, serial: str) -> bytes:
    if index == 0:
        return bytes((4, _STRING_DESCRIPTOR)) + _ENGLISH.to_bytes(2, "little")
    text = (serial if index == _SERIAL_STRING else _STRINGS.get(index, "")).encode("utf-16-le")
    return bytes((2 + len(text), _STRING_DESCRIPTOR)) + text


_FAULTY_PATIENCE_S = 5.0  # some faults keep it from being homed
_STILL_TICKS = 10  # longer than the pause between two strokes of homing


class EmulatedFalcon(FalconDevice):
    """An emulated Falcon; ``hand`` takes the orders of a simulated participant.

    Parameters
    ----------
    random : random numbers for the hand's tremor and the emulator's faults; None: fixed ones
    firmware : file to load; None: its firmware already runs
    emulator : an existing one to use
    given : further arguments of `FalconDevice`
    """

    name = "falcon-emulated"
    ends_force = None  # it ends with the program

    def __init__(
        self,
        random: Random | None = None,
        *,
        firmware: str | Path | None = None,
        emulator: Emulator | None = None,
        **given: Any,
    ) -> None:
        super().__init__(firmware=firmware, **given)
        self.hand = emulator or Emulator(random, running=firmware is None, workspace_m=self.workspace_m)
        self._backend = EmulatedBackend(self.hand)

    @classmethod
    def of(cls, request: OpenRequest) -> Self:
        return cls(request.random, **cls._device_options(request))

    def take_fault(self, fault: str) -> None:
        self.hand.set_fault(fault)
        self._patience_s = _FAULTY_PATIENCE_S

    def open(self) -> None:
        """Open the device and wait until the hand has moved the grip to the middle after homing."""
        super().open()
        still_ticks = 0
        while still_ticks < _STILL_TICKS:
            self._tick()
            still_ticks = 0 if self.hand.moving else still_ticks + 1
        self._restart_fade()
        self._backend.follow_clock(self.context)  # the record there begins with the time of the tick

    def close(self) -> None:
        self._backend.follow_clock(0)
        super().close()

    def _connect(self) -> Transport:
        return PyUsbTransport(self._backend)
