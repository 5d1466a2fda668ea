"""The tab Changes: compares the open study with a version, and reverts single differences."""

from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Final

from PySide6.QtCore import QObject, QTimer

from study_app.app.designer.editing import Editing
from study_app.app.designer.open_study import OpenStudy
from study_app.app.designer.versions.comparison import Version, compare, file_version, kept_version, newest, version_of
from study_app.app.designer.versions.known_runs import KnownRuns
from study_app.authoring.versions.contents import kept_versions
from study_app.authoring.versions.runs import Run, run_of
from study_app.authoring.writer.refused import Refused
from study_app.errors import StoreError
from study_app.gui.designer.pane.right_pane import PanePage
from study_app.gui.designer.versions.changes_card import ChangesCard
from study_app.gui.designer.view import DesignerPlace
from study_app.store.folders import SessionFolder
from study_app.viewmodels.designer.file_text import retyped
from study_app.viewmodels.designer.versions.change_rows import ChangeRow
from study_app.viewmodels.designer.versions.changes_view import FILE, ChangesView, VersionChoice, version_choices
from study_app.viewmodels.designer.versions.side_by_side import Hunk, reverted, side_by_side

TAB: Final = "changes"
REST_MS: Final = 200


class ChangesController(QObject):
    """Shows how the open study differs from a version, while its tab is shown."""

    def __init__(self, editing: Editing, place: DesignerPlace, runs: KnownRuns) -> None:
        super().__init__(editing)
        self.editing, self.place, self.runs = editing, place, runs
        self.card = ChangesCard()
        self._chosen = ""
        self._asked: Run | None = None
        place.pane.add_page(PanePage(TAB, "Changes", self.card, with_facts=False))
        self._resting = QTimer(self)
        self._resting.setInterval(REST_MS)
        self._resting.setSingleShot(True)
        self._resting.timeout.connect(self.show)
        place.pane.tab_shown.connect(lambda _tab: self.show())
        place.header.version.clicked.connect(lambda: self.compare_with(""))
        editing.opened_other.connect(self._begin)
        editing.edited.connect(self._resting.start)
        runs.changed.connect(self.show)
        self.card.version_chosen.connect(self.compare_with)
        self.card.go_asked.connect(lambda row: self.editing.select(row.element))
        self.card.revert_asked.connect(self.revert)
        self.card.revert_text_asked.connect(self.revert_text)

    def compare_with(self, key: str) -> None:
        """Show the tab with a version by its hash, the file ("file"), by default that of the last session."""
        self._chosen = key or self._chosen
        self.place.show_tab(TAB)
        self.show()

    def compare_with_session(self, study: str, folder: Path) -> None:
        """Show the tab with the version that a session was run with, if its study is the one that is open."""
        opened = self.editing.opened
        run = run_of(SessionFolder(folder, "", 0).receipt)
        if opened is None or run is None or opened.name != study:
            return
        self._asked = run
        self.compare_with(run.hash)

    def _begin(self) -> None:
        self._chosen, self._asked = "", None
        self._resting.start()

    def show(self) -> None:
        """Compare anew, where the tab is shown."""
        opened = self.editing.opened
        if opened is None or self.place.pane.tab != TAB:
            return
        choices = self._choices(opened)
        keys = [one.key for one in choices]
        chosen = self._chosen if self._chosen in keys else self._default(keys)
        if not chosen:
            self.card.show_view(ChangesView())
            return
        version = self._version(opened, chosen)
        found = compare(version, opened.study)
        text = version.text
        sides = None if text is None else side_by_side(text, opened.study.text)
        can_revert = not opened.read_only and text is not None
        self.card.show_view(ChangesView(choices, chosen, found.groups, found.note, sides, can_revert))

    def _choices(self, opened: OpenStudy) -> tuple[VersionChoice, ...]:
        file = ""
        with suppress(StoreError):  # a file that cannot be read is no version to compare with
            if opened.base and opened.file.exists():
                if opened.changed_outside():
                    file = "The file as another program wrote it"
                elif opened.edited:
                    file = "The file, without the edits"
        now = datetime.now().astimezone()
        return version_choices(self._known(), kept_versions(opened.file), file, now)

    def _known(self) -> tuple[Run, ...]:
        """Return what was run, with the session's version that was asked for, wherever its results are."""
        known = self.runs.known
        asked = self._asked
        return known if asked is None or any(run.hash == asked.hash for run in known) else (asked, *known)

    def _default(self, keys: list[str]) -> str:
        run = newest(self.runs.known)
        return run.hash if run is not None and run.hash in keys else keys[0] if keys else ""

    def _version(self, opened: OpenStudy, key: str) -> Version:
        if key == FILE:
            return file_version(opened.file)
        run = next((one for one in self._known() if one.hash == key), None)
        return kept_version(key) if run is None else version_of(opened, run)

    # one step each

    def revert(self, row: ChangeRow) -> None:
        """Take one difference back."""
        self.place.flush()
        self.show()
        rows = (one for group in self.card.view.groups for one in group.rows)
        now = next((one for one in rows if one.change.sentence == row.change.sentence), None)
        if now is None:
            return
        try:
            self.editing.make(f"Revert {now.title}", *now.change.revert, select=now.element or None)
        except Refused as refusal:
            self.place.message.emit("This was not reverted", f"{refusal}.")
        self.show()

    def revert_text(self, hunk: Hunk) -> None:
        """Give some lines the text that they had in the version."""
        self.place.flush()
        self.show()
        opened, sides = self.editing.writable, self.card.view.sides
        if opened is None or sides is None or hunk not in sides.hunks:
            return
        self.editing.type_text("Revert lines", retyped(opened.study.text, reverted(opened.study.text, hunk)))
        self.show()
