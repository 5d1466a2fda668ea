"""Executors: independent cases, whichever engine; interrupts, killed workers and a killed program leave nothing."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import textwrap
from concurrent.futures import Executor, Future
from pathlib import Path

import psutil
import pytest

from study_app.errors import WorkerError
from study_app.workers.executors import ENGINES, Engine, open_executor

pytestmark = pytest.mark.slow

SOON_S = 60.0
posix = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


def draw(seed: int) -> float:
    """Return the result of a seeded case."""
    return random.Random(seed).random()  # noqa: S311 - not for cryptography


def die(_case: int) -> None:
    """End the process as a kill does."""
    os.kill(os.getpid(), signal.SIGKILL)


def loaded(_case: int) -> tuple[bool, str]:
    """Return whether Qt is loaded, and how many threads linear algebra may use."""
    return "PySide6" in sys.modules, os.environ["OMP_NUM_THREADS"]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("workers", [1, 2, -1])
def test_results_are_those_of_the_seeds_in_their_order(engine: Engine, workers: int) -> None:
    with open_executor(engine, workers) as executor:
        assert isinstance(executor, Executor)
        assert list(executor.map(draw, range(20))) == [draw(seed) for seed in range(20)]


def test_a_process_loads_no_window_library_and_computes_in_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    with open_executor("processes", 1) as executor:
        assert executor.submit(loaded, 0).result() == (False, "1")


@posix
def test_a_killed_process_is_one_clear_line() -> None:
    with (
        pytest.raises(WorkerError, match="a worker process ended unexpectedly") as told,
        open_executor("processes", 2) as executor,
    ):
        list(executor.map(die, range(4)))
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("engine", ENGINES)
def test_an_exception_cancels_the_cases_that_have_not_begun(engine: Engine) -> None:
    waiting: list[Future[float]] = []

    def interrupted() -> None:
        with open_executor(engine, 1) as executor:
            waiting.extend(executor.submit(draw, seed) for seed in range(20_000))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert any(future.cancelled() or future.exception() is not None for future in waiting)
    assert all(future.done() for future in waiting)


ENDLESS = """
    import os, signal, sys, time
    from study_app.workers.executors import open_executor
    from tests.workers.test_executors import report_and_wait
    if __name__ == "__main__":
        signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
        try:
            with open_executor("processes", 2) as executor:
                list(executor.map(report_and_wait, range(8)))
        except KeyboardInterrupt:
            print("interrupted", flush=True)
            sys.exit(130)
"""


def report_and_wait(_case: int) -> None:
    """Print the process's number, and wait for a signal."""
    os.write(sys.stdout.fileno(), f"{os.getpid()}\n".encode())  # whole lines, whichever process is first
    signal.pause()


@posix
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL], ids=["interrupted", "killed"])
def test_processes_end_with_their_program_and_print_no_traceback(number: int) -> None:
    """Ctrl+C reaches every process of the terminal; a kill reaches the program alone."""
    program = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(ENDLESS)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        cwd=Path(__file__).parents[2],
    )
    assert program.stdout is not None
    workers = [psutil.Process(int(program.stdout.readline())) for _ in range(2)]
    if number == signal.SIGINT:
        os.killpg(program.pid, number)
    else:
        program.kill()
    out, err = program.communicate(timeout=SOON_S)
    assert psutil.wait_procs(workers, timeout=SOON_S)[1] == []
    assert "Traceback" not in err
    if number == signal.SIGINT:
        assert program.returncode == 130
        assert out.splitlines()[-1] == "interrupted"
