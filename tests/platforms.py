"""Conditions of the operating system that tests need."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from study_app.gui.display_check import missing_window_library

needs_window_system = pytest.mark.skipif(bool(missing_window_library()), reason=missing_window_library())


def _can_link() -> bool:
    """Return whether this user can make links: Windows demands a right, and Wine makes none without an error."""
    with tempfile.TemporaryDirectory() as folder:
        link = Path(folder, "link")
        with suppress(OSError, NotImplementedError):
            link.symlink_to(folder)
        return link.is_symlink()


needs_links = pytest.mark.skipif(not _can_link(), reason="this user cannot make links")
needs_posix = pytest.mark.skipif(os.name != "posix", reason="POSIX")
needs_fork = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs processes that fork")


@contextmanager
def files_up_to(size: int) -> Iterator[None]:
    """Let the system refuse to write any file of this process beyond so many bytes, as a full disk does."""
    resource = pytest.importorskip("resource", reason="sizes of files are limited through the resource module")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
