"""Measured motion and force from an inlet of the Lab Streaming Layer, where ``pylsl`` is installed.

A stream is used if its channels have the labels of a CSV file's columns (``growing_csv.HEADER``, without ``t_s``). Its
time stamps are the times of the rows.
"""

import importlib
import importlib.util
import math
from concurrent.futures import Executor, Future
from typing import Any, Final

import numpy as np

from study_app.errors import StudyError
from study_app.haptics.model.motion import PLACES, VELOCITIES
from study_app.lab.estimation.rows import FORCES, CentredVelocity, Rows, no_rows

LABELS: Final = (*PLACES[1:], *FORCES)
_INSTALL: Final = "the Lab Streaming Layer needs pylsl: pip install 'liquid-study[lsl]'"
_BUFFER_S: Final = 30
_OPENS_S: Final = 0.5


def available() -> bool:
    """Return whether ``pylsl`` is installed."""
    return importlib.util.find_spec("pylsl") is not None


class LslForce:
    """The first stream with the labels `LABELS`, and VELOCITIES where they are known.

    Parameters
    ----------
    name : str
        Of the stream; "" takes any.
    executor : Executor, optional
        Connects to streams, which may not answer for a second; by default `poll` does so itself.

    Raises
    ------
    StudyError
        ``pylsl`` or its library is not installed.
    """

    def __init__(self, name: str = "", executor: Executor | None = None) -> None:
        try:
            self._lsl: Any = importlib.import_module("pylsl")
        except (ImportError, RuntimeError, OSError) as error:  # without its library it raises RuntimeError
            raise StudyError(_INSTALL) from error
        self._resolver = self._lsl.ContinuousResolver(*(("name", name) if name else ()))
        self._executor = executor
        self._connecting: Future[tuple[Any, list[str]] | None] | None = None
        self._refused: set[str] = set()
        self._inlet: Any = None
        self._places: list[int] = []
        self._has_velocities = False
        self._last_s = -math.inf
        self._centred = CentredVelocity()

    @property
    def connected(self) -> bool:
        """Whether a stream was found."""
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
            return Rows(t_s, rows[:, :3], rows[:, 6:], rows[:, 3:6], np.ones(len(rows), bool))
        return self._centred.take(t_s, rows[:, :3], rows[:, 3:6])

    def close(self) -> None:
        """End the inlet."""
        inlet, self._inlet = self._inlet, None
        if inlet is not None:
            inlet.close_stream()

    def _connected_now(self) -> bool:
        """Use a stream that was opened meanwhile, or search for one; return whether there is one."""
        if self._executor is None:
            found = self._connect()
        elif self._connecting is None:
            self._connecting = self._executor.submit(self._connect)
            return False
        elif not self._connecting.done():
            return False
        else:
            connecting, self._connecting = self._connecting, None
            found = connecting.result()
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
                labels = _labels(inlet.info(timeout=_OPENS_S))
                if not set(LABELS) <= set(labels):
                    self._refused.add(found.uid())
                    continue
                inlet.open_stream(timeout=_OPENS_S)
            except (RuntimeError, TimeoutError):  # it ended, or does not answer now
                continue
            return inlet, labels
        return None


def _labels(info: Any) -> list[str]:
    """Return the labels of a stream's channels."""
    labels, channel = [], info.desc().child("channels").child("channel")
    while not channel.empty():
        labels.append(channel.child_value("label"))
        channel = channel.next_sibling("channel")
    return labels
