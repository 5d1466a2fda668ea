"""Cards below the file: the session in numbers, and the force of each liquid."""

from __future__ import annotations

from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QVBoxLayout, QWidget

from study_app.gui.theme.themed import dress, take_away
from study_app.gui.widgets.cards import SHADOW, Bar, Card, Chip, Icon
from study_app.gui.widgets.labels import Elided, figures, label
from study_app.viewmodels.designer.fact_cards import FactCards

HEIGHT = 166
LINES = 4
"""So many liquids are shown; how many more there are is said."""


class FactsRow(QWidget):
    """Draws `FactCards`."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Facts")
        self.setFixedHeight(HEIGHT)
        self.shown = FactCards()
        self.session = Card("Session", padding=16, gap=8)
        self._figures = QHBoxLayout()
        self._figures.setSpacing(18)
        self.session.column.addLayout(self._figures)
        self.texts = Chip()
        self.session.column.addWidget(self.texts)
        self.session.column.addStretch()
        self.limit = label("", "small", "text2")
        self.force = Card("Force of each liquid", self.limit, padding=16, gap=6)
        self._lines = QWidget()
        self.force.column.addWidget(self._lines, 1)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(14 - 2 * SHADOW)
        row.addWidget(self.session, 1)
        row.addWidget(self.force, 1)

    def show_facts(self, shown: FactCards) -> None:
        """Show other numbers."""
        if shown == self.shown:
            return
        self.shown = shown
        while self._figures.count():
            part = self._figures.takeAt(0).widget()
            if part is not None:
                take_away(part)
        for number, word in shown.figures:
            pair = QWidget()
            column = QVBoxLayout(pair)
            column.setContentsMargins(0, 0, 0, 0)
            column.setSpacing(0)
            value = figures(number, "number")
            value.setAccessibleName(f"{number} {word}")
            column.addWidget(value)
            column.addWidget(label(word, "small", "text2"))
            self._figures.addWidget(pair)
        self._figures.addStretch()
        self.texts.show_state(*shown.texts)
        self.limit.setText(shown.limit)
        lines = QWidget()
        grid = QGridLayout(lines)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setVerticalSpacing(4)
        grid.setColumnStretch(1, 1)
        for at, line in enumerate(shown.forces[:LINES]):
            name = Elided("label")
            name.setFixedWidth(96)
            name.show_text(line.title)
            bar = Bar(6)
            bar.show_share(line.share)
            verdict = "clipped by the force limit" if line.clipped else "below the force limit"
            icon = Icon("warning" if line.clipped else "check", "bad" if line.clipped else "ok", 16)
            icon.setAccessibleName(f"{line.title}: {line.force}, {verdict}")
            icon.setToolTip(verdict)
            for across, part in enumerate((name, bar, figures(line.force), icon)):
                grid.addWidget(part, at, across)
        if len(shown.forces) > LINES:
            grid.addWidget(label(f"and {len(shown.forces) - LINES} more", "small", "text2"), LINES, 0, 1, 2)
        grid.setRowStretch(LINES + 1, 1)
        self.force.column.replaceWidget(self._lines, lines)
        take_away(self._lines)
        self._lines = lines
        dress(self, self.session.theme)
