"""Rehearsals run every session that a study plans for a participant."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from study_app.session.simulated.answers_only import rehearse_answers
from study_app.session.simulated.rehearsal import rehearse, resume_rehearsal
from study_app.store.blinded.blinding import open_events, read_key
from study_app.store.files.folders import SessionFolder, StudyFolder
from study_app.store.journals import journal
from study_app.store.verification.reproduction import reproduce_session
from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo
from tests.journal_lines import raw
from tests.protocol.groups.grouped import STUDY

pytestmark = [pytest.mark.slow, needs_servo]

STUDY_OF_SESSIONS = (
    STUDY.replace("min_s = 1\nmax_s = 3", "min_s = 0.3\nmax_s = 0.6")
    + """
[groups.single]
sequences = [["hello", "thin"]]

[groups.trained]
sequences = [["hello", "thin", "thick"], ["thick"], ["thick", "end"]]
"""
)
CRITERION = """
[designs.pair]
kind = "2ifc"
feedback = "always"

[blocks.screening]
conditions = ["water", "honey"]
standard = "water"
design = "pair"
repetitions = 3
until = { right = 90, of = 90, missed = "end" }
"""


def lines_of(session: SessionFolder, study: Path) -> list[dict[str, Any]]:
    return raw(open_events(journal.read(session.journal), read_key(study)))


def answers_in(session: SessionFolder, study: Path, block: str) -> list[Any]:
    lines = lines_of(session, study)
    trials = [line["trial"] for line in lines if line["event"] == "trial_started" and line["block"] == block]
    return [line["items"][0]["value"] for line in lines if line["event"] == "responses" and line["trial"] in trials]


@pytest.mark.parametrize("rehearsed", [rehearse, rehearse_answers])
def test_each_group_completes_its_own_sessions(rehearsed: Callable[..., Path], tmp_path: Path) -> None:
    source = tmp_path / "grouped.toml"
    source.write_text(STUDY_OF_SESSIONS, encoding="utf-8", newline="\n")
    messages: list[str] = []
    study = rehearsed(source, participants=4, seed=8, results=tmp_path / "study", progress=messages.append)
    verification = verify_study(study)
    assert (verification.errors, verification.warnings, verification.sessions) == ((), (), 8)
    sessions: dict[str, list[SessionFolder]] = {}
    for session in StudyFolder(study).sessions():
        sessions.setdefault(session.participant, []).append(session)
        assert reproduce_session(session.path).differences == []
    numbers = [[session.number for session in own] for own in sessions.values()]
    assert sorted(numbers) == [[1], [1], [1, 2, 3], [1, 2, 3]]
    of_trained = [answers_in(session, study, "thick") for own in sessions.values() for session in own if len(own) > 1]
    assert [len(answers) for answers in of_trained] == [4] * 6
    assert len({tuple(answers) for answers in of_trained}) > 4, "a later session repeats the first one's answers"


def test_a_later_session_is_resumed_with_the_same_answers(tmp_path: Path) -> None:
    source = tmp_path / "grouped.toml"
    source.write_text(STUDY_OF_SESSIONS, encoding="utf-8", newline="\n")
    study = rehearse(source, participants=2, seed=8, results=tmp_path / "study", recordings=False)
    session = next(session for session in StudyFolder(study).sessions() if session.number == 3)
    whole = answers_in(session, study, "thick")
    (study / "fingerprints.txt").unlink()
    content = session.journal.read_bytes()
    session.journal.write_bytes(content[: len(content) // 2])
    for derived_file in (*session.path.glob("*.csv"), session.checksums):
        derived_file.unlink()
    text = session.receipt.read_text("utf-8").replace('"status": "completed"', '"status": "unfinished"')
    session.receipt.write_text(text, encoding="utf-8", newline="\n")
    resume_rehearsal(session.path, protocol=source)
    assert answers_in(session, study, "thick") == whole


@pytest.mark.parametrize("rehearsed", [rehearse, rehearse_answers])
def test_a_participant_whose_session_ended_early_has_no_later_session(
    rehearsed: Callable[..., Path], tmp_path: Path
) -> None:
    source = tmp_path / "grouped.toml"
    text = (
        STUDY_OF_SESSIONS.replace('["hello", "thin", "thick"]', '["hello", "screening", "thin", "thick"]') + CRITERION
    )
    source.write_text(text, encoding="utf-8", newline="\n")
    study = rehearsed(source, participants=2, seed=8, results=tmp_path / "study")
    assert [session.number for session in StudyFolder(study).sessions()] == [1, 1]
