"""The study that is open in the designer: its file, its draft, and the steps that are made in it."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import Final

from PySide6.QtCore import QObject, Signal

from study_app.designer.document.elements import FIRST, first_element, study_title, there
from study_app.designer.document.names import id_at, renamed, suggested_id
from study_app.designer.document.study import History, Study, read
from study_app.designer.document.toml_edits import Edit, Set
from study_app.designer.document.toml_text import Refused
from study_app.designer.new_study.new_study import check_free, copy_of
from study_app.designer.place.file import retyped
from study_app.designer.place.requests import AddElement, AddNamed, LeaveText, Request, RetypeFile, with_path
from study_app.designer.place.steps import Recorded, Step, Steps, no_answers
from study_app.designer.versions.version_rows import Standing, check_saving, standing
from study_app.errors import StoreError
from study_app.protocol.source.document import Path as Place
from study_app.protocol.source.document import value_at
from study_app.protocol.source.files import file_hash, hashes_in, shipped, shipped_file, unbundled, with_liquid_files
from study_app.store.atomic import cannot_write
from study_app.store.drafts import Draft, Keeper, draft_of
from study_app.store.folders import StudyFolder
from study_app.store.sessions.folder_lock import is_open
from study_app.store.study_runs import Run
from study_app.store.study_versions import content_hash, keep_content, save, write_whole

RESTORE: Final = "Restore the draft"
DEFAULT_VERSION: Final = "1"


@dataclass
class OpenStudy:
    """A study that is open in the designer."""

    file: Path  # where it is saved; the file need not exist yet
    history: History  # the study with its steps
    base: str = ""  # hash of the file's content that is edited; "" for a new file
    saved: str = ""  # the text of the file, "" for a new one
    read_only: str = ""  # why it cannot be changed, "" where it can
    draft: Draft | None = None  # the draft that was found when it was opened
    kept: datetime | None = None
    keeper: Keeper = field(init=False)

    def __post_init__(self) -> None:
        self.keeper = Keeper(self.file, self.base)

    @property
    def study(self) -> Study:
        return self.history.study

    @property
    def title(self) -> str:
        """Its title in its first language; "" where it has none."""
        return study_title(self.study.document)

    @property
    def edited(self) -> bool:
        return self.study.text != self.saved

    def note_edit(self, now_s: float) -> None:
        """Let the draft follow an edit; a text that is the file's again needs none."""
        if self.edited or not self.base:
            self.keeper.edited(self.study.text, self.history.selected, now_s)
        else:
            self.keeper.saved(self.base)
            self.kept = None

    def write_draft(self, now_s: float | None = None) -> bool:
        """Write the draft if it is due, without a time at once; return whether it was written."""
        written = self.keeper.write() if now_s is None else self.keeper.write_if_due(now_s)
        if written:
            self.kept = datetime.now().astimezone()
        return written

    def discard_draft(self) -> None:
        """Go back to the file as one step, and forget the draft."""
        self.history = self.history.typed("Discard the draft", self.saved)
        self.keeper.saved(self.base)
        self.draft = self.kept = None

    def give_up(self) -> None:
        self.keeper.saved("")
        self.keeper.write()

    def changed_outside(self) -> bool:
        """Return whether the file has another content than the one that is edited."""
        return content_hash(_content(self.file)) != self.base if self.file.exists() else bool(self.base)

    def take_outside(self) -> None:
        content = _content(self.file)
        self.saved = read(content, self.file.parent).text
        self.rebase(content_hash(content))
        self.history = self.history.typed("Take the file's content", self.saved)
        self.keeper.saved(self.base)
        self.kept = None

    def keep_mine(self, now_s: float) -> None:
        content = _content(self.file) if self.file.exists() else b""
        self.saved = content.decode("utf-8", "replace")
        self.rebase(content_hash(content) if self.file.exists() else "")
        self.note_edit(now_s)

    @property
    def name(self) -> str:
        """The name of the study, which its results folder has, too."""
        return str(value_at(self.study.document, ("study", "name")) or "")

    @property
    def version(self) -> str:
        """The version that the study states, or the one that counts where it states none."""
        stated = value_at(self.study.document, ("study", "version"))
        return str(stated) if stated is not None else DEFAULT_VERSION

    def source(self) -> bytes:
        """Return what a session would be run with: the text, and the liquid files that it names."""
        return with_liquid_files(self.study.text.encode(), self.study.folder)

    def standing(self, known: tuple[Run, ...]) -> Standing:
        """Return how the study stands to what was run."""
        if not any(run.sessions for run in known):
            return standing("", "", self.version, known)
        file = with_liquid_files(self.saved.encode(), self.study.folder)
        base = content_hash(file) if self.base else ""
        return standing(content_hash(self.source()), base, self.version, known)

    def save(self, known: tuple[Run, ...]) -> None:
        """Write the file, and keep what sessions will be run with."""
        source = self.source()
        check_saving(content_hash(source), self.version, known)
        self._bring_files(source)
        keep_content(source)
        self.base = save(self.file, self.study.text, self.base)
        self.saved = self.study.text
        self.keeper.saved(self.base)
        self.kept = self.draft = None

    def _bring_files(self, source: bytes) -> None:
        """Write the files that the study names into its own folder, where it was copied from another one."""
        folder = self.file.resolve().parent
        if self.study.folder.resolve() == folder:
            return
        for name, text in unbundled(source)[1].items():
            path = folder / name
            if path.exists() and _content(path) != text.encode():
                raise Refused(f"{path} exists and holds another liquid: rename one of the two files")
            write_whole(path, text.encode())
        for name, digest in hashes_in(source).items():
            if (there := file_hash(folder / name)) is None:
                _copy(self.study.folder / name, folder / name)
            elif there != digest:
                raise Refused(f"{folder / name} exists and holds another video: rename one of the two files")
        self.history = replace(self.history, study=replace(self.study, folder=folder))

    def saved_as(self, name: str) -> OpenStudy:
        """Return the study with its edits under another name, as one step; this one goes back to its file."""
        file = check_free(name)
        made = OpenStudy(file, self.history.typed(f"Save as {name}", copy_of(self.study, name).text))
        made.note_edit(0.0)
        made.write_draft()
        self.discard_draft()
        return made

    def set_version(self, version: str) -> None:
        """Give the study another version, as one step."""
        self.history = self.history.edited(f"Set version {version}", Set(("study", "version"), version))

    def rebase(self, base: str) -> None:
        self.base = self.keeper.base = base


def open_file(file: Path, results: Path) -> OpenStudy:
    """Open a study's file, with the draft of it that was not saved."""
    content = _content(file)
    study = read(content, file.parent)
    opened = OpenStudy(file, History(study, first_element(study.document)), content_hash(content), study.text)
    opened.read_only = why_read_only(opened, results)
    return opened if opened.read_only else _with_draft(opened)


def open_new(study: Study, name: str) -> OpenStudy:
    """Open a copy of a study under another name; nothing is written before it is saved."""
    file = check_free(name)
    made = copy_of(study, name)
    return OpenStudy(file, History(made, first_element(made.document)))


def open_unsaved(file: Path, draft: Draft) -> OpenStudy:
    """Open a study that was never saved, from its draft."""
    opened = OpenStudy(file, History(Study(draft.text, file.parent), draft.selected or FIRST), draft=draft)
    opened.keeper.take(draft)
    return opened


def _with_draft(opened: OpenStudy) -> OpenStudy:
    draft = draft_of(opened.file)
    if draft is None:
        return opened
    opened.keeper.take(draft)
    if draft.text != opened.saved:
        opened.draft = draft
        opened.history = opened.history.typed(RESTORE, draft.text)
        if draft.selected and value_at(opened.study.document, draft.selected) is not None:
            opened.history = replace(opened.history, selected=draft.selected)
        opened.rebase(draft.base)
    return opened


def why_read_only(opened: OpenStudy, results: Path) -> str:
    """Return why a study cannot be changed at this moment, "" where it can."""
    file = opened.file.resolve()
    if any(file == shipped_file(name).resolve() for name in shipped()):
        return "This study ships with the program. Make a copy to change it."
    if opened.file.exists() and not os.access(opened.file, os.W_OK):
        return "You may not write this file. Make a copy to change it."
    if any(is_open(session.path) for session in StudyFolder(results / opened.name).sessions()):
        return "A session of this study is under way. Make a copy, or wait until it has ended."
    return ""


def _copy(file: Path, to: Path) -> None:
    try:
        to.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, to)
    except OSError as error:
        raise cannot_write(to, error) from error


def _content(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError as error:
        raise StoreError(f"{file} cannot be read: {error.strerror}") from error


JOIN_S: Final = 1.0  # typing in one field is one step until the keyboard rests for so long


class Editing(QObject):
    """The open study: every change of it and of its selection is made here.

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
        if (opened := self.writable) is not None:
            self._take(opened, opened.history.edited(words, *edits, select=select))
            self._note()

    def type_text(self, words: str, text: str) -> None:
        if (opened := self.writable) is not None:
            self._type(opened, words, text)
            self._note()

    def undo(self) -> None:
        self._travel(History.undo)

    def redo(self) -> None:
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
