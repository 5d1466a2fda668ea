import os
import sys
import threading
import time
from pathlib import Path

import pytest

from study_app.workers.shared_tasks import SharedTasks
from tests.haptics.running import wait_until

only_linux = pytest.mark.skipif(sys.platform != "linux", reason="only Linux forks")


@pytest.fixture
def without_other_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threading, "active_count", lambda: 1)


@only_linux
def test_two_processes_share_the_tasks_and_results_keep_their_order(without_other_threads: None) -> None:
    def compute(number: int) -> tuple[int, int, bytes]:
        time.sleep(0.05)
        return number, os.getpid(), b"\x89PNG" * 100_000

    progress_calls: list[tuple[int, int, bytes]] = []
    results = SharedTasks([lambda number=number: compute(number) for number in range(12)]).results(
        progress_calls.append
    )
    assert [number for number, _, _ in results] == list(range(12))
    assert len({process for _, process, _ in results}) == 2
    assert {process for _, process, _ in progress_calls} == {os.getpid()}
    assert [number for number, _, _ in progress_calls] == list(range(len(progress_calls)))


@only_linux
def test_unfinished_tasks_of_a_dying_process_are_computed_here(without_other_threads: None, tmp_path: Path) -> None:
    here, died = os.getpid(), tmp_path / "died"

    def compute(number: int) -> int:
        if os.getpid() != here:
            died.touch()
            os._exit(9)
        return number

    shared = SharedTasks([lambda number=number: compute(number) for number in range(3)])
    wait_until(died.exists)
    assert shared.results() == [0, 1, 2]


@only_linux
def test_an_exception_here_ends_the_other_process(without_other_threads: None, tmp_path: Path) -> None:
    other = tmp_path / "other"
    here = os.getpid()

    def compute() -> None:
        if os.getpid() != here:
            other.write_text(f"{os.getpid()}", "ascii")
            time.sleep(60)

    def stop(_: None) -> None:
        raise InterruptedError

    shared = SharedTasks([compute, compute])
    wait_until(lambda: other.exists() and other.read_text("ascii"))
    with pytest.raises(InterruptedError):
        shared.results(stop)
    with pytest.raises(ProcessLookupError):
        os.kill(int(other.read_text("ascii")), 0)


def test_a_program_with_threads_is_not_forked() -> None:
    end = threading.Event()
    other = threading.Thread(target=end.wait)
    other.start()
    try:
        assert SharedTasks([os.getpid, os.getpid]).results() == [os.getpid()] * 2
    finally:
        end.set()
        other.join()
