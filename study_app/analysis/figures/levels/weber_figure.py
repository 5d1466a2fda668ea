"""Weber fractions over standards: participants as thin lines, the group with its interval."""

from collections.abc import Sequence
from functools import partial
from typing import Final

from matplotlib.axes import Axes

from study_app import figure_style as style
from study_app.analysis.figures import answer_figures
from study_app.analysis.figures.page_layout import MARGIN_PT, Sheet
from study_app.analysis.figures.picture import Picture, files_of, sample_words
from study_app.analysis.results.level_results import LevelsFound
from study_app.analysis.results.words import counted
from study_app.analysis.tables.study_tables import Study

LEFT_PT: Final = 34.0
RIGHT_PT: Final = 10.0
TOP_PT: Final = 40.0
FOOT_PT: Final = 32.0
HEIGHT_PT: Final = 190.0
FRACTIONS: Final = tuple(digit * 10.0**decade for decade in range(-4, 4) for digit in (1, 2, 5))
Point = tuple[float, float, float | None, float | None]
"""Standard, Weber fraction, and the ends of its interval."""


def weber_fractions(found: LevelsFound, participant: str | None) -> list[Point]:
    """Return the Weber fractions of a participant or, of None, of the group, by standard.

    A threshold that is a difference is divided by its standard; standards of zero and levels that are values have none.
    Where the percentage of the published values is known, the level at it is in the threshold's place.
    """
    if found.level_kind not in {"weber", "difference"}:
        return []
    points, at_threshold = [], found.compared_percent is None
    for one in found.thresholds:
        shown = (one.threshold, one.low, one.high)
        level, *ends = shown if at_threshold else (one.compared, one.compared_low, one.compared_high)
        if one.participant != participant or one.standard is None or one.standard <= 0 or level is None or level <= 0:
            continue
        unit = one.standard if found.level_kind == "difference" else 1.0
        low, high = (None if end is None or end <= 0 else end / unit for end in ends)
        points.append((one.standard, level / unit, low, high))
    return points


def _at(found: LevelsFound) -> str:
    """Return at which percentage Weber fractions are shown."""
    percent = found.compared_percent
    if percent is None and found.guess_rate is not None:
        percent = 50 * (1 + found.guess_rate)
    return "" if percent is None else f" at {percent:.3g} % {found.counts}"


def picture(study: Study, found: LevelsFound, forms: Sequence[str], name: str) -> Picture:
    """Draw the Weber fractions of a block with thresholds at two standards or more."""
    files = files_of(partial(_draw, study, found), forms, f"{study.name}: {found.title}, Weber fractions")
    caption = (
        f"{found.title}: Weber fraction of {found.quantity}{_at(found)}, over the standard. Thin: participants; "
        f"thick: random-effects mean with its 95 % interval.{_published_words(found)} "
        f"{sample_words(study, len(found.people))}"
    )
    return Picture(found.block, name, caption, files)


@style.own_settings()
def _draw(study: Study, found: LevelsFound, fonts: Sequence[str]) -> Sheet:
    sheet = Sheet(style.PAGE_WIDTH_PT / 2, HEIGHT_PT, fonts)
    sheet.heading(found.title, answer_figures.marks(study), (counted(study.n, "participant"), f"n = {study.n}"))
    sheet.text(MARGIN_PT, 28, f"Weber fraction{_at(found)}", size=7, colour=style.TEXT_SOFT)
    axes = sheet.axes(LEFT_PT, TOP_PT, sheet.width_pt - LEFT_PT - RIGHT_PT, sheet.height_pt - TOP_PT - FOOT_PT)
    group = weber_fractions(found, None)
    own = [weber_fractions(found, person) for person in found.people]
    published = published_fractions(found)
    _frame(axes, group, own, published)
    _published(axes, published, sheet)
    for points in own:
        axes.plot(
            [one[0] for one in points], [one[1] for one in points], color=style.PARTICIPANT, linewidth=0.5, alpha=0.7
        )
    _group(axes, group)
    for label in (*axes.get_xticklabels(), *axes.get_yticklabels()):
        label.set_fontproperties(sheet.font(6.5))
    below = f"Standard of {found.quantity}" + (f" [{found.unit}]" if found.unit else "")
    sheet.text(LEFT_PT, sheet.height_pt - 8, below, size=7, colour=style.TEXT_SOFT)
    return sheet


def _group(axes: Axes, points: Sequence[Point]) -> None:
    xs = [one[0] for one in points]
    axes.plot(xs, [one[1] for one in points], marker="o", markersize=3.5, color=style.ACCENT, linewidth=1.2, zorder=3)
    for x, _, low, high in points:
        if low is not None and high is not None:
            axes.plot([x, x], [low, high], color=style.ACCENT, linewidth=1.2, zorder=3)


def published_fractions(found: LevelsFound) -> list[tuple[float | None, float]]:
    """Return standard and Weber fraction of the published values that are one; a standard of None: of all."""
    points = []
    for one in found.published:
        if one.measure == "weber":
            points.append((one.standard, one.value))
        elif one.measure == "threshold" and found.level_kind == "difference" and one.standard:
            points.append((one.standard, one.value / one.standard))
    return points


def _published_words(found: LevelsFound) -> str:
    listed = "; ".join(one.in_words() for one in found.published)
    return f" Open circles and dotted lines: published values, {listed}." if published_fractions(found) else ""


def _published(axes: Axes, points: Sequence[tuple[float | None, float]], sheet: Sheet) -> None:
    """Draw published values: a circle at a standard, a dotted line over all, which is named above the axes."""
    over_all = [f"{fraction:g}" for standard, fraction in points if standard is None]
    if over_all:
        words = f"dotted: published {', '.join(over_all)}"
        x = sheet.width_pt - MARGIN_PT - sheet.text_width(words, 7)
        sheet.text(x, 28, words, size=7, colour=style.TEXT_SOFT)
    for standard, fraction in points:
        if standard is None:
            axes.axhline(fraction, color=style.TEXT_SOFT, linewidth=1.0, linestyle=":", zorder=2)
        else:
            axes.plot([standard], [fraction], "o", markersize=5, fillstyle="none", color=style.TEXT_SOFT, zorder=4)


def _frame(
    axes: Axes, group: Sequence[Point], own: Sequence[Sequence[Point]], published: Sequence[tuple[float | None, float]]
) -> None:
    """Draw logarithmic axes: the standards below, round fractions at the left."""
    values = [value for points in own for _, value, _, _ in points]
    values += [value for point in group for value in point[1:] if value is not None]
    values += [value for _, value in published]
    low = max((tick for tick in FRACTIONS if tick <= min(values)), default=min(values))
    high = min((tick for tick in FRACTIONS if tick >= max(values)), default=max(values))
    standards = [one[0] for one in group]
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.minorticks_off()
    margin = (standards[-1] / standards[0]) ** 0.08
    axes.set_xlim(standards[0] / margin, standards[-1] * margin)
    axes.set_ylim(low, high)
    axes.set_xticks(standards, [f"{standard:g}" for standard in standards])
    ticks = [tick for tick in FRACTIONS if low <= tick <= high]
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.hlines(ticks, *axes.get_xlim(), color=style.GRID, linewidth=0.6, zorder=0)
