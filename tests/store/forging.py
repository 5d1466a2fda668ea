"""What a person does who changes results by hand and computes anew whatever a program computed."""

import hashlib
import io
import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

from study_app.store.blinded.blinding import open_events, opened_key, read_key, seal_event
from study_app.store.files.folders import StudyFolder
from study_app.store.integrity.checksums import fingerprint, note_fingerprint, write_checksums
from study_app.store.journals.journal import line_bytes, read
from study_app.store.recordings import opened_content
from study_app.store.sessions.open_session import Place, table_files
from study_app.store.tables.study_files import write_participants
from tests.journal_lines import event_from, raw

Lines = list[dict[str, Any]]


def secret_of(recording: Path) -> bytes:
    """Return the secret that seals a recording."""
    return read_key(recording.parents[4]).nonce


def parquet_of(recording: Path) -> io.BytesIO:
    """Return the unsealed Parquet file of a recording."""
    return io.BytesIO(opened_content(recording, recording.read_bytes(), secret_of(recording)))


def forge(journal: Path, change: Callable[[Lines], object], *, chained: bool = True) -> None:
    """Change the lines of a journal, renumber them, and correct or omit every ``previous``."""
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
    """Rewrite tables, checksums and fingerprints of a study so that they match its journals and receipts."""
    folder = StudyFolder(study)
    folder.fingerprints.unlink(missing_ok=True)
    for session in folder.sessions():
        lines = read(session.journal)
        name = lines[0].study
        for path, content in table_files(Place(folder, session, name), lines, opened_key(folder)):
            path.write_bytes(content)
        session.checksums.unlink(missing_ok=True)
        if lines[-1].event == "session_ended":
            note_fingerprint(folder, session, fingerprint(write_checksums(session), lines))
        write_participants(folder, name)


def nothing(_lines: Lines) -> None:
    """Change nothing."""


def change(session: Path, edit: Callable[[Lines], None], after: Callable[[Lines], None] = nothing) -> None:
    """Change the journal like a forger who has the key, before and after sealing."""
    path = session / "journal.jsonl"
    key = read_key(session.parents[2])
    lines: Lines = raw(open_events(read(path), key))
    edit(lines)
    start, *rest = map(event_from, lines)
    closed = raw([start, *(seal_event(start, line, key) for line in rest)])
    after(closed)
    content = b""
    for number, line in enumerate(closed, start=1):
        content += line_bytes({**line, "n": number, "previous": hashlib.sha256(content).hexdigest()})
    path.write_bytes(content)


def cut(session: Path, size: int) -> None:
    """Cut the journal to its first bytes and remove the files that a session writes at its end."""
    path = session / "journal.jsonl"
    path.write_bytes(path.read_bytes()[:size])
    for derived_file in (*session.glob("*.csv"), session / "checksums.sha256"):
        derived_file.unlink()
    (session.parents[2] / "fingerprints.txt").unlink(missing_ok=True)
    shutil.rmtree(session / "recordings")
    receipt = session / "receipt.json"
    ended = re.compile('"status": "(completed|incomplete)"')
    receipt.write_text(ended.sub('"status": "unfinished"', receipt.read_text("utf-8")), encoding="utf-8", newline="\n")
