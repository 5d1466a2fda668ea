"""The device for the servo: its C functions, their memory, its limits."""

import ctypes
from functools import cache
from pathlib import Path
from typing import NamedTuple

from study_app.devices.base import Device
from study_app.errors import DeviceNotFound
from study_app.haptics.model.device_dynamics import Dynamics

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
        begin, end = getattr(loaded, f"{way}_open"), getattr(loaded, f"{way}_close")
        begin.argtypes, begin.restype = [ctypes.c_double], ctypes.c_ssize_t
        end.argtypes, end.restype = [ctypes.c_ssize_t], None
    return loaded


class ExampleDevice(Device):
    """The device, called directly or through a mailbox.

    Parameters
    ----------
    way : {"direct", "mailbox"}
        Which C file drives it.
    delay_s : float
        How much later than in the tick in which it is written a force acts [s].
    workspace_m : tuple of float
        Half extents of where it reaches [m].
    force_limit_n : float
        The greatest force it may be asked for [N].
    """

    def __init__(self, way, *, delay_s, workspace_m=(0.05, 0.05, 0.05), force_limit_n=8.0):
        self.name = f"example-{way}"
        self.workspace_m = workspace_m
        self.force_limit_n = force_limit_n
        self.context = 0
        self.read, self.write = CFunction(0), CFunction(0)
        self._way = way
        self._delay_s = delay_s

    @property
    def dynamics(self):
        """What the limits of the force follow from."""
        return Dynamics(self._delay_s, COUNT_M, MASS_KG, VELOCITY_LAG_S)

    def open(self):
        """Make it ready."""
        self.context = self._function("open")(self.force_limit_n)
        if self.context == 0:
            raise DeviceNotFound(f"no device for '{self.name}' is connected: check its cable and its power supply")
        self.read, self.write = (
            CFunction(ctypes.cast(self._function(name), ctypes.c_void_p).value) for name in ("read", "write")
        )

    def close(self):
        """Let go of it; a second call does nothing."""
        if self.context:
            self._function("close")(self.context)
            self.context = 0

    def _function(self, name):
        return getattr(library(), f"{self._way}_{name}")

    def describe(self):
        """Return what a receipt records of it."""
        return {
            "name": self.name,
            "workspace_m": list(self.workspace_m),
            "force_limit_n": self.force_limit_n,
            "dynamics": self.dynamics.describe(),
        }
