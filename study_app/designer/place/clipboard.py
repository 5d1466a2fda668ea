"""Copying and pasting elements of a study, as TOML on the clipboard."""

from PySide6.QtCore import QObject
from PySide6.QtGui import QGuiApplication

from study_app.designer.document.fragments import copied
from study_app.designer.document.names import named_at
from study_app.designer.place.editing import Editing
from study_app.designer.place.requests import Paste
from study_app.designer.place.view import DesignerPlace
from study_app.protocol.source.document import Path


class Clipboard(QObject):
    """Copies selected elements, and pastes after the selected one; copying works in read-only studies too."""

    def __init__(self, editing: Editing, place: DesignerPlace) -> None:
        super().__init__(editing)
        self.editing, self.place = editing, place
        place.copy_asked.connect(self.copy)
        place.paste_asked.connect(self.paste)

    def copy(self, paths: tuple[Path, ...]) -> None:
        """Put elements on the clipboard; an entry of a list of names stands for what it names."""
        opened = self.editing.opened
        if opened is None or not opened.study.is_toml:
            return
        things = [named_at(opened.study.document, path) or path for path in paths]
        if text := copied(opened.study, things):
            QGuiApplication.clipboard().setText(text)
            self.place.show_step((), "Copied", fresh=False)

    def paste(self) -> None:
        """Paste what is on the clipboard."""
        text = QGuiApplication.clipboard().text()
        if text.strip():
            self.editing.ask(Paste(self.editing.selected, text))
