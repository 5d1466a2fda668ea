"""The tables of a study with their codebook, as files: CSV, and further formats that are asked for."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final, Literal, TypeAlias

from study_app.analysis.export import spss
from study_app.analysis.export.codebook import codebook_bytes
from study_app.analysis.export.delivered import Delivered
from study_app.analysis.export.frame_csv import table_bytes
from study_app.analysis.export.typed_tables import deliver
from study_app.analysis.export.wide_table import wide
from study_app.analysis.tables.study import Study

Extra: TypeAlias = Literal["wide", "parquet", "sav", "psych-ds"]
OPENED: Final = ("tracks", "thresholds", "settings")
"""Tables of levels that SPSS files are made of."""
NOTHING_ELSE: Final[frozenset[Extra]] = frozenset()


def tables_of(study: Study, *, with_wide: bool) -> list[Delivered]:
    """Return the tables of a study, the wide one last where it is asked for."""
    return [*deliver(study), *([wide(study)[0]] if with_wide else [])]


def table_files(study: Study, extras: Collection[Extra] = NOTHING_ELSE) -> dict[str, bytes]:
    """Return the tables and the codebook of a study, in the formats of ``extras``, too, by the names of their files."""
    tables = list(deliver(study))
    responses = tables[0]
    across, cells = wide(study) if extras else (None, {})
    if across is not None and "wide" in extras:
        tables.append(across)
    files = {file_name(study, table, "csv"): table_bytes(table) for table in tables}
    columns = {file_name(study, table, "csv"): table.columns for table in tables}
    files["codebook.json"] = codebook_bytes(study, columns)
    if "parquet" in extras:
        from study_app.analysis.export.parquet import parquet_bytes  # noqa: PLC0415 - loads its library where it is asked for

        files |= {file_name(study, table, "parquet"): parquet_bytes(table) for table in tables}
    if across is not None and "sav" in extras:
        files[file_name(study, responses, "sav")] = spss.long_sav(study, responses)
        files[file_name(study, across, "sav")] = spss.wide_sav(study, across, cells)
        files |= {file_name(study, one, "sav"): spss.plain_sav(study, one) for one in tables if one.name in OPENED}
    return files


def file_name(study: Study, table: Delivered, ending: str) -> str:
    """Return the name of a table's file."""
    return f"study-{study.name}_description-{table.name}_data.{ending}"
