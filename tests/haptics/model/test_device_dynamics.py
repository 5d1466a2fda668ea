"""The dynamics of a device, as receipts record them."""

import pytest

from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics, dynamics_from

MEASURED = {"delay_s": 2e-3, "count_m": 5e-5, "mass_kg": 0.3, "velocity_lag_s": 4e-3, "assumed": ["mass_kg"]}


@pytest.mark.parametrize(("force_error_n", "recorded"), [(0.0, {}), (0.02, {"force_error_n": 0.02})])
def test_a_receipt_records_the_force_error_only_of_a_device_that_rounds(
    force_error_n: float, recorded: dict[str, float]
) -> None:
    dynamics = Dynamics(
        delay_s=2e-3, count_m=5e-5, mass_kg=0.3, velocity_lag_s=4e-3, assumed=("mass_kg",), force_error_n=force_error_n
    )
    assert dynamics.describe() == MEASURED | recorded
    assert dynamics_from({"dynamics": dynamics.describe()}) == dynamics
    assert dynamics_from({}) == UNKNOWN
