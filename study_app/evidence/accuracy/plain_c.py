"""The time of the servo's whole tick relative to the thesis' force in plain C (``thesis_law.c``)."""

import ctypes
import math
import shutil
import statistics
import subprocess
import tempfile
import time
import weakref
from collections.abc import Mapping
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from study_app.errors import StudyError
from study_app.evidence.cost import TickTimer, hand_motion
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.motion import Floats, Motion
from study_app.haptics.model.scene import Everywhere, Ewma, Scene
from study_app.haptics.runtime.offline import simulate

_SOURCE: Final = Path(__file__).with_name("thesis_law.c")
_RATE_HZ: Final = 1000.0
_BATCH: Final = 1_000
_CHECKED_TICKS: Final = 12_000
"""Number of ticks whose forces are compared, in which a wake fills, empties at rest and fills again."""
_SPEED_FACTOR: Final = 3.0
"""Factor for `hand_motion` in that comparison, with which the ball exceeds the threshold of the knee."""


class _Parameters(ctypes.Structure):
    """``Parameters`` of ``thesis_law.c``."""

    _fields_ = (
        ("scale", ctypes.c_double),
        ("origin_m", ctypes.c_double * 3),
        ("period_s", ctypes.c_double),
        ("alpha", ctypes.c_double),
        ("threshold_mps", ctypes.c_double),
        ("drag_kg_m", ctypes.c_double),
        ("scaling", ctypes.c_double),
        ("exponent", ctypes.c_double),
        ("breaking_cosine", ctypes.c_double),
        ("breaking_span_m", ctypes.c_double),
        ("decay", ctypes.c_double),
        ("vertical", ctypes.c_double),
        ("length", ctypes.c_long),
    )


class Comparison(NamedTuple):
    """Median times per tick [ns] over alternating batches, and the greatest difference of the two programs' forces."""

    plain_ns: float
    tick_ns: float
    rest_ns: float  # a tick without liquids
    difference: float  # relative to the greatest force

    @property
    def ratio(self) -> float:
        """The tick's time relative to that of plain C."""
        return self.tick_ns / self.plain_ns


def compare_with_plain_c(scenes: Mapping[str, Scene], *, batches: int) -> dict[str, Comparison]:
    """Return the comparison of each scene, all in one run with alternating batches.

    Raises
    ------
    StudyError
        There is no C compiler, or a scene has something that the C program lacks.
    """
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        library = _compile_library(Path(folder))
        differences = {name: _force_difference(library, scene) for name, scene in scenes.items()}
        timers = {
            name: (_PlainC(library, scene), TickTimer(scene), TickTimer(scene.model_copy(update={"liquids": ()})))
            for name, scene in scenes.items()
        }
        for _ in range(batches):
            for scene_timers in timers.values():
                for timer in scene_timers:
                    timer.run_batch()
        comparisons = {}
        for name, scene_timers in timers.items():
            plain_ns, tick_ns, rest_ns = (statistics.median(timer.costs_ns) for timer in scene_timers)
            comparisons[name] = Comparison(
                plain_ns=plain_ns, tick_ns=tick_ns, rest_ns=rest_ns, difference=differences[name]
            )
        return comparisons


def _compile_library(folder: Path) -> ctypes.CDLL:
    """Compile the C program into ``folder`` and load it."""
    compiler = shutil.which("gcc")
    if compiler is None:
        raise StudyError("there is no C compiler (gcc)")
    library_path = folder / "thesis_law"
    command = (compiler, "-O2", "-shared", "-fPIC", "-o", library_path, _SOURCE, "-lm")
    result = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - a fixed command
    if result.returncode != 0:
        raise StudyError(f"gcc cannot compile {_SOURCE.name}: {result.stderr.strip().splitlines()[-1]}")
    library = ctypes.CDLL(str(library_path))
    rows = np.ctypeslib.ndpointer(np.float64, ndim=2, flags="C_CONTIGUOUS")
    library.create_liquid.restype = ctypes.c_void_p
    library.free_liquid.argtypes = (ctypes.c_void_p,)
    library.run.argtypes = (ctypes.c_void_p, ctypes.c_long, rows, rows)
    return library


class _PlainC:
    """A liquid of the C program, timed like a `TickTimer`."""

    def __init__(self, library: ctypes.CDLL, scene: Scene) -> None:
        self._library, self._liquid = library, library.create_liquid(ctypes.byref(_parameters(scene)))
        weakref.finalize(self, library.free_liquid, self._liquid)
        self._hand_m = hand_motion()
        self._force_n = np.empty_like(self._hand_m)
        self._row = 0
        self.costs_ns: list[float] = []

    def run_batch(self) -> None:
        rows = slice(self._row, self._row + _BATCH)
        began = time.perf_counter_ns()
        self.run(self._hand_m[rows], self._force_n[rows])
        self.costs_ns.append((time.perf_counter_ns() - began) / _BATCH)
        self._row = rows.stop % len(self._hand_m)

    def run(self, hand_m: Floats, force_n: Floats) -> None:
        """Write the forces (n, 3) [N] at positions of the hand (n, 3) [m] that follow the last ones."""
        self._library.run(self._liquid, len(hand_m), hand_m, force_n)


def _force_difference(library: ctypes.CDLL, scene: Scene) -> float:
    """Return the greatest difference of the two programs' forces, relative to the greatest force."""
    hand_m = _SPEED_FACTOR * hand_motion(_CHECKED_TICKS)
    force_n = np.empty_like(hand_m)
    _PlainC(library, scene).run(hand_m, force_n)
    table = simulate(scene, Motion(np.arange(_CHECKED_TICKS) / _RATE_HZ, scene.origin_m + scene.scale * hand_m))
    servo_n = np.column_stack([table.fx_n, table.fy_n, table.fz_n])
    return float(np.abs(force_n - servo_n).max() / np.abs(servo_n).max())


def _parameters(scene: Scene) -> _Parameters:
    """Return the parameters of the C program; raise StudyError if it lacks something that the scene has."""
    scene = resolve(scene)
    liquid, wake, estimator = scene.liquids[0], scene.liquids[0].wake, scene.velocity
    if not isinstance(estimator, Ewma) or scene.knee.law != "sqrt" or not isinstance(liquid.region, Everywhere):
        raise StudyError(
            'the C program supports only velocity "ewma", knee "sqrt" and a single liquid that fills the scene'
        )
    if scene.rate_hz != _RATE_HZ:
        raise StudyError(f"the C program runs at {_RATE_HZ:g} Hz only, not at {scene.rate_hz:g} Hz")
    if liquid.effects not in (("drag",), ("drag", "wake")) or liquid.drag.law != "constant":
        raise StudyError("the C program supports only drag with a constant coefficient, with or without a wake")
    parameters = _Parameters(
        scale=scene.scale,
        origin_m=tuple(scene.origin_m),
        period_s=1 / _RATE_HZ,
        alpha=estimator.alpha,
        threshold_mps=scene.knee.threshold_mps,
        drag_kg_m=0.5 * liquid.density_kg_m3 * math.pi * scene.body.diameter_m**2 / 4 * scene.body.drag_coefficient,
    )
    if "wake" in liquid.effects and wake is not None:
        if wake.resolution_m > 0:
            raise StudyError("the C program stores a wake element on every tick (resolution 0)")
        parameters.length = wake.length
        parameters.scaling = wake.scaling
        parameters.exponent = wake.exponent
        parameters.breaking_cosine = math.cos(math.radians(wake.breaking_angle_deg))
        parameters.breaking_span_m = wake.breaking_span_m
        parameters.decay = wake.decay
        parameters.vertical = wake.axes == "xyz"
    return parameters
