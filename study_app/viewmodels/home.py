"""What the home window says of protocols and sessions, as values. No Qt here."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path

from study_app.errors import ProtocolError, StudyError
from study_app.protocol.describe import expected_duration_s
from study_app.protocol.load import at_hand, is_scene_file, load
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import PageStep, Schedule, build_schedule
from study_app.session.resume import find_protocol, is_rehearsal, resume_at, source_to_resume
from study_app.store import receipt
from study_app.store.folders import locate
from study_app.store.journals import journal
from study_app.store.progress import progress_of
from study_app.store.sessions.folder_lock import is_open
from study_app.store.workstation import recent_protocols
from study_app.viewmodels.sessions import SessionFacts, counted, started_words

LANGUAGES = {"en": "English", "nl": "Dutch", "de": "German", "fr": "French", "es": "Spanish", "it": "Italian"}


@dataclass(frozen=True, slots=True)
class StudyFacts:
    """A protocol as a card shows it; ``source`` is the name or path it is loaded by."""

    source: str
    protocol: Protocol
    title: str
    description: str
    languages: str
    extent: str
    duration: str
    needs: str


@dataclass(frozen=True, slots=True)
class BrokenFacts:
    """A protocol file that cannot be used, and the first thing wrong with it."""

    source: str
    problem: str


def sources() -> tuple[str, ...]:
    """Return the studies at hand: recent files, then names in the workspace and of those that ship; no liquid files."""
    names = sorted(at_hand(), key=lambda name: (name != "rek2024", name == "demo", name))
    found = dict.fromkeys((*recent_protocols(), *names))
    return tuple(source for source in found if not holds_liquids_alone(source))


def holds_liquids_alone(source: str) -> bool:
    """Return whether a file holds liquids and no study; a file that cannot be read does not."""
    try:
        return is_scene_file(source)
    except ProtocolError:
        return False


def study_facts(source: str) -> StudyFacts | BrokenFacts:
    """Load the protocol ``source`` and say what a researcher chooses by."""
    try:
        protocol = load(source)
    except ProtocolError as error:
        count = len(error.problems)
        others = f" (and {count - 1} more: liquid-study check {source})" if count > 1 else ""
        return BrokenFacts(source, f"{error.problems[0]}{others}")
    language = "en" if "en" in protocol.study.languages else protocol.study.languages[0]
    settings = sum(len(block.conditions) * block.repetitions for block in protocol.main_blocks)
    return StudyFacts(
        source=source,
        protocol=protocol,
        title=protocol.text(protocol.study.title, language),
        description=" ".join(protocol.study.description.split()),
        languages=", ".join(sorted(LANGUAGES.get(code, code) for code in protocol.study.languages)),
        extent=", ".join(
            (
                counted(protocol.parts, "part"),
                counted(settings, "setting"),
                counted(protocol.responses_per_participant(), "answer"),
            )
        ),
        duration=f"about {max(1, round(expected_duration_s(protocol) / 60))} min",
        needs=f"Falcon or mouse; at most {protocol.device.force_limit_n:g} N",
    )


@dataclass(frozen=True, slots=True)
class Interrupted:
    """A session that can go on: who, where it stopped and what is on disk, in words; ``folder`` is the session's."""

    folder: Path
    source: str
    participant: str
    heading: str
    line: str


def interrupted(found: Iterable[SessionFacts], studies: Iterable[StudyFacts], now: datetime) -> Interrupted | None:
    """Return the newest session that can go on here, if any: unfinished, open in no program, of a protocol at hand."""
    studies = tuple(studies)
    by_name = {facts.protocol.study.name: facts for facts in studies}
    for session in found:
        study = by_name.get(session.study)
        if session.status != "unfinished" or study is None or is_open(session.folder):
            continue
        try:
            folder = locate(session.folder)[1]
            if is_rehearsal(receipt.read(folder.receipt)):
                continue
            lines = journal.read(folder.journal)
            begun = progress_of(lines)
            schedule = build_schedule(study.protocol, session.participant, begun.start["seed"])
            source = find_protocol(
                begun.start, [facts.source for facts in studies], partial(source_to_resume, session.folder)
            )
            step = resume_at(study.protocol, schedule, lines).step
        except StudyError:
            continue  # what is wrong with it is said when it is asked for by its folder
        where = place_words(study.protocol, schedule, step)
        stopped = started_words(datetime.fromisoformat(lines[-1]["at"]).astimezone(now.tzinfo), now)
        whole = f" of {session.answers_of}" if session.answers_of is not None else ""
        kind = "Pilot " if session.pilot else ""
        return Interrupted(
            folder=session.folder,
            source=source,
            participant=session.participant,
            heading=f"{kind}{session.participant}, session {session.session} stopped {where}",
            line=f"{stopped}. {session.answers}{whole} answers are on disk; nothing is missing before that point.",
        )
    return None


def place_words(protocol: Protocol, schedule: Schedule, step: int) -> str:
    """Return where a session goes on, in the operator's words and without a condition: "in part 2, delay setting 3"."""
    language = "en" if "en" in protocol.study.languages else protocol.study.languages[0]
    if step >= len(schedule.steps):
        return "after its last page"
    here = schedule.steps[step]
    if isinstance(here, PageStep):
        return f"before “{protocol.text(protocol.pages[here.page_id].title, language)}”"
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
