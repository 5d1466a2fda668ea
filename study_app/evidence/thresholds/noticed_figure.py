"""The figure of detected and of rated delays: the shares over the delay, and both thresholds over the criterion."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from study_app import figure_style as style
from study_app.analysis.figures.page_layout import MARGIN_PT, Mark, Sheet
from study_app.evidence.thresholds.noticed_delays import (
    FORCED_CHOICE,
    LIKERT,
    MEAN_CRITERION_S,
    Compared,
    Rated,
    markdown,
)
from study_app.protocol.trials.stimuli import LINEAR_OBSERVER
from study_app.psychophysics.families import success
from study_app.store.output_files import write_files

HEIGHT_PT: Final = 236.0
TOP_PT: Final = 60.0
FOOT_PT: Final = 34.0
LEFT_PT: Final = 34.0
GAP_PT: Final = 52.0
THESIS_MS: Final = 125.0
GUESS, LAPSE = 0.5, 0.02
LABEL_SHARE: Final = 0.065
"""Height of a label."""
TITLE: Final = "Which delay is noticed? Two questions to the same people"


@style.own_settings()
def draw(found: Compared, fonts: Sequence[str]) -> Sheet:
    """Draw both panels."""
    sheet = Sheet(style.PAGE_WIDTH_PT, HEIGHT_PT, fonts)
    mark = Mark("SIMULATED participants", style.WARN, style.WARN_GROUND)
    sheet.heading(TITLE, [mark], [f"n = {found.people}"])
    width = (sheet.width_pt - 2 * MARGIN_PT - 2 * LEFT_PT - GAP_PT) / 2
    left, right = MARGIN_PT + LEFT_PT, MARGIN_PT + 2 * LEFT_PT + width + GAP_PT - LEFT_PT
    height = sheet.height_pt - TOP_PT - FOOT_PT
    plain = [one for one in found.rated if not one.adapted_s]
    _shares(sheet, sheet.axes(left, TOP_PT, width, height), found, plain)
    _thresholds(sheet, sheet.axes(right, TOP_PT, width, height), found)
    _heads(sheet, left, right)
    return sheet


def _heads(sheet: Sheet, left: float, right: float) -> None:
    for x, above, below in (
        (left, "Answers at each delay", "Delay, ms"),
        (right, "Threshold [ms] by the people's criterion", "Mean criterion of the ratings, ms"),
    ):
        sheet.text(x - 22, 36, above, size=7.5, weight="bold")
        sheet.text(x - 22, sheet.height_pt - 6, below, size=6.5, colour=style.TEXT_SOFT)
    words = f"dashed: correct in {FORCED_CHOICE}; solid: agree in {LIKERT}, by criterion [ms]"
    sheet.text(left - 22, 47, words, size=6.5, colour=style.TEXT_SOFT)
    sheet.text(
        right - 22,
        47,
        f"line: {FORCED_CHOICE}; dots: {LIKERT}; diamond: after adaptation",
        size=6.5,
        colour=style.TEXT_SOFT,
    )


def _shares(sheet: Sheet, axes: Axes, found: Compared, rated: Sequence[Rated]) -> None:
    delays = np.linspace(1.0, 200.0, 200)
    threshold = found.detected_ms[0]
    correct = success("weibull", np.log10(delays), np.log10(threshold), LINEAR_OBSERVER[0], GUESS, LAPSE)
    axes.plot(delays, correct, color=style.TEXT, linewidth=1.4, dashes=(4, 2), gid="correct")
    axes.plot([threshold], [GUESS + (1 - GUESS - LAPSE) / 2], "s", markersize=4, color=style.TEXT, gid="detected")
    below = 1.0 + LABEL_SHARE
    for one, colour in zip(rated, style.STEPS[1:], strict=False):
        test = one.found
        asked = np.array(test.asked)
        axes.plot(test.levels, np.array(test.yes) / asked, "o", markersize=3, color=colour, clip_on=False)
        if test.effect is None or test.width is None or test.guess is None or test.lapse is None:
            continue
        agree = success("logistic", delays, test.effect, test.width, test.guess, test.lapse)
        axes.plot(delays, agree, color=colour, linewidth=1.2, gid=f"rated-{1000 * one.criterion_s:.0f}")
        label = f"{1000 * one.criterion_s:.0f}"
        below = min(float(agree[-1]), below - LABEL_SHARE)
        axes.text(206.0, below, label, color=colour, va="center", fontproperties=sheet.font(6.5))
    axes.set_xlim(-4, 204)
    axes.set_ylim(-0.03, 1.03)
    axes.set_xticks([0, 50, 75, 100, 125, 150, 200])
    places = [0.0, 0.5, 0.75, 1.0]
    axes.set_yticks(places, [f"{place:.0%}" for place in places])
    _grid(sheet, axes, places)


def _thresholds(sheet: Sheet, axes: Axes, found: Compared) -> None:
    middle, low, high = found.detected_ms
    axes.axhspan(low, high, color=style.BAND, linewidth=0)
    axes.axhline(middle, color=style.TEXT, linewidth=1.4, dashes=(4, 2), gid="detected")
    axes.axhline(THESIS_MS, color=style.TEXT_SOFT, linewidth=0.8, dashes=(1, 1.5), gid="thesis")
    axes.text(54, THESIS_MS + 3, "“125 ms” of the thesis", color=style.TEXT_SOFT, fontproperties=sheet.font(6.5))
    plain = 0
    for one in found.rated:
        test, at = one.found, 1000 * one.criterion_s
        if test.effect is None:
            continue
        if one.adapted_s:
            at, colour, marker = at + 5, style.WARN, "D"
        else:
            plain += 1
            colour, marker = style.STEPS[plain], "o"
        if test.lower is not None and test.upper is not None:
            axes.plot([at, at], [test.lower, test.upper], color=colour, linewidth=1.0)
        axes.plot([at], [test.effect], marker, markersize=4, color=colour, gid=f"threshold-{at:.0f}")
    axes.set_xlim(50, 175)
    axes.set_ylim(0, 205)
    axes.set_xticks([1000 * one.criterion_s for one in found.rated if not one.adapted_s])
    places = [0, 50, 100, 150, 200]
    axes.set_yticks(places, [str(place) for place in places])
    _grid(sheet, axes, places)


def _grid(sheet: Sheet, axes: Axes, places: Sequence[float]) -> None:
    for label in (*axes.get_xticklabels(), *axes.get_yticklabels()):
        label.set_fontproperties(sheet.font(6.5))
    for place in places:
        axes.axhline(place, color=style.GRID, linewidth=0.6, zorder=0)


CAPTION: Final = (
    "Simulated people answer two questions about the delay of the picture. Left: share correct of the forced choice of "
    f"{FORCED_CHOICE} (dashed) and share of agreement with “different” in {LIKERT} (dots with fitted curves), for mean "
    "criteria of 60, 95, 130 and 165 ms. Right: both thresholds over the criterion, with 95 % intervals; the forced "
    "choice does not depend on it. Diamond: people to whom a delay of 30 ms has become the usual one. A criterion of "
    f"{1000 * MEAN_CRITERION_S:.0f} ms is that of the answer model, chosen to agree with the thesis."
)


def write(found: Compared, to: Path) -> tuple[Path, ...]:
    """Write the table, the figure (PNG, SVG, PDF) and its caption into the folder ``to``; return the files.

    Raises
    ------
    AnalysisError
        The folder cannot be written; nothing was.
    """
    files = {"delay-thresholds.md": markdown(found).encode(), "delay-thresholds.txt": f"{CAPTION}\n".encode()}
    for form in style.FORMATS:
        drawn = draw(found, style.fonts_for(form)).figure
        files[f"delay-thresholds.{form}"] = style.file_bytes(drawn, form, TITLE)
    return write_files(to, files)
