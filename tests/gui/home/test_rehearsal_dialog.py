"""The dialog of a rehearsal: it counts participants, says why it failed, and stops."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel

from study_app.gui.home import dialogs
from study_app.gui.home.dialogs import RehearsalDialog
from study_app.gui.home.study_facts import study_facts
from study_app.gui.kit.dialogs import STEPS
from study_app.session.simulated.rehearsal_worker import RehearsalOrder

pytestmark = pytest.mark.slow

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def open_dialog(qtbot: Any, tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], RehearsalDialog]:
    """Return a function that opens the dialog with a task in place of the rehearsal."""

    def open_(task: str = "endless") -> RehearsalDialog:
        dialog = RehearsalDialog(study_facts("demo"), tmp_path)
        qtbot.addWidget(dialog)
        monkeypatch.setattr(dialogs, "TASK", f"tests.gui.home.rehearsal_tasks:{task}")
        dialog.open()
        qtbot.waitUntil(dialog.isActiveWindow)
        return dialog

    return open_


@pytest.mark.parametrize(
    ("task", "said"),
    [
        ("fail", "no room left"),
        ("end", "the process ended with exit code 7; the terminal may show why"),
        ("", "no more processes"),
    ],
)
def test_a_failed_rehearsal_states_the_reason_and_stays_open(
    qtbot: Any, open_dialog: Any, monkeypatch: pytest.MonkeyPatch, task: str, said: str
) -> None:
    def none(*_args: Any, **_named: Any) -> None:
        raise OSError("no more processes")

    if not task:
        monkeypatch.setattr(dialogs, "WorkerClient", none)
    dialog = open_dialog(task)
    qtbot.mouseClick(dialog.go_on, LEFT)
    qtbot.waitUntil(lambda: dialog.said.text() == said, timeout=20_000)
    assert dialog.editors["participants"].isVisible(), "it can be tried again"
    qtbot.mouseClick(dialog.back, LEFT)
    assert not dialog.isVisible()


def test_a_rehearsal_counts_participants_and_leads_to_its_results(qtbot: Any, open_dialog: Any) -> None:
    dialog = open_dialog("two")
    dialog.editors["participants"].show_value(2)
    qtbot.mouseClick(dialog.go_on, LEFT)
    qtbot.waitUntil(lambda: dialog.bar.value() == STEPS // 2, timeout=20_000)
    assert dialog.said.text() == "1 of 2: R1: 8 responses (simulated)"
    dialog.worker.stop()
    qtbot.waitUntil(lambda: dialog.over, timeout=20_000)
    assert dialog.bar.value() == STEPS
    assert dialog.isVisible()
    assert str(dialog.folder) in dialog.said.text()
    assert dialog.go_on.text() == "Open results"
    with qtbot.waitSignal(dialog.accepted):
        qtbot.mouseClick(dialog.go_on, LEFT)


def test_the_rehearsal_gets_the_answers_and_an_own_folder(
    qtbot: Any, tmp_path: Any, open_dialog: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[Any] = []

    def client(task: str, *, name: str) -> Any:
        calls.append((task, name))
        idle = {"answers": list, "close": lambda: calls.append("close"), "wait_until_ended": bool, "ended": True}
        return SimpleNamespace(order=calls.append, **idle)

    (tmp_path / "demo-rehearsal-1").mkdir()
    dialog = open_dialog()
    monkeypatch.setattr(dialogs, "WorkerClient", client)
    texts = [part.text() for part in dialog.findChildren(QLabel)]
    about = f"The sessions are marked as simulated and stored separately in {tmp_path / 'demo-rehearsal-2'}."
    assert any(text.endswith(about) for text in texts), texts
    assert (dialog.windowTitle(), dialog.value("seed")) == ("Rehearse A first look", 1)
    count = dialog.editors["participants"].control
    assert (count.minimum(), count.maximum()) == (1, 200)
    dialog.editors["participants"].show_value(3)
    dialog.editors["seed"].show_value(9)
    qtbot.mouseClick(dialog.go_on, LEFT)
    order = RehearsalOrder("demo", 3, 9, tmp_path / "demo-rehearsal-2")
    assert calls == [(dialogs.TASK, "rehearsal"), order]
    assert dialog.said.text() == "0 of 3: rehearsing…"
    dialog.end()
    assert (calls[2:], dialog.working) == (["close"], False)


@pytest.mark.parametrize("at", ["participants", "seed", "go_on", "dialog"])
def test_enter_begins_the_rehearsal_wherever_the_keyboard_is_and_the_end_of_the_program_ends_it(
    qtbot: Any, open_dialog: Any, at: str
) -> None:
    dialog = open_dialog()
    pressed = {"dialog": dialog, "go_on": dialog.go_on}.get(at) or dialog.editors[at].control
    pressed.setFocus()
    qtbot.keyClick(pressed, Qt.Key.Key_Return)
    assert dialog.worker.works
    dialog.end()
    assert dialog.worker.ended


def test_the_number_is_selected_and_the_first_compilation_is_explained(qtbot: Any, open_dialog: Any) -> None:
    dialog = open_dialog("compiles")
    count = dialog.editors["participants"].control
    qtbot.waitUntil(lambda: dialog.focusWidget() is count and count.lineEdit().selectedText() == "5")
    qtbot.keyClicks(count, "3")
    assert dialog.value("participants") == 3
    qtbot.keyClick(count, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: dialog.bar.value() == STEPS // 4, timeout=20_000)
    assert dialog.said.text().startswith("The force model is being compiled. This happens once")
    dialog.end()


def test_cancel_closes_the_dialog_and_stops_a_rehearsal(qtbot: Any, open_dialog: Any) -> None:
    dialog = open_dialog()
    dialog.back.setFocus()
    qtbot.keyClick(dialog.back, Qt.Key.Key_Return)
    assert not dialog.isVisible()
    assert dialog.worker is None
    dialog = open_dialog()
    qtbot.mouseClick(dialog.go_on, LEFT)
    assert dialog.worker.works
    with qtbot.waitSignal(dialog.rejected):
        qtbot.mouseClick(dialog.back, LEFT)
        assert dialog.isVisible()  # and nobody waits
    assert dialog.worker.ended
    assert not dialog.isVisible()


def test_a_rehearsal_that_does_not_listen_is_killed(
    qtbot: Any, open_dialog: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    dialog = open_dialog("deaf")
    monkeypatch.setattr("study_app.workers.client.PATIENCE_S", 0.05)
    dialog.go_on.click()
    qtbot.waitUntil(lambda: dialog.said.text() == "1 of 5: deaf", timeout=20_000)
    with qtbot.waitSignal(dialog.rejected):
        dialog.close()
    assert dialog.worker.ended


@pytest.mark.parametrize(("study", "suggested"), [("viscosityjnd", 20), ("demo", 5)])
def test_the_planned_number_of_participants_is_suggested(qtbot: Any, tmp_path: Any, study: str, suggested: int) -> None:
    dialog = RehearsalDialog(study_facts(study), tmp_path)
    qtbot.addWidget(dialog)
    assert dialog.value("participants") == suggested
