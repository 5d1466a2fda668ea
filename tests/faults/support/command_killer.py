"""Kills commands on results at random moments and lets each run again: run as a program, once for all of them.

Everything is loaded once; each command is a fork that is killed with SIGKILL, and each next run another one. For every
command and moment it writes a line of JSON: the folder, the code of the killed run, the SHA-256 of every file before,
after it and after the next run, and how that ended. A first line of each command is of a run that was left alone.
"""

import hashlib
import json
import random
import shutil
import sys
import time
from functools import partial
from pathlib import Path

from study_app.analysis.export_study import export
from study_app.analysis.report.write_report import report
from study_app.session.simulated import rehearsal
from study_app.store.sessions.recovery import rebuild_session
from study_app.store.unblinding import unblind
from tests.faults.support.killer import SEED, forked

COMMANDS = {"export": (6, 0.0), "rebuild": (12, 0.0), "unblind": (12, 0.0), "report": (1, 0.9)}
"""How often each is killed, and after which share of its time at the earliest: a report writes at its end."""
P001 = Path("data/sub-P001/ses-01")


def prepared(command: str, study: Path, folder: Path) -> Path:
    """Return the folder that the command writes into: with older files, or a study of which files were lost."""
    if command in ("export", "report"):
        folder.mkdir()
        for name in ("report.html", "codebook.json", "study-demo_description-responses_data.csv"):
            (folder / name).write_bytes(b"older")
        return folder
    shutil.copytree(study, folder)
    if command == "rebuild":
        for path in (*(folder / P001).glob("*_data.csv"), *(folder / "data").glob("*_data.csv")):
            path.unlink()
        (folder / P001 / "checksums.sha256").unlink()
    return folder


def run(command: str, study: Path, folder: Path) -> None:
    match command:
        case "export":
            export(study, folder)
        case "report":
            report(study, folder)
        case "rebuild":
            rebuild_session(folder / P001)
        case "unblind":
            assert unblind(folder, "AB", "done").left == ()


def hashes(folder: Path) -> dict[str, str]:
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def main(protocol: str, folder: str, seed: str) -> None:
    study = Path(folder) / "study"
    rehearsal.rehearse(protocol, participants=2, seed=SEED, results=study)
    draw = random.Random(int(seed))  # noqa: S311 - moments, not secrets
    for command, (count, earliest) in COMMANDS.items():
        lasts_s = 0.0
        for number in range(-1, count):
            into = prepared(command, study, Path(folder) / f"{command}-{number + 1:02d}")
            before = hashes(into)
            after_s = None if number < 0 else draw.uniform(earliest, 1.0) * lasts_s
            began = time.perf_counter()
            code = forked(
                lambda command=command, into=into: run(command, study, into),
                None if after_s is None else partial(time.sleep, after_s),
            )
            lasts_s = lasts_s or time.perf_counter() - began
            held = hashes(into)
            again = 0 if number < 0 else forked(lambda command=command, into=into: run(command, study, into))
            became = {"command": command, "folder": str(into), "after_s": after_s, "code": code}
            files = {"before": before, "held": held, "left": hashes(into)}
            sys.stdout.write(json.dumps(became | files | {"again": again}) + "\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main(*sys.argv[1:])
