"""What is said of delays: from which one participants notice, up to which nothing changes, and what that can mean."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

from study_app import figure_style as style
from study_app.analysis.figures import delay_figures
from study_app.analysis.figures.page_layout import Sheet
from study_app.analysis.findings.delays import (
    ContrastsWithControl,
    ContrastWithControl,
    DetectionThreshold,
    Lowest,
    LowestDelay,
    equivalent_up_to,
)
from study_app.analysis.findings.finding import FOOT_PT, HEIGHT_PT, NO_EVIDENCE, WIDTH_PT, Answer, Finding, foot
from study_app.analysis.findings.statement_tests import DelayTrend
from study_app.analysis.report.html_page import box, heading, paragraph, table
from study_app.analysis.results import (
    BlockFound,
    Delivered,
    Results,
    all_of,
    beyond,
    counted,
    interval,
    lead,
    listed,
    ms,
    number,
    p_equals,
    percent,
    short,
    signed_difference,
)
from study_app.analysis.statistics.equivalence import fewest


class NoticedFrom(Finding[None]):
    """The first page's answer to the delay from which participants notice a difference."""

    key = "noticed from"
    place = 21
    kinds = ("delays",)
    question = "From which delay do participants notice a difference?"

    def answer(self) -> Answer:
        """Return from which delay a change shows: by primary statements, exploratory ones after them and marked."""
        lowest = {one.item: one.over_all_ms for one in LowestDelay.of(self.found) if one.over_all_ms is not None}
        different = [one for one in ContrastsWithControl.of(self.found) if one.verdict == "different"]
        threshold, decided = DetectionThreshold.of(self.found), self.results.decided
        of_primary, of_others = (
            _shortest(
                self.found,
                {item: at for item, at in lowest.items() if decided.is_primary(item) == primary},
                [one for one in different if decided.is_primary(one.item) == primary],
            )
            for primary in (True, False)
        )
        fitted = None
        if threshold is not None and threshold.effect is not None:
            words = "More people notice a difference with longer delays, but no single delay is shown to be noticed."
            fitted = None, words
        primary_threshold = decided.noticed is not None and decided.is_primary(decided.noticed)
        confirmed = of_primary or (fitted if primary_threshold else None)
        headline = confirmed or of_others or fitted
        at_ms, text = headline or (None, f"No delay was shown to be noticed. {NO_EVIDENCE}")
        if confirmed and of_others:
            text += f" In exploratory statements, {of_others[1][:1].lower()}{of_others[1][1:]}"
        return Answer(
            self.key,
            self.found.id,
            self.found.title,
            text,
            tuple(self._sizes(lowest, different, mark=confirmed is not None)),
            claims=headline is not None,
            exploratory=headline is not None and confirmed is None,
            at_ms=at_ms,
        )

    def _sizes(self, lowest: Mapping[str, float], different: Sequence[ContrastWithControl], *, mark: bool) -> list[str]:
        """Return the changes of all statements and the threshold; ``mark``: say which of them are exploratory."""
        found, decided, against = self.found, self.results.decided, ContrastsWithControl.of(self.found)

        def marked(item: str | None) -> str:
            return "Exploratory: " if mark and (item is None or not decided.is_primary(item)) else ""

        def change(item: str, delay_ms: float) -> str:
            """Say how far the mean answer at a delay is from that at the shortest."""
            here = [one for one in against if (one.item, one.delay_ms) == (item, delay_ms)]
            return f": {signed_difference(here[0].found)}" if here and here[0].found.effect is not None else ""

        sizes = [
            f"{marked(item)}“{short(found, item)}” from {ms(delay)} on at the latest{change(item, delay)}"
            for item, delay in sorted(lowest.items(), key=lambda one: one[1])
        ]
        sizes += [
            f"{marked(one.item)}“{short(found, one.item)}” differs at {ms(one.delay_ms)}"
            f"{change(one.item, one.delay_ms)}{'' if one.as_expected else ', against the direction stated'}"
            for one in _first_of_each(different)
            if one.item not in lowest
        ]
        if sizes and against:
            level = percent(1 - 2 * against[0].found.alpha)
            sizes[-1] += f". Points: mean difference to {ms(against[0].control_ms)}, {level} interval"
        threshold = DetectionThreshold.of(found)
        if threshold is not None and threshold.effect is not None:
            ends = "no interval"
            if threshold.interval is not None:
                ends = f"95 % interval {interval(threshold.interval, 0)} ms"
            sizes.append(
                f"{marked(decided.noticed)}Detection threshold, half-way between guesses and lapses: "
                f"{threshold.effect:.0f} ms ({ends})."
            )
        elif threshold is not None:
            sizes.append(f"No detection threshold: {threshold.note}.")
        return sizes

    def picture(self, sheet: Sheet, answer: Answer) -> str | None:
        threshold = DetectionThreshold.of(self.found)
        if threshold is None or not any(threshold.asked):
            return None
        axes = sheet.axes(32, 6, WIDTH_PT - 46, HEIGHT_PT - FOOT_PT - 16)
        delay_figures.curve(sheet, axes, threshold, answer.at_ms)
        dashed = "" if answer.at_ms is None else "; dashed: the answer"
        foot(sheet, f"Share that noticed, over delay in ms{dashed}")
        curve = "" if threshold.effect is None else ", with the fitted curve"
        return f"Share of answers that noticed the delay, over the delay in ms{curve}"


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


def _first_of_each(different: Iterable[ContrastWithControl]) -> Iterator[ContrastWithControl]:
    """Yield of each statement the comparison at the shortest delay."""
    seen = set()
    for one in sorted(different, key=lambda one: one.delay_ms):
        if one.item not in seen:
            seen.add(one.item)
            yield one


def common_ms(found: BlockFound) -> float | None:
    """Return the longest delay up to which every statement is equivalent at every delay."""
    delays = list(equivalent_up_to(ContrastsWithControl.of(found)).values())
    known = [delay for delay in delays if delay is not None]
    return min(known) if known and len(known) == len(delays) else None


class UnchangedUpTo(Finding[None]):
    """The first page's answer to the delay up to which answers do not change by a relevant amount."""

    key = "unchanged up to"
    place = 22
    kinds = ("delays",)
    question = "Up to which delay do answers not change by a relevant amount?"

    def answer(self) -> Answer:
        """Return up to which delay mean answers are equivalent to those at the shortest."""
        against = ContrastsWithControl.of(self.found)
        up_to = {item: delay for item, delay in equivalent_up_to(against).items() if delay is not None}
        if not against:
            why = next((one.why for one in self.found.absent if "equivalence" in one.what), "nothing was compared")
            return Answer(self.key, self.found.id, self.found.title, f"No answer: {why}.", ())
        first = against[0]
        points = "point" if first.found.bound == 1 else "points"
        within = f"within ±{first.found.bound:g} {points} of those at {ms(first.control_ms)}"
        at = common_ms(self.found)
        if at is not None:
            text = f"Up to {ms(at)}: mean answers to {all_of(len(up_to), 'statement')} stay {within}."
        elif up_to:
            single = listed([f"“{short(self.found, item)}” up to {ms(delay)}" for item, delay in up_to.items()])
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
                f"“{short(self.found, largest.item)}”, {signed_difference(largest.found)} ({level} interval); "
                f"people beyond the bound: {beyond(largest.found)}."
            )
        sizes.append("This is about means: single people may notice, and what is within the bound may still change.")
        return Answer(self.key, self.found.id, self.found.title, text, tuple(sizes))

    def sentences(self) -> Iterator[str]:
        against = ContrastsWithControl.of(self.found)
        if not against:
            return
        bound, control = against[0].found.bound, ms(against[0].control_ms)
        within = f"within ±{bound:g} {'point' if bound == 1 else 'points'} of those at {control}"
        up_to = [
            f"“{short(self.found, item)}” up to {ms(delay)}"
            for item, delay in equivalent_up_to(against).items()
            if delay is not None
        ]
        if up_to:
            yield f"{lead(self.found)}: mean answers {within} are shown for {listed(up_to)}."
        elif all(one.found.p is None for one in against):
            reasons = "; ".join(dict.fromkeys(one.found.note for one in against))
            yield f"{lead(self.found)}: no delay could be compared with {control} ({reasons})."
        else:
            nearest = ms(against[0].delay_ms)
            yield f"{lead(self.found)}: mean answers {within} are shown in no statement, not even at {nearest}."

    def picture(self, sheet: Sheet, answer: Answer) -> str | None:
        """Draw mean differences to the shortest delay with their intervals, and the bound as a band."""
        kept = [one for one in ContrastsWithControl.of(self.found) if one.found.effect is not None]
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
        items = [item.id for item in self.found.items]
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
        at = common_ms(self.found)
        if at is not None:
            axes.axvspan(-0.5, delays.index(at) + 0.5, color=style.BAND, alpha=0.35, zorder=0)
        level = f"{100 * (1 - 2 * kept[0].found.alpha):g} %"
        foot(sheet, f"Points from {ms(kept[0].control_ms)}, {level} intervals; blue: within ±{bound:g}")
        return f"Mean differences to {ms(kept[0].control_ms)} with intervals, one a statement and delay, and the bound"


VERDICTS: Final = ("equivalent", "different", "inconclusive", "out of reach")


def tempting_ms(found: BlockFound) -> float | None:
    """Return the delay for which the report discusses whether it matters.

    It is the longest delay without contrary evidence; if every delay has some, the shortest added delay.
    """
    if len(found.delays_ms) < 2:
        return None
    calm = [delay for delay in found.delays_ms[1:] if not speaking_against(found, delay)]
    return max(calm) if calm and (ContrastsWithControl.of(found) or DelayTrend.of(found)) else found.delays_ms[1]


def speaking_against(found: BlockFound, delay_ms: float) -> tuple[str, ...]:
    """Return the evidence against "delays up to this one do not matter", a clause for each statement.

    Evidence is a trend up to this delay or a shorter one, or a difference at one of them, in the direction stated
    before the study, if any. The error rate is controlled over all statements.
    """
    trends = {
        one.item: f"“{short(found, one.item)}” follows the delay already up to {ms(shown_ms)}{_exploratory(found, one)}"
        for one in LowestDelay.of(found)
        if (shown_ms := one.over_all_ms) is not None and shown_ms <= delay_ms
    }
    differences: dict[str, str] = {}
    for one in _differing(found, delay_ms):
        if one.as_expected and one.item not in trends:
            differences.setdefault(one.item, _differs(found, one))
    return (*trends.values(), *differences.values())


def _differing(found: BlockFound, delay_ms: float) -> list[ContrastWithControl]:
    """Return the comparisons up to a delay that show a difference, corrected over all of them, shortest delay first."""
    different = [
        one for one in ContrastsWithControl.of(found) if one.verdict == "different" and one.delay_ms <= delay_ms
    ]
    return sorted(different, key=lambda one: one.delay_ms)


def _differs(found: BlockFound, one: ContrastWithControl) -> str:
    sign = "+" if (one.found.effect or 0.0) > 0 else ""
    p = "" if one.p_adjusted is None else f", adjusted {p_equals(one.p_adjusted)}"
    return f"“{short(found, one.item)}” differs at {ms(one.delay_ms)} ({sign}{number(one.found.effect)}{p})"


def _exploratory(found: BlockFound, one: Lowest) -> str:
    suggested = any(trend.item == one.item and not trend.primary for trend in DelayTrend.of(found))
    return " (exploratory)" if suggested else ""


def meaning(found: BlockFound, results: Results) -> tuple[str, ...]:
    """Return the paragraphs on that delay."""
    delay_ms = tempting_ms(found)
    if delay_ms is None:
        return ()
    return (_as_number(found, results, delay_ms), *_as_lowest(found, delay_ms), *_as_claim(found, delay_ms))


def by_delay(found: BlockFound) -> list[list[str]]:
    """Return a row a delay: in which statements it is equivalent, different, inconclusive, and what that lets say."""
    rows = []
    for delay_ms in dict.fromkeys(one.delay_ms for one in ContrastsWithControl.of(found)):
        here = [one for one in ContrastsWithControl.of(found) if one.delay_ms == delay_ms]
        text = [
            ", ".join(short(found, one.item) for one in here if one.verdict == verdict) or "–" for verdict in VERDICTS
        ]
        rows.append([ms(delay_ms), *text, _said(found, here)])
    return rows


def _as_number(found: BlockFound, results: Results, delay_ms: float) -> str:
    by_delay_ms = {one.delay_ms: one for one in results.delivered if one.block == found.id}
    at, control = by_delay_ms.get(delay_ms), by_delay_ms.get(found.delays_ms[0])
    presented = listed([f"{delay:g}" for delay in found.delays_ms])
    return (
        f"As a number. {ms(delay_ms)} is what was asked for. {_achieved(at, control)} The display's own latency "
        "comes on top of it and is not in these numbers; only a photodiode at the corner of the screen measures it. "
        f"Only {presented} ms were presented: nothing was asked about delays between them."
    )


def _achieved(at: Delivered | None, control: Delivered | None) -> str:
    if at is None or at.achieved_ms is None:
        return "What was achieved was not measured."
    text = f"What was drawn was {number(at.achieved_ms, 1)} ms old on average, on the program's own clock"
    if control is None or control.achieved_ms is None:
        return f"{text}."
    return f"{text}, and {number(control.achieved_ms, 1)} ms at the shortest delay, with which it is compared."


def _as_lowest(found: BlockFound, delay_ms: float) -> Iterator[str]:
    lowest = {one.item: one.over_all_ms for one in LowestDelay.of(found)}
    at = [f"“{short(found, item)}”" for item, lowest_ms in lowest.items() if lowest_ms == delay_ms]
    below = [f"“{short(found, item)}”" for item, lowest_ms in lowest.items() if (lowest_ms or delay_ms) < delay_ms]
    people = counted(found.n, "participant")
    text = ""
    if below:
        text += f" For {listed(below)} a trend shows already below {ms(delay_ms)}."
    if at:
        text += (
            f" For {listed(at)} it is the lowest delay up to which the answers of these {people} show a trend, "
            "corrected for all statements."
        )
    yield (
        f"As a limit.{text or ' No statement has its lowest delay with a trend here.'} Such a delay depends on how "
        "many take part: more participants tend to find a lower one. It is an upper bound of what is noticed, and says "
        "nothing about what lies below it."
    )


def _as_claim(found: BlockFound, delay_ms: float) -> Iterator[str]:
    here = [one for one in ContrastsWithControl.of(found) if one.delay_ms == delay_ms]
    if not here:
        yield (
            f"As a claim. That answers at {ms(delay_ms)} are not significantly different would be no evidence that "
            "they are the same. To show that takes a bound of equivalence, decided before the study; there is none."
        )
        return
    first = here[0]
    bound = f"±{first.found.bound:g} {'point' if first.found.bound == 1 else 'points'}"
    verdicts = _by_verdict(found, here)
    yield (
        f"As a claim. A comparison that is not significant is no evidence that {ms(delay_ms)} goes unnoticed. What "
        f"would be is equivalence to {ms(first.control_ms)} within {bound}: {verdicts}{_needed(here)} "
        f"{_said(found, here)}"
    )


def _by_verdict(found: BlockFound, here: list[ContrastWithControl]) -> str:
    parts = []
    for verdict in VERDICTS:
        text = [f"“{short(found, one.item)}” ({_difference(one)})" for one in here if one.verdict == verdict]
        if text:
            parts.append(f"{verdict} for {listed(text)}")
    return "; ".join(parts) + "."


def _difference(one: ContrastWithControl) -> str:
    found = one.found
    people = "" if found.beyond is None else f", beyond the bound {beyond(found)}"
    if found.interval is None:
        return f"{number(found.effect)}, no interval: {found.no_interval}{people}"
    shown = f"{percent(found.interval.level)} interval {interval(found.interval)}"
    return f"{number(found.effect)}, {shown}{people}{_only(one)}"


def _only(one: ContrastWithControl) -> str:
    """Say which test alone would have decided otherwise."""
    found = one.found
    if one.verdict not in ("inconclusive", "out of reach"):
        return ""
    if found.p is not None and found.p <= found.alpha:
        if found.checks_agree is not False:
            return f", within the bound by every test, but {fewest(found.alpha)} participants are needed to call it so"
        return ", within the bound by t alone, which asks for normality"
    if found.p_difference is not None and found.p_difference <= found.alpha:
        return f", different only before Holm's correction for {one.members} comparisons"
    return ""


def _needed(here: list[ContrastWithControl]) -> str:
    needed = [one.found.n_needed for one in here if one.verdict != "equivalent" and one.found.n_needed]
    if not needed:
        return ""
    span = f"{min(needed)}" if min(needed) == max(needed) else f"{min(needed)} to {max(needed)}"
    return (
        f" With answers that spread as these do, showing it with 80 % power would take about {span} participants, if "
        "there were truly no difference; a spread estimated from few is itself uncertain."
    )


def _said(found: BlockFound, here: list[ContrastWithControl]) -> str:
    delay = ms(here[0].delay_ms)
    if all(one.verdict == "equivalent" for one in here):
        return (
            f"What can be said: at {delay} the mean answers to these statements stay within the bound. Not that "
            "nothing changes within it, not that no single person notices it (people beyond the bound: "
            f"{listed([beyond(one.found) for one in here])}), and not for other tasks or statements."
        )
    reasons = speaking_against(found, here[0].delay_ms)
    if reasons:
        return f"These data speak against the sentence “delays up to {delay} do not matter”: {'; '.join(reasons)}."
    return (
        f"So these data do not support the sentence “delays up to {delay} do not matter”, and do not refute it: they "
        f"are too few or too variable to decide.{_other_way(found, here[0].delay_ms)}"
    )


def _other_way(found: BlockFound, delay_ms: float) -> str:
    """Name the differences that go where they were not expected to go."""
    text = [_differs(found, one) for one in _differing(found, delay_ms) if not one.as_expected]
    if not text:
        return ""
    return f" Against the direction stated before the study: {'; '.join(text)}; that is a reason to look again."


class DelayMeaning(Finding[None]):
    """What a delay in milliseconds can and cannot mean: the sentence that is most easily said too strongly."""

    key = "meaning"
    place = 10
    part = "what a delay can mean"

    def section(self) -> Iterator[str]:
        """Yield what the delay of which one would most like to speak can and cannot mean."""
        delay_ms = tempting_ms(self.found)
        if delay_ms is None:
            return
        yield heading(3, f"What “{ms(delay_ms)}” can and cannot mean")
        yield box([paragraph(line) for line in meaning(self.found, self.results)], "care")
        if ContrastsWithControl.of(self.found):
            head = ("Delay", *(f"{verdict} in" for verdict in VERDICTS), "what can be said")
            yield table(head, by_delay(self.found), words=len(head))
