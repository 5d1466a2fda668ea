"""A row of the form: label, editor by its kind or key, faults and repairs."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Final

from PySide6.QtCore import QCoreApplication, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QAbstractItemView, QBoxLayout, QVBoxLayout, QWidget

from study_app.designer.document.steps import RemoveKey, SwitchKey
from study_app.designer.form.drawn_fields import LEVELS, TRIAL
from study_app.designer.form.fields import (
    ChecksField,
    ChoiceField,
    Field,
    LanguagesField,
    LineField,
    SpecialEditor,
    SwitchField,
    UnknownField,
    stacked,
)
from study_app.designer.form.hypotheses import BLOCK_ORDER, HYPOTHESES
from study_app.designer.form.lists import CONDITIONS, EntriesField, LanguageListField, LinesField
from study_app.designer.form.rows import STUDY_LANGUAGES, FormRow
from study_app.designer.form.special import DESCRIPTION, ORDER, POINTS, QUESTION_KIND, QUESTION_LIST, SENTENCES
from study_app.designer.form.targets import TARGETS
from study_app.designer.form.typed_fields import FIELD_PX, TypedLine, TypedText, removes_key
from study_app.designer.place.segments import Segments
from study_app.designer.problems.problems import ProblemRow, RepairButton
from study_app.gui.kit.commands import with_key
from study_app.gui.theme.themed import Themed, name_bars, remove_widget
from study_app.gui.widgets.boxes import add_layout, hbox, insert_layout, vbox
from study_app.gui.widgets.cards import Icon
from study_app.gui.widgets.controls import IconButton
from study_app.gui.widgets.labels import label
from study_app.number_text import capitalised

KINDS = {
    "numbers": "Numbers", "vector": "Numbers", "number": "One number", "whole number": "One number", "text": "Text",
    "choices": "Chosen", "choice": "Automatic", "texts": "Texts", "references": "Named", "reference": "Named",
    "table": "Table", "list": "List", "points": "Points", "localised": "Text", "switch": "Yes or no",
}  # fmt: skip
"""What the kinds of a value that may be of several are called."""


class EitherField(Field):
    """A value of one of several kinds: the kind, then its editor."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.kinds = Segments(f"{row.row.label}, kind")
        self.kinds.chosen.connect(self._switch)
        self.box.addWidget(self.kinds, 0, Qt.AlignmentFlag.AlignLeft)
        self.inner = field(self._chosen(row))
        self.inner.asked.connect(self.asked)
        self.inner.came.connect(self.came)
        self.box.addWidget(self.inner)
        self.setFocusProxy(self.inner)
        self.show_value()

    def show_row(self, row: FormRow) -> None:
        self.inner.show_row(self._chosen(row))
        super().show_row(row)

    def show_value(self) -> None:
        values = [(at, KINDS.get(one.kind, one.kind)) for at, one in enumerate(self.row.row.either)]
        self.kinds.show_values(values, self.row.number)

    def _chosen(self, row: FormRow) -> FormRow:
        return replace(row, row=row.row.either[row.number or 0])

    def _switch(self, at: int) -> None:
        """Ask for a value of another kind, made of the one there is as far as that goes."""
        if at == self.row.number:
            return
        to, value = self.row.row.either[at], self.row.row.value
        first = value[0] if isinstance(value, tuple) and value else value
        if to.kind in {"choice", "reference"}:
            self.set_value(to.choices[0].value if to.choices else "")
        elif to.kind == "choices":
            self.set_value([choice.value for choice in to.choices][:1])
        elif to.kind in {"number", "whole number"}:
            self.set_value(first if isinstance(first, int | float) else 1)
        elif to.kind in {"numbers", "vector"}:
            self.set_value([value] if isinstance(value, int | float) else [1])
        else:
            self.set_value(str(first))


def field(row: FormRow) -> Field:
    """Return the editor of a row."""
    kind = row.row.kind
    if kind in {"localised", "paragraphs"}:
        return LanguagesField(row)
    if kind == "switch":
        return SwitchField(row)
    if kind in {"choice", "kind", "reference"}:
        return ChoiceField(row)
    if kind == "choices":
        return ChecksField(row)
    if row.row.path == STUDY_LANGUAGES:
        return LanguageListField(row)
    if kind in {"texts", "points"}:
        return LinesField(row)
    if kind in {"references", "list", "tables"}:
        return EntriesField(row)
    if kind == "either":
        return EitherField(row)
    return LineField(row) if kind not in {"unknown", "table"} else UnknownField(row)


LABEL_PX = 116
MOST_REPAIRS = 3
EDITORS: Final[Mapping[tuple[str, str], SpecialEditor]] = {
    key: editor
    for editor in (
        CONDITIONS, DESCRIPTION, SENTENCES, ORDER, POINTS, QUESTION_KIND, QUESTION_LIST, LEVELS, TRIAL, TARGETS,
        BLOCK_ORDER, HYPOTHESES,
    )
    for key in editor.keys
}  # fmt: skip
"""The special editor of each (model, key) that has one."""


class FaultLine(QWidget):
    """A sentence that says what is wrong, below an editor."""

    def __init__(self) -> None:
        super().__init__()
        icon = (Icon("warning", "bad", 16), 0, Qt.AlignmentFlag.AlignTop)
        self.sentence = label("", "label", "bad", wraps=True)
        hbox(icon, (self.sentence, 1), spacing=8, margins=(LABEL_PX + 8, 0, 0, 0), parent=self)


class RowWidget(Themed, QWidget):
    """A row: its label, its editor, a button that removes the key, and what is wrong with it.

    ``repair_asked`` carries a problem and the words of one of its repairs.
    """

    repair_asked = Signal(object, str)

    def __init__(self, row: FormRow) -> None:
        super().__init__()
        self.row = row
        self.refusal = ""
        special, wide = special_editor_of(row), is_wide(row)
        bare = special is not None and not special.labelled
        self.field = field(row) if special is None else special.make(row)
        self.keys = Segments("Which of the two is given") if row.instead else None
        self.words = label(row.row.label, "label", wraps=True)
        if not wide:
            self.words.setFixedWidth(LABEL_PX)
        self.words.setMinimumHeight(FIELD_PX)
        self.words.setAlignment(Qt.AlignmentFlag.AlignVCenter)
        self.words.setBuddy(self.field)
        self.remove: IconButton | None = None
        if row.removable:
            removes = f"Remove {row.row.label} from the file"
            self.remove = IconButton("cross", removes, with_key(removes, "remove"), size=FIELD_PX, role="plain")
            self.remove.setFocusPolicy(Qt.FocusPolicy.ClickFocus)  # no stop of Tab at each field
            self.remove.clicked.connect(self._remove)
        across = hbox(spacing=8)
        top = Qt.AlignmentFlag.AlignTop
        if bare:
            across.addWidget(self.field, 1)
        else:
            across.addWidget(self.words, int(wide), top)
            across.addWidget(label(self.field.caption, "small", "text2") if wide else self.field, int(not wide))
        if self.remove is not None:
            across.addWidget(self.remove, 0, top)
        elif not bare:
            across.addSpacing(FIELD_PX + across.spacing())
        self.repairs: list[RepairButton] = []
        self._offered: dict[ProblemRow, tuple[str, ...]] = {}
        self._buttons = vbox(spacing=6, margins=(LABEL_PX + 32, 0, 0, 0))
        column = vbox(spacing=4, margins=0, parent=self)
        heads = wide and len(row.languages) > 1 and not stacked(row)
        labelled = not bare and (row.removable or not heads)
        if labelled or bare:
            add_layout(column, across)
        if not labelled:  # the names of the languages, or the editor, say what it is
            self.words.setParent(self)
            self.words.hide()
        if self.keys is not None:
            self.keys.show_values(row.instead, row.row.path[-1])
            self.keys.chosen.connect(self._switch)
            above = hbox((self.keys, 0, Qt.AlignmentFlag.AlignLeft), margins=(0 if wide else LABEL_PX + 8, 0, 0, 0))
            insert_layout(column, 0, above)
        if heads:
            of = "" if labelled else f"{row.row.label}, "
            column.addWidget(LanguageHeads(f"{of}{language}" for _, language in row.languages))
        if wide and not bare:
            column.addWidget(self.field)
        add_layout(column, self._buttons)
        self.show_row(row)

    @cached_property
    def wrong(self) -> FaultLine:
        """What is wrong, below the editor; made when it is first needed."""
        made = FaultLine()
        column = self.layout()
        assert isinstance(column, QVBoxLayout)  # noqa: S101 - made so
        made.hide()
        column.insertWidget(column.count() - 1, made)
        name_bars(made)
        return made

    def _remove(self) -> None:
        """Ask to remove the key; what is being typed is handed on before, else it would come back with that."""
        for part in self.field.findChildren(QWidget):
            if isinstance(part, TypedLine | TypedText):
                part.flush()
        self.field.asked.emit(RemoveKey(self.row.row.path))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if removes_key(event) and self.remove is not None and self.remove.isEnabled():
            self._remove()
        else:
            super().keyPressEvent(event)

    def _switch(self, key: object) -> None:
        if key != self.row.row.path[-1]:
            self.field.asked.emit(SwitchKey(self.row.row.path, str(key)))

    def show_row(self, row: FormRow) -> None:
        if row != self.row:
            self.refusal = ""
            self.row = row
            self.field.show_row(row)
        self.say()

    def begin(self, row: FormRow) -> None:
        """Show a row of another element: nothing typed, refused or selected in this one stays."""
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
            part.begin_value()
        self.say()

    def say(self) -> None:
        refused = [field.refusal for field in (self.field, *self.field.findChildren(Field)) if field.refusal]
        found = [sentence for sentence in (self.refusal, *refused, *self.row.faults) if sentence]
        times = Counter(found)
        if found or "wrong" in self.__dict__:
            said = (one if count == 1 else f"{count} × {one}" for one, count in times.items())
            self.wrong.sentence.setText("\n".join(said))
            self.wrong.setVisible(bool(found))
        row = self.row.row
        sentences = filter(None, (row.help, self.row.bounds, *found))
        self.field.setAccessibleDescription(" ".join(f"{one.rstrip('.')}." for one in sentences))
        some_missing = isinstance(self.field, LanguagesField) and self.field.some_missing
        for part in self.field.findChildren(QWidget):
            if not isinstance(part, TypedLine | TypedText):
                continue
            part.setAccessibleDescription(self.field.accessibleDescription())
            if not refused:
                blamed = part.focusPolicy() != Qt.FocusPolicy.NoFocus and not (some_missing and part.words())
                part.show_refused(bool(self.row.faults) and blamed)

    def show_repairs(self, known: Mapping[ProblemRow, tuple[str, ...]]) -> None:
        """Offer the repairs of the problems of this row, of each the first; none that reads like another one."""
        path = self.row.row.path
        offered = {one: words for one, words in known.items() if one.fault.path[: len(path)] == path and words}
        if offered == self._offered:
            return
        self._offered = offered
        before, self.repairs = self.repairs, []
        held = next((button.text() for button in before if button.hasFocus()), None)
        several = len(offered) > 1
        asked = [(one, word) for one, words in offered.items() for word in words[: 1 if several else 2]]
        times = Counter(word for _problem, word in asked)
        for problem, word in [(one, word) for one, word in asked if times[word] == 1][:MOST_REPAIRS]:
            made = RepairButton(problem, word)
            made.clicked.connect(lambda _on=False, one=problem, word=word: self.repair_asked.emit(one, word))
            made.typed.connect(self._type)
            name_bars(made)
            self._buttons.addWidget(made, 0, Qt.AlignmentFlag.AlignRight)
            made.show()  # at once: Tab passes what a layout is still to show
            self.repairs.append(made)
        if held is not None and not self.repairs:
            self.field.take_keyboard()
        elif held is not None:  # the same words again, where they are still offered
            min(self.repairs, key=lambda one: one.text() != held).setFocus(Qt.FocusReason.OtherFocusReason)
        for button in before:
            remove_widget(button)

    def _type(self, event: QKeyEvent) -> None:
        """Type a letter into the field."""
        self.field.take_keyboard()
        line = self.window().focusWidget()
        if isinstance(line, TypedLine | TypedText) and self.isAncestorOf(line):
            QCoreApplication.sendEvent(line, event)

    @property
    def help(self) -> str:
        """What the row edits: the description, or the sentence of what is chosen, and what is permitted."""
        row = self.row.row
        shown = row.default if row.value is None else row.value
        sentence = next((choice.sentence for choice in row.choices if choice.value == shown), "")
        reason = f" ({row.reason})" if row.reason else ""
        permitted = f"Permitted: {self.row.bounds}{reason}." if self.row.bounds and not row.choices else ""
        words = " ".join(filter(None, (sentence or row.help, permitted)))
        words = " ".join(words.replace("`", "").split())
        return capitalised(words)


def special_editor_of(row: FormRow) -> SpecialEditor | None:
    """Return the special editor of a row, None where its kind's editor is used."""
    return EDITORS.get((row.row.model, str(row.row.path[-1])))


def is_wide(row: FormRow) -> bool:
    """Return whether the editor of a row takes the width of the form."""
    special = special_editor_of(row)
    return row.row.kind == "paragraphs" if special is None else special.wide


def structure_of(row: FormRow) -> object:
    """Return what makes another editor of a row necessary."""
    special, own = special_editor_of(row), row.row
    inner = own.either[row.number or 0].kind if own.either else ""
    choices = tuple(choice.value for choice in own.choices) if own.kind in {"choice", "choices", "kind"} else ()
    extra = None if special is None else special.structure(row)
    return own.model, own.kind, inner, choices, row.languages, row.removable, row.instead, extra


class LanguageHeads(QWidget):
    """Names of languages above the columns of their texts; ``inset`` is the room left and right [px]."""

    def __init__(self, languages: Iterable[str], inset: tuple[int, int] = (0, 0)) -> None:
        super().__init__()
        heads = ((label(language, "small", "text2"), 1) for language in languages)
        hbox(*heads, spacing=8, margins=(inset[0], 0, inset[1], 0), parent=self)
