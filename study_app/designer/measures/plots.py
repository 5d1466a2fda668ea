"""The plots of a block with a method: psychometric function, expected track, force of each level."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPointF, QSize, Qt
from PySide6.QtGui import QBrush, QColor, QPen

from study_app.designer.measures.levels import (
    LIMIT_NAMES,
    LevelBlock,
    LevelWords,
    Limit,
    even_ticks,
    limit_colour,
    rounded,
)
from study_app.designer.measures.measures_view import NO_FORCES
from study_app.designer.measures.simulation import Observed
from study_app.gui.theme.theme import LIGHT, Theme, font
from study_app.gui.widgets.accessible import describe_plot
from study_app.gui.widgets.live_plots import Floats, Plot, pen
from study_app.protocol.presented.presented_levels import Level, standard_level

_BARS = 0.14  # of the height, for how often each level is asked
_SYMBOLS = ("o", "t1", "s", "d")
_DASHED = (4.0, 3.0)
_LIMITS_PX = 128.0  # of the names of the limits
_MOST_LABELS = 9


class _MeasurePlot(Plot):
    """A plot that is drawn anew from its value; ``sentence`` says what observers answered."""

    sentence: Callable[[LevelWords, Observed], str]

    def __init__(self, name: str) -> None:
        super().__init__()
        self.axes["left"].setWidth(40)
        self.axes["bottom"].setHeight(26)
        self.drawn: list[pg.GraphicsObject] = []
        self.shown: tuple[Any, ...] = ()
        self.grey = False
        describe_plot(self, name, "Not known yet.")

    def sizeHint(self) -> QSize:
        return QSize(220, 110)

    def show_plot(self, sentence: str, *shown: Any, grey: bool = False) -> None:
        """Draw other values, nothing if there are none; in grey if they are of an earlier version."""
        if (shown, grey) != (self.shown, self.grey):
            self.shown, self.grey = shown, grey
            self.setAccessibleDescription(sentence)
            self._draw()

    def show_observed(self, of: LevelBlock, observed: Observed | None, *, grey: bool) -> None:
        """Show the observers' answers; None before the first answer."""
        if observed is None or not observed.course:
            self.show_plot("Not known yet.")
        else:
            self.show_plot(self.sentence(of.words, observed), of.words, observed, of.clipped_from, grey=grey)

    def _draw(self) -> None:
        for item in self.drawn:
            self.box.removeItem(item)
        self.drawn = []
        if self.shown:
            self.draw(*self.shown)
        else:
            self.show_ticks("left", [])
            self.show_ticks("bottom", [])

    def draw(self, *shown: Any) -> None:
        raise NotImplementedError

    def apply_theme(self, theme: Theme) -> None:
        super().apply_theme(theme)
        self._draw()

    def add_item(self, item: pg.GraphicsObject, z: float = 0.0) -> None:
        """Draw an item at a z value; higher ones are in front."""
        item.setZValue(z)
        self.box.addItem(item, ignoreBounds=True)
        self.drawn.append(item)

    def draw_band(self, x: np.ndarray, low: np.ndarray, high: np.ndarray, opacity: float) -> None:
        colour = QColor(self.theme.ctl if self.grey else self.theme.accent)
        colour.setAlphaF(opacity)
        curves = (pg.PlotCurveItem(x, curve) for curve in (low, high))
        self.add_item(pg.FillBetweenItem(*curves, brush=QBrush(colour)), -5)

    def draw_curve(self, x: object, y: object, colour: str, width: float = 2.0, *, dashed: bool = False) -> None:
        made = pg.PlotCurveItem(np.asarray(x, float), np.asarray(y, float), antialias=True)
        made.setPen(self.stroke(colour, width, _DASHED if dashed else None))
        self.add_item(made, 2)

    def draw_zone(self, limit: Limit, first: float, last: float, *, upright: bool) -> None:
        colour = QColor(limit_colour(self.theme, limit))
        edge = colour.name()
        colour.setAlphaF(0.16)
        made = pg.LinearRegionItem(
            (first, last), orientation="vertical" if upright else "horizontal", movable=False, brush=QBrush(colour),
            pen=pen(edge, 1, _DASHED),
        )  # fmt: skip
        self.add_item(made, -8)

    def write_text(
        self, text: str, x: float, y: float, colour: str, anchor: tuple[float, float], *, over: bool = False
    ) -> None:
        """Write a text at a position; with ``over`` it interrupts the grid line behind it."""
        made = pg.TextItem(text, color=QColor(colour), anchor=anchor, fill=QColor(self.theme.surface) if over else None)
        made.textItem.setFont(font("small", weight=600, tabular=True))
        made.setPos(QPointF(x, y))
        self.add_item(made, 5)


class FunctionView(_MeasurePlot):
    """The psychometric function, the functions that were found, and how often each level is asked."""

    def __init__(self) -> None:
        super().__init__("Psychometric function")
        self.sentence = function_sentence
        self.apply_theme(LIGHT)

    def draw(self, wording: LevelWords, observed: Observed, clipped_from: tuple[float, Limit] | None) -> None:
        """Draw bands, function, mark and bars; x is the coordinate of the levels, y is in percent."""
        theme, x = self.theme, np.array([wording.at(level) for level in observed.levels])
        left, right = float(x[0]), float(x[-1])
        planted, quantiles = 100 * np.array(observed.planted), [100 * np.array(quantile) for quantile in observed.found]
        low = 10.0 * math.floor(10.0 * min(observed.planted[0], *(quantile[0] for quantile in observed.found)) + 1e-9)
        bottom, top = low - 1.0, 101.5
        self.draw_band(x, quantiles[-1], quantiles[0], 0.18)
        self.draw_band(x, quantiles[-2], quantiles[1], 0.30)
        self.draw_curve(x, planted, theme.ctl if self.grey else theme.accent, 2.4)
        at, percent = wording.at(observed.threshold), 100 * observed.at_threshold
        for xs, ys in (([left, at], [percent, percent]), ([at, at], [bottom, percent])):
            self.draw_curve(xs, ys, theme.text, 1.2, dashed=True)
        dot = pg.ScatterPlotItem([at], [percent], size=9, pen=pen(theme.text, 2), brush=QBrush(QColor(theme.surface)))
        self.add_item(dot, 4)
        before = at > (left + right) / 2
        self.write_text(
            wording.words(observed.threshold), at, percent, theme.text, (1.08, 1.0) if before else (-0.08, 0.0)
        )
        asked = np.array([(wording.at(level), share) for level, share in observed.asked]).reshape(-1, 2)
        self._draw_bars(asked[:, 0], asked[:, 1], right - left, (bottom, top), clipped_from)
        if clipped_from is not None and clipped_from[0] < right:
            self.draw_zone(clipped_from[1], max(left, clipped_from[0]), right, upright=True)
        self.show_ticks("left", [(percent, f"{percent:g}") for percent in even_ticks(low, 100.0, 7)])
        self.show_ticks("bottom", list(wording.ticks()))
        beyond = 0.03 * (right - left)
        self.box.setXRange(left - beyond, right + beyond, padding=0)
        self.box.setYRange(bottom, top, padding=0)

    def _draw_bars(
        self,
        places: Floats,
        shares: Floats,
        span: float,
        ends: tuple[float, float],
        clipped_from: tuple[float, Limit] | None,
    ) -> None:
        if not len(places) or shares.max() <= 0:
            return
        apart = float(np.min(np.diff(places))) if len(places) > 1 else 0.04 * span
        heights = _BARS * (ends[1] - ends[0]) * shares / shares.max()
        first, limit = clipped_from or (math.inf, "norm")
        clipped = places >= first
        for some, ink in ((~clipped, self.theme.accent), (clipped, limit_colour(self.theme, limit))):
            if some.any():
                colour = QColor(self.theme.ctl if self.grey else ink)
                colour.setAlphaF(0.6)
                bars = pg.BarGraphItem(
                    x=places[some], y0=ends[0], height=heights[some], width=0.72 * apart, brush=QBrush(colour),
                    pen=QPen(Qt.PenStyle.NoPen),
                )  # fmt: skip
                self.add_item(bars, -2)


class TrackView(_MeasurePlot):
    """The estimates after so many trials, and the trials of one observer."""

    def __init__(self) -> None:
        super().__init__("Expected track")
        self.sentence = track_sentence
        self.apply_theme(LIGHT)

    def draw(self, wording: LevelWords, observed: Observed, clipped_from: tuple[float, Limit] | None) -> None:
        """Draw bands, median, planted threshold and trials; y is the coordinate of the levels."""
        theme, bottom, top = self.theme, wording.at(observed.levels[0]), wording.at(observed.levels[-1])
        last, planted = _last_trial(observed), wording.at(observed.threshold)
        x = np.array([number for number, _ in observed.course], float)
        quantiles = np.array([[wording.at(level) for level in levels] for _, levels in observed.course]).T
        self.draw_band(x, quantiles[0], quantiles[-1], 0.18)
        self.draw_band(x, quantiles[1], quantiles[-2], 0.30)
        self.draw_curve(x, quantiles[len(quantiles) // 2], theme.ctl if self.grey else theme.accent, 2.4)
        self.draw_curve([0, last], [planted, planted], theme.text, 1.2, dashed=True)
        ink = QColor(theme.ctl if self.grey else theme.trace_y)
        for track in sorted({asked.track for asked in observed.one}):
            for success in (True, False):
                some = [asked for asked in observed.one if asked.track == track and asked.success == success]
                points = pg.ScatterPlotItem(
                    [asked.trial for asked in some], [wording.at(asked.level) for asked in some], size=7,
                    symbol=_SYMBOLS[(track - 1) % len(_SYMBOLS)], pen=pen(ink.name(), 1.2),
                    brush=QBrush(ink) if success else QBrush(QColor(theme.surface)),
                )  # fmt: skip
                self.add_item(points, 3)
        if clipped_from is not None and clipped_from[0] < top:
            self.draw_zone(clipped_from[1], max(bottom, clipped_from[0]), top, upright=False)
        self.show_ticks("left", list(wording.ticks()))
        self.show_ticks("bottom", [(trial or 1, f"{trial or 1:g}") for trial in even_ticks(0, last, 7)])
        beyond = 0.04 * (top - bottom)
        self.box.setXRange(-0.03 * last, 1.07 * last, padding=0)
        self.box.setYRange(bottom - beyond, top + beyond, padding=0)


class ForcesView(_MeasurePlot):
    """The force of each level: as sent, and dashed what the limits take away."""

    def __init__(self) -> None:
        super().__init__("Force at each level")
        self.box.sigResized.connect(self._draw)
        self.apply_theme(LIGHT)

    def show_levels(self, of: LevelBlock) -> None:
        """Show the levels of the highest standard; nothing if no force is known."""
        shown = [level for level in of.shown if level.asked_n is not None]
        if not shown or of.limits is None:
            self.show_plot(forces_sentence(of))
            return
        bars = list(shown) if of.standard is None else [standard_level(of.protocol, of.block.id, of.standard), *shown]
        values = [*([] if of.standard is None else [of.standard]), *(level.comparison for level in shown)]
        limits: dict[Limit, float] = {"norm": of.protocol.device.force_limit_n}
        if clipped := [level.sent_n or 0.0 for level in shown if level.clipped_by == "slope"]:
            limits["slope"] = min(clipped)
        self.show_plot(forces_sentence(of), tuple(bars), tuple(values), limits, of.standard is not None)

    def draw(
        self, bars: tuple[Level, ...], values: tuple[float, ...], limits: dict[Limit, float], has_standard: bool
    ) -> None:
        """Draw bars and limits; below some bars stands their value of ``values``."""
        theme, count = self.theme, len(bars)
        forces = [(bar.asked_n or 0.0, bar.sent_n or 0.0) for bar in bars]
        top = max(limits["norm"], *(asked for asked, _ in forces))
        step = max(1, math.ceil(count / _MOST_LABELS))
        self.show_ticks("left", [(force_n, f"{force_n:g}") for force_n in even_ticks(0.0, 1.02 * top, 5)])
        self.show_ticks("bottom", [(float(at), rounded(values[at])) for at in range(0, count, step)])
        for at, (bar, (asked, sent)) in enumerate(zip(bars, forces, strict=True)):
            if bar.clipped_by and asked > sent:
                lost = pg.BarGraphItem(
                    x=[at], y0=sent, height=[asked - sent], width=0.62, brush=QBrush(Qt.BrushStyle.NoBrush),
                    pen=pen(limit_colour(theme, bar.clipped_by), 1.2, (2.0, 2.0)),
                )  # fmt: skip
                self.add_item(lost, 1)
        inks = [limit_colour(theme, bar.clipped_by) if bar.clipped_by else theme.accent for bar in bars]
        inks[:1] = [theme.ctl] if has_standard else inks[:1]
        for ink in dict.fromkeys(inks):
            places = [at for at, bar_ink in enumerate(inks) if bar_ink == ink]
            bars = pg.BarGraphItem(
                x=places, y0=0.0, height=[forces[at][1] for at in places], width=0.62,
                brush=QBrush(QColor(ink)), pen=QPen(Qt.PenStyle.NoPen),
            )  # fmt: skip
            self.add_item(bars, 0)
        room = count * _LIMITS_PX / max(_LIMITS_PX + 1.0, self.box.width() - _LIMITS_PX)
        for name, force_n in limits.items():
            ink, text = limit_colour(theme, name), f"{LIMIT_NAMES[name]} {force_n:.3g} N"
            above = 0.5 if len(limits) == 1 else 1.0 if name == "norm" else 0.0  # the limits may be nearly equal
            self.draw_curve([-0.7, count - 0.3], [force_n, force_n], ink, 1.5, dashed=True)
            self.write_text(text, count - 0.2, force_n, ink, (0.0, above), over=True)
        self.box.setXRange(-0.8, count - 0.2 + room, padding=0)
        self.box.setYRange(0.0, 1.16 * top, padding=0)


def function_sentence(scale: LevelWords, seen: Observed) -> str:
    """Describe the psychometric function in a sentence."""
    most, _ = max(seen.asked, key=lambda pair: pair[1], default=(0.0, 0.0))
    low, high = _middle_half(seen)
    return (
        f"Proportion of answers that are {scale.success}, against the {scale.kind}: {100 * seen.planted[0]:.0f} "
        f"% at {scale.words(seen.levels[0])} to {100 * seen.planted[-1]:.0f} % at "
        f"{scale.words(seen.levels[-1])}, {100 * seen.at_threshold:.0f} % at the simulated {scale.name} of "
        f"{scale.words(seen.threshold)}. Half of the {seen.observers} estimates lie between {scale.number(low)} "
        f"and {scale.words(high)}. The level presented most often is {scale.words(most)}."
    )


def track_sentence(scale: LevelWords, seen: Observed) -> str:
    """Describe the expected track in a sentence."""
    low, high = _middle_half(seen)
    return (
        f"Estimates of the {scale.name} over {_last_trial(seen)} trials: after the last trial half of the "
        f"estimates lie between {scale.number(low)} and {scale.words(high)}, the simulated value is "
        f"{scale.words(seen.threshold)}. One of them answered {sum(asked.success for asked in seen.one)} of "
        f"{len(seen.one)} trials correctly."
    )


def forces_sentence(of: LevelBlock) -> str:
    """Describe the force at each level of the highest standard in a sentence."""
    shown = [level for level in of.shown if level.asked_n is not None]
    if not shown or of.limits is None:
        return NO_FORCES
    clipped = sum(level.clipped_by is not None for level in of.levels)
    least = shown[0].comparison if of.standard is None else of.standard
    slope_n = min((level.sent_n or 0.0 for level in shown if level.clipped_by == "slope"), default=None)
    slope = "" if slope_n is None else f", the {LIMIT_NAMES['slope']} {slope_n:.2f} N"
    return (
        f"Force at {len(shown)} levels from {rounded(least)} to {rounded(shown[-1].comparison)} "
        f"{of.words.value_unit}: at most {max(level.asked_n or 0.0 for level in shown):.2f} N are requested; the "
        f"{LIMIT_NAMES['norm']} is {of.protocol.device.force_limit_n:g} N{slope}. {len(of.levels) - clipped} of "
        f"{len(of.levels)} levels are as requested, {clipped} are clipped."
    )


def _middle_half(observed: Observed) -> tuple[float, float]:
    """Return the 25 and 75 % quantiles of the estimates after all trials."""
    quantiles = observed.course[-1][1]
    return quantiles[1], quantiles[3]


def _last_trial(observed: Observed) -> int:
    return max((asked.trial for asked in observed.one), default=1)
