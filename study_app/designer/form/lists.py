"""Lists in the form; moving, copying or removing an entry is one step."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from PySide6.QtCore import QEvent, QSize, Qt, Signal
from PySide6.QtGui import QDropEvent, QFocusEvent, QKeyEvent, QKeySequence, QResizeEvent
from PySide6.QtWidgets import QAbstractItemView, QBoxLayout, QFrame, QListWidget, QListWidgetItem, QWidget

from study_app.designer.document.elements import title_of
from study_app.designer.document.steps import (
    AddElement,
    AddEntry,
    ChangeLanguage,
    Do,
    DuplicateElement,
    MoveTo,
    RemoveKey,
    Request,
    SetValue,
)
from study_app.designer.document.study import Study
from study_app.designer.form.fields import Field, SpecialEditor, TypedLine, add_button, kept_value_sentence, typed_value
from study_app.designer.form.rows import FormRow
from study_app.designer.measures.cards import UNKNOWN
from study_app.designer.measures.study_facts import valid_part
from study_app.designer.parts import FIELD_PX, KeysOpenList, cut_text, make_dense, small_button
from study_app.gui.kit import keys_of, with_key
from study_app.gui.theme import name_scroll_bars
from study_app.gui.widgets import STRETCH, ActionButton, Elided, IconButton, add_layout, figures, hbox, label
from study_app.haptics.model.slope_limits import HAND_MPS, steady_force
from study_app.number_text import typed_numbers
from study_app.protocol.source import Path

_CAPTION: Final = f"force at a hand speed of {HAND_MPS:g} m/s"


@dataclass(frozen=True, slots=True)
class _ConditionLine:
    """One condition of a block."""

    liquid: Path | None  # the path of its liquid; None if it has several, or is not in the study
    note: str  # its liquid if the name differs, and the visual delay
    force: str  # its force with unit, "–" if unknown
    clipped: bool = False  # whether a limit clips the force


def _condition_line(study: Study, name: Any) -> _ConditionLine:
    document = study.document
    conditions, liquids = document.get("conditions", {}), document.get("liquids", {})
    table = conditions.get(name) if isinstance(conditions, Mapping) and isinstance(name, str) else None
    if not isinstance(table, Mapping):
        return _ConditionLine(None, "not in the study", UNKNOWN)
    liquid_id = table.get("liquid")
    known = isinstance(liquid_id, str) and isinstance(liquids, Mapping) and liquid_id in liquids
    liquid: Path | None = ("liquids", str(liquid_id)) if known else None
    liquid_ids = table.get("liquids")
    details = [title_of(document, liquid)] if liquid is not None and liquid_id != name else []
    if isinstance(liquid_ids, tuple):
        details.append(f"{len(liquid_ids)} liquids")
    delay_ms = table.get("delay_ms", 0)
    if isinstance(delay_ms, int | float):
        details.append(f"{delay_ms:g} ms late")
    valid_study_part = valid_part(study)
    protocol = valid_study_part.protocol if valid_study_part.forces else None
    if protocol is None or liquid is None or name not in protocol.conditions:
        return _ConditionLine(liquid, ", ".join(details), UNKNOWN)
    force = steady_force(protocol.scene_for(str(name)))
    return _ConditionLine(liquid, ", ".join(details), f"{force.force_n:.2f} N", force.limit is not None)


RIGHT: Final = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter


class _EntryListWidget(QListWidget):
    """A list widget as high as its entries.

    ``keys`` are its shortcuts; ``dropped`` carries the index before which dragged entries were dropped.
    """

    dropped = Signal(int)

    def __init__(self) -> None:
        super().__init__()
        self.keys: dict[str, Callable[[], object]] = {}
        self.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setResizeMode(QListWidget.ResizeMode.Adjust)
        self.setSpacing(2)
        self.setFrameShape(QFrame.Shape.NoFrame)

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent) and self._action_for(event):
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        action = self._action_for(event)
        action() if action else super().keyPressEvent(event)

    def _action_for(self, event: QKeyEvent) -> Callable[[], object] | None:
        modifiers = event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
        return self.keys.get(QKeySequence(event.key() | modifiers.value).toString())

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        if event.reason() != Qt.FocusReason.MouseFocusReason and not self.selectedIndexes():
            self.setCurrentRow(max(0, self.currentRow()))  # shows where the focus is

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.doItemsLayout()  # otherwise the rows keep their old width

    def dropEvent(self, event: QDropEvent) -> None:
        """Emit the index before which entries were dropped; the study, not Qt, moves them."""
        position = event.position().toPoint()
        index = self.indexAt(position)
        is_below = position.y() > self.visualRect(index).center().y()
        event.setDropAction(Qt.DropAction.IgnoreAction)
        self.dropped.emit(index.row() + is_below if index.isValid() else self.count())


class EntryRow(QFrame):
    """An entry of a list: a frame with its parts in a row."""

    def __init__(self, name: str, parts: Iterable[QWidget | tuple[QWidget, int]], *, faulty: bool) -> None:
        super().__init__()
        self.setProperty("role", "entry")
        self.setProperty("state", "refused" if faulty else "")
        self.setAccessibleName(name)
        self.setFixedHeight(FIELD_PX + 2)
        self.line = hbox(*parts, spacing=2, margins=(12, 0, 2, 0), parent=self)

    def add_button(self, icon: str, name: str, on_click: Callable[[], object], action: str = "") -> IconButton:
        button = IconButton(icon, name, with_key(name, action) if action else "", size=FIELD_PX - 2, role="plain")
        if action:
            button.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        button.clicked.connect(on_click)
        self.line.addWidget(button)
        return button


class EntryList(Field):
    """A list of entries; its rows are recreated only if they change, and keep selection and focus."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.box.setSpacing(6)
        self.ordered = row.kind != "tables"
        self.rows: list[EntryRow] = []
        self._selected_after_step: int | None = None
        self._shown_state: object = None
        self.list = _EntryListWidget()
        self.list.setAccessibleName(row.label)
        self.list.dropped.connect(lambda to: self.move_entry(self.chosen, to))
        self.list.itemDoubleClicked.connect(lambda item: self.open_entry(self.list.row(item)))
        self.list.keys = {"Return": self._open_current, "Enter": self._open_current}
        if self.ordered:
            self.list.setDragDropMode(QAbstractItemView.DragDropMode.InternalMove)
            self.list.keys |= {"Alt+Up": lambda: self.move_entry(self.chosen, self.chosen - 1),
                               "Alt+Down": lambda: self.move_entry(self.chosen, self.chosen + 2),
                               "Del": lambda: self.remove_entry(self.chosen), "Ctrl+D": self._duplicate}  # fmt: skip
            self.list.setAccessibleDescription("Alt+Up and Alt+Down move an entry; Delete removes it")
        else:
            self.list.itemClicked.connect(lambda item: self.open_entry(self.list.row(item)))
        self.box.addWidget(self.list)

    def entries_state(self) -> object:
        """Return the state of the entries that, when it changes, requires new rows."""
        return self.row.entries

    def fill_rows(self) -> None:
        raise NotImplementedError

    def show_value(self) -> None:
        if self._shown_state == (state := self.entries_state()):
            return
        self._shown_state, focused = state, self.window().focusWidget()
        focus_inside = focused is not None and focused is not self.list and self.list.isAncestorOf(focused)
        chosen, self._selected_after_step = (
            self.chosen if self._selected_after_step is None else self._selected_after_step,
            None,
        )
        if focus_inside:
            focused.clearFocus()
        self.rows = []
        self.list.clear()
        self.fill_rows()
        self.list.setFixedHeight(len(self.rows) * (FIELD_PX + 6) + 4)
        self.list.setFocusPolicy(Qt.FocusPolicy.StrongFocus if self.rows else Qt.FocusPolicy.NoFocus)
        if 0 <= chosen < len(self.rows):
            self.list.setCurrentRow(chosen)
        name_scroll_bars(self.list)
        if focus_inside or (focused is self.list and not self.rows):
            self.take_keyboard()

    def add_row(self, name: str, *parts: QWidget | tuple[QWidget, int], faulty: bool = False) -> EntryRow:
        entry_row, item = EntryRow(name, parts, faulty=faulty), QListWidgetItem(self.list)
        item.setData(Qt.ItemDataRole.AccessibleTextRole, name)
        item.setSizeHint(QSize(0, FIELD_PX + 2))
        self.list.setItemWidget(item, entry_row)
        self.rows.append(entry_row)
        return entry_row

    def make_read_only(self) -> None:
        """Make the list read-only; entries can still be opened."""
        self.list.setDragEnabled(False)
        self.list.setAccessibleDescription("")
        self.list.keys = {keys: action for keys, action in self.list.keys.items() if keys in {"Return", "Enter"}}

    @property
    def chosen(self) -> int:
        """The index of the selected entry, -1 without a selection."""
        return next((index.row() for index in self.list.selectedIndexes()), -1)

    def take_keyboard(self) -> None:
        (self if self.chosen < 0 else self.list).setFocus(Qt.FocusReason.OtherFocusReason)

    def entry_path(self, index: int) -> tuple[str | int, ...]:
        return self.row.entries[index].path if self.row.entries else (*self.row.path, index)

    def open_entry(self, index: int) -> None:
        if 0 <= index < len(self.row.entries) and (target := self.row.entries[index].target):
            self.asked.emit(Do("select", (target,)))

    def _open_current(self) -> None:
        self.open_entry(self.list.currentRow())

    def _request_step(self, request: Request, after: int) -> None:
        """Request a step, and select the entry with the index ``after`` when it is done."""
        self._selected_after_step = after
        self.asked.emit(request)
        self._selected_after_step = None

    def move_entry(self, index: int, to: int) -> None:
        """Request to move an entry before the one at ``to``."""
        after = to - (index < to)
        if index >= 0 and 0 <= to <= len(self.rows) and after != index:
            self._request_step(MoveTo(self.entry_path(index), to, stays=True), after)

    def remove_entry(self, index: int) -> None:
        if index >= 0:
            self._request_step(RemoveKey(self.entry_path(index)), min(index, len(self.rows) - 2))

    def _duplicate(self) -> None:
        if self.chosen >= 0 and self.row.kind != "references":  # a list must not contain a name twice
            self._request_step(DuplicateElement(self.entry_path(self.chosen), stays=True), self.chosen + 1)


class _AdditionList(KeysOpenList):
    """A list of possible additions without a current choice; ``chosen`` carries the value of an entry."""

    chosen = Signal(object)

    def __init__(self, name: str, placeholder: str) -> None:
        super().__init__()
        make_dense(self, name)
        self.setPlaceholderText(placeholder)
        self.setMinimumContentsLength(12)  # a form is narrower than the longest description of a liquid
        self.setSizeAdjustPolicy(self.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.activated.connect(self._choose_at)

    def show_items(self, items: Iterable[tuple[str, Any]]) -> None:
        self.clear()
        for name, data in items:
            self.addItem(name, data)
        self.setEnabled(bool(self.count()))

    def _choose_at(self, index: int) -> None:
        self.setCurrentIndex(-1)
        self.chosen.emit(self.itemData(index))


class EntriesField(EntryList):
    """References, tables in a list, or tables by name."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        name = f"Add to {row.label}"
        self.names = _AdditionList(name, "Add…") if row.kind == "references" or row.additions else None
        if self.names is not None:
            self.names.chosen.connect(self.asked)
            self.add: QWidget = self.names
        else:
            self.add = add_button(name, "Add")
            self.add.clicked.connect(lambda: self.asked.emit(AddElement(self.row.path)))
        add_layout(self.box, hbox(self.add, STRETCH))
        self.setFocusProxy(self.add)
        self.show_value()

    def show_value(self) -> None:
        super().show_value()
        if self.names is not None:
            self.names.show_items(self.row.additions)

    def fill_rows(self) -> None:
        label, count = self.row.label, len(self.row.entries)
        for index, entry in enumerate(self.row.entries):
            title = cut_text(entry.title, "label", "bad" if entry.faults else "text")
            entry_row = self.add_row(
                f"{label}, {entry.title}, {index + 1} of {count}", (title, 1), faulty=bool(entry.faults)
            )
            self.add_note(entry_row, index)
            if self.ordered:
                for offset, icon, direction in ((-1, "arrow_up", "up"), (1, "arrow_down", "down")):
                    move = partial(self.move_entry, index, index - 1 if offset < 0 else index + 2)
                    entry_row.add_button(icon, f"Move {entry.title} {direction}", move, direction).setEnabled(
                        0 <= index + offset < count
                    )
            action = "open entry" if self.ordered else ""
            open_button = entry_row.add_button(
                "arrow_right", f"Open {entry.title}", partial(self.open_entry, index), action
            )
            open_button.setEnabled(bool(entry.target))
            if self.ordered:
                entry_row.add_button(
                    "cross", f"Remove {entry.title} from {label}", partial(self.remove_entry, index), "delete"
                )

    def add_note(self, entry_row: EntryRow, index: int) -> None:
        entry = self.row.entries[index]
        if entry.note and entry.note.replace("_", " ") != entry.title.lower():
            note = cut_text(entry.note, "small", "text2", right=True)
            entry_row.line.addWidget(note)


class _ConditionsField(EntriesField):
    """The conditions of a block, each with its liquid, delay and force."""

    caption = _CAPTION

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.list.keys[keys_of("open liquid")[0]] = lambda: self._open_liquid(self.list.currentRow())

    def _open_liquid(self, index: int) -> None:
        if 0 <= index < len(self.row.facts) and (liquid := self.row.facts[index].liquid):
            self.asked.emit(Do("select", (liquid,)))

    def entries_state(self) -> object:
        return self.row.entries, self.row.facts

    def add_note(self, entry_row: EntryRow, index: int) -> None:
        line = self.row.facts[index]
        note, force = Elided("small", "text2"), figures(f"{line.force}, clipped" if line.clipped else line.force)
        note.show_text(line.note)
        force.setMinimumWidth(52)
        for part in (note, force):
            part.setAlignment(RIGHT)
            entry_row.line.addWidget(part)
        name = f"Open the liquid used in {self.row.entries[index].title}"
        entry_row.add_button("drop", name, partial(self._open_liquid, index), "open liquid").setEnabled(
            bool(line.liquid)
        )


class LinesField(EntryList):
    """Texts or points, one per line, with a button that adds a line."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.lines: list[TypedLine] = []
        self.add = add_button(f"Add to {row.label}")
        self.add.clicked.connect(lambda: self.asked.emit(AddEntry(self.row.path)))
        self.box.addWidget(self.add, 0, Qt.AlignmentFlag.AlignLeft)
        self.show_value()

    def entries_state(self) -> object:
        return len(self.row.value or ())

    def fill_rows(self) -> None:
        self.lines, row = [], self.row
        count = len(row.value or ())
        for index in range(count):
            line = TypedLine(f"{row.label} {index + 1}")
            line.typed.connect(partial(self._submit_line, index))
            line.focused.connect(self.focused)
            entry_row = self.add_row(f"{row.label} {index + 1} of {count}", (line, 1))
            entry_row.add_button(
                "cross", f"Remove {line.accessibleName()}", partial(self.remove_entry, index), "delete"
            )
            self.lines.append(line)
        self.setFocusProxy(self.lines[0] if self.lines else self.add)

    def show_value(self) -> None:
        super().show_value()
        for line, value in zip(self.lines, self.row.value or (), strict=False):
            if not (self.refusal and line.property("state")):
                line.show_text(typed_value(value))

    def _value_of(self, text: str) -> Any:
        return text if self.row.kind == "texts" else [number for _, number in typed_numbers(text)]

    def _submit_line(self, index: int, text: str) -> None:
        self.refusal, value = "", None
        try:
            value = self._value_of(text)
        except ValueError as unclear:
            self.refusal = f"{unclear}. {kept_value_sentence(self.row.value[index])}"
        self.lines[index].show_refused(bool(self.refusal))
        self.focused.emit()
        if not self.refusal:
            self.asked.emit(SetValue((*self.row.path, index), value, typing=True))


class LanguageListField(EntryList):
    """The languages and their missing texts; a language is added to or removed from every text."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.make_read_only()
        self.copies: dict[str, ActionButton] = {}
        self.names = _AdditionList("Add a language to every text", "Language…")
        self.names.chosen.connect(lambda code: self.asked.emit(ChangeLanguage("add", code)))
        self.box.addWidget(self.names, 0, Qt.AlignmentFlag.AlignLeft)
        self.setFocusProxy(self.names)
        self.show_value()

    def fill_rows(self) -> None:
        row, self.copies = self.row, {}
        codes = [str(code) for code in row.value] if isinstance(row.value, tuple) else []
        first = row.entries[0].title if row.entries else ""
        for index, (code, entry) in enumerate(zip(codes, row.entries, strict=True)):
            title = label(entry.title, "label", "bad" if entry.faults else "text")
            note = cut_text(entry.note, right=True)
            note.setMinimumWidth(note.fontMetrics().horizontalAdvance(entry.note.partition(",")[0]) + 2)
            description = f"{entry.title}, {entry.note}, {index + 1} of {len(codes)}"
            entry_row = self.add_row(description, title, note, faulty=bool(entry.faults))
            if entry.target:
                write_button = small_button("", "Write…", height=32)
                write_button.setAccessibleName(f"Write the texts that are missing in {entry.title}")
                write_button.clicked.connect(partial(self.open_entry, index))
                entry_row.line.addWidget(write_button)
            if entry.faults and index:
                copy_button = self.copies[code] = add_button(
                    f"Copy the {first} text wherever {entry.title} is missing", f"Copy {first}"
                )
                copy_button.clicked.connect(partial(self.asked.emit, ChangeLanguage("copy", code)))
                entry_row.line.addWidget(copy_button)
            if len(codes) > 1:
                name = f"Remove {entry.title} from every text"
                entry_row.add_button("cross", name, partial(self.asked.emit, ChangeLanguage("remove", code)))
        self.names.show_items((choice.sentence, choice.value) for choice in row.choices if choice.value not in codes)


CONDITIONS: Final = SpecialEditor(
    (("Block", "conditions"),), _ConditionsField, wide=True,
    facts=lambda study, row: tuple(
        _condition_line(study, name) for name in (row.value if isinstance(row.value, tuple) else ())
    ),
)  # fmt: skip
