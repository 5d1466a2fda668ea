"""The body of the tab Measures: numbers and plots of a block with a method, cards of everything else."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QGridLayout, QScrollArea, QWidget

from study_app.designer.measures.card_grid import CardGrid
from study_app.designer.measures.controls import MeasureControls
from study_app.designer.measures.number_cards import EARLIER, FAILED, ForcesPlot, MeasuresView, NumberCard
from study_app.designer.measures.parts import NumberPart
from study_app.gui.theme.themed import Themed, apply_theme_within
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Card, Chip, Icon, paint_ground
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import Elided, label

if TYPE_CHECKING:
    from study_app.designer.measures.block_plots import ForcesView, FunctionView, TrackView

NUMBERS, ONE_ROW_FROM = 4, 600
PLOT_PX, HIGHEST_PX, FORCES_PX = 300, 470, 216
FUNCTION_LEGEND = (
    "Line: simulated observers. Bands: 50 and 90 % of the estimates. Bars: how often each level is presented."
)
TRACK_LEGEND = "Bands: 50 and 90 % of the estimates. Marks: the trials of one observer, filled if correct."


class NumbersRow(QWidget):
    """Four numbers side by side, in narrow places two by two."""

    def __init__(self) -> None:
        super().__init__()
        self.grid = QGridLayout(self)
        self.grid.setContentsMargins(0, 0, 0, 0)
        self.grid.setSpacing(8)
        self.parts = [NumberPart() for _ in range(NUMBERS)]
        self._columns = 0
        self._lay(NUMBERS)

    def show_numbers(self, shown: tuple[NumberCard, ...], waiting: str) -> None:
        self.setVisible(bool(shown))
        for part, one in zip(self.parts, shown, strict=False):
            part.show_card(one, waiting)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._lay(NUMBERS if self.width() >= ONE_ROW_FROM else NUMBERS // 2)

    def _lay(self, columns: int) -> None:
        if columns != self._columns:
            self._columns = columns
            for at, part in enumerate(self.parts):
                self.grid.addWidget(part, at // columns, at % columns)
            for at in range(NUMBERS):
                self.grid.setColumnStretch(at, int(at < columns))


class PlotCard(Card):
    """A plot under its heading, its units and what its marks mean."""

    def __init__(self, title: str, legend: str, plot: QWidget) -> None:
        self.heading_unit = Elided("small", "text2")
        self.heading_unit.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        super().__init__(title, padding=14, gap=4)
        self.heading_unit.setAlignment(Qt.AlignmentFlag.AlignLeft)
        self.legend = label(legend, "small", "text2", wraps=True)
        add_parts(self.column, self.heading_unit, self.legend, (plot, 1))
        self._legend = legend

    def show_heading(self, words: str, waiting: str) -> None:
        """Say what is drawn, and how far the simulations of what is to be drawn are."""
        self.heading_unit.show_text(words)
        self.legend.setText(f"{waiting[:1].upper()}{waiting[1:]}" if waiting else self._legend)


class WarningBar(Themed, QWidget):
    """A field in the colour of warnings."""

    def paintEvent(self, _event: QPaintEvent) -> None:
        paint_ground(self, self.theme.warn_bg)


class ForcesCard(Card):
    """The force of each level, what clips it, and the repair; ``repair_asked`` carries problem and words."""

    repair_asked = Signal(object, str)

    def __init__(self, plot: ForcesView) -> None:
        super().__init__(padding=14, gap=4)
        self.plot = plot
        self.shown: ForcesPlot | None = None
        self.unit = Elided("small", "text2")
        self.chips = [Chip(small=True), Chip(small=True)]
        head = hbox(label("Force at each level", "card"), (self.unit, 1), *self.chips)
        self.bar = WarningBar()
        self.words = label("", "small", wraps=True)
        self.repair = ActionButton("", "Repair", height=34)
        self.repair.setProperty("dense", "true")
        self.repair.clicked.connect(self._ask)
        parts = (Icon("warning", "warn", 18), (self.words, 1), self.repair)
        hbox(*parts, spacing=10, margins=(12, 6, 8, 6), parent=self.bar)
        add_parts(self.column, head, (plot, 1), self.bar)

    def show_forces(self, shown: ForcesPlot) -> None:
        self.shown = shown
        self.unit.show_text(shown.heading)
        for chip, state in zip(self.chips, (*shown.verdicts, None), strict=False):
            chip.setVisible(state is not None)
            if state is not None:
                chip.show_state(*state)
        self.bar.setVisible(bool(shown.warning))
        self.words.setText(shown.warning)
        self.repair.setVisible(shown.repair is not None)
        if shown.repair is not None:
            self.repair.show_action("", shown.repair.words)
        self.plot.show_plot(shown)

    def _ask(self) -> None:
        if self.shown is not None and self.shown.repair is not None:
            self.repair_asked.emit(self.shown.repair.row, self.shown.repair.words)


class MeasuresPage(Themed, QWidget):
    """Draws a `MeasuresView`; plots are made when a block with a method is first shown."""

    repair_asked = Signal(object, str)
    open_asked = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Measures")
        self.shown: MeasuresView | None = None
        self.controls = MeasureControls()
        self.numbers = NumbersRow()
        self.numbers.hide()
        self.function: FunctionView | None = None
        self.track: TrackView | None = None
        self.forces: ForcesView | None = None
        self.cards: dict[str, Card] = {}
        self.blocks, self.grid = CardGrid(), CardGrid()
        for grid in (self.blocks, self.grid):
            grid.open_asked.connect(self.open_asked)
        inside = QWidget()
        self.curves = QWidget()
        self.plots = hbox(spacing=8, margins=0, parent=self.curves)
        self.curves.setMaximumHeight(HIGHEST_PX)
        parts = (self.blocks, self.numbers, (self.curves, 3), (self.grid, 1), STRETCH)
        self.column = vbox(*parts, spacing=8, margins=0, parent=inside)
        self.area = QScrollArea()
        self.area.setWidgetResizable(True)
        self.area.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.area.setAccessibleName("Measures")
        self.area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.area.setWidget(inside)
        inside.setObjectName("earlier")
        self.earlier = label(EARLIER, "label", "warn", wraps=True)
        self.earlier.hide()
        vbox(self.earlier, self.area, margins=0, parent=self)
        self.setFocusProxy(self.area)

    def show_measures(self, shown: MeasuresView) -> None:
        """Show other measures; while the page is hidden they are kept for later."""
        self.shown = shown
        self.controls.show_values(shown.controls)
        if self.isVisible():
            self._show()

    def showEvent(self, event: object) -> None:
        super().showEvent(event)  # type: ignore[arg-type]
        self._show()

    def _show(self) -> None:
        shown = self.shown
        if shown is None:
            return
        self.earlier.setVisible(shown.earlier)
        self.area.widget().setEnabled(not shown.earlier)
        self.blocks.setVisible(shown.blocks is not None)
        self.blocks.show_cards(() if shown.blocks is None else (shown.blocks,))
        self.numbers.show_numbers(shown.numbers, shown.waiting)
        if (shown.numbers or shown.forces) and not self.cards:
            self._make_plots()
        for name, there in (("function", shown.numbers), ("track", shown.numbers), ("forces", shown.forces)):
            if name in self.cards:
                self.cards[name].setVisible(bool(there))
        self.curves.setVisible(bool(shown.numbers))
        waiting = FAILED[2] if shown.failed else shown.waiting
        for name, view, plot in (("function", self.function, shown.function), ("track", self.track, shown.track)):
            if view is not None:
                view.show_plot(plot, grey=shown.earlier or bool(shown.waiting))
                self._head(name, "" if plot is None else plot.heading, waiting)
        forces = self.cards.get("forces")
        if shown.forces is not None and isinstance(forces, ForcesCard):
            forces.show_forces(shown.forces)
        self.grid.setVisible(bool(shown.cards))
        self.grid.show_cards(shown.cards)

    def _head(self, name: str, words: str, waiting: str) -> None:
        card = self.cards[name]
        if isinstance(card, PlotCard):
            card.show_heading(words, waiting)

    def _make_plots(self) -> None:
        from study_app.designer.measures.block_plots import ForcesView, FunctionView, TrackView  # noqa: PLC0415 - pyqtgraph, once there is a plot

        self.function, self.track, self.forces = FunctionView(), TrackView(), ForcesView()
        forces = ForcesCard(self.forces)
        forces.repair_asked.connect(self.repair_asked)
        self.cards = {
            "function": PlotCard("Psychometric function", FUNCTION_LEGEND, self.function),
            "track": PlotCard("Expected track", TRACK_LEGEND, self.track),
            "forces": forces,
        }
        for name in ("function", "track"):
            self.cards[name].setMinimumHeight(PLOT_PX)
            self.plots.addWidget(self.cards[name], 1)
        forces.setMinimumHeight(FORCES_PX)
        forces.setMaximumHeight(HIGHEST_PX)
        self.column.insertWidget(3, forces, 2)
        for card in self.cards.values():
            card.hide()
            apply_theme_within(card, self.theme)
