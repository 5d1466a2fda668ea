"""A lab with its real page, servo and scripted device."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication

from study_app.app.lab_controller import LabController
from study_app.gui.lab.view import LabPlace
from study_app.protocol.load import load_scene
from tests.app.lab.worlds import OPENS_MS, PATIENCE, SOON_MS, Prices, force_n


@pytest.fixture
def prices() -> Prices:
    return Prices()


@pytest.fixture
def make_lab(qtbot: Any, prices: Prices) -> Iterator[Callable[..., LabController]]:
    """Return a function that makes a lab that is not entered yet, with a scripted hand."""
    labs: list[LabController] = []

    def make(**options: Any) -> LabController:
        place = LabPlace()
        place.resize(1300, 800)
        labs.append(LabController(place, **({"device": "scripted", "make_appraiser": lambda: prices} | options)))
        return labs[-1]

    yield make
    for lab in labs:
        lab.end(PATIENCE)
        lab.place.close()
        lab.place.deleteLater()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


@pytest.fixture
def visit(make_lab: Callable[..., LabController]) -> LabController:
    return make_lab()


@pytest.fixture
def running_lab(visit: LabController, qtbot: Any) -> LabController:
    """Return an entered lab that presents honey along circles, so that a force acts until it is stopped."""
    visit.bench = visit.bench.choose("A", "Honey", load_scene("rek2024", "honey"))
    visit.place.show()
    qtbot.waitUntil(lambda: visit.live is not None, timeout=OPENS_MS)
    visit.place.ask("path", "circle")
    qtbot.waitUntil(lambda: force_n(visit) > 0.3, timeout=SOON_MS)
    return visit
