"""The operator's controls: stop the force, pause, repeat, end the session, write notes, diagnose the device."""

from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import (
    QLabel,
    QPlainTextEdit,
    QPushButton,
    QSizePolicy,
    QStyle,
    QStyleOptionButton,
    QStylePainter,
    QWidget,
)

from study_app.gui.operator.operator_view import NOTES_SHOWN, OperatorView
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.accessible import plain_tip
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, grid, hbox, vbox
from study_app.gui.widgets.cards import Card, Chip, Icon
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import Clamped, Elided, figures, label
from study_app.number_text import clock_text


class Actions(Card):
    """The bar of buttons at the bottom of the window."""

    def __init__(self) -> None:
        super().__init__(padding=14)
        self.pause = ActionButton("pause", "Pause", key="P")
        self.repeat = ActionButton("repeat", "Repeat trial…", key="R")
        self.hint = label("", "label", "text2", wraps=True, weight=400)
        self.end = ActionButton("cross", "End session…", role="danger")
        self.close_session = ActionButton("check", "Close session", role="primary")
        self._resumes = False
        self._shows_icons = True
        row = hbox(self.pause, self.repeat, STRETCH, self.end, self.close_session, spacing=10)
        for button in (self.pause, self.repeat, self.end, self.close_session):  # whose padding can shrink
            button.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)
        self.close_session.hide()
        add_parts(self.column, row, self.hint)

    def set_narrow(self, narrow: bool) -> None:
        """Hide the buttons' icons if the bar is narrow."""
        self._shows_icons = not narrow
        for button, icon in ((self.repeat, "repeat"), (self.end, "cross")):
            button.show_action("" if narrow else icon, button.text())
        self._show_pause()

    def _show_pause(self) -> None:
        icon, text = ("play", "Resume") if self._resumes else ("pause", "Pause")
        self.pause.show_action(icon if self._shows_icons else "", text)

    def show_view(self, view: OperatorView) -> None:
        self._resumes = view.may_resume
        self._show_pause()
        self.pause.setEnabled(view.may_pause or view.may_resume)
        self.repeat.setEnabled(view.may_repeat)
        for button in (self.pause, self.repeat, self.end):
            button.setVisible(not view.over)
        if view.over and self.close_session.isHidden():
            self.close_session.show()
            self.close_session.setFocus()
        self.hint.setText(_hint_text(view))

    @property
    def pause_request(self) -> str:
        """The request that the pause button makes now: "pause" or "resume"."""
        return "resume" if self._resumes else "pause"


def _hint_text(view: OperatorView) -> str:
    if view.over and view.trouble:
        return ""
    if view.over:
        return "The journal is closed and the tables have been written."
    if view.waits:
        return "The force is off. The answers are kept in memory until they can be written to disk."
    if view.state == "trouble":
        return "The force is off. All answers so far are on disk."
    if view.state == "force off":
        return "The force stays off until you turn it on again."
    if view.state == "paused":
        return "An interrupted trial starts again."
    return "You will be asked for a reason; both recordings are kept." if view.may_repeat else ""


class _NoteField(QPlainTextEdit):
    """A field for notes; Enter stores the note, Shift+Enter begins a new line."""

    entered = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setPlaceholderText("Write a note…")
        self.setAccessibleName("Note")
        self.setFont(font("label", weight=400))
        self.setTabChangesFocus(True)
        self.setMinimumHeight(52)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Store the note on Enter; leave Esc to the window."""
        is_unshifted = not event.modifiers() & Qt.KeyboardModifier.ShiftModifier
        if event.key() in {Qt.Key.Key_Return, Qt.Key.Key_Enter} and is_unshifted:
            self.entered.emit()
        elif event.key() == Qt.Key.Key_Escape:
            self.clearFocus()
            event.ignore()
        else:
            super().keyPressEvent(event)


class NotesCard(Card):
    """The last notes and marks, a field for a new note, and buttons to add a note or a mark."""

    note_written = Signal(str)

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
        self.field = _NoteField()
        self.hint = label("Press Enter to save the note with the time", "small", "text3")
        self.add = ActionButton("pen", "Add note", key="N")
        self.mark = ActionButton("flag", "Mark", key="M")
        buttons = hbox((self.add, 1), (self.mark, 1), spacing=12)
        add_parts(self.column, self._head, self._list, (self.field, 1), self.hint, buttons)
        self.field.entered.connect(self._submit_note)
        self.add.clicked.connect(self._add_note)

    def set_note_count(self, count: int) -> None:
        """Set the maximum number of notes; if it is less than `NOTES_SHOWN`, the heading and the hint are hidden."""
        self._shown = count
        self._head.setVisible(count == NOTES_SHOWN)
        self._list.setVisible(count > 0)
        self.hint.setVisible(count == NOTES_SHOWN)
        self.field.setToolTip(plain_tip("" if count == NOTES_SHOWN else self.hint.text()))
        if self._view is not None:
            self.show_view(self._view)

    def show_view(self, view: OperatorView) -> None:
        self._view = view
        self.none.setVisible(not view.notes)
        for index, row in enumerate(self.lines):
            shown = index < min(len(view.notes), self._shown)
            row.setVisible(shown)
            if shown:
                row.show_note(view.notes[index].kind, clock_text(view.notes[index].t_s), view.notes[index].text)
        for button in (self.add, self.mark):
            button.setEnabled(not view.over)
        self.field.setEnabled(not view.over)

    def _add_note(self) -> None:
        if self.field.toPlainText().strip():
            self._submit_note()
        else:
            self.field.setFocus(Qt.FocusReason.ShortcutFocusReason)

    def _submit_note(self) -> None:
        text = self.field.toPlainText().strip()
        if text:
            self.field.clear()
            self.note_written.emit(text)


class _NoteRow(QWidget):
    """A note with its icon, time and text, which has up to two lines in the newest note."""

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


LEAST_WIDTH, LEAST_HEIGHT = 320, 160


class _StopButton(Themed, QPushButton):
    """The button STOP FORCE, which names other ways to stop; it acts when pressed, not when released."""

    def __init__(self, device_button: str) -> None:
        super().__init__()
        self._others = f"Hold Esc in any window{f', or {device_button}' if device_button else ''}"
        self.setProperty("role", "stop")
        self.setAccessibleName("Stop force")
        self.setMinimumSize(LEAST_WIDTH, LEAST_HEIGHT)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setCursor(Qt.CursorShape.PointingHandCursor)

    def sizeHint(self) -> QSize:
        return QSize(LEAST_WIDTH, LEAST_HEIGHT)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QStylePainter(self)
        option = QStyleOptionButton()
        self.initStyleOption(option)
        painter.drawControl(QStyle.ControlElement.CE_PushButtonBevel, option)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        ink = QColor(self.theme.on_stop)
        middle, width = self.height() / 2, self.width()
        draw_icon(painter, "stop", QRectF(0, middle - 68, width, 58), ink, 2.0)
        painter.setPen(ink)
        painter.setFont(font("title", weight=700, scale=1.08))
        centred = Qt.AlignmentFlag.AlignCenter
        painter.drawText(QRectF(0, middle, width, 38), centred, "STOP FORCE")
        painter.setFont(font("label", weight=600))
        wrapped = Qt.AlignmentFlag.AlignHCenter | Qt.TextFlag.TextWordWrap
        painter.drawText(QRectF(8, middle + 42, width - 16, 38), wrapped, self._others)


class StopPanel(Card):
    """The stop button, the state of the force above it, and after a stop the button to resume.

    ``felt`` tells whether the device exerts force; ``device_button`` names the device's button that also stops the
    force, if any.
    """

    def __init__(self, *, felt: bool = True, device_button: str = "") -> None:
        super().__init__(padding=12, gap=10)
        self._felt = felt
        self.sign = Icon("check", "ok", 18)
        self.word = label("", "strong")
        self.fade_in = ActionButton("", "Fade in again", height=36)
        self.stop = _StopButton(device_button)
        row = hbox(self.sign, self.word, STRETCH, self.fade_in, spacing=10, margins=(6, 0, 0, 0))
        policy = self.fade_in.sizePolicy()
        policy.setRetainSizeWhenHidden(True)
        self.fade_in.setSizePolicy(policy)
        self.fade_in.hide()
        add_parts(self.column, row, (self.stop, 1))

    def show_view(self, view: OperatorView) -> None:
        if view.over:
            self._show_word("minus", "text2", "Force is off")
        elif view.force_on and self._felt:
            self._show_word("check", "ok", "Force is on")
        elif view.force_on:
            self._show_word("minus", "text2", "Visual only, no force")
        else:
            self._show_word("stop", "warn", "Force is off")
        self.fade_in.setVisible(not view.force_on and view.may_resume)

    def _show_word(self, icon: str, ink: str, word: str) -> None:
        self.sign.show_icon(icon, ink)  # type: ignore[arg-type]  # one of three literals above
        self.word.setText(word)


ALL_ROWS = 99


class DeviceCard(Card):
    """The name, state and properties of the device."""

    def __init__(self) -> None:
        super().__init__(padding=16, gap=10)
        self.icon = Icon("device", "text2", 22)
        self.name = label("", "card")
        self.chip = Chip("neutral", "ring", "Waiting", small=True)
        self.diagnose = ActionButton("pulse", "Diagnose…", key="D", height=36)
        self.diagnose.setToolTip("Turns off the force and pauses the session first")
        self._row_limit = ALL_ROWS
        self._view: OperatorView | None = None
        row = hbox(self.icon, self.name, STRETCH, self.chip, spacing=10)
        add_layout(self.column, row)
        self._grid = grid(12, 8)
        self._grid.setColumnStretch(1, 1)
        add_parts(self.column, self._grid, self.diagnose)
        self.rows: list[tuple[QLabel, Elided]] = []

    def set_row_limit(self, most: int) -> None:
        """Show at most ``most`` rows; the others are in the card's tip."""
        self._row_limit = most
        if self._view is not None:
            self.show_view(self._view)

    def show_view(self, view: OperatorView) -> None:
        device, self._view = view.device, view
        self.icon.show_icon(device.icon, "text2")
        self.name.setText(device.name)
        self.chip.show_state(*(("ok", "check", "Ready") if device.ready else ("bad", "warning", "Fault")))
        while len(self.rows) < len(device.rows):
            name, value = label("", "label", "text2"), Elided("label")
            value.setFont(font("label", weight=600, tabular=True))
            value.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            self._grid.addWidget(name, len(self.rows), 0)
            self._grid.addWidget(value, len(self.rows), 1)
            self.rows.append((name, value))
        for index, ((name, value), (name_text, value_text)) in enumerate(zip(self.rows, device.rows, strict=True)):
            name.setText(name_text)
            value.show_text(value_text)
            for part in (name, value):
                part.setVisible(index < self._row_limit)
        self.setToolTip(plain_tip("\n".join(f"{name}: {value}" for name, value in device.rows[self._row_limit :])))
