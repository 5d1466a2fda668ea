"""The C functions the servo calls: signatures, and how compiled code turns an address into records.

A device and a clock are each a few C functions and the address of their own memory (``context``), handed to the
compiled loop as arguments, so that one specialisation serves all of them. Simulated ones are ``numba.cfunc`` of the
same signatures; a driver in C passes its function pointers.

==========  ======================================================================================================
``READ``    ``int32 (intp context, int64 now_ns, intp reading)``: fill one ``layout.READING`` record; return
            ``READ_NEW``, ``READ_NOTHING_NEW`` or ``READ_LOST``
``WRITE``   ``int32 (intp context, float64 fx, float64 fy, float64 fz)``: force on the hand [N], hand frame;
            return 0, or ``READ_LOST``
``NOW``     ``int64 (intp context)``: monotonic time [ns]
``SLEEP``   ``int64 (intp context, int64 deadline_ns)``: return not before the deadline; gives the time then [ns]
==========  ======================================================================================================
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import from_dtype, types
from numba.extending import intrinsic

READ = types.int32(types.intp, types.int64, types.intp)
WRITE = types.int32(types.intp, types.float64, types.float64, types.float64)
NOW = types.int64(types.intp)
SLEEP = types.int64(types.intp, types.int64)

READ_NEW = 0
READ_NOTHING_NEW = 1
READ_LOST = -1


def pointer_to(dtype: np.dtype[Any]) -> Any:
    """Return an intrinsic that turns an address (intp) into a pointer to records of ``dtype``, for ``carray``."""
    pointer = types.CPointer(from_dtype(dtype))

    @intrinsic  # type: ignore[untyped-decorator]
    def cast(_typing_context: Any, _address: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            return builder.inttoptr(arguments[0], context.get_value_type(pointer))

        return pointer(types.intp), generate

    return cast
