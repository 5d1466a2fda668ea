"""Tidy tables of all participants in files, with a codebook that explains every column, statement and level."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from study_app.analysis.cells import table_bytes
from study_app.analysis.codebook import codebook_bytes
from study_app.analysis.delivered import deliver
from study_app.analysis.output import write_files
from study_app.analysis.tables import Study, load_study


def export(folder: Path, to: Path, *, warn: Callable[[str], object] | None = None) -> tuple[Path, ...]:
    """Write responses, trials, aggregate and codebook of a study into the folder ``to``; return the files.

    Files that are not as they were recorded are used as they are: ``warn`` is told of each, and the codebook names it.

    Raises
    ------
    AnalysisError
        The results cannot be evaluated, or ``to`` cannot be written; nothing was.
    StoreError
        The key was opened, and is now missing or changed; or ``exclusions.csv`` cannot be read.
    """
    study = load_study(folder)
    written = write_files(Path(to), export_files(study))
    study.tell_doubts(warn)
    return written


def export_files(study: Study) -> dict[str, bytes]:
    """Return responses, trials, aggregate and codebook of a study, by the names of their files."""
    tables = {f"study-{study.name}_description-{table.name}_data.csv": table for table in deliver(study)}
    return {
        **{name: table_bytes(table) for name, table in tables.items()},
        "codebook.json": codebook_bytes(study, {name: table.columns for name, table in tables.items()}),
    }
