"""Figures laid out in points, the data they are drawn from, and their files in each format."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, TypeAlias

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.patches import FancyBboxPatch
from matplotlib.text import Text
from matplotlib.transforms import Affine2D
from numpy.typing import NDArray

from study_app import figure_style as style
from study_app.analysis.data.blocks import Block
from study_app.analysis.data.study_tables import Study, group_members
from study_app.analysis.results import BlockResult, Failure, Failures, Results
from study_app.analysis.wording import counted
from study_app.number_text import capitalised
from study_app.protocol.participants import EACH_GROUP

MARGIN_PT = 4.0
SMALL = 7.2
"""Size of the smallest text [pt]: 11 px if a window 1366 px wide shows the figure."""

Style: TypeAlias = dict[str, Any]
"""Arguments of matplotlib for the appearance of a figure's marks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """A prominent label next to a figure's title: text, text colour and background colour."""

    words: str
    ink: str
    ground: str


class Sheet:
    """A figure of ``width_pt`` x ``height_pt``; each character uses the first of ``fonts`` that contains it."""

    def __init__(self, width_pt: float, height_pt: float, fonts: Sequence[str]) -> None:
        self.width_pt = width_pt
        self.height_pt = height_pt
        self._fonts = list(fonts)
        self.figure = Figure(figsize=(width_pt / 72, height_pt / 72), dpi=style.PNG_DPI, facecolor="white")
        self._canvas = FigureCanvasAgg(self.figure)

    def font(self, size: float, weight: str = "regular") -> FontProperties:
        """Return the sheet's font at ``size`` [pt]."""
        return FontProperties(family=self._fonts, size=size, weight=weight)

    def text_width(self, words: str, size: float, weight: str = "regular") -> float:
        """Return the width of one line of text [pt]."""
        renderer = self._canvas.get_renderer()  # type: ignore[no-untyped-call]  # matplotlib leaves it untyped
        width, _, _ = renderer.get_text_width_height_descent(words, self.font(size, weight), ismath=False)
        return float(width) * 72 / self.figure.dpi

    def wrap(self, words: str, width_pt: float, size: float, weight: str = "regular") -> list[str]:
        """Wrap a text at spaces into lines no wider than ``width_pt`` if possible."""
        lines: list[str] = []
        for word in words.split():
            longer = f"{lines[-1]} {word}" if lines else word
            if lines and self.text_width(longer, size, weight) <= width_pt:
                lines[-1] = longer
            else:
                lines.append(word)
        return lines or [""]

    def text(
        self,
        x: float,
        y: float,
        words: str,
        *,
        size: float = SMALL,
        weight: str = "regular",
        colour: str = style.TEXT,
        **place: Any,
    ) -> Text:
        """Draw ``words`` with their baseline at ``y``; ``ha`` and ``va`` are matplotlib's."""
        return self.figure.text(
            x / self.width_pt,
            1 - y / self.height_pt,
            words,
            fontproperties=self.font(size, weight),
            color=colour,
            parse_math=False,
            **place,
        )

    def lines(self, x: float, middle: float, lines: Sequence[str], line_pt: float, **look: Any) -> None:
        """Draw ``lines`` below each other, centred on a baseline at ``middle``."""
        for number, line in enumerate(lines):
            self.text(x, middle + line_pt * (number - (len(lines) - 1) / 2), line, **look)

    def axes(self, x: float, y: float, width: float, height: float) -> Axes:
        """Return bare axes: no frame, no ticks; ``x, y`` is their upper left corner."""
        place = (x / self.width_pt, 1 - (y + height) / self.height_pt, width / self.width_pt, height / self.height_pt)
        axes = self.figure.add_axes(place)
        axes.set_facecolor("none")
        for spine in axes.spines.values():
            spine.set_visible(False)
        axes.tick_params(length=0, pad=3, labelsize=SMALL, labelcolor=style.TEXT_SOFT)
        axes.set_xticks([])
        axes.set_yticks([])
        return axes

    def scale(
        self,
        axes: Axes,
        side: Literal["x", "y"],
        places: Sequence[float] | NDArray[np.float64],
        words: Sequence[object] | None = None,
        *,
        lines: bool = False,
    ) -> None:
        """Label positions of an axis, by default with the numbers (empty: no labels); ``lines`` adds grid lines."""
        shown = [f"{place:g}" for place in places] if words is None else [str(word) for word in words]
        if shown:
            (axes.set_xticks if side == "x" else axes.set_yticks)(places, shown, fontproperties=self.font(SMALL))
        if lines:
            for place in places:
                (axes.axvline if side == "x" else axes.axhline)(place, color=style.GRID, linewidth=0.6, zorder=0)

    def box(self, x: float, y: float, width: float, height: float, colour: str, rounding: float = 1.5) -> None:
        """Fill a rounded rectangle with its upper left corner at ``x, y``."""
        patch = FancyBboxPatch(
            (x + rounding, self.height_pt - y - height + rounding),
            width - 2 * rounding,
            height - 2 * rounding,
            boxstyle=f"round,pad={rounding}",
            facecolor=colour,
            edgecolor="none",
            transform=Affine2D().scale(1 / 72) + self.figure.dpi_scale_trans,
        )
        self.figure.add_artist(patch)

    def line(self, xs: Sequence[float], ys: Sequence[float], **look: Any) -> None:
        """Draw a line through points of the sheet."""
        line = Line2D([x / self.width_pt for x in xs], [1 - y / self.height_pt for y in ys], **look)
        line.set_transform(self.figure.transFigure)
        self.figure.add_artist(line)

    def heading(self, title: str, marks: Sequence[Mark], counts: Sequence[str]) -> None:
        """Draw the title, the marks next to it and, at the right, the first of ``counts`` that fits.

        A title that leaves no room for the marks and the last count is cut.
        """
        baseline, x, right = 15.0, MARGIN_PT, self.width_pt - MARGIN_PT
        widths = [self.text_width(mark.words, SMALL, "bold") + 11 for mark in marks]
        room = right - x - 18 - sum(widths) - 5 * len(widths) - self.text_width(counts[-1], 7.5)
        cut = title
        while title and self.text_width(title, 10, "bold") > room:
            cut = cut[:-1]
            title = f"{cut.rstrip()}…" if cut else ""
        self.text(x, baseline, title, size=10, weight="bold")
        x += self.text_width(title, 10, "bold") + 8
        for mark, width in zip(marks, widths, strict=True):
            self.box(x, baseline - 9.6, width, 13.2, mark.ground, rounding=4)
            self.text(x + 5.5, baseline - 0.6, mark.words, size=SMALL, weight="bold", colour=mark.ink)
            x += width + 5
        fitting = [words for words in counts if x + 10 + self.text_width(words, 7.5) <= right]
        words = fitting[0] if fitting else counts[-1]
        self.text(right, baseline, words, size=7.5, colour=style.TEXT_SOFT, ha="right")


POINT: Final[Style] = {
    "marker": "o",
    "linestyle": "none",
    "color": style.PARTICIPANT,
    "markersize": 3.0,
    "markeredgewidth": 0.4,
    "markeredgecolor": "#ffffff",
}
"""The point of one participant; the edge separates points that touch."""


def spread_points(places_pt: Sequence[float] | NDArray[np.float64], most_pt: float) -> NDArray[np.float64]:
    """Return an offset [pt] across the scale for each point, so that points overlap only if there is no space.

    Offsets lie within ±``most_pt`` and are 0 for points far from all others. If there is no space left, a point is
    placed where it overlaps the others least.
    """
    places, apart = np.asarray(places_pt, dtype=float), POINT["markersize"] + POINT["markeredgewidth"]
    step = apart / 4
    lanes = step * np.array(sorted(range(-int(most_pt / step), int(most_pt / step) + 1), key=abs))
    order, offsets = np.argsort(places, kind="stable"), np.zeros(len(places))
    for rank, point in enumerate(order):
        near = order[np.searchsorted(places[order], places[point] - apart) : rank]
        distances = np.hypot(places[point] - places[near], lanes[:, None] - offsets[near])
        free = np.minimum(distances.min(axis=1, initial=np.inf), apart - 1e-9)
        offsets[point] = lanes[np.argmax(free)]
    return offsets


@dataclass(frozen=True, slots=True)
class Look:
    """The elements that all figures have: title, marks, texts on n (longest first), and fonts."""

    title: str
    marks: Sequence[Mark]
    counts: Sequence[str]
    fonts: Sequence[str]

    def sheet(self, height_pt: float, width_pt: float = style.PAGE_WIDTH_PT) -> Sheet:
        """Return a sheet with its heading."""
        sheet = Sheet(width_pt, height_pt, self.fonts)
        sheet.heading(self.title, self.marks, self.counts)
        return sheet


def study_marks(study: Study) -> list[Mark]:
    """Return the marks for a study's figures."""
    marks = (
        (study.simulated, Mark(words="SIMULATED participants", ink=style.WARN, ground=style.WARN_GROUND)),
        (study.pilot, Mark(words="PILOT", ink=style.WARN, ground=style.WARN_GROUND)),
        (
            not study.revealed,
            Mark(words="Blinded: conditions appear as codes", ink=style.SEALED, ground=style.SEALED_GROUND),
        ),
        (
            study.split not in ("", EACH_GROUP),
            Mark(words=f"Only {study.split}", ink=style.SEALED, ground=style.SEALED_GROUND),
        ),
    )
    return [mark for applies, mark in marks if applies]


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """One figure: its block, file name, title and caption, and its content by format (png, svg, pdf).

    ``numbers`` are its data as tab-separated lines; empty if they are unknown.
    """

    block: str
    name: str
    caption: str
    files: dict[str, bytes]
    title: str = ""
    numbers: str = ""


FigureTask: TypeAlias = tuple[str, str, Callable[[], Picture | None]]
"""The ID of a block, a file name, and the function that draws the figure, or returns None without data."""


def draw_figures(tasks: Iterable[FigureTask], failures: Failures | None = None) -> Iterator[Picture]:
    """Yield the figures; one that fails is omitted and added to ``failures``."""
    collected = Failures() if failures is None else failures
    for block, name, draw in tasks:
        drawn = collected.attempt(f"figure {name}", draw, block=block)
        if drawn is not None and not isinstance(drawn, Failure):
            yield drawn


def picture_of(
    study: Study,
    block: str,
    name: str,
    title: str,
    caption: str,
    draw: Callable[[Look], Sheet],
    forms: Sequence[str],
    counts: Sequence[str] | None = None,
    numbers: str = "",
) -> Picture:
    """Return a figure drawn by ``draw`` in each of ``forms``; ``counts`` are texts on n, by default the study's."""
    people = (counted(study.n, "participant"),) if counts is None else counts
    drawn = draw(Look(title, study_marks(study), people, style.fonts())).figure
    files = {form: style.file_bytes(drawn, form, f"{study.name}: {title}") for form in forms}
    return Picture(block=block, name=name, caption=caption, files=files, title=title, numbers=numbers)


def tab_separated(study: Study, table: pd.DataFrame) -> str:
    """Return a table as tab-separated lines; the group of each participant follows the ID."""
    members = group_members(study)
    if members and "participant" in table:
        table = table.drop(columns="group", errors="ignore")
        table.insert([*table].index("participant") + 1, "group", table["participant"].map(members))
    return table.to_csv(sep="\t", index=False)


def sample_text(study: Study, n: int) -> str:
    """Return the last sentence of a caption, on the number of participants."""
    return f"{capitalised(counted(n, 'participant'))}{' (SIMULATED, not people)' if study.simulated else ''}."


@dataclass(frozen=True, slots=True)
class Drawing:
    """The data of a figure of a block, its file name, and its formats."""

    study: Study
    block: Block
    result: BlockResult
    results: Results
    name: str
    forms: Sequence[str]

    @property
    def simulated(self) -> str:
        """The caption's sentence on simulated participants, if any."""
        return "SIMULATED participants, not people; " if self.study.simulated else ""

    def picture(
        self, title: str, caption: str, draw: Callable[[Look], Sheet], counts: Sequence[str] = ("",), numbers: str = ""
    ) -> Picture:
        """Return the figure drawn by ``draw`` in each format."""
        return picture_of(self.study, self.block.id, self.name, title, caption, draw, self.forms, counts, numbers)
