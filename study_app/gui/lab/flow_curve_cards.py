"""Of non-Newtonian liquids: shear stress over shear rate, and the steady force over the speed of the hand."""

import math
from typing import Final

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QSize
from PySide6.QtWidgets import QWidget

from study_app.gui.lab.lab_plots import DASH, LIMIT, A, B, CurvePlot, PlotCard
from study_app.gui.theme.theme import LIGHT, Theme
from study_app.gui.widgets.boxes import hbox
from study_app.gui.widgets.labels import Elided
from study_app.gui.widgets.live_plots import Plot, draw_quickly, number
from study_app.haptics.model.scene import Scene
from study_app.lab.steady_curves import RATES_PER_S, SPEEDS_MPS, SteadyCurves, has_flow_curve, steady_curves
from study_app.viewmodels.lab import Floats, LabView

NOT_MODELLED: Final = "Steady shear. Not modelled: thixotropy, impact, fracture."
STRESS_SENTENCE: Final = f"Shear stress of settings A and B over the shear rate. {NOT_MODELLED}"
FORCE_SENTENCE: Final = (
    "Force of settings A and B on a hand that moves evenly, over its speed in m/s, after the limits."
)
STYLES: Final = (B, A)
EMPTY: Final[Floats] = np.empty(0)


class FlowCurvePlot(Plot):
    """Stress over shear rate, both logarithmic."""

    def __init__(self) -> None:
        super().__init__()
        self.curves = [pg.PlotCurveItem(antialias=True) for _ in STYLES]
        for curve, style in zip(self.curves, STYLES, strict=True):
            draw_quickly(curve, solid=style.stroke == "solid")
            self.box.addItem(curve, ignoreBounds=True)
        self.axes["left"].setWidth(56)
        self.axes["bottom"].setHeight(26)
        first, last = (round(math.log10(rate)) for rate in (RATES_PER_S[0], RATES_PER_S[-1]))
        self.box.setXRange(first, last + 0.06 * (last - first), padding=0)
        self.show_ticks("bottom", _decades(first, last))
        self.apply_theme(LIGHT)

    def sizeHint(self) -> QSize:
        """Return a small size: a plot takes what is left."""
        return QSize(240, 120)

    def show_stresses(self, stresses_pa: tuple[Floats | None, ...]) -> None:
        """Draw stresses (n,) [Pa], each at the shear rates; None draws nothing."""
        shown = np.concatenate([it for it in stresses_pa if it is not None] or [np.ones(1)])
        first, last = math.floor(math.log10(shown.min()) + 1e-9), math.ceil(math.log10(shown.max()) - 1e-9)
        last = max(last, first + 1)
        self.show_ticks("left", _decades(first, last))
        self.box.setYRange(first - 0.02, last + 0.12 * (last - first), padding=0)
        for curve, it in zip(self.curves, stresses_pa, strict=True):
            curve.setData(*((EMPTY, EMPTY) if it is None else (np.log10(RATES_PER_S), np.log10(it))))

    def apply_theme(self, theme: Theme) -> None:
        """Take the colours of ``theme``."""
        super().apply_theme(theme)
        for curve, style in zip(self.curves, STYLES, strict=True):
            curve.setPen(self.stroke(style.colour(theme), style.width, DASH[style.stroke]))


class SpeedPlot(CurvePlot):
    """Curves over the speed of the hand."""

    def __init__(self) -> None:
        super().__init__(STYLES, 1.0)
        most_mps = float(SPEEDS_MPS[-1])
        self.box.setXRange(0.0, 1.06 * most_mps, padding=0)
        self.show_ticks("bottom", [(round(it, 6), number(round(it, 6))) for it in np.arange(0.0, most_mps + 0.01, 0.1)])


class FlowCurveCard(PlotCard):
    """Shear stress over shear rate of both settings."""

    def __init__(self) -> None:
        self.stresses = FlowCurvePlot()
        super().__init__("Flow curve", "Pa over 1/s", self.stresses, STRESS_SENTENCE)
        note = Elided("small", "text2")
        note.show_text(NOT_MODELLED)
        self.column.addWidget(note)

    def show_curves(self, a: SteadyCurves, b: SteadyCurves) -> None:
        """Draw both flow curves."""
        self.legend.show_entries(((A, _name("A", a)), (B, _name("B", b))))
        self.stresses.show_stresses((b.stress_pa, a.stress_pa))


class SteadyForceCard(PlotCard):
    """Force over the speed of the hand in both settings."""

    def __init__(self) -> None:
        self.forces = SpeedPlot()
        super().__init__("Force over speed", "N over m/s", self.forces, FORCE_SENTENCE)

    def show_curves(self, a: SteadyCurves, b: SteadyCurves, limit_n: float) -> None:
        """Draw both forces."""
        self.legend.show_entries(((A, "A"), (B, "B"), (LIMIT, f"limit {limit_n:g} N")))
        self.forces.show_curves(SPEEDS_MPS, (b.force_n, a.force_n), limit_n)


class FlowCurveRow(QWidget):
    """Both cards side by side; hidden while neither setting has a flow curve."""

    def __init__(self, gap: int) -> None:
        super().__init__()
        self.stress, self.force = FlowCurveCard(), SteadyForceCard()
        self._shown: tuple[Scene, Scene, float] | None = None
        hbox((self.stress, 1), (self.force, 1), spacing=gap, margins=0, parent=self)
        self.hide()

    def show_view(self, view: LabView) -> None:
        """Draw the curves of both settings and the limit of the one in hand, if one of them has changed."""
        bench = view.workbench
        for card in (self.stress, self.force):
            card.show_blind(bench.blind)
        scenes, limit_n = (bench.a.scene, bench.b.scene), bench.in_hand.scene.force_limit_n
        shown = (*scenes, limit_n)
        if shown == self._shown:
            return
        self._shown = shown
        self.setVisible(any(map(has_flow_curve, scenes)))
        if not self.isHidden():
            a, b = map(steady_curves, scenes)
            self.stress.show_curves(a, b)
            self.force.show_curves(a, b, limit_n)


def _name(side: str, curves: SteadyCurves) -> str:
    return f"{side}, no viscosity" if curves.stress_pa is None else side


def _decades(first: int, last: int) -> list[tuple[float, str]]:
    step = 1 + (last - first) // 5
    return [(float(k), number(10.0**k)) for k in range(first, last + 1, step)]
