"""Fixtures for tests of the composition root, without a screen."""

from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication

from study_app.app.main_controller import MainController


@pytest.fixture
def visit(qapp: Any, tmp_path: Path) -> Any:
    controller = MainController(tmp_path / "results")
    controller.window.show()
    yield controller
    controller.window.close()
    controller.end()
    controller.window.deleteLater()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
