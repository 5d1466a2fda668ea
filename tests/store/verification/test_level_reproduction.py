"""Levels that were presented follow from the answers; whoever changes one is found, and no level is printed."""

import csv
import io
import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.errors import StoreError
from study_app.session.replay import replay
from study_app.session.simulated.rehearsal import rehearse, resume
from study_app.store.blinded.blinding import opened, read_key
from study_app.store.blinded.unblinding import unblind
from study_app.store.journals import journal
from study_app.store.verification.reproduction import reproduced
from study_app.store.verification.verify_study import verify
from tests.compiled import needs_servo
from tests.journal_lines import raw
from tests.protocol.trials.level_studies import BLOCK, HEAD
from tests.session.pairs import short_text
from tests.store.forging import Lines, change, cut, nothing

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def protocol(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("protocol") / "levels.toml"
    path.write_text(short_text())
    return path


@pytest.fixture(scope="module")
def study(protocol: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return rehearse(protocol, participants=1, seed=2, results=tmp_path_factory.mktemp("levels") / "study")


@pytest.fixture
def session(study: Path, tmp_path: Path) -> Path:
    """Return the session in a copy of the study, which may be changed."""
    shutil.copytree(study, tmp_path / "study")
    return next((tmp_path / "study" / "data").glob("sub-*/ses-*"))


def test_every_level_of_a_rehearsed_session_follows_and_every_force_is_computed_again(study: Path) -> None:
    session = next((study / "data").glob("sub-*/ses-*"))
    found = reproduced(session)
    assert found.differences == []
    assert found.followed[-1] == "viscosity: 6 of 6 levels follow from the answers"
    assert found.followed[0].startswith("training: ")
    assert replay(session).proved
    checked = verify(study, None)
    assert (checked.errors, checked.warnings) == ((), ())


def other_level(lines: Lines) -> None:
    next(line for line in lines if "level" in line and line["trial"] == 5)["level"] = 0.123


def other_arrangement(lines: Lines) -> None:
    line = next(line for line in lines if "level" in line and line["trial"] == 5)
    line["arrangement"] = line["arrangement"][::-1]


def passed_over_too_early(lines: Lines) -> None:
    later = [line for line in lines if line.get("trial") == 5]
    lines[lines.index(later[0])] = {
        **{name: later[0][name] for name in ("n", "t_s", "at")},
        **{"event": "passed_over", "trial": 5, "reason": "track_ended"},
    }
    for line in later[1:]:
        lines.remove(line)


def other_answer(lines: Lines) -> None:
    """Make the answer that met the criterion of the training wrong."""
    last = [line for line in lines if line["event"] == "responses" and line["trial"] <= 3][-1]
    last["items"][0]["value"] = {"first": "second", "second": "first"}[last["items"][0]["value"]]


@pytest.mark.parametrize(
    ("edit", "named"),
    [
        (other_level, "trial 5, attempt 1: another level"),
        (other_arrangement, "trial 5, attempt 1: another level"),
        (passed_over_too_early, "trial 5: passed over, though it was due"),
        (other_answer, "passed over, though it was due by the answers"),
    ],
)
def test_what_was_changed_with_the_key_at_hand_is_found(
    session: Path, edit: Callable[[Lines], None], named: str
) -> None:
    change(session, edit)
    found = reproduced(session).differences
    assert any(named in line for line in found), found
    ran = CliRunner().invoke(commands, ["reproduce", str(session)])
    assert ran.exit_code == 3
    assert named in ran.output
    assert not re.search(r"0\.[1248]", "".join(found))


def test_a_sealed_line_that_was_changed_is_a_difference_and_a_missing_key_is_refused(session: Path) -> None:
    key = next((session.parents[2] / "blinding").glob("key*"))
    key.rename(key.with_name("elsewhere"))
    with pytest.raises(StoreError, match="key"):
        reproduced(session)
    key.with_name("elsewhere").rename(key)

    def tamper(lines: Lines) -> None:
        line = next(line for line in lines if line["event"] == "trial_started")
        line["sealed"] = "0000" + line["sealed"][4:]

    change(session, nothing, tamper)
    assert "cannot be decrypted" in reproduced(session).differences[0]


def test_levels_are_in_the_tables_only_after_unblinding(session: Path) -> None:
    def intervals() -> list[dict[str, str]]:
        return [*csv.DictReader(io.StringIO(next(session.glob("*intervals*")).read_text()))]

    assert "level" not in intervals()[0]
    assert "force_mean_n" not in intervals()[0]
    assert len(intervals()) % 2 == 0
    unblind(session.parents[2], "somebody", "to test")
    opened_rows = intervals()
    assert {row["presented"] for row in opened_rows} == {"standard", "comparison"}
    assert {row["level"] for row in opened_rows} == {"0.2", "0.4", "0.8"}
    assert {row["standard"] for row in opened_rows} == {"1.0", "2.0"}
    assert verify(session.parents[2], None).errors == ()


@pytest.mark.parametrize("share", [0.2, 0.45, 0.7, 0.95])
def test_a_session_that_was_killed_and_resumed_presents_and_is_answered_as_one_that_was_not(
    session: Path, protocol: Path, share: float
) -> None:
    def told() -> tuple[list[Any], list[Any]]:
        lines = raw(opened(journal.read(session / "journal.jsonl"), read_key(session.parents[2])))
        last = {line["trial"]: line for line in lines if line["event"] == "trial_started"}
        levels = [(n, line["level"], line["standard"], line["arrangement"]) for n, line in sorted(last.items())]
        answers = {line["trial"]: line["items"][0]["value"] for line in lines if line["event"] == "responses"}
        return levels, sorted(answers.items())

    whole = told()
    cut(session, round(share * (session / "journal.jsonl").stat().st_size))
    resume(session, protocol=protocol)
    assert told() == whole
    assert reproduced(session).differences == []


def test_compared_conditions_follow_from_the_key(tmp_path: Path) -> None:
    text = HEAD + BLOCK.replace("stimulus", "#").replace("method", "#")
    text += 'conditions = ["oil", "other", "late"]\nstandard = "oil"\nrepetitions = 2\n'
    path = tmp_path / "pairs.toml"
    path.write_text(text.replace("min_s = 1", "min_s = 0.3"))
    study = rehearse(path, participants=1, seed=2, results=tmp_path / "study", recordings=False)
    found = reproduced(next((study / "data").glob("sub-*/ses-*")))
    assert found.differences == []
    assert found.followed == ["viscosity: 4 of 4 levels follow from the answers"]


@needs_servo
def test_a_rehearsed_session_is_reproduced_and_with_another_seed_it_is_not(tmp_path: Path) -> None:
    session = rehearse("demo", participants=1, seed=3, results=tmp_path / "demo") / "data/sub-P001/ses-01"
    assert reproduced(session).differences == []
    receipt = session / "receipt.json"
    told = json.loads(receipt.read_text())
    differ = set()
    for seed in range(8):
        receipt.write_text(json.dumps(told | {"seed": seed}))
        differ.add(bool(reproduced(session).differences))
    assert True in differ
    del told["seed"]
    receipt.write_text(json.dumps(told))
    with pytest.raises(StoreError, match="seed"):
        reproduced(session)
