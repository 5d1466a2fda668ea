"""The effects of choosing a device, and the window shown while a session is prepared."""

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
def test_simulated_sessions_have_a_separate_folder(tmp_path, device, folder):
    assert study_results(tmp_path, "demo", device) == tmp_path / folder


def test_firmware_is_offered_only_for_falcons(tmp_path):
    study = load("demo")
    chosen = replace(CHOSEN, results=tmp_path, device_options={"firmware": tmp_path / "file.bin"})
    with pytest.raises(DeviceError, match="device 'mouse' does not use firmware; only these do: Novint Falcon,"):
        check_choices(chosen, study)
    check_choices(replace(chosen, device="falcon"), study)
    with pytest.raises(DeviceNotFound, match="'falcon-socket:/run/f' is not known; choose one of: "):
        check_choices(replace(chosen, device="falcon-socket:/run/f"), study)


@pytest.fixture
def opening(qtbot: Any) -> OpeningWindow:
    window = OpeningWindow("A first look", "Participant P001")
    qtbot.addWidget(window)
    window.show()
    qtbot.waitExposed(window)
    return window


def test_the_note_explains_long_compilation_unless_the_device_gives_an_instruction(qtbot: Any) -> None:
    now_s = [100.0]
    window = OpeningWindow("A first look", "Participant P001", now_s=lambda: now_s[0])
    qtbot.addWidget(window)
    bar, tick = window.findChild(QProgressBar), window.findChild(QTimer).timeout.emit
    texts = [part.text() for part in window.findChildren(QLabel)]
    assert {"A first look", "Participant P001", "Preparing the device and the force model…"} <= {*texts}
    for seconds, elapsed, is_long in ((3.9, "0:03", False), (4.0, "0:04", False), (72.5, "1:12", True)):
        now_s[0] = 100.0 + seconds
        tick()
        assert (window.elapsed.text(), window.step.text().startswith("The force model")) == (elapsed, is_long)
    assert bar.maximum() == 0
    window.show_line("Pull the grip out.")
    tick()
    window.show_compiled(0.6)
    assert (window.step.text(), bar.maximum(), bar.value()) == ("Pull the grip out.", 100, 60)
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
def test_escape_closes_the_window_and_cancels_only_an_unfinished_opening(opening: OpeningWindow, ready: bool) -> None:
    cancelled: list[bool] = []
    opening.cancelled.connect(lambda: cancelled.append(True))
    if ready:
        opening.finish()
    else:
        opening.cancel.setFocus()
        QTest.keyPress(opening.windowHandle(), Qt.Key.Key_Escape)
    assert cancelled == ([] if ready else [True])
    assert not opening.isVisible()
