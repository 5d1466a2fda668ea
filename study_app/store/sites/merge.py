"""Merging: the results folders of sites are copied, unchanged, into a folder of one study.

A new merged study is created under a temporary name and then renamed. Further sites are first copied into its folder,
where they are ignored until its list of sites is replaced in one step. A program that is killed leaves either the old
or the new state, and perhaps folders that the next merge removes. Each site keeps its key, sealed or opened.
"""

import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import Final

from study_app.errors import StoreError
from study_app.ids import file_name_fault
from study_app.store import receipt
from study_app.store.blinded.blinding import Key, verified_key
from study_app.store.files.atomic import (
    cannot_read,
    cannot_write,
    copy_file,
    flush_entry,
    is_there,
    move,
    paths_in,
    refuse_special_files,
    remove_temporary_files,
    sync_folder,
    sync_folders,
    temporary_files,
    temporary_path,
    write_file,
)
from study_app.store.files.folders import ID_PATTERN, ReportProgress, SessionFolder, StudyFolder
from study_app.store.integrity.checksums import is_system_file
from study_app.store.integrity.folder_lock import (
    create_locked_folder,
    is_never_begun,
    is_open,
    lock_folder,
    refuse_if_open,
)
from study_app.store.journals import journal
from study_app.store.journals.journal_events import start_of
from study_app.store.merged import FOLDER, Merged, Site, merged_above, read_merged
from study_app.store.tables.study_files import described_study, row_of
from study_app.store.withdrawals import describe_session, tombstones

_MAX_SITE_LENGTH: Final = 16
_IGNORED: Final = shutil.ignore_patterns(".open-*.json", ".*.tmp")
"""Files that programs leave in a folder while they have it open, or when they are killed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Source:
    """A results folder that is, or will be, a site of a merged study.

    ``protocol_hash`` is empty and ``pilot`` None if all participants withdrew; ``begun`` are the sessions' folders by
    the SHA-256 of their journals' first lines. ``state`` changes if a file changes, and was read before its contents.
    """

    name: str
    path: Path
    state: list[tuple[Path, int, int]]
    study: str
    protocol_hash: str
    pilot: bool | None
    key: Key
    withdrawals: int
    begun: Mapping[str, Path]


def merge_sites(folders: Mapping[str, Path], to: Path, progress: ReportProgress | None = None) -> Merged:
    """Copy the results folders of sites into the merged study ``to``, which is created or extended.

    Parameters
    ----------
    folders : mapping of str to Path
        The sites' folders by the sites' names, which precede the participants' IDs.
    to : Path
        The merged study's folder.
    progress : callable, optional
        Called with the current step and the fraction done.

    Raises
    ------
    StoreError
        A name cannot be used or is used already; a folder is not the results folder of a study, is open in a program,
        or used another protocol than the others (the message names both hashes); a session is in two folders; or a file
        cannot be read or written. The listed sites have not changed then.
    """
    merged = read_merged(to)
    _check_names(folders, merged)
    _check_folders(folders, to, merged)
    present_sources = () if merged is None else tuple(_read_source(name, merged.folder(name)) for name in merged.names)
    new_sources = tuple(_read_source(name, path) for name, path in folders.items())
    if empty := next((name for name, source in zip(folders, new_sources, strict=True) if not source.begun), None):
        raise StoreError(f"site {empty}: {folders[empty]} does not contain any sessions yet: merge it later")
    protocol_hash = new_sources[0].protocol_hash if merged is None else merged.protocol_hash
    _check_same_protocol((*present_sources, *new_sources), protocol_hash)
    _check_sessions((*present_sources, *new_sources))
    at = datetime.now().astimezone().isoformat(timespec="seconds")
    sites = tuple(
        Site(
            name=source.name,
            merged_at=at,
            key_hash=source.key.hash,
            sessions=len(source.begun),
            withdrawals=source.withdrawals,
        )
        for source in new_sources
    )
    if merged is None:
        result = Merged(to, new_sources[0].study, protocol_hash, sites)
        _create_merged(result, new_sources, progress)
    else:
        result = Merged(to, merged.study, merged.protocol_hash, (*merged.sites, *sites))
        with lock_folder(to):
            if read_merged(to) != merged:
                raise StoreError(f"{to} was changed by another program during the merge: merge again")
            _add_sites(result, new_sources, progress)
    return result


def damaged_sessions(folder: Path) -> list[Path]:
    """Return the session folders of a study whose journals are damaged; see `study_files.row_of`."""
    return [
        session.path
        for session in StudyFolder(folder).sessions()
        if any(row["status"] == "damaged" for row in row_of(session, None))
    ]


def _check_names(folders: Mapping[str, Path], merged: Merged | None) -> None:
    if not folders:
        raise StoreError("no sites were specified: specify each site as A=DIR")
    used = {} if merged is None else {name.lower(): name for name in merged.names}
    for name in folders:
        if not ID_PATTERN.fullmatch(name) or len(name) > _MAX_SITE_LENGTH:
            raise StoreError(
                f"{name!r} cannot be used as the name of a site: use at most {_MAX_SITE_LENGTH} letters (A-Z, a-z) and "
                "digits (0-9), such as A or Utrecht"
            )
        if fault := file_name_fault(name):
            raise StoreError(f"site {name!r} {fault}, so it cannot be the name of a folder: use a different name")
        if (other := used.get(name.lower())) is not None:
            reason = "has already been merged" if merged is not None and other in merged.names else "is specified twice"
            raise StoreError(f"site {name!r} {reason} (case is ignored): use a different name")
        used[name.lower()] = name


def _check_folders(folders: Mapping[str, Path], to: Path, merged: Merged | None) -> None:
    target = to.resolve()
    if merged is None and is_there(to) and (not to.is_dir() or _entries(to)):
        raise StoreError(f"{to} is not a merged study and is not empty: specify a new folder with --to")
    for parent in (target, *target.parents):
        if described_study(StudyFolder(parent)) is not None:
            raise StoreError(f"{to} is, or lies within, the results folder {parent}: specify a folder outside it")
    for name, path in folders.items():
        if read_merged(path) is not None or merged_above(path) is not None:
            raise StoreError(f"site {name}: {path} belongs to a merged study: specify the folder of the site itself")
        resolved = path.resolve()
        if resolved.is_relative_to(target):
            raise StoreError(f"site {name}: {path} lies within {to}: specify a folder outside it with --to")


def _read_source(name: str, path: Path) -> _Source:
    """Read the properties of a results folder that must agree between sites."""
    study = StudyFolder(path)
    study_name = described_study(study)
    if study_name is None:
        raise StoreError(
            f"site {name}: {path} is not the results folder of a study ({study.description.name} is missing): specify "
            "one such as results/rek2024"
        )
    refuse_special_files(path.resolve())
    try:
        state = _folder_state(path)
    except OSError as error:
        raise cannot_read(path, error) from error
    refuse_if_open(path)
    sessions = [session for session in study.sessions() if not is_never_begun(session.path)]
    for session in sessions:
        refuse_if_open(session.path)
    kinds = [_session_protocol(session) for session in sessions]
    hashes = dict.fromkeys(protocol_hash for protocol_hash, _ in kinds)
    if len(hashes) > 1:
        raise StoreError(
            f"site {name}: sessions in {path} used {len(hashes)} different protocols (SHA-256 {', '.join(hashes)}): "
            "only sites with exactly the same protocol can be merged"
        )
    return _Source(
        name=name,
        path=path,
        state=state,
        study=study_name,
        protocol_hash=next(iter(hashes), ""),
        pilot=any(pilot for _, pilot in kinds) if kinds else None,
        key=verified_key(study),
        withdrawals=len(tombstones(study)),
        begun={describe_session(session).begun or str(session.path): session.path for session in sessions},
    )


def _session_protocol(session: SessionFolder) -> tuple[str, bool]:
    """Return the hash of a session's protocol, and whether it is a pilot: of the receipt, or else of the journal."""
    try:
        session_receipt = receipt.read(session.receipt)
        return str(session_receipt["protocol_hash"]), bool(session_receipt["pilot"])
    except StoreError:
        lines = journal.scan(session.journal).lines if is_there(session.journal) else []
        if not lines:
            raise
        start = start_of(lines)
        return start.protocol_hash, start.pilot


def _check_same_protocol(sources: tuple[_Source, ...], protocol_hash: str) -> None:
    """Raise an error for sites with different protocols, or rehearsals or pilots mixed with participants."""
    first = next((source for source in sources if source.protocol_hash), sources[0])
    for other in sources:
        if other.study != first.study or other.protocol_hash not in ("", protocol_hash):
            raise StoreError(
                f"site {other.name} ran the protocol {other.study} with SHA-256 {other.protocol_hash}, but site "
                f"{first.name} ran {first.study} with SHA-256 {protocol_hash}: only sites with exactly the same "
                "protocol can be merged"
            )
        if other.key.drawn != first.key.drawn or other.pilot not in (None, first.pilot):
            raise StoreError(
                f"site {other.name} contains {_session_kind(other)}, but site {first.name} contains "
                f"{_session_kind(first)}: only sessions of the same kind can be merged"
            )


def _session_kind(source: _Source) -> str:
    return "pilot sessions" if source.pilot else "rehearsals" if source.key.drawn == "seed" else "real sessions"


def _check_sessions(sources: tuple[_Source, ...]) -> None:
    """Raise an error for a session that is in two sites and would count twice."""
    seen: dict[str, Path] = {}
    for source in sources:
        for begun, path in source.begun.items():
            if (other := seen.get(begun)) is not None:
                raise StoreError(
                    f"{path} is a copy of {other}, so its data would be counted twice: use only one of the two folders"
                )
            seen[begun] = path


def _create_merged(merged: Merged, sources: tuple[_Source, ...], progress: ReportProgress | None) -> None:
    """Create the folder atomically."""
    target = merged.path.absolute()
    temporary = temporary_path(target)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        for path in temporary_files(target.parent, target.name):  # left by interrupted merges
            if path.is_dir() and not is_open(path):
                shutil.rmtree(path, ignore_errors=True)
        lock = create_locked_folder(temporary)
        (temporary / FOLDER).mkdir()
        for source in sources:
            _copy_site(source, temporary / FOLDER / source.name, progress)
        write_file(temporary / merged.manifest.name, merged.content())
        sync_folder(temporary / FOLDER)
        if lock is not None:
            lock.release()
        sync_folder(temporary)
        if target.is_dir():
            target.rmdir()
        move(temporary, target)
    except OSError as error:  # shutil.Error, too
        raise cannot_write(merged.path, error) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    flush_entry(target)


def _add_sites(merged: Merged, sources: tuple[_Source, ...], progress: ReportProgress | None) -> None:
    """Copy further sites into the folder; they take effect once they are listed."""
    sites_folder = merged.path / FOLDER
    remove_temporary_files(sites_folder)
    copies: list[Path] = []
    try:
        for source in sources:
            copy = merged.folder(source.name)
            if is_there(copy):  # left by an interrupted merge: it is not listed
                shutil.rmtree(copy)
            temporary = temporary_path(copy)
            copies.append(temporary)
            _copy_site(source, temporary, progress)
            move(temporary, copy)
            copies[-1] = copy
        sync_folder(sites_folder)
        write_file(merged.manifest, merged.content())
    except (OSError, StoreError) as error:
        if read_merged(merged.path) != merged:  # the list may be written although its folder could not be flushed
            for copy in copies:
                shutil.rmtree(copy, ignore_errors=True)
        raise error if isinstance(error, StoreError) else cannot_write(merged.path, error) from error


def _copy_site(source: _Source, to: Path, progress: ReportProgress | None) -> None:
    """Copy a results folder and flush it to the disk; links are copied as links, which `verify` reports."""
    numbers = count()

    def copy_next(*paths: str) -> str:
        number = next(numbers)
        if progress is not None and number % 100 == 0:
            progress(f"copying site {source.name}", min(number / len(source.state), 1.0))
        return copy_file(*paths)

    shutil.copytree(source.path, to, symlinks=True, ignore=_IGNORED, copy_function=copy_next)
    sync_folders(to)
    refuse_if_open(source.path)
    if _folder_state(source.path) != source.state:
        raise StoreError(
            f"{source.path} was changed while it was being copied: merge again when no other program is using it"
        )


def _folder_state(path: Path) -> list[tuple[Path, int, int]]:
    """Return path, size and modification time of every file in a folder, to detect changes."""
    states = [(entry, entry.lstat()) for entry in paths_in(path)]
    return [(entry, status.st_size, status.st_mtime_ns) for entry, status in states if not entry.is_dir()]


def stray_entries(merged: Merged) -> tuple[Path, ...]:
    """Return the entries next to the sites that are not listed, left by an interrupted merge or added by hand."""
    sites_folder = merged.path / FOLDER
    return tuple(path for path in _entries(sites_folder) if path.name not in merged.names)


def _entries(folder: Path) -> list[Path]:
    """Return the entries of a folder, if it exists, without files of operating systems and sharing programs."""
    paths = sorted(folder.iterdir()) if folder.is_dir() else []
    return [path for path in paths if not is_system_file(Path(path.name))]
