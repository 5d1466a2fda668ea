"""Sessions that are opened again, and the state of a folder."""

import itertools
from pathlib import Path
from typing import Any

import pytest

from study_app.protocol.model import Protocol
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.recovery import reopen_store
from tests.store.conftest import SOURCE, Start

Again = Start


@pytest.fixture
def again(tmp_path: Path, protocol: Protocol) -> Again:
    """Reopen P007's session; any argument of ``reopen`` can be given."""

    def reopened(**given: Any) -> SessionStore:
        ticks = itertools.count(900_000_000, 1_000_000)
        arguments: dict[str, Any] = {
            "session_folder": tmp_path / "study" / "data" / "sub-P007" / "ses-01",
            "protocol": protocol,
            "source": SOURCE,
            "operator": "CD",
            "device": {"name": "mouse"},
            "screens": {},
            "now_ns": lambda: next(ticks),
        }
        return reopen_store(**(arguments | given))

    return reopened


def every_byte(folder: Path) -> dict[str, bytes | None]:
    """Everything under ``folder``: files with their bytes, folders with None."""
    paths = sorted(folder.rglob("*"))
    return {path.relative_to(folder).as_posix(): path.read_bytes() if path.is_file() else None for path in paths}
