"""The figures of blocks of levels: answers over levels, tracks, settings and Weber fractions."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache, partial
from typing import Any, Final, TypeAlias, cast

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from study_app import figure_style as style
from study_app.analysis.data.blocks import published_text
from study_app.analysis.data.study_tables import Study
from study_app.analysis.figures.people_figures import scale_ticks
from study_app.analysis.levels.answers import (
    Answers,
    LevelAnswers,
    SettingEstimate,
    Settings,
    mean_text,
    people,
    summary_text,
)
from study_app.analysis.levels.statistic import level_text, with_unit
from study_app.analysis.levels.thresholds import (
    Flags,
    ThresholdEstimate,
    Thresholds,
    TrackCourse,
    percent_compared,
    psychometric_bands,
    track_courses,
)
from study_app.analysis.levels.tracks import tracks
from study_app.analysis.page_layout import MARGIN_PT, SMALL, FigureTask, Look, Picture, Sheet, picture_of, sample_text
from study_app.analysis.results import LevelsResult
from study_app.analysis.statistics.outcome import Array
from study_app.analysis.wording import counted
from study_app.number_text import capitalised
from study_app.psychophysics.families import Family, success

COLUMNS: Final = 4
_PANEL_PT: Final = 84.0
_LEFT_PT: Final = 40.0
_GAP_PT: Final = 16.0
_HEAD_PT: Final = 42.0
_ROW_GAP_PT: Final = 36.0


def panels(
    look: Look,
    above: str,
    names: Sequence[tuple[str, str]],
    draw: Callable[[Axes, int, bool], None],
    below: str,
    *,
    keys: Sequence[tuple[str, str]] = (),
    foot_pt: float = 28.0,
) -> Sheet:
    """Draw one panel for each of ``names``, which are pairs of a bold and a soft text above the panel.

    ``above`` and ``below`` are axis titles; ``keys`` are legend texts with their colours. ``draw`` is called with the
    axes, the panel's index, and whether it is the first of its row.
    """
    rows = math.ceil(len(names) / COLUMNS)
    sheet = look.sheet(_HEAD_PT + rows * _PANEL_PT + (rows - 1) * _ROW_GAP_PT + foot_pt + 14)
    sheet.text(MARGIN_PT, 28, above, size=SMALL, colour=style.TEXT_SOFT)
    x = sheet.width_pt - MARGIN_PT
    for words, colour in reversed(keys):
        x -= sheet.text_width(words, SMALL)
        sheet.text(x, 28, words, size=SMALL, colour=colour)
        x -= 10
    width = (sheet.width_pt - _LEFT_PT - MARGIN_PT - (COLUMNS - 1) * _GAP_PT) / COLUMNS
    for place, (name, words) in enumerate(names):
        row, column = divmod(place, COLUMNS)
        x, y = _LEFT_PT + column * (width + _GAP_PT), _HEAD_PT + row * (_PANEL_PT + _ROW_GAP_PT)
        sheet.text(x, y - 4, name, size=SMALL, weight="bold")
        if words:
            offset = sheet.text_width(name, SMALL, "bold") + 6
            sheet.text(x + offset, y - 4, words, size=SMALL, colour=style.TEXT_SOFT)
        axes = sheet.axes(x, y, width, _PANEL_PT)
        draw(axes, place, column == 0)
        for label in (*axes.get_xticklabels(), *axes.get_yticklabels()):
            label.set_fontproperties(sheet.font(SMALL))
    sheet.text(_LEFT_PT, sheet.height_pt - 10, below, size=SMALL, colour=style.TEXT_SOFT)
    return sheet


def _axis_limits(
    result: LevelsResult, levels: Iterable[float], share: float, least: float, linear: float
) -> tuple[float, float]:
    """Return the limits of an axis of levels.

    The margin on a logarithmic axis is ``share`` of the span in decades, but at least the factor ``least``; that on a
    linear axis is ``linear`` of the span.
    """
    drawable = [level for level in levels if level > 0 or result.spacing != "log"]
    low, high = float(min(drawable)), float(max(drawable))
    if result.spacing == "log":
        factor = max((high / low) ** share, least)
        return low / factor, high * factor
    margin = linear * ((high - low) or 1.0)
    return low - margin, high + margin


def _set_trial_axes(axes: Axes, result: LevelsResult, trials: int, ends: tuple[float, float], *, first: bool) -> None:
    """Set the ticks of the trials, from 1, and of the levels between ``ends``."""
    axes.set_xticks([1, *(place for place in (round(trials / 2), trials) if place > 1)])
    if result.spacing == "log":
        axes.set_yscale("log")
        axes.minorticks_off()
    axes.set_ylim(*ends)
    ticks = _level_ticks(result, ends)
    axes.set_yticks(ticks, [f"{tick:g}" if first else "" for tick in ticks])
    axes.hlines(ticks, *axes.get_xlim(), color=style.GRID, linewidth=0.6, zorder=0)


def _level_ticks(result: LevelsResult, ends: tuple[float, float]) -> list[float]:
    """Return round levels (1, 2, 5 per decade, or linear) between the ends of an axis."""
    low, high = ends
    if result.spacing == "linear":
        step = 10.0 ** math.floor(math.log10(high - low))
        step *= next(times for times in (0.1, 0.2, 0.5, 1.0, 2.0) if (high - low) / (step * times) <= 6)
        return [float(f"{number * step:.12g}") for number in range(math.ceil(low / step), math.floor(high / step) + 1)]
    return scale_ticks(low, high, log=True)


_TracksFunction: TypeAlias = Callable[[], pd.DataFrame]
"""A function that returns the tracks of a study and caches them."""

_MOST_PEOPLE: Final = 23
"""The most participants with a panel; the others appear only in the first panel and in the table."""
_FOOT_PT: Final = 26.0
_MOST_TICKS: Final = 5
_FEWEST_TICKS: Final = 2
_SIZE_PT2: Final = 2.0
"""Area of a circle for each answer at a level."""
_ASIDE: Final = 0.025
"""Distance between the points of consecutive standards, as a proportion of the axis."""
_BELOW: Final = 0.03
"""Distance by which the interval of each standard's threshold is drawn below the previous one (proportion correct)."""
_COLOURS: Final = (style.ACCENT, style.SECOND, style.TEXT, "#6d1007", "#5d8aa8", "#b75a26", "#02256d", style.AXIS)


def _level_picture(
    study: Study, result: LevelsResult, forms: Sequence[str], name: str, study_tracks: _TracksFunction
) -> Picture:
    """Draw the answers of a block against level."""
    bands = _psychometric_bands(study, result, study_tracks)
    further = len(people(result)) - _MOST_PEOPLE
    verb = "is" if further == 1 else "are"
    number = capitalised(counted(further, "further participant"))
    left_out = f" {number} {verb} shown only in the table." if further > 0 else ""
    chance = "" if result.guess_rate is None else f" Dashed line: chance ({100 * result.guess_rate:.0f} %)."
    where = "for each comparison" if result.vary is None else "at each level"
    caption = (
        f"{result.title}: {summary_text(result)} {where}. {_panels_caption(result, bool(bands))}{chance}{left_out} "
        f"{sample_text(study, len(people(result)))}"
    )
    return picture_of(study, result.block, name, result.title, caption, partial(_draw_levels, result, bands), forms)


def _psychometric_bands(study: Study, result: LevelsResult, study_tracks: _TracksFunction) -> Mapping[str, Array]:
    """Return the bands of the participants' psychometric functions; none if there are several standards."""
    if not Thresholds.participant_rows(result) or len(_standards(result)) > 1:
        return {}
    block = next(block for block in study.levels if block.id == result.block)
    return psychometric_bands(
        block, study_tracks(), people(result)[:_MOST_PEOPLE], _position_limits(result, _level_positions(result))
    )


def _panels_caption(result: LevelsResult, banded: bool) -> str:
    band = " and 95 % bands" if banded else ""
    crosses = "; crosses: catch trials" if any(answer.catch for answer in Answers.rows_in(result)) else ""
    if Thresholds.participant_rows(result):
        return (
            f"Curves: psychometric functions with posterior median parameters{band}; bars: 95 % intervals for the "
            "thresholds (stacked if there are several standards); circles: answers at each level (area proportional "
            f"to the number of answers){crosses}. First panel: all participants."
        )
    units = " after removing differences between participants' units" if result.own_units else ""
    own = "thin lines" if len(_level_positions(result)) > 1 else "small points"
    return (
        f"First panel: {mean_text(result)} across participants with its 95 % interval (Student's t); {own} show "
        f"individual participants{units}. Other panels: one participant each, with 95 % intervals for the "
        f"answers{crosses}."
    )


@style.own_settings()
def _draw_levels(result: LevelsResult, bands: Mapping[str, Array], look: Look) -> Sheet:
    shown_people = people(result)[:_MOST_PEOPLE]
    words = summary_text(result)
    above = words[:1].upper() + words[1:]
    standards = _standards(result)
    keys = [
        (f"standard {with_unit(result, standard)}", colour)
        for standard, colour in zip(standards, _COLOURS, strict=False)
    ]

    def draw(axes: Axes, place: int, first: bool) -> None:
        person = shown_people[place - 1] if place else None
        _draw_levels_panel(axes, result, person, first=first)
        if person is not None and person in bands:
            u, lower, upper = bands[person]
            axes.fill_between(u, lower, upper, color=style.BAND, linewidth=0, zorder=1)

    names = [(name, "") for name in ("All", *shown_people)]
    shown = keys if len(standards) > 1 else ()
    return panels(look, above, names, draw, level_text(result), keys=shown, foot_pt=_FOOT_PT)


def _standards(result: LevelsResult) -> list[float]:
    return sorted({answer.standard for answer in Answers.rows_in(result) if answer.standard is not None})


def _draw_levels_panel(axes: Axes, result: LevelsResult, person: str | None, *, first: bool) -> None:
    places = _level_positions(result)
    _draw_levels_frame(axes, result, places, first=first)
    groups: Sequence[float | None] = _standards(result) or [None]
    for number, (standard, colour) in enumerate(zip(groups, _COLOURS, strict=False)):
        for threshold in Thresholds.participant_rows(result):
            if threshold.standard == standard and person in {None, threshold.participant}:
                grey = person is None and len(groups) == 1
                _draw_curve(axes, result, threshold, style.PARTICIPANT if grey else colour)
                if person is not None:
                    _draw_threshold_interval(axes, result, threshold, colour, number)
        if person is None and result.adaptive:
            continue
        span = 0.0 if Thresholds.participant_rows(result) else max(places.values()) - min(places.values())
        aside = _ASIDE * (number - (len(groups) - 1) / 2) * span
        level_answers = [
            answer for answer in Answers.rows_in(result) if answer.standard == standard and not answer.catch
        ]
        if person is None and len(groups) == 1 and not Thresholds.participant_rows(result):
            for participant in people(result):
                _draw_person_line(axes, level_answers, participant, places, result)
        positions = {level: place + aside for level, place in places.items()}
        _draw_answer_points(
            axes, [answer for answer in level_answers if answer.participant == person], positions, result, colour
        )
        catch_answers = [
            answer
            for answer in Answers.rows_in(result)
            if answer.standard == standard and answer.catch and answer.participant == person
        ]
        heights = [_vertical_position(result, answer.value) for answer in catch_answers]
        axes.plot(
            [positions[_level_or_comparison(answer)] for answer in catch_answers],
            heights,
            "x",
            color=colour,
            markersize=4,
            zorder=4,
        )


def _draw_person_line(
    axes: Axes, shown: Sequence[LevelAnswers], person: str, places: Mapping[Any, float], result: LevelsResult
) -> None:
    """Draw a participant's answers; magnitude estimates are divided by the participant's unit."""
    points = [answers for answers in shown if answers.participant == person]
    heights = np.array([_vertical_position(result, point.value) for point in points])
    if result.own_units and points:
        heights += (
            np.mean([_vertical_position(result, answers.value) for answers in shown if answers.participant is None])
            - heights.mean()
        )
    xs, marker = [places[_level_or_comparison(point)] for point in points], "" if len(places) > 1 else "."
    axes.plot(xs, heights, marker=marker, markersize=4, color=style.PARTICIPANT, linewidth=0.5, alpha=0.7)


def _draw_curve(axes: Axes, result: LevelsResult, estimate: ThresholdEstimate, colour: str) -> None:
    low, high = axes.get_xlim()
    u = np.linspace(low, high, 120)
    middle = _coordinate(result, estimate.threshold)
    shape = cast("Family", result.family)
    psi = success(shape, u, middle, estimate.width or 1.0, estimate.guess or 0.0, estimate.lapse or 0.0)
    axes.plot(u, psi, color=colour, linewidth=0.9, zorder=2)


def _draw_threshold_interval(
    axes: Axes, result: LevelsResult, estimate: ThresholdEstimate, colour: str, number: int
) -> None:
    """Draw the interval of a threshold at the height of the function there, with an offset for each standard."""
    if estimate.low is None or estimate.high is None:
        return
    guess = estimate.guess or 0.0
    height = guess + (1.0 - guess - (estimate.lapse or 0.0)) / 2 - _BELOW * number
    ends = [_coordinate(result, estimate.low), _coordinate(result, estimate.high)]
    axes.plot(ends, [height, height], color=colour, linewidth=1.2, solid_capstyle="butt", zorder=2)


def _coordinate(result: LevelsResult, level: float) -> float:
    return math.log10(level) if result.spacing == "log" else level


def _draw_answer_points(
    axes: Axes, points: Sequence[LevelAnswers], places: Mapping[Any, float], result: LevelsResult, colour: str
) -> None:
    xs, ys = (
        [places[_level_or_comparison(point)] for point in points],
        [_vertical_position(result, point.value) for point in points],
    )
    if Thresholds.participant_rows(result):
        sizes = [_SIZE_PT2 * point.n for point in points]
        axes.scatter(xs, ys, s=sizes, facecolors="none", edgecolors=colour, linewidths=0.7, zorder=3, clip_on=False)
        return
    joined = "none" if result.vary is None else "-"
    axes.plot(xs, ys, marker="o", markersize=3, color=colour, linewidth=0.9, linestyle=joined)
    for x, point in zip(xs, points, strict=True):
        if point.low is not None and point.high is not None:
            axes.plot(
                [x, x],
                [_vertical_position(result, point.low), _vertical_position(result, point.high)],
                color=colour,
                linewidth=0.9,
            )


def _level_or_comparison(answers: LevelAnswers) -> Any:
    return answers.comparison if answers.level is None else answers.level


def _vertical_position(result: LevelsResult, value: float) -> float:
    return math.log10(value) if result.summary == "geometric mean" else value


def _level_positions(result: LevelsResult) -> dict[Any, float]:
    """Return the horizontal position of each level, logarithmic if levels are spaced logarithmically."""
    levels = list(
        dict.fromkeys(_level_or_comparison(answer) for answer in Answers.rows_in(result) if answer.participant is None)
    )
    if result.vary is None:
        return {level: float(place) for place, level in enumerate(levels)}
    if result.spacing == "linear":
        return {level: float(level) for level in levels}
    logs = {level: math.log10(level) for level in levels if level > 0}
    step = (max(logs.values()) - min(logs.values())) / max(1, len(logs) - 1) if len(logs) > 1 else 0.3
    return {
        level: logs.get(level, min(logs.values(), default=0.0) - step) for level in levels
    }  # level 0 is left of the lowest


def _draw_levels_frame(axes: Axes, result: LevelsResult, places: Mapping[Any, float], *, first: bool) -> None:
    """Draw the axes: levels below, and proportions, points or numbers at the left."""
    axes.set_xlim(*_position_limits(result, places))
    shown = _labelled_levels(result, places)
    axes.set_xticks(
        list(shown.values()), [level.replace("_", " ") if isinstance(level, str) else f"{level:.3g}" for level in shown]
    )
    ticks = _value_ticks(result)
    low, high = ticks[0][0], ticks[-1][0]
    axes.set_ylim(low - 0.04 * (high - low), high + 0.04 * (high - low))
    axes.set_yticks([at for at, _ in ticks], [words if first else "" for _, words in ticks])
    axes.hlines([at for at, _ in ticks], *axes.get_xlim(), color=style.GRID, linewidth=0.6, zorder=0)
    if result.guess_rate is not None:
        axes.axhline(result.guess_rate, color=style.AXIS, linewidth=0.6, linestyle=(0, (4, 3)), zorder=1)


def _position_limits(result: LevelsResult, places: Mapping[Any, float]) -> tuple[float, float]:
    low, high = min(places.values()), max(places.values())
    margin = 0.5 if result.vary is None else 0.06 * ((high - low) or 1.0)
    return low - margin, high + margin


def _labelled_levels(result: LevelsResult, places: Mapping[Any, float]) -> Mapping[Any, float]:
    """Return the levels with labels on the axis and their positions; round levels if many are logarithmic."""
    levels = sorted(places, key=lambda level: places[level])
    if result.vary is None or len(levels) <= _MOST_TICKS:
        return {level: places[level] for level in levels}
    if result.spacing == "log":
        low, high = places[levels[0]], places[levels[-1]]
        decades = range(math.floor(low), math.ceil(high) + 1)
        round_levels = [digit * 10.0**decade for decade in decades for digit in (1, 2, 5)]
        inside = {level: math.log10(level) for level in round_levels if low <= math.log10(level) <= high}
        if len(inside) >= _FEWEST_TICKS:
            return inside
    return {level: places[level] for level in levels[:: math.ceil(len(levels) / _MOST_TICKS)]}


def _value_ticks(result: LevelsResult) -> list[tuple[float, str]]:
    if result.summary == "share":
        return [(proportion, f"{100 * proportion:.0f} %") for proportion in (0.0, 0.25, 0.5, 0.75, 1.0)]
    ends = [
        end for answer in Answers.rows_in(result) for end in (answer.value, answer.low, answer.high) if end is not None
    ]
    if result.summary == "mean":
        low, high = result.bounds or (min(ends), max(ends))
        return [(float(point), str(point)) for point in range(math.floor(low), math.ceil(high) + 1)]
    decades = range(math.floor(math.log10(min(ends))), math.ceil(math.log10(max(ends))) + 1)
    known = [(math.log10(step) + decade, f"{step * 10.0**decade:g}") for decade in decades for step in (1, 2, 5)]
    minimum = max((at for at, _ in known if at <= math.log10(min(ends))), default=known[0][0])
    maximum = min((at for at, _ in known if at >= math.log10(max(ends))), default=known[-1][0])
    inside = [tick for tick in known if minimum <= tick[0] <= maximum]
    return inside if len(inside) <= 2 * _MOST_TICKS else [tick for tick in inside if tick[0] == math.floor(tick[0])]


_MOST_PANELS: Final = 24
_MARK_PT2: Final = 7.0
_RING_PT2: Final = 26.0
_CROSS_PT2: Final = 11.0
"""Areas of the marks of answers, reversals and catch trials [pt²]."""


def _track_picture(
    study: Study, result: LevelsResult, forms: Sequence[str], name: str, study_tracks: _TracksFunction
) -> Picture:
    """Draw the adaptive tracks of a block, once the key is open."""
    block = next(block for block in study.levels if block.id == result.block)
    courses = list(track_courses(block, study_tracks(), _MOST_PANELS))
    left_out = _panels_left_out(len(Thresholds.participant_rows(result)) - len(courses))
    success = "correctly" if result.counts == "correct" else f"“{result.counts}”"
    marks = " Colours: tracks." if any(course.tracks.max() > 1 for course in courses) else ""
    marks += " Rings: reversals." if any(course.reversals.any() for course in courses) else ""
    if any(course.catches.any() for course in courses):
        marks += " ×: catch trial answered correctly; +: catch trial answered incorrectly."
    caption = (
        f"{result.title}: the level of each trial. Filled: answered {success}; hollow: other answers.{marks} Band: 95 "
        f"% interval for the threshold, given the answers up to that trial.{left_out} "
        f"{sample_text(study, len(people(result)))}"
    )
    return picture_of(
        study, result.block, name, f"{result.title}: tracks", caption, partial(_draw_tracks, result, courses), forms
    )


def _panels_left_out(further: int) -> str:
    """Return a sentence on the panels that are not shown, with a leading space; "" without any."""
    verb = "is" if further == 1 else "are"
    return f" {capitalised(counted(further, 'further panel'))} {verb} not shown." if further > 0 else ""


@style.own_settings()
def _draw_tracks(result: LevelsResult, courses: Sequence[TrackCourse], look: Look) -> Sheet:
    standards = len({course.standard for course in courses}) > 1
    names = [(course.participant, f"standard {course.standard:g}" if standards else "") for course in courses]
    ends = _axis_limits(
        result,
        (level for course in courses for level in (*course.levels, course.low[-1], course.high[-1])),
        0.12,
        1.1,
        0.06,
    )

    def draw(axes: Axes, place: int, first: bool) -> None:
        n = len(courses[place].levels)
        axes.set_xlim(0.5 - 0.02 * n, n + 0.5 + 0.02 * n)
        _set_trial_axes(axes, result, n, ends, first=first)
        _draw_track_panel(axes, courses[place])

    below = "Trial number at this standard" if standards else "Trial number"
    return panels(look, level_text(result), names, draw, below)


def _draw_track_panel(axes: Axes, course: TrackCourse) -> None:
    """Draw the interval, a line for each track, and a mark for each answer; levels of zero are at the lower edge."""
    trials = np.arange(1.0, len(course.levels) + 1)
    low, high = axes.get_ylim()
    axes.fill_between(
        trials, np.clip(course.low, low, high), np.clip(course.high, low, high), color=style.BAND, linewidth=0, zorder=1
    )
    levels = np.maximum(course.levels, low)
    for track, colour in zip(sorted(set(course.tracks.tolist())), _COLOURS, strict=False):
        of_track = course.tracks == track
        track_trials = of_track & ~course.catches
        chosen = track_trials & ~course.noises
        axes.plot(trials[chosen], levels[chosen], color=colour, linewidth=0.6)
        _draw_marks(axes, trials, levels, track_trials & course.successes, colour, colour)
        _draw_marks(axes, trials, levels, track_trials & ~course.successes, "white", colour)
        _draw_marks(axes, trials, levels, track_trials & course.reversals, "none", colour, _RING_PT2)
        for marker, answered in (("x", course.successes), ("+", ~course.successes)):
            selected = of_track & course.catches & answered
            axes.scatter(
                trials[selected],
                levels[selected],
                s=_CROSS_PT2,
                marker=marker,
                color=colour,
                linewidths=0.8,
                clip_on=False,
            )


def _draw_marks(
    axes: Axes, trials: Array, levels: Array, which: Flags, face: str, edge: str, size: float = _MARK_PT2
) -> None:
    """Draw the circles selected by ``which``, not clipped at the edges."""
    axes.scatter(
        trials[which], levels[which], s=size, facecolors=face, edgecolors=edge, linewidths=0.6, zorder=4, clip_on=False
    )


def _settings_picture(
    study: Study, result: LevelsResult, forms: Sequence[str], name: str, _study_tracks: _TracksFunction
) -> Picture:
    """Draw the settings of an adjustment block, once the key is open."""
    left_out = _panels_left_out(len(Settings.participant_rows(result)) - _MOST_PANELS)
    standard = " Dashed line: standard." if Settings.matches_standard(result) else ""
    caption = (
        f"{result.title}: the levels set by participants, in trial order. Filled: started high; hollow: started low. "
        f"Line and band: {Settings.measure_name(result)} with its 95 % interval (Student's t).{standard}{left_out} "
        f"{sample_text(study, len(people(result)))}"
    )
    return picture_of(
        study, result.block, name, f"{result.title}: settings", caption, partial(_draw_settings, result), forms
    )


@style.own_settings()
def _draw_settings(result: LevelsResult, look: Look) -> Sheet:
    estimates = Settings.participant_rows(result)[:_MOST_PANELS]
    standards = len({estimate.standard for estimate in estimates}) > 1
    names = [
        (
            str(estimate.participant),
            f"standard {with_unit(result, estimate.standard)}" if standards and estimate.standard is not None else "",
        )
        for estimate in estimates
    ]
    levels = (
        level
        for estimate in estimates
        for level in (*estimate.levels, estimate.low, estimate.high, _standard_level(estimate))
        if level is not None
    )
    ends = _axis_limits(result, levels, 0.08, 1.05, 0.08)

    def draw(axes: Axes, place: int, first: bool) -> None:
        axes.set_xlim(0.4, estimates[place].n + 0.6)
        _set_trial_axes(axes, result, estimates[place].n, ends, first=first)
        _draw_settings_panel(axes, estimates[place])

    return panels(look, level_text(result), names, draw, "Setting")


def _standard_level(estimate: SettingEstimate) -> float | None:
    """Return the standard as a level; None if no standard was presented."""
    return estimate.standard if estimate.constant_error is not None else None


def _draw_settings_panel(axes: Axes, estimate: SettingEstimate) -> None:
    """Draw the PSE with its interval, the standard, and a circle for each setting."""
    if estimate.low is not None and estimate.high is not None:
        axes.axhspan(estimate.low, estimate.high, color=style.BAND, linewidth=0, zorder=1)
    axes.axhline(estimate.pse, color=style.ACCENT, linewidth=1.0, zorder=2)
    if (standard := _standard_level(estimate)) is not None:
        axes.axhline(standard, color=style.AXIS, linewidth=0.8, linestyle=(0, (4, 3)), zorder=2)
    places, levels = np.arange(1.0, estimate.n + 1), np.array(estimate.levels)
    high = np.array(estimate.started_high, dtype=bool)
    for which, face in ((high, style.ACCENT), (~high, "white")):
        _draw_marks(axes, places, levels, which, face, style.ACCENT)


_WEBER_LEFT_PT: Final = 34.0
_RIGHT_PT: Final = 10.0
_TOP_PT: Final = 40.0
_WEBER_FOOT_PT: Final = 32.0
_HEIGHT_PT: Final = 190.0
_FRACTIONS: Final = tuple(digit * 10.0**decade for decade in range(-4, 4) for digit in (1, 2, 5))
Point = tuple[float, float, float | None, float | None]
"""Standard, Weber fraction, and the ends of its interval."""


def _weber_fractions(result: LevelsResult, participant: str | None) -> list[Point]:
    """Return the Weber fractions by standard of a participant, or of the group if None.

    Thresholds that are differences are divided by their standards. Standards of zero and levels that are values have no
    Weber fraction. If the percentage correct of the published values is known, the level at that percentage replaces
    the threshold.
    """
    if result.level_kind not in {"weber", "difference"}:
        return []
    points, at_threshold = [], percent_compared(result) is None
    for threshold in Thresholds.rows_in(result):
        shown = (threshold.threshold, threshold.low, threshold.high)
        level, *ends = shown if at_threshold else (threshold.compared, threshold.compared_low, threshold.compared_high)
        if (
            threshold.participant != participant
            or threshold.standard is None
            or threshold.standard <= 0
            or level is None
            or level <= 0
        ):
            continue
        unit = threshold.standard if result.level_kind == "difference" else 1.0
        low, high = (None if end is None or end <= 0 else end / unit for end in ends)
        points.append((threshold.standard, level / unit, low, high))
    return points


def _percentage_phrase(result: LevelsResult) -> str:
    """Return a phrase on the percentage correct at which Weber fractions are shown."""
    percent = percent_compared(result)
    if percent is None and result.guess_rate is not None:
        percent = 50 * (1 + result.guess_rate)
    return "" if percent is None else f" at {percent:.3g} % {result.counts}"


def _weber_picture(
    study: Study, result: LevelsResult, forms: Sequence[str], name: str, _study_tracks: _TracksFunction
) -> Picture:
    """Draw the Weber fractions of a block with thresholds at two or more standards."""
    values = "; ".join(published_text(published, result.unit) for published in result.published)
    published = f" Open circles and dotted lines: published values, {values}." if _published_fractions(result) else ""
    caption = (
        f"{result.title}: Weber fraction for {result.quantity}{_percentage_phrase(result)}, as a function of the "
        f"standard. Thin lines: participants; thick line: random-effects mean with its 95 % interval.{published} "
        f"{sample_text(study, len(people(result)))}"
    )
    return picture_of(
        study,
        result.block,
        name,
        result.title,
        caption,
        partial(_draw_fractions, result),
        forms,
        (counted(study.n, "participant"), f"n = {study.n}"),
    )


@style.own_settings()
def _draw_fractions(result: LevelsResult, look: Look) -> Sheet:
    sheet = look.sheet(_HEIGHT_PT, style.PAGE_WIDTH_PT / 2)
    sheet.text(MARGIN_PT, 28, f"Weber fraction{_percentage_phrase(result)}", size=SMALL, colour=style.TEXT_SOFT)
    axes = sheet.axes(
        _WEBER_LEFT_PT, _TOP_PT, sheet.width_pt - _WEBER_LEFT_PT - _RIGHT_PT, sheet.height_pt - _TOP_PT - _WEBER_FOOT_PT
    )
    group = _weber_fractions(result, None)
    by_person = [_weber_fractions(result, person) for person in people(result)]
    published = _published_fractions(result)
    _draw_fractions_frame(axes, group, by_person, published)
    _draw_published(axes, published, sheet)
    for points in by_person:
        axes.plot(
            [point[0] for point in points],
            [point[1] for point in points],
            color=style.PARTICIPANT,
            linewidth=0.5,
            alpha=0.7,
        )
    xs = [point[0] for point in group]
    axes.plot(
        xs, [point[1] for point in group], marker="o", markersize=3.5, color=style.ACCENT, linewidth=1.2, zorder=3
    )
    for x, _, low, high in group:
        if low is not None and high is not None:
            axes.plot([x, x], [low, high], color=style.ACCENT, linewidth=1.2, zorder=3)
    for label in (*axes.get_xticklabels(), *axes.get_yticklabels()):
        label.set_fontproperties(sheet.font(SMALL))
    below = f"Standard for {result.quantity}" + (f" [{result.unit}]" if result.unit else "")
    sheet.text(_WEBER_LEFT_PT, sheet.height_pt - 8, below, size=SMALL, colour=style.TEXT_SOFT)
    return sheet


def _published_fractions(result: LevelsResult) -> list[tuple[float | None, float]]:
    """Return the standards and values of published Weber fractions; None means all standards."""
    points = []
    for published in result.published:
        if published.measure == "weber":
            points.append((published.standard, published.value))
        elif published.measure == "threshold" and result.level_kind == "difference" and published.standard:
            points.append((published.standard, published.value / published.standard))
    return points


def _draw_published(axes: Axes, points: Sequence[tuple[float | None, float]], sheet: Sheet) -> None:
    """Draw published values: a circle at the standard, or a labelled dotted line across all standards."""
    over_all = [f"{fraction:g}" for standard, fraction in points if standard is None]
    if over_all:
        words = f"dotted: published {', '.join(over_all)}"
        x = sheet.width_pt - MARGIN_PT - sheet.text_width(words, SMALL)
        sheet.text(x, 28, words, size=SMALL, colour=style.TEXT_SOFT)
    for standard, fraction in points:
        if standard is None:
            axes.axhline(fraction, color=style.TEXT_SOFT, linewidth=1.0, linestyle=":", zorder=2)
        else:
            axes.plot([standard], [fraction], "o", markersize=5, fillstyle="none", color=style.TEXT_SOFT, zorder=4)


def _draw_fractions_frame(
    axes: Axes,
    group: Sequence[Point],
    by_person: Sequence[Sequence[Point]],
    published: Sequence[tuple[float | None, float]],
) -> None:
    """Draw logarithmic axes with the standards as horizontal and round fractions as vertical ticks."""
    values = [value for points in by_person for _, value, _, _ in points]
    values += [value for point in group for value in point[1:] if value is not None]
    values += [value for _, value in published]
    low = max((tick for tick in _FRACTIONS if tick <= min(values)), default=min(values))
    high = min((tick for tick in _FRACTIONS if tick >= max(values)), default=max(values))
    standards = [point[0] for point in group]
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.minorticks_off()
    margin = (standards[-1] / standards[0]) ** 0.08
    axes.set_xlim(standards[0] / margin, standards[-1] * margin)
    axes.set_ylim(low, high)
    axes.set_xticks(standards, [f"{standard:g}" for standard in standards])
    ticks = [tick for tick in _FRACTIONS if low <= tick <= high]
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.hlines(ticks, *axes.get_xlim(), color=style.GRID, linewidth=0.6, zorder=0)


_Draw: TypeAlias = Callable[[Study, LevelsResult, Sequence[str], str, _TracksFunction], Picture]

_FIGURES: Final[tuple[tuple[str, Callable[[LevelsResult], object], _Draw], ...]] = (
    ("levels", Answers.rows_in, _level_picture),
    ("tracks", lambda result: result.adaptive and Thresholds.participant_rows(result), _track_picture),
    ("weber", lambda result: len(_weber_fractions(result, None)) >= 2, _weber_picture),
    ("settings", Settings.participant_rows, _settings_picture),
)
"""For each figure: its name, the condition on a block, and the function that draws it."""


def level_figure_tasks(
    study: Study, levels: Sequence[LevelsResult], forms: Sequence[str] = style.FORMATS
) -> Iterator[FigureTask]:
    """Yield all figures of all blocks of levels, to draw in each of ``forms``."""
    study_tracks = cache(partial(tracks, study))
    for kind, applies, draw in _FIGURES:
        for level in levels:
            if applies(level):
                name = f"{kind}-{level.block}"
                yield level.block, name, partial(draw, study, level, forms, name, study_tracks)
