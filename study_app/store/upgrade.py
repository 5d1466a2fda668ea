"""Upgrade of study and scene files of earlier formats in place; readers know only the current format."""

from pathlib import Path

from study_app.errors import StoreError
from study_app.protocol.load import read_document
from study_app.protocol.source.files import source_bytes
from study_app.protocol.upgrade import needs_upgrade, upgraded_file
from study_app.store.atomic import read_regular, write_file

_SECTIONS = frozenset({"study", "scene", "liquids"})


def upgrade(path: Path) -> list[Path]:
    """Rewrite a study or scene file of format 1, or all of them in a folder, in the current format.

    The original is copied next to the file, as ``NAME.toml.format-1``, and the copy is compared with it first. All
    files are read before one is written.

    Parameters
    ----------
    path : Path
        A TOML file, or a folder, which is searched at any depth.

    Returns
    -------
    list of Path
        The rewritten files, sorted; empty if all have the current format.

    Raises
    ------
    ProtocolError
        A file is not TOML, or cannot be extended (`protocol.upgrade.upgraded_file`).
    StoreError
        A copy of another original exists, or a file cannot be written.
    """
    files = [path] if path.is_file() else sorted(path.rglob("*.toml"))
    upgraded: dict[Path, bytes] = {}
    for file in files:
        source = source_bytes(file)
        document, _ = read_document(source, str(file))
        if needs_upgrade(document) and _SECTIONS & document.keys():
            upgraded[file] = upgraded_file(source, str(file))
    for file, content in upgraded.items():
        original, copy = file.read_bytes(), file.with_name(f"{file.name}.format-1")
        if not copy.exists():
            write_file(copy, original)
        if read_regular(copy) != original:
            raise StoreError(f"{copy} is not a copy of {file.name}, which was not changed: rename it, and try again")
        write_file(file, content)
    return list(upgraded)
