"""What choosing a device asks of the windows, and the note while a session is being made ready."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

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
