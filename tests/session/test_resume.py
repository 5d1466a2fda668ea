"""Where an interrupted session goes on, for every line its journal may end with, and what it then presents."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner

from study_app.app.session import entry
from study_app.cli import commands
from study_app.errors import SessionError
from study_app.protocol.load import parse
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import PageStep, Schedule, Trial, build_schedule
from study_app.protocol.source.files import protocol_hash, source_bytes
from study_app.session.pages import PausePage
from study_app.session.resume import REHEARSED_SCREENS, begun_schedule, find_protocol, is_rehearsal, resume_at
from study_app.session.start import NewSession, check, open_store, resumed
from study_app.session.transitions.events import Begin, FadeIn, ResumeRequested, ShowPage, StartTrial, Write
from study_app.session.transitions.state import Phase, SessionState
from study_app.session.transitions.table import advance, open_session
from study_app.store.journals import journal
from study_app.store.sessions.open_session import SessionStore
from study_app.store.verification.reproduction import reproduced
from study_app.store.verification.verify_study import verify
from tests.journal_lines import event_from, event_of
from tests.session import small

STARTED = {"event": "session_started", "t_s": 0.0}


def study(resume: str = "trial") -> Protocol:
    return Protocol.model_validate(small.TABLES | {"study": small.TABLES["study"] | {"resume": resume}})


def told(until: int) -> tuple[SessionState, list[dict[str, Any]]]:
    """Walk through a whole session; return the state and the journal when ``until`` lines were written, or all."""
    state = small.opened()
    lines: list[dict[str, Any]] = [STARTED]
    at_s = 0.0
    while state.phase is not Phase.COMPLETE:
        state, commands = advance(state, small.next_event(state, at_s))
        at_s += 1.0
        for command in commands:
            if isinstance(command, Write):
                lines.append({"event": command.line.event, "t_s": at_s, **command.line.fields()})
                if len(lines) == until:
                    return state, lines
    return state, lines


LINES = len(told(-1)[1])


def opened_again(resume: str, lines: list[dict[str, Any]]) -> tuple[SessionState, tuple[Any, ...]]:
    """Resume and begin; return the state and the commands."""
    plan = small.opened().plan
    protocol = study(resume)
    start = resume_at(protocol, plan.schedule, map(event_from, lines))
    state = open_session(protocol, plan.schedule, plan.key, "en", start)
    return advance(state, Begin(100.0))


def begun(resume: str, lines: list[dict[str, Any]]) -> tuple[SessionState, tuple[Any, ...]]:
    """Resume, begin, and be ready where a trial waits for that; return the state and the commands since."""
    state, commands = opened_again(resume, lines)
    return advance(state, ResumeRequested(101.0, "participant")) if state.phase is Phase.PAUSED else (state, commands)


@pytest.mark.parametrize("resume", ["trial", "block"])
@pytest.mark.parametrize("count", range(1, LINES + 1))
def test_no_trial_begins_before_somebody_is_ready_for_it(count: int, resume: str) -> None:
    _, lines = told(count)
    state, commands = opened_again(resume, lines)
    assert not any(isinstance(command, StartTrial | FadeIn) for command in commands)
    assert isinstance(commands[-1], ShowPage)
    if isinstance(state.step, Trial):
        assert commands[-1] == ShowPage(PausePage(force_off=False))
        assert commands[0] == Write(event_of("paused", by="program"))
        state, commands = begun(resume, lines)
        (start,) = [command for command in commands if isinstance(command, StartTrial)]
        assert (start.trial, start.attempt, state.attempt) == (state.trial.number, state.attempt, start.attempt)
        assert start.attempt >= 1
    else:
        assert state.phase in {Phase.READING, Phase.COMPLETE}


@pytest.mark.parametrize("count", range(1, LINES + 1))
def test_whatever_the_last_line_nothing_confirmed_is_asked_again_and_nothing_is_passed_over(count: int) -> None:
    _, lines = told(count)
    state, commands = begun("trial", lines)
    steps = state.plan.schedule.steps
    left = {line["page"] for line in lines if line["event"] == "page_left"}
    answered = {line["trial"] for line in lines if line["event"] == "responses"}
    silent = {step.number for step in steps if isinstance(step, Trial) and step.block in {"practice", "baseline"}}
    done = {line["trial"] for line in lines if line["event"] == "trial_ended"} & silent
    over = [step.page_id in left if isinstance(step, PageStep) else step.number in answered | done for step in steps]
    assert state.index == over.index(False) if False in over else state.phase is Phase.COMPLETE
    started = [command for command in commands if isinstance(command, StartTrial)]
    before = [line["trial"] for line in lines if line["event"] == "trial_started"]
    for command in started:
        assert command.attempt == before.count(command.trial) + 1
    assert isinstance(commands[-1], ShowPage)


@pytest.mark.parametrize("count", range(1, LINES + 1))
def test_by_block_it_goes_back_to_the_block_that_was_under_way(count: int) -> None:
    _, lines = told(count)
    by_trial, _ = begun("trial", lines)
    by_block, commands = begun("block", lines)
    step = by_trial.step
    if not isinstance(step, Trial):
        assert by_block.index == by_trial.index
        return
    first = by_block.step
    assert isinstance(first, Trial)
    assert (first.block, first.index) == (step.block, 1)
    before = [line["trial"] for line in lines if line["event"] == "trial_started"]
    (start,) = [command for command in commands if isinstance(command, StartTrial)]
    assert start.attempt == before.count(first.number) + 1
    assert by_block.plan.schedule == by_trial.plan.schedule


def test_later_trials_of_a_block_that_is_presented_again_count_their_attempts_too() -> None:
    _, lines = told(-1)
    cut = max(n for n, line in enumerate(lines) if line["event"] == "choice" and line["trial"] == 3)
    state, _ = begun("block", lines[:cut])
    state = small.walk(state, Phase.TASK)
    assert (state.trial.number, state.attempt) == (3, 2)
    state = small.walk(state, Phase.TASK)
    assert (state.trial.number, state.attempt) == (4, 1)


def test_a_session_that_goes_on_by_block_goes_on_again_after_the_next_interruption() -> None:
    _, lines = told(-1)
    cut = max(n for n, line in enumerate(lines) if line["event"] == "choice" and line["trial"] == 3)
    lines = [*lines[:cut], {"event": "session_resumed", "t_s": 100.0}]
    protocol, presented = small.protocol(), {}
    again = Protocol.model_validate(small.TABLES | {"study": small.TABLES["study"] | {"resume": "block"}})
    schedule = build_schedule(again, "P001", 1)
    for trial in (2, 3):
        which = {"t_s": 101.0, "trial": trial, "attempt": 2}
        lines.append({"event": "trial_started", **which})
        presented[trial] = 2
        start = resume_at(again, schedule, map(event_from, lines))
        first = schedule.steps[start.step]
        assert isinstance(first, Trial)
        assert (first.block, first.index) == ("feeling", 1)
        assert {number: start.presented[number] for number in presented} == presented
        by_trial = resume_at(protocol, schedule, map(event_from, lines))
        here = schedule.steps[by_trial.step]
        assert isinstance(here, Trial)
        assert here.number == trial
        lines.append({"event": "trial_ended", **which, "outcome": "complete"})
        lines.append({"event": "responses", **which, "items": []})


def test_a_break_within_a_block_belongs_to_it() -> None:
    tables = small.TABLES | {
        "pages": small.TABLES["pages"] | {"rest": {"kind": "break", "title": "Rest", "body": "Breathe."}},
        "study": small.TABLES["study"] | {"resume": "block"},
    }
    tables["blocks"] = tables["blocks"] | {
        "feeling": tables["blocks"]["feeling"] | {"break_every": 1, "break_page": "rest"}
    }
    protocol = Protocol.model_validate(tables)
    schedule = build_schedule(protocol, "P001", 1)
    pause = next(n for n, step in enumerate(schedule.steps) if step == PageStep("rest"))
    lines: list[dict[str, Any]] = [STARTED]
    for step in schedule.steps[:pause]:
        if isinstance(step, PageStep):
            lines += [{"event": name, "t_s": 1.0, "page": step.page_id} for name in ("page_shown", "page_left")]
        else:
            which = {"t_s": 1.0, "trial": step.number, "attempt": 1}
            lines.append({"event": "trial_started", **which})
            lines.append({"event": "trial_ended", **which, "outcome": "complete"})
            lines += [{"event": "responses", **which, "items": []}] if step.block == "feeling" else []
    lines.append({"event": "page_shown", "t_s": 2.0, "page": "rest"})
    start = resume_at(protocol, schedule, map(event_from, lines))
    first = schedule.steps[start.step]
    assert isinstance(first, Trial)
    assert (first.block, first.index) == ("feeling", 1)


def test_a_journal_of_another_order_is_refused() -> None:
    plan = small.opened().plan
    lines = [event_from(STARTED), event_of("trial_started", t_s=1.0, trial=3, attempt=1)]
    with pytest.raises(SessionError, match="does not follow the order"):
        resume_at(study(), plan.schedule, lines)


def began(study: str, protocol_hash: str = "0") -> Any:
    return event_of("session_started", study=study, protocol_hash=protocol_hash)


def test_the_protocol_is_found_by_its_hash_then_by_its_study(tmp_path: Path) -> None:
    changed = tmp_path / "mine.toml"
    changed.write_bytes(source_bytes("demo") + b"\n# changed\n")
    exact = began("demo", protocol_hash(changed.read_bytes()))
    assert find_protocol(exact, ["demo", str(changed)]) == str(changed)
    assert find_protocol(began("demo"), ["rek2024", "demo"]) == "demo"
    with pytest.raises(SessionError, match="--protocol"):
        find_protocol(began("gone"), ["demo"])


@pytest.mark.slow
def test_a_protocol_at_hand_that_cannot_be_read_is_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = tmp_path / "protocols"
    (own / "a_folder.toml").mkdir(parents=True)
    (own / "latin.toml").write_bytes(b"\xff\xfe")
    (own / "broken.toml").write_bytes(b"[study")
    (own / "mine.toml").write_bytes(source_bytes("demo") + b"\n# changed\n")
    monkeypatch.chdir(tmp_path)
    assert find_protocol(began("demo", protocol_hash((own / "mine.toml").read_bytes()))) == "mine"
    assert find_protocol(began("demo")) in ("mine", "demo")
    with pytest.raises(SessionError, match="--protocol"):
        find_protocol(began("gone"))


def test_a_receipt_without_screens_is_of_no_rehearsal() -> None:
    assert is_rehearsal({"screens": dict(REHEARSED_SCREENS)})
    assert not is_rehearsal({"screens": {}})
    assert not is_rehearsal({})


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
        store.append(event_of("trial_started", trial=trial.number, attempt=1, **fields))
        store.append(event_of("trial_ended", trial=trial.number, attempt=1, outcome="complete"))
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
