"""What the home window says of protocols and sessions, as values. No Qt here."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache, partial
from pathlib import Path

from study_app.authoring.drafts import draft_files, draft_of, unsaved_files
from study_app.authoring.edited_study import read
from study_app.authoring.outline import study_title
from study_app.errors import ProtocolError, StudyError
from study_app.protocol.load import at_hand, is_scene_file, load, parse
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Schedule, Trial
from study_app.protocol.source.files import find, shipped, shipped_file
from study_app.protocol.wording.languages import language_name
from study_app.session.resume import begun_schedule, find_protocol, is_rehearsal, resume_at, source_to_resume
from study_app.store import receipt
from study_app.store.blinded.allocation import session_protocol
from study_app.store.folders import locate
from study_app.store.journals import journal
from study_app.store.progress import progress_of
from study_app.store.sessions.folder_lock import is_open
from study_app.store.workstation import recent_protocols
from study_app.viewmodels.extent import counted_each, extent_of
from study_app.viewmodels.session.stages import operator_language, step_title
from study_app.viewmodels.sessions import SessionFacts, counted, started_words
from study_app.workspace import workspace


@dataclass(frozen=True, slots=True)
class StudyFacts:
    """A protocol as a card shows it; ``source`` is the name or path it is loaded by.

    ``draft`` says that there is a draft of it that was not saved, "" where there is none.
    """

    source: str
    protocol: Protocol
    title: str
    description: str
    languages: str
    extent: str
    duration: str
    needs: str
    draft: str = ""

    @property
    def name(self) -> str:
        """The study's name, which its sessions carry."""
        return self.protocol.study.name

    @property
    def file_name(self) -> str:
        """The name of its file, without ending, which commands take."""
        return Path(self.source).stem


@dataclass(frozen=True, slots=True)
class BrokenFacts:
    """A protocol file that cannot be used, and the first thing wrong with it; ``draft`` as of `StudyFacts`."""

    source: str
    problem: str
    draft: str = ""


@dataclass(frozen=True, slots=True)
class DraftFacts:
    """A study that was never saved: the path of its file, its title, and what is said of its draft."""

    source: str
    title: str
    draft: str


def sources() -> tuple[str, ...]:
    """Return the studies at hand: recent files, then names in the workspace and of those that ship; no liquid files."""
    names = sorted(at_hand(), key=lambda name: (name != "rek2024", name == "demo", name))
    found = dict.fromkeys((*recent_protocols(), *names))
    return tuple(source for source in found if not holds_liquids_alone(source))


def file_states(opened: Iterable[str]) -> frozenset[tuple[Path, int, int]]:
    """Return path, time of change [ns] and size [bytes] of the files that studies come from, liquid files among them.

    These are the workspace's files, recent ones and ``opened`` ones, and drafts.
    """
    states = []
    for path in (*workspace().own_protocols(), *map(Path, (*recent_protocols(), *opened)), *draft_files()):
        with suppress(OSError):
            state = path.stat()
            states.append((path, state.st_mtime_ns, state.st_size))
    return frozenset(states)


def read_studies(opened: Iterable[str]) -> tuple[StudyFacts | BrokenFacts | DraftFacts, ...]:
    """Return what is said of each study at hand, ``opened`` ones first, those that were never saved last."""
    found = [study_facts(source) for source in dict.fromkeys((*opened, *sources()))]
    return (*found, *(_of_draft(file) for file in unsaved_files(workspace().protocols)))


def _of_draft(file: Path) -> DraftFacts:
    draft = draft_of(file)
    title = "" if draft is None else study_title(read(draft.text.encode(), file.parent).document)
    return DraftFacts(str(file), title or file.stem, draft_words(file))


def holds_liquids_alone(source: str) -> bool:
    """Return whether a file holds liquids and no study; a file that cannot be read does not."""
    try:
        path = find(source)
        state = path.stat()
        return _holds_liquids_alone(path, state.st_mtime_ns, state.st_size)
    except (ProtocolError, OSError):
        return False


@lru_cache(maxsize=256)
def _holds_liquids_alone(path: Path, _changed_ns: int, _size: int) -> bool:
    try:
        return is_scene_file(path)
    except ProtocolError:
        return False


def is_shipped(source: str) -> bool:
    """Return whether a source is a study that ships with the program, not one of the same name in the workspace."""
    try:
        return source in shipped() and find(source).resolve() == shipped_file(source).resolve()
    except ProtocolError:
        return False


def study_facts(source: str) -> StudyFacts | BrokenFacts:
    """Load the protocol ``source`` and say what a researcher chooses by."""
    try:
        protocol = load(source)
    except ProtocolError as error:
        count = len(error.problems)
        others = f". Open it in the designer to see all {count} problems." if count > 1 else ""
        return BrokenFacts(source, f"{error.problems[0]}{others}", _draft_words_of(source))
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
                counted_each(extent.parts, "part"),
                counted_each(extent.settings, extent.setting),
                counted_each(extent.answers, "answer"),
            )
        ),
        duration=f"about {extent.minutes}",
        needs=f"Haptic device or mouse; at most {protocol.device.force_limit_n:g} N",
        draft=_draft_words_of(source),
    )


def draft_words(file: Path) -> str:
    """Return what is said of a draft that was not saved: "Draft of today 14:02, not saved"; "" where there is none."""
    draft = draft_of(file)
    try:
        saved = draft is None or draft.text.encode() == file.read_bytes()
    except OSError:
        saved = False
    return "" if draft is None or saved else f"Draft of {time_words(draft.kept_at)}, not saved"


def _draft_words_of(source: str) -> str:
    with suppress(ProtocolError):
        return "" if is_shipped(source) else draft_words(find(source))
    return ""


def time_words(moment: str) -> str:
    """Return when a draft was kept: "today 14:02", "2026-11-20 14:02"."""
    try:
        kept = datetime.fromisoformat(moment).astimezone()
    except ValueError:
        return "an unknown time"
    today = kept.date() == datetime.now().astimezone().date()
    return f"today {kept:%H:%M}" if today else f"{kept:%Y-%m-%d %H:%M}"


@dataclass(frozen=True, slots=True)
class Interrupted:
    """A session that can go on: who, where it stopped and what is on disk, in words; ``folder`` is the session's."""

    folder: Path
    source: str
    participant: str
    heading: str
    line: str


def interrupted(
    found: Iterable[SessionFacts], studies: Iterable[StudyFacts | BrokenFacts], now: datetime
) -> Interrupted | None:
    """Return the newest session that can go on here, if any: unfinished, open in no program, of a protocol at hand.

    A protocol that cannot be used because its liquid file is lost still resumes: its liquids are sealed in the key.
    """
    studies = tuple(studies)
    for session in found:
        candidates = [it.source for it in studies if isinstance(it, BrokenFacts) or it.name == session.study]
        if session.status != "unfinished" or not candidates or is_open(session.folder):
            continue
        try:
            folder = locate(session.folder)[1]
            if is_rehearsal(receipt.read(folder.receipt)):
                continue
            lines = journal.read(folder.journal)
            begun = progress_of(lines)
            read = partial(source_to_resume, session.folder)
            source = find_protocol(begun.start, candidates, read)
            protocol = parse(read(source), source)
            study = locate(session.folder)[0]
            protocol = session_protocol(study, protocol, session.participant, begun.start["session"])
            schedule = begun_schedule(protocol, begun.start)
            step = resume_at(protocol, schedule, lines).step
        except StudyError:
            continue  # what is wrong with it is said when it is asked for by its folder
        where = place_words(protocol, schedule, step)
        stopped = started_words(datetime.fromisoformat(lines[-1]["at"]).astimezone(now.tzinfo), now)
        whole = f" of {session.answers_of}" if session.answers_of is not None else ""
        kind = "Pilot " if session.pilot else ""
        return Interrupted(
            folder=session.folder,
            source=source,
            participant=session.participant,
            heading=f"{kind}{session.participant}, session {session.session} of {session.study} stopped {where}",
            line=f"{stopped}. {session.answers}{whole} answers are on disk; nothing before that point is missing.",
        )
    return None


def place_words(protocol: Protocol, schedule: Schedule, step: int) -> str:
    """Return where a session goes on, in the operator's words and without a condition: "in part 2, delay setting 3"."""
    language = operator_language(protocol)
    if step >= len(schedule.steps):
        return "after the last page"
    here = schedule.steps[step]
    if not isinstance(here, Trial):
        return f"before “{step_title(protocol, here, language)}”"
    name = here.label(protocol, language)
    label = f"{name[:1].lower()}{name[1:]}" + (f" of {here.of}" if here.of > 1 else "")
    return f"in part {here.part}, {label}" if here.part else f"in {label}"


def held(found: Iterable[SessionFacts], study: str) -> str:
    """Return how many sessions of a study there are: "4 sessions, 3 complete, 1 excluded"."""
    own = [session for session in found if session.study == study and not session.simulated and not session.pilot]
    if not own:
        return "no participant yet"
    complete = sum(session.status == "completed" for session in own)
    excluded = sum(session.excluded is not None for session in own)
    return f"{counted(len(own), 'session')}, {complete} complete" + (f", {excluded} excluded" if excluded else "")
