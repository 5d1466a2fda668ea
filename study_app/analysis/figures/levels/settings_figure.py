"""Settings in their order for each participant and standard, with the point of subjective equality and the standard."""

from collections.abc import Sequence
from functools import partial
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from study_app import figure_style as style
from study_app.analysis.figures.levels.level_figure import level_words, with_unit
from study_app.analysis.figures.levels.panels import draw_panels, over_trials, sheet_of_panels
from study_app.analysis.figures.levels.track_figure import MARK_PT2, MOST_PANELS
from study_app.analysis.figures.page_layout import Sheet
from study_app.analysis.figures.picture import Picture, files_of, sample_words
from study_app.analysis.results.level_results import LevelsFound, SettingFound
from study_app.analysis.results.words import counted
from study_app.analysis.tables.study_tables import Study

MARGIN: Final = 0.08
"""Of the axis beyond the lowest and the highest setting, as a share of the span."""


def picture(study: Study, found: LevelsFound, forms: Sequence[str], name: str) -> Picture:
    """Draw the settings of a block whose levels participants set, once the key is open."""
    files = files_of(partial(_draw, study, found), forms, f"{study.name}: {found.title}, settings")
    rest = len(found.own_settings) - MOST_PANELS
    left_out = f" {counted(rest, 'more panel')} not shown." if rest > 0 else ""
    compared = any(one.constant_error is not None for one in found.own_settings)
    standard = " Dashed: standard." if compared else ""
    caption = (
        f"{found.title}: the levels that participants set, in their order. Filled: started high; hollow: started low. "
        f"Line and band: point of subjective equality with its 95 % interval (Student's t).{standard}{left_out} "
        f"{sample_words(study, len(found.people))}"
    )
    return Picture(found.block, name, caption, files)


@style.own_settings()
def _draw(study: Study, found: LevelsFound, fonts: Sequence[str]) -> Sheet:
    shown = found.own_settings[:MOST_PANELS]
    sheet = sheet_of_panels(study, f"{found.title}: settings", level_words(found), len(shown), fonts)
    standards = len({one.standard for one in shown}) > 1
    names = [
        (
            str(one.participant),
            f"standard {with_unit(found, one.standard)}" if standards and one.standard is not None else "",
        )
        for one in shown
    ]
    ends = _ends(found, shown)

    def draw(axes: Axes, place: int, first: bool) -> None:
        axes.set_xlim(0.4, shown[place].n + 0.6)
        over_trials(axes, found, shown[place].n, ends, first=first)
        _panel(axes, shown[place])

    return draw_panels(sheet, names, draw, "Setting")


def _compared(one: SettingFound) -> float | None:
    """Return the standard as a level that can be drawn among the settings; None where none was presented."""
    return one.standard if one.constant_error is not None else None


def _ends(found: LevelsFound, shown: Sequence[SettingFound]) -> tuple[float, float]:
    """Return the ends of the axis: all settings and standards, with a margin."""
    levels = [level for one in shown for level in (*one.levels, one.low, one.high, _compared(one)) if level is not None]
    if found.spacing == "log":
        low, high = min(level for level in levels if level > 0), max(levels)
        factor = max((high / low) ** MARGIN, 1.05)
        return low / factor, high * factor
    low, high = min(levels), max(levels)
    margin = MARGIN * ((high - low) or 1.0)
    return low - margin, high + margin


def _panel(axes: Axes, one: SettingFound) -> None:
    """Draw the PSE with its interval, the standard, and a circle for each setting."""
    if one.low is not None and one.high is not None:
        axes.axhspan(one.low, one.high, color=style.BAND, linewidth=0, zorder=1)
    axes.axhline(one.pse, color=style.ACCENT, linewidth=1.0, zorder=2)
    if (standard := _compared(one)) is not None:
        axes.axhline(standard, color=style.AXIS, linewidth=0.8, linestyle=(0, (4, 3)), zorder=2)
    places, levels = np.arange(1, one.n + 1), np.array(one.levels)
    high = np.array(one.started_high, dtype=bool)
    for which, face in ((high, style.ACCENT), (~high, "white")):
        axes.scatter(
            places[which],
            levels[which],
            s=MARK_PT2,
            facecolors=face,
            edgecolors=style.ACCENT,
            linewidths=0.6,
            zorder=4,
            clip_on=False,
        )
