"""The curves of the lab's cards: fewer points than samples, and every peak."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from study_app.gui.lab.lab_state import LabView
from study_app.lab.shadow import Trace

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("count", [1, 7, 240, 241, 2503])
def test_a_curve_keeps_the_newest_sample_and_every_peak(place: Any, still: LabView, count: int) -> None:
    for peak in range(max(0, count - 12), count):
        speed, none = np.zeros(count), np.zeros((count, 3))
        speed[peak] = 7.0
        values = {one.name: none if one.name.endswith("_n") else speed for one in dataclasses.fields(Trace)}
        trace = Trace(**(values | {"t_s": np.arange(count) / 1000}))
        place.show_view(dataclasses.replace(still, trace=trace))
        times, kept = place.speed.plot.curves[0].getData()
        assert len(times) == len(kept) <= 2 * 240
        assert times[-1] == (count - 1) / 1000
        assert np.count_nonzero(kept == 7.0) == 1
