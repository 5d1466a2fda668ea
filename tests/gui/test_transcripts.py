"""Every window, compared with a reviewed text: what it paints and tells, and what each control does."""

from pathlib import Path
from typing import Any

import pytest

from study_app.gui.home import new_session_dialog
from study_app.gui.widgets.background import wait_for_jobs
from study_app.gui.widgets.main_view import Place
from tests.gui.transcript import compare, lines_of, steps
from tests.gui.walk import settle
from tests.gui.windows import WINDOWS, two_screens

SEED = 1234


@pytest.fixture(autouse=True)
def alike_every_time(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    two_screens(monkeypatch)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(new_session_dialog, "draw_seed", lambda: SEED)


def at_rest(window: Any) -> None:
    wait_for_jobs(60)
    settle(window)


@pytest.fixture(params=WINDOWS)
def named_window(qtbot: Any, request: pytest.FixtureRequest) -> tuple[str, Any]:
    make, sizes = WINDOWS[request.param]
    window = make(qtbot, Path())
    settle(window, sizes[-1])
    return request.param, window


def test_what_a_window_paints_and_tells(named_window: tuple[str, Any], pytestconfig: pytest.Config) -> None:
    name, window = named_window
    compare(f"{name}, shown", lines_of(window), pytestconfig)
    window.window().close()


@pytest.mark.slow
def test_what_each_control_does(named_window: tuple[str, Any], pytestconfig: pytest.Config) -> None:
    name, window = named_window
    place = next((one for one in window.findChildren(Place) if one.isVisible()), window)
    compare(f"{name}, used", list(steps(place, lambda: at_rest(window))), pytestconfig)
    window.window().close()
