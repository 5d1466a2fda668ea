"""The contents of a study's file with which sessions were run, and the numbers of sessions."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

from study_app.errors import StoreError
from study_app.protocol.descriptions import differences
from study_app.protocol.source import with_liquid_files
from study_app.store import receipt
from study_app.store.files.folders import StudyFolder
from study_app.store.merged import folders_of
from study_app.store.versions.study_versions import content_hash, keep_content, kept_content

_HIDDEN_CHANGE: Final = "only comments, liquids or conditions have changed; the receipts do not contain these"
_NAME: Final = re.compile(r"[a-z][a-z0-9]*")


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """The numbers of sessions, by type, that were run with one content of a study's file.

    Attributes
    ----------
    hash : str
        ``protocol_hash`` of the content.
    version : str
        Its version.
    sessions, pilots, rehearsals : int
        Numbers of sessions; pilots include those that were played in the study designer and kept; rehearsals are
        the other sessions on simulated devices.
    last : str
        Start of the newest session, as ISO 8601.
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
        """The protocol in the receipt; None if it can no longer be read."""
        try:
            protocol = None if self.receipt is None else receipt.read(self.receipt).get("protocol")
        except StoreError:
            return None
        return protocol if isinstance(protocol, dict) else None


def runs_of_study(results: Path, study: str) -> tuple[Run, ...]:
    """Return the contents of a study's file with which sessions were run, the newest last.

    Only receipts are read, no sealed key. An unreadable receipt is omitted (`verify` reports it).

    Parameters
    ----------
    results : Path
        The folder with the studies' folders.
    study : str
        The study's name, whose pilots and rehearsals have their own folders. An invalid name has no sessions.
    """
    if not _NAME.fullmatch(study):
        return ()
    by_hash: dict[str, Run] = {}
    numbered_folders = (
        folder for kind in ("pilot", "rehearsal") for folder in sorted(results.glob(f"{study}-{kind}-*"))
    )
    for folder in (results / study, results / f"{study}-pilot", *numbered_folders):
        for session in StudyFolder(folder).sessions():
            if (session_run := run_of(session.receipt)) is not None:
                run = by_hash.get(session_run.hash, replace(session_run, sessions=0, pilots=0, rehearsals=0))
                by_hash[session_run.hash] = replace(
                    run,
                    sessions=run.sessions + session_run.sessions,
                    pilots=run.pilots + session_run.pilots,
                    rehearsals=run.rehearsals + session_run.rehearsals,
                    last=max(run.last, session_run.last),
                )
    return tuple(sorted(by_hash.values(), key=lambda run: run.last))


def run_of(path: Path) -> Run | None:
    """Return the content used in the session of a receipt; None if the receipt cannot be read."""
    try:
        return _read_run(path, path.stat().st_mtime_ns)
    except (StoreError, OSError):
        return None


@lru_cache(maxsize=4096)
def _read_run(path: Path, _changed_ns: int) -> Run:
    session_receipt = receipt.read(path)
    version = str(session_receipt.get("protocol", {}).get("study", {}).get("version", ""))
    simulated, pilot = bool(session_receipt.get("simulated")), bool(session_receipt.get("pilot"))
    return Run(
        hash=str(session_receipt.get("protocol_hash")),
        version=version,
        sessions=int(not simulated and not pilot),
        pilots=int(pilot),
        rehearsals=int(simulated and not pilot),
        last=str(receipt.began_at(session_receipt) or ""),
        receipt=path,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedContent:
    """A content of a study's file as recorded in the receipts of a results folder, without its conditions.

    Attributes
    ----------
    version : str
        Its version.
    protocol : mapping
        The protocol in the receipt.
    participant : str
        The participant of the first session that was run with it; in a merged study the ID includes the site.
    began : str
        When this session began, as ISO 8601.
    saved_by : str
        Initials of the operator who saved the content; "" if they are not recorded.
    """

    version: str
    protocol: Mapping[str, Any]
    participant: str
    began: str
    saved_by: str

    @property
    def name(self) -> str:
        """The version and its first session: "0.2 (first session: P002, 2026-11-27; saved by AK)"."""
        saver = f"; saved by {self.saved_by}" if self.saved_by else ""
        return f"{self.version} (first session: {self.participant}, {self.began[:10]}{saver})"


def recorded_contents(folder: Path) -> tuple[RecordedContent, ...]:
    """Return the contents of the study's file recorded in the receipts of a results folder, in the order of first use.

    The study's file is not needed. A receipt that cannot be read is left out (`verify` reports it).
    """
    first: dict[str, RecordedContent] = {}
    for prefix, site_folder in folders_of(folder).items():
        for session in StudyFolder(site_folder).sessions():
            run = run_of(session.receipt)
            if run is None or (protocol := run.protocol) is None:
                continue
            known = first.get(run.hash)
            if known is None or run.last < known.began:
                first[run.hash] = RecordedContent(
                    version=run.version,
                    protocol=protocol,
                    participant=f"{prefix}{session.participant}",
                    began=run.last,
                    saved_by=str(receipt.read(session.receipt).get("saved_by", "")),
                )
    return tuple(sorted(first.values(), key=lambda content: content.began))


def content_changes(contents: Sequence[RecordedContent]) -> Iterator[tuple[RecordedContent, tuple[str, ...]]]:
    """Yield each content after the first with a sentence for each difference from the one before."""
    for before, after in pairwise(contents):
        yield after, differences(before.protocol, after.protocol) or (_HIDDEN_CHANGE,)


def recorded_items(runs: Iterable[Run]) -> dict[tuple[str, str], int]:
    """Return the number of participants' sessions in which each item was asked, by questionnaire and id."""
    counts: dict[tuple[str, str], int] = {}
    for run in runs:
        protocol = run.protocol if run.sessions else None
        for name, questionnaire in (protocol or {}).get("questionnaires", {}).items():
            for item in questionnaire.get("items", ()):
                counts[name, item["id"]] = counts.get((name, item["id"]), 0) + run.sessions
    return counts


def source_of(run: Run) -> str | None:
    """Return the text used in sessions, including its liquid files; None if no copy is stored."""
    content = kept_content(run.hash)
    return None if content is None else content.decode("utf-8", "replace")


def keep_run_content(file: Path, runs: Iterable[Run]) -> None:
    """Store the file's content if it was used in sessions, before another program can change it.

    Raises
    ------
    StoreError
        It cannot be written.
    """
    try:
        source = with_liquid_files(file.read_bytes(), file.parent)
    except OSError:
        return
    if any(run.hash == content_hash(source) for run in runs):
        keep_content(source)
