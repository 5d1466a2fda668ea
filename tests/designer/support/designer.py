"""The designer in the main window without a screen, with one study of its own; driven by keys, names and clicks."""

from pathlib import Path
from typing import Any

from PySide6.QtCore import QEvent, QPoint, QSize, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from study_app.app.session.playing import Playing
from study_app.designer.controller import DesignerController
from study_app.designer.outline import ROW_ROLE
from study_app.gui.home.main_window import MainWindow
from study_app.gui.widgets.main_view import Place
from study_app.protocol.source.document import value_at
from study_app.protocol.source.files import shipped_file
from tests.designer.support.inputs import HELD, QtInput
from tests.designer.support.users import KeyUser

DEMO = shipped_file("demo").read_text(encoding="utf-8").replace('name = "demo"', 'name = "kitchen"')
NONE, LEFT = Qt.KeyboardModifier.NoModifier, Qt.MouseButton.LeftButton


def no_worker() -> None:
    """Refuse to start the simulation worker; tests that need one set another."""
    raise OSError("no process in this test")


class Designer(KeyUser):
    """The designer with its window; ``file`` is the workspace's study, a copy of the demo."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "protocols" / "kitchen.toml"
        self.file.parent.mkdir()
        self.file.write_text(DEMO, encoding="utf-8", newline="\n")
        self.results = folder / "results"
        self.controller = DesignerController(self.results)
        self.playing = Playing(self.controller)
        self.controller.measures.make = no_worker
        self.editing, self.saving = self.controller.editing, self.controller.saving
        self.place = self.controller.place
        self.messages: list[tuple[str, str]] = []
        self.place.message.connect(lambda title, sentence: self.messages.append((title, sentence)))
        self.place.file_message.connect(lambda title, sentence, _file: self.messages.append((title, sentence)))
        window = MainWindow({"home": Place, "designer": lambda: self.place})
        super().__init__(window, QtInput())
        self.window: Any = window
        window.resize(QSize(1600, 1000))
        window.show()
        window.activateWindow()
        window.go("designer")

    def close(self) -> None:
        """Close the window and delete it at once."""
        self.window.close()
        self.window.deleteLater()
        self.controller.deleteLater()
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)

    def change(self, *pairs: tuple[str, str]) -> str:
        """Replace texts in the file of the study, each where it stands first; return the text before."""
        before = text = self.file.read_text(encoding="utf-8")
        for old, new in pairs:
            assert old in text, old
            text = text.replace(old, new, 1)
        self.file.write_text(text, encoding="utf-8", newline="\n")
        return before

    def open(self, name: str = "kitchen", *path: str | int, width: int = 0) -> None:
        """Open a study, in a window of a width, and select an element."""
        if width:
            self.window.resize(width, 768)
        self.controller.open(name)
        if path:
            self.go_to(*path)

    def go_to(self, *path: str | int) -> None:
        """Select an element by its path, and let the participant's page follow."""
        self.editing.select(path)
        QApplication.processEvents()

    @property
    def text(self) -> str:
        """Return the text of the open study."""
        assert self.editing.opened is not None
        return self.editing.opened.study.text

    @property
    def study(self) -> Any:
        """Return the open study."""
        assert self.editing.opened is not None
        return self.editing.opened.study

    def value(self, *path: str | int) -> Any:
        """Return the value at a path of the open study."""
        return value_at(self.study.document, path)

    @property
    def steps(self) -> list[str]:
        """Return the titles of the steps."""
        assert self.editing.opened is not None
        return [step.title for step in self.editing.opened.done]

    def undo_all(self) -> str:
        """Undo every step; return the text then."""
        while self.steps:
            self.editing.undo()
        return self.text

    def form_row(self, *path: str | int) -> Any:
        """Return the form's row of a path."""
        return next(row for row in self.place.form.rows if row.row.path == path)

    def field(self, *path: str | int) -> Any:
        """Return the form's field of a path."""
        return self.form_row(*path).field

    @property
    def keyboard(self) -> Any:
        """Return the focused widget."""
        return QApplication.focusWidget()

    def hit(self, keys: str, times: int = 1) -> Any:
        """Press keys on the focused widget; return the widget that has the focus then."""
        self.key(keys, times)
        QApplication.processEvents()
        return self.keyboard

    def fill(self, field: Any, text: str, keys: str = "Return") -> None:
        """Type a text in place of what a field holds, then press keys."""
        field.setFocus()
        field.selectAll()
        QTest.keyClicks(field, text)
        if keys:
            self.key(keys)

    def click_on(self, part: QWidget, held: str = "", at: QPoint | None = None) -> None:
        """Click a part, in its middle unless a place is given."""
        QTest.mouseClick(part, LEFT, HELD[held] if held else NONE, part.rect().center() if at is None else at)

    def index(self, *path: str | int) -> Any:
        """Return the index of an element's first row in the outline."""
        return next(index for index in self.outline.indexes() if index.data(ROW_ROLE).path == path)
