"""An examination in a worker process: what it says, and that it can be ended at any time."""

import multiprocessing
import time

import pytest

from study_app.devices.doctor import Report
from study_app.devices.doctor_worker import start_examination
from study_app.workers.server import Crashed, Refused
from tests.compiled import needs_servo

pytestmark = [pytest.mark.slow, needs_servo]


@pytest.fixture
def begin():
    """Return what begins an examination; each is closed."""
    begun = []

    def made(*words, **options):
        begun.append(start_examination(*words, **options))
        return begun[-1]

    yield made
    for one in begun:
        one.close()
        one.wait_until_ended()
    assert not [child for child in multiprocessing.active_children() if child.name == "examination"]


def answers_to_the_last(examination, most_s=120.0):
    """Return all answers, of which the last is no line."""
    told, end = [], time.perf_counter() + most_s
    while not told or isinstance(told[-1], str):
        assert time.perf_counter() < end, told
        told += [answer for _, answer in examination.answers(wait_s=0.1)]
    return told


def test_it_tells_its_lines_and_then_what_was_found(begin):
    examination = begin("falcon-emulated", faults=("never-homes",))
    told = answers_to_the_last(examination)
    assert all(isinstance(line, str) for line in told[:-1])
    assert isinstance(told[-1], Report)
    assert [finding.id for finding in told[-1].found] == ["stroke-in"]
    assert examination.answers() == []


def test_what_is_no_falcon_is_told_in_a_sentence(begin):
    (refused,) = answers_to_the_last(begin("mouse"))
    assert isinstance(refused, Refused)
    assert "the doctor command does not support 'mouse'" in refused.sentence


def test_a_process_that_dies_is_told(begin):
    examination = begin("falcon-emulated")
    examination.process.kill()
    *_, crashed = answers_to_the_last(examination)
    assert crashed == Crashed(-9)
    assert crashed.sentence == "the process was ended by signal 9"
