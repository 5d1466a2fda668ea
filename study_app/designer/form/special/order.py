"""The order of a block's conditions, with the numbers of participants that balance it."""

from typing import Final

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QBoxLayout

from study_app.designer.form.facts.order import OrderBalance
from study_app.designer.form.form_rows import FormRow
from study_app.designer.form.row_fields import ChoiceField
from study_app.designer.form.special_editor import SpecialEditor
from study_app.gui.widgets.cards import Chip

LETTERS, NARROWEST = 8, 124


class OrderField(ChoiceField):
    """The choice of an order, and a chip that says how even it is."""

    def __init__(self, row: FormRow) -> None:
        self.chip = Chip(small=True)
        super().__init__(row)
        if self.list is not None:
            self.list.setMinimumContentsLength(LETTERS)
        self.box.addWidget(self.chip, 0, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft)
        self.show_value()

    def show_value(self) -> None:
        """Show what is chosen, and how balanced it is."""
        super().show_value()
        found: OrderBalance | None = self.row.facts
        self.chip.setVisible(found is not None and self.box.indexOf(self.chip) >= 0)
        if found is not None:
            self.chip.show_state(found.tone, found.icon, found.words)
            self.chip.setToolTip(found.sentence)
            self.chip.setAccessibleDescription(found.sentence)

    def minimumSizeHint(self) -> QSize:
        return QSize(max(NARROWEST, self.chip.sizeHint().width()), super().minimumSizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        beside = self.width() >= NARROWEST + self.chip.sizeHint().width() + 8
        directions = QBoxLayout.Direction
        self.box.setDirection(directions.LeftToRight if beside else directions.TopToBottom)


EDITOR: Final = SpecialEditor((("Block", "order"),), OrderField)
