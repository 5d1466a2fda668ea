"""Drafts, saving, and the banner of a study that is read-only or changed by another program."""

import time
from collections.abc import Callable
from typing import Final

from PySide6.QtCore import QObject, Qt, QTimer, Signal
from PySide6.QtGui import QGuiApplication

from study_app.designer.document.document import Document, Standing, check_version
from study_app.designer.document.toml_edits import Set
from study_app.designer.document.toml_text import Refused
from study_app.designer.editing import Editing
from study_app.designer.header import Notice
from study_app.designer.new_study_page import source_of
from study_app.designer.problems import problem_rows
from study_app.designer.prompts import ConfirmCard
from study_app.designer.version_rows import FILE, Comparison
from study_app.designer.versions import KnownRuns, SaveCard, compare, latest_run, version_of
from study_app.designer.window import DesignerPlace
from study_app.errors import StudyError
from study_app.gui.home import time_text
from study_app.number_text import counted
from study_app.store.versions import ChangedOutsideError, draft_of, keep_original, kept_versions

_DRAFT_CHECK_MS: Final = 50
_RETRY_MS: Final = 2_000


class Saving(QObject):
    """Keeps the draft of the open study and writes its file.

    Signals: ``kept`` (a draft was written), ``saved`` (the written file), ``copy_asked`` (the study to copy),
    ``compare_asked`` (the version to compare with: its hash, or "file"), ``continued`` (the document under another
    name that replaces the open one), ``discarded`` (a study that was never saved was discarded).
    """

    kept = Signal()
    saved = Signal(object)
    copy_asked = Signal(str)
    compare_asked = Signal(str)
    continued = Signal(object)
    discarded = Signal()

    def __init__(self, editing: Editing, place: DesignerPlace, runs: KnownRuns) -> None:
        super().__init__(editing)
        self.editing, self.place, self.runs = editing, place, runs
        self.banner: Notice | None = None
        self._notice: Notice | None = None
        self._shown_while_edited: bool | None = (
            None  # True: while the study is edited; False: until it is edited; None: until closed
        )
        self.card: SaveCard | None = None
        self._other_edits, self._draft_error = 0, ""
        self._draft_timer = QTimer(self)
        self._draft_timer.setInterval(_DRAFT_CHECK_MS)
        self._draft_timer.timeout.connect(self.write_draft)
        application = QGuiApplication.instance()
        assert isinstance(application, QGuiApplication)  # noqa: S101 - a window has one
        application.applicationStateChanged.connect(self._check_file_after_return)
        editing.opened_other.connect(self._show_opened)
        editing.edited.connect(self._end_notice)
        place.left.connect(self.leave)

    # the banner

    def _show_opened(self) -> None:
        self._show_notice(None)
        self.banner, opened = None, self.editing.opened
        if opened is None:
            return
        self._draft_timer.start(_DRAFT_CHECK_MS)
        self._other_edits, self._draft_error = opened.keeper.others, ""
        self.offer_to_discard()
        self.banner = _banner_notice(opened) or self._notice

    def offer_to_discard(self) -> None:
        """Show the time of the restored draft, with a button that discards it."""
        opened = self.editing.opened
        draft = None if opened is None else opened.draft if opened.base else draft_of(opened.file)
        if opened is not None and draft is not None and opened.edited:
            sentence = f"Draft from {time_text(draft.kept_at)}, {'not' if opened.base else 'never'} saved"
            self._show_notice(sentence, ("discard", "Discard the draft"), while_edited=True)

    def _show_notice(self, sentence: str | None, *actions: tuple[str, str], while_edited: bool | None = None) -> None:
        """Set the notice for the banner, which a banner that needs an answer hides; None removes it.

        ``while_edited`` is that of `_shown_while_edited`.
        """
        self._notice, self._shown_while_edited = (
            None if sentence is None else Notice(sentence, actions, closes=True),
            while_edited,
        )

    def _end_notice(self) -> None:
        """Remove the notice if it does not apply any more after an edit."""
        opened = self.editing.opened
        if opened is not None and self._notice is not None and self._shown_while_edited is (not opened.edited):
            self._close_notice(opened)

    def _close_notice(self, opened: Document) -> None:
        self._show_notice(None)
        opened.draft = None  # so that it is not announced again
        self.banner = _banner_notice(opened)
        self.place.banner.show_notice(self.banner)

    def check_file(self) -> None:
        """Check whether the study may be edited, and whether another program changed its file.

        If the study was not edited here, the file's content is loaded as a step; otherwise the banner asks which one
        to keep.
        """
        opened = self.editing.opened
        if opened is None:
            return
        previous = opened.read_only, self.banner
        opened.read_only = opened.read_only_reason(self.editing.results)
        if not opened.edited and opened.file.exists() and _is_changed_outside(opened):
            self._try_action(opened, opened.take_file_content)
        self.banner = _banner_notice(opened) or self._notice
        if previous != (opened.read_only, self.banner):
            self.editing.announce_edit()

    def _check_file_after_return(self, state: Qt.ApplicationState) -> None:
        """Check the file when the program becomes active, since another program may have written it."""
        if state == Qt.ApplicationState.ApplicationActive and self.place.isVisible():
            self.place.flush()
            self.check_file()

    def answer_banner(self, action: str) -> None:
        opened = self.editing.opened
        if opened is None:
            return
        if action == "copy":
            self.copy_asked.emit(source_of(opened.file))
            return
        if action == "problems":
            self.place.parts.focus_problems()
            return
        if action == "compare":
            drafts = [version.hash for version in kept_versions(opened.file) if version.origin == "draft"]
            self.compare_asked.emit(FILE if _is_changed_outside(opened) or not drafts else drafts[-1])
            return
        if action == "close":
            self._close_notice(opened)
            return
        if action == "discard" and not opened.base:
            consequence = (
                "has never been saved, so if you discard its draft, the whole study will be lost. This cannot be "
                "undone."
            )
            title = f"Discard “{opened.title or opened.file.stem}”?"
            card = ConfirmCard(title, f"{opened.file.name} {consequence}", "Discard the draft", "trash")
            card.answered.connect(self.discard_study)
            self.place.show_prompt(card, card.first)
            return
        self._show_notice(None)
        if action == "keep":
            self._try_action(opened, lambda: opened.keep_edits(time.perf_counter()))
        elif action == "take":
            self._try_action(opened, opened.take_file_content)
        else:
            self._try_action(opened, opened.discard_draft)

    def discard_study(self) -> None:
        self.place.flush()
        opened = self.editing.opened
        if opened is None or opened.base:
            return
        try:
            opened.discard()
        except StudyError as error:
            self.place.message.emit("The draft was not discarded", f"{error}.")
            return
        self.discarded.emit()

    # saving

    def save(self) -> None:
        self.editing.leave_entries()
        opened = self.editing.writable
        if opened is None or (opened.base and not opened.edited):
            return
        opened.read_only = opened.read_only_reason(self.editing.results)
        if opened.read_only:
            self._show_banner(opened)
            return
        known = self.runs.read()
        standing = opened.standing(known)
        if standing.needs_confirmation and not _is_changed_outside(opened):
            self._show_save_card(opened, standing)
        else:
            self._save_file(opened)

    def _show_save_card(self, opened: Document, standing: Standing) -> None:
        run = latest_run(self.runs.known)
        comparison = Comparison() if run is None else compare(version_of(opened, run), opened.study)
        problems = len(problem_rows(opened.study))
        self.card = card = SaveCard(standing, self.runs.known, comparison, problems)
        card.save_asked.connect(self.save_as_version)
        card.another_asked.connect(self.save_as_another)
        card.changes_asked.connect(self.place.close_prompt)
        card.changes_asked.connect(lambda: self.compare_asked.emit("" if run is None else run.hash))
        self.place.show_prompt(card, card.first)

    def save_as_version(self, version: str) -> None:
        """Set the study's version and save it; the card shows the reason if that fails."""
        opened = self.editing.writable
        if opened is None:
            return
        try:
            check_version(version, self.runs.read())
            opened.edit(f"Set version {version}", Set(("study", "version"), version))
        except Refused as refusal:
            if self.card is not None:
                self.card.refuse(f"{refusal}.")
            return
        self.place.close_prompt()
        self._save_file(opened)

    def save_as_another(self, name: str) -> None:
        opened = self.editing.writable
        if opened is None:
            return
        try:
            copy = opened.copy_as(name)
        except StudyError as refusal:
            if self.card is not None:
                self.card.refuse(f"{refusal}.")
            return
        self.write_draft(at_once=True)
        self.place.close_prompt()
        keep_original(copy.file, opened.file.stem)
        self.continued.emit(copy)
        self._save_file(copy)

    def _save_file(self, opened: Document) -> None:
        try:
            opened.save(self.runs.read())
        except ChangedOutsideError:
            self._show_banner(opened)
            return
        except StudyError as error:
            self.place.message.emit("The study was not saved", f"{error}.")
            self.editing.announce_edit()
            return
        count = len(problem_rows(opened.study))
        sentence = f"Saved, but the study cannot be run yet because of {counted(count, 'problem')}" if count else None
        self._show_notice(sentence, ("problems", "Show the list"), while_edited=False)
        self._show_banner(opened)
        self.saved.emit(opened.file)

    # drafts

    def leave(self) -> None:
        self.place.flush()
        self.write_draft(at_once=True)

    def write_draft(self, *, at_once: bool = False) -> None:
        """Write the draft if it is due, or ``at_once``; a failed write is reported once and retried."""
        opened = self.editing.opened
        if opened is None:
            return
        try:
            written = opened.write_draft(None if at_once else time.perf_counter())
        except StudyError as error:
            self._draft_timer.setInterval(_RETRY_MS)
            if self._draft_error != str(error):
                self._draft_error = str(error)
                self.place.message.emit("The draft is not up to date", f"{error}.")
            return
        if self._draft_error:
            self._draft_error = ""
            self._draft_timer.setInterval(_DRAFT_CHECK_MS)
        if opened.keeper.others > self._other_edits:
            self._other_edits = opened.keeper.others
            sentence = (
                "This study is also being edited in another window. The unsaved edits made there are kept as a version"
            )
            self._show_notice(sentence, ("compare", "Compare"))
            self._show_banner(opened)
        if written:
            self.kept.emit()

    def _try_action(self, opened: Document, action: Callable[[], object]) -> None:
        try:
            action()
        except StudyError as error:
            self.place.message.emit("The action failed", f"{error}.")
        self._show_banner(opened)

    def _show_banner(self, opened: Document) -> None:
        self.banner = _banner_notice(opened) or self._notice
        self.editing.announce_edit()


def _banner_notice(opened: Document) -> Notice | None:
    """Return the notice on a study that is read-only, or whose file another program changed; otherwise None."""
    if opened.read_only:
        return Notice(opened.read_only, (("copy", "Make a copy…"),))
    try:
        changed = opened.changed_outside()
    except StudyError as error:
        return Notice(f"{str(error)[:1].upper()}{str(error)[1:]}")
    if not changed:
        return None
    if not opened.file.exists():
        return Notice("Another program has deleted or moved this file", (("keep", "Keep mine"),))
    edited_too = ", and you have edited it here too" if opened.edited else ""
    return Notice(
        f"Another program has changed this file{edited_too}",
        (("keep", "Keep mine"), ("take", "Use the file's"), ("compare", "Compare")),
    )


def _is_changed_outside(opened: Document) -> bool:
    """Return whether the file can be read and differs from the content that is being edited."""
    try:
        return opened.changed_outside()
    except StudyError:
        return False
