"""Texts on the versions of a study: the version chip, the versions to compare with, the edits of a draft."""

import re
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Final

from study_app.designer.document.document import Standing
from study_app.designer.document.elements import element_of, study_title, title_of
from study_app.designer.document.fields import label_of
from study_app.designer.document.study import Study
from study_app.gui.sessions.session_facts import start_time_text
from study_app.gui.theme import Tone
from study_app.number_text import counted
from study_app.protocol.descriptions import document_differences
from study_app.store.versions import Kept, Run, kept_content

FILE: Final = "file"
"""The key of the file's content among the versions."""
_MAX_KEPT: Final = 40
_VERSION_LINE: Final = re.compile(r"""^\s*version\s*=\s*["']([^"']+)""", re.MULTILINE)


@dataclass(frozen=True, slots=True, kw_only=True)
class VersionChip:
    """The version chip: tone, icon, text and tool tip, and the text of the save button."""

    tone: Tone = "neutral"
    icon: str = "ring"
    text: str = ""
    tip: str = ""
    save: str = "Save"


@dataclass(frozen=True, slots=True)
class Comparison:
    """The differences between a study and a version: lines of a unified diff, or sentences, and a note."""

    lines: tuple[str, ...] = ()
    note: str = ""


def version_chip(standing: Standing, known: Iterable[Run]) -> VersionChip:
    """Return the version chip of a study; ``known`` are the versions that were run."""
    known = tuple(known)
    tip = "\n".join(f"Version {run.version}: {run_counts(run)}" for run in known)
    save = f"Save {standing.version}…" if standing.needs_confirmation else "Save"
    if not standing.last_version:
        text = "Piloted" if any(run.pilots for run in known) else "Rehearsed" if known else "Not yet run"
        return VersionChip(
            tone="neutral", icon="ring", text=text, tip=tip or "No session has been run with this study", save=save
        )
    if standing.sessions:
        text = f"{standing.version}, run by {standing.sessions}"
        return VersionChip(tone="ok", icon="check", text=text, tip=tip, save=save)
    return VersionChip(
        tone="accent", icon="pen", text=f"{standing.version}, was {standing.last_version}", tip=tip, save=save
    )


def run_counts(run: Run) -> str:
    """Return the counts of a run as text, without zeros: "12 sessions, 2 pilots, 1 rehearsal"."""
    numbers = ((run.sessions, "session"), (run.pilots, "pilot"), (run.rehearsals, "rehearsal"))
    return ", ".join(counted(number, word) for number, word in numbers if number)


def version_choices(
    known: Sequence[Run], kept: Iterable[Kept], file: str, now: datetime
) -> tuple[tuple[str, str], ...]:
    """Return key and label of each version to compare with: the file, run and saved versions, newest first.

    ``file`` is the label of the file, "" if it equals the study; ``now`` is used for "Today 14:02".
    """
    choices = [(FILE, file)] if file else []
    run_hashes = {run.hash for run in known}
    choices += [
        (run.hash, f"{run.version}: {run_counts(run)}, last {_time_text(run.last, now)}") for run in reversed(known)
    ]
    saved = [version for version in kept if version.hash not in run_hashes][-_MAX_KEPT:]
    choices += [(version.hash, _kept_label(version, now)) for version in reversed(saved)]
    return tuple(choices)


def _kept_label(version: Kept, now: datetime) -> str:
    when = _time_text(version.at, now)
    if version.origin == "draft":
        return f"Unsaved edits from another window, {when}"
    version_line = _VERSION_LINE.search((kept_content(version.hash) or b"").decode("utf-8", "replace"))
    origin = "saved" if version.origin == "saved" else "the file before it was saved"
    operator = f" by {version.by}" if version.by else ""
    return f"{version_line[1] if version_line else 'No version'}: {origin}{operator} {when}"


def _time_text(moment: str, now: datetime) -> str:
    try:
        text = start_time_text(datetime.fromisoformat(moment), now)
    except ValueError:
        return "at an unknown time"
    return f"{text[:1].lower()}{text[1:]}"


_MAX_NAMED: Final = 3
"""Greatest number of elements named in a list of unsaved edits."""


def draft_title(draft: str, folder: Path) -> str:
    """Return the title of the study in a draft's text, "" if it has none."""
    return study_title(Study(draft, folder).document)


def edited_elements_text(saved: str, draft: str, folder: Path) -> str:
    """Return the elements in which a draft differs from its file: ": Water, Welcome and 2 more"."""
    study = Study(draft, folder)
    try:
        differences = document_differences(tomllib.loads(saved), tomllib.loads(draft))
    except ValueError:  # the text of one of them is not TOML
        return ""
    places = (difference.place[:2] for difference in differences)
    titles = dict.fromkeys(
        label_of(path[1]) if path[0] == "study" else title_of(study.document, element_of(study, path))
        for path in places
    )
    named_titles, more_count = list(titles)[:_MAX_NAMED], len(titles) - _MAX_NAMED
    more_text = f" and {more_count} more" if more_count > 0 else ""
    return f": {', '.join(named_titles) or 'only comments, order or formatting'}{more_text}"
