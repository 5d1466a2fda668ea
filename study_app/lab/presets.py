"""The available liquids, and settings saved as presets, which are scene files that every command accepts."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from study_app.errors import ProtocolError
from study_app.haptics.model.scene import Scene
from study_app.lab.ab_comparison import Setting
from study_app.protocol.file_format import scene_text, with_default_estimator
from study_app.protocol.load import load_scene, load_scenes, shipped
from study_app.store.files import write_file
from study_app.workspace import workspace


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """A liquid that can be chosen: its file or shipped name, its id there, and its displayed name."""

    source: str
    liquid: str
    title: str

    @property
    def scene(self) -> Scene:
        """The scene of the liquid.

        Raises
        ------
        ProtocolError
            The file no longer contains the liquid.
        """
        return load_scene(self.source, self.liquid)

    def setting(self) -> Setting:
        """Return the initial setting of the liquid for a side of the workbench.

        If its file has the default "ewma", the lab uses "kalman" instead, also in the presets that it saves.
        """
        scene = with_default_estimator(self.scene)
        return Setting(displayed_name(self.liquid), scene, scene)


def available_liquids(folders: tuple[Path, ...] | None = None, saved: tuple[str, ...] = ()) -> tuple[Choice, ...]:
    """Return the liquids of the shipped protocols, of the files in ``folders``, and of the ``saved`` files.

    ``folders`` is by default the workspace's ``protocols``. Broken files are skipped; a file in ``folders`` with the
    name of a shipped one replaces it.
    """
    folders = (workspace().protocols,) if folders is None else folders
    in_folders = [
        str(path) for folder in folders for path in sorted(folder.glob("[!.]*.toml")) if path.stem not in shipped()
    ]
    choices: list[Choice] = []
    for source in dict.fromkeys([*shipped(), *in_folders, *saved]):
        with suppress(ProtocolError):
            choices += liquids_of(source)
    return tuple(choices)


def liquids_of(source: str) -> tuple[Choice, ...]:
    """Return the liquids of a file or shipped protocol.

    Raises
    ------
    ProtocolError
        Lists every problem of the file.
    """
    return tuple(
        Choice(source=source, liquid=name, title=f"{displayed_name(name)} ({Path(source).stem})")
        for name in load_scenes(source)
    )


def preset_text(setting: Setting) -> str:
    """Return a setting as the text of a scene file, with a comment that lists the changes."""
    changed = ", ".join(setting.changed_names())
    comment = [f"{setting.name}, as set in the liquid lab."]
    if changed:
        comment.append(f"Changed from the preset: {changed}.")
    return scene_text(setting.scene, said=comment)


def save_preset(path: Path, text: str) -> None:
    """Write a preset atomically.

    Raises
    ------
    StoreError
        The file cannot be written.
    """
    write_file(path, text.encode())


def displayed_name(liquid_id: str) -> str:
    """Return the displayed name of a liquid."""
    name = liquid_id.replace("_", " ")
    return name[:1].upper() + name[1:]
