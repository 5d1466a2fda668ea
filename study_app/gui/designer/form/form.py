"""The form: one element at a time, its rows in sections, with help for the focused field at its foot."""

from __future__ import annotations

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QScrollArea, QVBoxLayout, QWidget

from study_app.gui.designer.form.form_foot import FormFoot
from study_app.gui.designer.form.form_head import LABEL_PX, FormHead
from study_app.gui.designer.form.list_fields import field, structure
from study_app.gui.designer.form.question_rows import Panel, QuestionRow, QuestionRows
from study_app.gui.designer.form.row_fields import LanguagesField, add_button, stacked
from study_app.gui.designer.form.special import EDITORS
from study_app.gui.designer.form.special_editor import SpecialEditor
from study_app.gui.designer.form.typed_fields import FIELD_PX, TypedLine, TypedText
from study_app.gui.designer.segments import Segments
from study_app.gui.theme.themed import dress, take_away
from study_app.gui.widgets.cards import Card, Icon, Rule
from study_app.gui.widgets.controls import IconButton
from study_app.gui.widgets.labels import label
from study_app.viewmodels.designer.form_rows import Form, FormRow, Section
from study_app.viewmodels.designer.requests import AddKey, RemoveKey, SwitchKey
from study_app.viewmodels.designer.special.questions import QuestionLine

ACROSS = 2


class RowWidget(QWidget):
    """A row: its label, its editor, its bounds, a button that removes the key, and what is wrong with it."""

    def __init__(self, row: FormRow) -> None:
        super().__init__()
        self.row = row
        self.key = structure_of(row)
        self.refusal = ""
        special, wide = special_editor_of(row), is_wide(row)
        self.field = field(row) if special is None else special.make(row)
        self.keys = Segments("Which of the two is given") if row.instead else None
        self.words = label(row.row.label, "label", wraps=True)
        if not wide:
            self.words.setFixedWidth(LABEL_PX)
        self.words.setMinimumHeight(FIELD_PX)
        self.words.setAlignment(Qt.AlignmentFlag.AlignVCenter)
        self.words.setBuddy(self.field)
        self.remove = IconButton("cross", f"Remove {row.row.label} from the file", size=FIELD_PX, role="plain")
        self.remove.clicked.connect(lambda: self.field.asked.emit(RemoveKey(self.row.row.path)))
        across = QHBoxLayout()
        across.setSpacing(8)
        top = Qt.AlignmentFlag.AlignTop
        across.addWidget(self.words, int(wide), top)
        across.addWidget(label(self.field.caption, "small", "text2") if wide else self.field, int(not wide))
        across.addWidget(self.remove, 0, top)
        policy = self.remove.sizePolicy()
        policy.setRetainSizeWhenHidden(True)
        self.remove.setSizePolicy(policy)
        self.wrong = QWidget()
        beside = QHBoxLayout(self.wrong)
        beside.setContentsMargins(LABEL_PX + 8, 0, 0, 0)
        beside.setSpacing(8)
        beside.addWidget(Icon("warning", "bad", 16), 0, top)
        self.sentence = label("", "label", "bad", wraps=True)
        beside.addWidget(self.sentence, 1)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        column.addLayout(across)
        if self.keys is not None:
            self.keys.show_values(row.instead, row.row.path[-1])
            self.keys.chosen.connect(self._switch)
            above = QHBoxLayout()
            above.setContentsMargins(0 if wide else LABEL_PX + 8, 0, 0, 0)
            above.addWidget(self.keys, 0, Qt.AlignmentFlag.AlignLeft)
            column.insertLayout(0, above)
        if wide and len(row.languages) > 1 and not stacked(row):
            column.addLayout(language_heads(row.languages))
        if wide:
            column.addWidget(self.field)
        column.addWidget(self.wrong)
        self.remove.setVisible(row.removable)  # in its layout by now: it would be shown as a window before
        self.show_row(row)

    def _switch(self, key: object) -> None:
        if key != self.row.row.path[-1]:
            self.field.asked.emit(SwitchKey(self.row.row.path, str(key)))

    def show_row(self, row: FormRow) -> None:
        """Show the row's value and faults."""
        if row != self.row:
            self.refusal = ""
            self.row = row
            self.field.show_row(row)
        self.say()

    def say(self) -> None:
        """Show what is wrong."""
        found = [sentence for sentence in (self.refusal, self.field.refusal, *self.row.faults) if sentence]
        self.sentence.setText("\n".join(found))
        self.wrong.setVisible(bool(found))
        row = self.row.row
        self.field.setAccessibleDescription(". ".join(filter(None, (row.help, self.row.bounds, *found))))
        some_missing = isinstance(self.field, LanguagesField) and self.field.some_missing
        for part in self.field.findChildren(QWidget):
            if isinstance(part, TypedLine | TypedText):
                part.setAccessibleDescription(self.field.accessibleDescription())
            if isinstance(part, TypedLine) and not self.field.refusal:
                blamed = part.focusPolicy() != Qt.FocusPolicy.NoFocus and not (some_missing and part.words())
                part.show_refused(bool(self.row.faults) and blamed)

    @property
    def help(self) -> str:
        """What the row edits: the description, or the sentence of what is chosen, and what is permitted."""
        row = self.row.row
        shown = row.default if row.value is None else row.value
        sentence = next((choice.sentence for choice in row.choices if choice.value == shown), "")
        reason = f" ({row.reason})" if row.reason else ""
        permitted = f"Permitted: {self.row.bounds}{reason}." if self.row.bounds and not row.choices else ""
        words = " ".join(filter(None, (sentence or row.help, permitted)))
        return " ".join(words.replace("`", "").split())


class FormCard(Card):
    """Draws a `Form`.

    Signals: ``asked`` (a request), ``open_asked`` (path), ``delete_asked`` (path), ``copy_asked`` (paths).
    """

    asked = Signal(object)
    copy_asked = Signal(object)
    open_asked = Signal(object)
    delete_asked = Signal(object)

    def __init__(self) -> None:
        super().__init__(padding=18, gap=8)
        self.setAccessibleName("Form")
        self.form: Form | None = None
        self.read_only = False
        self.rows: list[RowWidget] = []
        self.others: list[QuestionRow] = []
        self.adds: list[QWidget] = []
        self._focused: RowWidget | None = None
        self.head = FormHead()
        self.head.asked.connect(self.asked)
        self.head.delete_asked.connect(self.delete_asked)
        self.own = label("", "label", "bad", wraps=True)
        self.inside = QWidget()
        self.sections = QVBoxLayout(self.inside)
        self.sections.setContentsMargins(0, 2, 8, 2)
        self.sections.setSpacing(7)
        self.area = QScrollArea()
        self.area.setWidgetResizable(True)
        self.area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.area.setWidget(self.inside)
        self.foot = FormFoot()
        for part in (self.head, Rule(), self.own):
            self.column.addWidget(part)
        self.column.addWidget(self.area, 1)
        self.column.addWidget(self.foot)

    def show_form(self, form: Form, *, read_only: bool) -> None:
        """Show a form: in place where its rows stay the same, else anew."""
        before, self.form, self.read_only = self.form, form, read_only
        self.head.show_form(form, read_only=read_only)
        self.own.setText("\n".join(form.faults))
        self.own.setVisible(bool(form.faults))
        same = before is not None and before.path == form.path and _shape(before) == _shape(form)
        if same and [row.key for row in self.rows] == [structure_of(row) for row in form.rows]:
            for widget, row in zip(self.rows, form.rows, strict=True):
                widget.show_row(row)
        else:
            self._make(form, stays=before is not None and before.path == form.path)
        self.show_help()

    def _make(self, form: Form, *, stays: bool) -> None:
        focused = (
            self._focused.row.row.path if self._focused is not None and self.isAncestorOf(self.focusWidget()) else None
        )
        scrolled = self.area.verticalScrollBar().value() if stays else 0
        self._focused = None
        self.flush()
        inside = QWidget()
        whole = sections = QVBoxLayout(inside)
        whole.setContentsMargins(0, 2, 8, 2)
        whole.setSpacing(7)
        self.rows, self.adds, self.others = [], [], []
        if form.questions.lines:
            panel = Panel()
            sections = QVBoxLayout(panel)
            sections.setContentsMargins(10, 8, 4, 8)
            sections.setSpacing(7)
            at = next((at for at, line in enumerate(form.questions.lines) if line.path == form.path), 0)
            whole.addWidget(self._others(form.questions.lines[:at], form.questions.languages))
            whole.addWidget(panel)
            whole.addWidget(self._others(form.questions.lines[at + 1 :], ()))
        for number, section in enumerate(form.sections):
            if number:
                sections.addWidget(Rule())
            if section.title:
                sections.addLayout(self._heading(section, removable=section.path != form.path))
            heads: tuple[tuple[str, str], ...] = ()
            for row in section.rows:
                beside = () if stacked(row) or is_wide(row) else row.languages
                if len(beside) > 1 and beside != heads:
                    sections.addLayout(language_heads(beside, (LABEL_PX + 8, FIELD_PX + 8)))
                heads = beside
                sections.addWidget(self._row(row))
            if section.absent and not self.read_only:
                grid = QGridLayout()
                grid.setSpacing(0)
                for at, absent in enumerate(section.absent):
                    made = add_button(f"Add {absent.label}", absent.label)
                    made.setToolTip(absent.help)
                    made.clicked.connect(lambda _checked=False, path=absent.path: self.asked.emit(AddKey(path)))
                    grid.addWidget(made, at // ACROSS, at % ACROSS, Qt.AlignmentFlag.AlignLeft)
                    self.adds.append(made)
                sections.addLayout(grid)
        whole.addStretch(1)
        dress(inside, self.theme)
        self.inside, self.sections = inside, whole
        old = self.area.takeWidget()
        self.area.setWidget(inside)
        if old is not None:
            take_away(old)
        QTimer.singleShot(0, self.area, lambda: self.area.verticalScrollBar().setValue(scrolled))
        if focused is not None and stays:
            self.focus(focused)

    def _others(self, lines: tuple[QuestionLine, ...], languages: tuple[str, ...]) -> QuestionRows:
        made = QuestionRows(lines, languages)
        made.write_asked.connect(self.write)
        self.others += made.rows
        return made

    def write(self, path: tuple[str | int, ...]) -> None:
        """Select a question and give the keyboard to its text."""
        self.open_asked.emit(path)
        self.focus((*path, "text"))

    def _heading(self, section: Section, *, removable: bool) -> QHBoxLayout:
        heading = QHBoxLayout()
        heading.addWidget(label(section.title, "strong"))
        heading.addStretch()
        if removable:
            away = IconButton("cross", f"Remove {section.title} from the file", size=FIELD_PX, role="plain")
            away.clicked.connect(lambda: self.asked.emit(RemoveKey(section.path)))
            away.setEnabled(not self.read_only)
            heading.addWidget(away)
        return heading

    def _row(self, row: FormRow) -> RowWidget:
        made = RowWidget(row)
        made.field.asked.connect(self.asked)
        made.field.open_asked.connect(self.open_asked)
        made.field.write_asked.connect(self.write)
        made.field.copy_asked.connect(lambda path: self.copy_asked.emit((path,)))
        made.field.came.connect(lambda: self._come(made))
        made.field.setEnabled(not self.read_only or row.row.kind in {"list", "tables", "references", "reference"})
        made.remove.setEnabled(not self.read_only)
        self.rows.append(made)
        return made

    def flush(self) -> None:
        """Hand on what is being typed."""
        for part in self.findChildren(QWidget):
            if isinstance(part, TypedLine | TypedText):
                part.flush()

    def focus(self, path: tuple[str | int, ...]) -> bool:
        """Give the keyboard to the row of a place, and scroll to it; return whether there is one."""
        inner = [row for row in self.rows if path[: len(row.row.row.path)] == row.row.row.path]
        found = max(inner, key=lambda row: len(row.row.row.path), default=None)
        if found is None:
            return False
        found.field.take_keyboard()
        self._come(found)
        self.area.ensureWidgetVisible(found, 0, 40)
        return True

    def focus_first(self) -> None:
        """Give the keyboard to the first row."""
        if self.rows:
            self.focus(self.rows[0].row.row.path)

    def focus_first_text(self) -> None:
        """Give the keyboard to the first empty text, else to the first text, marked, else to the first row."""
        texts = [part for row in self.rows for part in row.field.findChildren(QWidget)]
        lines = [part for part in texts if isinstance(part, TypedLine | TypedText)]
        words = [part for part in lines if isinstance(part.parent(), LanguagesField)]
        found = next((part for part in lines if not part.words() and not part.placeholderText()), None)
        found = found or next(iter(words), None)
        if found is None:
            self.focus_first()
            return
        found.setFocus(Qt.FocusReason.OtherFocusReason)
        found.selectAll()
        self.area.ensureWidgetVisible(found, 0, 60)

    def refuse(self, path: tuple[str | int, ...], sentence: str) -> None:
        """Say at the field of a place why it was not changed."""
        inner = [row for row in self.rows if path[: len(row.row.row.path)] == row.row.row.path]
        found = max(inner, key=lambda row: len(row.row.row.path), default=None)
        if found is not None:
            found.refusal = sentence
            found.say()
        else:
            self.own.setText(sentence)
            self.own.setVisible(True)

    def _come(self, row: RowWidget) -> None:
        self._focused = row
        row.say()
        self.show_help()

    def show_help(self) -> None:
        """Show the help of the focused field, or of the first one."""
        row = self._focused if self._focused in self.rows else next(iter(self.rows), None)
        if row is None:
            self.foot.show_help("", "", "")
        else:
            self.foot.show_help(row.row.row.label, row.row.place, row.help)


def special_editor_of(row: FormRow) -> SpecialEditor | None:
    """Return the special editor of a row, None where its kind's editor is used."""
    return EDITORS.get((row.row.model, str(row.row.path[-1])))


def is_wide(row: FormRow) -> bool:
    """Return whether the editor of a row takes the width of the form."""
    special = special_editor_of(row)
    return row.row.kind == "paragraphs" if special is None else special.wide


def structure_of(row: FormRow) -> object:
    """Return what makes another editor of a row necessary."""
    special = special_editor_of(row)
    return structure(row), None if special is None else special.structure(row)


def language_heads(languages: tuple[tuple[str, str], ...], inset: tuple[int, int] = (0, 0)) -> QHBoxLayout:
    """Return the names of languages above the columns of their texts; ``inset`` is the room left and right [px]."""
    heads = QHBoxLayout()
    heads.setContentsMargins(inset[0], 0, inset[1], 0)
    heads.setSpacing(8)
    for _code, language in languages:
        heads.addWidget(label(language, "small", "text2"), 1)
    return heads


def _shape(form: Form) -> object:
    others = [line for line in form.questions.lines if line.path != form.path]
    return (
        others,
        form.questions.languages,
        [(section.path, section.title, tuple(row.path for row in section.absent)) for section in form.sections],
    )
