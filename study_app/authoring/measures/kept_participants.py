"""How many participants a study is simulated with, where that is another number than the file plans.

It is kept with drafts and versions in the user's data folder: to try a number out changes no protocol.
"""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from typing import Any

from study_app.authoring.versions.contents import file_key, write_whole
from study_app.errors import StoreError
from study_app.store.journals.parsing import parse_json
from study_app.user_folder import data_folder


def kept_participants(file: Path) -> int | None:
    """Return the number that is kept for a study's file; None where there is none that can be read."""
    try:
        kept: Any = parse_json(_kept_file(file).read_bytes())
    except (OSError, ValueError):
        return None
    number = kept.get("participants") if isinstance(kept, dict) else None
    return number if isinstance(number, int) and not isinstance(number, bool) else None


def keep_participants(file: Path, number: int | None) -> None:
    """Keep the number for a study's file, None for the planned one; where it cannot be written, it is not kept."""
    with contextlib.suppress(StoreError, OSError):
        if number is None:
            _kept_file(file).unlink(missing_ok=True)
        else:
            write_whole(_kept_file(file), json.dumps({"file": str(file.resolve()), "participants": number}).encode())


def _kept_file(file: Path) -> Path:
    return data_folder() / "measures" / f"{file_key(file)}.json"
