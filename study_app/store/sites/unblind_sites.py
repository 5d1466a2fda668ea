"""Opening a merged study: the key of each site, every one recorded in its own folder."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from study_app.store.blinded.blinding import reveals, verified_key
from study_app.store.blinded.unblinding import Unblinded, unblind
from study_app.store.folders import StudyFolder
from study_app.store.sites.merged import folders_of


def unblind_folder(folder: Path, by: str, reason: str) -> dict[str, Unblinded]:
    """Open the key of a study, or of each site of a merged one, by what precedes the site's participants ("A-" or "").

    Raises
    ------
    StoreError
        ``by`` or ``reason`` is empty, or a key is missing, unreadable or not the one the sessions ran under; none was
        opened then.
    """
    folders = folders_of(folder)
    if "" not in folders:
        for place in folders.values():
            verified_key(StudyFolder(place))
    return {prefix: _named(prefix, unblind(place, by, reason)) for prefix, place in folders.items()}


def _named(prefix: str, opened: Unblinded) -> Unblinded:
    """Return what was opened with IDs as the merged study has them."""
    return replace(
        opened, excluded=tuple(replace(row, participant=f"{prefix}{row.participant}") for row in opened.excluded)
    )


def reveals_of(folder: Path) -> tuple[dict[str, str], ...]:
    """Return the recorded reveals of a study; those of a merged one say of which ``site`` they are.

    Raises
    ------
    StoreError
        They cannot be read.
    """
    found: list[dict[str, str]] = []
    for prefix, place in folders_of(folder).items():
        named: Mapping[str, str] = {"site": prefix[:-1]} if prefix else {}
        found += [{**named, **one} for one in reveals(place)]
    return tuple(found)


def all_opened(folder: Path) -> bool:
    """Return whether the key of a study, or the keys of all sites of a merged one, were opened.

    Raises
    ------
    StoreError
        A list of reveals cannot be read.
    """
    return all(reveals(place) for place in folders_of(folder).values())
