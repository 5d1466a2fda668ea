"""Figures 3 to 8 of the thesis as programmed motions through the default liquid of its evaluation.

Rek 2024, §5.1: density 1000 kg/m³, a ball of 68 mm, N = S = 5000, y = 1, λ = 0.999975, breaking angle 45° between
neighbouring elements; motions at 1 m/s with their exact velocity.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np

from study_app.haptics.model import paths
from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Given, Liquid, Scene
from study_app.haptics.runtime.offline import Table, simulate

RATE_HZ: Final = 1000.0
LENGTH: Final = 5000
RESOLUTIONS_M: Final = (0.0, 1.5e-3, 3.5e-3)
"""Of Fig. 7: at 1 m/s every tick, every second and every fourth one leaves an element."""
EXPONENTS: Final = (0.25, 0.5, 1.0, 2.0, 4.0)


@dataclass(frozen=True, eq=False)
class Run:
    """One motion through one liquid; ``label`` names it in its figure."""

    label: str
    scene: Scene
    motion: Motion

    @cached_property
    def table(self) -> Table:
        """What is felt, a row a tick (see ``offline.simulate``)."""
        return simulate(self.scene, self.motion)


@dataclass(frozen=True, eq=False)
class ThesisFigure:
    """What a figure shows: its runs, when something happens in them [s], and what it states."""

    number: int
    title: str
    caption: str
    runs: tuple[Run, ...]
    events: tuple[tuple[float, str], ...] = ()

    @property
    def name(self) -> str:
        """Name of its files."""
        return f"figure-{self.number}"


def tank(**wake: Any) -> Scene:
    """Return the evaluation's liquid; ``wake`` changes parameters of its tail."""
    tail = Wake(**{"length": LENGTH, "scaling": LENGTH, "breaking_span_m": 0.0, **wake})
    return _scene(Liquid(id="liquid", density_kg_m3=1000, effects=("drag", "wake"), wake=tail))


def _scene(liquid: Liquid) -> Scene:
    return Scene(rate_hz=RATE_HZ, velocity=Given(), liquids=(liquid,))


def figure_3() -> ThesisFigure:
    """Return Fig. 3: three circles with drag alone."""
    motion = paths.circle(RATE_HZ)
    return ThesisFigure(
        3,
        "Three circles, drag alone",
        "The body performs three circles at constant speed and stops. With drag alone the force keeps its size, always "
        "opposes the motion, and is zero on the tick after the stop.",
        (Run("drag", _scene(Liquid(id="liquid", density_kg_m3=1000)), motion),),
        ((_stop_s(motion), "stop"),),
    )


def figure_4() -> ThesisFigure:
    """Return Fig. 4: three circles with the wake."""
    motion = paths.circle(RATE_HZ)
    return ThesisFigure(
        4,
        "Three circles, drag and wake",
        "The same motion with the wake. The liquid takes up the motion: the speed relative to it falls linearly while "
        "the tail fills, and the force as its square. After the stop the liquid pushes on along the former motion, a "
        "little weaker than the drag at first, and falls to zero as the tail empties.",
        (Run("drag and wake", tank(), motion),),
        ((_stop_s(motion), "stop"),),
    )


def figure_5() -> ThesisFigure:
    """Return Fig. 5: three circles, then against the flow."""
    motion = paths.reverse(RATE_HZ)
    turn_s = _stop_s(paths.circle(RATE_HZ))
    return ThesisFigure(
        5,
        "Three circles, then 2 s against the flow",
        "After the circles the body turns back against the whirlpool it has made: the force jumps far above the plain "
        "drag, then falls as the tail takes up the new direction, and falls again after the stop.",
        (Run("drag and wake", tank(), motion),),
        ((turn_s, "turn back"), (_stop_s(motion), "stop")),
    )


def figure_6() -> ThesisFigure:
    """Return Fig. 6: steps that alternate by 90°, with two breaking angles."""
    motion = paths.zigzag(RATE_HZ)
    return ThesisFigure(
        6,
        "Steps alternating by 90°",
        "The body moves toward −z in steps that alternate along x. With a breaking angle of 45° every step begins a "
        "segment of its own, their directions partly cancel, and the wake stays limited. With 100° the whole path is "
        "one segment that always follows the newest direction, one tick late at each turn, and the force falls toward "
        "zero.",
        tuple(Run(f"breaking angle {angle}°", tank(breaking_angle_deg=angle), motion) for angle in (45, 100)),
    )


def figure_7() -> ThesisFigure:
    """Return Fig. 7: a straight line at three resolutions of the tail."""
    motion = paths.line(RATE_HZ, moving_s=12.0)
    labels = ("every tick", "1.5 mm", "3.5 mm")
    return ThesisFigure(
        7,
        "A straight line at three resolutions of the tail",
        "The body moves straight at constant speed. A coarser resolution stores fewer elements (here every second, "
        "every fourth tick), so the tail fills more slowly and the force falls later.",
        tuple(Run(label, tank(resolution_m=step), motion) for label, step in zip(labels, RESOLUTIONS_M, strict=True)),
    )


def figure_8() -> ThesisFigure:
    """Return Fig. 8: a straight line with five responses of the wake."""
    motion = paths.line(RATE_HZ, moving_s=8.0)
    return ThesisFigure(
        8,
        "A straight line with five responses of the wake",
        "The body moves straight at constant speed. The wake builds up as the share of the tail that is filled, "
        "to the power y: y below 1 gives way at once, y = 4 keeps the full drag for long and gives way near the end. "
        "The decay of the elements leaves all of them a little below the speed of the body.",
        tuple(Run(f"y = {exponent:g}", tank(exponent=exponent), motion) for exponent in EXPONENTS),
    )


FIGURES: Final[tuple[Callable[[], ThesisFigure], ...]] = (figure_3, figure_4, figure_5, figure_6, figure_7, figure_8)


def _stop_s(motion: Motion) -> float:
    """Return the time of the first tick from which the body no longer moves [s]."""
    rests = ~np.diff(motion.position_m, axis=0).any(axis=1)
    return float(motion.t_s[int(np.argmax(rests))])
