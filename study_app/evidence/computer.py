"""The computer on which times are measured: its description, and the load during a measurement.

``app.delay_session`` provides the windows.
"""

import os
import platform
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final, Literal, Protocol, TypeAlias, TypeVar

import numba
import numpy as np


def machine() -> str:
    """Return a description of the machine for reported times: processor, cores, system and versions."""
    name = platform.processor() or platform.machine()
    cpus = Path("/proc/cpuinfo")
    if cpus.exists():
        lines = cpus.read_text(encoding="utf-8", errors="replace").splitlines()
        name = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), name)
    versions = f"Python {platform.python_version()}, numpy {np.__version__}, numba {numba.__version__}"
    return f"{name}, {os.cpu_count()} cores, {platform.system()}, {versions}"


LoadName: TypeAlias = Literal["none", "gui", "gui+cpu"]

_T = TypeVar("_T")

_BUSY: Final = """\
import os, sys, threading
threading.Thread(target=lambda: (sys.stdin.read(), os._exit(0)), daemon=True).start()
while True:
    sum(range(100_000))
"""  # ends when this program closes the pipe or ends; on Windows a process cannot detect that by its parent's ID


class Windows(Protocol):
    """Access to the GUI thread for a measurement.

    ``during`` runs ``work`` in another thread while this one runs the event loop, and returns or raises its result.
    ``timer`` is a timer of the GUI thread for ``work``; ``frames`` counts the painted frames.
    """

    @property
    def frames(self) -> int: ...
    def timer(self, period_ms: int, count: int, fire: Callable[[], object]) -> int: ...
    def during(self, work: Callable[[], _T]) -> _T: ...


def under_load(load: LoadName, windows: Windows | None, work: Callable[[], _T]) -> _T:
    """Run ``work`` under a load and return its result; ``windows``, if any, are kept open in this thread meanwhile."""
    if windows is None:
        return work()
    if load == "gui+cpu":
        with busy_cores():
            return windows.during(work)
    return windows.during(work)


@contextmanager
def busy_cores(count: int | None = None) -> Iterator[None]:
    """Keep every core busy with a Python process; the processes end when this one does."""
    command = [sys.executable, "-S", "-c", _BUSY]
    processes = [subprocess.Popen(command, stdin=subprocess.PIPE) for _ in range(count or os.cpu_count() or 1)]  # noqa: S603 - a fixed command
    try:
        yield
    finally:
        for process in processes:
            process.terminate()
        for process in processes:
            process.communicate()
