"""The tab Measures: numbers and plots of a block with a method, cards of everything else; and the cards below tabs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QObject, Qt, Signal
from PySide6.QtGui import QPaintEvent, QShowEvent
from PySide6.QtWidgets import QScrollArea, QSizePolicy, QToolTip, QWidget

from study_app.designer.measures.cards import UNKNOWN, CardGrid, NumbersRow, Verdict
from study_app.designer.measures.levels import LevelBlock, LevelWords, rounded
from study_app.designer.measures.measures_view import FAILED, NO_FORCES, MeasuresView
from study_app.designer.measures.simulation import Controls
from study_app.designer.parts import cut_text, small_button
from study_app.designer.problems import ProblemRow
from study_app.gui.theme.theme import Tone
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Card, Chip, Icon, paint_ground
from study_app.gui.widgets.labels import Elided, label
from study_app.gui.widgets.numbers import NumberField
from study_app.haptics.model.device_dynamics import ASSUMED_TICKS
from study_app.number_text import capitalised, unclear_number
from study_app.protocol.checks.force_limits import check_clipping, unpaced_clipping_warning

if TYPE_CHECKING:
    from study_app.designer.measures.plots import ForcesView, FunctionView, TrackView

_EARLIER = "These numbers describe the last valid state: correct the problems to update them."
_FIELD_PX = 48
PLOT_PX, HIGHEST_PX, FORCES_PX = 300, 470, 216
_FUNCTION_LEGEND = (
    "Line: simulated observers. Bands: 50 and 90 % of the estimates. Bars: how often each level is presented."
)
_TRACK_LEGEND = "Bands: 50 and 90 % of the estimates. Marks: the trials of one observer, filled if correct."
FACTS_MOST, FACTS_LEAST = 366, 190
FACTS_SHARE, HIGH_FROM = 0.3, 940
"""The share of a window's height that the cards take at most; in windows as high as this two rows are shown whole."""


class Control(QWidget):
    """A number with its words before and its unit behind it; ``entered`` carries what was typed or stepped to."""

    entered = Signal(float)

    def __init__(self, text: str, unit: str, step: float) -> None:
        super().__init__()
        self._value, self._step = 0.0, step
        self.words, self.unit = label(text, "small", "text2"), label(unit, "small", "text2")
        self.field = NumberField()
        self.field.setFixedWidth(_FIELD_PX)
        self.setSizePolicy(QSizePolicy.Policy.Maximum, QSizePolicy.Policy.Preferred)
        hbox(self.words, self.field, self.unit, spacing=6, margins=0, parent=self)
        self.show_words(text, unit)
        self.field.entered.connect(self._enter_value)
        self.field.unread.connect(self._show_refusal)
        self.field.abandoned.connect(lambda: self.field.show_state(""))
        self.field.stepped.connect(lambda steps: self.entered.emit(self._value + steps * self._step))

    def show_words(self, text: str, unit: str) -> None:
        self.words.setText(text.removeprefix("simulated "))
        self.unit.setText(unit)
        self.unit.setVisible(bool(unit))
        self.field.setAccessibleName(f"{text}, {unit}" if unit else text)

    def _enter_value(self, value: float) -> None:
        self.field.show_state("")
        self.entered.emit(value)

    def _show_refusal(self, text: str) -> None:
        """Leave the text in the field and show above it why it is not a number."""
        why = f"{unclear_number(text)}, or press Esc"
        self.field.show_state("refused")
        self.field.setAccessibleDescription(why)
        QToolTip.showText(self.field.mapToGlobal(self.field.rect().topLeft()), why, self.field)

    def show_number(self, text: str) -> None:
        self._value = float(text)
        self.field.show_text(text)


class _MeasureControls(QWidget):
    """Simulated threshold, lapse rate and participants."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("What is simulated")
        self.threshold = Control("simulated JND", "%", 1.0)
        self.lapses = Control("lapses", "%", 1.0)
        self.participants = Control("participants", "", 1.0)
        hbox(STRETCH, self.threshold, self.lapses, self.participants, spacing=10, margins=0, parent=self)

    def show_values(self, shown: Controls, wording: LevelWords | None) -> None:
        """Show other values; threshold and lapses only where observers are simulated (with their ``wording``)."""
        planned = "planned" if shown.planned == shown.participants else f"({shown.planned or 'none'} planned)"
        self.participants.show_words("participants", planned)
        self.participants.show_number(str(shown.participants))
        self.threshold.setVisible(wording is not None)
        self.lapses.setVisible(wording is not None)
        if wording is not None:
            self.threshold.show_words(f"simulated {wording.name}", wording.unit)
            self.threshold.show_number(wording.number(shown.threshold))
            self.lapses.show_number(rounded(100 * shown.lapses))


class PlotCard(Card):
    """A plot under its heading, its units and what its marks mean."""

    def __init__(self, title: str, legend: str, plot: FunctionView | TrackView) -> None:
        self.heading_unit = cut_text("", "small", "text2", right=True)
        super().__init__(title, padding=14, gap=4)
        self.heading_unit.setAlignment(Qt.AlignmentFlag.AlignLeft)
        self.legend = label(legend, "small", "text2", wraps=True)
        add_parts(self.column, self.heading_unit, self.legend, (plot, 1))
        self._legend, self.plot = legend, plot

    def show_simulated(self, heading: str, of: LevelBlock, shown: MeasuresView) -> None:
        """Show the answers simulated so far; the legend says if others are being simulated or cannot be."""
        observed, waiting = shown.simulated.observed, shown.simulated.waiting
        self.heading_unit.show_text(heading if observed else "")
        said = FAILED[2] if shown.simulated.failed else waiting
        self.legend.setText(capitalised(said) if said else self._legend)
        self.plot.show_observed(of, observed, grey=shown.earlier or bool(waiting))


class _WarningBar(Themed, QWidget):
    """A field in the colour of warnings."""

    def paintEvent(self, _event: QPaintEvent) -> None:
        paint_ground(self, self.theme.warn_bg)


class ForcesCard(Card):
    """The force of each level, what clips it, and the repair; ``repair_asked`` carries problem and words."""

    repair_asked = Signal(object, str)

    def __init__(self, plot: ForcesView) -> None:
        super().__init__(padding=14, gap=4)
        self.plot = plot
        self.offered: tuple[ProblemRow | None, str] = (None, "")
        self.unit = Elided("small", "text2")
        self.chips = [Chip(small=True), Chip(small=True)]
        head = hbox(label("Force at each level", "card"), (self.unit, 1), *self.chips, spacing=8)
        self.bar = _WarningBar()
        self.words = label("", "small", wraps=True)
        self.repair = small_button("", "Repair", height=34)
        self.repair.clicked.connect(lambda: self.repair_asked.emit(*self.offered))
        parts = (Icon("warning", "warn", 18), (self.words, 1), self.repair)
        hbox(*parts, spacing=10, margins=(12, 6, 8, 6), parent=self.bar)
        add_parts(self.column, head, (plot, 1), self.bar)

    def show_levels(self, shown: MeasuresView) -> None:
        """Show the forces, unless they are unknown or a level has none."""
        of = shown.levels
        has_forces = of is not None and any(level.asked_n is not None for level in of.shown)
        if of is None or not has_forces or (of.forces and of.limits is None):
            self.hide()
            return
        self.show()
        count, total = sum(level.clipped_by is not None for level in of.levels), len(of.levels)
        verdicts: tuple[Verdict, ...] = (("ok", "check", f"{total - count} of {total} as asked"),)
        if of.limits is None:
            verdicts = (("neutral", "info", f"{UNKNOWN} of {total} as asked"),)
        elif count:
            tone: Tone = "bad" if shown.problems else "warn"
            verdicts = ("neutral", "info", verdicts[0][2]), (tone, "warning", f"{count} clipped")
        standard = "" if of.standard is None else f"standard {rounded(of.standard)} {of.words.value_unit}, "
        speed = "" if of.limits is None else f"N, {standard}at {of.limits.hand_mps:.3f} m/s of the hand"
        self.unit.show_text(speed)
        for chip, state in zip(self.chips, (*verdicts, None), strict=False):
            chip.setVisible(state is not None)
            if state is not None:
                chip.show_state(*state)
        warning = clipped_sentence(of)
        self.bar.setVisible(bool(warning))
        self.words.setText(warning)
        self.offered = next(((row, sentences[0]) for row, sentences in shown.problems if sentences), (None, ""))
        self.repair.setVisible(self.offered[0] is not None)
        self.repair.show_action("", self.offered[1])
        self.plot.show_levels(of)


def clipped_sentence(of: LevelBlock) -> str:
    """Return a sentence on the clipped levels, "" if there are none."""
    if of.limits is None:
        return NO_FORCES
    messages = [fault.message for fault in check_clipping(of.protocol, [of.block], ASSUMED_TICKS)]
    said = ". ".join(capitalised(message) for message in messages)
    return said or unpaced_clipping_warning(of.protocol, [of.block]) or ""


class _MeasureCards(QScrollArea):
    """Draws numbers and cards of a `MeasuresView`; ``open_asked`` carries an element's path.

    While they are hidden, the last ones are kept; ``appeared`` comes when they are shown.
    """

    open_asked = Signal(object)
    appeared = Signal()

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setWidgetResizable(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.shown: MeasuresView | None = None
        self.numbers, self.grid = NumbersRow(), CardGrid(self.open_asked.emit)
        self.numbers.hide()
        self.earlier = label(_EARLIER, "small", "warn", wraps=True)
        self.earlier.hide()
        inside = QWidget()
        inside.setObjectName("earlier")
        self.column = vbox(self.earlier, self.numbers, (self.grid, 1), spacing=8, margins=0, parent=inside)
        self.setWidget(inside)

    def show_measures(self, shown: MeasuresView) -> None:
        self.shown = shown
        if self.isVisible():
            self.show_parts(shown)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if self.shown is not None:
            self.show_parts(self.shown)
        self.appeared.emit()

    def show_parts(self, shown: MeasuresView) -> None:
        self.earlier.setVisible(shown.earlier)
        for part in self.widget().findChildren(QWidget, options=Qt.FindChildOption.FindDirectChildrenOnly):
            part.setEnabled(part is self.earlier or not shown.earlier)
        self.numbers.show_numbers(shown.numbers, shown.simulated.waiting)


class MeasuresPage(_MeasureCards):
    """The tab; plots are made when a block with a method is first shown."""

    repair_asked = Signal(object, str)

    def __init__(self) -> None:
        super().__init__("Measures")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.controls = _MeasureControls()
        self.function: PlotCard | None = None
        self.track: PlotCard | None = None
        self.forces: ForcesCard | None = None
        self.hypotheses = CardGrid(self.open_asked.emit)
        self.curves = QWidget()
        self.plots = hbox(spacing=8, margins=0, parent=self.curves)
        self.curves.setMaximumHeight(HIGHEST_PX)
        self.column.insertWidget(1, self.hypotheses)
        self.column.insertWidget(3, self.curves, 3)
        self.column.addStretch()

    def show_measures(self, shown: MeasuresView) -> None:
        self.controls.show_values(shown.controls, shown.words)
        super().show_measures(shown)

    def show_parts(self, shown: MeasuresView) -> None:
        super().show_parts(shown)
        self.hypotheses.setVisible(shown.hypotheses is not None)
        self.hypotheses.show_cards(() if shown.hypotheses is None else (shown.hypotheses,))
        self.curves.setVisible(bool(shown.numbers))
        of = shown.levels
        if of is not None and self.forces is None:
            self._make_plots()
        if self.forces is not None:
            self.forces.show_levels(shown)
        if of is not None and shown.numbers and self.function is not None and self.track is not None:
            unit = f", {of.words.unit}" if of.words.unit else ""
            self.function.show_simulated(f"% {of.words.success} over {of.words.kind}{unit}", of, shown)
            self.track.show_simulated(f"{of.words.kind}{unit} over trials", of, shown)
        cards = () if shown.numbers else shown.cards
        self.grid.setVisible(bool(cards))
        self.grid.show_cards(cards)

    def _make_plots(self) -> None:
        from study_app.designer.measures.plots import ForcesView, FunctionView, TrackView  # noqa: PLC0415 - pyqtgraph, once there is a plot

        self.function = PlotCard("Psychometric function", _FUNCTION_LEGEND, FunctionView())
        self.track = PlotCard("Expected track", _TRACK_LEGEND, TrackView())
        self.forces = ForcesCard(ForcesView())
        self.forces.repair_asked.connect(self.repair_asked)
        for card in (self.function, self.track):
            card.setMinimumHeight(PLOT_PX)
            self.plots.addWidget(card, 1)
        self.forces.setMinimumHeight(FORCES_PX)
        self.forces.setMaximumHeight(HIGHEST_PX)
        self.column.insertWidget(4, self.forces, 2)


class FactsRow(_MeasureCards):
    """The cards that stay below other tabs."""

    def __init__(self) -> None:
        super().__init__("Facts")
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._window_px = self._left_px = 0
        self.make_room(0, 0)

    def make_room(self, window_px: int, left_px: int) -> None:
        """Take the height of the cards as far as the window has room or the page above leaves it."""
        self._window_px, self._left_px = window_px, left_px
        most = FACTS_MOST if window_px >= HIGH_FROM else max(FACTS_LEAST, round(FACTS_SHARE * window_px))
        most = left_px if left_px > 0 else most
        column = self.column
        needed = max(column.totalHeightForWidth(self.viewport().width()), column.totalMinimumSize().height())
        self.setFixedHeight(min(most, needed + 2 * self.frameWidth()) if self.grid.cards else most)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        handled = super().eventFilter(watched, event)
        if watched is self.widget() and event.type() == QEvent.Type.LayoutRequest:
            self.make_room(self._window_px, self._left_px)
        return handled

    def show_parts(self, shown: MeasuresView) -> None:
        super().show_parts(shown)
        self.grid.show_cards(shown.below)
        self.make_room(self._window_px, self._left_px)
