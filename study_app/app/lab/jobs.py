"""What the lab does outside the window's thread: costs, opening a device, saving presets."""

from __future__ import annotations

import gc
import logging
import threading
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QCoreApplication, QObject, Qt, QTimer, Signal

from study_app.evidence.appraisal import AppraisalClient, Costs, Errors, Question
from study_app.haptics.model.scene import Scene
from study_app.lab.ab_comparison import Setting
from study_app.lab.presets import Choice, liquids_at_hand, liquids_of, preset_text, save, spoken, use_in_study

if TYPE_CHECKING:
    from study_app.lab.live import Live

log = logging.getLogger(__name__)


class Prices:
    """What the felt setting costs and how true it is, as far as it was answered."""

    def __init__(self, make_appraiser: Callable[[], AppraisalClient]) -> None:
        self._make = make_appraiser
        self._appraiser: AppraisalClient | None = None
        self._asked = 0
        self.costs: Costs | None = None
        self.errors: Errors | None = None
        self.waits = False

    def forget(self) -> None:
        """Know nothing of a setting that was changed."""
        self._asked, self.costs, self.errors, self.waits = -1, None, None, False

    def ask(self, scene: Scene) -> None:
        """Ask about a setting; the answers come to `take`."""
        self.forget()
        if self._appraiser is not None and not self._appraiser.works:
            self.close()
        if self._appraiser is None:
            try:
                self._appraiser = self._make()
            except OSError as error:  # no process to be had: the lab continues without costs
                log.info("the appraisal failed: %s", error)
                return
        self._asked, self.waits = self._appraiser.order(Question(scene)), True

    def take(self) -> None:
        for number, answer in () if self._appraiser is None else self._appraiser.answers():
            if number != self._asked:
                continue
            if isinstance(answer, Costs):
                self.costs = answer
            elif isinstance(answer, Errors):
                self.errors, self.waits = answer, False
            else:
                self.waits = False

    def close(self) -> None:
        appraiser, self._appraiser, self.waits = self._appraiser, None, False
        if appraiser is not None:
            appraiser.close()


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


class LabSaving(QObject):
    """The liquids at hand; writes presets, one at a time, and looks which liquids there are then.

    ``said`` tells what was written or opened last. ``saved`` comes when something was written, ``failed`` carries what
    was met instead.
    """

    saved = Signal()
    failed = Signal(object)
    _done = Signal(object)

    def __init__(self, liquids: tuple[Choice, ...]) -> None:
        super().__init__()
        self.liquids = liquids
        self.said = ""
        self._before: threading.Thread | None = None
        self._files: list[tuple[Scene, Path]] = []
        self._done.connect(self._tell, Qt.ConnectionType.QueuedConnection)

    def save(self, path: Path, setting: Setting) -> None:
        self._begin(partial(self._save, path, setting), (str(path),))

    def use(self, study: Path, setting: Setting) -> None:
        """Name a setting's file in a study, after it was saved in the study's folder where it has no file yet."""
        self._begin(partial(self._use, study, setting), ())

    def open(self, path: Path) -> Choice:
        """Have the liquids of a file at hand; return the first.

        Raises
        ------
        ProtocolError
            Every problem of the file.
        """
        found = liquids_of(str(path))
        self.liquids = (*(it for it in self.liquids if it not in found), *found)
        if len(found) == 1:
            self._files.insert(0, (found[0].scene, path))
        self.said = f"Opened {path.name}: {', '.join(spoken(it.liquid) for it in found)}"
        return found[0]

    def wait(self, patience_s: float = PATIENCE_S) -> None:
        """Wait until everything is on the disk, and tell of it."""
        if self._before is not None:
            self._before.join(patience_s)
            QCoreApplication.sendPostedEvents(self)

    def _begin(self, write: Callable[[], str], more: tuple[str, ...]) -> None:
        at_hand = (*(it.source for it in self.liquids), *more)
        self._before = threading.Thread(
            target=self._write, args=(self._before, write, at_hand), name="preset", daemon=True
        )
        self._before.start()

    def _write(self, before: threading.Thread | None, write: Callable[[], str], at_hand: tuple[str, ...]) -> None:
        """Write, in a thread of its own, after the one before."""
        if before is not None:
            before.join()
        try:
            found: object = write(), liquids_at_hand(saved=at_hand)
        except Exception as error:  # noqa: BLE001 - handed over: a thread has no caller to raise it to
            found = error
        self._done.emit(found)

    def _save(self, path: Path, setting: Setting) -> str:
        save(path, preset_text(setting))
        self._files = [(setting.scene, path), *((scene, file) for scene, file in self._files if file != path)]
        return f"Saved as {path.name} in {path.parent}"

    def _use(self, study: Path, setting: Setting) -> str:
        file = next((path for scene, path in self._files if scene == setting.scene and path.is_file()), None)
        return use_in_study(study, setting, file)

    def _tell(self, found: Exception | tuple[str, tuple[Choice, ...]]) -> None:
        if isinstance(found, Exception):
            self.failed.emit(found)
            return
        self.said, written = found
        self.liquids = tuple(dict.fromkeys((*self.liquids, *written)))
        self.saved.emit()
