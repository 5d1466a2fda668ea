"""The open study as a Qt object, which makes its steps and emits signals about changes."""

import time
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from study_app.designer.document.additions import texts_to_write
from study_app.designer.document.document import Document
from study_app.designer.document.elements import STUDY_LANGUAGES, existing_path
from study_app.designer.document.fields import edits_to_rename, id_at, suggested_id
from study_app.designer.document.steps import (
    AddElement,
    AddLiquid,
    AddNamed,
    DuplicateElement,
    LeaveText,
    MoveElement,
    Recorded,
    RenameElement,
    Request,
    Step,
    StepContext,
    with_path,
)
from study_app.designer.document.study import Entry, Study, is_within
from study_app.designer.document.toml_edits import Edit
from study_app.designer.document.toml_text import Refused
from study_app.protocol.source import Path as Place


class Editing(QObject):
    """The open study; all changes to it and to the selection are made here.

    ``opened_other`` is emitted when another study is opened or the study is closed, ``changed`` when the study or the
    selection changes, ``edited`` when the study changes; ``refused`` carries the path of a rejected request, the
    reason, and the request; ``made`` carries the `Step` of a request, after ``edited``.
    """

    opened_other = Signal()
    changed = Signal()
    edited = Signal()
    refused = Signal(object, str, object)
    made = Signal(object)

    def __init__(self, results: Path, parent: QObject) -> None:
        super().__init__(parent)
        self.results = results
        self.opened: Document | None = None
        self.recorded: Recorded = lambda _element: frozenset()
        self._back: list[Place] = []
        self._added: tuple[Place, str, str] = ((), "", "")

    @property
    def writable(self) -> Document | None:
        return None if self.opened is None or self.opened.read_only else self.opened

    @property
    def selected(self) -> Place:
        """The path of the selected element, () without an open study."""
        return () if self.opened is None else self.opened.selected

    def open(self, opened: Document | None) -> None:
        self.leave_entries()
        self.opened = opened
        if opened is not None:
            opened.end_step()
            opened.to_write = texts_to_write(opened.study) if opened.selected == STUDY_LANGUAGES else ()
        self._back, self._added = [], ((), "", "")
        self.opened_other.emit()

    def select(self, path: Place, *, back: bool = False) -> None:
        opened = self.opened
        if opened is None or (opened.selected == path and path != STUDY_LANGUAGES):
            return
        previous = opened.selected
        self.suggest_id()
        if path == STUDY_LANGUAGES:
            opened.to_write = texts_to_write(opened.study)
        if not back and previous != path:
            self._back.append(opened.selected)
        opened.end_step()
        opened.selected = with_path(path, previous, opened.selected)
        self._keep_selection()
        if not self.leave_entries(opened.selected):
            self.changed.emit()

    def go_back(self) -> None:
        if self._back:
            self.select(self._back.pop(), back=True)

    def _keep_selection(self) -> None:
        if (opened := self.opened) is not None:
            opened.selected = existing_path(opened.study.document, opened.selected)

    def handle_request(self, request: Request) -> None:
        """Apply the step of a request; emit ``refused`` with the reason if it is not possible."""
        opened = self.writable
        if opened is None:
            return
        if isinstance(request, LeaveText):
            self.suggest_id()
            return
        study, selected = opened.study, opened.selected
        try:
            step = request.step(StepContext(study, selected, self.recorded))
            opened.edit(step.title, *step.edits, text=step.text, select=step.select, key=step.continues)
        except Refused as refusal:
            path = getattr(request, "path", opened.selected)
            self.refused.emit(path, f"{str(refusal)[:1].upper()}{str(refusal)[1:]}.", request)
            return
        self._note_entries(opened, request, step, study)
        if step.entry and opened.selected != selected:
            self._back.append(selected)
        if isinstance(request, AddElement | AddNamed | DuplicateElement) and opened.selected == step.entry:
            document, added_path = opened.study.document, opened.selected
            self._added = added_path, id_at(document, added_path), suggested_id(document, added_path)
        self._note_edit()
        self.made.emit(step)

    def _note_entries(self, opened: Document, request: Request, step: Step, before: Study) -> None:
        """Add the entry that a step begins to the unfinished ones, and finish those that do not contain it."""
        entries = opened.study.unfinished
        if isinstance(request, RenameElement | MoveElement):
            entries = with_path(entries, request.path, opened.selected)
        elif step.entry:
            paths: tuple[Place, ...] = (step.entry,)
            if isinstance(request, AddNamed | AddLiquid) and request.path:
                paths = (
                    request.path[:2],
                    step.entry,
                )  # the element that refers to the new one stays unfinished until that is complete
            entries = tuple(entry for entry in entries if any(is_within(path, entry.path) for path in paths))
            known = frozenset((fault.path, fault.message) for fault in before.shown_faults)
            entries += tuple(Entry(path, known) for path in paths if path not in [entry.path for entry in entries])
        elif step.select is not None:
            entries = tuple(entry for entry in entries if is_within(opened.selected, entry.path))
        opened.study = opened.study.with_unfinished(entries)

    def leave_entries(self, selected: Place = (), row: Place = ()) -> bool:
        """Finish entries, showing their problems, except those that contain the selected element or a focused row.

        Return whether an entry was finished.
        """
        if (opened := self.opened) is None:
            return False
        entries = opened.study.unfinished
        inside = (
            is_within(selected, entry.path) or bool(row and (is_within(row, entry.path) or is_within(entry.path, row)))
            for entry in entries
        )
        remaining = entries[: max((count for count, stays in enumerate(inside, start=1) if stays), default=0)]
        if remaining != entries:
            opened.study = opened.study.with_unfinished(remaining)
            self.announce_edit()
        return remaining != entries

    def suggest_id(self) -> None:
        """Derive the ID of the last added element from its text when the text field is left for the first time."""
        path, name, initial = self._added
        if (opened := self.writable) is None or not path or id_at(opened.study.document, path) != name:
            return
        recorded = self.recorded(path)
        new_id = "" if name in recorded else suggested_id(opened.study.document, path, recorded)
        if new_id in {"", initial}:
            return
        self._added = ((), "", "")
        after = path if isinstance(path[-1], int) else (*path[:-1], new_id)
        edits = edits_to_rename(opened.study.document, path, new_id, recorded)
        select = with_path(opened.selected, path, after)
        opened.edit(f"Rename to {new_id}", *edits, select=select, key=opened.last[0])
        opened.study = opened.study.with_unfinished(with_path(opened.study.unfinished, path, after))
        self._note_edit()

    def make_step(self, name: str, *edits: Edit, text: str | None = None, select: Place | None = None) -> None:
        """Apply edits, or replace the text, as one step.

        Raises Refused, leaving the study unchanged, if that is not possible.
        """
        if (opened := self.writable) is not None:
            opened.edit(name, *edits, text=text, select=select)
            self._note_edit()

    def undo(self) -> None:
        if (opened := self.writable) is not None:
            opened.undo()
            self.leave_entries(opened.selected)
            self._note_edit()

    def redo(self) -> None:
        if (opened := self.writable) is not None:
            opened.redo()
            self.leave_entries(opened.selected)
            self._note_edit()

    def _note_edit(self) -> None:
        if self.opened is not None:
            self.opened.note_edit(time.perf_counter())
            self.announce_edit()

    def announce_edit(self) -> None:
        self._keep_selection()
        self.changed.emit()
        self.edited.emit()
