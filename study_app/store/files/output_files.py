"""Files and folders written for the user, all or none, and the list of outputs made from a study's results.

A withdrawal must also reach the files that the user of this machine made from the results. ``outputs.jsonl`` in the
program's data folder therefore has a line for every output. It is not in the results folder, which reading must not
change.
"""

import contextlib
import hashlib
import json
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Final, NamedTuple

from study_app.errors import AnalysisError, StoreError
from study_app.store.files.atomic import (
    append_line,
    cannot_write,
    flush_file,
    make_folder,
    move,
    open_regular,
    parse_json,
    remove_old_temporary_files,
    sync_folder,
    system_message,
    temporary_path,
    write_all,
    write_new_file,
)
from study_app.user_folder import data_folder

_CHUNK_BYTES: Final = 1 << 20
NAME: Final = "outputs.jsonl"


class FileCopy(NamedTuple):
    """A file to copy in chunks, since it may exceed the memory, with its expected SHA-256."""

    source: Path
    sha256: str


def write_files(to: Path, files: Mapping[str, bytes | FileCopy]) -> tuple[Path, ...]:
    """Write ``files`` (name → content) into the folder ``to``, which is created; replace older files.

    All are written under temporary names and flushed before the first is renamed, so that neither a full disk nor a
    file that another program has open changes anything. Old temporary files of killed programs are removed at the end.

    Raises
    ------
    AnalysisError
        The folder cannot be written, a file would lie outside of it, or one to copy cannot be read or has another
        SHA-256; the folder is as before.
    """
    for name in files:
        if not (to / name).resolve().is_relative_to(to.resolve()):
            raise AnalysisError(f"{name!r} would be written outside {to}: nothing was written")
    staged = {name: temporary_path(to / name) for name in files}
    folders = sorted({parent for path in staged.values() for parent in (path.parent, *path.parent.parents)})
    created = [parent for parent in folders if parent.is_relative_to(to) and not parent.exists()]
    try:
        to.mkdir(parents=True, exist_ok=True)
        for parent in created:
            parent.mkdir(exist_ok=True)
        for name, content in files.items():
            if isinstance(content, FileCopy):
                with staged[name].open("xb", buffering=0) as file:
                    for chunk in _read_chunks(content):
                        write_all(file, chunk)
                    flush_file(file.fileno())
            else:
                write_new_file(staged[name], content)
        for name in files:
            _refuse_open_file(to / name)
        for name, path in staged.items():
            move(path, to / name)
    except (OSError, AnalysisError) as error:
        for path in staged.values():
            with contextlib.suppress(OSError):
                path.unlink(missing_ok=True)
        for parent in reversed(created):
            with contextlib.suppress(OSError):
                parent.rmdir()
        if isinstance(error, AnalysisError):
            raise
        reason = "it is a file, not a folder" if to.is_file() else error.strerror or type(error).__name__
        raise AnalysisError(
            f"{to} cannot be written ({reason}): choose another folder with --to, free disk space, or correct the "
            "permissions"
        ) from error
    for parent in {path.parent for path in staged.values()}:
        remove_old_temporary_files(parent)
    return tuple(to / name for name in files)


def _refuse_open_file(path: Path) -> None:
    """Raise an error if another program has the file open: Windows then does not rename it, even to its own name."""
    if path.exists():
        try:
            move(path, path)
        except PermissionError as error:
            raise AnalysisError(
                f"{path} cannot be replaced ({system_message(error)}): close the program that has it open, or choose "
                "another folder with --to; nothing was written"
            ) from error


def _read_chunks(copied: FileCopy) -> Iterator[bytes]:
    """Yield the content of a file in chunks; errors name this file, not the target folder."""
    digest = hashlib.sha256()
    try:
        with open_regular(copied.source, largest_bytes=math.inf) as file:
            while chunk := file.read(_CHUNK_BYTES):
                digest.update(chunk)
                yield chunk
    except OSError as error:
        raise AnalysisError(
            f"{copied.source} cannot be read ({system_message(error)}): nothing was written; correct its permissions, "
            "or restore it from a backup"
        ) from error
    if digest.hexdigest() != copied.sha256:
        raise AnalysisError(
            f"{copied.source} changed while it was being copied: nothing was written; repeat the command"
        )


@dataclass(frozen=True, slots=True)
class Output:
    """Files of a study's results, written into the folder ``to`` at ``at`` (wall time with its zone)."""

    to: Path
    at: str
    files: tuple[str, ...]

    @property
    def paths(self) -> tuple[Path, ...]:
        """The files of this output that still exist."""
        return tuple(path for name in self.files if (path := self.to / name).is_file())


def write_output(
    study: Path, to: Path, files: Mapping[str, bytes | FileCopy], warn: Callable[[str], object] | None = None
) -> tuple[Path, ...]:
    """Write ``files`` made from the results in ``study`` into the folder ``to`` with `write_files`, and list them.

    If the list cannot be updated, ``warn`` is called: a withdrawal would not find the files.

    Raises
    ------
    AnalysisError
        The files cannot be written; nothing was written.
    """
    paths = write_files(to, files)
    at = datetime.now().astimezone().isoformat(timespec="seconds")
    line = {"study": str(study.resolve()), "to": str(to.resolve()), "at": at, "files": [*files]}
    try:
        make_folder(data_folder(), waits=False)
        append_line(data_folder() / NAME, json.dumps(line).encode() + b"\n", waits=False)
    except StoreError as error:
        if warn is not None:
            warn(
                f"the output in {to} could not be added to the list of outputs ({error}), so the withdraw command "
                "will not list it: keep a note of the folder"
            )
    return paths


def outputs(study: Path) -> tuple[Output, ...]:
    """Return the listed outputs of a study's results, one for each folder and set of files, the newest last."""
    latest: dict[tuple[str, tuple[str, ...]], Output] = {}
    try:
        lines = (data_folder() / NAME).read_bytes().splitlines()
    except OSError:
        lines = []
    for line in lines:
        try:
            record = parse_json(line)
            if record["study"] == str(study.resolve()):
                names = tuple(map(str, record["files"]))
                latest[record["to"], names] = Output(Path(record["to"]), str(record["at"]), names)
        except (ValueError, KeyError, TypeError):  # a partly written line
            continue
    return tuple(latest.values())


def erase_outputs(study: Path, within: Path) -> tuple[tuple[Path, ...], tuple[Output, ...]]:
    """Delete a study's listed outputs below the folder ``within``; return these files, and the outputs elsewhere."""
    erased: list[Path] = []
    elsewhere: list[Output] = []
    for output in outputs(study):
        if not output.to.is_relative_to(within.resolve()):
            elsewhere.append(output)
            continue
        for path in output.paths:
            try:
                path.unlink()
                sync_folder(path.parent)
            except OSError as error:
                raise cannot_write(path, error) from error
            erased.append(path)
    return tuple(erased), tuple(elsewhere)
