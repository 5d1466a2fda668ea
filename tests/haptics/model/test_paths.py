import numpy as np
import pytest

from study_app.errors import StudyError
from study_app.haptics.model.paths import NAMES, circle, line, path, reach, reverse, stop, zigzag


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("rate_hz", [500.0, 1000.0])
def test_the_ideal_velocity_is_the_slope_of_the_place(name, rate_hz):
    motion = path(name, rate_hz=rate_hz)
    assert motion.t_s == pytest.approx(np.arange(len(motion.t_s)) / rate_hz, abs=0)
    slope = (motion.position_m[2:] - motion.position_m[:-2]) * rate_hz / 2
    smooth = abs(np.diff(motion.velocity_mps, 2, axis=0)).max(axis=1) < 1e-3
    assert smooth.mean() > 0.98
    assert slope[smooth] == pytest.approx(motion.velocity_mps[1:-1][smooth], abs=1e-3)


@pytest.mark.parametrize("name", NAMES)
def test_all_are_horizontal_and_at_hand_speed(name):
    motion = path(name)
    assert not motion.position_m[:, 1].any()
    assert 0.5 < np.linalg.norm(motion.velocity_mps, axis=1).max() < 2


@pytest.mark.parametrize("make", [circle, reverse, stop])
def test_a_stop_is_sudden_exact_and_long(make):
    motion = make(1000.0)
    still = ~motion.velocity_mps.any(axis=1)
    first = int(np.argmax(still))
    assert still[first:].all()
    assert len(still) - first >= 5000
    assert (motion.position_m[first:] == motion.position_m[-1]).all()
    assert np.linalg.norm(motion.velocity_mps[:first], axis=1) == pytest.approx(1.0)


def test_the_circle_comes_round_three_times_in_five_seconds():
    motion = circle(1000.0)
    moving = int((motion.velocity_mps.any(axis=1)).sum())
    assert moving == pytest.approx(5000, abs=10)
    angle = np.unwrap(np.arctan2(motion.position_m[:, 2], motion.position_m[:, 0]))
    assert angle[-1] - angle[0] == pytest.approx(6 * np.pi)
    assert motion.position_m[-1] == pytest.approx(motion.position_m[0])


def test_the_reverse_goes_back_the_way_it_came():
    motion = reverse(1000.0, revolutions=1.0, against_s=0.5, rest_s=0.1)
    turn = int(np.argmax(motion.velocity_mps[1:, 2] * motion.velocity_mps[:-1, 2] < -0.5)) + 1
    assert motion.position_m[turn + 100] == pytest.approx(motion.position_m[turn - 100], abs=2e-3)


def test_the_zigzag_turns_by_ninety_degrees_every_leg():
    motion = zigzag(1000.0, leg_s=0.1, legs=4)
    v = motion.velocity_mps[:-1]
    turns = np.flatnonzero(abs((v[1:] * v[:-1]).sum(axis=1)) < 1e-9) + 1
    assert turns.tolist() == [100, 200, 300]


def test_a_reach_goes_to_and_fro_with_the_minimum_jerk_peak_in_its_middle():
    motion = reach(1000.0, distance_m=0.4, reach_s=0.8, dwell_s=0.2, reaches=2)
    assert motion.position_m[800:1000, 0] == pytest.approx(0.4)
    assert motion.position_m[-1, 0] == pytest.approx(0.0)
    assert motion.velocity_mps[400, 0] == pytest.approx(1.875 * 0.4 / 0.8)
    assert motion.velocity_mps[1400, 0] == pytest.approx(-1.875 * 0.4 / 0.8)


def test_a_line_never_stops():
    assert (line(1000.0, speed_mps=2.0, moving_s=1.0).velocity_mps == [2.0, 0.0, 0.0]).all()


def test_a_path_that_is_not_there_is_named_with_those_that_are():
    with pytest.raises(StudyError, match=r"'circel': did you mean 'circle'.*circle, line, stop, zigzag"):
        path("circel")
