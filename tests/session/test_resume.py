"""Where an interrupted session goes on, for every line its journal may end with, and what it then presents."""

from pathlib import Path
from typing import Any

import pytest

from study_app.errors import SessionError
from study_app.protocol.load import protocol_hash, source_bytes
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import PageStep, Trial, build_schedule
from study_app.session.pages import PausePage
from study_app.session.resume import REHEARSED_SCREENS, find_protocol, is_rehearsal, resume_at
from study_app.session.transitions.commands import FadeIn, ShowPage, StartTrial, Write
from study_app.session.transitions.events import Begin, ResumeAsked
from study_app.session.transitions.state import Phase, SessionState
from study_app.session.transitions.table import advance, open_session
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
                lines.append({"event": command.event, "t_s": at_s, **command.fields})
                if len(lines) == until:
                    return state, lines
    return state, lines


LINES = len(told(-1)[1])


def opened_again(resume: str, lines: list[dict[str, Any]]) -> tuple[SessionState, tuple[Any, ...]]:
    """Resume and begin; return the state and the commands."""
    plan = small.opened().plan
    protocol = study(resume)
    start = resume_at(protocol, plan.schedule, lines)
    state = open_session(protocol, plan.schedule, plan.key, "en", start)
    return advance(state, Begin(100.0))


def begun(resume: str, lines: list[dict[str, Any]]) -> tuple[SessionState, tuple[Any, ...]]:
    """Resume, begin, and be ready where a trial waits for that; return the state and the commands since."""
    state, commands = opened_again(resume, lines)
    return advance(state, ResumeAsked(101.0, "participant")) if state.phase is Phase.PAUSED else (state, commands)


@pytest.mark.parametrize("resume", ["trial", "block"])
@pytest.mark.parametrize("count", range(1, LINES + 1))
def test_no_trial_begins_before_somebody_is_ready_for_it(count: int, resume: str) -> None:
    _, lines = told(count)
    state, commands = opened_again(resume, lines)
    assert not any(isinstance(command, StartTrial | FadeIn) for command in commands)
    assert isinstance(commands[-1], ShowPage)
    if isinstance(state.step, Trial):
        assert commands[-1] == ShowPage(PausePage(force_off=False))
        assert commands[0] == Write("paused", {"by": "program"})
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
        start = resume_at(again, schedule, lines)
        first = schedule.steps[start.step]
        assert isinstance(first, Trial)
        assert (first.block, first.index) == ("feeling", 1)
        assert {number: start.presented[number] for number in presented} == presented
        by_trial = resume_at(protocol, schedule, lines)
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
    start = resume_at(protocol, schedule, lines)
    first = schedule.steps[start.step]
    assert isinstance(first, Trial)
    assert (first.block, first.index) == ("feeling", 1)


def test_a_journal_of_another_order_is_refused() -> None:
    plan = small.opened().plan
    lines = [STARTED, {"event": "trial_started", "t_s": 1.0, "trial": 3, "attempt": 1}]
    with pytest.raises(SessionError, match="does not follow the order"):
        resume_at(study(), plan.schedule, lines)


def test_the_protocol_is_found_by_its_hash_then_by_its_study(tmp_path: Path) -> None:
    changed = tmp_path / "mine.toml"
    changed.write_bytes(source_bytes("demo") + b"\n# changed\n")
    exact = {"study": "demo", "protocol_hash": protocol_hash(changed.read_bytes())}
    assert find_protocol(exact, ["demo", str(changed)]) == str(changed)
    assert find_protocol(exact | {"protocol_hash": "0"}, ["rek2024", "demo"]) == "demo"
    with pytest.raises(SessionError, match="--protocol"):
        find_protocol({"study": "gone", "protocol_hash": "0"}, ["demo"])


@pytest.mark.slow
def test_a_protocol_at_hand_that_cannot_be_read_is_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = tmp_path / "protocols"
    (own / "a_folder.toml").mkdir(parents=True)
    (own / "latin.toml").write_bytes(b"\xff\xfe")
    (own / "broken.toml").write_bytes(b"[study")
    (own / "mine.toml").write_bytes(source_bytes("demo") + b"\n# changed\n")
    monkeypatch.chdir(tmp_path)
    assert find_protocol({"study": "demo", "protocol_hash": protocol_hash((own / "mine.toml").read_bytes())}) == "mine"
    assert find_protocol({"study": "demo", "protocol_hash": "0"}) in ("mine", "demo")
    with pytest.raises(SessionError, match="--protocol"):
        find_protocol({"study": "gone", "protocol_hash": "0"})


def test_a_receipt_without_screens_is_of_no_rehearsal() -> None:
    assert is_rehearsal({"screens": dict(REHEARSED_SCREENS)})
    assert not is_rehearsal({"screens": {}})
    assert not is_rehearsal({})
