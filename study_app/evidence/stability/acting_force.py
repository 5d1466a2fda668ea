"""The force that acts on the hand against the law on the handle's true motion at the same time, delay included.

An arm holds a handle through its tissue (`closed_loop`, "arm") at 1 kHz with an encoder of 38 µm counts and `kalman`;
the device states the handle's mass or 0.1 kg, whichever is less. The arm means to move along a sine of ±20 mm, and,
separately, along noise about the same frequency with the power of that sine (`velocity.noise_m`), both with a tremor of
50 µm; how far the handle moves depends on the liquid. The law is the same scene on the handle's true motion, velocities
given, within the force limit. Errors are the RMS of the difference over the RMS of the law.

The bound is the least error of a linear causal estimator on that very noise: the filter of the encoder's positions that
fits the law at the time at which the force acts best. A sine has no such bound, since its future follows from its past.
The shares are least-squares coefficients of a part of the law in the acting force on the noise, beside that of the rest
of the law: of the steady drag with its wake, of the inertial force (added mass and history), and of the history alone.
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from typing import Any, Final, NamedTuple

import numpy as np

from study_app.evidence.reference_model import unsteady_n
from study_app.evidence.reference_solutions import without_buoyancy
from study_app.evidence.stability.bench import DIRECTION, FORCE_LIMIT_N, Bench, law_along, sine_path
from study_app.evidence.stability.stability_cases import SECOND, Case, scene_of
from study_app.evidence.stability.velocity import COUNT_M, RATE_HZ, noise_m
from study_app.evidence.table import Evidence, run
from study_app.haptics.model.motion import Floats
from study_app.haptics.model.scene import Scene

LIQUIDS: Final = ("water", "olive_oil", "gear_oil", "glycerin", "honey")
HANDS: Final = ("light", "middle", "firm")
MASSES_KG: Final = (0.1, 0.2, 0.5)
DELAYS: Final = (1, 2, 3, 4)
FREQUENCIES_HZ: Final = (1.6, 3.0)
STATED_KG: Final = 0.1
AMPLITUDE_M: Final = 0.02
TREMOR_M: Final = 50e-6
TREMORS_HZ: Final = (9.0, 10.3, 8.2)
SINE_S: Final = 4.0
NOISE_S: Final = 10.0
BEGINS_S: Final = 0.5
"""Time in which the noise reaches its size: a step at the start would be an energy debt."""
SETTLED_S: Final = 1.5
LAGS: Final = np.unique(np.geomspace(1, 400, 60).round().astype(int))
"""How many ticks ago the positions are that the best linear estimator uses."""

MOST_ERROR: Final[Mapping[str, float]] = {**dict.fromkeys(LIQUIDS, 13.0), "water": 20.0, "honey": 15.0}
"""Greatest error on the sine of 1.6 Hz [%], middle hand, 0.2 kg."""
MOST_FAST_ERROR: Final[Mapping[str, float]] = {**dict.fromkeys(LIQUIDS, 20.0), "honey": 35.0}
"""The same at 3 Hz."""
OTHER_LOOPS: Final = 1.5
"""Factor on these with other hands and handles."""
HONEY_ERROR: Final = 30.0
"""Of honey at 1.6 Hz with 0.1 kg or in a light hand."""
MOST_OF_BOUND: Final[Mapping[str, float]] = {**dict.fromkeys(LIQUIDS, 1.5), "glycerin": 2.0, "honey": 2.0}
"""Greatest error on noise of 1.6 Hz over the bound, at 1 and 3 ticks, middle hand, 0.2 kg."""
INERTIA: Final = (85.0, 115.0)
DRAG: Final[Mapping[str, tuple[float, float]]] = {**dict.fromkeys(LIQUIDS, (80.0, 120.0)), "honey": (70.0, 130.0)}
"""Shares of inertia at 1.6 Hz and of drag at 3 Hz [%], middle hand, 0.2 kg."""


class Loop(NamedTuple):
    """One liquid in one loop; the frequency is that of the motion."""

    liquid: str
    hand: str
    mass_kg: float
    frequency_hz: float
    delay: int

    @property
    def is_usual(self) -> bool:
        return self.hand == "middle" and self.mass_kg == 0.2

    @property
    def most_error(self) -> float:
        """The limit of the error on the sine [%]."""
        if self.frequency_hz > FREQUENCIES_HZ[0]:
            return MOST_FAST_ERROR[self.liquid] * (1.0 if self.is_usual else OTHER_LOOPS)
        if self.liquid == "honey" and (self.mass_kg == STATED_KG or self.hand == "light"):
            return HONEY_ERROR
        return MOST_ERROR[self.liquid] * (1.0 if self.is_usual else OTHER_LOOPS)


class Shares(NamedTuple):
    """The shares of the law's parts that act on the noise [%]; NaN of a history that the law does not have."""

    drag: float
    inertial: float
    history: float


class Acting(NamedTuple):
    """Error on the sine and on the noise, the bound, and the shares of the law's parts [%]."""

    loop: Loop
    sine: float
    noise: float
    bound: float
    shares: Shares

    @property
    def misses(self) -> tuple[str, ...]:
        """The limits that are not met, in words."""
        loop, found = self.loop, []
        if self.sine > loop.most_error:
            found.append(f"error {self.sine:.3g} %, at most {loop.most_error:g}")
        if loop.is_usual and loop.frequency_hz == FREQUENCIES_HZ[0]:
            if not INERTIA[0] <= self.shares.inertial <= INERTIA[1]:
                found.append(f"inertial force {self.shares.inertial:.3g} %, {INERTIA[0]:g} to {INERTIA[1]:g}")
            if loop.delay in (1, 3) and self.noise > MOST_OF_BOUND[loop.liquid] * self.bound:
                ratio = self.noise / self.bound
                found.append(f"error on noise {ratio:.3g} of the bound, at most {MOST_OF_BOUND[loop.liquid]:g}")
        elif loop.is_usual and not DRAG[loop.liquid][0] <= self.shares.drag <= DRAG[loop.liquid][1]:
            found.append("drag {:.3g} %, {:g} to {:g}".format(self.shares.drag, *DRAG[loop.liquid]))
        return tuple(found)


def measure(executor: Executor | None = None, liquids: Sequence[str] = LIQUIDS) -> tuple[Acting, ...]:
    """Return what acts in every loop, by an executor or here."""
    planned = itertools.product(liquids, HANDS, MASSES_KG, FREQUENCIES_HZ, DELAYS)
    return run(measure_loop, planned, executor)


def measure_loop(liquid: str, hand: str, mass_kg: float, frequency_hz: float, delay: int) -> Acting:
    """Return what acts in one loop."""
    case = Case(
        liquid=f"physical2_{liquid}",
        scale=3.0,
        delay=delay,
        estimator="kalman",
        hand=hand,
        plant=SECOND,
        mass_kg=mass_kg,
        believed_kg=min(mass_kg, STATED_KG),
        quantum_um=1e6 * COUNT_M,
    )
    scene = without_buoyancy(scene_of(case))
    sine = Bench(case, scene=scene).follow(_shaken(sine_path(AMPLITUDE_M, 2 * math.pi * frequency_hz, SINE_S, RATE_HZ)))
    begun = np.minimum(np.arange(round(NOISE_S * RATE_HZ)) / (BEGINS_S * RATE_HZ), 1.0)
    path_m = np.outer(begun * noise_m(frequency_hz, seed=1)[: len(begun)], DIRECTION)
    noise = Bench(case, scene=scene).follow(_shaken(path_m))
    law_n, counted = mean_law(scene, noise), noise.t_s[:-1] >= SETTLED_S
    return Acting(
        loop=Loop(liquid=liquid, hand=hand, mass_kg=mass_kg, frequency_hz=frequency_hz, delay=delay),
        sine=_error(sine.acting_n[:-1], mean_law(scene, sine), sine.t_s[:-1] >= SETTLED_S),
        noise=_error(noise.acting_n[:-1], law_n, counted),
        bound=least_error(np.floor(noise.position_m / COUNT_M + 0.5) * COUNT_M, law_n, delay),
        shares=part_shares(scene, noise, law_n),
    )


def _shaken(path_m: Floats) -> Floats:
    """Add tremor to a path (ticks, 3) [m]."""
    t_s = np.arange(len(path_m)) / RATE_HZ
    return path_m + TREMOR_M * np.sin(2 * math.pi * np.outer(t_s, TREMORS_HZ) + np.arange(3))


def mean_law(scene: Scene, trace: Any) -> Floats:
    """Return the law's mean force from each tick to the next (ticks − 1, 3) [N], within the force limit."""
    law_n = law_along(scene, trace)
    law_n *= np.minimum(FORCE_LIMIT_N / np.maximum(np.linalg.norm(law_n, axis=1), FORCE_LIMIT_N), 1.0)[:, np.newaxis]
    mean_n: Floats = 0.5 * (law_n[:-1] + law_n[1:])
    return mean_n


def _error(acting_n: Floats, law_n: Floats, counted: Any) -> float:
    return 100 * math.sqrt(float(np.sum((acting_n - law_n)[counted] ** 2) / np.sum(law_n[counted] ** 2)))


def least_error(seen_m: Floats, law_n: Floats, delay: int) -> float:
    """Return the error [%] of the best linear function of the positions seen (ticks, 3) [m] up to each tick.

    It estimates ``law_n``, whose rows are the means from tick to tick, ``delay`` ticks later; all axes share it.
    """
    rows = np.arange(max(round(SETTLED_S * RATE_HZ), LAGS[-1]), len(law_n) - delay)
    steps_m = np.concatenate(
        [seen_m[rows, axis, np.newaxis] - seen_m[rows[:, np.newaxis] - LAGS, axis] for axis in range(3)]
    )
    wanted_n = law_n[rows + delay].T.ravel()
    weights = np.linalg.lstsq(steps_m, wanted_n, rcond=None)[0]
    return 100 * math.sqrt(float(np.sum((steps_m @ weights - wanted_n) ** 2) / np.sum(wanted_n**2)))


def part_shares(scene: Scene, trace: Any, law_n: Floats) -> Shares:
    """Return the shares in the acting force of a trace where ``law_n`` of `mean_law` is within the force limit."""
    liquid = scene.liquids[0]
    v, even_s = scene.scale * trace.velocity_mps, np.full(len(trace), 1 / RATE_HZ)
    a = np.gradient(v, trace.t_s, axis=0)
    inertia_n = -0.5 * liquid.density_kg_m3 * scene.body.volume_m3 * a
    whole_n = law_along(scene, trace)
    drag_n = whole_n - inertia_n
    if "unsteady_drag" in liquid.effects:
        drag_n = unsteady_n(scene, v, np.zeros_like(a), even_s)
    history_n = whole_n - inertia_n - drag_n
    counted = (trace.t_s[:-1] >= SETTLED_S) & (np.linalg.norm(law_n, axis=1) < FORCE_LIMIT_N)

    def share(part_n: Floats) -> float:
        """Return the coefficient of a part beside that of the rest of the law [%]."""
        pair = (0.5 * (it[:-1] + it[1:])[counted].ravel() for it in (part_n, whole_n - part_n))
        acting_n = trace.acting_n[:-1][counted].ravel()
        return 100 * float(np.linalg.lstsq(np.column_stack(list(pair)), acting_n, rcond=None)[0][0])

    return Shares(
        drag=share(drag_n),
        inertial=share(inertia_n + history_n),
        history=share(history_n) if "unsteady_drag" in liquid.effects else math.nan,
    )


def evidence(rows: Sequence[Acting]) -> Evidence:
    """Return the table, and whether each limit is met."""
    lines = tuple(_lines(rows))
    text = "\n".join(lines) + "\n"
    return Evidence(text, {"acting.txt": text}, missed=any(row.misses for row in rows))


def _lines(rows: Sequence[Acting]) -> Iterator[str]:
    yield "force that acts on the handle against the law on its true motion, kalman, 38 µm a count, scale 3; the arm"
    yield "means to move ±20 mm. RMS error on a sine, on noise, least error of a linear estimator on that noise; shares"
    yield "of drag, inertial force and history in it that act on the noise [%]; at 1, 2, 3, 4 ticks of delay"
    for (frequency_hz, hand, mass_kg), of_loop in itertools.groupby(
        sorted(rows, key=lambda row: (row.loop.frequency_hz, row.loop.hand, row.loop.mass_kg)),
        key=lambda row: (row.loop.frequency_hz, row.loop.hand, row.loop.mass_kg),
    ):
        yield ""
        yield f"{frequency_hz:g} Hz, {hand} hand, {mass_kg:g} kg"
        for liquid, cells in itertools.groupby(of_loop, key=lambda row: row.loop.liquid):
            yield f"  {liquid:10}" + " |".join(
                f"{row.sine:5.1f}{row.noise:5.1f}{row.bound:5.1f} "
                + "".join("   –" if math.isnan(share) else f"{share:4.0f}" for share in row.shares)
                for row in cells
            )
    yield ""
    yield "limits: " + "; ".join(_limits())
    missed = [row for row in rows if row.misses]
    yield f"loops: {len(rows)}; with a limit that is not met: {len(missed)}"
    for row in missed:
        loop = row.loop
        where = f"{loop.liquid}, {loop.frequency_hz:g} Hz, {loop.hand} hand, {loop.mass_kg:g} kg, delay {loop.delay}"
        yield f"  {where}: {'; '.join(row.misses)}"


def _limits() -> Iterator[str]:
    """Yield the limits in words."""
    for name, limits in (("1.6 Hz", MOST_ERROR), ("3 Hz", MOST_FAST_ERROR), ("noise over bound", MOST_OF_BOUND)):
        yield f"{name} " + ", ".join(f"{liquid} {limit:g}" for liquid, limit in limits.items())
    yield f"other hands and handles {OTHER_LOOPS:g} times (honey {HONEY_ERROR:g} with 0.1 kg or a light hand)"
    yield "inertial force at 1.6 Hz {:g} to {:g}".format(*INERTIA)
    yield "drag at 3 Hz {:g} to {:g}, honey {:g} to {:g}".format(*DRAG["water"], *DRAG["honey"])
