"""The one C function that the compiled exchange needs: ``libusb_bulk_transfer``, or anything of its signature.

``int32 (intp handle, uint8 endpoint, intp data, int32 length, intp transferred, uint32 timeout_ms)``: move ``length``
bytes at address ``data`` out, or at most as many in; write how many were moved into the int32 at ``transferred``;
return 0 or a negative libusb error.
"""

from typing import NamedTuple

from numba import types

BULK = types.int32(types.intp, types.uint8, types.intp, types.int32, types.intp, types.uint32)


class BulkCalls(NamedTuple):
    """An open bridge as compiled code sees it: the handle to pass, and the address of the function."""

    handle: int
    transfer: int
