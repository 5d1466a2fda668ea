"""Figures of fits: force and residual over time, residual over speed; or stress over shear rate."""

import textwrap
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, ScalarFormatter

from study_app import figure_style as style
from study_app.haptics.model.laws import stress_pa
from study_app.haptics.model.motion import Floats
from study_app.lab.identify.fit import CURVE_TABLE, CurveFit, Fit

_MEASURED: Final = "#b4bec7"
_TOP_PT: Final = 40.0
_FORCE_PT: Final = 120.0
_RESIDUAL_PT: Final = 92.0
_GAP_PT: Final = 36.0
_FOOT_PT: Final = 34.0
_LINE_PT: Final = 11.0
_SIDE_PT: Final = 34.0
_RIGHT_PT: Final = 14.0
_SPEED_PT: Final = 128.0
_CAPTION_LETTERS: Final = 118
_BINS: Final = 12
_MIN_IN_BIN: Final = 20


@style.own_settings(style.PLOT_SETTINGS)
def draw_force(fit: Fit) -> Figure:
    """Draw measured and fitted force over time, and the residual over time and against speed."""
    caption = textwrap.wrap(_caption(fit), _CAPTION_LETTERS)
    height_pt = _TOP_PT + _FORCE_PT + _GAP_PT + _RESIDUAL_PT + _FOOT_PT + _LINE_PT * len(caption)
    figure = Figure(figsize=(style.PAGE_WIDTH_PT / 72, height_pt / 72), facecolor="white")
    time_pt = style.PAGE_WIDTH_PT - _SIDE_PT - _RIGHT_PT - _SPEED_PT - _GAP_PT

    def place(left_pt: float, down_pt: float, width_pt: float, tall_pt: float) -> Axes:
        bottom = 1 - (down_pt + tall_pt) / height_pt
        box = (left_pt / style.PAGE_WIDTH_PT, bottom, width_pt / style.PAGE_WIDTH_PT, tall_pt / height_pt)
        return figure.add_axes(box)

    def write(left_pt: float, down_pt: float, text: str, **look: Any) -> None:
        figure.text(left_pt / style.PAGE_WIDTH_PT, 1 - down_pt / height_pt, text, va="top", **look)

    below_pt = _TOP_PT + _FORCE_PT + _GAP_PT
    right_pt = _SIDE_PT + time_pt + _GAP_PT
    write(_SIDE_PT, 6, f"{fit.liquid_id}: measured and fitted force", fontsize=9, fontweight="bold")
    _draw_force_axes(place(_SIDE_PT, _TOP_PT, time_pt, _FORCE_PT), fit)
    _draw_residual(place(_SIDE_PT, below_pt, time_pt, _RESIDUAL_PT), fit)
    _draw_residual_by_speed(place(right_pt, below_pt, _SPEED_PT, _RESIDUAL_PT), fit)
    limit_n = 1.05 * float(np.abs(fit.residual_n).max()) or 1.0
    for axes in figure.axes[1:]:
        axes.set_ylim(-limit_n, limit_n)
    write(right_pt, _TOP_PT - 13, "Fitted values with 95 % intervals", color=style.TEXT_SOFT)
    write(right_pt, _TOP_PT + 3, "\n".join(_value_lines(fit)), linespacing=1.45)
    write(_SIDE_PT, below_pt + _RESIDUAL_PT + _FOOT_PT - 8, "\n".join(caption), color=style.TEXT_SOFT, linespacing=1.25)
    return figure


def _value_lines(fit: Fit) -> list[str]:
    """Return two lines for each parameter: its name and value, and the interval."""
    lines = []
    for parameter in fit.parameters:
        value, interval = fit.row(parameter)
        lines += [f"{parameter.name}  {value}", f"   {interval}"]
    return lines


def _caption(fit: Fit) -> str:
    text = (
        "Measurements are grey; lines show the least-squares fit, computed at the servo's tick rate. The residual, "
        f"measured − fitted, is {fit.rms_n:.3g} N RMS ({100 * fit.share:.1f} % of the force); its lag-1 "
        f"autocorrelation is {fit.autocorrelation:.2f}."
    ).replace("-", "−")
    panel_text = (
        " The right panel plots the residual force in the direction of motion against speed; the dots are medians. A "
        "slope or bend there indicates that the force law is wrong."
    )
    return text + panel_text + "".join(f" Warning: {warning}." for warning in fit.warnings)


def _used_axes(fit: Fit) -> list[tuple[int, str]]:
    return [(axis, "xyz"[axis]) for axis in fit.axes]


def _draw_force_axes(axes: Axes, fit: Fit) -> None:
    """Draw each axis of the force; the measured force is a wide line behind the fitted one."""
    t_s = fit.motion.t_s
    _time_axis(axes, fit)
    axes.set_title("Force on the ball [N]", pad=6)
    for axis, _ in _used_axes(fit):
        axes.plot(t_s, fit.measured_n[:, axis], color=_MEASURED, linewidth=2.4, rasterized=True)
    for axis, name in _used_axes(fit):
        axes.plot(t_s, fit.fitted_n[:, axis], **style.AXES[name], label=name)
    _name_curves(axes, len(fit.axes))


def _draw_residual(axes: Axes, fit: Fit) -> None:
    """Draw each axis of the residual as dots, since a line through noise would fill the plot."""
    _time_axis(axes, fit)
    axes.set_title("Measured − fitted [N]", pad=6)
    axes.set_xlabel("Time [s]", loc="right", labelpad=1)
    for axis, name in _used_axes(fit):
        look = {"color": style.AXES[name]["color"], "markersize": 1.1, "alpha": 0.55, "rasterized": True}
        axes.plot(fit.motion.t_s, fit.residual_n[:, axis], ".", markeredgewidth=0, label=name, **look)
    _name_curves(axes, len(fit.axes))


def _draw_residual_by_speed(axes: Axes, fit: Fit) -> None:
    """Draw the residual's component along the motion against the speed."""
    velocity_mps = _velocity_mps(fit)
    speed_mps = np.linalg.norm(velocity_mps, axis=1)
    moves = speed_mps > 1e-3
    along_n = np.sum(fit.residual_n[moves] * velocity_mps[moves], axis=1) / speed_mps[moves]
    axes.axhline(0, color=style.ZERO, linewidth=0.6, zorder=1)
    axes.set_title("along the motion, against speed [m/s]", pad=6)
    axes.xaxis.set_major_locator(MaxNLocator(4))
    axes.yaxis.set_major_locator(MaxNLocator(5))
    look: dict[str, Any] = {"markersize": 1.1, "alpha": 0.55, "rasterized": True}
    axes.set_xlim(0, 1.05 * float(speed_mps.max()) or 1.0)
    axes.plot(speed_mps[moves], along_n, ".", color=style.ZERO, markeredgewidth=0, **look)
    middles = _medians(speed_mps[moves], along_n)
    axes.plot(middles[:, 0], middles[:, 1], "o", color=style.AXES["y"]["color"], markersize=3.2)


def _medians(speed_mps: Floats, along_n: Floats) -> Floats:
    """Return the median speed and the median residual, (k, 2), in equal speed intervals with enough rows."""
    if len(speed_mps) == 0:
        return np.empty((0, 2))
    edges = np.linspace(speed_mps.min(), speed_mps.max(), _BINS + 1)
    bins = np.clip(np.digitize(speed_mps, edges) - 1, 0, _BINS - 1)
    used = [bins == k for k in range(_BINS) if np.count_nonzero(bins == k) >= _MIN_IN_BIN]
    return np.array([(np.median(speed_mps[rows]), np.median(along_n[rows])) for rows in used]).reshape(-1, 2)


def _velocity_mps(fit: Fit) -> Floats:
    """Return the measured velocities (n, 3), or those computed from the positions."""
    if fit.motion.velocity_mps is not None:
        return fit.motion.velocity_mps
    slopes: Floats = np.gradient(fit.motion.position_m, fit.motion.t_s, axis=0)
    return slopes


def _time_axis(axes: Axes, fit: Fit) -> None:
    axes.set_xlim(fit.motion.t_s[0], fit.motion.t_s[-1])
    axes.xaxis.set_major_locator(MaxNLocator(7))
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.axhline(0, color=style.ZERO, linewidth=0.6, zorder=1)


def _name_curves(axes: Axes, columns: int) -> None:
    """Draw the legend of the axes in a row above the plot."""
    axes.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.02),
        ncols=columns,
        frameon=False,
        markerscale=6,
        handletextpad=0.5,
        columnspacing=1.4,
        borderpad=0,
        borderaxespad=0.3,
    )


_MARGIN: Final = 1.3
_CURVE_LETTERS: Final = 96


@style.own_settings(style.PLOT_SETTINGS)
def draw_curve(fit: CurveFit) -> Figure:
    """Draw measured and fitted stress against shear rate, both logarithmic, and the residual in percent below."""
    figure = Figure(figsize=(style.PAGE_WIDTH_PT / 72, 4.2), facecolor="white", layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    figure.suptitle(f"{fit.liquid_id}: measured and fitted flow curve", fontsize=9, fontweight="bold")
    rates = fit.curve.rate_per_s
    (liquid,) = (liquid for liquid in fit.scene.liquids if liquid.id == fit.liquid_id)
    fine = np.geomspace(rates.min() / _MARGIN, rates.max() * _MARGIN, 200)
    look = {"color": style.AXES["x"]["color"]}
    above.loglog(
        fine, [stress_pa(getattr(liquid, CURVE_TABLE), rate) for rate in fine.tolist()], **look, label="fitted"
    )
    above.loglog(rates, fit.curve.stress_pa, "o", color=style.ZERO, markersize=3.2, label="measured")
    above.yaxis.set_major_formatter(ScalarFormatter())
    above.yaxis.set_minor_formatter(ScalarFormatter())
    above.set_ylabel("Shear stress [Pa]")
    above.legend(loc="upper left", frameon=False)
    above.text(
        0.99,
        0.03,
        "\n".join(f"{parameter.name}  {' · '.join(fit.row(parameter))}" for parameter in fit.parameters),
        transform=above.transAxes,
        ha="right",
        va="bottom",
    )
    _draw_curve_residual(below, fit)
    caption = "Least-squares fit of the relative residual, with 95 % intervals."
    caption += "".join(f" Warning: {warning}." for warning in fit.warnings)
    below.set_xlabel("Shear rate [1/s]\n" + "\n".join(textwrap.wrap(caption, _CURVE_LETTERS)))
    return figure


def _draw_curve_residual(axes: Axes, fit: CurveFit) -> None:
    residual = 100 * (1 - fit.fitted_pa / fit.curve.stress_pa)
    axes.axhline(0, color=style.ZERO, linewidth=0.6, zorder=1)
    axes.semilogx(fit.curve.rate_per_s, residual, "o", color=style.ZERO, markersize=3.2)
    axes.xaxis.set_major_formatter(ScalarFormatter())
    axes.set_ylabel("Residual [%]")
