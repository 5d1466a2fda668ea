"""The form: its head, its rows in sections, and help for the focused field at its foot."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial

from PySide6.QtCore import QEvent, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QApplication, QGridLayout, QMenu, QWidget

from study_app.designer.document.steps import AddKey, LeaveText, RemoveKey, RenameElement, SetValue
from study_app.designer.form.fields import LanguagesField, add_button, stacked
from study_app.designer.form.lists import EntryList
from study_app.designer.form.row_widget import LABEL_PX, LanguageHeads, RowWidget, is_wide, structure_of
from study_app.designer.form.rows import Form, FormRow, Section, added_row
from study_app.designer.form.special import Panel, QuestionRow, QuestionRows
from study_app.designer.form.typed_fields import FIELD_PX, TypedLine, TypedText
from study_app.designer.place.segments import cut_text, small_button
from study_app.designer.problems.problems import NameRefusal, ProblemRow, RepairButton
from study_app.gui.kit.commands import tip
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import RADIUS_CONTROL, font
from study_app.gui.theme.themed import Themed, name_bars, remove_widget
from study_app.gui.widgets.accessible import say
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, hbox, vbox
from study_app.gui.widgets.boxes import grid as grid_of
from study_app.gui.widgets.cards import QWIDGETSIZE_MAX, Card, Rule, fill_rounded, scrolled, smooth_painter
from study_app.gui.widgets.controls import IconButton
from study_app.gui.widgets.labels import Elided, label
from study_app.protocol.source.document import Path

TILE = 40


class Tile(Themed, QWidget):
    """An icon on a tinted square."""

    def __init__(self) -> None:
        super().__init__()
        self.icon = "ring"
        self.setFixedSize(TILE, TILE)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = smooth_painter(self)
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
        self.ask = small_button("list", "Ask after …", height=34)
        self.ask.hide()
        self.asks = QMenu(self)
        self.asks.setFont(font("label"))
        self.id = TypedLine("Id")
        self.id.setMinimumWidth(110)
        self.id.setMaximumWidth(230)
        self.id.rests = False
        self.unlock = small_button("lock", "Change anyway …", height=34)
        self.unlock.hide()
        self.comments = small_button("", "Comments", role="plain", height=34)
        self.comments.hide()
        self._lock: tuple[object, str] = ((), "")
        self._read_only = False
        self.refusal = NameRefusal("Rename to")
        self.refusal.chosen.connect(self._take_free)
        self.feel = IconButton("drop", "Feel", size=34)
        self.series = small_button("bars", "Series …", height=34)
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
        add_layout(
            grid, hbox(self.ask, self.feel, self.series, self.up, self.down, self.copy, self.delete, spacing=8), 0, 2
        )
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
        self.ask.clicked.connect(lambda: self.asks.popup(self.ask.mapToGlobal(self.ask.rect().bottomLeft())))

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
        self.ask.setVisible(bool(form.asks) and not read_only)
        self.asks.clear()
        for words, asked in form.asks:
            self.asks.addAction(words.replace("&", "&&")).triggered.connect(
                lambda _on=False, asked=asked: self.asked.emit(asked)
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

    def _ask_to_feel(self) -> None:
        if self.form is not None:
            self.feel_asked.emit(self.form.path)

    def _take_free(self, name: str) -> None:
        """Take the id that is proposed; the keyboard goes from its button, which is gone then, to the id."""
        self.id.setFocus(Qt.FocusReason.OtherFocusReason)
        self.id.setText(name)
        self._rename(name)

    def _rename(self, name: str) -> None:
        if self.form is not None and self.form.id is not None:
            if name == self.form.id:
                self.refuse("")
            elif not self.form.id:
                self.asked.emit(SetValue((*self.form.path, "id"), name))
            else:
                self.asked.emit(RenameElement(self.form.path, name))


ACROSS = 2
FOOT_FROM = 460
"""The height of the form from which it has a foot [px]."""


class FormFoot(Themed, QWidget):
    """Label and place of a field, and its description."""

    def __init__(self) -> None:
        super().__init__()
        self.title = label("", "label")
        self.place = cut_text("", "small", "text2", right=True)
        self.words = label("", "small", "text2", wraps=True)
        self.words.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.glossary = small_button("info", "Glossary", role="plain", height=26)
        above = hbox(self.title, (self.place, 1), self.glossary, spacing=8)
        vbox(above, self.words, spacing=3, margins=(12, 4, 4, 8), parent=self)

    def show_help(self, title: str, place: str, words: str) -> None:
        self.title.setText(title)
        self.place.show_text(place)
        self.words.setText(words)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = smooth_painter(self)
        fill_rounded(painter, QRectF(self.rect()), RADIUS_CONTROL, self.theme.sunk)


class AddKeys(QWidget):
    """Buttons that add keys to a section; ``keys`` are paths within the element, labels and descriptions."""

    def __init__(self, keys: Iterable[tuple[Path, str, str]], add: Callable[[Path], None]) -> None:
        super().__init__()
        grid = grid_of(0, 0, margins=0, parent=self)
        self.buttons: dict[Path, QWidget] = {}
        for at, (inner, words, help_) in enumerate(keys):
            made = self.buttons[inner] = add_button(f"Add {words}", words)
            made.setToolTip(help_)
            made.clicked.connect(lambda _checked=False, inner=inner: add(inner))
            grid.addWidget(made, at // ACROSS, at % ACROSS, Qt.AlignmentFlag.AlignLeft)


class FormCard(Card):
    """Shows a `Form`; a part that both the old and the new form have keeps its widget, with caret and focus.

    Signals: ``asked`` (a request), ``repair_asked`` (problem, words).
    """

    asked = Signal(object)
    repair_asked = Signal(object, str)

    def __init__(self) -> None:
        super().__init__(padding=18, gap=8)
        self.setAccessibleName("Form")
        self.form: Form | None = None
        self.read_only = False
        self.rows: list[RowWidget] = []
        self.adds: dict[Path, QWidget] = {}
        self._parts: dict[object, QWidget] = {}
        self._known: Mapping[ProblemRow, tuple[str, ...]] = {}
        self._together: tuple[Path, ...] = ()
        self._focused: RowWidget | None = None
        self._renames = False
        self.head = FormHead()
        self.head.asked.connect(self._ask)
        self.own = label("", "label", "bad", wraps=True)
        self.above, self.panel, self.below = QuestionRows(), Panel(), QuestionRows()
        for questions in (self.above, self.below):
            questions.asked.connect(self.asked)
        self.sections = vbox(spacing=7, parent=self.panel)
        self.inside = QWidget()
        vbox(self.above, self.panel, self.below, STRETCH, spacing=7, margins=(0, 2, 8, 2), parent=self.inside)
        self.area = scrolled(self.inside)
        self.foot = FormFoot()
        add_parts(self.column, self.head, Rule(), self.own, (self.area, 1), self.foot)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.foot.setVisible(self.height() >= FOOT_FROM)

    def _ask(self, asked: object) -> None:
        """Ask for a step; a rename leaves the form at its element."""
        before, self._renames = self._renames, isinstance(asked, RenameElement | LeaveText)
        self.asked.emit(asked)
        self._renames = before

    @property
    def others(self) -> list[QuestionRow]:
        return [*self.above.rows, *self.below.rows]

    def show_form(self, form: Form, *, read_only: bool) -> None:
        """Show a form: parts that it has already stay as they are, others are made, the rest goes."""
        before = self.form
        stays = before is not None and (
            form.path == before.path or (self._renames and form.path[:-1] == before.path[:-1])
        )
        if before is not None and not stays:
            self.flush()
            if self.form is not before:  # what was typed is in a later form, which is shown by now
                return
        if read_only != self.read_only:
            self._drop(self._parts)
            self._parts = {}
        self.form, self.read_only = form, read_only
        self.head.show_form(form, read_only=read_only)
        self.own.setText("\n".join(form.faults))
        self.own.setVisible(bool(form.faults))
        self._show_parts(form, before if stays else None)
        if not stays:
            self.area.verticalScrollBar().setValue(0)
            keyboard = self.window().focusWidget()
            if keyboard is not None and self.inside.isAncestorOf(keyboard):
                self._reveal(keyboard)
        self.show_repairs(self._known)
        self.show_selected(self._together)
        self.show_help()

    def _show_parts(self, form: Form, before: Form | None) -> None:
        """Show what a form is made of; ``before`` is the form of the same element before, None for another element."""
        lines = form.questions.lines
        at = next((at for at, line in enumerate(lines) if line.path == form.path), 0)
        self.above.show_lines(lines[:at], form.questions.languages if lines else ())
        self.below.show_lines(lines[at + 1 :])
        self.panel.tinted = bool(lines)
        self.sections.setContentsMargins(*((10, 8, 4, 8) if lines else (0, 0, 0, 0)))
        keyboard = self.window().focusWidget()
        inside_form = keyboard is not None and self.inside.isAncestorOf(keyboard)
        old, self._parts, self.rows, self.adds = self._parts, {}, [], {}
        for key, make, row in self._wanted(form):
            kept = old.pop(key, None)
            part = self._parts[key] = kept or make()
            if isinstance(part, RowWidget) and row is not None:
                if before is None and kept is not None:
                    part.begin(row)
                else:
                    part.show_row(row)
                self.rows.append(part)
            elif isinstance(part, AddKeys):
                self.adds |= {(*form.path, *inner): made for inner, made in part.buttons.items()}
        gone = next((part for part in old.values() if inside_form and part.isAncestorOf(keyboard)), None)
        typed = keyboard if gone is not None and isinstance(keyboard, TypedLine | TypedText) else None
        marked = (0, 0, 0) if typed is None else typed.marked()
        if gone is not None and keyboard is not None:
            keyboard.clearFocus()  # else Qt hands the keyboard on
        self._drop(old)
        for place, part in enumerate(self._parts.values()):
            if self.sections.indexOf(part) != place:
                self.sections.insertWidget(place, part)
                name_bars(part)
                part.show()  # at once: a layout shows it later, and what is hidden takes no keyboard
        if gone is not None:
            self._refocus(form, before, gone)
        if typed is not None and before is not None and self._focused is not None:
            for part in self._focused.findChildren(QWidget):
                if type(part) is type(typed) and part.accessibleName() == typed.accessibleName():
                    part.take_over(typed, marked)

    def _refocus(self, form: Form, before: Form | None, gone: QWidget) -> None:
        """Give the keyboard of a part that is gone to the row in its place, or that it added; else to the first row."""
        path: Path | None = None
        if before is not None and isinstance(gone, RowWidget):
            path = gone.row.row.path
            path = (*form.path, *path[len(before.path) :]) if path[: len(before.path)] == before.path else path
        elif before is not None:
            path = added_row(form, before)
        if path is None or not self.focus(path):
            self.focus_first()

    @staticmethod
    def _drop(parts: Mapping[object, QWidget]) -> None:
        for part in parts.values():
            remove_widget(part)

    def _wanted(self, form: Form) -> Iterator[tuple[object, Callable[[], QWidget], FormRow | None]]:
        """Yield the parts of a form from top to bottom: what tells each apart, what makes it, and its row."""
        for number, section in enumerate(form.sections):
            at = form.path[:1], section.title, section.path[len(form.path) :]
            if number:
                yield ("rule", at), Rule, None
            if section.title:
                removable = section.path != form.path and not self.read_only
                yield ("title", at), partial(self._heading, section, removable=removable), None
            if section.faults:
                words = "\n".join(section.faults)
                yield ("faults", at, words), partial(label, words, "label", "bad", wraps=True), None
            heads: tuple[tuple[str, str], ...] = ()
            for row in section.rows:
                beside = () if stacked(row) or is_wide(row) else row.languages
                if len(beside) > 1 and beside != heads:
                    names = tuple(language for _, language in beside)
                    yield (
                        ("heads", at, row.row.path[-1], names),
                        partial(LanguageHeads, names, (LABEL_PX + 8, FIELD_PX + 8)),
                        None,
                    )
                heads = beside
                inner = row.row.path[len(form.path) :] if row.row.path[: len(form.path)] == form.path else row.row.path
                yield (at, inner, structure_of(row)), partial(self._row, row), row
            if section.absent and not self.read_only:
                added = tuple((one.path[len(form.path) :], one.label, one.help) for one in section.absent)
                yield ("adds", at, added), partial(AddKeys, added, self._add), None

    def _add(self, inner: Path) -> None:
        self.asked.emit(AddKey(self._now(inner)))

    def _now(self, inner: Path) -> Path:
        """Return the path of a part of the element that is shown."""
        return inner if self.form is None else (*self.form.path, *inner)

    def show_selected(self, paths: tuple[Path, ...]) -> None:
        self._together = paths
        for row in self.others:
            row.show_chosen(row.line.path in paths)

    def _heading(self, section: Section, *, removable: bool) -> QWidget:
        made, inner = QWidget(), () if self.form is None else section.path[len(self.form.path) :]
        heading = hbox(label(section.title, "strong"), STRETCH, margins=0, parent=made)
        if section.path != (() if self.form is None else self.form.path):
            away = IconButton("cross", f"Remove {section.title} from the file", size=FIELD_PX, role="plain")
            away.clicked.connect(lambda: self.asked.emit(RemoveKey(self._now(inner))))
            away.setEnabled(removable)
            heading.addWidget(away)
        return made

    def _row(self, row: FormRow) -> RowWidget:
        made = RowWidget(row)
        made.field.asked.connect(self._ask)
        made.repair_asked.connect(self.repair_asked)
        if isinstance(made.field, EntryList) and self.read_only:
            made.field.freeze()
        made.field.came.connect(lambda: self._come(made))
        made.field.setEnabled(not self.read_only or row.row.kind in {"list", "tables", "references", "reference"})
        for part in (made.remove, made.keys):
            if part is not None:
                part.setEnabled(not self.read_only)
        return made

    def flush(self) -> None:
        self.head.id.flush()
        for part in self.inside.findChildren(QWidget):
            if isinstance(part, TypedLine | TypedText):
                part.flush()

    def _reveal(self, row: QWidget) -> None:
        """Scroll to a row, and in a high row to the part with the keyboard; rows made just now are laid out before."""
        QApplication.sendPostedEvents(None, QEvent.Type.LayoutRequest.value)
        self.area.ensureWidgetVisible(row, 0, 40)
        keyboard = self.window().focusWidget()
        if keyboard is not None and row.isAncestorOf(keyboard):
            self.area.ensureWidgetVisible(keyboard, 0, 40)

    def _row_of(self, path: Path) -> RowWidget | None:
        around = [row for row in self.rows if path[: len(row.row.row.path)] == row.row.row.path]
        return max(around, key=lambda row: len(row.row.row.path), default=None)

    def focus(self, path: Path) -> bool:
        """Give the keyboard to the row of a place and scroll; return whether there is one.

        A key that the file does not have has a button that adds it instead.
        """
        found = self._row_of(path)
        if found is None:
            if (button := self.adds.get(path)) is not None:
                button.setFocus(Qt.FocusReason.OtherFocusReason)
                self.area.ensureWidgetVisible(button)
            return button is not None
        found.field.take_keyboard()
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

    def refuse(self, path: Path, sentence: str) -> None:
        """Say at the field of a place why it was not changed."""
        if (found := self._row_of(path)) is not None:
            found.refusal = sentence
            found.say()
        else:
            self.own.setText(sentence)
            self.own.setVisible(True)

    def show_repairs(self, known: Mapping[ProblemRow, tuple[str, ...]]) -> None:
        self._known = {} if self.read_only else known
        for row in self.rows:
            row.show_repairs(self._known)

    def repairs_of(self, problem: ProblemRow) -> list[RepairButton]:
        return [button for row in self.rows for button in row.repairs if button.problem == problem]

    def _come(self, row: RowWidget) -> None:
        self._focused = row if row in self.rows else self._focused  # its own step may just have replaced it
        row.say()
        self.show_help()

    def show_help(self) -> None:
        row = self._focused if self._focused in self.rows else next(iter(self.rows), None)
        if row is None:
            self.foot.show_help("", "", "")
        else:
            self.foot.show_help(row.row.row.label, row.row.place, row.help)
