"""Fixtures of home: a results folder with one session, and home that shows it."""

import pytest

from tests.gui.home.home_window import hold, open_home


@pytest.fixture
def results(tmp_path):
    folder = tmp_path / "results"
    hold(folder / "demo", "P001")
    return folder


@pytest.fixture
def home(qtbot, results):
    return open_home(qtbot, results)
