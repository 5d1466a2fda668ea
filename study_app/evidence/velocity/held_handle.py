"""The force in closed loops: a hand holds the handle, and the force of the effects is compared with that of the law.

The law is the same scene on the handle's true motion, velocities given. The comparison leaves out what safety
withholds, and buoyancy and weight, which need no velocity. The error is the RMS of the difference over the RMS of the
law's force.
"""

import math
from collections.abc import Iterable
from typing import Any, Final

import numpy as np

from study_app.evidence.scene_variants import without_buoyancy
from study_app.evidence.stability.closed_loop import LOOP, TRACE, follow
from study_app.evidence.stability.device_bench import FORCE_LIMIT_N
from study_app.evidence.stability.stability_cases import GRIPS, Grip, scenes
from study_app.evidence.velocity.imposed_motions import COUNT_M, RATE_HZ, Stroke
from study_app.haptics.kernels.plant import new_handle
from study_app.haptics.kernels.safety import new_safety
from study_app.haptics.kernels.tick_schedule import new_schedule
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.layout import SAMPLE, records
from study_app.haptics.model.motion import Floats, Motion
from study_app.haptics.model.scene import Knee, Liquid, Scene, Velocity
from study_app.haptics.runtime.offline import simulate
from study_app.haptics.runtime.pack import pack

HANDS: Final = ("light", "middle", "firm")
DELAY: Final = 1
HANDLE_KG: Final = 0.1
FRICTION_NSPM: Final = 0.5
LASTS_S: Final = 4.0
SETTLED_S: Final = 1.5
DIRECTION: Final = np.array([0.8, 0.0, 0.6])

STROKES: Final = tuple(Stroke(0.02, hz) for hz in (1.0, 2.0, 3.0))
QUICK: Final = Stroke(0.01, 5.0)
DAMPING_NSPM: Final = 20.0
WHOLE: Final = Stroke(0.02, 1.6)
WHOLE_SCALE: Final = 3.0
WHOLE_LIQUIDS: Final = ("water", "glycerin", "honey", "gear_oil")


def plain_forces() -> tuple[Scene, ...]:
    """Return a damper of 20 N·s/m and a drag of 85 N·s²/m² at the hand: the thesis' water without its wake."""
    damper = Liquid(id="damper", density_kg_m3=1000, drag=Drag(law="linear", damping_nspm=DAMPING_NSPM))
    quadratic = Liquid(id="quadratic", density_kg_m3=1000, effects=("drag",))
    return Scene(scale=1, liquids=(damper,), knee=Knee(law="none")), Scene(scale=10, liquids=(quadratic,))


def whole_forces() -> tuple[Scene, ...]:
    """Return the liquids of physical2, effects chosen, without buoyancy."""
    return tuple(
        without_buoyancy(scenes()[f"physical2_{name}"].model_copy(update={"scale": WHOLE_SCALE}))
        for name in WHOLE_LIQUIDS
    )


def plain_errors(velocity: Velocity, strokes: Iterable[Stroke] = STROKES) -> tuple[float, ...]:
    """Return the error [%] of each plain force, in each grip and stroke."""
    return tuple(
        error(scene, velocity, GRIPS[hand], stroke) for scene in plain_forces() for hand in HANDS for stroke in strokes
    )


def error(scene: Scene, velocity: Velocity, grip: Grip, stroke: Stroke) -> float:
    """Return the error of a scene's force [%] in a loop of one tick of delay."""
    trace = _held(scene.model_copy(update={"velocity": velocity}), grip, stroke)
    motion = Motion(trace.t_s, scene.scale * trace.position_m, scene.scale * trace.velocity_mps)
    law = simulate(scene, motion)
    law_n = np.column_stack([law.fx_n, law.fy_n, law.fz_n])
    counted = trace.t_s >= SETTLED_S
    off_n, right_n = (trace.asked_n - law_n)[counted], law_n[counted]
    return 100 * math.sqrt(float(np.sum(off_n**2) / np.sum(right_n**2)))


def _held(scene: Scene, grip: Grip, stroke: Stroke) -> Any:
    """Return the trace of a handle that a hand moves along a stroke."""
    handle = new_handle(
        mass_kg=HANDLE_KG,
        viscous_nspm=FRICTION_NSPM,
        hand_kg=grip.mass_kg,
        stiffness_npm=grip.stiffness_npm,
        damping_nspm=grip.damping_nspm,
        quantum_m=COUNT_M,
        motor_limit_n=FORCE_LIMIT_N,
        delay=DELAY,
    )
    trace = records(TRACE, round(LASTS_S * RATE_HZ))
    path_m: Floats = np.outer(stroke.places_m(np.arange(len(trace)) / RATE_HZ), DIRECTION)
    safety = new_safety(FORCE_LIMIT_N, DELAY)
    safety[0].fade = 1.0
    loop = records(LOOP, 1)[0]
    loop.safe = 1
    dynamics = Dynamics(DELAY / RATE_HZ, COUNT_M, HANDLE_KG)
    model = pack(scene, dynamics=dynamics)
    follow(model, safety[0], records(SAMPLE, 1)[0], handle, new_schedule(1 / RATE_HZ), loop, trace, path_m)
    return trace
