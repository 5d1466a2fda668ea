"""The device for the servo: how it is opened and closed, what can go wrong with it, and what its receipt records."""

import ctypes
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from liquid_study_example.failures import FAILURES
from study_app.devices.driver import COMMON, FIRST_CAUSE, FramedDevice
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.layout import records

LOST = FIRST_CAUSE  # LIQUID_STUDY_LOST of liquid_study_device.h
EXCHANGE = np.dtype(COMMON, align=True)
DELAY_S = {"direct": 0.0, "mailbox": 1e-3}
"""How much later than in the tick in which it is written a force acts."""
MASS_KG = 0.2
COUNT_M = 1e-6
VELOCITY_LAG_S = None
"""Mean lag of the velocity that READ gives [s], where it shall replace the estimator (docs/velocity.md); None: the
velocity is recorded only."""


class CFunction(NamedTuple):
    """A C function, as the servo takes it."""

    address: int


@cache
def library():
    """Load the C part."""
    (path,) = Path(__file__).parent.glob("_device*")
    loaded = ctypes.CDLL(str(path))
    for way in ("direct", "mailbox"):
        getattr(loaded, f"{way}_open").argtypes = [ctypes.c_ssize_t]
    return loaded


class Opened(NamedTuple):
    """The open device."""

    close: object


class ExampleDevice(FramedDevice):
    """The device, called directly or through a mailbox: ``way``; ``limits`` are those of `FramedDevice`."""

    failures, running, causes = FAILURES, "lost", {LOST: "lost"}

    def __init__(self, way, *, workspace_m=(0.05, 0.05, 0.05), force_limit_n=8.0):
        self.name, self._way = f"example-{way}", way
        functions = tuple(CFunction(self._address(name)) for name in ("read", "write"))
        super().__init__(records(EXCHANGE, 1), workspace_m, force_limit_n, functions)
        self._dynamics = Dynamics(delay_s=DELAY_S[way], count_m=COUNT_M, mass_kg=MASS_KG, velocity_lag_s=VELOCITY_LAG_S)

    def _function(self, name):
        return getattr(library(), f"{self._way}_{name}")

    def _address(self, name):
        return ctypes.cast(self._function(name), ctypes.c_void_p).value

    def _connect(self):
        if self._function("open")(self.context) != 0:
            raise FAILURES.failure("not-found")
        return Opened(self._function("close"))

    def _prepare(self, connection):
        self.memory[:] = records(EXCHANGE, 1)
        self.exchange.force_limit_n = self.force_limit_n
        return {}

    def _finish(self, connection):
        return "stand_down"  # closing the library ends the force


class DirectDevice(ExampleDevice):
    """The device whose library is called."""

    @classmethod
    def of(cls, request):
        """Return the device of a request, closed."""
        return cls("direct", **request.limits)


class MailboxDevice(ExampleDevice):
    """The device whose library owns the 1 kHz thread."""

    @classmethod
    def of(cls, request):
        """Return the device of a request, closed."""
        return cls("mailbox", **request.limits)
