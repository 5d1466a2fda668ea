"""Answers over levels: a panel for all participants with 95 % intervals, and one for each participant."""

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, Final, cast

import numpy as np
from matplotlib.axes import Axes

from study_app import figure_style as style
from study_app.analysis.designs.psychometric_bands import psychometric_bands
from study_app.analysis.figures.levels.panels import draw_panels, sheet_of_panels
from study_app.analysis.figures.page_layout import MARGIN_PT, Sheet
from study_app.analysis.figures.picture import Picture, files_of, sample_words
from study_app.analysis.results.level_results import LevelAnswers, LevelsFound, ThresholdFound
from study_app.analysis.results.words import counted
from study_app.analysis.statistics.outcome import Array
from study_app.analysis.tables.study_tables import Study
from study_app.analysis.tables.tracks import tracks
from study_app.psychophysics.families import Family, success

MOST_PEOPLE: Final = 23
"""Participants with a panel of their own; the others are in the first panel and in the table."""
FOOT_PT: Final = 26.0
MOST_TICKS: Final = 5
FEWEST_TICKS: Final = 2
SIZE_PT2: Final = 2.0
"""Area of a circle for each answer at a level."""
ASIDE: Final = 0.025
"""How far the points of one standard are from those of the next, as a share of the axis."""
BELOW: Final = 0.03
"""How far the interval of one standard's threshold is drawn below that of the one before, as a share correct."""
COLOURS: Final = (style.ACCENT, "#b35600", style.TEXT, "#6d1007", "#5d8aa8", "#b75a26", "#02256d", style.AXIS)
LEVELS: Final[Mapping[str | None, str]] = {"weber": "Weber fraction of ", "difference": "difference of ", "value": ""}
UNITLESS: Final = "weber"


def picture(study: Study, found: LevelsFound, forms: Sequence[str], name: str) -> Picture:
    """Draw the answers over levels of a block."""
    bands = _bands(study, found)
    files = files_of(partial(_draw, study, found, bands), forms, f"{study.name}: {found.title}")
    own = len(found.people) - MOST_PEOPLE
    left_out = f" {counted(own, 'more participant')} in the table alone." if own > 0 else ""
    caption = (
        f"{found.title}: {summary_words(found)} at each level. {_panels(found, bool(bands))}{_chance(found)}{left_out} "
        f"{sample_words(study, len(found.people))}"
    )
    return Picture(found.block, name, caption, files)


def _bands(study: Study, found: LevelsFound) -> Mapping[str, Array]:
    """Return the bands of the participants' functions, where there is one in each panel."""
    if not found.own_thresholds or len(_standards(found)) > 1:
        return {}
    block = next(block for block in study.levels if block.id == found.block)
    return psychometric_bands(block, tracks(study), found.people[:MOST_PEOPLE], _limits(found, _places(found)))


def _panels(found: LevelsFound, banded: bool) -> str:
    band = ", with the 95 % band" if banded else ""
    crosses = "; crosses: catch trials" if found.has_catch_trials else ""
    if found.own_thresholds:
        return (
            f"Curves: psychometric functions at the posterior medians{band}; bars: 95 % intervals of the thresholds, "
            "those of several standards one below another; "
            f"circles: answers at each level, area by their number{crosses}. First panel: all participants."
        )
    units = ", without the unit that each chose" if found.own_units else ""
    return (
        f"First panel: {mean_words(found)} over the participants, bars: its 95 % interval (Student's t); thin: "
        f"participants{units}. Other panels: each participant with the 95 % interval of the answers{crosses}."
    )


def summary_words(found: LevelsFound) -> str:
    """Return what a value at a level is: "share correct", "mean rating", "geometric mean of the numbers"."""
    if found.summary == "share":
        return "share correct" if found.counts == "correct" else f"share “{found.counts}”"
    return "mean rating" if found.summary == "mean" else "geometric mean of the numbers"


def mean_words(found: LevelsFound) -> str:
    """Return what a value of all participants is."""
    return "geometric mean" if found.summary == "geometric mean" else "mean"


def level_words(found: LevelsFound) -> str:
    """Return what a level is, with its unit: "Weber fraction of viscosity", "Viscosity [Pa·s]", "Condition"."""
    if found.quantity is None:
        return "Condition"
    words = f"{LEVELS[found.level_kind]}{found.quantity}"
    unit = "" if found.level_kind == UNITLESS or not found.unit else f" [{found.unit}]"
    return words[:1].upper() + words[1:] + unit


def with_unit(found: LevelsFound, value: float) -> str:
    """Return a value of the varied number with its unit."""
    return f"{value:g} {found.unit or ''}".rstrip()


def _chance(found: LevelsFound) -> str:
    return "" if found.guess_rate is None else f" Dashed: chance ({100 * found.guess_rate:.0f} %)."


@style.own_settings()
def _draw(study: Study, found: LevelsFound, bands: Mapping[str, Array], fonts: Sequence[str]) -> Sheet:
    people = found.people[:MOST_PEOPLE]
    words = summary_words(found)
    above = words[:1].upper() + words[1:]
    sheet = sheet_of_panels(study, found.title, above, 1 + len(people), fonts, foot_pt=FOOT_PT)
    _keys(sheet, found)

    def draw(axes: Axes, place: int, first: bool) -> None:
        person = people[place - 1] if place else None
        _panel(axes, found, person, first=first)
        if person is not None and person in bands:
            u, lower, upper = bands[person]
            axes.fill_between(u, lower, upper, color=style.BAND, linewidth=0, zorder=1)

    return draw_panels(sheet, [(name, "") for name in ("All", *people)], draw, level_words(found))


def _keys(sheet: Sheet, found: LevelsFound) -> None:
    """Write which colour is which standard."""
    standards = _standards(found)
    if len(standards) < 2:
        return
    x = sheet.width_pt - MARGIN_PT
    for standard, colour in reversed(list(zip(standards, COLOURS, strict=False))):
        words = f"standard {with_unit(found, standard)}"
        x -= sheet.text_width(words, 7)
        sheet.text(x, 28, words, size=7, colour=colour)
        x -= 10


def _standards(found: LevelsFound) -> list[float]:
    return sorted({one.standard for one in found.answers if one.standard is not None})


def _panel(axes: Axes, found: LevelsFound, person: str | None, *, first: bool) -> None:
    places = _places(found)
    _frame(axes, found, places, first=first)
    groups: Sequence[float | None] = _standards(found) or [None]
    for number, (standard, colour) in enumerate(zip(groups, COLOURS, strict=False)):
        for one in found.own_thresholds:
            if one.standard == standard and person in {None, one.participant}:
                grey = person is None and len(groups) == 1
                _curve(axes, found, one, style.PARTICIPANT if grey else colour)
                if person is not None:
                    _interval(axes, found, one, colour, number)
        if person is None and found.adaptive:
            continue
        span = 0.0 if found.own_thresholds else max(places.values()) - min(places.values())
        aside = ASIDE * (number - (len(groups) - 1) / 2) * span
        shown = [one for one in found.answers if one.standard == standard and not one.catch]
        if person is None and len(groups) == 1 and not found.own_thresholds:
            for somebody in found.people:
                _line(axes, shown, somebody, places, found)
        shifted = {level: place + aside for level, place in places.items()}
        _points(axes, [one for one in shown if one.participant == person], shifted, found, colour)
        caught = [one for one in found.answers if one.standard == standard and one.catch and one.participant == person]
        heights = [_height(found, one.value) for one in caught]
        axes.plot([shifted[_where(one)] for one in caught], heights, "x", color=colour, markersize=4, zorder=4)


def _line(
    axes: Axes, shown: Sequence[LevelAnswers], person: str, places: Mapping[Any, float], found: LevelsFound
) -> None:
    """Draw a participant's answers; numbers without the unit that the participant chose."""
    points = [one for one in shown if one.participant == person]
    heights = np.array([_height(found, one.value) for one in points])
    if found.own_units and points:
        heights += np.mean([_height(found, one.value) for one in shown if one.participant is None]) - heights.mean()
    axes.plot([places[_where(one)] for one in points], heights, color=style.PARTICIPANT, linewidth=0.5, alpha=0.7)


def _curve(axes: Axes, found: LevelsFound, one: ThresholdFound, colour: str) -> None:
    """Draw a participant's psychometric function."""
    low, high = axes.get_xlim()
    u = np.linspace(low, high, 120)
    middle = _coordinate(found, one.threshold)
    shape = cast("Family", found.family)
    psi = success(shape, u, middle, one.width or 1.0, one.guess or 0.0, one.lapse or 0.0)
    axes.plot(u, psi, color=colour, linewidth=0.9, zorder=2)


def _interval(axes: Axes, found: LevelsFound, one: ThresholdFound, colour: str, number: int) -> None:
    """Draw the interval of a threshold at the height of the function there, each standard's below the one before."""
    if one.low is None or one.high is None:
        return
    guess = one.guess or 0.0
    height = guess + (1.0 - guess - (one.lapse or 0.0)) / 2 - BELOW * number
    ends = [_coordinate(found, one.low), _coordinate(found, one.high)]
    axes.plot(ends, [height, height], color=colour, linewidth=1.2, solid_capstyle="butt", zorder=2)


def _coordinate(found: LevelsFound, level: float) -> float:
    return math.log10(level) if found.spacing == "log" else level


def _points(
    axes: Axes, points: Sequence[LevelAnswers], places: Mapping[Any, float], found: LevelsFound, colour: str
) -> None:
    xs, ys = [places[_where(one)] for one in points], [_height(found, one.value) for one in points]
    if found.own_thresholds:
        sizes = [SIZE_PT2 * one.n for one in points]
        axes.scatter(xs, ys, s=sizes, facecolors="none", edgecolors=colour, linewidths=0.7, zorder=3)
        return
    joined = "none" if found.vary is None else "-"
    axes.plot(xs, ys, marker="o", markersize=3, color=colour, linewidth=0.9, linestyle=joined)
    for x, one in zip(xs, points, strict=True):
        if one.low is not None and one.high is not None:
            axes.plot([x, x], [_height(found, one.low), _height(found, one.high)], color=colour, linewidth=0.9)


def _where(one: LevelAnswers) -> Any:
    return one.comparison if one.level is None else one.level


def _height(found: LevelsFound, value: float) -> float:
    return math.log10(value) if found.summary == "geometric mean" else value


def _places(found: LevelsFound) -> dict[Any, float]:
    """Return the place of each level on the horizontal axis: its logarithm where levels are spaced so."""
    levels = list(dict.fromkeys(_where(one) for one in found.answers if one.participant is None))
    if found.vary is None:
        return {level: float(place) for place, level in enumerate(levels)}
    if found.spacing == "linear":
        return {level: float(level) for level in levels}
    logs = {level: math.log10(level) for level in levels if level > 0}
    step = (max(logs.values()) - min(logs.values())) / max(1, len(logs) - 1) if len(logs) > 1 else 0.3
    return {level: logs.get(level, min(logs.values(), default=0.0) - step) for level in levels}  # 0: left of the least


def _frame(axes: Axes, found: LevelsFound, places: Mapping[Any, float], *, first: bool) -> None:
    """Draw the axes: levels below, shares, points or numbers at the left."""
    axes.set_xlim(*_limits(found, places))
    shown = _shown_levels(found, places)
    axes.set_xticks(
        list(shown.values()), [level.replace("_", " ") if isinstance(level, str) else f"{level:.3g}" for level in shown]
    )
    ticks = _ticks(found)
    low, high = ticks[0][0], ticks[-1][0]
    axes.set_ylim(low - 0.04 * (high - low), high + 0.04 * (high - low))
    axes.set_yticks([at for at, _ in ticks], [words if first else "" for _, words in ticks])
    axes.hlines([at for at, _ in ticks], *axes.get_xlim(), color=style.GRID, linewidth=0.6, zorder=0)
    if found.guess_rate is not None:
        axes.axhline(found.guess_rate, color=style.AXIS, linewidth=0.6, linestyle=(0, (4, 3)), zorder=1)


def _limits(found: LevelsFound, places: Mapping[Any, float]) -> tuple[float, float]:
    """Return the ends of the horizontal axis."""
    low, high = min(places.values()), max(places.values())
    margin = 0.5 if found.vary is None else 0.06 * ((high - low) or 1.0)
    return low - margin, high + margin


def _shown_levels(found: LevelsFound, places: Mapping[Any, float]) -> Mapping[Any, float]:
    """Return the levels that are named below the axis, with their places: of many on log spacing, round ones."""
    named = sorted(places, key=lambda level: places[level])
    if found.vary is None or len(named) <= MOST_TICKS:
        return {level: places[level] for level in named}
    if found.spacing == "log":
        low, high = places[named[0]], places[named[-1]]
        decades = range(math.floor(low), math.ceil(high) + 1)
        round_levels = [digit * 10.0**decade for decade in decades for digit in (1, 2, 5)]
        inside = {level: math.log10(level) for level in round_levels if low <= math.log10(level) <= high}
        if len(inside) >= FEWEST_TICKS:
            return inside
    return {level: places[level] for level in named[:: math.ceil(len(named) / MOST_TICKS)]}


def _ticks(found: LevelsFound) -> list[tuple[float, str]]:
    if found.summary == "share":
        return [(share, f"{100 * share:.0f} %") for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
    ends = [end for one in found.answers for end in (one.value, one.low, one.high) if end is not None]
    if found.summary == "mean":
        low, high = found.bounds or (min(ends), max(ends))
        return [(float(point), str(point)) for point in range(math.floor(low), math.ceil(high) + 1)]
    decades = range(math.floor(math.log10(min(ends))), math.ceil(math.log10(max(ends))) + 1)
    known = [(math.log10(step) + decade, f"{step * 10.0**decade:g}") for decade in decades for step in (1, 2, 5)]
    least = max((at for at, _ in known if at <= math.log10(min(ends))), default=known[0][0])
    most = min((at for at, _ in known if at >= math.log10(max(ends))), default=known[-1][0])
    inside = [one for one in known if least <= one[0] <= most]
    return inside if len(inside) <= 2 * MOST_TICKS else [one for one in inside if one[0] == math.floor(one[0])]
