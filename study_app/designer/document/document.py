"""An open study: its text with the undo history, its file, draft and version; new studies."""

from __future__ import annotations

import os
import re
import shutil
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any, Final

from study_app.designer.document.additions import edits_to_add_language, edits_to_fill_in, edits_to_remove_language
from study_app.designer.document.elements import FIRST, first_element, study_title
from study_app.designer.document.study import Study, read_study
from study_app.designer.document.toml_edits import Edit, Set
from study_app.designer.document.toml_text import Refused, Splices, revert_splices
from study_app.designer.templates import FOLDER, templates
from study_app.errors import StoreError
from study_app.ids import MAX_SHORT_NAME, file_name_fault, free_short_name, short_name_of
from study_app.number_text import counted
from study_app.protocol.source import Path as Place
from study_app.protocol.source import StudySource, did_you_mean, file_hash, shipped, value_at
from study_app.protocol.wording import languages_of
from study_app.store.files import StudyFolder, cannot_write
from study_app.store.integrity import is_open
from study_app.store.versions import (
    Draft,
    Keeper,
    Run,
    content_hash,
    draft_of,
    keep_content,
    save_study,
    unsaved_files,
    write_whole,
)
from study_app.workspace import workspace


@dataclass(frozen=True, slots=True)
class Answers:
    """The initial settings of a new study; omitted ones are taken from the template.

    Texts are missing in languages that the template does not have. If it has none of the chosen languages, the texts of
    its first language are copied to the first chosen one.
    """

    title: str = ""
    languages: tuple[str, ...] = ()
    values: tuple[tuple[Place, Any], ...] = ()  # answers to the template's own questions


NO_ANSWERS: Final = Answers()
_FIRST_VERSION: Final = "0.1"
_NAME: Final = re.compile(rf"[a-z][a-z0-9]{{0,{MAX_SHORT_NAME - 1}}}")
_CHECK_COMMAND: Final = "liquid-study check NAME"


def template(name: str) -> Study:
    """Return the study of a template.

    Raises Refused if there is no template of this name.
    """
    if name not in templates():
        raise Refused(f'there is no template "{name}": {did_you_mean(name, templates())}')
    return read_study((FOLDER / f"{name}.toml").read_bytes())


def copy_of(study: Study, name: str) -> Study:
    """Return a copy of a study under another name, including comments, as version 0.1.

    Raises Refused if the name is not permitted, or the study cannot be read.
    """
    _check_name(name)
    named = Study(study.text.replace(_CHECK_COMMAND, f"liquid-study check {name}"), study.folder)
    return named.with_edits(Set(("study", "name"), name), Set(("study", "version"), _FIRST_VERSION))[0]


def with_answers(study: Study, answers: Answers) -> Study:
    """Return a study with the answers given on the page of new studies.

    Raises Refused if an answer is not permitted.
    """
    for place, value in answers.values:
        study, _ = study.with_edits(Set(place, value))
        fault = next((problem for problem in study.faults if problem.path[: len(place)] == place), None)
        if fault is not None:
            raise Refused(f"{fault.message}{f' ({fault.hint})' if fault.hint else ''}")
    if answers.title:
        head = study.document["study"]
        by_language = isinstance(head, Mapping) and isinstance(head.get("title"), Mapping)
        place = ("study", "title", languages_of(study.document)[0]) if by_language else ("study", "title")
        study, _ = study.with_edits(Set(place, answers.title))
    codes = languages_of(study.document)
    for code in answers.languages:
        if code not in codes:
            study, _ = study.with_edits(*edits_to_add_language(study, code))
    if answers.languages and set(codes).isdisjoint(answers.languages):  # otherwise no text would remain
        study, _ = study.with_edits(*edits_to_fill_in(study, answers.languages[0]))
    for code in codes:
        if answers.languages and code not in answers.languages:
            study, _ = study.with_edits(*edits_to_remove_language(study, code))
    return study


def check_free_name(name: str) -> Path:
    """Return the file of a new study in the workspace's protocols.

    Raises Refused if the name is not permitted, or taken.
    """
    _check_name(name)
    file = workspace().protocols / f"{name}.toml"
    if file.exists():
        raise _refusal(f"{file} already exists", name)
    return file


def write_new(study: Study, name: str) -> Path:
    """Write a copy of a study into the workspace's protocols and return its file.

    Raises Refused if the name is not permitted, or taken; StoreError if it cannot be written.
    """
    file = check_free_name(name)
    save_study(file, copy_of(study, name).text, "")
    return file


def _check_name(name: str) -> None:
    if not _NAME.fullmatch(name):
        rule = f"use at most {MAX_SHORT_NAME} lowercase letters and digits, starting with a letter"
        raise _refusal(f'"{name}" is not a valid short name: {rule}', name)
    if fault := file_name_fault(name):
        raise _refusal(f'"{name}" {fault}', name)
    if name in shipped():
        raise _refusal(f'"{name}" is the name of a study that ships with the program', name)


def taken_names() -> set[str]:
    """Return the short names of all studies: shipped ones, and those of the workspace, saved or not."""
    folder = workspace().protocols
    return {*shipped(), *(file.stem for file in (*folder.glob("*.toml"), *unsaved_files(folder)))}


def _refusal(reason: str, name: str) -> Refused:
    free = free_short_name(taken_names(), short_name_of(name) or "study")
    return Refused(f'{reason}; "{free}" is free')


_MAX_STEPS: Final = 500
_PAUSE_S: Final = 1.0  # typing in one field is one step until a pause of this length
_DEFAULT_VERSION: Final = "1"
_VERSION: Final = re.compile(r"[0-9A-Za-z.+-]+")


@dataclass(frozen=True, slots=True)
class _DoneStep:
    """A completed step: its title ("Move Honey up"), its splices, and the selection before and after it."""

    title: str
    splices: tuple[Splices, ...]
    before: Place = ()
    after: Place = ()


class Document:
    """A study that is open in the designer, with its undo history.

    ``base`` is the hash of the file content that is edited, and ``saved`` the text of that content; both are "" for a
    new file. ``read_only`` is the reason why the study cannot be changed, or "". ``draft`` is the draft that existed
    when the study was opened, and ``kept`` the time of the last draft. ``to_write`` lists the texts that were missing
    when their list was opened.
    """

    def __init__(
        self, study: Study, selected: Place = FIRST, file: Path = Path(), base: str = "", draft: Draft | None = None
    ) -> None:
        self.study, self.selected, self.file = study, selected, file
        self.base, self.saved = base, study.text if base else ""
        self.done: list[_DoneStep] = []
        self.undone: list[_DoneStep] = []
        self.read_only = ""
        self.to_write: tuple[Place, ...] = ()
        self.draft = draft
        self.kept: datetime | None = None
        self.keeper = Keeper(file, base)
        self.last: tuple[object, float] = (None, 0.0)

    # steps

    def edit(
        self, name: str, *edits: Edit, text: str | None = None, select: Place | None = None, key: object = None
    ) -> None:
        """Replace the text, apply edits in order, or both, as one undo step; without a change, no step is added.

        A step is merged into the last one if both have the same ``key`` and less than `_PAUSE_S` lies between them.
        Raises Refused, leaving the document unchanged, if an edit is not possible.
        """
        study, splices = (self.study, ()) if text is None else self.study.with_text(text)
        if edits or text is None:
            study, edit_splices = study.with_edits(*edits)
            splices = (*splices, *edit_splices)
        before, selected = self.selected, self.selected if select is None else select
        self.selected = selected
        if not splices:
            return
        last_key, last_s = self.last
        if key is not None and key == last_key and time.perf_counter() - last_s < _PAUSE_S and self.done:
            joined = self.done.pop()
            splices, before = (*joined.splices, *splices), joined.before
        self.study, self.undone, self.last = study, [], (key, time.perf_counter())
        self.done = [*self.done, _DoneStep(name, splices, before, selected)][-_MAX_STEPS:]

    def end_step(self) -> None:
        """Close the current undo step; the next edit begins a new one."""
        self.last = (None, 0.0)

    def undo(self) -> None:
        if self.done:
            step = self.done.pop()
            self.study = self.study.with_splices(tuple(revert_splices(splices) for splices in reversed(step.splices)))
            self.selected = step.before
            self.undone.append(step)
            self.end_step()

    def redo(self) -> None:
        if self.undone:
            step = self.undone.pop()
            self.study, self.selected = self.study.with_splices(step.splices), step.after
            self.done.append(step)
            self.end_step()

    # title, name and version

    @property
    def title(self) -> str:
        return study_title(self.study.document)

    @property
    def name(self) -> str:
        """The name of the study, also used for its results folder."""
        return str(value_at(self.study.document, ("study", "name")) or "")

    @property
    def version(self) -> str:
        """The version stated in the study, or the default version."""
        stated = value_at(self.study.document, ("study", "version"))
        return str(stated) if stated is not None else _DEFAULT_VERSION

    # file and draft

    @property
    def edited(self) -> bool:
        return self.study.text != self.saved

    def note_edit(self, now_s: float) -> None:
        """Schedule a draft after an edit; none is written if the text equals the file."""
        if self.edited or not self.base:
            self.keeper.note_edit(self.study.text, self.selected, now_s)
        else:
            self._forget_draft()

    def _forget_draft(self) -> None:
        """Discard the draft, which is not needed while the text equals the file."""
        self.keeper.note_saved(self.base)
        self.kept = None

    def write_draft(self, now_s: float | None = None) -> bool:
        written = self.keeper.write() if now_s is None else self.keeper.write_if_due(now_s)
        if written:
            self.kept = datetime.now().astimezone()
        return written

    def discard_draft(self) -> None:
        """Restore the file's text as one step and discard the draft."""
        self.edit("Discard the draft", text=self.saved)
        self.draft = None
        self._forget_draft()

    def discard(self) -> None:
        self.keeper.note_saved("")
        self.keeper.write()

    def changed_outside(self) -> bool:
        return content_hash(_file_content(self.file)) != self.base if self.file.exists() else bool(self.base)

    def take_file_content(self) -> None:
        content = _file_content(self.file)
        self.saved = read_study(content, self.file.parent).text
        self._rebase(content_hash(content))
        self.edit("Use the file's content", text=self.saved)
        self._forget_draft()

    def keep_edits(self, now_s: float) -> None:
        content = _file_content(self.file) if self.file.exists() else b""
        self.saved = content.decode("utf-8-sig", "replace")
        self._rebase(content_hash(content) if self.file.exists() else "")
        self.note_edit(now_s)

    def _rebase(self, base: str) -> None:
        """Treat the edits as based on the content with this hash."""
        self.base = self.keeper.base = base

    def continue_draft(self) -> None:
        """Restore the unsaved draft of the file as one step."""
        if (draft := draft_of(self.file)) is None:
            return
        self.keeper.resume_from(draft)
        if draft.text != self.saved:
            self.draft = draft
            self.edit("Restore the draft", text=draft.text)
            if draft.selected and value_at(self.study.document, draft.selected) is not None:
                self.selected = draft.selected
            self._rebase(draft.base)

    def read_only_reason(self, results: Path) -> str:
        """Return the reason why the study cannot be changed now, or ""."""
        if any(self.file.resolve() == file.resolve() for file in shipped().values()):
            return "This study ships with the program. Make a copy to change it."
        if self.file.exists() and not os.access(self.file, os.W_OK):
            return "You do not have permission to write this file. Make a copy to change it."
        if any(is_open(session.path) for session in StudyFolder(results / self.name).sessions()):
            return "A session of this study is running. Make a copy, or wait until it has ended."
        return ""

    # versions

    @property
    def saved_source(self) -> bytes:
        """The content of the saved study that a session would use."""
        return Study(self.saved, self.study.folder).source

    def standing(self, known: tuple[Run, ...]) -> Standing:
        if not any(run.sessions for run in known):
            return version_standing("", "", self.version, known)
        base = content_hash(self.saved_source) if self.base else ""
        return version_standing(content_hash(self.study.source), base, self.version, known)

    def save(self, known: tuple[Run, ...]) -> None:
        """Write the file, and store the content for sessions.

        Raises Refused if sessions were run with this version and other content, and ChangedOutsideError if another
        program changed the file.
        """
        source = self.study.source
        if conflicts := self.standing(known).conflicts:
            raise Refused(
                f"version {self.version} has already been run with different content "
                f"({counted(conflicts, 'session')}): save the study as version {next_version(self.version)}"
            )
        self._copy_referenced_files(source)
        keep_content(source)
        self.base = save_study(self.file, self.study.text, self.base)
        self.saved, self.draft = self.study.text, None
        self._forget_draft()

    def _copy_referenced_files(self, source: bytes) -> None:
        """Copy the liquid files and videos of the study into its folder if it was read from another folder."""
        folder = self.file.resolve().parent
        if self.study.folder.resolve() == folder:
            return
        study_source = StudySource.split(source)
        for name, text in study_source.liquids.items():
            path = folder / name
            if path.exists() and _file_content(path) != text.encode():
                raise Refused(f"{path} already exists and contains a different liquid: rename one of the two files")
            write_whole(path, text.encode())
        for name, digest in study_source.footage.items():
            if (digest_here := file_hash(folder / name)) is None:
                try:
                    (folder / name).parent.mkdir(parents=True, exist_ok=True)
                    shutil.copyfile(self.study.folder / name, folder / name)
                except OSError as error:
                    raise cannot_write(folder / name, error) from error
            elif digest_here != digest:
                raise Refused(
                    f"{folder / name} already exists and contains a different video: rename one of the two files"
                )
        self.study = replace(self.study, folder=folder)

    def copy_as(self, name: str) -> Document:
        """Return a document with the edited study under another name; this document reverts to its file's content."""
        document = Document(self.study, self.selected, check_free_name(name))
        document.done = [*self.done]
        document.edit(f"Save as {name}", text=copy_of(self.study, name).text)
        document.note_edit(0.0)
        document.write_draft()
        self.discard_draft()
        return document


def open_file(file: Path, results: Path) -> Document:
    """Open a study's file and restore its unsaved draft, if any."""
    content = _file_content(file)
    study = read_study(content, file.parent)
    opened = Document(study, first_element(study.document), file, content_hash(content))
    opened.read_only = opened.read_only_reason(results)
    if not opened.read_only:
        opened.continue_draft()
    return opened


def open_new(study: Study, name: str) -> Document:
    """Open a copy of a study under another name; its file is written only when it is saved."""
    file, named_copy = check_free_name(name), copy_of(study, name)
    return Document(named_copy, first_element(named_copy.document), file)


def open_unsaved(file: Path, draft: Draft) -> Document:
    """Open the draft of a study that was never saved."""
    opened = Document(Study(draft.text, file.parent), draft.selected or FIRST, file, draft=draft)
    opened.keeper.resume_from(draft)
    return opened


def _file_content(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError as error:
        raise StoreError(f"{file} cannot be read: {error.strerror}") from error


@dataclass(frozen=True, slots=True)
class Standing:
    """The relation of a study's content to the versions that were run with participants."""

    version: str  # the version to save the study as: its own, or the next free one
    last_version: str = ""  # the version that was run last, "" if none was
    sessions: int = 0  # number of sessions that were run with this content
    needs_confirmation: bool = False  # whether saving must be confirmed: the content differs from the one that was run
    conflicts: int = 0  # number of sessions that were run with the study's own version and another content


def version_standing(hash_: str, base: str, version: str, known: Iterable[Run]) -> Standing:
    """Return the relation of a study's content to the versions that were run; pilots and rehearsals are ignored.

    ``hash_`` and ``base`` are the ``protocol_hash`` of the edited study and of the file from which it is edited, "" for
    a new study; ``version`` is the version stated in the study.
    """
    used_runs = [run for run in known if run.sessions]
    if not used_runs:
        return Standing(version)
    same_content = sum(run.sessions for run in used_runs if run.hash == hash_)
    conflicts = sum(run.sessions for run in used_runs if run.version == version and run.hash != hash_)
    needs_confirmation = not same_content and bool(conflicts or any(run.hash == base for run in used_runs))
    free_version = version
    while not same_content and any(run.version == free_version for run in used_runs):
        free_version = next_version(free_version)
    return Standing(free_version, used_runs[-1].version, same_content, needs_confirmation, conflicts)


def check_version(version: str, known: Iterable[Run]) -> None:
    """Raise Refused if a text cannot be the version of content that was not run yet."""
    if not _VERSION.fullmatch(version):
        raise Refused(f'"{version}" is not a valid version: use letters, digits, dots, plus and minus signs, as in 1.2')
    if any(run.sessions and run.version == version for run in known):
        raise Refused(f"version {version} has already been run with different content: choose a different number")


def next_version(version: str) -> str:
    """Return a version with its last number incremented: 1.2 for 1.1; without a number, with ".1" appended."""
    last = re.search(r"(\d+)(\D*)$", version)
    if last is None:
        return f"{version}.1"
    return f"{version[: last.start()]}{int(last[1]) + 1}{last[2]}"
