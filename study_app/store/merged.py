"""A merged study's folder: its sites, and the lookup of a participant's site by ID.

::

    pooled/
      sites.json      the list of sites; a folder below sites/ that it does not list is ignored
      sites/A/        the results folder of site A, as it was (see `store.files.folders`), with its sealed key
      sites/B/

Merged tables are not stored. They are made from the sites whenever the folder is read, so that they reflect a
withdrawal, an exclusion or an opened key at once. Their participants are named SITE-ID, such as A-P007. Neither a
site's name nor an ID contains a dash, so that equal IDs at two sites are two participants.
"""

import json
import os
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Final

from study_app.errors import StoreError
from study_app.store.exclusions import Exclusion, exclusions
from study_app.store.files.atomic import cannot_read, parse_json, read_regular
from study_app.store.files.folders import ID_PATTERN, SessionFolder, StudyFolder, check_study_name
from study_app.store.journals.journal_events import is_valid_value, shorten_value

MANIFEST: Final = "sites.json"
FOLDER: Final = "sites"
_FORMAT: Final = 2
DASH: Final = "-"


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """A site of a merged study, as ``sites.json`` lists it.

    ``withdrawals`` is their number at the merge; lists of format 1 do not have it.
    """

    name: str
    merged_at: str
    key_hash: str
    sessions: int
    withdrawals: int | None = None


@dataclass(frozen=True, slots=True)
class Merged:
    """A merged study: its folder, name and sites, and the SHA-256 of the protocol that all sites ran."""

    path: Path
    study: str
    protocol_hash: str
    sites: tuple[Site, ...]

    @property
    def manifest(self) -> Path:
        """The path of the list of sites."""
        return self.path / MANIFEST

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the sites."""
        return tuple(site.name for site in self.sites)

    def folder(self, site: str) -> Path:
        """Return the results folder of a site."""
        return self.path / FOLDER / site

    def content(self) -> bytes:
        """Return the content of ``sites.json``."""
        content = {
            "format": _FORMAT,
            "study": self.study,
            "protocol_hash": self.protocol_hash,
            "sites": [asdict(site) for site in self.sites],
        }
        return f"{json.dumps(content, indent=2)}\n".encode()


def read_merged(folder: Path) -> Merged | None:
    """Return the merged study in ``folder``, or None if it is not one.

    Raises
    ------
    StoreError
        Its list of sites cannot be read.
    """
    path = folder / MANIFEST
    try:
        content = parse_json(read_regular(path))
        if content["format"] not in (1, _FORMAT):
            shown = shorten_value(content["format"])
            raise StoreError(
                f"{path} has format {shown}, but this version reads only formats 1 and {_FORMAT}: install a newer "
                "version"
            )
        sites = tuple(Site(**site) for site in content["sites"])
        if sites and all(map(_is_site, sites)) and is_valid_value("protocol_hash", content["protocol_hash"]):
            merged = Merged(folder, check_study_name(content["study"]), content["protocol_hash"], sites)
            _refuse_links(merged)
            return merged
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise cannot_read(path, error) from error
    except (ValueError, KeyError, TypeError):
        pass
    raise StoreError(f"{path} does not list the sites of a merged study: restore it from a backup")


def _is_site(site: Site) -> bool:
    has_name = isinstance(site.name, str) and ID_PATTERN.fullmatch(site.name) is not None
    has_valid_fields = (
        is_valid_value("at", site.merged_at)
        and is_valid_value("key_hash", site.key_hash)
        and isinstance(site.sessions, int)
        and isinstance(site.withdrawals, int | None)
    )
    return has_name and has_valid_fields


def _refuse_links(merged: Merged) -> None:
    """Raise an error if a site's folder is a link to a folder outside the merged study."""
    for folder in map(merged.folder, merged.names):
        if not (real := _resolved_path(folder)).is_relative_to(_resolved_path(merged.path)):
            raise StoreError(
                f"{folder} is a link to {real}, which is outside {merged.path}: replace the link with the folder itself"
            )


def _resolved_path(path: Path) -> Path:
    """Return a path with links resolved; a loop of links, for which `Path.resolve` raises RuntimeError, is kept."""
    return Path(os.path.realpath(path))


def folders_of(folder: Path) -> dict[str, Path]:
    """Return the results folders in ``folder`` by the prefix of their IDs: "A-" for site A, "" if it is not merged.

    Raises
    ------
    StoreError
        The list of sites cannot be read.
    """
    merged = read_merged(folder)
    return {"": folder} if merged is None else {f"{name}{DASH}": merged.folder(name) for name in merged.names}


def locate_participant(folder: Path, participant: str) -> tuple[Path, str]:
    """Return the results folder that holds a participant, and the participant's ID there.

    Raises
    ------
    StoreError
        The study is merged, and the ID names none of its sites.
    """
    folders = folders_of(folder)
    if "" in folders:
        return folder, participant
    site, dash, local_id = participant.partition(DASH)
    if (site_folder := folders.get(f"{site}{dash}")) is None or not local_id:
        known = ", ".join(name.removesuffix(DASH) for name in folders)
        raise StoreError(
            f"{folder} contains several sites ({known}), but {participant!r} does not include the site: specify "
            f"SITE-ID, such as {next(iter(folders))}P007"
        )
    return site_folder, local_id


def session_in(folder: Path, participant: str, number: int) -> SessionFolder:
    """Return the folder of a session, which need not exist; in a merged study the participant's ID includes the site.

    Raises
    ------
    StoreError
        The study is merged, and the ID names none of its sites.
    """
    site_folder, local_id = locate_participant(folder, participant)
    return StudyFolder(site_folder).session(local_id, number)


def all_exclusions(folder: Path) -> tuple[Exclusion, ...]:
    """Return the exclusions of a study, merged or not.

    Raises
    ------
    StoreError
        A list cannot be read.
    """
    return tuple(
        replace(row, participant=f"{prefix}{row.participant}")
        for prefix, site_folder in folders_of(folder).items()
        for row in exclusions(site_folder)
    )


def sessions_in(folders: Iterable[Path]) -> tuple[SessionFolder, ...]:
    """Return the sessions in the given results folders."""
    return tuple(session for folder in folders for session in StudyFolder(folder).sessions())


def merged_above(folder: Path) -> Path | None:
    """Return the merged study that contains ``folder`` as the copy of a site, or None."""
    resolved = _resolved_path(folder)
    is_copy = resolved.parent.name == FOLDER and (resolved.parents[1] / MANIFEST).is_file()
    return resolved.parents[1] if is_copy else None


def refuse_merged(folder: Path) -> None:
    """Raise an error for a merged study or its copy of a site, in which no sessions can run."""
    if (folder / MANIFEST).is_file():
        raise StoreError(f"{folder} is a merged study, which contains only copies: run sessions in a site's own folder")
    if (above := merged_above(folder)) is not None:
        raise StoreError(
            f"{folder} is the copy of a site in the merged study {above}: run sessions in the site's own folder"
        )
