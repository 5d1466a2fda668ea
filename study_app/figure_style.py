"""The style of figures on paper: palette, fonts, and how a figure becomes the bytes of a file.

Files are deterministic: no dates, SVG ids from a fixed salt. SVG keeps text as text; PDF embeds TrueType (type 42).
"""

import contextlib
import io
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
from matplotlib import font_manager
from matplotlib.figure import Figure

LEVEL_COLOURS: Final = ("#6d1007", "#b75a26", "#d69f7e", "#d9d9d9", "#7db0c9", "#116496", "#02256d")
"""Levels 1 to 7, disagreement to agreement: Crameri's vik, reversed, with a darker neutral.

Smallest CIEDE2000 distance of neighbours 16.1, of mirrored levels 28.9, over normal, protan, deutan and tritan eyes.
"""
LEVEL_INKS: Final = ("#ffffff", "#ffffff", "#000000", "#000000", "#000000", "#ffffff", "#ffffff")
"""Text on each level; contrast at least 4.7."""

TEXT: Final = "#13202c"
TEXT_SOFT: Final = "#45535f"
GRID: Final = "#e6ebef"
GROUND: Final = "#f4f6f8"
BORDER: Final = "#c9d1d8"
AXIS: Final = "#5d6a75"
ACCENT: Final = "#0b65a3"
SECOND: Final = "#b35600"
BAND: Final = "#c8dded"
PARTICIPANT: Final = "#8b97a1"
WARN: Final = "#8a5200"
WARN_GROUND: Final = "#fff1d6"
SEALED: Final = "#45535f"
SEALED_GROUND: Final = "#edf1f4"

ZERO: Final = "#7d8994"
"""The line at zero of a plot."""

AXES: Final[dict[str, dict[str, Any]]] = {
    "x": {"color": "#0b65a3", "linestyle": "-"},
    "y": {"color": "#b35600", "linestyle": (0, (5, 2))},
    "z": {"color": "#13202c", "linestyle": (0, (1, 1.2))},
}
"""Traces of the three axes; smallest CIEDE2000 distance 25 over normal, protan, deutan and tritan eyes."""

STEPS: Final = ("#02256d", "#116496", "#5d8aa8", "#b75a26", "#6d1007")
"""Curves of one parameter, in its order: dark blue to dark red, lightest in the middle."""

PAGE_WIDTH_PT: Final = 7.16 * 72
"""Two columns of an IEEE page."""
PNG_DPI: Final = 300
FORMATS: Final = ("png", "svg", "pdf")

FALLBACK_FONTS: Final = ("DejaVu Sans", "sans-serif")
"""The first ships with matplotlib; the second is for readers of an SVG."""
FONT_FOLDER: Final = resources.files("study_app") / "gui" / "assets" / "fonts"


SETTINGS: Final[Mapping[Any, Any]] = {"svg.fonttype": "none", "svg.hashsalt": "liquid-study", "pdf.fonttype": 42}
"""Matplotlib's settings for every figure: SVG keeps text, and ids from a fixed salt."""

PLOT_SETTINGS: Final[Mapping[Any, Any]] = {
    **SETTINGS,
    "font.family": FALLBACK_FONTS,
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
"""Settings of figures that matplotlib lays out itself: the plots of evidence and `lab.identify`."""


@cache
def fonts() -> tuple[str, ...]:
    """Return the font families of figures, best first: Inter, which ships with the windows, then other scripts.

    Inter is included as TrueType, with only Latin and Greek letters, since PDF may not embed its PostScript outlines as
    type 42. An installed Inter is preferred.
    """
    files = [Path(str(FONT_FOLDER / f"Inter-{weight}.ttf")) for weight in ("Regular", "Bold")]
    if not all(file.is_file() for file in files):
        return FALLBACK_FONTS
    manager = font_manager.fontManager
    manager.ttflist = [entry for entry in manager.ttflist if entry.name != "Inter"]
    for file in files:
        manager.addfont(file)
    return ("Inter", *FALLBACK_FONTS)


@contextlib.contextmanager
def own_settings(settings: Mapping[Any, Any] = SETTINGS) -> Iterator[None]:
    """Draw with matplotlib's defaults and ``settings``, regardless of the user's matplotlibrc, then restore it."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(settings)
        yield


def file_bytes(figure: Figure, kind: str, title: str, settings: Mapping[Any, Any] = SETTINGS) -> bytes:
    """Return the figure as file content of ``kind`` (one of `FORMATS`); the same figure gives the same bytes."""
    metadata: dict[str, dict[str, str | None]] = {
        "png": {"Software": None, "Title": title},
        "svg": {"Date": None, "Title": title},
        "pdf": {"CreationDate": None, "Title": title},
    }
    target = io.BytesIO()
    with own_settings(settings):
        figure.savefig(target, format=kind, dpi=PNG_DPI, metadata=metadata[kind])
    return target.getvalue()
