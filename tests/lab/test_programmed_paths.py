"""Paths of a hand: how a hand is led to one, and how large it is in a workspace."""

import numpy as np
import pytest

from study_app.errors import StudyError
from study_app.haptics.model.motion import RADIUS_M, Motion
from study_app.haptics.model.scene import Scene
from study_app.lab.programmed_paths import TITLES, lead_to_path, programmed_path


@pytest.mark.parametrize(("way_m", "lasts_s"), [(0.08, 1.0), (0.16, 2.0), (0.01, 0.5)])
def test_a_hand_is_led_from_rest_to_rest_at_8_cm_a_second_or_in_half_a_second(way_m: float, lasts_s: float) -> None:
    path = Motion(np.array([0.0, 0.001]), np.array([[0.02 + way_m, 0.01, 0.0], [0.03 + way_m, 0.01, 0.0]]))
    led = lead_to_path(path, (0.02, 0.01, 0.0))
    rows = round(1000 * lasts_s)
    assert led.t_s == pytest.approx(np.arange(rows + 2) / 1000)
    assert led.position_m[rows:].tolist() == path.position_m.tolist()
    assert (led.position_m[:, 1:] == [0.01, 0.0]).all()
    progress = (led.position_m[: rows + 1, 0] - 0.02) / way_m
    quarters = progress[[0, rows // 4, rows // 2, 3 * rows // 4, rows]]
    assert quarters == pytest.approx([0.0, 53 / 512, 0.5, 1 - 53 / 512, 1.0]), "minimum jerk"


def test_a_path_fills_85_percent_of_the_workspace_unless_the_figure_is_smaller() -> None:
    """Half extents in the scene: 0.425 m along x and 0.1275 m along z; in a large tank figures have their own size."""
    half_m = (0.05, 0.04, 0.015)
    paths = {name: programmed_path(name, Scene(scale=10.0), half_m) for name in TITLES}
    for name, path in paths.items():
        spans_m = np.ptp(path.position_m, axis=0)
        assert path.position_m.max(axis=0) == pytest.approx(-path.position_m.min(axis=0), abs=1e-12), name
        assert spans_m[0] <= 0.085 + 1e-9, name
        assert spans_m[2] <= 0.0255 + 1e-9, name
        assert np.diff(path.t_s) == pytest.approx(0.001), name
        steps_m = np.linalg.norm(np.diff(path.position_m, axis=0), axis=1)
        if name != "reach":
            assert steps_m.max() == pytest.approx(1e-4, rel=0.01), "1 m/s in the scene"
    assert np.ptp(paths["line"].position_m[:, 0]) == pytest.approx(0.085, rel=1e-3)
    assert np.ptp(paths["circle"].position_m[:, 2]) == pytest.approx(0.0255, rel=1e-3)
    assert np.ptp(paths["reach"].position_m[:, 0]) == pytest.approx(0.06, rel=1e-3)
    assert np.ptp(paths["zigzag"].position_m[:, 0]) > np.ptp(paths["zigzag"].position_m[:, 2])
    for name in ("circle", "stop"):
        rest = paths[name].position_m[-1999:]
        assert np.ptp(rest, axis=0) == pytest.approx(0.0, abs=1e-9), "2 s at rest"
    large = programmed_path("circle", Scene(scale=1.0), (5.0, 5.0, 5.0))
    assert np.ptp(large.position_m[:, 0]) == pytest.approx(2 * RADIUS_M, rel=1e-3)
    with pytest.raises(StudyError, match=r"^unknown path 'loop': the known paths are circle, reverse, line, stop"):
        programmed_path("loop", Scene(), half_m)
