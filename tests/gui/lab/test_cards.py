"""The cards of the lab: how curves are thinned, and what the estimation asks for."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtWidgets import QFileDialog

from study_app.gui.lab.cards import thinned
from study_app.gui.lab.lab_state import LSL, SOURCES, EstimateRow, EstimateShown, LabView
from tests.gui.lab.sample import heard

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


FOUND = EstimateShown(
    source="other",
    rows=(EstimateRow("Drag coefficient", "0.4203", "0.419 … 0.422"),),
    message="Residual 0.052 N, 12 % of the force; 10 s measured",
    sound=True,
    may_apply=True,
    may_follow=True,
)


def test_sources_a_file_and_parameters_are_chosen(place: Any, still: LabView, tmp_path: Path) -> None:
    sources, parameters = heard(place, "source"), heard(place, "parameters")
    place.show_view(dataclasses.replace(still, estimate=dataclasses.replace(FOUND, sources=(*SOURCES, *LSL))))
    for at in (2, 4, 3):
        place.estimate.source.activated.emit(at)
    place.estimate.parameters.activated.emit(1)
    assert isinstance(place.dialog, QFileDialog)
    place.dialog.fileSelected.emit(str(tmp_path / "robot.csv"))
    place.dialog.reject()
    assert sources == [(None, "device"), (None, "lsl"), (tmp_path / "robot.csv", "file")]
    assert parameters == [("wake",)]
