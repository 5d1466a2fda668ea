"""The solved cases: a ball in liquids of a shipped protocol, its speed over time, and the exact force of creeping flow.

Profiles are in units of the ball diameter D, the speed U and the liquid density ρ: times in D/U, forces in ρU²D².
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from study_app.errors import StudyError
from study_app.haptics.model.motion import Floats
from study_app.protocol.load import load_scene
from study_app.protocol.source import shipped_file

RAMP: Final = 0.2
STOP: Final = 10.0
_END: Final = 20.0
_FINE: Final = ((0.5, 1), (1.0, 2))
_PANEL: Final = 0.5
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)


class Step(NamedTuple):
    """A minimum-jerk change of speed by ``by`` within `RAMP`, starting at ``at`` (Flash & Hogan 1985)."""

    at: float
    by: float


class _Sine(NamedTuple):
    """A component ``amplitude`` · sin(2πt/period + phase) of the speed."""

    amplitude: float
    period: float
    phase: float


@dataclass(frozen=True, slots=True)
class VelocityProfile:
    """Speed along one axis over time, from rest: the sum of the steps, multiplied by the sum of the sines if any."""

    name: str
    words: str
    steps: tuple[Step, ...]
    sines: tuple[_Sine, ...] = ()
    end: float = _END

    @property
    def description(self) -> str:
        changes = ", ".join(f"{by:+g} U over {RAMP:g} D/U, starting at {at:g} D/U" for at, by in self.steps)
        sines = " + ".join(f"{a:g} sin(2πt/{T:g} + {phase:g})" for a, T, phase in self.sines)
        return f"speed {changes}{f', times {sines}' if sines else ''}; end at {self.end:g} D/U"

    def speed(self, t: Floats) -> Floats:
        """Return the speed (n,) at times (n,)."""
        return self._step_sum(t) * self._sine_sum(t)

    def acceleration(self, t: Floats) -> Floats:
        """Return the acceleration (n,) [U²/D] at times (n,)."""
        steps: Floats = np.sum([by * _step_slope((t - at) / RAMP) / RAMP for at, by in self.steps], axis=0)
        rates = [a * 2 * math.pi / T * np.cos(2 * math.pi * t / T + phase) for a, T, phase in self.sines]
        values: Floats = steps * self._sine_sum(t) + self._step_sum(t) * np.sum(rates, axis=0)
        return values

    def solution_times(self, step: float) -> Floats:
        """Return the times (n,) at which the flow is solved.

        They are ``step`` apart for half a D/U after each change of speed, twice as far apart in the following D/U, and
        four times as far apart in the rest.
        """
        parts = []
        ends = [*(it.at for it in self.steps[1:]), self.end]
        for (begin, _), end in zip(self.steps, ends, strict=True):
            start = begin
            for length, factor in (*_FINE, (end - begin - sum(it for it, _ in _FINE), 4)):
                parts.append(np.linspace(start, start + length, round(length / (factor * step)), endpoint=False))
                start += length
        return np.concatenate([*parts, [self.end]])

    def near_steps(self, t: Floats) -> NDArray[np.bool_]:
        """Return which of the times (n,) lie within two ramps after the start of a step."""
        near: NDArray[np.bool_] = np.any([(t >= at) & (t <= at + 2 * RAMP) for at, _ in self.steps], axis=0)
        return near

    def linear_drags(self, t: Floats, reynolds: float) -> Floats:
        """Return the force (n,) against the motion in creeping flow at times (n,), exact for an unbounded liquid.

        It is the sum of Stokes drag, added mass, and the Basset integral (Landau & Lifshitz, Fluid Mechanics, §24),
        computed by Gaussian quadrature in √(t − τ), which removes the singularity.
        """
        viscosity = 1 / reynolds
        memory = np.zeros_like(t)
        for begin, end in self._panels():
            minimum, maximum = (np.sqrt(np.maximum(t - it, 0.0)) for it in (end, begin))
            roots = np.multiply.outer((maximum - minimum) / 2, _NODES) + ((maximum + minimum) / 2)[:, np.newaxis]
            memory += (maximum - minimum) * (self.acceleration(t[:, np.newaxis] - roots**2) @ _WEIGHTS)
        prompt = 3 * math.pi * viscosity * self.speed(t) + math.pi / 12 * self.acceleration(t)
        force: Floats = prompt + 1.5 * math.sqrt(math.pi * viscosity) * memory
        return force

    def _panels(self) -> list[tuple[float, float]]:
        """Return the intervals of acceleration, split so that each is smooth and short enough for the quadrature."""
        ramps = [(at, at + RAMP) for at, _ in self.steps]
        if not self.sines:
            return ramps
        edges = sorted({*np.arange(0.0, self.end + _PANEL, _PANEL).tolist(), *(it for ramp in ramps for it in ramp)})
        return list(itertools.pairwise(edges))

    def _step_sum(self, t: Floats) -> Floats:
        values: Floats = np.sum([by * _rising_step((t - at) / RAMP) for at, by in self.steps], axis=0)
        return values

    def _sine_sum(self, t: Floats) -> Floats:
        if not self.sines:
            return np.ones_like(t)
        values: Floats = np.sum([a * np.sin(2 * math.pi * t / T + phase) for a, T, phase in self.sines], axis=0)
        return values


def _rising_step(x: Floats) -> Floats:
    clipped = np.clip(x, 0.0, 1.0)
    values: Floats = clipped**3 * (10 - 15 * clipped + 6 * clipped**2)
    return values


def _step_slope(x: Floats) -> Floats:
    clipped = np.clip(x, 0.0, 1.0)
    values: Floats = 30 * (clipped * (1 - clipped)) ** 2
    return values


def _oscillation_profile(keulegan_carpenter: float) -> VelocityProfile:
    """Return four periods of an oscillation with the Keulegan–Carpenter number U T/D."""
    sine = _Sine(amplitude=1.0, period=keulegan_carpenter, phase=0.0)
    title = f"oscillation, KC {keulegan_carpenter:g}"
    return VelocityProfile(
        f"oscillation-kc{keulegan_carpenter:g}", title, (Step(0.0, 1.0),), (sine,), 4 * keulegan_carpenter
    )


STOPPING: Final = VelocityProfile("stop", "stop", (Step(0.0, 1.0), Step(STOP, -1.0)))
_REVERSAL: Final = VelocityProfile("reversal", "reversal", (Step(0.0, 1.0), Step(STOP, -2.0)))
_RETURN: Final = VelocityProfile(
    "return", "return after a pause", (Step(0.0, 1.0), Step(STOP, -1.0), Step(13.0, -1.0)), end=23.0
)
_MULTI_SINE: Final = VelocityProfile(
    "multi-sine",
    "multi-sine",
    (Step(0.0, 1.0),),
    (
        _Sine(amplitude=0.38, period=2.0, phase=0.4),
        _Sine(amplitude=0.38, period=3.7, phase=2.1),
        _Sine(amplitude=0.38, period=6.9, phase=4.4),
        _Sine(amplitude=0.38, period=13.0, phase=1.0),
    ),
    26.0,
)
_OSCILLATION_KC4: Final = _oscillation_profile(4.0)
_OSCILLATION_KC5: Final = _oscillation_profile(5.0)
PROFILES: Final = {
    it.name: it for it in (STOPPING, _REVERSAL, _RETURN, _MULTI_SINE, _OSCILLATION_KC4, _OSCILLATION_KC5)
}


_PROTOCOL: Final = "physical_liquids"
LIQUIDS: Final = ("honey", "glycerin")
_HIGHEST_REYNOLDS: Final = 200.0
"""Up to about 210 the flow behind a sphere is axisymmetric (Johnson & Patel 1999, J. Fluid Mech. 378:19)."""

TRAINING: Final = (
    (_MULTI_SINE, "honey", 0.3),
    (_MULTI_SINE, "glycerin", 10.0),
    (_MULTI_SINE, "gear_oil", 60.0),
    (_OSCILLATION_KC5, "glycerin", 20.0),
    (_OSCILLATION_KC4, "gear_oil", 100.0),
    (_REVERSAL, "glycerin", 10.0),
    (STOPPING, "honey", 1.0),
    (STOPPING, "gear_oil", 100.0),
)
"""Motions by profile, liquid and Reynolds number, that the constants of unsteady drag are fitted to.

They are added to those of `cases`, which do not determine the constants because none of them moves back through its own
wake.
"""
HELD_OUT: Final = (
    (_MULTI_SINE, "tar", 0.16),
    (_OSCILLATION_KC4, "honey", 3.0),
    (_OSCILLATION_KC5, "gear_oil", 60.0),
    (_REVERSAL, "honey", 2.0),
    (_REVERSAL, "glycerin", 30.0),
    (_REVERSAL, "gear_oil", 60.0),
    (_REVERSAL, "gear_oil", 100.0),
    (_RETURN, "glycerin", 30.0),
    (STOPPING, "gear_oil", 60.0),
)
"""Motions like those of `TRAINING`, and a return after a pause, that no fit uses, to test the constants.

The reversal at Re 60 and the return were also used to choose the form of the law.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A ball in one liquid that follows a velocity profile; ``speed_mps`` is its U."""

    liquid_id: str
    density_kg_m3: float
    viscosity_pa_s: float
    diameter_m: float
    speed_mps: float
    profile: VelocityProfile = STOPPING

    def __post_init__(self) -> None:
        if self.reynolds > _HIGHEST_REYNOLDS:
            raise StudyError(
                f"{self.liquid_id} at {self.speed_mps:g} m/s has a Reynolds number of {self.reynolds:.0f}: the solver "
                f"assumes axisymmetric flow, which holds only up to {_HIGHEST_REYNOLDS:g}"
            )

    @property
    def name(self) -> str:
        """The file name without its suffix."""
        motion = "" if self.profile is STOPPING else f"{self.profile.name}-"
        return f"{motion}{self.liquid_id}-{round(self.speed_mps * 1000)}mmps"

    @property
    def title(self) -> str:
        return f"{self.profile.words} at {self.speed_mps:.3g} m/s"

    @property
    def reynolds(self) -> float:
        """Re = ρUD/µ."""
        return self.density_kg_m3 * self.speed_mps * self.diameter_m / self.viscosity_pa_s

    @property
    def unit_s(self) -> float:
        """D/U."""
        return self.diameter_m / self.speed_mps

    @property
    def unit_n(self) -> float:
        """ρU²D²."""
        return self.density_kg_m3 * (self.speed_mps * self.diameter_m) ** 2


def cases() -> tuple[Case, ...]:
    """Return each liquid at the greatest speed of its protocol, at the scene's scale and at scale 1."""
    all_cases = []
    for liquid_id in LIQUIDS:
        scene = load_scene(shipped_file(_PROTOCOL), liquid_id)
        fastest_mps = scene.motion_in(scene.liquids[0]).speed_mps or math.nan
        all_cases += [_case(liquid_id, speed_mps) for speed_mps in (fastest_mps / scene.scale, fastest_mps)]
    return tuple(all_cases)


def cases_of(motions: Sequence[tuple[VelocityProfile, str, float]]) -> tuple[Case, ...]:
    """Return the cases of motions by profile, liquid and Reynolds number."""
    all_cases = []
    for profile, liquid_id, reynolds in motions:
        case = _case(liquid_id, 1e-3)
        all_cases.append(_case(liquid_id, 1e-3 * reynolds / case.reynolds, profile))
    return tuple(all_cases)


def _case(liquid_id: str, speed_mps: float, profile: VelocityProfile = STOPPING) -> Case:
    scene = load_scene(shipped_file(_PROTOCOL), liquid_id)
    (liquid,) = scene.liquids
    return Case(
        liquid_id=liquid_id,
        density_kg_m3=liquid.density_kg_m3,
        viscosity_pa_s=liquid.viscosity_pa_s or math.nan,
        diameter_m=scene.body.diameter_m,
        speed_mps=speed_mps,
        profile=profile,
    )
