"""A description of the computer on which times were measured."""

import os
import platform
from pathlib import Path

import numba
import numpy as np


def machine() -> str:
    """Return the environment of the times: processor, cores, system, versions."""
    name = platform.processor() or platform.machine()
    cpus = Path("/proc/cpuinfo")
    if cpus.exists():
        lines = cpus.read_text(encoding="utf-8", errors="replace").splitlines()
        name = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), name)
    versions = f"Python {platform.python_version()}, numpy {np.__version__}, numba {numba.__version__}"
    return f"{name}, {os.cpu_count()} cores, {platform.system()}, {versions}"
