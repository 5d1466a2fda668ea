"""Work beside other work: a report beside a session that goes on, and a draft that an earlier release left."""

import hashlib
import json
import threading
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import Qt

from study_app.analysis.report.write_report import report
from study_app.app.main_controller import MainController
from study_app.gui.home.view import HomePlace
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.source.files import source_bytes
from study_app.session.resume import REHEARSED_SCREENS
from study_app.session.simulated.answers_only import DEVICE, Answering, SimulatedTime
from study_app.session.transitions.table import initial_state
from study_app.store.journals.journal import SessionClock
from study_app.store.sessions.open_session import SessionStore
from study_app.store.verification.whole_study import verify_study
from study_app.user_folder import data_folder
from tests.studies import begun, made_up, rehearsed

pytestmark = pytest.mark.slow


class Stepwise:
    """A session store that writes each line only when permitted."""

    def __init__(self, store: SessionStore) -> None:
        self.store, self.ended = store, threading.Event()
        self._allowed, self._written = threading.Semaphore(0), threading.Semaphore(0)

    def append(self, event: Any, **about: Any) -> None:
        self._allowed.acquire()
        self.store.append(event, **about)
        self._written.release()

    def finish(self, status: str, reason: str = "") -> None:
        self._allowed.acquire()
        self.store.finish(status, reason)
        self.ended.set()
        self._written.release()

    def write(self, lines: int) -> None:
        for _ in range(lines):
            if not self.ended.is_set():
                self._allowed.release()
                self._written.acquire()


@pytest.mark.usefixtures("quick_pdf")
def test_a_report_beside_a_running_session_is_of_the_sessions_that_ended_and_disturbs_none(tmp_path: Path) -> None:
    results = rehearsed(tmp_path / "results", people=2)
    study, passed, features = load("demo"), SimulatedTime(), made_up("demo")
    who = {"seed": 3, "device": DEVICE, "screens": REHEARSED_SCREENS, "simulated": True}
    with begun(results, "P003", clock=SessionClock(passed.ns), **who) as store:
        stepwise, schedule = Stepwise(store), build_schedule(study, "P003", 3)
        state = initial_state(study, schedule, store.key.codes, "en", secret=store.key.nonce)
        answering = Answering(study, state, stepwise, passed, lambda block, condition: features[block, condition])
        session = threading.Thread(target=answering.run)
        session.start()
        stepwise.write(10)
        steps: list[str] = []

        def go_on(what: str, _share: float) -> None:
            steps.append(what)
            stepwise.write(3)

        messages: list[str] = []
        report(results, tmp_path / "beside", progress=go_on, warn=messages.append, failed=messages.append)
        assert messages == []
        assert len(steps) > 3
        assert not stepwise.ended.is_set()
        stepwise.write(10_000)
        session.join(30)
    assert verify_study(results).errors == ()
    report(results, tmp_path / "after", warn=messages.append, failed=messages.append)
    assert messages == []
    reports = [json.loads((tmp_path / name / "report.json").read_bytes()) for name in ("beside", "after")]
    assert [(report["study"]["participants"], report["study"]["sessions_left_out"]) for report in reports] == [
        (2, 1),
        (3, 0),
    ]
    for report_content, status in zip(reports, ("unfinished", "completed"), strict=True):
        assert [session["status"] for session in report_content["sessions"]] == ["completed", "completed", status]


def test_a_draft_that_release_0_2_left_is_shown_at_home_and_opened_in_the_designer(
    qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    (tmp_path / "protocols").mkdir()
    file, saved = tmp_path / "protocols" / "mine.toml", source_bytes("demo")
    file.write_bytes(saved)
    edited = saved.decode().replace('title = "A first look"', 'title = "A second look"')
    draft = {  # as 0.2.0 wrote it
        "file": str(file),
        "base": hashlib.sha256(saved).hexdigest(),
        "selected": ["study"],
        "kept_at": "2026-11-22T10:00:00+01:00",
        "text": edited,
    }
    name = hashlib.sha256(str(file).encode()).hexdigest()[:32]
    (data_folder() / "drafts").mkdir(parents=True)
    (data_folder() / "drafts" / f"{name}.json").write_text(json.dumps(draft), encoding="utf-8", newline="\n")
    visit = MainController(tmp_path / "results")
    qtbot.addWidget(visit.window)
    visit.window.show()
    home = visit.window.place("home")
    assert isinstance(home, HomePlace)
    qtbot.waitUntil(lambda: bool(home.grid.cards))
    first = home.grid.cards[0]
    assert first.facts.source == "mine"
    assert "22" in first.facts.draft.words
    qtbot.mouseClick(first.pen, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: visit.designer is not None and visit.designer.editing.opened is not None, timeout=20_000)
    assert visit.designer is not None
    opened_draft = visit.designer.editing.opened
    assert opened_draft is not None
    assert opened_draft.study.document["study"]["title"] == "A second look"
    assert file.read_bytes() == saved
    visit.window.close()
    visit.end()
