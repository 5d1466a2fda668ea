"""The C function that puts a socket (``bridge``) where libusb would be: POSIX ``send`` and ``recv``."""

import sys
from functools import cache
from typing import Any

import numpy as np
from numba import types

from study_app.devices.falcon import constants
from study_app.devices.falcon.bulk import BULK
from study_app.haptics.kernels.c_functions import c_function, external, record_at
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.model.layout import records
from tests.devices.falcon.served.bridge import ANSWER, BULK_IN, BULK_OUT, REQUEST

_REQUEST = np.dtype(
    [("kind", "u1"), ("endpoint", "u1"), ("value", "<u2"), ("length", "<u2"), ("timeout_ms", "<u2")]
)  # framing.REQUEST
_ANSWER = np.dtype([("code", "<i4"), ("length", "<u4")])  # framing.ANSWER
CONNECTION = np.dtype(
    [
        ("file", np.int64),  # descriptor of the socket
        ("broken", np.int64),  # 1 once an answer did not come whole: then nothing more can be believed
        ("request", _REQUEST),
        ("answer", _ANSWER),
        ("spilt", np.uint8, (constants.USB_PACKET,)),  # what of an answer found no room
    ],
    align=True,
)
_LONGEST = 0xFFFF

_connection_at = record_at(CONNECTION)
_count_at = record_at(np.dtype([("count", np.int32)]))
_errno_at = record_at(np.dtype([("errno", np.int32)]))
_EINTR = 4
_offsets = {name: int(CONNECTION.fields[name][1]) for name in CONNECTION.names}  # type: ignore[index,union-attr]
_REQUEST_AT, _ANSWER_AT, _SPILT_AT = _offsets["request"], _offsets["answer"], _offsets["spilt"]
_REQUEST_SIZE, _ANSWER_SIZE = REQUEST.size, ANSWER.size

_send = external("send", types.intp(types.int32, types.intp, types.uintp, types.int32))
_recv = external("recv", types.intp(types.int32, types.intp, types.uintp, types.int32))
_errno = external("__error" if sys.platform == "darwin" else "__errno_location", types.intp())


def connection_record(file: int) -> Any:
    """Return the memory of an open socket's C function, whose address is its handle."""
    memory = records(CONNECTION, 1)
    memory[0].file = file
    return memory


@cache
def transfer() -> Any:
    """Return the C function, of ``bulk.BULK``'s signature."""
    return c_function(BULK, _transfer)


def _transfer(handle: int, endpoint: int, data: int, length: int, transferred: int, timeout_ms: int) -> Any:
    connection = _connection_at(handle)
    _count_at(transferred).count = 0
    if connection.broken:
        return constants.ERROR_NO_DEVICE
    out = endpoint == constants.ENDPOINT_OUT
    connection.request.kind = BULK_OUT if out else BULK_IN
    connection.request.endpoint = endpoint
    connection.request.length = min(length, _LONGEST)
    connection.request.timeout_ms = min(timeout_ms, _LONGEST)
    connection.broken = 1  # unless all goes well
    if not _all(connection.file, handle + _REQUEST_AT, _REQUEST_SIZE, True):
        return constants.ERROR_NO_DEVICE
    if out and not _all(connection.file, data, length, True):
        return constants.ERROR_NO_DEVICE
    if not _all(connection.file, handle + _ANSWER_AT, _ANSWER_SIZE, False):
        return constants.ERROR_NO_DEVICE
    came: Any = np.int64(connection.answer.length)
    kept: Any = 0 if out else min(came, length)
    if not _all(connection.file, data, kept, False) or not _spill(handle, connection.file, came - kept):
        return constants.ERROR_NO_DEVICE
    connection.broken = 0
    code = connection.answer.code
    if code == constants.SUCCESS and not out and came > length:
        code = constants.ERROR_OVERFLOW
    sent = length if code == constants.SUCCESS else 0
    _count_at(transferred).count = sent if out else kept
    return code


@kernel
def _all(file: int, address: int, size: Any, out: bool) -> bool:
    """Send, or receive, all ``size`` bytes at ``address``, whatever signals arrive meanwhile; whether they went."""
    done = 0
    while done < size:
        moved = _send(file, address + done, size - done, 0) if out else _recv(file, address + done, size - done, 0)
        if moved > 0:
            done += moved
        elif moved == 0 or _errno_at(_errno()).errno != _EINTR:
            return False
    return True


@kernel
def _spill(handle: int, file: int, size: Any) -> bool:
    """Receive ``size`` bytes and discard them."""
    left = size
    while left > 0:
        some = min(left, constants.USB_PACKET)
        if not _all(file, handle + _SPILT_AT, some, False):
            return False
        left -= some
    return True
