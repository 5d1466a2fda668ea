"""A workspace with one study of its own, and the designer in the main window."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QEvent, QSize
from PySide6.QtWidgets import QApplication

from study_app.app.designer.controller import DesignerController
from study_app.gui.home.main_window import MainWindow
from study_app.gui.widgets.main_view import Place
from study_app.protocol.source.files import shipped_file


def no_worker() -> None:
    """Refuse to start the worker of slow numbers: tests that need it give another one."""
    raise OSError("no process in this test")


class Designer:
    """The designer with its window; ``file`` is the workspace's study, a copy of the demo."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "protocols" / "kitchen.toml"
        self.file.parent.mkdir()
        demo = shipped_file("demo").read_bytes()
        self.file.write_bytes(demo.replace(b'name = "demo"', b'name = "kitchen"'))
        self.results = folder / "results"
        self.controller = DesignerController(self.results)
        self.controller.measures.slow.make = no_worker
        self.editing, self.saving = self.controller.editing, self.controller.saving
        self.place = self.controller.place
        self.messages: list[tuple[str, str]] = []
        self.place.message.connect(lambda title, sentence: self.messages.append((title, sentence)))
        self.window = MainWindow({"home": Place, "designer": lambda: self.place})
        self.window.resize(QSize(1600, 1000))
        self.window.show()
        self.window.activateWindow()
        self.window.go("designer")

    def select(self, path: tuple[str | int, ...]) -> None:
        """Select an element, and let the participant's page follow."""
        self.editing.select(path)
        QApplication.processEvents()

    def row(self, *path: str | int) -> Any:
        """The form's row of a place."""
        return next(row for row in self.place.form.rows if row.row.row.path == path)

    @property
    def text(self) -> str:
        """The text of the open study."""
        assert self.editing.opened is not None
        return self.editing.opened.study.text


@pytest.fixture
def designer(qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Designer]:
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    made = Designer(tmp_path)
    qtbot.waitUntil(made.window.isActiveWindow)
    yield made
    made.window.close()
    made.window.deleteLater()
    made.controller.deleteLater()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


@pytest.fixture(params=["special editors", "no special editors"])
def editors(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run a test with the special editors and without any."""
    if request.param == "no special editors":
        monkeypatch.setattr("study_app.gui.designer.form.row_widget.EDITORS", {})
