"""The key above the panels of a figure."""

from collections.abc import Sequence

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from study_app import figure_style as style


def figure_key(figure: Figure, handles: Sequence[Line2D], left_pt: float, *, handlelength: float) -> None:
    """Name the lines above the panels, in one row from ``left_pt`` on."""
    figure.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(left_pt / style.PAGE_WIDTH_PT, 1.0),
        ncols=len(handles),
        frameon=False,
        fontsize=7.2,
        handlelength=handlelength,
        columnspacing=2.2,
    )
