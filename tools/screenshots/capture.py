"""Waits until a window shows what is wanted of it, and keeps a picture of it."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Final, TypeVar

from PySide6.QtCore import QBuffer, QEventLoop, QIODevice, QSize
from PySide6.QtWidgets import QApplication, QDialog, QWidget

from study_app.errors import StudyError
from study_app.gui.widgets.background import wait_for_jobs
from study_app.store.files.atomic import write_file

PATIENCE_S: Final = 180.0  # the first session after an installation compiles
SETTLED_MS: Final = 250
PAINTED_S: Final = 2.0
TURN_MS: Final = 20

T = TypeVar("T")


class Camera:
    """Takes pictures into a folder, which must exist; ``progress`` is given a line for every picture.

    Every window that is no dialog is taken in each of ``sizes`` (width and height in logical px), too.
    """

    def __init__(self, to: Path, progress: Callable[[str], object], sizes: tuple[tuple[int, int], ...] = ()) -> None:
        self._to, self._progress, self.sizes = to, progress, sizes
        self.taken: list[Path] = []

    def until(self, found: Callable[[], T | None], what: str) -> T:
        """Let the program go on until ``found`` returns something, and return that.

        Raises
        ------
        StudyError
            It did not come.
        """
        deadline = time.perf_counter() + PATIENCE_S
        while not (it := found()):
            if time.perf_counter() > deadline:
                raise StudyError(f"no picture could be taken: {what} did not appear within {PATIENCE_S:g} s")
            self._turn()
        return it

    def wait(self, milliseconds: int) -> None:
        """Process events for this time."""
        deadline = time.perf_counter() + milliseconds / 1000
        while time.perf_counter() < deadline:
            self._turn()

    def take(self, window: QWidget, name: str, size: tuple[int, int] | None = None, *, at_once: bool = False) -> None:
        """Keep a picture of a window, in ``size`` [logical px] where that is given, once it has settled.

        Raises
        ------
        StoreError
            The file cannot be written.
        """
        if size is not None:
            window.resize(QSize(*size))
        if not at_once:
            self.wait(SETTLED_MS)
        self._keep(window, name)
        for width, height in () if isinstance(window, QDialog) or at_once else self.sizes:
            before = window.size()
            window.resize(width, height)
            self.wait(SETTLED_MS)
            wait_for_jobs(PAINTED_S)  # a tank's glass is painted for each size
            self.wait(SETTLED_MS)
            self._keep(window, f"{name}-{width}x{height}")
            window.resize(before)

    def _keep(self, window: QWidget, name: str) -> None:
        held = QBuffer()
        held.open(QIODevice.OpenModeFlag.WriteOnly)
        window.grab().save(held, "PNG")
        path = self._to / f"{name}.png"
        write_file(path, bytes(held.data().data()))
        self.taken.append(path)
        self._progress(str(path))

    @staticmethod
    def _turn() -> None:
        QApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, TURN_MS)
        time.sleep(0.002)  # what runs in other threads goes on, too


def shown(kind: type[T]) -> T | None:
    """Return the window of a kind that is shown."""
    return next((one for one in QApplication.topLevelWidgets() if isinstance(one, kind) and one.isVisible()), None)
