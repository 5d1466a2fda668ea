"""Figures with a small point for each participant's value, next to the mean with its interval.

If a study is split by group, the points and means of all groups are side by side, or only one group is shown.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from study_app import figure_style as style
from study_app.analysis.data.study_tables import Study, group_members
from study_app.analysis.page_layout import MARGIN_PT, POINT, SMALL, Look, Picture, Sheet, picture_of, spread_points
from study_app.analysis.statistics.outcome import student_interval
from study_app.analysis.wording import percent
from study_app.protocol.participants import EACH_GROUP

_A_ROW: Final = 3
"""Number of panels in a row."""
WIDTH_PT: Final = 420.0
"""Width of a figure that is next to its answer."""
_PANEL_PT: Final = 128.0
_SMALL_PANEL_PT: Final = 72.0
_LEAST_PANEL_PT: Final = 52.0
"""Heights of panels in one row, in two rows, and in more."""
_MOST_COLUMN_PT: Final = 120.0
_NARROW_PT: Final = 290.0
"""Smallest width of a figure, in which its heading fits."""
_OF_MANY_PT: Final = 300.0
"""Largest width of a column in which each participant has an interval; `_MOST_COLUMN_PT` is that of others."""
MOST_LETTERS: Final = 64
"""The most letters of the title of a scale, which does not reach the legend."""
_ROW_GAP_PT: Final = 6.0
_LEFT_PT: Final = 34.0
_GAP_PT: Final = 12.0
_TITLE_PT: Final = 10.0
_NAME_PT: Final = 8.6
_HEAD_PT: Final = 38.0
_ROOM: Final = 0.07
"""Margin beyond the ends of a scale, as a proportion of the scale."""
_SPREAD: Final = 0.16
"""Largest distance between joined points of a column, as a proportion of the distance between columns."""
_SPREAD_OF_ENDS: Final = 0.26
"""The same if each participant has an interval; participants are then sorted by value."""
_SPREAD_ALONE: Final = 0.2
"""The same if points are not joined; only points that would touch are moved apart."""
_GOLDEN: Final = 0.6180339887
"""Steps of a sequence that spreads points evenly."""
_ASIDE: Final = 0.27
"""Distance of a mean from its points, as a proportion of the distance between columns."""
_GROUPS: Final = (style.ACCENT, style.SECOND, "#5d6a75", "#6d1007", "#5d8aa8", "#02256d")
_MARKERS: Final = "osD^vP"
_LEAST_TICKS: Final = 3
_GROUP_STEP: Final = 0.8
"""Distance over which the groups of a column are spread, as a proportion of the distance between columns."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mean:
    """A mean and its interval."""

    value: float
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """The values of all participants above one name, in the same order in every column, and their mean.

    ``ends`` has the ends of each participant's interval; ``group`` is the group whose participants the column shows.
    """

    name: str
    values: Mapping[str, float]
    mean: Mean | None = None
    ends: Mapping[str, tuple[float, float]] | None = None
    group: str = ""

    def select_group(self, people: Mapping[str, str], group: str, *, log: bool, level: float = 0.95) -> "Column":
        """Return the column with the values of one group; ``people`` maps participants to groups."""
        values = {person: value for person, value in self.values.items() if people.get(person) == group}
        ends = (
            None
            if self.ends is None
            else {person: interval for person, interval in self.ends.items() if person in values}
        )
        mean = mean_of((math.log(value) if log else value for value in values.values()), level)
        if mean is not None and log:
            low, high = (None if end is None else math.exp(end) for end in (mean.low, mean.high))
            mean = Mean(value=math.exp(mean.value), low=low, high=high)
        return replace(self, values=values, mean=mean, ends=ends, group=group)


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """Columns with a common scale.

    Parameters
    ----------
    title : its heading
    places : positions of the columns on a numeric axis; by default columns are evenly spaced
    joined : whether the points of a participant are joined
    share : its width as a proportion of all panels of a row
    line, bound : a value and a range to mark
    log : whether the scale is logarithmic
    level : the confidence level of the intervals of means
    ends : ends of the scale, which has labels at the ends and in the middle; by default from the values
    ticks : positions and names below the columns; by default each column's own
    """

    title: str = ""
    columns: tuple[Column, ...]
    places: tuple[float, ...] = ()
    joined: bool = True
    share: float = 1.0
    line: float | None = None
    bound: tuple[float, float] | None = None
    log: bool = False
    level: float = 0.95
    ends: tuple[float, float] | None = None
    ticks: tuple[tuple[float, str], ...] = ()

    @property
    def xs(self) -> Sequence[float]:
        """The horizontal positions of the columns."""
        return self.places or tuple(map(float, range(len(self.columns))))

    @property
    def names(self) -> Sequence[tuple[float, str]]:
        """The positions and names below the columns."""
        return self.ticks or [(x, column.name) for x, column in zip(self.xs, self.columns, strict=True)]

    def split(self, people: Mapping[str, str], groups: Sequence[str]) -> "Panel":
        """Return the panel with a column for each group in place of each column; ``people`` maps IDs to groups."""
        columns = [
            column.select_group(people, group, log=self.log, level=self.level)
            for column in self.columns
            for group in groups
        ]
        if len(groups) == 1:
            return replace(self, columns=tuple(columns))
        bases = np.array(self.xs)
        step = _GROUP_STEP / len(groups) * (float(np.diff(bases).min()) if len(bases) > 1 else 1.0)
        offsets = step * (np.arange(len(groups)) - (len(groups) - 1) / 2)
        places = tuple(float(base + offset) for base in bases for offset in offsets)
        return replace(self, columns=tuple(columns), places=places, ticks=tuple(self.names))

    @property
    def numbers(self) -> list[float]:
        """All values that the scale must include."""
        means = [column.mean for column in self.columns if column.mean is not None]
        mean_ends = [end for mean in means for end in (mean.value, mean.low, mean.high) if end is not None]
        interval_ends = [end for column in self.columns for ends in (column.ends or {}).values() for end in ends]
        marks = [*([self.line] if self.line is not None else []), *(self.bound or ())]
        return [
            *(value for column in self.columns for value in column.values.values()),
            *mean_ends,
            *interval_ends,
            *marks,
        ]


def people_picture(
    study: Study,
    block: str,
    name: str,
    title: str,
    caption: str,
    panels: Sequence[Panel],
    forms: Sequence[str],
    *,
    above: str,
    below: str = "",
    shared: bool = False,
) -> Picture:
    """Return the figure of panels (see `draw_people`), with the groups that the study's split shows."""
    members = group_members(study)
    groups = sorted({*members.values()})
    if study.split and not any(column.group for panel in panels for column in panel.columns):
        panels = [panel.split(members, groups) for panel in panels]
        caption += f" Diamonds show group means with {percent(panels[0].level)} confidence intervals (Student's t)."
    people = {person for panel in panels for column in panel.columns for person in column.values}
    shown_members = {person: group for person, group in members.items() if person in people}
    coloured_members = shown_members if study.split in ("", EACH_GROUP) else None
    draw = partial(draw_people, panels, above=above, below=below, members=coloured_members, shared=shared)
    n = (f"n = {len(people)}",)
    return picture_of(study, block, name, title, caption, draw, forms, n, numbers_of_panels(panels, shown_members))


def numbers_of_panels(panels: Sequence[Panel], members: Mapping[str, str] = MappingProxyType({})) -> str:
    """Return the values of panels as tab-separated lines: one for each participant, then means with intervals.

    With ``members``, the second column is the group.
    """
    columns: dict[str, list[Column]] = {}
    for panel in panels:
        for column in panel.columns:
            columns.setdefault(f"{panel.title} {column.name}".strip() or "value", []).append(column)
    people = sorted({person for same in columns.values() for column in same for person in column.values})

    def row(first: str, group: str, cells: Iterable[float | None]) -> list[str]:
        numbers = ("" if cell is None else repr(float(cell)) for cell in cells)
        return [first, *([group] if members else []), *numbers]

    rows = [["participant", *(["group"] if members else []), *columns]]
    for person in people:
        values = (
            next((column.values[person] for column in same if person in column.values), None)
            for same in columns.values()
        )
        rows.append(row(person, members.get(person, ""), values))
    interval = _interval_text(panels)
    means = {"value": "mean", "low": f"lower end of the {interval}", "high": f"upper end of the {interval}"}
    for field, words in means.items():
        for group in dict.fromkeys(column.group for same in columns.values() for column in same):
            group_means = (
                next((column.mean for column in same if column.group == group), None) for same in columns.values()
            )
            rows.append(row(words, group, (getattr(mean, field, None) for mean in group_means)))
    return "".join("\t".join(cells) + "\n" for cells in rows)


def _interval_text(panels: Sequence[Panel]) -> str:
    return f"{percent(panels[0].level)} interval"


def mean_of(values: Iterable[float], level: float = 0.95) -> Mean | None:
    """Return the mean with Student's interval; None without numbers."""
    array = np.array([*values], dtype=float)
    if not len(array):
        return None
    low, high = student_interval(array, level)
    return Mean(value=float(array.mean()), low=low, high=high)


@style.own_settings()
def draw_people(
    panels: Sequence[Panel],
    look: Look,
    *,
    above: str,
    below: str = "",
    members: Mapping[str, str] | None = None,
    shared: bool = False,
) -> Sheet:
    """Draw panels in rows of `_A_ROW`.

    Parameters
    ----------
    above, below : the titles of the scale at the left and of the columns
    members : the group of each participant, which determines colour and marker
    shared : whether all panels have a common scale
    """
    groups = sorted(set((members or {}).values()))
    panel_pt = _PANEL_PT if len(panels) <= _A_ROW else _SMALL_PANEL_PT if len(panels) <= 2 * _A_ROW else _LEAST_PANEL_PT
    width_pt = WIDTH_PT
    ruler = Sheet(width_pt, 72, look.fonts)
    rows = [panels[place : place + _A_ROW] for place in range(0, len(panels), _A_ROW)]
    available_pt = width_pt - MARGIN_PT
    widths = [_panel_widths(row, rows[0], available_pt, shared=shared) for row in rows]
    if len(panels) == 1:
        width_pt = min(width_pt, max(_NARROW_PT, _LEFT_PT + widths[0][0] + MARGIN_PT))
    titles = [
        [ruler.wrap(panel.title, width, SMALL, "bold") for panel, width in zip(row, row_widths, strict=True)]
        for row, row_widths in zip(rows, widths, strict=True)
    ]
    names = [
        [_wrapped_names(ruler, panel, width) for panel, width in zip(row, row_widths, strict=True)]
        for row, row_widths in zip(rows, widths, strict=True)
    ]
    title_pt = [_TITLE_PT * max(map(len, lines), default=0) * any(panel.title for panel in row)
                for lines, row in zip(titles, rows, strict=True)]  # fmt: skip
    name_pt = [_NAME_PT * max(len(lines) for panel in row for lines in panel) + 8 for row in names]
    head = _HEAD_PT + (10.0 if groups else 0.0)
    height = head + sum(title_pt) + sum(name_pt) + len(rows) * (panel_pt + _ROW_GAP_PT) + (8.0 if below else 2.0)
    sheet = look.sheet(height, width_pt)
    logarithmic = " (logarithmic scale)" if any(panel.log for panel in panels) else ""
    sheet.text(MARGIN_PT, 28, f"{above}{logarithmic}", size=SMALL, colour=style.TEXT_SOFT)
    _draw_legend(sheet, groups, _interval_text(panels))
    y = head
    for row, row_widths, row_titles, row_names, title, name in zip(
        rows, widths, titles, names, title_pt, name_pt, strict=True
    ):
        x = 0.0
        for place, (panel, width) in enumerate(zip(row, row_widths, strict=True)):
            x += _LEFT_PT if place == 0 or not shared else _GAP_PT
            for number, line in enumerate(row_titles[place]):
                sheet.text(x, y + _TITLE_PT * number + 5, line, size=SMALL, weight="bold")
            axes = sheet.axes(x, y + title, width, panel_pt)
            ends = _draw_scale(sheet, axes, panel, panels if shared else [panel], words=place == 0 or not shared)
            axes.set_ylim(*ends)
            _draw_panel(sheet, axes, panel, members or {}, groups, row_names[place])
            x += width
        y += title + panel_pt + name + _ROW_GAP_PT
    if below:
        sheet.text(_LEFT_PT, sheet.height_pt - 4, below, size=SMALL, colour=style.TEXT_SOFT)
    return sheet


def panel_rows(panels: int) -> int:
    """Return the number of rows for a number of panels."""
    return -(-panels // _A_ROW)


def _panel_widths(row: Sequence[Panel], first: Sequence[Panel], available_pt: float, *, shared: bool) -> list[float]:
    """Return the widths of a row's panels [pt], which correspond to those of the ``first`` row."""
    panels_pt = available_pt - (_LEFT_PT + (len(first) - 1) * _GAP_PT if shared else len(first) * _LEFT_PT)
    total = sum(panel.share for panel in first)
    limits = [
        _OF_MANY_PT if any(column.ends for column in panel.columns) else _MOST_COLUMN_PT * len(panel.columns)
        for panel in row
    ]
    return [min(panels_pt * panel.share / total, limit) for panel, limit in zip(row, limits, strict=True)]


def _wrapped_names(ruler: Sheet, panel: Panel, width: float) -> list[list[str]]:
    """Return the lines of each column's name."""
    room = width / (len(panel.names) or 1) - 3
    return [ruler.wrap(name, room, SMALL) for _, name in panel.names]


def _draw_legend(sheet: Sheet, groups: Sequence[str], interval: str) -> None:
    """Draw the legend of means, and of participants or, with groups, of each group's colour and marker."""
    x = sheet.width_pt - MARGIN_PT
    marks = ((f"mean, {interval}", "D", 3.6), ("participant", "o", POINT["markersize"]))
    for words, marker, size in marks[: 1 if groups else 2]:
        x -= sheet.text_width(words, SMALL)
        sheet.text(x, 28, words, size=SMALL, colour=style.TEXT_SOFT)
        colour = style.TEXT if marker == "D" else style.PARTICIPANT
        sheet.line([x - 5], [25.5], marker=marker, markersize=size, markeredgewidth=0, color=colour)
        x -= 18
    x = sheet.width_pt - MARGIN_PT
    for number, group in reversed([*enumerate(groups)]):
        x -= sheet.text_width(group, SMALL)
        sheet.text(x, 38.5, group, size=SMALL, colour=_GROUPS[number % len(_GROUPS)], weight="bold")
        x -= 9
        sheet.line([x + 4], [36], marker=_MARKERS[number % len(_MARKERS)], markersize=3.2,
                   color=_GROUPS[number % len(_GROUPS)], linestyle="none")  # fmt: skip
        x -= 8


def _draw_scale(sheet: Sheet, axes: Axes, panel: Panel, common: Sequence[Panel], *, words: bool) -> tuple[float, float]:
    """Draw the scale of a panel for the values of the panels ``common``; return its limits."""
    ends = panel.ends
    if ends is None:
        numbers = [number for other in common for number in other.numbers if number > 0 or not panel.log]
        low, high = min(numbers, default=0.0), max(numbers, default=1.0)
        if panel.log:
            factor = max((high / low) ** 0.06, 1.08)
            ends = low / factor, high * factor
        else:
            margin = _ROOM * ((high - low) or 1.0)
            ends = low - margin, high + margin
        ticks = scale_ticks(*ends, log=panel.log)
    else:
        low, high = ends
        margin, ticks = _ROOM * (high - low), [low, (low + high) / 2, high]
        ends = low - margin, high + margin
    if panel.log:
        axes.set_yscale("log")
        axes.minorticks_off()
    sheet.scale(axes, "y", ticks, [f"{tick:g}".replace("-", "−") if words else "" for tick in ticks], lines=True)
    return ends


def scale_ticks(low: float, high: float, *, log: bool) -> list[float]:
    """Return round numbers (1, 2, 5 per decade, or linear) between the ends of a scale."""
    if not log:
        ticks = MaxNLocator(nbins=5, steps=[1, 2, 5, 10]).tick_values(low, high)
        return [float(f"{tick:.12g}") for tick in ticks if low <= tick <= high]
    inside: list[float] = []
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for digits in ((1,), (1, 3), (1, 2, 5), (1, 2, 3, 5, 7), tuple(range(1, 10)), tuple(np.arange(10, 100) / 10)):
        inside = [tick for tick in (float(f"{digit:g}e{decade}") for decade in decades for digit in digits)
                  if low <= tick <= high]  # fmt: skip
        if len(inside) >= _LEAST_TICKS:
            break
    return inside


def _draw_panel(
    sheet: Sheet,
    axes: Axes,
    panel: Panel,
    members: Mapping[str, str],
    groups: Sequence[str],
    names: Sequence[Sequence[str]],
) -> None:
    xs = np.array(panel.xs)
    step = float(np.min(np.diff(np.unique(xs)))) if len(xs) > 1 else 1.0
    axes.set_xlim(xs.min() - 0.55 * step, xs.max() + 0.55 * step)
    axes.set_xticks([x for x, _ in panel.names], ["\n".join(lines) for lines in names])
    for text in axes.get_xticklabels():
        text.set_fontproperties(sheet.font(SMALL))
    if panel.bound is not None:
        axes.axhspan(*panel.bound, color=style.BAND, alpha=0.55, linewidth=0, zorder=0, gid="bound")
    if panel.line is not None:
        axes.axhline(panel.line, color=style.AXIS, linewidth=0.8, linestyle=(0, (4, 3)), zorder=1)
    people = sorted({person for column in panel.columns for person in column.values})
    if sum(len(column.values) for column in panel.columns) == len(people) and panel.columns[0].ends is None:
        offsets = _point_offsets(axes, panel, _SPREAD_ALONE * step)
    else:
        offsets = dict(zip(people, _joined_offsets(panel, people) * step, strict=True))
    for person in people:
        points = [(x + offsets[person], column.values[person])
              for x, column in zip(xs, panel.columns, strict=True) if person in column.values]  # fmt: skip
        number = groups.index(members[person]) if person in members else None
        colour = style.PARTICIPANT if number is None else _GROUPS[number % len(_GROUPS)]
        if panel.joined and len(points) > 1:
            axes.plot(*zip(*points, strict=True), color=colour, linewidth=0.6, alpha=0.55, zorder=2)
        marker = "o" if number is None else _MARKERS[number % len(_MARKERS)]
        point = POINT | {"marker": marker, "color": colour}
        axes.plot(*zip(*points, strict=True), **point, zorder=3, gid=f"person-{person}")
    for x, column in zip(xs, panel.columns, strict=True):
        ink = _GROUPS[groups.index(column.group) % len(_GROUPS)] if column.group in groups else style.TEXT
        for person, ends in (column.ends or {}).items():
            axes.plot([x + offsets[person]] * 2, ends, color=style.PARTICIPANT, linewidth=0.5, zorder=2)
        if column.mean is not None:
            mean_x = x + (_ASIDE * step if column.values else 0.0)
            axes.plot([mean_x], [column.mean.value], "D", color=ink, markersize=4, zorder=5, gid="mean")
            _draw_interval(axes, mean_x, column.mean, ink)


def _draw_interval(axes: Axes, x: float, mean: Mean, colour: str) -> None:
    """Draw the interval of a mean, with an arrow at an end beyond the scale."""
    if mean.low is None or mean.high is None:
        return
    bottom, top = axes.get_ylim()
    low, high = max(mean.low, bottom), min(mean.high, top)
    axes.plot([x] * 2, [low, high], color=colour, linewidth=1.5, zorder=4, gid="interval")
    arrows = (("v", low, low > mean.low), ("^", high, high < mean.high))
    for marker, end, is_cut in arrows:
        if is_cut:
            axes.plot([x], [end], marker, color=colour, markersize=4, markeredgewidth=0, zorder=4)


def _point_offsets(axes: Axes, panel: Panel, most: float) -> dict[str, float]:
    """Return the horizontal offset of each participant's point, if each has only one."""
    per_pt = 72 / axes.figure.dpi
    (left, _), (right, _) = axes.transData.transform([(0.0, axes.get_ylim()[0]), (1.0, axes.get_ylim()[0])])
    offsets: dict[str, float] = {}
    for column in panel.columns:
        heights = axes.transData.transform([(0.0, value) for value in column.values.values()] or [(0.0, 1.0)])[:, 1]
        width = per_pt * (right - left)
        offsets |= zip(column.values, spread_points(per_pt * heights, most * width) / width, strict=False)
    return offsets


def _joined_offsets(panel: Panel, people: Sequence[str]) -> np.ndarray:
    """Return the horizontal offset of each participant's points, which are joined or have intervals."""
    if len(people) < 2:
        return np.zeros(len(people))
    first = [next(column.values[person] for column in panel.columns if person in column.values) for person in people]
    order = np.argsort(np.argsort(first, kind="stable"))
    if panel.columns[0].ends is not None:
        return np.asarray((order / (len(people) - 1) - 0.75) * 2 * _SPREAD_OF_ENDS)
    return np.asarray((np.arange(len(people)) * _GOLDEN % 1.0 - 0.5) * _SPREAD)
