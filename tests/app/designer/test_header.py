"""The designer's header: what is at its left edge, with and without its title."""

from __future__ import annotations

from typing import Any

from PySide6.QtWidgets import QApplication

from study_app.gui.designer.designer_header import DesignerHeader
from study_app.gui.widgets.cards import SHADOW


def test_the_list_of_studies_is_at_the_edge_where_the_title_has_no_room(qtbot: Any) -> None:
    header = DesignerHeader()
    qtbot.addWidget(header)
    header.resize(1200, 60)
    header.show()
    QApplication.processEvents()
    assert header.title.x() == SHADOW
    assert header.study.x() > header.title.geometry().right()
    header.title.hide()
    header.layout().activate()
    QApplication.processEvents()
    assert header.study.x() == SHADOW
