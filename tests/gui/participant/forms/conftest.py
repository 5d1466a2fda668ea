"""Forms that are opened and closed again, and a finger."""

from typing import Any

import pytest
from PySide6.QtGui import QPointingDevice
from PySide6.QtTest import QTest

from tests.gui.participant.forms.opened_form import Opened, form


@pytest.fixture
def opened(qtbot: Any) -> Any:
    made = Opened(qtbot, form())
    yield made
    made.close()


@pytest.fixture
def opening(qtbot: Any) -> Any:
    made: list[Opened] = []

    def open_(*arguments: Any, **named: Any) -> Opened:
        made.append(Opened(qtbot, *arguments, **named))
        return made[-1]

    yield open_
    for one in made:
        one.close()


@pytest.fixture(scope="module")
def finger() -> QPointingDevice:
    return QTest.createTouchDevice()
