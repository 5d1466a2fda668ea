"""A moment of a recorded trial: the participant's tank with arrows, both forces with a cursor, the time line."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPointF
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF, QRegion
from PySide6.QtWidgets import QSizePolicy, QWidget

from study_app.gui.participant.tank.arrows import HEIGHTS, Arrow, arrows_place, paint_arrows
from study_app.gui.participant.tank.frame import Placed
from study_app.gui.participant.tank_widget import TankWidget
from study_app.gui.theme.theme import LIGHT, TANK, Theme
from study_app.gui.widgets.accessible import describe_plot
from study_app.gui.widgets.boxes import hbox, vbox
from study_app.gui.widgets.cards import MaskedPanel, smooth_painter
from study_app.gui.widgets.labels import Elided, figures, label
from study_app.gui.widgets.live_plots import STROKE, Floats, Plot, draw_quickly, number, step_for
from study_app.gui.widgets.numbers import MARGIN, Range, Slider
from study_app.protocol.wording.languages import words
from study_app.session.tasks import TankView
from study_app.session.watch import Kind, Watched

LEAST_N, LEAST_MPS = 0.05, 0.01  # lower peaks are not drawn larger
MOST_POINTS: Final = 800  # of a curve
AXIS_PX: Final = 60  # of the plot's numbers
FORCES_HIDDEN: Final = "Hidden while the study is blinded", "liquid-study unblind RESULTS shows forces."


class WatchedTank(TankWidget):
    """The participant's tank with arrows of force and velocity, which participants never see."""

    arrows: tuple[Arrow, ...] = ()

    def __init__(self, shown: Watched) -> None:
        super().__init__(shown.page, words(shown.language), photodiode=False)
        self.setMinimumSize(420, 240)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def show_moment(self, view: TankView, arrows: tuple[Arrow, ...]) -> None:
        """Draw a view with arrows, whose vectors are in heights of the water."""
        self._ready()
        high = self._box.water - self._box.floor
        self.arrows = tuple(
            Arrow(name, start_m, (high * x, high * y, high * z), colour) for name, start_m, (x, y, z), colour in arrows
        )
        self.show_view(view)

    def _frame(self) -> dict[str, Placed]:
        things = super()._frame()
        if self.camera is not None and self.arrows:
            things["arrows"] = Placed(self.arrows, arrows_place(self.camera, self.arrows))
        return things

    def _paint_things(self, painter: QPainter, region: QRegion) -> None:
        if self.camera is not None:
            paint_arrows(painter, self.camera, self.arrows)
        super()._paint_things(painter, region)


class ForcePlot(Plot):
    """The force sent as a line and the force requested as an area behind it [N] over the time [s], with a cursor."""

    def __init__(self, shown: Watched) -> None:
        super().__init__()
        sizes = [np.linalg.norm(np.nan_to_num(shown.samples[name]), axis=1) for name in ("force_n", "device_force_n")]
        times_s, (low, high) = thinned(shown.times_s, sizes[0])
        self.requested = pg.PlotCurveItem(times_s, high, fillLevel=0.0, antialias=True)
        times_s, (low, high) = thinned(shown.times_s, sizes[1])
        self.sent = pg.PlotCurveItem(np.repeat(times_s, 2), np.column_stack([low, high]).ravel(), antialias=True)
        draw_quickly(self.sent, solid=True)
        self.cursor = pg.InfiniteLine(angle=90)
        for item in (self.requested, self.sent, self.cursor):
            self.box.addItem(item)
        peak = max(LEAST_N, *(float(size.max()) for size in sizes))
        up, along = step_for(peak, 3), step_for(shown.ends_s - shown.begins_s, 8)
        self.show_ticks("left", [(up * k, number(up * k)) for k in range(int(peak / up + 1e-9) + 1)])
        first, last = np.ceil(shown.begins_s / along), np.floor(shown.ends_s / along)
        self.show_ticks("bottom", [(along * k, f"{number(along * k)} s") for k in np.arange(first, last + 1)])
        self.box.setXRange(shown.begins_s, shown.ends_s, padding=0)
        self.box.setYRange(0.0, 1.12 * peak, padding=0)
        described = f"Size of the force sent and of the force requested over the trial, up to {peak:.2f} N."
        describe_plot(self, "Force on the hand", described)
        self.apply_theme(LIGHT)

    def apply_theme(self, theme: Theme) -> None:
        super().apply_theme(theme)
        area = QColor(theme.text3)
        self.requested.setPen(self.stroke(theme.text3, 1.0))
        area.setAlpha(70)
        self.requested.setBrush(area)
        self.sent.setPen(self.stroke(theme.accent, STROKE))
        self.cursor.setPen(self.stroke(theme.text, 1.4))


def thinned(times_s: Floats, values: Floats) -> tuple[Floats, tuple[Floats, Floats]]:
    """Return times (k,) and the least and greatest values (k,) from each to the next; some `MOST_POINTS` at most."""
    starts = np.arange(0, len(values), max(1, len(values) // MOST_POINTS))
    return times_s[starts], (np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts))


class TimeLine(Slider):
    """The time of a trial with its marks: targets as triangles, answers as diamonds, events as lines."""

    def __init__(self, shown: Watched) -> None:
        super().__init__()
        self._shown = shown
        self._reach = Range(shown.begins_s, shown.ends_s)
        self.setAccessibleName("Time in seconds")
        self.setFixedHeight(40)

    def show_time(self, at_s: float) -> None:
        self.show_number(self._reach, at_s)

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        painter = smooth_painter(self)
        inks: dict[Kind, str] = {"target": self.theme.ok, "answer": self.theme.accent, "event": self.theme.text2}
        for mark in self._shown.marks:
            at, ink = QPointF(self._x(mark.at_s), 6), QColor(inks[mark.kind])
            painter.setPen(QPen(ink, 2))
            painter.setBrush(ink)
            if mark.kind == "event":
                painter.drawLine(at + QPointF(0, -5), at + QPointF(0, 6))
                continue
            corners = [(-4, -3), (4, -3), (0, 4)] if mark.kind == "target" else [(-4, 0), (0, -4), (4, 0), (0, 4)]
            painter.drawPolygon(QPolygonF([at + QPointF(*corner) for corner in corners]))


class Stage(QWidget):
    """Everything of one moment; a video shows it as it is here."""

    def __init__(self, shown: Watched) -> None:
        super().__init__()
        self.shown, self.at_s, self.as_seen = shown, shown.begins_s, False
        self.tank, self.line = WatchedTank(shown), TimeLine(shown)
        self.forces = None if shown.blinded else ForcePlot(shown)
        self.numbers, self.happened = figures("", "label"), Elided("label", "text2")
        plot = self.forces or MaskedPanel(*FORCES_HIDDEN)
        plot.setMinimumHeight(88)
        plot.setMaximumHeight(190)
        key = label("" if shown.blinded else "N: line sent, area requested", "small", "text2")
        above = hbox(self.numbers, (self.happened, 1), key, spacing=16, margins=(0, 4, int(MARGIN), 0))
        along = hbox((plot, 1), margins=(0, 0, int(MARGIN), 0))
        timed = hbox((self.line, 1), margins=(AXIS_PX - int(MARGIN), 0, 0, 0))
        vbox((self.tank, 3), above, (along, 1), timed, spacing=4, margins=0, parent=self)
        self._peaks = {
            name: max(least, float(np.linalg.norm(np.nan_to_num(shown.samples[name]), axis=1).max()))
            for name, least in (("device_force_n", LEAST_N), ("velocity_mps", LEAST_MPS))
        }

    def show_moment(self, at_s: float) -> None:
        """Show a time [s]; what lies outside the recording is the nearest moment of it."""
        shown = self.shown
        self.at_s = at_s = min(max(at_s, shown.begins_s), shown.ends_s)
        view = shown.view(shown.drawn_s(at_s) if self.as_seen else at_s)
        sample = shown.samples[shown.index(at_s)]
        self.tank.show_moment(view, self._arrows(view, sample))
        if self.forces is not None:
            self.forces.cursor.setValue(at_s)
        self.line.show_time(at_s)
        speed = f"{np.linalg.norm(sample['velocity_mps']):.3f} m/s in the scene"
        sent, requested = (np.linalg.norm(sample[name]) for name in ("device_force_n", "force_n"))
        force = () if shown.blinded else (f"sent {sent:.3f} N", f"requested {requested:.3f} N")
        self.numbers.setText("   ".join((f"{at_s:.3f} s", f"sample {shown.index(at_s) + 1}", *force, speed)))
        before = [mark for mark in shown.marks if mark.at_s <= at_s]
        self.happened.show_text(f"{before[-1].at_s:.2f} s: {before[-1].words}" if before else "")

    def describe(self) -> None:
        """Tell screen readers the moment that is shown."""
        self.line.setAccessibleDescription(f"{self.numbers.text()}. {self.happened.whole}")

    def _arrows(self, view: TankView, sample: Any) -> tuple[Arrow, ...]:
        start = tuple(float(part) for part in view.position_m)
        chosen = [("velocity", "velocity_mps", TANK.wake)]
        if not self.shown.blinded:
            chosen.insert(0, ("force", "device_force_n", TANK.proxy_light))
        return tuple(
            Arrow(word, start, tuple(HEIGHTS * np.nan_to_num(sample[name]) / self._peaks[name]), colour)  # type: ignore[arg-type]
            for word, name, colour in chosen
        )
