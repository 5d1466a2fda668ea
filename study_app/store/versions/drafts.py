"""Drafts: unsaved edits, stored within a second.

A draft is one file in the user's data folder, written atomically. If two programs edit one study, each stores the
other's draft as a version before it writes its own.
"""

import json
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, TypeAlias

from study_app.errors import StoreError
from study_app.store.files.atomic import parse_json
from study_app.store.versions.study_versions import file_key, keep_version, write_whole
from study_app.user_folder import data_folder

REST_S: Final = 0.25
"""Time from the first unsaved edit to the writing of a draft [s]."""
_Selection: TypeAlias = tuple[str | int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Draft:
    """A study's text that is not saved.

    Attributes
    ----------
    text : str
        The text.
    base : str
        `content_hash` of the file that was edited; "" if there was none.
    selected : tuple of str or int
        The path that was selected.
    kept_at : str
        The time of writing, as ISO 8601 with the time zone.
    """

    text: str
    base: str
    selected: _Selection = ()
    kept_at: str = ""


class Keeper:
    """Writes the draft of one study at most `REST_S` after an edit, even if edits continue.

    ``others`` counts the drafts of other programs that were stored as versions.
    """

    def __init__(self, file: Path, base: str) -> None:
        self.base = base
        self.others = 0
        self._file = file
        self._own: str | None = None
        self._pending: Draft | None = None
        self._obsolete = False
        self._due_s = 0.0

    def resume_from(self, draft: Draft) -> None:
        """Continue from an existing draft."""
        self._own = draft.text

    def note_edit(self, text: str, selected: _Selection, now_s: float) -> None:
        """Note an edit at a time of a monotonic clock [s]."""
        if self._pending is None:
            self._due_s = now_s + REST_S
        self._pending = Draft(text=text, base=self.base, selected=selected)

    def write_if_due(self, now_s: float) -> bool:
        """Write the draft if it is due, or delete one that could not be deleted; return whether it was written.

        Raises
        ------
        StoreError
            The draft cannot be written or deleted; it stays due.
        """
        return (self._pending is None or now_s >= self._due_s) and self.write()

    def write(self) -> bool:
        """Write a pending draft at once, such as on leaving the view; return whether there was one.

        Raises
        ------
        StoreError
            The draft cannot be written or deleted; it stays due.
        """
        if self._pending is None:
            if self._obsolete:
                self._delete_own_draft()
            return False
        other = draft_of(self._file)
        if other is not None and other.text not in {self._own, self._pending.text}:
            keep_version(self._file, other.text.encode(), "draft")
            self.others += 1
        write_draft(self._file, self._pending)
        self._own, self._pending, self._obsolete = self._pending.text, None, False
        return True

    def note_saved(self, base: str) -> None:
        """Delete the draft after its text was saved, unless another program wrote it.

        If that fails, deletion stays due and `write` raises the error.
        """
        self.base, self._pending, self._obsolete = base, None, True
        with suppress(StoreError):
            self._delete_own_draft()

    def _delete_own_draft(self) -> None:
        other = draft_of(self._file)
        if other is None or other.text == self._own:
            delete_draft(self._file)
        self._own, self._obsolete = None, False


def write_draft(file: Path, draft: Draft) -> None:
    """Write the draft of a study's file.

    Raises
    ------
    StoreError
        The draft cannot be written.
    """
    path = _draft_file(file)
    record = {
        "file": str(file.resolve()),
        "base": draft.base,
        "selected": list(draft.selected),
        "kept_at": datetime.now(UTC).astimezone().isoformat(timespec="seconds"),
        "text": draft.text,
    }
    write_whole(path, json.dumps(record, ensure_ascii=False).encode())


def draft_of(file: Path) -> Draft | None:
    """Return the draft of a study's file, or None if there is no readable draft."""
    try:
        record: Any = parse_json(_draft_file(file).read_bytes())
        selected = tuple(step for step in record["selected"] if isinstance(step, str | int))
        draft = Draft(text=record["text"], base=record["base"], selected=selected, kept_at=record["kept_at"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return draft if all(isinstance(value, str) for value in (draft.text, draft.base, draft.kept_at)) else None


def drafted_files() -> tuple[Path, ...]:
    """Return the files that have a readable draft, sorted."""
    files: list[Path] = []
    for path in draft_files():
        try:
            file = Path(parse_json(path.read_bytes())["file"])
        except (OSError, ValueError, KeyError, TypeError):
            continue
        if draft_of(file) is not None:
            files.append(file)
    return tuple(sorted(files))


def draft_files() -> tuple[Path, ...]:
    """Return the paths of all draft files."""
    return tuple((data_folder() / "drafts").glob("*.json"))


def unsaved_files(folder: Path) -> tuple[Path, ...]:
    """Return the study files in a folder that exist only as a draft."""
    resolved = folder.resolve()
    return tuple(file for file in drafted_files() if file.parent == resolved and not file.exists())


def delete_draft(file: Path) -> None:
    """Delete the draft of a study's file.

    Raises
    ------
    StoreError
        The draft cannot be deleted.
    """
    try:
        _draft_file(file).unlink(missing_ok=True)
    except OSError as error:
        raise StoreError(f"the draft of {file} cannot be deleted: {error.strerror}") from error


def _draft_file(file: Path) -> Path:
    return data_folder() / "drafts" / f"{file_key(file)}.json"
