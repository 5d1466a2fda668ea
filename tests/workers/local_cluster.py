"""A Dask cluster of two worker processes: prints its address, and ends with its standard input.

It is a program of its own, so that what it logs is not in the log of the tests.
"""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import psutil

INSTALLED = find_spec("distributed") is not None
MISSING = "the extra cluster (distributed) is not installed"
ROOT = Path(__file__).parents[2]


@contextmanager
def local_cluster() -> Iterator[tuple[str, psutil.Process]]:
    """Start the cluster; yield the address of its scheduler, and the process that is the scheduler."""
    program = subprocess.Popen(
        [sys.executable, "-m", "tests.workers.local_cluster"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert program.stdin is not None
    assert program.stdout is not None
    processes = [psutil.Process(program.pid)]
    try:
        address = program.stdout.readline().strip()
        processes += processes[0].children(recursive=True)
        yield address, processes[0]
        processes += processes[0].children(recursive=True) if processes[0].is_running() else []
    finally:
        program.stdin.close()
        program.stdout.close()
        for process in psutil.wait_procs(processes, timeout=10)[1]:
            process.kill()
        program.wait()


def main() -> None:
    """Serve until standard input ends."""
    import dask
    from distributed import LocalCluster

    # Idle, its processes would look at themselves 50 and 100 times a second until the last test has ended.
    dask.config.set({"distributed.worker.profile.enabled": False, "distributed.admin.tick.interval": "500ms"})
    with LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, worker_dashboard_address=None
    ) as cluster:
        print(cluster.scheduler_address, flush=True)  # noqa: T201 - its one line
        sys.stdin.read()


if __name__ == "__main__":
    main()
