"""What must hold with every effect at once, whatever the rate and however the path is turned."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from study_app.haptics.model.effects.current import Channel, Uniform, Vortex
from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.motion import Motion
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import COMPILED, EVERYTHING, PLACES, POOL, UNBENT, examples, liquid, moving, scene, vectors

LAWS = ("constant", "schiller-naumann", "haider-levenspiel", "brown-lawler")


def turned(vector, angle):
    """Return vectors (n, 3) turned about the vertical."""
    tick = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    return np.asarray(vector) @ tick.T


@pytest.mark.skipif(not COMPILED, reason="seconds of motion are for compiled code")
@pytest.mark.parametrize("rate_hz", [500.0, 2000.0])
@pytest.mark.parametrize("felt", EVERYTHING.values(), ids=EVERYTHING)
def test_half_and_double_the_rate_feel_the_same(felt, rate_hz):
    def stroke(hz):
        t_s = np.arange(round(3 * hz) + 1) / hz
        x, y, z = 0.15 * np.sin(4 * t_s), -0.02 - 0.06 * np.cos(5 * t_s), 0.12 * np.sin(3 * t_s)
        vx, vy, vz = 0.6 * np.cos(4 * t_s), 0.3 * np.sin(5 * t_s), 0.36 * np.cos(3 * t_s)
        return Motion(t_s, np.column_stack([x, y, z]), np.column_stack([vx, vy, vz]))

    usual = vectors(simulate(felt, stroke(1000.0)), "force")[:3000:2]
    other = vectors(simulate(felt.model_copy(update={"rate_hz": rate_hz}), stroke(rate_hz)), "force")
    same = other[(np.arange(0, 3000, 2) * rate_hz / 1000).astype(int)]
    largest = np.linalg.norm(usual, axis=1).max()
    error = np.linalg.norm(same - usual, axis=1)
    # A border is met a tick sooner or later: there alone the force may differ by more.
    assert np.quantile(error, 0.98 if len(felt.liquids) > 1 else 1.0) <= 0.02 * largest


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


@pytest.mark.slow
@settings(max_examples=examples(60), deadline=None)
@given(
    velocity=st.tuples(*[st.sampled_from([0.0, 5e-324, 1e-310, 1e-160, 1e-9, -1.0, 100.0])] * 3),
    law=st.sampled_from(LAWS),
    effects=st.sampled_from(
        [("drag",), ("unsteady_drag",), ("drag", "added_mass", "history"), ("drag", "wake"), ("drag", "local_wake")]
    ),
)
def test_the_smallest_and_the_fastest_motions_have_a_finite_force(velocity, law, effects):
    fields = {"effects": effects, "drag": Drag(law=law), "wake": POOL.wake, "local_wake": POOL.local_wake}
    viscous = POOL.model_copy(update=fields)
    felt = simulate(scene(viscous), moving([velocity] * 4 + [(0.0, 0.0, 0.0)] * 2))
    assert np.isfinite(vectors(felt, "force")).all()
    assert (np.linalg.norm(vectors(felt, "device"), axis=1) <= 8 * (1 + 1e-12)).all()


def test_after_a_long_rest_next_to_nothing_is_left():
    resting = liquid(
        1400.0,
        viscosity_pa_s=2.0,
        effects=("drag", "wake", "added_mass", "history"),
        wake={"length": 50, "scaling": 50},
    )
    moved = np.zeros((9000 if COMPILED else 900, 3))
    moved[5:60] = [0.5, 0.0, 0.0]
    felt = simulate(scene(resting), moving(moved))
    assert not felt.wake_x_mps[-1]
    assert abs(felt.fx_n[-1]) < 1e-3 * abs(felt.fx_n[30])
