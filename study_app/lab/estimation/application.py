"""Applies an estimate to the selected scene, at once or continuously, within the slope and force limits.

With the constant law of drag, F = c w², the damping F/w grows up to √(F_max c) at the force limit F_max. The drag
coefficient is applied up to the value at which this equals the slope limit of the loop: so no estimate causes the slope
limit to act. The force limit always acts. In continuous application a value changes by at most `MOST_PER_S`. The length
of the wake is only applied at once, because another length clears the wake.
"""

import math
from typing import Final

from study_app.haptics.model.device_dynamics import MOST_DELAY, Dynamics
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import LIGHTER, MEASURED_KG, slope_limit
from study_app.lab.estimation.estimator import Estimate
from study_app.lab.estimation.liquid_model import DRAG, LENGTH, SCALING, values_of

MOST_PER_S: Final = 0.5
"""Greatest rate of change of the logarithm of a value."""
SETTLED: Final = 2e-3
"""A value whose relative difference from the estimate is less than this stays."""


def most_drag_coefficient(scene: Scene, dynamics: Dynamics, device_limit_n: float) -> float:
    """Return the greatest drag coefficient that may be applied to a scene with one liquid: at least its present one."""
    delay = min(dynamics.delay_ticks(scene.rate_hz), MOST_DELAY)
    lighter = min(dynamics.mass_kg / MEASURED_KG, 1.0) ** LIGHTER
    slope_nspm: float = lighter * slope_limit(1 / scene.rate_hz, delay, scene.velocity) / scene.scale
    limit_n = min(device_limit_n, scene.force_limit_n)
    by_one_kg_m: float = 0.5 * scene.liquids[0].density_kg_m3 * math.pi / 4 * scene.body.diameter_m**2
    return float(max(slope_nspm**2 / (limit_n * by_one_kg_m), scene.body.drag_coefficient))


def applicable(scene: Scene, estimate: Estimate, dynamics: Dynamics, device_limit_n: float) -> dict[str, float]:
    """Return the values of an estimate within the limits, by name; none if the motion identifies none."""
    if not estimate.identified:
        return {}
    values = dict(estimate.values)
    values[DRAG] = min(values[DRAG], most_drag_coefficient(scene, dynamics, device_limit_n))
    if SCALING in values:
        length = values.get(LENGTH, values_of(scene).get(LENGTH, 1.0))
        values[SCALING] = max(values[SCALING], length)
    return values


def stepped(
    scene: Scene, estimate: Estimate, dynamics: Dynamics, device_limit_n: float, elapsed_s: float
) -> dict[str, float]:
    """Return the values that continuous application sets next, by name; none without a change."""
    now, most = values_of(scene), MOST_PER_S * elapsed_s
    found = {}
    for name, target in applicable(scene, estimate, dynamics, device_limit_n).items():
        if name == LENGTH or now.get(name, 0.0) <= 0:
            continue
        wanted = max(target, now[LENGTH]) if name == SCALING else target  # the length is not changed
        way = math.log(wanted / now[name])
        if abs(way) > SETTLED:
            found[name] = wanted if abs(way) <= most else now[name] * math.exp(math.copysign(most, way))
    return found
