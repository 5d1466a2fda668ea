"""A lab in which a ball was moved, computed once."""

from typing import Any

import numba
import pytest

from study_app.gui.lab.lab_state import LabView
from study_app.gui.lab.view import LabPlace
from tests.gui import windows
from tests.gui.lab.sample import lab_view, still_view


@pytest.fixture(scope="session")
def moved() -> LabView:
    if numba.config.DISABLE_JIT:
        pytest.skip("a motion of three seconds is quick enough in compiled code alone")
    return lab_view()


@pytest.fixture(scope="session")
def still() -> LabView:
    return still_view()


@pytest.fixture
def place(qtbot: Any) -> Any:
    lab_place = windows.show_window(qtbot, LabPlace(), (1528, 900))
    lab_place.activateWindow()
    return lab_place
