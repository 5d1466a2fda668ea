"""Plots that are painted once, jobs beside the window, and roles for screen readers."""

import threading
from typing import Any

import numpy as np
import pytest
import shiboken6
from PySide6.QtCore import QObject
from PySide6.QtGui import QAccessible
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from study_app.errors import StudyError
from study_app.gui.widgets.background import Background, wait_for_jobs
from study_app.gui.widgets.labels import Clamped, label
from study_app.gui.widgets.live_plots import TracePlot, tick_text


def test_what_was_changed_is_painted_at_once_and_not_again_later(qtbot: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    painted: list[int] = []
    paint = TracePlot.paintEvent
    monkeypatch.setattr(TracePlot, "paintEvent", lambda self, event: (painted.append(1), paint(self, event))[1])
    plot = TracePlot(10.0, 50.0)
    qtbot.addWidget(plot)
    plot.resize(420, 200)
    plot.show()
    qtbot.waitExposed(plot)
    QApplication.processEvents()
    painted.clear()
    times_s = np.linspace(-10, 0, 100)
    for turn in range(5):
        plot.show_traces(times_s, np.column_stack([np.sin(times_s + turn)] * 3))
        assert len(painted) == turn
        plot.paint_now()
        assert len(painted) == turn + 1
        QApplication.processEvents()
    assert len(painted) == 5


def test_only_the_newest_of_what_was_asked_for_comes(qtbot: Any) -> None:
    parent = QObject()
    background, came, go_on = Background(parent), [], threading.Event()
    background.done.connect(came.append)
    background.run(lambda: go_on.wait(10) and "first")
    background.run(lambda: "second")
    background.run(lambda: "third")
    assert background.busy
    assert came == []
    go_on.set()
    qtbot.waitUntil(lambda: not background.busy)
    assert came == ["third"]


@pytest.mark.parametrize("listened", [False, True])
def test_a_refusal_that_nothing_listens_to_is_logged(
    qtbot: Any, caplog: pytest.LogCaptureFixture, *, listened: bool
) -> None:
    def refuse() -> None:
        raise StudyError("no such folder")

    parent, came = QObject(), []
    background = Background(parent)
    if listened:
        background.failed.connect(came.append)
    background.run(refuse)
    qtbot.waitUntil(lambda: not background.busy)
    assert ("no such folder" in caplog.messages) is not listened
    assert len(came) == listened
    caplog.clear()


def test_the_end_of_the_program_waits_for_jobs_but_not_for_ever() -> None:
    parent = QObject()
    background, go_on, ended = Background(parent), threading.Event(), []
    background.run(lambda: ended.append(go_on.wait(10)))
    wait_for_jobs(0.01)
    assert ended == []
    go_on.set()
    wait_for_jobs(10)
    assert ended == [True]


def test_a_job_that_outlives_qt_ends_without_a_word(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[Any] = []
    monkeypatch.setattr(threading, "excepthook", told.append)
    parent, go_on = QObject(), threading.Event()
    background = Background(parent)
    monkeypatch.setattr(background, "_outcomes", type(background._outcomes)())
    background.run(lambda: go_on.wait(10))
    shiboken6.delete(background._outcomes)
    ended = threading.Event()
    ended.set()
    monkeypatch.setattr("study_app.gui.widgets.background._program_ends", ended)
    go_on.set()
    assert background.wait(10)
    assert told == []


@pytest.mark.slow
def test_a_role_goes_with_its_widget(qtbot: Any) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    for number in range(600):
        made = label(f"Heading {number}", "card")
        made.setParent(window)
        child = QAccessible.queryAccessibleInterface(window).child(0)
        assert child.role() == QAccessible.Role.Heading
        made.setParent(None)
        made.deleteLater()
        QTest.qWait(0)


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0"), (-20.0, "−20"), (10_000.0, "10\u2009000"), (-1234.5, "−1\u2009234.5")]
)
def test_a_tick_has_a_minus_sign_and_thin_spaces(value: float, text: str) -> None:
    assert tick_text(value) == text


def test_a_clamped_text_is_replaced_and_its_tip_has_what_was_left_out(qtbot: Any) -> None:
    clamped = Clamped("Honey", 2)
    qtbot.addWidget(clamped)
    clamped.show()
    clamped.resize(90, 60)
    assert (clamped.text(), clamped.toolTip()) == ("Honey", "")
    long = "Glycerin with a little more water than in the block before, at a delay of 35 ms"
    clamped.show_text(long)
    shown = clamped.text().splitlines()
    assert len(shown) == 2
    assert shown[0].startswith("Glycerin")
    assert shown[1].endswith("…")
    assert clamped.accessibleName() == long
    assert "35 ms" in clamped.toolTip()
