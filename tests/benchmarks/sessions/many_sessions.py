"""What a study of 3,000 sessions costs: `verify` (time, memory), the home window's list, the table of participants.

``python tests/benchmarks/sessions/many_sessions.py [SESSIONS]``

A few sessions of rek2024 with simulated answers are copied under other participants' names; each copy's journal is
chained anew, and the list of fingerprints names it.
"""

import hashlib
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.checksums import write_checksums
from study_app.store.folders import SessionFolder, StudyFolder
from study_app.store.journals import journal
from study_app.store.journals.journal import Line, line_bytes
from study_app.store.sessions.open_session import Place, table_files
from study_app.store.tables.participants import write_participants
from study_app.store.verification.fingerprints import fingerprint, note_fingerprint
from study_app.viewmodels.sessions import sessions

SESSIONS = 3000
REHEARSED = 5
PROTOCOL = "rek2024"
LIMIT_LIST_S = 1.0


VERIFY = """
import re, sys, time
from pathlib import Path
from study_app.store.verification.verify_study import verify
begun = time.process_time()
found = verify(Path(sys.argv[1]))
each_s = (time.process_time() - begun) / found.sessions
peak_mb = int(re.search("VmHWM: *([0-9]+)", Path("/proc/self/status").read_text().replace("\\t", " "))[1]) / 1024
print(f"verify of {found.sessions} sessions, sound: {found.sound}; {each_s:.4f} s of processor time each (limit 0.02)")
print(f"its program's greatest memory: {peak_mb:.0f} MB (limit 200)")
"""
"""A program of its own, whose memory is not that of the copying."""


def main(count: int = SESSIONS) -> None:
    """Make the study, and print what looking at it costs."""
    with tempfile.TemporaryDirectory() as folder:
        study = StudyFolder(Path(folder) / PROTOCOL)
        rehearse_answers(PROTOCOL, participants=REHEARSED, seed=1, results=study.path)
        originals = study.sessions()
        for number in range(REHEARSED + 1, count + 1):
            copy(study, originals[number % REHEARSED], f"P{number:04d}")
        time.sleep(2.5)  # journals that are as new as the table are read
        write_participants(study, PROTOCOL)
        begun = time.perf_counter()
        listed = sessions(Path(folder), {})
        list_s = time.perf_counter() - begun
        print(f"list of {len(listed)} sessions: {list_s:.2f} s (limit {LIMIT_LIST_S:g})")
        copy(study, originals[0], "P9999")
        begun = time.perf_counter()
        write_participants(study, PROTOCOL)
        print(f"table of participants, one session more: {time.perf_counter() - begun:.2f} s")
        begun = time.perf_counter()
        write_participants(study, PROTOCOL, whole=True)
        print(f"table of participants, every journal read: {time.perf_counter() - begun:.2f} s")
        subprocess.run([sys.executable, "-c", VERIFY, str(study.path)], check=True)


def copy(study: StudyFolder, original: SessionFolder, participant: str) -> None:
    """Write a session again under another participant's name."""
    folder = study.session(participant, 1)
    folder.path.mkdir(parents=True)
    lines: list[Line] = []
    content = b""
    for line in journal.read(original.journal):
        named = {"participant": participant} if line["event"] == "session_started" else {}
        lines.append({**line, **named, "previous": hashlib.sha256(content).hexdigest()})
        content += line_bytes(lines[-1])
    folder.journal.write_bytes(content)
    told = json.loads(original.receipt.read_bytes()) | {"participant": participant}
    folder.receipt.write_text(json.dumps(told), encoding="utf-8")
    for path, table in table_files(Place(study, folder, PROTOCOL), lines, None):
        path.write_bytes(table)
    note_fingerprint(study, folder, fingerprint(write_checksums(folder, {})), waits=False)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
