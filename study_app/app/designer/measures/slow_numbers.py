"""Numbers that take simulations: ordered when the keyboard rests, dropped at the next edit, kept by what they need."""

from __future__ import annotations

import logging
from collections import OrderedDict
from collections.abc import Callable
from typing import Final

from PySide6.QtCore import QObject, QTimer, Signal

from study_app.app.designer.measures.measures_worker import (
    Found,
    MeasureClient,
    MeasureOrder,
    Wanted,
    start_measure_worker,
)
from study_app.workers.messages import Crashed, Refused

log = logging.getLogger(__name__)

REST_MS: Final = 800
LOOK_MS: Final = 100
KEPT: Final = 200


class SlowNumbers(QObject):
    """Gives what is known of the numbers that are wanted, and orders the others; ``came`` follows each answer."""

    came = Signal()

    def __init__(self, parent: QObject, make: Callable[[], MeasureClient] = start_measure_worker) -> None:
        super().__init__(parent)
        self.make = make
        self._client: MeasureClient | None = None
        self._known: OrderedDict[Wanted, Found] = OrderedDict()
        self._wanted: tuple[Wanted, ...] = ()
        self._failed: set[Wanted] = set()
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
        self._wanted = wanted
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
                self._failed |= set(wanted)
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
            elif number == self._ordered:
                self._look.stop()
                if isinstance(answer, Refused | Crashed):
                    if not (isinstance(answer, Refused) and answer.stopped):
                        log.info("slow numbers failed: %s", answer.sentence)
                        self._failed |= set(self._open())
                    changed = True
        if changed:
            self.came.emit()

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
