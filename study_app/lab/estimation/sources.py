"""Sources of measured motion and force: a CSV file that grows, an inlet of LSL (``pylsl``).

A stream of LSL is used if its channels have the labels of a CSV file's columns (`HEADER`, without ``t_s``); its time
stamps are the times of the rows.
"""

from __future__ import annotations

import importlib
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.errors import StudyError
from study_app.haptics.model.motion import PLACES, VELOCITIES, refuse_device
from study_app.text_tables import Line, decoded, fields_of, names_of, numbers_at, separator_of

Floats: TypeAlias = NDArray[np.float64]

FORCES: Final = ("fx_n", "fy_n", "fz_n")
HALF_S: Final = 0.0125
"""Half width of the window for velocities: a tenth of the period of strokes of 4 Hz in total. [choice]"""
GAP_S: Final = 0.05
"""A longer time between two rows restarts the estimation, since the motion between them is unknown."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Rows:
    """Rows of a stream in the scene frame.

    ``t_s`` (n,) increases; ``position_m``, ``velocity_mps`` and ``force_n`` (the liquid's on the body) are (n, 3).
    Where ``usable`` (n,) is false only the motion is known.
    """

    t_s: Floats
    position_m: Floats
    velocity_mps: Floats
    force_n: Floats
    usable: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.t_s)

    def part(self, first: int, behind: int | None = None) -> Rows:
        return Rows(**{name: getattr(self, name)[first:behind] for name in self.__slots__})


def no_rows() -> Rows:
    """Return no rows."""
    return Rows(
        t_s=np.empty(0),
        position_m=np.empty((0, 3)),
        velocity_mps=np.empty((0, 3)),
        force_n=np.empty((0, 3)),
        usable=np.empty(0, bool),
    )


def joined(*parts: Rows) -> Rows:
    """Return successive rows joined."""
    return Rows(**{name: np.concatenate([getattr(it, name) for it in parts]) for name in Rows.__slots__})


class CentredVelocity:
    """Computes velocities of a stream without them: the slope through the positions 12.5 ms to both sides.

    A row is returned once the positions after it are known. A gap restarts the window.
    """

    def __init__(self) -> None:
        self._t_s: Floats = np.empty(0)
        self._position_m: Floats = np.empty((0, 3))
        self._force_n: Floats = np.empty((0, 3))

    def take(self, t_s: Floats, position_m: Floats, force_n: Floats) -> Rows:
        """Return the rows that are complete: times (n,) [s], positions [m] and forces [N] (n, 3) are the next ones."""
        self._t_s = np.concatenate([self._t_s, t_s])
        self._position_m = np.concatenate([self._position_m, position_m])
        self._force_n = np.concatenate([self._force_n, force_n])
        gaps = np.flatnonzero(np.diff(self._t_s) > GAP_S)
        if len(gaps):
            self._drop(int(gaps[-1]) + 1)
        if len(self._t_s) < 3:
            return no_rows()
        half = max(1, round(HALF_S / float(np.median(np.diff(self._t_s)))))
        width = 2 * half + 1
        if len(self._t_s) < width:
            return no_rows()
        times_s = np.lib.stride_tricks.sliding_window_view(self._t_s, width)
        places_m = np.lib.stride_tricks.sliding_window_view(self._position_m, width, axis=0)
        lever_s = times_s - times_s.mean(axis=1, keepdims=True)
        slopes = np.einsum("nw,naw->na", lever_s, places_m) / np.sum(lever_s**2, axis=1)[:, np.newaxis]
        inner = slice(half, half + len(slopes))
        out = Rows(
            t_s=self._t_s[inner],
            position_m=self._position_m[inner],
            velocity_mps=slopes,
            force_n=self._force_n[inner],
            usable=np.ones(len(slopes), bool),
        )
        self._drop(len(slopes))
        return out

    def _drop(self, count: int) -> None:
        self._t_s, self._position_m = self._t_s[count:], self._position_m[count:]
        self._force_n = self._force_n[count:]


HEADER: Final = f"{','.join(PLACES + FORCES)}, with {','.join(VELOCITIES)} where they are known"
_MOST_BYTES: Final = 65_536
"""Greatest number of bytes per call: later calls read the rest of a long file."""


class GrowingCsv:
    """A file with the columns of `HEADER`, in any order; other columns and lines that begin with # are ignored.

    It may have rows already, or only a header. A last line is read once its line end is written. A `StudyError` is
    raised where it cannot be read, or has another header.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._read = 0
        self._line = 0
        self._rest = b""
        self._separator, self._columns = ",", 0
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
                numbered.append((self._line, line))
        if numbered and not self._places:
            self._take_header(numbered.pop(0)[1])
        if not numbered:
            return no_rows()
        rows = np.array([self._numbers(number, line) for number, line in numbered])
        falls = np.flatnonzero(np.diff(rows[:, 0], prepend=self._last_s) <= 0)
        if len(falls):
            raise StudyError(f"{self.path}, line {numbered[falls[0]][0]}: t_s must increase, but does not here")
        self._last_s = float(rows[-1, 0])
        if self._has_velocities:
            return Rows(
                t_s=rows[:, 0],
                position_m=rows[:, 1:4],
                velocity_mps=rows[:, 7:],
                force_n=rows[:, 4:7],
                usable=np.ones(len(rows), bool),
            )
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
        self._read += len(found)
        *lines, self._rest = (self._rest + found).split(b"\n")
        try:
            return [decoded(line, number) for number, line in enumerate(lines, start=self._line + 1)]
        except ValueError as error:
            raise StudyError(f"cannot read {self.path}: {error}; name a CSV file of {HEADER}") from error

    def _numbers(self, number: int, line: str) -> list[float]:
        try:
            return numbers_at(Line(number, fields_of(line, self._separator)), self._places, self._columns)
        except ValueError as error:
            raise StudyError(f"{self.path}, {error}") from error

    def _take_header(self, header: str) -> None:
        wanted = PLACES + FORCES
        self._separator = separator_of(header, wanted)
        names = names_of(header, self._separator)
        self._columns = len(names)
        if lacking := [name for name in wanted if name not in names]:
            raise StudyError(f"{self.path} has no column {', '.join(lacking)}: the first line must name {HEADER}")
        self._has_velocities = all(name in names for name in VELOCITIES)
        self._places = [names.index(name) for name in wanted + (VELOCITIES if self._has_velocities else ())]


LABELS: Final = (*PLACES[1:], *FORCES)
_INSTALL: Final = "the Lab Streaming Layer needs pylsl: pip install 'liquid-study[lsl]'"
_BUFFER_S: Final = 30
_OPENS_S: Final = 0.5


class LslForce:
    """The first stream with the labels `LABELS`, and VELOCITIES where they are known, called ``name``, "" for any.

    A `StudyError` is raised where ``pylsl`` or its library is not installed.
    """

    def __init__(self, name: str = "") -> None:
        try:
            self._lsl: Any = importlib.import_module("pylsl")
        except (ImportError, RuntimeError, OSError) as error:  # without its library it raises RuntimeError
            raise StudyError(_INSTALL) from error
        self._resolver = self._lsl.ContinuousResolver(*(("name", name) if name else ()))
        self._refused: set[str] = set()
        self._inlet: Any = None
        self._places: list[int] = []
        self._has_velocities = False
        self._last_s = -math.inf
        self._centred = CentredVelocity()

    @property
    def connected(self) -> bool:
        return self._inlet is not None

    def poll(self) -> Rows:
        """Return the rows received since the last call; none before a stream was found."""
        if self._inlet is None and not self._connected_now():
            return no_rows()
        try:
            samples, stamps = self._inlet.pull_chunk(timeout=0.0, max_samples=4096)
        except RuntimeError as error:  # the base of what pylsl raises
            raise StudyError("the LSL stream of measured force ended: start it again, then choose it again") from error
        if not stamps:
            return no_rows()
        t_s = np.asarray(stamps, float)
        rows = np.asarray(samples, float)[:, self._places]
        newer = np.concatenate([[self._last_s], np.maximum.accumulate(t_s)])
        kept = (t_s > newer[:-1]) & np.isfinite(rows).all(axis=1)
        t_s, rows = t_s[kept], rows[kept]
        if len(t_s) == 0:
            return no_rows()
        self._last_s = float(t_s[-1])
        if self._has_velocities:
            return Rows(
                t_s=t_s,
                position_m=rows[:, :3],
                velocity_mps=rows[:, 6:],
                force_n=rows[:, 3:6],
                usable=np.ones(len(rows), bool),
            )
        return self._centred.take(t_s, rows[:, :3], rows[:, 3:6])

    def close(self) -> None:
        inlet, self._inlet = self._inlet, None
        if inlet is not None:
            inlet.close_stream()

    def _connected_now(self) -> bool:
        """Use a stream that was opened meanwhile, or search for one; return whether there is one."""
        found = self._connect()
        if found is None:
            return False
        inlet, labels = found
        self._has_velocities = set(VELOCITIES) <= set(labels)
        self._places = [labels.index(it) for it in (*LABELS, *(VELOCITIES if self._has_velocities else ()))]
        self._inlet = inlet
        return True

    def _connect(self) -> tuple[Any, list[str]] | None:
        """Open the first stream with the labels; return its inlet and labels, None where there is none."""
        for found in self._resolver.results():
            if found.uid() in self._refused:
                continue
            inlet = self._lsl.StreamInlet(found, max_buflen=_BUFFER_S, recover=False)
            try:
                info = inlet.info(timeout=_OPENS_S)
                labels = _labels(info)[: info.channel_count()]
                if not set(LABELS) <= set(labels) or info.channel_format() == self._lsl.cf_string:
                    self._refused.add(found.uid())
                    continue
                inlet.open_stream(timeout=_OPENS_S)
            except (RuntimeError, TimeoutError):  # it ended, or does not answer now
                continue
            return inlet, labels
        return None


def _labels(info: Any) -> list[str]:
    labels, channel = [], info.desc().child("channels").child("channel")
    while not channel.empty():
        labels.append(channel.child_value("label"))
        channel = channel.next_sibling("channel")
    return labels
