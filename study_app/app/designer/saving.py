"""Drafts, saving, and the banner of a study that is read-only or was changed by another program."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from PySide6.QtCore import QObject, QTimer, Signal

from study_app.app.designer.editing import Editing
from study_app.app.designer.open_study import OpenStudy, why_read_only
from study_app.app.designer.studies import source_of, time_words
from study_app.app.designer.versions.comparison import Comparison, compare, newest, version_of
from study_app.app.designer.versions.file_watch import FileWatch
from study_app.app.designer.versions.known_runs import KnownRuns
from study_app.authoring.versions.contents import ChangedOutsideError, kept_versions
from study_app.authoring.versions.runs import Standing, check_version
from study_app.authoring.writer.refused import Refused
from study_app.errors import StudyError
from study_app.gui.designer.versions.save_card import SaveCard
from study_app.gui.designer.view import DesignerPlace
from study_app.viewmodels.designer.versions.changes_view import FILE
from study_app.viewmodels.designer.versions.standing import save_prompt
from study_app.viewmodels.designer.view import Banner

DRAFT_MS: Final = 50


class Saving(QObject):
    """Keeps the draft of the open study and writes its file.

    ``kept`` is emitted when a draft was written or the banner changed, ``saved`` carries the file that was written,
    ``copy_asked`` the study of which a copy is to be made, ``compare_asked`` the version to compare with (its hash, or
    "file"), ``continued`` the study under another name that is open from now on.
    """

    kept = Signal()
    saved = Signal(object)
    copy_asked = Signal(str)
    compare_asked = Signal(str)
    continued = Signal(object)

    def __init__(self, editing: Editing, place: DesignerPlace, runs: KnownRuns) -> None:
        super().__init__(editing)
        self.editing, self.place, self.runs = editing, place, runs
        self.banner: Banner | None = None
        self.card: SaveCard | None = None
        self._others = 0
        self._drafting = QTimer(self)
        self._drafting.setInterval(DRAFT_MS)
        self._drafting.timeout.connect(self.write_draft)
        self._watch = FileWatch(editing)
        self._watch.touched.connect(self._look_while_shown)
        editing.opened_other.connect(self._begin)
        place.left.connect(self.leave)
        place.save_asked.connect(self.save)
        place.banner_asked.connect(self.answer_banner)

    # the banner

    def _begin(self) -> None:
        opened = self.editing.opened
        assert opened is not None  # noqa: S101 - that is what was opened
        self._drafting.start()
        self._others = opened.keeper.others
        self.banner = None
        if opened.read_only:
            self._say_read_only(opened)
        elif self._changed_outside(opened):
            self._say_changed()
        elif opened.draft is not None and opened.edited and opened.base:
            when = time_words(opened.draft.kept_at)
            self.banner = Banner(f"Draft of {when}, not saved", (("discard", "Discard the draft"),))

    def look_again(self) -> None:
        """Look whether the study may be changed, and whether another program changed its file.

        Where it was not edited here, the file's content is taken in as a step; else it is asked which is to be kept.
        """
        opened = self.editing.opened
        if opened is None:
            return
        reason = why_read_only(opened, self.editing.results)
        if reason != opened.read_only:
            opened.read_only, self.banner = reason, None
            if reason:
                self._say_read_only(opened)
            self.editing.announce()
        if not self._changed_outside(opened):
            return
        if reason and not opened.edited and opened.file.exists():
            self._try(opened.take_outside)
            self._say_read_only(opened)
        elif opened.edited or not opened.file.exists():
            self._say_changed()
            self.editing.announce()
        else:
            self._try(opened.take_outside)

    def _look_while_shown(self) -> None:
        if self.place.isVisible():
            self.place.flush()
            self.look_again()

    def _changed_outside(self, opened: OpenStudy) -> bool:
        try:
            return opened.changed_outside()
        except StudyError as error:
            self.banner = Banner(f"{str(error)[:1].upper()}{str(error)[1:]}")
            return False

    def _say_read_only(self, opened: OpenStudy) -> None:
        self.banner = Banner(opened.read_only, (("copy", "Make a copy …"),))

    def _say_changed(self) -> None:
        opened = self.editing.opened
        if opened is not None and not opened.file.exists():
            self.banner = Banner("Another program deleted or moved this file", (("keep", "Keep mine"),))
            return
        self.banner = Banner(
            "Another program changed this file, and it was edited here, too",
            (("keep", "Keep mine"), ("take", "Take the file's"), ("compare", "Compare")),
        )

    def answer_banner(self, action: str) -> None:
        """Carry out what a button of the banner asks for."""
        opened = self.editing.opened
        if opened is None:
            return
        if action == "copy":
            self.copy_asked.emit(source_of(opened.file))
            return
        if action == "compare":
            drafts = [one.hash for one in kept_versions(opened.file) if one.origin == "draft"]
            self.compare_asked.emit(FILE if self._changed_outside(opened) or not drafts else drafts[-1])
            return
        self.banner = None
        if action == "keep":
            self._try(lambda: opened.keep_mine(time.monotonic()))
        elif action == "take":
            self._try(opened.take_outside)
        else:
            self._try(opened.discard_draft)

    # saving

    def save(self) -> None:
        """Write the file; ask where sessions were run with other content, or another program changed the file."""
        opened = self.editing.writable
        if opened is None or (opened.base and not opened.edited):
            return
        opened.read_only = why_read_only(opened, self.editing.results)
        if opened.read_only:
            self._say_read_only(opened)
            self.editing.announce()
            return
        known = self.runs.read()
        standing = opened.standing(known)
        if standing.asks and not self._changed_outside(opened):
            self._ask(opened, standing)
        else:
            self._write(opened)

    def _ask(self, opened: OpenStudy, standing: Standing) -> None:
        """Show what differs from what was run, and ask under which version or name the study is saved."""
        run = newest(self.runs.known)
        found = Comparison() if run is None else compare(version_of(opened, run), opened.study)
        problems = len(opened.study.faults)
        self.card = card = SaveCard(save_prompt(standing, self.runs.known, found.groups, found.note, problems))
        card.save_asked.connect(self.save_as_version)
        card.another_asked.connect(self.save_as_another)
        card.changes_asked.connect(self.place.close_prompt)
        card.changes_asked.connect(lambda: self.compare_asked.emit("" if run is None else run.hash))
        self.place.show_prompt(card, card.first)

    def save_as_version(self, version: str) -> None:
        """Give the study another version and save it; the card says why where that cannot be."""
        opened = self.editing.writable
        if opened is None:
            return
        try:
            check_version(version, self.runs.read())
            opened.set_version(version)
        except Refused as refusal:
            if self.card is not None:
                self.card.refuse(f"{refusal}.")
            return
        self.place.close_prompt()
        self._write(opened)

    def save_as_another(self, name: str) -> None:
        """Save the study with its edits under another name; the file of this one stays as it is."""
        opened = self.editing.writable
        if opened is None:
            return
        try:
            made = opened.saved_as(name)
        except StudyError as refusal:
            if self.card is not None:
                self.card.refuse(f"{refusal}.")
            return
        self.place.close_prompt()
        self.continued.emit(made)
        self._write(made)

    def _write(self, opened: OpenStudy) -> None:
        try:
            opened.save(self.runs.read())
        except ChangedOutsideError:
            self._say_changed()
            self.editing.announce()
            return
        except StudyError as error:
            self.place.message.emit("The study was not saved", f"{error}.")
            self.editing.announce()
            return
        self.banner = None
        self.editing.announce()
        self.saved.emit(opened.file)

    # drafts

    def leave(self) -> None:
        """Hand on what is being typed, and write the draft at once."""
        self.place.flush()
        self.write_draft(at_once=True)

    def write_draft(self, *, at_once: bool = False) -> None:
        """Write the draft if it is due."""
        opened = self.editing.opened
        if opened is None:
            return
        try:
            written = opened.write_draft(None if at_once else time.monotonic())
        except StudyError as error:
            self._drafting.stop()
            self.place.message.emit("The draft is not kept", f"{error}.")
            return
        if opened.keeper.others > self._others:
            self._others = opened.keeper.others
            self.banner = Banner(
                "Another window of the program edits this study, too: its unsaved edits are kept as a version",
                (("compare", "Compare"),),
            )
            self.editing.announce()
        if written:
            self.kept.emit()

    def _try(self, act: Callable[[], object]) -> None:
        try:
            act()
        except StudyError as error:
            self.place.message.emit("This was not done", f"{error}.")
        self.editing.announce()
