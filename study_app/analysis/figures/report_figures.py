"""The figures of a report, each as PNG, SVG and PDF, with a caption that stands on its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from study_app.analysis import style
from study_app.analysis.figures import (
    answer_figures,
    captions,
    movement_plots,
    psychometric_curve,
    recognition_matrix,
    small_multiples,
)
from study_app.analysis.findings.block_results import BlockFound, Results
from study_app.analysis.findings.section_failures import Failure, Failures
from study_app.analysis.findings.words import counted, interval, number, p_equals
from study_app.analysis.tables.compared_blocks import Block
from study_app.analysis.tables.performance import OF_REACHES
from study_app.analysis.tables.study import Study

MOVES = {
    "movement_time_s": "Movement time, s",
    "path_mm": "Path, mm",
    "overshoot_mm": "Overshoot, mm",
    "submovements": "Submovements",
}


@dataclass(frozen=True, slots=True)
class Picture:
    """One figure: the block it is of, its name as a file, its caption, and its bytes by form (png, svg, pdf)."""

    block: str
    name: str
    caption: str
    files: dict[str, bytes]


def pictures(
    study: Study, results: Results, forms: Sequence[str] = style.FORMATS, failures: Failures | None = None
) -> Iterator[Picture]:
    """Draw every figure that there are answers or recordings for, block by block, in each of ``forms``.

    A figure that fails is left out, and kept in ``failures``.
    """
    held = Failures() if failures is None else failures
    for block, found in zip(study.blocks, results.blocks, strict=True):
        if not found.n:
            continue
        several = len(study.blocks_of(block.kind)) > 1
        for what, draw in _of_block(study, results, block, found, forms):
            name = f"{what}-{block.id}" if several else what
            drawn = held.attempt(f"figure {name}", partial(draw, name), block=block.id)
            if not isinstance(drawn, Failure):
                yield drawn


def _of_block(
    study: Study, results: Results, block: Block, found: BlockFound, forms: Sequence[str]
) -> Iterator[tuple[str, Callable[[str], Picture]]]:
    """Yield what a block's figures are called, and how each is drawn."""
    yield block.kind, lambda name: _answers(study, block, found, name, forms)
    if found.named is not None:
        yield "recognition", lambda name: _recognition(study, block, found, name, forms)
    if found.threshold is not None and any(found.threshold.asked):
        yield "threshold", lambda name: _threshold(study, block, found, name, forms)
    if found.delays_ms and results.performance is not None and results.performance.recorded_in(block.id):
        yield "movement", lambda name: _movement(study, block, results, name, forms)


def _answers(study: Study, block: Block, found: BlockFound, name: str, forms: Sequence[str]) -> Picture:
    lowest = {one.item: one.over_all_ms for one in found.lowest if one.over_all_ms is not None}
    caption = captions.caption(study, block)
    if lowest:
        caption += (
            " Dashed: lowest delay at which stepping down still shows a trend, with the error rate held over all "
            "statements; an upper bound of the delay that is noticed."
        )
    return Picture(block.id, name, caption, {form: answer_figures.render(study, block, form, lowest) for form in forms})


def _recognition(study: Study, block: Block, found: BlockFound, name: str, forms: Sequence[str]) -> Picture:
    named = found.named
    assert named is not None  # noqa: S101 - asked by the caller
    shorts = {item.id: item.short for item in found.items}
    right = [None if label is None else named.labels.index(label) for label in named.right]
    title = "What each liquid was named"
    files = {
        form: style.file_bytes(
            recognition_matrix.draw(
                named.found.table,
                found.names,
                [shorts[label] for label in named.labels],
                right,
                title=title,
                marks=answer_figures.marks(study),
                counts=captions.counts(study, block),
                foot="Counts, with the share of the row. Framed: the name that is right.",
                fonts=style.fonts_for(form),
            ).figure,
            form,
            f"{study.name}: {title}",
        )
        for form in forms
    }
    simulated = "SIMULATED participants, no people; " if study.simulated else ""
    hits, expected = named.found.statistic, named.found.expected
    chance = ""
    if hits is not None and expected is not None and named.found.p is not None:
        chance = (
            f" Right: {hits:g}; {number(expected, 1)} would be by chance, that is after exchanging the liquids within "
            f"each participant (exact, one-sided, {p_equals(named.found.p)})."
        )
    caption = (
        f"The name that was rated highest for each liquid ({simulated}{captions.counts(study, block)[0]}). Cells: "
        f"counts and share of the row; framed: right. Undecided: {counted(2, 'name')} or more were rated equally high."
        f"{chance}"
    )
    return Picture(block.id, name, caption, files)


def _threshold(study: Study, block: Block, found: BlockFound, name: str, forms: Sequence[str]) -> Picture:
    threshold = found.threshold
    assert threshold is not None  # noqa: S101 - asked by the caller
    lowest = min((one.over_all_ms for one in found.lowest if one.over_all_ms is not None), default=None)
    title = "When a delay is noticed"
    files = {
        form: style.file_bytes(
            psychometric_curve.draw(
                threshold,
                lowest,
                title=title,
                marks=answer_figures.marks(study),
                counts=("",),
                fonts=style.fonts_for(form),
            ).figure,
            form,
            f"{study.name}: {title}",
        )
        for form in forms
    }
    simulated = "SIMULATED participants, no people; " if study.simulated else ""
    curve = f"No curve: {threshold.note}."
    if threshold.effect is not None:
        curve = (
            f"Curve: {threshold.method}; diamond: the detection threshold, {threshold.effect:.0f} ms, on its 95 % "
            f"interval {interval(threshold.interval, 0)} ms."
        )
    dashed = "" if lowest is None else f" Dashed: the lowest delay up to which a statement follows it, {lowest:g} ms."
    caption = (
        f"Share of answers that noticed the delay, over the delay asked for ({simulated}n = {threshold.n}). {curve}"
        f"{dashed}"
    )
    return Picture(block.id, name, caption, files)


def _movement(study: Study, block: Block, results: Results, name: str, forms: Sequence[str]) -> Picture:
    measured = results.performance
    assert measured is not None  # noqa: S101 - asked by the caller
    people = sorted({trial.participant for trial in measured.reached if trial.block == block.id})
    plots = [
        movement_plots.Measured(MOVES[measure], measured.by_participant(people, block, measure))
        for measure in OF_REACHES
    ]
    title = "Reaching over added delay"
    n = f"n = {len(people)} participant" + ("" if len(people) == 1 else "s")
    files = {
        form: style.file_bytes(
            movement_plots.draw(
                plots,
                [setting.delay_ms or 0.0 for setting in block.settings],
                title=title,
                marks=answer_figures.marks(study),
                counts=[f"{n} with recordings", n],
                foot="Added delay, ms. A participant's point: the median of a trial's reaches, the first left out.",
                fonts=style.fonts_for(form),
            ).figure,
            form,
            f"{study.name}: {title}",
        )
        for form in forms
    }
    simulated = "SIMULATED participants, no people; " if study.simulated else ""
    caption = (
        f"How participants reached, over the delay that was asked for ({simulated}{n} with recordings). Thin lines: "
        f"{small_multiples.told_lines(len(people))}; thick line: median; band: the middle half. Movement time: from "
        "the "
        "lighting of a target to the "
        f"entry that was held. Scales do not begin at zero. {_kept(block, results)}"
    )
    return Picture(block.id, name, caption, files)


def _kept(block: Block, results: Results) -> str:
    """Say how many trials kept to the limits of timing."""
    here = [one for one in results.delivered if one.block == block.id]
    judged, valid = sum(one.judged for one in here), sum(one.valid for one in here)
    if not judged:
        return "Whether trials kept to the protocol's limits of timing was not measured."
    return f"Trials that kept to the protocol's limits of timing: {valid} of {judged}; all are included."
