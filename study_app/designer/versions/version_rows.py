"""Versions of a study as the designer shows them: the chip of the header, the card that saves, the tab Changes."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache
from typing import Final

from study_app.designer.versions.standing import Standing
from study_app.gui.sessions.session_facts import started_words
from study_app.gui.theme.theme import Tone
from study_app.number_text import counted
from study_app.store.study_runs import Run
from study_app.store.study_versions import Kept, kept_content

FILE: Final = "file"
"""The key of what the file holds."""
MOST_KEPT: Final = 40
_VERSION: Final = re.compile(r"""^\s*version\s*=\s*["']([^"']+)""", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class VersionChip:
    """The chip of the version: tone, icon, words, what its tip says; and what the button that saves says."""

    tone: Tone = "neutral"
    icon: str = "ring"
    words: str = ""
    tip: str = ""
    save: str = "Save"


@dataclass(frozen=True, slots=True)
class Comparison:
    """How a study differs from a version: lines of a unified difference, or sentences, and a note about it."""

    lines: tuple[str, ...] = ()
    note: str = ""


@dataclass(frozen=True, slots=True)
class SavePrompt:
    """What is asked before a study that was run is saved with other content.

    ``version`` is proposed, ``explanation`` names the sessions of each version, ``problems`` says what is wrong with
    the study, "" where nothing is.
    """

    version: str
    explanation: str
    difference: Comparison
    problems: str = ""


@dataclass(frozen=True, slots=True)
class VersionChoice:
    """A version to compare with: its key, its words, and whether sessions were run with it."""

    key: str
    words: str
    run: bool = False


@dataclass(frozen=True, slots=True)
class ChangesView:
    """The tab: the versions, the key of the chosen one ("" without any), and whether it can be restored."""

    versions: tuple[VersionChoice, ...] = ()
    chosen: str = ""
    difference: Comparison = Comparison()
    can_restore: bool = False


def version_chip(standing: Standing, known: Iterable[Run]) -> VersionChip:
    """Return the chip of a study that stands so to what was run."""
    known = tuple(known)
    tip = run_words(known)
    save = f"Save {standing.version} …" if standing.asks else "Save"
    if not standing.was:
        words = "Piloted" if any(run.pilots for run in known) else "Rehearsed" if known else "Not run yet"
        return VersionChip("neutral", "ring", words, tip or "No session was run with this study", save)
    if standing.sessions:
        words = f"{standing.version}, run by {standing.sessions}"
        return VersionChip("ok", "check", words, tip, save)
    return VersionChip("accent", "pen", f"{standing.version}, was {standing.was}", tip, save)


def run_words(known: Iterable[Run]) -> str:
    """Return how many sessions, pilots and rehearsals there were with each version, one line per version."""
    return "\n".join(f"Version {run.version}: {counts(run)}" for run in known)


def counts(run: Run) -> str:
    """Return "12 sessions, 2 pilots, 1 rehearsal", without what there is none of."""
    numbers = ((run.sessions, "session"), (run.pilots, "pilot"), (run.rehearsals, "rehearsal"))
    return ", ".join(counted(number, word) for number, word in numbers if number)


def save_prompt(standing: Standing, known: Iterable[Run], difference: Comparison, problems: int) -> SavePrompt:
    """Return what is asked before saving."""
    ran = [run for run in known if run.sessions]
    sessions = "; ".join(f"{counts(run)} with version {run.version}" for run in ran)
    explanation = (
        f"This study was run: {sessions}. A version that was run is never overwritten: the study is saved under "
        "another number."
    )
    are = "it is" if problems == 1 else "they are"
    wrong = f"{counted(problems, 'problem')}: new sessions are refused until {are} solved." if problems else ""
    return SavePrompt(standing.version, explanation, difference, wrong)


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
