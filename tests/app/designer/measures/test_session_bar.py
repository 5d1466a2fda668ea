"""The bar of the steps of a session."""

from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt

from study_app.gui.designer.measures.parts import SessionPart

pytestmark = pytest.mark.slow


def test_a_click_on_a_step_of_the_session_bar_opens_the_step(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.select(("pages", "welcome"))
    facts = designer.place.pane.facts

    def bar() -> Any:
        return next((one.strip for one in facts.grid.parts if isinstance(one, SessionPart)), None)

    qtbot.waitUntil(lambda: bar() is not None and bar().width() > 100)
    strip, x = bar(), 0.0
    for _, share, _, path in strip.segments:
        if path == ("blocks", "liquids"):
            break
        x += share * strip.width()
    qtbot.mouseClick(strip, Qt.MouseButton.LeftButton, pos=QPoint(round(x + share * strip.width() / 2), 7))
    assert designer.editing.selected == ("blocks", "liquids")
