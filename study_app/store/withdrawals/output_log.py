"""Where this machine's user wrote tables, figures and reports of a study: what a withdrawal must reach.

A line for every output in ``outputs.jsonl`` of the program's data folder. Results folders hold no such list: reading
them never changes them.
"""

import contextlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Final

from study_app.errors import StoreError
from study_app.store.atomic import append_line, cannot_write
from study_app.store.journals.parsing import parse_json
from study_app.store.output_files import FileCopy, write_files
from study_app.user_folder import data_folder

NAME: Final = "outputs.jsonl"


@dataclass(frozen=True, slots=True)
class Output:
    """Files of a study's results, written into the folder ``to`` at ``at`` (wall time with its zone)."""

    to: Path
    at: str
    files: tuple[str, ...]

    @property
    def paths(self) -> tuple[Path, ...]:
        """Those of its files that are still there."""
        return tuple(path for name in self.files if (path := self.to / name).is_file())


def write_output(study: Path, to: Path, files: Mapping[str, bytes | FileCopy]) -> tuple[Path, ...]:
    """Write ``files`` of the results in ``study`` into the folder ``to`` (as `write_files`), and note where they are.

    Raises
    ------
    AnalysisError
        They cannot be written; nothing was.
    """
    written = write_files(to, files)
    at = datetime.now().astimezone().isoformat(timespec="seconds")
    line = {"study": str(study.resolve()), "to": str(to.resolve()), "at": at, "files": [*files]}
    with contextlib.suppress(StoreError, OSError):  # the files are there; a list that cannot be written stops nobody
        data_folder().mkdir(parents=True, exist_ok=True)
        append_line(data_folder() / NAME, json.dumps(line, ensure_ascii=False).encode() + b"\n", waits=False)
    return written


def outputs(study: Path) -> tuple[Output, ...]:
    """Return the noted outputs of a study's results, one for each folder and set of files, the newest last."""
    found: dict[tuple[str, tuple[str, ...]], Output] = {}
    for line in _lines():
        try:
            held = parse_json(line)
            if held["study"] == str(study.resolve()):
                names = tuple(map(str, held["files"]))
                found[held["to"], names] = Output(Path(held["to"]), str(held["at"]), names)
        except (ValueError, KeyError, TypeError):  # a torn line
            continue
    return tuple(found.values())


def erase_outputs(study: Path, within: Path) -> tuple[tuple[Path, ...], tuple[Output, ...]]:
    """Delete the noted outputs of a study below the folder ``within``; return the files, and the outputs elsewhere.

    Raises
    ------
    StoreError
        A file cannot be deleted.
    """
    erased: list[Path] = []
    elsewhere: list[Output] = []
    for output in outputs(study):
        if not output.to.is_relative_to(within.resolve()):
            elsewhere.append(output)
            continue
        for path in output.paths:
            try:
                path.unlink()
            except OSError as error:
                raise cannot_write(path, error) from error
            erased.append(path)
    return tuple(erased), tuple(elsewhere)


def _lines() -> list[bytes]:
    try:
        return (data_folder() / NAME).read_bytes().splitlines()
    except OSError:
        return []
