"""Questions with a way back, and the choice of a protocol's file."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any, Final

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDialog, QFileDialog, QWidget

from study_app.gui.kit.fields import Editor, Field
from study_app.gui.theme.theme import Theme
from study_app.gui.theme.themed import apply_theme
from study_app.gui.widgets.boxes import STRETCH, Part, hbox, vbox
from study_app.gui.widgets.cards import Icon
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label
from study_app.workspace import workspace

NOTHING: Final[Mapping[str, str]] = MappingProxyType({})
REASON: Final = "Please enter a reason; it is recorded."


def choose_protocol(parent: QWidget, title: str) -> str:
    """Ask for a file in the workspace's folder of protocols; return its path, "" where none is chosen."""
    return QFileDialog.getOpenFileName(parent, title, str(workspace().protocols), "Protocols (*.toml)")[0]


class Question(QDialog):
    """A question with its fields and a way back, or a notice with one button, where no ``go_on`` is given.

    It blocks nothing: whatever is asked, the force can be stopped behind it.

    Parameters
    ----------
    go_on : the button of the step that goes on
    back : the words on the way back
    fields : what is asked
    needs : what is said where one of these fields is empty
    warning : what is said below the explanation, with a sign
    inside : what is shown below that
    width : the least width [px]
    """

    def __init__(
        self,
        parent: QWidget,
        theme: Theme,
        title: str,
        explanation: str,
        go_on: ActionButton | None = None,
        *,
        back: str = "Cancel",
        fields: Iterable[Field] = (),
        needs: Mapping[str, str] = NOTHING,
        warning: str = "",
        inside: QWidget | None = None,
        width: int = 0,
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle(title)
        self.setModal(False)
        self.setMinimumWidth(width)
        self._needs = needs
        self.editors = {one.name: Editor(one, judges=True) for one in fields}
        self.missing = label("", "label", "bad", wraps=True)
        self.missing.hide()
        self.go_on = go_on or ActionButton("", "Close", role="primary")
        self.go_on.setDefault(True)
        self.go_on.clicked.connect(self.accept)
        self.back = ActionButton("", back)
        self.back.setAutoDefault(False)
        self.back.clicked.connect(self.reject)
        self.back.setHidden(go_on is None)
        said = label(explanation, "body", "text2", wraps=True)
        said.setMinimumWidth(420)
        warns = QWidget()
        sign = Icon("warning", "warn", 20), 0, Qt.AlignmentFlag.AlignTop
        hbox(sign, (label(warning, "label", "warn", wraps=True), 1), spacing=10, margins=0, parent=warns)
        warns.setVisible(bool(warning))
        asked, foot = (*self.editors.values(), self.missing), hbox(self.back, STRETCH, self.go_on)
        parts: tuple[Part, ...] = (
            label(title, "title_dense"),
            said,
            warns,
            *([(inside, 1)] if inside else []),
            *asked,
            8,
            foot,
        )
        vbox(*parts, spacing=12, margins=(28, 24, 28, 24), parent=self)
        apply_theme(self, theme)
        next((editor.control for editor in self.editors.values()), self.go_on).setFocus()

    def value(self, name: str) -> Any:
        """Return what stands in a field."""
        return self.editors[name].value

    def accept(self) -> None:
        """Go on, unless something is missing."""
        for name, sentence in self._needs.items():
            if not self.value(name):
                self.missing.setText(sentence)
                self.missing.show()
                self.editors[name].control.setFocus()
                return
        super().accept()
