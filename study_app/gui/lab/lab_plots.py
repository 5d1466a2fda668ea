"""Below the tank: the force on the hand, and how fast body and wake are, over the last seconds."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPointF, QSize
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QStackedLayout, QWidget

from study_app.gui.lab.lab_state import SPAN_S, Floats, LabView
from study_app.gui.lab.parameters import HIDDEN
from study_app.gui.theme.theme import LIGHT, Theme, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.accessible import describe_plot
from study_app.gui.widgets.boxes import add_layout, vbox
from study_app.gui.widgets.cards import Card, MaskedPanel
from study_app.gui.widgets.labels import label
from study_app.gui.widgets.live_plots import MINUS, Plot, draw_quickly, number, pen

POINTS = 240  # of a curve: one for one to two pixels; painting takes as long as there are points
STEPS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
MOST_TICKS, TICK_PX = 5, 22
LEGEND_LINE, LEGEND_GAP, STROKE_WIDTH = 20, 16.0, 24.0
LABEL_PX = 9.0  # half of a tick's number
SHRINKS_BELOW = 0.45  # of the height: a plot that follows every peak is never at rest
DASH: dict[str, tuple[float, float] | None] = {"solid": None, "long": (6.0, 3.0), "short": (3.0, 2.0)}


@dataclass(frozen=True, slots=True)
class CurveStyle:
    """A curve: its name, how its colour is found in a theme, and its stroke."""

    name: str
    colour: Callable[[Theme], str]
    stroke: str
    width: float = 2.0


A = CurveStyle("A", lambda theme: theme.trace_x, "solid", 2.2)
B = CurveStyle("B", lambda theme: theme.trace_y, "long")
BODY = CurveStyle("body", lambda theme: theme.text3, "short", 1.6)
LIMIT = CurveStyle("limit", lambda theme: theme.bad, "short", 1.6)


class Legend(Themed, QWidget):
    """Names of curves, each behind a piece of its stroke."""

    def __init__(self) -> None:
        super().__init__()
        self._entries: tuple[tuple[CurveStyle, str], ...] = ()
        self._font = font("small", weight=500, tabular=True)
        self.setFixedHeight(LEGEND_LINE)

    def show_entries(self, entries: tuple[tuple[CurveStyle, str], ...]) -> None:
        if entries != self._entries:
            self._entries = entries
            self.setAccessibleName(", ".join(words for _, words in entries))
            self._fit()
            self.update()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        lines = {place.y() for place in self._places()}
        self.setFixedHeight(LEGEND_LINE * max(1, len(lines)))

    def _places(self) -> list[QPointF]:
        metrics = QFontMetricsF(self._font)
        places, x, y = [], 0.0, LEGEND_LINE / 2
        for _, words in self._entries:
            width = STROKE_WIDTH + 6 + metrics.horizontalAdvance(words)
            if x and x + width > self.width():
                x, y = 0.0, y + LEGEND_LINE
            places.append(QPointF(x, y))
            x += width + LEGEND_GAP
        return places

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(self._font)
        for (style, words), place in zip(self._entries, self._places(), strict=True):
            ink = style.colour(self.theme)
            painter.setPen(pen(ink, style.width * self.devicePixelRatioF(), DASH[style.stroke]))
            painter.drawLine(place, place + QPointF(STROKE_WIDTH, 0))
            painter.setPen(QColor(ink if style is LIMIT else self.theme.text2))
            painter.drawText(place + QPointF(STROKE_WIDTH + 6, 4.5), words)


class CurvePlot(Plot):
    """Curves from 0 upwards over the last 2.5 s; the height grows at once, and shrinks only by half."""

    def __init__(self, styles: tuple[CurveStyle, ...], least: float) -> None:
        super().__init__()
        self._styles, self._least, self._top, self._peak = styles, least, 0.0, least
        self.curves = [pg.PlotCurveItem(antialias=True) for _ in styles]
        for curve, style in zip(self.curves, styles, strict=True):
            draw_quickly(curve, solid=style.stroke == "solid")
        self.limit = pg.InfiniteLine(0.0, angle=0)
        self.limit.setVisible(False)
        for item in (*self.curves, self.limit):
            self.box.addItem(item, ignoreBounds=True)
        self.axes["left"].setWidth(40)
        self.axes["bottom"].setHeight(26)
        self.box.setXRange(-SPAN_S, 0.02 * SPAN_S, padding=0)
        marks = np.arange(0.0, SPAN_S + 0.01, 0.5)
        self.show_ticks("bottom", [(-float(t), f"{MINUS}{t:g}" if t else "0") for t in marks])
        self._show_top(least)
        self.box.sigResized.connect(self._lay_ticks)
        self.apply_theme(LIGHT)

    def sizeHint(self) -> QSize:
        """Return a small size: a plot takes what is left."""
        return QSize(240, 120)

    def show_curves(self, t_s: Floats, values: tuple[Floats, ...], limit: float | None = None) -> None:
        """Draw ``values``, each (n,), over ``t_s`` (n,), and a limit where there is one."""
        peak = max((float(np.nanmax(it)) for it in values if len(it)), default=0.0)
        self._show_top(max(peak, limit or 0.0, self._least))
        for curve, it in zip(self.curves, values, strict=True):
            curve.setData(*thinned(t_s, it))
        self.limit.setVisible(limit is not None)
        if limit is not None:
            self.limit.setPos(limit)

    def apply_theme(self, theme: Theme) -> None:
        super().apply_theme(theme)
        for curve, style in zip(self.curves, self._styles, strict=True):
            curve.setPen(self.stroke(style.colour(theme), style.width, DASH[style.stroke]))
        self.limit.setPen(self.stroke(theme.bad, 1.5, DASH["short"]))

    def _show_top(self, peak: float) -> None:
        if SHRINKS_BELOW * self._top <= peak <= self._top:
            return
        self._peak = peak
        self._lay_ticks()

    def _lay_ticks(self) -> None:
        """Choose grid lines up to the peak, as many as there is room for."""
        ticks = max(2, min(MOST_TICKS, int(self.box.height() // TICK_PX)))
        step = next((it for it in STEPS if self._peak / it <= ticks), STEPS[-1])
        rows = max(1, int(np.ceil(self._peak / step - 1e-9)))
        self._top = rows * step
        self.show_ticks("left", [(k * step, number(round(k * step, 6))) for k in range(rows + 1)])
        self._make_room()

    def _make_room(self) -> None:
        """Keep half a number's height free above the highest grid line, however low the plot is."""
        share = min(LABEL_PX / max(1.0, self.box.height()), 0.3)
        self.box.setYRange(-0.02 * self._top, self._top / (1 - share), padding=0)


FORCE_SENTENCE = f"Magnitude of the force of settings A and B on the same motion over the last {SPAN_S:g} s, in N."
SPEED_SENTENCE = f"Speed of the body, and of the wake in settings A and B, over the last {SPAN_S:g} s, in m/s."


class PlotCard(Card):
    """A plot under its heading and its curves' names; while blind, nothing of it in the same place."""

    def __init__(self, title: str, unit: str, plot: Plot, sentence: str) -> None:
        super().__init__(title, label(unit, "small", "text2"), padding=14, gap=4)
        self.plot, self.legend = plot, Legend()
        describe_plot(plot, title, sentence)
        shown = QWidget()
        vbox(self.legend, (plot, 1), spacing=2, margins=0, parent=shown)
        self.stack = QStackedLayout()
        self.stack.addWidget(shown)
        self.stack.addWidget(MaskedPanel(HIDDEN, "A trace would reveal which is which."))
        add_layout(self.column, self.stack, 1)
        self.setMinimumHeight(226)

    def show_blind(self, blind: bool) -> None:
        self.stack.setCurrentIndex(int(blind))


class ForceCard(PlotCard):
    """The force of both settings on the same motion, and the limit of the one that is felt."""

    def __init__(self) -> None:
        super().__init__("Force on the hand", f"N, last {SPAN_S:g} s", CurvePlot((B, A), 1.0), FORCE_SENTENCE)

    def show_view(self, view: LabView) -> None:
        self.show_blind(view.workbench.blind)
        if view.workbench.blind:
            return
        limit = view.workbench.in_hand.scene.force_limit_n
        a, b = ("A, felt now", "B, same motion") if view.felt == "A" else ("A, same motion", "B, felt now")
        self.legend.show_entries(((A, a), (B, b), (LIMIT, f"limit {limit:g} N")))
        trace = view.trace
        nothing = np.empty(0)
        t_s = nothing if trace is None else trace.t_s
        forces = (nothing, nothing) if trace is None else (_size(trace.force_b_n), _size(trace.force_a_n))
        self.plot.show_curves(t_s, forces, limit)


class SpeedCard(PlotCard):
    """How fast the body is, and the wake that it meets in both settings."""

    def __init__(self) -> None:
        super().__init__("Body and wake", f"m/s, last {SPAN_S:g} s", CurvePlot((BODY, B, A), 0.5), SPEED_SENTENCE)
        self.legend.show_entries(((BODY, "body"), (A, "wake of A"), (B, "wake of B")))

    def show_view(self, view: LabView) -> None:
        self.show_blind(view.workbench.blind)
        if view.workbench.blind:
            return
        trace = view.trace
        if trace is None:
            self.plot.show_curves(np.empty(0), (np.empty(0), np.empty(0), np.empty(0)))
        else:
            self.plot.show_curves(trace.t_s, (trace.body_mps, trace.wake_b_mps, trace.wake_a_mps))


def _size(vectors: Floats) -> Floats:
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))


def thinned(t_s: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return of every so many samples the time of the newest and the largest value: no peak is missed."""
    step = max(1, len(t_s) // POINTS)
    first = len(t_s) % step
    return t_s[first:].reshape(-1, step)[:, -1], values[first:].reshape(-1, step).max(axis=1)
