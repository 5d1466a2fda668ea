"""The log of the force that acted on the hand, which the observer reads."""

import numpy as np
import pytest

from study_app.haptics.kernels.passivity import log_acted
from study_app.haptics.model.layout import PASSIVITY, records


@pytest.mark.parametrize("row", [0, 3, -1])
def test_the_force_on_the_hand_is_logged_once_without_buoyancy(row: int) -> None:
    passivity = records(PASSIVITY, 1)[0]
    passivity.row = range(len(passivity.acted_n))[row]
    passivity.lift_n = (0.25, -0.5, 4.0)
    expected = passivity.copy()
    expected.acted_n[row] = (1.25, 2.5, -7.0)
    log_acted(passivity, np.array([1.5, 2.0, -3.0, 77.0]))
    assert passivity.tobytes() == expected.tobytes()
