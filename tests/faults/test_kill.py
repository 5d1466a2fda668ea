"""A session killed at any moment: every answer that was acknowledged is there, and the session can be completed."""

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from study_app.protocol.load import load
from study_app.protocol.orders.block_orders import orders_of
from study_app.store.files.folders import SessionFolder, StudyFolder
from study_app.store.journals import journal
from study_app.store.tables import session_tables
from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo
from tests.faults.support import short
from tests.faults.support.killer_runs import outcomes_of
from tests.journal_lines import raw
from tests.platforms import needs_fork

TIMES = {"answered_at", "onset_s", "first_choice_s", "last_change_s", "attempt"}
WHAT_RAN = ("trial", "block", "phase", "part", "index", "of", "code", "outcome")

pytestmark = [pytest.mark.slow, needs_servo, needs_fork]


def session(study: Path) -> SessionFolder:
    (folder,) = StudyFolder(study).sessions()
    return folder


def rows(study: Path, name: str) -> list[dict[str, str]]:
    with session(study).table("demo", name).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def answers(study: Path) -> list[dict[str, str]]:
    """Return the responses of each trial's last attempt without times and attempts."""
    response_rows = rows(study, "responses")
    last = {(row["trial"], row["attempt"]) for row in session_tables.latest_attempts(with_numbers(response_rows))}
    return [
        {name: cell for name, cell in row.items() if name not in TIMES}
        for row in response_rows
        if (int(row["trial"]), int(row["attempt"])) in last
    ]


def with_numbers(response_rows: list[dict[str, str]]) -> list[dict[str, Any]]:
    return [{**row, "trial": int(row["trial"]), "attempt": int(row["attempt"])} for row in response_rows]


def last_attempts(study: Path) -> list[tuple[str, ...]]:
    return [
        tuple(str(row[name]) for name in WHAT_RAN)
        for row in session_tables.latest_attempts(with_numbers(rows(study, "trials")))
    ]


@pytest.mark.parametrize(
    ("resume", "count"),
    [
        pytest.param("trial", 35, marks=pytest.mark.nightly),
        ("block", 6),
        pytest.param("block", 15, marks=pytest.mark.nightly),
        pytest.param("trial", 2000, marks=[pytest.mark.nightly, pytest.mark.timeout(4 * 3600)]),
    ],
)
def test_killed_at_random_moments_a_session_is_completed_as_if_nothing_had_been(
    tmp_path: Path, resume: str, count: int
) -> None:
    outcomes = outcomes_of("killer", short.write(tmp_path, resume=resume), tmp_path, count, 1, limit_s=150 + 5 * count)
    assert len(outcomes) == count
    whole = tmp_path / "whole"
    interrupted = 0
    for outcome in outcomes:
        study = Path(outcome["folder"])
        if outcome["resumed"] is None:
            assert outcome["code"] == 0
            continue
        assert outcome["resumed"] == 0, outcome["after_s"]
        interrupted += 1
        lines = raw(journal.read(session(study).journal))
        *before, _torn = outcome["held"].split("\n")
        assert lines[: len(before)] == [json.loads(line) for line in before]
        resumed = [line["event"] for line in lines].count("session_resumed")
        assert resumed == ("\n" in outcome["held"] and "session_ended" not in outcome["held"])
        assert lines[-1]["status"] == "completed"
        assert answers(study) == answers(whole)
        assert last_attempts(study) == last_attempts(whole)
        assert len(answers(study)) == short.ANSWERS == orders_of(load(str(tmp_path / "short.toml"))).answers
        assert_answers_in_table(before, rows(study, "responses"))
    assert interrupted >= count / 3
    study = next(Path(outcome["folder"]) for outcome in outcomes if outcome["resumed"] == 0)
    assert verify_study(study).errors == ()


def assert_answers_in_table(held: list[str], response_rows: list[dict[str, str]]) -> None:
    """Assert that the table contains every answer confirmed before the kill, with its value."""
    table = {(row["trial"], row["attempt"], row["item"]): row["response"] for row in response_rows}
    for line in map(json.loads, held):
        for answer in line["items"] if line["event"] == "responses" else ():
            assert table[str(line["trial"]), str(line["attempt"]), answer["item"]] == str(answer["value"])
