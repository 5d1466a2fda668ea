"""The tables of a running session: at each page only the rows that changed are written, however many were before them.

A program killed while it writes leaves a table that is the beginning of what the journal gives.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from pathlib import Path

from study_app.store.atomic import replace_end, write_file
from study_app.store.blinded.blinding import Key
from study_app.store.blinded.sealing import opened
from study_app.store.journals.journal import Line
from study_app.store.tables.columns import RESPONSES, Column
from study_app.store.tables.csv_files import Row, header_bytes, records
from study_app.store.tables.session_tables import SessionRows, trial_columns


class GrowingTables:
    """The two tables of a session on the disk, ``responses`` and ``trials``, kept up to date with its journal."""

    def __init__(self, responses: Path, trials: Path) -> None:
        self._responses = _GrowingTable(responses)
        self._trials = _GrowingTable(trials)
        self._rows: SessionRows | None = None
        self._taken = 0  # lines of the journal
        self._opened = False

    def write(self, lines: Sequence[Line], key: Key | None, *, whole: bool = False) -> None:
        """Bring the tables up to date with the journal's ``lines``, which are those of before and new ones.

        Parameters
        ----------
        key : Key, optional
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
            self._responses.forget()
            self._trials.forget()
        rows = self._rows
        for line in opened([lines[0], *lines[self._taken :]], key)[1:]:
            self._taken += 1
            rows.take(line)
        self._responses.write(RESPONSES, rows.responses, self._responses.rows, waits=whole)
        self._trials.write(trial_columns(lines, opened=self._opened), rows.trials, rows.changed, waits=whole)
        rows.changed = len(rows.trials)


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
        """Write the file as a whole next time."""
        self._ends = []

    def write(self, columns: Sequence[Column], rows: Sequence[Row], first: int, *, waits: bool) -> None:
        """Write the rows from index ``first`` on; all of them where the file is not as it was left."""
        kept = first + 1 if self._is_as_left() else 0  # records
        start = self._ends[kept - 1] if kept else 0
        new = [*([] if kept else [header_bytes(columns)]), *records(columns, rows[max(0, kept - 1) :])]
        if not new:
            return
        ends, self._ends = self._ends, []  # none until it is written
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
