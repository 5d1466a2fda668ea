"""End to end: every protocol that ships is rehearsed, kept, and found again."""

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from study_app.protocol.load import load
from study_app.protocol.orders.block_orders import orders_of
from study_app.protocol.orders.schedule import build_schedule, stream
from study_app.protocol.source.files import shipped
from study_app.session.replay import replay
from study_app.store.blinded.blinding import open_events, open_or_draw_key, read_key
from study_app.store.files.folders import SessionFolder, StudyFolder
from study_app.store.journals import journal
from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo
from tests.journal_lines import raw

pytestmark = [pytest.mark.slow, needs_servo]


def table(folder: SessionFolder, study: str, name: str) -> list[dict[str, str]]:
    with folder.table(study, name).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


FIXED = [name for name in shipped() if not load(name).stimuli]
"""Where answers choose levels, `validate` rehearses the whole program."""


def besides(*names: str) -> list[Any]:
    """Return the shipped protocols of fixed conditions; those not in ``names`` are nightly."""
    return [name if name in names else pytest.param(name, marks=pytest.mark.nightly) for name in FIXED]


@pytest.fixture(params=besides("demo", "rek2024"))
def rehearsed(request: pytest.FixtureRequest, rehearsal_of: Callable[[str], Path]) -> tuple[str, StudyFolder]:
    """Return each shipped protocol of fixed conditions with its rehearsed results."""
    return request.param, StudyFolder(rehearsal_of(request.param))


def test_sessions_are_complete_and_every_response_is_there_once(rehearsed: tuple[str, StudyFolder]) -> None:
    name, folder = rehearsed
    protocol = load(name)
    with folder.participants(protocol.study.name).open(newline="", encoding="utf-8") as file:
        people = [(row["participant"], row["status"], row["simulated"]) for row in csv.DictReader(file)]
    assert people == [("P001", "completed", "true"), ("P002", "completed", "true")]
    for session in folder.sessions():
        rows = table(session, protocol.study.name, "responses")
        assert len(rows) == len({(row["trial"], row["item"]) for row in rows}) == orders_of(protocol).answers
        assert {row["response"] for row in rows} <= set("1234567")
        assert {row["simulated"] for row in rows} == {"true"}
        trials = table(session, protocol.study.name, "trials")
        schedule = build_schedule(protocol, session.participant, 1)
        assert [row["code"] for row in trials] == [trial.code for trial in schedule.trials]
        assert {row["outcome"] for row in trials} == {"complete"}
        assert {(row["samples_dropped"], row["overruns"]) for row in trials} == {("0", "0")}
        lines = raw(open_events(journal.read(session.journal), read_key(folder.path)))
        measured = [line for line in lines if line["event"] == "trial_ended"]
        assert len(measured) == len(trials)
        assert {line["limiter_non_finite"] for line in measured} == {0}
        assert all(abs(line["delay_error_mean_ms"]) < 10 and line["frames"] > 100 for line in measured)
        receipt = json.loads(session.receipt.read_text(encoding="utf-8"))
        assert (receipt["status"], receipt["simulated"], receipt["seed"]) == ("completed", True, 1)
        assert (receipt["device"]["name"], receipt["participant"]) == ("scripted", session.participant)


def test_a_rehearsed_study_is_sound_and_its_forces_are_replayed(rehearsed: tuple[str, StudyFolder]) -> None:
    _, folder = rehearsed
    assert verify_study(folder.path).is_sound
    assert verify_study(folder.path).warnings == ()
    for session in folder.sessions():
        replay_result = replay(session.path)
        assert (replay_result.differences, replay_result.uncompared) == ((), ())
        assert replay_result.recordings == len(journal_events(session, "trial_started"))


def journal_events(session: SessionFolder, name: str) -> list[dict[str, Any]]:
    return [line for line in raw(journal.read(session.journal)) if line["event"] == name]


def test_answers_follow_the_simulated_delay(rehearsal_of: Callable[[str], Path]) -> None:
    """Every simulated participant rates the longest delay as more different from the baseline than no delay."""
    folder = StudyFolder(rehearsal_of("rek2024"))
    codes = open_or_draw_key(folder.path, load("rek2024"), stream(1, "blinding").random).codes["delays"]
    of = {condition: code for code, condition in codes.items()}
    for session in folder.sessions():
        different = {
            row["code"]: int(row["response"])
            for row in table(session, "rek2024", "responses")
            if row["item"] == "different"
        }
        assert different[of["delay_200"]] > different[of["delay_0"]]
