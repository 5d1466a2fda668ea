"""End to end: every protocol that ships is rehearsed, kept, and found again."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from study_app.analysis.export.export import export
from study_app.analysis.figures.plotting import plot
from study_app.errors import StoreError
from study_app.evaluation.replay import replay
from study_app.protocol.load import load, shipped
from study_app.protocol.orders.block_orders import orders_of
from study_app.protocol.orders.schedule import build_schedule, stream
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.blinded.blinding import open_or_draw_key, read_key
from study_app.store.blinded.sealing import opened
from study_app.store.folders import SessionFolder, StudyFolder
from study_app.store.journals import journal
from study_app.store.verification.verify_study import verify
from tests.compiled import needs_servo

pytestmark = [pytest.mark.slow, needs_servo]

CLOCK_COLUMNS = {"answered_at", "trial_started_at", "session_started_at", "session_ended_at"}


def table(folder: SessionFolder, study: str, name: str) -> list[dict[str, str]]:
    with folder.table(study, name).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def without_clock(rows: list[dict[str, str]]) -> list[dict[str, str]]:
    return [{name: cell for name, cell in row.items() if name not in CLOCK_COLUMNS} for row in rows]


FIXED = [name for name in shipped() if not load(name).stimuli]
"""Where answers choose levels, `validate` rehearses the whole program."""


def besides(*names: str) -> list[Any]:
    """Return the shipped protocols of fixed conditions; those other than ``names`` are of the nightly circle."""
    return [name if name in names else pytest.param(name, marks=pytest.mark.nightly) for name in FIXED]


@pytest.fixture(params=besides("demo", "rek2024"))
def rehearsed(request: pytest.FixtureRequest, rehearsal_of: Callable[[str], Path]) -> tuple[str, StudyFolder]:
    """Return each shipped protocol of fixed conditions with its rehearsed results."""
    return request.param, StudyFolder(rehearsal_of(request.param))


def test_every_response_is_there_once_on_the_scale_and_marked_as_simulated(rehearsed: tuple[str, StudyFolder]) -> None:
    name, folder = rehearsed
    protocol = load(name)
    for session in folder.sessions():
        rows = table(session, protocol.study.name, "responses")
        assert len(rows) == orders_of(protocol).answers
        assert len({(row["trial"], row["item"]) for row in rows}) == len(rows)
        assert {row["response"] for row in rows} <= set("1234567")
        assert {row["simulated"] for row in rows} == {"true"}


def test_sessions_are_complete_and_their_trials_valid(rehearsed: tuple[str, StudyFolder]) -> None:
    name, folder = rehearsed
    protocol = load(name)
    with folder.participants(protocol.study.name).open(newline="", encoding="utf-8") as file:
        people = list(csv.DictReader(file))
    assert [(row["participant"], row["status"], row["simulated"]) for row in people] == [
        ("P001", "completed", "true"),
        ("P002", "completed", "true"),
    ]
    for session in folder.sessions():
        trials = table(session, protocol.study.name, "trials")
        assert [row["code"] for row in trials] == [
            trial.code for trial in build_schedule(protocol, session.participant, 1).trials
        ]
        assert {row["outcome"] for row in trials} == {"complete"}
        assert {(row["samples_dropped"], row["overruns"]) for row in trials} == {("0", "0")}
        lines = opened(journal.read(session.journal), read_key(folder.path))
        measured = [line for line in lines if line["event"] == "trial_ended"]
        assert len(measured) == len(trials)
        assert {line["limiter_non_finite"] for line in measured} == {0}
        assert all(abs(line["delay_error_mean_ms"]) < 10 and line["frames"] > 100 for line in measured)


def test_a_rehearsed_study_is_sound_and_every_force_of_it_comes_out_again(rehearsed: tuple[str, StudyFolder]) -> None:
    _, folder = rehearsed
    assert verify(folder.path).sound
    assert verify(folder.path).warnings == ()
    for session in folder.sessions():
        found = replay(session.path)
        assert (found.differences, found.uncompared) == ((), ())
        assert found.recordings == len(journal_events(session, "trial_started"))


def journal_events(session: SessionFolder, name: str) -> list[dict[str, Any]]:
    return [line for line in journal.read(session.journal) if line["event"] == name]


def test_the_receipt_says_how_it_ended_and_what_ran_it(rehearsed: tuple[str, StudyFolder]) -> None:
    _, folder = rehearsed
    for session in folder.sessions():
        receipt = json.loads(session.receipt.read_text(encoding="utf-8"))
        assert (receipt["status"], receipt["simulated"], receipt["seed"]) == ("completed", True, 1)
        assert (receipt["device"]["name"], receipt["participant"]) == ("scripted", session.participant)


def test_answers_follow_what_was_seen(rehearsal_of: Callable[[str], Path]) -> None:
    """The longest delay seems more different from the baseline than none does, to every simulated participant."""
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


@pytest.mark.nightly
def test_a_rehearsed_study_can_be_exported_and_plotted(rehearsal_of: Callable[[str], Path], tmp_path: Path) -> None:
    folder = rehearsal_of("rek2024")
    written = [*export(folder, tmp_path / "tables"), *plot(folder, tmp_path / "figures")]
    assert len(written) >= 3
    assert all(path.stat().st_size > 0 for path in written)


def test_the_thesis_study_leaves_62_responses() -> None:
    assert orders_of(load("rek2024")).answers == 62


@pytest.mark.nightly
@pytest.mark.parametrize("rehearsed", besides("physical2", "slime"), indirect=True)
def test_the_same_call_into_another_folder_gives_the_same_tables_but_for_wall_clock_times(
    rehearsed: tuple[str, StudyFolder], tmp_path: Path
) -> None:
    """For protocols of format 1 `test_format_1` compares every table with those of the first release.

    One study is enough for P002, whose order differs from that of P001.
    """
    name, first = rehearsed
    study = load(name).study.name
    participants = 2 if name == "slime" else 1
    again = StudyFolder(rehearse(name, participants=participants, seed=1, results=tmp_path / "again"))
    for one, other in zip(first.sessions()[:participants], again.sessions(), strict=True):
        for kind in ("responses", "trials"):
            assert without_clock(table(one, study, kind)) == without_clock(table(other, study, kind))


@pytest.mark.parametrize("rehearsed", besides("demo"), indirect=True)
def test_another_seed_gives_another_study(rehearsed: tuple[str, StudyFolder], tmp_path: Path) -> None:
    name, first = rehearsed
    study = load(name).study.name
    other = StudyFolder(rehearse(name, participants=1, seed=2, results=tmp_path / "other"))
    one, two = (table(folder.sessions()[0], study, "responses") for folder in (first, other))
    assert [row["response"] for row in one] != [row["response"] for row in two]


def test_a_used_id_is_refused_and_nothing_is_touched(rehearsed: tuple[str, StudyFolder]) -> None:
    name, folder = rehearsed

    def everything() -> dict[str, bytes]:
        return {str(path): path.read_bytes() for path in sorted(folder.path.rglob("*")) if path.is_file()}

    before = everything()
    with pytest.raises(StoreError, match="P001 already has session 1"):
        rehearse(name, participants=3, seed=1, results=folder.path)
    assert everything() == before


def test_ids_are_checked_before_the_first_session_begins(tmp_path: Path) -> None:
    rehearse("demo", participants=1, seed=1, results=tmp_path / "demo")
    used = tmp_path / "demo" / "data" / "sub-P001"
    used.rename(used.with_name("sub-P002"))
    with pytest.raises(StoreError, match="P002 already has session 1"):
        rehearse("demo", participants=2, seed=1, results=tmp_path / "demo")
    assert not used.exists()


ODD = {
    "liquids.thin": "liquids.qaxilium",
    "liquids.thick": "liquids.vorbent",
    '"thin"': '"qaxilium"',
    '"thick"': '"vorbent"',
    "conditions.thin": "conditions.qaxilium",
    "conditions.thick": "conditions.vorbent",
    "conditions.prompt": "conditions.zwiftan",
    "conditions.late": "conditions.drovelm",
    '"prompt"': '"zwiftan"',
    '"late"': '"drovelm"',
    "delay_ms = 200": "delay_ms = 137.25",
    "density_kg_m3 = 1000": "density_kg_m3 = 1013.7",
    "density_kg_m3 = 1400": "density_kg_m3 = 1450.3",
    "length = 1700": "length = 17391",
    "scaling = 1700": "scaling = 17392",
}


def test_a_finished_folder_names_no_condition_liquid_parameter_or_delay(tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "protocols" / "demo.toml").read_text(encoding="utf-8")
    for plain, odd in ODD.items():
        text = text.replace(plain, odd)
    odd_file = tmp_path / "odd.toml"
    odd_file.write_text(text, encoding="utf-8")
    assert {condition.delay_ms for condition in load(odd_file).conditions.values()} == {0, 137.25}
    folder = rehearse(odd_file, participants=1, seed=3, results=tmp_path / "results")
    names = ("qaxilium", "vorbent", "zwiftan", "drovelm")
    secrets = (*names, "137.25", "0.13725", "137250000", "1013.7", "1450.3", "17391", "17392")
    searched = {
        secret: re.compile(rf"(?<![0-9A-Za-z]){re.escape(secret)}(?![0-9A-Za-z])".encode()) for secret in secrets
    }
    found = [
        (path.name, secret)
        for path in folder.rglob("*")
        if path.is_file()
        for secret, pattern in searched.items()
        if pattern.search(path.read_bytes())
    ]
    assert found == []


KILLED = """
import sys
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.sessions.open_session import SessionStore

kept = SessionStore.append

def append(self, event, **fields):
    kept(self, event, **fields)
    print(event, fields.get("trial", 0), fields.get("item", "-"), fields.get("value", "-"), flush=True)

SessionStore.append = append
rehearse("rek2024", participants=1, seed=1, results=sys.argv[1])
"""


@pytest.mark.nightly
def test_a_kill_during_part_2_leaves_every_earlier_answer_readable(tmp_path: Path) -> None:
    """What was told as kept before the kill is in the journal, in the table where its page was confirmed."""
    child = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(tmp_path / "rek2024")],
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[2],
    )
    told: list[list[str]] = []
    confirmed = 0
    assert child.stdout is not None
    with child, child.stdout:
        for line in child.stdout:
            told.append(line.split())
            confirmed += told[-1][0] == "responses"
            if confirmed >= 6 and told[-1][0] == "choice":  # three liquids, three delays, and into the fourth
                os.kill(child.pid, signal.SIGKILL)
                break
    assert child.returncode == -signal.SIGKILL
    (session,) = StudyFolder(tmp_path / "rek2024").sessions()
    lines = journal.read(session.journal)
    choices: list[list[Any]] = [
        ["choice", str(line["trial"]), line["item"], str(line["value"])] for line in lines if line["event"] == "choice"
    ]
    expected = [entry for entry in told if entry[0] == "choice"]
    assert choices[: len(expected)] == expected
    rows = table(session, "rek2024", "responses")
    assert len(rows) >= 3 * 9 + 2 * 5  # the table may be one page behind the journal, never the journal
    answered = {(row["trial"], row["item"]): row["response"] for row in rows}
    last = {(trial, item): value for _, trial, item, value in choices}
    assert all(last[key] == value for key, value in answered.items())
