"""The operator's displays: tiles with the servo's health, and plots of force, position and lateness."""

import pyqtgraph as pg
from PySide6.QtCore import QPointF, QSize, Qt
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QWidget

from study_app.gui.operator.operator_view import OperatorView
from study_app.gui.operator.servo_health import TRACE_WINDOW_S, Forces, ServoHealth, Tile, Verdict
from study_app.gui.theme.theme import LIGHT, Theme, font
from study_app.gui.widgets.accessible import describe_plot
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, grid, hbox
from study_app.gui.widgets.cards import Card, Chip, Icon, MaskedPanel
from study_app.gui.widgets.labels import Elided, Ink, figures, label
from study_app.gui.widgets.live_plots import (
    NAME_MARGIN,
    NAMES,
    NOTHING,
    Floats,
    LatenessPlot,
    TracePlot,
    lateness_histogram,
    tick_text,
)

_FIELD = QSize(320, 210)
"""The preferred size of the force card, whether it shows the force or hides it."""
_MIN_RANGE = 1 / 16  # of the limit: a smaller range would make noise look like force
_NARROW_BELOW = 0.8  # hysteresis of the range, so that a force at its edge does not toggle the scale
_FILL_ALPHA = 46


class _ForcePlot(TracePlot):
    """Force on the hand along x, y, z, its magnitude as an area behind them, and the limit.

    The scale follows the force of the last ten seconds, up to the limit, since most liquids stay far below it.
    """

    limits: tuple[pg.InfiniteLine, ...] = ()
    limit_name: pg.TextItem | None = None
    magnitude_area: pg.PlotCurveItem | None = None

    def __init__(self, limit_n: float) -> None:
        super().__init__(TRACE_WINDOW_S, limit_n, (*NAMES, "size"))
        self.limit_n = limit_n
        self._least = limit_n * _MIN_RANGE
        self.magnitude_area = pg.PlotCurveItem(fillLevel=0.0)  # the area below the magnitude
        self.magnitude_area.setZValue(-5)
        self.limits = tuple(pg.InfiniteLine(sign * limit_n, angle=0) for sign in (1, -1))
        self.limit_name = pg.TextItem(f"limit {tick_text(limit_n)} N", anchor=(0, 0))
        self.limit_name.textItem.setFont(font("small", weight=600, tabular=True))
        self.limit_name.textItem.document().setDocumentMargin(NAME_MARGIN)
        for item in (self.magnitude_area, *self.limits, self.limit_name):
            self.box.addItem(item)
        self.axes["bottom"].setHeight(6)
        self.show_ticks("bottom", [])
        self._fit_axes()
        self.apply_theme(LIGHT)

    def show_forces(self, times_s: Floats, forces_n: Floats) -> None:
        """Draw forces (n, 4: x, y, z, magnitude) [N] over times before now (n,) [s]."""
        peak = float(forces_n[:, 3].max(initial=0.0))
        reach = min(max(peak, self._least), self.limit_n)
        if reach < _NARROW_BELOW * self.reach:
            self.show_reach(reach / _NARROW_BELOW if reach < self.limit_n else self.limit_n)
        self.show_traces(times_s, forces_n)
        if self.magnitude_area is not None:
            self.magnitude_area.setData(times_s, forces_n[:, 3])

    def _fit_axes(self) -> None:
        super()._fit_axes()
        for line in self.limits:
            line.setVisible(self.limit_n <= self.reach)
        if self.limit_name is not None:
            self.limit_name.setVisible(self.limit_n <= self.reach)
            self.limit_name.setPos(QPointF(-1.01 * self._span_s, self.limit_n))

    def apply_theme(self, theme: Theme) -> None:
        super().apply_theme(theme)
        self.curves[3].setPen(self.stroke(theme.text3, 1.4))
        self.ends[3].setColor(QColor(theme.text3))
        for line in self.limits:
            line.setPen(self.stroke(theme.bad, 1.4, (4.0, 3.0)))
        if self.limit_name is not None:
            self.limit_name.setColor(QColor(theme.bad))
        if self.magnitude_area is not None:
            field = QColor(theme.text3)
            field.setAlpha(_FILL_ALPHA)
            self.magnitude_area.setPen(NOTHING)
            self.magnitude_area.setBrush(field)


class ForceCard(Card):
    """The force over the last ten seconds."""

    def __init__(self, limit_n: float) -> None:
        aside = label(f"last {TRACE_WINDOW_S:.0f} s, N; limit {limit_n:g}", "small", "text2")
        super().__init__("Force", aside, padding=16, gap=2)
        self.plot = _ForcePlot(limit_n)
        self.plot.setMinimumHeight(48)
        self.column.addWidget(self.plot, 1)
        span = f"over the last {TRACE_WINDOW_S:.0f} s"
        force = f"Force along x, y and z and its magnitude {span}, in N. The limit is {limit_n:g} N."
        describe_plot(self.plot, "Force on the hand", force)

    def show_forces(self, forces: Forces, now_ns: int) -> None:
        """Draw the force up to ``now_ns`` on the servo's clock."""
        self.plot.show_forces(*forces.trace(now_ns))
        self.plot.paint_now()

    def sizeHint(self) -> QSize:
        return _FIELD

    def minimumSizeHint(self) -> QSize:
        return _FIELD


class LatenessCard(Card):
    """A histogram of the lateness of the last minute's ticks."""

    def __init__(self, limit_s: float) -> None:
        super().__init__("Tick lateness", label("last 60 s", "small", "text2"), padding=16, gap=4)
        self.plot = LatenessPlot(limit_s * 1e6)
        describe_plot(self.plot, "Tick lateness", "Histogram of tick lateness over the last minute, in µs.")
        axes = label("lateness, µs (log), ticks per bin (log)", "small", "text2")
        axes.setAlignment(Qt.AlignmentFlag.AlignHCenter)
        add_parts(self.column, (self.plot, 1), axes)

    def show_health(self, health: ServoHealth) -> None:
        p99 = health.vitals().lateness_p99_s
        self.plot.show_histogram(*lateness_histogram(health.latenesses_us), None if p99 is None else p99 * 1e6)
        self.plot.paint_now()


class PositionCard(Card):
    """The position of the hand, or of the mouse pointer, over the last ten seconds."""

    def __init__(self, reach_m: float, *, pointer: bool) -> None:
        title = "Position of the pointer" if pointer else "Position of the hand"
        super().__init__(title, label(f"last {TRACE_WINDOW_S:.0f} s, mm", "small", "text2"), padding=16, gap=4)
        self.plot = TracePlot(TRACE_WINDOW_S, reach_m * 1000)
        description = f"Position along x, y and z over the last {TRACE_WINDOW_S:.0f} s, in mm."
        describe_plot(self.plot, title, description)
        self.column.addWidget(self.plot, 1)

    def show_health(self, health: ServoHealth, now_s: float) -> None:
        times, positions = health.trace(now_s)
        self.plot.show_traces(times, positions * 1000)
        self.plot.paint_now()


class HiddenForceCard(Card):
    """A placeholder for the force plot in a double-blind study, of the same size."""

    TITLE = "Hidden because the study is double-blind"
    WHY = "The trace would reveal the liquid."

    def __init__(self) -> None:
        super().__init__("Force", Chip("neutral", "eye_off", "Hidden", small=True), padding=16, gap=8)
        self.column.addWidget(MaskedPanel(self.TITLE, self.WHY), 1)

    def sizeHint(self) -> QSize:
        return _FIELD

    def minimumSizeHint(self) -> QSize:
        return _FIELD


_VERDICTS: dict[Verdict, tuple[str, Ink]] = {
    "ok": ("check", "ok"),
    "late": ("warning", "warn"),
    "open": ("ring", "text3"),
}


class _TileCard(Card):
    """A tile with one number and its verdict."""

    def __init__(self) -> None:
        super().__init__(padding=14, gap=4)
        self.title = label("", "label", "text2")
        self.value = figures("", "number")
        self.unit = label("", "label", "text2")
        self.sign = Icon("ring", "text3", 14)
        self.line = Elided("small", "text2")
        self.column.addWidget(self.title)
        row = hbox(self.value, self.unit, STRETCH, spacing=6)
        add_layout(self.column, row)
        below = hbox(self.sign, (self.line, 1), spacing=8)
        add_layout(self.column, below)

    def show_tile(self, tile: Tile) -> None:
        self.title.setText(tile.title)
        self.value.setText(tile.value)
        self.unit.setText(tile.unit)
        self.line.show_text(tile.line)
        self.sign.show_icon(*_VERDICTS[tile.verdict])
        states = {"ok": "within limits", "late": "outside limits", "open": "not measured yet"}
        value = f"{tile.value} {tile.unit}".strip()
        self.setAccessibleName(f"{tile.title}: {value}, {states[tile.verdict]}, {tile.line}")


class Tiles(QWidget):
    """The row of four tiles."""

    def __init__(self) -> None:
        super().__init__()
        self._grid = grid(10, 10, margins=0, parent=self)
        self.cards = [_TileCard() for _ in range(4)]
        self.set_narrow(False)

    def set_narrow(self, narrow: bool) -> None:
        self.across = across = 2 if narrow else 4
        for index, card in enumerate(self.cards):
            self._grid.addWidget(card, index // across, index % across)
        for column in range(4):
            self._grid.setColumnStretch(column, int(column < across))

    def show_view(self, view: OperatorView) -> None:
        for card, tile in zip(self.cards, view.tiles, strict=True):
            card.show_tile(tile)
