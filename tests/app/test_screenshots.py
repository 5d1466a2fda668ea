"""Screenshots of a real session: complete, and without leftovers."""

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
def test_screenshots_of_a_session_show_both_themes(qapp, tmp_path, monkeypatch):
    monkeypatch.setattr(session_pictures, "TRACED_MS", 500)
    monkeypatch.setattr("study_app.session.start.MEASURED_S", 0.1)
    here, progress_lines = Path.cwd(), []
    pictures = screenshots(tmp_path, only="single-blind", progress=progress_lines.append)
    assert [path.name for path in pictures][-3:] == [
        "cockpit-single-blind-dark.png",
        "cockpit-single-blind-light.png",
        "participant-end.png",
    ]
    assert progress_lines == [str(path) for path in pictures]
    dark, light = (QImage(str(path)) for path in pictures[-3:-1])
    assert dark.size() == light.size()
    assert (dark.width(), dark.height()) == session_pictures.COCKPIT
    lightness = [image.scaled(1, 1).pixelColor(0, 0).lightness() for image in (dark, light)]
    assert lightness[0] < 60
    assert lightness[1] > 180
    assert Path.cwd() == here
    assert not [window for window in QApplication.topLevelWidgets() if window.isVisible()]
    assert sorted(tmp_path.iterdir()) == sorted(pictures)


@pytest.mark.slow
@pytest.mark.nightly
@needs_servo
def test_a_failed_screenshot_releases_the_session(qapp, tmp_path, monkeypatch):
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
