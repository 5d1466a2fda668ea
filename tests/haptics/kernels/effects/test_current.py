import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.haptics.model.effects.current import Channel, Uniform, Vortex
from study_app.haptics.model.estimators import Given
from study_app.haptics.model.motion import Motion
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import UNBENT, WATER_FACTOR, examples, liquid, moving, scene, vectors

components = st.floats(-3, 3)
velocities = st.tuples(components, components, components)


def river(current, **fields):
    """Return a scene of flowing water."""
    effects = ("drag", "current", *(("wake",) if "wake" in fields else ()))
    return scene(liquid(current=current, effects=effects, **fields), knee=UNBENT, velocity=Given())


def resting_at(places_m):
    """Return a motion that is at rest at each of these places in turn."""
    places_m = np.asarray(places_m, float)
    return Motion(np.arange(len(places_m)) / 1000, places_m, velocity_mps=np.zeros_like(places_m))


def flow(scene, places_m):
    """Return the velocity of the liquid (n, 3), from the drag on a body that is held there."""
    force = vectors(simulate(scene, resting_at(places_m)), "force")
    size = np.linalg.norm(force, axis=1, keepdims=True)
    return np.divide(force, np.sqrt(size * WATER_FACTOR), out=np.zeros_like(force), where=size > 0)


@pytest.mark.slow
@settings(max_examples=examples(30), deadline=None)
@given(through=st.tuples(components, st.just(0.0), components), current=velocities)
def test_in_its_own_frame_a_river_is_a_pond(through, current):
    wake = {"length": 30, "scaling": 40, "axes": "xyz"}
    path = np.tile(through, (60, 1)) * np.repeat([1.0, 0.3], 30)[:, None]
    pond = simulate(scene(liquid(wake=wake), knee=UNBENT), moving(path))
    river_table = simulate(river(Uniform(velocity_mps=current), wake=wake), moving(path + np.array(current)))
    assert vectors(river_table, "wake") == pytest.approx(vectors(pond, "wake"), abs=1e-12)
    assert vectors(river_table, "force") == pytest.approx(vectors(pond, "force"), abs=1e-11)


@pytest.mark.parametrize(("heading_deg", "along", "across"), [(0, (1, 0, 0), (0, 0, 1)), (90, (0, 0, -1), (1, 0, 0))])
def test_a_channel_is_fastest_midway_and_still_at_its_walls(heading_deg, along, across):
    centre = np.array([0.1, 0.2, 0.3])
    channel = Channel(centre_m=tuple(centre), heading_deg=heading_deg, width_m=0.4, peak_mps=0.5)
    sides = np.array([-0.3, -0.2, -0.1, 0.0, 0.1, 0.19, 0.25])
    places = centre + np.outer(sides, across) + np.outer(np.arange(7), along) + np.outer(np.arange(7), [0, 1, 0])
    expected = 0.5 * np.maximum(1 - (sides / 0.2) ** 2, 0)
    assert flow(river(channel), places) == pytest.approx(np.outer(expected, along), abs=1e-9)


def test_a_vortex_turns_counter_clockwise_seen_from_above_fastest_at_its_core():
    vortex = Vortex(centre_m=(0.1, 0.0, -0.1), core_m=0.2, peak_mps=0.8)
    right, far, behind = (0.3, 5.0, -0.1), (0.1 + 20, 0.0, -0.1), (0.1, 0.0, -0.3)
    flow_mps = flow(river(vortex), [right, behind, far, (0.1, 1.0, -0.1)])
    assert flow_mps[0] == pytest.approx([0, 0, -0.8])
    assert flow_mps[1] == pytest.approx([-0.8, 0, 0])
    assert flow_mps[2] == pytest.approx([0, 0, -0.8 * 2 * 0.2 / 20], rel=1e-3)
    assert flow_mps[3] == pytest.approx([0, 0, 0], abs=1e-12)
    radii = np.linspace(0.01, 1, 100)
    around = flow(river(vortex), [(0.1 + r, 0.0, -0.1) for r in radii])
    assert radii[np.linalg.norm(around, axis=1).argmax()] == pytest.approx(0.2)
