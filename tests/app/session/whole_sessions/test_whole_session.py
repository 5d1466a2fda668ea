"""Sessions started by command with real windows, servo and store, without a screen."""

import json
import shutil
import signal
import threading
from contextlib import suppress
from pathlib import Path

import pytest
from PySide6.QtCore import QObject, Qt, QTimer, Signal
from PySide6.QtGui import QColor
from PySide6.QtTest import QTest

from study_app import app
from study_app.app import failures
from study_app.app.session import live_session
from study_app.ending_signals import ENDING_SIGNALS
from study_app.errors import DeviceNotFound, DisplayError, SessionError, StoreError, StudyError
from study_app.gui.operator.window import OperatorWindow
from study_app.gui.startup_window import OpeningWindow
from study_app.gui.theme.theme import PARTICIPANT
from study_app.store import workstation
from study_app.store.recordings import read_frames
from study_app.store.versions.study_versions import kept_content
from study_app.store.workstation import MachineSettings
from tests.app.people import Person, can_go_on, events, rows, run_attended, window
from tests.compiled import needs_servo
from tests.store.forging import secret_of

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.usefixtures("qapp", "nobody_stays", "quick_preflight")]


@pytest.mark.parametrize("device", [pytest.param("scripted", marks=pytest.mark.nightly), "falcon-emulated"])
def test_a_session_runs_from_the_first_page_to_the_last_in_its_windows(short_demo, results, device):
    """On a busy machine the emulated device may be lost, which ends the session: then it is repeated."""
    folder = results / "data" / "sub-P001" / "ses-01"
    for _ in range(3):
        shutil.rmtree(results, ignore_errors=True)
        traced = []
        person = Person(once=lambda _participant: traced.append((folder / "crash.txt").read_bytes()))  # noqa: B023
        with suppress(StudyError):
            code, lines = run_attended(short_demo, results, person, device=device)
            break
    assert code == 0
    journal = events(results)
    assert journal[-1]["event"] == "session_ended"
    assert journal[-1]["status"] == "completed"
    proof, _, place = (results / "fingerprints.txt").read_text("utf-8").rstrip().partition("  ")
    assert place == "data/sub-P001/ses-01"
    assert lines[-2] == f"session fingerprint (also in the study's fingerprints.txt): {proof}"
    answers = rows(results, "responses")
    assert len(answers) == 8
    assert {row["response"] for row in answers} == {"1", "2"}
    assert {row["simulated"] for row in answers} == {"true"}
    trials = rows(results, "trials")
    assert [row["outcome"] for row in trials] == ["complete"] * 4
    frames = [len(read_frames(path, secret_of(path))) for path in results.rglob("*_frames.parquet")]
    assert len(frames) == 4
    assert min(frames) > 5
    assert all(float(row["tick_rate_hz"]) > 500 for row in trials)  # whatever else the machine does
    receipt = json.loads((results / "data" / "sub-P001" / "ses-01" / "receipt.json").read_text("utf-8"))
    assert receipt["screens"]["participant"]["number"] == 1
    assert receipt["operator"] == "AK"
    assert kept_content(receipt["protocol_hash"]) == Path(short_demo).read_bytes()
    assert receipt["device"]["name"] == device
    assert ("The Falcon is ready (green light)." in lines) == (device == "falcon-emulated")
    assert receipt["status"] == "completed"
    assert traced == [b""]
    assert not (folder / "crash.txt").exists()
    assert "crash.txt" not in (folder / "checksums.sha256").read_text("utf-8")
    assert lines[-1] == f"session completed: {results / 'data' / 'sub-P001' / 'ses-01'}"


class Manager:
    """The session manager of a desktop, which asks programs to end."""

    def setRestartHint(self, hint):  # noqa: N802 - Qt's name
        self.hint = hint


@pytest.mark.parametrize("number", [*ENDING_SIGNALS, None], ids=str)
def test_a_signal_or_a_log_off_leaves_the_session_unfinished_and_resumable(short_demo, results, monkeypatch, number):
    class Application(QObject):
        asked = Signal(object)

    source, manager = Application(), Manager()
    monkeypatch.setattr(failures, "log_off_signal", lambda: source.asked)
    before = signal.getsignal(number or signal.SIGTERM)

    def suspend_and_end(_participant):
        if hasattr(signal, "SIGTSTP"):
            assert signal.getsignal(signal.SIGTSTP) is not signal.SIG_DFL  # Ctrl-Z would leave the force on
        if number is None:
            source.asked.emit(manager)
        else:
            signal.raise_signal(number)

    code, lines = run_attended(short_demo, results, Person(once=suspend_and_end), device="mouse")
    assert code == 128 + (number or 1)
    assert hasattr(manager, "hint") == (number is None)
    assert lines[-1] == f"session not finished: {results / 'data' / 'sub-P001' / 'ses-01'}"
    assert can_go_on(short_demo, results)
    assert signal.getsignal(number or signal.SIGTERM) is before
    assert window(OperatorWindow) is None


def test_a_lost_device_ends_the_session_with_one_line(short_demo, results, monkeypatch):
    machines = []
    open_rig = live_session.open_rig
    monkeypatch.setattr(live_session, "open_rig", lambda *a, **k: machines.append(open_rig(*a, **k)) or machines[-1])

    def unplug(participant):
        QTest.keyClick(participant.widget, Qt.Key.Key_Return)
        machines[0].device.unplug()

    with pytest.raises(StudyError, match="stopped responding"):
        run_attended(short_demo, results, Person(once=unplug), device="mouse")
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
        ({"results": Path("file") / "demo"}, SessionError),
    ],
)
def test_a_refused_session_leaves_nothing_behind(short_demo, results, monkeypatch, tmp_path, wrong, refused):
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("no folder", encoding="utf-8", newline="\n")
    with pytest.raises(refused) as error:
        app.run(short_demo, **{"participant": "P001", "windowed": True, "results": results} | wrong)
    assert "\n" not in str(error.value)
    assert ("there is a file where a folder is needed" in str(error.value)) == ("results" in wrong)
    assert not results.exists()
    assert window(OperatorWindow) is None


@pytest.mark.nightly
def test_the_receipt_states_the_settings_of_the_machine_and_texts_have_their_size(short_demo, results):
    workstation.save_settings(MachineSettings(viewing_distance_mm=1200, screen_width_mm=150))
    scales = []
    code, _ = run_attended(short_demo, results, Person(once=lambda participant: scales.append(participant.text_scale)))
    assert code == 0
    screens = json.loads((results / "data" / "sub-P001" / "ses-01" / "receipt.json").read_text("utf-8"))["screens"]
    assert (screens["participant"]["viewing_distance_mm"], screens["participant"]["width_mm"]) == (1200, 150)
    assert screens["participant"]["display_offset"] is None
    assert scales[0] > 1
    assert screens["participant"]["text_scale"] == pytest.approx(scales[0], abs=0.001)


def test_cancelling_the_opening_creates_nothing(short_demo, results):
    def cancel():
        window(OpeningWindow).cancel.click()

    QTimer.singleShot(0, lambda: QTimer.singleShot(0, cancel))
    assert app.run(short_demo, participant="P001", windowed=True, results=results) == failures.CANCELLED
    assert not results.exists()
    assert not [thread for thread in threading.enumerate() if thread.name in {"background", "servo"}]


def test_a_mistake_in_the_program_is_an_exit_code_and_a_trace(short_demo, results, monkeypatch, capsys):
    def fails(*_chosen, **_asked):
        raise RuntimeError("not thought of")

    monkeypatch.setattr(live_session, "open_rig", fails)
    assert app.run(short_demo, participant="P001", windowed=True, results=results) == failures.BUG
    assert "not thought of" in capsys.readouterr().err
    assert not results.exists()


def test_a_pilot_is_marked_framed_and_kept_apart(short_demo, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    looks = []

    def look(participant):
        corner = participant.grab().toImage().pixelColor(2, 2).name()
        looks.extend((participant.isFullScreen(), participant.frame_px > 0, corner, participant.windowTitle()))
        signal.raise_signal(signal.SIGTERM)

    person = Person(once=look)
    app.run(short_demo, participant="test", pilot=True)
    person.deleteLater()
    assert looks[:3] == [False, True, QColor(PARTICIPANT.warn).name()]
    assert "pilot" in looks[3]
    folder = tmp_path / "results" / "demo-pilot"
    assert not (tmp_path / "results" / "demo").exists()
    assert json.loads((folder / "data" / "sub-test" / "ses-01" / "receipt.json").read_text("utf-8"))["pilot"] is True


def test_the_preflight_is_reported_before_any_file_is_created(short_demo, results):
    progress_lines = []
    person = Person(once=lambda _participant: signal.raise_signal(signal.SIGTERM))
    run_attended(short_demo, results, person, progress=lambda line: progress_lines.append((line, results.exists())))
    *before, (last, _) = progress_lines
    assert last.startswith("session not finished: ")
    names = [line[9:25].strip() for line, _ in before]
    assert names == [
        "Device", "Loop delay", "Servo rate", "Servo lateness", "Priority", "Visual delay", "Screen", "Results folder",
        "Free space", "Blinding",
    ]  # fmt: skip
    assert not any(there for _, there in before)


def test_a_failing_preflight_refuses_the_session(short_demo, results, monkeypatch):
    monkeypatch.setattr("study_app.session.preflight_measurements.probe_free_bytes", lambda _folder: 1_000)
    with pytest.raises(SessionError, match="free space: 0 MB free"):
        app.run(short_demo, participant="P001", windowed=True, results=results)
    assert not results.exists()
