"""Tidy tables of all participants in files, with a codebook that explains every column, statement and level."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path

from study_app.analysis.export import psychds_dataset, spss
from study_app.analysis.export.frame_csv import table_bytes
from study_app.analysis.export.table_files import NOTHING_ELSE, Extra, file_name, table_files, tables_of
from study_app.analysis.tables.study import Study, load_study
from study_app.store.output_files import write_files


def export(
    folder: Path,
    to: Path,
    *,
    extras: Collection[Extra] = NOTHING_ELSE,
    warn: Callable[[str], object] | None = None,
) -> tuple[Path, ...]:
    """Write the tables and the codebook of a study into the folder ``to``; return the files.

    Tables: responses, trials, aggregate; of a study with levels also intervals and, once its key is open, tracks
    and thresholds, and where participants set levels their settings.

    Files that are not as they were recorded are used as they are: ``warn`` receives each, and the codebook names it.

    Parameters
    ----------
    extras : what is written in addition
        "wide": the answers, a row a participant; "parquet": the tables as Parquet; "sav": the answers, long and wide,
        for SPSS; "psych-ds": a folder to share that keeps the rules of Psych-DS: all tables, report, script
        and the study's file.

    Raises
    ------
    AnalysisError
        The results cannot be evaluated, the library for .sav is missing, or ``to`` cannot be written; nothing was.
    StoreError
        The key was opened, and is now missing or changed; or ``exclusions.csv`` cannot be read.
    """
    if "sav" in extras:
        spss.require()
    study = load_study(folder)
    written = write_files(Path(to), export_files(study, extras))
    study.tell_doubts(warn)
    return written


def export_files(study: Study, extras: Collection[Extra] = NOTHING_ELSE) -> dict[str, bytes]:
    """Return the tables and the codebook of a study, and the ``extras``, by the names of their files."""
    files = table_files(study, extras)
    if "psych-ds" in extras:
        tables = {file_name(study, table, "csv"): table for table in tables_of(study, with_wide=True)}
        contents = {name: files.get(name) or table_bytes(table) for name, table in tables.items()}
        described = {name: table.columns for name, table in tables.items()}
        files |= psychds_dataset.dataset_files(study, contents, described, _report(study))
    return files


def _report(study: Study) -> dict[str, bytes]:
    from study_app.analysis.report.write_report import asks, report_files  # noqa: PLC0415 - only to share a study

    return report_files(study)[0] if asks(study) else {}
