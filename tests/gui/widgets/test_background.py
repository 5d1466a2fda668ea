"""Jobs beside the window's thread."""

import threading

from PySide6.QtCore import QObject

from study_app.gui.widgets.background import Background, wait_for_jobs


def test_only_the_newest_of_what_was_asked_for_comes(qtbot):
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


def test_the_end_of_the_program_waits_for_jobs_but_not_for_ever():
    parent = QObject()
    background, go_on, ended = Background(parent), threading.Event(), []
    background.run(lambda: ended.append(go_on.wait(10)))
    wait_for_jobs(0.01)
    assert ended == []
    go_on.set()
    wait_for_jobs(10)
    assert ended == [True]
