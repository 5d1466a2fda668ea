"""Check whether the safety layer can deliver the levels of liquids with inertia while the hand follows a target.

Added mass and history return energy to the hand, which the safety layer permits only in part. How much it permits
depends on the motion, so that the motion of the target is simulated.
"""

from collections.abc import Iterator

import numpy as np

from study_app.haptics.model.effects import EFFECTS
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.motion import Motion
from study_app.haptics.runtime.offline import samples_along
from study_app.protocol.model import Follow, Protocol
from study_app.protocol.presented import extreme_levels
from study_app.protocol.trials import OF_CONDITION, Stimulated
from study_app.store.session_progress import broken_interval_limits, delivered_values, judged_fields

_INERTIAL = {effect.name for effect in EFFECTS if effect.damping_nspm is not None}


def undelivered_levels(protocol: Protocol) -> Iterator[str]:
    """Yield a sentence for each stimulus whose lowest or highest level would never be delivered."""
    for block in protocol.blocks.values():
        task, key = protocol.tasks[block.task], f"stimuli.{block.stimulus}.levels"
        if block.stimulus is None or not isinstance(task, Follow):
            continue
        stimulus = protocol.stimulus_of(block)
        if stimulus.vary in OF_CONDITION:
            continue
        times_s = np.arange(round(task.limit_s * protocol.device.rate_hz)) / protocol.device.rate_hz
        hand_m, missed = np.array([task.target_m(time_s) for time_s in times_s.tolist()]), list[str]()
        for standard, level, scene in extreme_levels(protocol, block):
            if not any(_INERTIAL & set(liquid.effects) for liquid in resolve(scene).liquids):
                continue
            presented = Stimulated(protocol.condition_of(stimulus), stimulus.vary, stimulus.comparison(standard, level))
            samples = judged_fields(samples_along(scene, Motion(times_s, scene.origin_m + scene.scale * hand_m)))
            samples["time_ns"], samples["position_m"] = np.rint(1e9 * times_s), hand_m
            delivery = delivered_values(protocol, presented, task, samples)
            if "level_error_percent" in broken_interval_limits(protocol.limits, presented, task, delivery):
                missed.append(f"{level:.3g}")
        if missed:
            yield (
                f"{key}: level{'s' * (len(missed) > 1)} {' and '.join(missed)} cannot be rendered if the hand "
                "follows the target, because the safety layer removes energy that the liquid returns. Trials at these "
                "levels would be repeated and never answered. Choose a smaller scene.scale, or effects "
                "without added_mass, history and unsteady_drag"
            )
