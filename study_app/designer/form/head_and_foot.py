"""The head of the form, with the title, ID and actions of the element, and its foot, with help for a field."""

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPaintEvent
from PySide6.QtWidgets import QGridLayout, QMenu, QWidget

from study_app.designer.document.steps import RenameElement, SetValue
from study_app.designer.form.fields import TypedLine
from study_app.designer.form.rows import Form
from study_app.designer.parts import LABEL_PX, cut_text, small_button
from study_app.gui.kit import command_tip
from study_app.gui.theme import RADIUS_CONTROL, Themed, draw_icon, font
from study_app.gui.widgets import (
    QWIDGETSIZE_MAX,
    Elided,
    IconButton,
    add_layout,
    button_text,
    fill_rounded,
    hbox,
    label,
    smooth_painter,
    vbox,
)
from study_app.number_text import capitalised
from study_app.protocol.source import Path

_TILE = 40
_HELP_LINES = 2
"""Number of help lines for which there is always room, so that longer help does not move the form."""


class _Tile(Themed, QWidget):
    """An icon on a tinted square."""

    def __init__(self) -> None:
        super().__init__()
        self.icon = "ring"
        self.setFixedSize(_TILE, _TILE)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = smooth_painter(self)
        painter.setPen(QColor(self.theme.selected))
        painter.setBrush(QColor(self.theme.selected))
        painter.drawRoundedRect(QRectF(self.rect()), RADIUS_CONTROL, RADIUS_CONTROL)
        draw_icon(painter, self.icon, QRectF(self.rect()).adjusted(10, 10, -10, -10), self.theme.accent, 2.0)


class FormHead(QWidget):
    """The head of the form. Signals: ``asked`` (a request), ``feel_asked`` (path), ``id_typed`` (path, current text).

    ``unlock_asked`` is emitted if the user wants to change a locked ID.
    """

    asked = Signal(object)
    id_typed = Signal(object, str)
    unlock_asked = Signal()
    feel_asked = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.form: Form | None = None
        self._faulty = False
        self.tile = _Tile()
        self.title = Elided("card")
        self.kind = Elided("small", "text2")
        self.used = Elided("small", "text2")
        self.ask = small_button("list", "When…", height=34)
        self.ask.hide()
        self.asks = QMenu(self)
        self.asks.setFont(font("label"))
        self.id = TypedLine("ID")
        self.id.setMinimumWidth(110)
        self.id.setMaximumWidth(230)
        self.id.submits_while_typing = False
        self.unlock = small_button("lock", "Change anyway…", height=34)
        self.unlock.hide()
        self._lock: tuple[object, str] = ((), "")
        self._read_only = False
        self.refusal = label("", "label", "bad", wraps=True)
        self.refusal.hide()
        self.feel = IconButton("drop", "Feel", size=34)
        self.series = small_button("bars", "Series…", height=34)
        self.up = IconButton("arrow_up", "Move up", size=34)
        self.down = IconButton("arrow_down", "Move down", size=34)
        self.copy = IconButton("copy", "Duplicate", size=34)
        self.delete = IconButton("trash", "Delete", f"{command_tip('delete')} in the outline", size=34, role="danger")
        titles = vbox(self.title, self.kind, spacing=0)
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(8)
        grid.addWidget(self.tile, 0, 0)
        add_layout(grid, titles, 0, 1)
        add_layout(
            grid, hbox(self.ask, self.feel, self.series, self.up, self.down, self.copy, self.delete, spacing=8), 0, 2
        )
        self.id_line = QWidget()
        id_label = label("ID", "label")
        id_label.setFixedWidth(LABEL_PX)
        parts = (id_label, (self.id, 8), self.unlock, (self.used, 1))
        hbox(*parts, spacing=8, margins=(0, 4, 0, 0), parent=self.id_line)
        grid.addWidget(self.id_line, 1, 0, 1, 3)
        grid.addWidget(self.refusal, 2, 0, 1, 3)
        grid.setColumnStretch(1, 1)
        self.id.typed.connect(self._rename)
        self.id.textEdited.connect(lambda name: self.id_typed.emit(self.path, name))
        self.unlock.clicked.connect(self.unlock_asked)
        self.feel.clicked.connect(lambda: self.feel_asked.emit(self.path))
        self.ask.clicked.connect(lambda: self.asks.popup(self.ask.mapToGlobal(self.ask.rect().bottomLeft())))

    @property
    def path(self) -> Path:
        return () if self.form is None else self.form.path

    def show_form(self, form: Form, *, read_only: bool) -> None:
        if self.form is None or self.form.path != form.path or self.form.id != form.id:
            self.refuse("")
        self.form = form
        self.tile.icon = form.icon
        self.tile.update()
        self.title.show_text(form.title)
        position = "" if form.position is None else f"{form.position[0]} of {form.position[1]}"
        self.kind.show_text("  ·  ".join(filter(None, (form.kind, position))))
        self.used.show_text(form.used)
        self.ask.setVisible(bool(form.asks) and not read_only)
        self.asks.clear()
        for sentence, request in form.asks:
            self.asks.addAction(button_text(sentence)).triggered.connect(
                lambda _on=False, request=request: self.asked.emit(request)
            )
        self.id_line.setVisible(form.id is not None)
        self._read_only = read_only
        self._apply_lock()
        if form.id_faults:
            self.refuse("\n".join(form.id_faults))
        elif self._faulty:
            self.refuse("")
        self._faulty = bool(form.id_faults)
        if not self.refusal.text() or self._faulty:
            self.id.show_text(form.id or "")
        self.feel.setVisible(bool(form.feel))
        self.feel.setAccessibleName(form.feel or "Feel")
        self.feel.setToolTip(f"{form.feel} in the lab")
        self.series.setVisible(form.series and not read_only)
        has_arrows = form.position is not None  # next to the arrows, there is only room for the icon
        self.series.show_action("bars", "" if has_arrows else "Series…")
        self.series.setMaximumWidth(34 if has_arrows else QWIDGETSIZE_MAX)
        self.series.setAccessibleName(f"Series of {form.title}")
        place, count = form.position or (0, 0)
        for button in (self.up, self.down):
            button.setVisible(form.position is not None and not read_only)
        for button in (self.copy, self.delete):
            button.setVisible(form.id is not None and not read_only)
        self.up.setEnabled(not read_only and place > 1)
        self.down.setEnabled(not read_only and 0 < place < count)
        for button in (self.copy, self.delete):
            button.setEnabled(not read_only and len(form.path) > 1 and form.id is not None)

    def show_lock(self, path: object, reason: str) -> None:
        self._lock = (path, reason)
        self._apply_lock()

    def _apply_lock(self) -> None:
        path, reason = self._lock
        locked = bool(reason) and self.form is not None and self.form.path == path
        self.id.setReadOnly(self._read_only or locked)
        self.id.setToolTip(reason if locked else command_tip("rename"))
        self.unlock.setVisible(locked and not self._read_only)
        self.unlock.setToolTip(reason)
        self.unlock.setAccessibleDescription(reason)

    def edit_id(self) -> None:
        self.id.setFocus(Qt.FocusReason.ShortcutFocusReason)
        self.id.selectAll()

    def refuse(self, sentence: str) -> None:
        self.refusal.setText(capitalised(sentence))
        self.refusal.setVisible(bool(sentence))
        self.id.show_refused(bool(sentence))

    def _rename(self, name: str) -> None:
        if self.form is not None and self.form.id is not None:
            if name == self.form.id:
                self.refuse("")
            elif not self.form.id:
                self.asked.emit(SetValue((*self.form.path, "id"), name))
            else:
                self.asked.emit(RenameElement(self.form.path, name))


class FormFoot(Themed, QWidget):
    """The label, the path and the description of a field."""

    def __init__(self) -> None:
        super().__init__()
        self.title = label("", "label")
        self.place = cut_text("", "small", "text2", right=True)
        self.help_label = label("", "small", "text2", wraps=True)
        self.help_label.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.help_label.setMinimumHeight(_HELP_LINES * self.help_label.fontMetrics().lineSpacing())
        self.glossary = small_button("info", "Glossary", role="plain", height=26)
        above = hbox(self.title, (self.place, 1), self.glossary, spacing=8)
        vbox(above, self.help_label, spacing=3, margins=(12, 4, 4, 8), parent=self)

    def show_help(self, title: str, place: str, text: str) -> None:
        self.title.setText(title)
        self.place.show_text(place)
        self.help_label.setText(text)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = smooth_painter(self)
        fill_rounded(painter, QRectF(self.rect()), RADIUS_CONTROL, self.theme.sunk)
