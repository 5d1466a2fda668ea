"""One entry of a list in the form: dragged by its grip, or moved by keys."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QGuiApplication, QKeyEvent, QKeySequence, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QApplication, QHBoxLayout, QWidget

from study_app.gui.designer.form.typed_fields import FIELD_PX
from study_app.gui.designer.outline.rows import paint_grip
from study_app.gui.theme.theme import RADIUS_CONTROL
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.controls import IconButton
from study_app.gui.widgets.labels import Elided
from study_app.viewmodels.designer.form_rows import Entry


class EntryRow(Themed, QWidget):
    """One entry in an outlined row: a grip where it can be dragged, title, id, and its buttons.

    Signals: ``dragged`` (how far down its parent the pointer is; None cancels), ``dropped``, ``moved`` (by how many
    places a key moves it), ``copy_asked``, ``pasted`` (a text).
    """

    dragged = Signal(object)
    dropped = Signal()
    moved = Signal(int)
    copy_asked = Signal()
    pasted = Signal(str)

    def __init__(self, entry: Entry, words: str, *, grip: bool = False) -> None:
        super().__init__()
        self.grip, self._pressed, self._dragging = grip, 0, False
        if grip:
            self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
            self.setAccessibleDescription("Alt+Up and Alt+Down move it")
        self.faulty = bool(entry.faults)
        self.title = Elided("label", "bad" if self.faulty else "text")
        self.title.show_text(entry.title)
        self.row = QHBoxLayout(self)
        self.row.setContentsMargins(24 if grip else 12, 0, 2, 0)
        self.row.setSpacing(2)
        self.row.addWidget(self.title, 1)
        if entry.note and entry.note.replace("_", " ") != entry.title.lower():
            note = Elided("small", "text2")
            note.show_text(entry.note)
            note.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            self.row.addWidget(note, 1)
        self.setMinimumHeight(FIELD_PX + 2)
        self.setAccessibleName(words)

    def button(self, icon: str, name: str) -> IconButton:
        """Add a button at the right."""
        made = IconButton(icon, name, size=FIELD_PX - 2, role="plain")
        self.row.addWidget(made)
        return made

    # moving

    def event(self, event: QEvent) -> bool:
        """Keep Alt and the arrows while the row has the keyboard; the place would move the whole element."""
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent) and self.grip:
            keys = (QKeySequence.StandardKey.Copy, QKeySequence.StandardKey.Paste)
            if self._by(event) or any(event.matches(key) for key in keys):
                event.accept()
                return True
        return super().event(event)

    def _by(self, event: QKeyEvent) -> int:
        alone = event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier == Qt.KeyboardModifier.AltModifier
        return {Qt.Key.Key_Up: -1, Qt.Key.Key_Down: 1}.get(Qt.Key(event.key()), 0) if alone and self.grip else 0

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802 - Qt's name
        """Move by Alt and the arrows; cancel a drag at Esc."""
        if by := self._by(event):
            self.moved.emit(by)
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

    def mousePressEvent(self, event: QMouseEvent) -> None:  # noqa: N802 - Qt's name
        """Note where a drag may begin."""
        self._pressed = round(event.position().y()) if event.button() == Qt.MouseButton.LeftButton else 0

    def mouseMoveEvent(self, event: QMouseEvent) -> None:  # noqa: N802 - Qt's name
        """Drag."""
        if not self.grip or not event.buttons() & Qt.MouseButton.LeftButton or not self._pressed:
            return
        y = round(event.position().y())
        if not self._dragging and abs(y - self._pressed) >= QApplication.startDragDistance():
            self._dragging = True
            self.setCursor(Qt.CursorShape.ClosedHandCursor)
        if self._dragging:
            self.dragged.emit(self.mapToParent(event.position().toPoint()).y())

    def mouseReleaseEvent(self, _event: QMouseEvent) -> None:  # noqa: N802 - Qt's name
        """Drop."""
        if self._dragging:
            self._let_go()
            self.dropped.emit()

    def _let_go(self) -> None:
        self._dragging, self._pressed = False, 0
        self.unsetCursor()

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint the edge and the grip."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if self.grip:
            paint_grip(painter, QRectF(6, 0, 12, self.height()), self.theme.text2)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        ink = self.theme.bad if self.faulty else self.theme.accent if self.hasFocus() else self.theme.ctl
        painter.setPen(QPen(QColor(ink), 2 if self.faulty or self.hasFocus() else 1))
        painter.drawRoundedRect(QRectF(self.rect()).adjusted(1, 1, -1, -1), RADIUS_CONTROL, RADIUS_CONTROL)
