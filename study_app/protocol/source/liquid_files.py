"""Liquid files: ``[liquids.syrup] file = "syrup.toml"`` names a scene file with one liquid, in the study's folder.

A study's source is its file, followed by the liquid files that it names, as texts in a last table ``[liquid_files]``.
So one piece of bytes holds all that is run, its hash covers it, and the lines of the study's own file keep their
numbers. A file that names no liquid file is its own source, byte for byte.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

TABLE: Final = "liquid_files"
_HEADER: Final = f"\n\n# The liquid files of this study, as they were read.\n[{TABLE}]\n".encode()
_FILE_KEY: Final = re.compile(rb"""\bfile["']?[ \t]*=""")


def with_liquid_files(study: bytes, folder: Path) -> bytes:
    """Return a study's source: its file ``study``, and the liquid files it names, relative to ``folder``.

    One that cannot be read is left out; `load.parse` reports it.
    """
    return bundled(study, lambda name: _read(folder / name))


def bundled(study: bytes, text_of: Callable[[str], str | None]) -> bytes:
    """Return a study's file followed by the liquid files it names; ``text_of`` gives the text of one, None if lost."""
    texts = {name: text for name in _named(study) if (text := text_of(name)) is not None}
    if not texts:
        return study
    return study + _HEADER + "".join(f"{_quoted(name)} = {_quoted(text)}\n" for name, text in texts.items()).encode()


def unbundled(source: bytes) -> tuple[bytes, dict[str, str]]:
    """Return the study's file in a source, and the texts of its liquid files by their names."""
    study, header, table = source.rpartition(_HEADER)
    return (study, tomllib.loads(table.decode())) if header else (source, {})


def file_of(liquid: Any) -> Any:
    """Return what a liquid's table names as its file; None where it names none."""
    return liquid.get("file") if isinstance(liquid, Mapping) else None


def _named(study: bytes) -> list[str]:
    """Return the names of the liquid files of a study, sorted; none where it is not TOML (`load.parse` reports it)."""
    if not _FILE_KEY.search(study):
        return []
    try:
        liquids = tomllib.loads(study.decode()).get("liquids")
    except (ValueError, RecursionError):
        return []
    named = (file_of(liquid) for liquid in liquids.values()) if isinstance(liquids, Mapping) else ()
    return sorted({name for name in named if isinstance(name, str)})


def _read(path: Path) -> str | None:
    try:
        return path.read_bytes().decode() if path.is_file() else None  # never a device or a pipe, which may not end
    except (OSError, ValueError):
        return None


def _quoted(text: str) -> str:
    """Return a text as a TOML string of one line."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
