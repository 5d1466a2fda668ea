"""Findings about delays: equivalence to the shortest, the shortest with a trend, detection threshold, and reaching."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import pandas as pd

from study_app import number_text
from study_app.analysis.data.blocks import Block
from study_app.analysis.data.measures import AGREEMENT
from study_app.analysis.data.motion import OF_REACHES
from study_app.analysis.data.study_tables import groups_shown
from study_app.analysis.figures import answer_figures
from study_app.analysis.findings.finding import (
    FOUND,
    NO_EVIDENCE,
    Absent,
    Answer,
    BlockAnswers,
    Finding,
    Row,
    codes_of,
    test_row,
    uncorrected_entries,
)
from study_app.analysis.findings.statement_tests import ONE_DELAY, DelayTrend
from study_app.analysis.html_page import ends_of, heading, paragraph, table, table_of
from study_app.analysis.page_layout import Drawing, Picture, tab_separated
from study_app.analysis.results import (
    BlockResult,
    NotTested,
    Results,
    beyond_phrase,
    lead_phrase,
    min_sample,
    min_sample_reason,
    short_text,
)
from study_app.analysis.statistics.equivalence import STEPS, Equivalence, tost
from study_app.analysis.statistics.equivalence import Verdict as Nearness
from study_app.analysis.statistics.thresholds import Threshold, detection_threshold
from study_app.analysis.statistics.trend_tests import StepDown, Trend, step_down
from study_app.analysis.wording import (
    all_of,
    bound_text,
    counted,
    interval,
    listed,
    ms,
    number,
    p_equals,
    p_value,
    percent,
    significant,
    with_group,
)
from study_app.protocol.participants import EACH_GROUP, fewest_participants


@dataclass(frozen=True, slots=True)
class ContrastWithControl:
    """The equivalence test of one delay against the shortest, for one statement."""

    item: str
    delay_ms: float
    control_ms: float
    found: Equivalence

    @property
    def verdict(self) -> Nearness:
        """The verdict: "equivalent" only if every test shows it."""
        return self.found.verdict


def equivalent_up_to(against: tuple[ContrastWithControl, ...]) -> dict[str, float | None]:
    """Return the longest delay, by statement, up to which all delays are equivalent.

    The delays are tested in a fixed order, so no correction is needed. A delay counts as equivalent only if every test
    shows it.
    """
    longest: dict[str, float | None] = {}
    stopped = set()
    for tested in against:
        longest.setdefault(tested.item, None)
        if tested.verdict != "equivalent":
            stopped.add(tested.item)
        elif tested.item not in stopped:
            longest[tested.item] = tested.delay_ms
    return longest


def _comparison_notes(against: Sequence[ContrastWithControl]) -> Iterator[str]:
    """Yield sentences on the method and the limitations of the comparisons with the shortest delay."""
    first = against[0].found
    yield (
        f"Each comparison uses two one-sided t tests with equivalence bounds of {bound_text(first.bound)}, and a "
        f"{percent(1 - 2 * first.alpha)} confidence interval. Equivalent: both the t tests and the bootstrap show that "
        f"the mean difference lies within the bounds, and the study has {min_sample_reason(first.alpha, first.bound)}. "
        "Not equivalent: the whole confidence interval lies outside the bounds; this verdict is not corrected for the "
        "number of comparisons. Inconclusive: neither verdict is supported, which is not evidence of a difference. "
        "Out of reach: with so few participants, no set of answers could have shown equivalence. Intervals for the "
        "proportion of participants outside the bounds are 95 % Clopper–Pearson intervals."
    )
    disagree = sum(tested.found.checks_agree is False for tested in against)
    if disagree:
        yield (
            f"* The t tests and the bootstrap disagree in {disagree} of {len(against)} comparisons. A comparison "
            "counts as equivalent only if both show equivalence."
        )


_VERDICTS: Final = ("equivalent", "not equivalent", "inconclusive", "out of reach")


def rows_by_delay(result: BlockResult) -> list[list[str]]:
    """Return one table row for each delay: the delay, the statements with each verdict, and a concluding sentence."""
    rows = []
    for delay_ms in dict.fromkeys(tested.delay_ms for tested in ContrastsWithControl.value_in(result)):
        at_delay = [tested for tested in ContrastsWithControl.value_in(result) if tested.delay_ms == delay_ms]
        cells = [
            ", ".join(short_text(result, tested.item) for tested in at_delay if tested.verdict == verdict) or "–"
            for verdict in _VERDICTS
        ]
        rows.append([ms(delay_ms), *cells, _delay_conclusion(result, delay_ms, at_delay)])
    return rows


def _delay_conclusion(result: BlockResult, delay_ms: float, comparisons: Sequence[ContrastWithControl]) -> str:
    if all(tested.verdict == "equivalent" for tested in comparisons):
        not_excluded = _minority_phrase([tested.found for tested in comparisons])
        return f"The mean answers to these statements stay within the bounds, but {not_excluded}."
    reasons = _evidence_up_to(result, delay_ms)
    if not reasons:
        return f"These data neither support nor refute the claim that delays of up to {ms(delay_ms)} do not matter."
    unclear = [
        f"“{short_text(result, tested.item)}”"
        for tested in comparisons
        if tested.verdict in ("inconclusive", "out of reach")
    ]
    limit = (
        f" For {listed(unclear)}, the data do not show whether the mean difference at {ms(delay_ms)} exceeds the bound."
        if unclear
        else ""
    )
    return f"Delays of up to {ms(delay_ms)} change the answers: {'; '.join(reasons)}.{limit}"


def _evidence_up_to(result: BlockResult, delay_ms: float) -> tuple[str, ...]:
    """Return phrases with the evidence that delays up to this one change answers.

    Evidence is a trend up to this delay or a shorter one, with the error rate controlled over all statements, or an
    interval outside the bound.
    """
    exploratory = {trend.item for trend in DelayTrend.value_in(result) if not trend.primary}
    trends: dict[float, list[str]] = {}
    for lowest in LowestDelay.value_in(result):
        if (shown_ms := lowest.over_all_ms) is not None and shown_ms <= delay_ms:
            note = " (exploratory)" if lowest.item in exploratory else ""
            trends.setdefault(shown_ms, []).append(f"“{short_text(result, lowest.item)}”{note}")
    beyond: dict[str, list[str]] = {}
    for tested in ContrastsWithControl.value_in(result):
        if tested.verdict == "not equivalent" and tested.delay_ms <= delay_ms:
            beyond.setdefault(tested.item, []).append(ms(tested.delay_ms))
    differing = [f"“{short_text(result, item)}” (at {listed(delays)})" for item, delays in beyond.items()]
    return (
        *(
            f"agreement with {listed(items)} shows a trend over delays of up to {ms(at)}"
            for at, items in sorted(trends.items())
        ),
        *(
            [f"mean answers differ from those at the shortest delay by more than the bound for {listed(differing)}"]
            if differing
            else []
        ),
    )


def common_ms(result: BlockResult) -> float | None:
    """Return the longest delay up to which all statements are equivalent, or None."""
    delays = list(equivalent_up_to(ContrastsWithControl.value_in(result)).values())
    equivalent_delays = [delay for delay in delays if delay is not None]
    return min(equivalent_delays) if equivalent_delays and len(equivalent_delays) == len(delays) else None


class ContrastsWithControl(Finding[tuple[ContrastWithControl, ...]]):
    """Equivalence of each delay to the shortest one."""

    key = "against"
    place = 7
    row_place = 10
    what = "equivalence test"
    kinds = ("delays",)
    waits = ("delays",)
    empty = ()

    @classmethod
    def test(cls, answers: BlockAnswers, result: BlockResult) -> tuple[tuple[ContrastWithControl, ...], Absent]:
        """Compare every delay with the shortest one, using the planned bound."""
        bound, delays_ms = answers.decided.equivalence_bound, answers.block.delays_ms
        if answers.k < 2:
            return (), (NotTested(cls.what, ONE_DELAY),)
        if bound is None:
            why = (
                "the protocol does not specify an equivalence bound, and a bound chosen now could be influenced by "
                "the answers"
            )
            return (), (NotTested(cls.what, why),)
        compared = []
        for item in answers.block.items:
            values = answers.values[item.id]
            for place, delay_ms in enumerate(delays_ms[1:], start=1):
                differences = values[:, place] - values[:, 0]
                tested = tost(differences, bound, alpha=answers.decided.alpha, seed=answers.seed)
                compared.append(ContrastWithControl(item.id, delay_ms, delays_ms[0], tested))
        return tuple(compared), ()

    @classmethod
    def entries(cls, result: BlockResult) -> Mapping[str, Any]:
        against = cls.value_in(result)
        up_to = equivalent_up_to(against) if cls.key in result.findings else None
        return {cls.key: against, "equivalent_up_to": up_to}

    def rows(self) -> Iterator[Row]:
        for against in self.value:
            row = test_row(self.result, "a delay is equivalent", against.found)
            yield (
                row
                | uncorrected_entries(self.result, f"{against.item} at {against.delay_ms:g} ms")
                | {
                    "item": against.item,
                    "comparison": f"{against.delay_ms:g} ms − {against.control_ms:g} ms",
                    "verdict": against.verdict,
                    "codes": codes_of(self.result, against.delay_ms, against.control_ms),
                }
            )

    def section(self) -> Iterator[str]:
        """Yield the comparisons of each delay with the shortest."""
        if not self.value:
            return
        control = ms(self.value[0].control_ms)
        yield heading(3, f"Comparison of each delay with {control}")
        yield table_of(
            self.value,
            ("Statement", lambda tested: short_text(self.result, tested.item)),
            ("Comparison", lambda tested: f"{ms(tested.delay_ms)} − {control}"),
            ("n", lambda tested: str(tested.found.n)),
            ("mean difference", lambda tested: number(tested.found.effect)),
            *ends_of(lambda tested: tested.found.interval, level=1 - 2 * self.value[0].found.alpha),
            ("participants outside the bounds", lambda tested: beyond_phrase(tested.found)),
            ("p (t tests)", lambda tested: p_value(tested.found.p)),
            ("p (bootstrap)", lambda tested: p_value(tested.found.p_bootstrap)),
            ("Verdict", lambda tested: tested.verdict + (" *" if tested.found.checks_agree is False else "")),
            words=2,
            last=1,
        )
        yield paragraph(" ".join(_comparison_notes(self.value)), "soft")
        head = ("Delay", *(f"{verdict} in" for verdict in _VERDICTS), "Conclusion")
        yield table(head, rows_by_delay(self.result), words=len(head), folded=True)

    def limits(self) -> Iterator[str]:
        against, result = self.value, self.result
        if not against:
            return
        first, lead, control = against[0].found, lead_phrase(result), ms(against[0].control_ms)
        if result.n < fewest_participants(first.alpha, first.bound, STEPS):
            yield (
                f"{lead}: to show that a mean answer stays within {bound_text(first.bound)} of that at {control}, a "
                f"study needs {min_sample_reason(first.alpha, first.bound)}. This study has "
                f"{counted(result.n, 'participant')}"
                f"{', so it can show only that a mean answer differs by more' if result.n > 1 else ''}."
            )
        undecided = sum(tested.verdict in ("inconclusive", "out of reach") for tested in against)
        if undecided:
            yield (
                f"{lead}: in {undecided} of {number_text.counted(len(against), 'comparison')} with {control} (one "
                f"for each statement and delay), the data show neither that the mean answer stays within "
                f"{bound_text(first.bound)} nor that it differs by more."
            )

    def methods(self) -> Iterator[str]:
        if self.value:
            first = self.value[0].found
            beforehand = " (stated before the first session)" if self.results.decided.binding else ""
            yield (
                f"Each delay was compared with {ms(self.value[0].control_ms)} using two one-sided t tests on paired "
                f"differences, with equivalence bounds of {bound_text(first.bound)}{beforehand} and "
                f"{percent(1 - 2 * first.alpha)} confidence intervals. A delay was classified as equivalent only if a "
                "bootstrap that includes one hypothetical participant as extreme as the most extreme participant in "
                "the sample (Gaffke 2005) also showed equivalence, and only with "
                f"{min_sample(first.alpha, first.bound)}. It was classified as not equivalent if the whole confidence "
                "interval lay outside the bounds."
            )


@dataclass(frozen=True, slots=True)
class LowestTrend:
    """The shortest delay with a trend in one statement, found by stepping down.

    ``steps`` control the error rate within the statement. ``over_all_ms``, the lowest delay whose steps all have
    p ≤ alpha / ``members``, controls it over all statements of the family.
    """

    item: str
    steps: StepDown
    members: int = 1

    @property
    def over_all_ms(self) -> float | None:
        """The lowest delay with a trend, with the error rate controlled over all statements; None without a trend."""
        lowest = None
        for step in self.steps.steps:
            if step.trend.p is None or step.trend.p > self.steps.alpha / self.members:
                break
            lowest = step.longest_ms
        return lowest

    def trend_up_to(self, longest_ms: float) -> Trend:
        """Return the test of the delays up to ``longest_ms``, one of the steps."""
        return next(step.trend for step in self.steps.steps if step.longest_ms == longest_ms)


class LowestDelay(Finding[tuple[LowestTrend, ...]]):
    """The shortest delay with a trend, stepping down from the longest."""

    key = "lowest"
    place = 6
    row_place = 9
    what = "shortest delay with a trend"
    kinds = ("delays",)
    waits = ("delays",)
    empty = ()

    @classmethod
    def test(cls, answers: BlockAnswers, result: BlockResult) -> tuple[tuple[LowestTrend, ...], Absent]:
        """Step down in the statements that show a trend over all delays."""
        trends, lowest = DelayTrend.value_in(result), []
        significant = [trend for trend in trends if trend.verdict in FOUND]
        for test in significant:
            direction, alpha = answers.decided.direction(test.item), answers.decided.alpha
            steps = step_down(answers.values[test.item], answers.block.delays_ms, direction, alpha=alpha)
            lowest.append(LowestTrend(test.item, steps, test.members))
        if trends and not significant:
            why = "no statement shows a trend across all delays, but participants may still notice the delays"
            return (), (NotTested(cls.what, why),)
        return tuple(lowest), ()

    def rows(self) -> Iterator[Row]:
        for lowest in self.value:
            for step in lowest.steps.steps:
                row = test_row(self.result, "answers change with the delay, step-down test", step.trend)
                row |= uncorrected_entries(self.result, f"stepping down within {lowest.item}") | {
                    "members": len(lowest.steps.steps)
                }
                row |= {
                    "correction": "none: the tests are run in a fixed sequence that stops at the first "
                    "non-significant result"
                }
                yield row | {"item": lowest.item, "comparison": f"up to {step.longest_ms:g} ms"}

    def section(self) -> Iterator[str]:
        """Yield the shortest delay with a trend, by statement."""
        if not self.value:
            return
        yield heading(3, "The shortest delay with a trend")
        yield table_of(
            self.value,
            ("Statement", lambda lowest: short_text(self.result, lowest.item)),
            ("shortest", lambda row: "–" if row.over_all_ms is None else f"≤ {ms(row.over_all_ms)}"),
            ("uncorrected", lambda row: "–" if row.steps.lowest_ms is None else f"≤ {ms(row.steps.lowest_ms)}"),
            (
                "longest delay and p at each step",
                lambda lowest: "; ".join(
                    f"{ms(step.longest_ms)} {p_value(step.trend.p)}" for step in lowest.steps.steps
                ),
            ),
            words=4,
        )
        yield paragraph(
            "If there is a trend, the longest delay is dropped and the trend is tested again; this is repeated until "
            f"no trend remains. {self._criterion()}. The shortest delay is an upper bound: it tends to be too long "
            "rather than too short, because with few participants only long delays show a trend.",
            "soft",
        )

    def _criterion(self) -> str:
        """Return a clause on the p values that the steps require, by family of statements."""
        families = {test.primary: test.members for test in DelayTrend.value_in(self.result)}
        limits = {primary: f"alpha / {members}" if members > 1 else "alpha" for primary, members in families.items()}
        if set(limits.values()) == {"alpha"}:
            return "Every step requires p ≤ alpha"
        required = f"p ≤ {next(iter(limits.values()))} at every step"
        across = all_of(next(iter(families.values())), "statement")
        if len(families) > 1:
            required = (
                f"p ≤ {limits[True]} for primary and p ≤ {limits[False]} for exploratory statements at every step"
            )
            across = "the primary and across the exploratory statements"
        return (
            f"“Shortest” requires {required}, which controls the error rate across {across}; “uncorrected” requires "
            "p ≤ alpha, which controls it only within a single statement"
        )


class DetectionThreshold(Finding[Threshold | None]):
    """The detection threshold for a delay: a psychometric function fitted to the answers to one statement."""

    key = "threshold"
    place = 8
    row_place = 11
    what = "detection threshold"
    kinds = ("delays",)
    waits = ("delays",)
    figure_name = "threshold"
    figure_title = "Agreement as a function of delay"

    @classmethod
    def test(cls, answers: BlockAnswers, result: BlockResult) -> tuple[Threshold | None, Absent]:
        item = answers.decided.noticed
        if item is None or item not in answers.values:
            return None, (NotTested(cls.what, "the protocol does not specify a detection question (analysis.noticed)"),)
        rising = [
            test.item
            for test in DelayTrend.value_in(result)
            if test.verdict in FOUND and (test.outcome.effect or 0.0) > 0
        ]
        if item not in rising:
            return None, (NotTested(cls.what, "the tests do not show that agreement increases with the delay"),)
        return detection_threshold(answers.single[item], answers.block.delays_ms), ()

    def rows(self) -> Iterator[Row]:
        threshold = self.value
        if threshold is not None:
            yield test_row(self.result, "a delay is noticed", threshold)

    def section(self) -> Iterator[str]:
        """Yield the detection threshold, or the reason why there is none."""
        threshold = self.value
        if threshold is None:
            return
        yield heading(3, "At what delay do participants notice a difference?")
        counts = ", ".join(
            f"{yes} of {asked} at {ms(level)}"
            for level, yes, asked in zip(threshold.levels, threshold.yes, threshold.asked, strict=True)
        )
        if threshold.effect is None:
            yield paragraph(
                f"No threshold could be estimated: {threshold.note}. Answers that express agreement (5 to 7): {counts}."
            )
            yield from self.figure_html()
            return
        yield paragraph(
            f"Detection threshold: {number(threshold.effect, 0)} ms, {_threshold_interval(threshold)}, n = "
            f"{threshold.n}. {_threshold_definition(threshold)} Answers that express agreement (5 to 7): {counts}. "
            f"{threshold.note[:1].upper()}{threshold.note[1:]}. Fit: {threshold.method}. Agreement is not the same as "
            "answering “yes”: a participant who “somewhat agrees” may have noticed little difference."
        )
        yield from self.figure_html()

    def figure(self, drawing: Drawing) -> Picture | None:
        threshold = self.value
        if threshold is None or not any(threshold.asked) or drawing.study.split == EACH_GROUP:
            return None  # each group has its own figure
        lowest = min(
            (lowest.over_all_ms for lowest in LowestDelay.value_in(drawing.result) if lowest.over_all_ms is not None),
            default=None,
        )
        curve = f"There is no curve, because {threshold.note}."
        if threshold.effect is not None:
            curve = (
                f"Curve: {threshold.method}; diamond: the detection threshold, {number(threshold.effect, 0)} ms "
                f"({_threshold_interval(threshold)}). {_threshold_definition(threshold)}"
            )
        dashed = (
            ""
            if lowest is None
            else f" Dashed line: the shortest delay at which any statement shows a trend, {ms(lowest)}."
        )
        caption = (
            "Proportion of answers that express agreement (5 to 7), as a function of the requested delay "
            f"({drawing.simulated}n = {threshold.n}). Small points: individual participants. {curve}{dashed}"
        )
        proportions = self._shares(drawing)
        numbers = tab_separated(
            drawing.study, pd.DataFrame(proportions).T.rename(columns=ms).rename_axis("participant").reset_index()
        )
        draw = partial(answer_figures.draw_threshold, threshold, proportions, lowest)
        return drawing.picture(self.figure_title, caption, draw, (f"n = {threshold.n}",), numbers)

    def _shares(self, drawing: Drawing) -> dict[str, dict[float, float]]:
        """Return, for each participant, the proportion of answers that agree, by delay."""
        answers = drawing.study.answers(drawing.block)
        rows = answers[(answers["item"] == self.results.decided.noticed) & answers["response"].notna()]
        delays_ms = {setting.code: setting.delay_ms or 0.0 for setting in drawing.result.settings}
        rows = rows.assign(delay=rows["code"].map(delays_ms).astype(float), agrees=rows["response"].isin(AGREEMENT))
        people = rows.groupby("participant", sort=True)
        return {str(person): dict(person_rows.groupby("delay")["agrees"].mean()) for person, person_rows in people}

    def methods(self) -> Iterator[str]:
        if self.value is not None:
            yield (
                "The detection threshold is the delay at which a logistic function, fitted to agreement (5 to 7) in "
                "individual answers pooled across participants, lies halfway between the guess rate and one minus the "
                "lapse rate (posterior median). Its 95 % interval is widened to allow for differences between "
                "participants. The threshold is reported only if the statement shows a trend and the threshold lies "
                "within the range of presented delays."
            )


def _threshold_interval(threshold: Threshold) -> str:
    if threshold.interval is None:
        return threshold.no_interval
    return f"95 % interval {interval(threshold.interval, 0)} ms"


def _threshold_definition(threshold: Threshold) -> str:
    """Return a sentence that defines a detection threshold and gives the proportion of agreement there."""
    return (
        "The threshold is the delay at which the fitted function lies halfway between the guess rate "
        f"({percent(threshold.guess or 0.0)}) and one minus the lapse rate ({percent(threshold.lapse or 0.0)}). At "
        f"this delay, {percent(threshold.half_way or 0.0)} of answers express agreement."
    )


class _FirstNoticedDelay(Finding[None]):
    """The first page's answer: the delay from which participants notice a difference."""

    key = "noticed from"
    place = 21
    kinds = ("delays",)
    question = "At what delay do participants begin to notice a difference?"
    answer_figures = ("threshold", "delays")

    def answer(self) -> Answer:
        """Return the shortest delay with a change, from primary statements or else from exploratory ones."""
        decided, threshold = self.results.decided, DetectionThreshold.value_in(self.result)
        fitted = decided.noticed if threshold is not None and threshold.effect is not None else None
        for primary, verdict in ((True, "shown"), (False, "suggested")):
            text = self._shortest([item.id for item in self.result.items if decided.is_primary(item.id) == primary])
            is_fitted = fitted is not None and decided.is_primary(fitted) == primary
            if not text and is_fitted:
                text = (
                    "Agreement increases with the delay, but we could not show that participants noticed any "
                    "particular delay."
                )
            if text:
                return self.make_answer(verdict, f"{self._threshold_text() if is_fitted else ''}{text}", claims=True)
        return self.make_answer("not shown", f"We could not show that participants noticed any delay. {NO_EVIDENCE}")

    def _shortest(self, items: Sequence[str]) -> str:
        """Return a sentence on the shortest delay that changes one of these statements, or ""."""
        lowest = [
            lowest
            for lowest in LowestDelay.value_in(self.result)
            if lowest.over_all_ms is not None and lowest.item in items
        ]
        if not lowest:
            return ""
        at = min(row.over_all_ms or 0.0 for row in lowest)
        rated = [
            f"{'higher' if correlation > 0 else 'lower'} on “{short_text(self.result, row.item)}” "
            f"(mean rank correlation {number(correlation)}, {p_equals(trend.p)}, n = {trend.n})"
            for row in lowest
            if row.over_all_ms == at
            and (trend := row.trend_up_to(at)).p is not None
            and (correlation := self._correlation(row, trend))
        ]
        members, alpha = lowest[0].members, lowest[0].steps.alpha
        criterion = f"{significant(alpha / members)} ({significant(alpha)} / {members})"
        corrected = f" With {counted(members, 'statement')} tested, p ≤ {criterion} is significant."
        return (
            f"Over delays of {self.result.delays_ms[0]:g} to {ms(at)}, participants tended to rate longer delays "
            f"{listed(rated)}.{corrected * (members > 1)} Participants may also notice shorter delays. The test "
            "compares ranks, not mean ratings."
        )

    def _threshold_text(self) -> str:
        """Return a sentence on the detection threshold, with a leading space."""
        threshold = DetectionThreshold.value_in(self.result)
        if threshold is None or threshold.effect is None:
            return ""
        item = short_text(self.result, self.results.decided.noticed or "")
        return (
            f"The detection threshold is {number(threshold.effect, 0)} ms ({_threshold_interval(threshold)}, n = "
            f"{threshold.n}); at this delay, {percent(threshold.half_way or 0.0)} of answers express agreement with "
            f"“{item}”. "
        )

    def _correlation(self, lowest: LowestTrend, trend: Trend) -> float:
        """Return the mean rank correlation of a trend, negative if answers fall with the delay."""
        falling = self.results.decided.direction(lowest.item) == "decreasing"
        return (trend.effect or 0.0) * (-1 if falling else 1)


class _EquivalentDelays(Finding[None]):
    """The first page's answer: the delay up to which answers do not change by a relevant amount."""

    key = "unchanged up to"
    place = 22
    kinds = ("delays",)
    question = "Up to what delay do answers remain practically unchanged?"
    answer_figures = ("effects",)

    def answer(self) -> Answer:
        """Return the longest delay up to which mean answers are equivalent to those at the shortest delay."""
        against = ContrastsWithControl.value_in(self.result)
        if not against:
            why = next(
                (not_tested.why for not_tested in self.result.absent if "equivalence" in not_tested.what),
                "there was no comparison",
            )
            return self.make_answer("not tested", f"This was not tested, because {why}.")
        at, within = common_ms(self.result), _bounds_phrase(against[0])
        if at is None:
            fewest = fewest_participants(against[0].found.alpha, against[0].found.bound, STEPS)
            needed = f" (at least {fewest} participants are needed)" if self.result.n < fewest else ""
            return self.make_answer(
                "inconclusive",
                f"{_NO_DELAY.format(within + needed)} {_largest_text(self.result, against)}{_beyond_text(against)}",
            )
        statements = all_of(len(equivalent_up_to(against)), "statement")
        proportion = _minority_phrase([tested.found for tested in against if tested.delay_ms <= at])
        text = f"Up to {ms(at)}, mean answers to {statements} stay {within}, but {proportion}."
        return self.make_answer("equivalent", text)


_NO_DELAY: Final = "We could not show for any delay that the mean answers to all statements stay {}."


def _largest_text(result: BlockResult, against: Sequence[ContrastWithControl]) -> str:
    """Return a sentence on the largest mean difference with its interval, with a leading space, or ""."""
    comparisons = [
        tested for tested in against if tested.found.effect is not None and tested.found.interval is not None
    ]
    if not comparisons:
        return ""
    largest = max(comparisons, key=lambda tested: abs(tested.found.effect or 0.0))
    return (
        f"The largest mean difference is {number(largest.found.effect)} points (“{short_text(result, largest.item)}” "
        f"at {ms(largest.delay_ms)}, {percent(1 - 2 * largest.found.alpha)} confidence interval "
        f"{interval(largest.found.interval)}, n = {largest.found.n}). "
    )


def _beyond_text(against: Sequence[ContrastWithControl]) -> str:
    """Return a sentence on the comparisons that are not equivalent, with their delays, or that there are none."""
    beyond = [tested.delay_ms for tested in against if tested.verdict == "not equivalent"]
    if not beyond:
        return "Failing to show equivalence is not evidence that answers change."
    delays = listed([f"{delay_ms:g}" for delay_ms in sorted({*beyond})])
    return (
        f"In {len(beyond)} of {number_text.counted(len(against), 'comparison')} (at {delays} ms), the whole confidence "
        "interval lies outside the equivalence bounds (not equivalent; not corrected for the number of comparisons)."
    )


def _minority_phrase(tested: Sequence[Equivalence]) -> str:
    """Return a phrase on the proportion of people who may differ by more than the bound."""
    most = max(
        (equivalence.beyond.interval.high for equivalence in tested if equivalence.beyond is not None), default=1.0
    )
    return f"the data do not rule out the possibility that up to {100 * most:.0f} % of people show a larger difference"


def _bounds_phrase(against: ContrastWithControl) -> str:
    return f"within {bound_text(against.found.bound)} of those at {ms(against.control_ms)}"


_MEASURES: Final = ("Movement time, s", "Path, mm", "Overshoot, mm", "Submovements")
"""The titles of `OF_REACHES`."""


def _limits_sentence(block: Block, results: Results) -> str:
    """Return a sentence on the number of trials within the limits."""
    deliveries = [delivered for delivered in results.delivered if delivered.block == block.id]
    judged, valid = sum(delivered.judged for delivered in deliveries), sum(delivered.valid for delivered in deliveries)
    if not judged:
        return "No data are available on whether trials met the protocol's limits."
    return f"{valid} of {judged} trials met the protocol's limits; all trials are included."


class Movement(Finding[None]):
    """The figure of reaching movements by delay, measured from recordings."""

    key = "movement"
    place = 11
    figure_name = "movement"
    figure_title = "Reaching as a function of added delay"

    def section(self) -> Iterable[str]:
        return self.figure_html()

    def figure(self, drawing: Drawing) -> Picture | None:
        block, measured = drawing.block, drawing.results.performance
        if not drawing.result.delays_ms or measured is None or not measured.recorded_in(block.id):
            return None
        medians = measured.medians(block.id).reset_index()
        medians = medians[medians["participant"].isin(drawing.study.people)]

        def values_of(people: Sequence[str], measure: str) -> Any:
            rows = medians[medians["participant"].isin(people)]
            return rows.pivot(index="participant", columns="code", values=measure)[list(block.codes)].to_numpy()

        measures = [*zip(_MEASURES, OF_REACHES, strict=True)]
        groups = groups_shown(drawing.study)
        plots = [
            (with_group(title, group), values_of(part.people, measure))
            for group, part in groups
            for title, measure in measures
        ]
        scales = [values_of(drawing.study.people, measure) for _, measure in measures] * len(groups)
        people = medians["participant"].nunique()
        n = counted(people, "participant")
        footnote = (
            "Added delay in ms. Each point is a participant's median across the reaches in a trial, excluding the "
            "first reach."
        )
        caption = (
            f"Reaching movements as a function of the requested delay ({drawing.simulated}n = {people} with "
            f"recordings). Thin lines: {answer_figures.line_text(people)}; thick line: median; band: interquartile "
            "range. Movement time is measured from the moment a target lights up until the hand enters it for the "
            f"last time. The axes do not start at zero. {_limits_sentence(block, drawing.results)}"
        )
        delays_ms = [setting.delay_ms or 0.0 for setting in block.settings]
        draw = partial(answer_figures.draw_answers, plots, delays_ms, [None] * len(plots), footnote, own_scales=scales)
        numbers = tab_separated(drawing.study, medians)
        return drawing.picture(self.figure_title, caption, draw, (f"{n} with recordings", n), numbers)
