"""A tank with two targets."""

from typing import Any

import pytest

from study_app.gui.participant.tank_widget import TankWidget
from study_app.protocol.wording.languages import words
from tests.gui.small import task_page


@pytest.fixture
def tank(qtbot: Any) -> TankWidget:
    widget = TankWidget(task_page(), words("en"))
    qtbot.addWidget(widget)
    widget.resize(960, 640)
    widget.show()
    return widget
