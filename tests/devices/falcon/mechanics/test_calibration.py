import dataclasses
import math
from datetime import date

import numpy as np
import pytest

from study_app.devices.falcon.calibration import Calibration, calibration_file, fit, load_calibration, save_calibration
from study_app.devices.falcon.mechanics import GEOMETRIES, REACHED, inverse, new_mechanism
from study_app.errors import DeviceError

GEOMETRY = GEOMETRIES["libnifalcon"]
PLACES = ((0, 0, 0.127), (0.03, 0.02, 0.11), (-0.03, 0.02, 0.14), (0.02, -0.02, 0.15), (-0.02, -0.03, 0.10))
WEIGHTS_N = (0.0, 4.9, 0.0, 4.9, 2.45)


def weighed_samples(gain, offset_rad, own_n, *, places=PLACES, weights_n=WEIGHTS_N):
    """Return counts, forces and units of a Falcon that holds weights: by virtual work, slopes taken by differences."""
    mechanism = new_mechanism(GEOMETRY, gain, offset_rad)

    def theta_at(place):
        theta = np.zeros(3)
        assert inverse(mechanism, np.array(place, float), theta) == REACHED
        return theta

    counts, units = [], []
    for place, weight_n in zip(places, weights_n, strict=True):
        slopes = np.zeros((3, 3))
        for axis, step in enumerate(np.eye(3) * 1e-6):
            slopes[:, axis] = (theta_at(np.add(place, step)) - theta_at(np.subtract(place, step))) / 2e-6
        torque_nm = np.linalg.solve(slopes.T, [0.0, weight_n + own_n, 0.0])
        counts.append((theta_at(place) - mechanism.zero_rad) / mechanism.rad_per_count)
        units.append(-gain * torque_nm)
    forces_n = np.column_stack([np.zeros(len(places)), -np.array(weights_n), np.zeros(len(places))])
    return np.array(counts), forces_n, np.array(units)


class TestFit:
    @pytest.mark.parametrize("gain", [6616.0, 10_000.0, 8000.0])
    @pytest.mark.parametrize("offset_deg", [0.0, 5.0, -3.0])
    def test_finds_gain_offset_and_weight_of_the_grip(self, gain, offset_deg):
        calibration = fit(GEOMETRY, *weighed_samples(gain, math.radians(offset_deg), 1.2), measured=date(2026, 11, 20))
        assert calibration.units_per_nm == pytest.approx(gain, rel=1e-4)
        assert math.degrees(calibration.arm_offset_rad) == pytest.approx(offset_deg, abs=0.01)
        assert calibration.own_weight_n == pytest.approx(1.2, abs=1e-3)
        assert calibration.residual_n < 1e-3
        assert (calibration.geometry, calibration.poses, calibration.measured) == ("libnifalcon", 5, "2026-11-20")

    def test_measurements_that_cannot_be_are_named(self):
        counts, forces_n, units = weighed_samples(6616.0, 0.0, 1.0)
        no_pose = counts.copy()
        no_pose[2] = 9000
        for arguments, words in (
            ((counts[:4], forces_n[:4], units[:4]), "at least 5 poses, not 4"),
            (weighed_samples(6616.0, 0.0, 1.0, weights_n=(4.9,) * 5), "two weights"),
            ((counts, forces_n * 10, units), "check the weights"),
            ((no_pose, forces_n, units), "pose 3"),
            ((counts, forces_n[:, :2], units), "three encoder counts, three force components"),
        ):
            with pytest.raises(DeviceError, match=words):
                fit(GEOMETRY, *arguments)


class TestKeeping:
    CALIBRATION = Calibration(
        geometry="zm-redux",
        units_per_nm=7000.0,
        arm_offset_rad=0.03,
        own_weight_n=1.1,
        residual_n=0.05,
        poses=6,
        measured="2026-11-20",
    )

    @pytest.fixture
    def folder(self, tmp_path):
        return tmp_path / "settings"

    def test_is_found_again_by_serial_number(self):
        save_calibration("FTABC123", self.CALIBRATION)
        assert load_calibration("FTABC123") == self.CALIBRATION
        assert load_calibration("FTABC124") is None
        newer = dataclasses.replace(self.CALIBRATION, units_per_nm=9000.0)
        save_calibration("FTABC123", newer)
        assert load_calibration("FTABC123") == newer

    def test_no_serial_number_leaves_the_folder(self, folder):
        assert calibration_file("../../x").parent == folder
        assert save_calibration("", self.CALIBRATION).parent == folder

    @pytest.mark.parametrize(
        "text",
        [
            "",
            "[]",
            '{"geometry": "libnifalcon"}',
            '{"geometry": "libnifalcon", "units_per_nm": 0}',
            '{"geometry": "libnifalcon", "units_per_nm": NaN}',
            '{"geometry": "libnifalcon", "units_per_nm": "7000"}',
            '{"geometry": "libnifalcon", "units_per_nm": 7000, "arm_offset_rad": 2}',
        ],
    )
    def test_an_invalid_file_is_reported_with_its_path(self, text):
        file = save_calibration("A", self.CALIBRATION)
        file.write_text(text, encoding="utf-8", newline="\n")
        with pytest.raises(DeviceError, match=r"falcon-A\.json.*calibrate again"):
            load_calibration("A")

    def test_an_unknown_geometry_is_reported(self):
        save_calibration("A", dataclasses.replace(self.CALIBRATION, geometry="other"))
        with pytest.raises(DeviceError, match="'other'"):
            load_calibration("A")

    def test_a_file_in_place_of_the_folder_is_reported(self, folder):
        folder.write_text("", encoding="utf-8", newline="\n")
        with pytest.raises(DeviceError, match="LIQUID_STUDY_CONFIG"):
            save_calibration("A", self.CALIBRATION)
