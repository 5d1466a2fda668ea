"""Errors of the delay over the requested delay: one panel per screen, loads abreast, ½ frame and 1 frame marked."""

import textwrap
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from study_app import figure_style as style
from study_app.evidence.timing.delay_results import BESIDE, TAIL_PERCENT, Delayed, Shown
from study_app.evidence.timing.figure_key import figure_key
from study_app.evidence.timing.machine_load import LoadName

HEIGHT_PT: Final = 212.0
TOP_PT: Final = 46.0
FOOT_PT: Final = 62.0
LEFT_PT: Final = 34.0
GAP_PT: Final = 46.0
RIGHT_PT: Final = 44.0
LETTERS: Final = 132
MOST_FRAMES: Final = 1.5  # of the axis: what lies beyond is written at its top
APART: Final = 0.34

LOOKS: Final[dict[LoadName, dict[str, Any]]] = {
    "none": {"color": "#0b65a3", "marker": "o", "markerfacecolor": "#0b65a3"},
    "gui": {"color": "#b35600", "marker": "^", "markerfacecolor": "white"},
    "gui+cpu": {"color": "#7a3e8f", "marker": "D", "markerfacecolor": "white"},
}


@style.own_settings(style.PLOT_SETTINGS)
def draw(found: Delayed) -> Figure:
    """Draw what was found."""
    figure = Figure(figsize=(style.PAGE_WIDTH_PT / 72, HEIGHT_PT / 72), facecolor="white")
    screens = found.screens
    width_pt = (style.PAGE_WIDTH_PT - LEFT_PT - RIGHT_PT - GAP_PT * (len(screens) - 1)) / len(screens)
    for number, screen in enumerate(screens):
        left = (LEFT_PT + number * (width_pt + GAP_PT)) / style.PAGE_WIDTH_PT
        tall = (HEIGHT_PT - TOP_PT - FOOT_PT) / HEIGHT_PT
        axes = figure.add_axes((left, FOOT_PT / HEIGHT_PT, width_pt / style.PAGE_WIDTH_PT, tall))
        _panel(axes, found, screen, first=number == 0)
    _key(figure, found)
    text = "\n".join(textwrap.wrap(_caption(found), LETTERS))
    figure.text(4 / style.PAGE_WIDTH_PT, 29 / HEIGHT_PT, text, va="top", fontsize=6.6, color=style.TEXT_SOFT)
    return figure


def _panel(axes: Axes, found: Delayed, screen: str, *, first: bool) -> None:
    """Draw every trial on a screen: a sign at the mean, a line from there to the 99th percentile."""
    frame_ms = found.on(screen, found.loads[0])[0].frame_ms
    top_ms = MOST_FRAMES * frame_ms
    for number, load in enumerate(found.loads):
        aside = APART * (number - (len(found.loads) - 1) / 2)
        for place, trial in enumerate(found.on(screen, load)):
            _trial(axes, trial, place + aside, top_ms)
    for share, words in ((0.5, "½ frame"), (1.0, "1 frame")):
        axes.axhline(share * frame_ms, color=style.ZERO, linewidth=0.8, linestyle=(0, (1, 1.5)), zorder=1)
        axes.annotate(
            words,
            (1.0, share * frame_ms),
            (3, 0),
            xycoords=("axes fraction", "data"),
            textcoords="offset points",
            va="center",
            fontsize=6.6,
        )
    delays_ms = [1e3 * trial.delay_s for trial in found.on(screen, found.loads[0])]
    axes.set_xticks(range(len(delays_ms)), [f"{delay_ms:g}" for delay_ms in delays_ms])
    axes.set_xlim(-0.6, len(delays_ms) - 0.4)
    axes.set_ylim(0, top_ms)
    axes.tick_params(labelsize=6.6)
    axes.set_xlabel("requested delay [ms]", fontsize=7, labelpad=2)
    if first:
        axes.set_ylabel("later than requested [ms]", fontsize=7, labelpad=2)
    paced = found.on(screen, found.loads[0])[0].paced
    axes.set_title(f"{screen[0].upper()}{screen[1:]}, {paced}", pad=13, color=style.TEXT)


def _trial(axes: Axes, trial: Shown, at: float, top_ms: float) -> None:
    look = LOOKS[trial.load]
    tail_ms = trial.percentile_ms(TAIL_PERCENT)
    axes.plot([at, at], [trial.mean_ms, min(tail_ms, top_ms)], color=look["color"], linewidth=1.3, zorder=4)
    if tail_ms < top_ms:
        axes.plot([at - 0.09, at + 0.09], [tail_ms, tail_ms], color=look["color"], linewidth=1.3, zorder=4)
    else:
        axes.annotate(
            f"{tail_ms:.0f}",
            (at, top_ms),
            (0, 1),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=6.0,
            color=look["color"],
            annotation_clip=False,
        )
    axes.plot([at], [np.clip(trial.mean_ms, 0, top_ms)], markersize=4.5, zorder=5, clip_on=False, **look)


def _key(figure: Figure, found: Delayed) -> None:
    """Name the loads above the panels."""
    handles = [
        Line2D([], [], markersize=4.5, linewidth=1.3, label=BESIDE[load].capitalize(), **LOOKS[load])
        for load in found.loads
    ]
    figure_key(figure, handles, LEFT_PT - 6, handlelength=2.6)


def _caption(found: Delayed) -> str:
    width, height = found.size_px
    return (
        f"Marks: mean of all frames; lines reach up to the {TAIL_PERCENT:g}th percentile, which is written if it is "
        f"off the scale. {found.seconds:g} s of reaching at each delay with the tank at {width} × {height}, from "
        "the "
        f"sample that is drawn to the end of its painting. {found.machine}."
    )
