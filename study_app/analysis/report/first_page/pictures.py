"""The small pictures beside the three answers of the first page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from matplotlib.axes import Axes

from study_app.analysis import style
from study_app.analysis.figures import psychometric_curve
from study_app.analysis.figures.page_layout import Sheet
from study_app.analysis.findings.block_results import BlockFound
from study_app.analysis.findings.liquid_recognition import RecognitionResult
from study_app.analysis.findings.words import ms, name, short
from study_app.analysis.report.first_page.answer import Answer
from study_app.analysis.report.first_page.answers_of_delays import common_ms

WIDTH_PT: Final = 264.0
HEIGHT_PT: Final = 150.0
FOOT_PT: Final = 24.0
OTHERS: Final = ("#c9d1d8", "#aab5be", "#dfe5ea", "#b9c3cb", "#d3dae0")
"""Grounds of the wrong names, with the dark text on each of them at a contrast of at least 7."""

UNDECIDED: Final = "undecided"


@style.own_settings()
def draw(answer: Answer, found: BlockFound) -> tuple[bytes, str] | None:
    """Return the picture beside an answer as PNG, and what it shows in words; None where there is nothing to show."""
    sheet = Sheet(WIDTH_PT, HEIGHT_PT, style.fonts_for("png"))
    if answer.question == "distinguished":
        words = _names(sheet, found.named, found) if found.named is not None else _ratings(sheet, found)
    elif answer.question == "noticed from":
        words = _noticed(sheet, found, answer.at_ms)
    else:
        words = _differences(sheet, found)
    return None if words is None else (style.file_bytes(sheet.figure, "png", words), words)


def _names(sheet: Sheet, named: RecognitionResult, found: BlockFound) -> str:
    """Draw a bar a liquid: how many gave it its right name, and which other names it was given."""
    left = 4 + max(sheet.text_width(words, 9) for words in found.names)
    height = (HEIGHT_PT - FOOT_PT) / len(found.names)
    axes = sheet.axes(left + 6, 4, WIDTH_PT - left - 10, HEIGHT_PT - FOOT_PT)
    most = max(sum(row) for row in named.found.table) or 1
    axes.set_xlim(0, most)
    axes.set_ylim(len(found.names), 0)
    called = [*(_called(named, found, label) for label in named.labels), UNDECIDED, "no answer"]
    for place, row in enumerate(named.found.table):
        sheet.text(left, 4 + height * (place + 0.5) + 2.5, found.names[place], size=9, ha="right")
        right = named.right[place]
        own = None if right is None else named.labels.index(right)
        order = sorted(range(len(row)), key=lambda at: -row[at] if at != own else -most - 1)
        begun = 0
        for number, at in enumerate(order):
            if not row[at]:
                continue
            colour = style.ACCENT if at == own else OTHERS[number % len(OTHERS)]
            axes.barh(place + 0.5, row[at], left=begun, height=0.62, color=colour, edgecolor="white", linewidth=0.8)
            words = f"{called[at]} {row[at]}"
            room = row[at] / most * (WIDTH_PT - left - 10) - 6
            fits = words if sheet.text_width(words, 8) <= room else str(row[at])
            ink = "white" if at == own else style.TEXT
            axes.text(
                begun + row[at] / 2,
                place + 0.5,
                fits if sheet.text_width(fits, 8) <= room + 4 else "",
                fontproperties=sheet.font(8),
                color=ink,
                ha="center",
                va="center",
            )
            begun += row[at]
    _foot(sheet, "Names given, number of people; blue: the right one")
    return "How many people gave each liquid which name; blue is the right one"


def _called(named: RecognitionResult, found: BlockFound, label: str) -> str:
    at = next((place for place, other in enumerate(named.right) if other == label), None)
    return found.names[at].lower() if at is not None else short(found, label).lower().removeprefix("like ")


def _ratings(sheet: Sheet, found: BlockFound) -> str | None:
    """Draw medians and quartiles of the liquids in the statement that differs most."""
    tested = [one for one in found.omnibus if one.outcome.effect is not None]
    if not tested:
        return None
    item = max(tested, key=lambda one: abs(one.outcome.effect or 0.0)).item
    rows = {str(row["code"]): row for row in found.measures if row["item"] == item and row["median"] is not None}
    codes = [setting.code for setting in found.settings if setting.code in rows]
    if not codes:
        return None
    left = 4 + max(sheet.text_width(name(found, code), 9) for code in codes)
    axes = sheet.axes(left + 6, 4, WIDTH_PT - left - 14, HEIGHT_PT - FOOT_PT - 10)
    axes.set_xlim(0.7, 7.3)
    axes.set_ylim(len(codes), 0)
    height = (HEIGHT_PT - FOOT_PT - 10) / len(codes)
    _levels(sheet, axes)
    for place, code in enumerate(codes):
        row = rows[code]
        sheet.text(left, 4 + height * (place + 0.5) + 2.5, name(found, code), size=9, ha="right")
        axes.plot([row["q1"], row["q3"]], [place + 0.5] * 2, color=style.BAND, linewidth=7, solid_capstyle="butt")
        axes.plot([row["median"]], [place + 0.5], "o", markersize=6, color=style.ACCENT)
    _foot(sheet, f"“{short(found, item)}”, 1 to 7: median and middle half")
    return f"Median and middle half of the answers to “{short(found, item)}” for each setting"


def _levels(sheet: Sheet, axes: Axes) -> None:
    axes.set_xticks(range(1, 8), [str(level) for level in range(1, 8)])
    for label in axes.get_xticklabels():
        label.set_fontproperties(sheet.font(8))
    for level in range(1, 8):
        axes.axvline(level, color=style.GRID, linewidth=0.6, zorder=0)


def _noticed(sheet: Sheet, found: BlockFound, at_ms: float | None) -> str | None:
    if found.threshold is None or not any(found.threshold.asked):
        return None
    axes = sheet.axes(32, 6, WIDTH_PT - 46, HEIGHT_PT - FOOT_PT - 16)
    psychometric_curve.curve(sheet, axes, found.threshold, at_ms)
    dashed = "" if at_ms is None else "; dashed: the answer"
    _foot(sheet, f"Share that noticed, over delay in ms{dashed}")
    curve = "" if found.threshold.effect is None else ", with the fitted curve"
    return f"Share of answers that noticed the delay, over the delay in ms{curve}"


def _differences(sheet: Sheet, found: BlockFound) -> str | None:
    """Draw mean differences to the shortest delay with their intervals, and the bound as a band."""
    kept = [one for one in found.against if one.found.effect is not None]
    if not kept:
        return None
    bound = kept[0].found.bound
    ends = [end for one in kept if one.found.interval for end in (one.found.interval.low, one.found.interval.high)]
    ends += [side * 1.4 * bound for side in (-1, 1)] + [one.found.effect or 0.0 for one in kept]
    delays = sorted({one.delay_ms for one in kept})
    axes = sheet.axes(32, 6, WIDTH_PT - 46, HEIGHT_PT - FOOT_PT - 16)
    axes.set_xlim(-0.5, len(delays) - 0.5)
    axes.set_ylim(min(ends) - 0.1, max(ends) + 0.1)
    axes.axhspan(-bound, bound, color=style.GROUND, zorder=0)
    for side in (-bound, bound):
        axes.axhline(side, color=style.TEXT_SOFT, linewidth=0.8, dashes=(3, 2), zorder=1)
    axes.axhline(0, color=style.BORDER, linewidth=0.6, zorder=1)
    items = [item.id for item in found.items]
    for one in kept:
        x = delays.index(one.delay_ms) + (items.index(one.item) - (len(items) - 1) / 2) * 0.7 / max(1, len(items))
        colour = style.ACCENT if one.verdict == "equivalent" else style.PARTICIPANT
        if one.found.interval is not None:
            axes.plot([x, x], [one.found.interval.low, one.found.interval.high], color=colour, linewidth=1.2)
        axes.plot([x], [one.found.effect or 0.0], "o", markersize=2.6, color=colour)
    axes.set_xticks(range(len(delays)), [f"{delay:g}" for delay in delays])
    axes.set_yticks([-bound, 0, bound], [f"−{bound:g}", "0", f"+{bound:g}"])
    for label in (*axes.get_xticklabels(), *axes.get_yticklabels()):
        label.set_fontproperties(sheet.font(8))
    at = common_ms(found)
    if at is not None:
        axes.axvspan(-0.5, delays.index(at) + 0.5, color=style.BAND, alpha=0.35, zorder=0)
    level = f"{100 * (1 - 2 * kept[0].found.alpha):g} %"
    _foot(sheet, f"Points from {ms(kept[0].control_ms)}, {level} intervals; blue: within ±{bound:g}")
    return f"Mean differences to {ms(kept[0].control_ms)} with intervals, one a statement and delay, and the bound"


def _foot(sheet: Sheet, words: str) -> None:
    lines: Sequence[str] = sheet.wrap(words, WIDTH_PT - 8, 8)
    for number, line in enumerate(reversed(lines)):
        sheet.text(4, HEIGHT_PT - 4 - 9.5 * number, line, size=8, colour=style.TEXT_SOFT)
