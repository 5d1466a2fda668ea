"""The head of the lab: which side is felt, blinding, device and motion, undo, the force stop, and saving."""

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QWidget

from study_app.gui.lab.side_switch import SideSwitch
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import add_layout, add_parts, hbox
from study_app.gui.widgets.controls import ActionButton, Choice, CompactStop, IconButton, Toggle
from study_app.gui.widgets.labels import label
from study_app.viewmodels.lab import Choices, LabView

BUTTON = 44
FREE = "Free motion"
LETTERS = 13  # of a choice before it is cut


class Picker(Choice):
    """A list with an icon before the word it is at."""

    def __init__(self, icon: str, name: str) -> None:
        super().__init__()
        self._icon = icon
        self._choices: Choices = ()
        self.setFont(font("label"))
        self.setAccessibleName(name)
        self.setFixedHeight(BUTTON)
        self.setStyleSheet("QComboBox { padding-left: 40px; }")
        self.setMinimumContentsLength(LETTERS)
        self.setSizeAdjustPolicy(Choice.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)

    def show_choices(self, choices: Choices, chosen: str) -> None:
        """Offer ``choices`` (value, words), of which one is chosen."""
        if choices != self._choices:
            self._choices = choices
            self.clear()
            for value, words in choices:
                self.addItem(words, value)
        self.setCurrentIndex(self.findData(chosen))

    def show_whole(self, yes: bool) -> None:
        """Be as wide as the longest words, or cut what is longer than most."""
        policy = self.SizeAdjustPolicy
        self.setSizeAdjustPolicy(policy.AdjustToContents if yes else policy.AdjustToMinimumContentsLengthWithIcon)

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        draw_icon(QPainter(self), self._icon, QRectF(13, self.height() / 2 - 10, 20, 20), self.theme.text2, 1.9)


class LabHeader(Themed, QWidget):
    """One row in a wide window, two in a narrow one."""

    switched = Signal()
    blind_asked = Signal(bool)
    device_chosen = Signal(str)
    path_chosen = Signal(object)
    undo_asked = Signal()
    redo_asked = Signal()
    stop_asked = Signal()
    save_asked = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.title = label("Liquid lab", "title_dense")
        self.sides = SideSwitch()
        self.blind = Toggle("Blind A/B")
        self.blind.setFont(font("label"))
        self.blind.setToolTip("Hide which setting is which")
        self.device = Picker("mouse", "Device")
        self.path = Picker("route", "Motion")
        self.undo = IconButton("undo", "Undo", "Undo (Ctrl+Z)")
        self.redo = IconButton("redo", "Redo", "Redo (Ctrl+Shift+Z)")
        self.stop = CompactStop()
        self.save = ActionButton("save", "Save preset …", role="primary", height=BUTTON)
        self.save.setFixedHeight(BUTTON)
        self._narrow: bool | None = None
        self._lay_out()
        self.arrange(narrow=False)
        self._connect()

    def _lay_out(self) -> None:
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(24, 12, 24, 13)
        self._grid.setHorizontalSpacing(16)
        self._grid.setVerticalSpacing(8)
        self._left, self._middle, self._right = (_row() for _ in range(3))
        parts: dict[QHBoxLayout, tuple[QWidget, ...]] = {
            self._left: (self.title, self.sides),
            self._middle: (self.blind, self.device, self.path),
            self._right: (self.undo, self.redo, self.stop, self.save),
        }
        for row, inside in parts.items():
            add_parts(row, *inside)
        self._left.setSpacing(16)
        self._grid.setColumnStretch(2, 1)

    def arrange(self, *, narrow: bool) -> None:
        """Stand in one row or two; the force stop is at the right of the first in both."""
        if narrow == self._narrow:
            return
        self._narrow = narrow
        for picker in (self.device, self.path):
            picker.show_whole(narrow)
        for row in (self._left, self._middle, self._right):
            self._grid.removeItem(row)
        if narrow:
            add_layout(self._grid, self._left, 0, 0)
            add_layout(self._grid, self._right, 0, 3)
            add_layout(self._grid, self._middle, 1, 0, 1, 4, Qt.AlignmentFlag.AlignLeft)
        else:
            add_layout(self._grid, self._left, 0, 0)
            add_layout(self._grid, self._middle, 0, 1)
            add_layout(self._grid, self._right, 0, 3)

    def _connect(self) -> None:
        self.sides.switched.connect(self.switched)
        self.blind.clicked.connect(self._ask_blind)
        self.device.activated.connect(lambda index: self.device_chosen.emit(self.device.itemData(index)))
        self.path.activated.connect(lambda index: self.path_chosen.emit(self.path.itemData(index) or None))
        self.undo.clicked.connect(self.undo_asked)
        self.redo.clicked.connect(self.redo_asked)
        self.stop.pressed.connect(self.stop_asked)
        self.save.clicked.connect(self.save_asked)

    def show_view(self, view: LabView) -> None:
        self.sides.show_view(view)
        self.blind.setChecked(view.workbench.blind)
        self.device.show_choices(view.device.choices, view.device.chosen)
        self.device.setAccessibleDescription(view.device.state)
        self.path.show_choices((("", FREE), *view.paths), view.path or "")
        self.undo.setEnabled(view.workbench.may_undo)
        self.redo.setEnabled(view.workbench.may_redo)
        self.save.setEnabled(not view.workbench.blind)

    def _ask_blind(self, on: bool) -> None:
        self.blind.setChecked(not on)  # the view says when it is
        self.blind_asked.emit(on)

    def paintEvent(self, _event: QPaintEvent) -> None:
        QPainter(self).fillRect(0, self.height() - 1, self.width(), 1, QColor(self.theme.border))


def _row() -> QHBoxLayout:
    row = hbox(spacing=10, margins=0)
    return row
