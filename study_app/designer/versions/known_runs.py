"""What the open study was run with, read in the background, and changes of its file by other programs."""

import contextlib
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Final

from PySide6.QtCore import QFileSystemWatcher, QObject, Qt, Signal
from PySide6.QtGui import QGuiApplication

from study_app.designer.document.document import Standing
from study_app.designer.place.editing import Editing
from study_app.designer.versions.version_rows import VersionChip, version_chip
from study_app.errors import StoreError
from study_app.gui.widgets.background import Background, delayed
from study_app.store.study_runs import Run, keep_what_was_run, recorded_items, runs

REST_MS: Final = 150
"""A program that writes a file makes several changes; they are one."""


class FileWatch(QObject):
    """``touched`` is emitted when the file or its folder changed, and when the program is in front again.

    A folder on a network may not say that it changes; then the file is looked at when the program is in front again.
    """

    touched = Signal()

    def __init__(self, editing: Editing) -> None:
        super().__init__(editing)
        self.editing = editing
        self._watcher = QFileSystemWatcher(self)
        self._resting = delayed(self, REST_MS, self._touch)
        self._watcher.fileChanged.connect(lambda _path: self._resting.start())
        self._watcher.directoryChanged.connect(lambda _path: self._resting.start())
        editing.opened_other.connect(self.watch)
        application = QGuiApplication.instance()
        if isinstance(application, QGuiApplication):
            application.applicationStateChanged.connect(self._come_back)

    def watch(self) -> None:
        """Watch the file of the open study; one that was replaced is another file to the system."""
        watched = [*self._watcher.files(), *self._watcher.directories()]
        opened = self.editing.opened
        file = None if opened is None else opened.file.resolve()
        wanted = [] if file is None else [str(path) for path in (file, file.parent) if path.exists()]
        if gone := [path for path in watched if path not in wanted]:
            self._watcher.removePaths(gone)
        if missing := [path for path in wanted if path not in watched]:
            self._watcher.addPaths(missing)

    def _touch(self) -> None:
        self.watch()
        self.touched.emit()

    def _come_back(self, state: Qt.ApplicationState) -> None:
        if state == Qt.ApplicationState.ApplicationActive and self.editing.opened is not None:
            self._resting.start()


class KnownRuns(QObject):
    """The contents of the open study that sessions were run with; ``changed`` comes when they or the chip change.

    ``items`` counts the sessions of participants by questionnaire and id of the questions that they were asked.
    """

    changed = Signal()

    def __init__(self, editing: Editing) -> None:
        super().__init__(editing)
        self.editing = editing
        self.known: tuple[Run, ...] = ()
        self.items: Mapping[tuple[str, str], int] = {}
        self.chip = VersionChip()
        self._reader = Background(self)
        self._reader.done.connect(self._take)
        self._resting = delayed(self, REST_MS, self._stand)
        editing.opened_other.connect(self._begin)
        editing.edited.connect(self._resting.start)

    def look(self) -> None:
        """Read again which sessions there are, without waiting for it."""
        if (opened := self.editing.opened) is not None:
            self._reader.run(partial(_read, self.editing.results, opened.name, opened.file))

    def read(self) -> tuple[Run, ...]:
        """Read at once which sessions there are, as before saving."""
        if (opened := self.editing.opened) is not None:
            self.known = runs(self.editing.results, opened.name)
        return self.known

    def standing(self) -> Standing | None:
        """Return how the open study stands to what was run."""
        return None if self.editing.opened is None else self.editing.opened.standing(self.known)

    def _begin(self) -> None:
        self.known, self.items, self.chip = (), {}, VersionChip()
        self.look()

    def _take(self, found: tuple[str, tuple[Run, ...], Mapping[tuple[str, str], int]]) -> None:
        if self.editing.opened is not None and self.editing.opened.name == found[0]:
            fresh = found[1:] != (self.known, self.items)
            _, self.known, self.items = found
            self._stand()
            if fresh:
                self.changed.emit()

    def _stand(self) -> None:
        standing = self.standing()
        chip = VersionChip() if standing is None else version_chip(standing, self.known)
        if chip != self.chip:
            self.chip = chip
            self.changed.emit()


def _read(results: Path, study: str, file: Path) -> tuple[str, tuple[Run, ...], Mapping[tuple[str, str], int]]:
    found = runs(results, study)
    with contextlib.suppress(StoreError):  # a draft that cannot be written says so
        keep_what_was_run(file, found)
    return study, found, recorded_items(found)
