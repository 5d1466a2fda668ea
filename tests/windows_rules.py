"""The restrictions of Windows on files, for tests on other systems."""

import io
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

LONGEST_PATH = 259  # characters; the 260th ends the text
LONGEST_FOLDER = 247  # leaves room for a name of 8 and 3 letters
RESERVED = {"con", "prn", "aux", "nul", *(f"{port}{number}" for port in ("com", "lpt") for number in range(1, 10))}


def is_valid_on_windows(name: str) -> bool:
    """Return whether Windows can have a file or folder with this name, by Microsoft's rules for file names."""
    stem = name.partition(".")[0].rstrip(" ").lower()
    return stem not in RESERVED and name[-1:] not in {".", " "} and not set(name) & set('<>:"/\\|?*')


class Windows:
    """The files that other programs have open, with their refused changes; ``calls`` limits refusals."""

    def __init__(self) -> None:
        self.held: dict[Path, int] = {}
        self.refused: list[Path] = []
        self.shared: set[Path] = set()

    @contextmanager
    def hold(self, path: Path, calls: int = 10_000, *, shared: bool = False) -> Iterator[None]:
        """Mark ``path`` as open in another program, as Excel does, for a maximum number of refusals.

        A ``shared`` file can be written by others, too, as those of Python can.
        """
        self.held[path.resolve()] = calls
        if shared:
            self.shared.add(path.resolve())
        try:
            yield
        finally:
            self.held.pop(path.resolve(), None)

    def check(self, *paths: Any, longest: int = LONGEST_PATH, writes: bool = False) -> None:
        """Raise the error of Windows if one of the paths is, or contains, an open file, or cannot exist there."""
        for path in map(Path, paths):
            for name in path.resolve().relative_to(path.resolve().anchor).parts:
                if not is_valid_on_windows(name):
                    raise OSError(22, "Invalid argument", str(path))
            if len(str(path.resolve())) > longest:
                raise FileNotFoundError(2, "No such file or directory", str(path))
            for held in [held for held, calls in self.held.items() if calls and held.is_relative_to(path.resolve())]:
                if writes and held in self.shared:
                    continue
                self.held[held] -= 1
                self.refused.append(held)
                raise PermissionError(13, "Permission denied", str(path))


@pytest.fixture
def windows(monkeypatch: pytest.MonkeyPatch) -> Windows:
    """Refuse to rename, replace, delete or write files that another program has open, as Windows does."""
    rules = Windows()

    def check_calls_of(name: str, path_count: int) -> None:
        original: Callable[..., Any] = getattr(os, name)

        def call(*paths: Any, **kwargs: Any) -> Any:
            rules.check(*paths[:path_count], longest=LONGEST_FOLDER if name == "mkdir" else LONGEST_PATH)
            return original(*paths, **kwargs)

        monkeypatch.setattr(os, name, call)

    for name, path_count in (("rename", 2), ("replace", 2), ("unlink", 1), ("remove", 1), ("mkdir", 1)):
        check_calls_of(name, path_count)
    original_open = io.open

    def open_file(file: Any, mode: str = "r", *args: Any, **kwargs: Any) -> Any:
        if not isinstance(file, int) and set(mode) & set("wax+"):
            rules.check(file, writes=True)
        return original_open(file, mode, *args, **kwargs)

    original_os_open = os.open

    def open_descriptor(path: Any, flags: int, *args: Any, **kwargs: Any) -> int:
        if flags & (os.O_WRONLY | os.O_RDWR):
            rules.check(path, writes=True)
        return original_os_open(path, flags, *args, **kwargs)

    monkeypatch.setattr(os, "open", open_descriptor)
    monkeypatch.setattr(io, "open", open_file)
    monkeypatch.setattr("builtins.open", open_file)
    return rules
