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
def examinations():
    return []


@pytest.fixture
def dialog(qtbot, examinations):
    def begin(name, options):
        examinations.append(Examined(name, options))
        return examinations[-1]

    shown_dialog = DiagnosisDialog(None, LIGHT, "falcon", options={"firmware": "f.bin"}, begin=begin)
    qtbot.addWidget(shown_dialog)
    shown_dialog.show()
    return shown_dialog


@pytest.mark.parametrize("close", ["cancel", "escape", "window"])
def test_closing_ends_the_examination(dialog, examinations, qtbot, close):
    if close == "cancel":
        qtbot.mouseClick(dialog.close_button, Qt.MouseButton.LeftButton)
    elif close == "escape":
        qtbot.keyClick(dialog, Qt.Key.Key_Escape)
    else:
        dialog.close()
    qtbot.waitUntil(lambda: examinations[0].closed)
    assert (dialog.isVisible(), dialog.findChild(QTimer).isActive(), dialog.isModal()) == (False, False, False)


def test_steps_come_first_then_the_report_and_it_can_run_again(dialog, examinations, qtbot):
    buttons = dialog.again, dialog.copy, dialog.support
    assert [(examination.name, examination.options) for examination in examinations] == [
        ("falcon", {"firmware": "f.bin"})
    ]
    assert dialog.windowTitle() == "Diagnose Novint Falcon"
    assert dialog.close_button.isDefault()
    assert [button.autoDefault() for button in buttons] == [False] * 3
    examinations[0].pending_answers = ["Pull the grip out.", "Push it in."]
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
            examinations[-1].pending_answers = [conclusion]
        assert over.args == [well]
        assert examinations[-1].closed
        assert dialog.step.text() == sentence
        assert (dialog.step.property("role"), dialog.sign.name, dialog.sign.ink) == sign
        assert [button.isEnabled() for button in buttons] == [True, can_copy, True]
        assert (dialog.close_button.text(), dialog.bar.isHidden(), len(examinations)) == ("Close", True, number)
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
    assert len(examinations) == 4


def test_the_next_examination_waits_until_the_device_is_released(dialog, examinations, qtbot, monkeypatch):
    released = []
    monkeypatch.setattr(Examined, "ended", property(lambda _self: bool(released)))
    dialog.examine()
    qtbot.wait(250)
    assert (len(examinations), examinations[0].closed) == (1, True)
    released.append(True)
    qtbot.waitUntil(lambda: len(examinations) == 2)


@pytest.mark.parametrize("sound", [True, False])
@pytest.mark.parametrize("held", [True, False])
def test_a_diagnosis_uses_the_settings_and_notes_a_session_that_uses_the_device(
    qtbot, monkeypatch, tmp_path, sound, held
):
    beeps, examinations = [], []
    monkeypatch.setattr(QApplication, "beep", lambda: beeps.append(True))

    def begin(name, options):
        examinations.append(Examined(name, options))
        return examinations[-1]

    dialog = partial(DiagnosisDialog, begin=begin)
    monkeypatch.setattr("study_app.gui.devices.diagnosis_dialog.DiagnosisDialog", dialog)
    firmware = tmp_path / "f.bin"
    diagnosis = open_diagnosis(
        None, DARK, "falcon:FT1", MachineSettings(firmware=str(firmware), sound=sound), held=held
    )
    assert [(examination.name, examination.options) for examination in examinations] == [
        ("falcon:FT1", {"firmware": firmware})
    ]
    assert diagnosis.note.text().startswith("This session is using the device") is held
    assert diagnosis.note.isHidden() is not held
    examinations[0].pending_answers = [FALCON_WELL]
    qtbot.waitUntil(lambda: diagnosis.report is not None)
    assert beeps == [True] * sound
    diagnosis.reject()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    assert not isValid(diagnosis)


@needs_servo
@pytest.mark.parametrize(("fault", "mode"), [("access-denied", "permission"), ("busy", "busy")])
def test_a_fault_of_an_emulated_falcon_is_found_by_the_real_examination(qtbot, fault, mode):
    diagnosis = DiagnosisDialog(
        None,
        DARK,
        "falcon-emulated",
        begin=lambda name, options: start_examination(name, options=options, faults=(fault,)),
    )
    qtbot.addWidget(diagnosis)
    with qtbot.waitSignal(diagnosis.over, timeout=120_000):
        pass
    assert [finding.id for finding in diagnosis.report.findings if finding.state == "found"] == [mode]
    assert diagnosis.text.toPlainText().count("FAULT") == 1
    assert diagnosis.step.text()[1:] == f"{diagnosis.report.failure[1:]}."
    assert (diagnosis.bar.isHidden(), diagnosis.copy.isEnabled(), diagnosis.close_button.text()) == (
        True,
        True,
        "Close",
    )
    diagnosis.close()
    diagnosis.leaving.wait_until_ended()
    assert diagnosis.leaving.ended


def test_a_zip_for_support_contains_the_report_and_a_failure_is_one_sentence(dialog, examinations, qtbot, tmp_path):
    assert not dialog.support.isEnabled()
    examinations[0].pending_answers = [REFUSED]
    qtbot.waitUntil(dialog.support.isEnabled)
    dialog.save_support(tmp_path / "missing" / "help.zip")
    assert ("cannot be written" in dialog.saved.text(), dialog.saved.isVisible()) == (True, True)
    qtbot.mouseClick(dialog.support, Qt.MouseButton.LeftButton)
    file_dialog = dialog.findChild(QFileDialog)
    assert (file_dialog.isVisible(), file_dialog.windowTitle()) == (True, "Save a zip file for support")
    assert (file_dialog.acceptMode(), file_dialog.nameFilters(), file_dialog.defaultSuffix()) == (
        QFileDialog.AcceptMode.AcceptSave, ["Zip files (*.zip)"], "zip"
    )  # fmt: skip
    file_dialog.fileSelected.emit(str(tmp_path / "help.zip"))
    file_dialog.close()
    with zipfile.ZipFile(tmp_path / "help.zip") as packed:
        assert "this account does not have permission to open it" in packed.read("diagnosis.txt").decode()
    assert str(tmp_path / "help.zip") in dialog.saved.text()
