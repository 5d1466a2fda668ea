"""Levels that were presented follow from the answers; whoever changes one is found, and no level is printed."""

import csv
import io
import shutil
from pathlib import Path
from typing import Any

import pytest

from study_app.session.simulated.rehearsal import rehearse, resume_rehearsal
from study_app.store.blinded.blinding import open_events, read_key
from study_app.store.journals import journal
from study_app.store.unblinding import unblind
from study_app.store.verification.reproduction import reproduce_session
from study_app.store.verification.whole_study import verify_study
from tests.journal_lines import raw
from tests.protocol.trials.level_studies import BLOCK, HEAD
from tests.session.pairs import short_text
from tests.store.forging import cut

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def protocol(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("protocol") / "levels.toml"
    path.write_text(short_text(), encoding="utf-8", newline="\n")
    return path


@pytest.fixture(scope="module")
def study(protocol: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return rehearse(protocol, participants=1, seed=2, results=tmp_path_factory.mktemp("levels") / "study")


@pytest.fixture
def session(study: Path, tmp_path: Path) -> Path:
    """Return the session in a copy of the study, which may be changed."""
    shutil.copytree(study, tmp_path / "study")
    return next((tmp_path / "study" / "data").glob("sub-*/ses-*"))


def test_levels_are_in_the_tables_only_after_unblinding(session: Path) -> None:
    def intervals() -> list[dict[str, str]]:
        return [*csv.DictReader(io.StringIO(next(session.glob("*intervals*")).read_text("utf-8")))]

    assert "level" not in intervals()[0]
    assert "force_mean_n" not in intervals()[0]
    assert len(intervals()) % 2 == 0
    unblind(session.parents[2], "somebody", "to test")
    opened_rows = intervals()
    assert {row["presented"] for row in opened_rows} == {"standard", "comparison"}
    assert {row["level"] for row in opened_rows} == {"0.2", "0.4", "0.8"}
    assert {row["standard"] for row in opened_rows} == {"1.0", "2.0"}
    assert verify_study(session.parents[2], None).errors == ()


@pytest.mark.parametrize("share", [0.2, 0.45, 0.7, 0.95])
def test_a_session_that_was_killed_and_resumed_presents_and_is_answered_as_one_that_was_not(
    session: Path, protocol: Path, share: float
) -> None:
    def told() -> tuple[list[Any], list[Any]]:
        lines = raw(open_events(journal.read(session / "journal.jsonl"), read_key(session.parents[2])))
        last = {line["trial"]: line for line in lines if line["event"] == "trial_started"}
        levels = [(n, line["level"], line["standard"], line["arrangement"]) for n, line in sorted(last.items())]
        answers = {line["trial"]: line["items"][0]["value"] for line in lines if line["event"] == "responses"}
        return levels, sorted(answers.items())

    whole = told()
    cut(session, round(share * (session / "journal.jsonl").stat().st_size))
    resume_rehearsal(session, protocol=protocol)
    assert told() == whole
    assert reproduce_session(session).differences == []


def test_compared_conditions_follow_from_the_key(tmp_path: Path) -> None:
    text = HEAD + BLOCK.replace("stimulus", "#").replace("method", "#")
    text += 'conditions = ["oil", "other", "late"]\nstandard = "oil"\nrepetitions = 2\n'
    path = tmp_path / "pairs.toml"
    path.write_text(text.replace("min_s = 1", "min_s = 0.3"), encoding="utf-8", newline="\n")
    study = rehearse(path, participants=1, seed=2, results=tmp_path / "study", recordings=False)
    reproduction = reproduce_session(next((study / "data").glob("sub-*/ses-*")))
    assert reproduction.differences == []
    assert reproduction.followed == ["viscosity: 4 of 4 levels are consistent with the answers"]
