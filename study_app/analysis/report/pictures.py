"""The figures of a report, each as PNG, SVG and PDF, with a caption that stands on its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from study_app.analysis import captions, figures, movement, multiples, recognition_matrix, style
from study_app.analysis.performance import OF_REACHES
from study_app.analysis.questions import Block
from study_app.analysis.report.words import counted, number, p_equals
from study_app.analysis.results import BlockFound, Results
from study_app.analysis.tables import Study

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


def pictures(study: Study, results: Results, forms: Sequence[str] = style.FORMATS) -> Iterator[Picture]:
    """Draw every figure that there are answers or recordings for, block by block, in each of ``forms``."""
    for block, found in zip(study.blocks, results.blocks, strict=True):
        if not found.n:
            continue
        several = len(study.blocks_of(block.kind)) > 1
        yield _answers(study, block, found, f"{block.kind}-{block.id}" if several else block.kind, forms)
        if found.named is not None:
            yield _recognition(study, block, found, f"recognition-{block.id}" if several else "recognition", forms)
        if found.delays_ms and results.performance is not None and results.performance.recorded_in(block.id):
            yield _movement(study, block, results, f"movement-{block.id}" if several else "movement", forms)


def _answers(study: Study, block: Block, found: BlockFound, name: str, forms: Sequence[str]) -> Picture:
    lowest = {one.item: one.steps.lowest_ms for one in found.lowest if one.steps.lowest_ms is not None}
    caption = captions.caption(study, block)
    if lowest:
        caption += (
            " Dashed: lowest delay at which stepping down still shows a trend, an upper bound of the delay that is "
            "noticed."
        )
    return Picture(block.id, name, caption, {form: figures.render(study, block, form, lowest) for form in forms})


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
                marks=figures.marks(study),
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


def _movement(study: Study, block: Block, results: Results, name: str, forms: Sequence[str]) -> Picture:
    measured = results.performance
    assert measured is not None  # noqa: S101 - asked by the caller
    people = sorted({trial.participant for trial in measured.reached if trial.block == block.id})
    plots = [
        movement.Measured(MOVES[measure], measured.by_participant(people, block, measure)) for measure in OF_REACHES
    ]
    title = "Reaching over added delay"
    n = f"n = {len(people)} participant" + ("" if len(people) == 1 else "s")
    files = {
        form: style.file_bytes(
            movement.draw(
                plots,
                [setting.delay_ms or 0.0 for setting in block.settings],
                title=title,
                marks=figures.marks(study),
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
        f"{multiples.told_lines(len(people))}; thick line: median; band: the middle half. Movement time: from the "
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
