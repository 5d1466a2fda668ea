"""Files and folders handed to the user: all of them whole, or none."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from pathlib import Path

from study_app.errors import AnalysisError, StoreError
from study_app.store.atomic import sweep_old, temporary_path, write_through


def write_files(to: Path, files: Mapping[str, bytes]) -> tuple[Path, ...]:
    """Put ``files`` (name to content) into the folder ``to``, which is created; older files of these names give way.

    All are written under temporary names and flushed to the disk before the first takes its name, so that a full disk
    changes nothing. What a killed program left half-written there is taken away at the end, when it is old.

    Raises
    ------
    AnalysisError
        The folder cannot be written, or a file would lie outside of it; it is as before.
    """
    for name in files:
        if not (to / name).resolve().is_relative_to(to.resolve()):
            raise AnalysisError(f"{name!r} would be written outside of {to}: nothing was written")
    staged = {name: temporary_path(to / name) for name in files}
    within = sorted({folder for path in staged.values() for folder in (path.parent, *path.parent.parents)})
    created = [folder for folder in within if folder.is_relative_to(to) and not folder.exists()]
    try:
        to.mkdir(parents=True, exist_ok=True)
        for folder in created:
            folder.mkdir(exist_ok=True)
        for name, content in files.items():
            write_through(staged[name], content)
        for name, path in staged.items():
            path.replace(to / name)
    except OSError as error:
        for path in staged.values():
            with contextlib.suppress(OSError):
                path.unlink(missing_ok=True)
        for folder in reversed(created):
            with contextlib.suppress(OSError):
                folder.rmdir()
        why = "it is a file, not a folder" if to.is_file() else error.strerror or type(error).__name__
        raise AnalysisError(
            f"{to} cannot be written ({why}): choose another folder with --to, free disk space, or correct the "
            "permissions"
        ) from error
    for folder in {path.parent for path in staged.values()}:
        sweep_old(folder)
    return tuple(to / name for name in files)


def make_folder(to: Path) -> None:
    """Make the folder for reports before the work begins, not minutes or days after.

    Raises
    ------
    StoreError
        It cannot be made.
    """
    try:
        to.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        why = "it is a file, not a folder" if to.is_file() else error.strerror or error
        raise StoreError(f"cannot make the folder {to} ({why}): choose another with --to") from error
