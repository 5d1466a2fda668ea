"""A worker process answers orders piece by piece, stops when asked to, and a crash is an answer too."""

import json
import multiprocessing
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import psutil
import pytest

from study_app.errors import StudyError
from study_app.workers import client as clients
from study_app.workers.client import WorkerClient
from study_app.workers.server import Crashed, Refused, Send, Stop, Stopped
from tests.plug_in_packages import install

SOON_S = 60.0


def carry_out(order: str, send: Send, stop: Stop) -> object:
    """Carry out a test order."""
    send(f"{order} begun")
    match order:
        case "refuse":
            raise StudyError("it cannot be done")
        case "mistake":
            raise ZeroDivisionError
        case "plug-in":
            resolve_name("toy_plug:fail")()
        case "die":
            os.kill(os.getpid(), signal.SIGKILL)
        case "wait":
            while not stop():
                threading.Event().wait(0.01)
            raise Stopped("given up")
        case "ignore":
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            send("deaf")
            threading.Event().wait()
        case "loaded":
            return sorted({"PySide6", "numba", "pandas"} & sys.modules.keys())
        case "priority":
            return psutil.Process().nice()
    return order


class Tried(WorkerClient[str, Any]):
    """A client that keeps all answers."""

    def __init__(self, **options: Any) -> None:
        super().__init__("tests.workers.test_client:carry_out", name="tried", **options)
        self.kept: list[tuple[int, Any]] = []

    def answers(self, wait_s: float = 0.0) -> list[tuple[int, Any]]:
        new_answers = super().answers(wait_s)
        self.kept += new_answers
        return new_answers


@pytest.fixture
def start() -> Iterator[Callable[..., Tried]]:
    """Return a function that starts a worker; close all workers and check that their processes end."""
    workers_started: list[Tried] = []

    def made(**options: Any) -> Tried:
        workers_started.append(Tried(**options))
        return workers_started[-1]

    yield made
    for worker in workers_started:
        worker.close()
        worker.wait_until_ended()
        assert worker.ended
    assert not [child for child in multiprocessing.active_children() if child.name == "tried"]


def answers_until(worker: Tried, number: int, wanted: Callable[[Any], bool]) -> list[Any]:
    """Return the answers to an order up to the first ``wanted`` one."""
    end_s = time.perf_counter() + SOON_S
    while True:
        answers = [answer for of_number, answer in worker.kept if of_number == number]
        if answers and wanted(answers[-1]):
            return answers
        assert time.perf_counter() < end_s, answers
        worker.answers(wait_s=0.1)


def is_last(answer: Any) -> bool:
    return not isinstance(answer, str) or " " not in answer


@pytest.mark.slow
def test_orders_are_carried_out_one_after_the_other_and_a_refusal_is_a_sentence(start: Callable[..., Tried]) -> None:
    worker = start()
    first, refused_order, last = (worker.order(order) for order in ("first", "refuse", "last"))
    answers_until(worker, last, is_last)
    assert worker.kept == [
        (first, "first begun"),
        (first, "first"),
        (refused_order, "refuse begun"),
        (refused_order, Refused("it cannot be done")),
        (last, "last begun"),
        (last, "last"),
    ]
    assert worker.works


@pytest.mark.slow
def test_a_failing_plug_in_is_named_and_the_worker_continues(
    start: Callable[..., Tried], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(tmp_path, "toy-plug", "method", {"toy": "toy_plug:fail"}, toy_plug="def fail():\n    return 1 / 0\n")
    monkeypatch.syspath_prepend(tmp_path)
    worker = start()
    (*_, last_answer) = answers_until(worker, worker.order("plug-in"), is_last)
    assert isinstance(last_answer, Refused)
    assert last_answer.sentence.startswith("the plug-in toy-plug 1.0 failed (ZeroDivisionError: division by zero)")
    assert worker.works


@pytest.mark.slow
@pytest.mark.parametrize("how", ["stop", "another order"])
def test_an_order_is_given_up_when_that_is_asked_for_or_another_comes(start: Callable[..., Tried], how: str) -> None:
    worker = start()
    waiting = worker.order("wait")
    answers_until(worker, waiting, lambda answer: answer == "wait begun")
    for _ in range(100):  # a pipe holds some 64 kB; a process that is busy reads orders all the same
        following = worker.order("x" * 10_000) if how == "another order" else worker.stop()
    assert answers_until(worker, waiting, is_last) == ["wait begun", Refused("given up", stopped=True)]
    following = following or worker.order("x" * 10_000)
    assert answers_until(worker, following, is_last)[-1] == "x" * 10_000


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize(("order", "exit_code", "words"), [("die", -9, "signal 9"), ("mistake", 1, "exit code 1")])
def test_a_process_that_ends_answers_every_order_once_with_how_it_ended(
    start: Callable[..., Tried], order: str, exit_code: int, words: str
) -> None:
    worker = start()
    first, second = worker.order(order), worker.order("next")
    answers_until(worker, second, is_last)
    assert worker.kept == [(first, f"{order} begun"), (first, Crashed(exit_code)), (second, Crashed(exit_code))]
    assert words in Crashed(exit_code).sentence
    assert worker.answers() == []
    assert not worker.works
    third = worker.order("to nobody")
    assert worker.answers() == [(third, Crashed(exit_code))]


@pytest.mark.slow
def test_a_process_that_does_not_listen_is_killed(start: Callable[..., Tried], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clients, "PATIENCE_S", 0.05)
    worker = start()
    answers_until(worker, worker.order("ignore"), lambda answer: answer == "deaf")
    monkeypatch.setattr(
        worker.process, "kill", threading.Timer(0.2, worker.process.kill).start
    )  # it dies a little later
    worker.close()
    assert not worker.works
    worker.wait_until_ended()
    assert worker.ended
    worker.order("to nobody")
    assert worker.answers() == []


def test_a_process_loads_only_the_modules_of_its_task_and_may_have_the_lowest_priority(
    start: Callable[..., Tried],
) -> None:
    worker = start(background=True)
    assert answers_until(worker, worker.order("loaded"), is_last)[-1] == []
    if sys.platform != "win32":
        assert answers_until(worker, worker.order("priority"), is_last)[-1] == 19


PROGRAM = """
    import signal, sys, threading
    from study_app.workers.client import WorkerClient
    signal.signal(signal.SIGINT, lambda *_: sys.exit(130))
    worker = WorkerClient("tests.workers.test_client:carry_out", name="tried")
    number = worker.order("wait")
    while (number, "wait begun") not in worker.answers(wait_s=0.1):
        pass
    print(worker.process.pid, flush=True)
    threading.Event().wait()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("interrupted", [True, False], ids=["interrupted", "killed"])
@pytest.mark.slow
def test_a_worker_ends_with_its_program_and_prints_no_traceback(interrupted: bool) -> None:
    program = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(PROGRAM)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        cwd=Path(__file__).parents[2],
    )
    assert program.stdout is not None
    worker = psutil.Process(json.loads(program.stdout.readline()))
    if interrupted:
        os.killpg(program.pid, signal.SIGINT)
    else:
        program.kill()
    _, err = program.communicate(timeout=SOON_S)
    assert psutil.wait_procs([worker], timeout=SOON_S)[1] == []
    assert err == ""
