"""Give each command that reads results a folder that a stranger made: python -m tests.benchmarks.sessions.strangers.

Fourteen kinds of folders; kinds that concern a file are tried with each kind of file in turn. For each folder a process
runs ``verify``, ``export``, ``report``, ``merge`` and ``reproduce``, and plays a trial again. Each must end within
`LONGEST_S` and `MOST_MEMORY`, with exit code 0, 2 (one line) or 3 and no traceback or control character in its output;
nothing outside may be read or changed; report.html and the tables must contain the texts escaped. Prints a table and
the faults; the exit code is 1 if there are any. Devices are made as root only.
"""

import argparse
import csv
import hashlib
import importlib
import os
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, TypeAlias

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import pyarrow as pa
from pyarrow import parquet

from study_app.cli import main as run_command
from study_app.protocol.source.files import source_bytes
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.exclusions import exclude
from study_app.store.unblinding import unblind

LONGEST_S: Final = 90
LOADED: Final = ("analysis.export_study", "analysis.report.write_report", "store.sites.merge", "gui.watch.window")
"""Modules loaded before the processes of the commands are forked."""
MOST_MEMORY: Final = 4 << 30
MOST_WRITTEN: Final = 1 << 30
MILLIONS_OF_ROWS: Final = 20
LARGE: Final = 200 << 30
SECRET: Final = "what only this computer knows"  # noqa: S105 - no password
SCRIPT: Final = "<script>alert(1)</script><img src=x onerror=alert(2)>"
FORMULA: Final = "=HYPERLINK(1)"
NAME: Final = "demo"
SESSION: Final = "data/sub-P001/ses-01"
RECORDING: Final = f"{SESSION}/recordings/trial-001.parquet"
FILES: Final = (
    *("dataset_description.json", "exclusions.csv", "withdrawals.jsonl", "blinding/key.sealed"),
    *("blinding/reveals.jsonl", "data/study-demo_description-participants_data.csv"),
    *(f"{SESSION}/journal.jsonl", f"{SESSION}/receipt.json", RECORDING),
)
FOLDERS: Final = ("blinding", "data", "data/sub-P001", SESSION, f"{SESSION}/recordings")
Change: TypeAlias = Callable[[Path, Path], object]
"""Changes a copy of the study; the second folder is outside."""


def removed(path: Path) -> Path:
    """Remove a file or folder, and return its path."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
    return path


def edited(path: Path, pattern: bytes, new: bytes) -> None:
    path.write_bytes(re.sub(pattern, new, path.read_bytes()))


def link_file(name: str, study: Path, outside: Path) -> None:
    target = outside / Path(name).name
    if (study / name).exists():
        shutil.copy(study / name, target)
    else:
        target.write_text(SECRET, encoding="utf-8", newline="\n")
    removed(study / name).symlink_to(target)


def link_folder(name: str, study: Path, outside: Path) -> None:
    shutil.copytree(study / name, outside / "folder")
    removed(study / name).symlink_to(outside / "folder")


def sparse(name: str, study: Path, _outside: Path) -> None:
    with (study / name).open("ab") as file:
        file.truncate(LARGE)


def bomb(study: Path, _outside: Path) -> None:
    """Write a recording of few bytes and many equal rows."""
    rows = parquet.read_table(study / RECORDING).take(pa.array([0] * 1_000_000))
    with parquet.ParquetWriter(study / RECORDING, rows.schema, compression="zstd") as writer:
        for _ in range(MILLIONS_OF_ROWS):
            writer.write_table(rows)


def nest(study: Path, _outside: Path) -> None:
    (study / SESSION / "receipt.json").write_text("[" * 100_000 + "]" * 100_000, encoding="utf-8", newline="\n")
    with (study / SESSION / "journal.jsonl").open("a", encoding="utf-8", newline="\n") as file:
        file.write('{"a":' * 100_000 + "1" + "}" * 100_000 + "\n")
    here = os.open(study / "data", os.O_RDONLY)
    for _ in range(600):
        os.mkdir("nested", dir_fd=here)
        inner = os.open("nested", os.O_RDONLY, dir_fd=here)
        os.close(here)
        here = inner
    os.close(here)


def name_oddly(study: Path, _outside: Path) -> None:
    odd = ("\x1b[2J", "a\nb", "\u202egnp.exe", "<b>x", "=1+1", "..", "x" * 200)
    for name in odd[:5]:
        shutil.copytree(study / "data/sub-P001", study / f"data/sub-{name}")
        shutil.copytree(study / SESSION, study / f"data/sub-P001/ses-{name}")
        (study / name).write_text(name, encoding="utf-8", newline="\n")
        (study / SESSION / f"{name}.csv").write_text(name, encoding="utf-8", newline="\n")


def each(change: Callable[[str, Path, Path], object], names: tuple[str, ...] = FILES) -> dict[str, Change]:
    """Return the change of each file or folder by its name."""
    return {name: lambda study, outside, name=name: change(name, study, outside) for name in names}  # type: ignore[misc]


def kinds() -> dict[str, dict[str, Change]]:
    """Return for each kind of folder its changes by name."""
    texts = (b'"(operator|language)":"[^"]*"', b'"\\1":"\x1b[2J' + SCRIPT.encode() + b'"')
    changes: dict[str, dict[str, Change]] = {
        "HTML, script and formulas in every text": {"": lambda *_: None},
        "the same in lists": {"exclusions": lambda s, _: exclude(s, "P001", 1, by=FORMULA, reason=SCRIPT)},
        "links in place of files": each(link_file),
        "links in place of folders": each(link_folder, FOLDERS),
        "FIFOs": each(lambda name, study, _: os.mkfifo(removed(study / name))),
        "folders in place of files": each(lambda name, study, _: removed(study / name).mkdir()),
        "bytes that are no text": each(lambda name, study, _: (study / name).write_bytes(bytes(range(256)) * 99)),
        "a parquet bomb": {"": bomb},
        "a journal of format 99": {
            "": lambda s, _: edited(s / SESSION / "journal.jsonl", rb'"format":\d+', b'"format":99')
        },
        "a receipt of format 99": {
            "": lambda s, _: edited(s / SESSION / "receipt.json", rb'"format": ?\d+', b'"format": 99')
        },
        "names with control characters": {"": name_oddly},
        "deep nesting": {"": nest},
        "huge sparse files": each(sparse, ("exclusions.csv", f"{SESSION}/journal.jsonl", RECORDING)),
        "journal with control characters": {"": lambda s, _: edited(s / SESSION / "journal.jsonl", *texts)},
    }
    if os.geteuid() == 0:
        changes["devices"] = each(lambda name, study, _: os.mknod(removed(study / name), 0o20666, os.makedev(1, 5)))
    return dict(sorted(changes.items(), key=lambda kind: len(kind[1])))


def snapshot(folder: Path) -> dict[str, str]:
    """Return the checksum of every file."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def commands(study: Path, good: Path, to: Path) -> Iterator[tuple[str, Callable[[], object]]]:
    """Yield the name and function of each command to run on a folder."""
    for name, words in {
        "verify": [study],
        "export": [study, "--to", to / "export", "--wide", "--parquet"],
        "report": [study, "--to", to / "report"],
        "merge": [f"A={study}", f"B={good}", "--to", to / "merged"],
        "reproduce": [study / SESSION],
    }.items():
        sys.argv[1:] = [name, *map(str, words)]
        yield name, run_command
    yield "watch again", lambda: open_watch_window(study / SESSION)


def open_watch_window(session: Path) -> None:
    """Open the window that plays a trial and wait until it shows the trial or an error."""
    from PySide6.QtTest import QTest
    from PySide6.QtWidgets import QWidget

    from study_app.gui.application import application_here
    from study_app.gui.theme.theme import LIGHT
    from study_app.gui.watch.window import WatchWindow

    application_here()
    parent = QWidget()
    window = WatchWindow(parent, LIGHT, session, 1, attempt=1, presented="")
    window.show()
    while window.stage is None and window.sentence.text() == "Reading…":
        QTest.qWait(20)
    print("shown" if window.stage is not None else window.sentence.text())
    window.close()


def run_all(study: Path, good: Path, to: Path) -> list[str]:
    """Run every command on a folder, each in a process of its own; return the faults."""
    faults = []
    for name, run in commands(study, good, to):
        said, began_s = to / f"{name}.txt", time.perf_counter()
        if (child := os.fork()) == 0:
            _run_in_child(run, said)
        _, status, used = os.wait4(child, 0)
        code, text = os.waitstatus_to_exitcode(status), said.read_text("utf-8", "replace")
        lines = [line for line in text.splitlines() if line]
        if code not in (0, 2, 3) or "Traceback" in text:
            after = f" after {time.perf_counter() - began_s:.0f} s and {used.ru_maxrss >> 10} MiB"
            faults.append(f"{name}: exit code {code}{after}: {lines[-1] if lines else ''!r:.300}")
        if code == 2 and sum(line.startswith("liquid-study") for line in lines) != 1:
            faults.append(f"{name}: {text!r:.300} is not one line")
        if match := re.search(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\u202e]", text.replace("\r", "")):
            faults.append(f"{name}: prints {match[0]!r} in {text[max(match.start() - 80, 0) : match.end() + 20]!r}")
    return faults


def _run_in_child(run: Callable[[], object], said: Path) -> None:
    """Run a command with its output in a file; never return."""
    file = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(file, 1)
    os.dup2(file, 2)
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.alarm(LONGEST_S)
    resource.setrlimit(resource.RLIMIT_DATA, (MOST_MEMORY, MOST_MEMORY))
    resource.setrlimit(resource.RLIMIT_FSIZE, (MOST_WRITTEN, MOST_WRITTEN))
    code: Any = 0
    try:
        run()
    except SystemExit as error:
        code = error.code or 0
    except BaseException:  # noqa: BLE001 - printed, as Python would
        import traceback

        traceback.print_exc()
        code = 1
    with suppress(ValueError):
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(code)


def unescaped(to: Path) -> list[str]:
    """Return texts in outputs that a browser or a spreadsheet would run, and secrets of this computer."""
    faults = []
    for path in to.rglob("*"):
        if path.suffix == ".html" and re.search(r"<script>alert|<img src=x", path.read_text("utf-8")):
            faults.append(f"{path.name} contains a script")
        if path.suffix == ".csv" and "merged" not in path.parts:
            with path.open(encoding="utf-8", newline="") as file:
                if cells := [cell for row in csv.reader(file) for cell in row if cell.startswith(FORMULA)]:
                    faults.append(f"{path.name} contains {cells[0]!r}")
        if path.is_file() and not path.is_symlink() and SECRET.encode() in path.read_bytes():
            faults.append(f"{path.name} contains what a link points to")
    return faults


def hostile_source() -> bytes:
    """Return the text of the demo with HTML, a script or a formula in each text."""
    text = source_bytes("demo").decode()
    text = re.sub(
        r'^((?:title|description|short|text|intro|button|instruction|setting_label|cannot_judge) = )"',
        rf'\1"{FORMULA}{SCRIPT}',
        text,
        flags=re.MULTILINE,
    )
    text = re.sub(r'(body = """\n)', rf"\g<1>{SCRIPT} {FORMULA}\n", text)
    return re.sub(r"^(min_s|dwell_s) = [\d.]+", r"\1 = 0.2", text, flags=re.MULTILINE).encode()


def main() -> int:
    """Print the table, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kind", action="append", help="only kinds whose names contain this")
    wanted = parser.parse_args().kind or [""]
    failed = False
    with tempfile.TemporaryDirectory() as kept:
        folder = Path(kept)
        for name in ("CONFIG", "DATA", "WORKSPACE"):
            os.environ[f"LIQUID_STUDY_{name}"] = str(folder / name.lower())
        (folder / "demo.toml").write_bytes(hostile_source())
        original, good = folder / "original" / NAME, folder / "good" / NAME
        for results in (original, good):
            rehearse(str(folder / "demo.toml"), participants=2, seed=1, results=results)
        unblind(original, by=FORMULA, reason=SCRIPT)
        for module in LOADED:
            importlib.import_module(f"study_app.{module}")
        print("| folder | tried | commands | faults |\n| --- | --- | --- | --- |")
        for kind, changes in kinds().items():
            if not any(word in kind for word in wanted):
                continue
            faults = []
            for name, change in changes.items():
                here = Path(tempfile.mkdtemp(dir=folder))
                study, outside, to = here / NAME, here / "outside", here / "to"
                shutil.copytree(original, study)
                outside.mkdir()
                to.mkdir()
                change(study, outside)
                before = snapshot(outside), snapshot(good)
                faults += [f"{name}: {fault}" for fault in (*run_all(study, good, to), *unescaped(to))]
                if before != (snapshot(outside), snapshot(good)):
                    faults.append(f"{name}: something outside has changed")
                shutil.rmtree(here)
            print(f"| {kind} | {len(changes)} | {6 * len(changes)} | {len(faults)} |", *faults, sep="\n", flush=True)
            failed |= bool(faults)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
