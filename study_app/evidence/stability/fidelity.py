"""What safety takes away from a liquid that a hand holds: the force sent against the model, merely clamped to 8 N.

Each liquid of the shipped studies at its own scale and with its own estimator, moved by a middling hand (0.55 kg,
135 N/m, 6.5 N·s/m) along reaches, circles and strokes of 0.1 to 1 m/s, through several loops. The target is that of the
choice of effects: 5 % or 0.05 N, whichever is more, taken of the mean square root over a motion. Single ticks may be
further off: a wake that breaks or a hand that turns back may change the force by more than the slew limit permits.
"""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from typing import Any, Final, NamedTuple

import numpy as np

from study_app.evidence.stability.bench import FORCE_LIMIT_N, Bench, lasts_s, new_trace
from study_app.evidence.stability.stability_cases import CIRCLES, REACHES, STROKE, Case, liquids
from study_app.evidence.table import run

LOOPS: Final = ((1000.0, 0), (1000.0, 1), (1000.0, 2), (1000.0, 4), (2000.0, 1), (500.0, 1), (250.0, 1))
"""Ticks a second and ticks of delay; the first two are those of a study."""
MOTIONS: Final = (REACHES, CIRCLES, STROKE)
SPEEDS_MPS: Final = (0.1, 0.3, 0.6, 1.0)
RELATIVE: Final = 0.05
ABSOLUTE_N: Final = 0.05
SETTLED_S: Final = 0.2
MOVING_S: Final = 1.2


class Fidelity(NamedTuple):
    """One liquid in one loop, in the worst of its motions.

    ``difference_n`` and ``force_n`` are mean square roots [N] over a motion; ``beyond`` is the greatest share of ticks
    in which a single force is further off than the target.
    """

    liquid: str
    rate_hz: float
    delay: int
    difference_n: float
    force_n: float
    beyond: float

    @property
    def share(self) -> float:
        return self.difference_n / self.force_n if self.force_n > 0 else 0.0

    @property
    def target_n(self) -> float:
        """How great the difference may be."""
        return max(RELATIVE * self.force_n, ABSOLUTE_N)

    @property
    def within(self) -> bool:
        return self.difference_n <= self.target_n


def fidelities(
    names: Sequence[str] | None = None, loops: Sequence[tuple[float, int]] = LOOPS, *, executor: Executor | None = None
) -> tuple[Fidelity, ...]:
    """Measure liquids (by default all) in each of the loops, by an executor or here."""
    return run(_worst, itertools.product(names or liquids(), loops), executor)


def by_liquid(found: Sequence[Fidelity]) -> Mapping[str, tuple[Fidelity, ...]]:
    """Return what was found, one row a liquid."""
    return {name: tuple(rows) for name, rows in itertools.groupby(found, key=lambda one: one.liquid)}


def _worst(liquid: str, loop: tuple[float, int]) -> Fidelity:
    """Return the fidelity of the motion that is furthest off its target."""
    measured = list(_motions(liquid, *loop))
    beyond = max(one.beyond for one in measured)
    return max(measured, key=lambda one: one.difference_n / one.target_n)._replace(beyond=beyond)


def _motions(liquid: str, rate_hz: float, delay: int) -> Iterator[Fidelity]:
    scene = liquids()[liquid]
    for motion, speed_mps in itertools.product(MOTIONS, SPEEDS_MPS):
        case = Case(
            liquid=liquid,
            scale=scene.scale,
            rate_hz=rate_hz,
            delay=delay,
            estimator=scene.velocity.kind,
            motion=motion,
            speed_mps=speed_mps,
        )
        bench, trace = Bench(case), new_trace(case)
        bench.begin()
        trace = trace[: bench.run(trace, 0, lasts_s(case))]
        trace = trace[(trace.t_s > SETTLED_S) & (trace.t_s < MOVING_S)]
        yield _compare(case, trace)


def _compare(case: Case, trace: Any) -> Fidelity:
    """Compare the force sent with the one asked for, clamped in the same direction."""
    asked_n = np.linalg.norm(trace.asked_n, axis=1)
    clamped_n = trace.asked_n * np.minimum(1.0, FORCE_LIMIT_N / np.maximum(asked_n, 1e-12))[:, None]
    force_n = np.linalg.norm(clamped_n, axis=1)
    off_n = np.linalg.norm(trace.sent_n - clamped_n, axis=1)
    return Fidelity(
        case.liquid,
        case.rate_hz,
        case.delay,
        float(np.sqrt(np.mean(off_n**2))),
        float(np.sqrt(np.mean(force_n**2))),
        float(np.mean(off_n > np.maximum(RELATIVE * force_n, ABSOLUTE_N))),
    )
