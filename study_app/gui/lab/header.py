"""The lab's header: device, path, force stop, and the switch between A and B."""

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QAbstractButton, QGridLayout, QHBoxLayout, QSizePolicy, QWidget

from study_app.gui.lab.lab_state import SIDES, Choices, LabView
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import RADIUS_CONTROL, Theme, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import add_layout, add_parts, hbox
from study_app.gui.widgets.controls import ActionButton, Choice, CompactStop, IconButton, Toggle
from study_app.gui.widgets.labels import label
from study_app.lab.ab_comparison import Side

HEIGHT = 44
WIDEST = 190
BADGE = 20
KEY = "X"


def side_colour(theme: Theme, side: Side) -> str:
    """Return the colour of a side: in the switch, the plots and the tank's words."""
    return theme.trace_x if side == "A" else theme.trace_y


def draw_badge(painter: QPainter, middle: QPointF, theme: Theme, side: Side, letter: str) -> None:
    """Paint a side's letter on a disc of its colour."""
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(side_colour(theme, side)))
    painter.drawEllipse(middle, BADGE / 2, BADGE / 2)
    painter.setPen(QColor(theme.on_accent))
    painter.setFont(font("key"))
    half = BADGE / 2
    painter.drawText(QRectF(middle.x() - half, middle.y() - half, BADGE, BADGE), Qt.AlignmentFlag.AlignCenter, letter)


class Badge(Themed, QWidget):
    """The letter of a side on its own."""

    def __init__(self) -> None:
        super().__init__()
        self._side: Side = "A"
        self.setFixedSize(BADGE + 2, BADGE + 2)

    def show_side(self, side: Side) -> None:
        if side != self._side:
            self._side = side
            self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        draw_badge(painter, QRectF(self.rect()).center(), self.theme, self._side, self._side)


class Segment(Themed, QAbstractButton):
    """One side: its letter and its name; the felt one is raised, with an accent edge."""

    def __init__(self, side: Side) -> None:
        super().__init__()
        self._letter: str = side
        self.setCheckable(True)
        self.setFixedHeight(HEIGHT - 8)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)

    def show_name(self, name: str, letter: str) -> None:
        if (name, letter) != (self.text(), self._letter):
            self._letter = letter
            self.setText(name)
            self.setToolTip(name)
            self.updateGeometry()
            self.update()

    def nextCheckState(self) -> None:
        """Leave it to the view which side is felt."""

    def sizeHint(self) -> QSize:
        width = QFontMetricsF(font("strong", scale=0.94)).horizontalAdvance(self.text())
        return QSize(min(round(width) + 60, WIDEST), HEIGHT - 8)

    def minimumSizeHint(self) -> QSize:
        return QSize(110, HEIGHT - 8)

    def paintEvent(self, _event: QPaintEvent) -> None:
        t = self.theme
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        body = QRectF(self.rect()).adjusted(1, 1, -1, -1)
        if self.isChecked() or self.underMouse():
            painter.setPen(QPen(QColor(t.accent), 1.6) if self.isChecked() else Qt.PenStyle.NoPen)
            painter.setBrush(QColor(t.surface if self.isChecked() else t.hover))
            painter.drawRoundedRect(body, RADIUS_CONTROL, RADIUS_CONTROL)
        if self.hasFocus():
            painter.setPen(QPen(QColor(t.text if self.isChecked() else t.accent), 2))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRoundedRect(body.adjusted(2, 2, -2, -2), RADIUS_CONTROL - 2, RADIUS_CONTROL - 2)
        side: Side = "A" if self._letter in {"A", "1"} else "B"
        draw_badge(painter, QPointF(24, self.height() / 2), t, side, self._letter)
        painter.setPen(QColor(t.text if self.isChecked() else t.text2))
        painter.setFont(font("strong", scale=0.94, weight=600 if self.isChecked() else 500))
        room = QRectF(42, 0, self.width() - 52, self.height())
        shown = painter.fontMetrics().elidedText(self.text(), Qt.TextElideMode.ElideRight, round(room.width()))
        painter.drawText(room, Qt.AlignmentFlag.AlignVCenter, shown)


class SideSwitch(Themed, QWidget):
    """Both sides in a track; ``switched`` when the other one is to be felt. The X key does the same."""

    switched = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setFixedHeight(HEIGHT)
        self.segments = {side: Segment(side) for side in SIDES}
        row = hbox(spacing=2, margins=(4, 4, 34, 4), parent=self)
        for segment in self.segments.values():
            segment.clicked.connect(lambda _on, it=segment: None if it.isChecked() else self.switched.emit())
            row.addWidget(segment)
        self.setToolTip("Feel the other setting (X)")

    def show_view(self, view: LabView) -> None:
        bench = view.workbench
        order: tuple[Side, ...] = SIDES if not bench.blind or bench.first == "A" else SIDES[::-1]
        for number, (place, side) in enumerate(zip(SIDES, order, strict=True), 1):
            segment = self.segments[place]
            segment.show_name(bench.shown_name(side), str(number) if bench.blind else side)
            segment.setChecked(side == bench.presented)
            felt = ", felt now" if side == bench.presented else ""
            segment.setAccessibleName(f"{'' if bench.blind else side + ': '}{bench.shown_name(side)}{felt}")

    def paintEvent(self, _event: QPaintEvent) -> None:
        t = self.theme
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(t.sunk))
        painter.drawRoundedRect(QRectF(self.rect()), RADIUS_CONTROL + 2, RADIUS_CONTROL + 2)
        cap = QRectF(self.width() - 28, self.height() / 2 - 10, 20, 20)
        painter.setPen(QPen(QColor(t.ctl), 1))
        painter.setBrush(QColor(t.surface))
        painter.drawRoundedRect(cap.adjusted(0.5, 0.5, -0.5, -0.5), 5, 5)
        painter.setPen(QColor(t.text2))
        painter.setFont(font("key"))
        painter.drawText(cap, Qt.AlignmentFlag.AlignCenter, KEY)


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
