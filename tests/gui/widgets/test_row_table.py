"""Rows of a table: what stands in a cell keeps off the row's outline."""

from typing import Any

from PySide6.QtCore import QRect, Qt
from PySide6.QtGui import QImage, QPainter, QStandardItem, QStandardItemModel
from PySide6.QtWidgets import QStyleOptionViewItem

from study_app.gui.theme.theme import LIGHT
from study_app.gui.widgets.row_table import BELOW_ROLE, CHIP_ROLE, ROW_HEIGHT, Table

OUTLINE = 3  # px from the row's edge to within the outline of a chosen row


def test_a_chip_with_words_below_keeps_off_the_outline_of_its_row(qtbot: Any) -> None:
    model, cell = QStandardItemModel(), QStandardItem()
    cell.setData(("ok", "check", "Complete"), CHIP_ROLE)
    cell.setData("device reconnected, recording lost", BELOW_ROLE)
    model.appendRow([cell])
    table = Table(model, ((1, 200),), "Sessions")
    qtbot.addWidget(table)
    table.apply_theme(LIGHT)
    drawn = QImage(300, ROW_HEIGHT, QImage.Format.Format_ARGB32)
    drawn.fill(Qt.GlobalColor.transparent)
    option = QStyleOptionViewItem()
    option.rect = QRect(0, 0, 300, ROW_HEIGHT)  # type: ignore[attr-defined]  # missing in the stubs
    painter = QPainter(drawn)
    table.itemDelegate().paint(painter, option, model.index(0, 0))
    painter.end()
    inked = [y for y in range(ROW_HEIGHT) if any(drawn.pixelColor(x, y).alpha() for x in range(drawn.width()))]
    assert OUTLINE <= inked[0] < inked[-1] < ROW_HEIGHT - OUTLINE
