"""The participant's window, with and without the pointer as its device, and a finger."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from PySide6.QtGui import QPointingDevice
from PySide6.QtTest import QTest

from study_app.gui import key_presses
from study_app.gui.participant.tank_widget import TankWidget
from study_app.gui.participant.window import PointerCapture
from study_app.protocol.wording.languages import words
from tests.gui.participant.driver import Participant
from tests.gui.small import task_page


@pytest.fixture(autouse=True)
def early_clicks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let pages accept clicks at once; the delay is tested with the key presses."""
    monkeypatch.setattr(key_presses, "CLICK_MS", 0)


@pytest.fixture
def opening(qtbot: Any) -> Iterator[Callable[..., Participant]]:
    """Return a function that opens a window, which is closed after the test."""
    participants: list[Participant] = []

    def open_(*arguments: Any, **named: Any) -> Participant:
        participants.append(Participant(qtbot, *arguments, **named))
        return participants[-1]

    yield open_
    for participant in participants:
        participant.close()


@pytest.fixture
def participant(opening: Callable[..., Participant]) -> Participant:
    return opening()


@pytest.fixture
def captured(opening: Callable[..., Participant]) -> Iterator[Participant]:
    participant = opening(captures_pointer=True)
    yield participant
    participant.close()
    assert not participant.window.findChild(PointerCapture).is_held


@pytest.fixture(scope="module")
def finger() -> QPointingDevice:
    return QTest.createTouchDevice()


@pytest.fixture
def make_tank(qtbot: Any) -> Callable[..., TankWidget]:
    def make(page: Any = None, size: tuple[int, int] = (960, 640), language: str = "en", **named: Any) -> TankWidget:
        widget = TankWidget(page or task_page(), words(language), **named)
        qtbot.addWidget(widget)
        widget.resize(*size)
        widget.show()
        return widget

    return make
