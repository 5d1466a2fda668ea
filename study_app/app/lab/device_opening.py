"""A device for the lab, opened in the background: one at a time, cancelled when another is wanted."""

from __future__ import annotations

import gc
import threading
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QCoreApplication, QObject, Qt, QTimer, Signal

if TYPE_CHECKING:
    from study_app.lab.live import Live

PATIENCE_S = 20.0
STARTS_AFTER_MS = 150  # the lab is laid out and painted first: opening a device takes Python's lock for long


class LabOpening(QObject):
    """Opens the device that is wanted, and lets go of one that is not any more.

    ``opened`` carries a `Live` whose servo runs at rest; ``failed`` what was met instead; ``said`` a line that the
    device asks for while it is opened.

    Parameters
    ----------
    open_live : opens a device by its name, as ``lab.live.open_live`` does
    options : values of devices' options, by name
    """

    opened = Signal(object)
    failed = Signal(object)
    said = Signal(str)
    _done = Signal(object)

    def __init__(self, open_live: Callable[..., Live] | None = None, options: Mapping[str, Path] | None = None) -> None:
        super().__init__()
        self._open_live = open_live
        self._options = options
        self._wanted: str | None = None
        self._opening: str | None = None
        self._cancelled = threading.Event()
        self._thread: threading.Thread | None = None
        self._began_s = 0.0
        self._start = QTimer(self)
        self._start.setSingleShot(True)
        self._start.setInterval(STARTS_AFTER_MS)
        self._start.timeout.connect(self._begin)
        self._done.connect(self._end, Qt.ConnectionType.QueuedConnection)

    @property
    def busy_with(self) -> str | None:
        """The device that is being opened and still wanted; None where none is."""
        return self._wanted

    @property
    def lasts_s(self) -> float:
        """How long a device has been opened so far [s]; 0 where none is."""
        return 0.0 if self._thread is None or self._wanted is None else time.monotonic() - self._began_s

    def want(self, name: str) -> None:
        """Open a device; one that is being opened is given up first."""
        self.cancel()
        self._wanted = name
        if self._thread is None:
            self._start.start()

    def cancel(self) -> None:
        """Want nothing any more: what is being opened is closed as soon as it is open."""
        self._wanted = None
        self._start.stop()
        self._cancelled.set()

    def wait(self, patience_s: float = PATIENCE_S) -> None:
        """Wait for what is being opened: it must be let go of in the windows' thread, not in its own."""
        if self._thread is not None:
            self._thread.join(patience_s)
            QCoreApplication.sendPostedEvents(self)

    def _begin(self) -> None:
        assert self._wanted is not None  # noqa: S101 - begun only where something is wanted
        self._opening, self._cancelled, self._began_s = self._wanted, threading.Event(), time.monotonic()
        self._thread = threading.Thread(
            target=self._open, args=(self._wanted, self._cancelled), name="lab opening", daemon=True
        )
        self._thread.start()

    def _open(self, name: str, cancelled: threading.Event) -> None:
        """Compile, open and start, in a thread of its own; whatever comes of it goes to ``_end``."""
        try:
            loads = self._open_live is None
            if self._open_live is None:
                from study_app.lab.live import open_live  # noqa: PLC0415 - the compiler: only once it is needed

                self._open_live = partial(open_live, options=self._options)
            made: object = self._open_live(name, progress=self.said.emit, cancelled=cancelled.is_set)
            if loads:
                gc.freeze()  # the windows' thread need not look through all that was loaded here
        except Exception as error:  # noqa: BLE001 - handed over: a thread has no caller to raise it to
            made = error
        self._done.emit((made, cancelled))

    def _end(self, done: tuple[object, threading.Event]) -> None:
        """Hand over what was opened, or let go of it where it is not wanted any more."""
        made, cancelled = done
        self._thread = None
        if not cancelled.is_set():
            self._wanted = None
            (self.failed if isinstance(made, Exception) else self.opened).emit(made)
            return
        if not isinstance(made, Exception):
            try:
                made.close()  # type: ignore[attr-defined]
            except Exception as error:  # noqa: BLE001 - reported: it may push, and the next one does not wait
                self.failed.emit(error)
        if self._wanted is not None:
            self._begin()
