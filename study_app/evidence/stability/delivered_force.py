"""The force that acts on the hand, after the device's delay, against the law on the handle's true motion.

An arm that holds a handle through its tissue (`closed_loop.ARMS`) follows a sine and random motion at 1 kHz, each with
the power of ±20 mm, and repeated reaches; the force moves arm and handle, so the handle itself moves less. The law is
the same scene on the handle's true motion, with exact velocities. Buoyancy, which needs no velocity, is left out.

- *error*: RMS of acting force less law over RMS of the law;
- *least*: the error of the best linear estimator for this random motion: least squares of the law at the time when the
  force acts on all counted positions up to the sample. A law that is not linear can be estimated better than that;
- *drag*, *wake*, *inertia*: how much of each part of the law acts, by least squares on the sine. Inertia includes the
  history, which a single frequency cannot tell from drag and inertia.
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import cache
from typing import Any, Final, NamedTuple

import numpy as np

from study_app.evidence.reference_model import CONSTANTS, late_mps
from study_app.evidence.reference_solutions import with_effects, without_buoyancy
from study_app.evidence.stability.bench import DIRECTION, Bench, law_along, sine_path
from study_app.evidence.stability.case_groups import peak_mps
from study_app.evidence.stability.stability_cases import DAMPER, SECOND, SINE, Case, scene_of, scenes
from study_app.evidence.stability.velocity import COUNT_M, WHOLE, Stroke, random_path
from study_app.evidence.table import Evidence, Table, run
from study_app.haptics.model.motion import Floats
from study_app.haptics.model.scene import Effect, Scene

_HANDS: Final = ("light", "middle", "firm")
_HANDLES_KG: Final = (0.1, 0.2, 0.5)
_STANDARD: Final = ("middle", 0.2)
"""The hand and the handle [kg] that strict limits apply to."""
_FREQUENCIES_HZ: Final = (1.6, 3.0)
DELAYS: Final = (1, 2, 3, 4)
_REPORTED_KG: Final = 0.1
"""The least mass that the drivers report."""
_DURATION_S: Final = 8.0
_SETTLED_S: Final = 3.0
_TAPS: Final = (*range(200), *range(200, 1200, 40))
"""Ages [ticks] of the positions that the best linear estimator uses."""
_REACH: Final = Stroke(0.03, reach_s=0.3)
_ROW_STEP: Final = 2
"""Interval between the rows that are fitted."""

_Range = tuple[float, float]
_ERROR: Final = {"water": 20.0, "olive_oil": 13.0, "gear_oil": 13.0, "glycerin": 13.0, "honey": 15.0}
_THICK: Final = ("glycerin", "honey")
_FAST_ERROR: Final = 20.0
_FAST_HONEY: Final = 35.0
_LIGHT_HONEY: Final = 30.0
_OTHER_GRIPS_FACTOR: Final = 1.5
"""Factor by which the error may be larger with other hands and handles than with the standard ones."""


class Delivered(NamedTuple):
    """The acting force of one liquid in one loop; errors and proportions in %.

    ``parts`` are the proportions of the law's parts on the sine, ``withheld`` that of the force held back by the safety
    layer, ``least`` the error of the best linear estimator on the random motion, ``reach`` the error in repeated
    reaches of 60 mm in 0.3 s (only with the frequency 1.6 Hz).
    """

    case: Case
    frequency_hz: float
    sine: float
    random: float
    least: float
    parts: Mapping[str, float]
    withheld: float
    reach: float | None = None

    @property
    def values(self) -> Mapping[str, float]:
        """The quantities that may have limits, by name [%]."""
        reach = {} if self.reach is None else {"reach": self.reach}
        return {"sine": self.sine, "random": self.random, "least": self.least, **reach, **self.parts}

    @property
    def limits(self) -> Mapping[str, _Range]:
        """The permitted ranges, by quantity; empty for liquids and estimators without limits."""
        case, name = self.case, self.case.liquid.removeprefix("physical2_")
        if case.estimator != "kalman" or name == case.liquid or name not in _ERROR:
            return {}
        is_honey, is_fast = name == "honey", self.frequency_hz > WHOLE.frequency_hz
        error = (_FAST_HONEY if is_honey else _FAST_ERROR) if is_fast else _ERROR[name]
        if (case.hand, case.mass_kg) != _STANDARD:
            is_light = is_honey and not is_fast and (case.hand == "light" or case.mass_kg == min(_HANDLES_KG))
            return {"sine": (0.0, _LIGHT_HONEY if is_light else _OTHER_GRIPS_FACTOR * error)}
        limits = {"sine": (0.0, error)}
        if is_fast:
            limits["drag"] = (70.0, 130.0) if is_honey else (80.0, 120.0)
        else:
            limits |= {"inertia": (85.0, 115.0), "reach": (0.0, error)}
            if case.delay in {1, 3}:
                limits["random"] = (0.0, self.least * (2.0 if name in _THICK else 1.5))
        return limits

    @property
    def exceeded(self) -> tuple[str, ...]:
        """The quantities outside their permitted range."""
        return tuple(name for name, (low, high) in self.limits.items() if not low <= self.values[name] <= high)


@cache
def _shipped_liquids() -> tuple[str, ...]:
    """Return the liquids of all shipped studies; of several with the same force only the first."""
    liquids: dict[str, str] = {}
    for name, scene in scenes().items():
        if name not in {"dense", DAMPER}:
            single = without_buoyancy(scene).model_dump(include={"scale", "rate_hz", "body", "knee", "liquids"})
            single["liquids"][0].pop("id")
            liquids.setdefault(str(single), name)
    return tuple(liquids.values())


def measure_delivered_force(*, whole: bool = False, executor: Executor | None = None) -> tuple[Delivered, ...]:
    """Return the acting force of the liquids with limits, with one hand or handle changed at a time.

    With ``whole``, also with every hand and handle, and of all other shipped liquids with both estimators.
    """
    limited = tuple(f"physical2_{name}" for name in _ERROR)
    holds = [
        hold
        for hold in itertools.product(_HANDS, _HANDLES_KG)
        if whole or hold[0] == _STANDARD[0] or hold[1] == _STANDARD[1]
    ]
    loops = [(liquid, "kalman", *hold) for liquid in limited for hold in holds]
    if whole:
        pairs = itertools.product(_shipped_liquids(), ("kalman", "ewma"))
        loops += [(*pair, *_STANDARD) for pair in pairs if (*pair, *_STANDARD) not in loops]
    measured_loops = [(*loop, hz, delay) for loop in loops for hz in _FREQUENCIES_HZ for delay in DELAYS]
    return run(delivered, measured_loops, executor)


def delivered(
    liquid: str, estimator: str, hand: str, mass_kg: float, frequency_hz: float = WHOLE.frequency_hz, delay: int = 1
) -> Delivered:
    """Measure the acting force of one liquid in one loop."""
    case = case_of(scenes()[liquid], estimator, delay, hand=hand, mass_kg=mass_kg, frequency_hz=frequency_hz)
    case = replace(case, liquid=liquid)
    scene = without_buoyancy(scene_of(case))
    sine, random = acting_on_sine(case, scene, frequency_hz), acting_on_random_motion(case, scene, frequency_hz)
    return Delivered(
        case=case,
        frequency_hz=frequency_hz,
        sine=sine.error,
        random=random.error,
        least=random.least,
        parts=sine.parts,
        withheld=sine.withheld,
        reach=error_in_reaches(case, scene) if frequency_hz == WHOLE.frequency_hz else None,
    )


def case_of(
    scene: Scene,
    estimator: str,
    delay: int,
    *,
    hand: str = _STANDARD[0],
    mass_kg: float = _STANDARD[1],
    frequency_hz: float = WHOLE.frequency_hz,
) -> Case:
    """Return the loop in which a hand follows a sine of ±20 mm in a scene, at its scale and rate."""
    return Case(
        scale=scene.scale,
        rate_hz=scene.rate_hz,
        delay=delay,
        estimator=estimator,
        hand=hand,
        motion=SINE,
        speed_mps=peak_mps(frequency_hz, WHOLE.amplitude_m),
        way_mm=2e3 * WHOLE.amplitude_m,
        quantum_um=1e6 * COUNT_M,
        mass_kg=mass_kg,
        believed_kg=min(mass_kg, _REPORTED_KG),
        plant=SECOND,
    )


class OnRandomMotion(NamedTuple):
    """Error of the acting force and least error of a linear estimator [%], on the same random motion."""

    error: float
    least: float


def acting_on_random_motion(case: Case, scene: Scene, frequency_hz: float = WHOLE.frequency_hz) -> OnRandomMotion:
    """Return the error of the acting force of ``scene`` in the loop of ``case`` while the hand moves at random."""
    trace = Bench(case, scene=scene).follow(random_path(frequency_hz, case.rate_hz))
    law_n = law_along(scene, trace) @ DIRECTION
    return OnRandomMotion(error=_rms_error(trace, law_n), least=_least_error(trace, law_n, case.delay))


class Acting(NamedTuple):
    """Error, proportion of each part of the law, and proportion withheld [%], on a sine."""

    error: float
    parts: Mapping[str, float]
    withheld: float


def acting_on_sine(case: Case, scene: Scene, frequency_hz: float = WHOLE.frequency_hz) -> Acting:
    """Return the acting force of ``scene`` in the loop of ``case`` while the hand follows a sine of ±20 mm."""
    path_m = sine_path(WHOLE.amplitude_m, 2 * math.pi * frequency_hz, _DURATION_S, case.rate_hz)
    trace = Bench(case, scene=scene).follow(path_m)
    settled = trace.t_s >= _SETTLED_S
    parts_n = _law_parts(scene, trace)
    regressors = np.column_stack([part_n[settled] for part_n in parts_n.values()])
    proportions = np.linalg.lstsq(regressors, (trace.acting_n @ DIRECTION)[settled], rcond=None)[0]
    model_n, sent_n = trace.asked_n[settled], trace.sent_n[settled]
    withheld = float(np.linalg.norm(model_n - sent_n, axis=1).sum() / np.linalg.norm(model_n, axis=1).sum())
    return Acting(
        error=_rms_error(trace, law_along(scene, trace) @ DIRECTION),
        parts={name: 100 * float(proportion) for name, proportion in zip(parts_n, proportions, strict=True)},
        withheld=100 * withheld,
    )


def error_in_reaches(case: Case, scene: Scene) -> float:
    """Return the error of the acting force [%] of ``scene`` while the hand reaches back and forth, with rests."""
    t_s = np.arange(round(_DURATION_S * case.rate_hz)) / case.rate_hz
    trace = Bench(case, scene=scene).follow(np.outer(_REACH.places_m(t_s), DIRECTION))
    return _rms_error(trace, law_along(scene, trace) @ DIRECTION)


def _rms_error(trace: Any, law_n: Floats) -> float:
    """Return the RMS of acting force less law (n,) over the RMS of the law [%], along the motion."""
    settled = trace.t_s >= _SETTLED_S
    error_n = (trace.acting_n @ DIRECTION - law_n)[settled]
    return 100 * math.sqrt(float(np.sum(error_n**2) / np.sum(law_n[settled] ** 2)))


def _law_parts(scene: Scene, trace: Any) -> Mapping[str, Floats]:
    """Return those of drag, wake and inertia that the scene has, along the true motion, each (n,) [N]."""
    liquid, effects = scene.liquids[0], scene.liquids[0].effects
    if "unsteady_drag" in effects:
        w_mps = scene.scale * trace.velocity_mps
        diameter_m, viscosity_pa_s = scene.body.diameter_m, liquid.viscosity_pa_s or math.nan
        excess_mps = late_mps(
            w_mps,
            np.zeros_like(w_mps),  # without acceleration there is no history
            np.full(len(w_mps), 1 / scene.rate_hz),
            diameter_m,
            viscosity_pa_s / liquid.density_kg_m3,
            CONSTANTS,
        )
        drag_n = -3 * math.pi * viscosity_pa_s * diameter_m * (w_mps + excess_mps)
        return {"drag": drag_n @ DIRECTION, "inertia": (law_along(scene, trace) - drag_n) @ DIRECTION}

    def force_n(*names: Effect) -> Floats:
        force: Floats = law_along(with_effects(scene, *names), trace) @ DIRECTION
        return force

    inertial = tuple(name for name in effects if name in {"added_mass", "history"})
    waking = tuple(name for name in effects if name in {"wake", "local_wake"})
    drag = tuple(name for name in effects if name not in {*inertial, *waking})
    parts = {"drag": force_n(*drag)}
    if waking:
        parts["wake"] = force_n(*drag, *waking) - parts["drag"]
    if inertial:
        parts["inertia"] = force_n(*drag, *inertial) - parts["drag"]
    return parts


def _least_error(trace: Any, law_n: Floats, delay: int) -> float:
    """Return the error [%] of the linear estimator of the law (n,) [N] that is best on this motion."""
    counted_m = np.rint(trace.position_m / COUNT_M) @ DIRECTION * COUNT_M
    rows = np.flatnonzero(trace.t_s >= _SETTLED_S)[::_ROW_STEP]
    regressors = np.column_stack([counted_m[rows - delay - age] for age in _TAPS])
    weights = np.linalg.solve(regressors.T @ regressors, regressors.T @ law_n[rows])
    error_n = regressors @ weights - law_n[rows]
    return 100 * math.sqrt(float(np.sum(error_n**2) / np.sum(law_n[rows] ** 2)))


def delivered_force_evidence(found: Sequence[Delivered]) -> Evidence:
    """Return the table, with the limits, and whether each limit is met."""
    exceeded = sum(bool(row.exceeded) for row in found)
    text = "\n".join((*_lines(found), f"{exceeded} of {len(found)} rows exceed a limit")) + "\n"
    return Evidence(text, {"delivered.txt": text}, missed=exceeded > 0)


def _lines(found: Sequence[Delivered]) -> Iterator[str]:
    yield "Force on the hand, including the delay, compared with the law for the handle's true motion; 1 kHz, 38 µm."
    yield "The hand follows a sine, random motion with the power of a ±20 mm sine, and reaches of 60 mm in 0.3 s."
    yield "Columns: RMS error in each [% of the law], error of the best linear estimator from positions in the random"
    yield "motion, proportion of each part of the law that reaches the hand during the sine [%] (inertia includes"
    yield "history), and proportion of the force held back [%]."
    yield "A limit follows its value after a slash; * marks a value beyond it."
    yield ""
    headings = ("liquid", "estimator", "hand", "kg", "Hz", "ticks", "sine", "random", "least", "reach", "drag", "wake")
    rows = []
    for row in found:
        case = row.case
        identity = (case.liquid, case.estimator, case.hand, f"{case.mass_kg:g}", f"{row.frequency_hz:g}", case.delay)
        cells = [_cell(name, row) for name in (*headings[6:], "inertia")]
        rows.append((*identity, *cells, f"{row.withheld:.0f}"))
    yield Table((*headings, "inertia", "withheld"), rows, left=3).text()
    yield ""


def _cell(name: str, row: Delivered) -> str:
    if (value := row.values.get(name)) is None:
        return "–"
    text = f"{value:.0f}" if name in row.parts else f"{value:.1f}"
    if name not in row.limits:
        return text
    low, high = row.limits[name]
    return f"{text}/{f'{low:g}–' if low else ''}{high:.3g}{'*' if name in row.exceeded else ''}"
