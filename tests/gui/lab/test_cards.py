"""The curves of the lab's cards: fewer points than samples, and every peak."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from PySide6.QtGui import QColor

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


def test_each_name_in_a_legend_is_that_of_the_curve_in_its_colour(place: Any, still: LabView) -> None:
    drawn = {"body_mps": 1.0, "wake_a_mps": 2.0, "wake_b_mps": 3.0, "force_a_n": 4.0, "force_b_n": 5.0}
    values = {one.name: np.zeros((3, 3) if one.name.endswith("_n") else 3) for one in dataclasses.fields(Trace)}
    for name, value in drawn.items():
        values[name][..., 0] = value
        values[name][1] = value if name.endswith("_mps") else (0, value, 0)
        values[name][2] = value if name.endswith("_mps") else (0, 0, -value)
    trace = Trace(**(values | {"t_s": np.array([-0.2, -0.1, 0.0])}))
    view = dataclasses.replace(still, trace=trace)
    for felt, force_a, force_b in (("A", "A (felt now)", "B (same motion)"), ("B", "A (same motion)", "B (felt now)")):
        place.show_view(dataclasses.replace(view, workbench=dataclasses.replace(view.workbench, presented=felt)))
        for card, names in (
            (place.speed, {"body": 1.0, "wake of A": 2.0, "wake of B": 3.0}),
            (place.force, {force_a: 4.0, force_b: 5.0}),
        ):
            colours = {QColor(style.colour(card.plot.theme)).name(): text for style, text in card.legend._entries}
            curves = {colours[curve.opts["pen"].color().name()]: curve.getData()[1] for curve in card.plot.curves}
            assert {name: set(values) for name, values in curves.items()} == {name: {v} for name, v in names.items()}
