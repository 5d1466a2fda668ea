"""The original of a copied study, stored with drafts and versions in the user's data folder."""

import contextlib
import json
from pathlib import Path
from typing import Any

from study_app.errors import StoreError
from study_app.store.files.atomic import parse_json
from study_app.store.versions.study_versions import file_key, write_whole
from study_app.user_folder import data_folder


def kept_original(file: Path) -> str:
    """Return the name of the study from which a study was copied; "" if it is not known to be a copy."""
    try:
        record: Any = parse_json(_settings_file(file).read_bytes())
    except (OSError, ValueError):
        return ""
    original = record.get("copy_of") if isinstance(record, dict) else None
    return original if isinstance(original, str) else ""


def keep_original(file: Path, copy_of: str = "") -> None:
    """Store the name of the study from which a new file was copied ("" for none); ignore write errors."""
    with contextlib.suppress(StoreError, OSError):
        if copy_of:
            write_whole(_settings_file(file), json.dumps({"file": str(file.resolve()), "copy_of": copy_of}).encode())
        else:
            _settings_file(file).unlink(missing_ok=True)  # left by another study with this path


def _settings_file(file: Path) -> Path:
    return data_folder() / "settings" / f"{file_key(file)}.json"
