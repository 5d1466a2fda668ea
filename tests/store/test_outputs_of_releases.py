"""What the commands make of each released version's folder, compared column by column with what they made before.

``releases/outputs.txt`` is of version 0.2.0, without what the changelog names as changed; tests over delays are those
of this version. A later version may add columns, results and sentences; it loses and changes none. With another
version's source on PYTHONPATH,
``python tests/store/test_outputs_of_releases.py > OUTPUTS`` prints its lines.
"""

import csv
import hashlib
import json
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.session.simulated import rehearsal

RELEASES = Path(__file__).parent / "releases"
KEPT = RELEASES / "outputs.txt"
STUDIES = [
    path.parent.relative_to(RELEASES).as_posix()
    for path in sorted(RELEASES.glob("*/*/data"))
    if (path.parent / "dataset_description.json").exists()
]
OF_THE_CLOCK = re.compile(r".*_at|trial_started_s|onset_s|first_choice_s|last_change_s")


def run(*words: object) -> Iterator[str]:
    """Yield the exit code of a command, and each line that it prints, without times and paths."""
    ended = CliRunner().invoke(commands, [str(word) for word in words])
    if ended.exception is not None and not isinstance(ended.exception, SystemExit):
        raise ended.exception
    yield f"exit code {ended.exit_code}"
    for line in ended.output.splitlines():
        if not re.search("[|/]tmp/|PytestWarning", line):
            yield re.sub(r"recomputed .* in all\): ", "", line)


def rounded(value: Any) -> Any:
    """Return a value whose numbers have nine digits: the last ones depend on libraries."""
    if isinstance(value, dict):
        return {key: rounded(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [rounded(inner) for inner in value]
    return float(f"{value:.9g}") if isinstance(value, float) else value


def digest(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, ensure_ascii=False).encode()).hexdigest()[:10]


def columns(path: Path, left_out: re.Pattern[str] | None = None, *, exactly: bool = True) -> Iterator[str]:
    """Yield name, number of cells and hash of each column of a table."""
    with path.open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    for at, name in enumerate(header):
        if left_out is None or not left_out.fullmatch(name):
            cells = [row[at] for row in rows]
            yield f"{path.name} {name} {len(cells)} {digest(cells if exactly else [as_number(cell) for cell in cells])}"


def as_number(cell: str) -> Any:
    try:
        return rounded(float(cell))
    except ValueError:
        return cell


def results(path: Path) -> Iterator[str]:
    """Yield key and hash of each result in ``report.json``."""
    told = json.loads(path.read_text(encoding="utf-8"))["results"]
    for number, block in enumerate(told["blocks"]):
        for key, value in block.items():
            inner = value.items() if isinstance(value, dict) else [("", value)]
            yield from (f"block {number} {key} {name} {digest(rounded(one))}" for name, one in inner)


def outputs(study: str, to: Path) -> Iterator[str]:
    """Yield lines on what each command makes of a study."""
    folder = shutil.copytree(RELEASES / study, to / "study")
    sessions = sorted(folder.glob("data/sub-*/ses-*"))
    yield from (f"verify: {line}" for line in run("verify", folder))
    for command in ("replay", "reproduce"):
        yield from (f"{command} {place.parent.name}: {line}" for place in sessions for line in run(command, place))
    list(run("unblind", folder, "--by", "AB", "--reason", "a test"))
    yield from (f"export: {line}" for line in run("export", folder, "--wide", "--to", to / "tables"))
    for path in sorted((to / "tables").glob("*.csv")):
        yield from (f"export: {line}" for line in columns(path))
    yield from (f"report: {line}" for line in run("report", folder, "--to", to / "report"))
    yield from (f"report: {line}" for line in columns(to / "report" / "tests.csv", exactly=False))
    yield from (f"report: {line}" for line in results(to / "report" / "report.json"))
    unfinished = [place for place in sessions if '"session_ended"' not in (place / "journal.jsonl").read_text("utf-8")]
    for place in unfinished:
        again = shutil.copytree(RELEASES / study, to / "resumed")
        session = again / place.relative_to(folder)
        rehearsal.resume_rehearsal(session, protocol=RELEASES / f"{study}.toml")
        list(run("unblind", again, "--by", "AB", "--reason", "a test"))
        for path in sorted(session.glob("*.csv")):
            yield from (f"resume: {line}" for line in columns(path, OF_THE_CLOCK))
        yield from (f"resume, replay: {line}" for line in run("replay", session))


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.usefixtures("quick_pdf")
@pytest.mark.parametrize("study", STUDIES)
def test_what_the_commands_make_of_it_stays_the_same(study: str, tmp_path: Path) -> None:
    kept = [line.partition(": ")[2] for line in KEPT.read_text("utf-8").splitlines() if line.startswith(f"{study}: ")]
    made = set(outputs(study, tmp_path))
    assert len(kept) > 100
    assert [line for line in kept if line not in made] == []


if __name__ == "__main__":
    for name in STUDIES:
        with tempfile.TemporaryDirectory() as within:
            sys.stdout.writelines(f"{name}: {line}\n" for line in outputs(name, Path(within)))
