"""What a tick has to do while it is timed: a scene with every effect on, and a hand that costs nothing itself."""

from functools import cache
from typing import Any, Final

import numpy as np

from study_app.evidence.cost import hand
from study_app.haptics.kernels.c_functions import READ, READ_NEW, WRITE, c_function, record_at
from study_app.haptics.model.device_dynamics import UNKNOWN
from study_app.haptics.model.effects.current import Vortex
from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.layout import READING, records
from study_app.haptics.model.scene import Cylinder, Liquid, Scene

FULL: Final = Scene(
    liquids=(
        Liquid(
            id="everything",
            density_kg_m3=1400,
            viscosity_pa_s=2.0,
            region=Cylinder(centre_m=(0.0, -0.45, 0.0), radius_m=1.0, height_m=1.0),
            effects=("drag", "wake", "current", "buoyancy", "surface", "added_mass", "history"),
            drag=Drag(law="brown-lawler"),
            wake=Wake(length=1700, scaling=1700, exponent=0.75),
            current=Vortex(core_m=0.2, peak_mps=0.5),
        ),
    )
)
"""Every effect that can act at once, on a hand that comes out of the liquid's surface and goes back."""

_PLACE = np.dtype([("position_m", np.float64, (3,))], align=True)
_PLAYED = np.dtype(
    [
        ("places", np.intp),  # address of the first
        ("count", np.int64),
        ("next", np.int64),
    ],
    align=True,
)
_place_at = record_at(_PLACE)
_played_at = record_at(_PLAYED)
_reading_at = record_at(READING)


class PlayedHand:
    """A device that gives one place of a motion at every reading and takes any force: what is timed is the tick."""

    name = "played"
    force_limit_n = 8.0
    dynamics = UNKNOWN
    failure = None

    def __init__(self) -> None:
        self._places_m = np.ascontiguousarray(hand(), np.float64)
        self._memory = records(_PLAYED, 1)
        self._memory[0].places = self._places_m.ctypes.data
        self._memory[0].count = len(self._places_m)
        self.context = int(self._memory.ctypes.data)
        self.read, self.write = _functions()


@cache
def _functions() -> tuple[Any, Any]:
    return c_function(READ, _read), c_function(WRITE, _write)


def _read(context: int, _now_ns: int, reading: int) -> int:
    played = _played_at(context)
    place = _place_at(played.places + 24 * played.next)
    played.next = played.next + 1 if played.next + 1 < played.count else 0
    out = _reading_at(reading)
    for axis in range(3):
        out.position_m[axis] = place.position_m[axis]
    out.buttons = 0
    return READ_NEW


def _write(_context: int, _command: int) -> int:
    return 0
