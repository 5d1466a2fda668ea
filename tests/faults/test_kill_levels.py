"""A session with levels, killed at random bytes of its journal and resumed, presents what it would have presented."""

import os
from pathlib import Path
from typing import Any

import pytest

from study_app.store.blinded.blinding import open_events, read_key
from study_app.store.files.columns import DELIVERED, TRIALS
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.verification.reproduction import reproduce_session
from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo
from tests.faults.support.killer_runs import outcomes_of
from tests.journal_lines import raw
from tests.platforms import needs_fork
from tests.session.pairs import short_text

KILLS = int(os.environ.get("LIQUID_STUDY_LEVEL_KILLS", "6"))
TIMES = {"n", "at", "t_s", "previous", "attempt", "onset_s", "first_choice_s", "last_change_s", "first_s", "last_s"}
MEASURES = {column.name for column in (*TRIALS, *DELIVERED) if column.kind in {"number", "integer"}} - {
    "trial",
    "index",
    "of",
    "part",
}
OF_TRIALS = {"trial_started", "interval_started", "interval_ended", "trial_ended", "responses", "passed_over"}

pytestmark = [pytest.mark.slow, needs_servo, needs_fork, pytest.mark.timeout(300 + 60 * KILLS)]


def recorded_events(study: Path) -> dict[tuple[Any, ...], Any]:
    """Return a journal's events of the last attempt at each trial, unsealed, without times and measurements.

    Measurements differ: after a break the simulated hand is elsewhere, and the force fades in again.
    """
    (session,) = StudyFolder(study).sessions()
    events: dict[tuple[Any, ...], Any] = {}
    for line in raw(open_events(journal.read(session.journal), read_key(study))):
        if line["event"] in OF_TRIALS:
            events[line["event"], line.get("trial", line.get("page")), line.get("interval")] = comparable(line)
    return events


def comparable(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: comparable(inner) for name, inner in value.items() if name not in TIMES | MEASURES}
    return [comparable(inner) for inner in value] if isinstance(value, list) else value


CONSTANT = 'kind = "constant"\nlevels = [0.2, 0.4, 0.8]\nrepetitions = 1'
ADAPTIVE = 'kind = "questplus"\ntrials = 8\ntracks = 2'
CATCH = 'method = "few"\ncatch = { share = 0.25 }'


@pytest.mark.nightly
@pytest.mark.parametrize(
    "edits",
    [pytest.param({}, id="constant"), pytest.param({CONSTANT: ADAPTIVE, 'method = "few"': CATCH}, id="adaptive")],
)
def test_a_session_killed_at_random_bytes_of_its_journal_equals_one_that_was_not(
    tmp_path: Path, edits: dict[str, str]
) -> None:
    text = short_text()
    for old, new in edits.items():
        assert old in text
        text = text.replace(old, new)
    protocol = tmp_path / "levels.toml"
    protocol.write_text(text, encoding="utf-8", newline="\n")
    outcomes = outcomes_of("killer", protocol, tmp_path, KILLS, 3, "bytes", limit_s=240 + 50 * KILLS)
    whole = recorded_events(tmp_path / "whole")
    assert sum(event == "trial_started" for event, *_ in whole) >= 7
    assert all("level" in line for (event, *_), line in whole.items() if event == "trial_started")
    killed = [outcome for outcome in outcomes if outcome["resumed"] is not None]
    assert len(killed) > KILLS / 2
    for outcome in killed:
        study = Path(outcome["folder"])
        assert outcome["resumed"] == 0, outcome
        (session,) = StudyFolder(study).sessions()
        assert session.journal.read_text(encoding="utf-8").startswith(outcome["held"].rpartition("\n")[0])
        assert_same_session(study, whole)


def assert_same_session(study: Path, whole: dict[tuple[Any, ...], Any]) -> None:
    """Assert that a study's only session is sound and has the same events as an uninterrupted one."""
    assert recorded_events(study) == whole, study
    (session,) = StudyFolder(study).sessions()
    assert reproduce_session(session.path).differences == []
    assert verify_study(study, None).errors == ()


@pytest.mark.nightly
def test_one_session_killed_again_and_again_equals_one_that_was_not(tmp_path: Path) -> None:
    protocol = tmp_path / "levels.toml"
    protocol.write_text(
        short_text().replace(CONSTANT, ADAPTIVE).replace('method = "few"', CATCH), encoding="utf-8", newline="\n"
    )
    (outcome,) = outcomes_of("killer", protocol, tmp_path, KILLS, 3, "again", limit_s=240 + 50 * KILLS)
    assert outcome["kills"] > 0.8 * KILLS
    study = Path(outcome["folder"])
    (session,) = StudyFolder(study).sessions()
    events = [line["event"] for line in raw(journal.read(session.journal))]
    assert events.count("session_resumed") > 0.5 * KILLS
    assert_same_session(study, recorded_events(tmp_path / "whole"))
