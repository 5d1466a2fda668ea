"""A session that is kept nowhere, for rehearsals whose answers are not asked for."""

from collections.abc import Callable
from typing import Any

from study_app.store.blinded.blinding import Key
from study_app.store.journals.journal import SessionClock


class Unkept:
    """A session that is kept nowhere."""

    recorder = None
    fingerprint = ""

    def __init__(self, now_ns: Callable[[], int], codes: dict[str, dict[str, str]], secret: bytes) -> None:
        self.clock = SessionClock(now_ns)
        self.key = Key(hash="", drawn="seed", codes=codes, tables={}, tables_hash="", nonce=secret)

    def append(self, event: str, *, t_s: float | None = None, **fields: Any) -> None:
        """Keep nothing."""

    def check_flushed(self) -> None:
        """Do nothing: nothing is kept."""

    def write_tables(self) -> None:
        """Keep nothing."""

    def finish(self, status: str, reason: str = "") -> None:
        """Keep nothing."""
