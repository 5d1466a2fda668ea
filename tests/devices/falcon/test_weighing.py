import math
from itertools import chain, repeat

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("devices are C functions", allow_module_level=True)

from study_app.devices.emulators.falcon import EmulatedFalcon
from study_app.devices.emulators.falcon_emulator import Emulator
from study_app.devices.falcon.calibration import (
    GRAVITY_MPS2,
    PLACES_M,
    Grip,
    fit,
    measure_with_scale,
    measure_with_weight,
    residual_forces,
)
from study_app.devices.falcon.mechanics import GEOMETRIES
from study_app.errors import DeviceError

pytestmark = pytest.mark.slow

WEIGHT_N = 0.4 * GRAVITY_MPS2


def emulated(**options):
    return Emulator(**{"tremor_m": 0.0, "running": True, **options})


def helper(emulator, weight_n=WEIGHT_N, *, readings=None, lags=0):
    """Return a scripted operator that acts ``lags`` ticks after each request, and the list of its requests."""
    kinds = []

    def ask(kind, _words):
        kinds.append(kind)
        waits = iter([None] * lags)
        if kind in {"hang", "pull"}:
            emulator.weight_n = weight_n
        elif kind in {"let-go", "take-off"}:
            emulator.weight_n = 0.0
        emulator.held = kind == "take-off"
        answer = next(readings) if kind == "reading" else ""
        return lambda: next(waits, answer)

    return ask, kinds


def weighed(emulator, weight_n=WEIGHT_N):
    ask, kinds = helper(emulator, weight_n)
    with EmulatedFalcon(emulator=emulator) as device:
        notes = measure_with_weight(Grip(device, virtual=True), weight_n, ask)
    return notes, kinds


class TestAWeight:
    @pytest.mark.parametrize(
        ("gain", "offset_deg", "geometry"),
        [(6616.0, 0.0, "libnifalcon"), (10_000.0, 0.0, "zm-redux"), (8000.0, 4.0, "libnifalcon")],
    )
    def test_tells_gain_and_offset_of_the_emulated_arms(self, gain, offset_deg, geometry):
        emulator = emulated(units_per_nm=gain, arm_offset_rad=(math.radians(offset_deg),) * 3, geometry=geometry)
        notes, kinds = weighed(emulator)
        assert kinds == ["let-go", "hang", "take-off"]
        calibration = fit(GEOMETRIES[geometry], notes.counts, notes.forces_n, notes.units)
        assert calibration.units_per_nm == pytest.approx(gain, rel=0.01)
        assert math.degrees(calibration.arm_offset_rad) == pytest.approx(offset_deg, abs=0.3)
        assert calibration.own_weight_n == pytest.approx(0.0, abs=0.03)
        assert calibration.poses == 4 * len(PLACES_M)
        residuals_n = residual_forces(calibration, notes.counts, notes.forces_n, notes.units)
        assert math.sqrt((residuals_n**2).sum() / len(residuals_n)) == pytest.approx(calibration.residual_n)
        assert np.abs(residuals_n).max() < 0.12  # 0.1 N of it is the friction of the emulated arms

    @pytest.mark.parametrize("weight_n", [0.5, 6.5, -1.0, math.nan])
    def test_one_that_tells_nothing_or_is_too_heavy_is_refused(self, weight_n):
        emulator = emulated()
        with EmulatedFalcon(emulator=emulator) as device, pytest.raises(DeviceError, match="110 to 600 g"):
            measure_with_weight(Grip(device, virtual=True), weight_n, helper(emulator)[0])


class TestAScale:
    def test_tells_the_gain_as_a_weight_does(self):
        emulator = emulated(units_per_nm=9000.0)
        ask, kinds = helper(emulator, readings=repeat("400"), lags=5)
        with EmulatedFalcon(emulator=emulator) as device:
            notes = measure_with_scale(Grip(device, virtual=True), ask)
        assert kinds == ["let-go", *["pull", "reading", "let-go"] * len(PLACES_M), "take-off"]
        calibration = fit(GEOMETRIES["libnifalcon"], notes.counts, notes.forces_n, notes.units)
        assert calibration.units_per_nm == pytest.approx(9000, rel=0.04)

    def test_an_invalid_reading_is_requested_again(self):
        emulator = emulated()
        wrong = ["", "four", "-3", "0", "900", "nan"]
        ask, kinds = helper(emulator, readings=chain(wrong, repeat("400")))
        words = []
        with EmulatedFalcon(emulator=emulator) as device:
            notes = measure_with_scale(
                Grip(device, virtual=True), lambda kind, said: words.append(said) or ask(kind, said)
            )
        assert kinds.count("reading") == len(wrong) + len(PLACES_M)
        assert [said for said in words if "is not a weight between" in said][1].startswith("'four' is")
        calibration = fit(GEOMETRIES["libnifalcon"], notes.counts, notes.forces_n, notes.units)
        assert calibration.units_per_nm == pytest.approx(6616, rel=0.04)


class TestTheGrip:
    def test_is_moved_slowly_and_with_no_more_force_than_the_limit(self):
        emulator = emulated()
        with EmulatedFalcon(emulator=emulator, force_limit_n=2.0) as device:
            grip = Grip(device, virtual=True)
            emulator.held = False
            grip.move_to((0.02, 0.01, 0.01))
            assert grip.place_m == pytest.approx((0.02, 0.01, 0.01), abs=5e-4)
            emulator.held = True
            emulator.reach_to(-0.04, 0.0, 0.0)
            pushes = []
            for _ in range(1500):
                grip.tick()
                pushes.append(np.linalg.norm(emulator.force_n))
            assert max(pushes) == pytest.approx(2.0, rel=0.01)

    def test_one_that_somebody_shakes_does_not_come_to_rest(self):
        emulator = emulated(tremor_m=2e-3)
        with EmulatedFalcon(emulator=emulator) as device, pytest.raises(DeviceError, match="has not come to rest"):
            Grip(device, virtual=True).move_to((0.01, 0.0, 0.0))
        assert emulator.torques == (0, 0, 0)

    def test_without_news_of_its_place_it_is_let_go(self):
        emulator = emulated()
        with EmulatedFalcon(emulator=emulator) as device:
            grip = Grip(device, virtual=True)
            emulator.reach_to(0.03, 0.0, 0.0)
            for _ in range(1500):
                grip.tick()
            assert emulator.torques != (0, 0, 0)
            emulator.faults.chance("drop", 1.0)
            for _ in range(40):
                grip.tick()
            assert emulator.torques == (0, 0, 0)
