"""The C functions that the servo calls: their signatures, their compilation, and access to records by address.

A device and a clock each consist of a few C functions and the address of their memory (``context``). The compiled loop
gets addresses as integers, so that one specialisation serves all of them. Simulated ones are ``numba.cfunc``; a driver
in C offers its functions as objects with an ``address``.

==========  ======================================================================================================
``READ``    ``int32 (intp context, int64 now_ns, intp reading)``: fill the ``layout.READING`` record at the address
            ``reading``, no further than its ``size_bytes``; return ``READ_NEW``, ``READ_NOTHING_NEW`` or ``READ_LOST``
``WRITE``   ``int32 (intp context, intp command)``: send the force of the ``layout.COMMAND`` record at the address
            ``command``; where another force is sent, say so in it; return 0, ``WRITE_SATURATED`` if the motors may
            have given less, or ``READ_LOST``
``NOW``     ``int64 (intp context)``: monotonic time [ns]
``SLEEP``   ``int64 (intp context, int64 deadline_ns)``: return not before the deadline; gives the time then [ns]
==========  ======================================================================================================
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, Protocol

import numba
import numpy as np
from llvmlite import ir
from numba import from_dtype, types
from numba.core import cgutils
from numba.extending import intrinsic

from study_app.haptics.kernels.compiled import CACHE  # chosen before the first function is compiled
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.layout import COMMAND, READING

READ = types.int32(types.intp, types.int64, types.intp)
WRITE = types.int32(types.intp, types.intp)
NOW = types.int64(types.intp)
SLEEP = types.int64(types.intp, types.int64)

READ_NEW = 0
READ_NOTHING_NEW = 1
READ_LOST = -1
WRITE_SATURATED = 1


class Driver(Protocol):
    """The part of a device that the servo uses (``devices.base.Device`` is the full interface).

    ``name`` is the word that ``open_device`` takes, ``read`` and ``write`` are C functions (objects with an
    ``address``), ``context`` is the address of the device's memory, passed to both, ``force_limit_n`` the greatest
    force that may be commanded [N], and ``dynamics`` the mass, friction and delay measured when the device was opened.
    """

    name: str
    read: Any
    write: Any
    context: int
    force_limit_n: float

    @property
    def dynamics(self) -> Dynamics:
        """The dynamics that the device measured when it was opened."""

    @property
    def failure(self) -> str | None:
        """Symptom, cause and remedy of a failure of the device, in a sentence; None: the device reports none."""
        return None


_alloca_once: Any = cgutils.alloca_once
_unpack_tuple: Any = cgutils.unpack_tuple
_raw_memcpy: Any = cgutils.raw_memcpy
_StarArgTuple: Any = types.StarArgTuple


def c_function(signature: Any, function: Callable[..., Any]) -> Any:
    """Compile ``function`` as a C function of ``signature``, kept on disk like every kernel."""
    return numba.cfunc(signature, cache=CACHE is not None, error_model="numpy")(function)


def external(symbol: str, signature: Any) -> Any:
    """Return the system's C function ``symbol`` for compiled code to call."""
    return types.ExternalFunction(symbol, signature)


def call_at(signature: Any) -> Any:
    """Return a function for compiled code: (address, *arguments) -> the result of the C function at the address."""

    def call(_typing_context: Any, _address: Any, *_arguments: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
            returned = context.get_value_type(signature.return_type)
            taken = [context.get_value_type(argument) for argument in signature.args]
            function = builder.inttoptr(values[0], ir.FunctionType(returned, taken).as_pointer())
            return builder.call(function, _unpack_tuple(builder, values[1]))

        return signature.return_type(types.intp, _StarArgTuple.from_types(signature.args)), generate

    return intrinsic(call)


def record_at(dtype: np.dtype[Any]) -> Any:
    """Return a function for compiled code: an address (intp) -> the record of ``dtype`` at it."""
    record: Any = from_dtype(dtype)

    def cast(_typing_context: Any, _address: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            return builder.inttoptr(arguments[0], context.get_value_type(record))

        return record(types.intp), generate

    return intrinsic(cast)


def stack_memory(word_count: int) -> Any:
    """Return a function for compiled code: -> the address (intp) of ``word_count`` 8-byte words on its own stack."""
    block = ir.ArrayType(ir.IntType(64), word_count)

    def allocate(_typing_context: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
            return builder.ptrtoint(_alloca_once(builder, block), context.get_value_type(types.intp))

        return types.intp(), generate

    return intrinsic(allocate)


def _fence(order: str) -> Any:
    def order_memory(_typing_context: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
            builder.fence(order)
            return context.get_dummy_value()

        return types.none(), generate

    return intrinsic(order_memory)


fence = _fence("acq_rel")
"""Release and acquire fence for compiled code: other threads see earlier writes before later ones."""
full_fence = _fence("seq_cst")
"""Full fence for compiled code: other threads see earlier writes before any later read is made."""


def _copy_record(_typing_context: Any, to: Any, source: Any) -> Any:
    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        size = context.get_constant(types.intp, to.size)
        _raw_memcpy(builder, arguments[0], arguments[1], size, 1)
        return context.get_dummy_value()

    return types.none(to, source), generate


copy_record: Any = intrinsic(_copy_record)
"""Copy a record onto another of its type (to, source): an assignment copies number by number, 5 s longer to compile."""
reading_at, command_at = record_at(READING), record_at(COMMAND)


@cache
def device_functions(read: Callable[..., int], write: Callable[..., int]) -> tuple[Any, Any]:
    """Compile the functions of a device (``READ``, ``WRITE``), once for all devices of a kind."""
    return c_function(READ, read), c_function(WRITE, write)
