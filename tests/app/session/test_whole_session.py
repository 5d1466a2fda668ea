"""The program's two ways in, with real windows, servo and store, without a screen."""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
import signal
import threading
from pathlib import Path

import pytest
from PySide6.QtCore import QEvent, QObject, Qt, QTimer, Signal
from PySide6.QtGui import QColor
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from study_app import app
from study_app.app.session import live_session, termination
from study_app.errors import DeviceNotFound, DisplayError, SessionError, StoreError, StudyError
from study_app.gui.home.main_window import MainWindow
from study_app.gui.home.startup_window import OpeningWindow
from study_app.gui.operator import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.gui.preflight import PreflightWindow
from study_app.gui.theme.theme import PARTICIPANT
from study_app.protocol.load import parse, source_bytes
from study_app.session import start
from study_app.session.pages import EndPage, PausePage, QuestionnairePage, TaskPage, TextPage, TroublePage
from study_app.store import workstation
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.reopen import check_can_go_on
from study_app.store.workstation import MachineSettings
from tests.compiled import needs_servo

# The platform without a screen cannot limit or raise windows, and says so.
pytestmark = [needs_servo, pytest.mark.usefixtures("qapp")]


@pytest.fixture(autouse=True)
def nobody_stays():
    """Let no simulated person of one test look at the windows of the next."""
    yield
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


@pytest.fixture(autouse=True)
def quick_preflight(monkeypatch):
    """Measure a tenth of a second: what is judged of it is tested by itself."""
    monkeypatch.setattr(start, "MEASURED_S", 0.1)


@pytest.fixture
def short_demo(tmp_path: Path) -> str:
    """Return the demo protocol with tasks of a second."""
    text = source_bytes("demo").decode()
    for key, value in (("min_s", "0.3"), ("count", "1"), ("dwell_s", "0.05")):
        text, found = re.subn(rf"^{key} = [\d.]+", f"{key} = {value}", text, flags=re.MULTILINE)
        assert found == 1
    path = tmp_path / "demo.toml"
    path.write_text(text)
    return str(path)


@pytest.fixture
def results(tmp_path: Path) -> Path:
    return tmp_path / "results" / "demo"


def window(kind):
    """Return the window of that kind that is shown, or None."""
    shown = [widget for widget in QApplication.topLevelWidgets() if isinstance(widget, kind) and widget.isVisible()]
    return shown[0] if shown else None


def place_at_home():
    """Return the main window's home, or None while the window is away."""
    shown = window(MainWindow)
    return None if shown is None else shown.place("home")


class Person(QObject):
    """Does what participant and operator do, with keys and clicks: looks at the windows every 20 ms."""

    def __init__(self, once=None):
        super().__init__()
        self.once = once
        self.answered = None
        self.shots = []
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.look)
        self._timer.start(20)

    def look(self):
        participant = window(ParticipantWindow)
        if participant is None or participant.page is None:
            return
        if self.once is not None:
            act, self.once = self.once, None
            act(participant)
            return
        page = participant.page
        if isinstance(page, TextPage):
            QTest.keyClick(participant.widget, Qt.Key.Key_Return)
        elif isinstance(page, QuestionnairePage) and page is not self.answered:
            self.answered = page
            for number in range(len(page.items)):
                QTest.keyClick(participant.focusWidget(), Qt.Key(Qt.Key.Key_1 + number))
            QTest.keyClick(participant.focusWidget(), Qt.Key.Key_Return)
        elif isinstance(page, PausePage):  # the machine stood still
            QTest.keyClick(participant.widget, Qt.Key.Key_Return)
        elif isinstance(page, TroublePage):
            window(OperatorWindow).end_asked.emit("aborted", "cable")
        elif isinstance(page, EndPage):
            operator = window(OperatorWindow)
            QTest.mouseClick(operator.buttons.close_session, Qt.MouseButton.LeftButton)


def can_go_on(study: str, results: Path) -> bool:
    """Return whether P001's session has no end and is not refused by resume."""
    source = source_bytes(study)
    check_can_go_on(results / "data" / "sub-P001" / "ses-01", parse(source, study), source)
    return "session_ended" not in [line["event"] for line in events(results)]


def events(results: Path):
    journal = results / "data" / "sub-P001" / "ses-01" / "journal.jsonl"
    return [json.loads(line) for line in journal.read_text().splitlines()]


def rows(results: Path, name: str):
    (path,) = (results / "data" / "sub-P001" / "ses-01").glob(f"*description-{name}_data.csv")
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("device", ["scripted", "falcon-emulated"])
def test_a_session_runs_from_the_first_page_to_the_last_in_its_windows(short_demo, results, device):
    """A machine that starves the emulator's Python code loses the device and ends the session: then again."""
    folder = results / "data" / "sub-P001" / "ses-01"
    for _ in range(3):
        shutil.rmtree(results, ignore_errors=True)
        traced, lines = [], []
        person = Person(once=lambda _participant: traced.append((folder / "crash.txt").read_bytes()))  # noqa: B023
        try:
            code = app.run(
                short_demo,
                participant="P001",
                seed=5,
                device=device,
                windowed=True,
                operator="AK",
                results=results,
                tell=lines.append,
            )
        except StudyError:
            code = None
        person.deleteLater()
        if code == 0:
            break
    assert code == 0
    told = events(results)
    assert told[-1]["event"] == "session_ended"
    assert told[-1]["status"] == "completed"
    proof, _, place = (results / "fingerprints.txt").read_text().rstrip().partition("  ")
    assert place == "data/sub-P001/ses-01"
    assert lines[-2] == f"fingerprint of the session, also in fingerprints.txt of the study: {proof}"
    answers = rows(results, "responses")
    assert len(answers) == 8
    assert {row["response"] for row in answers} == {"1", "2"}
    assert {row["simulated"] for row in answers} == {"true"}
    trials = rows(results, "trials")
    assert [row["outcome"] for row in trials] == ["complete"] * 4
    assert min(event["frames_recorded"] for event in told if event["event"] == "recorded") > 5
    assert all(float(row["tick_rate_hz"]) > 500 for row in trials)  # whatever else the machine does
    receipt = json.loads((results / "data" / "sub-P001" / "ses-01" / "receipt.json").read_text())
    assert receipt["screens"]["participant"]["number"] == 1
    assert receipt["operator"] == "AK"
    assert receipt["device"]["name"] == device
    assert ("The Falcon is ready (green light)." in lines) == (device == "falcon-emulated")
    assert receipt["status"] == "completed"
    assert traced == [b""]
    assert not (folder / "crash.txt").exists()
    assert "crash.txt" not in (folder / "checksums.sha256").read_text()
    assert lines[-1] == f"session completed: {results / 'data' / 'sub-P001' / 'ses-01'}"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_leaves_the_session_unfinished_and_resumable(short_demo, results, number):
    before = signal.getsignal(number)

    def suspend_and_end(_participant):
        if hasattr(signal, "SIGTSTP"):
            assert signal.getsignal(signal.SIGTSTP) is not signal.SIG_DFL  # Ctrl-Z would leave the force on
        os.kill(os.getpid(), number)

    person = Person(once=suspend_and_end)
    lines = []
    code = app.run(short_demo, participant="P001", windowed=True, results=results, tell=lines.append)
    person.deleteLater()
    assert code == 128 + number
    assert lines[-1] == f"session not finished: {results / 'data' / 'sub-P001' / 'ses-01'}"
    assert can_go_on(short_demo, results)
    assert signal.getsignal(number) is before
    assert window(OperatorWindow) is None


def test_a_lost_device_ends_the_session_with_one_line(short_demo, results, monkeypatch):
    machines = []
    open_rig = live_session.open_rig
    monkeypatch.setattr(live_session, "open_rig", lambda *a, **k: machines.append(open_rig(*a, **k)) or machines[-1])

    def unplug(participant):
        QTest.keyClick(participant.widget, Qt.Key.Key_Return)
        machines[0].device.unplug()

    person = Person(once=unplug)
    with pytest.raises(StudyError, match="stopped answering"):
        app.run(short_demo, participant="P001", windowed=True, results=results)
    person.deleteLater()
    assert events(results)[-1]["status"] == "broken"
    assert not machines[0].servo.force_is_on


@pytest.mark.parametrize(
    ("wrong", "refused"),
    [
        ({"participant": "P-001"}, StoreError),
        ({"participant": "test"}, StoreError),
        ({"device": "falcn"}, DeviceNotFound),
        ({"language": "xx"}, SessionError),
        ({"screen": 9}, DisplayError),
    ],
)
def test_what_cannot_begin_leaves_nothing_behind(short_demo, results, wrong, refused):
    with pytest.raises(refused) as error:
        app.run(short_demo, **{"participant": "P001", "windowed": True, "results": results} | wrong)
    assert "\n" not in str(error.value)
    assert not results.exists()


def test_the_receipt_says_what_is_set_for_the_machine_and_words_are_as_large_as_it_asks(short_demo, results):
    workstation.save(MachineSettings(viewing_distance_mm=1200, screen_width_mm=150))
    scales = []
    person = Person(once=lambda participant: scales.append(participant._text_scale))
    assert app.run(short_demo, participant="P001", windowed=True, device="scripted", results=results) == 0
    assert person.answered
    told = json.loads((results / "data" / "sub-P001" / "ses-01" / "receipt.json").read_text())["screens"]
    assert (told["participant"]["viewing_distance_mm"], told["participant"]["width_mm"]) == (1200, 150)
    assert told["participant"]["display_offset"] is None
    assert scales[0] > 1
    assert told["participant"]["text_scale"] == pytest.approx(scales[0], abs=0.001)


def test_a_results_folder_that_cannot_be_one_is_named(short_demo, tmp_path):
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(SessionError, match="Not a directory"):
        app.run(short_demo, participant="P001", windowed=True, results=tmp_path / "file" / "demo")
    assert window(OperatorWindow) is None


def test_cancelling_the_opening_creates_nothing(short_demo, results):
    def cancel():
        window(OpeningWindow).cancel.click()

    QTimer.singleShot(0, lambda: QTimer.singleShot(0, cancel))
    assert app.run(short_demo, participant="P001", windowed=True, results=results) == app.CANCELLED
    assert not results.exists()
    assert not [thread for thread in threading.enumerate() if thread.name in {"opening", "servo"}]


def test_a_mistake_in_the_program_is_an_exit_code_and_a_trace(short_demo, results, monkeypatch, capsys):
    def fails(*_chosen, **_asked):
        raise RuntimeError("not thought of")

    monkeypatch.setattr(live_session, "open_rig", fails)
    assert app.run(short_demo, participant="P001", windowed=True, results=results) == app.BUG
    assert "not thought of" in capsys.readouterr().err
    assert not results.exists()


def test_home_closes_with_exit_code_0(tmp_path):
    QTimer.singleShot(0, lambda: QTimer.singleShot(0, lambda: window(MainWindow).close()))
    assert app.home(tmp_path / "results") == 0
    assert not (tmp_path / "results").exists()


def test_from_home_into_a_session_and_home_again(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    steps = []

    def step():
        home, operator = place_at_home(), window(OperatorWindow)
        if not steps and home is not None:
            steps.append("asked")
            card = next(card for card in home.grid.cards if card.facts.source == "demo")
            card.new.click()
            home.dialog.windowed.setChecked(True)
            home.dialog.begin.click()
        elif steps == ["asked"] and window(PreflightWindow) is not None:
            assert not (tmp_path / "results").exists()
            steps.append("looked")
            window(PreflightWindow).start.click()
        elif steps == ["asked", "looked"] and operator is not None and operator.buttons.end.isEnabled():
            steps.append("ended")
            operator.end_asked.emit("withdrawn", "")
            operator.close()
        elif steps == ["asked", "looked", "ended"] and home is not None and home.sessions.shown:
            steps.append(home.sessions.shown[0].status)
            home.window().close()

    timer = QTimer()
    timer.timeout.connect(step)
    timer.start(20)
    assert app.home(tmp_path / "results") == 0
    timer.stop()
    assert steps == ["asked", "looked", "ended", "withdrawn"]
    assert events(tmp_path / "results" / "demo")[-1]["status"] == "withdrawn"


def test_going_back_before_the_session_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    steps = []

    def step():
        home, asked = place_at_home(), window(PreflightWindow)
        if not steps and home is not None:
            steps.append("asked")
            card = next(card for card in home.grid.cards if card.facts.source == "demo")
            card.new.click()
            home.dialog.begin.click()
        elif steps == ["asked"] and asked is not None:
            steps.append("again")
            asked.again.click()
            assert not asked.start.isEnabled()
        elif steps == ["asked", "again"] and asked is not None and asked.start.isEnabled():
            steps.append("back")
            asked.cancel.click()
        elif steps == ["asked", "again", "back"] and home is not None:
            steps.append("home")
            home.window().close()

    timer = QTimer()
    timer.timeout.connect(step)
    timer.start(20)
    assert app.home(tmp_path / "results") == 0
    timer.stop()
    assert steps == ["asked", "again", "back", "home"]
    assert list(tmp_path.iterdir()) == []


def receipt_of(results: Path):
    return json.loads((results / "data" / "sub-P001" / "ses-01" / "receipt.json").read_text())


class Leaver(Person):
    """Goes through the session until its second trial, and then the program is gone: nothing more is written."""

    def __init__(self, monkeypatch):
        super().__init__()
        self._monkeypatch = monkeypatch

    def look(self):
        participant = window(ParticipantWindow)
        if participant is not None and isinstance(participant.page, TaskPage) and participant.page.trial == 2:
            with self._monkeypatch.context() as patched:
                patched.setattr(SessionStore, "finish", lambda *_arguments, **_named: None)
                os.kill(os.getpid(), signal.SIGTERM)
                QTest.qWait(300)
        else:
            super().look()


@pytest.fixture
def stopped(short_demo, results, monkeypatch):
    """Return a protocol whose session P001 stopped in its second trial."""
    person = Leaver(monkeypatch)
    app.run(short_demo, participant="P001", seed=5, device="scripted", windowed=True, results=results)
    person.deleteLater()
    told = events(results)
    assert told[-1]["event"] != "session_ended"
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
    told = events(results)
    assert told[: len(before)] == before
    (resumed,) = [line for line in told if line["event"] == "session_resumed"]
    assert resumed["operator"] == "BB"
    assert met == [PausePage(force_off=False)]
    assert [line["event"] for line in told[len(before) :]][:5] == [
        "session_resumed",
        "preflight",
        "paused",
        "resumed",
        "trial_started",
    ]
    assert resumed["gap_s"] >= 0
    attempts = [(line["trial"], line["attempt"]) for line in told if line["event"] == "trial_started"]
    assert attempts == [(1, 1), (2, 1), (2, 2), (3, 1), (4, 1)]
    assert len(rows(results, "responses")) == 8
    assert [row["outcome"] for row in rows(results, "trials")] == ["complete", "interrupted", *["complete"] * 3]
    assert told[-1]["status"] == "completed"
    assert len(receipt_of(results)["resumed"]) == 1
    with pytest.raises(StoreError, match="finished"):
        app.resume(folder, protocol=stopped, windowed=True)


def test_a_changed_protocol_is_refused_with_the_difference_and_nothing_changes(stopped, results, tmp_path):
    changed = tmp_path / "changed.toml"
    changed.write_text(Path(stopped).read_text().replace('title = "Now reach"', 'title = "Reach now"'))
    before = events(results)
    with pytest.raises(StoreError, match="Reach now"):
        app.resume(results / "data" / "sub-P001" / "ses-01", protocol=str(changed), windowed=True)
    assert events(results) == before


def test_home_offers_first_to_go_on_with_a_session_that_stopped(stopped, results, monkeypatch):
    monkeypatch.chdir(Path(stopped).parent)
    Path("protocols").mkdir()
    Path("protocols/demo.toml").write_text(Path(stopped).read_text())
    steps = []

    def step():
        home, operator = place_at_home(), window(OperatorWindow)
        if not steps and home is not None and home.banner.isVisible():
            steps.append(home.banner.heading.text())
            steps.append(home.banner.line.text())
            home.banner.resume.click()
        elif len(steps) == 2 and window(PreflightWindow) is not None:
            window(PreflightWindow).start.click()
        elif len(steps) == 2 and operator is not None and operator.buttons.end.isEnabled():
            steps.append(operator.rail.heading.text())
            operator.end_asked.emit("withdrawn", "")
            operator.close()
        elif len(steps) == 3 and home is not None and not home.reading:
            home.sessions.show_kind("every")
            steps.append([one.status for one in home.sessions.shown])
            steps.append(home.banner.isVisible())
            home.window().close()

    timer = QTimer()
    timer.timeout.connect(step)
    timer.start(20)
    assert app.home(results.parent) == 0
    timer.stop()
    assert steps[0] == "P001, session 1 stopped in part 1, liquid setting 2 of 2"
    assert "2 of 8 answers are on disk" in steps[1]
    assert steps[2:] == ["Trial 2 of 4", ["withdrawn"], False]


def test_a_pilot_is_marked_framed_and_kept_apart(short_demo, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    seen = []

    def look(participant):
        seen.append((participant.isFullScreen(), participant.frame_px, participant.windowTitle()))
        corner = participant.grab().toImage().pixelColor(2, 2)
        seen.append(corner.name())
        os.kill(os.getpid(), signal.SIGTERM)

    person = Person(once=look)
    app.run(short_demo, participant="test", pilot=True)
    person.deleteLater()
    assert seen[0][0] is False
    assert seen[0][1] > 0
    assert "pilot" in seen[0][2]
    assert seen[1] == QColor(PARTICIPANT.warn).name()
    folder = tmp_path / "results" / "demo-pilot"
    assert not (tmp_path / "results" / "demo").exists()
    assert json.loads((folder / "data" / "sub-test" / "ses-01" / "receipt.json").read_text())["pilot"] is True


def test_the_preflight_is_told_before_anything_is_created(short_demo, results):
    told = []

    def tell(line):
        told.append((line, results.exists()))

    person = Person(once=lambda _participant: os.kill(os.getpid(), signal.SIGTERM))
    app.run(short_demo, participant="P001", windowed=True, results=results, tell=tell)
    person.deleteLater()
    *before, (last, _) = told
    assert last.startswith("session not finished: ")
    names = [line[9:25].strip() for line, _ in before]
    assert names == [
        "Device", "Loop delay", "Servo rate", "Servo lateness", "Priority", "Visual delay", "Screen", "Results folder",
        "Free space", "Blinding",
    ]  # fmt: skip
    assert not any(there for _, there in before)


def test_a_failing_preflight_refuses_the_session(short_demo, results, monkeypatch):
    monkeypatch.setattr("study_app.session.preflight_measurements.probe", lambda _folder: 1_000)
    with pytest.raises(SessionError, match="free space: 0 MB free"):
        app.run(short_demo, participant="P001", windowed=True, results=results)
    assert not results.exists()


def test_a_log_off_leaves_the_session_unfinished_and_resumable(short_demo, results, monkeypatch):
    heard = []

    class Application(QObject):
        asked = Signal(object)

    source = Application()
    monkeypatch.setattr(termination, "log_off_signal", lambda: source.asked)

    class Manager:
        def setRestartHint(self, hint):  # noqa: N802 - Qt's name
            heard.append(hint)

    person = Person(once=lambda _participant: source.asked.emit(Manager()))
    code = app.run(short_demo, participant="P001", windowed=True, results=results)
    person.deleteLater()
    assert heard
    assert code == 128 + 1
    assert can_go_on(short_demo, results)
