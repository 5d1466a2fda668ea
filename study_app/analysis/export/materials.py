"""The files of a study that a folder to share has as materials: its own file, its liquid files and its footage."""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import NamedTuple

from study_app.analysis.tables.study_tables import Study
from study_app.errors import ProtocolError
from study_app.protocol.source.files import at_hand, find, protocol_hash, source_bytes
from study_app.protocol.source.liquid_files import bundled, file_hash, unbundled
from study_app.store.blinded.blinding import revealed_key
from study_app.store.sites.merged import read_merged


class Materials(NamedTuple):
    """The files that this machine has, by name, and those that it has not, in words."""

    files: dict[str, bytes]
    missing: tuple[str, ...]


def materials(study: Study) -> Materials:
    """Return the study's file, its liquid files and its footage; nothing while the key is sealed."""
    if not study.revealed:
        return Materials({}, ())
    footage = _footage(study)
    found = _study_file(set(study.participants["protocol_hash"]), footage)
    if found is None:
        return Materials({}, ("the study's file", *map(_named, footage.items())))
    file, content, liquids = found
    shown = {name: file.parent / name for name in footage if _is_inside(name)}
    there = {name: path for name, path in shown.items() if file_hash(path) == footage[name]}
    files = {
        file.name: content,
        **{name: text.encode() for name, text in liquids.items() if _is_inside(name)},
        **{name: path.read_bytes() for name, path in there.items()},
    }
    return Materials(files, tuple(_named(one) for one in footage.items() if one[0] not in there))


def _footage(study: Study) -> dict[str, str]:
    """Return the SHA-256 of the study's footage by name, from its opened key."""
    merged = read_merged(study.folder)
    key = revealed_key(study.folder if merged is None else merged.folder(merged.names[0]))
    conditions = () if key is None else key.tables["conditions"].values()
    return dict(sorted((one["view"], one["footage_sha256"]) for one in conditions if one.get("footage_sha256")))


def _study_file(hashes: set[str], footage: dict[str, str]) -> tuple[Path, bytes, dict[str, str]] | None:
    """Return where the study's file is, it, and the texts of its liquid files; whether its footage is there or not."""
    for name in at_hand():
        try:
            file, source = find(name), source_bytes(name)
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


def _named(footage: tuple[str, str]) -> str:
    name, digest = footage
    return f"{name} (SHA-256 {digest})"
