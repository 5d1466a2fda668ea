"""The first page's answer to the delay from which participants notice a difference."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

from study_app.analysis.figures import psychometric_curve
from study_app.analysis.figures.page_layout import Sheet
from study_app.analysis.findings.contrast_with_control import FINDING as CONTRASTS
from study_app.analysis.findings.contrast_with_control import ContrastWithControl
from study_app.analysis.findings.detection_threshold import FINDING as THRESHOLD
from study_app.analysis.findings.lowest_delay import FINDING as LOWEST
from study_app.analysis.report.first_page.answer import NO_EVIDENCE, Answer
from study_app.analysis.report.first_page.pictures import FOOT_PT, HEIGHT_PT, WIDTH_PT, foot
from study_app.analysis.results.block_results import BlockFound
from study_app.analysis.results.finding import Finding, Question
from study_app.analysis.results.words import interval, listed, ms, percent, short, signed_difference
from study_app.analysis.tables.planned_analysis import Decided

KEY: Final = "noticed from"


def noticed_from(found: BlockFound, decided: Decided) -> Answer:
    """Return from which delay a change shows: by primary statements, exploratory ones after them and marked."""
    lowest = {one.item: one.over_all_ms for one in LOWEST.of(found) if one.over_all_ms is not None}
    different = [one for one in CONTRASTS.of(found) if one.verdict == "different"]
    threshold = THRESHOLD.of(found)
    of_primary, of_others = (
        _shortest(
            found,
            {item: at for item, at in lowest.items() if decided.is_primary(item) == primary},
            [one for one in different if decided.is_primary(one.item) == primary],
        )
        for primary in (True, False)
    )
    fitted = None
    if threshold is not None and threshold.effect is not None:
        fitted = None, "More people notice a difference with longer delays, but no single delay is shown to be noticed."
    primary_threshold = decided.noticed is not None and decided.is_primary(decided.noticed)
    confirmed = of_primary or (fitted if primary_threshold else None)
    headline = confirmed or of_others or fitted
    at_ms, text = headline or (None, f"No delay was shown to be noticed. {NO_EVIDENCE}")
    if confirmed and of_others:
        text += f" In exploratory statements, {_first_lower(of_others[1])}"
    exploratory = headline is not None and confirmed is None
    sizes = _noticed_sizes(found, decided, lowest, different, mark=confirmed is not None)
    return Answer(KEY, found.id, found.title, text, tuple(sizes), headline is not None, exploratory, at_ms)


def _shortest(
    found: BlockFound, lowest: Mapping[str, float], different: Sequence[ContrastWithControl]
) -> tuple[float, str] | None:
    """Return the shortest delay that changes a statement of those given and the sentence of it; None without any."""
    if lowest:
        at = min(lowest.values())
        first = [f"“{short(found, item)}”" for item, delay in lowest.items() if delay == at]
        return at, (
            f"From {ms(at)} on at the latest: {listed(first)} {'changes' if len(first) == 1 else 'change'} with the "
            "delay up to there. Shorter delays may be noticed too."
        )
    if different:
        at = min(one.delay_ms for one in different)
        return at, f"No trend is shown, but answers at {ms(at)} differ from those at {ms(different[0].control_ms)}."
    return None


def _noticed_sizes(
    found: BlockFound,
    decided: Decided,
    lowest: Mapping[str, float],
    different: Sequence[ContrastWithControl],
    *,
    mark: bool,
) -> list[str]:
    """Return the changes of all statements and the threshold; ``mark``: say which of them are exploratory."""

    def marked(item: str | None) -> str:
        return "Exploratory: " if mark and (item is None or not decided.is_primary(item)) else ""

    sizes = [
        f"{marked(item)}“{short(found, item)}” from {ms(delay)} on at the latest{_change(found, item, delay)}"
        for item, delay in sorted(lowest.items(), key=lambda one: one[1])
    ]
    sizes += [
        f"{marked(one.item)}“{short(found, one.item)}” differs at {ms(one.delay_ms)}"
        f"{_change(found, one.item, one.delay_ms)}{'' if one.as_expected else ', against the direction stated'}"
        for one in _first_of_each(different)
        if one.item not in lowest
    ]
    if sizes and CONTRASTS.of(found):
        sizes[-1] += f". {_level(CONTRASTS.of(found))}"
    threshold = THRESHOLD.of(found)
    if threshold is not None and threshold.effect is not None:
        ends = "no interval" if threshold.interval is None else f"95 % interval {interval(threshold.interval, 0)} ms"
        sizes.append(
            f"{marked(decided.noticed)}Detection threshold, half-way between guesses and lapses: "
            f"{threshold.effect:.0f} ms ({ends})."
        )
    elif threshold is not None:
        sizes.append(f"No detection threshold: {threshold.note}.")
    return sizes


def _first_of_each(different: Iterable[ContrastWithControl]) -> Iterator[ContrastWithControl]:
    """Yield of each statement the comparison at the shortest delay."""
    seen = set()
    for one in sorted(different, key=lambda one: one.delay_ms):
        if one.item not in seen:
            seen.add(one.item)
            yield one


def _change(found: BlockFound, item: str, delay_ms: float) -> str:
    """Return how far the mean answer at a delay is from that at the shortest, with its interval."""
    for one in CONTRASTS.of(found):
        if one.item == item and one.delay_ms == delay_ms and one.found.effect is not None:
            return f": {signed_difference(one.found)}"
    return ""


def _level(against: Sequence[ContrastWithControl]) -> str:
    """Return what the differences and their intervals are, said once."""
    first = against[0]
    return f"Points: mean difference to {ms(first.control_ms)}, {percent(1 - 2 * first.found.alpha)} interval"


def _first_lower(words: str) -> str:
    return words[:1].lower() + words[1:]


def _picture(sheet: Sheet, found: BlockFound, answer: Answer) -> str | None:
    threshold = THRESHOLD.of(found)
    if threshold is None or not any(threshold.asked):
        return None
    axes = sheet.axes(32, 6, WIDTH_PT - 46, HEIGHT_PT - FOOT_PT - 16)
    psychometric_curve.curve(sheet, axes, threshold, answer.at_ms)
    dashed = "" if answer.at_ms is None else "; dashed: the answer"
    foot(sheet, f"Share that noticed, over delay in ms{dashed}")
    curve = "" if threshold.effect is None else ", with the fitted curve"
    return f"Share of answers that noticed the delay, over the delay in ms{curve}"


FINDING: Final[Finding[None]] = Finding(
    key=KEY,
    place=21,
    empty=None,
    kinds=("delays",),
    question=Question(
        words="From which delay do participants notice a difference?", answer=noticed_from, picture=_picture
    ),
)
