"""An examination in a worker process: its messages, and that it can be ended at any time."""

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
    """Return a function that starts examinations; each is closed after the test."""
    examinations = []

    def start(*words, **options):
        examinations.append(start_examination(*words, **options))
        return examinations[-1]

    yield start
    for examination in examinations:
        examination.close()
        examination.wait_until_ended()
    assert not [child for child in multiprocessing.active_children() if child.name == "examination"]


def answers_to_the_last(examination, most_s=120.0):
    """Return all answers up to the first that is not a line."""
    answers, end = [], time.perf_counter() + most_s
    while not answers or isinstance(answers[-1], str):
        assert time.perf_counter() < end, answers
        answers += [answer for _, answer in examination.answers(wait_s=0.1)]
    return answers


def test_an_examination_sends_its_lines_and_then_its_report(begin):
    examination = begin("falcon-emulated", faults=("never-homes",))
    answers = answers_to_the_last(examination)
    assert all(isinstance(line, str) for line in answers[:-1])
    assert isinstance(answers[-1], Report)
    assert [finding.id for finding in answers[-1].found] == ["stroke-in"]
    assert examination.answers() == []


def test_an_unsupported_device_is_refused_in_one_sentence(begin):
    (refused,) = answers_to_the_last(begin("mouse"))
    assert isinstance(refused, Refused)
    assert "the doctor command does not support 'mouse'" in refused.sentence


def test_a_dying_process_is_reported(begin):
    examination = begin("falcon-emulated")
    examination.process.kill()
    *_, crashed = answers_to_the_last(examination)
    assert crashed == Crashed(-9)
    assert crashed.sentence == "the process was ended by signal 9"
