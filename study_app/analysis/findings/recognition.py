"""Recognition of liquids by the statement with the highest rating, and the first page's answer about it."""

from collections.abc import Container, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np
import pandas as pd

from study_app import number_text
from study_app.analysis.data.blocks import name_in_sentence
from study_app.analysis.figures import answer_figures
from study_app.analysis.findings.finding import (
    FOUND,
    NO_EVIDENCE,
    Absent,
    Answer,
    BlockAnswers,
    Finding,
    Row,
    test_row,
    uncorrected_entries,
)
from study_app.analysis.findings.statement_tests import Effects, Pairs, SettingsDiffer
from study_app.analysis.html_page import ends_of, heading, paragraph, table_of
from study_app.analysis.page_layout import Drawing, Picture, tab_separated
from study_app.analysis.results import BlockResult, NotTested, Verdict, name, short_text
from study_app.analysis.statistics.recognition_tests import MOST as MOST_NAMED
from study_app.analysis.statistics.recognition_tests import Recognition, named_labels, recognition
from study_app.analysis.wording import interval, listed, number, p_equals, p_value
from study_app.protocol.participants import EACH_GROUP

_NONE_RECOGNISED: Final = "We could not show that participants recognised any liquid above chance."
_NO_SINGLE_LIQUID: Final = "We could not show for any single liquid that it was recognised above chance."


@dataclass(frozen=True, slots=True)
class RecognitionResult:
    """The result of the recognition test: the items that name a liquid, and the correct item of each setting (code)."""

    labels: tuple[str, ...]
    settings: tuple[str, ...]
    right: tuple[str | None, ...]
    found: Recognition
    verdict: Verdict


class LiquidRecognition(Finding[RecognitionResult | None]):
    """Recognition of liquids: the statement with the highest rating names the liquid."""

    key = "named"
    place = 4
    row_place = 8
    what = "recognition test"
    kinds = ("liquids",)
    waits = ("liquids",)
    figure_name = "recognition"
    figure_title = "Names given to each liquid"

    @classmethod
    def test(cls, answers: BlockAnswers, result: BlockResult) -> tuple[RecognitionResult | None, Absent]:
        """Test whether settings were named correctly more often than by chance."""
        labels = answers.decided.names
        correct_labels = tuple(setting.label for setting in answers.block.settings)
        if not labels and not any(correct_labels):
            return None, ()  # the study does not ask participants to recognise liquids
        if not labels or not set(labels) <= answers.values.keys() or not any(correct_labels):
            return None, (NotTested(cls.what, "the protocol does not specify which statements name these liquids"),)
        if not 2 <= answers.k <= MOST_NAMED or len(labels) < 2:
            return None, (NotTested(cls.what, f"the test needs 2 to {MOST_NAMED} conditions and at least two names"),)
        ratings = np.stack([answers.values[label] for label in labels], axis=2)
        correct_indices = [None if label is None else labels.index(label) for label in correct_labels]
        tested = recognition(named_labels(ratings), correct_indices, len(labels), seed=answers.intervals)
        verdict = answers.verdict(tested.p, tested.smallest_p, primary=answers.decided.binding)
        return RecognitionResult(labels, answers.block.codes, correct_labels, tested, verdict), ()

    def rows(self) -> Iterator[Row]:
        recognition_result = self.value
        if recognition_result is not None:
            row = test_row(self.result, "liquids are recognised", recognition_result.found) | uncorrected_entries(
                self.result, "recognition"
            )
            yield row | {"verdict": recognition_result.verdict}

    def section(self) -> Iterator[str]:
        recognition_result = self.value
        if recognition_result is None:
            return
        yield heading(3, "Were the liquids recognised?")
        yield from self.figure_html()
        yield table_of(
            sorted(recognition_result.found.rates, key=lambda rate: rate.setting),
            ("Liquid", lambda rate: self.result.names[rate.setting]),
            ("correct", lambda rate: str(rate.hits)),
            ("n", lambda rate: str(rate.n)),
            ("undecided", lambda rate: str(recognition_result.found.table[rate.setting][_UNDECIDED_COLUMN])),
            ("proportion", lambda rate: number(rate.rate)),
            *ends_of(lambda rate: rate.interval),
            ("closest other liquid", lambda rate: "–" if rate.rival is None else self.result.names[rate.rival]),
            ("p", lambda rate: p_value(rate.p)),
            ("adjusted p", lambda rate: p_value(rate.p_adjusted)),
        )
        outcome = recognition_result.found
        if outcome.p is None:
            yield paragraph(f"Not tested: {outcome.note}.")
            return
        yield paragraph(
            f"Correct names: {number(outcome.statistic, 0)}; {number(outcome.expected, 1)} expected by chance; "
            f"{p_equals(outcome.p)} ({outcome.method}; smallest attainable {p_equals(outcome.smallest_p or 0.0)}): "
            f"{recognition_result.verdict}. {_kappa_text(outcome)} {_undecided_text(outcome)}This is a single test, "
            "so its p value is not corrected."
        )
        kappa_note = "" if outcome.interval is None else f" Confidence interval for kappa: {outcome.interval.method}."
        yield paragraph(
            f"Confidence intervals for proportions are Clopper–Pearson intervals.{kappa_note} For each liquid, a "
            "within-participant test (McNemar's exact test, one-sided) shows whether its name was used more often for "
            "it than for each of the others. The table shows the largest of these p values and the liquid for which "
            "it was obtained (the closest other liquid). Adjusted p values are Holm-corrected across the liquids.",
            "soft",
        )

    def figure(self, drawing: Drawing) -> Picture | None:
        study, block, recognition_result = drawing.study, drawing.block, self.value
        if recognition_result is None or study.split == EACH_GROUP:  # each group has its own figure
            return None
        shorts = {item.id: item.short for item in self.result.items}
        right = [
            None if label is None else recognition_result.labels.index(label) for label in recognition_result.right
        ]
        hits, expected = recognition_result.found.statistic, recognition_result.found.expected
        chance = ""
        if hits is not None and expected is not None and recognition_result.found.p is not None:
            chance = (
                f" Correct: {hits:g}; {number(expected, 1)} expected by chance (liquids permuted within each "
                f"participant; exact, one-sided, {p_equals(recognition_result.found.p)})."
            )
        caption = (
            "The name that was rated highest for each liquid "
            f"({drawing.simulated}{answer_figures.counts(study, block)[0]}). Cells show counts and row percentages; "
            f"correct names are outlined. Undecided: two or more names were tied for the highest rating.{chance}"
        )
        labels = [shorts[label] for label in recognition_result.labels]
        table = pd.DataFrame(recognition_result.found.table, self.result.names, [*labels, "undecided", "unanswered"])
        return drawing.picture(
            self.figure_title,
            caption,
            partial(answer_figures.draw_recognition, recognition_result.found.table, self.result.names, labels, right),
            answer_figures.counts(study, block),
            tab_separated(study, table.rename_axis("liquid").reset_index()),
        )

    def methods(self) -> Iterator[str]:
        if self.value is not None:
            yield (
                "Participants were considered to have named the liquid whose statement they rated highest; ties for "
                "the highest rating were treated as undecided and scored as incorrect. The number of correct names "
                "was tested by permuting the liquids within participants (exact, one-sided). In addition, a liquid was "
                "classified as recognised only if its name was used more often for it than for each of the others "
                "(McNemar's exact test within participants, one-sided, with p values Holm-adjusted across the liquids)."
            )


_UNDECIDED_COLUMN: Final = -2
"""The index of the column of undecided answers in `Recognition.table`."""


def _kappa_text(outcome: Recognition) -> str:
    """Return a sentence on kappa, with its interval and the number of answers."""
    if outcome.effect is None:
        return f"Cohen's kappa could not be calculated ({outcome.no_interval.removeprefix('no interval: ')})."
    ends = outcome.no_interval if outcome.interval is None else f"95 % confidence interval {interval(outcome.interval)}"
    return (
        f"Cohen's kappa for the {number_text.counted(outcome.decided, 'decided answer')} is {number(outcome.effect)} "
        f"({ends})."
    )


def _undecided_text(outcome: Recognition) -> str:
    """Return a sentence on the treatment of undecided answers, with a leading space, or ""."""
    if not outcome.undecided:
        return ""
    is_single = outcome.undecided == 1
    return (
        f"{number_text.counted(outcome.undecided, 'undecided answer')} {'counts' if is_single else 'count'} as "
        f"incorrect and {'is' if is_single else 'are'} not included in kappa. "
    )


def _hits_text(named: RecognitionResult) -> str:
    """Return a sentence on the number of correct names and the number expected by chance, if there is a p value."""
    tested = named.found
    hits = f"named {number(tested.statistic, 0)} of {sum(rate.n for rate in tested.rates)} liquids correctly"
    chance = f"given how often each name was used; {p_equals(tested.p or 0.0)}"
    if named.verdict in FOUND:
        return (
            f"Overall, participants {hits}, more than the {number(tested.expected, 1)} expected by chance ({chance})."
        )
    return f"Participants {hits} ({number(tested.expected, 1)} expected by chance, {chance})."


def recognised(named: RecognitionResult, alpha: float) -> tuple[int, ...]:
    """Return the indices of the settings that were recognised.

    There are none unless names are correct more often than by chance overall. A setting is recognised if its name is
    used more often for it than for each other setting.
    """
    if named.verdict not in FOUND:
        return ()
    return tuple(rate.setting for rate in named.found.rates if rate.p_adjusted is not None and rate.p_adjusted <= alpha)


class _Distinguished(Finding[None]):
    """The first page's answer: the liquids or views that were distinguished."""

    key = "distinguished"
    place = 20
    kinds = ("liquids", "views")
    question = "Which {kind} were distinguished?"
    answer_figures = ("effects", "recognition")

    def answer(self) -> Answer:
        """Return the liquids recognised by name, and the liquids or views that were rated differently.

        Exploratory tests are used only if no primary one is significant.
        """
        result, named = self.result, LiquidRecognition.value_in(self.result)
        recognised_settings = () if named is None else recognised(named, self.results.decided.alpha)
        differing = [test for test in SettingsDiffer.value_in(result) if test.verdict in FOUND]
        pairs = [
            ((pair.first, pair.second), pair.tested) for pair in Pairs.value_in(result) if pair.tested.verdict in FOUND
        ]
        if len(result.settings) == 2:
            pairs = [((result.settings[0].code, result.settings[1].code), test) for test in differing]
        verdicts = {test.verdict for test in (*differing, *(tested for _, tested in pairs))}
        verdicts |= {named.verdict} if named is not None and recognised_settings else set()
        verdict = "shown" if "shown" in verdicts else "suggested"
        statements_by_pair: dict[str, list[str]] = {}
        for (first, second), test in pairs:
            if test.verdict == verdict:
                first_name, second_name = (name_in_sentence(name(result, code)) for code in (first, second))
                pair = f"between {first_name} and {second_name}"
                statements_by_pair.setdefault(pair, []).append(f"“{short_text(result, test.item)}”")
        items = [f"“{short_text(result, test.item)}”" for test in differing if test.verdict == verdict]
        if statements_by_pair:
            differences = [f"{pair} ({listed(texts)})" for pair, texts in statements_by_pair.items()]
            text = f"Ratings differed {listed(differences)}."
        elif items:
            text = (
                f"The {result.kind} were rated differently on {listed(items)}, but the tests do not show which ones "
                "differ."
            )
        else:
            text = f"No statement showed a difference between any two {result.kind}."
        text += self._largest_text({test.item for test in differing if test.verdict == verdict})
        if named is not None and named.found.p is not None:
            names = listed([name_in_sentence(result.names[place]) for place in recognised_settings])
            single = f"Recognised above chance: {names}." if names else _NO_SINGLE_LIQUID
            if named.verdict not in FOUND:
                single = _NONE_RECOGNISED
            hits = f"{_hits_text(named)} {single}"
            # Significant results come first.
            text = f"{hits} {text}" if recognised_settings or not verdicts else f"{text} {hits}"
        if not verdicts:
            return self.make_answer("not shown", f"{text} {NO_EVIDENCE}")
        return self.make_answer(verdict, text, claims=True)

    def _largest_text(self, items: Container[str]) -> str:
        """Return a sentence on the largest mean difference from the first setting in ``items``, with a space."""
        result = self.result
        effects = [effect for effect in Effects.value_in(result) if effect.item in items and effect.low is not None]
        if not effects:
            return ""
        largest = max(effects, key=lambda effect: abs(effect.mean or 0.0))
        first, other = (name_in_sentence(name(result, code)) for code in (result.settings[0].code, largest.code))
        ends = f"[{number(largest.low)}, {number(largest.high)}]"
        return (
            f" The largest mean difference from {first} is {number(largest.mean)} points "
            f"(“{short_text(result, largest.item)}” for {other}, 95 % confidence interval {ends}, n = {largest.n})."
        )
