"""Which contents of a study were run, by how many sessions, and what may be saved under which version."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from study_app.authoring.versions.contents import content_hash, keep_content, kept_content
from study_app.authoring.writer.refused import Refused
from study_app.errors import StoreError
from study_app.number_text import counted
from study_app.protocol.source.files import with_liquid_files
from study_app.store import receipt
from study_app.store.folders import StudyFolder

_VERSION: Final = re.compile(r"[0-9A-Za-z.+-]+")
_NAME: Final = re.compile(r"[a-z][a-z0-9]*")


@dataclass(frozen=True, slots=True)
class Run:
    """The sessions that were run with one content of a study's file, counted by what they were.

    Attributes
    ----------
    hash : str
        ``protocol_hash`` of the content.
    version : str
        Its version.
    sessions, pilots, rehearsals : int
        How many there are; pilots are marked as such, also those that were played in the study designer and kept;
        rehearsals are the other sessions on simulated devices.
    last : str
        When the newest began, as ISO 8601.
    receipt : Path or None
        A receipt that holds the protocol, without its conditions.
    """

    hash: str
    version: str
    sessions: int = 0
    pilots: int = 0
    rehearsals: int = 0
    last: str = ""
    receipt: Path | None = None

    @property
    def protocol(self) -> Mapping[str, Any] | None:
        """The protocol of the receipt; None where it cannot be read any more."""
        try:
            held = None if self.receipt is None else receipt.read(self.receipt).get("protocol")
        except StoreError:
            return None
        return held if isinstance(held, dict) else None


def runs(results: Path, study: str) -> tuple[Run, ...]:
    """Return every content of a study that sessions were run with, the newest last.

    Nothing is read but receipts; no sealed key. A receipt that cannot be read is left out (`verify` reports it).

    Parameters
    ----------
    results : Path
        The folder with the studies' folders.
    study : str
        The study's name; its pilots and rehearsals are in folders of their own. No session has a name that `check`
        refuses.
    """
    if not _NAME.fullmatch(study):
        return ()
    found: dict[str, Run] = {}
    others = (folder for kind in ("pilot", "rehearsal") for folder in sorted(results.glob(f"{study}-{kind}-*")))
    for folder in (results / study, results / f"{study}-pilot", *others):
        for session in StudyFolder(folder).sessions():
            if (one := run_of(session.receipt)) is not None:
                run = found.get(one.hash, replace(one, sessions=0, pilots=0, rehearsals=0))
                found[one.hash] = replace(
                    run,
                    sessions=run.sessions + one.sessions,
                    pilots=run.pilots + one.pilots,
                    rehearsals=run.rehearsals + one.rehearsals,
                    last=max(run.last, one.last),
                )
    return tuple(sorted(found.values(), key=lambda run: run.last))


def run_of(path: Path) -> Run | None:
    """Return the content that the session of a receipt was run with; None where the receipt cannot be read."""
    try:
        return _run(path, path.stat().st_mtime_ns)
    except (StoreError, OSError):
        return None


@lru_cache(maxsize=4096)
def _run(path: Path, _changed_ns: int) -> Run:
    held = receipt.read(path)
    version = str(held.get("protocol", {}).get("study", {}).get("version", ""))
    simulated, pilot = bool(held.get("simulated")), bool(held.get("pilot"))
    counted = (int(not simulated and not pilot), int(pilot), int(simulated and not pilot))
    return Run(str(held.get("protocol_hash")), version, *counted, str(receipt.began_at(held) or ""), path)


def recorded_items(known: Iterable[Run]) -> dict[tuple[str, str], int]:
    """Return how many sessions of participants were asked each item, by its questionnaire and id."""
    found: dict[tuple[str, str], int] = {}
    for run in known:
        held = run.protocol if run.sessions else None
        for name, questionnaire in (held or {}).get("questionnaires", {}).items():
            for item in questionnaire.get("items", ()):
                found[name, item["id"]] = found.get((name, item["id"]), 0) + run.sessions
    return found


def source_of(run: Run) -> str | None:
    """Return the text of a content that was run, with its liquid files; None where no copy is kept."""
    content = kept_content(run.hash)
    return None if content is None else content.decode("utf-8", "replace")


def keep_what_was_run(file: Path, known: Iterable[Run]) -> None:
    """Keep the file's content where sessions were run with it, before another program can change it.

    Raises
    ------
    StoreError
        It cannot be written.
    """
    try:
        source = with_liquid_files(file.read_bytes(), file.parent)
    except OSError:
        return
    if any(run.hash == content_hash(source) for run in known):
        keep_content(source)


@dataclass(frozen=True, slots=True)
class Standing:
    """How a study's content stands to those that participants were run with.

    Attributes
    ----------
    version : str
        The version to save it as: its own, or the next free one.
    was : str
        The version that was run last; "" where none was.
    sessions : int
        How many sessions were run with this very content.
    asks : bool
        Whether saving asks first: the content differs from the one that was run.
    others : int
        How many sessions were run with the study's own version and another content.
    """

    version: str
    was: str = ""
    sessions: int = 0
    asks: bool = False
    others: int = 0


def standing(hash_: str, base: str, version: str, known: Iterable[Run]) -> Standing:
    """Return how a study's content stands to what was run; pilots and rehearsals protect nothing.

    Parameters
    ----------
    hash_ : str
        ``protocol_hash`` of the study as it is edited.
    base : str
        ``protocol_hash`` of the file that it is edited from; "" for a new study.
    version : str
        The version that the study states.
    known : iterable of Run
        What was run (`runs`).
    """
    ran = [run for run in known if run.sessions]
    if not ran:
        return Standing(version)
    same = sum(run.sessions for run in ran if run.hash == hash_)
    others = sum(run.sessions for run in ran if run.version == version and run.hash != hash_)
    asks = not same and bool(others or any(run.hash == base for run in ran))
    free = version
    while not same and any(run.version == free for run in ran):
        free = next_version(free)
    return Standing(free, ran[-1].version, same, asks, others)


def check_saving(hash_: str, version: str, known: tuple[Run, ...]) -> None:
    """Refuse to save a version under the number of another content that participants were run with.

    Parameters
    ----------
    hash_, version : str
        ``protocol_hash`` and version of what is to be saved.
    known : tuple of Run
        What was run (`runs`); pilots and rehearsals protect nothing.

    Raises
    ------
    Refused
        The version was run with another content.
    """
    others = sum(run.sessions for run in known if run.version == version and run.hash != hash_)
    if others:
        raise Refused(
            f"version {version} was run by {counted(others, 'session')} with another content: "
            f"save it as version {next_version(version)}"
        )


def check_version(version: str, known: Iterable[Run]) -> None:
    """Refuse what cannot be the version of a content that was not run.

    Raises
    ------
    Refused
        It is not letters, digits, dots, plus and minus, or participants were run with it.
    """
    if not _VERSION.fullmatch(version):
        raise Refused(f'"{version}" cannot be a version: write letters, digits, dots, plus and minus, such as 1.2')
    if any(run.sessions and run.version == version for run in known):
        raise Refused(f"version {version} was run with another content: choose another number")


def next_version(version: str) -> str:
    """Return a version with its last number raised: 1.2 of 1.1; of one without a number, with ".1" added."""
    last = re.search(r"(\d+)(\D*)$", version)
    if last is None:
        return f"{version}.1"
    return f"{version[: last.start()]}{int(last[1]) + 1}{last[2]}"
