"""Tables compared with what the journals give, and their cells with the column dictionary.

A table of a session that has not ended may be an earlier state of what its journal gives: this is only a warning.
"""

import csv
import io
from collections.abc import Callable, Mapping
from itertools import zip_longest
from pathlib import Path

from study_app.errors import StoreError
from study_app.store.atomic import read_regular
from study_app.store.blinded.sealing import opened_key
from study_app.store.journals.journal import Line
from study_app.store.sessions.open_session import Place, table_files
from study_app.store.tables import csv_files
from study_app.store.tables.column import MISSING, Column
from study_app.store.tables.columns import TABLES
from study_app.store.tables.session_tables import table_columns
from study_app.store.verification import table_checks
from study_app.store.verification.violations import Gathered

_COUNTED = frozenset(
    {"status", "session_ended_at", "resumed", "language", "trials", "responses", "validity"}
)  # columns of a session that later events change


def check_tables(place: Place, lines: list[Line], said: set[Path], found: Gathered) -> None:
    """Compare the tables with the journal, but for those of which something was ``said``."""
    try:
        expected = table_files(place, lines, opened_key(place.study_folder))
    except StoreError as error:
        found.error(place.folder.journal, f"gives no tables: {error}")
        return
    ended = lines[-1]["event"] == "session_ended"
    tables = table_columns(lines, opened=True)
    for (path, content), name in zip(expected, tables, strict=True):
        if path not in said:
            check_table(path, content, name, found, may_be_behind=lambda _: not ended, tables=tables)


def check_table(
    path: Path,
    expected: bytes,
    name: str,
    found: Gathered,
    *,
    may_be_behind: Callable[[int], bool],
    tables: Mapping[str, tuple[Column, ...]] = TABLES,
) -> None:
    """Compare a table with what the journals give, and its cells with the dictionary.

    ``may_be_behind`` says of a line's number whether it is of a session that has not ended, whose tables follow its
    journal with the next page or when it is rebuilt.
    """
    try:
        content = read_regular(path)
    except OSError:
        found.error(path, "is missing or cannot be read; rebuild makes it again")
        return
    expected, columns = csv_files.in_columns_of(content, expected, tables[name])
    if differing := _differing_lines(content, expected):
        beginning = expected.startswith(content)
        behind = all(map(may_be_behind, differing)) and (beginning or _is_behind(content, expected, name))
        report = found.warning if behind else found.error
        report(path, f"differs from the journal, from line {differing[0]} on; rebuild renews it")
        if behind and beginning:  # a program killed while it wrote a row
            return
    for problem in table_checks.problems(content, columns):
        found.error(path, problem)


def _is_behind(held: bytes, expected: bytes, table: str) -> bool:
    """Return whether a table ``held`` may be an earlier state of ``expected``: it holds nothing that this lacks."""
    try:
        theirs, ours = (
            list(csv.reader(io.StringIO(content.decode("utf-8", "replace"), newline=""), strict=True))
            for content in (held, expected)
        )
    except csv.Error:
        return False
    if len(theirs) > len(ours) or theirs[:1] != ours[:1]:
        return False
    return all(
        here == there or _may_lag(table, name, here, there)
        for early, late in zip(theirs, ours, strict=False)
        for name, here, there in zip_longest(ours[0], early, late, fillvalue="")
    )


def _may_lag(table: str, name: str, here: str, there: str) -> bool:
    """Return whether a cell ``here`` may become ``there`` with later events of its session."""
    if table == "participants":
        return name in _COUNTED
    return here == MISSING or (name, here) == ("marked", "false") or (name == "notes" and there.startswith(here))


def _differing_lines(content: bytes, expected: bytes) -> list[int]:
    pairs = zip_longest(content.split(b"\n"), expected.split(b"\n"))
    return [number for number, (ours, theirs) in enumerate(pairs, start=1) if ours != theirs]
