"""The dialog of a rehearsal: its progress, its end, and rehearsals that fail or do not stop."""

import pytest
from PySide6.QtCore import Qt

from study_app.gui.home.rehearsal_dialog import RehearsalDialog
from study_app.store.folders import rehearsal_folder
from study_app.viewmodels.home import study_facts

pytestmark = pytest.mark.slow


def test_rehearsals_get_a_folder_of_their_own(tmp_path):
    assert rehearsal_folder(tmp_path, "demo").name == "demo-rehearsal-1"
    (tmp_path / "demo-rehearsal-1").mkdir()
    assert rehearsal_folder(tmp_path, "demo").name == "demo-rehearsal-2"


@pytest.mark.parametrize(
    ("task", "said"),
    [("fail", "no room left"), ("end", "the process ended with exit code 7; the terminal may show why")],
)
def test_a_failed_rehearsal_says_why_and_stays(qtbot, tmp_path, monkeypatch, task, said):
    dialog = RehearsalDialog(study_facts("demo"), tmp_path)
    qtbot.addWidget(dialog)
    dialog.open()
    monkeypatch.setattr("study_app.gui.home.rehearsal_dialog.TASK", f"tests.gui.home.rehearsal_tasks:{task}")
    qtbot.mouseClick(dialog.start, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: dialog.cancel.text() == "Close", timeout=20_000)
    assert dialog.isVisible()
    assert dialog.said.text() == said
    qtbot.mouseClick(dialog.cancel, Qt.MouseButton.LeftButton)
    assert not dialog.isVisible()


def test_a_rehearsal_counts_participants_and_leads_to_its_results(qtbot, tmp_path, monkeypatch):
    dialog = RehearsalDialog(study_facts("demo"), tmp_path)
    qtbot.addWidget(dialog)
    dialog.open()
    dialog.participants.setValue(2)
    monkeypatch.setattr("study_app.gui.home.rehearsal_dialog.TASK", "tests.gui.home.rehearsal_tasks:two")
    qtbot.mouseClick(dialog.start, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: dialog.progress.value() == 1, timeout=20_000)
    assert dialog.said.text() == "1 of 2: R1: 8 responses (simulated)"
    assert (dialog.progress.minimum(), dialog.progress.maximum()) == (0, 2)
    dialog.worker.stop()
    qtbot.waitUntil(lambda: dialog.over, timeout=20_000)
    assert dialog.progress.value() == 2
    assert dialog.isVisible()
    assert str(dialog.folder) in dialog.said.text()
    assert dialog.start.text() == "Open results"
    with qtbot.waitSignal(dialog.accepted):
        qtbot.mouseClick(dialog.start, Qt.MouseButton.LeftButton)


@pytest.mark.parametrize("at", ["participants", "seed", "start", "dialog"])
def test_enter_begins_the_rehearsal_wherever_the_keyboard_is(qtbot, tmp_path, monkeypatch, at):
    dialog = RehearsalDialog(study_facts("demo"), tmp_path)
    qtbot.addWidget(dialog)
    dialog.open()
    qtbot.waitUntil(dialog.isActiveWindow)
    monkeypatch.setattr("study_app.gui.home.rehearsal_dialog.TASK", "tests.gui.home.rehearsal_tasks:endless")
    pressed = dialog if at == "dialog" else getattr(dialog, at)
    pressed.setFocus()
    qtbot.keyClick(pressed, Qt.Key.Key_Return)
    assert dialog.worker.works
    dialog.end()
    assert dialog.worker.ended


def test_enter_on_cancel_cancels(qtbot, tmp_path):
    dialog = RehearsalDialog(study_facts("demo"), tmp_path)
    qtbot.addWidget(dialog)
    dialog.open()
    qtbot.waitUntil(dialog.isActiveWindow)
    dialog.cancel.setFocus()
    qtbot.keyClick(dialog.cancel, Qt.Key.Key_Return)
    assert not dialog.isVisible()
    assert dialog.worker is None


def test_cancelling_a_rehearsal_stops_it(qtbot, tmp_path, monkeypatch):
    dialog = RehearsalDialog(study_facts("demo"), tmp_path)
    qtbot.addWidget(dialog)
    dialog.open()
    monkeypatch.setattr("study_app.gui.home.rehearsal_dialog.TASK", "tests.gui.home.rehearsal_tasks:endless")
    qtbot.mouseClick(dialog.start, Qt.MouseButton.LeftButton)
    assert dialog.worker.works
    with qtbot.waitSignal(dialog.rejected):
        qtbot.mouseClick(dialog.cancel, Qt.MouseButton.LeftButton)
        assert dialog.isVisible()  # and nobody waits
    assert dialog.worker.ended
    assert not dialog.isVisible()


def test_a_rehearsal_that_does_not_listen_is_killed(qtbot, tmp_path, monkeypatch):
    dialog = RehearsalDialog(study_facts("demo"), tmp_path)
    qtbot.addWidget(dialog)
    dialog.open()
    monkeypatch.setattr("study_app.gui.home.rehearsal_dialog.TASK", "tests.gui.home.rehearsal_tasks:deaf")
    monkeypatch.setattr("study_app.workers.client.PATIENCE_S", 0.05)
    dialog.start.click()
    qtbot.waitUntil(lambda: dialog.said.text() == "1 of 5: deaf", timeout=20_000)
    with qtbot.waitSignal(dialog.rejected):
        dialog.close()
    assert dialog.worker.ended


def test_a_rehearsal_that_cannot_be_run_says_so(qtbot, tmp_path, monkeypatch):
    dialog = RehearsalDialog(study_facts("demo"), tmp_path)
    qtbot.addWidget(dialog)
    dialog.open()

    def none(*_args, **_named):
        raise OSError("no more processes")

    monkeypatch.setattr("study_app.gui.home.rehearsal_dialog.WorkerClient", none)
    dialog.start.click()
    qtbot.waitUntil(lambda: dialog.cancel.text() == "Close")
    assert dialog.said.text() == "no more processes"
