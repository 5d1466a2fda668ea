"""The form: its head, its rows in sections, and help for the focused field at its foot."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from PySide6.QtCore import QEvent, QRectF, Qt, QTimer, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QApplication, QGridLayout, QHBoxLayout, QLineEdit, QPlainTextEdit, QVBoxLayout, QWidget

from study_app.designer.document.steps import AddKey, LeaveText, RemoveKey, RenameElement, SetValue
from study_app.designer.form.fields import LanguagesField, add_button, stacked
from study_app.designer.form.lists import EntryList
from study_app.designer.form.row_widget import LABEL_PX, RowWidget, is_wide, language_heads, structure_of
from study_app.designer.form.rows import Form, FormRow, QuestionLine, Section, added_row, shape_of
from study_app.designer.form.special import Panel, QuestionRow, QuestionRows
from study_app.designer.form.typed_fields import FIELD_PX, TypedLine, TypedText
from study_app.designer.problems.card import NameRefusal, RepairButton
from study_app.designer.problems.problems import ProblemRow
from study_app.gui.kit.commands import tip
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import RADIUS_CONTROL, font
from study_app.gui.theme.themed import Themed, apply_theme_within
from study_app.gui.widgets.accessible import say
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, hbox, vbox
from study_app.gui.widgets.cards import QWIDGETSIZE_MAX, Card, Rule, scrolled
from study_app.gui.widgets.controls import ActionButton, IconButton
from study_app.gui.widgets.labels import Elided, label

TILE = 40


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
        self.up = IconButton("arrow_up", "Move up", size=34)
        self.down = IconButton("arrow_down", "Move down", size=34)
        self.copy = IconButton("copy", "Duplicate", size=34)
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
        self.id.setFocus(Qt.FocusReason.ShortcutFocusReason)
        self.id.selectAll()

    def refuse(self, sentence: str, free: str = "") -> None:
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


ACROSS = 2
ROW_PX = FIELD_PX + 7
FOOT_FROM = 460
"""The height of the form from which it has a foot [px]."""
SHOWN_OR_HIDDEN = Qt.WidgetAttribute.WA_WState_ExplicitShowHide
WORDS_PX = 50


@dataclass(frozen=True, slots=True)
class Caret:
    """The name of an editor of text, and before which of its letters the next one is typed."""

    editor: str
    at: int

    @classmethod
    def of(cls, editor: QWidget | None) -> Caret | None:
        """Return where the keyboard is; None where no text is edited."""
        if isinstance(editor, QLineEdit):
            return cls(editor.accessibleName(), editor.cursorPosition())
        if isinstance(editor, QPlainTextEdit):
            return cls(editor.accessibleName(), editor.textCursor().position())
        return None

    def put_into(self, row: QWidget) -> None:
        """Give the keyboard to the editor of that name in a row; where there is none, nothing changes."""
        for editor in row.findChildren(QWidget):
            if isinstance(editor, QLineEdit | QPlainTextEdit) and editor.accessibleName() == self.editor:
                editor.setFocus(Qt.FocusReason.OtherFocusReason)
                if isinstance(editor, QLineEdit):
                    editor.setCursorPosition(self.at)
                else:
                    cursor = editor.textCursor()
                    cursor.setPosition(min(self.at, editor.document().characterCount() - 1))
                    editor.setTextCursor(cursor)


class FormFoot(Themed, QWidget):
    """Label and place of a field, and its description."""

    def __init__(self) -> None:
        super().__init__()
        self.title = label("", "label")
        self.place = Elided("small", "text2")
        self.place.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.words = label("", "small", "text2", wraps=True)
        self.words.setMinimumHeight(WORDS_PX)
        self.words.setAlignment(Qt.AlignmentFlag.AlignTop)
        vbox(hbox(self.title, (self.place, 1)), self.words, spacing=3, margins=(12, 8, 12, 8), parent=self)

    def show_help(self, title: str, place: str, words: str) -> None:
        self.title.setText(title)
        self.place.show_text(place)
        self.words.setText(words)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(self.theme.sunk))
        painter.drawRoundedRect(QRectF(self.rect()), RADIUS_CONTROL, RADIUS_CONTROL)


class FormCard(Card):
    """Draws a `Form`.

    Signals: ``asked`` (a request), ``repair_asked`` (problem, words).
    """

    asked = Signal(object)
    repair_asked = Signal(object, str)

    def __init__(self) -> None:
        super().__init__(padding=18, gap=8)
        self.setAccessibleName("Form")
        self.form: Form | None = None
        self.read_only = False
        self._made: list[RowWidget] = []
        self._unmade: Iterator[int] | None = None
        self._known: Mapping[ProblemRow, tuple[str, ...]] = {}
        self._together: tuple[tuple[str | int, ...], ...] = ()
        self._later = QTimer(self)
        self._later.setSingleShot(True)
        self._later.setInterval(0)
        self._later.timeout.connect(self._finish)
        self.others: list[QuestionRow] = []
        self.adds: dict[tuple[str | int, ...], QWidget] = {}
        self._focused: RowWidget | None = None
        self._may_rename = False
        self._chosen: tuple[tuple[str | int, ...], tuple[int, ...]] | None = None
        self.head = FormHead()
        self.head.asked.connect(self._ask)
        self.own = label("", "label", "bad", wraps=True)
        self.inside = QWidget()
        host = QWidget()
        self._host = vbox(self.inside, margins=0, parent=host)
        self.area = scrolled(host)
        self.foot = FormFoot()
        add_parts(self.column, self.head, Rule(), self.own, (self.area, 1), self.foot)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.foot.setVisible(self.height() >= FOOT_FROM)

    def _ask(self, asked: object) -> None:
        """Ask for a step; the form of an element that it renames keeps its editors."""
        before, self._may_rename = self._may_rename, isinstance(asked, RenameElement | LeaveText)
        self.asked.emit(asked)
        self._may_rename = before

    def show_form(self, form: Form, *, read_only: bool) -> None:
        """Show a form: in place where its rows stay the same, else anew."""
        before, was_read_only = self.form, self.read_only
        self.form, self.read_only = form, read_only
        self.head.show_form(form, read_only=read_only)
        self.own.setText("\n".join(form.faults))
        self.own.setVisible(bool(form.faults))
        stays = before is not None and (
            form.path == before.path or (self._may_rename and form.path[:-1] == before.path[:-1])
        )
        same = before is not None and stays and shape_of(before) == shape_of(form) and was_read_only == read_only
        if same and [row.key for row in self.rows] == [structure_of(row) for row in form.rows]:
            for widget, row in zip(self.rows, form.rows, strict=True):
                widget.show_row(row)
        else:
            self._make(form, before if stays else None)
        self.show_help()

    def _make(self, form: Form, before: Form | None) -> None:
        """Make the editors anew; ``before`` is the form of the same element before, None for another element."""
        keyboard = QApplication.focusWidget()
        inside_form = keyboard is not None and self.inside.isAncestorOf(keyboard)
        held = next((row for row in self._made if keyboard is not None and row.isAncestorOf(keyboard)), None)
        added = added_row(form, before) if inside_form and held is None and before is not None else None
        if held is None and added is None and self.isAncestorOf(self.window().focusWidget()):
            held = self._focused  # a list that drops down, or another window, has the keyboard for a while
        focused = added
        if held is not None and before is not None:
            focused = (*form.path, *held.row.row.path[len(before.path) :])
        caret = None if held is None else Caret.of(held.focusWidget())
        down_px = 0 if before is None else self.area.verticalScrollBar().value()
        self._focused = None
        self.flush()
        inside = QWidget()
        whole = vbox(spacing=7, margins=(0, 2, 8, 2), parent=inside)
        self._made, self.adds, self.others = [], {}, []
        self._unmade = self._fill(form, whole)
        room = self.area.viewport().height() if before is None else QWIDGETSIZE_MAX
        for height in self._unmade:
            room -= height
            if room < 0:
                self._later.start()
                break
        else:
            self._unmade = None
        apply_theme_within(inside, self.theme)
        self._replace(inside)
        self.area.verticalScrollBar().setValue(down_px)
        QTimer.singleShot(0, self.area, lambda: self._settle(down_px, other=before is None))
        if (focused is None or not self.focus(focused, caret)) and inside_form:
            self.focus_first()

    def _settle(self, down_px: int, *, other: bool) -> None:
        """Scroll once the editors have their places: in another element to the row that got the keyboard meanwhile."""
        if other and self._focused is not None:
            self._reveal(self._focused)
        else:
            self.area.verticalScrollBar().setValue(down_px)

    def _reveal(self, row: RowWidget) -> None:
        """Scroll to a row, and in a high row to the part with the keyboard; rows made just now are laid out before."""
        QApplication.sendPostedEvents(None, QEvent.Type.LayoutRequest.value)
        self.area.ensureWidgetVisible(row, 0, 40)
        keyboard = self.window().focusWidget()
        if keyboard is not None and row.isAncestorOf(keyboard):
            self.area.ensureWidgetVisible(keyboard, 0, 40)

    def _fill(self, form: Form, whole: QVBoxLayout) -> Iterator[int]:
        """Make the editors from top to bottom; yield how high each part is, about [px]."""
        lines, sections = form.questions.lines, whole
        at = next((at for at, line in enumerate(lines) if line.path == form.path), 0)
        if lines:
            panel = Panel()
            sections = vbox(spacing=7, margins=(10, 8, 4, 8), parent=panel)
            add_parts(whole, self._others(lines[:at], form.questions.languages), panel)
            yield ROW_PX * at
        for number, section in enumerate(form.sections):
            if number:
                sections.addWidget(Rule())
            if section.title:
                add_layout(sections, self._heading(section, removable=section.path != form.path))
            if section.faults:
                sections.addWidget(label("\n".join(section.faults), "label", "bad", wraps=True))
            heads: tuple[tuple[str, str], ...] = ()
            for row in section.rows:
                beside = () if stacked(row) or is_wide(row) else row.languages
                if len(beside) > 1 and beside != heads:
                    add_layout(sections, language_heads(beside, (LABEL_PX + 8, FIELD_PX + 8)))
                heads = beside
                sections.addWidget(self._row(row))
                yield ROW_PX * (1 + len(row.entries))
            if section.absent and not self.read_only:
                add_layout(sections, self._adds(section))
                yield ROW_PX
        if lines:
            whole.addWidget(self._others(lines[at + 1 :], ()))
        whole.addStretch(1)

    def _adds(self, section: Section) -> QGridLayout:
        grid = QGridLayout()
        grid.setSpacing(0)
        for at, absent in enumerate(section.absent):
            made = add_button(f"Add {absent.label}", absent.label)
            made.setToolTip(absent.help)
            made.clicked.connect(lambda _checked=False, path=absent.path: self.asked.emit(AddKey(self._now(path))))
            grid.addWidget(made, at // ACROSS, at % ACROSS, Qt.AlignmentFlag.AlignLeft)
            self.adds[absent.path] = made
        return grid

    def _finish(self) -> None:
        """Make the editors that are below what is seen at first."""
        self._later.stop()
        unmade, self._unmade = self._unmade, None
        if unmade is not None:
            for _height in unmade:
                pass
            apply_theme_within(self.inside, self.theme)
            for around in (self.inside, *self.inside.findChildren(Panel)):
                for part in around.children():  # Qt shows them later: what is hidden takes no keyboard and no room
                    if isinstance(part, QWidget) and not part.testAttribute(SHOWN_OR_HIDDEN):
                        part.show()
            self.show_repairs(self._known)
            self.show_selected(self._together)

    @property
    def rows(self) -> list[RowWidget]:
        self._finish()
        return self._made

    def _replace(self, inside: QWidget) -> None:
        """Show other editors; those before stay where they are until they are deleted: to move them takes long."""
        old, self.inside = self.inside, inside
        held = self.window().focusWidget()
        if held is not None and old.isAncestorOf(held):
            held.clearFocus()  # else Qt hands the keyboard on
        old.hide()
        self._host.removeWidget(old)
        self._host.addWidget(inside)
        inside.show()  # at once: a layout shows it later, and what is hidden takes no keyboard
        old.deleteLater()

    def _now(self, path: tuple[str | int, ...]) -> tuple[str | int, ...]:
        """Return the path of a part of the element, which may have been renamed since its editor was made."""
        return path if self.form is None else (*self.form.path, *path[len(self.form.path) :])

    def _others(self, lines: tuple[QuestionLine, ...], languages: tuple[str, ...]) -> QuestionRows:
        made = QuestionRows(lines, languages)
        made.asked.connect(self.asked)
        self.others += made.rows
        return made

    def show_selected(self, paths: tuple[tuple[str | int, ...], ...]) -> None:
        self._together = paths
        for row in self.others:
            row.show_chosen(row.line.path in paths)

    def _heading(self, section: Section, *, removable: bool) -> QHBoxLayout:
        heading = hbox(label(section.title, "strong"), STRETCH)
        if removable:
            away = IconButton("cross", f"Remove {section.title} from the file", size=FIELD_PX, role="plain")
            away.clicked.connect(lambda: self.asked.emit(RemoveKey(self._now(section.path))))
            away.setEnabled(not self.read_only)
            heading.addWidget(away)
        return heading

    def _row(self, row: FormRow) -> RowWidget:
        made = RowWidget(row)
        made.field.asked.connect(self._ask)
        made.repair_asked.connect(self.repair_asked)
        if isinstance(made.field, EntryList):
            made.field.changes.connect(lambda asked, after: self._change_entries(made.row.row.path, asked, after))
            if self._chosen is not None and self._chosen[0] == row.row.path:
                made.field.choose(self._chosen[1])
            if self.read_only:
                made.field.freeze()
        made.field.came.connect(lambda: self._come(made))
        made.field.setEnabled(not self.read_only or row.row.kind in {"list", "tables", "references", "reference"})
        for part in (made.remove, made.keys):
            if part is not None:
                part.setEnabled(not self.read_only)
        self._made.append(made)
        return made

    def _change_entries(self, path: tuple[str | int, ...], asked: object, after: tuple[int, ...]) -> None:
        """Ask for a step of a list's entries; those at ``after`` are selected where the list is made anew."""
        self._chosen = (path, after)
        self.asked.emit(asked)
        self._chosen = None

    def flush(self) -> None:
        self.head.id.flush()
        for part in self.inside.findChildren(QWidget):
            if isinstance(part, TypedLine | TypedText):
                part.flush()

    def focus(self, path: tuple[str | int, ...], caret: Caret | None = None) -> bool:
        """Give the keyboard to the row of a place, or to an editor in it, and scroll; return whether there is one.

        A key that the file does not have has a button that adds it instead.
        """
        inner = [row for row in self.rows if path[: len(row.row.row.path)] == row.row.row.path]
        found = max(inner, key=lambda row: len(row.row.row.path), default=None)
        if found is None:
            if (button := {self._now(key): made for key, made in self.adds.items()}.get(path)) is not None:
                button.setFocus(Qt.FocusReason.OtherFocusReason)
                self.area.ensureWidgetVisible(button)
            return button is not None
        found.field.take_keyboard()
        if caret is not None:
            caret.put_into(found)
        self._come(found)
        self._reveal(found)
        return True

    def focus_first(self) -> None:
        if self.rows:
            self.focus(self.rows[0].row.row.path)

    def focus_first_text(self, *, filled: bool) -> None:
        """Give the keyboard to the first text, marked, before it to an empty one unless all are filled in.

        A form without texts gives it to its first row.
        """
        texts = [part for row in self.rows for part in row.field.findChildren(QWidget)]
        lines = [part for part in texts if isinstance(part, TypedLine | TypedText)]
        words = [part for part in lines if isinstance(part.parent(), LanguagesField)]
        empty = (part for part in lines if not filled and not part.words() and not part.placeholderText())
        found = next(iter((*empty, *words)), None)
        if found is None:
            self.focus_first()
            return
        found.setFocus(Qt.FocusReason.OtherFocusReason)
        found.selectAll()
        row = next(row for row in self.rows if row.isAncestorOf(found))
        self._come(row)
        self._reveal(row)

    def refuse(self, path: tuple[str | int, ...], sentence: str) -> None:
        inner = [row for row in self.rows if path[: len(row.row.row.path)] == row.row.row.path]
        found = max(inner, key=lambda row: len(row.row.row.path), default=None)
        if found is not None:
            found.refusal = sentence
            found.say()
        else:
            self.own.setText(sentence)
            self.own.setVisible(True)

    def show_repairs(self, known: Mapping[ProblemRow, tuple[str, ...]]) -> None:
        """Offer repairs at the rows that their problems are in."""
        self._known = {} if self.read_only else known
        for row in self._made:
            row.show_repairs(self._known)

    def repairs_of(self, problem: ProblemRow) -> list[RepairButton]:
        return [button for row in self._made for button in row.repairs if button.problem == problem]

    def _come(self, row: RowWidget) -> None:
        self._focused = row if row in self._made else self._focused  # its own step may just have replaced it
        row.say()
        self.show_help()

    def show_help(self) -> None:
        row = self._focused if self._focused in self._made else next(iter(self._made), None)
        if row is None:
            self.foot.show_help("", "", "")
        else:
            self.foot.show_help(row.row.row.label, row.row.place, row.help)
