import os
import sys
import threading
import time

import pytest

from study_app.workers.shared_tasks import SharedTasks

only_linux = pytest.mark.skipif(sys.platform != "linux", reason="only Linux forks")


@pytest.fixture
def without_other_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threading, "active_count", lambda: 1)


@only_linux
def test_two_processes_share_the_tasks_and_results_keep_their_order(without_other_threads: None) -> None:
    def compute(number: int) -> tuple[int, int, bytes]:
        time.sleep(0.05)
        return number, os.getpid(), b"\x89PNG" * 100_000

    told: list[tuple[int, int, bytes]] = []
    results = SharedTasks([lambda number=number: compute(number) for number in range(12)]).results(told.append)
    assert [number for number, _, _ in results] == list(range(12))
    assert len({process for _, process, _ in results}) == 2
    assert {process for _, process, _ in told} == {os.getpid()}
    assert [number for number, _, _ in told] == list(range(len(told)))


@only_linux
def test_what_a_dying_process_leaves_is_computed_here(without_other_threads: None) -> None:
    here = os.getpid()
    tasks = [lambda number=number: number if os.getpid() == here else os._exit(9) for number in range(3)]
    shared = SharedTasks(tasks)
    time.sleep(0.2)  # the other process has begun the last task
    assert shared.results() == [0, 1, 2]


def test_a_program_with_threads_is_not_forked() -> None:
    end = threading.Event()
    other = threading.Thread(target=end.wait)
    other.start()
    try:
        assert SharedTasks([os.getpid, os.getpid]).results() == [os.getpid()] * 2
    finally:
        end.set()
        other.join()
