"""Measure computation time and accuracy of a scene with one liquid, fast enough for use while it is presented."""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from study_app.evidence import reference_model
from study_app.evidence.appraisal import Costs, DeliveryQuestion, EffectCost, Errors, Question
from study_app.evidence.cost import measure
from study_app.haptics.model.device_dynamics import ASSUMED_TICKS, Dynamics
from study_app.haptics.model.effects import NAMED
from study_app.haptics.model.gate import effect_verdicts, resolve
from study_app.haptics.model.motion import Motion, programmed_motion
from study_app.haptics.model.scene import Effect, Everywhere, Knee, Scene
from study_app.haptics.runtime.offline import samples_along, simulate
from study_app.protocol.trials import Stroke
from study_app.session.preflight import PredictedDelivery
from study_app.session.simulated.predicted_delivery import predicted_delivery
from study_app.workers.server import Send, Stop

_BATCHES: Final = 60
_RAMP_MPS2: Final = 2.0
_RAMP_S: Final = 0.5
_COMPARED: Final[tuple[Effect, ...]] = ("drag", "wake")
_MOTIONS: Final = (
    ("reverse", {"revolutions": 1.0, "against_s": 0.7, "rest_s": 0.5}),
    ("zigzag", {"leg_s": 0.25, "legs": 8.0}),
)
_DURATION_S: Final = 2.0
_HAND_M: Final = 0.03
_HAND_HZ: Final = 2.0
_FINE_COUNT_M: Final = 10e-6
"""Encoder count that is assumed for a device with an unknown one [m]; finer than the default."""


def costs(scene: Scene, *, batches: int = _BATCHES) -> Costs:
    """Measure the computation time of a scene with one liquid."""
    cost = measure(scene, batches=batches)
    liquid = resolve(scene).liquids[0]
    are_requested = scene.liquids[0].effects != "auto"
    bounds_n = {verdict.effect: verdict.bound_n for verdict in effect_verdicts(scene)}
    rows = []
    for effect in NAMED:
        ns = cost.effects_ns.get((liquid.id, effect))
        if effect in liquid.effects and ns is not None:
            rows.append(EffectCost(effect, max(ns, 0.0)))
        else:
            reason = f"out, {bounds_n[effect]:.2f} N" if effect in bounds_n else "not used"
            rows.append(EffectCost(effect, None, "not used" if are_requested else reason))
    return Costs(cost.scene_ns, cost.rest_ns, tuple(rows))


def errors(scene: Scene) -> Errors:
    """Return the errors of a one-liquid scene against the definition of its drag and wake."""
    scene = resolve(scene)
    liquid = scene.liquids[0]
    compared_effects = tuple(effect for effect in liquid.effects if effect in _COMPARED)
    compared_liquid = liquid.model_copy(update={"effects": compared_effects, "region": Everywhere()})
    compared = scene.model_copy(update={"liquids": (compared_liquid,), "origin_m": (0.0, 0.0, 0.0)})
    wake: float | None = None
    force_n: float | None = None
    if compared_effects:
        differences = [
            _largest_differences(compared, programmed_motion(name, rate_hz=scene.rate_hz, **parameters))
            for name, parameters in _MOTIONS
        ]
        force_n = max(newtons for _, newtons in differences)
        wake = max(proportion for proportion, _ in differences) if "wake" in compared_effects else None
    left_out = tuple(effect for effect in liquid.effects if effect not in compared_effects)
    return Errors(wake=wake, force_n=force_n, lag_s=_filter_lag_s(scene), left_out=left_out)


def _filter_lag_s(scene: Scene) -> float:
    """Return the lag of a scene's velocity [s] under constant acceleration: (v − v_filtered)/a."""
    t_s = np.arange(round(_RAMP_S * scene.rate_hz) + 1) / scene.rate_hz
    zeros = np.zeros_like(t_s)
    motion = Motion(t_s, np.column_stack([0.5 * _RAMP_MPS2 * t_s**2, zeros, zeros]))
    without_liquids = scene.model_copy(update={"liquids": (), "knee": Knee(law="none"), "origin_m": (0.0, 0.0, 0.0)})
    table = simulate(without_liquids, motion)
    settled = len(t_s) // 4  # rows at the end of the motion, where the filter has settled
    return float(np.mean(_RAMP_MPS2 * t_s[-settled:] - table["vx_mps"][-settled:])) / _RAMP_MPS2


def velocity_errors(scene: Scene, dynamics: Dynamics) -> tuple[float, float]:
    """Return the relative RMS velocity error on a device, and on the same device with fully known dynamics.

    The hand moves by `_HAND_M` at `_HAND_HZ`. An unknown encoder count is assumed to be `_FINE_COUNT_M`, an unknown
    delay one tick.
    """
    known = dynamics._replace(
        delay_s=ASSUMED_TICKS / scene.rate_hz if dynamics.delay_s is None else dynamics.delay_s,
        count_m=_FINE_COUNT_M if "count_m" in dynamics.assumed else dynamics.count_m,
        assumed=(),
    )
    return _velocity_error(scene, dynamics, known.count_m), _velocity_error(scene, known, known.count_m)


def _velocity_error(scene: Scene, dynamics: Dynamics, count_m: float) -> float:
    t_s = np.arange(round(_DURATION_S * scene.rate_hz)) / scene.rate_hz
    turns = 2.0 * math.pi * _HAND_HZ * t_s
    zeros = np.zeros_like(t_s)
    counted_m = scene.scale * count_m * np.rint(_HAND_M * np.sin(turns) / count_m)
    without_liquids = scene.model_copy(update={"liquids": (), "knee": Knee(law="none"), "origin_m": (0.0, 0.0, 0.0)})
    samples = samples_along(without_liquids, Motion(t_s, np.column_stack([counted_m, zeros, zeros])), dynamics)
    true_mps = scene.scale * _HAND_M * 2.0 * math.pi * _HAND_HZ * np.cos(turns)
    settled = len(t_s) // 4
    error_mps = samples["velocity_mps"][settled:, 0] - true_mps[settled:]
    return float(np.sqrt(np.mean(error_mps**2) / np.mean(true_mps[settled:] ** 2)))


def _largest_differences(scene: Scene, motion: Motion) -> tuple[float, float]:
    """Return the largest wake difference, as a fraction of Σ|e|/S, and force difference [N] along a motion."""
    table = simulate(scene, motion)
    reference = reference_model.respond(scene, motion)
    wake_mps = np.column_stack([table[f"wake_{axis}_mps"] for axis in "xyz"])
    force_n = np.column_stack([table[f"f{axis}_n"] for axis in "xyz"])
    largest_mps = float(reference.size_mps.max())
    difference_mps = float(np.linalg.norm(wake_mps - reference.wake_mps, axis=1).max())
    proportion = difference_mps / largest_mps if largest_mps > 0 else 0.0
    return proportion, float(np.linalg.norm(force_n - reference.force_n, axis=1).max())


def withheld_share(scene: Scene, stroke: Stroke, dynamics: Dynamics) -> float:
    """Return Σ|F_a - F_b| / Σ|F_a| along a prescribed stroke that starts at rest; 0 without a force.

    The stroke is centred on the device's origin, and the loop has these ``dynamics``. F_a is the force after norm clamp
    and fades, F_b the force after slope limits, passivity controller and slew limit.
    """
    t_s = np.arange(round(_DURATION_S * scene.rate_hz)) / scene.rate_hz
    along_m = scene.scale * stroke.amplitude_m * np.cos(2.0 * math.pi * stroke.frequency_hz * t_s)
    zeros = np.zeros_like(t_s)
    position_m = np.add(scene.origin_m, np.column_stack((along_m, zeros, zeros)))
    samples = samples_along(scene, Motion(t_s, position_m), dynamics)
    permitted_n = float(samples["permitted_n"].sum())
    return float(samples["withheld_n"].sum()) / permitted_n if permitted_n > 0.0 else 0.0


def appraise(question: Question | DeliveryQuestion, send: Send, stop: Stop) -> Errors | PredictedDelivery | None:
    """Send the `Costs` of a scene, then return its `Errors`; None if another question is waiting.

    For a study, return the trials that would not be delivered.
    """
    if stop():
        return None
    if isinstance(question, DeliveryQuestion):
        return predicted_delivery(question.protocol, question.delay_ticks)
    send(costs(question.scene))
    if stop():
        return None
    stroke = question.stroke
    proportion = withheld_share(question.scene, stroke, question.dynamics) if stroke is not None else None
    velocity = velocity_errors(question.scene, question.dynamics) if question.dynamics.unknown else None
    return replace(errors(question.scene), withheld=proportion, velocity=velocity)
