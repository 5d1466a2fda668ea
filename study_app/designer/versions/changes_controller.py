"""The tab Changes: compares the open study with a version, and restores a version."""

import json
from collections.abc import Iterable
from contextlib import suppress
from datetime import datetime
from difflib import unified_diff
from pathlib import Path
from typing import Final, NamedTuple

from PySide6.QtCore import QObject, QTimer

from study_app.designer.document.study import Study
from study_app.designer.place.arrangement import PanePage
from study_app.designer.place.editing import Editing, OpenStudy
from study_app.designer.place.file import shown
from study_app.designer.place.view import DesignerPlace
from study_app.designer.versions.known_runs import KnownRuns
from study_app.designer.versions.version_rows import FILE, ChangesView, Comparison, VersionChoice, version_choices
from study_app.designer.versions.versions_page import ChangesCard
from study_app.errors import StoreError
from study_app.protocol.differences import differences
from study_app.protocol.source.files import unbundled, with_liquid_files
from study_app.store.folders import SessionFolder
from study_app.store.receipt import without_conditions
from study_app.store.study_runs import Run, run_of, source_of
from study_app.store.study_versions import content_hash, kept_content, kept_versions

TAB: Final = "changes"
REST_MS: Final = 200
NO_COPY: Final = (
    "No copy of this version is kept on this computer. What differs is taken from a receipt, which does not say what "
    "the conditions are."
)
FAULTY: Final = "No copy of this version is kept on this computer: solve the problems of the study to list differences."
EQUAL: Final = "The study does not differ from this version."


class Version(NamedTuple):
    """A version to compare with: its source (text and liquid files) where a copy is kept, and a run with a receipt."""

    source: str | None
    run: Run | None = None

    @property
    def text(self) -> str | None:
        """The text of the study's own file."""
        return None if self.source is None else unbundled(self.source.encode())[0].decode()


def version_of(opened: OpenStudy, run: Run) -> Version:
    """Return a version that was run: its copy is kept, or it is what the file holds."""
    source = source_of(run)
    if source is None:
        file = with_liquid_files(opened.saved.encode(), opened.study.folder)
        source = file.decode() if content_hash(file) == run.hash else None
    return Version(source, run)


def kept_version(hash_: str) -> Version:
    """Return a version that was saved."""
    content = kept_content(hash_)
    return Version(None if content is None else content.decode("utf-8", "replace"))


def file_version(file: Path) -> Version:
    """Return what a study's file holds at this moment."""
    try:
        return Version(file.read_bytes().decode("utf-8", "replace"))
    except OSError:
        return Version(None)


def compare(version: Version, study: Study) -> Comparison:
    """Return how a study differs from a version: line by line, or in sentences where only a receipt is known."""
    if version.source is None:
        held = None if version.run is None else version.run.protocol
        if held is None or study.protocol is None:
            return Comparison((), FAULTY)
        return Comparison(differences(held, json.loads(json.dumps(without_conditions(study.protocol)))), NO_COPY)
    now = study.text
    if unbundled(version.source.encode())[1]:  # kept with its liquid files
        now = with_liquid_files(now.encode(), study.folder).decode()
    before, after = (shown(text).split("\n") for text in (version.source, now))
    _, _, *lines = unified_diff(before, after, lineterm="") if before != after else ("", "")
    return Comparison(tuple(lines), "" if lines else EQUAL)


def newest(known: Iterable[Run]) -> Run | None:
    """Return what participants were run with last; where there are none, what was run last as a pilot or rehearsal."""
    ran = tuple(known)
    return next((run for run in reversed(ran) if run.sessions), ran[-1] if ran else None)


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
        self.card.restore_asked.connect(self.restore)

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
        can_restore = not opened.read_only and version.text not in {None, opened.study.text}
        self.card.show_view(ChangesView(choices, chosen, found, can_restore))

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

    def restore(self) -> None:
        """Give the study the text of the version, as one step."""
        self.place.flush()
        opened, chosen = self.editing.writable, self.card.view.chosen
        text = None if opened is None else self._version(opened, chosen).text
        if text is not None:
            words = next(one.words for one in self.card.view.versions if one.key == chosen)
            self.editing.type_text(f"Restore {words}", text)
            self.show()
