"""Notices that another program changes the file of the open study, while the designer is shown."""

from typing import Final

from PySide6.QtCore import QFileSystemWatcher, QObject, Qt, QTimer, Signal
from PySide6.QtGui import QGuiApplication

from study_app.designer.place.editing import Editing

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
        self._resting = QTimer(self)
        self._resting.setInterval(REST_MS)
        self._resting.setSingleShot(True)
        self._resting.timeout.connect(self._touch)
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
