"""The first page's answer to the delay up to which answers do not change by a relevant amount."""

from collections.abc import Iterator
from typing import Final

from study_app import figure_style as style
from study_app.analysis.figures.page_layout import Sheet
from study_app.analysis.findings.contrast_with_control import FINDING as CONTRASTS
from study_app.analysis.findings.contrast_with_control import equivalent_up_to
from study_app.analysis.report.first_page.answer import Answer
from study_app.analysis.report.first_page.pictures import FOOT_PT, HEIGHT_PT, WIDTH_PT, foot
from study_app.analysis.results.block_results import BlockFound
from study_app.analysis.results.finding import Finding, Question
from study_app.analysis.results.words import all_of, beyond, lead, listed, ms, percent, short, signed_difference
from study_app.analysis.tables.planned_analysis import Decided

KEY: Final = "unchanged up to"


def common_ms(found: BlockFound) -> float | None:
    """Return the longest delay up to which every statement is equivalent at every delay."""
    delays = list(equivalent_up_to(CONTRASTS.of(found)).values())
    known = [delay for delay in delays if delay is not None]
    return min(known) if known and len(known) == len(delays) else None


def unchanged(found: BlockFound, _decided: Decided) -> Answer:
    """Return up to which delay mean answers are equivalent to those at the shortest."""
    against = CONTRASTS.of(found)
    up_to = {item: delay for item, delay in equivalent_up_to(against).items() if delay is not None}
    if not against:
        why = next((one.why for one in found.absent if "equivalence" in one.what), "nothing was compared")
        return Answer(KEY, found.id, found.title, f"No answer: {why}.", ())
    first = against[0]
    points = "point" if first.found.bound == 1 else "points"
    within = f"within ±{first.found.bound:g} {points} of those at {ms(first.control_ms)}"
    at = common_ms(found)
    if at is not None:
        text = f"Up to {ms(at)}: mean answers to {all_of(len(up_to), 'statement')} stay {within}."
    elif up_to:
        single = listed([f"“{short(found, item)}” up to {ms(delay)}" for item, delay in up_to.items()])
        text = f"For no delay is it shown in all statements. In single ones mean answers stay {within}: {single}."
    else:
        text = (
            f"For no delay, not even {ms(first.delay_ms)}, are mean answers shown to stay {within}. That is not "
            "evidence that something changes."
        )
    here = [one for one in against if one.delay_ms <= (at or first.delay_ms) and one.found.effect is not None]
    sizes = []
    if here:
        largest = max(here, key=lambda one: abs(one.found.effect or 0.0))
        level = percent(1 - 2 * largest.found.alpha)
        sizes.append(
            f"The largest difference {'up to' if at is not None else 'at'} {ms(at or first.delay_ms)}: "
            f"“{short(found, largest.item)}”, {signed_difference(largest.found)} ({level} interval); "
            f"people beyond the bound: {beyond(largest.found)}."
        )
    sizes.append("This is about means: single people may notice, and what is within the bound may still change.")
    return Answer(KEY, found.id, found.title, text, tuple(sizes))


def _sentences(found: BlockFound, _decided: Decided) -> Iterator[str]:
    against = CONTRASTS.of(found)
    if not against:
        return
    bound, control = against[0].found.bound, ms(against[0].control_ms)
    within = f"within ±{bound:g} {'point' if bound == 1 else 'points'} of those at {control}"
    up_to = [
        f"“{short(found, item)}” up to {ms(delay)}"
        for item, delay in equivalent_up_to(against).items()
        if delay is not None
    ]
    if up_to:
        yield f"{lead(found)}: mean answers {within} are shown for {listed(up_to)}."
    elif all(one.found.p is None for one in against):
        reasons = "; ".join(dict.fromkeys(one.found.note for one in against))
        yield f"{lead(found)}: no delay could be compared with {control} ({reasons})."
    else:
        nearest = ms(against[0].delay_ms)
        yield f"{lead(found)}: mean answers {within} are shown in no statement, not even at {nearest}."


def _picture(sheet: Sheet, found: BlockFound, _answer: Answer) -> str | None:
    """Draw mean differences to the shortest delay with their intervals, and the bound as a band."""
    kept = [one for one in CONTRASTS.of(found) if one.found.effect is not None]
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
    foot(sheet, f"Points from {ms(kept[0].control_ms)}, {level} intervals; blue: within ±{bound:g}")
    return f"Mean differences to {ms(kept[0].control_ms)} with intervals, one a statement and delay, and the bound"


FINDING: Final[Finding[None]] = Finding(
    key=KEY,
    place=22,
    empty=None,
    kinds=("delays",),
    sentences=_sentences,
    question=Question(
        words="Up to which delay do answers not change by a relevant amount?", answer=unchanged, picture=_picture
    ),
)
