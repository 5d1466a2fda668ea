"""The designer in the main window, and what is made of it by many tests."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.designer.support.designer import Designer
from tests.gui.conftest import pytest_pycollect_makemodule

__all__ = ["pytest_pycollect_makemodule"]


@pytest.fixture
def designer(qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Designer]:
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    made = Designer(tmp_path)
    qtbot.waitUntil(made.window.isActiveWindow)
    yield made
    made.close()


@pytest.fixture(params=["special editors", "no special editors"])
def editors(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run a test with the special editors and without any."""
    if request.param == "no special editors":
        monkeypatch.setattr("study_app.designer.form.card.EDITORS", {})
