"""The cards of the lab: how curves are thinned."""

import numpy as np
import pytest

from study_app.gui.lab.cards import thinned

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("count", [0, 1, 7, 240, 241, 2500])
def test_thinning_keeps_the_newest_and_every_peak(count: int) -> None:
    t_s = np.arange(count, dtype=float)
    for peak in range(max(0, count - 30), count):
        values = np.zeros(count)
        values[peak] = 7.0
        times, kept = thinned(t_s, values)
        assert len(times) == len(kept) <= 2 * 240
        assert times[-1] == count - 1
        assert np.count_nonzero(kept == 7.0) == 1
