"""A journal that reports its lines to the operator's window: what was written counts as progress, nothing else."""

from collections.abc import Callable
from dataclasses import replace

from study_app.session.ports import JournalPort
from study_app.store.journals.journal_events import Event, SessionEnded
from study_app.store.progress import Progress


class WatchedJournal:
    """Passes everything on to the store, and folds what it has kept into ``progress``."""

    def __init__(self, store: JournalPort, progress: Progress, clock: Callable[[], float]) -> None:
        self.progress = progress
        self._store = store
        self._clock = clock

    def append(self, event: Event, *, t_s: float | None = None, waits: bool = True) -> None:
        """Put an event into the journal (StoreError: nothing has changed)."""
        self._store.append(event, t_s=t_s, waits=waits)
        self.progress.take(replace(event, t_s=self._clock() if t_s is None else t_s))

    @property
    def fingerprint(self) -> str:
        """The session's fingerprint; empty until it has ended."""
        return self._store.fingerprint

    def check_flushed(self) -> None:
        """Raise StoreError if lines that were not waited for could not be flushed."""
        self._store.check_flushed()

    def write_tables(self) -> None:
        """Bring the tables up to date."""
        self._store.write_tables()

    def finish(self, status: str, reason: str = "") -> None:
        """Close the session (StoreError: the last table or line could not be written; it counts as ended here)."""
        try:
            self._store.finish(status, reason)
        finally:
            proof = {"fingerprint": self._store.fingerprint}
            self.progress.take(SessionEnded(status=status, reason=reason, t_s=self._clock(), others=proof))
