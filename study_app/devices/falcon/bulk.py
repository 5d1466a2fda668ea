"""The only C function that the compiled exchange needs: ``libusb_bulk_transfer``, or one with the same signature.

``int32 (intp handle, uint8 endpoint, intp data, int32 length, intp transferred, uint32 timeout_ms)``: send ``length``
bytes at address ``data``, or receive at most as many; write the number of bytes into the int32 at ``transferred``;
return 0 or a negative libusb error.
`transfer` returns such a function for FTDI's library (``FT_Read`` and ``FT_Write``).
"""

import ctypes
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import types

from study_app.devices.falcon import constants
from study_app.haptics.kernels import c_function, call_at, kernel, record_at
from study_app.haptics.model.layout import records

BULK = types.int32(types.intp, types.uint8, types.intp, types.int32, types.intp, types.uint32)


class BulkCalls(NamedTuple):
    """An open bridge as compiled code sees it: the handle to pass, and the address of the function."""

    handle: int
    transfer: int


_BRIDGE = np.dtype(
    [
        ("handle", np.intp),  # FT_HANDLE
        ("read", np.intp),  # addresses of the library's functions
        ("write", np.intp),
        ("waiting", np.intp),
        ("set_timeouts", np.intp),
        ("timeout_ms", np.int64),  # time-out last set; 0: none
        ("count", np.uint32),  # number of bytes transferred, written by the library
    ],
    align=True,
)
_COUNT_AT = int(_BRIDGE.fields["count"][1])  # type: ignore[index]
_DATA_BYTES = constants.USB_PACKET - constants.STATUS_BYTES
_MAX_GONE_STATUS = 4  # FT_STATUS 1 to 4: invalid handle, device not found, device not opened, input/output error

_bridge_at = record_at(_BRIDGE)
_count_at = record_at(np.dtype([("count", np.int32)]))
_status_at = record_at(np.dtype([("bytes", np.uint8, (constants.STATUS_BYTES,))]))
_call_transfer = call_at(types.uint32(types.intp, types.intp, types.uint32, types.intp))
_call_queue_status = call_at(types.uint32(types.intp, types.intp))
_call_set_timeouts = call_at(types.uint32(types.intp, types.uint32, types.uint32))


def bridge_record(library: Any, handle: Any) -> Any:
    """Return the memory that the C function of an open bridge uses; its address is the function's handle."""
    memory = records(_BRIDGE, 1)
    bridge = memory[0]
    bridge.handle = handle.value
    bridge.read = _function_address(library.FT_Read)
    bridge.write = _function_address(library.FT_Write)
    bridge.waiting = _function_address(library.FT_GetQueueStatus)
    bridge.set_timeouts = _function_address(library.FT_SetTimeouts)
    return memory


def _function_address(function: Any) -> int:
    return ctypes.cast(function, ctypes.c_void_p).value or 0


@cache
def transfer() -> Any:
    """Return the C function, with the signature `BULK`; a read returns one packet of at most 64 bytes."""
    return c_function(BULK, _transfer)


def _transfer(handle: int, endpoint: int, data: int, length: int, transferred: int, timeout_ms: int) -> Any:
    bridge = _bridge_at(handle)
    _count_at(transferred).count = 0
    if bridge.timeout_ms != timeout_ms:
        status = _call_set_timeouts(bridge.set_timeouts, bridge.handle, timeout_ms, timeout_ms)
        if status != 0:
            return _error_code(status)
        bridge.timeout_ms = timeout_ms
    if endpoint == constants.ENDPOINT_OUT:
        status = _call_transfer(bridge.write, bridge.handle, data, length, transferred)
        if status == 0 and _count_at(transferred).count < length:
            return constants.ERROR_TIMEOUT
        return _error_code(status)
    return _receive(handle, data, length, transferred)


@kernel
def _receive(handle: int, data: int, length: int, transferred: int) -> Any:
    """Receive the available bytes, or wait for a first byte; put status bytes in front of them."""
    bridge = _bridge_at(handle)
    max_bytes = min(length - constants.STATUS_BYTES, _DATA_BYTES)
    received: Any = 0
    for _ in range(2):
        status = _call_queue_status(bridge.waiting, bridge.handle, handle + _COUNT_AT)
        if status != 0:
            return _error_code(status)
        min_bytes = 1 if received == 0 else 0
        wanted: Any = min(max(np.int64(bridge.count), min_bytes), max_bytes - received)
        if wanted > 0:
            address = data + constants.STATUS_BYTES + received
            status = _call_transfer(bridge.read, bridge.handle, address, wanted, handle + _COUNT_AT)
            if status != 0:
                return _error_code(status)
            received += np.int64(bridge.count)
        if received != 1:
            break  # after waiting for a single byte, more may have arrived with it
    if received == 0:
        return constants.ERROR_TIMEOUT
    for i in range(constants.STATUS_BYTES):
        _status_at(data).bytes[i] = 0
    _count_at(transferred).count = constants.STATUS_BYTES + received
    return constants.SUCCESS


@kernel
def _error_code(status: int) -> Any:
    if status == 0:
        return constants.SUCCESS
    return constants.ERROR_NO_DEVICE if status <= _MAX_GONE_STATUS else constants.ERROR_IO
