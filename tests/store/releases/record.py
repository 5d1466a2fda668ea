"""Record small results of this version, which later versions must read: run before a release.

Of ``demo`` one participant with all recordings and one whose program is killed in the second trial; of ``thickness``
(format 2: forms, numbers, questions of several kinds) one participant's answers. Next to them are the protocol
files and ``expected.json``: status and number of answers of each participant. The studies of
``recorded_sessions.STRESSED`` are for replay only.

    python -m tests.store.releases.record
"""

import json
import subprocess
import sys
import time
from pathlib import Path

from study_app import __version__
from study_app.protocol.source.files import source_bytes
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from tests.session.replay.recorded_sessions import STRESSED, stressed

HERE = Path(__file__).resolve().parent
PATIENCE_S = 300.0


def rehearsal(name: str, folder: Path, participants: int, *options: str) -> list[str]:
    """Return the command that rehearses a study into a folder."""
    words = ["rehearse", name, "--participants", str(participants), "--seed", "1", "--results", str(folder)]
    return [sys.executable, "-m", "study_app", *words, *options]


def killed_in_second_trial(command: list[str], path: Path) -> None:
    """Run a command, and kill it once a journal contains the start of the second trial."""
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as program:
        began = time.monotonic()
        while not (path.exists() and path.read_bytes().count(b'"event":"trial_started"') == 2):
            if program.poll() is not None or time.monotonic() - began > PATIENCE_S:
                program.kill()
                sys.exit(f"{path} has no second trial")
            time.sleep(0.005)
        program.kill()
    for lock in path.parent.glob(".open-*.json"):
        lock.unlink()  # it names a process of this computer


def status_and_answers(folder: StudyFolder) -> dict[str, tuple[str, int]]:
    """Return status and number of answers of each participant."""
    counts: dict[str, tuple[str, int]] = {}
    for session in folder.sessions():
        lines = journal.read(session.journal)
        answers = sum(len(line.items) for line in lines if line.event == "responses")
        counts[session.participant] = (str(getattr(lines[-1], "status", "unfinished")), answers)
    return counts


def main() -> None:
    """Record studies with a released version and print their sessions."""
    to = HERE / __version__.rpartition(".")[0]
    if to.exists():
        sys.exit(f"{to} exists: results of a released version are never recorded again")
    demo = to / "demo"
    journal_of_second = demo / "data" / "sub-P002" / "ses-01" / "journal.jsonl"
    killed_in_second_trial(rehearsal("demo", demo, 2), journal_of_second)
    subprocess.run(rehearsal("thickness", to / "thickness", 1, "--answers-only"), check=True)
    for liquid in STRESSED:
        stressed(to / liquid, liquid)
    expected = {}
    for name in ("demo", "thickness"):
        (to / f"{name}.toml").write_bytes(source_bytes(name))
        expected[name] = status_and_answers(StudyFolder(to / name))
    (to / "expected.json").write_text(json.dumps(expected, indent=2) + "\n", encoding="utf-8", newline="\n")
    size = sum(path.stat().st_size for path in to.rglob("*") if path.is_file())
    print(f"{to.relative_to(HERE)}: {expected}, {size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
