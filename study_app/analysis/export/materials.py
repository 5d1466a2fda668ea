"""The files of a study that a folder to share has as materials: its own file, its liquid files and its footage."""

import tomllib
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from study_app.analysis.tables.study_tables import Study
from study_app.errors import ProtocolError
from study_app.protocol.source.files import at_hand, bundled, file_hash, find, protocol_hash, source_bytes, unbundled
from study_app.store.atomic import cause, open_regular
from study_app.store.blinded.blinding import revealed_key
from study_app.store.output_files import FileCopy
from study_app.store.sites.merged import read_merged


class Materials(NamedTuple):
    """The files that this machine has, by name, and those that it has not, in words; footage is not read."""

    files: dict[str, bytes | FileCopy]
    missing: tuple[str, ...]


def materials(study: Study) -> Materials:
    """Return the study's file, its liquid files and its footage; nothing while the key is sealed."""
    if not study.revealed:
        return Materials({}, ())
    footage = _footage(study)
    found = _study_file(study.name, set(study.participants["protocol_hash"]), footage)
    if found is None:
        return Materials({}, ("the study's file", *(f"{name} (SHA-256 {footage[name]})" for name in footage)))
    file, content, liquids = found
    shown = {name: file.parent / name for name in footage if _is_inside(name)}
    there = {name: path for name, path in shown.items() if file_hash(path) == footage[name]}
    files: dict[str, bytes | FileCopy] = {
        file.name: content,
        **{name: text.encode() for name, text in liquids.items() if _is_inside(name)},
        **{name: FileCopy(path, footage[name]) for name, path in there.items()},
    }
    missing = [
        f"{name} (SHA-256 {digest}; {_why_missing(shown.get(name))})"
        for name, digest in footage.items()
        if name not in there
    ]
    return Materials(files, tuple(missing))


def _footage(study: Study) -> dict[str, str]:
    """Return the SHA-256 of the study's footage by name, from its opened key."""
    merged = read_merged(study.folder)
    key = revealed_key(study.folder if merged is None else merged.folder(merged.names[0]))
    conditions = () if key is None else key.tables["conditions"].values()
    return dict(sorted((one["view"], one["footage_sha256"]) for one in conditions if one.get("footage_sha256")))


def _study_file(study: str, hashes: set[str], footage: dict[str, str]) -> tuple[Path, bytes, dict[str, str]] | None:
    """Return where the study's file is, it, and the texts of its liquid files; whether its footage is there or not."""
    for name in at_hand():
        try:
            file = find(name)
            if not _is_of(study, file):  # the footage of other studies is not hashed: it may be large
                continue
            source = source_bytes(name)
        except ProtocolError:  # of another study, perhaps: what cannot be read cannot be shared
            continue
        content, liquids = unbundled(source)
        if protocol_hash(bundled(content, liquids.get, footage)) in hashes:
            return file, content, liquids
    return None


def _is_inside(name: str) -> bool:
    """Return whether a file that a study names is in the study's folder."""
    path = PurePosixPath(name)
    return ".." not in path.parts and not path.is_absolute()


def _is_of(study: str, file: Path) -> bool:
    """Return whether a protocol file is of the study of that name."""
    try:
        head = tomllib.loads(file.read_bytes().decode()).get("study")
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(head, dict) and head.get("name") == study


def _why_missing(path: Path | None) -> str:
    """Return why footage is not shared; ``path`` is None where it lies outside of the study's folder."""
    if path is None:
        return "outside of the study's folder"
    try:
        with open_regular(path) as file:
            file.read(1)
    except (OSError, ValueError) as error:
        return f"cannot be read: {cause(error) if isinstance(error, OSError) else error}"
    return "the file of this name has another SHA-256"
