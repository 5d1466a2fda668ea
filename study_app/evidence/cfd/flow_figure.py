"""The forces of the solver and of models as a figure: one column of a page, readable in grey."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from study_app import figure_style as style
from study_app.evidence.cfd.fits import MODELS, Fitted, even
from study_app.evidence.cfd.profiles import STOP
from study_app.evidence.cfd.stored_flows import Table

WIDTH_PT: Final = 85 / 25.4 * 72
PANEL_PT: Final = 118.0
LOOKS: Final[dict[str, tuple[str, dict[str, Any]]]] = {
    "drag of the Reynolds number": ("drag alone", {"color": "#5d6a75", "linestyle": (0, (1, 1.2))}),
    "constant C_d, wake": ("constant $C_d$ and wake", {"color": "#b35600", "linestyle": (0, (5, 2))}),
    "... history, added mass": ("drag, history, added mass", {"color": "#0b65a3", "linestyle": "-"}),
}
SOLVER: Final[dict[str, Any]] = {"color": "#13202c", "linewidth": 3.2, "alpha": 0.35}
AFTER: Final = 8.0


@style.own_settings(style.PLOT_SETTINGS)
def draw(tables: Sequence[Table], fits: Sequence[Fitted]) -> Figure:
    """Draw, for the fastest motion through each liquid, the force from its start to 8 D/U after its stop."""
    shown = {table.case.liquid_id: table for table in sorted(tables, key=lambda it: it.case.speed_mps)}
    height_pt = PANEL_PT * len(shown) + 30
    figure = Figure(figsize=(WIDTH_PT / 72, height_pt / 72), facecolor="white")
    axes = figure.subplots(len(shown), 1, squeeze=False)[:, 0]
    figure.subplots_adjust(left=0.12, right=0.98, top=1 - 44 / height_pt, bottom=28 / height_pt, hspace=0.42)
    for ax, table in zip(axes, shown.values(), strict=True):
        _panel(ax, table, [it for it in fits if it.case == table.case and it.model.name in LOOKS])
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper left", ncols=2, frameon=False, fontsize=6.8, bbox_to_anchor=(0.0, 1.0))
    axes[-1].set_xlabel("time [s]")
    return figure


def _panel(ax: Axes, table: Table, fits: Sequence[Fitted]) -> None:
    case, (motion, force_n) = table.case, even(table)
    t_s = motion.t_s
    kept = t_s <= (STOP + AFTER) * case.unit_s
    ax.plot(t_s[kept], force_n[kept], label="fluid solver", **SOLVER)
    order = [it.name for it in MODELS]
    for it in sorted(fits, key=lambda it: order.index(it.model.name)):
        label, look = LOOKS[it.model.name]
        ax.plot(t_s[kept], it.force_n[kept], label=label, linewidth=1.1, **look)
    even_n = float(np.interp(STOP * case.unit_s * 0.95, t_s, force_n))
    ax.set_ylim(2.3 * even_n, -1.6 * even_n)
    ax.axhline(0, color=style.ZERO, linewidth=0.6)
    ax.set_title(f"{case.liquid_id}, {case.speed_mps:g} m/s, Re {case.reynolds:.2g}: force along the motion [N]")
    ax.yaxis.set_major_locator(MaxNLocator(5))
    _note(ax, "stop", (STOP * case.unit_s, 0), (-21, 5))
    for peak, edge in ((int(force_n.argmin()), 0), (int(force_n.argmax()), 1)):
        _note(ax, f"to {force_n[peak]:.1f} N", (t_s[peak], ax.get_ylim()[edge]), (9, -7 if edge else 3))


def _note(ax: Axes, words: str, at: tuple[float, float], offset_pt: tuple[float, float]) -> None:
    words = words.replace("-", "−")
    ax.annotate(words, at, offset_pt, textcoords="offset points", fontsize=6.6, color=style.TEXT_SOFT)
