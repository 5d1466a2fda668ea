"""One open study: its file, its history, its draft, and saving."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Final

from study_app.authoring.drafts import Draft, Keeper, content_hash, draft_of, drafted_files, save
from study_app.authoring.history import History
from study_app.authoring.new_study import check_free, copy_of
from study_app.authoring.study import Study, read
from study_app.authoring.versions import check_saving, runs
from study_app.authoring.writer.edits import Set
from study_app.errors import StoreError
from study_app.protocol.source.files import protocol_hash, shipped, shipped_file
from study_app.protocol.source.liquid_files import with_liquid_files
from study_app.store.folders import StudyFolder
from study_app.store.sessions.folder_lock import is_open
from study_app.viewmodels.designer.form_rows import first_element, value_at
from study_app.viewmodels.designer.outline_rows import FIRST
from study_app.workspace import workspace

RESTORE: Final = "Restore the draft"


@dataclass
class OpenStudy:
    """A study that is open in the designer.

    Attributes
    ----------
    file : Path
        Where it is saved; the file need not exist yet.
    history : History
        The study with its steps.
    base : str
        Hash of the file's content that is edited; "" for a new file.
    saved : str
        The text of the file, "" for a new one.
    read_only : str
        Why it cannot be changed, "" where it can.
    draft : Draft or None
        The draft that was found when it was opened.
    """

    file: Path
    history: History
    base: str = ""
    saved: str = ""
    read_only: str = ""
    draft: Draft | None = None
    kept: datetime | None = None
    keeper: Keeper = field(init=False)

    def __post_init__(self) -> None:
        self.keeper = Keeper(self.file, self.base)

    @property
    def study(self) -> Study:
        """The study as it is now."""
        return self.history.study

    @property
    def edited(self) -> bool:
        """Whether it differs from the file."""
        return self.study.text != self.saved

    def note_edit(self, now_s: float) -> None:
        """Let the draft follow an edit; a text that is the file's again needs none."""
        if self.edited or not self.base:
            self.keeper.edited(self.study.text, self.history.selected, now_s)
        else:
            self.keeper.saved(self.base)
            self.kept = None

    def write_draft(self, now_s: float | None = None) -> bool:
        """Write the draft if it is due, without a time at once; return whether it was written.

        Raises
        ------
        StoreError
            It cannot be written.
        """
        written = self.keeper.write() if now_s is None else self.keeper.write_if_due(now_s)
        if written:
            self.kept = datetime.now().astimezone()
        return written

    def discard_draft(self) -> None:
        """Go back to the file as one step, and forget the draft.

        Raises
        ------
        StoreError
            The draft cannot be deleted.
        """
        self.history = self.history.typed("Discard the draft", self.saved)
        self.keeper.saved(self.base)
        self.draft = self.kept = None

    def changed_outside(self) -> bool:
        """Return whether the file has another content than the one that is edited."""
        return content_hash(_content(self.file)) != self.base if self.file.exists() else bool(self.base)

    def take_outside(self) -> None:
        """Take the file's content as one step.

        Raises
        ------
        Refused
            It is not UTF-8 text.
        """
        content = _content(self.file)
        self.saved = read(content, self.file.parent).text
        self.rebase(content_hash(content))
        self.history = self.history.typed("Take the file's content", self.saved)
        self.keeper.saved(self.base)
        self.kept = None

    def keep_mine(self, now_s: float) -> None:
        """Let the next saving replace what another program wrote."""
        content = _content(self.file) if self.file.exists() else b""
        self.saved = content.decode("utf-8", "replace")
        self.rebase(content_hash(content) if self.file.exists() else "")
        self.note_edit(now_s)

    def save(self, results: Path) -> None:
        """Write the file.

        Raises
        ------
        Refused
            Sessions were run with this version and another content.
        StoreError
            It cannot be written, or was changed outside.
        """
        study = self.study
        name, version = (str(value_at(study.document, ("study", key))) for key in ("name", "version"))
        sound = study.protocol is not None
        hash_ = protocol_hash(with_liquid_files(study.text.encode(), study.folder)) if sound else ""
        check_saving(hash_, version, runs(results, name))
        self.base = save(self.file, study.text, self.base)
        self.saved = study.text
        self.keeper.saved(self.base)
        self.kept = self.draft = None

    def set_version(self, version: str) -> None:
        """Give the study another version, as one step."""
        self.history = self.history.edited(f"Set version {version}", Set(("study", "version"), version))

    def rebase(self, base: str) -> None:
        """Take edits as made from the content of another hash."""
        self.base = base
        self.keeper = Keeper(self.file, base)


def open_file(file: Path, results: Path) -> OpenStudy:
    """Open a study's file, with the draft of it that was not saved.

    Raises
    ------
    Refused
        It is not UTF-8 text.
    StoreError
        It cannot be read.
    """
    content = _content(file)
    study = read(content, file.parent)
    opened = OpenStudy(file, History(study, first_element(study.document)), content_hash(content), study.text)
    opened.read_only = _why_read_only(opened, results)
    return opened if opened.read_only else _with_draft(opened)


def open_new(study: Study, name: str) -> OpenStudy:
    """Open a copy of a study under another name; nothing is written before it is saved.

    Raises
    ------
    Refused
        The name is not permitted, or taken.
    """
    file = check_free(name)
    made = copy_of(study, name)
    return OpenStudy(file, History(made, first_element(made.document)))


def open_unsaved(file: Path, draft: Draft) -> OpenStudy:
    """Open a study that was never saved, from its draft."""
    return OpenStudy(file, History(Study(draft.text, file.parent), draft.selected or FIRST), draft=draft)


def unsaved_studies() -> tuple[Path, ...]:
    """Return the files of drafts in the workspace's protocols that were never saved."""
    folder = workspace().protocols.resolve()
    return tuple(file for file in drafted_files() if file.parent == folder and not file.exists())


def _with_draft(opened: OpenStudy) -> OpenStudy:
    draft = draft_of(opened.file)
    if draft is not None and draft.text != opened.saved:
        opened.draft = draft
        opened.history = opened.history.typed(RESTORE, draft.text)
        opened.rebase(draft.base)
    return opened


def _why_read_only(opened: OpenStudy, results: Path) -> str:
    file = opened.file.resolve()
    if any(file == shipped_file(name).resolve() for name in shipped()):
        return "This study ships with the program. Make a copy to change it."
    if not os.access(opened.file, os.W_OK):
        return "You may not write this file. Make a copy to change it."
    name = str(value_at(opened.study.document, ("study", "name")))
    if any(is_open(session.path) for session in StudyFolder(results / name).sessions()):
        return "A session of this study is under way. Make a copy, or wait until it has ended."
    return ""


def _content(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError as error:
        raise StoreError(f"{file} cannot be read: {error.strerror}") from error
