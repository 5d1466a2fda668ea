"""The lab's cards: live plots, cost and error, limiters."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QLabel, QStackedLayout, QVBoxLayout, QWidget

from study_app.gui.lab.lab_state import SPAN_S, CostRow, ErrorRow, Floats, LabView
from study_app.gui.lab.parameters import HIDDEN
from study_app.gui.theme.theme import LIGHT, RADIUS_CONTROL, Theme, font
from study_app.gui.theme.themed import Themed, remove_widget
from study_app.gui.widgets.accessible import describe_plot
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Bar, Card, Icon, MaskedPanel, Rule, fill_rounded, smooth_painter
from study_app.gui.widgets.labels import Elided, figures, label, set_ink
from study_app.gui.widgets.live_plots import MINUS, Plot, draw_quickly, pen, tick_text
from study_app.lab.live import LimiterCount
from study_app.number_text import grouped

_POINTS = 240  # of a curve: one for one to two pixels, since painting time grows with their number
_STEPS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
MOST_TICKS, TICK_PX = 5, 22
LEGEND_LINE, LEGEND_GAP, STROKE_WIDTH = 20, 16.0, 24.0
_LABEL_PX = 9.0  # half the height of a tick's number
_SHRINK_BELOW = 0.45  # part of the height below which the scale shrinks, so that it does not follow every peak
_DASH: dict[str, tuple[float, float] | None] = {"solid": None, "long": (6.0, 3.0), "short": (3.0, 2.0)}


@dataclass(frozen=True, slots=True)
class _CurveStyle:
    """The appearance of a curve: its name, its colour in a theme, and its stroke."""

    name: str
    colour: Callable[[Theme], str]
    stroke: str
    width: float = 2.0


A = _CurveStyle("A", lambda theme: theme.trace_x, "solid", 2.2)
B = _CurveStyle("B", lambda theme: theme.trace_y, "long")
_BODY = _CurveStyle("body", lambda theme: theme.text3, "short", 1.6)
_LIMIT = _CurveStyle("limit", lambda theme: theme.bad, "short", 1.6)


class _Legend(Themed, QWidget):
    """The legend of a plot: the names of its curves, each after a sample of its stroke."""

    def __init__(self) -> None:
        super().__init__()
        self._entries: tuple[tuple[_CurveStyle, str], ...] = ()
        self._font = font("small", weight=500, tabular=True)
        self.setFixedHeight(LEGEND_LINE)

    def show_entries(self, entries: tuple[tuple[_CurveStyle, str], ...]) -> None:
        if entries != self._entries:
            self._entries = entries
            self.setAccessibleName(", ".join(text for _, text in entries))
            self._fit_height()
            self.update()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit_height()

    def _fit_height(self) -> None:
        lines = {place.y() for place in self._entry_positions()}
        self.setFixedHeight(LEGEND_LINE * max(1, len(lines)))

    def _entry_positions(self) -> list[QPointF]:
        metrics = QFontMetricsF(self._font)
        positions, x, y = [], 0.0, LEGEND_LINE / 2
        for _, text in self._entries:
            width = STROKE_WIDTH + 6 + metrics.horizontalAdvance(text)
            if x and x + width > self.width():
                x, y = 0.0, y + LEGEND_LINE
            positions.append(QPointF(x, y))
            x += width + LEGEND_GAP
        return positions

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = smooth_painter(self)
        painter.setFont(self._font)
        for (style, text), place in zip(self._entries, self._entry_positions(), strict=True):
            ink = style.colour(self.theme)
            painter.setPen(pen(ink, style.width * self.devicePixelRatioF(), _DASH[style.stroke]))
            painter.drawLine(place, place + QPointF(STROKE_WIDTH, 0))
            painter.setPen(QColor(ink if style is _LIMIT else self.theme.text2))
            painter.drawText(place + QPointF(STROKE_WIDTH + 6, 4.5), text)


class _CurvePlot(Plot):
    """A plot of curves above 0 over the last 2.5 s; the scale grows at once, but shrinks only by half."""

    def __init__(self, styles: tuple[_CurveStyle, ...], least: float) -> None:
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
        self.box.sigResized.connect(self._draw_ticks)
        self.apply_theme(LIGHT)

    def sizeHint(self) -> QSize:
        return QSize(240, 120)

    def show_curves(self, t_s: Floats, values: tuple[Floats, ...], limit: float | None = None) -> None:
        """Draw ``values``, each (n,), over ``t_s`` (n,), and the limit, if any."""
        peak = max((float(np.nanmax(curve)) for curve in values if len(curve)), default=0.0)
        self._show_top(max(peak, limit or 0.0, self._least))
        for curve, samples in zip(self.curves, values, strict=True):
            curve.setData(*_thin_samples(t_s, samples))
        self.limit.setVisible(limit is not None)
        if limit is not None:
            self.limit.setPos(limit)

    def apply_theme(self, theme: Theme) -> None:
        super().apply_theme(theme)
        for curve, style in zip(self.curves, self._styles, strict=True):
            curve.setPen(self.stroke(style.colour(theme), style.width, _DASH[style.stroke]))
        self.limit.setPen(self.stroke(theme.bad, 1.5, _DASH["short"]))

    def _show_top(self, peak: float) -> None:
        if _SHRINK_BELOW * self._top <= peak <= self._top:
            return
        self._peak = peak
        self._draw_ticks()

    def _draw_ticks(self) -> None:
        """Draw grid lines up to the peak, as many as fit."""
        ticks = max(2, min(MOST_TICKS, int(self.box.height() // TICK_PX)))
        step = next((size for size in _STEPS if self._peak / size <= ticks), _STEPS[-1])
        rows = max(1, int(np.ceil(self._peak / step - 1e-9)))
        self._top = rows * step
        self.show_ticks("left", [(k * step, tick_text(round(k * step, 6))) for k in range(rows + 1)])
        self._set_range()

    def _set_range(self) -> None:
        """Leave space for half a number above the highest grid line."""
        share = min(_LABEL_PX / max(1.0, self.box.height()), 0.3)
        self.box.setYRange(-0.02 * self._top, self._top / (1 - share), padding=0)


_FORCE_SENTENCE = f"Magnitude of the force in settings A and B for the same motion over the last {SPAN_S:g} s, in N."
_SPEED_SENTENCE = f"Speed of the body, and of the wake in settings A and B, over the last {SPAN_S:g} s, in m/s."


class _ReadingCard(Card):
    """A card whose content is hidden, with its space kept, while the comparison is blind."""

    def __init__(self, title: str, aside: QLabel, why: str, *, padding: int = 15, gap: int = 6) -> None:
        super().__init__(title, aside, padding=padding, gap=gap)
        self.aside = aside
        self._shown = QWidget()
        self.content = vbox(spacing=4, margins=0, parent=self._shown)
        self.stack = QStackedLayout()
        self.stack.addWidget(self._shown)
        self._masked = MaskedPanel(HIDDEN, why)
        self.stack.addWidget(self._masked)
        add_layout(self.column, self.stack, 1)

    def show_blind(self, blind: bool) -> bool:
        """Hide or show the content; return whether it is hidden.

        Hidden content must not be updated, since a change of its size would reveal that the felt setting changed.
        """
        self.stack.setCurrentIndex(int(blind))
        self.aside.setVisible(not blind)
        return blind


class _PlotCard(_ReadingCard):
    """A card with a plot and the legend above it."""

    def __init__(self, title: str, unit: str, plot: Plot, sentence: str) -> None:
        why = "The trace would reveal the settings."
        super().__init__(title, label(unit, "small", "text2"), why, padding=14, gap=4)
        self.plot, self.legend = plot, _Legend()
        describe_plot(plot, title, sentence)
        self.content.setSpacing(2)
        add_parts(self.content, self.legend, (plot, 1))
        self.setMinimumHeight(226)


class ForceCard(_PlotCard):
    """The plot of the force of both settings for the same motion, with the limit of the felt one."""

    def __init__(self) -> None:
        super().__init__("Force on the hand", f"N, last {SPAN_S:g} s", _CurvePlot((B, A), 1.0), _FORCE_SENTENCE)

    def show_view(self, view: LabView) -> None:
        if self.show_blind(view.workbench.blind):
            return
        limit = view.workbench.in_hand.scene.force_limit_n
        a, b = ("A (felt now)", "B (same motion)") if view.felt == "A" else ("A (same motion)", "B (felt now)")
        self.legend.show_entries(((A, a), (B, b), (_LIMIT, f"limit {limit:g} N")))
        trace = view.trace
        empty = np.empty(0)
        t_s = empty if trace is None else trace.t_s
        forces = (empty, empty) if trace is None else (_vector_sizes(trace.force_b_n), _vector_sizes(trace.force_a_n))
        self.plot.show_curves(t_s, forces, limit)


class SpeedCard(_PlotCard):
    """The plot of the body's speed, and of the wake's speed at the body in both settings."""

    def __init__(self) -> None:
        super().__init__("Body and wake", f"m/s, last {SPAN_S:g} s", _CurvePlot((_BODY, B, A), 0.5), _SPEED_SENTENCE)
        self.legend.show_entries(((_BODY, "body"), (A, "wake of A"), (B, "wake of B")))

    def show_view(self, view: LabView) -> None:
        if self.show_blind(view.workbench.blind):
            return
        trace = view.trace
        if trace is None:
            self.plot.show_curves(np.empty(0), (np.empty(0), np.empty(0), np.empty(0)))
        else:
            self.plot.show_curves(trace.t_s, (trace.body_mps, trace.wake_b_mps, trace.wake_a_mps))


def _vector_sizes(vectors: Floats) -> Floats:
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))


def _thin_samples(t_s: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return the newest time and the largest value of each group of samples, so that peaks are kept."""
    step = max(1, len(t_s) // _POINTS)
    first = len(t_s) % step
    return t_s[first:].reshape(-1, step)[:, -1], values[first:].reshape(-1, step).max(axis=1)


_NAME_WIDTH = 84
_LINE = 26
COST_HEIGHT, ERROR_HEIGHT = 252, 3 * _LINE + 6  # usual heights, which are reserved until the measurement
_UNKNOWN = "–"
_LEAST_NS = 1.0  # the smallest cost that can be measured next to a running servo
_LimiterState = Literal["acting", "acted", "quiet"]


class _CostLine(QWidget):
    """A line with an effect, its time in ns, and a bar relative to the most expensive effect."""

    def __init__(self) -> None:
        super().__init__()
        self.name = Elided("label")
        self.name.setFixedWidth(_NAME_WIDTH)
        self.bar = Bar()
        self.ns = figures("", "label")
        self.ns.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.ns.setMinimumWidth(56)
        hbox(self.name, (self.bar, 1), self.ns, spacing=10, margins=0, parent=self)
        self.setFixedHeight(_LINE)

    def show_cost(self, cost: CostRow, most_ns: float) -> None:
        ns = cost.ns or 0.0
        self.name.show_text(cost.effect)
        self.bar.show_share(ns / most_ns if most_ns > 0 else 0.0)
        text = f"{ns:.0f} ns" if ns >= _LEAST_NS else f"< {_LEAST_NS:g} ns"
        self.ns.setText(text)
        self.setAccessibleName(f"{cost.effect}: {text}")

    def show_waiting(self) -> None:
        self.bar.show_share(0.0)
        self.ns.setText(_UNKNOWN)
        self.setAccessibleName(f"{self.name.accessibleName()}: measuring")


class _AbsentLine(QWidget):
    """A line with an effect that has no cost, and the reason."""

    def __init__(self) -> None:
        super().__init__()
        self.name = label("", "label", "text2")
        self.why = Elided("small", "text2")
        self.why.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        hbox(Icon("minus", "text3", 14), self.name, (self.why, 1), spacing=8, margins=0, parent=self)
        self.setFixedHeight(_LINE - 3)

    def show_cost(self, cost: CostRow) -> None:
        self.name.setText(cost.effect)
        self.why.show_text(cost.why)


class CostCard(_ReadingCard):
    """The card with the time of each effect per tick."""

    def __init__(self) -> None:
        super().__init__("Time per tick", label("", "small", "text2"), "Computation times would reveal the settings.")
        self.lines: list[_CostLine] = []
        self.absent: list[_AbsentLine] = []
        self._costs = vbox(spacing=0)
        self._absent = vbox(spacing=0)
        self.sum_name = label("Sum", "label", weight=600)
        self.sum = figures("", "label", weight=600)
        self.sum.setAlignment(Qt.AlignmentFlag.AlignRight)
        whole = hbox(self.sum_name, (self.sum, 1))
        add_parts(self.content, self._costs, Rule(), whole, self._absent, STRETCH)
        self._masked.setMinimumHeight(COST_HEIGHT)  # the lines may be higher

    def show_view(self, view: LabView) -> None:
        if self.show_blind(view.workbench.blind):
            return
        self.aside.setText(_aside_text(view))
        if view.measuring and not view.cost and self.lines:
            self._show_waiting()
            return
        present = [row for row in view.cost if row.ns is not None]
        missing = [row for row in view.cost if row.ns is None]
        most_ns = max((row.ns or 0.0 for row in present), default=0.0)
        _match_count(self.lines, len(present), _CostLine, self._costs)
        _match_count(self.absent, len(missing), _AbsentLine, self._absent)
        for line, row in zip(self.lines, present, strict=True):
            line.show_cost(row, most_ns)
        for absent, row in zip(self.absent, missing, strict=True):
            absent.show_cost(row)
        tick_ns = view.tick_ns if view.tick_ns is not None else sum(row.ns or 0.0 for row in present)
        period_ms = 1000 / view.workbench.in_hand.scene.rate_hz
        self.sum.setText(f"{grouped(round(tick_ns))} ns of {period_ms:g} ms" if view.cost else "not measured yet")

    def _show_waiting(self) -> None:
        """Clear the numbers, but keep the lines, so that the layout is stable while a slider is dragged."""
        for line in self.lines:
            line.show_waiting()
        self.sum.setText(_UNKNOWN)


class _ErrorLine(QWidget):
    """A line with a measure and its value."""

    def __init__(self) -> None:
        super().__init__()
        self.name, self.value = Elided("label", "text2"), figures("", "label", weight=600)
        self.name.setFixedHeight(_LINE)
        hbox((self.name, 1), self.value, margins=0, parent=self)

    def show_error(self, error: ErrorRow) -> None:
        self.name.show_text(error.measure)
        self.value.setText(error.value)
        self.value.setToolTip(error.note)


class ErrorCard(_ReadingCard):
    """The card with the deviation of the felt setting from its reference."""

    def __init__(self) -> None:
        why = "The errors relative to the reference would reveal the settings."
        super().__init__("Error relative to the reference", label("", "small", "text2"), why)
        self.lines: list[_ErrorLine] = []
        self._lines = vbox(spacing=2)
        add_parts(self.content, self._lines, STRETCH)
        self._shown.setMinimumHeight(ERROR_HEIGHT)

    def show_view(self, view: LabView) -> None:
        if self.show_blind(view.workbench.blind):
            return
        rows = view.errors or (ErrorRow(measure="Not measured yet", value=""),)
        if view.measuring and not view.errors and self.lines and self.lines[0].value.text():
            rows = tuple(ErrorRow(measure=line.name.whole, value=_UNKNOWN) for line in self.lines)
        _match_count(self.lines, len(rows), _ErrorLine, self._lines)
        for line, row in zip(self.lines, rows, strict=True):
            line.show_error(row)


class _LimiterLine(Themed, QWidget):
    """A line with a limiter and the number of ticks in which it acted; it is tinted while the limiter acts."""

    def __init__(self) -> None:
        super().__init__()
        self._state: _LimiterState = "quiet"
        self.name = Elided("label")
        self.word = label("", "small", "warn")
        self.count = figures("0", "label", "text2")
        self.count.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.count.setMinimumWidth(40)
        hbox((self.name, 1), self.word, self.count, spacing=6, margins=(34, 0, 10, 0), parent=self)
        self.setFixedHeight(_LINE + 2)

    def show_limiter(self, limiter: LimiterCount) -> None:
        state: _LimiterState = "acting" if limiter.acting else "acted" if limiter.ticks else "quiet"
        self.name.show_text(limiter.name)
        self.count.setText(grouped(limiter.ticks))
        if state != self._state:
            self._state = state
            self.word.setText({"acting": "acting now", "acted": "acted", "quiet": ""}[state])
            set_ink(self.count, "text2" if state == "quiet" else "warn")
            weight = 600 if state == "acting" else None
            self.name.setFont(font("label", weight=weight))
            self.count.setFont(font("label", weight=weight, tabular=True))
            self.update()
        self.setAccessibleName(f"{limiter.name}: {self.word.text() or 'inactive'}, {limiter.ticks} ticks")

    def paintEvent(self, _event: QPaintEvent) -> None:
        t = self.theme
        painter = smooth_painter(self)
        if self._state == "acting":
            fill_rounded(painter, QRectF(self.rect()), RADIUS_CONTROL, t.warn_bg)
        mark = QRectF(12, self.height() / 2 - 6, 12, 12)
        ink = QColor(t.text3 if self._state == "quiet" else t.warn)
        painter.setPen(ink)
        painter.setBrush(ink if self._state == "acting" else Qt.BrushStyle.NoBrush)
        painter.drawEllipse(mark)
        if self._state == "acted":
            painter.setBrush(ink)
            painter.drawChord(mark, 90 * 16, 180 * 16)


class LimiterCard(_ReadingCard):
    """The card with the limiters, and the number of ticks in which each acted in the last ten seconds."""

    def __init__(self) -> None:
        why = "Limiter counts would reveal the settings."
        super().__init__("Limiters", label("ticks, last 10 s", "small", "text2"), why)
        self.lines: list[_LimiterLine] = []
        self._lines = vbox(spacing=0, margins=(-8, 0, -8, 0))
        add_parts(self.content, self._lines, STRETCH)

    def show_view(self, view: LabView) -> None:
        if self.show_blind(view.workbench.blind):
            return
        _match_count(self.lines, len(view.limiters), _LimiterLine, self._lines)
        for line, limiter in zip(self.lines, view.limiters, strict=True):
            line.show_limiter(limiter)


def _aside_text(view: LabView) -> str:
    if view.measuring:
        return f"{view.felt}, measuring…"
    return f"{view.felt}, measured" if view.cost else ""


def _match_count(lines: list, count: int, kind: type, layout: QVBoxLayout) -> None:
    while len(lines) > count:
        remove_widget(lines.pop())
    while len(lines) < count:
        lines.append(kind())
        layout.addWidget(lines[-1])
