"""Presets written beside the windows: a disk may take its time, and a program that ends waits for it."""

from __future__ import annotations

import threading
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QObject, Qt, Signal

from study_app.lab.presets import liquids_at_hand, preset_text, save
from study_app.lab.workbench import Setting

PATIENCE_S = 20.0


class LabSaving(QObject):
    """Writes presets, one at a time, and looks which liquids there are then.

    ``saved`` carries the liquids at hand (a tuple of `Choice`), ``failed`` what was met instead.
    """

    saved = Signal(object)
    failed = Signal(object)
    _done = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self._before: threading.Thread | None = None
        self._done.connect(self._tell, Qt.ConnectionType.QueuedConnection)

    def save(self, path: Path, setting: Setting, at_hand: tuple[str, ...]) -> None:
        """Write a setting as a preset to ``path``; ``at_hand`` are files to look for liquids in, beside the usual."""
        words = (self._before, path, setting, at_hand)
        self._before = threading.Thread(target=self._write, args=words, name="preset", daemon=True)
        self._before.start()

    def wait(self) -> None:
        """Wait until everything is on the disk, and tell of it."""
        if self._before is not None:
            self._before.join(PATIENCE_S)
            QCoreApplication.sendPostedEvents(self)

    def _write(self, before: threading.Thread | None, path: Path, setting: Setting, at_hand: tuple[str, ...]) -> None:
        """Write a preset, in a thread of its own, after the one before."""
        if before is not None:
            before.join()
        try:
            save(path, preset_text(setting))
            found: object = liquids_at_hand(saved=(*at_hand, str(path)))
        except Exception as error:  # noqa: BLE001 - handed over, not swallowed: a thread has nobody to raise it to
            found = error
        self._done.emit(found)

    def _tell(self, found: object) -> None:
        (self.failed if isinstance(found, Exception) else self.saved).emit(found)
