"""The figure of a block's power: over the number of participants, a small plot a statement, and under it what is found.

Upper plots: the share of simulated studies that show it, with its Monte Carlo band; the line at 80 %; dashed, the same
without any effect. Under them the smallest difference that 80 % of studies show. Where the study has delays there is a
row for the lowest delay that shows and one for equivalence, a line a delay.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from study_app import figure_style as style
from study_app.analysis.figures.page_layout import MARGIN_PT, Mark, Sheet
from study_app.analysis.power.plan import Planned
from study_app.analysis.power.power_curves import OVER_ALL, WANTED, Curve, Powers, Question, interval
from study_app.analysis.tables.measures import Array

PLOTS_A_ROW: Final = 5
POWER_PT: Final = 74.0
POINTS_PT: Final = 34.0
BETWEEN_PT: Final = 9.0
GAP_PT: Final = 22.0
SCALE_PT: Final = 26.0
TICKS_PT: Final = 12.0
TOP_PT: Final = 30.0
LINE_PT: Final = 9.0
HEAD_PT: Final = 17.0
FOOT_PT: Final = 20.0
SHADES: Final = ("#9dc3de", "#02256d")
"""Of delays, from the shortest to the longest."""

HEADS: Final[dict[Question, str]] = {
    "settings differ": "Studies that show that settings differ; below, the smallest difference that 80 % show [points]",
    "trend": "Studies that show a trend over delay; below, the smallest difference that 80 % show [points]",
    "lowest delay": "Studies that show a trend up to this delay [ms] or a shorter one",
    "equivalence": "Studies that find this delay [ms] equivalent to the shortest, under the model's differences",
}


@dataclass(frozen=True, slots=True)
class _Row:
    """A row of plots: its heading, and for each plot a title and curves."""

    head: str
    plots: tuple[tuple[str, tuple[Curve, ...]], ...]
    points: bool

    @property
    def height_pt(self) -> float:
        return POWER_PT + TICKS_PT + (POINTS_PT + BETWEEN_PT if self.points else 0)


@style.own_settings()
def draw(found: Powers, block: Planned, fonts: Sequence[str]) -> Sheet:
    """Draw the power of one block."""
    ruler = Sheet(style.PAGE_WIDTH_PT, 72, fonts)
    rows = _rows(found, block)
    width = (style.PAGE_WIDTH_PT - 2 * MARGIN_PT - SCALE_PT - PLOTS_A_ROW * GAP_PT + 8) / PLOTS_A_ROW
    titles = [[ruler.wrap(title, width + GAP_PT - 6, 7.5, "bold") for title, _ in row.plots] for row in rows]
    heights = [
        (HEAD_PT if row.head else 0) + max(map(len, lines)) * LINE_PT + row.height_pt + 8
        for row, lines in zip(rows, titles, strict=True)
    ]
    sheet = Sheet(style.PAGE_WIDTH_PT, TOP_PT + sum(heights) + FOOT_PT, fonts)
    mark = Mark("SIMULATED participants", style.WARN, style.WARN_GROUND)
    sheet.heading(
        f"Power: {block.title}",
        [mark],
        [f"{found.studies} studies of each size, α = {found.plan.decided.alpha:g}", f"{found.studies} studies"],
    )
    top = TOP_PT
    for row, lines, height in zip(rows, titles, heights, strict=True):
        _draw_row(sheet, found, row, lines, top, width)
        top += height
    sheet.text(MARGIN_PT, sheet.height_pt - 6, _foot(found, rows), size=6.5, colour=style.TEXT_SOFT)
    return sheet


def _rows(found: Powers, block: Planned) -> list[_Row]:
    rows: list[_Row] = []
    for question, head in HEADS.items():
        curves = [one for one in found.curves if (one.block, one.question) == (block.id, question)]
        plots: list[tuple[str, tuple[Curve, ...]]] = [
            (item.short, mine) for item in block.items if (mine := tuple(one for one in curves if one.item == item.id))
        ]
        plots += [(one.over.capitalize(), (one,)) for one in curves if one.over == OVER_ALL]
        points = any(one.detectable for one in curves)
        for first in range(0, len(plots), PLOTS_A_ROW):
            cut = tuple(plots[first : first + PLOTS_A_ROW])
            rows.append(_Row("" if first else head, cut, points and any(one[0].item for _, one in cut)))
    return rows


def _draw_row(
    sheet: Sheet, found: Powers, row: _Row, titles: Sequence[Sequence[str]], top: float, width: float
) -> None:
    if row.head:
        sheet.text(MARGIN_PT, top + 6, row.head, size=7.5, colour=style.TEXT_SOFT)
        top += HEAD_PT
    title_pt = max(map(len, titles)) * LINE_PT
    highest = max(
        [points for _, curves in row.plots for one in curves for points in one.detectable or () if points], default=1.0
    )
    for place, (_, curves) in enumerate(row.plots):
        x = MARGIN_PT + SCALE_PT + place * (width + GAP_PT)
        for number, line in enumerate(titles[place]):
            sheet.text(x, top + 6 + number * LINE_PT, line, size=7.5, weight="bold")
        axes = sheet.axes(x, top + title_pt + 2, width, POWER_PT)
        _power(sheet, axes, found, curves, numbers=place == 0)
        if row.points and curves[0].detectable:
            below = sheet.axes(x, top + title_pt + 2 + POWER_PT + BETWEEN_PT, width, POINTS_PT)
            _points(sheet, below, found, curves[0], 1.18 * highest)
            _sizes(sheet, below, found, width)
        else:
            _sizes(sheet, axes, found, width)


def _power(sheet: Sheet, axes: Axes, found: Powers, curves: Sequence[Curve], *, numbers: bool) -> None:
    sizes = np.array(found.sizes, dtype=float)
    axes.set_ylim(-2, 104)
    for share in (0, 50, 100):
        axes.axhline(share, color=style.GRID, linewidth=0.6, zorder=0)
    axes.axhline(100 * WANTED, color=style.AXIS, linewidth=0.6, linestyle=(0, (1, 2)), zorder=1)
    if numbers:
        axes.set_yticks((0, 50, 80, 100), ("0", "50", "80", "100 %"), fontproperties=sheet.font(6.5))
    if curves[0].setting is not None:
        _delays(sheet, axes, sizes, curves)
        return
    (curve,) = curves
    power = np.array(curve.power)
    low, high = np.array([interval(share, found.studies) for share in curve.power]).T
    axes.fill_between(sizes, 100 * low, 100 * high, color=style.BAND, linewidth=0, zorder=2)
    axes.plot(sizes, 100 * power, color=style.ACCENT, linewidth=1.5, marker="o", markersize=2.6, zorder=4)
    if curve.alarms is not None:
        axes.plot(
            sizes, 100 * np.array(curve.alarms), color=style.PARTICIPANT, linewidth=0.9, linestyle=(0, (3, 2)), zorder=3
        )


def _delays(sheet: Sheet, axes: Axes, sizes: Array, curves: Sequence[Curve]) -> None:
    """Draw a line a delay, named at its right end, names kept apart."""
    light, dark = (np.array([int(shade[at : at + 2], 16) for at in (1, 3, 5)]) / 255 for shade in SHADES)
    ends = [100 * curve.power[-1] for curve in curves]
    for place, curve in enumerate(curves):
        part = place / max(len(curves) - 1, 1)
        colour = tuple(light + part * (dark - light))
        axes.plot(
            sizes, 100 * np.array(curve.power), color=colour, linewidth=1.3, marker="o", markersize=2, zorder=3 + part
        )
    for curve, y in zip(curves, _apart(ends, 8.4, longest_first=curves[0].question == "lowest delay"), strict=True):
        axes.annotate(
            (curve.setting or "").removesuffix(" ms"),
            (float(sizes[-1]), y),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontproperties=sheet.font(5.6),
            color=style.TEXT,
            annotation_clip=False,
        )


def _apart(ends: Sequence[float], least: float, *, longest_first: bool) -> list[float]:
    """Return heights near ``ends``, ``least`` apart; of equal ones the longest delay is on top, or the shortest."""
    order = sorted(range(len(ends)), key=lambda place: (-ends[place], -place if longest_first else place))
    placed = [0.0] * len(ends)
    ceiling = 104.0
    for place in order:
        placed[place] = min(ends[place], ceiling)
        ceiling = placed[place] - least
    floor = -4.0
    for place in reversed(order):
        placed[place] = max(placed[place], floor)
        floor = placed[place] + least
    return placed


def _points(sheet: Sheet, axes: Axes, found: Powers, curve: Curve, highest: float) -> None:
    sizes = np.array(found.sizes, dtype=float)
    points = np.array([np.nan if one is None else one for one in curve.detectable or ()])
    axes.set_ylim(0, highest)
    axes.axhline(0, color=style.GRID, linewidth=0.6, zorder=0)
    axes.plot(sizes, points, color=style.TEXT, linewidth=1.0, marker="o", markersize=2.2, zorder=3)
    known = np.flatnonzero(~np.isnan(points))
    for at in dict.fromkeys((known[0], known[-1])) if len(known) else ():
        axes.annotate(
            f"{points[at]:.1f}",
            (sizes[at], points[at]),
            xytext=(0, 4),
            textcoords="offset points",
            ha="center",
            fontproperties=sheet.font(6),
            color=style.TEXT,
        )


def _sizes(sheet: Sheet, axes: Axes, found: Powers, width: float) -> None:
    """Put the sizes under a plot, leaving out those that have no room."""
    for other in axes.figure.axes:
        _limits(other, found)
    low, high = axes.get_xlim()
    shown: list[int] = []
    for size in sorted(found.sizes, key=lambda one: (one not in (found.sizes[0], found.sizes[-1]), one)):
        room = sheet.text_width(str(size), 6.5) + 3
        if all(abs(size - other) / (high - low) * width >= room for other in shown):
            shown.append(size)
    axes.set_xticks(shown, [str(size) for size in shown], fontproperties=sheet.font(6.5))


def _limits(axes: Axes, found: Powers) -> None:
    reach = max(found.sizes[-1] - found.sizes[0], 1)
    axes.set_xlim(found.sizes[0] - 0.05 * reach, found.sizes[-1] + 0.05 * reach)


def _foot(found: Powers, rows: Sequence[_Row]) -> str:
    words = "Over participants. Band: Monte Carlo 95 %. Dashed: without any effect. "
    if not any(curve.setting for row in rows for _, curves in row.plots for curve in curves):
        return f"{words}Answers of a model, not of people: real effects may be smaller."
    bound = found.plan.decided.equivalence_bound
    return f"{words}Equivalent: within ±{bound:g} points. Answers of a model, not of people." if bound else words
