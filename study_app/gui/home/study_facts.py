"""Facts about protocols and sessions for the home page, without Qt."""

import time
import typing
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache, partial
from pathlib import Path
from typing import Final, TypeAlias

from study_app.errors import ProtocolError, StudyError
from study_app.gui.sessions.session_facts import (
    SAMPLE,
    SessionFacts,
    count_range_text,
    extent_of,
    operator_language,
    start_time_text,
    step_title,
)
from study_app.number_text import counted
from study_app.protocol.load import is_scene_file, load, parse
from study_app.protocol.model import Protocol
from study_app.protocol.orders import Schedule, Trial
from study_app.protocol.source import known_protocols, protocol_file, shipped, without_byte_order_mark
from study_app.protocol.wording import language_name
from study_app.session.resume import begun_schedule, find_protocol, is_rehearsal, resume_at, source_to_resume
from study_app.store import receipt
from study_app.store.blinded import read_key, session_protocol
from study_app.store.files import locate_session
from study_app.store.integrity import is_open
from study_app.store.journals import journal
from study_app.store.journals.journal_events import COMPLETED, INCOMPLETE, start_of
from study_app.store.versions import draft_files, draft_of, kept_original, unsaved_files
from study_app.store.workstation import recent_protocols
from study_app.workspace import workspace

SHIPPED: Final = "Shipped study"
_FIRST_STUDY: Final = "demo"


@dataclass(frozen=True, slots=True)
class DraftNote:
    """The note about an unsaved draft, and the time at which the draft was stored (ISO 8601)."""

    words: str
    kept_at: str


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyFacts:
    """The facts on a study's card; ``source`` is the name or path from which the study is loaded.

    ``origin`` is "Shipped study", "Copy of demo" or "Own study", ``draft`` the note about unsaved changes, if any.
    """

    source: str
    protocol: Protocol
    title: str
    description: str
    languages: str
    extent: str
    duration: str
    needs: str
    origin: str
    draft: DraftNote | None = None

    @property
    def name(self) -> str:
        """The study's name, as stated in its sessions."""
        return self.protocol.study.name

    @property
    def file_name(self) -> str:
        """The name of the study's file without suffix, which commands accept."""
        return Path(self.source).stem


@dataclass(frozen=True, slots=True, kw_only=True)
class BrokenFacts:
    """The facts about a protocol file that cannot be used: its first problem, and fields as in `StudyFacts`."""

    source: str
    problem: str
    origin: str
    draft: DraftNote | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class DraftFacts:
    """The facts about a study that was never saved; ``source`` is the path that its file will have."""

    source: str
    title: str
    origin: str
    draft: DraftNote


def known_sources() -> tuple[str, ...]:
    """Return the known studies: recent files, the workspace's, then shipped ones, without liquid files."""
    names = sorted(known_protocols(), key=lambda name: (is_shipped(name), name != "rek2024", name == "demo", name))
    known = dict.fromkeys((*recent_protocols(), *names))
    return tuple(source for source in known if not holds_liquids_alone(source))


def file_states(opened: Iterable[str]) -> frozenset[tuple[Path, int, int]]:
    """Return the path, the modification time [ns] and the size [bytes] of each study file, draft and liquid file.

    The study files are those of the workspace, the recent ones and the ``opened`` ones.
    """
    states = []
    for path in (*workspace().own_protocols(), *map(Path, (*recent_protocols(), *opened)), *draft_files()):
        with suppress(OSError):
            state = path.stat()
            states.append((path, state.st_mtime_ns, state.st_size))
    return frozenset(states)


class DraftWords(typing.Protocol):
    """The study designer's description of a draft."""

    def draft_title(self, draft: str, folder: Path) -> str: ...

    def edited_elements_text(self, saved: str, draft: str, folder: Path) -> str: ...


LoadWords: TypeAlias = Callable[[], DraftWords] | None
"""A function that imports the designer, called only if there is a draft; None if drafts are not described."""


def last_written_ns(session: Path) -> int:
    """Return the time of the last line of a session's journal [ns]; 0 if it is unknown."""
    with suppress(OSError):
        return (session / "journal.jsonl").stat().st_mtime_ns
    return 0


def _last_study(results: Path) -> str:
    """Return the name of the study of the latest session under ``results``, except samples, or ""."""
    folders = results.glob("*/data/sub-*/ses-*")
    with suppress(StudyError, ValueError):
        last = max(
            (folder for folder in folders if not folder.relative_to(results).parts[0].startswith(SAMPLE)),
            key=last_written_ns,
        )
        return start_of(journal.read(last / "journal.jsonl")).study
    return ""


def read_studies(
    opened: Iterable[str], draft_words: LoadWords = None, results: Path | None = None
) -> tuple[StudyFacts | BrokenFacts | DraftFacts, ...]:
    """Return the facts about each known study.

    Drafts come first, newest first, followed by ``opened`` studies and the study that was run last under ``results``,
    or the demo before the first session.
    """
    opened = tuple(opened)
    last = "" if results is None else _last_study(results)
    has_no_session = results is not None and not last
    drafts = (_draft_facts(file, draft_words) for file in unsaved_files(workspace().protocols))
    facts = (
        *filter(None, drafts),
        *(study_facts(source, draft_words) for source in dict.fromkeys((*opened, *known_sources()))),
    )

    def order(study: StudyFacts | BrokenFacts | DraftFacts) -> tuple[float, bool, bool]:
        if last and isinstance(study, StudyFacts):
            is_next = study.name == last
        else:
            is_next = study.source == _FIRST_STUDY and has_no_session
        edited_s = 0.0 if study.draft is None else _epoch_seconds(study.draft.kept_at)
        return -edited_s, study.source not in opened, not is_next

    return tuple(sorted(facts, key=order))


def _draft_facts(file: Path, draft_words: LoadWords) -> DraftFacts | None:
    draft = draft_of(file)
    if draft is None:  # the study was saved meanwhile
        return None
    title = draft_words().draft_title(draft.text, file.parent) if draft_words else ""
    note = DraftNote(f"Draft from {time_text(draft.kept_at)}, never saved", draft.kept_at)
    return DraftFacts(source=str(file), title=title or file.stem, origin=_origin_of(str(file)), draft=note)


def holds_liquids_alone(source: str) -> bool:
    """Return whether a file contains only liquids instead of a study; False if it cannot be read."""
    try:
        path = protocol_file(source)
        state = path.stat()
        return _is_liquid_file(path, state.st_mtime_ns, state.st_size)
    except (ProtocolError, OSError):
        return False


@lru_cache(maxsize=256)
def _is_liquid_file(path: Path, _changed_ns: int, _size: int) -> bool:
    try:
        return is_scene_file(path)
    except ProtocolError:
        return False


def is_shipped(source: str) -> bool:
    """Return whether a source is a shipped study, rather than one with the same name in the workspace."""
    try:
        return source in shipped() and protocol_file(source).resolve() == shipped()[source].resolve()
    except ProtocolError:
        return False


def _origin_of(source: str) -> str:
    """Return the origin of a study: "Shipped study", "Copy of demo" or "Own study"."""
    if is_shipped(source):
        return SHIPPED
    with suppress(ProtocolError):
        file = Path(source) if Path(source).suffix == ".toml" else protocol_file(source)
        if original := kept_original(file):
            return f"Copy of {original}"
    return "Own study"


def study_facts(source: str, draft_words: LoadWords = None) -> StudyFacts | BrokenFacts:
    """Load the protocol ``source`` and return the facts on its card."""
    try:
        protocol = load(source)
    except ProtocolError as error:
        count = len(error.problems)
        others = f". Open it in the designer to see all {count} problems." if count > 1 else ""
        return BrokenFacts(
            source=source,
            problem=f"{error.problems[0]}{others}",
            origin=_origin_of(source),
            draft=_draft_note(source, draft_words),
        )
    language = operator_language(protocol)
    extent = extent_of(protocol)
    return StudyFacts(
        source=source,
        protocol=protocol,
        title=protocol.text(protocol.study.title, language),
        description=" ".join(protocol.study.description.split()),
        languages=", ".join(sorted(language_name(code) for code in protocol.study.languages)),
        extent=", ".join(
            (
                count_range_text(extent.parts, "part"),
                count_range_text(extent.settings, extent.setting),
                count_range_text(extent.answers, "answer"),
            )
        ),
        duration=f"about {extent.duration}",
        needs=f"Haptic device or mouse; at most {protocol.device.force_limit_n:g} N",
        origin=_origin_of(source),
        draft=_draft_note(source, draft_words),
    )


def _draft_note(source: str, draft_words: LoadWords) -> DraftNote | None:
    """Return the note about a draft ("Draft from today 14:02, not saved: Water"), or None without unsaved changes."""
    with suppress(ProtocolError, OSError):
        file = protocol_file(source)
        draft, content = None if is_shipped(source) else draft_of(file), without_byte_order_mark(file.read_bytes())
        if draft is not None and draft.text.encode() != content:
            edited = (
                draft_words().edited_elements_text(content.decode("utf-8", "replace"), draft.text, file.parent)
                if draft_words
                else ""
            )
            return DraftNote(f"Draft from {time_text(draft.kept_at)}, not saved{edited}", draft.kept_at)
    return None


def time_text(moment: str) -> str:
    """Return a time as text: "today 14:02" or "2026-11-20 14:02"."""
    if not (seconds := _epoch_seconds(moment)):
        return "an unknown time"
    kept, now = (datetime.fromtimestamp(at).astimezone() for at in (seconds, time.time()))
    return f"today {kept:%H:%M}" if kept.date() == now.date() else f"{kept:%Y-%m-%d %H:%M}"


def _epoch_seconds(moment: str) -> float:
    """Return a time as seconds since 1970; 0 if it cannot be read."""
    try:
        return datetime.fromisoformat(moment).timestamp()
    except ValueError:
        return 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Interrupted:
    """A session that can be resumed, with texts about the participant, the step and the stored data."""

    folder: Path
    source: str
    participant: str
    heading: str
    line: str


def interrupted_session(
    sessions: Iterable[SessionFacts], studies: Iterable[StudyFacts | BrokenFacts], now: datetime
) -> Interrupted | None:
    """Return the first of the sessions that can be resumed: unfinished, not open, with a known protocol.

    A session can be resumed even if its protocol cannot be used because a liquid file is lost, since the liquids are
    sealed in the key.
    """
    studies = tuple(studies)
    for session in sessions:
        candidates = [
            study.source for study in studies if isinstance(study, BrokenFacts) or study.name == session.study
        ]
        if session.status != "unfinished" or not candidates or is_open(session.folder):
            continue
        try:
            folder = locate_session(session.folder)[1]
            if is_rehearsal(receipt.read(folder.receipt)):
                continue
            lines = journal.read(folder.journal)
            begun = start_of(lines)
            read = partial(source_to_resume, session.folder)
            source = find_protocol(begun, candidates, read)
            protocol = parse(read(source), source)
            session_study = locate_session(session.folder)[0]
            protocol = session_protocol(session_study, protocol, session.participant, begun.session)
            schedule = begun_schedule(protocol, begun, read_key(session_study.path))
            step = resume_at(protocol, schedule, lines).step
        except StudyError:
            continue  # reported when the session is opened
        position = _position_text(protocol, schedule, step)
        stopped = start_time_text(datetime.fromisoformat(lines[-1].at), now)
        total = f" of {session.answers_of}" if session.answers_of is not None else ""
        kind = "Pilot " if session.pilot else ""
        return Interrupted(
            folder=session.folder,
            source=source,
            participant=session.participant,
            heading=f"{kind}{session.participant}, session {session.session} of {session.study} stopped {position}",
            line=f"{stopped}. Answers on disk: {session.answers}{total}; all data up to that point are complete.",
        )
    return None


def _position_text(protocol: Protocol, schedule: Schedule, step: int) -> str:
    """Return the point at which a session resumes, without the condition: "in part 2, delay setting 3"."""
    language = operator_language(protocol)
    if step >= len(schedule.steps):
        return "after the last page"
    next_step = schedule.steps[step]
    if not isinstance(next_step, Trial):
        return f"before “{step_title(protocol, next_step, language)}”"
    name = next_step.label(protocol, language)
    label = f"{name[:1].lower()}{name[1:]}" + (f" of {next_step.of}" if next_step.of > 1 else "")
    return f"in part {next_step.part}, {label}" if next_step.part else f"in {label}"


def session_counts_text(sessions: Iterable[SessionFacts], study: str) -> str:
    """Return the numbers of a study's sessions: "5 sessions, 3 complete, 1 incomplete, 1 excluded, 2 pilots"."""
    of_study = [session for session in sessions if session.study == study]
    from_participants = [session for session in of_study if not session.kind]
    pilots = sum(session.kind == "pilot" for session in of_study)
    complete = sum(session.status == COMPLETED for session in from_participants)
    incomplete = sum(session.status == INCOMPLETE for session in from_participants)
    excluded = sum(session.excluded is not None for session in from_participants)
    parts = [
        f"{counted(len(from_participants), 'session')}, {complete} complete"
        if from_participants
        else "no participants yet"
    ]
    parts += [f"{incomplete} incomplete"] * bool(incomplete)
    parts += [f"{excluded} excluded"] * bool(excluded) + [counted(pilots, "pilot")] * bool(pilots)
    return ", ".join(parts)
