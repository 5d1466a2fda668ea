"""The first entry of places that take long to make: the window answers meanwhile."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from study_app.app import main_controller
from study_app.app.main_controller import MainController


@pytest.mark.parametrize("name", ["lab", "designer"])
def test_a_place_is_not_made_while_a_thread_loads_what_it_needs(
    qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    wanted: list[object] = []
    monkeypatch.setattr(main_controller.Background, "_begin", lambda _self, job: wanted.append(job))
    made: list[str] = []
    monkeypatch.setattr(MainController, f"_{name}", lambda _self: made.append(name))
    visit = MainController(tmp_path / "results")
    qtbot.addWidget(visit.window)
    visit.window.show()
    visit._prepare_lab()  # as once the window stands
    visit.window.go(name)
    assert (visit.window.here, made) == (name, [])
    assert wanted == [main_controller._prepare_lab]
    visit.window.go("home")
    visit.window.close()
    visit.end()
