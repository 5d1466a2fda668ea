"""Numbers that take simulations: ordered when the keyboard rests, dropped at the next edit, kept by what they need."""

import logging
import time
from collections import OrderedDict
from collections.abc import Callable
from typing import Final

from PySide6.QtCore import QObject, QTimer, Signal

from study_app.app.designer.measures.measures_worker import (
    Counted,
    Found,
    MeasureClient,
    MeasureOrder,
    Wanted,
    start_measure_worker,
)
from study_app.workers.server import Crashed, Refused

log = logging.getLogger(__name__)

REST_MS: Final = 800
LOOK_MS: Final = 100
COUNT_S: Final = 0.5
"""So often the numbers say how far their simulations are."""
FAILED: Final = "the process of the simulations does not start"
KEPT: Final = 200


class SlowNumbers(QObject):
    """Gives what is known of the numbers that are wanted, and orders the others.

    ``came`` follows each answer, and what is said of simulations that run or have failed.
    """

    came = Signal()

    def __init__(self, parent: QObject, make: Callable[[], MeasureClient] = start_measure_worker) -> None:
        super().__init__(parent)
        self.make = make
        self._client: MeasureClient | None = None
        self._known: OrderedDict[Wanted, Found] = OrderedDict()
        self._wanted: tuple[Wanted, ...] = ()
        self._failed: dict[Wanted, str] = {}
        self._counted: Counted | None = None
        self._said_s = 0.0
        self._ordered = 0
        self.rest = QTimer(self)
        self.rest.setSingleShot(True)
        self.rest.setInterval(REST_MS)
        self.rest.timeout.connect(self._order)
        self._look = QTimer(self)
        self._look.setInterval(LOOK_MS)
        self._look.timeout.connect(self._take)

    def want(self, wanted: tuple[Wanted, ...]) -> None:
        """Want these numbers from now on, and no others; what is under way for others is given up."""
        if wanted == self._wanted:
            return
        self._wanted, self._counted = wanted, None
        self._failed.clear()
        if self._look.isActive():
            self._look.stop()
            if self._client is not None:
                self._client.stop()
        if self._open():
            self.rest.start()
        else:
            self.rest.stop()

    def known(self, wanted: Wanted) -> bool:
        """Return whether a number was answered."""
        return wanted in self._known

    def found(self, wanted: Wanted) -> Found:
        """Return what was answered, None where nothing was."""
        return self._known.get(wanted)

    def failure(self, wanted: Wanted) -> str:
        """Return why a number is not computed; "" where nothing failed."""
        return self._failed.get(wanted, "")

    def progress(self, wanted: Wanted) -> tuple[int, int] | None:
        """Return how many simulations of a number are done, and of how many; None where it does not run."""
        counted = self._counted
        return (counted.done, counted.total) if counted is not None and counted.wanted == wanted else None

    @property
    def waits(self) -> bool:
        """Whether a number is still to come."""
        return bool(self._open())

    def _open(self) -> tuple[Wanted, ...]:
        return tuple(one for one in self._wanted if one not in self._known and one not in self._failed)

    def _order(self) -> None:
        wanted = self._open()
        if not wanted:
            return
        if self._client is not None and not self._client.works:
            self.close()
        if self._client is None:
            try:
                self._client = self.make()
            except OSError as error:  # no process to be had: the designer goes on without these numbers
                log.info("the worker of slow numbers does not start: %s", error)
                self._failed |= dict.fromkeys(wanted, FAILED)
                self.came.emit()
                return
        self._ordered = self._client.order(MeasureOrder(wanted))
        self._look.start()

    def _take(self) -> None:
        if self._client is None:
            return
        changed = False
        for number, answer in self._client.answers():
            if isinstance(answer, tuple):
                self._keep(*answer)
                changed = True
            elif isinstance(answer, Counted):
                self._counted = answer
                changed = changed or time.monotonic() > self._said_s + COUNT_S
            elif number == self._ordered:
                self._look.stop()
                if isinstance(answer, Refused | Crashed):
                    if not (isinstance(answer, Refused) and answer.stopped):
                        self._fail(answer.sentence)
                    changed = True
        if changed:
            self._said_s = time.monotonic()
            self.came.emit()

    def _fail(self, sentence: str) -> None:
        """Give up the number that was computed, and order those after it."""
        log.info("slow numbers failed: %s", sentence)
        self._counted = None
        if wanted := self._open():  # the process may end after its last answer
            self._failed[wanted[0]] = sentence
        if wanted[1:]:
            self.rest.start()

    def _keep(self, wanted: Wanted, found: Found) -> None:
        self._known[wanted] = found
        while len(self._known) > KEPT:
            self._known.popitem(last=False)

    def close(self) -> None:
        """End the process."""
        self.rest.stop()
        self._look.stop()
        client, self._client = self._client, None
        if client is not None:
            client.close()
