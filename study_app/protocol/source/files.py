"""Where protocol files are: a path, or a name from the workspace and then from those that ship with the program."""

from __future__ import annotations

import hashlib
from pathlib import Path

from study_app.errors import Problem, ProtocolError
from study_app.protocol.source.liquid_files import with_liquid_files
from study_app.protocol.source.problems import did_you_mean
from study_app.workspace import workspace

_PACKAGE = Path(__file__).resolve().parents[2]
# A checkout is offered as the workspace: then the folder of these protocols also holds the studies made there.
_SHIPPED = (
    "delaydetect",
    "delayjnd",
    "demo",
    "forcedelay",
    "physical2",
    "physical_liquids",
    "rek2024",
    "slime",
    "thickness",
    "viscosityjnd",
)


def _shipped_folder() -> Path:
    """Return the protocols inside an installed package, or next to the package in a checkout."""
    inside = _PACKAGE / "protocols"
    return inside if inside.is_dir() else _PACKAGE.parent / "protocols"


def shipped() -> tuple[str, ...]:
    """Return the names of the protocols that ship with the program, sorted."""
    return tuple(name for name in _SHIPPED if shipped_file(name).is_file())


def shipped_file(name: str) -> Path:
    """Return the file of a protocol that ships with the program, even where the workspace has one of the same name."""
    return _shipped_folder() / f"{name}.toml"


def at_hand() -> tuple[str, ...]:
    """Return the names of the protocols in the workspace, then of those that ship with the program."""
    return tuple(dict.fromkeys((*(path.stem for path in workspace().own_protocols()), *shipped())))


def find(name_or_path: str | Path) -> Path:
    """Return the file of a protocol.

    Raises
    ------
    ProtocolError
        There is none.
    """
    path = Path(name_or_path)
    if path.is_file():
        return path
    if path.name == str(name_or_path) and path.suffix != ".toml":
        for folder in (workspace().protocols, _shipped_folder()):
            if (found := folder / f"{path.name}.toml").is_file():
                return found
        raise _not_found(name_or_path, "no protocol of this name", did_you_mean(path.name, at_hand()))
    if path.is_dir():
        raise _not_found(name_or_path, "is a folder, not a protocol file", "name one of the .toml files in it")
    raise _not_found(name_or_path, "no such file", f"or a name: {', '.join(shipped())}")


def _not_found(name_or_path: str | Path, message: str, hint: str) -> ProtocolError:
    return ProtocolError(str(name_or_path), (Problem("file", message, hint=hint),))


def source_bytes(name_or_path: str | Path) -> bytes:
    """Return a protocol's file as it is on disk, followed by the liquid files it names (see ``liquid_files``).

    Raises
    ------
    ProtocolError
        It does not exist or cannot be read.
    """
    path = find(name_or_path)
    try:
        return with_liquid_files(path.read_bytes(), path.parent)
    except OSError as error:
        raise _not_found(name_or_path, f"cannot be read: {error.strerror}", "check its permissions") from error


def protocol_hash(source: bytes) -> str:
    """Return the SHA-256 of a protocol's source, in hexadecimal: of its file and the liquid files it names."""
    return hashlib.sha256(source).hexdigest()
