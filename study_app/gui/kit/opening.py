"""Open files and folders with the system's default programs."""

import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path

from PySide6.QtCore import QTimer, QUrl
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QApplication, QWidget

from study_app.gui.kit.dialogs import Question
from study_app.gui.theme.theme import LIGHT

_POLL_MS = 200
_POLLS = 50
"""The number of polls after which a program that still runs is assumed to show the file."""


def open_here(path: Path) -> None:
    """Open a file or folder with the system's program for it; a notice names the path if none can open it."""
    opener = shutil.which("xdg-open") if sys.platform == "linux" else None  # Qt does not wait for its exit code
    if opener is None:
        if not QDesktopServices.openUrl(QUrl.fromLocalFile(str(path.resolve()))):
            _show_not_opened(path)
        return
    process = subprocess.Popen(  # noqa: S603 - the path is an argument, without a shell
        [opener, str(path.resolve())], start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    _check_opened(process, path, _POLLS)


def _check_opened(process: subprocess.Popen[bytes], path: Path, polls: int) -> None:
    code = process.poll()
    if code:
        _show_not_opened(path)
    elif code is None and polls:
        QTimer.singleShot(_POLL_MS, partial(_check_opened, process, path, polls - 1))


def _show_not_opened(path: Path) -> None:
    window = QApplication.activeWindow() or next(filter(QWidget.isVisible, QApplication.topLevelWidgets()), None)
    if window is not None:
        sentence = f"This computer could not open {path.resolve()}. Open the file with a suitable program."
        Question(window, getattr(window, "theme", LIGHT), "Not opened", sentence).open()
