"""Whatever study `check` accepts: held, cut off anywhere, resumed, verified, unblinded, exported and reported."""

import random
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest

from study_app.analysis.export_study import export
from study_app.analysis.report.write_report import report
from study_app.errors import AnalysisError
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.session.resume import REHEARSED_SCREENS, resume_at
from study_app.session.simulated.answers_only import DEVICE, Answering, SimulatedStore, SimulatedTime, rehearse_answers
from study_app.session.simulated.rehearsal import ConditionFeatures
from study_app.session.transitions.table import initial_state
from study_app.store.blinded.allocation import session_protocol
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.journals.journal import SessionClock
from study_app.store.session_progress.progress import progress_of
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.recovery import reopen_store
from study_app.store.unblinding import unblind_folder
from study_app.store.verification.reproduction import reproduce_session
from study_app.store.verification.whole_study import verify_study
from tests.end_to_end.drawn_studies import drawn
from tests.studies import begun, made_up

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]

STUDIES = 200


class CutOffError(Exception):
    """The program of a session ended."""


class CutOff:
    """Takes the lines of a session until its program ends."""

    def __init__(self, store: SessionStore, lines: int) -> None:
        self._store = store
        self._left = lines

    def append(self, event: Any, **about: Any) -> None:
        if self._left == 0:
            raise CutOffError
        self._left -= 1
        self._store.append(event, waits=False, **about)

    def finish(self, _status: str, _reason: str = "") -> None:
        raise CutOffError


def run(
    study: Protocol, store: SessionStore, kept: SimulatedStore, felt: ConditionFeatures, passed: SimulatedTime
) -> None:
    """Answer a session from where its journal ends."""
    start_line = store.lines[0]
    own = session_protocol(
        store.place.study_folder, store.as_recorded(study), start_line.participant, start_line.session
    )
    schedule = build_schedule(own, start_line.participant, start_line.seed)
    start = resume_at(own, schedule, store.lines, store.key)
    state = initial_state(own, schedule, store.key.codes, start_line.language, start, store.key.nonce)
    Answering(study, state, kept, passed, lambda block, condition: felt[block, condition]).run()


def cut_off_and_resumed(study: Protocol, source: bytes, results: Path, felt: ConditionFeatures, seed: int) -> None:
    """Run a session in a study folder whose program ends at a random line, and resume it."""
    rng = random.Random(seed)  # noqa: S311 - of a test
    language = rng.choice(study.study.languages)
    who = {"seed": seed, "language": language, "device": DEVICE, "screens": REHEARSED_SCREENS, "simulated": True}
    whole = len(journal.read(StudyFolder(results).session("P001", 1).journal))
    passed = SimulatedTime()
    first = begun(results, "P003", study, source, clock=SessionClock(passed.ns), session=1, **who)
    with first as store, pytest.raises(CutOffError):
        run(study, store, CutOff(store, rng.randrange(whole)), felt, passed)
    lines = journal.read(store.folder.journal)
    passed = SimulatedTime(progress_of(lines).t_s)
    again = {"operator": "", "device": DEVICE, "screens": REHEARSED_SCREENS, "now_ns": passed.ns}
    with reopen_store(store.folder.path, study, source, now=datetime.fromisoformat(lines[-1].at), **again) as store:
        run(study, store, store, felt, passed)
    ended = journal.read(store.folder.journal)[-1]
    assert ended.status == "completed" or ended.reason.startswith("the criterion of block")


def check_outputs(study: Protocol, results: Path, to: Path) -> None:
    """Check that results are sound, exported and, if anything was asked, reported, and that no trouble is told."""
    messages: list[str] = []
    assert verify_study(results).errors == ()
    assert export(results, to, warn=messages.append, failed=messages.append)
    if study.forms or study.main_blocks:
        assert report(results, to, warn=messages.append, failed=messages.append)
    else:
        with pytest.raises(AnalysisError, match="there is nothing to report"):
            report(results, to)
    assert messages == []


@pytest.mark.variants(6)
@pytest.mark.parametrize("number", range(STUDIES))
def test_any_accepted_study_can_be_held_resumed_verified_exported_and_reported(number: int, tmp_path: Path) -> None:
    text, study = drawn(number)
    file, results = tmp_path / "drawn.toml", tmp_path / "results"
    file.write_text(text, encoding="utf-8", newline="\n")
    features = made_up(str(file))
    rehearse_answers(file, participants=2, seed=number, results=results, features=features)
    cut_off_and_resumed(study, file.read_bytes(), results, features, number)
    for session in StudyFolder(results).sessions():
        assert reproduce_session(session.path).differences == []
    if number % 2:
        assert verify_study(results).errors == ()
        unblind_folder(results, by="AB", reason="a test")
    check_outputs(study, results, tmp_path / "outputs")
