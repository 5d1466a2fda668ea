"""Recognition of liquids: the statement rated highest names one."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from study_app.analysis.designs.block_tests import Asked
from study_app.analysis.designs.verdicts import verdict
from study_app.analysis.figures import captions, recognition_matrix
from study_app.analysis.figures.picture import Drawing, Picture
from study_app.analysis.report.html_page import drawn, heading, paragraph, table
from study_app.analysis.report.r_syntax import r_number, r_text, r_vector
from study_app.analysis.report.test_rows import rows_alone, test_row
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.finding import BlockFigure, Finding, Row
from study_app.analysis.results.item_test import Verdict
from study_app.analysis.results.not_tested import NotTested
from study_app.analysis.results.words import counted, interval, lead, listed, number, p_equals, p_value
from study_app.analysis.statistics.recognition import MOST as MOST_NAMED
from study_app.analysis.statistics.recognition import Recognition, named, recognition
from study_app.analysis.tables.planned_analysis import Decided

RECOGNITION: Final = "test of recognition"
TITLE: Final = "What each liquid was named"


@dataclass(frozen=True, slots=True)
class RecognitionResult:
    """The recognition of liquids: the items that name one, and which of them is right for each setting (code)."""

    labels: tuple[str, ...]
    settings: tuple[str, ...]
    right: tuple[str | None, ...]
    found: Recognition
    verdict: Verdict


def _tested(answers: Asked, _found: BlockFound) -> tuple[RecognitionResult | None, tuple[NotTested, ...]]:
    """Test whether settings were named for what they were."""
    labels = answers.decided.names
    right = tuple(setting.label for setting in answers.block.settings)
    if not answers.decided.named_in(answers.block) or not any(right):
        return None, (NotTested(RECOGNITION, "the protocol does not say which statements name these liquids"),)
    if not 2 <= answers.k <= MOST_NAMED or len(labels) < 2:
        return None, (NotTested(RECOGNITION, f"it needs 2 to {MOST_NAMED} settings and two names"),)
    ratings = np.stack([answers.values[label] for label in labels], axis=2)
    truth = [None if label is None else labels.index(label) for label in right]
    found = recognition(named(ratings), truth, len(labels), seed=answers.intervals)
    said = verdict(found.p, found.smallest_p, answers.decided.alpha, primary=answers.decided.binding)
    return RecognitionResult(labels, answers.block.codes, right, found, said), ()


def _rows(found: BlockFound) -> Iterator[Row]:
    named = FINDING.of(found)
    if named is not None:
        row = test_row(found, "liquids are recognised", named.found) | rows_alone(found, "recognition")
        yield row | {"verdict": named.verdict}


def _section(found: BlockFound, _results: Results, pictures: Mapping[str, Picture]) -> Iterator[str]:
    named = FINDING.of(found)
    if named is None:
        return
    yield heading(3, "Were the liquids recognised?")
    yield from drawn(pictures, "recognition")
    rates = {rate.setting: rate for rate in named.found.rates}
    yield table(
        ("Liquid", "right", "of", "share", "95 % interval"),
        [
            [
                name,
                str(rates[place].hits),
                str(rates[place].n),
                number(rates[place].rate),
                interval(rates[place].interval),
            ]
            for place, name in enumerate(found.names)
            if place in rates
        ],
    )
    outcome = named.found
    why = "" if outcome.interval else f" ({outcome.no_interval})"
    note = f" {outcome.note[:1].upper()}{outcome.note[1:]}." if outcome.note else ""
    if outcome.p is None:
        yield paragraph(f"Not tested: {outcome.note}.")
        return
    yield paragraph(
        f"Hits {number(outcome.statistic, 0)}, {number(outcome.expected, 1)} expected by chance, "
        f"{p_equals(outcome.p)} (smallest attainable {p_value(outcome.smallest_p)}), {named.verdict}. Kappa of decided "
        f"answers {number(outcome.effect)}, 95 % interval {interval(outcome.interval)}{why}. Chance: "
        f"{outcome.method}.{note} One test, corrected for no other."
    )
    yield paragraph("Intervals of the shares: Clopper-Pearson, which takes participants one by one.", "soft")


def _figure(drawing: Drawing) -> Picture | None:
    found, study, block = drawing.found, drawing.study, drawing.block
    named = FINDING.of(found)
    if named is None:
        return None
    shorts = {item.id: item.short for item in found.items}
    right = [None if label is None else named.labels.index(label) for label in named.right]
    hits, expected = named.found.statistic, named.found.expected
    chance = ""
    if hits is not None and expected is not None and named.found.p is not None:
        chance = (
            f" Right: {hits:g}; {number(expected, 1)} would be by chance, that is after exchanging the liquids within "
            f"each participant (exact, one-sided, {p_equals(named.found.p)})."
        )
    caption = (
        f"The name that was rated highest for each liquid ({drawing.simulated}{captions.counts(study, block)[0]}). "
        f"Cells: counts and share of the row; framed: right. Undecided: {counted(2, 'name')} or more were rated "
        f"equally high.{chance}"
    )
    return drawing.picture(
        TITLE,
        caption,
        lambda **own: (
            recognition_matrix.draw(
                named.found.table,
                found.names,
                [shorts[label] for label in named.labels],
                right,
                counts=captions.counts(study, block),
                foot="Counts, with the share of the row. Framed: the name that is right.",
                **own,
            ).figure
        ),
    )


def _sentences(found: BlockFound, _decided: Decided) -> Iterator[str]:
    named = FINDING.of(found)
    if named is None or named.found.p is None or named.found.expected is None or named.found.statistic is None:
        return
    rates = [f"{found.names[rate.setting]} {rate.hits} of {rate.n}" for rate in named.found.rates]
    answers = named.found.decided + named.found.undecided
    verdict = {
        "shown": "recognition above chance is shown",
        "suggested": "recognition above chance is suggested (exploratory)",
        "out of reach": "recognition above chance was out of reach of these answers",
    }.get(named.verdict, "recognition above chance is not shown")
    yield (
        f"{lead(found)}: {verdict}: {named.found.statistic:g} of {answers} names were right, "
        f"{number(named.found.expected, 1)} expected by chance ({p_equals(named.found.p)}). This is "
        f"about all liquids together; by liquid: {listed(rates)}."
    )


def _methods(found: BlockFound, _results: Results) -> Iterator[str]:
    if FINDING.of(found) is not None:
        yield (
            "A participant was taken to have named the liquid whose statement he or she rated highest; equal highest "
            "ratings are undecided and count as no hit. Hits were tested against exchanging the liquids within "
            "participants (exact, one-sided)."
        )


def _calls(found: BlockFound, codes: str) -> Iterator[str]:
    named = FINDING.of(found)
    if named is not None and named.found.statistic is not None:
        right = ", ".join("NA_character_" if label is None else r_text(label) for label in named.right)
        block, labels = r_text(found.id), r_vector(named.labels)
        yield f"hits({block}, {block}, {labels}, {codes}, c({right}), {r_number(named.found.statistic)})"


FINDING: Final[Finding[RecognitionResult | None]] = Finding(
    key="named",
    place=4,
    empty=None,
    what=RECOGNITION,
    tests=_tested,
    kinds=("liquids",),
    waits=("liquids",),
    row_place=8,
    rows=_rows,
    part="recognition",
    section=_section,
    figure=BlockFigure(name="recognition", title=TITLE, draw=_figure),
    sentences=_sentences,
    methods=_methods,
    calls=_calls,
)
