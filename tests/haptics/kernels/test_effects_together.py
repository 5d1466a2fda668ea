"""What must hold with every effect at once, whatever the rate and however the path is turned."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from study_app.haptics.model.effects.current import Channel, Uniform, Vortex
from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.motion import Motion
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import PLACES, POOL, UNBENT, examples, scene, vectors

LAWS = ("constant", "schiller-naumann", "haider-levenspiel", "brown-lawler")


def turned(vector, angle):
    """Return vectors (n, 3) turned about the vertical."""
    tick = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    return np.asarray(vector) @ tick.T


@pytest.mark.slow
@settings(max_examples=examples(30), deadline=None)
@given(angle=st.floats(0, 2 * np.pi), seed=st.integers(0, 2**32 - 1), law=st.sampled_from(LAWS))
@example(angle=np.pi / 2, seed=0, law="brown-lawler")
@pytest.mark.parametrize("places", [False, True], ids=["tail", "places"])
@pytest.mark.parametrize("kind", ["uniform", "channel", "vortex"])
def test_turning_everything_about_the_vertical_turns_the_force(places, kind, angle, seed, law):
    random = np.random.default_rng(seed)
    pieces = np.repeat(random.normal(size=(6, 3)), 12, axis=0) * [1.0, 0.05, 1.0]
    velocity = 0.4 * pieces + 0.02 * random.normal(size=(72, 3))
    position = np.array([0.02, -0.01, 0.03]) + np.cumsum(velocity * 1e-3, axis=0)

    def felt(by):
        centre = (0.1, 0.0, 0.2)
        current = {
            "uniform": Uniform(velocity_mps=tuple(turned((0.3, 0.1, -0.2), by))),
            "channel": Channel(
                centre_m=tuple(turned(centre, by)), heading_deg=np.degrees(by) % 360, width_m=1.0, peak_mps=0.4
            ),
            "vortex": Vortex(centre_m=tuple(turned(centre, by)), core_m=0.2, peak_mps=0.4),
        }[kind]
        base = PLACES if places else POOL
        effects = tuple(one for one in base.effects if one != "buoyancy")
        wake = base.wake.model_copy(update={"breaking_angle_deg": 52.3})  # at a threshold rounding decides
        fields = {"effects": effects, "current": current, "wake": wake, "drag": Drag(law=law)}
        one = base.model_copy(update=fields)
        times_s = np.arange(72) / 1000
        motion = Motion(times_s, turned(position, by), turned(velocity, by))
        return vectors(simulate(scene(one, knee=UNBENT), motion), "force")

    straight = felt(0.0)
    assert felt(angle) == pytest.approx(turned(straight, angle), abs=1e-12 * max(abs(straight).max(), 1))
