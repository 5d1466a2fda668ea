"""The tables of a running session: at each page only changed rows are written, independent of the number of rows.

A program killed while it writes leaves a table that is the beginning of what the journal gives.
"""

from collections.abc import Callable, Sequence
from itertools import accumulate
from pathlib import Path

from study_app.store.atomic import replace_end, write_file
from study_app.store.blinded.blinding import Key
from study_app.store.blinded.sealing import opened
from study_app.store.journals.journal import Line
from study_app.store.tables.column import Column
from study_app.store.tables.csv_files import Row, header_bytes, records
from study_app.store.tables.session_tables import SessionRows, table_columns


class GrowingTables:
    """The tables of a session on the disk, kept up to date with its journal.

    Parameters
    ----------
    path_of : callable
        Returns the path of the table of a name.
    """

    def __init__(self, path_of: Callable[[str], Path]) -> None:
        self._path_of = path_of
        self._tables: dict[str, _GrowingTable] = {}
        self._rows: SessionRows | None = None
        self._taken = 0  # lines of the journal
        self._opened = False

    def write(self, lines: Sequence[Line], key: Key | None, *, whole: bool = False) -> None:
        """Bring the tables up to date with the journal's ``lines``, which are those of before and new ones.

        Parameters
        ----------
        lines : sequence of Line
            The journal's, those of before and new ones.
        key : Key or None
            The study's, once it was opened; without it the sealed columns are left out.
        whole : bool
            Whether the files are replaced as wholes and flushed to the disk.

        Raises
        ------
        StoreError
            A table cannot be written; the next call tries again.
        """
        if whole or self._rows is None or self._opened != (key is not None):
            self._rows, self._taken, self._opened = SessionRows(opened(lines, key)), len(lines), key is not None
            for table in self._tables.values():
                table.forget()
        rows = self._rows
        for line in opened([lines[0], *lines[self._taken :]], key)[1:]:
            self._taken += 1
            rows.take(line)
        for name, columns in table_columns(lines, opened=self._opened).items():
            table = self._tables.setdefault(name, _GrowingTable(self._path_of(name)))
            first = {"trials": rows.changed, "intervals": rows.changed_intervals}.get(name, table.rows)
            table.write(columns, rows.table(name), first, waits=whole)
        rows.changed, rows.changed_intervals = len(rows.trials), len(rows.intervals)


class _GrowingTable:
    """One table, and where each of its records ends in the file."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._ends: list[int] = []  # the header's first; none where the file must be written as a whole

    @property
    def rows(self) -> int:
        """How many rows the file holds."""
        return max(0, len(self._ends) - 1)

    def forget(self) -> None:
        """Rewrite the whole file next time."""
        self._ends = []

    def write(self, columns: Sequence[Column], rows: Sequence[Row], first: int, *, waits: bool) -> None:
        """Write the rows from index ``first`` on; all of them if the file was changed meanwhile."""
        kept = first + 1 if self._is_as_left() else 0  # records
        start = self._ends[kept - 1] if kept else 0
        new = [*([] if kept else [header_bytes(columns)]), *records(columns, rows[max(0, kept - 1) :])]
        if not new:
            return
        ends, self._ends = self._ends, []  # none before it is written
        if kept:
            replace_end(self._path, start, b"".join(new))
        else:
            write_file(self._path, b"".join(new), waits=waits)
        ends[kept:] = [*accumulate(map(len, new), initial=start)][1:]
        self._ends = ends

    def _is_as_left(self) -> bool:
        if not self._ends:
            return False
        try:
            return self._path.stat().st_size == self._ends[-1]
        except OSError:
            return False
