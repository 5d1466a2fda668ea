"""Drafts: what was edited and not saved, kept within a second; and saving a study's file.

A draft is one file in the user's data folder, written whole or not at all. Only `save` writes the protocol file.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, TypeAlias

from study_app.errors import StoreError
from study_app.store.atomic import write_file
from study_app.user_folder import data_folder

REST_S: Final = 0.5
"""A draft is written so long after the first edit that it does not hold [s]."""
Selection: TypeAlias = tuple[str | int, ...]


@dataclass(frozen=True, slots=True)
class Draft:
    """A study's text that is not saved.

    Attributes
    ----------
    text : str
        The text.
    base : str
        `content_hash` of the file that was edited; "" where there was none.
    selected : tuple of str or int
        The path that was selected.
    kept_at : str
        When it was written, as ISO 8601 with the time zone.
    """

    text: str
    base: str
    selected: Selection = ()
    kept_at: str = ""


class Keeper:
    """Keeps the draft of one study: at most `REST_S` after an edit, however fast edits follow each other."""

    def __init__(self, file: Path, base: str) -> None:
        self._file = file
        self._base = base
        self._pending: Draft | None = None
        self._due_s = 0.0

    def edited(self, text: str, selected: Selection, now_s: float) -> None:
        """Note an edit at a time of a monotonic clock [s]."""
        if self._pending is None:
            self._due_s = now_s + REST_S
        self._pending = Draft(text, self._base, selected)

    def write_if_due(self, now_s: float) -> bool:
        """Write the draft if it is due; return whether it was written.

        Raises
        ------
        StoreError
            It cannot be written; it stays due.
        """
        return self._pending is not None and now_s >= self._due_s and self.write()

    def write(self) -> bool:
        """Write what is pending at once, as on leaving the place; return whether there was something.

        Raises
        ------
        StoreError
            It cannot be written; it stays due.
        """
        if self._pending is None:
            return False
        keep(self._file, self._pending)
        self._pending = None
        return True

    def saved(self, base: str) -> None:
        """Forget the draft: the file holds it."""
        self._base, self._pending = base, None
        discard(self._file)


def content_hash(content: bytes) -> str:
    """Return the SHA-256 of a file's content, in hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def keep(file: Path, draft: Draft) -> None:
    """Write the draft of a study's file.

    Raises
    ------
    StoreError
        It cannot be written.
    """
    path = _draft_file(file)
    kept = {
        "file": str(file.resolve()),
        "base": draft.base,
        "selected": list(draft.selected),
        "kept_at": datetime.now(UTC).astimezone().isoformat(timespec="seconds"),
        "text": draft.text,
    }
    _write(path, json.dumps(kept, ensure_ascii=False).encode())


def draft_of(file: Path) -> Draft | None:
    """Return the draft of a study's file; None where there is none that can be read."""
    try:
        kept: Any = json.loads(_draft_file(file).read_bytes())
        selected = tuple(step for step in kept["selected"] if isinstance(step, str | int))
        draft = Draft(kept["text"], kept["base"], selected, kept["kept_at"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return draft if all(isinstance(one, str) for one in (draft.text, draft.base, draft.kept_at)) else None


def drafted_files() -> tuple[Path, ...]:
    """Return the files that have a draft, sorted; a draft that cannot be read has none."""
    found: list[Path] = []
    for kept in (data_folder() / "drafts").glob("*.json"):
        try:
            file = Path(json.loads(kept.read_bytes())["file"])
        except (OSError, ValueError, KeyError, TypeError):
            continue
        if draft_of(file) is not None:
            found.append(file)
    return tuple(sorted(found))


def discard(file: Path) -> None:
    """Delete the draft of a study's file.

    Raises
    ------
    StoreError
        It cannot be deleted.
    """
    try:
        _draft_file(file).unlink(missing_ok=True)
    except OSError as error:
        raise StoreError(f"the draft of {file} cannot be deleted: {error.strerror}") from error


class ChangedOutsideError(StoreError):
    """The file is not the one that was edited; nothing was written."""


def save(file: Path, text: str, base: str) -> str:
    """Write a study's file in one step and return its hash; its previous content is kept (`kept_content`).

    Parameters
    ----------
    file : Path
        The protocol file; its permissions stay, and a link stays a link.
    text : str
        The whole text, with its own line breaks.
    base : str
        `content_hash` of the content that the text was edited from; "" for a new file.

    Raises
    ------
    ChangedOutsideError
        The file has another content than ``base``, or is already there.
    StoreError
        It cannot be written.
    """
    target = file.resolve()
    mode = None
    if target.exists():
        content, mode = _content(target), target.stat().st_mode & 0o777
        if content_hash(content) != base:
            raise ChangedOutsideError(f"{file} was changed by another program: compare it with the edits, then choose")
        keep_content(content)
    elif base:
        raise ChangedOutsideError(f"{file} was deleted or moved by another program: save it as another study")
    source = text.encode()
    _write(target, source)
    if mode is not None:
        target.chmod(mode)
    keep_content(source)
    return content_hash(source)


def keep_content(content: bytes) -> None:
    """Keep one content of a study's file by its hash.

    Raises
    ------
    StoreError
        It cannot be written.
    """
    path = _content_file(content_hash(content))
    if not path.exists():
        _write(path, content)


def kept_content(hash_: str) -> bytes | None:
    """Return the content of a hash; None where none was kept, or it was changed since."""
    try:
        content = _content_file(hash_).read_bytes()
    except OSError:
        return None
    return content if content_hash(content) == hash_ else None


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise StoreError(f"{path} cannot be read: {error.strerror}") from error


def _write(path: Path, content: bytes) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(f"{path.parent} cannot be made: {error.strerror}") from error
    write_file(path, content)


def _draft_file(file: Path) -> Path:
    name = content_hash(str(file.resolve()).encode("utf-8", "surrogatepass"))
    return data_folder() / "drafts" / f"{name[:32]}.json"


def _content_file(hash_: str) -> Path:
    return data_folder() / "contents" / f"{hash_}.toml"
