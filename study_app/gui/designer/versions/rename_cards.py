"""Cards about a new id: what it breaks where answers are recorded, and the comments that mention the old one."""

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QScrollArea, QWidget

from study_app.gui.designer.prompts import Prompt
from study_app.gui.widgets.boxes import add_layout, vbox
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label


class UnlockCard(Prompt):
    """What another id of a question breaks; ``answered`` comes where it is to be changed all the same."""

    def __init__(self, name: str, why: str, breaks: Sequence[str]) -> None:
        super().__init__(f"Change the id “{name}”?", f"{why} With another id:")
        for words in breaks:
            self.column.addWidget(label(f"•  {words}", "label", wraps=True))
        self.go_on = ActionButton("", "Change the id", role="danger", height=40)
        self.go_on.clicked.connect(lambda: self.answered.emit(name))
        self.buttons.addWidget(self.go_on)
        add_layout(self.column, self.buttons)
        self.first: QWidget = self.cancel


class CommentsCard(Prompt):
    """Comments that mention a name that is no longer there; ``line_asked`` carries a line, from 1."""

    line_asked = Signal(int)

    def __init__(self, name: str, comments: Sequence[tuple[int, str]]) -> None:
        super().__init__(
            title_of(name, comments), "Renaming does not change comments. Correct them in the file where needed."
        )
        inside = QWidget()
        column = vbox(spacing=2, margins=0, parent=inside)
        self.lines: list[ActionButton] = []
        for line, text in comments:
            made = ActionButton("", f"Line {line}:  {_cut(text)}", role="plain", height=34)
            made.setProperty("dense", "true")
            made.setAccessibleName(f"Go to line {line}: {text}")
            made.setToolTip(text)
            made.clicked.connect(lambda _checked=False, line=line: self.line_asked.emit(line))
            column.addWidget(made, 0, Qt.AlignmentFlag.AlignLeft)
            self.lines.append(made)
        column.addStretch()
        area = QScrollArea()
        area.setWidgetResizable(True)
        area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        area.setWidget(inside)
        area.setMinimumHeight(min(160, 38 * len(comments) + 6))
        self.column.addWidget(area, 1)
        self.cancel.setText("Close")
        add_layout(self.column, self.buttons)
        self.first: QWidget = self.cancel


def title_of(name: str, comments: Sequence[tuple[int, str]]) -> str:
    """Return how many comments mention a name."""
    count = "1 comment mentions" if len(comments) == 1 else f"{len(comments)} comments mention"
    return f"{count} “{name}”"


def _cut(text: str) -> str:
    return text if len(text) <= 90 else f"{text[:89].rstrip()}…"
