"""The program's only Qt application, created when the first window is needed."""

import ctypes
import os
import sys

from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QApplication

from study_app.gui.display_check import check_display
from study_app.gui.key_presses import key_presses
from study_app.gui.theme.icons import logo
from study_app.gui.theme.theme import LIGHT

_SWITCH_INTERVAL_S = 0.0005
"""How long another thread may keep the interpreter lock while the GUI thread waits for it after a Qt call."""


def application_here() -> QApplication:
    """Return the application, creating it on first use."""
    instance = QApplication.instance()
    if isinstance(instance, QApplication):
        instance.setQuitOnLastWindowClosed(False)
        return instance
    check_display()
    os.environ.setdefault(
        "MESA_SHADER_CACHE_DISABLE", "true"
    )  # its idle thread delays the program's exit by seconds under load
    if sys.platform == "win32":  # otherwise the taskbar shows Python's icon
        ctypes.windll.shell32.SetCurrentProcessExplicitAppUserModelID("LiquidStudy")
    QGuiApplication.setHighDpiScaleFactorRoundingPolicy(Qt.HighDpiScaleFactorRoundingPolicy.PassThrough)
    application = QApplication(["liquid-study"])
    application.setApplicationName("liquid-study")
    application.setStyle("Fusion")
    application.setWindowIcon(logo(32, LIGHT.accent, LIGHT.on_accent))
    application.setQuitOnLastWindowClosed(False)
    key_presses()
    sys.setswitchinterval(_SWITCH_INTERVAL_S)
    return application
