"""The report of a study, written whole or not at all: the page, every number, figures, tables, and how to repeat it."""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from markupsafe import Markup

from study_app import __version__
from study_app.analysis.data.study_tables import Study, load_study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.export.table_files import credit_lines, table_files
from study_app.analysis.export.tables import deliver
from study_app.analysis.figures.level_figures import level_pictures
from study_app.analysis.figures.page_layout import Picture
from study_app.analysis.figures.question_figures import question_pictures
from study_app.analysis.figures.study_figures import pictures
from study_app.analysis.planning.preregistration import deviations_section as preregistration_section
from study_app.analysis.report import number_files, sections
from study_app.analysis.report.html_page import (
    attempted,
    box,
    bullets,
    font_faces,
    heading,
    page,
    paragraph,
    render,
    table,
)
from study_app.analysis.report.number_files import r_script
from study_app.analysis.report.sections import methods, version_words
from study_app.analysis.results import Failure, Failures, Progress, Results, counted, silent
from study_app.errors import AnalysisError
from study_app.store.blinded.unblinding import reveals_of
from study_app.store.output_files import write_output

HASHES_SHOWN = 12
"""Of so few files the page shows the hashes one by one; of more, one over all of them."""


def report(
    folder: Path,
    to: Path,
    *,
    progress: Progress = silent,
    warn: Callable[[str], object] | None = None,
    failed: Callable[[str], object] | None = None,
) -> tuple[Path, ...]:
    """Write the report of a study's results into the folder ``to``; return the files, ``report.html`` first.

    The same results give the same bytes. While the key is sealed the report is by code, and says what waits for it.

    Parameters
    ----------
    progress : callable, optional
        Is called with what is being done and which share of all is done (0 to 1); what it raises ends the report.
    warn : callable, optional
        Is called with a line for every file that is not as it was recorded, and is used as it is.
    failed : callable, optional
        Is called with a line for every section that could not be computed: the report says so in its place, and holds
        everything else.

    Raises
    ------
    AnalysisError
        The results cannot be evaluated, or ``to`` cannot be written; nothing was.
    StoreError
        The key was opened, and is now missing or changed; or ``exclusions.csv`` cannot be read.
    """
    progress("reading", 0.0)
    study = load_study(folder)
    if not asks(study):
        raise AnalysisError(f"{folder}: the study {study.name!r} asks no statements, so there is nothing to report")
    files, found = report_files(study, progress)
    progress("writing", 0.95)
    written = write_output(study.folder, Path(to), files)
    study.tell_doubts(warn)
    if failed is not None:
        for failure in found:
            failed(f"error: {failure}")
    return written


def asks(study: Study) -> bool:
    """Return whether a study has answers to report."""
    return bool(study.blocks or study.others.questions)


def report_files(study: Study, progress: Progress = silent) -> tuple[dict[str, bytes], tuple[Failure, ...]]:
    """Return the files of a study's report by their names, ``report.html`` first, and the sections that failed.

    report.json is made last, since it holds the failures of the others.
    """
    results = evaluate(study, progress=lambda what, share: progress(what, 0.1 + 0.6 * share))
    failures = Failures(results.failures)
    drawn = []
    for one in _drawn(study, results, failures):
        drawn.append(one)
        progress(f"drawing: {one.name}", 0.7 + 0.2 * min(1.0, len(drawn) / 4))

    def told(what: str, make: Callable[[], tuple[str, ...]]) -> tuple[str, ...]:
        found = failures.attempt(f"texts: {what}", make)
        return (f"Not there: {found.why}.",) if isinstance(found, Failure) else found

    texts: dict[str, Any] = {
        "findings": told("findings", lambda: sections.findings(results)),
        "limits": told("limits", lambda: sections.limits(study, results)),
        "methods": told("methods", lambda: (methods(study, results),))[0],
    }
    files: dict[str, bytes] = {}
    for name, make in (
        ("report.R", lambda: r_script(study).encode()),
        ("methods.txt", f"{texts['methods']}\n".encode),
        ("tests.csv", lambda: number_files.tests_csv(results)),
        ("motion.csv", lambda: number_files.motion_csv(results)),
    ):
        content = failures.value(name, make, None)
        files |= {} if content is None else {name: content}
    for one in drawn:
        files |= {f"{one.name}.{form}": content for form, content in one.files.items()}
        files[f"{one.name}.txt"] = f"{one.caption}\n".encode()
    files |= failures.value("exported tables", lambda: table_files(study, deliver(study)), {})
    page_ = _page(study, results, drawn, texts, failures).encode()
    numbers = number_files.document(study, results, texts, failures)
    return {"report.html": page_, "report.json": numbers, **files}, tuple(failures.found)


def _drawn(study: Study, results: Results, failures: Failures) -> Iterator[Picture]:
    yield from pictures(study, results, failures=failures)
    if results.questions:
        yield from question_pictures(study, results.questions, failures=failures)
    if results.levels:
        yield from level_pictures(study, results.levels, failures=failures)


def _page(
    study: Study, results: Results, drawn: Sequence[Picture], texts: Mapping[str, Any], failures: Failures
) -> str:
    sections_: list[tuple[str, Callable[[], Iterable[str]]]] = [
        ("In short", lambda: _short(texts, results)),
        *((found.title, partial(sections.block, found, results, drawn, failures)) for found in results.blocks),
        *(
            (title, partial(sections.question_section, where, study, results, drawn))
            for where, title in sections.places(results).items()
        ),
        ("What the words mean", lambda: sections.verdicts_mean(results)),
        ("Groups", lambda: sections.groups(study, results)),
        ("Sites", lambda: sections.groups(study, results, "site")),
        ("Motion and force", lambda: sections.motion(results)),
        ("How it was run", lambda: sections.conduct(study, results)),
        ("Preregistration", lambda: preregistration_section(study)),
        ("Methods, to paste", lambda: (heading(2, "Methods, to paste"), box([paragraph(str(texts["methods"]))]))),
        ("Reproducing this report", lambda: _again(study, results)),
        ("Licence and citation", lambda: (heading(2, "Licence and citation"), bullets(credit_lines(study)))),
        ("Answers, counted", lambda: sections.counts_of_answers(results)),
    ]
    first = attempted(failures, "first page", Markup(), lambda: [sections.first_page(results, texts["limits"])])
    made = [(title, attempted(failures, f"section “{title}”", heading(2, title), make)) for title, make in sections_]
    body = render(
        "body.html",
        title=study.title,
        facts=_facts(study),
        marks=_marks(study),
        parts=[{"title": title, "html": html} for title, html in made if html],
        failures=[str(one) for one in failures.found],
        first=Markup().join(first),
    )
    faces = failures.value("typeface", lambda: font_faces("".join(sorted(set(body.unescape())))), "")
    return page(f"{study.title}: report", body, faces)


def _facts(study: Study) -> str:
    """Say which study it is, how many took part, and on which days the sessions that count began."""
    people = counted(study.n, "participant")
    rows = study.participants
    days = sorted({str(at)[:10] for at in rows.loc[rows["counted"], "started_at"]})
    when = (
        "" if not days else f"Sessions on {days[0]}." if len(days) == 1 else f"Sessions from {days[0]} to {days[-1]}."
    )
    return f"Study {study.name}, {version_words(study)}. {people[:1].upper()}{people[1:]}. {when}"


def _marks(study: Study) -> list[tuple[str, str]]:
    """Return what must be seen at the head of the page: a class of the style, and words."""
    marks = [("mark", "SIMULATED participants, no people")] if study.simulated else []
    marks += [("mark", "PILOT")] if study.pilot else []
    return marks if study.revealed else [*marks, ("sealed", "Blinded: by code")]


def _short(texts: Mapping[str, Any], results: Results) -> Iterator[str]:
    """Yield every finding in a sentence, with its p; nothing without statements, where the first page has them."""
    if not results.blocks:
        return
    yield heading(2, "In short: every finding in a sentence")
    found = texts["findings"]
    yield bullets(found) if found else paragraph(sections.none_found(results))


def _again(study: Study, results: Results) -> Iterator[str]:
    """Yield what it takes to get the same numbers again."""
    yield heading(2, "Reproducing this report")
    decided = results.decided
    bound = decided.equivalence_bound
    rows = [
        ("Decided before the first session", "yes" if decided.binding else "no: everything is exploratory"),
        ("Alpha", f"{decided.alpha:g}"),
        ("Bound of equivalence", "none" if bound is None else f"±{bound:g}"),
        ("Primary statements", (", ".join(decided.primary) or "all") if decided.binding else "none"),
        ("Seed of the analysis", str(results.seed)),
        *((f"Version of {library}", version) for library, version in number_files.versions().items()),
        ("Key opened", "; ".join(map(_opened, reveals_of(study.folder))) or "no"),
    ]
    yield table(("Setting", "Value"), rows, words=2)
    hashes = number_files.files(study)
    together = hashlib.sha256("".join(f"{digest}  {name}\n" for name, digest in sorted(hashes.items())).encode())
    if len(hashes) <= HASHES_SHOWN:
        yield table(("File", "SHA-256"), list(hashes.items()), words=2)
    yield paragraph(
        f"The numbers come from {counted(len(hashes), 'file')}; SHA-256 over their hashes and names: "
        f"{together.hexdigest()}. Each one's hash, and every session's seed, is in report.json."
    )
    yield paragraph(
        "Files next to this page: report.json (every number), tests.csv (one row per test), motion.csv, the tables of "
        "responses, trials and aggregates with their codebook, every figure as PNG, SVG and PDF with its caption, "
        "methods.txt, and report.R, which computes the main numbers again in base R. "
        f"Made by liquid-study {__version__}.",
        "soft",
    )


def _opened(reveal: Mapping[str, str]) -> str:
    site = f"site {reveal['site']}, " if "site" in reveal else ""
    return f"{site}{reveal['at']} by {reveal['by']}: {reveal['reason']}"
