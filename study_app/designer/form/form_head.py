"""The head of the form: icon, title and id of the element, and the buttons that move, copy and delete it."""

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QGridLayout, QWidget

from study_app.designer.form.form_rows import Form
from study_app.designer.form.typed_fields import TypedLine
from study_app.designer.place.requests import RenameElement, SetValue
from study_app.designer.problems.repair_button import NameRefusal
from study_app.gui.kit.commands import tip
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import RADIUS_CONTROL, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.accessible import say
from study_app.gui.widgets.boxes import add_layout, hbox, vbox
from study_app.gui.widgets.cards import QWIDGETSIZE_MAX
from study_app.gui.widgets.controls import ActionButton, IconButton
from study_app.gui.widgets.labels import Elided, label

TILE = 40
LABEL_PX = 116


class Tile(Themed, QWidget):
    """An icon on a tinted square."""

    def __init__(self) -> None:
        super().__init__()
        self.icon = "ring"
        self.setFixedSize(TILE, TILE)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QColor(self.theme.selected))
        painter.setBrush(QColor(self.theme.selected))
        painter.drawRoundedRect(QRectF(self.rect()), RADIUS_CONTROL, RADIUS_CONTROL)
        draw_icon(painter, self.icon, QRectF(self.rect()).adjusted(10, 10, -10, -10), self.theme.accent, 2.0)


class FormHead(QWidget):
    """Signals: ``asked`` (a request), ``feel_asked`` (path), ``id_typed`` (path, text so far).

    ``unlock_asked`` is emitted where a locked id is to be changed, ``comments_asked`` where the comments are to be seen
    that mention the id before. What ``up``, ``down``, ``copy`` and ``delete`` do is
    done to every selected element.
    """

    asked = Signal(object)
    id_typed = Signal(object, str)
    unlock_asked = Signal()
    comments_asked = Signal()
    feel_asked = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.form: Form | None = None
        self._faulty = False
        self.tile = Tile()
        self.title = Elided("card")
        self.kind = Elided("small", "text2")
        self.followed = Elided("small", "text2")
        self.used = Elided("small", "text2")
        self.id = TypedLine("Id")
        self.id.setMinimumWidth(110)
        self.id.setMaximumWidth(230)
        self.id.rests = False
        self.unlock = ActionButton("lock", "Change anyway …", height=34)
        self.unlock.setProperty("dense", "true")
        self.unlock.setFont(font("label"))
        self.unlock.hide()
        self.comments = ActionButton("", "Comments", role="plain", height=34)
        self.comments.setProperty("dense", "true")
        self.comments.setFont(font("label"))
        self.comments.hide()
        self._lock: tuple[object, str] = ((), "")
        self._read_only = False
        self.refusal = NameRefusal("Rename to")
        self.refusal.chosen.connect(self._take_free)
        self.feel = IconButton("drop", "Feel", size=34)
        self.series = ActionButton("bars", "Series …", height=34)
        self.series.setProperty("dense", "true")
        self.series.setFont(font("label"))
        self.series.setToolTip(tip("series"))
        self.up = IconButton("arrow_up", "Move up", tip("up"), size=34)
        self.down = IconButton("arrow_down", "Move down", tip("down"), size=34)
        self.copy = IconButton("copy", "Duplicate", tip("duplicate"), size=34)
        self.delete = IconButton("trash", "Delete", f"{tip('delete')} in the outline", size=34, role="danger")
        words = vbox(self.title, hbox(self.kind, (self.followed, 1), spacing=8), spacing=0)
        grid = self._grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(8)
        grid.addWidget(self.tile, 0, 0)
        add_layout(grid, words, 0, 1)
        add_layout(grid, hbox(self.feel, self.series, self.up, self.down, self.copy, self.delete, spacing=8), 0, 2)
        self.id_line = QWidget()
        words_of_id = label("Id", "label")
        words_of_id.setFixedWidth(LABEL_PX)
        parts = (words_of_id, (self.id, 8), self.unlock, self.comments, (self.used, 1))
        hbox(*parts, spacing=8, margins=(0, 4, 0, 0), parent=self.id_line)
        grid.addWidget(self.id_line, 1, 0, 1, 3)
        grid.addWidget(self.refusal, 2, 0, 1, 3)
        grid.setColumnStretch(1, 1)
        self.id.typed.connect(self._rename)
        self.id.textEdited.connect(self._type_id)
        self.unlock.clicked.connect(self.unlock_asked)
        self.comments.clicked.connect(self.comments_asked)
        self.feel.clicked.connect(self._ask_to_feel)

    def show_form(self, form: Form, *, read_only: bool) -> None:
        if self.form is None or self.form.path != form.path or self.form.id != form.id:
            self.refuse("")
        self.form = form
        self.tile.icon = form.icon
        self.tile.update()
        self.title.show_text(form.title)
        at = "" if form.position is None else f"{form.position[0]} of {form.position[1]}"
        self.kind.show_text("  ·  ".join(filter(None, (form.kind, at))))
        self.used.show_text(form.used)
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
        alone = form.position is not None  # next to the arrows there is room for the icon alone
        self.series.show_action("bars", "" if alone else "Series …")
        self.series.setMaximumWidth(34 if alone else QWIDGETSIZE_MAX)
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

    def show_lock(self, path: object, why: str) -> None:
        """Lock the id of the element at ``path``, or with "" unlock it."""
        self._lock = (path, why)
        self._apply_lock()

    def show_comments(self, words: str) -> None:
        """Offer the comments that mention the id before, with "" none; nothing moves and the keyboard stays."""
        if words and words != self.comments.text():
            say(self, words)
        self.comments.setText(words or "Comments")
        self.comments.setVisible(bool(words))

    def show_followed(self, words: str) -> None:
        """Show in place of the kind, and say once, what followed the id."""
        if words:
            say(self, words)
        self.followed.show_text(words)
        self.kind.setHidden(bool(words))
        self._grid.activate()  # at once, or the words are cut where there was less room

    def _apply_lock(self) -> None:
        path, why = self._lock
        locked = bool(why) and self.form is not None and self.form.path == path
        self.id.setReadOnly(self._read_only or locked)
        self.id.setToolTip(why if locked else tip("rename"))
        self.unlock.setVisible(locked and not self._read_only)
        self.unlock.setToolTip(why)
        self.unlock.setAccessibleDescription(why)

    def edit_id(self) -> None:
        """Go to the id."""
        self.id.setFocus(Qt.FocusReason.ShortcutFocusReason)
        self.id.selectAll()

    def refuse(self, sentence: str, free: str = "") -> None:
        """Say why the id cannot be changed, and offer one that is free."""
        self.refusal.show_refusal(sentence, free)
        self.id.show_refused(bool(sentence))

    def _type_id(self, name: str) -> None:
        if self.form is not None:
            self.id_typed.emit(self.form.path, name)

    def _take_free(self, name: str) -> None:
        """Take the id that is proposed; the keyboard goes from its button, which is gone then, to the id."""
        self.id.setFocus(Qt.FocusReason.OtherFocusReason)
        self.id.setText(name)
        self._rename(name)

    def _ask_to_feel(self) -> None:
        if self.form is not None:
            self.feel_asked.emit(self.form.path)

    def _rename(self, name: str) -> None:
        if self.form is not None and self.form.id is not None:
            if name == self.form.id:
                self.refuse("")
            elif not self.form.id:
                self.asked.emit(SetValue((*self.form.path, "id"), name))
            else:
                self.asked.emit(RenameElement(self.form.path, name))
