"""The operator's notes and marks, which go into the journal with their time."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QPlainTextEdit, QWidget

from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Card, Icon
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import Clamped, Elided, figures, label
from study_app.viewmodels.number_words import minutes
from study_app.viewmodels.operator import NOTES_SHOWN, OperatorView


class NoteField(QPlainTextEdit):
    """Where a note is written; Enter keeps it, Shift+Enter begins a line."""

    entered = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setPlaceholderText("Write a note …")
        self.setAccessibleName("Note")
        self.setFont(font("label", weight=400))
        self.setTabChangesFocus(True)
        self.setMinimumHeight(52)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Keep the note on Enter; leave Esc to the window."""
        plain = not event.modifiers() & Qt.KeyboardModifier.ShiftModifier
        if event.key() in {Qt.Key.Key_Return, Qt.Key.Key_Enter} and plain:
            self.entered.emit()
        elif event.key() == Qt.Key.Key_Escape:
            self.clearFocus()
            event.ignore()
        else:
            super().keyPressEvent(event)


class NotesCard(Card):
    """The last notes and marks, a field for the next, and two buttons."""

    note_written = Signal(str)
    mark_set = Signal()

    def __init__(self) -> None:
        super().__init__(padding=16, gap=10)
        self._shown = NOTES_SHOWN
        self._view: OperatorView | None = None
        self._head = QWidget()
        stored = label("stored in the journal", "small", "text2")
        hbox(label("Notes and marks", "card"), STRETCH, stored, margins=0, parent=self._head)
        self.lines = [_NoteRow(newest=number == 0) for number in range(NOTES_SHOWN)]
        self.none = label("No notes yet.", "label", "text2")
        self._list = QWidget()
        vbox(self.none, *self.lines, STRETCH, spacing=6, margins=0, parent=self._list)
        self.field = NoteField()
        self.hint = label("Press Enter to store it with the time", "small", "text3")
        self.add = ActionButton("pen", "Add note", key="N")
        self.mark = ActionButton("flag", "Mark", key="M")
        buttons = hbox((self.add, 1), (self.mark, 1), spacing=12)
        add_parts(self.column, self._head, self._list, (self.field, 1), self.hint, buttons)
        self.field.entered.connect(self._keep)
        self.add.clicked.connect(self._add)
        self.mark.clicked.connect(self.mark_set)

    def show_lines(self, most: int) -> None:
        """Show so many notes at most; heading and hint go with the first that is left out."""
        self._shown = most
        self._head.setVisible(most == NOTES_SHOWN)
        self._list.setVisible(most > 0)
        self.hint.setVisible(most == NOTES_SHOWN)
        self.field.setToolTip("" if most == NOTES_SHOWN else self.hint.text())
        if self._view is not None:
            self.show_view(self._view)

    def show_view(self, view: OperatorView) -> None:
        self._view = view
        self.none.setVisible(not view.notes)
        for index, row in enumerate(self.lines):
            shown = index < min(len(view.notes), self._shown)
            row.setVisible(shown)
            if shown:
                row.show_note(view.notes[index].kind, minutes(view.notes[index].t_s), view.notes[index].text)
        for button in (self.add, self.mark):
            button.setEnabled(not view.over)
        self.field.setEnabled(not view.over)

    def _add(self) -> None:
        if self.field.toPlainText().strip():
            self._keep()
        else:
            self.field.setFocus(Qt.FocusReason.ShortcutFocusReason)

    def _keep(self) -> None:
        text = self.field.toPlainText().strip()
        if text:
            self.field.clear()
            self.note_written.emit(text)


class _NoteRow(QWidget):
    """Sign, time and text, of the newest note in two lines; a long text ends in "…" and is whole in the tip."""

    def __init__(self, *, newest: bool) -> None:
        super().__init__()
        self.sign = Icon("pen", "text2", 16)
        self.time = figures("", "label", "text2")
        self.text = Clamped("", 2, "label", steady=False) if newest else Elided("label")
        self.text.setFont(font("label", weight=400))
        top = Qt.AlignmentFlag.AlignTop
        hbox((self.sign, 0, top), (self.time, 0, top), (self.text, 1), spacing=8, margins=0, parent=self)

    def show_note(self, kind: str, at: str, text: str) -> None:
        self.sign.show_icon(*(("flag", "warn") if kind == "mark" else ("pen", "text2")))
        self.time.setText(at)
        self.text.show_text(" ".join(text.split()) or "Mark")
