"""The version of a study in the header, and what is asked before it is saved."""

from collections.abc import Iterable
from dataclasses import dataclass

from study_app.authoring.versions.runs import Run, Standing
from study_app.number_text import counted
from study_app.viewmodels.designer.versions.change_rows import ChangeGroup
from study_app.viewmodels.tones import Tone


@dataclass(frozen=True, slots=True)
class VersionChip:
    """The chip of the version: tone, icon, words, what its tip says; and what the button that saves says."""

    tone: Tone = "neutral"
    icon: str = "ring"
    words: str = ""
    tip: str = ""
    save: str = "Save"


@dataclass(frozen=True, slots=True)
class SavePrompt:
    """What is asked before a study that was run is saved with other content.

    Attributes
    ----------
    version : str
        The version that is proposed.
    explanation : str
        Which sessions were run with which version.
    groups : tuple of ChangeGroup
        What differs.
    note : str
        What is to be known of the comparison, "" where nothing is.
    problems : str
        What is wrong with the study, "" where nothing is.
    another : bool
        Whether to offer saving as another study.
    """

    version: str
    explanation: str
    groups: tuple[ChangeGroup, ...] = ()
    note: str = ""
    problems: str = ""
    another: bool = False


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


def save_prompt(
    standing: Standing, known: Iterable[Run], groups: tuple[ChangeGroup, ...], note: str, problems: int
) -> SavePrompt:
    """Return what is asked before saving."""
    ran = [run for run in known if run.sessions]
    sessions = "; ".join(f"{counts(run)} with version {run.version}" for run in ran)
    explanation = (
        f"This study was run: {sessions}. A version that was run is never overwritten: the study is saved under "
        "another number."
    )
    wrong = (
        f"{counted(problems, 'problem')}: new sessions are refused until {'it is' if problems == 1 else 'they are'} "
        "solved."
        if problems
        else ""
    )
    another = any(group.tone != "ok" for group in groups) or not groups
    return SavePrompt(standing.version, explanation, groups, note, wrong, another)
