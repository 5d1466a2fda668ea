"""The diagnosis of a Falcon: faults are found, closing it ends the examination, and the report is saved."""

import zipfile
from functools import partial

import pytest
from PySide6.QtCore import QEvent, Qt, QTimer
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QApplication, QFileDialog
from shiboken6 import isValid

from study_app.devices.doctor import report_lines
from study_app.devices.doctor_worker import start_examination
from study_app.gui.devices.diagnosis_dialog import DiagnosisDialog, open_diagnosis
from study_app.gui.theme.theme import DARK, LIGHT
from study_app.store.workstation import MachineSettings
from study_app.workers.server import Refused
from tests.compiled import needs_servo
from tests.gui.states import FALCON_WELL, REFUSED, Examined

pytestmark = pytest.mark.slow


@pytest.fixture
def begun():
    return []


@pytest.fixture
def dialog(qtbot, begun):
    def begin(name, options):
        begun.append(Examined(name, options))
        return begun[-1]

    made = DiagnosisDialog(None, LIGHT, "falcon", options={"firmware": "f.bin"}, begin=begin)
    qtbot.addWidget(made)
    made.show()
    return made


@pytest.mark.parametrize("close", ["cancel", "escape", "window"])
def test_closing_ends_what_goes_on(dialog, begun, qtbot, close):
    if close == "cancel":
        qtbot.mouseClick(dialog.close_button, Qt.MouseButton.LeftButton)
    elif close == "escape":
        qtbot.keyClick(dialog, Qt.Key.Key_Escape)
    else:
        dialog.close()
    qtbot.waitUntil(lambda: begun[0].closed)
    assert (dialog.isVisible(), dialog.findChild(QTimer).isActive(), dialog.isModal()) == (False, False, False)


def test_steps_come_first_then_the_report_and_it_can_run_again(dialog, begun, qtbot):
    buttons = dialog.again, dialog.copy, dialog.support
    assert [(one.name, one.options) for one in begun] == [("falcon", {"firmware": "f.bin"})]
    assert dialog.windowTitle() == "Diagnose Novint Falcon"
    assert dialog.close_button.isDefault()
    assert [button.autoDefault() for button in buttons] == [False] * 3
    begun[0].told = ["Pull the grip out.", "Push it in."]
    qtbot.waitUntil(lambda: dialog.step.text() == "Push it in.")
    assert dialog.text.toPlainText() == "Pull the grip out.\nPush it in."
    assert [button.isEnabled() for button in buttons] == [False] * 3
    assert (dialog.step.property("role"), dialog.sign.name, dialog.sign.ink) == ("text", "pulse", "accent")
    for number, conclusion, well, sentence, sign, can_copy in (
        (1, REFUSED, False, "This account does not have permission to open it.", ("bad", "warning", "bad"), True),
        (2, FALCON_WELL, True, FALCON_WELL.conclusion, ("text2", "check", "ok"), True),
        (3, Refused("'mouse' is none"), False, "'mouse' is none.", ("bad", "warning", "bad"), False),
    ):
        with qtbot.waitSignal(dialog.over) as over:
            begun[-1].told = [conclusion]
        assert over.args == [well]
        assert begun[-1].closed
        assert dialog.step.text() == sentence
        assert (dialog.step.property("role"), dialog.sign.name, dialog.sign.ink) == sign
        assert [button.isEnabled() for button in buttons] == [True, can_copy, True]
        assert (dialog.close_button.text(), dialog.bar.isHidden(), len(begun)) == ("Close", True, number)
        if can_copy:
            report = "\n".join(report_lines(conclusion)).strip() + "\n"
            assert dialog.text.toPlainText() == report
            dialog.copy.click()
            assert (QGuiApplication.clipboard().text(), dialog.copy.text()) == (report, "Copied")
        dialog.again.click()
        assert (dialog.text.toPlainText(), dialog.step.text()[:9], dialog.report) == ("", "Preparing", None)
        assert [button.isEnabled() for button in buttons] == [False] * 3
        assert (dialog.close_button.text(), dialog.bar.isHidden(), dialog.saved.isHidden()) == ("Cancel", False, True)
        assert dialog.copy.text() == "Copy report"
    assert len(begun) == 4


def test_the_next_examination_waits_until_the_device_is_released(dialog, begun, qtbot, monkeypatch):
    released = []
    monkeypatch.setattr(Examined, "ended", property(lambda _self: bool(released)))
    dialog.examine()
    qtbot.wait(250)
    assert (len(begun), begun[0].closed) == (1, True)
    released.append(True)
    qtbot.waitUntil(lambda: len(begun) == 2)


@pytest.mark.parametrize("sound", [True, False])
@pytest.mark.parametrize("held", [True, False])
def test_a_diagnosis_uses_the_settings_and_says_if_a_session_holds_the_device(
    qtbot, monkeypatch, tmp_path, sound, held
):
    beeps, begun = [], []
    monkeypatch.setattr(QApplication, "beep", lambda: beeps.append(True))

    def begin(name, options):
        begun.append(Examined(name, options))
        return begun[-1]

    dialog = partial(DiagnosisDialog, begin=begin)
    monkeypatch.setattr("study_app.gui.devices.diagnosis_dialog.DiagnosisDialog", dialog)
    firmware = tmp_path / "f.bin"
    made = open_diagnosis(None, DARK, "falcon:FT1", MachineSettings(firmware=str(firmware), sound=sound), held=held)
    assert [(one.name, one.options) for one in begun] == [("falcon:FT1", {"firmware": firmware})]
    assert made.note.text().startswith("This session is using the device") is held
    assert made.note.isHidden() is not held
    begun[0].told = [FALCON_WELL]
    qtbot.waitUntil(lambda: made.report is not None)
    assert beeps == [True] * sound
    made.reject()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    assert not isValid(made)


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
    with qtbot.waitSignal(made.over, timeout=120_000):
        pass
    assert [finding.id for finding in made.report.findings if finding.state == "found"] == [mode]
    assert made.text.toPlainText().count("FAULT") == 1
    assert made.step.text()[1:] == f"{made.report.failure[1:]}."
    assert (made.bar.isHidden(), made.copy.isEnabled(), made.close_button.text()) == (True, True, "Close")
    made.close()
    made.leaving.wait_until_ended()
    assert made.leaving.ended


def test_a_zip_for_whoever_helps_is_saved_with_the_report_and_a_failure_is_a_sentence(dialog, begun, qtbot, tmp_path):
    assert not dialog.support.isEnabled()
    begun[0].told = [REFUSED]
    qtbot.waitUntil(dialog.support.isEnabled)
    dialog.save_support(tmp_path / "missing" / "help.zip")
    assert ("cannot be written" in dialog.saved.text(), dialog.saved.isVisible()) == (True, True)
    qtbot.mouseClick(dialog.support, Qt.MouseButton.LeftButton)
    asked = dialog.findChild(QFileDialog)
    assert (asked.isVisible(), asked.windowTitle()) == (True, "Save a zip file for support")
    assert (asked.acceptMode(), asked.nameFilters(), asked.defaultSuffix()) == (
        QFileDialog.AcceptMode.AcceptSave, ["Zip files (*.zip)"], "zip"
    )  # fmt: skip
    asked.fileSelected.emit(str(tmp_path / "help.zip"))
    asked.close()
    with zipfile.ZipFile(tmp_path / "help.zip") as packed:
        assert "this account does not have permission to open it" in packed.read("diagnosis.txt").decode()
    assert str(tmp_path / "help.zip") in dialog.saved.text()
