import numpy as np
import pytest

from study_app.errors import StudyError
from study_app.haptics.model.motion import NAMES, circle, programmed_motion, reach, reverse, stop


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("rate_hz", [500.0, 1000.0])
def test_the_ideal_velocity_is_the_slope_of_the_place(name, rate_hz):
    motion = programmed_motion(name, rate_hz=rate_hz)
    assert motion.t_s == pytest.approx(np.arange(len(motion.t_s)) / rate_hz, abs=0)
    slope = (motion.position_m[2:] - motion.position_m[:-2]) * rate_hz / 2
    smooth = abs(np.diff(motion.velocity_mps, 2, axis=0)).max(axis=1) < 1e-3
    assert smooth.mean() > 0.98
    assert slope[smooth] == pytest.approx(motion.velocity_mps[1:-1][smooth], abs=1e-3)


@pytest.mark.parametrize("make", [circle, reverse, stop])
def test_a_stop_is_sudden_exact_and_long(make):
    motion = make(1000.0)
    still = ~motion.velocity_mps.any(axis=1)
    first = int(np.argmax(still))
    assert still[first:].all()
    assert len(still) - first >= 5000
    assert (motion.position_m[first:] == motion.position_m[-1]).all()
    assert np.linalg.norm(motion.velocity_mps[:first], axis=1) == pytest.approx(1.0)


def test_a_reach_goes_to_and_fro_with_the_minimum_jerk_peak_in_its_middle():
    motion = reach(1000.0, distance_m=0.4, reach_s=0.8, dwell_s=0.2, reaches=2)
    assert motion.position_m[800:1000, 0] == pytest.approx(0.4)
    assert motion.position_m[-1, 0] == pytest.approx(0.0)
    assert motion.velocity_mps[400, 0] == pytest.approx(1.875 * 0.4 / 0.8)
    assert motion.velocity_mps[1400, 0] == pytest.approx(-1.875 * 0.4 / 0.8)


def test_a_path_that_is_not_there_is_named_with_those_that_are():
    with pytest.raises(StudyError, match=r"'circel': did you mean 'circle'.*circle, line, stop, zigzag"):
        programmed_motion("circel")
