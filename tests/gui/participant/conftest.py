"""The participant's window, with and without the pointer as its device."""

from typing import Any

import pytest

from study_app.gui.participant.pointer_capture import PointerCapture
from tests.gui.participant.screens import Opened


@pytest.fixture
def opened(qtbot: Any) -> Any:
    made = Opened(qtbot)
    yield made
    made.window.may_close = True
    made.window.close()


@pytest.fixture
def captured(qtbot: Any) -> Any:
    made = Opened(qtbot, captures_pointer=True)
    yield made
    made.window.may_close = True
    made.window.close()
    assert not made.window.findChild(PointerCapture).held
