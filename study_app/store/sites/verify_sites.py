"""Verification of a merged study: every site separately, and the data that must agree between them."""

import contextlib
from collections.abc import Iterable
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TypeVar

from study_app.errors import StoreError
from study_app.store import receipt
from study_app.store.atomic import temporaries
from study_app.store.blinded.blinding import sealed_hash
from study_app.store.folders import StudyFolder
from study_app.store.sites.merge import unlisted
from study_app.store.sites.merged import FOLDER, Merged, Site, read_merged
from study_app.store.tables.study_description import described_study
from study_app.store.verification.psychds import Issue, PsychDs
from study_app.store.verification.verify_study import Findings, verify
from study_app.store.verification.violations import Finding, Gathered
from study_app.store.withdrawals.tombstones import describe_session, tombstones

Placed = TypeVar("Placed", Finding, Issue)


def verify_folder(folder: Path, fingerprints: Path | None = None) -> Findings:
    """Check a whole study, merged or not.

    Parameters
    ----------
    folder : Path
        The study folder.
    fingerprints : Path, optional
        A copy of the ``fingerprints.txt`` of a study that is not merged (see `verify_study.verify`).

    Raises
    ------
    StoreError
        It is not a study folder, or ``fingerprints`` no copy of fingerprints.
    """
    merged = read_merged(folder)
    if merged is None:
        return verify(folder, fingerprints)
    if fingerprints is not None:
        raise StoreError(
            f"{folder} holds several sites: compare each with the copy of its own fingerprints, such as {fingerprints} "
            f"with {merged.folder(merged.names[0])}"
        )
    found = Gathered(folder)
    _between(merged, found)
    each: dict[str, Findings] = {}
    for name in merged.names:
        if merged.folder(name).is_dir():  # `_between` says which are missing
            try:
                each[name] = verify(merged.folder(name))
            except StoreError as error:
                found.failure(merged.folder(name), error)
    placed = {name: _placed(name, one) for name, one in each.items()}
    return Findings(
        (*found.errors, *(error for one in placed.values() for error in one.errors)),
        (*found.warnings, *(warning for one in placed.values() for warning in one.warnings)),
        PsychDs(
            tuple(issue for one in placed.values() for issue in one.psychds.errors),
            tuple(issue for one in placed.values() for issue in one.psychds.warnings),
        ),
        sum(one.sessions for one in each.values()),
        sum(one.running for one in each.values()),
    )


def _between(merged: Merged, found: Gathered) -> None:
    """Check what the list of sites says of them, and that no session is in two."""
    seen: dict[str, Path] = {}
    for site in merged.sites:
        folder = merged.folder(site.name)
        if not folder.is_dir():
            lists = f"{merged.manifest.name} lists site {site.name}"
            found.error(folder, f"is missing, but {lists}: restore it from a copy")
            continue
        if sealed_hash(folder) != site.key_hash:
            key = StudyFolder(folder).key
            found.error(key, f"is not the key that site {site.name} was merged with: restore it from a copy")
        _compare(merged, site, found)
        for session in StudyFolder(folder).sessions():
            with contextlib.suppress(StoreError):  # said when the site is checked
                if (other := receipt.read(session.receipt)["protocol_hash"]) != merged.protocol_hash:
                    found.error(session.receipt, f"is of protocol {other}, not of {merged.protocol_hash} as merged")
            begun = describe_session(session).begun
            if begun and (twin := seen.get(begun)) is not None:
                found.error(session.path, f"is a copy of {twin.relative_to(merged.path).as_posix()}: it counts twice")
            seen[begun] = session.path
    for path in unlisted(merged):
        found.warning(path, f"is not a site that {merged.manifest.name} lists, so it is ignored")
    for path in temporaries(merged.path):
        found.warning(path, "is an incomplete file of a program that was ended, or is being written")


def _compare(merged: Merged, site: Site, found: Gathered) -> None:
    """Compare a site's folder with what the list of sites says of it; sessions are only erased there."""
    study = StudyFolder(merged.folder(site.name))
    if (name := described_study(study)) not in (None, merged.study):
        found.error(study.path, f"is of study {name}, but {merged.manifest.name} lists sites of {merged.study}")
    with contextlib.suppress(StoreError):  # said when the site is checked
        merged_at = datetime.fromisoformat(site.merged_at)
        since = [one for one in tombstones(study).values() if datetime.fromisoformat(one.at) >= merged_at]
        erased = sum(len(one.sessions) for one in since)
        if (there := len(study.sessions())) + erased < site.sessions:
            which = f"{there} of the {site.sessions} sessions that {merged.manifest.name} lists"
            found.error(study.path, f"has {which}: restore the others from a copy")


def _placed(site: str, found: Findings) -> Findings:
    """Return what was found in a site's folder with its place in the merged study's."""
    below = f"{FOLDER}/{site}"

    def moved(them: Iterable[Placed]) -> tuple[Placed, ...]:
        return tuple(replace(one, place=below if one.place == "." else f"{below}/{one.place}") for one in them)

    rules = PsychDs(moved(found.psychds.errors), moved(found.psychds.warnings))
    return replace(found, errors=moved(found.errors), warnings=moved(found.warnings), psychds=rules)
