"""The tables of a study with their codebook, as files: CSV, and further formats that are asked for."""

from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType
from typing import Final, Literal, TypeAlias

from study_app.analysis.export import spss
from study_app.analysis.export.codebook import codebook_bytes
from study_app.analysis.export.delivered import Delivered
from study_app.analysis.export.table_formats import parquet_bytes, table_bytes
from study_app.analysis.export.wide_table import Cells, QuestionCells
from study_app.analysis.tables.study_tables import Study

Extra: TypeAlias = Literal["wide", "parquet", "sav", "psych-ds"]
OPENED: Final = ("tracks", "thresholds", "settings", "exponents")
"""Tables of levels that SPSS files are made of."""
NOTHING_ELSE: Final[frozenset[Extra]] = frozenset()


def table_files(
    study: Study,
    tables: Sequence[Delivered],
    extras: Collection[Extra] = NOTHING_ELSE,
    cells: Mapping[str, Cells | QuestionCells] = MappingProxyType({}),
) -> dict[str, bytes]:
    """Return tables of a study and their codebook, in the formats of ``extras``, too, by the names of their files.

    With ``extras`` the wide table is the last of ``tables``, and ``cells`` says what its columns hold.
    """
    written = tables if "wide" in extras or not extras else tables[:-1]
    files = {file_name(study, table, "csv"): table_bytes(table) for table in written}
    columns = {file_name(study, table, "csv"): table.columns for table in written}
    files["codebook.json"] = codebook_bytes(study, columns)
    if "parquet" in extras:
        files |= {file_name(study, table, "parquet"): parquet_bytes(table) for table in written}
    if "sav" in extras:
        files[file_name(study, tables[0], "sav")] = spss.long_sav(study, tables[0])
        files[file_name(study, tables[-1], "sav")] = spss.wide_sav(study, tables[-1], cells)
        files |= {file_name(study, one, "sav"): spss.plain_sav(study, one) for one in tables if one.name in OPENED}
    return files


def file_name(study: Study, table: Delivered, ending: str) -> str:
    """Return the name of a table's file."""
    return f"study-{study.name}_description-{table.name}_data.{ending}"
