"""A list whose entries are selected by mouse and keys: moved, copied and removed together, as one step."""

from collections.abc import Iterable

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QBoxLayout

from study_app.gui.designer.form.entry_row import EntryRow
from study_app.gui.designer.form.row_fields import Field
from study_app.viewmodels.designer.form.form_rows import FormRow
from study_app.viewmodels.designer.requests import DuplicateEntries, MoveEntries, Paste, RemoveKey, Request, Several


class EntryList(Field):
    """Entries in rows.

    A click selects an entry, with Shift or Ctrl several; so do the arrow keys, with Shift. What is selected is moved by
    Alt and the arrows or by a drag, removed by Delete, copied by Ctrl+D, and put on the clipboard by Ctrl+C.

    ``changes`` carries a request and the indexes of the entries that are selected after it.
    """

    changes = Signal(object, object)

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.box.setSpacing(6)
        self.rows: list[EntryRow] = []
        self.chosen: tuple[int, ...] = ()
        self._anchor = 0
        self._target: int | None = None

    def show_value(self) -> None:
        """Do nothing: other entries make another field."""

    def add_row(self, shown: EntryRow) -> None:
        """Add the row of an entry below the others."""
        at = len(self.rows)
        shown.pressed.connect(lambda extends, toggles: self._press(at, extends=extends, toggles=toggles))
        shown.clicked.connect(lambda: self.choose((at,), focus=at))
        shown.stepped.connect(lambda by, extends: self._step(at + by, extends=extends))
        shown.moved.connect(lambda by: self._move_by(at, by))
        shown.dragged.connect(lambda y: self._drag(at, y))
        shown.dropped.connect(lambda: self._drop(at))
        shown.remove_asked.connect(lambda: self.remove(self._together(at)))
        shown.duplicate_asked.connect(lambda: self._duplicate(self._together(at)))
        shown.copy_asked.connect(lambda: self.copy(self._together(at)))
        shown.pasted.connect(lambda text: self.paste(at, text))
        self.rows.append(shown)
        self.box.addWidget(shown)

    def place(self, at: int) -> tuple[str | int, ...]:
        """Return the place of an entry in the study."""
        return (*self.row.row.path, at)

    # selection

    def choose(self, indexes: Iterable[int], focus: int | None = None) -> None:
        """Select entries together; ``focus`` takes the keyboard."""
        self.chosen = tuple(sorted(at for at in set(indexes) if 0 <= at < len(self.rows)))
        for at, row in enumerate(self.rows):
            row.show_chosen(at in self.chosen, len(self.chosen))
        if focus is not None and 0 <= focus < len(self.rows):
            self.rows[focus].setFocus(Qt.FocusReason.OtherFocusReason)
        if len(self.chosen) == 1:
            self._anchor = self.chosen[0]

    def take_keyboard(self) -> None:
        """Give the keyboard to the first selected entry, else to the editor."""
        if self.chosen:
            self.rows[self.chosen[0]].setFocus(Qt.FocusReason.OtherFocusReason)
        else:
            super().take_keyboard()

    def _press(self, at: int, *, extends: bool, toggles: bool) -> None:
        if extends:
            self.choose(range(min(at, self._anchor), max(at, self._anchor) + 1))
        elif toggles:
            self.choose(set(self.chosen) ^ {at})
            self._anchor = at
        elif at not in self.chosen:
            self.choose((at,))

    def _step(self, to: int, *, extends: bool) -> None:
        if 0 <= to < len(self.rows):
            self._press(to, extends=True, toggles=False) if extends else self.choose((to,))
            self.rows[to].setFocus(Qt.FocusReason.OtherFocusReason)

    def _together(self, at: int) -> tuple[int, ...]:
        """Return the entries that an entry stands for: all that are selected where it is one of them."""
        return self.chosen if at in self.chosen else (at,)

    # steps

    def _move_by(self, at: int, by: int) -> None:
        indexes = self._together(at)
        self.move_entries(indexes, min(indexes) + by if by < 0 else max(indexes) + 1 + by)

    def move_entries(self, indexes: tuple[int, ...], to: int) -> None:
        """Ask to move entries before the one at ``to``."""
        first = to - sum(index < to for index in indexes)
        after = tuple(range(first, first + len(indexes)))
        if 0 <= to <= len(self.rows) and after != indexes:
            self.changes.emit(MoveEntries(tuple(self.place(index) for index in indexes), to), after)

    def remove(self, indexes: tuple[int, ...]) -> None:
        """Ask to remove entries, the last first."""
        gone: tuple[Request, ...] = tuple(RemoveKey(self.place(index)) for index in reversed(indexes))
        words = f"Remove {len(gone)} entries of {self.row.row.label}"
        near = min(indexes[0], len(self.rows) - len(indexes) - 1)
        self.changes.emit(gone[0] if len(gone) == 1 else Several(words, gone), () if near < 0 else (near,))

    def _duplicate(self, indexes: tuple[int, ...]) -> None:
        if self.row.row.kind != "references":  # a name that is listed twice is a fault
            after = tuple(index + rank for rank, index in enumerate(indexes, start=1))
            self.changes.emit(DuplicateEntries(tuple(self.place(index) for index in indexes)), after)

    def copy(self, indexes: tuple[int, ...]) -> None:
        """Ask to put entries on the clipboard."""
        self.copy_asked.emit(tuple(self.place(index) for index in indexes))

    def paste(self, at: int, text: str) -> None:
        """Ask to paste a text after an entry."""
        self.asked.emit(Paste(self.place(at), text))

    # dragging

    def _drag(self, at: int, y: int | None) -> None:
        """Show where the dragged entries would come; None cancels."""
        if at not in self.chosen:
            self.choose((at,))
        self._target = None if y is None else sum(row.geometry().center().y() < y for row in self.rows)
        self.update()

    def _drop(self, at: int) -> None:
        target, self._target = self._target, None
        self.update()
        if target is not None:
            self.move_entries(self._together(at), target)

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self._target is not None and self.rows:
            last = self._target == len(self.rows)
            row = self.rows[-1 if last else self._target].geometry()
            y = row.bottom() + 3 if last else row.top() - 3
            QPainter(self).fillRect(QRectF(0, y - 1, self.width(), 2), QColor(self.rows[0].theme.accent))
