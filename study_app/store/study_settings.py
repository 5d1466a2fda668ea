"""Settings of a study outside its file: the study it is a copy of, and how it is displayed.

It is displayed in a language of the preview and with a number of simulated participants that may differ from the plan.
These settings are stored with drafts and versions in the user's data folder; they change no protocol.
"""

import contextlib
import json
from pathlib import Path
from typing import Any, Literal, TypeAlias

from study_app.errors import StoreError
from study_app.store.atomic import parse_json
from study_app.store.study_versions import file_key, write_whole
from study_app.user_folder import data_folder

Setting: TypeAlias = Literal["participants", "language", "copy_of"]


def kept_participants(file: Path) -> int | None:
    """Return the number of simulated participants of a study; None if it is not set, or cannot be read."""
    number = _kept(file).get("participants")
    return number if isinstance(number, int) and not isinstance(number, bool) else None


def kept_language(file: Path) -> str:
    """Return the language in which a study's pages are shown; "" if none is set."""
    return _kept_text(file, "language")


def kept_original(file: Path) -> str:
    """Return the name of the study that a study was copied from; "" if it is not known to be a copy."""
    return _kept_text(file, "copy_of")


def keep_setting(file: Path, name: Setting, value: int | str | None) -> None:
    """Store a setting for a study's file, None for the default; ignore it if it cannot be written."""
    others = {key: one for key, one in _kept(file).items() if key not in {"file", name}}
    if value is not None:
        others[name] = value
    if not others:
        forget_settings(file)
        return
    with contextlib.suppress(StoreError, OSError):
        write_whole(_kept_file(file), json.dumps({"file": str(file.resolve()), **others}).encode())


def begin_settings(file: Path, copy_of: str = "") -> None:
    """Delete the settings of another study that had this file, and store the study it is a copy of."""
    forget_settings(file)
    keep_setting(file, "copy_of", copy_of or None)


def forget_settings(file: Path) -> None:
    """Delete the settings of another study that had this file."""
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
