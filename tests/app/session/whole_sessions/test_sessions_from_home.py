"""Sessions begun at the home window, and those that stopped and go on."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtTest import QTest

from study_app import app
from study_app.errors import StoreError
from study_app.gui.home.main_window import MainWindow
from study_app.gui.operator.window import OperatorWindow
from study_app.gui.preflight.window import PreflightWindow
from study_app.session.pages import PausePage
from tests.app.people import Leaver, Person, events, place_at_home, poll_windows, receipt_of, rows, run_attended, window
from tests.compiled import needs_servo

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.usefixtures("qapp", "nobody_stays", "quick_preflight")]


def begin(preflight):
    """Start the session and return whether it starts; if the pre-flight failed on a busy computer, measure again."""
    starts = preflight.start.isEnabled()
    if starts:
        preflight.start.click()
    elif preflight.again.isEnabled():
        preflight.again.click()
    return starts


def test_home_closes_with_exit_code_0(tmp_path):
    QTimer.singleShot(0, lambda: QTimer.singleShot(0, lambda: window(MainWindow).close()))
    assert app.run_home_window(tmp_path / "results") == 0
    assert not (tmp_path / "results").exists()


def test_from_home_into_a_session_and_home_again(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    steps = []

    def step():
        home, operator = place_at_home(), window(OperatorWindow)
        if not steps and home is not None and home.grid.cards:
            steps.append("asked")
            card = next(card for card in home.grid.cards if card.facts.source == "demo")
            card.new.click()
            home.dialog.editors["windowed"].control.setChecked(True)
            home.dialog.begin.click()
        elif steps == ["asked"] and window(PreflightWindow) is not None:
            assert not (tmp_path / "results").exists()
            if begin(window(PreflightWindow)):
                steps.append("looked")
        elif steps == ["asked", "looked"] and operator is not None and operator.buttons.end.isEnabled():
            steps.append("ended")
            operator.ask("end", "withdrawn", "")
            operator.close()
        elif steps == ["asked", "looked", "ended"] and home is not None and home.sessions.shown:
            steps.append(home.sessions.shown[0].status)
            home.window().close()

    with poll_windows(step):
        assert app.run_home_window(tmp_path / "results") == 0
    assert steps == ["asked", "looked", "ended", "withdrawn"]
    assert events(tmp_path / "results" / "demo")[-1]["status"] == "withdrawn"


def test_going_back_before_the_session_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    steps = []

    def step():
        home, preflight = place_at_home(), window(PreflightWindow)
        if not steps and home is not None and home.grid.cards:
            steps.append("asked")
            card = next(card for card in home.grid.cards if card.facts.source == "demo")
            card.new.click()
            home.dialog.begin.click()
        elif steps == ["asked"] and preflight is not None:
            steps.append("again")
            preflight.again.click()
            assert not preflight.start.isEnabled()
        elif (
            steps == ["asked", "again"]
            and preflight is not None
            and (preflight.start.isEnabled() or preflight.again.isEnabled())
        ):
            steps.append("back")
            preflight.cancel.click()
        elif steps == ["asked", "again", "back"] and home is not None:
            steps.append("home")
            home.window().close()

    with poll_windows(step):
        assert app.run_home_window(tmp_path / "results") == 0
    assert steps == ["asked", "again", "back", "home"]
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def stopped(short_demo, results, monkeypatch):
    """Return a protocol whose session P001 stopped in its second trial."""
    run_attended(short_demo, results, Leaver(monkeypatch))
    journal = events(results)
    assert journal[-1]["event"] != "session_ended"
    return short_demo


def test_a_session_that_stopped_goes_on_where_it_was_to_its_end(stopped, results):
    before = events(results)
    met = []

    def be_ready(participant):
        met.append(participant.page)
        QTest.keyClick(participant.widget, Qt.Key.Key_Return)

    person = Person(be_ready)
    folder = results / "data" / "sub-P001" / "ses-01"
    assert app.resume(folder, protocol=stopped, windowed=True, operator="BB") == 0
    person.deleteLater()
    journal = events(results)
    assert journal[: len(before)] == before
    (resumed,) = [line for line in journal if line["event"] == "session_resumed"]
    assert resumed["operator"] == "BB"
    assert met == [PausePage(force_off=False)]
    about_recordings = {"recorded", "recording_lost"}  # the first trial's may have been under way
    after = [line["event"] for line in journal[len(before) :] if line["event"] not in about_recordings]
    assert after[:5] == ["session_resumed", "preflight", "paused", "resumed", "trial_started"]
    assert resumed["gap_s"] >= 0
    attempts = [(line["trial"], line["attempt"]) for line in journal if line["event"] == "trial_started"]
    assert attempts == [(1, 1), (2, 1), (2, 2), (3, 1), (4, 1)]
    assert len(rows(results, "responses")) == 8
    assert [row["outcome"] for row in rows(results, "trials")] == ["complete", "interrupted", *["complete"] * 3]
    assert journal[-1]["status"] == "completed"
    assert len(receipt_of(results)["resumed"]) == 1
    with pytest.raises(StoreError, match="finished"):
        app.resume(folder, protocol=stopped, windowed=True)


def test_a_changed_protocol_is_refused_with_the_difference_and_nothing_changes(stopped, results, tmp_path):
    changed = tmp_path / "changed.toml"
    changed.write_text(
        Path(stopped).read_text("utf-8").replace('title = "Reaching"', 'title = "Reach now"'),
        encoding="utf-8",
        newline="\n",
    )
    before = events(results)
    with pytest.raises(StoreError, match="Reach now"):
        app.resume(results / "data" / "sub-P001" / "ses-01", protocol=str(changed), windowed=True)
    assert events(results) == before


def test_home_offers_first_to_go_on_with_a_session_that_stopped(stopped, results, monkeypatch):
    monkeypatch.chdir(Path(stopped).parent)
    Path("protocols").mkdir()
    Path("protocols/demo.toml").write_text(Path(stopped).read_text("utf-8"), encoding="utf-8", newline="\n")
    steps = []

    def step():
        home, operator = place_at_home(), window(OperatorWindow)
        if not steps and home is not None and home.banner.isVisible():
            steps.append(home.banner.heading.text())
            steps.append(home.banner.line.text())
            home.banner.resume.click()
        elif len(steps) == 2 and window(PreflightWindow) is not None:
            begin(window(PreflightWindow))
        elif len(steps) == 2 and operator is not None and operator.buttons.end.isEnabled():
            steps.append(operator.rail.heading.text())
            operator.ask("end", "withdrawn", "")
            operator.close()
        elif len(steps) == 3 and home is not None and not home.is_reading:
            home.sessions.show_kind("every")
            steps.append([session.status for session in home.sessions.shown])
            steps.append(home.banner.isVisible())
            home.window().close()

    with poll_windows(step):
        assert app.run_home_window(results.parent) == 0
    assert steps[0] == "P001, session 1 of demo stopped in part 1, liquid setting 2 of 2"
    assert "Answers on disk: 2 of 8" in steps[1]
    assert steps[2:] == ["Trial 2 of 4", ["withdrawn"], False]
