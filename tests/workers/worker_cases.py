"""Cases for executors: worker processes import them by name."""

import os
import random
import signal
import sys
from pathlib import Path

from study_app.errors import Problem, ProtocolError, StudyError


def draw(seed: int) -> float:
    """Return the result of a seeded case."""
    return random.Random(seed).random()  # noqa: S311 - not for cryptography


def killed_once(folder: Path, seed: int) -> float:
    """Return the result of a seeded case; the process of every tenth is killed the first time."""
    try:
        (folder / str(seed)).touch(exist_ok=False)
    except FileExistsError:
        return draw(seed)
    if seed % 10 == 5:
        os.kill(os.getpid(), signal.SIGKILL)
    return draw(seed)


def refuse_file(line: int) -> None:
    """Raise the error of a protocol file with a problem in this line."""
    raise ProtocolError("a.toml", (Problem("blocks.b", "is unknown", line, hint="did you mean c?"),))


def die(_case: int) -> None:
    """End the process as a kill does."""
    os.kill(os.getpid(), signal.SIGKILL)


def refuse(case: int) -> int:
    """Fail where the case is 3."""
    if case == 3:
        raise StudyError("case 3 cannot be computed")
    return case


def loaded(_case: int) -> tuple[bool, str]:
    """Return whether Qt is loaded, and how many threads linear algebra may use."""
    return "PySide6" in sys.modules, os.environ["OMP_NUM_THREADS"]


def report_and_wait(_case: int) -> None:
    """Print the process's number, and wait for a signal."""
    os.write(sys.stdout.fileno(), f"{os.getpid()}\n".encode())  # whole lines, whichever process is first
    signal.pause()
