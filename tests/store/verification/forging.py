"""What a person does who changes results by hand and computes anew whatever a program computed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from study_app.store.checksums import write_checksums
from study_app.store.folders import StudyFolder
from study_app.store.journals.journal import read
from study_app.store.sessions.open_session import Place, table_files
from study_app.store.tables.participants import write_participants
from study_app.store.verification.fingerprints import fingerprint, note_fingerprint

Lines = list[dict[str, Any]]


def forge(journal: Path, change: Callable[[Lines], object], *, chained: bool = True) -> None:
    """Change the lines of a journal, number them anew, and make every ``previous`` right or leave it out."""
    lines = [json.loads(line) for line in journal.read_bytes().splitlines()]
    change(lines)
    content = b""
    for number, line in enumerate(lines, start=1):
        line["n"] = number
        line.pop("previous", None)
        if chained:
            line["previous"] = hashlib.sha256(content).hexdigest()
        content += json.dumps(line, ensure_ascii=False, separators=(",", ":")).encode() + b"\n"
    journal.write_bytes(content)


def cover_up(study: Path) -> None:
    """Make tables, checksums and fingerprints of a study so that they fit the journals and receipts there are."""
    folder = StudyFolder(study)
    folder.fingerprints.unlink(missing_ok=True)
    for session in folder.sessions():
        lines = read(session.journal)
        name = lines[0]["study"]
        for path, content in table_files(Place(folder, session, name), lines, None):
            path.write_bytes(content)
        session.checksums.unlink(missing_ok=True)
        if lines[-1]["event"] == "session_ended":
            note_fingerprint(folder, session, fingerprint(write_checksums(session, {})))
        write_participants(folder, name)
