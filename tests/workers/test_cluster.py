"""A Dask cluster of two worker processes: the same results, killed workers, and one line where there is none."""

import re
import sys
from functools import partial
from pathlib import Path

import psutil
import pytest

from study_app.cli import main
from study_app.errors import WorkerError
from study_app.workers import cases
from study_app.workers.cases import environment
from study_app.workers.executors import Workers, open_executor
from tests.strangers import ends_with_each
from tests.workers.local_cluster import INSTALLED, MISSING, local_cluster
from tests.workers.worker_cases import draw, killed_once

pytestmark = pytest.mark.slow
needs_distributed = pytest.mark.skipif(not INSTALLED, reason=MISSING)
posix = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


@pytest.mark.nightly
@needs_distributed
@posix
def test_killed_workers_do_not_change_results_and_a_lost_scheduler_is_one_line(tmp_path: Path) -> None:
    """Four of forty cases kill their worker the first time; then the scheduler and its workers are killed."""
    with local_cluster() as (address, scheduler):
        with open_executor(Workers(cluster=address)) as executor:
            assert list(executor.map(partial(killed_once, tmp_path), range(40))) == [draw(seed) for seed in range(40)]

        def lost() -> None:
            with open_executor(Workers(cluster=address)) as executor:
                futures = [executor.submit(draw, seed) for seed in range(2000)]
                assert futures[0].result() == draw(0)
                for process in (*scheduler.children(recursive=True), scheduler):
                    process.kill()
                for future in futures:
                    future.result()

        with pytest.raises(WorkerError, match=f"the cluster at {address} is no longer available") as error:
            lost()
        assert "\n" not in str(error.value)
        assert not psutil.pid_exists(scheduler.pid) or scheduler.status() == psutil.STATUS_ZOMBIE


def test_a_worker_with_another_library_or_program_refuses_its_cases() -> None:
    compute = cases._compute
    assert compute(environment(), draw, (3,), {}) == draw(3)
    with pytest.raises(WorkerError, match=r"numpy \S+ instead of 1\.0; scipy") as error:
        compute({**environment(), "numpy": "1.0", "scipy": "0.1"}, draw, (3,), {})
    assert "\n" not in str(error.value)
    with pytest.raises(WorkerError, match=r"liquid-study \S+ \(\w{16}\) instead of 0\.1\.0 \(another\)"):
        compute({**environment(), "liquid-study": "0.1.0 (another)"}, draw, (3,), {})


def test_the_digest_of_a_program_is_of_names_and_contents_of_its_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "protocols").mkdir()
    monkeypatch.setattr(cases, "_PACKAGE", tmp_path)
    digests = []
    for name, content in (("a.py", "1"), ("b.py", "1"), ("b.py", "2"), ("b.txt", "2"), ("c.txt", "3")):
        file = tmp_path / name
        file.write_text(content, encoding="utf-8", newline="\n")
        digests.append(environment.__wrapped__()["liquid-study"])
        file.unlink()
    assert len(set(digests)) == 4
    assert digests[3] == digests[4]  # what is no part of the program


def test_another_program_at_the_address_of_a_cluster_is_one_line_in_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cases, "CONNECT_S", 0.5)

    def client(port: int) -> str:
        with pytest.raises(WorkerError) as error:
            open_executor(Workers(cluster=f"tcp://127.0.0.1:{port}"))
        return str(error.value)

    messages = ends_with_each(client, at_once=True)
    why = r"\((timed out|another program is listening there)\)"
    line = rf"no Dask scheduler responds at tcp://127.0.0.1:\d+ {why}: start one"
    assert [outcome for outcome in messages.items() if not re.match(line, outcome[1])] == []


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("localhost", "'localhost' is not the address of a Dask scheduler: specify tcp://HOST:PORT"),
        ("http://127.0.0.1:8786", "specify tcp://HOST:PORT"),
        ("tcp://127.0.0.1:port", "specify tcp://HOST:PORT"),
        ("tcp://127.0.0.1:99999", "no Dask scheduler responds at tcp://127.0.0.1:99999"),
        ("tcp://127.0.0.1:1", "(Connection refused)"),
        ("tcp://no-such-host.invalid:8786", "no Dask scheduler responds at tcp://no-such-host.invalid:8786"),
    ],
)
def test_an_unreachable_cluster_is_one_line_and_exit_code_2(
    address: str, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["liquid-study", "power", "rek2024", "--cluster", address])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line


@needs_distributed
def test_one_line_names_the_missing_extra(dask_cluster: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(WorkerError, match=r"pip install 'liquid-study\[cluster\]'"):
        open_executor(Workers(cluster=dask_cluster))
