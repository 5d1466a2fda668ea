"""Measured motion and force from a CSV file that another program appends to."""

import csv
import math
from pathlib import Path
from typing import Final

import numpy as np

from study_app.errors import StudyError
from study_app.haptics.model.motion import PLACES, SHOWN, VELOCITIES, refuse_device
from study_app.lab.estimation.rows import FORCES, CentredVelocity, Floats, Rows, no_rows

HEADER: Final = f"{','.join(PLACES + FORCES)}, with {','.join(VELOCITIES)} where they are known"
_MOST_BYTES: Final = 65_536
"""Greatest number of bytes per call: later calls read the rest of a long file."""


class GrowingCsv:
    """A file with the columns of `HEADER`, in any order; other columns and lines that begin with # are ignored.

    Parameters
    ----------
    path : Path
        It may have rows already, or only a header. A last line is read once its line end is written.

    Raises
    ------
    StudyError
        It cannot be read, or has another header.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._read = 0
        self._line = 0
        self._rest = b""
        self._places: list[int] = []
        self._has_velocities = False
        self._last_s = -math.inf
        self._centred = CentredVelocity()
        self._bytes()  # raises at once if it cannot be read
        self._read, self._rest = 0, b""

    def poll(self) -> Rows:
        """Return the rows that were appended since.

        Raises
        ------
        StudyError
            The file cannot be read, became shorter, or has a line that cannot be used.
        """
        numbered = []
        for line in self._bytes():
            self._line += 1
            if line.strip() and not line.startswith("#"):
                numbered.append((self._line, next(csv.reader([line]))))
        if numbered and not self._places:
            self._take_header(numbered.pop(0)[1])
        if not numbered:
            return no_rows()
        rows = np.array([self._row(number, fields) for number, fields in numbered])
        self._check_times(rows[:, 0], numbered)
        if self._has_velocities:
            return Rows(rows[:, 0], rows[:, 1:4], rows[:, 7:], rows[:, 4:7], np.ones(len(rows), bool))
        return self._centred.take(rows[:, 0], rows[:, 1:4], rows[:, 4:7])

    def _bytes(self) -> list[str]:
        """Return the complete lines not yet read."""
        try:
            refuse_device(self.path)
            with self.path.open("rb") as file:
                size = file.seek(0, 2)
                if size < self._read:
                    raise StudyError(f"{self.path} became shorter while it was read: append to it, or choose it again")
                file.seek(self._read)
                found = file.read(_MOST_BYTES)
        except OSError as error:
            raise StudyError(f"cannot read {self.path}: {error.strerror}; name a CSV file of {HEADER}") from error
        first = self._read == 0
        self._read += len(found)
        *lines, self._rest = (self._rest + found).split(b"\n")
        try:
            text = [line.decode("utf-8") for line in lines]
        except UnicodeDecodeError as error:
            raise StudyError(f"cannot read {self.path}: it is not UTF-8 text; name a CSV file of {HEADER}") from error
        return [text[0].removeprefix("\ufeff"), *text[1:]] if first and text else text

    def _take_header(self, header: list[str]) -> None:
        names = [name.strip() for name in header]
        wanted = PLACES + FORCES
        if lacking := [name for name in wanted if name not in names]:
            raise StudyError(f"{self.path} has no column {', '.join(lacking)}: the first line must name {HEADER}")
        self._has_velocities = all(name in names for name in VELOCITIES)
        self._places = [names.index(name) for name in wanted + (VELOCITIES if self._has_velocities else ())]

    def _row(self, number: int, fields: list[str]) -> list[float]:
        if len(fields) <= max(self._places):
            raise StudyError(f"{self.path}, line {number}: has {len(fields)} fields, fewer than the header names")
        row = []
        for place in self._places:
            try:
                value = float(fields[place])
            except ValueError:
                value = math.nan
            if not math.isfinite(value):
                raise StudyError(
                    f"{self.path}, line {number}: {fields[place][:SHOWN]!r} is not a finite number; correct it"
                )
            row.append(value)
        return row

    def _check_times(self, t_s: Floats, numbered: list[tuple[int, list[str]]]) -> None:
        falls = np.flatnonzero(np.diff(t_s, prepend=self._last_s) <= 0)
        if len(falls):
            raise StudyError(f"{self.path}, line {numbered[falls[0]][0]}: t_s must increase, but does not here")
        self._last_s = float(t_s[-1])
