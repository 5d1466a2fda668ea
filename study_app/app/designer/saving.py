"""Drafts, saving, and the banner of a study that is read-only or was changed by another program."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from PySide6.QtCore import QObject, QTimer, Signal

from study_app.app.designer.editing import Editing
from study_app.app.designer.studies import source_of, time_words
from study_app.authoring.drafts import ChangedOutsideError
from study_app.authoring.versions import next_version
from study_app.authoring.writer.refused import Refused
from study_app.errors import StudyError
from study_app.gui.designer.view import DesignerPlace
from study_app.viewmodels.designer.form_rows import value_at
from study_app.viewmodels.designer.view import Banner

DRAFT_MS: Final = 50


class Saving(QObject):
    """Keeps the draft of the open study and writes its file.

    ``kept`` is emitted when a draft was written or the banner changed, ``saved`` carries the file that was written,
    ``copy_asked`` the study of which a copy is to be made.
    """

    kept = Signal()
    saved = Signal(object)
    copy_asked = Signal(str)

    def __init__(self, editing: Editing, place: DesignerPlace) -> None:
        super().__init__(editing)
        self.editing, self.place = editing, place
        self.banner: Banner | None = None
        self._drafting = QTimer(self)
        self._drafting.setInterval(DRAFT_MS)
        self._drafting.timeout.connect(self.write_draft)
        editing.opened_other.connect(self._begin)
        place.left.connect(self.leave)
        place.save_asked.connect(self.save)
        place.save_as_version_asked.connect(self.save_as_version)
        place.banner_asked.connect(self.answer_banner)

    # the banner

    def _begin(self) -> None:
        opened = self.editing.opened
        assert opened is not None  # noqa: S101 - that is what was opened
        self._drafting.start()
        self.banner = None
        if opened.read_only:
            self.banner = Banner(opened.read_only, (("copy", "Make a copy …"),))
        elif opened.changed_outside():
            self._say_changed()
        elif opened.draft is not None and opened.edited and opened.base:
            when = time_words(opened.draft.kept_at)
            self.banner = Banner(f"Draft of {when}, not saved", (("discard", "Discard the draft"),))

    def look_again(self) -> None:
        """Take in a file that another program changed; where it was edited here, too, ask which is to be kept."""
        opened = self.editing.writable
        if opened is None or not opened.changed_outside():
            return
        if opened.edited or not opened.file.exists():
            self._say_changed()
        else:
            self._try(opened.take_outside)

    def _say_changed(self) -> None:
        self.banner = Banner(
            "Another program changed this file, and it was edited here, too",
            (("keep", "Keep mine"), ("take", "Take the file's")),
        )

    def answer_banner(self, action: str) -> None:
        """Carry out what a button of the banner asks for."""
        opened = self.editing.opened
        if opened is None:
            return
        if action == "copy":
            self.copy_asked.emit(source_of(opened.file))
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
        """Write the file; ask where the version was run, or another program changed the file."""
        opened = self.editing.writable
        if opened is None or (opened.base and not opened.edited):
            return
        try:
            opened.save(self.editing.results)
        except Refused as refusal:
            version = next_version(str(value_at(opened.study.document, ("study", "version"))))
            self.place.ask_for_version(f"{refusal}.", version)
            return
        except ChangedOutsideError:
            self._say_changed()
            self.editing.announce()
            return
        except StudyError as error:
            self.place.message.emit("The study was not saved", f"{error}.")
            return
        self.banner = None
        self.editing.announce()
        self.saved.emit(opened.file)

    def save_as_version(self, version: str) -> None:
        """Give the study another version and save it."""
        if (opened := self.editing.writable) is not None:
            self._try(lambda: opened.set_version(version))
            self.save()

    # drafts

    def leave(self) -> None:
        """Write the draft at once."""
        self.write_draft(at_once=True)

    def write_draft(self, *, at_once: bool = False) -> None:
        """Write the draft if it is due."""
        if self.editing.opened is None:
            return
        try:
            written = self.editing.opened.write_draft(None if at_once else time.monotonic())
        except StudyError as error:
            self._drafting.stop()
            self.place.message.emit("The draft is not kept", f"{error}.")
            return
        if written:
            self.kept.emit()

    def _try(self, act: Callable[[], object]) -> None:
        try:
            act()
        except StudyError as error:
            self.place.message.emit("This was not done", f"{error}.")
        self.editing.announce()
