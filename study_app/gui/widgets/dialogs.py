"""Questions with a way back, notices of one sentence and one button, and the choice of a protocol's file."""

from PySide6.QtWidgets import QDialog, QFileDialog, QWidget

from study_app.gui.theme.theme import Theme
from study_app.gui.theme.themed import apply_theme
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox, vbox
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label
from study_app.workspace import workspace


def choose_protocol(parent: QWidget, title: str) -> str:
    """Ask for a file in the workspace's folder of protocols; return its path, "" where none is chosen."""
    return QFileDialog.getOpenFileName(parent, title, str(workspace().protocols), "Protocols (*.toml)")[0]


class Question(QDialog):
    """A question with a way back. It blocks nothing: whatever is asked, the force can be stopped behind it."""

    def __init__(self, parent: QWidget, theme: Theme, title: str, explanation: str) -> None:
        super().__init__(parent)
        self.setWindowTitle(title)
        self.setModal(False)
        self.column = vbox(label(title, "title_dense"), spacing=12, margins=(28, 24, 28, 24), parent=self)
        said = label(explanation, "body", "text2", wraps=True)
        said.setMinimumWidth(420)
        self.column.addWidget(said)
        self._theme = theme

    def add_buttons(self, back: str, go_on: ActionButton) -> None:
        """Put the way back at the left and the step that goes on at the right."""
        self.back, self.go_on = ActionButton("", back), go_on
        self.back.clicked.connect(self.reject)
        self.go_on.clicked.connect(self.accept)
        self.back.setAutoDefault(False)
        self.go_on.setDefault(True)
        row = hbox(self.back, STRETCH, self.go_on)
        add_parts(self.column, 8, row)
        apply_theme(self, self._theme)


class Notice(Question):
    """Something that went wrong, in one sentence."""

    def __init__(self, parent: QWidget, theme: Theme, title: str, sentence: str) -> None:
        super().__init__(parent, theme, title, sentence)
        self.close_button = ActionButton("", "Close", role="primary")
        self.close_button.clicked.connect(self.accept)
        self.close_button.setDefault(True)
        row = hbox(STRETCH, self.close_button)
        add_parts(self.column, 8, row)
        apply_theme(self, theme)
