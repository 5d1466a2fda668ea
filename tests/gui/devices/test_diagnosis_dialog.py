"""The diagnosis of a Falcon: faults are found, closing it ends the examination, and the report is saved."""

import zipfile

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog

from study_app.devices.doctor_worker import start_examination
from study_app.gui.devices.diagnosis_dialog import DiagnosisDialog
from study_app.gui.theme.theme import DARK, LIGHT
from tests.compiled import needs_servo
from tests.gui.states import REFUSED, Examined

pytestmark = pytest.mark.slow


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
    with qtbot.waitSignal(made.over, timeout=120_000):
        pass
    assert [finding.id for finding in made.report.findings if finding.state == "found"] == [mode]
    assert made.text.toPlainText().count("FOUND") == 1
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
    assert "cannot be written" in dialog.saved.text()
    qtbot.mouseClick(dialog.support, Qt.MouseButton.LeftButton)
    asked = dialog.findChild(QFileDialog)
    assert asked.isVisible()
    asked.fileSelected.emit(str(tmp_path / "help.zip"))
    asked.close()
    with zipfile.ZipFile(tmp_path / "help.zip") as packed:
        assert "this account does not have permission to open it" in packed.read("diagnosis.txt").decode()
    assert str(tmp_path / "help.zip") in dialog.saved.text()
