"""The form of an element: its rows in sections between its head and foot, and the focus in them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property, partial
from typing import Final

from PySide6.QtCore import QCoreApplication, QEvent, Qt, Signal
from PySide6.QtGui import QKeyEvent, QResizeEvent
from PySide6.QtWidgets import QAbstractItemView, QApplication, QBoxLayout, QMenu, QVBoxLayout, QWidget

from study_app.designer.document.elements import STUDY_LANGUAGES
from study_app.designer.document.steps import AddKey, LeaveText, RemoveKey, RenameElement, SwitchKey, UseSource
from study_app.designer.form.drawn_fields import LEVELS, TRIAL
from study_app.designer.form.fields import (
    LANGUAGE,
    ChecksField,
    ChoiceField,
    Field,
    LanguagesField,
    LineField,
    SpecialEditor,
    SwitchField,
    TypedLine,
    TypedText,
    UnknownField,
    add_button,
    is_stacked,
    remove_button,
    removes_key,
)
from study_app.designer.form.head_and_foot import FormFoot, FormHead
from study_app.designer.form.lists import CONDITIONS, EntriesField, EntryList, LanguageListField, LinesField
from study_app.designer.form.rows import Form, FormRow, Section, added_row, values_of
from study_app.designer.form.special import (
    BLOCK_ORDER,
    DESCRIPTION,
    GROUP_ASSIGNMENT,
    HYPOTHESES,
    ORDER,
    POINTS,
    QUESTION_KIND,
    QUESTION_LIST,
    SENTENCES,
    Panel,
    QuestionRows,
)
from study_app.designer.parts import FIELD_PX, LABEL_PX, Segments
from study_app.designer.problems import ProblemRow, RepairButton
from study_app.gui.kit import choose_protocol, with_key
from study_app.gui.theme import Themed, font, name_scroll_bars, remove_widget
from study_app.gui.widgets import (
    STRETCH,
    Card,
    Icon,
    IconButton,
    Ink,
    Rule,
    add_layout,
    add_parts,
    hbox,
    insert_layout,
    label,
    scrolled,
    set_property,
    vbox,
)
from study_app.gui.widgets import grid as grid_of
from study_app.number_text import capitalised
from study_app.protocol.questionnaires import Instrument
from study_app.protocol.source import Path

KINDS = {
    "numbers": "Numbers", "vector": "Numbers", "number": "One number", "whole number": "One number", "text": "Text",
    "choices": "Chosen", "choice": "Automatic", "texts": "Texts", "references": "Named", "reference": "Named",
    "table": "Table", "list": "List", "points": "Points", "localised": "Text", "switch": "Yes or no",
}  # fmt: skip
"""Labels of the kinds of a value that can have several kinds."""


class _EitherField(Field):
    """A value of one of several kinds: a choice of the kind, followed by its editor."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.kinds = Segments(f"{row.label}, kind")
        self.kinds.chosen.connect(self._switch_kind)
        self.box.addWidget(self.kinds, 0, Qt.AlignmentFlag.AlignLeft)
        self.inner = _field_for(self._chosen_row(row))
        self.inner.asked.connect(self.asked)
        self.inner.focused.connect(self.focused)
        self.box.addWidget(self.inner)
        self.setFocusProxy(self.inner)
        self.show_value()

    def show_row(self, row: FormRow) -> None:
        self.inner.show_row(self._chosen_row(row))
        super().show_row(row)

    def show_value(self) -> None:
        values = [
            (index, KINDS.get(alternative.kind, alternative.kind)) for index, alternative in enumerate(self.row.either)
        ]
        self.kinds.show_values(values, self.row.number)

    def _chosen_row(self, row: FormRow) -> FormRow:
        return replace(row, **values_of(row.either[row.number or 0]))

    def _switch_kind(self, index: int) -> None:
        """Request a value of another kind, converted from the current one as far as possible."""
        if index == self.row.number:
            return
        new_row, value = self.row.either[index], self.row.value
        first_value = value[0] if isinstance(value, tuple) and value else value
        if new_row.kind in {"choice", "reference"}:
            self.set_value(new_row.choices[0].value if new_row.choices else "")
        elif new_row.kind == "choices":
            self.set_value([choice.value for choice in new_row.choices][:1])
        elif new_row.kind in {"number", "whole number"}:
            self.set_value(first_value if isinstance(first_value, int | float) else 1)
        elif new_row.kind in {"numbers", "vector"}:
            self.set_value([value] if isinstance(value, int | float) else [1])
        else:
            self.set_value(str(first_value))


def _field_for(row: FormRow) -> Field:
    """Return the editor of a row."""
    kind = row.kind
    if kind in {"localised", "paragraphs"}:
        return LanguagesField(row)
    if kind == "switch":
        return SwitchField(row)
    if kind in {"choice", "kind", "reference"}:
        return ChoiceField(row)
    if kind == "choices":
        return ChecksField(row)
    if row.path == STUDY_LANGUAGES:
        return LanguageListField(row)
    if kind in {"texts", "points"}:
        return LinesField(row)
    if kind in {"references", "list", "tables"}:
        return EntriesField(row)
    if kind == "either":
        return _EitherField(row)
    return LineField(row) if kind not in {"unknown", "table"} else UnknownField(row)


_MAX_REPAIRS = 3
_SOURCES = _LIQUID_FILE, _INSTRUMENT = ("liquids", "file"), ("questionnaires", "instrument")
"""Section and key of sources that replace a whole element; a file or questionnaire is chosen first."""
EDITORS: Final[Mapping[tuple[str, str], SpecialEditor]] = {
    key: editor
    for editor in (
        CONDITIONS, DESCRIPTION, SENTENCES, ORDER, POINTS, QUESTION_KIND, QUESTION_LIST, LEVELS, TRIAL,
        BLOCK_ORDER, GROUP_ASSIGNMENT, HYPOTHESES,
    )
    for key in editor.keys
}  # fmt: skip
"""The special editor of each (model, key) that has one."""


class _FaultLine(QWidget):
    """A line below an editor with a fault, or with a hint on an unfinished entry."""

    def __init__(self) -> None:
        super().__init__()
        self.icon = Icon("warning", "bad", 16)
        self.sentence = label("", "label", "bad", wraps=True)
        icon = (self.icon, 0, Qt.AlignmentFlag.AlignTop)
        hbox(icon, (self.sentence, 1), spacing=8, margins=(LABEL_PX + 8, 0, 0, 0), parent=self)

    def show_text(self, text: str, *, is_hint: bool) -> None:
        self.icon.show_icon(*(("info", "text2") if is_hint else ("warning", "bad")))
        self.sentence.setText(text)
        set_property(self.sentence, "role", "text2" if is_hint else "bad")


class _RowWidget(Themed, QWidget):
    """A row: its label, its editor, a button that removes the key, and its faults.

    ``repair_asked`` carries a problem and the text of one of its repairs.
    """

    repair_asked = Signal(object, str)

    def __init__(self, row: FormRow) -> None:
        super().__init__()
        self.row = row
        self.refusal = ""
        special, wide = _special_editor_of(row), _is_wide(row)
        bare = special is not None and not special.labelled
        self.field = _field_for(row) if special is None or special.make is None else special.make(row)
        if special is not None and special.adds is not None:
            self.field.add_extra(special.adds(self.field))
        self.keys = Segments("Choose one of the two keys") if row.keys else None
        self.label = label(row.label, "label", wraps=True)
        if not wide:
            self.label.setFixedWidth(LABEL_PX)
        self.label.setMinimumHeight(FIELD_PX)
        self.label.setAlignment(Qt.AlignmentFlag.AlignVCenter)
        self.label.setBuddy(self.field)
        self.remove = remove_button(f"Remove {row.label} from the file", self._ask_to_remove)
        policy = self.remove.sizePolicy()
        policy.setRetainSizeWhenHidden(True)
        self.remove.setSizePolicy(policy)
        line = hbox(spacing=8)
        top = Qt.AlignmentFlag.AlignTop
        if bare:
            line.addWidget(self.field, 1)
        else:
            line.addWidget(self.label, int(wide), top)
            line.addWidget(label(self.field.caption, "small", "text2") if wide else self.field, int(not wide))
        if not bare or row.is_removable:
            line.addWidget(self.remove, 0, top)
        self.repairs: list[RepairButton] = []
        self._offered: dict[ProblemRow, tuple[str, ...]] = {}
        self._buttons = vbox(spacing=6, margins=(LABEL_PX + 32, 0, 0, 0))
        column = vbox(spacing=4, margins=0, parent=self)
        has_headings = wide and len(row.languages) > 1 and not is_stacked(row)
        has_label = not bare and not (has_headings and row.required)
        if has_label or bare:
            add_layout(column, line)
        if not has_label:  # the language headings, or the editor itself, label the row
            self.label.setParent(self)
            self.label.hide()
        if self.keys is not None:
            self.keys.show_values(row.keys, row.path[-1])
            self.keys.chosen.connect(self._switch_key)
            key_line = hbox((self.keys, 0, Qt.AlignmentFlag.AlignLeft), margins=(0 if wide else LABEL_PX + 8, 0, 0, 0))
            insert_layout(column, 0, key_line)
        if has_headings:
            prefix = "" if has_label else f"{row.label}, "
            column.addWidget(_LanguageHeadings(f"{prefix}{language}" for _, language in row.languages))
        if wide and not bare:
            column.addWidget(self.field)
        add_layout(column, self._buttons)
        column.addStretch(1)  # otherwise a field moves while its row shrinks, and a click misses it
        self.show_row(row)

    @cached_property
    def fault_line(self) -> _FaultLine:
        """The faults below the editor; created on first use."""
        line = _FaultLine()
        column = self.layout()
        assert isinstance(column, QVBoxLayout)  # noqa: S101 - set in __init__
        line.hide()
        column.insertWidget(column.count() - 2, line)
        name_scroll_bars(line)
        return line

    def _ask_to_remove(self) -> None:
        """Request to remove the key; pending text is submitted first, since it would add the key again later."""
        for part in self.field.findChildren(QWidget):
            if isinstance(part, TypedLine | TypedText):
                part.flush()
        if self.remove.hasFocus():  # the button is hidden with the value, and Qt would move the focus to the next row
            self.field.take_keyboard()
        self.field.asked.emit(RemoveKey(self.row.path))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if removes_key(event) and self.row.is_removable and self.remove.isEnabled():
            self._ask_to_remove()
        else:
            super().keyPressEvent(event)

    def _switch_key(self, key: object) -> None:
        if key != self.row.path[-1]:
            self.field.asked.emit(SwitchKey(self.row.path, str(key)))

    def show_row(self, row: FormRow) -> None:
        if row != self.row:
            self.refusal = ""
            self.row = row
            self.field.show_row(row)
        self.show_messages()

    def begin(self, row: FormRow) -> None:
        """Show the row of another element; typed text, rejections and selections are discarded."""
        for field in (self.field, *self.field.findChildren(Field)):
            field.refusal = ""
        typed = [part for part in self.field.findChildren(QWidget) if isinstance(part, TypedLine | TypedText)]
        for part in typed:
            part.show_refused(False)
        for entries in self.field.findChildren(QAbstractItemView):
            entries.clearSelection()
        self.refusal, self.row = "", row
        self.field.show_row(row)
        for part in typed:
            part.accept_shown_text()
        self.show_messages()

    def show_messages(self) -> None:
        self.remove.setVisible(self.row.is_removable and self.remove.parent() is not None)
        refused = [field.refusal for field in (self.field, *self.field.findChildren(Field)) if field.refusal]
        corrections = [sentence for sentence in (self.refusal, *refused, *self.row.faults) if sentence]
        counts = Counter(corrections)
        if corrections or "fault_line" in self.__dict__:
            sentences_shown = (
                sentence if count == 1 else f"{count} × {sentence}" for sentence, count in counts.items()
            )
            self.fault_line.show_text(
                "\n".join(sentences_shown), is_hint=self.row.unfinished and not (self.refusal or refused)
            )
            self.fault_line.setVisible(bool(corrections))
        row = self.row
        sentences = filter(None, (row.help, row.permitted, *corrections))
        self.field.setAccessibleDescription(" ".join(f"{sentence.rstrip('.')}." for sentence in sentences))
        some_texts_missing = isinstance(self.field, LanguagesField) and self.field.has_missing_texts
        lines = self.field.lines if isinstance(self.field, LanguagesField) else {}
        faultless_lines = [
            line for code, line in lines.items() if row.faulty_languages and code not in row.faulty_languages
        ]
        for part in self.field.findChildren(QWidget):
            if not isinstance(part, TypedLine | TypedText):
                continue
            part.setAccessibleDescription(self.field.accessibleDescription())
            if not refused:
                is_marked = part.focusPolicy() != Qt.FocusPolicy.NoFocus and not (
                    some_texts_missing and part.typed_text()
                )
                is_marked = is_marked and part not in faultless_lines
                part.show_refused(bool(self.row.faults) and not self.row.unfinished and is_marked)

    def show_repairs(self, known: Mapping[ProblemRow, tuple[str, ...]]) -> None:
        """Offer the first repair of each problem of this row; a repair whose text is not unique is omitted."""
        path = self.row.path
        offered = {
            problem: sentences
            for problem, sentences in known.items()
            if problem.fault.path[: len(path)] == path and problem.fault.kind != "no text" and sentences
        }
        if offered == self._offered:
            return
        self._offered = offered
        old_buttons, self.repairs = self.repairs, []
        focused_text = next((button.text() for button in old_buttons if button.hasFocus()), None)
        has_several = len(offered) > 1
        repairs = [
            (problem, text) for problem, sentences in offered.items() for text in sentences[: 1 if has_several else 2]
        ]
        counts = Counter(text for _problem, text in repairs)
        for problem, text in [(problem, text) for problem, text in repairs if counts[text] == 1][:_MAX_REPAIRS]:
            button = RepairButton(problem, text)
            button.clicked.connect(lambda _on=False, problem=problem, text=text: self.repair_asked.emit(problem, text))
            button.typed.connect(self._type_letter)
            name_scroll_bars(button)
            self._buttons.addWidget(button, 0, Qt.AlignmentFlag.AlignRight)
            button.show()  # at once: Tab skips widgets that a layout has not shown yet
            self.repairs.append(button)
        if focused_text is not None and not self.repairs:
            self.field.take_keyboard()
        elif focused_text is not None:  # focus the same repair again, if it is still offered
            min(self.repairs, key=lambda button: button.text() != focused_text).setFocus(
                Qt.FocusReason.OtherFocusReason
            )
        for button in old_buttons:
            remove_widget(button)

    def _type_letter(self, event: QKeyEvent) -> None:
        """Type a letter into the field."""
        self.field.take_keyboard()
        line = self.window().focusWidget()
        if isinstance(line, TypedLine | TypedText) and self.isAncestorOf(line):
            QCoreApplication.sendEvent(line, event)

    @property
    def help(self) -> str:
        """The help text of the row: its description, or that of the current choice, and the permitted values."""
        row = self.row
        current = row.default if row.value is None else row.value
        sentence = next((choice.sentence for choice in row.choices if choice.value == current), "")
        reason = f" ({row.reason})" if row.reason else ""
        permitted = f"Permitted: {row.permitted}{reason}." if row.permitted and not row.choices else ""
        text = " ".join(filter(None, (sentence or row.help, permitted)))
        text = " ".join(text.replace("`", "").split())
        return capitalised(text)


def _special_editor_of(row: FormRow) -> SpecialEditor | None:
    """Return the special editor of a row, or None for the standard editor of its kind."""
    return EDITORS.get((row.model, str(row.path[-1])))


def _is_wide(row: FormRow) -> bool:
    """Return whether the editor of a row takes the width of the form."""
    special = _special_editor_of(row)
    return row.kind == "paragraphs" if special is None else special.wide


def _editor_structure(row: FormRow) -> object:
    """Return the part of a row's state that, when it changes, requires a new editor."""
    special = _special_editor_of(row)
    chosen_kind = row.either[row.number or 0].kind if row.either else ""
    choices = tuple(choice.value for choice in row.choices) if row.kind in {"choice", "choices", "kind"} else ()
    extra = None if special is None else special.structure(row)
    return row.model, row.kind, chosen_kind, choices, row.languages, row.required, row.keys, extra


class _LanguageHeadings(QWidget):
    """The languages' names above the columns of their texts; ``inset`` is the left and right margin [px]."""

    def __init__(self, languages: Iterable[str], inset: tuple[int, int] = (0, 0)) -> None:
        super().__init__()
        headings = ((label(language, "small", "text2"), 1) for language in languages)
        hbox(*headings, spacing=8, margins=(inset[0], 0, inset[1], 0), parent=self)


_COLUMNS = 2
_ADD_PX = 235
"""The greatest width of a button in a column of `_AddKeys` [px]."""
_FOOT_MIN_PX = 460
"""Minimum height of the form with a foot [px]."""


class _AddKeys(QWidget):
    """Buttons that add keys to a section; ``keys`` are paths within the element, labels and descriptions."""

    def __init__(self, keys: Iterable[tuple[Path, str, str]], add: Callable[[Path], None]) -> None:
        super().__init__()
        grid = grid_of(0, 0, margins=0, parent=self)
        self.buttons: dict[Path, QWidget] = {}
        position = 0
        for key, name, description in keys:
            button = self.buttons[key] = add_button(f"Add {name}", name)
            button.setToolTip(description)
            button.clicked.connect(lambda _checked=False, key=key: add(key))
            columns = _COLUMNS if button.sizeHint().width() > _ADD_PX else 1
            position += -position % columns  # a button with a long name takes a whole line
            grid.addWidget(button, position // _COLUMNS, position % _COLUMNS, 1, columns, Qt.AlignmentFlag.AlignLeft)
            position += columns


class FormCard(Card):
    """Shows a `Form`; parts common to the old and the new form keep their widgets, with caret and focus.

    Signals: ``asked`` (a request), ``repair_asked`` (a problem and the text of a repair).
    """

    asked = Signal(object)
    repair_asked = Signal(object, str)

    def __init__(self) -> None:
        super().__init__(padding=18, gap=8)
        self.setAccessibleName("Form")
        self.form: Form | None = None
        self.read_only = False
        self.rows: list[_RowWidget] = []
        self.adds: dict[Path, QWidget] = {}
        self._parts: dict[object, QWidget] = {}
        self._known: Mapping[ProblemRow, tuple[str, ...]] = {}
        self._focused: _RowWidget | None = None
        self._renames = False
        self.instruments = QMenu(self)
        self.instruments.setFont(font("label"))
        self.head = FormHead()
        self.head.asked.connect(self._request)
        self.own = label("", "label", "bad", wraps=True)
        self.above, self.panel, self.below = QuestionRows(), Panel(), QuestionRows()
        for questions in (self.above, self.below):
            questions.asked.connect(self.asked)
        self.sections = vbox(STRETCH, spacing=7, parent=self.panel)
        self.inside = QWidget()
        vbox(self.above, self.panel, self.below, STRETCH, spacing=7, margins=(0, 2, 8, 2), parent=self.inside)
        self.area = scrolled(self.inside)
        self.foot = FormFoot()
        add_parts(self.column, self.head, Rule(), self.own, (self.area, 1), self.foot)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.foot.setVisible(self.height() >= _FOOT_MIN_PX)

    def _request(self, asked: object) -> None:
        """Request a step; after a rename, the form still shows the same element."""
        before, self._renames = self._renames, isinstance(asked, RenameElement | LeaveText)
        self.asked.emit(asked)
        self._renames = before

    def show_form(self, form: Form, *, read_only: bool) -> None:
        """Show a form: keep the parts that exist, create missing ones, and remove the others."""
        before = self.form
        stays = before is not None and (
            form.path == before.path or (self._renames and form.path[:-1] == before.path[:-1])
        )
        if before is not None and not stays:
            self.flush()
            if self.form is not before:  # a later form with the typed text is already shown
                return
        if read_only != self.read_only:
            self._remove_parts(self._parts)
            self._parts = {}
        self.form, self.read_only = form, read_only
        self.head.show_form(form, read_only=read_only)
        self.own.setText("\n".join(form.faults))
        set_property(self.own, "role", "text2" if form.unfinished else "bad")
        self.own.setVisible(bool(form.faults))
        self._show_parts(form, before if stays else None)
        if not stays:
            self.area.verticalScrollBar().setValue(0)
            keyboard = self.window().focusWidget()
            if keyboard is not None and self.inside.isAncestorOf(keyboard):
                self._scroll_to(keyboard)
        self.show_repairs(self._known)
        self.show_help()

    def _show_parts(self, form: Form, before: Form | None) -> None:
        """Show the parts of a form; ``before`` is the previous form of the same element, None for another element."""
        lines = form.questions.lines
        index = next((index for index, line in enumerate(lines) if line.path == form.path), 0)
        self.above.show_lines(lines[:index], form.questions.languages if lines else ())
        self.below.show_lines(lines[index + 1 :])
        self.panel.tinted = bool(lines)
        self.sections.setContentsMargins(*((10, 8, 4, 8) if lines else (0, 0, 0, 0)))
        keyboard = self.window().focusWidget()
        inside_form = keyboard is not None and self.inside.isAncestorOf(keyboard)
        old, self._parts, self.rows, self.adds = self._parts, {}, [], {}
        for key, make, row in self._form_parts(form):
            existing = old.pop(key, None)
            part = self._parts[key] = existing or make()
            if isinstance(part, _RowWidget) and row is not None:
                if before is None and existing is not None:
                    part.begin(row)
                else:
                    part.show_row(row)
                self.rows.append(part)
            elif isinstance(part, _AddKeys):
                self.adds |= {(*form.path, *inner): button for inner, button in part.buttons.items()}
        removed = next((part for part in old.values() if inside_form and part.isAncestorOf(keyboard)), None)
        if removed is not None and keyboard is not None:
            keyboard.clearFocus()  # otherwise Qt moves the keyboard focus
        self._remove_parts(old)
        for position, part in enumerate(self._parts.values()):
            if self.sections.indexOf(part) != position:
                self.sections.insertWidget(position, part)
                name_scroll_bars(part)
                part.show()  # at once: a layout shows it later, and a hidden widget takes no focus
        if removed is not None:
            self._refocus(form, before, removed)

    def _refocus(self, form: Form, before: Form | None, removed: QWidget) -> None:
        """Move the focus from a removed part to the row that replaced it or that it added, or to the first row."""
        path: Path | None = None
        if before is not None and isinstance(removed, _RowWidget):
            path = removed.row.path
            path = (*form.path, *path[len(before.path) :]) if path[: len(before.path)] == before.path else path
        elif before is not None:
            path = added_row(form, before)
        if path is None or not self.focus_row(path):
            self.focus_first()

    @staticmethod
    def _remove_parts(parts: Mapping[object, QWidget]) -> None:
        for part in parts.values():
            remove_widget(part)

    def _form_parts(self, form: Form) -> Iterator[tuple[object, Callable[[], QWidget], FormRow | None]]:
        """Yield the key, the factory and the row, if any, of each part of a form, from top to bottom."""
        for number, section in enumerate(form.sections):
            section_key = form.path[:1], section.title, section.path[len(form.path) :]
            if number:
                yield ("rule", section_key), Rule, None
            if section.title:
                removable = section.path != form.path and not self.read_only
                yield ("title", section_key), partial(self._section_heading, section, removable=removable), None
            if section.faults:
                sentences = "\n".join(section.faults)
                ink: Ink = "text2" if section.unfinished else "bad"
                yield ("faults", section_key, sentences, ink), partial(label, sentences, "label", ink, wraps=True), None
            shown_languages: tuple[tuple[str, str], ...] = ()
            for row in section.rows:
                languages = () if is_stacked(row) or _is_wide(row) else row.languages
                if len(languages) > 1 and languages != shown_languages:
                    names = tuple(language for _, language in languages)
                    yield (
                        ("heads", section_key, row.path[-1], names),
                        partial(_LanguageHeadings, names, (LABEL_PX + 8, FIELD_PX + 8)),
                        None,
                    )
                shown_languages = languages
                inner = row.path[len(form.path) :] if row.path[: len(form.path)] == form.path else row.path
                yield (section_key, inner, _editor_structure(row)), partial(self._make_row, row), row
            if section.absent and not self.read_only:
                added = tuple(
                    (row.path[len(form.path) :], row.label + "…" * (row.path[::2] in _SOURCES), row.help)
                    for row in section.absent
                )
                yield ("adds", section_key, added), partial(_AddKeys, added, self._add_key), None

    def _add_key(self, inner: Path) -> None:
        """Request to add a key; let the user choose a liquid file or standard questionnaire first."""
        path = self._path_in_form(inner)
        if path[::2] == _LIQUID_FILE:
            if name := choose_protocol(self, "Choose a liquid file"):
                self.asked.emit(UseSource(path, name))
        elif path[::2] == _INSTRUMENT:
            self.instruments.clear()
            for name in Instrument.names():
                use = self.instruments.addAction(name.upper())
                use.triggered.connect(partial(self.asked.emit, UseSource(path, name)))
            self.instruments.popup(self.adds[path].mapToGlobal(self.adds[path].rect().bottomLeft()))
        else:
            self.asked.emit(AddKey(path))

    def _path_in_form(self, inner: Path) -> Path:
        """Return the path of a part of the shown element."""
        return inner if self.form is None else (*self.form.path, *inner)

    def _section_heading(self, section: Section, *, removable: bool) -> QWidget:
        widget, inner = QWidget(), () if self.form is None else section.path[len(self.form.path) :]
        heading = hbox(label(section.title, "strong"), STRETCH, margins=0, parent=widget)
        if section.path != (() if self.form is None else self.form.path):
            remove = IconButton("cross", f"Remove {section.title} from the file", size=FIELD_PX, role="plain")
            remove.clicked.connect(lambda: self.asked.emit(RemoveKey(self._path_in_form(inner))))
            remove.setEnabled(removable)
            heading.addWidget(remove)
        return widget

    def _make_row(self, row: FormRow) -> _RowWidget:
        row_widget = _RowWidget(row)
        row_widget.field.asked.connect(self._request)
        row_widget.repair_asked.connect(self.repair_asked)
        if isinstance(row_widget.field, EntryList) and self.read_only:
            row_widget.field.make_read_only()
        row_widget.field.focused.connect(lambda: self._show_focused_row(row_widget))
        row_widget.field.setEnabled(not self.read_only or row.kind in {"list", "tables", "references", "reference"})
        for part in (row_widget.remove, row_widget.keys):
            if part is not None:
                part.setEnabled(not self.read_only)
        return row_widget

    def flush(self) -> None:
        self.head.id.flush()
        for part in self.inside.findChildren(QWidget):
            if isinstance(part, TypedLine | TypedText):
                part.flush()

    def _scroll_to(self, row: QWidget) -> None:
        """Scroll so that a row's question, the row, and its focused part are visible, the last one with priority."""
        # new rows have no position before they are laid out
        QApplication.sendPostedEvents(None, QEvent.Type.LayoutRequest.value)
        if self.panel.tinted:
            self.area.ensureWidgetVisible(self.panel, 0, 0)
        self.area.ensureWidgetVisible(row, 0, 40)
        keyboard = self.window().focusWidget()
        if keyboard is not None and row.isAncestorOf(keyboard):
            self.area.ensureWidgetVisible(keyboard, 0, 40)

    def _innermost_row(self, path: Path) -> _RowWidget | None:
        containing = [row for row in self.rows if path[: len(row.row.path)] == row.row.path]
        return max(containing, key=lambda row: len(row.row.path), default=None)

    def focus_row(self, path: Path) -> bool:
        """Focus the row that contains a path and scroll to it; return whether there is one.

        If the key is missing in the file, focus the button that adds it.
        """
        row = self._innermost_row(path)
        if row is None:
            if (button := self.adds.get(path)) is not None:
                button.setFocus(Qt.FocusReason.OtherFocusReason)
                self.area.ensureWidgetVisible(button)
            return button is not None
        row.field.take_keyboard()
        self._show_focused_row(row)
        self._scroll_to(row)
        return True

    def focus_first(self) -> None:
        if self.rows:
            self.focus_row(self.rows[0].row.path)

    def focus_first_field(self) -> None:
        """Focus the first text field, or the first row of a form without one."""
        if (field := next(self._typed_fields(), None)) is not None:
            self._focus_typed(field)
            if isinstance(field, TypedLine):
                field.end(False)  # otherwise Delete, which is meant for the element, would delete a letter
        else:
            self.focus_first()

    def focus_first_text(self, *, filled: bool) -> None:
        """Focus and select the first text; unless ``filled``, the first empty one is preferred.

        In the form of a new element without texts, focus its ID; in other forms without texts, focus the first row.
        """
        fields = list(self._typed_fields())
        texts = [field for field in fields if isinstance(field.parent(), LanguagesField)]
        if not (filled or texts) and self.head.id_line.isVisibleTo(self):
            self.head.edit_id()
            return
        empty = (field for field in fields if not filled and not field.typed_text() and not field.placeholderText())
        field = next(iter((*empty, *texts)), None)
        if field is None:
            self.focus_first()
            return
        self._focus_typed(field)
        field.selectAll()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """At Enter in the list of texts to write, go to the next missing text."""
        if self.form is None or not self.form.lists_texts or event.key() not in {Qt.Key.Key_Return, Qt.Key.Key_Enter}:
            super().keyPressEvent(event)
            return
        fields = list(self._typed_fields())
        next_index = next((next_index for next_index, field in enumerate(fields, start=1) if field.hasFocus()), 0)
        to_write = (field for field in (*fields[next_index:], *fields[:next_index]) if self._is_to_write(field))
        if (field := next(to_write, None)) is None:
            self.show_note("No texts are missing.")
        else:
            self._focus_typed(field)
            field.selectAll()

    def _is_to_write(self, field: TypedLine | TypedText) -> bool:
        row = next(row.row for row in self.rows if row.isAncestorOf(field))
        return not field.typed_text().strip() or field.property(LANGUAGE) in {
            text.language for text in row.untranslated
        }

    def _typed_fields(self) -> Iterator[TypedLine | TypedText]:
        for row in self.rows:
            for part in row.field.findChildren(QWidget):
                if isinstance(part, TypedLine | TypedText) and part.isVisibleTo(self) and part.isEnabled():
                    yield part

    def _focus_typed(self, field: TypedLine | TypedText) -> None:
        field.setFocus(Qt.FocusReason.OtherFocusReason)
        row = next(row for row in self.rows if row.isAncestorOf(field))
        self._show_focused_row(row)
        self._scroll_to(row)

    def refuse(self, path: Path, sentence: str) -> None:
        """Show the reason for a rejected change below the row that contains its path."""
        if (row := self._innermost_row(path)) is not None:
            row.refusal = sentence
            row.show_messages()
        else:
            self.own.setText(sentence)
            set_property(self.own, "role", "bad")
            self.own.setVisible(True)

    def show_repairs(self, known: Mapping[ProblemRow, tuple[str, ...]]) -> None:
        self._known = {} if self.read_only else known
        for row in self.rows:
            row.show_repairs(self._known)

    def repairs_of(self, problem: ProblemRow) -> list[RepairButton]:
        return [button for row in self.rows for button in row.repairs if button.problem == problem]

    def _show_focused_row(self, row: _RowWidget) -> None:
        self._focused = row if row in self.rows else self._focused  # the row's own step may have replaced it
        row.show_messages()
        self.show_help()

    def show_help_of(self, part: QWidget | None) -> None:
        """Show the help of the row that contains a part, if any."""
        row = self._row_containing(part)
        if row is not None and row is not self._focused:
            self._show_focused_row(row)

    def row_path_of(self, part: QWidget) -> Path:
        """Return the path of the row that contains a part, () if there is none."""
        row = self._row_containing(part)
        return () if row is None else row.row.path

    def _row_containing(self, part: QWidget | None) -> _RowWidget | None:
        return next((row for row in self.rows if part is not None and row.isAncestorOf(part)), None)

    def show_note(self, sentence: str) -> None:
        """Show a sentence in the foot, also of a low form, until the help of another field or step replaces it."""
        self.foot.show_help("", "", sentence)
        self.foot.show()

    def show_help(self) -> None:
        self.foot.setVisible(self.height() >= _FOOT_MIN_PX)
        row = self._focused if self._focused in self.rows else next(iter(self.rows), None)
        if row is None:
            self.foot.show_help("", "", "")
        else:
            removes = with_key("remove", "remove") if row.row.is_removable and not self.read_only else ""
            self.foot.show_help(row.row.label, " · ".join(filter(None, (removes, row.row.place))), row.help)
