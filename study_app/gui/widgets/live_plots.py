"""Live plots in the style of the program; pyqtgraph only draws curves and axes.

Plots have horizontal grid lines and few ticks. Curves have their names at their ends, and differ in stroke and colour.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QCoreApplication, QEvent, QPointF, QSize, Qt
from PySide6.QtGui import QColor, QPen
from PySide6.QtWidgets import QFrame

from study_app.gui.theme.theme import LIGHT, Theme, font
from study_app.gui.theme.themed import Coloured

Floats = NDArray[np.float64]

MINUS = "\u2212"
_THIN_SPACE = "\u2009"
STROKE = 2.0
NOTHING = QPen(QColor(0, 0, 0, 0))
# Lengths of dash and gap in stroke widths: x solid, y dashed, z dotted.
_DASHES: tuple[tuple[float, float] | None, ...] = (None, (6.0, 3.0), (1.0, 1.6))
_LINE_PX = 16.0  # the height of a line of text
NAME_MARGIN = 1.0  # around names [px]
_NAMES_AFTER_PX = 6.0  # from a curve's end to its name
_HALF_TICK_PX = 24.0  # half the width of "10 000", the last tick of an axis
_DIGIT_PX = 8.5  # the width of a digit, including its share of the gap between two ticks
_MAX_NAMES_FRACTION = 0.5  # of the plot's height
_P99_ABOVE = 0.1  # how far the line of the 99th percentile may extend above the top grid line [decades]
_BINS_PER_DECADE = 14
LOWEST_US, LEAST_HIGHEST_US = 1.0, 1000.0
NAMES = ("x right", "y up", "z near")


def tick_text(value: float) -> str:
    """Return a tick's number with a minus sign and thin spaces: "−20", "10 000"."""
    text = f"{abs(value):,.6g}".replace(",", _THIN_SPACE)
    return f"{MINUS}{text}" if value < 0 else text


def pen(colour: str, width: float = STROKE, dash: tuple[float, float] | None = None) -> QPen:
    """Return a pen whose width is in screen px at any scale of the plot."""
    cosmetic_pen = QPen(QColor(colour), width)
    cosmetic_pen.setCosmetic(True)
    cosmetic_pen.setCapStyle(Qt.PenCapStyle.FlatCap)
    cosmetic_pen.setJoinStyle(Qt.PenJoinStyle.BevelJoin)  # others are slower and look the same
    if dash is not None:
        cosmetic_pen.setDashPattern(list(dash))
    return cosmetic_pen


class _Axis(pg.AxisItem):
    """An axis without a label: laying out an empty one takes a quarter of the time to create a plot."""

    def _updateLabel(self) -> None:
        self.picture = None
        self.update()


class Plot(Coloured, pg.GraphicsView):
    """An empty plot without menu, buttons, mouse or frame, with horizontal grid lines at the ticks of y.

    It uses only pyqtgraph's view box and axes: its plot item creates menus that outlive the window.
    """

    def __init__(self) -> None:
        super().__init__(background=LIGHT.surface)
        self.setFrameShape(QFrame.Shape.NoFrame)
        for part in (self, self.viewport()):
            part.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.box = pg.ViewBox(enableMenu=False, enableMouse=False, defaultPadding=0)
        self.axes = {side: _Axis(side) for side in ("left", "bottom")}
        self.ticks: dict[str, list[tuple[float, str]]] = {}
        layout = pg.GraphicsLayout()
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addItem(self.axes["left"], 0, 0)
        layout.addItem(self.box, 0, 1)
        layout.addItem(self.axes["bottom"], 1, 1)
        self.setCentralItem(layout)
        self._grid: list[Any] = []
        for axis in self.axes.values():
            axis.linkToView(self.box)
            axis.setStyle(
                tickLength=0,
                tickFont=font("small", tabular=True),
                tickTextOffset=10,
                tickAlpha=0,
                hideOverlappingLabels=False,
            )
            axis.setPen(NOTHING)
            axis.setTickPen(NOTHING)
        self.axes["left"].setWidth(60)
        self.axes["bottom"].setHeight(28)

    def stroke(self, colour: str, width: float = STROKE, dash: tuple[float, float] | None = None) -> QPen:
        """Return a pen whose width is in logical px on a screen of any density."""
        return pen(colour, width * self.devicePixelRatioF(), dash)

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.DevicePixelRatioChange:
            self.apply_theme(self.theme)
        return bool(super().event(event))

    def paint_now(self) -> None:
        """Paint changes at once instead of waiting for Qt."""
        QCoreApplication.sendPostedEvents(self.scene(), QEvent.Type.MetaCall.value)

    def sizeHint(self) -> QSize:
        """Return a small size, because a plot fills the remaining space and must not make a window scroll."""
        return QSize(320, 150)

    def show_ticks(self, side: str, ticks: list[tuple[float, str]]) -> None:
        """Draw ``ticks`` (position, text) at an axis; those of y also get a grid line."""
        self.ticks[side] = ticks
        self.axes[side].setTicks([ticks])
        if side == "left":
            for line in self._grid:
                self.box.removeItem(line)
            self._grid = [pg.InfiniteLine(value, angle=0, pen=pen(self.theme.grid, 1)) for value, _ in ticks]
            for line in self._grid:
                line.setZValue(-10)
                self.box.addItem(line, ignoreBounds=True)

    def apply_theme(self, theme: Theme) -> None:
        self.setBackground(theme.surface)
        for axis in self.axes.values():
            axis.setTextPen(QColor(theme.text3))
        for line in self._grid:
            line.setPen(pen(theme.grid, 1))


class TracePlot(Plot):
    """Three curves over the last seconds, with their names at the newest ends.

    Parameters
    ----------
    reach : initial range, from −reach to reach; the plot extends if a curve goes beyond it
    """

    def __init__(self, span_s: float, reach: float, names: Sequence[str] = NAMES) -> None:
        super().__init__()
        self._span_s = span_s
        self._requested_reach = self.reach = reach
        self._shown_ticks = (0, 0.0)
        self._name_height = self._names_after_s = 0.0
        self._newest: list[float] = []
        self.curves = [pg.PlotCurveItem(antialias=True) for _ in names]
        for curve, dash in zip(self.curves, (*_DASHES, None), strict=False):
            draw_quickly(curve, solid=dash is None)
        self.ends = [pg.TextItem(name, anchor=(0, 0.5)) for name in names]
        for item in (*self.curves, *self.ends):
            self.box.addItem(item)
        for end in self.ends:
            end.textItem.setFont(font("small", weight=600))
            end.textItem.document().setDocumentMargin(NAME_MARGIN)
            end.setVisible(False)
        self.box.sigResized.connect(self._fit_axes)
        self.show_ticks("bottom", _time_ticks(span_s))
        self._fit_axes()
        self.apply_theme(LIGHT)

    def show_reach(self, reach: float) -> None:
        """Set the range to ±reach, extended to the next tick."""
        if reach != self._requested_reach:
            self._requested_reach = reach
            self._fit_axes()

    def _fit_axes(self) -> None:
        """Leave space for the names at the right, and for half a line of text above and below the outer ticks."""
        height, width = max(60.0, self.box.height()), max(120.0, self.box.width())
        max_rows = 3 if height > 130 else 2 if height > 84 else 1  # grid lines on either side of zero
        step = tick_step(self._requested_reach, max_rows)
        rows = max(1, int(np.ceil(self._requested_reach / step - 1e-9)))
        self.reach = rows * step
        self._name_height = 2 * self.reach * (_LINE_PX + 1) / (height - _LINE_PX)
        limit = self.reach * height / (height - _LINE_PX)
        self.box.setYRange(-limit, limit, padding=0)
        name_width = max(end.textItem.boundingRect().width() for end in self.ends) + _NAMES_AFTER_PX + 2
        share = min(0.4, name_width / width)
        self._names_after_s = 1.02 * self._span_s / (1 - share) * _NAMES_AFTER_PX / width
        self.box.setXRange(-1.02 * self._span_s, 1.02 * self._span_s * share / (1 - share), padding=0)
        if (rows, step) != self._shown_ticks:
            self._shown_ticks = (rows, step)
            self.show_ticks("left", [(k * step, tick_text(k * step)) for k in range(-rows, rows + 1)])
        self._place_names()

    def show_traces(self, times_s: Floats, values: Floats) -> None:
        """Draw ``values`` (n, curves) over ``times_s`` (n,), where zero is now."""
        if len(values) and float(np.nanmax(np.abs(values))) > 1.08 * self.reach:
            self.show_reach(float(np.nanmax(np.abs(values))))
        for axis, curve in enumerate(self.curves):
            curve.setData(times_s, values[:, axis])
        self._newest = [float(value) for value in values[-1]] if len(values) else []
        for end in self.ends:
            end.setVisible(len(values) > 0)
        self._place_names()

    def _place_names(self) -> None:
        """Place every name as close to the newest end of its curve as the other names and the edges permit."""
        if not self._newest:
            return
        for end, height in zip(self.ends, _spread_apart(self._newest, self._name_height, self.reach), strict=True):
            end.setPos(QPointF(self._names_after_s, height))

    def apply_theme(self, theme: Theme) -> None:
        super().apply_theme(theme)
        colours = (theme.trace_x, theme.trace_y, theme.trace_z)
        for curve, end, colour, dash in zip(self.curves, self.ends, colours, _DASHES, strict=False):
            curve.setPen(self.stroke(colour, STROKE, dash))
            end.setColor(QColor(colour))


class LatenessPlot(Plot):
    """A histogram of the lateness of ticks on logarithmic axes, with the 99th percentile and the limit."""

    def __init__(self, limit_us: float) -> None:
        super().__init__()
        self._limit = float(np.log10(limit_us))
        self._decades = (0, 0)
        self.bars = pg.BarGraphItem(x=[], height=[], width=0.05, y0=0.0)
        self.p99_line = pg.PlotCurveItem()
        self.limit_line = pg.InfiniteLine(self._limit, angle=90)
        self.p99_name = pg.TextItem("", anchor=(0.5, 1))
        self.limit_name = pg.TextItem(f"limit {tick_text(limit_us)}", anchor=(1, 0))
        for item in (self.bars, self.p99_line, self.limit_line, self.p99_name, self.limit_name):
            self.box.addItem(item)
        for name in (self.p99_name, self.limit_name):
            name.textItem.setFont(font("small", weight=600, tabular=True))
            name.textItem.document().setDocumentMargin(NAME_MARGIN)
        self.box.sigResized.connect(self._fit_axes)
        self._show_decades(max(3, int(np.ceil(self._limit + 0.1))), 4)
        self.apply_theme(LIGHT)

    def _show_decades(self, x_decades: int, y_decades: int) -> None:
        if (x_decades, y_decades) == self._decades:
            return
        self._decades = (x_decades, y_decades)
        self._fit_axes()
        self.show_ticks("left", [(k, tick_text(10.0**k)) for k in range(y_decades + 1)])

    def _fit_axes(self) -> None:
        """Leave space above the bars for the name of the 99th percentile and, above it, that of the limit."""
        x_decades, y_decades = self._decades
        share = min(0.2, _HALF_TICK_PX / max(1.0, self.box.width()))  # half of the last tick's text
        last = x_decades * (1 + share / (1 - share))
        self.box.setXRange(-0.02 * x_decades, last, padding=0)
        step = 1 if self.box.width() >= _DIGIT_PX * (x_decades + 1) * (last + 0.02 * x_decades) else 2
        self.show_ticks("bottom", [(k, tick_text(10.0**k)) for k in range(0, x_decades + 1, step)])
        line_height = self.limit_name.textItem.boundingRect().height() + NAME_MARGIN
        share = min(2 * line_height / max(1.0, self.box.height()), _MAX_NAMES_FRACTION)
        top = (y_decades + _P99_ABOVE + 0.3 * share) / (1 - share)
        self.box.setYRange(-0.3, top, padding=0)
        self.limit_name.setPos(self._limit - 0.01 * x_decades, top)

    def show_histogram(self, edges_us: Floats, counts: NDArray[np.int64], p99_us: float | None) -> None:
        """Draw ``counts`` (bins,) between ``edges_us`` (bins + 1,) and the 99th percentile [µs]."""
        edges = np.log10(edges_us)
        filled = counts > 0
        up = max(4, int(np.ceil(np.log10(max(1, int(counts.max(initial=0)))))))
        self._show_decades(max(int(np.ceil(edges[-1] - 1e-9)), int(np.ceil(self._limit + 0.1))), up)
        heights = np.log10(np.maximum(counts[filled], 1)) + 0.3
        width = (edges[1] - edges[0]) * 0.72
        self.bars.setOpts(x=(edges[:-1] + edges[1:])[filled] / 2, height=heights, width=width, y0=-0.3)
        self.p99_name.setVisible(p99_us is not None)
        self.p99_line.setVisible(p99_us is not None)
        if p99_us is not None:
            at = float(np.log10(max(p99_us, 1.0)))
            near = counts[np.abs((edges[:-1] + edges[1:]) / 2 - at) < 0.12 * self._decades[0]]
            top = min(up + _P99_ABOVE, float(np.log10(max(1, int(near.max(initial=1))))) + 0.3)
            self.p99_line.setData([at, at], [-0.3, top])
            self.p99_name.setPos(at, top)
            self.p99_name.setText(f"p99 {tick_text(round(p99_us))}")

    def apply_theme(self, theme: Theme) -> None:
        super().apply_theme(theme)
        self.bars.setOpts(brush=QColor(theme.accent), pen=QPen(Qt.PenStyle.NoPen))
        self.p99_line.setPen(self.stroke(theme.text, 1.4))
        self.p99_name.setColor(QColor(theme.text))
        self.limit_line.setPen(self.stroke(theme.bad, 1.4, (4.0, 3.0)))
        self.limit_name.setColor(QColor(theme.bad))


def lateness_histogram(lateness_us: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Return logarithmically spaced bin edges [µs] (bins + 1,) and counts (bins,); less than 1 µs counts as 1 µs."""
    micros = np.maximum(lateness_us, LOWEST_US)
    decades = int(np.ceil(np.log10(max(LEAST_HIGHEST_US, float(micros.max(initial=0.0)))) - 1e-9))
    edges = np.logspace(0, decades, decades * _BINS_PER_DECADE + 1)
    counts, _ = np.histogram(np.log10(micros), np.log10(edges))
    return edges, counts


def draw_quickly(curve: pg.PlotCurveItem, *, solid: bool) -> None:
    """Draw a solid curve in pieces, which takes half as long; dashes must be continuous."""
    curve.setSegmentedLineMode("on" if solid else "off")


def tick_step(reach: float, most: int) -> float:
    """Return the smallest round step (1, 2 or 5 times a power of ten) with at most ``most`` ticks within ``reach``."""
    least = max(reach, 1e-9) / (most + 0.01)
    power = 10.0 ** np.floor(np.log10(least))
    return float(next(power * step for step in (1, 2, 5, 10) if power * step >= least))


def _time_ticks(span_s: float) -> list[tuple[float, str]]:
    """Return ticks every two seconds, from now (0 s) back to ``span_s``."""
    return [(-t, "0 s" if t == 0 else f"{MINUS}{t} s") for t in range(0, int(span_s) + 1, 2)]


def _spread_apart(positions: Sequence[float], gap: float, reach: float) -> list[float]:
    """Return ``positions``, moved to be at least ``gap`` apart and within ±reach, in the same order."""
    order = np.argsort(positions, kind="stable")
    moved = np.asarray(positions, float)[order]
    for _ in range(8):
        for i in range(len(moved) - 1):
            missing = gap - (moved[i + 1] - moved[i])
            if missing > 0:
                moved[i] -= missing / 2
                moved[i + 1] += missing / 2
    for i in range(len(moved) - 1):
        moved[i + 1] = max(moved[i + 1], moved[i] + gap)
    rank = np.arange(len(moved))
    moved = np.maximum(moved, -reach + gap * rank)
    moved = np.minimum(moved, reach - gap * rank[::-1])
    spread = np.empty_like(moved)
    spread[order] = moved
    return [float(position) for position in spread]
