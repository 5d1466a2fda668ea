import numpy as np
import pytest

from study_app.haptics.model.motion import Motion, circle
from study_app.haptics.runtime.offline import simulate
from study_app.store.files.csv_files import write_columns
from tests.haptics.scenes import WATER, scene

# The settings of the thesis' figures 3 to 8.


def test_every_row_is_a_tick_at_its_own_time():
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


def test_a_file_is_as_good_as_a_motion(tmp_path):
    motion = circle(1000.0, rest_s=0.1, revolutions=0.1)
    table = simulate(WATER, motion)
    file = tmp_path / "motion.csv"
    write_columns(file, table[["t_s", "x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps"]])
    assert (simulate(WATER, file) == table).all()
    assert (simulate(WATER, str(file)) == table).all()
