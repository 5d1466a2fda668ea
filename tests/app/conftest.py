"""What meets in the composition root is tested without a screen, as the windows are."""

from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication

from study_app.app.main_controller import MainController


@pytest.fixture
def visit(qapp: Any, tmp_path: Path) -> Any:
    made = MainController(tmp_path / "results")
    made.window.show()
    yield made
    made.window.close()
    made.end()
    made.window.deleteLater()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
