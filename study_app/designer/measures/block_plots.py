"""The plots of a block with a method: psychometric function, expected track, force of each level."""

import math
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPointF, QSize, Qt
from PySide6.QtGui import QBrush, QColor, QPen

from study_app.designer.measures.limit_colours import limit_colour
from study_app.designer.measures.number_cards import LIMIT_NAMES, ForcesPlot, FunctionPlot, Limit, TrackPlot
from study_app.gui.theme.theme import LIGHT, Theme, font
from study_app.gui.widgets.accessible import describe_plot
from study_app.gui.widgets.live_plots import Plot, pen

BARS = 0.14  # of the height, for how often each level is asked
SYMBOLS = ("o", "t1", "s", "d")
DASHED = (4.0, 3.0)
LIMITS_PX = 128.0  # of the names of the limits


class MeasurePlot(Plot):
    """A plot that is drawn anew from its value."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.axes["left"].setWidth(40)
        self.axes["bottom"].setHeight(26)
        self.drawn: list[pg.GraphicsObject] = []
        self.shown: Any = None
        self.grey = False
        describe_plot(self, name, "")

    def sizeHint(self) -> QSize:
        return QSize(220, 110)

    def show_plot(self, shown: Any, *, grey: bool = False) -> None:
        """Show another value, None where there is none; ``grey`` if it is of an earlier study."""
        if (shown, grey) != (self.shown, self.grey):
            self.shown, self.grey = shown, grey
            self.setAccessibleDescription("Not known yet." if shown is None else shown.sentence)
            self._draw()

    def _draw(self) -> None:
        self.clear()
        if self.shown is not None:
            self.draw(self.shown)
        else:
            self.show_ticks("left", [])
            self.show_ticks("bottom", [])

    def draw(self, shown: Any) -> None:
        """Draw a value in the colours of the theme."""
        raise NotImplementedError

    def apply_theme(self, theme: Theme) -> None:
        super().apply_theme(theme)
        self._draw()

    def clear(self) -> None:
        """Take everything away that was drawn."""
        for item in self.drawn:
            self.box.removeItem(item)
        self.drawn = []

    def add(self, item: pg.GraphicsObject, z: float = 0.0) -> None:
        """Draw an item at a height: those of more are in front."""
        item.setZValue(z)
        self.box.addItem(item, ignoreBounds=True)
        self.drawn.append(item)

    def band(self, x: np.ndarray, low: np.ndarray, high: np.ndarray, opacity: float) -> None:
        """Fill the space between two curves."""
        colour = QColor(self.theme.ctl if self.grey else self.theme.accent)
        colour.setAlphaF(opacity)
        curves = (pg.PlotCurveItem(x, one) for one in (low, high))
        self.add(pg.FillBetweenItem(*curves, brush=QBrush(colour)), -5)

    def curve(self, x: object, y: object, colour: str, width: float = 2.0, *, dashed: bool = False) -> None:
        """Draw a curve."""
        made = pg.PlotCurveItem(np.asarray(x, float), np.asarray(y, float), antialias=True)
        made.setPen(self.stroke(colour, width, DASHED if dashed else None))
        self.add(made, 2)

    def zone(self, limit: Limit, first: float, last: float, *, upright: bool) -> None:
        """Mark where a limit takes part of the force away."""
        colour = QColor(limit_colour(self.theme, limit))
        edge = colour.name()
        colour.setAlphaF(0.16)
        made = pg.LinearRegionItem(
            (first, last), orientation="vertical" if upright else "horizontal", movable=False, brush=QBrush(colour),
            pen=pen(edge, 1, DASHED),
        )  # fmt: skip
        self.add(made, -8)

    def words(
        self, text: str, x: float, y: float, colour: str, anchor: tuple[float, float], *, over: bool = False
    ) -> None:
        """Write words at a place; those ``over`` a line of the grid interrupt it."""
        made = pg.TextItem(text, color=QColor(colour), anchor=anchor, fill=QColor(self.theme.surface) if over else None)
        made.textItem.setFont(font("small", weight=600, tabular=True))
        made.setPos(QPointF(x, y))
        self.add(made, 5)


class FunctionView(MeasurePlot):
    """The psychometric function, the functions that were found, and how often each level is asked."""

    def __init__(self) -> None:
        super().__init__("Psychometric function")
        self.apply_theme(LIGHT)

    def draw(self, shown: FunctionPlot) -> None:
        """Draw bands, function, mark and bars."""
        theme, (left, right) = self.theme, shown.span
        bottom, top = shown.low - 1.0, 101.5
        x = np.array(shown.x)
        self.band(x, np.array(shown.found[-1]), np.array(shown.found[0]), 0.18)
        self.band(x, np.array(shown.found[-2]), np.array(shown.found[1]), 0.30)
        self.curve(x, shown.planted, theme.ctl if self.grey else theme.accent, 2.4)
        at, percent = shown.mark
        for xs, ys in (([left, at], [percent, percent]), ([at, at], [bottom, percent])):
            self.curve(xs, ys, theme.text, 1.2, dashed=True)
        dot = pg.ScatterPlotItem([at], [percent], size=9, pen=pen(theme.text, 2), brush=QBrush(QColor(theme.surface)))
        self.add(dot, 4)
        before = at > (left + right) / 2
        self.words(shown.mark_words, at, percent, theme.text, (1.08, 1.0) if before else (-0.08, 0.0))
        self._bars(shown, bottom, top)
        if shown.clipped_from is not None and shown.clipped_from[0] < right:
            first, limit = shown.clipped_from
            self.zone(limit, max(left, first), right, upright=True)
        self.show_ticks("left", list(shown.ticks_y))
        self.show_ticks("bottom", list(shown.ticks_x))
        beyond = 0.03 * (right - left)
        self.box.setXRange(left - beyond, right + beyond, padding=0)
        self.box.setYRange(bottom, top, padding=0)

    def _bars(self, shown: FunctionPlot, bottom: float, top: float) -> None:
        places = np.array([at for at, _ in shown.asked])
        shares = np.array([share for _, share in shown.asked])
        if not len(places) or shares.max() <= 0:
            return
        apart = float(np.min(np.diff(places))) if len(places) > 1 else 0.04 * (shown.span[1] - shown.span[0])
        heights = BARS * (top - bottom) * shares / shares.max()
        first, limit = shown.clipped_from or (math.inf, "norm")
        clipped = places >= first
        for some, ink in ((~clipped, self.theme.accent), (clipped, limit_colour(self.theme, limit))):
            if some.any():
                colour = QColor(self.theme.ctl if self.grey else ink)
                colour.setAlphaF(0.6)
                bars = pg.BarGraphItem(
                    x=places[some], y0=bottom, height=heights[some], width=0.72 * apart, brush=QBrush(colour),
                    pen=QPen(Qt.PenStyle.NoPen),
                )  # fmt: skip
                self.add(bars, -2)


class TrackView(MeasurePlot):
    """The estimates after so many trials, and the trials of one observer."""

    def __init__(self) -> None:
        super().__init__("Expected track")
        self.apply_theme(LIGHT)

    def draw(self, shown: TrackPlot) -> None:
        """Draw bands, median, planted threshold and trials."""
        theme, (bottom, top) = self.theme, shown.span
        x, found = np.array(shown.trials), [np.array(one) for one in shown.found]
        self.band(x, found[0], found[-1], 0.18)
        self.band(x, found[1], found[-2], 0.30)
        self.curve(x, found[len(found) // 2], theme.ctl if self.grey else theme.accent, 2.4)
        self.curve([0, shown.last], [shown.planted, shown.planted], theme.text, 1.2, dashed=True)
        ink = QColor(theme.ctl if self.grey else theme.trace_y)
        for track in sorted({track for _, _, track, _ in shown.one}):
            for success in (True, False):
                some = [(trial, level) for trial, level, of, right in shown.one if of == track and right == success]
                points = pg.ScatterPlotItem(
                    [trial for trial, _ in some], [level for _, level in some], size=7,
                    symbol=SYMBOLS[(track - 1) % len(SYMBOLS)], pen=pen(ink.name(), 1.2),
                    brush=QBrush(ink) if success else QBrush(QColor(theme.surface)),
                )  # fmt: skip
                self.add(points, 3)
        if shown.clipped_from is not None and shown.clipped_from[0] < top:
            first, limit = shown.clipped_from
            self.zone(limit, max(bottom, first), top, upright=False)
        self.show_ticks("left", list(shown.ticks_y))
        self.show_ticks("bottom", list(shown.ticks_x))
        beyond = 0.04 * (top - bottom)
        self.box.setXRange(-0.03 * shown.last, 1.07 * shown.last, padding=0)
        self.box.setYRange(bottom - beyond, top + beyond, padding=0)


class ForcesView(MeasurePlot):
    """The force of each level: as sent, and dashed what the limits take away."""

    def __init__(self) -> None:
        super().__init__("Force at each level")
        self.box.sigResized.connect(self._draw)
        self.apply_theme(LIGHT)

    def draw(self, shown: ForcesPlot) -> None:
        """Draw bars and limit; nothing where no force is known."""
        theme, count = self.theme, len(shown.bars)
        self.show_ticks("left", list(shown.ticks_y))
        self.show_ticks("bottom", list(shown.ticks_x))
        if not shown.bars:
            return
        for at, bar in enumerate(shown.bars):
            if bar.clipped_by and bar.asked_n > bar.sent_n:
                lost = pg.BarGraphItem(
                    x=[at], y0=bar.sent_n, height=[bar.asked_n - bar.sent_n], width=0.62,
                    brush=QBrush(Qt.BrushStyle.NoBrush), pen=pen(limit_colour(theme, bar.clipped_by), 1.2, (2.0, 2.0)),
                )  # fmt: skip
                self.add(lost, 1)
        inks = [
            theme.ctl if bar.standard else limit_colour(theme, bar.clipped_by) if bar.clipped_by else theme.accent
            for bar in shown.bars
        ]
        for ink in dict.fromkeys(inks):
            places = [at for at, one in enumerate(inks) if one == ink]
            bars = pg.BarGraphItem(
                x=places, y0=0.0, height=[shown.bars[at].sent_n for at in places], width=0.62,
                brush=QBrush(QColor(ink)), pen=QPen(Qt.PenStyle.NoPen),
            )  # fmt: skip
            self.add(bars, 0)
        top = max(shown.limit_n, *(bar.asked_n for bar in shown.bars))
        highest = 1.16 * top
        limits: dict[Limit, float] = {"norm": shown.limit_n}
        if shown.slope_n is not None:
            limits["slope"] = shown.slope_n
        room = count * LIMITS_PX / max(LIMITS_PX + 1.0, self.box.width() - LIMITS_PX)
        for name, force_n in limits.items():
            ink, words = limit_colour(theme, name), f"{LIMIT_NAMES[name]} {force_n:.3g} N"
            above = 0.5 if len(limits) == 1 else 1.0 if name == "norm" else 0.0  # the limits may be nearly equal
            self.curve([-0.7, count - 0.3], [force_n, force_n], ink, 1.5, dashed=True)
            self.words(words, count - 0.2, force_n, ink, (0.0, above), over=True)
        self.box.setXRange(-0.8, count - 0.2 + room, padding=0)
        self.box.setYRange(0.0, highest, padding=0)
