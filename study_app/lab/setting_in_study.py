"""A setting of the lab used in a study: its liquid file is named in a table at the end of the study's file."""

from __future__ import annotations

import json
import os
import tomllib
from pathlib import Path
from typing import Any, Final

from study_app.errors import ProtocolError, StoreError
from study_app.haptics.model.scene import Scene
from study_app.ids import free_id, id_of
from study_app.lab.ab_comparison import Setting
from study_app.lab.presets import preset_text, save
from study_app.protocol.load import load
from study_app.store.atomic import cannot_read, write_file

SHARED: Final = {"scale": "scale", "velocity": "velocity filter", "knee": "speed limit", "rate_hz": "servo rate"}
"""Tables that a study sets for all of its liquids, and a liquid file cannot set."""


def use_in_study(study: Path, setting: Setting, file: Path | None) -> str:
    """Add a table ``[liquids.NAME]`` with a setting's liquid file at the end of a study's file; return a message.

    Parameters
    ----------
    study : a protocol's file
    setting : must be saved in ``file``; without one it is first saved in the study's folder

    Raises
    ------
    StoreError
        The study's file is not valid, cannot have such a table, or a file cannot be read or written. It is unchanged
        then.
    """
    before = _read(study)
    document = _document(study, before)
    wanted = id_of(file.stem if file is not None else setting.scene.liquids[0].id)
    name = free_id(document.get("liquids", {}), wanted or "liquid")
    made = file if file is not None else _free_file(study.parent / f"{name}.toml")
    named = _relative(made, study.parent)
    newline = "\r\n" if b"\r\n" in before else "\n"
    lines = ["" if before.endswith(b"\n") else newline, "", f"[liquids.{name}]", f"file = {_quoted(named)}", ""]
    after = before + newline.join(lines).encode()
    document.setdefault("liquids", {})[name] = {"file": named}
    if _tables(after) != document:
        raise StoreError(f"{study} cannot be extended by the table [liquids.{name}]: add it by hand")
    if file is None:
        save(made, preset_text(setting))
    write_file(study, after)
    return (
        f"Added to {study.name} as [liquids.{name}]. Name it in a condition. {_replaced(study, setting.scene)}".strip()
    )


def _read(study: Path) -> bytes:
    try:
        return study.read_bytes()
    except OSError as error:
        raise cannot_read(study, error) from error


def _document(study: Path, source: bytes) -> dict[str, Any]:
    document = _tables(source)
    if document is None or "study" not in document:
        raise StoreError(f"{study} is not a study file: choose a valid TOML file with a table [study]")
    return document


def _tables(source: bytes) -> dict[str, Any] | None:
    try:
        return tomllib.loads(source.decode())
    except (ValueError, RecursionError):
        return None


def _free_file(wanted: Path) -> Path:
    numbered = (wanted.with_stem(f"{wanted.stem}-{number}") for number in range(2, 999))
    return next(path for path in (wanted, *numbered) if not path.exists())


def _relative(file: Path, folder: Path) -> str:
    """Return a file's path relative to a folder; unchanged if there is none, as between drives."""
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:
        return file.absolute().as_posix()


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _replaced(study: Path, scene: Scene) -> str:
    """Return a sentence on the lab's settings that the study overrides; "" if the study cannot be read."""
    try:
        protocol = load(study)
    except ProtocolError:
        return ""
    own = {**dict(protocol.scene), "rate_hz": protocol.device.rate_hz}
    others = [words for name, words in SHARED.items() if own[name] != getattr(scene, name)]
    return f"The study's own {' and '.join(others)} will be used." if others else ""
