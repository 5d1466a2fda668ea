"""The emulated device: its readings, and the Falcon through either driver."""

from typing import Any

import numpy as np
import pytest

from tests.compiled import needs_servo

PATH_S = np.arange(0.0, 4.0, 0.01)


def emulated(**settings: Any) -> Any:
    from study_app.devices.emulators.force_dimension import EmulatedForceDimension

    return EmulatedForceDimension(tremor_m=0.0, **settings)


def stroked(device: Any, clock: Any = None) -> tuple[Any, Any]:
    """Move a device's hand back and forth through honey; return the servo and its samples of the last 0.9 s."""
    from study_app.haptics.runtime.clocks.clock import VirtualClock
    from study_app.haptics.runtime.servo import Servo
    from study_app.protocol.load import load

    servo = Servo(device, clock=clock or VirtualClock())
    reader = servo.telemetry.reader()
    servo.load(load("rek2024").scene_for("honey"))
    path_m = np.zeros((PATH_S.size, 3))
    path_m[:, 0] = 0.02 * (1.0 - np.cos(2.0 * np.pi * PATH_S))
    device.hand.follow(PATH_S, path_m)
    servo.advance(3000)
    reader.read()
    servo.advance(900)
    return servo, reader.read()


@needs_servo
def test_readings_are_those_of_the_simulated_handle_and_force_acts_on_it() -> None:
    device = emulated()
    with device:
        servo, rows = stroked(device)
        servo.check()
        assert rows.fresh.all()
        assert np.ptp(rows.position_m[:, 0]) > 0.03
        assert np.ptp(rows.position_m[:, 1:], axis=0).max() < 1e-4
        moved_mps = np.gradient(rows.position_m[:, 0], 1e-3)
        assert np.abs(moved_mps - rows.device_velocity_mps[:, 0])[50:-1].max() < 0.05  # a count a millisecond
        assert device.hand.force_n == pytest.approx(rows.device_force_n[-1])
        assert np.abs(rows.device_force_n[:, 0]).max() > 1.0
    assert device.hand.force_n == (0.0, 0.0, 0.0)


@pytest.mark.slow
@needs_servo
def test_the_same_handle_through_the_falcons_own_driver_has_the_same_force() -> None:
    """Emulated halves: the Falcon's own driver with its kinematics and motors, and the maker-library driver."""
    from study_app.devices.emulators.falcon import EmulatedFalcon
    from study_app.devices.emulators.falcon_emulator import Emulator

    falcon = EmulatedFalcon(emulator=Emulator(running=True, tremor_m=0.0, workspace_m=(0.05, 0.05, 0.05)))
    found = []
    for device in (emulated(), falcon):
        with device:
            servo, rows = stroked(device)
            servo.check()
            found.append(rows)
    through_library, own = found
    off_m = np.abs(through_library.position_m - own.position_m).max()
    mean_n = [float(np.abs(rows.device_force_n[:, 0]).mean()) for rows in found]
    print(f"positions within {1e6 * off_m:.0f} um, mean forces {mean_n[0]:.3f} and {mean_n[1]:.3f} N")  # noqa: T201
    assert mean_n[0] > 0.5
    assert off_m < 5e-4
    assert mean_n[0] == pytest.approx(mean_n[1], rel=0.05)
