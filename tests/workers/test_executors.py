"""Local processes: independent cases; interrupts, killed workers and a killed program change and leave nothing."""

import contextlib
import errno
import os
import signal
import subprocess
import sys
import textwrap
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import psutil
import pytest

from study_app.errors import PlugInError, Problem, ProtocolError, StudyError, WorkerError
from study_app.workers.executors import Workers, open_executor
from study_app.workers.server import CONTEXT
from tests.plug_in_packages import forget_plug_ins, install
from tests.workers.worker_cases import die, draw, loaded, refuse, refuse_file

pytestmark = pytest.mark.slow

SOON_S = 60.0
posix = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


@pytest.fixture(params=[1, 2, None, "cluster"])
def workers(request: pytest.FixtureRequest) -> Workers:
    if request.param != "cluster":
        return Workers(request.param)
    return Workers(cluster=request.getfixturevalue("dask_cluster"))


def test_results_are_those_of_the_seeds_in_their_order_and_an_error_is_that_of_its_case(workers: Workers) -> None:
    with open_executor(workers) as executor:
        assert isinstance(executor, Executor)
        assert list(executor.map(draw, range(20))) == [draw(seed) for seed in range(20)]
        futures = [executor.submit(refuse, case) for case in range(6)]
        with pytest.raises(StudyError, match="case 3"):
            futures[3].result()
        assert [future.result() for future in futures[:3]] == [0, 1, 2]
        with pytest.raises(ProtocolError, match=r"a\.toml: 1 problem\n  line 7: blocks\.b: is unknown") as error:
            executor.submit(refuse_file, 7).result()
        assert error.value.problems == (Problem("blocks.b", "is unknown", 7, hint="did you mean c?"),)
        assert executor.submit(draw, 1).result() == draw(1)
    with pytest.raises(Exception if workers.cluster else RuntimeError, match=r"shutdown|Client is closed"):
        executor.submit(draw, 1)


def test_a_process_loads_no_window_library_and_computes_in_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    with open_executor(Workers(1)) as executor:
        assert executor.submit(loaded, 0).result() == (False, "1")


@posix
def test_a_case_that_kills_its_process_is_one_clear_line() -> None:
    with (
        pytest.raises(WorkerError, match="a worker process ended unexpectedly") as error,
        open_executor(Workers(2)) as executor,
    ):
        list(executor.map(die, range(4)))
    assert "\n" not in str(error.value)


def test_a_plug_in_that_fails_in_a_case_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install(tmp_path, "toy-plug", "method", {"toy": "toy_plug:fail"}, toy_plug="def fail():\n    return 1 / 0\n")
    monkeypatch.syspath_prepend(tmp_path)
    fail = resolve_name("toy_plug:fail")
    with pytest.raises(PlugInError, match=r"toy-plug 1\.0 failed \(ZeroDivisionError"), open_executor() as executor:
        executor.submit(fail).result()
    forget_plug_ins("toy_plug")


@posix
def test_a_process_that_cannot_be_started_is_one_clear_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_process: Any) -> None:
        raise BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")

    monkeypatch.setattr(CONTEXT.Process, "start", fail)
    with pytest.raises(WorkerError, match="or could not be started"), open_executor(Workers(2)) as executor:
        executor.submit(draw, 1).result()


@pytest.mark.parametrize("workers", [1, "cluster"], indirect=True)
def test_an_exception_cancels_the_cases_that_have_not_finished(workers: Workers) -> None:
    waiting: list[Future[float]] = []

    def interrupted() -> None:
        with open_executor(workers) as executor:
            waiting.extend(executor.submit(draw, seed) for seed in range(300 if workers.cluster else 20_000))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    finished = []
    for future in waiting:
        with contextlib.suppress(CancelledError, BrokenExecutor):
            finished.append(future.result(SOON_S))
    assert len(finished) < len(waiting)


ENDLESS = """
    import os, signal, sys, time
    from study_app.workers.executors import Workers, open_executor
    from tests.workers.worker_cases import report_and_wait

    if __name__ == "__main__":
        signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
        try:
            with open_executor(Workers(2)) as executor:
                list(executor.map(report_and_wait, range(8)))
        except KeyboardInterrupt:
            print("interrupted", flush=True)
            sys.exit(130)
"""


@posix
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL], ids=["interrupted", "killed"])
def test_processes_end_with_their_program_and_print_no_traceback(number: int) -> None:
    """Ctrl+C reaches every process of the terminal; a kill reaches only the program."""
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
