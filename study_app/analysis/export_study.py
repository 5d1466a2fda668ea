"""Tidy tables of all participants in files, with a codebook that explains every column, statement and level."""

import importlib
from collections.abc import Callable, Collection, Mapping
from pathlib import Path

from study_app.analysis.data.study_tables import Study, load_study
from study_app.analysis.export import psychds_dataset
from study_app.analysis.export.table_files import NOTHING_ELSE, Extra, file_name, table_bytes, table_files
from study_app.analysis.export.tables import exported_tables, wide_table
from study_app.analysis.results import Failure, Progress, report_no_progress
from study_app.store.files import FileCopy, write_output


def export(
    folder: Path,
    to: Path,
    *,
    extras: Collection[Extra] = NOTHING_ELSE,
    progress: Progress = report_no_progress,
    warn: Callable[[str], object] | None = None,
    failed: Callable[[str], object] | None = None,
) -> tuple[Path, ...]:
    """Write the tables and the codebook of a study into the folder ``to``; return the files.

    Tables: responses, trials, aggregate; for a study with levels also intervals and, once its key is open, tracks and
    the statistics in `analysis.levels`.

    Files that differ from their recorded state are used: ``warn`` is called for each, and the codebook lists them.

    Parameters
    ----------
    extras : additional outputs
        "wide": the answers, one row per participant; "parquet": the tables as Parquet; "sav": the answers, long and
        wide, for SPSS; "psych-ds": a folder to share that conforms to Psych-DS: all tables, report, script and the
        study's file.
    progress : callable, optional
        Called with the current activity and the fraction done (0 to 1); an exception that it raises ends the export.
    failed : callable, optional
        Called with a line for every section of the shared report that could not be computed.

    Raises
    ------
    AnalysisError
        The results cannot be evaluated, or ``to`` cannot be written; nothing was written.
    StoreError
        The key was opened, and is now missing or changed; or ``exclusions.csv`` cannot be read.
    """
    if "sav" in extras:
        importlib.import_module("pyreadstat")  # before anything is read
    progress("reading", 0.0)
    study = load_study(folder)
    progress("creating the tables", 0.3)
    files, failures = _files(study, extras)
    progress("writing", 0.9)
    written = write_output(study.folder, Path(to), files, warn)
    study.tell_doubts(warn)
    if failed is not None:
        for failure in failures:
            failed(f"error: {failure}")
    return written


def _files(study: Study, extras: Collection[Extra]) -> tuple[Mapping[str, bytes | FileCopy], tuple[Failure, ...]]:
    """Return all files by name, and the sections of the shared report that failed."""
    across, cells = wide_table(study) if extras else (None, {})
    tables = [*exported_tables(study), *([] if across is None else [across])]
    files = table_files(study, tables, extras, cells)
    if "psych-ds" not in extras:
        return files, ()
    from study_app.analysis.report.write_report import has_results, report_files  # noqa: PLC0415 - only to share a study

    report, failures = report_files(study) if has_results(study) else ({}, ())
    named = {file_name(study, table, "csv"): table for table in tables}
    contents = {name: files.get(name) or table_bytes(table) for name, table in named.items()}
    described = {name: table.columns for name, table in named.items()}
    return files | psychds_dataset.dataset_files(study, contents, described, report), failures
