"""The available liquids, and settings saved as presets: scene files that every command accepts."""

from __future__ import annotations

import json
import os
import tomllib
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from study_app.errors import ProtocolError, StoreError
from study_app.haptics.model.scene import Scene
from study_app.ids import free_id, id_of
from study_app.lab.ab_comparison import Setting
from study_app.protocol.load import load, load_scene, load_scenes, shipped
from study_app.protocol.scene_file import for_new_file, scene_text
from study_app.store.atomic import cannot_read, write_file
from study_app.workspace import workspace


@dataclass(frozen=True, slots=True)
class Choice:
    """A liquid for a side: its file or shipped name, its id there, and its displayed name."""

    source: str
    liquid: str
    title: str

    @property
    def scene(self) -> Scene:
        """The scene of the liquid.

        Raises
        ------
        ProtocolError
            The file no longer contains it.
        """
        return load_scene(self.source, self.liquid)

    def setting(self) -> Setting:
        """Return its initial setting on a side of the workbench.

        If its file has the default "ewma", the lab uses "kalman", also in presets saved there.
        """
        scene = for_new_file(self.scene)
        return Setting(spoken(self.liquid), scene, scene)


def liquids_at_hand(folders: tuple[Path, ...] | None = None, saved: tuple[str, ...] = ()) -> tuple[Choice, ...]:
    """Return every liquid of the shipped protocols, of the files in ``folders``, and of those ``saved``.

    ``folders`` is by default the workspace's ``protocols``.
    A broken file has none; a file in ``folders`` with the name of a shipped one replaces it.
    """
    folders = (workspace().protocols,) if folders is None else folders
    own = [str(path) for folder in folders for path in sorted(folder.glob("*.toml")) if path.stem not in shipped()]
    found: list[Choice] = []
    for source in dict.fromkeys([*shipped(), *own, *saved]):
        with suppress(ProtocolError):
            found += liquids_of(source)
    return tuple(found)


def liquids_of(source: str) -> tuple[Choice, ...]:
    """Return the liquids of a file or shipped protocol.

    Raises
    ------
    ProtocolError
        Every problem of the file.
    """
    return tuple(Choice(source, name, f"{spoken(name)} ({Path(source).stem})") for name in load_scenes(source))


def preset_text(setting: Setting) -> str:
    """Return a setting as a scene file, with a comment that lists the changes."""
    changed = ", ".join(setting.changed_names())
    said = [f"{setting.name}, as set in the liquid lab."]
    if changed:
        said.append(f"Changed from the preset: {changed}.")
    return scene_text(setting.scene, said=said)


def save(path: Path, text: str) -> None:
    """Write a preset atomically.

    Raises
    ------
    StoreError
        The file cannot be written.
    """
    write_file(path, text.encode())


def spoken(liquid_id: str) -> str:
    """Return the displayed name of a liquid."""
    words = liquid_id.replace("_", " ")
    return words[:1].upper() + words[1:]


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
    try:
        before = study.read_bytes()
    except OSError as error:
        raise cannot_read(study, error) from error
    document = _tables(before)
    if document is None or "study" not in document:
        raise StoreError(f"{study} is not a study file: choose a valid TOML file with a table [study]")
    wanted = id_of(file.stem if file is not None else setting.scene.liquids[0].id)
    name = free_id(document.get("liquids", {}), wanted or "liquid")
    names = (f"{name}.toml", *(f"{name}-{number}.toml" for number in range(2, 999)))
    made = file if file is not None else next(path for path in map(study.parent.joinpath, names) if not path.exists())
    named = _relative(made, study.parent)
    newline = "\r\n" if b"\r\n" in before else "\n"
    lines = [
        "" if before.endswith(b"\n") else newline,
        "",
        f"[liquids.{name}]",
        f"file = {json.dumps(named, ensure_ascii=False)}",
        "",
    ]
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


def _tables(source: bytes) -> dict[str, Any] | None:
    try:
        return tomllib.loads(source.decode())
    except (ValueError, RecursionError):
        return None


def _relative(file: Path, folder: Path) -> str:
    """Return a file's path relative to a folder; unchanged if there is none, as between drives."""
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:
        return file.absolute().as_posix()


def _replaced(study: Path, scene: Scene) -> str:
    """Return a sentence on the lab's settings that the study overrides; "" if the study cannot be read."""
    try:
        protocol = load(study)
    except ProtocolError:
        return ""
    own = {**dict(protocol.scene), "rate_hz": protocol.device.rate_hz}
    others = [words for name, words in SHARED.items() if own[name] != getattr(scene, name)]
    return f"The study's own {' and '.join(others)} will be used." if others else ""
