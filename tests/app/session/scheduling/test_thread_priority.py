"""The windows' thread goes before other programs while it is asked to, and is one among others again after that."""

import os
import sys
import threading

import pytest

from study_app.app.session import thread_priority
from study_app.app.session.thread_priority import ThreadPriority

if sys.platform != "linux":
    pytest.skip("levels of Linux", allow_module_level=True)


def level():
    return os.getpriority(os.PRIO_PROCESS, threading.get_native_id())


@pytest.fixture
def kept():
    before = level()
    if before < 0:
        pytest.skip("this thread goes before others already")
    yield before
    if level() < before:
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), before)


def test_it_raises_and_restores_its_priority(kept):
    made = ThreadPriority()
    if not made.raise_priority():
        pytest.skip("this user may not")
    assert level() == thread_priority.NICE
    made.restore()
    assert level() == kept
    made.restore()
    assert level() == kept


def test_who_may_not_asks_the_desktops_service(kept, monkeypatch):
    asked = []

    def refuse(_which, _who, _level):
        raise PermissionError

    monkeypatch.setattr(os, "setpriority", refuse)
    monkeypatch.setattr(thread_priority, "make_high_priority", lambda *given: asked.append(given))
    assert ThreadPriority().raise_priority()
    assert asked == [(threading.get_native_id(), thread_priority.NICE)]


def test_where_nobody_grants_it_nothing_breaks(kept, monkeypatch):
    def refuse(*_given):
        raise PermissionError

    monkeypatch.setattr(os, "setpriority", refuse)
    monkeypatch.setattr(thread_priority, "make_high_priority", refuse)
    made = ThreadPriority()
    assert not made.raise_priority()
    made.restore()
    assert level() == kept
