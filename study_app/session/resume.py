"""The start of a resumed session: the interrupted trial, or the beginning of its block."""

import contextlib
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from study_app.errors import ProtocolError, SessionError
from study_app.protocol.load import known_protocols, parse, source_bytes
from study_app.protocol.model import Protocol
from study_app.protocol.orders import FormStep, PageStep, Schedule, Step, Trial, build_schedule
from study_app.protocol.source import has_hash
from study_app.protocol.trials import TrialResult
from study_app.store.blinded import Key, open_events, place_number
from study_app.store.journals.journal_events import Event, SessionStarted
from study_app.store.session_progress import Progress, progress_of, trial_results
from study_app.store.sessions import sealed_source
from study_app.store.workstation import recent_protocols

REHEARSED_SCREENS: dict[str, Any] = {"participant": "simulated", "refresh_hz": 60}


@dataclass(frozen=True, slots=True)
class Start:
    """The point at which a session starts or resumes: the index of its first step, and the state of earlier trials.

    ``presented`` maps trial numbers to earlier presentations; ``heard`` are the answered trials of designs that still
    count. ``invalid`` counts the attempts at the first step's trial that were not delivered as requested.
    """

    step: int = 0
    presented: Mapping[int, int] = field(default_factory=dict)
    heard: tuple[TrialResult, ...] = field(default=(), repr=False)
    invalid: int = 0


FIRST = Start()


def resume_at(
    protocol: Protocol, schedule: Schedule, lines: Iterable[Event], key: Key | None = None, *, exactly: bool = False
) -> Start:
    """Return the point from which the session with these journal lines continues.

    The levels of answered trials are those of the journal, opened with the study's ``key``; without it `Start.heard` is
    empty.

    A trial with unconfirmed answers is presented again as its next attempt, so that no answer refers to a percept
    before the gap; a completed trial without questions is over. With ``resume = "block"`` in the study the whole block
    is presented again, unless the session continues ``exactly`` at the interrupted step. Raise SessionError if the
    journal does not fit this schedule.
    """
    lines = list(lines)
    progress = progress_of(lines)
    step = reached = _next_step(protocol, schedule, progress)
    heard = () if key is None else trial_results(protocol, open_events(lines, key))
    if protocol.study.resume == "block" and not exactly:
        trial = _trial_around(schedule.steps, step)
        if trial is not None:  # back to the first trial of its block
            step = next(
                index
                for index, other in enumerate(schedule.steps)
                if isinstance(other, Trial) and other.block == trial.block
            )
        earlier_trials = {trial.number for trial in schedule.steps[:step] if isinstance(trial, Trial)}
        heard = tuple(result for result in heard if result.trial in earlier_trials)
    return Start(step, progress.presented, heard, progress.invalid if step == progress.step == reached else 0)


def begun_schedule(protocol: Protocol, start: SessionStarted, key: Key) -> Schedule:
    """Return the schedule of the session whose journal begins with ``start``; ``key`` is the study's."""
    return build_schedule(protocol, start.participant, start.seed, place_number(start, key))


def is_rehearsal(session_receipt: Mapping[str, Any]) -> bool:
    """Return whether a session's receipt has a simulated participant."""
    return bool(session_receipt.get("screens") == REHEARSED_SCREENS)


def source_to_resume(session_folder: Path, name: str) -> bytes:
    """Return the source of a protocol with which a session is resumed, with its liquid files as sealed."""
    return sealed_source(session_folder, source_bytes(name))


def find_protocol(
    start: SessionStarted, candidates: Iterable[str] | None = None, read: Callable[[str], bytes] = source_bytes
) -> str:
    """Return the file or name of the protocol of a session, from its journal's first line.

    It is searched for among ``candidates``, by default the protocols in the workspace, the shipped ones and the recent
    ones; ``read`` returns the source of one. Raise SessionError if none of them belongs to that study.
    """
    names = dict.fromkeys((*known_protocols(), *recent_protocols()) if candidates is None else candidates)
    sources: dict[str, bytes] = {}
    for name in names:
        with contextlib.suppress(ProtocolError):  # an unreadable file is not a candidate
            sources[name] = read(name)
    for name, source in sources.items():
        if has_hash(source, start.protocol_hash):
            return name
    for name, source in sources.items():
        with contextlib.suppress(ProtocolError):
            if parse(source, name).study.name == start.study:
                return name
    raise SessionError(
        f"the protocol for the study {start.study!r} was not found: specify its file with --protocol FILE"
    )


def _next_step(protocol: Protocol, schedule: Schedule, progress: Progress) -> int:
    """Return the index of the first unfinished step, checked against its name in the journal."""
    steps = schedule.steps
    step_to_check = steps[progress.step] if progress.step < len(steps) else None
    step_name = (
        step_to_check.page_id
        if isinstance(step_to_check, PageStep)
        else step_to_check.form
        if isinstance(step_to_check, FormStep)
        else None
    )
    number = step_to_check.number if isinstance(step_to_check, Trial) else None
    if (progress.page, progress.trial) not in {(None, None), (step_name, number)}:
        raise SessionError(
            "the journal does not follow the order determined by the seed and the participant, so the session "
            "cannot be resumed"
        )
    if number is not None and progress.invalid >= (protocol.limits.attempts or math.inf):
        return progress.step + 1  # all permitted attempts were made
    has_questions = isinstance(step_to_check, Trial) and protocol.questionnaire_of(step_to_check.block) is not None
    return progress.step + 1 if number is not None and progress.task_done and not has_questions else progress.step


def _trial_around(steps: tuple[Step, ...], step: int) -> Trial | None:
    """Return a trial of the block that contains ``step`` (a trial, or a break between trials); None elsewhere."""
    current, previous, following = (
        steps[index] if 0 <= index < len(steps) else None for index in (step, step - 1, step + 1)
    )
    if isinstance(current, Trial):
        return current
    if isinstance(previous, Trial) and isinstance(following, Trial) and previous.block == following.block:
        return following
    return None
