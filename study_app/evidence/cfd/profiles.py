"""How the speed of a solved ball changes with time, and the exact force of creeping flow along it.

Numbers are in ball diameters D, speeds U and liquid densities: times in D/U, forces in ρU²D².
"""

import itertools
import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from study_app.haptics.model.motion import Floats

RAMP: Final = 0.2
STOP: Final = 10.0
END: Final = 20.0
_FINE: Final = ((0.5, 1), (1.0, 2))
_PANEL: Final = 0.5
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)


class Step(NamedTuple):
    """A change of the speed ``by`` so much within `RAMP`, from ``at`` on, with least jerk (Flash & Hogan 1985)."""

    at: float
    by: float


class Sine(NamedTuple):
    """A part ``amplitude`` · sin(2πt/period + phase) of the speed."""

    amplitude: float
    period: float
    phase: float


@dataclass(frozen=True, slots=True)
class VelocityProfile:
    """Speed along one axis over time, from rest: the sum of the steps, times that of the sines if there are any."""

    name: str
    words: str
    steps: tuple[Step, ...]
    sines: tuple[Sine, ...] = ()
    end: float = END

    @property
    def description(self) -> str:
        """The motion in words and numbers."""
        changes = ", ".join(f"{by:+g} U within {RAMP:g} D/U from {at:g} D/U on" for at, by in self.steps)
        sines = " + ".join(f"{a:g} sin(2πt/{T:g} + {phase:g})" for a, T, phase in self.sines)
        return f"speed {changes}{f', times {sines}' if sines else ''}; end at {self.end:g} D/U"

    def speed(self, t: Floats) -> Floats:
        """Return the speed (n,) at times (n,)."""
        return self._stepped(t) * self._waved(t)

    def acceleration(self, t: Floats) -> Floats:
        """Return the acceleration (n,) [U²/D] at times (n,)."""
        steps: Floats = np.sum([by * _slope((t - at) / RAMP) / RAMP for at, by in self.steps], axis=0)
        rates = [a * 2 * math.pi / T * np.cos(2 * math.pi * t / T + phase) for a, T, phase in self.sines]
        found: Floats = steps * self._waved(t) + self._stepped(t) * np.sum(rates, axis=0)
        return found

    def moments(self, step: float) -> Floats:
        """Return the times (n,) at which the flow is solved: ``step`` apart for half a D/U after each step.

        Twice as far apart in the D/U after that, four times in the rest.
        """
        parts = []
        ends = [*(it.at for it in self.steps[1:]), self.end]
        for (begin, _), end in zip(self.steps, ends, strict=True):
            least = begin
            for length, times in (*_FINE, (end - begin - sum(it for it, _ in _FINE), 4)):
                parts.append(np.linspace(least, least + length, round(length / (times * step)), endpoint=False))
                least += length
        return np.concatenate([*parts, [self.end]])

    def near_steps(self, t: Floats) -> NDArray[np.bool_]:
        """Return which of the times (n,) are within two ramps after the begin of a step."""
        found: NDArray[np.bool_] = np.any([(t >= at) & (t <= at + 2 * RAMP) for at, _ in self.steps], axis=0)
        return found

    def linear_drags(self, t: Floats, reynolds: float) -> Floats:
        """Return the force (n,) against the motion in creeping flow, exact for an unbounded liquid, at times (n,).

        Stokes drag, the inertia of half the displaced liquid, and the Basset integral (Landau & Lifshitz, Fluid
        Mechanics, §24), here by Gauss' rule in √(t − τ), in which it has no singularity.
        """
        viscosity = 1 / reynolds
        memory = np.zeros_like(t)
        for begin, end in self._panels():
            least, most = (np.sqrt(np.maximum(t - it, 0.0)) for it in (end, begin))
            roots = np.multiply.outer((most - least) / 2, _NODES) + ((most + least) / 2)[:, np.newaxis]
            memory += (most - least) * (self.acceleration(t[:, np.newaxis] - roots**2) @ _WEIGHTS)
        prompt = 3 * math.pi * viscosity * self.speed(t) + math.pi / 12 * self.acceleration(t)
        found: Floats = prompt + 1.5 * math.sqrt(math.pi * viscosity) * memory
        return found

    def _panels(self) -> list[tuple[float, float]]:
        """Return the intervals in which the ball accelerates, smooth and short enough for Gauss' rule."""
        ramps = [(at, at + RAMP) for at, _ in self.steps]
        if not self.sines:
            return ramps
        edges = sorted({*np.arange(0.0, self.end + _PANEL, _PANEL).tolist(), *(it for ramp in ramps for it in ramp)})
        return list(itertools.pairwise(edges))

    def _stepped(self, t: Floats) -> Floats:
        found: Floats = np.sum([by * _rise((t - at) / RAMP) for at, by in self.steps], axis=0)
        return found

    def _waved(self, t: Floats) -> Floats:
        if not self.sines:
            return np.ones_like(t)
        found: Floats = np.sum([a * np.sin(2 * math.pi * t / T + phase) for a, T, phase in self.sines], axis=0)
        return found


def _rise(x: Floats) -> Floats:
    held = np.clip(x, 0.0, 1.0)
    found: Floats = held**3 * (10 - 15 * held + 6 * held**2)
    return found


def _slope(x: Floats) -> Floats:
    held = np.clip(x, 0.0, 1.0)
    found: Floats = 30 * (held * (1 - held)) ** 2
    return found


def _oscillation(keulegan_carpenter: float) -> VelocityProfile:
    """Return four periods of an oscillation by the Keulegan–Carpenter number U T/D."""
    sine = Sine(1.0, keulegan_carpenter, 0.0)
    words = f"oscillation, KC {keulegan_carpenter:g}"
    return VelocityProfile(
        f"oscillation-kc{keulegan_carpenter:g}", words, (Step(0.0, 1.0),), (sine,), 4 * keulegan_carpenter
    )


STOPPING: Final = VelocityProfile("stop", "stop", (Step(0.0, 1.0), Step(STOP, -1.0)))
REVERSAL: Final = VelocityProfile("reversal", "reversal", (Step(0.0, 1.0), Step(STOP, -2.0)))
RETURN: Final = VelocityProfile(
    "return", "return after a pause", (Step(0.0, 1.0), Step(STOP, -1.0), Step(13.0, -1.0)), end=23.0
)
MULTI_SINE: Final = VelocityProfile(
    "multi-sine",
    "multi-sine",
    (Step(0.0, 1.0),),
    (Sine(0.38, 2.0, 0.4), Sine(0.38, 3.7, 2.1), Sine(0.38, 6.9, 4.4), Sine(0.38, 13.0, 1.0)),
    26.0,
)
OSCILLATION_KC4: Final = _oscillation(4.0)
OSCILLATION_KC5: Final = _oscillation(5.0)
PROFILES: Final = {it.name: it for it in (STOPPING, REVERSAL, RETURN, MULTI_SINE, OSCILLATION_KC4, OSCILLATION_KC5)}
