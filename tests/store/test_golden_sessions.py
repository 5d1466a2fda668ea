"""Every file that a session of each shipped study leaves, and what changes in them as the study is handled."""

import base64
import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.exclusions import exclude, include
from study_app.store.session_progress.progress import Progress
from study_app.store.unblinding import unblind
from study_app.store.verification.whole_study import verify_study
from tests import golden
from tests.golden_values import changed, table_lines, value_lines
from tests.journal_lines import event_of
from tests.studies import begun, made_up, once

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
        found = CHANGING.sub("*", text).splitlines()
        yield f"== {path.relative_to(folder).as_posix()}: {len(found)} lines"
        if path.suffix in (".json", ".sealed"):
            content = {key: one for key, one in json.loads(text).items() if key not in OF_THE_MACHINE}
            yield from (CHANGING.sub("*", line) for line in value_lines(content))
        elif path.suffix == ".csv":
            yield from (line.partition(":")[0] for line in table_lines("\n".join(found)))
        else:
            yield from found[: MOST // 2] + found[MOST // 2 :: max(1, len(found) // MOST)]


def without_folder(text: str, folder: Path) -> str:
    return text.replace(str(folder), "FOLDER").replace(folder.as_posix(), "FOLDER")


@pytest.mark.parametrize("name", [*STUDIES[:2], *(pytest.param(name, marks=pytest.mark.slow) for name in STUDIES[2:])])
def test_files(name: str, tmp_path_factory: pytest.TempPathFactory, pytestconfig: pytest.Config) -> None:
    def make(folder: Path) -> None:
        rehearse_answers(name, participants=1, seed=11, results=folder / name, features=made_up(name))

    study = once(tmp_path_factory, f"golden-session-{name}", make) / name
    assert verify_study(study).is_sound
    if name in RECORDED:
        golden.compare(GOLDEN / f"{name}.txt", golden.each_once(lines_of(study)), pytestconfig)


def test_handling(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, pytestconfig: pytest.Config) -> None:
    def make(folder: Path) -> None:
        rehearse_answers("demo", participants=2, seed=7, results=folder / "demo", features=made_up("demo"))

    study = Path(shutil.copytree(once(tmp_path_factory, "handled-demo", make) / "demo", tmp_path / "demo"))
    steps: dict[str, Any] = {
        "exclude": lambda: exclude(study, "P001", 1, by="AK", reason="asleep"),
        "exclude a trial": lambda: exclude(study, "P002", 1, trial=2, by="AK", reason="phone"),
        "include": lambda: include(study, "P001", 1, by="CD", reason="awake"),
        "unblind": lambda: unblind(study, "AK", "closed"),
    }
    before, told = list(lines_of(study)), list[str]()
    for name, step in steps.items():
        result = step()
        after = list(lines_of(study))
        told += [f"== {name}: {result}", *changed(before, after)]
        before = after
    text = without_folder("\n".join(told), tmp_path)
    golden.compare(GOLDEN / "handling.txt", golden.each_once(golden.what_comes(text.split("\n"))), pytestconfig)


EVENTS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("page_shown", {"page": "welcome"}), ("page_left", {"page": "welcome"}),
    ("trial_started", {"trial": 1, "attempt": 1, "block": "liquids", "phase": "main", "part": 1, "index": 1, "of": 2,
                       "code": "L1"}),
    ("note", {"kind": "note", "text": "=left-handed, \"quoted\"\nsecond"}), ("note", {"kind": "mark", "text": ""}),
    ("force_stopped", {"by": "operator"}), ("force_restored", {"by": "operator"}), ("paused", {"by": "operator"}),
    ("resumed", {"by": "operator"}), ("repeat", {"trial": 1, "reason": "phone rang"}),
    ("recording_lost", {"trial": 1, "attempt": 1, "reason": "the disk was full"}),
)  # fmt: skip


def test_a_journal(tmp_path: Path, pytestconfig: pytest.Config) -> None:
    study = tmp_path / "demo"
    progress, told, before = Progress(), list[str](), list[str]()
    with begun(study, "P003", seed=5, operator="AK", simulated=True) as session:
        for number, (event, fields) in enumerate(EVENTS):
            session.append(event_of(event, **fields), t_s=float(number))
            session.write_tables()
            after = [*lines_of(study), *value_lines(progress, "progress")]
            told += [f"== {event}", *changed(before, after)]
            before = after
        session.finish("withdrawn", "felt unwell")
    told += ["== finished", *changed(before, list(lines_of(study)))]
    told += sorted(f"left open: {path.name}" for path in study.rglob(".open-*"))
    told += [without_folder(line, tmp_path) for line in value_lines(verify_study(study), "verify")]
    golden.compare(GOLDEN / "journal.txt", golden.each_once(golden.what_comes(told)), pytestconfig)
