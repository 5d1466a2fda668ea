"""A fitted flow curve as a figure: shear stress over shear rate, and the residual."""

import textwrap
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import ScalarFormatter

from study_app import figure_style as style
from study_app.haptics.model.laws import stress_pa
from study_app.lab.identify.flow_curve import TABLE, CurveFit

MARGIN: Final = 1.3
LETTERS: Final = 96


@style.own_settings(style.PLOT_SETTINGS)
def draw(found: CurveFit) -> Figure:
    """Draw measured and fitted stress over the shear rate, both logarithmic, and the residual in per cent below."""
    figure = Figure(figsize=(style.PAGE_WIDTH_PT / 72, 4.2), facecolor="white", layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    figure.suptitle(f"{found.liquid_id}: measured and fitted flow curve", fontsize=9, fontweight="bold")
    rates = found.curve.rate_per_s
    (liquid,) = (it for it in found.scene.liquids if it.id == found.liquid_id)
    fine = np.geomspace(rates.min() / MARGIN, rates.max() * MARGIN, 200)
    look = {"color": style.AXES["x"]["color"]}
    above.loglog(fine, [stress_pa(getattr(liquid, TABLE), rate) for rate in fine.tolist()], **look, label="fitted")
    above.loglog(rates, found.curve.stress_pa, "o", color=style.ZERO, markersize=3.2, label="measured")
    above.yaxis.set_major_formatter(ScalarFormatter())
    above.yaxis.set_minor_formatter(ScalarFormatter())
    above.set_ylabel("Shear stress [Pa]")
    above.legend(loc="upper left", frameon=False)
    above.text(0.99, 0.03, "\n".join(_values(found)), transform=above.transAxes, ha="right", va="bottom")
    _residual(below, found)
    caption = "Least squares of the residual as a share of the stress, with 95 % intervals."
    caption += "".join(f" Warning: {warning}." for warning in found.warnings)
    below.set_xlabel("Shear rate [1/s]\n" + "\n".join(textwrap.wrap(caption, LETTERS)))
    return figure


def _residual(axes: Axes, found: CurveFit) -> None:
    residual = 100 * (1 - found.fitted_pa / found.curve.stress_pa)
    axes.axhline(0, color=style.ZERO, linewidth=0.6, zorder=1)
    axes.semilogx(found.curve.rate_per_s, residual, "o", color=style.ZERO, markersize=3.2)
    axes.xaxis.set_major_formatter(ScalarFormatter())
    axes.set_ylabel("Residual [%]")


def _values(found: CurveFit) -> list[str]:
    """Return a line for each parameter: name, value, interval."""
    return [f"{it.name}  {' · '.join(found.row(it))}" for it in found.parameters]
