"""How this package compiles: one decorator, and one cache that no edit can leave stale.

numba keys its on-disk cache on the file of the outermost function alone, so a change in a function it calls would go
unseen. The cache therefore lives in a folder named after a digest of every source file that may hold kernels.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core.options import DefaultOptions

_PACKAGE = Path(__file__).resolve().parent.parent
_KERNEL_FOLDERS = ("haptics", "devices", "evaluation")

_OPTIONS: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
# numba's own name for it, which its stubs do not know; without it ticks are slower, and just as right.
_NO_MEMORY: dict[str, Any] = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}

F = TypeVar("F", bound=Callable[..., Any])


def _digest_of_sources() -> str:
    digest = hashlib.sha256()
    for folder in _KERNEL_FOLDERS:
        for source in sorted((_PACKAGE / folder).rglob("*.py")):
            digest.update(source.relative_to(_PACKAGE).as_posix().encode())
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _user_cache() -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")) / "liquid-study"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "liquid-study"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "liquid-study"


def _use_own_cache() -> None:
    folder = Path(os.environ.get("NUMBA_CACHE_DIR") or _user_cache()) / _digest_of_sources()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return  # numba then falls back to its own places; slower, never wrong within one run
    vars(numba.config)["CACHE_DIR"] = str(folder)


_use_own_cache()


def kernel(function: F) -> F:
    """Compile ``function`` for the servo: no interpreter lock, IEEE arithmetic, division by zero gives infinity.

    numba's memory management is off: code that would allocate does not compile, and arrays that are handed on are not
    counted, which took two thirds of a tick. They live as long as whoever called from Python holds them.
    """
    return cast(F, numba.njit(**_OPTIONS, **_NO_MEMORY)(function))


def part(function: F) -> F:
    """Compile ``function`` into each kernel that calls it: for the steps of a tick, which hand on whole models."""
    return cast(F, numba.njit(**_OPTIONS, **_NO_MEMORY, forceinline=True)(function))


def workings(function: F) -> F:
    """Compile ``function`` for evaluation, not for the servo: like `kernel`, but it may make arrays."""
    return cast(F, numba.njit(**_OPTIONS)(function))
