"""Dialogs that can be cancelled, and the choice of a protocol file."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any, Final

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QDialog, QFileDialog, QProgressBar, QWidget

from study_app.gui.kit.fields import Editor, Field
from study_app.gui.theme.theme import Theme
from study_app.gui.theme.themed import apply_theme
from study_app.gui.widgets.boxes import STRETCH, Part, hbox, vbox
from study_app.gui.widgets.cards import Icon
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label, set_ink
from study_app.workspace import workspace

_NO_NEEDS: Final[Mapping[str, str]] = MappingProxyType({})
STEPS: Final = 1000  # of a progress bar
REASON: Final = "Please enter a reason. It will be recorded."


def choose_protocol(parent: QWidget, title: str) -> str:
    """Ask for a file in the workspace's protocols; return its path, or "" if the dialog was cancelled."""
    return QFileDialog.getOpenFileName(parent, title, str(workspace().protocols), "Protocols (*.toml)")[0]


class Question(QDialog):
    """A question with fields and Cancel, or a notice with one button if no ``go_on`` is given.

    It is not modal, so that the force can be stopped while it is open.

    Parameters
    ----------
    go_on : the text of the button that continues
    back : the text of the button that goes back
    other : the text of a third button, which also closes the question
    fields : the fields of the question
    needs : the message if one of these fields is empty
    warning : a warning below the explanation
    inside : a widget below the warning
    width : the minimum width [px]
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
        other: ActionButton | None = None,
        fields: Iterable[Field] = (),
        needs: Mapping[str, str] = _NO_NEEDS,
        warning: str = "",
        inside: QWidget | None = None,
        width: int = 0,
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle(title)
        self.setModal(False)
        self.setMinimumWidth(width)
        self._needs = needs
        self.editors = {field.name: Editor(field, judges=True) for field in fields}
        self.missing = label("", "label", "bad", wraps=True)
        self.missing.hide()
        self.go_on = go_on or ActionButton("", "Close", role="primary")
        self.go_on.setDefault(True)
        self.go_on.clicked.connect(self.accept)
        self.back = ActionButton("", back)
        self.back.setAutoDefault(False)
        self.back.clicked.connect(self.reject)
        self.back.setHidden(go_on is None)
        if other is not None:
            other.setAutoDefault(False)
            other.clicked.connect(self.reject)
        self.said = label(explanation, "body", "text2", wraps=True)
        self.said.setMinimumWidth(420)
        warning_row = QWidget()
        sign = Icon("warning", "warn", 20), 0, Qt.AlignmentFlag.AlignTop
        hbox(sign, (label(warning, "label", "warn", wraps=True), 1), spacing=10, margins=0, parent=warning_row)
        warning_row.setVisible(bool(warning))
        parts: tuple[Part, ...] = (
            label(title, "title_dense"),
            self.said,
            warning_row,
            *([(inside, 1)] if inside else []),
            *self.editors.values(),
            self.missing,
            8,
            hbox(self.back, STRETCH, *([other] if other else []), self.go_on, spacing=10),
        )
        vbox(*parts, spacing=12, margins=(28, 24, 28, 24), parent=self)
        apply_theme(self, theme)
        next((editor.control for editor in self.editors.values()), self.go_on).setFocus()

    def value(self, name: str) -> Any:
        """Return the value of a field."""
        return self.editors[name].value

    def accept(self) -> None:
        """Accept unless an answer is missing."""
        if self.check_answers():
            super().accept()

    def check_answers(self) -> bool:
        """Return whether all answers are present and valid; if not, focus the first that is not and show the reason."""
        for editor in self.editors.values():
            try:
                _ = editor.value
            except ValueError as refusal:
                editor.show_refusal(str(refusal))
                editor.control.setFocus()
                return False
        for name, sentence in self._needs.items():
            if not self.value(name):
                self.missing.setText(sentence)
                self.missing.show()
                self.editors[name].control.setFocus()
                return False
        self.missing.hide()
        return True


class Work(Question):
    """A question that starts a job, then shows its progress and a link to its result.

    ``begun`` is emitted when the job should start and ``stop_asked`` when it should be cancelled; call `close_stopped`
    once it has stopped. ``opened`` is emitted when the result should be shown.
    """

    begun = Signal()
    stop_asked = Signal()
    opened = Signal()

    def __init__(self, *arguments: Any, **more: Any) -> None:
        self.bar = QProgressBar(textVisible=False)
        self.bar.setFixedHeight(8)
        super().__init__(*arguments, inside=self.bar, **more)
        self.setModal(True)
        self.bar.hide()
        self.working = self.over = False

    def show_progress(self, sentence: str, share: float | None = None) -> None:
        """Show the current activity and the fraction done (0 to 1), if known."""
        self.said.setText(sentence)
        self.bar.setRange(0, 0 if share is None else STEPS)
        self.bar.setValue(round(STEPS * (share or 0.0)))

    def show_done(self, sentence: str, opens: str) -> None:
        """Show the result; the button ``opens`` it."""
        self._show_end(sentence)
        self.over = True
        self.back.show_action("", "Close")
        self.go_on.show_action("", opens)
        self.go_on.setFocus()

    def show_refused(self, sentence: str) -> None:
        """Show why the job was rejected; the answers can be changed."""
        for editor in self.editors.values():
            editor.show()
        set_ink(self.said, "bad")
        self._show_end(sentence)

    def close_stopped(self) -> None:
        """Close after the job was cancelled."""
        self.working = False
        super().reject()

    def accept(self) -> None:
        """Start the job, or open its result."""
        if self.over:
            self.opened.emit()
        elif not self.working and self.check_answers():
            self.working = True
            for part in (*self.editors.values(), self.go_on):
                part.hide()
            set_ink(self.said, "text2")
            self.show_progress("Beginning…")
            self.bar.show()
            self._shrink()
            self.begun.emit()

    def reject(self) -> None:
        """Close the dialog, or cancel the running job."""
        if not self.working:
            super().reject()
        elif self.back.isEnabled():
            self.back.setEnabled(False)
            self.said.setText("Stopping…")
            self.stop_asked.emit()

    def _show_end(self, sentence: str) -> None:
        self.working = False
        self.bar.hide()
        self.said.setText(sentence)
        self.go_on.show()
        self.back.setEnabled(True)  # disabled if the job ended after a request to stop
        self._shrink()

    def _shrink(self) -> None:
        layout = self.layout()
        if layout is not None:
            layout.activate()
        self.adjustSize()
