"""Saving a study's file without overwriting another program's content; every content is kept under its hash."""

import contextlib
import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final, Literal, TypeAlias

from study_app.errors import StoreError
from study_app.store.files.atomic import (
    append_line,
    make_folder,
    parse_json,
    read_if_there,
    remove_old_temporary_files,
    write_file,
)
from study_app.store.integrity.folder_lock import lock_folder
from study_app.store.workstation import load_or_default
from study_app.user_folder import data_folder

_Origin: TypeAlias = Literal["saved", "found", "draft"]
"""Whether a content was saved by this program, found in the file on overwriting, or another program's draft."""
_ORIGINS: Final = frozenset({"saved", "found", "draft"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Kept:
    """A stored content of a study's file, identified by its hash; ``at`` is ISO 8601 with the time zone.

    ``by`` are the initials of the operator who saved it; "" if they are not known.
    """

    hash: str
    origin: _Origin
    at: str
    by: str = ""


class ChangedOutsideError(StoreError):
    """Another program has changed the file since it was read; nothing was written."""


def content_hash(content: bytes) -> str:
    """Return the SHA-256 of a file's content, in hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def file_key(file: Path) -> str:
    """Return the key of a study's file in the user's data folder."""
    return content_hash(str(file.resolve()).encode("utf-8", "surrogatepass"))[:32]


def save_study(file: Path, text: str, base: str) -> str:
    """Write a study's file in one step and return its hash; the previous content is stored (`kept_content`).

    Parameters
    ----------
    file : Path
        The protocol file; permissions and links are preserved.
    text : str
        The whole text with its line endings.
    base : str
        `content_hash` of the content that the text was edited from; "" for a new file.

    Raises
    ------
    ChangedOutsideError
        The content of the file differs from ``base``, or a new file already exists.
    StoreError
        The file cannot be written, or another program is saving it.
    """
    target, source = file.resolve(), text.encode()
    with _locked_file(file):
        remove_old_temporary_files(target.parent, target.name)
        mode = None
        if (content := read_if_there(target)) is not None:
            mode = target.stat().st_mode & 0o777
            if content_hash(content) != base:
                raise ChangedOutsideError(
                    f"{file} was changed by another program: compare it with your edits, then choose which to keep"
                )
            keep_version(file, content, "found")
        elif base:
            raise ChangedOutsideError(f"{file} was deleted or moved by another program: save it as another study")
        # before the file, so that an error always means that the file was not written
        keep_version(file, source, "saved")
        write_whole(target, source)
        if mode is not None:
            target.chmod(mode)
    return content_hash(source)


def keep_version(file: Path, content: bytes, origin: _Origin) -> None:
    """Store a content of a study's file by its hash and list it (`kept_versions`); a listed content is not changed.

    Raises
    ------
    StoreError
        It cannot be written.
    """
    keep_content(content)
    hash_ = content_hash(content)
    if any(version.hash == hash_ for version in kept_versions(file)):
        return
    line = {"hash": hash_, "origin": origin, "at": datetime.now(UTC).astimezone().isoformat(timespec="seconds")}
    if origin == "saved" and (by := load_or_default()[0].operator):
        line["by"] = by
    path = _list_file(file)
    make_folder(path.parent, waits=False)
    append_line(path, json.dumps(line).encode() + b"\n")


def kept_versions(file: Path) -> tuple[Kept, ...]:
    """Return the stored contents of a study's file, the oldest first; unreadable lines are left out."""
    return _listed_versions(_list_file(file))


def saver_of(hash_: str) -> str:
    """Return the initials of the operator who saved a content on this computer; "" if they are not known."""
    lists = sorted((data_folder() / "versions").glob("*.jsonl"))
    return next((version.by for path in lists for version in _listed_versions(path) if version.hash == hash_), "")


def _listed_versions(path: Path) -> tuple[Kept, ...]:
    try:
        lines = path.read_bytes().splitlines()
    except OSError:
        return ()
    versions: list[Kept] = []
    for line in lines:
        with contextlib.suppress(ValueError):
            record = parse_json(line)
            if isinstance(record, dict) and record.get("origin") in _ORIGINS:
                texts = {name: str(record.get(name, "")) for name in ("hash", "at", "by")}
                versions.append(Kept(origin=record["origin"], **texts))
    return tuple(versions)


def keep_content(content: bytes) -> None:
    """Store a content of a study's file by its hash.

    Raises
    ------
    StoreError
        It cannot be written.
    """
    path = _content_file(content_hash(content))
    if not path.exists():
        write_whole(path, content)


def kept_content(hash_: str) -> bytes | None:
    """Return the stored content with this hash; None if it was not stored or has changed since."""
    try:
        content = _content_file(hash_).read_bytes()
    except OSError:
        return None
    return content if content_hash(content) == hash_ else None


def write_whole(path: Path, content: bytes) -> None:
    """Write a file in one step, with the folder that it is in.

    Raises
    ------
    StoreError
        It cannot be written.
    """
    make_folder(path.parent, waits=False)
    write_file(path, content)


@contextlib.contextmanager
def _locked_file(file: Path) -> Iterator[None]:
    """Lock the file so that no other program saves it."""
    folder = data_folder() / "saving" / file_key(file)
    make_folder(folder, waits=False)
    try:
        lock = lock_folder(folder)
    except StoreError as error:
        raise StoreError(f"{file} cannot be saved while another program is saving it: try again ({error})") from error
    try:
        yield
    finally:
        lock.release()


def _list_file(file: Path) -> Path:
    return data_folder() / "versions" / f"{file_key(file)}.jsonl"


def _content_file(hash_: str) -> Path:
    return data_folder() / "contents" / f"{hash_}.toml"
