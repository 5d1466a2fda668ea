"""The study that is open in the designer, and the steps that are made in it."""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Final

from PySide6.QtCore import QObject, Signal

from study_app.designer.document.edited_study import Study
from study_app.designer.document.names import id_at, renamed, suggested_id
from study_app.designer.document.undo_stack import History
from study_app.designer.document.writer.edits import Edit
from study_app.designer.document.writer.refused import Refused
from study_app.designer.new_study.known_studies import there
from study_app.designer.place.edit_steps import Recorded, Steps, no_answers
from study_app.designer.place.element_steps import Step
from study_app.designer.place.file_text import retyped
from study_app.designer.place.open_study import OpenStudy
from study_app.designer.place.requests import AddElement, AddNamed, LeaveText, Request, RetypeFile, with_path
from study_app.protocol.source.document import Path as Place

JOIN_S: Final = 1.0  # typing in one field is one step until the keyboard rests for so long


class Editing(QObject):
    """The open study: every change of it and of its selection is made here.

    Parameters
    ----------
    results
        Folder that holds the studies' results folders.

    ``opened_other`` is emitted when another study is open, or none, ``changed`` after each step of the study or of its
    selection, ``edited`` after each step of the study alone; ``refused`` carries the path that a refused request
    concerns, the sentence that says why, and the request; ``made`` the `Step` of a request, after ``edited``.
    """

    opened_other = Signal()
    changed = Signal()
    edited = Signal()
    refused = Signal(object, str, object)
    made = Signal(object)

    def __init__(self, results: Path, parent: QObject) -> None:
        super().__init__(parent)
        self.results = results
        self.opened: OpenStudy | None = None
        self.recorded: Recorded = no_answers
        self._steps = Steps()
        self._last: tuple[object, float, Study | None] = (None, 0.0, None)
        self._back: list[Place] = []
        self._made: Step | None = None
        self._added: tuple[Place, str, str] = ((), "", "")

    @property
    def writable(self) -> OpenStudy | None:
        """The open study, None where there is none or it is read-only."""
        return None if self.opened is None or self.opened.read_only else self.opened

    @property
    def selected(self) -> Place:
        """The path of the selected element, () where no study is open."""
        return () if self.opened is None else self.opened.history.selected

    def open(self, opened: OpenStudy | None) -> None:
        """Take another study from now on, None for none."""
        self.opened = opened
        self._steps, self._last, self._back = Steps(self.recorded), (None, 0.0, None), []
        self._added = ((), "", "")
        self.opened_other.emit()

    # selection

    def select(self, path: Place, *, back: bool = False) -> None:
        """Select an element."""
        opened = self.opened
        if opened is None or opened.history.selected == path:
            return
        before = opened.history.selected
        self.suggest_id()
        path = with_path(path, before, opened.history.selected)
        if not back:
            self._back.append(opened.history.selected)
        self._steps.leave()
        self._last = (None, 0.0, None)
        opened.history = replace(opened.history, selected=path)
        self.keep_selection()
        self.changed.emit()

    def go_back(self) -> None:
        """Select what was selected before."""
        if self._back:
            self.select(self._back.pop(), back=True)

    def keep_selection(self) -> None:
        """Select the nearest element that exists."""
        if (opened := self.opened) is not None:
            selected = there(opened.study.document, opened.history.selected)
            opened.history = replace(opened.history, selected=selected)

    # steps

    def ask(self, asked: Request) -> None:
        """Make a step as a view asks for it; ``refused`` says why where it cannot be made."""
        opened = self.writable
        if opened is None:
            return
        if isinstance(asked, LeaveText):
            self.suggest_id()
            return
        try:
            if isinstance(asked, RetypeFile):
                text = retyped(opened.study.text, asked.text)
                if text == opened.study.text:
                    return
                self._type(opened, "Edit the file", text, "file")
            else:
                self._make(opened, self._steps.step(opened.study, asked, opened.history.selected))
                if isinstance(asked, AddElement | AddNamed):
                    document, added = opened.study.document, opened.history.selected
                    self._added = added, id_at(document, added), suggested_id(document, added)
        except Refused as refusal:
            path = asked.path if hasattr(asked, "path") else opened.history.selected
            self.refused.emit(path, f"{str(refusal)[:1].upper()}{str(refusal)[1:]}.", asked)
            return
        self._note()
        if (step := self._made) is not None:
            self._made = None
            self.made.emit(step)

    def _make(self, opened: OpenStudy, step: Step) -> None:
        history = opened.history.typed(step.words, step.text) if step.text else opened.history
        joins = bool(step.text) or self._joins(step.continues)
        self._take(opened, history.edited(step.words, *step.edits, select=step.select, joins=joins), step.continues)
        self._made = step

    def _type(self, opened: OpenStudy, words: str, text: str, key: object = None) -> None:
        history = opened.history.typed(words, text, joins=self._joins(key))
        self._take(opened, history, key)

    def suggest_id(self) -> None:
        """Give the element that was added last the id of its text, once: when its text is left."""
        path, name, initial = self._added
        if (opened := self.writable) is None or not path or id_at(opened.study.document, path) != name:
            return
        recorded = self.recorded(path)
        wanted = "" if name in recorded else suggested_id(opened.study.document, path, recorded)
        if wanted in {"", initial}:
            return
        self._added = ((), "", "")
        after = path if isinstance(path[-1], int) else (*path[:-1], wanted)
        edits = renamed(opened.study.document, path, wanted, recorded)
        select = with_path(opened.history.selected, path, after)
        joins = self._joins(self._last[0])
        self._take(opened, opened.history.edited(f"Rename to {wanted}", *edits, select=select, joins=joins))
        self._note()

    def _joins(self, key: object) -> bool:
        """Return whether an edit continues the last step: of the same key, made here, not long ago."""
        before, then, study = self._last
        same = self.opened is not None and self.opened.study is study
        return key is not None and key == before and same and time.monotonic() - then < JOIN_S

    def _take(self, opened: OpenStudy, history: History, key: object = None) -> None:
        """Take the history after a step, which edits of the same key may continue; an edit without effect is none."""
        if history.study is not opened.history.study:
            self._last = (key, time.monotonic(), history.study)
        opened.history = history

    def make(self, words: str, *edits: Edit, select: Place | None = None) -> None:
        """Make a step of edits.

        Raises
        ------
        Refused
            The step cannot be made; nothing is changed.
        """
        if (opened := self.writable) is not None:
            self._take(opened, opened.history.edited(words, *edits, select=select))
            self._note()

    def type_text(self, words: str, text: str) -> None:
        """Give the file another text, as a step of its own."""
        if (opened := self.writable) is not None:
            self._type(opened, words, text)
            self._note()

    def undo(self) -> None:
        """Undo the last step."""
        self._travel(History.undo)

    def redo(self) -> None:
        """Redo the step that was undone last."""
        self._travel(History.redo)

    def _travel(self, to: Callable[[History], History]) -> None:
        if (opened := self.writable) is not None:
            self._take(opened, to(opened.history))
            self._note()

    def _note(self) -> None:
        if self.opened is not None:
            self.opened.note_edit(time.monotonic())
            self.announce()

    def announce(self) -> None:
        """Let every view show the study as it is now."""
        self.keep_selection()
        self.changed.emit()
        self.edited.emit()
