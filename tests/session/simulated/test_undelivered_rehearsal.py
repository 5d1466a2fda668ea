"""A study whose strong levels the force limit clips: such trials come again, are not asked about, and are given up."""

import csv
import shutil
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.session.replay import replay
from study_app.session.simulated.rehearsal import rehearse, resume_rehearsal
from study_app.store.blinded.blinding import open_events, read_key
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.verification.reproduction import reproduce_session
from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo
from tests.journal_lines import raw
from tests.protocol.edited_studies import text_of
from tests.store.forging import cut

pytestmark = [pytest.mark.slow, needs_servo]

STRONG = 4.0
ATTEMPTS = 3


@pytest.fixture(scope="module")
def protocol(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("clipped") / "clipped.toml"
    path.write_text(text_of("clipped"), encoding="utf-8", newline="\n")
    return path


@pytest.fixture(scope="module")
def study(protocol: Path) -> Path:
    return rehearse(protocol, participants=1, seed=1, results=protocol.parent / "results")


@pytest.fixture
def session(study: Path, tmp_path: Path) -> Path:
    """Return the session in a copy of the study, which may be changed."""
    shutil.copytree(study, tmp_path / "study")
    return StudyFolder(tmp_path / "study").sessions()[0].path


def lines_of(session: Path) -> list[dict[str, Any]]:
    return [
        dict(line) for line in raw(open_events(journal.read(session / "journal.jsonl"), read_key(session.parents[2])))
    ]


def rows_of(session: Path, table: str) -> list[dict[str, str]]:
    (path,) = session.glob(f"*description-{table}_data.csv")
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))


def by_trial(lines: list[dict[str, Any]], event: str) -> dict[int, list[dict[str, Any]]]:
    lines_of_trial: dict[int, list[dict[str, Any]]] = {}
    for line in lines:
        if line["event"] == event:
            lines_of_trial.setdefault(line["trial"], []).append(line)
    return lines_of_trial


def outcomes(lines: list[dict[str, Any]]) -> list[tuple[int, int, str]]:
    return [(line["trial"], line["attempt"], line["outcome"]) for line in lines if line["event"] == "trial_ended"]


def answers(lines: list[dict[str, Any]]) -> list[tuple[int, Any]]:
    return [(line["trial"], line["items"][0]["value"]) for line in lines if line["event"] == "responses"]


def test_trials_with_clipped_intervals_are_repeated_without_a_question(session: Path) -> None:
    lines = lines_of(session)
    start_lines, ended = by_trial(lines, "trial_started"), by_trial(lines, "trial_ended")
    answered = set(by_trial(lines, "responses"))
    strong = {trial for trial, attempts in start_lines.items() if attempts[0]["level"] == STRONG}
    assert len(strong) == 2
    assert answered == set(start_lines) - strong
    for trial in strong:
        assert [line["outcome"] for line in ended[trial]] == ["invalid"] * ATTEMPTS
        assert len({(line["level"], line["standard"], line["arrangement"]) for line in start_lines[trial]}) == 1
    invalid = [line for line in lines if line["event"] == "interval_ended" and "invalid" in line]
    assert len(invalid) == ATTEMPTS * len(strong)
    for line in invalid:
        arrangement = start_lines[line["trial"]][0]["arrangement"]
        assert arrangement[line["interval"] - 1] == "C"
        assert line["invalid"] == ["level_error_percent", "force_limit_n"]
        assert line["limiter_norm"] > 0


def test_tables_say_invalid_and_why_without_a_number(session: Path) -> None:
    trials, intervals = rows_of(session, "trials"), rows_of(session, "intervals")
    assert sum(row["outcome"] == "invalid" for row in trials) == 2 * ATTEMPTS
    assert {row["valid"] for row in trials if row["outcome"] == "invalid"} == {"false"}
    assert {row["invalid_reasons"] for row in intervals} == {"n/a", "level_error_percent force_limit_n"}
    assert not {"value_delivered", "force_share", "apparent_mass_kg", "pace_mps"} & {*intervals[0]}
    presented = Counter((row["trial"], row["attempt"]) for row in intervals)
    assert {(row["trial"], row["attempt"]): int(row["intervals"]) for row in trials} == presented
    assert len(set(presented.values())) == 2, "an attempt ends with the interval that was not delivered"


def test_journal_recordings_and_answers_agree(study: Path) -> None:
    session = StudyFolder(study).sessions()[0].path
    assert replay(session).proved
    reproduction = reproduce_session(session)
    assert (reproduction.differences, reproduction.followed) == (
        [],
        ["thicker: 4 of 4 levels are consistent with the answers"],
    )
    checked = verify_study(study, None)
    lost = (
        "2 of 4 trials were not delivered: the force was not as requested (limit 5 %) in 2, the force limit was reached"
    )
    assert (checked.errors, [warning.message for warning in checked.warnings]) == ((), [f"{lost} in 2"])


def test_a_session_ended_between_two_attempts_continues_to_the_same_answers(session: Path, protocol: Path) -> None:
    whole = lines_of(session)
    invalid = [index for index, line in enumerate(whole) if line.get("outcome") == "invalid"]
    content = (session / "journal.jsonl").read_bytes()
    cut(session, len(b"".join(content.splitlines(keepends=True)[: invalid[1] + 1])))
    resume_rehearsal(session, protocol=protocol)
    again = lines_of(session)
    assert outcomes(again) == outcomes(whole)
    assert answers(again) == answers(whole)
    assert reproduce_session(session).differences == []


INERTIA = """
format = 2
study.name = "inertia"
scene.scale = {scale}
liquids.goo = {{ density_kg_m3 = 1200, {liquid} }}
tasks.stir.kind = "follow"
stimuli.resistance = {{ vary = "{vary}", levels = [0.02, 0.6] }}
blocks.thicker = {{ stimulus = "resistance", design = "2ifc", method = "m" }}
methods.m = {{ kind = "questplus", trials = 2 }}
"""
GOO = ("viscosity_pa_s", 'viscosity_pa_s = 1.0, effects = ["unsteady_drag"]')
DAMPER = ("damping_nspm", 'drag = { law = "linear", damping_nspm = 3 }, effects = ["drag", "added_mass"]')


@pytest.mark.parametrize(("goo", "scale", "notes"), [(GOO, 3, 0), (GOO, 4, 1), (DAMPER, 2, 0)])
def test_check_notes_levels_of_a_liquid_with_inertia_that_a_rehearsal_does_not_deliver(
    goo: tuple[str, str], scale: int, notes: int, tmp_path: Path
) -> None:
    file = tmp_path / "inertia.toml"
    file.write_text(INERTIA.format(scale=scale, vary=goo[0], liquid=goo[1]), encoding="utf-8", newline="\n")
    message = " ".join(CliRunner().invoke(commands, ["check", str(file)]).output.split())
    assert (
        message.count("levels 0.6 and 0.02 cannot be rendered if the hand")
        == message.count("cannot be rendered")
        == notes
    )
    study = rehearse(file, participants=1, seed=1, results=tmp_path / "results")
    valid = {row["valid"] for row in rows_of(StudyFolder(study).sessions()[0].path, "trials")}
    assert valid == {"false" if notes else "true"}
