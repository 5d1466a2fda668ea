"""The report of a study: page, files with all numbers, figures, tables, and an R script, written completely or not."""

import hashlib
import json
import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, fields, is_dataclass
from functools import partial
from importlib import metadata
from itertools import chain
from pathlib import Path
from platform import python_version
from typing import Any, Final

from markupsafe import Markup

from study_app import __version__
from study_app.analysis.contrasts import contrast_rows, contrast_section
from study_app.analysis.data.blocks import Setting
from study_app.analysis.data.study_tables import DAMAGED, Study, group_counts, load_study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.export.table_files import credit_lines, study_head, table_files
from study_app.analysis.export.tables import exported_tables
from study_app.analysis.figures.level_figures import level_figure_tasks
from study_app.analysis.figures.question_figures import question_figure_tasks
from study_app.analysis.figures.summary_figures import Numbers, numbers_of, summary_figure_tasks
from study_app.analysis.findings import FINDINGS, all_findings
from study_app.analysis.findings.finding import TESTS
from study_app.analysis.html_page import box, bullets, chunks, font_face, heading, paragraph, render, table, try_part
from study_app.analysis.levels.evaluate import level_entries
from study_app.analysis.page_layout import FigureTask, Picture, draw_figures
from study_app.analysis.planned_exclusions import PlannedExclusions, Proposal, planned_exclusions
from study_app.analysis.planning.preregistration import FILE as PREREGISTRATION
from study_app.analysis.planning.preregistration import deviations, preregistration_folders
from study_app.analysis.planning.preregistration import deviations_section as preregistration_section
from study_app.analysis.report import sections
from study_app.analysis.report.first_page import cards, figures_shown, first_page, presented_in
from study_app.analysis.report.methods import methods, version_text
from study_app.analysis.report.motion_section import motion_section
from study_app.analysis.report.questions_in_full import appendix
from study_app.analysis.report.r_script import r_script
from study_app.analysis.report.study_figures import block_figure_tasks
from study_app.analysis.results import (
    BlockResult,
    ContrastResult,
    Failure,
    Failures,
    LevelsResult,
    Progress,
    Results,
    name,
    report_no_progress,
)
from study_app.analysis.wording import bound_text, counted, listed, with_d_z
from study_app.errors import AnalysisError
from study_app.figure_style import FORMATS
from study_app.number_text import capitalised
from study_app.protocol.model import Contrast, Published
from study_app.store.files import TRIALS_MISSING, Column, StudyFolder, csv_bytes, optional, write_output
from study_app.store.integrity import sha256
from study_app.store.merged import MANIFEST, folders_of
from study_app.store.receipt import recorded_plug_ins
from study_app.store.unblinding import RULES, reveals_of
from study_app.store.versions import recorded_contents
from study_app.workers.shared_tasks import SharedTasks

_OF_FORMAT_2: Final = {
    Results: frozenset({"questions", "scores", "levels", "contrasts", "block_orders"}),
    Setting: frozenset({"link", "view"}),
    ContrastResult: frozenset({"cells"}),
}
"""Fields that earlier versions do not have in report.json; omitted if they are empty."""


def as_json_types(value: Any) -> Any:
    """Return a result as dictionaries, lists and values that JSON can represent."""
    if isinstance(value, BlockResult):
        return {name: as_json_types(entry) for name, entry in _block_entries(value)}
    if isinstance(value, LevelsResult):
        entries = {field.name: getattr(value, field.name) for field in fields(value) if field.name != "statistics"}
        return as_json_types(entries | level_entries(value))
    if is_dataclass(value) and not isinstance(value, type):
        held = {field.name: getattr(value, field.name) for field in fields(value) if field.metadata.get("json", True)}
        omitted = _OF_FORMAT_2.get(type(value), frozenset())
        return {name: as_json_types(entry) for name, entry in held.items() if entry or name not in omitted}
    if isinstance(value, Contrast):
        return value.model_dump()
    if isinstance(value, Published):
        return value.model_dump(exclude={"block"})
    if isinstance(value, Mapping):
        return {str(key): as_json_types(entry) for key, entry in value.items()}
    if isinstance(value, tuple | list):
        return [as_json_types(entry) for entry in value]
    if hasattr(value, "item"):
        return as_json_types(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        raise AnalysisError(f"a result is {value}; this is a fault in the program: please report it")
    return value


def _block_entries(result: BlockResult) -> Iterator[tuple[str, Any]]:
    """Yield the report.json entries of a block: its fields, with the entries of findings in place of ``findings``."""
    for field in fields(result):
        if field.name != "findings":
            if field.name != "incomplete" or result.incomplete:
                yield field.name, getattr(result, field.name)
            continue
        for finding in all_findings():
            if finding.what:
                yield from finding.entries(result).items()


_FORMAT: Final = 1
LIBRARIES: Final = ("numpy", "scipy", "pandas", "matplotlib", "pyarrow")

_MOTION: Final = (
    Column("block", "text", "ID of the block."),
    Column("code", "text", "Code of the condition."),
    Column("setting", "text", "Name of the condition."),
    Column("measure", "text", "Name of the measure, ending with its unit."),
    Column("n", "integer", "Number of participants with a value for the measure.", minimum=0),
    optional("median", "number", "Median across participants."),
    optional("q1", "number", "Lower quartile across participants."),
    optional("q3", "number", "Upper quartile across participants."),
    Column("trials", "integer", "Number of analysed trials in the condition.", minimum=0),
    Column("judged", "integer", "Number of these trials in which the limits were checked.", minimum=0),
    Column("valid", "integer", "Number of these trials that met the protocol's limits.", minimum=0),
)


def tests(results: Results) -> list[dict[str, Any]]:
    """Return one row per test."""
    in_order = sorted(all_findings(), key=lambda finding: finding.row_place)
    of_blocks = (finding(block, results).rows() for block in results.blocks for finding in in_order)
    return [*contrast_rows(results), *chain.from_iterable(of_blocks)]


def tests_csv(results: Results) -> bytes:
    """Return a CSV table with one row per test."""
    return csv_bytes(TESTS, tests(results))


def motion_csv(results: Results) -> bytes:
    """Return a CSV table with one row per measure of motion and force and setting."""
    moved = () if results.performance is None else results.performance.moved
    blocks = {block.id: block for block in results.trial_blocks}
    delivered = {(setting.block, setting.code): setting for setting in results.delivered}
    return csv_bytes(
        _MOTION,
        [
            {
                **as_json_types(quartiles),
                "setting": name(blocks[quartiles.block], quartiles.code),
                **{
                    field: getattr(delivered[quartiles.block, quartiles.code], field)
                    for field in ("trials", "judged", "valid")
                },
            }
            for quartiles in moved
        ],
    )


def document(study: Study, results: Results, texts: Mapping[str, Any], failures: Failures) -> bytes:
    """Return all results as JSON; ``texts`` are the findings as sentences. A part that fails is null."""
    parts: dict[str, Callable[[], Any]] = {
        "versions": versions,
        **({"plug_ins": lambda: used} if (used := plug_ins(study)) else {}),
        "study": lambda: {
            **study_head(study),
            "blinded": not study.revealed,
            "key_opened": list(reveals_of(study.folder)),
        },
        "sessions": lambda: sessions(study),
        "exclusions": lambda: [
            {**asdict(exclusion), "after_unblinding": exclusion in study.late} for exclusion in study.exclusions
        ],
        "doubts": lambda: [{"file": _path_in_study(study, doubt.path), "what": doubt.what} for doubt in study.doubts],
        "files": lambda: files(study),
        **{what: partial(as_json_types, text) for what, text in texts.items()},
        "results": lambda: as_json_types(results),
    }
    if any((folder / PREREGISTRATION).exists() for folder in preregistration_folders(study).values()):
        parts["preregistration"] = lambda: as_json_types(deviations(study))
    made = {name: failures.attempt(f"report.json, {name}", make) for name, make in parts.items()}
    content = {
        "format": _FORMAT,
        "program": f"liquid-study {__version__}",
        "failures": [{**asdict(failure), "why": failure.why} for failure in failures.found],
        **{name: None if isinstance(part, Failure) else part for name, part in made.items()},
    }
    return f"{json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False)}\n".encode()


def versions() -> dict[str, str]:
    """Return the versions of the software that computed the results."""
    return {
        "liquid-study": __version__,
        "python": python_version(),
        **{library: metadata.version(library) for library in LIBRARIES},
    }


def plug_ins(study: Study) -> dict[str, list[str]]:
    """Return the plug-ins used in the sessions and in this report: kinds and names by package and version."""
    places = map(StudyFolder, folders_of(study.folder).values())
    used = recorded_plug_ins(session.receipt for place in places for session in place.sessions())
    for plug_in in FINDINGS.plug_ins:
        if not plug_in.fault:
            used.setdefault(f"{plug_in.package} {plug_in.version}", []).append(f"{plug_in.kind} {plug_in.name}")
    return used


def sessions(study: Study) -> list[dict[str, Any]]:
    """Return the provenance of every session: seed, protocol hash, and program version."""
    columns = ["participant", "session", "status", "counted", "seed", "protocol_hash", "key_hash", "version", "device"]
    rows = study.participants[columns].astype(object).where(study.participants[columns].notna(), None)
    entries = [{str(key): as_json_types(value) for key, value in row.items()} for row in rows.to_dict("records")]
    if not study.levels:
        return entries
    missing = [None if trials is None else trials.count for trials in study.participants["missing"]]
    return [row | {TRIALS_MISSING.name: count} for row, count in zip(entries, missing, strict=True)]


def files(study: Study) -> dict[str, str]:
    """Return the SHA-256 of every input file; recordings are in their session's checksums."""
    paths = [study.folder / MANIFEST]
    for place in map(StudyFolder, folders_of(study.folder).values()):
        paths += [place.exclusions, place.key, place.reveals, place.preregistration]
        for session in place.sessions():
            tables = [session.table(study.name, name) for name in ("responses", "trials")]
            paths += [session.receipt, session.journal, session.checksums, *tables]
    return {_path_in_study(study, path): sha256(path) for path in paths if path.is_file()}


def _path_in_study(study: Study, path: Any) -> str:
    return str(path.relative_to(study.folder).as_posix())


_HASHES_SHOWN = 12
"""The most files whose hashes the page lists; it always shows a combined hash."""


def report(
    folder: Path,
    to: Path,
    *,
    progress: Progress = report_no_progress,
    warn: Callable[[str], object] | None = None,
    failed: Callable[[str], object] | None = None,
) -> tuple[Path, ...]:
    """Write the report of a study's results into the folder ``to``; return the files, ``report.html`` first.

    The same results give the same bytes. While the key is sealed, the report uses codes and lists the missing results.

    Parameters
    ----------
    progress : callable, optional
        Called with the current activity and the fraction done (0 to 1); an exception that it raises ends the report.
    warn : callable, optional
        Called with a line for every file that differs from its recorded state but is used.
    failed : callable, optional
        Called with a line for every section that could not be computed; the report has a note in its place and contains
        all others.

    Raises
    ------
    AnalysisError
        The results cannot be evaluated, or ``to`` cannot be written; nothing was written.
    StoreError
        The key was opened, and is now missing or changed; or ``exclusions.csv`` cannot be read.
    """
    progress("reading", 0.0)
    study = load_study(folder)
    if not has_results(study):
        raise AnalysisError(
            f"{folder}: the study {study.name!r} contains neither trials nor questions, so there is nothing to report"
        )
    files, report_failures = report_files(study, progress)
    progress("writing", 0.95)
    written = write_output(study.folder, Path(to), files, warn)
    study.tell_doubts(warn)
    if failed is not None:
        for failure in report_failures:
            failed(f"error: {failure}")
    return written


def has_results(study: Study) -> bool:
    """Return whether a study has trials or answers to report."""
    return bool(study.trial_blocks or study.others.questions)


def report_files(study: Study, progress: Progress = report_no_progress) -> tuple[dict[str, bytes], tuple[Failure, ...]]:
    """Return the files of a study's report by name, ``report.html`` first, and the sections that failed.

    report.json is made last, because it lists the failures of all other parts.
    """
    results = evaluate(study, progress=lambda what, share: progress(what, 0.1 + 0.6 * share))
    failures = Failures(results.failures)
    numbers = failures.value("the participants' values", lambda: numbers_of(study), {})
    figure_tasks = SharedTasks([partial(_draw_or_fail, task) for task in _figure_tasks(study, results, numbers)])
    texts: dict[str, Any] = {
        "findings": failures.value("texts: findings", lambda: sections.level_sentences(results), ()),
        "limits": failures.value("texts: limits", lambda: sections.limits(study, results), ()),
        "methods": failures.value("texts: methods", lambda: methods(study, results), ""),
    }
    planned = failures.value("planned exclusions", lambda: planned_exclusions(study, results), None)
    if planned is not None:
        undecided = [proposal for proposal in planned.proposals if proposal.decision == "undecided"]
        texts["limits"] = (*_proposal_sentences(undecided), *texts["limits"])
        texts["planned_exclusions"] = [asdict(proposal) for proposal in planned.proposals]
    files: dict[str, bytes] = {}
    for file, make in (
        ("report.R", lambda: r_script(study, results).encode()),
        ("methods.txt", with_d_z(f"{texts['methods']}\n", "dz").encode),
        ("tests.csv", lambda: tests_csv(results)),
        ("motion.csv", lambda: motion_csv(results)),
    ):
        content = failures.value(file, make, None)
        files |= {} if content is None else {file: content}
    files |= failures.value("exported tables", lambda: table_files(study, exported_tables(study)), {})
    progress("drawing", 0.8)
    figures = figure_tasks.results()
    failures.found += [figure for figure in figures if isinstance(figure, Failure)]
    drawn = [figure for figure in figures if isinstance(figure, Picture)]
    for picture in drawn:
        files |= {f"{picture.name}.{form}": content for form, content in picture.files.items()}
        files[f"{picture.name}.txt"] = f"{picture.caption}\n".encode()
    page = _render_page(study, results, numbers, drawn, texts, planned, failures).encode()
    return {"report.html": page, "report.json": document(study, results, texts, failures), **files}, tuple(
        failures.found
    )


def _figure_tasks(study: Study, results: Results, numbers: Mapping[str, Sequence[Numbers]]) -> Iterator[FigureTask]:
    yield from block_figure_tasks(study, results, FORMATS)
    if results.questions:
        yield from question_figure_tasks(study, results.questions, FORMATS)
    yield from summary_figure_tasks(study, results, numbers, FORMATS)
    if results.levels:
        yield from level_figure_tasks(study, results.levels, FORMATS)


def _draw_or_fail(task: FigureTask) -> Picture | Failure | None:
    failures = Failures()
    picture = next(draw_figures([task], failures), None)
    return failures.found[0] if failures.found else picture


def _proposal_sentences(proposals: Sequence[Proposal]) -> Iterator[str]:
    """Yield a sentence on sessions whose exclusion awaits a decision; nothing without such sessions."""
    if proposals:
        sessions = listed(
            [
                f"{proposal.participant}, session {proposal.session} ({proposal.rule.replace('_', ' ')})"
                for proposal in proposals
            ]
        )
        yield (
            f"Under a planned rule, {sessions} would be excluded; no decision has been made yet (see “Planned "
            "exclusions”)."
        )


def _render_page(
    study: Study,
    results: Results,
    numbers: Mapping[str, Sequence[Numbers]],
    drawn: Sequence[Picture],
    texts: Mapping[str, Any],
    planned: PlannedExclusions | None,
    failures: Failures,
) -> str:
    on_first = failures.value("figures on the first page", lambda: figures_shown(cards(results, numbers), drawn), set())
    presented = failures.value("the presented liquids", lambda: presented_in(study), {})
    others = [picture for picture in drawn if picture.name not in on_first]
    all_sections: list[tuple[str, Callable[[], Iterable[str]]]] = [
        ("Hypotheses", lambda: contrast_section(results)),
        *((block.title, partial(sections.block, block, results, others, failures)) for block in results.blocks),
        *(
            (title, partial(sections.question_section, where, study, results, others))
            for where, title in sections.places(results).items()
        ),
    ]
    open_sections = len(all_sections)
    all_sections += [
        ("What the verdicts mean", lambda: sections.verdicts_mean(results)),
        ("Groups", lambda: sections.groups(study, results)),
        ("Sites", lambda: sections.groups(study, results, "site")),
        ("Motion and force", lambda: motion_section(results)),
        ("Planned exclusions", lambda: sections.planned_section(planned, sealed=not study.revealed)),
        ("How the study was run", lambda: sections.conduct(study, results)),
        ("Preregistration", lambda: preregistration_section(study)),
        (
            "Methods (text to paste)",
            lambda: (heading(2, "Methods (text to paste)"), box([paragraph(str(texts["methods"]))])),
        ),
        ("Reproducing this report", lambda: _reproduction_sentences(study, results)),
        ("Licence and citation", lambda: (heading(2, "Licence and citation"), bullets(credit_lines(study)))),
        ("Counts of answers", lambda: sections.counts_of_answers(results)),
        ("Questions in full", lambda: appendix(recorded_contents(study.folder))),
    ]
    first = try_part(
        failures, "first page", Markup(), lambda: [first_page(results, texts["limits"], numbers, drawn, presented)]
    )
    rendered = [
        (title, try_part(failures, f"section “{title}”", heading(2, title), make), place < open_sections)
        for place, (title, make) in enumerate(all_sections)
    ]
    body = render(
        "body.html",
        title=study.title,
        facts=_facts_sentences(study),
        marks=_marks(study),
        parts=[
            {"title": title, "html": html, "chunks": chunks(html[1:]), "open": is_open}
            for title, html, is_open in rendered
            if html
        ],
        failures=[str(failure) for failure in failures.found],
        first=Markup().join(first),
    )
    fonts = [(weight, font_face(name)) for weight, name in (("400", "Regular"), ("500 800", "Bold"))]
    return render(
        "page.html", title=f"{study.title}: report", body=body, fonts=[(weight, font) for weight, font in fonts if font]
    )


def _facts_sentences(study: Study) -> str:
    """Return sentences with the study's name, sample size, and the dates of the included sessions."""
    people = counted(study.n, "participant")
    rows = study.participants
    days = sorted({str(at)[:10] for at in rows.loc[rows["counted"], "started_at"]})
    dates = (
        "" if not days else f"Sessions on {days[0]}." if len(days) == 1 else f"Sessions from {days[0]} to {days[-1]}."
    )
    groups = listed([f"{count} {group}" for group, count in group_counts(study).items()])
    group_note = f" ({groups})" if groups else ""
    took_part = rows["participant"].nunique()
    planned = (study.protocol.get("analysis") or {}).get("participants")
    notes = ["all were included"] if study.n == took_part > 1 else []
    if notes and (left_out := int((~rows["counted"]).sum())):
        notes = [f"all were included, but {left_out} of {len(rows)} sessions {'was' if left_out == 1 else 'were'} not"]
    if left_out := took_part - study.n:
        notes = [
            f"{left_out} of {took_part} {'was' if left_out == 1 else 'were'} not included ({_why_not_included(study)})"
        ]
    notes += [] if planned is None else [f"{planned} were planned"]
    notes_sentence = f" {capitalised('; '.join(notes))}." if notes else ""
    sample = f"{people[:1].upper()}{people[1:]}{group_note}"
    return f"Study {study.name}, {version_text(study)}. {sample}.{notes_sentence} {dates}"


_EXCLUSION_REASONS: Final = {
    "below_chance": "answers below chance",
    "threshold_beyond_levels": "thresholds beyond the levels",
    "constant_answers": "constant answers",
    "fast_answers": "fast answers",
    **RULES,
}


def _why_not_included(study: Study) -> str:
    """Return a phrase with the number of participants without an included session for each reason."""
    rows = study.participants
    absent = rows[~rows["participant"].isin(study.people)]
    rules = {row.participant: row.rule_or_person for row in study.exclusions if row.trial is None}
    excluded = set(absent.loc[absent["excluded"], "participant"])
    damaged = set(absent.loc[absent["status"] == DAMAGED, "participant"])
    reasons = [
        _EXCLUSION_REASONS.get(rules.get(person, ""), "a researcher's decision")
        if person in excluded
        else "damaged session"
        if person in damaged
        else "unfinished session"
        for person in sorted(set(absent["participant"]))
    ]
    counts = ", ".join(f"{reason}: {count}" for reason, count in Counter(reasons).most_common())
    return f"{counts}; see “How the study was run”"


def _marks(study: Study) -> list[tuple[str, str]]:
    """Return the marks at the top of the page: CSS class and text."""
    marks = [("mark", "SIMULATED participants, not people")] if study.simulated else []
    marks += [("mark", "PILOT")] if study.pilot else []
    return marks if study.revealed else [*marks, ("sealed", "Blinded: conditions appear as codes")]


def _reproduction_sentences(study: Study, results: Results) -> Iterator[str]:
    """Yield the section on reproducing the report: settings, versions and hashes."""
    yield heading(2, "Reproducing this report")
    decided = results.decided
    bound = decided.equivalence_bound
    rows = [
        ("Analysis decided before the first session", "yes" if decided.binding else "no; all results are exploratory"),
        ("Alpha", decided.alpha_text()),
        *(
            [
                ("Equivalence bound for statements", "none" if bound is None else bound_text(bound)),
                ("Primary statements", (", ".join(decided.primary) or "all") if decided.binding else "none"),
            ]
            if results.blocks
            else []
        ),
        ("Seed of the analysis", str(results.seed)),
        *((f"Version of {library}", version) for library, version in versions().items()),
        *((f"Plug-in {package}", ", ".join(names)) for package, names in plug_ins(study).items()),
        ("Key opened", "; ".join(map(_reveal_text, reveals_of(study.folder))) or "no"),
    ]
    yield table(("Setting", "Value"), rows, words=2)
    hashes = files(study)
    together = hashlib.sha256("".join(f"{digest}  {name}\n" for name, digest in sorted(hashes.items())).encode())
    if len(hashes) <= _HASHES_SHOWN:
        yield table(("File", "SHA-256"), list(hashes.items()), words=2)
    yield paragraph(
        f"The numbers are based on {counted(len(hashes), 'file')}. The combined SHA-256 of the files' hashes and names "
        f"is {together.hexdigest()}. report.json contains the hash of each file and the seed of each session."
    )
    yield paragraph(
        "The files next to this page are report.json (all numbers), tests.csv (one row per test), motion.csv, the "
        "tables of responses, trials and aggregates with their codebook, every figure as PNG, SVG and PDF with "
        "its caption, methods.txt, and report.R, which recomputes the main numbers in base R. This report was made "
        f"with liquid-study {__version__}.",
        "soft",
    )


def _reveal_text(reveal: Mapping[str, str]) -> str:
    site = f"site {reveal['site']}, " if "site" in reveal else ""
    return f"{site}{reveal['at']} by {reveal['by']}: {reveal['reason']}"
