"""An examination in a process of its own: what it says, and that it can be ended at any time."""

from __future__ import annotations

import multiprocessing
import time

import pytest

from study_app.devices.doctor_report import Report
from study_app.devices.falcon.doctor.worker import ENDED, Examination
from study_app.errors import StudyError
from tests.compiled import needs_servo

pytestmark = needs_servo


@pytest.fixture
def begin():
    """Return what begins an examination; each is closed."""
    begun = []

    def made(*words, **options):
        begun.append(Examination(*words, **options))
        return begun[-1]

    yield made
    for one in begun:
        one.close()
    assert not [child for child in multiprocessing.active_children() if child.name == "examination"]


def wait_for(examination, what, most_s=120.0):
    """Return all that is said until ``what`` holds of it."""
    told, end = [], time.monotonic() + most_s
    while not what(told):
        assert time.monotonic() < end, told
        told += examination.said()
        multiprocessing.connection.wait([examination._connection], timeout=0.1) if not examination.over else None
    return told


def test_it_tells_its_lines_and_then_what_was_found(begin):
    examination = begin("falcon-emulated", faults=("never-homes",))
    told = wait_for(examination, lambda said: said and not isinstance(said[-1], str))
    assert all(isinstance(line, str) for line in told[:-1])
    assert isinstance(told[-1], Report)
    assert [finding.id for finding in told[-1].found] == ["stroke-in"]
    assert examination.over
    assert examination.said() == []


def test_what_is_no_falcon_is_told_in_a_sentence(begin):
    (error,) = wait_for(begin("mouse"), lambda said: said)
    assert isinstance(error, StudyError)
    assert "'mouse' is none" in str(error)


def test_it_can_be_cancelled_before_it_says_anything(begin):
    examination = begin("falcon-emulated")
    examination.cancel()
    assert examination.said() == []
    examination._process.join(30)
    assert examination.gone


def test_a_process_that_dies_is_told(begin):
    examination = begin("falcon-emulated")
    examination._process.kill()
    (error,) = wait_for(examination, lambda said: said)
    assert str(error) == ENDED
