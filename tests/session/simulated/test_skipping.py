"""A session that begins at a later step: exactly there, under the preview's key, with levels that answers led to."""

from datetime import datetime
from pathlib import Path

import pytest

from study_app.errors import SessionError
from study_app.protocol.load import parse
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Trial
from study_app.protocol.presented.presentation import next_level
from study_app.protocol.randomization.streams import Key
from study_app.protocol.source.files import source_bytes
from study_app.session.resume import Start, resume_at
from study_app.session.simulated.answers_only import begin_session_at_step
from study_app.session.transitions.page_builder import preview
from study_app.store.blinded.blinding import read_key
from study_app.store.files.folders import locate_session
from study_app.store.journals import journal
from study_app.store.sessions.begin import SessionStart

pytestmark = pytest.mark.slow


def start_at(tmp_path: Path, study: Protocol, source: bytes, step: int, *, exactly: bool = True) -> Start:
    start = SessionStart(
        "P001",
        seed=4,
        operator="",
        language=study.study.languages[0],
        device={"name": "scripted"},
        screens={},
        simulated=True,
        pilot=True,
    )
    study_folder, session = locate_session(
        begin_session_at_step(tmp_path / study.study.name, study, source, start, step)
    )
    state, key = preview(study, 4), read_key(study_folder.path)
    assert (key.codes, key.nonce) == (state.codes, state.secret)
    lines = journal.read(session.journal)
    assert datetime.fromisoformat(lines[-1].at) <= datetime.now().astimezone(), "what was skipped lies in the past"
    return resume_at(state.protocol, state.schedule, lines, key, exactly=exactly)


@pytest.mark.parametrize(("name", "step"), [("rek2024", 0), ("rek2024", 9), ("viscosityjnd", 60), ("delayjnd", 30)])
def test_a_session_can_begin_at_any_step(tmp_path: Path, name: str, step: int) -> None:
    source = source_bytes(name)
    study = parse(source, name)
    session = start_at(tmp_path, study, source, step)
    assert session.step == step
    pages = preview(study, 4)
    trial = pages.schedule.steps[step]
    if session.heard:
        assert isinstance(trial, Trial)
        key = Key(pages.codes, pages.secret)
        due, first = (next_level(pages.protocol, key, pages.schedule, trial, heard) for heard in (session.heard, ()))
        assert due is not None
        assert first is not None
        assert name != "viscosityjnd" or due.level != first.level  # the track has followed the simulated answers


def test_a_study_that_resumes_by_blocks_can_begin_within_one(tmp_path: Path) -> None:
    source = source_bytes("rek2024").replace(b'resume = "trial"', b'resume = "block"')
    study = parse(source, "rek2024")
    steps = preview(study, 4).schedule.steps
    third = next(at for at, step in enumerate(steps) if isinstance(step, Trial) and step.index == 3)
    assert start_at(tmp_path / "exactly", study, source, third).step == third
    assert start_at(tmp_path / "by-blocks", study, source, third, exactly=False).step < third


def test_levels_of_a_block_that_is_presented_again_do_not_follow_its_earlier_answers(tmp_path: Path) -> None:
    source = source_bytes("viscosityjnd").replace(b"[study]", b'[study]\nresume = "block"', 1)
    study = parse(source, "viscosityjnd")
    exactly, again = (start_at(tmp_path / f"{how}", study, source, 60, exactly=how) for how in (True, False))
    first = preview(study, 4).schedule.steps[again.step]
    assert isinstance(first, Trial)
    assert first.index == 1
    assert max(result.trial for result in exactly.heard) > first.number
    assert all(result.trial < first.number for result in again.heard)


def test_a_step_behind_a_criterion_that_is_missed_is_not_reached(tmp_path: Path) -> None:
    source = source_bytes("viscosityjnd")
    for old, new in (
        (b"until = { right = 8, of = 10 }", b'until = { right = 10, of = 10, missed = "end" }'),
        (b"levels = [0.5] ", b"levels = [0.02]"),
    ):
        assert old in source
        source = source.replace(old, new)
    study = parse(source, "viscosityjnd")
    with pytest.raises(SessionError, match="criterion"):
        start_at(tmp_path, study, source, 60)
