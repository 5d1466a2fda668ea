"""Who replaces a participant takes that participant's row of every square: begun, resumed and reproduced so."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner

from study_app.app.session import entry
from study_app.cli import commands
from study_app.errors import SessionError
from study_app.protocol.load import parse, source_bytes
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Schedule, build_schedule
from study_app.session.request import NewSession, resumed
from study_app.session.resume import begun_schedule
from study_app.session.start import check, open_store
from study_app.store.journals import journal
from study_app.store.sessions.open_session import SessionStore
from study_app.store.verification.reproduction import reproduced
from study_app.store.verification.verify_study import verify

SEED = 5
RIG: Any = SimpleNamespace(described={"name": "mouse"}, servo=SimpleNamespace(now_ns=lambda: 0))


@pytest.fixture
def square(tmp_path: Path) -> Path:
    """Return the demo with its blocks in the orders of Latin squares."""
    path = tmp_path / "square.toml"
    text = source_bytes("demo").decode()
    assert text.count('\norder = "shuffled"') == 2
    path.write_text(text.replace('\norder = "shuffled"', '\norder = "latin"'))
    return path


def chosen_for(path: Path, participant: str, row_of: str | None) -> NewSession:
    results = path.parent / "results"
    return NewSession(
        str(path), participant, 1, SEED, "AK", "en", "mouse", True, None, results, recordings=False, row_of=row_of
    )


def codes(schedule: Schedule) -> list[str]:
    return [trial.code for trial in schedule.trials]


def present(store: SessionStore, schedule: Schedule) -> None:
    """Present every trial of a schedule and end the session."""
    for trial in schedule.trials:
        fields = {name: getattr(trial, name) for name in ("block", "phase", "part", "index", "of", "code")}
        store.append("trial_started", trial=trial.number, attempt=1, **fields)
        store.append("trial_ended", trial=trial.number, attempt=1, outcome="complete")
    store.finish("completed")


def run_one(path: Path, participant: str, row_of: str | None) -> tuple[Protocol, SessionStore]:
    source = path.read_bytes()
    protocol = parse(source, str(path))
    chosen = chosen_for(path, participant, row_of)
    check(chosen, protocol)
    return protocol, open_store(chosen, protocol, source, RIG, {})


def test_row_of_another_participant_gives_that_participants_order(square: Path) -> None:
    protocol = parse(square.read_bytes(), "square.toml")
    rows = {who: codes(build_schedule(protocol, who, SEED)) for who in ("P001", "P002")}
    assert rows["P001"] != rows["P002"]
    for who, row in rows.items():
        assert codes(build_schedule(protocol, "P025", SEED, who)) == row
    assert codes(build_schedule(protocol, "P025", SEED, "2")) == rows["P002"]


@pytest.mark.parametrize("row_of", ["P001", "P002"])
def test_receipt_keeps_the_row_and_reproduce_uses_it(square: Path, row_of: str) -> None:
    protocol, store = run_one(square, "P025", row_of)
    present(store, build_schedule(protocol, "P025", SEED, row_of))
    path = store.folder.receipt
    held = json.loads(path.read_text())
    assert held["row_of"] == row_of
    assert reproduced(store.folder.path).differences == []
    assert verify(square.parent / "results").errors == ()
    path.write_text(json.dumps(held | {"row_of": "P002" if row_of == "P001" else "P001"}))
    assert any("code" in line for line in reproduced(store.folder.path).differences)
    assert any("row_of: differ from the journal" in str(one) for one in verify(square.parent / "results").errors)


def test_resumed_session_keeps_the_row(square: Path) -> None:
    protocol, store = run_one(square, "P025", "P002")
    store.close()
    chosen = resumed(store.folder.path, protocol=str(square))
    assert (chosen.participant, chosen.row_of) == ("P025", "P002")
    planned = build_schedule(protocol, "P025", SEED, "P002")
    assert chosen.schedule(protocol) == begun_schedule(protocol, journal.read(store.folder.journal)[0]) == planned
    assert planned != build_schedule(protocol, "P025", SEED)


def test_session_without_a_row_of_another_has_no_such_key(square: Path) -> None:
    _, store = run_one(square, "P025", None)
    store.close()
    assert "row_of" not in json.loads(store.folder.receipt.read_text())
    assert resumed(store.folder.path, protocol=str(square)).row_of is None


@pytest.mark.parametrize(
    ("source", "row_of", "message"),
    [
        ("demo", "P002", "no block of demo has a Williams or Latin order"),
        ("square", "anna", "rows are assigned by the number in a participant's id"),
        ("square", "P 2", "rows are assigned by the number in a participant's id"),
    ],
)
def test_row_that_decides_nothing_is_refused(square: Path, source: str, row_of: str, message: str) -> None:
    text = source_bytes("demo") if source == "demo" else square.read_bytes()
    with pytest.raises(SessionError, match=message):
        check(chosen_for(square, "P025", row_of), parse(text, "file.toml"))


def test_run_takes_the_row_of_a_participant(square: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[NewSession] = []
    monkeypatch.setattr(entry, "run_session", lambda chosen, _progress: asked.append(chosen) or 0)
    words = ["run", str(square), "--participant", "P025", "--row-of", "P002", "--results", str(square.parent / "r")]
    assert CliRunner().invoke(commands, words).exit_code == 0
    assert [one.row_of for one in asked] == ["P002"]
