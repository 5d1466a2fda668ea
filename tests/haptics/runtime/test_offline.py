import numpy as np
import pytest

from study_app.haptics.model.layout import LIMITER_SLEW
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.overrides import override_all
from study_app.haptics.model.paths import circle, line, path, reach, reverse, zigzag
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import SLEW_N
from study_app.haptics.runtime.offline import COLUMNS, simulate
from study_app.store.tables.csv_files import write_columns
from tests.haptics.scenes import HONEY, WATER, WATER_FACTOR, moving, scene, vectors

# The settings of the thesis' figures 3 to 8.
FIGURES = {"length": 5000, "scaling": 5000, "exponent": 1, "breaking_span_m": 0}
FIGURE_TANK = override_all(WATER, FIGURES)
DRAG_ALONE = override_all(WATER, {"effects": "drag"})
INITIAL_N = WATER_FACTOR  # at 1 m/s


def size(vectors_n):
    """Return lengths (n,)."""
    return np.linalg.norm(vectors_n, axis=1)


def share_along(vectors_n, directions):
    """Return the part of each vector along a direction (n, 3)."""
    return (vectors_n * directions).sum(axis=1)


@pytest.fixture(scope="module")
def circles():
    """The programmed circles, and how many rows move."""
    motion = path("circle")
    return motion, int((size(motion.velocity_mps) > 0).sum())


def test_figure_3_drag_alone_is_constant_and_ends_with_the_motion(circles):
    motion, moving_rows = circles
    force = vectors(simulate(DRAG_ALONE, motion), "force")
    assert size(force[:moving_rows]) == pytest.approx(INITIAL_N)
    against = -motion.velocity_mps[:moving_rows]
    assert force[:moving_rows] == pytest.approx(INITIAL_N * against)
    assert not force[moving_rows:].any()


def test_figure_4_the_liquid_follows_and_the_drag_falls_as_the_square_of_a_line(circles):
    motion, moving_rows = circles
    table = simulate(FIGURE_TANK, motion)
    relative = size(motion.velocity_mps - vectors(table, "wake"))[:moving_rows]
    assert relative[0] == 1.0
    straight = np.polyfit(np.arange(moving_rows), relative, 1)
    assert straight[0] == pytest.approx(-1 / 5000, rel=0.1)
    assert abs(np.polyval(straight, np.arange(moving_rows)) - relative).max() < 0.01
    assert size(vectors(table, "force")[:moving_rows]) == pytest.approx(INITIAL_N * relative**2)
    opposing = share_along(vectors(table, "force"), motion.velocity_mps)[:moving_rows]
    assert (opposing < 0).all()


@pytest.mark.compiled
def test_figure_4_after_the_stop_the_liquid_pushes_on_and_comes_to_rest(circles):
    motion, moving_rows = circles
    force = vectors(simulate(FIGURE_TANK, motion), "force")
    former = motion.velocity_mps[moving_rows - 1]
    push = force[moving_rows:]
    assert push[0] @ former == pytest.approx(size(push[:1])[0])
    assert 0.8 * INITIAL_N < size(push[:1])[0] < INITIAL_N
    assert (np.diff(size(push)) <= 1e-15).all()
    assert not push[5000:].any()
    assert size(push[:4900]).min() > 0


@pytest.mark.compiled
def test_figure_5_turning_against_the_flow_meets_more_than_plain_drag():
    motion = reverse(1000.0)
    table = simulate(FIGURE_TANK, motion)
    force, v = vectors(table, "force"), motion.velocity_mps
    tick = int(np.argmax(share_along(v[1:], v[:-1]) < 0)) + 1
    assert size(force[tick : tick + 1])[0] > 3 * INITIAL_N
    assert force[tick] @ v[tick] < 0
    stop = int(np.argmin(size(v) > 0))
    assert size(force[stop : stop + 1])[0] > size(force[-1:])[0] == 0


@pytest.mark.compiled
def test_figure_6_a_breaking_angle_above_the_ticks_lets_the_force_fall_further():
    motion = zigzag(1000.0)
    broken = size(vectors(simulate(FIGURE_TANK, motion), "force"))
    whole = size(vectors(simulate(override_all(FIGURE_TANK, {"breaking_angle_deg": 100}), motion), "force"))
    assert broken[-1] > 2 * whole[-1]
    assert whole[-1] == pytest.approx(0.0, abs=0.02)


def test_figure_7_a_coarser_resolution_fills_more_slowly():
    final = [
        simulate(override_all(FIGURE_TANK, {"resolution_m": step}), line(1000.0, moving_s=3.0)).fx_n[-1]
        for step in (0.0, 0.005, 0.02)
    ]
    assert final[2] < final[1] < final[0] < 0


@pytest.mark.compiled
def test_figure_8_a_higher_exponent_builds_slowly_and_gives_way_near_the_end():
    motion = line(1000.0, moving_s=5.0)
    drags = {y: -simulate(override_all(FIGURE_TANK, {"exponent": y, "decay": 1}), motion).fx_n for y in (0.25, 1, 4)}
    assert drags[0.25][500] < drags[1][500] < drags[4][500]
    assert drags[4][2500] > 0.85 * INITIAL_N
    assert [drag[5000] for drag in drags.values()] == pytest.approx([0, 0, 0], abs=1e-5)


def test_the_table_holds_inputs_and_results_by_name():
    motion = moving([(1.0, 2.0, 3.0), (1.0, 2.0, 3.0)])
    table = simulate(HONEY, motion)
    assert table.dtype.names == COLUMNS
    assert COLUMNS[:7] == ("t_s", "x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps")
    assert (table.t_s == motion.t_s).all()
    assert table.z_m == pytest.approx(motion.position_m[:, 2], abs=0)
    assert table.limiters.dtype == np.int64


def test_what_is_sent_is_slewed_from_zero_with_the_start_fade_over():
    table = simulate(WATER, moving(np.tile([1.6, 0.0, 0.0], (3, 1))))
    assert table.device_fx_n[0] == pytest.approx(-SLEW_N)
    assert table.limiters[0] == LIMITER_SLEW
    assert table.device_fx_n[2] == table.fx_n[2]


def test_every_row_is_a_tick_of_its_own_time_not_of_the_rate():
    t_s = np.array([0.0, 0.001, 0.004, 0.5])
    motion = Motion(t_s, np.column_stack([t_s, 0 * t_s, 0 * t_s]))
    v = simulate(scene(), motion).vx_mps
    expected = [0.0]
    for step, elapsed in [(0.001, 1), (0.003, 3), (0.496, 20)]:
        u = step / (elapsed * 1e-3)
        expected.append(expected[-1] + (1 - 0.9**elapsed) * (u - expected[-1]))
    assert v[:3] == pytest.approx(expected[:3])
    # Half a second is taken as 20 ms: 24.8 m/s, lowered by the knee.
    assert v[3] == pytest.approx(5 + np.sqrt(1 + 2 * (expected[3] - 5)) - 1)


def test_the_first_tick_takes_the_scenes_period():
    motion = moving([(1.0, 0, 0)] * 2)
    wake = {"length": 10, "scaling": 10}
    slow = override_all(WATER.model_copy(update={"rate_hz": 100.0}), {**wake, "decay": 0.5, "exponent": 1})
    # One element of 1 m/s, stored in a tail of one at 100 Hz.
    assert simulate(slow, motion).wake_x_mps[1] == pytest.approx(1.0)


def test_rest_feels_nothing():
    assert not vectors(simulate(Scene(), reach(1000.0, reaches=1)), "device").any()


def test_a_file_is_as_good_as_a_motion(tmp_path):
    motion = circle(1000.0, rest_s=0.1, revolutions=0.1)
    table = simulate(WATER, motion)
    file = tmp_path / "motion.csv"
    write_columns(file, table[["t_s", "x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps"]])
    assert (simulate(WATER, file) == table).all()
    assert (simulate(WATER, str(file)) == table).all()


def test_simulating_twice_gives_the_same_bits():
    motion = reach(1000.0, reaches=1)
    assert simulate(WATER, motion).tobytes() == simulate(WATER, motion).tobytes()
