"""The sections of the page: tables of every test, in the order of the study's blocks."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial

from study_app.analysis.figures.picture import Picture
from study_app.analysis.findings import all_findings
from study_app.analysis.report.html_page import bullets, drawn, heading, not_there, paragraph, table
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.section_failures import Failure, Failures
from study_app.analysis.results.words import (
    VERDICTS_MEAN,
    lead,
    missing,
    name,
    number,
    said_of_presentations,
    settings_noun,
    short,
)


def block(
    found: BlockFound, results: Results, drawn: Sequence[Picture], failures: Failures | None = None
) -> Iterator[str]:
    """Yield the section of one block; a part that fails is said in its place, and kept in ``failures``."""
    yield heading(2, lead(found))
    if not found.n:
        untested = any(one.block == found.id for one in results.failures)
        yield (
            bullets(missing(found))
            if untested
            else paragraph("No answers count yet: there is nothing to test or to plot.")
        )
        return
    held = Failures() if failures is None else failures
    for what, make in _parts(found, results, {one.name.split("-")[0]: one for one in drawn if one.block == found.id}):
        part = held.attempt(what, partial(_made, make), block=found.id)
        yield from (heading(3, what.capitalize()), not_there(part.why)) if isinstance(part, Failure) else part


def _made(make: Callable[[], Iterable[str]]) -> list[str]:
    return list(make())


def _parts(
    found: BlockFound, results: Results, pictures: Mapping[str, Picture]
) -> Iterator[tuple[str, Callable[[], Iterable[str]]]]:
    """Yield what the parts of a block's section are, and how each is made."""
    yield "presentations", lambda: _presentations(found)
    yield "figure of answers", lambda: drawn(pictures, found.kind)
    for finding in all_findings():
        yield finding.part, finding(found, results, pictures).section
    yield "what is not here", lambda: _absent(found)


def _presentations(found: BlockFound) -> Iterator[str]:
    """Say what one answer stands for, where it is more than one presentation."""
    lines = said_of_presentations(found)
    if lines:
        yield paragraph(" ".join(lines))


def _absent(found: BlockFound) -> Iterator[str]:
    if found.absent:
        yield heading(3, "What is not here, and why")
        yield bullets(f"{line[:1].upper()}{line[1:]}" for line in missing(found))


def verdicts_mean(results: Results) -> Iterator[str]:
    """Yield what the words of verdicts mean, once for all tables; nothing where nothing was tested."""
    if not results.blocks:
        return
    yield heading(2, "What the words of verdicts mean")
    yield paragraph(VERDICTS_MEAN.format(alpha=f"{results.decided.alpha:g}"))


def answers(results: Results) -> Iterator[str]:
    """Yield the counts of all answers, block by block; nothing without blocks of statements."""
    if not results.blocks:
        return
    yield heading(2, "Answers, counted")
    for found in results.blocks:
        if found.measures:
            yield heading(3, lead(found))
            yield _measures(found)


def _measures(found: BlockFound) -> str:
    levels = [str(level) for level in range(1, 8)]
    return table(
        ("Statement", settings_noun(found).capitalize(), *levels, "n", "missing", "median", "quartiles", "agree %"),
        [
            [
                short(found, str(row["item"])),
                name(found, str(row["code"])),
                *(str(row[f"count_{level}"]) for level in levels),
                str(row["n"]),
                str(row["missing"] + row["cannot_judge"]),
                number(row["median"], 1),
                f"{number(row['q1'], 1)} – {number(row['q3'], 1)}" if row["q1"] is not None else "–",
                number(row["agree_percent"], 0),
            ]
            for row in sorted(found.measures, key=lambda row: [item.id for item in found.items].index(str(row["item"])))
        ],
        words=2,
    )
