"""The liquids at hand, and a setting kept as a preset: a scene file that every command takes."""

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from study_app.errors import ProtocolError
from study_app.haptics.model.scene import Scene
from study_app.lab.ab_comparison import Setting
from study_app.protocol.load import load_scene, load_scenes, shipped
from study_app.protocol.scene_file import for_new_file, scene_text
from study_app.store.atomic import write_file
from study_app.workspace import workspace


@dataclass(frozen=True, slots=True)
class Choice:
    """A liquid that a side can be set to: the file or shipped name it is from, its id there, and what it is called."""

    source: str
    liquid: str
    title: str

    @property
    def scene(self) -> Scene:
        """The scene it is.

        Raises
        ------
        ProtocolError
            The file does not hold it any more.
        """
        return load_scene(self.source, self.liquid)

    def setting(self) -> Setting:
        """Return it as a side of the workbench begins with it.

        Where its file has the usual "ewma", the lab has "kalman", and so do presets saved there.
        """
        scene = for_new_file(self.scene)
        return Setting(spoken(self.liquid), scene, scene)


def liquids_at_hand(folders: tuple[Path, ...] | None = None, saved: tuple[str, ...] = ()) -> tuple[Choice, ...]:
    """Return every liquid of the shipped protocols, of the files in ``folders``, and of those ``saved``.

    ``folders`` is by default the workspace's ``protocols``.
    A broken file has none; a file of a shipped one's name in ``folders`` is that one.
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
    """Return a setting as a scene file, with what was changed named above it."""
    changed = ", ".join(setting.changed_names())
    said = [f"{setting.name}, as set in the liquid lab."]
    if changed:
        said.append(f"Changed from the preset: {changed}.")
    return scene_text(setting.scene, said=said)


def save(path: Path, text: str) -> None:
    """Write a preset, whole or not at all.

    Raises
    ------
    StoreError
        The file cannot be written.
    """
    write_file(path, text.encode())


def spoken(liquid_id: str) -> str:
    """Return the name of a liquid as people say it."""
    words = liquid_id.replace("_", " ")
    return words[:1].upper() + words[1:]
