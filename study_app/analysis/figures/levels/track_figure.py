"""Tracks of adaptive methods: level over trial for each participant and standard, with the narrowing interval."""

from collections.abc import Sequence
from functools import partial
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from study_app import figure_style as style
from study_app.analysis.designs.track_courses import Flags, TrackCourse, courses
from study_app.analysis.figures.levels.level_figure import COLOURS, level_words
from study_app.analysis.figures.levels.panels import draw_panels, over_trials, sheet_of_panels
from study_app.analysis.figures.page_layout import Sheet
from study_app.analysis.figures.picture import Picture, files_of, sample_words
from study_app.analysis.results.level_results import LevelsFound
from study_app.analysis.results.words import counted
from study_app.analysis.statistics.outcome import Array
from study_app.analysis.tables.study_tables import Study
from study_app.analysis.tables.tracks import tracks

MOST_PANELS: Final = 24
MARK_PT2: Final = 7.0
RING_PT2: Final = 26.0
CROSS_PT2: Final = 11.0
"""Areas of the marks of answers, reversals and catch trials."""


def picture(study: Study, found: LevelsFound, forms: Sequence[str], name: str) -> Picture:
    """Draw the tracks of a block whose levels answers chose, once the key is open."""
    block = next(block for block in study.levels if block.id == found.block)
    shown = list(courses(block, tracks(study), MOST_PANELS))
    files = files_of(partial(_draw, study, found, shown), forms, f"{study.name}: {found.title}, tracks")
    rest = len(found.own_thresholds) - len(shown)
    left_out = f" {counted(rest, 'more panel')} not shown." if rest > 0 else ""
    success = "correct" if found.counts == "correct" else f"“{found.counts}”"
    marks = " Colours: tracks." if any(one.tracks.max() > 1 for one in shown) else ""
    marks += " Rings: reversals." if any(one.reversals.any() for one in shown) else ""
    marks += " × and +: catch trials, answered correctly and not." if any(one.catches.any() for one in shown) else ""
    caption = (
        f"{found.title}: the level of each trial. Filled: {success}; hollow: not.{marks} Band: 95 % interval of "
        f"the threshold from the answers so far.{left_out} {sample_words(study, len(found.people))}"
    )
    return Picture(found.block, name, caption, files)


@style.own_settings()
def _draw(study: Study, found: LevelsFound, shown: Sequence[TrackCourse], fonts: Sequence[str]) -> Sheet:
    sheet = sheet_of_panels(study, f"{found.title}: tracks", level_words(found), len(shown), fonts)
    standards = len({one.standard for one in shown}) > 1
    names = [(one.participant, f"standard {one.standard:g}" if standards else "") for one in shown]
    ends = _ends(found, shown)

    def draw(axes: Axes, place: int, first: bool) -> None:
        n = len(shown[place].levels)
        axes.set_xlim(0.5 - 0.02 * n, n + 0.5 + 0.02 * n)
        over_trials(axes, found, n, ends, first=first)
        _panel(axes, shown[place])

    return draw_panels(sheet, names, draw, "Trial at the standard" if standards else "Trial")


def _ends(found: LevelsFound, shown: Sequence[TrackCourse]) -> tuple[float, float]:
    """Return the ends of the axis: all levels and the last intervals, with a margin."""
    levels = np.concatenate([(*one.levels, one.low[-1], one.high[-1]) for one in shown])
    levels = levels[levels > 0] if found.spacing == "log" else levels
    low, high = float(levels.min()), float(levels.max())
    if found.spacing == "log":
        factor = max((high / low) ** 0.12, 1.1)
        return low / factor, high * factor
    margin = 0.06 * ((high - low) or 1.0)
    return low - margin, high + margin


def _panel(axes: Axes, course: TrackCourse) -> None:
    """Draw the interval, a line for each track, and a mark for each answer; levels of zero lie on the lower edge."""
    trials = np.arange(1.0, len(course.levels) + 1)
    low, high = axes.get_ylim()
    axes.fill_between(
        trials, np.clip(course.low, low, high), np.clip(course.high, low, high), color=style.BAND, linewidth=0, zorder=1
    )
    levels = np.maximum(course.levels, low)
    for track, colour in zip(sorted(set(course.tracks.tolist())), COLOURS, strict=False):
        of_track = course.tracks == track
        own = of_track & ~course.catches
        chosen = own & ~course.noises
        axes.plot(trials[chosen], levels[chosen], color=colour, linewidth=0.6)
        _marks(axes, trials, levels, own & course.successes, colour, colour)
        _marks(axes, trials, levels, own & ~course.successes, "white", colour)
        _marks(axes, trials, levels, own & course.reversals, "none", colour, RING_PT2)
        for marker, answered in (("x", course.successes), ("+", ~course.successes)):
            which = of_track & course.catches & answered
            axes.scatter(
                trials[which], levels[which], s=CROSS_PT2, marker=marker, color=colour, linewidths=0.8, clip_on=False
            )


def _marks(
    axes: Axes, trials: Array, levels: Array, which: Flags, face: str, edge: str, size: float = MARK_PT2
) -> None:
    """Draw circles; those at an edge are not cut off."""
    axes.scatter(
        trials[which], levels[which], s=size, facecolors=face, edgecolors=edge, linewidths=0.6, zorder=4, clip_on=False
    )
