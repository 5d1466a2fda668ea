"""The report of a study, written whole or not at all: the page, every number, figures, tables, and how to repeat it."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from study_app import __version__
from study_app.analysis.evaluate import Progress, evaluate
from study_app.analysis.export import export_files
from study_app.analysis.output import write_files
from study_app.analysis.report import conduct_section, listing, sections, short
from study_app.analysis.report.methods import methods
from study_app.analysis.report.page import box, bullets, heading, page, paragraph, table
from study_app.analysis.report.pictures import Picture, pictures
from study_app.analysis.report.r_script import r_script
from study_app.analysis.report.words import counted
from study_app.analysis.results import Results
from study_app.analysis.tables import Study, load_study
from study_app.errors import AnalysisError
from study_app.store import blinding

HASHES_SHOWN = 12
"""Of so few files the page shows the hashes one by one; of more, one over all of them."""


def report(
    folder: Path,
    to: Path,
    *,
    progress: Callable[[str, float], object] | None = None,
    cancelled: Callable[[], bool] | None = None,
    warn: Callable[[str], object] | None = None,
) -> tuple[Path, ...]:
    """Write the report of a study's results into the folder ``to``; return the files, ``report.html`` first.

    The same results give the same bytes. While the key is sealed the report is by code, and says what waits for it.

    Parameters
    ----------
    progress : callable, optional
        Is told what is being done and which share of all is done (0 to 1).
    cancelled : callable, optional
        Is asked again and again whether to give up.
    warn : callable, optional
        Is told a line of every file that is not as it was recorded, and is used as it is.

    Raises
    ------
    AnalysisError
        The results cannot be evaluated, ``to`` cannot be written, or it was cancelled; nothing was written.
    StoreError
        The key was opened, and is now missing or changed; or ``exclusions.csv`` cannot be read.
    """
    going = partial(_going, progress, cancelled)
    going("reading", 0.0)
    study = load_study(folder)
    if not study.blocks:
        raise AnalysisError(f"{folder}: the study {study.name!r} asks no statements, so there is nothing to report")
    results = evaluate(study, progress=lambda what, share: going(what, 0.1 + 0.6 * share))
    drawn = list(_drawn(study, results, going))
    going("writing", 0.95)
    written = write_files(Path(to), _files(study, results, drawn))
    study.tell_doubts(warn)
    return written


def _going(
    progress: Callable[[str, float], object] | None, cancelled: Callable[[], bool] | None, what: str, share: float
) -> None:
    """Tell what is being done, unless it is to be given up."""
    if cancelled is not None and cancelled():
        raise AnalysisError("the report was cancelled; nothing was written")
    if progress is not None:
        progress(what, share)


def _drawn(study: Study, results: Results, going: Progress) -> Iterator[Picture]:
    for number, picture in enumerate(pictures(study, results), start=1):
        going(f"drawing: {picture.name}", 0.7 + 0.2 * min(1.0, number / 4))
        yield picture


def _files(study: Study, results: Results, drawn: Sequence[Picture]) -> dict[str, bytes]:
    told = {
        "findings": short.findings(results),
        "limits": short.limits(study, results),
        "methods": methods(study, results),
    }
    files = {
        "report.html": _page(study, results, drawn, told).encode(),
        "report.json": listing.document(study, results, told),
        "report.R": r_script(study, results).encode(),
        "methods.txt": f"{told['methods']}\n".encode(),
        "tests.csv": listing.tests_csv(results),
        "motion.csv": listing.motion_csv(results),
    }
    for one in drawn:
        files |= {f"{one.name}.{form}": content for form, content in one.files.items()}
        files[f"{one.name}.txt"] = f"{one.caption}\n".encode()
    return files | export_files(study)


def _page(study: Study, results: Results, drawn: Sequence[Picture], told: Mapping[str, Any]) -> str:
    body = [*_head(study), *_short(told)]
    for found in results.blocks:
        body += sections.block(found, results, drawn)
    body += conduct_section.motion(results)
    body += conduct_section.conduct(study, results)
    body += [heading(2, "Methods, to paste"), box([paragraph(str(told["methods"]))])]
    body += _again(study, results)
    return page(f"{study.title}: report", body)


def _head(study: Study) -> Iterator[str]:
    yield heading(1, study.title)
    people = counted(study.n, "participant")
    yield paragraph(f"Study {study.name}, version {study.version}. {people[:1].upper()}{people[1:]}.", "soft")
    marks = []
    if study.simulated:
        marks.append('<span class="mark">SIMULATED participants, no people</span>')
    if study.pilot:
        marks.append('<span class="mark">PILOT</span>')
    if not study.revealed:
        marks.append('<span class="sealed">Blinded: by code</span>')
    if marks:
        yield f"<p>{' '.join(marks)}</p>"


def _short(told: Mapping[str, Any]) -> Iterator[str]:
    yield heading(2, "In short")
    found = told["findings"]
    yield box([bullets(found)]) if found else paragraph("No answers count yet: there are no findings.")
    if told["limits"]:
        yield heading(3, "What this study cannot show")
        yield box([bullets(told["limits"])], "care")


def _again(study: Study, results: Results) -> Iterator[str]:
    """Yield what it takes to get the same numbers again."""
    yield heading(2, "To repeat it")
    decided = results.decided
    bound = decided.equivalence_bound
    rows = [
        ("Decided before the first session", "yes" if decided.binding else "no: everything is exploratory"),
        ("Alpha", f"{decided.alpha:g}"),
        ("Bound of equivalence", "none" if bound is None else f"±{bound:g}"),
        ("Primary statements", (", ".join(decided.primary) or "all") if decided.binding else "none"),
        ("Seed of the analysis", str(results.seed)),
        *((f"Version of {library}", version) for library, version in listing.versions().items()),
        ("Key opened", "; ".join(f"{one['at']} by {one['by']}: {one['reason']}" for one in _reveals(study)) or "no"),
    ]
    yield table(("Setting", "Value"), rows, words=2)
    hashes = listing.files(study)
    together = hashlib.sha256("".join(f"{digest}  {name}\n" for name, digest in sorted(hashes.items())).encode())
    if len(hashes) <= HASHES_SHOWN:
        yield table(("File", "SHA-256"), list(hashes.items()), words=2)
    yield paragraph(
        f"The numbers come from {counted(len(hashes), 'file')}; SHA-256 over their hashes and names: "
        f"{together.hexdigest()}. Each one's hash, and every session's seed, stands in report.json."
    )
    yield paragraph(
        "Beside this page: report.json (every number), tests.csv (a row a test), motion.csv, the tables of responses, "
        "trials and aggregates with their codebook, every figure as PNG, SVG and PDF with its caption, methods.txt, "
        f"and report.R, which computes the main numbers again in base R. Made by liquid-study {__version__}.",
        "soft",
    )


def _reveals(study: Study) -> tuple[dict[str, str], ...]:
    return blinding.reveals(study.folder)
