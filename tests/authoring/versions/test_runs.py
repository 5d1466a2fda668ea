from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from study_app.authoring.versions import Run, changes, check_saving, next_version, runs
from study_app.authoring.writer.refused import Refused
from study_app.protocol.load import load, parse
from study_app.protocol.source.files import protocol_hash
from study_app.store.receipt import without_conditions
from tests.authoring.grown import PROTOCOLS

TEXT = (PROTOCOLS / "demo.toml").read_text(encoding="utf-8")
DEMO = load(PROTOCOLS / "demo.toml")


def changed(*pairs: tuple[str, str]) -> Any:
    text = TEXT
    for old, new in pairs:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return parse(text.encode(), "demo")


@pytest.mark.parametrize(
    ("old", "new", "effect"),
    [
        ('title = "Now reach"', 'title = "Reach"', "comparable"),
        ('version = "1.0"', 'version = "1.1"', "comparable"),
        ('short = "Task harder"', 'short = "Harder"', "comparable"),
        ("delay_ms = 200", "delay_ms = 300", "measured"),
        ("count = 6", "count = 8", "measured"),
        ('order = "shuffled"\nrepetitions = 1\ntask = "reach"', 'order = "fixed"\ntask = "reach"', "measured"),
        ('text = "What I saw made the task harder."', 'text = "It was harder."', "measured"),
        ('id = "harder"', 'id = "difficult"', "tables"),
        ('code_prefix = "D"', 'code_prefix = "E"', "tables"),
        ("lateness_ms = 2 ", "lateness_ms = 3 ", "measured"),
    ],
)
@pytest.mark.parametrize("of_receipt", [False, True])
def test_changes_are_sorted_by_what_they_do(old: str, new: str, effect: str, *, of_receipt: bool) -> None:
    after = changed((old, new))
    found = changes(without_conditions(DEMO) if of_receipt else DEMO, after)
    if of_receipt and old.startswith("delay_ms"):
        assert not found
        return
    assert {one.effect for one in found} == {effect}, found


def test_changes_of_the_same_study_are_none() -> None:
    assert changes(DEMO, DEMO) == ()


def session(folder: Path, participant: str, source: bytes, **facts: Any) -> None:
    path = folder / "data" / f"sub-{participant}" / "ses-01" / "receipt.json"
    path.parent.mkdir(parents=True)
    protocol = without_conditions(parse(source, "demo"))
    held = {
        "key_hash": "0" * 64, "protocol_hash": protocol_hash(source), "protocol": protocol, "simulated": False,
        "pilot": False, "started_at": "2026-11-21T12:00:00+00:00", **facts,
    }  # fmt: skip
    path.write_text(json.dumps(held))


def test_runs_counts_sessions_pilots_and_rehearsals_by_content(tmp_path: Path) -> None:
    one, other = TEXT.encode(), TEXT.replace('version = "1.0"', 'version = "1.1"').encode()
    session(tmp_path / "demo", "P001", one)
    session(tmp_path / "demo", "P002", one)
    session(tmp_path / "demo", "P003", other, started_at="2026-11-22T12:00:00+00:00")
    session(tmp_path / "demo-pilot", "P001", one, pilot=True)
    session(tmp_path / "demo-rehearsal-1", "P001", other, simulated=True)
    (tmp_path / "demo" / "data" / "sub-P004" / "ses-01").mkdir(parents=True)
    found = runs(tmp_path, "demo")
    assert [(run.version, run.sessions, run.pilots, run.rehearsals) for run in found] == [
        ("1.0", 2, 1, 0),
        ("1.1", 1, 0, 1),
    ]
    assert [run.hash for run in found] == [protocol_hash(one), protocol_hash(other)]
    assert runs(tmp_path, "other") == ()


def test_a_version_that_was_run_is_never_overwritten_with_other_content() -> None:
    known = (Run("abc", "1.0", sessions=2), Run("def", "1.1", pilots=3))
    check_saving("abc", "1.0", known)
    check_saving("new", "1.1", known)
    check_saving("new", "2.0", known)
    with pytest.raises(Refused, match=r"version 1\.0 was run by 2 sessions with another content: .* version 1\.1$"):
        check_saving("new", "1.0", known)


@pytest.mark.parametrize(
    ("version", "following"),
    [("1", "2"), ("1.9", "1.10"), ("2026-a", "2027-a"), ("beta", "beta.1"), ("1.0-rc2", "1.0-rc3")],
)
def test_next_version_raises_the_last_number(version: str, following: str) -> None:
    assert next_version(version) == following
