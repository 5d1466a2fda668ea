"""What a check of a folder finds, gathered while it goes on where an error would stop."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from study_app.errors import StoreError


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing found, and where: a path in the study folder."""

    place: str
    message: str

    def __str__(self) -> str:
        return f"{self.place}: {self.message}"


class Gathered:
    """Findings so far: ``errors`` are files that cannot be trusted as they are, ``warnings`` something to know."""

    def __init__(self, folder: Path) -> None:
        self.errors: list[Finding] = []
        self.warnings: list[Finding] = []
        self._folder = folder

    def alike(self) -> Gathered:
        """Return findings of the same folder, with nothing found."""
        return Gathered(self._folder)

    def take(self, others: Gathered) -> None:
        """Add what others found."""
        self.errors += others.errors
        self.warnings += others.warnings

    def error(self, path: Path, message: str) -> None:
        """Add what makes ``path`` untrustworthy."""
        self.errors.append(Finding(self._name(path), message))

    def failure(self, path: Path, error: StoreError) -> None:
        """Add an error that stopped us reading ``path``, which is named once."""
        self.error(path, str(error).removeprefix(str(path)).lstrip(" ,:/"))

    def warning(self, path: Path, message: str) -> None:
        """Add what should be known of ``path``."""
        self.warnings.append(Finding(self._name(path), message))

    @contextlib.contextmanager
    def reading(self, path: Path) -> Iterator[None]:
        """Turn an error of reading within this block into a finding about ``path``, and continue after the block."""
        try:
            yield
        except StoreError as error:
            self.failure(path, error)

    def _name(self, path: Path) -> str:
        inside = path.is_relative_to(self._folder) and path != self._folder
        return path.relative_to(self._folder).as_posix() if inside else "."
