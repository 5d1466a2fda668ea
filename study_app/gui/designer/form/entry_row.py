"""One entry of a list in the form: selected, dragged by its grip, or moved by keys."""

from typing import Final

from PySide6.QtCore import QEvent, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QGuiApplication, QKeyEvent, QKeySequence, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QApplication, QWidget

from study_app.gui.designer.form.typed_fields import FIELD_PX
from study_app.gui.designer.outline.rows import paint_grip
from study_app.gui.theme.theme import RADIUS_CONTROL
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import hbox
from study_app.gui.widgets.controls import IconButton
from study_app.gui.widgets.labels import Elided
from study_app.viewmodels.designer.form.form_rows import Entry
from study_app.viewmodels.designer.keys import with_key

KEYS: Final = "Alt+Up and Alt+Down move it, Delete removes it, Shift and the arrows select several"


class EntryRow(Themed, QWidget):
    """One entry in an outlined row: a grip where it can be dragged, title, id, and its buttons.

    Signals: ``pressed`` (whether it extends the selection, and whether it joins or leaves it), ``clicked``, ``stepped``
    (by how many rows a key goes on, and whether it extends the selection); ``dragged`` (how far down its parent the
    pointer is; None cancels), ``dropped``, ``moved`` (by how many places a key moves it); ``remove_asked``,
    ``duplicate_asked``, ``copy_asked``, ``pasted`` (a text); ``opened`` (by Enter, a double click, or a click where
    there is no grip).
    """

    pressed = Signal(bool, bool)
    clicked = Signal()
    stepped = Signal(int, bool)
    remove_asked = Signal()
    duplicate_asked = Signal()
    dragged = Signal(object)
    dropped = Signal()
    moved = Signal(int)
    copy_asked = Signal()
    pasted = Signal(str)
    opened = Signal()

    def __init__(self, entry: Entry, words: str, *, grip: bool = False) -> None:
        super().__init__()
        self.grip, self._pressed, self._dragging = grip, 0, False
        self.chosen, self._words = False, words
        if grip:
            self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
            self.setAccessibleDescription(KEYS)
        self.faulty = bool(entry.faults)
        self.title = Elided("label", "bad" if self.faulty else "text")
        self.title.show_text(entry.title)
        self.row = hbox(self.title, spacing=2, margins=(24 if grip else 12, 0, 2, 0), parent=self)
        if entry.note and entry.note.replace("_", " ") != entry.title.lower():
            note = Elided("small", "text2")
            note.show_text(entry.note)
            note.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            self.row.addWidget(note)
        self.setMinimumHeight(FIELD_PX + 2)
        self.setAccessibleName(words)

    def button(self, icon: str, name: str, action: str = "") -> IconButton:
        """Add a button at the right; Tab passes one whose action the row has a key for."""
        made = IconButton(icon, name, size=FIELD_PX - 2, role="plain")
        if action and self.grip:
            made.setToolTip(with_key(name, action))
            made.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.row.addWidget(made)
        return made

    def show_chosen(self, chosen: bool, count: int) -> None:
        """Show whether it is selected, with how many."""
        self.chosen = chosen
        self.setAccessibleName(f"{self._words}, one of {count} selected" if chosen and count > 1 else self._words)
        self.update()

    # moving

    def event(self, event: QEvent) -> bool:
        """Keep Alt and the arrows while the row has the keyboard; the place would move the whole element."""
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent) and self.grip:
            keys = (QKeySequence.StandardKey.Copy, QKeySequence.StandardKey.Paste)
            if self._by(event) or _duplicates(event) or any(event.matches(key) for key in keys):
                event.accept()
                return True
        return super().event(event)

    def _by(self, event: QKeyEvent) -> int:
        """Return by how many places a key moves the entry."""
        return _arrow(event) if _held(event) == Qt.KeyboardModifier.AltModifier and self.grip else 0

    def keyPressEvent(self, event: QKeyEvent) -> None:
        extends = _held(event) == Qt.KeyboardModifier.ShiftModifier
        if by := self._by(event):
            self.moved.emit(by)
        elif (by := _arrow(event)) and (extends or not _held(event)):
            self.stepped.emit(by, extends)
        elif event.key() in {Qt.Key.Key_Return, Qt.Key.Key_Enter} and not _held(event):
            self.opened.emit()
        elif event.key() == Qt.Key.Key_Delete and self.grip and not _held(event):
            self.remove_asked.emit()
        elif _duplicates(event) and self.grip:
            self.duplicate_asked.emit()
        elif event.matches(QKeySequence.StandardKey.Copy):
            self.copy_asked.emit()
        elif event.matches(QKeySequence.StandardKey.Paste):
            if text := QGuiApplication.clipboard().text().strip():
                self.pasted.emit(text)
        elif event.key() == Qt.Key.Key_Escape and self._dragging:
            self._let_go()
            self.dragged.emit(None)
        else:
            super().keyPressEvent(event)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        left = event.button() == Qt.MouseButton.LeftButton
        self._pressed = max(1, round(event.position().y())) if left else 0
        if left:
            self.setFocus(Qt.FocusReason.MouseFocusReason)
            held = event.modifiers()
            shift, control = Qt.KeyboardModifier.ShiftModifier, Qt.KeyboardModifier.ControlModifier
            self.pressed.emit(bool(held & shift), bool(held & control))

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self.opened.emit()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if not self.grip or not event.buttons() & Qt.MouseButton.LeftButton or not self._pressed:
            return
        y = round(event.position().y())
        if not self._dragging and abs(y - self._pressed) >= QApplication.startDragDistance():
            self._dragging = True
            self.setCursor(Qt.CursorShape.ClosedHandCursor)
        if self._dragging:
            self.dragged.emit(self.mapToParent(event.position().toPoint()).y())

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if self._dragging:
            self._let_go()
            self.dropped.emit()
        elif self._pressed and not event.modifiers():
            self.clicked.emit()
            if not self.grip:
                self.opened.emit()
        self._pressed = 0

    def _let_go(self) -> None:
        self._dragging, self._pressed = False, 0
        self.unsetCursor()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setBrush(QColor(self.theme.selected) if self.chosen else Qt.BrushStyle.NoBrush)
        ink = self.theme.bad if self.faulty else self.theme.accent if self.hasFocus() else self.theme.ctl
        painter.setPen(QPen(QColor(ink), 2 if self.faulty or self.hasFocus() else 1))
        painter.drawRoundedRect(QRectF(self.rect()).adjusted(1, 1, -1, -1), RADIUS_CONTROL, RADIUS_CONTROL)
        if self.grip:
            paint_grip(painter, QRectF(6, 0, 12, self.height()), self.theme.text2)


def _held(event: QKeyEvent) -> Qt.KeyboardModifier:
    return event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier


def _arrow(event: QKeyEvent) -> int:
    return {Qt.Key.Key_Up: -1, Qt.Key.Key_Down: 1}.get(Qt.Key(event.key()), 0)


def _duplicates(event: QKeyEvent) -> bool:
    return event.key() == Qt.Key.Key_D and _held(event) == Qt.KeyboardModifier.ControlModifier
