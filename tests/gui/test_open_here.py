"""A file is opened with the system's program for it; if none can open it, a notice names the path."""

import sys
from pathlib import Path

import pytest
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QLabel, QWidget

from study_app.gui.kit.dialogs import Question
from study_app.gui.kit.opening import open_here


@pytest.fixture
def window(qtbot) -> QWidget:
    window = QWidget()
    qtbot.addWidget(window)
    window.show()
    return window


def notice_of(window: QWidget) -> str:
    """Close the notices of a window; return their texts."""
    notices = window.findChildren(Question)
    for notice in notices:
        notice.close()
    return " ".join(text.text() for notice in notices for text in notice.findChildren(QLabel))


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has xdg-open")
@pytest.mark.parametrize("code", [0, 3])
def test_a_failing_program_is_reported_with_the_path(
    window: QWidget, qtbot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    program, report = tmp_path / "xdg-open", tmp_path / "report.html"
    program.write_text(f'#!/bin/sh\necho "$1" > {tmp_path}/asked\nexit {code}\n', encoding="utf-8", newline="\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    open_here(report)
    qtbot.waitUntil((tmp_path / "asked").exists)
    qtbot.wait(600)
    assert (tmp_path / "asked").read_text(encoding="utf-8").strip() == str(report.resolve())
    assert (str(report.resolve()) in notice_of(window)) == (code != 0)


def test_a_missing_program_is_reported_with_the_path(
    window: QWidget, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(QDesktopServices, "openUrl", lambda _url: False)
    open_here(tmp_path / "report.html")
    assert str((tmp_path / "report.html").resolve()) in notice_of(window)
