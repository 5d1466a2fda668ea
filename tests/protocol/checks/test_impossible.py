"""Studies that could be read, but in which nothing would be felt, nothing would differ, or no trial could end."""

import numpy as np
import pytest

from study_app.haptics.model.motion import Motion
from study_app.protocol.checks.consistency import LEAST_N, force_n
from study_app.protocol.checks.warnings import warnings
from study_app.protocol.load import load, parse
from study_app.protocol.source.files import shipped, source_bytes
from study_app.protocol.trials.tasks import Explore, Stroke
from tests.compiled import needs_servo


@needs_servo
@pytest.mark.parametrize("name", shipped())
def test_the_estimated_force_is_near_that_of_the_model(name: str) -> None:
    """The estimate decides whether anything is felt; the compiled model says what is."""
    from study_app.haptics.runtime.offline import simulate

    protocol = load(name)
    stroke = Explore(kind="explore", min_s=1, max_s=2, instruction="x").fastest_stroke(protocol.device.workspace_m)
    assert stroke == Stroke(5.0, 0.03)
    for condition in protocol.conditions:
        weak = protocol.scene_for(condition)
        weak = weak.model_copy(update={"scale": weak.scale / 5, "force_limit_n": 20.0})  # below every limit
        t_s = np.arange(2000) / weak.rate_hz
        along_m = weak.scale * stroke.amplitude_m * np.cos(2 * np.pi * stroke.frequency_hz * t_s)
        found = simulate(weak, Motion(t_s, np.column_stack((along_m, 0 * t_s, 0 * t_s))))
        peak_n = float(np.sqrt(found.fx_n**2 + found.fy_n**2 + found.fz_n**2).max())
        assert LEAST_N < peak_n < 3 * force_n(weak, stroke) < 20 * peak_n, condition


@pytest.mark.parametrize(
    ("study", "old", "new", "device", "place"),
    [
        ("viscosityjnd", 'ball = "hidden"', 'ball = "hidden"\ndelay_ms = 50', "", "conditions.damper.delay_ms"),
        ("delaydetect", "[conditions.water]", "[conditions.water]", "Mouse", ""),
        ("forcedelay", "format = 2", "format = 2", "Mouse", "stimuli.delay.vary: Mouse gives no force"),
        ("forcedelay", "damping_nspm = 4", "damping_nspm = 0.01", "", "stimuli.delay.vary: the condition gives no"),
        ("demo", "format = 1", "format = 1", "Mouse", "blocks.liquids: Mouse gives no force: participants see"),
        ("viscosityjnd", "format = 2", "format = 2", "Mouse", "blocks.viscosity: Mouse gives no force, and the"),
    ],
)
def test_a_condition_that_nobody_can_perceive_is_warned_of(
    study: str, old: str, new: str, device: str, place: str
) -> None:
    text = source_bytes(study).decode()
    assert old in text
    found = warnings(parse(text.replace(old, new, 1).encode(), study), simulates=False, without_force=device)
    perceived = [one for one in found if "gives no force" in one or "ball is hidden" in one]
    assert [one for one in perceived if one.startswith(place)] if place else perceived == []
    assert not [one for one in warnings(load(study), simulates=False) if one in perceived]
