"""The diagnosis of a Falcon: what goes on is told, every mode has a row, and closing it ends the examination."""

import zipfile

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QFileDialog, QLabel

from study_app.devices.doctor_report import Report
from study_app.devices.doctor_worker import start_examination
from study_app.devices.falcon.doctor.failure_report import findings_of
from study_app.devices.falcon.facts import OPEN, Facts
from study_app.devices.falcon.failure_modes import MODES, UDEV_RULE
from study_app.gui.devices.diagnosis_dialog import DiagnosisDialog
from study_app.gui.devices.failure_rows import Paste, capital
from study_app.gui.theme.theme import DARK, LIGHT
from study_app.workers.messages import Refused
from tests.compiled import needs_servo

pytestmark = pytest.mark.slow

REFUSED = Report(("opened",), findings_of(Facts(platform="linux", usb="access")), "this account may not open it")
WELL = Report((), findings_of(Facts(platform="linux", usb=OPEN)), None)


class Examined:
    """An examination that says what it is given."""

    def __init__(self, name, options):
        self.name, self.options = name, options
        self.told = []
        self.closed = False

    @property
    def ended(self):
        return self.closed

    def answers(self):
        told, self.told = self.told, []
        return [(1, one) for one in told]

    def close(self):
        self.closed = True


@pytest.fixture
def begun():
    return []


@pytest.fixture
def dialog(qtbot, begun):
    def begin(name, options):
        begun.append(Examined(name, options))
        return begun[-1]

    made = DiagnosisDialog(None, LIGHT, "falcon", begin=begin)
    qtbot.addWidget(made)
    made.show()
    return made


def words(widget):
    return [one.text() for one in widget.findChildren(QLabel) if one.isVisibleTo(widget)]


def order(dialog):
    return [row.finding.number for row in sorted(dialog.rows, key=lambda row: row.y())]


def test_every_mode_has_a_row_that_waits_and_what_goes_on_is_told(dialog, begun, qtbot):
    assert [row.finding.id for row in dialog.rows] == [mode.id for mode in MODES]
    assert {row.chip.word for row in dialog.rows} == {"Waiting"}
    assert dialog.bar.isVisible()
    assert not dialog.copy.isEnabled()
    assert [one.name for one in begun] == ["falcon"]
    begun[0].told = ["Pull the grip out.", "Push it in."]
    qtbot.waitUntil(lambda: dialog.step.text() == "Push it in.")
    begun[0].told = [Refused("'mouse' is none")]
    with qtbot.waitSignal(dialog.over):
        pass
    assert dialog.step.text() == "'mouse' is none."
    assert {row.chip.word for row in dialog.rows} == {"Waiting"}
    assert dialog.report is None


def test_what_is_found_stands_first_open_with_cause_cure_and_what_to_paste(dialog, begun, qtbot):
    begun[0].told = [REFUSED]
    with qtbot.waitSignal(dialog.over) as over:
        pass
    assert over.args == [False]
    assert dialog.step.text() == "This account may not open it."
    found = [row for row in dialog.rows if row.found]
    assert [row.finding.id for row in found] == ["permission"]
    assert found[0].words.text() == capital(found[0].finding.symptom)
    assert (capital("macOS denies it"), capital("it is not found")) == ("macOS denies it", "It is not found")
    qtbot.waitUntil(lambda: order(dialog)[0] == found[0].finding.number)
    (mode,) = (mode for mode in MODES if mode.id == "permission")
    told = words(found[0].body)
    assert capital(mode.cause) in told
    assert capital(mode.cure("linux")) in told
    assert mode.detected in told
    (paste,) = found[0].findChildren(Paste)
    qtbot.mouseClick(paste.copy, Qt.MouseButton.LeftButton)
    assert UDEV_RULE in QGuiApplication.clipboard().text()
    assert "\n" not in QGuiApplication.clipboard().text()
    qtbot.mouseClick(dialog.copy, Qt.MouseButton.LeftButton)
    assert "FOUND" in QGuiApplication.clipboard().text()


def test_again_begins_anew_once_the_first_has_left_and_others_say_why_when_they_are_asked(dialog, begun, qtbot):
    begun[0].told = [REFUSED]
    with qtbot.waitSignal(dialog.over):
        pass
    qtbot.mouseClick(dialog.again, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: len(begun) == 2)
    assert begun[0].closed
    assert {row.chip.word for row in dialog.rows} == {"Waiting"}
    assert order(dialog) == sorted(order(dialog))
    begun[1].told = [WELL]
    with qtbot.waitSignal(dialog.over) as over:
        pass
    assert over.args == [True]
    row = next(row for row in dialog.rows if row.finding.state == "ok")
    assert row.chip.word == "OK"
    assert row.words.text() == capital(row.finding.tested)
    assert row.body is None
    qtbot.keyClick(row.more, Qt.Key.Key_Space)
    assert "Cure" in words(row.body)
    qtbot.keyClick(row.more, Qt.Key.Key_Space)
    assert not row.body.isVisible()


@pytest.mark.parametrize("close", ["cancel", "escape", "window"])
def test_closing_ends_what_goes_on(dialog, begun, qtbot, close):
    if close == "cancel":
        qtbot.mouseClick(dialog.close_button, Qt.MouseButton.LeftButton)
    elif close == "escape":
        qtbot.keyClick(dialog, Qt.Key.Key_Escape)
    else:
        dialog.close()
    qtbot.waitUntil(lambda: begun[0].closed)
    assert not dialog.isVisible()


@needs_servo
@pytest.mark.parametrize(("fault", "mode"), [("access-denied", "permission"), ("busy", "busy")])
def test_a_fault_of_an_emulated_falcon_is_found_by_the_real_examination(qtbot, fault, mode):
    made = DiagnosisDialog(
        None,
        DARK,
        "falcon-emulated",
        begin=lambda name, options: start_examination(name, options=options, faults=(fault,)),
    )
    qtbot.addWidget(made)
    assert all(row.chip.theme is DARK for row in made.rows)
    with qtbot.waitSignal(made.over, timeout=120_000):
        pass
    assert [row.finding.id for row in made.rows if row.found] == [mode]
    made.close()
    made.leaving.wait_until_ended()
    assert made.leaving.ended


def test_a_zip_for_whoever_helps_is_saved_with_the_report_and_a_failure_is_a_sentence(dialog, begun, qtbot, tmp_path):
    assert not dialog.support.isEnabled()
    begun[0].told = [REFUSED]
    qtbot.waitUntil(dialog.support.isEnabled)
    dialog.save_support(tmp_path / "missing" / "help.zip")
    assert "cannot be written" in dialog.seen.text()
    qtbot.mouseClick(dialog.support, Qt.MouseButton.LeftButton)
    asked = dialog.findChild(QFileDialog)
    assert asked.isVisible()
    asked.fileSelected.emit(str(tmp_path / "help.zip"))
    asked.close()
    with zipfile.ZipFile(tmp_path / "help.zip") as packed:
        assert "this account may not open it" in packed.read("diagnosis.txt").decode()
    assert str(tmp_path / "help.zip") in dialog.seen.text()
