"""Differences from a version as a list: groups by effect, each difference with its place and its way back."""

from collections.abc import Sequence

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtWidgets import QScrollArea, QWidget

from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import Themed, apply_theme_within, replace_inside
from study_app.gui.widgets.boxes import hbox, vbox
from study_app.gui.widgets.cards import Icon, Rule
from study_app.gui.widgets.controls import ActionButton, IconButton
from study_app.gui.widgets.labels import label
from study_app.viewmodels.designer.versions.change_rows import ChangeGroup, ChangeRow

INDENT = 28
LEAST, HIGHEST = 96, 330


class ChangeLine(QWidget):
    """One difference; ``go`` and ``revert`` are there where it can be gone to and reverted."""

    def __init__(self, row: ChangeRow, *, can_go: bool, can_revert: bool) -> None:
        super().__init__()
        self.row = row
        self.go: IconButton | None = None
        self.revert: ActionButton | None = None
        title = label(row.title, "label", wraps=True)
        title.setFont(font("label", weight=600))
        sentence = label(_breakable(row.change.sentence), "small", "text2", wraps=True)
        sentence.setAccessibleName(row.change.sentence)
        across = hbox((vbox(title, sentence, spacing=0), 1), spacing=8, margins=(INDENT, 3, 0, 3), parent=self)
        if can_go and row.element:
            self.go = IconButton("arrow_right", f"Go to {row.title}", size=34, role="plain")
            across.addWidget(self.go)
        if can_revert and row.change.revert:
            self.revert = ActionButton("undo", "Revert", height=34)
            self.revert.setProperty("dense", "true")
            self.revert.setFont(font("label"))
            self.revert.setAccessibleName(f"Revert {row.title}: {row.change.sentence}")
            across.addWidget(self.revert)


class ChangeList(Themed, QScrollArea):
    """Draws groups of differences; ``go_asked`` and ``revert_asked`` carry a `ChangeRow`.

    Parameters
    ----------
    can_go
        Whether each difference has a button that goes to its element.
    """

    go_asked = Signal(object)
    revert_asked = Signal(object)

    def __init__(self, *, can_go: bool = True) -> None:
        super().__init__()
        self._can_go = can_go
        self.setAccessibleName("Differences")
        self.setWidgetResizable(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setMinimumHeight(LEAST)
        self.lines: list[ChangeLine] = []
        self._shown: object = None

    def sizeHint(self) -> QSize:  # noqa: N802 - Qt's name
        """Return the room for all differences, or for as many as there is room for."""
        inside = self.widget()
        return QSize(300, min(HIGHEST, inside.sizeHint().height() + 4 if inside is not None else LEAST))

    def show_groups(self, groups: Sequence[ChangeGroup], *, can_revert: bool) -> None:
        """Show other differences; the place in the list stays."""
        if (groups, can_revert) == self._shown:
            return
        self._shown = (groups, can_revert)
        scrolled = self.verticalScrollBar().value()
        inside = QWidget()
        column = vbox(spacing=4, margins=(0, 0, 8, 0), parent=inside)
        self.lines = []
        for at, group in enumerate(groups):
            if at:
                column.addWidget(Rule())
            column.addWidget(_heading(group))
            for row in group.rows:
                made = ChangeLine(row, can_go=self._can_go, can_revert=can_revert)
                if made.go is not None:
                    made.go.clicked.connect(lambda _checked=False, row=row: self.go_asked.emit(row))
                if made.revert is not None:
                    made.revert.clicked.connect(lambda _checked=False, row=row: self.revert_asked.emit(row))
                column.addWidget(made)
                self.lines.append(made)
        column.addStretch()
        apply_theme_within(inside, self.theme)
        replace_inside(self, inside)
        self.verticalScrollBar().setValue(scrolled)


def _heading(group: ChangeGroup) -> QWidget:
    made = QWidget()
    icon = Icon(group.icon, group.tone if group.tone in {"ok", "warn", "bad"} else "text2", 18)
    title = label(f"{group.title}: {len(group.rows)}", "label", group.tone)  # type: ignore[arg-type]
    title.setFont(font("label", weight=600))
    meaning = label(group.meaning, "small", "text2", wraps=True)
    hbox(icon, title, (meaning, 1), spacing=8, margins=(0, 6, 0, 2), parent=made)
    return made


def _breakable(sentence: str) -> str:
    """Return a sentence whose long place may be broken at its dots."""
    place, colon, words = sentence.partition(":")
    return place.replace(".", ".\u200b").replace("_", "_\u200b") + colon + words
