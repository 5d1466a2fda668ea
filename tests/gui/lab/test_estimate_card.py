"""The card of the estimation: what it shows, what it asks for, and nothing of it while the comparison is blind."""

import dataclasses
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtWidgets import QFileDialog

from study_app.viewmodels.estimation import LSL, SOURCES, EstimateRow, EstimateShown
from study_app.viewmodels.lab import LabView
from tests.gui.lab.sample import heard

pytestmark = pytest.mark.slow

FOUND = EstimateShown(
    source="other",
    rows=(EstimateRow("Drag coefficient", "0.4203", "0.419 … 0.422"),),
    message="Residual 0.052 N, 12 % of the force; 10 s measured",
    sound=True,
    may_apply=True,
    may_follow=True,
)


def test_values_stand_with_their_intervals_and_are_applied_on_request(place: Any, still: LabView) -> None:
    said = {name: heard(place, name) for name in ("estimate_apply_asked", "estimate_follow_asked")}
    place.show_view(dataclasses.replace(still, estimate=FOUND))
    name, value, interval = place.estimate.lines[0]
    assert (name.whole, value.text(), interval.text()) == ("Drag coefficient", "0.4203", "0.419 … 0.422")
    assert place.estimate.message.text().startswith("Residual 0.052 N")
    place.estimate.apply.click()
    place.estimate.follow.click()
    assert said == {"estimate_apply_asked": [()], "estimate_follow_asked": [(True,)]}
    assert not place.estimate.follow.isChecked()  # the view says when it is
    place.show_view(dataclasses.replace(still, estimate=dataclasses.replace(FOUND, follows=True)))
    assert place.estimate.follow.isChecked()


def test_what_is_not_identified_cannot_be_applied(place: Any, still: LabView) -> None:
    vague = dataclasses.replace(FOUND, sound=False, may_apply=False, message="This motion does not identify it.")
    place.show_view(dataclasses.replace(still, estimate=vague))
    assert not place.estimate.apply.isEnabled()
    assert place.estimate.message.property("role") == "warn"


def test_sources_and_parameters_are_chosen(place: Any, still: LabView) -> None:
    sources, parameters = heard(place, "estimate_source_chosen"), heard(place, "estimate_parameters_chosen")
    place.show_view(dataclasses.replace(still, estimate=dataclasses.replace(FOUND, sources=(*SOURCES, *LSL))))
    place.estimate.source.activated.emit(2)
    place.estimate.source.activated.emit(4)
    place.estimate.parameters.activated.emit(1)
    assert sources == [("device", None), ("lsl", None)]
    assert parameters == [("wake",)]


def test_a_file_is_asked_for(place: Any, still: LabView, tmp_path: Path) -> None:
    sources = heard(place, "estimate_source_chosen")
    place.show_view(still)
    place.estimate.source.activated.emit(3)
    assert isinstance(place.dialog, QFileDialog)
    place.dialog.fileSelected.emit(str(tmp_path / "robot.csv"))
    place.dialog.reject()
    assert sources == [("file", tmp_path / "robot.csv")]


def test_nothing_of_it_is_seen_in_a_blind_comparison(place: Any, still: LabView) -> None:
    shown = dataclasses.replace(still, estimate=FOUND)
    place.show_view(shown)
    blind = dataclasses.replace(shown, workbench=dataclasses.replace(still.workbench, blind=True))
    place.show_view(blind)
    assert not place.estimate.lines[0][1].isVisible()
    assert not place.estimate.source.isVisible()
