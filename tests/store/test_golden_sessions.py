"""Every file that a session of each shipped study leaves."""

import base64
import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.verification.whole_study import verify_study
from tests import golden
from tests.golden_values import table_lines, value_lines
from tests.studies import made_up, once

GOLDEN = Path(__file__).parent / "golden"
STUDIES = ("demo", "physical2", "rek2024", "thickness", "viscosityjnd", "forcedelay", "delaydetect")
CHANGING = re.compile(
    golden.CHANGING.pattern + r"|\b(?:[a-z0-9]{4}-){2}[a-z0-9]{4}\b|(?<=session_ended\",\"t_s\":)[0-9.]+"
)
"""Dates, versions, hashes, fingerprints and when a session that nobody simulates ended."""
RECORDED = ("demo", "viscosityjnd")
"""Studies that together write each kind of file."""
OF_THE_MACHINE = ("versions", "machine", "clock", "git")
MOST = 40
"""Most lines of a file that are compared, evenly spread."""


def lines_of(folder: Path) -> Iterator[str]:
    for path in sorted(folder.rglob("*")):
        if not path.is_file() or path.suffix in (".sha256", ".toml") or path.name.startswith("."):
            continue
        text = path.read_text(encoding="utf-8")
        if path.suffix == ".sealed":
            text = base64.b64decode(text).decode()
        lines = CHANGING.sub("*", text).splitlines()
        yield f"== {path.relative_to(folder).as_posix()}: {len(lines)} lines"
        if path.suffix in (".json", ".sealed"):
            content = {key: value for key, value in json.loads(text).items() if key not in OF_THE_MACHINE}
            yield from (CHANGING.sub("*", line) for line in value_lines(content))
        elif path.suffix == ".csv":
            yield from (line.partition(":")[0] for line in table_lines("\n".join(lines)))
        else:
            yield from lines[: MOST // 2] + lines[MOST // 2 :: max(1, len(lines) // MOST)]


@pytest.mark.parametrize("name", [*STUDIES[:2], *(pytest.param(name, marks=pytest.mark.slow) for name in STUDIES[2:])])
def test_files(name: str, tmp_path_factory: pytest.TempPathFactory, pytestconfig: pytest.Config) -> None:
    def make(folder: Path) -> None:
        rehearse_answers(name, participants=1, seed=11, results=folder / name, features=made_up(name))

    study = once(tmp_path_factory, f"golden-session-{name}", make) / name
    assert verify_study(study).is_sound
    if name in RECORDED:
        golden.compare(GOLDEN / f"{name}.txt", golden.each_once(lines_of(study)), pytestconfig)
