"""What a delay in milliseconds can and cannot mean: the sentence that is most easily said too strongly."""

from collections.abc import Iterator, Mapping
from typing import Final

from study_app.analysis.figures.picture import Picture
from study_app.analysis.findings.contrast_with_control import FINDING as CONTRASTS
from study_app.analysis.findings.contrast_with_control import ContrastWithControl
from study_app.analysis.findings.delay_trend import FINDING as TREND
from study_app.analysis.findings.lowest_delay import FINDING as LOWEST
from study_app.analysis.findings.lowest_delay import Lowest
from study_app.analysis.report.html_page import box, heading, paragraph, table
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.delivered_delay import Delivered
from study_app.analysis.results.finding import Finding
from study_app.analysis.results.words import beyond, counted, interval, listed, ms, number, p_equals, percent, short
from study_app.analysis.statistics.equivalence.tost import fewest

VERDICTS: Final = ("equivalent", "different", "inconclusive", "out of reach")


def tempting_ms(found: BlockFound) -> float | None:
    """Return the delay for which the report discusses whether it matters.

    It is the longest delay without contrary evidence; if every delay has some, the shortest added delay.
    """
    if len(found.delays_ms) < 2:
        return None
    calm = [delay for delay in found.delays_ms[1:] if not speaking_against(found, delay)]
    return max(calm) if calm and (CONTRASTS.of(found) or TREND.of(found)) else found.delays_ms[1]


def speaking_against(found: BlockFound, delay_ms: float) -> tuple[str, ...]:
    """Return the evidence against "delays up to this one do not matter", a clause for each statement.

    Evidence is a trend up to this delay or a shorter one, or a difference at one of them, in the direction stated
    before the study, if any. The error rate is controlled over all statements.
    """
    trends = {
        one.item: f"“{short(found, one.item)}” follows the delay already up to {ms(shown_ms)}{_exploratory(found, one)}"
        for one in LOWEST.of(found)
        if (shown_ms := one.over_all_ms) is not None and shown_ms <= delay_ms
    }
    differences: dict[str, str] = {}
    for one in _differing(found, delay_ms):
        if one.as_expected and one.item not in trends:
            differences.setdefault(one.item, _differs(found, one))
    return (*trends.values(), *differences.values())


def _differing(found: BlockFound, delay_ms: float) -> list[ContrastWithControl]:
    """Return the comparisons up to a delay that show a difference, corrected over all of them, shortest delay first."""
    different = [one for one in CONTRASTS.of(found) if one.verdict == "different" and one.delay_ms <= delay_ms]
    return sorted(different, key=lambda one: one.delay_ms)


def _differs(found: BlockFound, one: ContrastWithControl) -> str:
    sign = "+" if (one.found.effect or 0.0) > 0 else ""
    p = "" if one.p_adjusted is None else f", adjusted {p_equals(one.p_adjusted)}"
    return f"“{short(found, one.item)}” differs at {ms(one.delay_ms)} ({sign}{number(one.found.effect)}{p})"


def _exploratory(found: BlockFound, one: Lowest) -> str:
    suggested = any(trend.item == one.item and not trend.primary for trend in TREND.of(found))
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
    for delay_ms in dict.fromkeys(one.delay_ms for one in CONTRASTS.of(found)):
        here = [one for one in CONTRASTS.of(found) if one.delay_ms == delay_ms]
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
    lowest = {one.item: one.over_all_ms for one in LOWEST.of(found)}
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
    here = [one for one in CONTRASTS.of(found) if one.delay_ms == delay_ms]
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


def _section(found: BlockFound, results: Results, _pictures: Mapping[str, Picture]) -> Iterator[str]:
    """Yield what the delay of which one would most like to speak can and cannot mean."""
    delay_ms = tempting_ms(found)
    if delay_ms is None:
        return
    yield heading(3, f"What “{ms(delay_ms)}” can and cannot mean")
    yield box([paragraph(line) for line in meaning(found, results)], "care")
    if CONTRASTS.of(found):
        head = ("Delay", *(f"{verdict} in" for verdict in VERDICTS), "what can be said")
        yield table(head, by_delay(found), words=len(head))


FINDING: Final[Finding[None]] = Finding(
    key="meaning", place=10, empty=None, part="what a delay can mean", section=_section
)
