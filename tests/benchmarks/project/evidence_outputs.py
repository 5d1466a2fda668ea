"""Compares what each command of evidence prints and writes with another checkout of the program, byte for byte.

``python tests/benchmarks/project/evidence_outputs.py CHECKOUT FOLDER [--only NAME ...]`` runs every command in both
with small sizes and equal seeds, and prints "equal" or the difference. Left out are numbers that a clock or the memory
of the process gives, what the other checkout has of removed models and estimators, figures of such numbers, and the
width of separators in Markdown. The other checkout's outputs stay in FOLDER and are used again. Cases of `stability`
whose estimator the other checkout draws from others differ.
"""

import argparse
import csv
import difflib
import itertools
import os
import re
import subprocess
import sys
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Final, NamedTuple

ROOT = Path(__file__).resolve().parents[3]
NUMBERS: Final = r"[-+]?\d[\d,.]*(e[-+]?\d+)?"
VERDICTS: Final = r"\b(met|missed|undecided: measure for longer|times)\b"
SECONDS: Final = r"\d+ s\b"
MEASURED_COLUMNS: Final = (
    "median_ns", "p99_ns", "ns_per_ms", "memory_bytes", "ticks_per_s", "times_real_time", "batches", "pareto_front",
    "ns per tick", "p99", "memory [kB]", "ticks per second", "times real time",
)  # fmt: skip
REMOVED: Final = r"plain Python|numpy|velocity by (line|foaw|lead)"
"""Models that are in the program no more."""
DIFFERING: Final = 12
"""Lines of a file's difference that are printed."""
ENDED: Final = ("exit code 0\n", "exit code 3\n", "exit code 4\n")
"""The command ended, perhaps with a limit that is missed or undecided."""


class Compared(NamedTuple):
    """The arguments of a command, and what of its output is not compared.

    ``masked`` is an expression whose matches count as equal; ``columns`` are headings, ``lines`` an expression that
    leaves lines out. ``timed``: its figures are of times.
    """

    arguments: str
    masked: str = ""
    columns: Collection[str] = ()
    lines: str = ""
    timed: bool = False


ACCURACY: Final = Compared("", r"^●?(?= \|)|\d\.?\d*e-1\d", MEASURED_COLUMNS, REMOVED, timed=True)
"""Marks of the fastest models, and errors of rounding, are masked."""
TIMES: Final = Compared("", rf"{NUMBERS}|{VERDICTS}|\b(n/a|nan|inf|–)\b|\s+|-{{3,}}", timed=True)
SOAK: Final = r"[\d.]+ s, \d+ times|[\d.]+ MiB|\"took_s\".*|growth.*|  [\d. ]+;|^    \d+,?$"
COMMANDS: Final = {
    "accuracy": ACCURACY._replace(arguments="accuracy --to out"),
    "accuracy of a file": ACCURACY._replace(arguments="accuracy physical2 --liquid glycerin --path circle --to out"),
    "accuracy --liquids": ACCURACY._replace(arguments="accuracy --liquids --to out"),
    "cfd": Compared("cfd --to out"),
    "cfd --materials": Compared("cfd --materials --to out"),
    "cfd --refit": Compared("cfd --refit --to out"),
    "delay-thresholds": Compared("delay-thresholds --people 5 --to out"),
    "figures": Compared("figures --to out"),
    "scene": Compared("scene rek2024 --liquid water", r"[\d.]+ ns|[\d.]+ % of the tick|\s+\d+(?=  (in|out))"),
    "soak": Compared("soak --hours 0.004 --virtual --to out", SOAK),
    "stability": Compared("stability --cases 2 --to out", SECONDS),
    "stability --case": Compared("stability --case liquid=honey"),
    "stability --delayed": Compared("stability --delayed out/delayed.csv"),
    "stability --delivered": Compared("stability --delivered"),
    "stability --estimation": Compared("stability --estimation 4"),
    "stability --only": Compared("stability --cases 2 --only driver", SECONDS),
    "stability --table": Compared("stability --table out/limits.csv", lines="^(line|foaw|lead),"),
    "stability --velocity": Compared("stability --velocity", columns=("line", "foaw", "lead"), lines="^cost"),
    "stability --withheld": Compared("stability --withheld"),
    "timing": TIMES._replace(arguments="timing --seconds 0.5 --to out"),
    "timing --delays": TIMES._replace(arguments="timing --delays --seconds 0.5 --to out"),
    "timing --devices": TIMES._replace(arguments="timing --devices --seconds 0.5 --to out"),
    "timing --lsl": TIMES._replace(arguments="timing --lsl --seconds 0.5 --to out"),
    "timing --triggers": TIMES._replace(arguments="timing --triggers virtual --seconds 0.5 --to out"),
    "validate": Compared("validate --studies 10 --workers 1 --to out", r"in \d+ s, \d+ s of processor time"),
    "validate-report": Compared("validate-report --studies 1 --workers 1 --to out", SECONDS),
}


def main() -> None:
    """Run the commands in both checkouts, and print what differs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("checkout", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="*", choices=COMMANDS, default=COMMANDS)
    options = parser.parse_args()
    different = 0
    for name in options.only:
        of_command = options.folder.resolve() / re.sub(r"\W+", "-", name)
        before = of_command / "other"
        if not (before / "stdout").exists() or not (before / "stdout").read_text().endswith(ENDED):
            _run(name, options.checkout.resolve(), before)
        _run(name, ROOT, of_command / "this")
        differences = tuple(_differences(COMMANDS[name], before, of_command / "this"))
        failed = not (before / "stdout").read_text().endswith(ENDED)
        different += failed or bool(differences)
        print(f"{name:<24} {'FAILED' if failed else 'DIFFERS' if differences else 'equal'}")
        print(*differences, sep="\n", end="\n" if differences else "", flush=True)
    sys.exit(different > 0)


def _run(name: str, checkout: Path, folder: Path) -> None:
    """Run a command in a folder of its own, and keep what it printed in the file ``stdout``, its exit code last."""
    for file in sorted(folder.rglob("*"), reverse=True):
        file.rmdir() if file.is_dir() else file.unlink()
    for part in ("out", "settings"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    of_user = {"LIQUID_STUDY_CONFIG": str(folder / "settings"), "QT_QPA_PLATFORM": "offscreen"}
    ended = subprocess.run(
        [sys.executable, "-m", "study_app", *COMMANDS[name].arguments.split()],
        cwd=folder,
        env={**os.environ, **of_user, "PYTHONPATH": str(checkout)},
        capture_output=True,
        text=True,
        check=False,
    )
    said = ended.stdout.replace(str(folder), "DIR")
    (folder / "stderr").write_text(ended.stderr)
    (folder / "stdout").write_text(f"{said}exit code {ended.returncode}\n")


def _differences(compared: Compared, before: Path, now: Path) -> Iterator[str]:
    """Yield the lines of a difference for each file that differs."""
    names = {file.relative_to(top) for top in (before, now) for file in (top / "out").rglob("*") if file.is_file()}
    for name in (Path("stdout"), *sorted(names)):
        files = before / name, now / name
        if missing := [str(file) for file in files if not file.exists()]:
            yield f"missing: {', '.join(missing)}"
        elif name.suffix in {".png", ".svg", ".pdf"}:
            if not compared.timed and files[0].read_bytes() != files[1].read_bytes():
                yield f"another figure: {name}"
        else:
            texts = [list(_compared_lines(compared, file)) for file in files]
            found = difflib.unified_diff(*texts, f"other/{name}", f"this/{name}", "", "", 0, "")
            yield from itertools.islice(found, DIFFERING)


def _compared_lines(compared: Compared, file: Path) -> Iterator[str]:
    """Yield the lines of a file without what is not compared."""
    dropped: list[int] = []
    for line in file.read_text().split("\n"):
        if compared.lines and re.search(compared.lines, line):
            continue
        kept = re.sub("-+", "-", line.replace(" ", "")) if re.fullmatch(r"\|[-:| ]+\|", line) else line
        if compared.columns:
            cells = _cells(kept, file.suffix)
            dropped = [k for k, cell in enumerate(cells) if cell in compared.columns] or dropped
            if len(cells) > 1:
                kept = " | ".join(cell for k, cell in enumerate(cells) if k not in dropped)
        yield re.sub(f"(?:{compared.masked})+", "…", kept) if compared.masked else kept


def _cells(line: str, suffix: str) -> list[str]:
    if suffix == ".csv":
        return next(csv.reader([line]), [])
    if line.startswith("|"):
        return [cell.strip() for cell in line.strip("|").split("|")]
    return re.split(r"\s{2,}", line.rstrip())


if __name__ == "__main__":
    main()
