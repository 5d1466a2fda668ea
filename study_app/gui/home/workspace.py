"""The question of the first start: which folder of this machine holds protocols and results."""

from pathlib import Path

from PySide6.QtWidgets import QFileDialog, QLineEdit, QWidget

from study_app.gui.theme.theme import Theme, font
from study_app.gui.widgets.boxes import add_layout, hbox
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.dialogs import Question
from study_app.gui.widgets.labels import label


class WorkspaceDialog(Question):
    """Shows the folder that is offered; another can be chosen or typed. Nothing is created until it is accepted."""

    def __init__(self, parent: QWidget, theme: Theme, offered: Path) -> None:
        super().__init__(
            parent,
            theme,
            "Choose your workspace",
            "Protocols and results of this computer are kept in one folder. Windows and commands use it wherever they "
            "are started. You can change it later under This machine.",
        )
        self.setModal(True)
        self.setMinimumWidth(620)
        self.path = QLineEdit(str(offered))
        self.path.setFont(font("body"))
        self.path.setAccessibleName("Workspace folder")
        self.choose = ActionButton("", "Choose …", height=40)
        self.choose.setAutoDefault(False)
        self.choose.clicked.connect(self._choose)
        add_layout(self.column, hbox((self.path, 1), self.choose, spacing=8))
        holds = label("It will contain the folders protocols and results.", "label", "text2")
        self.column.addWidget(holds)
        self.add_buttons("Not now", ActionButton("check", "Use this folder", role="primary"))
        self.path.textChanged.connect(lambda text: self.go_on.setEnabled(bool(text.strip())))
        self.go_on.setFocus()

    @property
    def folder(self) -> Path:
        """The folder in the field."""
        return Path(self.path.text().strip()).expanduser()

    def _choose(self) -> None:
        chosen = QFileDialog.getExistingDirectory(self, "Workspace", self.path.text())
        if chosen:
            self.path.setText(chosen)
