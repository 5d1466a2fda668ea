"""What is known of a study beside its file: of which study it is a copy, and how it is looked at.

It is looked at in a language of the preview and with a number of simulated participants where the file plans others.
These settings are kept with drafts and versions in the user's data folder; they change no protocol.
"""

import contextlib
import json
from pathlib import Path
from typing import Any, Literal, TypeAlias

from study_app.authoring.versions.contents import file_key, write_whole
from study_app.errors import StoreError
from study_app.store.journals.parsing import parse_json
from study_app.user_folder import data_folder

Setting: TypeAlias = Literal["participants", "language", "copy_of"]


def kept_participants(file: Path) -> int | None:
    """Return how many participants a study is simulated with; None if none is kept, or it cannot be read."""
    number = _kept(file).get("participants")
    return number if isinstance(number, int) and not isinstance(number, bool) else None


def kept_language(file: Path) -> str:
    """Return the language in which a study's pages are shown; "" where none is kept."""
    return _kept_text(file, "language")


def kept_original(file: Path) -> str:
    """Return the name of the study that a study was copied from; "" where it is not known to be a copy."""
    return _kept_text(file, "copy_of")


def keep_setting(file: Path, name: Setting, value: int | str | None) -> None:
    """Keep a setting for a study's file, None for the usual one; where it cannot be written, it is not kept."""
    others = {key: one for key, one in _kept(file).items() if key not in {"file", name}}
    if value is not None:
        others[name] = value
    if not others:
        forget_settings(file)
        return
    with contextlib.suppress(StoreError, OSError):
        write_whole(_kept_file(file), json.dumps({"file": str(file.resolve()), **others}).encode())


def begin_settings(file: Path, copy_of: str = "") -> None:
    """Forget the settings of another study that had this file, and keep which study it is a copy of."""
    forget_settings(file)
    keep_setting(file, "copy_of", copy_of or None)


def forget_settings(file: Path) -> None:
    """Forget the settings of another study that had this file."""
    with contextlib.suppress(OSError):
        _kept_file(file).unlink(missing_ok=True)


def _kept_text(file: Path, name: Setting) -> str:
    text = _kept(file).get(name)
    return text if isinstance(text, str) else ""


def _kept(file: Path) -> dict[str, Any]:
    try:
        kept: Any = parse_json(_kept_file(file).read_bytes())
    except (OSError, ValueError):
        return {}
    return kept if isinstance(kept, dict) else {}


def _kept_file(file: Path) -> Path:
    return data_folder() / "settings" / f"{file_key(file)}.json"
