"""What the tab Changes shows: the versions to compare with, and how the study differs from the chosen one."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache
from typing import Final

from study_app.authoring.versions.contents import Kept, kept_content
from study_app.authoring.versions.runs import Run
from study_app.viewmodels.designer.versions.change_rows import ChangeGroup
from study_app.viewmodels.designer.versions.side_by_side import SideBySide
from study_app.viewmodels.designer.versions.standing import counts
from study_app.viewmodels.sessions import started_words

FILE: Final = "file"
"""The key of what the file holds."""
MOST_KEPT: Final = 40
_VERSION: Final = re.compile(r"""^\s*version\s*=\s*["']([^"']+)""", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class VersionChoice:
    """A version to compare with: its key, its words, and whether sessions were run with it."""

    key: str
    words: str
    run: bool = False


@dataclass(frozen=True, slots=True)
class ChangesView:
    """The tab.

    Attributes
    ----------
    versions : tuple of VersionChoice
        What the study can be compared with.
    chosen : str
        The key of the version that it is compared with; "" where there is none.
    groups : tuple of ChangeGroup
        What differs, by its effect.
    note : str
        What is to be known of the comparison.
    sides : SideBySide or None
        Both texts; None where no copy of the version is kept.
    can_revert : bool
        Whether differences can be reverted.
    """

    versions: tuple[VersionChoice, ...] = ()
    chosen: str = ""
    groups: tuple[ChangeGroup, ...] = ()
    note: str = ""
    sides: SideBySide | None = None
    can_revert: bool = False


def version_choices(known: Sequence[Run], kept: Iterable[Kept], file: str, now: datetime) -> tuple[VersionChoice, ...]:
    """Return what a study can be compared with: its file, what was run, and what was saved, the newest first.

    Parameters
    ----------
    known : sequence of Run
        What was run.
    kept : iterable of Kept
        What was saved.
    file : str
        What is said of the file; "" where it does not differ from the study.
    now : datetime
        For "Today 14:02".
    """
    found = [VersionChoice(FILE, file)] if file else []
    ran = {run.hash for run in known}
    found += [
        VersionChoice(run.hash, f"{run.version}: {counts(run)}, last {_when(run.last, now)}", run=True)
        for run in reversed(known)
    ]
    saved = [one for one in kept if one.hash not in ran][-MOST_KEPT:]
    found += [VersionChoice(one.hash, _kept_words(one, now)) for one in reversed(saved)]
    return tuple(found)


def _kept_words(one: Kept, now: datetime) -> str:
    when = _when(one.at, now)
    if one.origin == "draft":
        return f"Unsaved edits of another window, {when}"
    return f"{_stated(one.hash)}: {'saved' if one.origin == 'saved' else 'in the file before it was saved'} {when}"


@lru_cache(maxsize=256)
def _stated(hash_: str) -> str:
    found = _VERSION.search((kept_content(hash_) or b"").decode("utf-8", "replace"))
    return found[1] if found else "No version"


def _when(moment: str, now: datetime) -> str:
    try:
        words = started_words(datetime.fromisoformat(moment).astimezone(now.tzinfo), now)
    except ValueError:
        return "at an unknown time"
    return f"{words[:1].lower()}{words[1:]}"
