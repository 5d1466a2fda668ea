"""The export of results: folder, contents, progress, and then a link to the written files."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QDialog, QWidget

from study_app.gui.kit.fields import Editor, Field
from study_app.gui.theme.theme import Theme
from study_app.gui.theme.themed import apply_theme
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.gui.widgets.cards import Bar
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label, set_ink
from study_app.number_text import counted

WIDTH = 600
WARNED = 3
"""Of so many files that are not as recorded each is named."""


class Extra(NamedTuple):
    """Something that is written where it is asked for: its name in the command, its words, and why it cannot be."""

    name: str
    words: str
    why_not: str = ""


class WriteDialog(QDialog):
    """Asks for a folder and what to write, then shows how far it is; Cancel leaves nothing behind.

    ``write_asked`` carries the folder and the names of the extras, ``stop_asked`` asks to give up, ``open_asked``
    carries what is to be opened.

    Parameters
    ----------
    to
        The folder that is suggested.
    extras
        What can be written in addition.
    opens
        The words on the button that opens what was written.
    """

    write_asked = Signal(object, object)
    stop_asked = Signal()
    open_asked = Signal(object)

    def __init__(
        self,
        parent: QWidget,
        theme: Theme,
        *,
        title: str,
        explanation: str,
        go_on: str,
        to: Path,
        extras: Sequence[Extra] = (),
        opens: str = "Open the folder",
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle(title)
        self.setModal(True)
        self.setMinimumWidth(WIDTH)
        self._opens = opens
        self._result: Path | None = None
        self._working = False
        self.extras = {extra.name: Editor(Field(extra.name, extra.words, "check")) for extra in extras}
        for extra in extras:
            self.extras[extra.name].setEnabled(not extra.why_not)
            self.extras[extra.name].setToolTip(extra.why_not)
        self.to = Editor(Field("to", "Folder", "folder", hint="Existing files will be overwritten."))
        self.to.show_value(str(to))
        self.said = label(explanation, "body", "text2", wraps=True)
        self.bar = Bar()
        self.bar.hide()
        self.cancel = ActionButton("", "Cancel")
        self.go_on = ActionButton("", go_on, role="primary")
        self.go_on.setDefault(True)
        self.cancel.setAutoDefault(False)
        reasons = [label(extra.why_not, "small", "text2", wraps=True) for extra in extras if extra.why_not]
        self._form = QWidget()
        vbox(*self.extras.values(), *reasons, 4, self.to, spacing=6, margins=0, parent=self._form)
        foot = hbox(self.cancel, STRETCH, self.go_on)
        parts = label(title, "title_dense"), self.said, self._form, self.bar, 6, foot
        vbox(*parts, spacing=12, margins=(28, 24, 28, 24), parent=self)
        apply_theme(self, theme)
        self.go_on.clicked.connect(self._go_on)
        self.cancel.clicked.connect(self.reject)

    def show_progress(self, what: str, share: float) -> None:
        self.said.setText(f"{what[:1].upper()}{what[1:]} …")
        self.bar.show_share(share)

    def show_written(self, files: Sequence[Path], opens: Path, warnings: Sequence[str]) -> None:
        self._working = False
        self._result = opens
        self.bar.hide()
        more = f" {len(warnings) - WARNED} more." if len(warnings) > WARNED else ""
        warned = "".join(f"\n{line}" for line in warnings[:WARNED])
        self.said.setText(f"{counted(len(files), 'file')} in {files[0].parent}.{warned}{more}")
        self.cancel.show_action("", "Close")
        self.cancel.setEnabled(True)  # it may have been written although one asked to stop
        self.go_on.show_action("", self._opens)
        self.go_on.show()
        self.go_on.setFocus()
        self._shrink()

    def show_refused(self, sentence: str) -> None:
        """Say why nothing was written; what was asked can be changed."""
        self._working = False
        self.bar.hide()
        self._form.show()
        self.said.setText(f"{sentence}.")
        set_ink(self.said, "bad")
        self.go_on.show()
        self.cancel.setEnabled(True)
        self._shrink()

    def _go_on(self) -> None:
        if self._result is not None:
            self.open_asked.emit(self._result)
            return
        if not self.to.value:
            self.to.control.setFocus()
            return
        self._working = True
        self._form.hide()
        self.go_on.hide()
        set_ink(self.said, "text2")
        self.show_progress("beginning", 0.0)
        self.bar.show()
        extras = tuple(name for name, check in self.extras.items() if check.value)
        self._shrink()
        self.write_asked.emit(Path(self.to.value).expanduser(), extras)

    def _shrink(self) -> None:
        layout = self.layout()
        if layout is not None:
            layout.activate()
        self.adjustSize()

    def reject(self) -> None:
        """Close; where something is being written, have it given up first."""
        if self._working:
            self.cancel.setEnabled(False)
            self.said.setText("Stopping …")
            self.stop_asked.emit()
            return
        super().reject()

    def stopped(self) -> None:
        """Close: it was given up, and nothing was written."""
        self._working = False
        super().reject()
