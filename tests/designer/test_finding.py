"""Words of the grammar are found and lead to their fields, in the outline of a large window and in the drawer."""

from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QApplication

from study_app.designer.outline.card import ROW_ROLE

pytestmark = pytest.mark.slow

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def small(designer: Any) -> Any:
    """A study of many elements in a small window."""
    designer.window.resize(1366, 768)
    designer.controller.begin("rek2024", "mine")
    QApplication.processEvents()
    return designer


def open_drawer(qtbot: Any, designer: Any) -> None:
    designer.key("ctrl+1")
    QApplication.processEvents()


def index_of(designer: Any, *path: str | int) -> Any:
    return next(one for one in designer.place.outline.indexes() if one.data(ROW_ROLE).path == path)


def expanded(designer: Any) -> set[Any]:
    tree = designer.place.outline.tree
    return {one.data(ROW_ROLE).path for one in designer.place.outline.indexes() if tree.isExpanded(one)}


def test_a_click_in_the_drawer_leads_to_the_form_and_leaves_what_is_open(qtbot: Any, small: Any) -> None:
    outline, tree = small.place.outline, small.place.outline.tree
    small.editing.select(("blocks", "liquids"))
    for _ in range(2):
        open_drawer(qtbot, small)
        index = index_of(small, "blocks", "liquids")
        before = expanded(small)
        assert ("blocks", "liquids") in before
        tree.scrollTo(index)
        qtbot.mouseClick(tree.viewport(), LEFT, pos=tree.visualRect(index).center())
        assert not outline.isVisible()
        assert small.place.form.isAncestorOf(small.keyboard)
        assert expanded(small) == before
    open_drawer(qtbot, small)
    index = index_of(small, "blocks", "liquids")
    tree.scrollTo(index)
    qtbot.mouseClick(tree.viewport(), LEFT, pos=QPoint(20, tree.visualRect(index).center().y()))
    assert outline.isVisible(), "the sign before the title opens and closes, it does not choose"
    assert ("blocks", "liquids") not in expanded(small)
