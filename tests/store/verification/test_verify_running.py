"""A study folder that programs write to is not called damaged: many looks beside real ones."""

import multiprocessing
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.sessions.begin import SessionStart, begin
from study_app.store.sessions.open_session import SessionStore
from study_app.store.verification.verify_study import verify
from tests.faults.support import short
from tests.platforms import needs_fork
from tests.store.conftest import SOURCE, choose, study_tables, summary_of_trial

pytestmark = pytest.mark.slow

ENOUGH = 1  # looks
MOST = 100  # sessions of a program, which ends after as many looks as are enough


def hold_sessions(study: Path, first: int, enough: Any) -> None:
    """Begin, hold and end short sessions, one after the other, until it was looked at them often enough."""
    protocol = Protocol.model_validate(study_tables())
    for number in range(first, first + MOST):
        if enough.is_set():
            break
        person = f"P{number:03d}"
        who: dict[str, Any] = {"seed": 11, "operator": "AB", "language": "en", "simulated": True}
        store = begin(study, protocol, SOURCE, SessionStart(person, device={"name": "scripted"}, screens={}, **who))
        for trial in build_schedule(protocol, person, 11).trials:
            which = {"trial": trial.number, "attempt": 1}
            told = {name: getattr(trial, name) for name in ("block", "phase", "part", "index", "of", "code")}
            store.append("trial_started", **which, **told)
            store.append("trial_ended", **which, outcome="complete", **summary_of_trial())
            store.write_tables()
            times = {"onset_s": 1.5, "first_s": 2.25, "last_s": 2.25, "changes": 0}
            items = [{"item": it, "number": at, "value": 4, **times} for at, it in enumerate(trial.items, start=1)]
            if items:
                choose(store, trial.number, items)
                store.append("responses", **which, items=items)
                store.write_tables()
        store.finish("completed")


def rehearse_short(study: Path, protocol: Path, _enough: Any) -> None:
    rehearse(protocol, participants=1, seed=7, results=study)


def look_beside(study: Path, *programs: tuple[Callable[..., None], tuple[Any, ...]]) -> tuple[int, int, list[str]]:
    """Verify until the programs have ended; return how often, how often a session ran, and every error."""
    forking = multiprocessing.get_context("fork")
    enough = forking.Event()
    started = [forking.Process(target=target, args=(study, *given, enough)) for target, given in programs]
    for program in started:
        program.start()
    looks = running = 0
    errors: list[str] = []
    while any(program.is_alive() for program in started):
        if (study / "dataset_description.json").exists():
            findings = verify(study)
            looks += 1
            running += findings.running > 0
            if running >= ENOUGH:
                enough.set()
            errors += [*map(str, findings.errors), *map(str, findings.psychds.errors)]
    assert [program.exitcode for program in started] == [0] * len(started)
    return looks, running, errors


@pytest.mark.nightly
@needs_fork
def test_sessions_that_are_begun_and_ended_beside_it_are_never_called_unsound(tmp_path: Path) -> None:
    """Two programs write to one study, with all that begins and ends a session."""
    study = tmp_path / "study"
    _, running, errors = look_beside(study, (hold_sessions, (101,)), (hold_sessions, (1,)))
    assert errors == []
    assert running >= ENOUGH
    findings = verify(study)
    assert (findings.sound, findings.running) == (True, 0)


@needs_fork
def test_a_rehearsal_with_recordings_beside_it_is_never_called_unsound(tmp_path: Path) -> None:
    _, running, errors = look_beside(tmp_path / "study", (rehearse_short, (short.write(tmp_path),)))
    assert errors == []
    assert running > 0
    assert verify(tmp_path / "study").sound


def test_a_damaged_line_of_a_running_session_is_an_error(tmp_path: Path, start: Callable[..., SessionStore]) -> None:
    with start() as store:
        store.append("note", kind="note", text="one")
        store.append("note", kind="note", text="two")
        path = store.folder.journal
        path.write_bytes(path.read_bytes().replace(b'"one"', b'"six"'))
        findings = verify(tmp_path / "study")
        assert findings.running == 1
        assert ["which was changed" in str(error) for error in findings.errors] == [True]
