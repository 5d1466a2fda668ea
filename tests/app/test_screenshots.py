"""Pictures of the windows: taken of a real session, whole, and nothing of it stays behind."""

import threading
from pathlib import Path

import pytest
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication

from study_app.errors import StudyError
from tests.compiled import needs_servo
from tools.screenshots import screenshots, session_pictures


@pytest.mark.slow
@pytest.mark.nightly
@needs_servo
def test_a_session_is_held_and_its_cockpit_taken_in_both_themes(qapp, tmp_path, monkeypatch):
    monkeypatch.setattr(session_pictures, "TRACED_MS", 500)
    monkeypatch.setattr("study_app.session.start.MEASURED_S", 0.1)
    here, told = Path.cwd(), []
    taken = screenshots(tmp_path, only="single-blind", progress=told.append)
    assert [path.name for path in taken][-3:] == [
        "cockpit-single-blind-dark.png",
        "cockpit-single-blind-light.png",
        "participant-end.png",
    ]
    assert told == [str(path) for path in taken]
    dark, light = (QImage(str(path)) for path in taken[-3:-1])
    assert dark.size() == light.size()
    assert (dark.width(), dark.height()) == session_pictures.COCKPIT
    lightness = [image.scaled(1, 1).pixelColor(0, 0).lightness() for image in (dark, light)]
    assert lightness[0] < 60
    assert lightness[1] > 180
    assert Path.cwd() == here
    assert not [window for window in QApplication.topLevelWidgets() if window.isVisible()]
    assert sorted(tmp_path.iterdir()) == sorted(taken)


@pytest.mark.slow
@pytest.mark.nightly
@needs_servo
def test_a_session_that_cannot_be_taken_is_let_go_of(qapp, tmp_path, monkeypatch):
    def fails(_held, _name):
        assert [thread for thread in threading.enumerate() if thread.name == "servo"]
        raise StudyError("no picture")

    monkeypatch.setattr(session_pictures, "TRACED_MS", 0)
    monkeypatch.setattr(session_pictures.PicturedSession, "take_cockpit", fails)
    monkeypatch.setattr("study_app.session.start.MEASURED_S", 0.1)
    with pytest.raises(StudyError, match="no picture"):
        screenshots(tmp_path, only="single-blind", progress=lambda _line: None)
    assert not [window for window in QApplication.topLevelWidgets() if window.isVisible()]
    assert not [thread for thread in threading.enumerate() if thread.name == "servo"]
