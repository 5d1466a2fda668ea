"""What check reports of paced motions: each row with its line and hint."""

from collections.abc import Iterable

import numpy as np
import pytest

from study_app.haptics.model.estimators import Ewma, Given, Kalman, Raw
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import steady_force
from study_app.haptics.runtime.offline import simulate
from study_app.protocol.checks.force_limits import fastest_hz, passed_share
from study_app.protocol.load import parse
from study_app.protocol.model import Protocol
from study_app.protocol.presented.presented_levels import FASTER
from study_app.protocol.trials.tasks import Follow
from tests.haptics.scenes import UNBENT, scene
from tests.protocol.edited_studies import text_of

STUDY = text_of("pace")
HIDDEN = ('liquid = "damper"\n[tasks', 'liquid = "damper"\nball = "hidden"\n[tasks')


def study(edits: Iterable[tuple[str, str]]) -> Protocol:
    text = STUDY
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    return parse(text.encode(), "pace.toml")


@pytest.mark.parametrize(
    "edits",
    [
        [],
        [("[8]", "[32]"), ("amplitude_mm = 25", "amplitude_mm = 20.7")],
        [("[8]", "[32]"), ("amplitude_mm = 25", "amplitude_mm = 25\nfrequency_hz = 0.82")],
        [("[8]", "[33.1]"), ("amplitude_mm = 25", "amplitude_mm = 20")],
        [("amplitude_mm = 25", "amplitude_mm = 10\nfrequency_hz = 1.6")],
        [HIDDEN],
    ],
)
def test_the_suggested_pace_passes_the_check_without_clipping(edits: list[tuple[str, str]]) -> None:
    protocol = study(edits)
    task = protocol.tasks["stir"]
    assert isinstance(task, Follow)
    stimulus = protocol.stimuli["damping"]
    strongest = stimulus.comparison(stimulus.standards[0], stimulus.levels[1])
    scene = protocol.scene_for("damper")
    damper = scene.liquids[0]
    drag = damper.drag.model_copy(update={"damping_nspm": strongest})
    damped_scene: Scene = scene.model_copy(update={"liquids": (damper.model_copy(update={"drag": drag}),)})
    assert steady_force(damped_scene, FASTER * task.fastest_stroke((0.1, 0.06, 0.06)).speed_mps).limit is None


SWINGS = 4


def measured_share(velocity, rate_hz, frequency_hz):
    """Return Σ v̂v / Σ v² over whole swings, once the estimator has settled."""
    t_s = np.arange(round(rate_hz * (SWINGS + 2) / frequency_hz)) / rate_hz
    omega = 2 * np.pi * frequency_hz
    still = np.zeros_like(t_s)
    path = Motion(t_s, np.column_stack([0.1 * np.sin(omega * t_s), still, still]))
    velocities = simulate(scene(velocity=velocity, rate_hz=rate_hz, knee=UNBENT), path).vx_mps
    true = 0.1 * omega * np.cos(omega * t_s)
    whole = slice(round(2 * rate_hz / frequency_hz), None)
    return np.sum(velocities[whole] * true[whole]) / np.sum(true[whole] ** 2)


@pytest.mark.compiled
@pytest.mark.parametrize("frequency_hz", [0.5, 1.0, 4.0])
@pytest.mark.parametrize("rate_hz", [500.0, 1000.0])
@pytest.mark.parametrize("velocity", [Ewma(), Ewma(alpha=0.02), Raw()], ids=str)
def test_the_share_is_that_of_the_estimator(velocity, rate_hz, frequency_hz):
    share = passed_share(velocity, rate_hz, frequency_hz)
    assert share == pytest.approx(measured_share(velocity, rate_hz, frequency_hz), abs=1e-3)


def test_the_usual_estimator_passes_99_percent_up_to_1_6_hz():
    assert passed_share(Ewma(), 1000, 3) == pytest.approx(0.969, abs=5e-4)
    assert fastest_hz(Ewma(), 1000, 0.99) == pytest.approx(1.68, abs=0.02)


def test_a_known_velocity_is_passed_whole_and_a_window_is_judged_at_its_full_length():
    assert passed_share(Given(), 1000, 5) == 1
    assert 0.99 < passed_share(Kalman(), 1000, 5) < 1
