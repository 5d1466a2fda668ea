"""The look of the evaluation's figures, and how a figure becomes the bytes of a file.

Colours and dashes of the axes are those of the operator's traces. Files are deterministic: no dates, SVG ids from a
fixed salt; SVG keeps text as text, PDF embeds TrueType (type 42), in the font that ships with matplotlib.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator
from typing import Any, Final

import matplotlib as mpl
from matplotlib.figure import Figure

TEXT: Final = "#13202c"
TEXT_SOFT: Final = "#45535f"
AXIS: Final = "#5d6a75"
GRID: Final = "#e6ebef"
ZERO: Final = "#7d8994"

AXES: Final[dict[str, dict[str, Any]]] = {
    "x": {"color": "#0b65a3", "linestyle": "-"},
    "y": {"color": "#b35600", "linestyle": (0, (5, 2))},
    "z": {"color": "#13202c", "linestyle": (0, (1, 1.2))},
}
"""Traces of the three axes; smallest CIEDE2000 distance 25 over normal, protan, deutan and tritan eyes."""

STEPS: Final = ("#02256d", "#116496", "#5d8aa8", "#b75a26", "#6d1007")
"""Curves of one parameter, in its order: dark blue to dark red, lightest in the middle."""

WIDTH_PT: Final = 7.16 * 72
"""Two columns of an IEEE page."""
FORMATS: Final = ("png", "svg", "pdf")

_SETTINGS: Final[dict[Any, Any]] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "liquid-study",
    "pdf.fonttype": 42,
    "font.family": ["DejaVu Sans", "sans-serif"],
    "font.size": 7.5,
    "text.color": TEXT,
    "axes.edgecolor": AXIS,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "axes.axisbelow": True,
    "axes.titlesize": 7.5,
    "axes.titlecolor": TEXT_SOFT,
    "axes.titlelocation": "left",
    "axes.labelcolor": TEXT_SOFT,
    "axes.unicode_minus": True,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.3,
    "xtick.color": AXIS,
    "ytick.color": AXIS,
    "xtick.major.size": 2.5,
    "ytick.major.size": 0,
}


@contextlib.contextmanager
def own_settings() -> Iterator[None]:
    """Draw by matplotlib's defaults and ours, whatever the user's matplotlibrc says; put that back at the end."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_SETTINGS)
        yield


def file_bytes(figure: Figure, kind: str, title: str) -> bytes:
    """Return the figure as the bytes of a file of ``kind`` (one of `FORMATS`); the same figure gives the same bytes."""
    metadata: dict[str, dict[str, str | None]] = {
        "png": {"Software": None, "Title": title},
        "svg": {"Date": None, "Title": title},
        "pdf": {"CreationDate": None, "Title": title},
    }
    target = io.BytesIO()
    with own_settings():
        figure.savefig(target, format=kind, dpi=300, metadata=metadata[kind])
    return target.getvalue()
