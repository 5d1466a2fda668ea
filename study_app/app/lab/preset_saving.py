"""Presets written in the background: a disk may take its time, and a program that ends waits for it."""

import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QObject, Qt, Signal

from study_app.haptics.model.scene import Scene
from study_app.lab.ab_comparison import Setting
from study_app.lab.presets import Choice, liquids_at_hand, liquids_of, preset_text, save, spoken
from study_app.lab.setting_in_study import use_in_study

PATIENCE_S = 20.0


class LabSaving(QObject):
    """The liquids at hand; writes presets, one at a time, and looks which liquids there are then.

    ``said`` tells what was written or opened last. ``saved`` comes when something was written, ``failed`` carries what
    was met instead.
    """

    saved = Signal()
    failed = Signal(object)
    _done = Signal(object)

    def __init__(self, liquids: tuple[Choice, ...]) -> None:
        super().__init__()
        self.liquids = liquids
        self.said = ""
        self._before: threading.Thread | None = None
        self._files: list[tuple[Scene, Path]] = []
        self._done.connect(self._tell, Qt.ConnectionType.QueuedConnection)

    def save(self, path: Path, setting: Setting) -> None:
        """Write a setting as a preset to ``path``."""
        self._begin(partial(self._save, path, setting), (str(path),))

    def use(self, study: Path, setting: Setting) -> None:
        """Name a setting's file in a study, after it was saved in the study's folder where it has no file yet."""
        self._begin(partial(self._use, study, setting), ())

    def open(self, path: Path) -> Choice:
        """Have the liquids of a file at hand; return the first.

        Raises
        ------
        ProtocolError
            Every problem of the file.
        """
        found = liquids_of(str(path))
        self.liquids = (*(it for it in self.liquids if it not in found), *found)
        if len(found) == 1:
            self._files.insert(0, (found[0].scene, path))
        self.said = f"Opened {path.name}: {', '.join(spoken(it.liquid) for it in found)}"
        return found[0]

    def wait(self, patience_s: float = PATIENCE_S) -> None:
        """Wait until everything is on the disk, and tell of it."""
        if self._before is not None:
            self._before.join(patience_s)
            QCoreApplication.sendPostedEvents(self)

    def _begin(self, write: Callable[[], str], more: tuple[str, ...]) -> None:
        at_hand = (*(it.source for it in self.liquids), *more)
        self._before = threading.Thread(
            target=self._write, args=(self._before, write, at_hand), name="preset", daemon=True
        )
        self._before.start()

    def _write(self, before: threading.Thread | None, write: Callable[[], str], at_hand: tuple[str, ...]) -> None:
        """Write, in a thread of its own, after the one before."""
        if before is not None:
            before.join()
        try:
            found: object = write(), liquids_at_hand(saved=at_hand)
        except Exception as error:  # noqa: BLE001 - handed over: a thread has no caller to raise it to
            found = error
        self._done.emit(found)

    def _save(self, path: Path, setting: Setting) -> str:
        save(path, preset_text(setting))
        self._files = [(setting.scene, path), *((scene, file) for scene, file in self._files if file != path)]
        return f"Saved as {path.name} in {path.parent}"

    def _use(self, study: Path, setting: Setting) -> str:
        file = next((path for scene, path in self._files if scene == setting.scene and path.is_file()), None)
        return use_in_study(study, setting, file)

    def _tell(self, found: Exception | tuple[str, tuple[Choice, ...]]) -> None:
        if isinstance(found, Exception):
            self.failed.emit(found)
            return
        self.said, written = found
        self.liquids = tuple(dict.fromkeys((*self.liquids, *written)))
        self.saved.emit()
