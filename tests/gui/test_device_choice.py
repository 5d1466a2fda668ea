"""What choosing a device asks of the windows, and the note while a session is being made ready."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QProgressBar

from study_app.errors import DeviceError, DeviceNotFound
from study_app.gui.startup_window import OpeningWindow
from study_app.protocol.load import load
from study_app.session.start import NewSession, check_choices, study_results

CHOSEN = NewSession(
    source="demo",
    participant="P001",
    session=1,
    seed=7,
    operator="",
    language="en",
    device="mouse",
    windowed=True,
    screen=None,
    results=Path("nowhere"),
)


@pytest.mark.parametrize(
    ("device", "folder"),
    [
        ("mouse", "demo"),
        ("falcon", "demo"),
        ("falcon:FT123", "demo"),
        ("scripted", "demo-scripted"),
        ("falcon-emulated", "demo-falcon-emulated"),
    ],
)
def test_what_nobody_felt_is_kept_apart(tmp_path, device, folder):
    assert study_results(tmp_path, "demo", device) == tmp_path / folder


def test_firmware_is_for_falcons_alone(tmp_path):
    study = load("demo")
    chosen = replace(CHOSEN, results=tmp_path, device_options={"firmware": tmp_path / "file.bin"})
    with pytest.raises(DeviceError, match="device 'mouse' does not use firmware; only these do: Novint Falcon,"):
        check_choices(chosen, study)
    check_choices(replace(chosen, device="falcon"), study)
    with pytest.raises(DeviceNotFound, match="'falcon-socket:/run/f' is not known; choose one of: "):
        check_choices(replace(chosen, device="falcon-socket:/run/f"), study)


@pytest.fixture
def opening(qtbot: Any) -> OpeningWindow:
    made = OpeningWindow("A first look", "Participant P001")
    qtbot.addWidget(made)
    made.show()
    qtbot.waitExposed(made)
    return made


def test_the_note_says_what_takes_long_unless_the_device_asks_for_something(qtbot: Any) -> None:
    now_s = [100.0]
    made = OpeningWindow("A first look", "Participant P001", now_s=lambda: now_s[0])
    qtbot.addWidget(made)
    bar, tick = made.findChild(QProgressBar), made.findChild(QTimer).timeout.emit
    texts = [part.text() for part in made.findChildren(QLabel)]
    assert {"A first look", "Participant P001", "Preparing the device and the force model …"} <= {*texts}
    for seconds, elapsed, is_long in ((3.9, "0:03", False), (4.0, "0:04", False), (72.5, "1:12", True)):
        now_s[0] = 100.0 + seconds
        tick()
        assert (made.elapsed.text(), made.step.text().startswith("The force model")) == (elapsed, is_long)
    assert bar.maximum() == 0
    made.show_line("Pull the grip out.")
    tick()
    made.show_compiled(0.6)
    assert (made.step.text(), bar.maximum(), bar.value()) == ("Pull the grip out.", 100, 60)
    other = OpeningWindow("A first look", "Participant P001")
    qtbot.addWidget(other)
    other.show()
    other.show_compiled(0.0)
    assert other.step.text().startswith("The force model is being compiled.")
    with qtbot.waitSignal(other.cancelled):
        other.cancel.click()
    assert not other.findChild(QTimer).isActive()
    other.show()
    with qtbot.assertNotEmitted(other.cancelled):
        other.close()


@pytest.mark.parametrize("ready", [False, True])
def test_escape_goes_back_whichever_part_has_the_keyboard_and_what_is_ready_is_not_cancelled(
    opening: OpeningWindow, ready: bool
) -> None:
    cancelled: list[bool] = []
    opening.cancelled.connect(lambda: cancelled.append(True))
    if ready:
        opening.finish()
    else:
        opening.cancel.setFocus()
        QTest.keyPress(opening.windowHandle(), Qt.Key.Key_Escape)
    assert cancelled == ([] if ready else [True])
    assert not opening.isVisible()
