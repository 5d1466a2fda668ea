"""Local processes: independent cases; interrupts, killed workers and a killed program change and leave nothing."""

import errno
import logging
import os
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import psutil
import pytest

from study_app.errors import Problem, ProtocolError, StudyError, WorkerError
from study_app.workers import cases
from study_app.workers.cases import OLD_S, CancellingExecutor, KeptCases
from study_app.workers.executors import Workers, open_executor
from study_app.workers.server import CONTEXT
from tests.workers.worker_cases import counted_draw, die, draw, killed_once, loaded, refuse, refuse_file

pytestmark = pytest.mark.slow

SOON_S = 60.0
posix = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


@pytest.mark.parametrize("workers", [1, 2, None])
def test_results_are_those_of_the_seeds_in_their_order(workers: int | None) -> None:
    with open_executor(Workers(workers)) as executor:
        assert isinstance(executor, Executor)
        assert list(executor.map(draw, range(20))) == [draw(seed) for seed in range(20)]


def test_a_process_loads_no_window_library_and_computes_in_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    with open_executor(Workers(1)) as executor:
        assert executor.submit(loaded, 0).result() == (False, "1")


@posix
@pytest.mark.parametrize("workers", [1, 2])
def test_killed_processes_change_no_result(workers: int, tmp_path: Path) -> None:
    """Four of forty cases kill their process the first time."""
    with open_executor(Workers(workers)) as executor:
        assert list(executor.map(partial(killed_once, tmp_path), range(40))) == [draw(seed) for seed in range(40)]


@posix
def test_a_case_that_always_kills_its_process_is_one_clear_line() -> None:
    with (
        pytest.raises(WorkerError, match="a worker process ended unexpectedly 3 times") as raised,
        open_executor(Workers(2)) as executor,
    ):
        list(executor.map(die, range(4)))
    assert "\n" not in str(raised.value)


@posix
@pytest.mark.parametrize("failing", [1, 100])
def test_a_process_that_cannot_be_started_is_started_again_or_one_clear_line(
    failing: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[object] = []
    start = CONTEXT.Process.start

    def fail(process: Any) -> None:
        started.append(process)
        if len(started) <= failing:
            raise BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")
        start(process)

    monkeypatch.setattr(CONTEXT.Process, "start", fail)
    with open_executor(Workers(2)) as executor:
        found = [executor.submit(draw, seed) for seed in range(4)]
        if failing == 1:
            assert [one.result() for one in found] == [draw(seed) for seed in range(4)]
        else:
            with pytest.raises(WorkerError, match="or could not be started"):
                found[0].result()


def test_an_error_of_a_case_is_raised_where_its_result_is_asked_for() -> None:
    with open_executor(Workers(2)) as executor:
        futures = [executor.submit(refuse, case) for case in range(6)]
        with pytest.raises(StudyError, match="case 3"):
            futures[3].result()
        assert [future.result() for future in futures[:3]] == [0, 1, 2]
        with pytest.raises(ProtocolError, match=r"a\.toml: 1 problem\n  line 7: blocks\.b: is unknown") as refused:
            executor.submit(refuse_file, 7).result()
        assert refused.value.problems == (Problem("blocks.b", "is unknown", 7, "did you mean c?"),)
        assert executor.submit(draw, 1).result() == draw(1)
    with pytest.raises(RuntimeError, match="shut down"):
        executor.submit(draw, 1)


def test_an_exception_cancels_the_cases_that_have_not_finished() -> None:
    waiting: list[Future[float]] = []

    def interrupted() -> None:
        with open_executor(Workers(1)) as executor:
            waiting.extend(executor.submit(draw, seed) for seed in range(20_000))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert any(future.cancelled() for future in waiting)
    assert all(future.done() for future in waiting)


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


class Threads(CancellingExecutor):
    """One thread in place of processes."""

    workers = 1

    def __init__(self) -> None:
        self._executor = ThreadPoolExecutor(1)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        return self._executor.submit(fn, *args, **kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        self._executor.shutdown(wait, cancel_futures=cancel_futures)


@pytest.fixture
def computed(tmp_path: Path) -> Path:
    folder = tmp_path / "computed"
    folder.mkdir()
    return folder


@pytest.fixture
def store(tmp_path: Path) -> Path:
    return tmp_path / "cases"


def compute(store: Path, computed: Path, seeds: range, stop_after: int | None = None) -> KeptCases:
    """Compute seeds in their order; the first ``stop_after`` are finished when the computation is interrupted."""
    kept = KeptCases(Threads(), store)
    try:
        with kept:
            many = len(seeds) if stop_after is None else stop_after
            found = [kept.submit(partial(counted_draw, computed), seed).result() for seed in seeds[:many]]
            if stop_after is not None:
                interrupt()
            assert found == [draw(seed) for seed in seeds]
    except KeyboardInterrupt:
        assert stop_after is not None
    return kept


def interrupt() -> None:
    raise KeyboardInterrupt


def times(computed: Path) -> dict[int, int]:
    """Return how often each seed was computed."""
    return {int(path.name): len(path.read_text().splitlines()) for path in computed.iterdir()}


def files(store: Path) -> list[Path]:
    return sorted(store.rglob("*.cases"))


def test_an_interrupted_computation_continues_with_what_was_finished(store: Path, computed: Path) -> None:
    first = compute(store, computed, range(10), stop_after=4)
    assert (first.reused, first.stored) == (0, 4)
    second = compute(store, computed, range(10), stop_after=7)
    assert (second.reused, second.stored) == (4, 7)
    last = compute(store, computed, range(10))
    assert (last.reused, last.stored) == (7, 10)
    assert times(computed) == dict.fromkeys(range(10), 1)
    assert files(store) == []
    assert compute(store, computed, range(3)).reused == 0  # it had ended


def test_the_end_of_another_computation_removes_nothing(store: Path, computed: Path, tmp_path: Path) -> None:
    compute(store, computed, range(10), stop_after=4)
    assert compute(store, computed, range(100, 103)).reused == 0
    assert compute(store, tmp_path, range(4)).reused == 0  # other arguments
    assert compute(store, computed, range(10)).reused == 4


@pytest.mark.parametrize("cut", [0, 1, 30, 50])
def test_a_file_that_was_cut_or_changed_is_used_as_far_as_it_is_whole(store: Path, computed: Path, cut: int) -> None:
    compute(store, computed, range(10), stop_after=4)
    (file,) = files(store)
    content = bytearray(file.read_bytes())
    content[-3] ^= 1 if cut == 0 else 0
    file.write_bytes(content[: len(content) - cut])
    assert compute(store, computed, range(10)).reused == 3


def test_another_program_or_library_has_other_cases(
    store: Path, computed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compute(store, computed, range(10), stop_after=4)
    monkeypatch.setattr(cases, "environment_digest", lambda: "another")
    assert compute(store, computed, range(10)).reused == 0
    assert len(files(store)) == 1


def test_a_case_is_the_same_with_other_hashes() -> None:
    """A protocol holds sets of names, whose order differs from one start to the next."""
    program = (
        "from study_app.protocol.load import load; from study_app.workers.cases import _key_of;"
        "print(_key_of((load('viscosityjnd'), frozenset('abc'))).hex(), list(set('abcdefgh')))"
    )
    keys, orders = zip(
        *(
            subprocess.run(
                [sys.executable, "-c", program],
                capture_output=True,
                text=True,
                check=True,
                cwd=Path(__file__).parents[2],
                env={**os.environ, "PYTHONHASHSEED": seed},
            ).stdout.split(maxsplit=1)
            for seed in ("1", "2")
        ),
        strict=True,
    )
    assert orders[0] != orders[1]
    assert keys[0] == keys[1]


def test_cases_that_nothing_asked_for_in_a_month_are_removed(store: Path, computed: Path) -> None:
    compute(store, computed, range(4), stop_after=4)
    (file,) = files(store)
    for path in (file, file.parent):
        os.utime(path, (time.time() - OLD_S - 60,) * 2)
    assert compute(store, computed, range(4)).reused == 0
    assert not file.exists()


def test_without_a_folder_that_can_be_written_the_cases_are_computed(
    store: Path, computed: Path, caplog: pytest.LogCaptureFixture
) -> None:
    store.write_text("a file")
    with caplog.at_level(logging.CRITICAL, "study_app.workers.cases"):
        assert compute(store, computed, range(4)).stored == 0
    assert times(computed) == dict.fromkeys(range(4), 1)
