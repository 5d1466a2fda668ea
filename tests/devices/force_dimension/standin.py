"""The stand-in for Force Dimension's library, built by the C compiler, and its own functions for tests."""

import ctypes
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

COMPILER: Any = shutil.which("cc")
SOURCE = Path(__file__).with_name("standin.c")
needs_standin = [
    pytest.mark.skipif(COMPILER is None, reason="no C compiler ('cc') is installed"),
    pytest.mark.skipif(sys.platform == "win32", reason="the stand-in is built with the options of a POSIX compiler"),
]

FAULTS = (
    "none",
    "no-device",
    "uncalibrated",
    "no-threshold",
    "weak",
    "stays-off",
    "error",
    "nan",
    "turns-off",
    "slow",
    "guarded",
    "write-error",
    "saturated",
    "status-error",
    "hangs",
    "unwatched",
    "deaf",
    "unmodelled",
    "plain",
)
"""In the order of the stand-in's enumeration."""


def build(folder: Path, *options: str) -> Path:
    library = folder / "libdrd-standin.so"
    command = [COMPILER, "-std=c11", "-D_POSIX_C_SOURCE=200809L", "-Wall", "-Werror", "-shared", "-fPIC", *options]
    subprocess.run([*command, SOURCE, "-o", library, "-lm"], check=True)
    return library


class StandIn:
    """The stand-in's own functions, for tests."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.loaded = ctypes.CDLL(str(path))  # the same instance that the driver loads

    def fault(self, name: str) -> None:
        self.loaded.standin_fault(FAULTS.index(name))

    def rotate(self, rotation: Any) -> None:
        self.loaded.standin_rotate((ctypes.c_double * 9)(*np.ravel(rotation)))

    @property
    def state(self) -> dict[str, Any]:
        out = (ctypes.c_double * 15)()
        self.loaded.standin_state(out)
        names = ("force_on", "open", "closed", "stopped", "time_guard", "watchdog", "gravity", "readings")
        return {"force_n": list(out[:3]), "torque": list(out[3:6]), "grip": out[6]} | dict(
            zip(names, out[7:], strict=True)
        )
