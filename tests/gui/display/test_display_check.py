"""Whether a window can be opened is found out before Qt is asked, and said in one line."""

import gc
import sys

import pytest

from study_app import app
from study_app.errors import DisplayError
from study_app.gui.display.display_check import check_display, missing_library


def test_no_display_says_what_to_do_and_what_needs_none():
    with pytest.raises(DisplayError, match="DISPLAY") as refused:
        check_display({}, "linux")
    assert "ssh -X" in str(refused.value)
    assert "rehearse" in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_display_nobody_serves_is_an_error_and_no_abort():
    with pytest.raises(DisplayError):
        check_display({"DISPLAY": ":7654"}, "linux")


def test_xcb_asked_for_by_name_needs_a_display():
    with pytest.raises(DisplayError):
        check_display({"QT_QPA_PLATFORM": "xcb", "WAYLAND_DISPLAY": "wayland-0"}, "linux")


@pytest.mark.parametrize(
    "environment",
    [{"QT_QPA_PLATFORM": "offscreen"}, {"QT_QPA_PLATFORM": "vnc:size=800x600"}, {"WAYLAND_DISPLAY": "wayland-0"}],
)
def test_platforms_without_an_x_server_are_left_to_qt(environment):
    check_display(environment, "linux")


@pytest.mark.parametrize("platform", ["win32", "darwin"])
def test_systems_with_a_display_of_their_own_are_left_to_qt(platform):
    check_display({}, platform)


def test_a_missing_library_is_named_with_the_packages_that_bring_it():
    error = ImportError("libEGL.so.1: cannot open shared object file: No such file or directory")
    said = str(missing_library(error))
    assert "libEGL.so.1" in said
    assert "apt install" in said
    assert "\n" not in said


def test_a_library_that_is_missing_for_the_main_window_is_named_too(monkeypatch):
    monkeypatch.setitem(sys.modules, "study_app.app.main_controller", None)
    with pytest.raises(DisplayError, match="Qt cannot be loaded"):
        app.home  # noqa: B018 - it is imported where it is asked for


def test_garbage_is_collected_again_after_an_import_that_failed(monkeypatch):
    monkeypatch.setitem(sys.modules, "study_app.app.main_controller", None)
    monkeypatch.setattr(gc, "isenabled", lambda: True)
    enabled = []
    monkeypatch.setattr(gc, "enable", lambda: enabled.append(True))
    with pytest.raises(DisplayError):
        app.home  # noqa: B018 - it is imported where it is asked for
    assert enabled
