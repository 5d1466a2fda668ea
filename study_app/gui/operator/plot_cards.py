"""The middle of the operator's window: lateness of ticks, the hand's position, and the force that stays hidden."""

from PySide6.QtCore import QSize, Qt

from study_app.gui.operator.force_plots import FIELD
from study_app.gui.widgets.accessible import describe_plot
from study_app.gui.widgets.boxes import add_parts
from study_app.gui.widgets.cards import Card, Chip
from study_app.gui.widgets.labels import label
from study_app.gui.widgets.live_plots import LatenessPlot, TracePlot
from study_app.gui.widgets.masked_panel import MaskedPanel
from study_app.viewmodels.servo_health import TRACE_WINDOW_S, ServoHealth


class LatenessCard(Card):
    """Histogram of the last minute's ticks."""

    def __init__(self, limit_s: float) -> None:
        super().__init__("Tick lateness", label("last 60 s", "small", "text2"), padding=16, gap=4)
        self.plot = LatenessPlot(limit_s * 1e6)
        describe_plot(self.plot, "Tick lateness", "Histogram of how late the ticks of the last minute began, in µs.")
        axes = label("lateness, µs (log), ticks per bin (log)", "small", "text2")
        axes.setAlignment(Qt.AlignmentFlag.AlignHCenter)
        add_parts(self.column, (self.plot, 1), axes)

    def show_health(self, health: ServoHealth) -> None:
        """Draw the ticks as of now."""
        edges, counts = health.lateness_histogram()
        p99 = health.vitals().lateness_p99_s
        self.plot.show_histogram(edges, counts, None if p99 is None else p99 * 1e6)


class PositionCard(Card):
    """The hand along x, y and z over the last ten seconds; with the mouse, the pointer."""

    def __init__(self, reach_m: float, *, pointer: bool) -> None:
        title = "Position of the pointer" if pointer else "Position of the hand"
        super().__init__(title, label(f"last {TRACE_WINDOW_S:.0f} s, mm", "small", "text2"), padding=16, gap=4)
        self.plot = TracePlot(TRACE_WINDOW_S, reach_m * 1000)
        what = f"Position along x, y and z over the last {TRACE_WINDOW_S:.0f} s, in mm."
        describe_plot(self.plot, title, what)
        self.column.addWidget(self.plot, 1)

    def show_health(self, health: ServoHealth, now_s: float) -> None:
        """Draw the curves as of now."""
        times, positions = health.trace(now_s)
        self.plot.show_traces(times, positions * 1000)


class HiddenForceCard(Card):
    """In the place and size of the force's plot while the study is double-blind: nothing about the force."""

    TITLE = "Hidden while the study is double-blind"
    WHY = "A trace would reveal the liquid."

    def __init__(self) -> None:
        super().__init__("Force", Chip("neutral", "eye_off", "Hidden", small=True), padding=16, gap=8)
        self.column.addWidget(MaskedPanel(self.TITLE, self.WHY), 1)

    def sizeHint(self) -> QSize:
        return FIELD

    def minimumSizeHint(self) -> QSize:
        return FIELD
