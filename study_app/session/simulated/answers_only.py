"""Simulated sessions with answers only: state machine, questionnaires and answer model, without a servo.

The percept of a trial is drawn from the percepts of rehearsed participants in the same condition
(`condition_features`). A task takes its shortest time and is not measured, so its columns are n/a. Everything else is
as in a rehearsal: the state machine, the orders, the answer model and the files, whose rows are marked as simulated.
With equal percepts the answers equal those of the rehearsal.

A session can also begin at a later step: a simulated participant, who senses varied numbers exactly as requested and
nothing else, answers the steps before it, and the session is resumed there. The journal notes which steps were
simulated, and the session counts as simulated.
"""

import time
import typing
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path
from typing import Final

from study_app.errors import SessionError
from study_app.protocol.blocks import Block
from study_app.protocol.load import parse, source_bytes
from study_app.protocol.model import Protocol
from study_app.protocol.simulated import NO_FEATURES, Comparison, TrialFeatures, as_requested
from study_app.protocol.trials import Stimulated
from study_app.session.pages import DesignPage, FeedbackPage, Interval, PausePage, QuestionnairePage, TaskPage, TextPage
from study_app.session.resume import REHEARSED_SCREENS, begun_schedule
from study_app.session.simulated.observers import reading_s
from study_app.session.simulated.participant import LOOK_AT_SETTING_S, SimulatedParticipant
from study_app.session.simulated.rehearsal import REHEARSED_PEOPLE, ConditionFeatures, condition_features
from study_app.session.transitions.events import (
    Adjust,
    Begin,
    Command,
    Continue,
    Event,
    Finish,
    ResumeRequested,
    ShowPage,
    StartTrial,
    Stepped,
    TaskDone,
    TimeUp,
    Write,
)
from study_app.session.transitions.page_builder import preview
from study_app.session.transitions.state import FINAL, Phase, SessionState
from study_app.session.transitions.table import advance, initial_state
from study_app.store.blinded import simulated_groups
from study_app.store.files import StudyFolder, rehearsal_folder
from study_app.store.journals.journal import SessionClock
from study_app.store.journals.journal_events import Event as Line
from study_app.store.journals.journal_events import FormShown, Note, PageShown, TrialStarted, start_of
from study_app.store.sessions import SessionStart, SimulatedStudy, begin_session
from study_app.workspace import workspace

DEVICE = {"name": "answers-only", "measured": False}
REPORT_INTERVAL_S = 5.0
_STEP_EVENTS: Final = (PageShown, FormShown, TrialStarted)
"""The events that begin a step."""


def rehearse_answers(
    protocol: str | Path,
    *,
    participants: int,
    seed: int,
    results: Path | None = None,
    group: str | None = None,
    features: ConditionFeatures | None = None,
    progress: Callable[[str], object] | None = None,
) -> Path:
    """Simulate the answers of P001, P002 … in all their planned sessions and return the study folder.

    Parameters
    ----------
    protocol : str or Path
        File or name of a protocol.
    participants : int
        Number of participants.
    seed : int
        Seed of all randomness, including the key's.
    results : Path, optional
        Study folder; by default a new ``results/<study>-rehearsal-<n>`` of the workspace.
    group : str, optional
        The pre-existing group of all participants; by default they are divided in the planned ratio.
    features : ConditionFeatures, optional
        The features of each condition; by default they are rehearsed first.
    progress : callable, optional
        Called with a line from time to time.

    Raises
    ------
    ProtocolError
        The protocol cannot be used.
    StoreError
        The folder holds another study or an id is used already, and nothing was changed; or it cannot be written.
    SessionError
        A session broke.
    """
    source = source_bytes(protocol)
    study = parse(source, str(protocol))
    folder = rehearsal_folder(workspace().results, study.study.name) if results is None else Path(results)
    participant_ids = tuple(f"P{number:03d}" for number in range(1, participants + 1))
    groups = simulated_groups(StudyFolder(folder), study, participant_ids, group)
    simulated_study = SimulatedStudy(
        folder, study, source, participant_ids, seed=seed, device=DEVICE, screens=REHEARSED_SCREENS
    )
    if features is None:
        features = condition_features(study, seed=seed, people=REHEARSED_PEOPLE, progress=progress)
    last_report_s = time.perf_counter()
    with simulated_study:
        for number, participant in enumerate(participant_ids, start=1):
            session = 1
            while _answer_session(study, participant, groups[participant], simulated_study, features, session=session):
                session += 1
            if progress is not None and (
                time.perf_counter() - last_report_s >= REPORT_INTERVAL_S or number == participants
            ):
                last_report_s = time.perf_counter()
                progress(f"{participant}: {number} of {participants} simulated participants have answered")
    return folder


def _answer_session(
    study: Protocol,
    participant: str,
    group: str | None,
    simulated_study: SimulatedStudy,
    features: ConditionFeatures,
    *,
    session: int,
) -> bool:
    """Simulate the answers of one session and return whether another follows; ``group`` is pre-existing."""
    time_passed = SimulatedTime()
    store = simulated_study.begin(
        participant, SessionClock(time_passed.ns, datetime.now().astimezone()), group, session=session
    )
    protocol = store.protocol
    schedule = begun_schedule(protocol, start_of(store.lines), simulated_study.key)
    state = initial_state(
        protocol, schedule, simulated_study.key.codes, study.study.languages[0], secret=simulated_study.key.nonce
    )
    answering = Answering(
        study, state, store, time_passed, lambda block, condition: features[block, condition], session=session
    )
    answering.run()
    return answering.state.phase is Phase.COMPLETE and session < store.planned


class SimulatedStore(typing.Protocol):
    """The interface of the store of a simulated session."""

    def append(self, event: Line, *, t_s: float | None = None) -> None: ...  # noqa: D102
    def finish(self, status: str, reason: str = "") -> None: ...  # noqa: D102


@dataclass(slots=True)
class SimulatedTime:
    """The simulated time of a session [s]."""

    seconds: float = 0.0

    def ns(self) -> int:
        """Return the time in ns, as a clock."""
        return round(self.seconds * 1e9)


class Answering(SimulatedParticipant):
    """One session of simulated answers, without a servo."""

    def __init__(
        self,
        study: Protocol,
        state: SessionState,
        store: SimulatedStore,
        time_passed: SimulatedTime,
        features: Callable[[str, str], Sequence[TrialFeatures]],
        *,
        session: int = 1,
    ) -> None:
        self._features_of = features
        self._features = NO_FEATURES
        self._sensed: dict[int, list[float]] = {}  # by trial, in the order of intervals
        self._time = time_passed
        self._store = store
        super().__init__(study, state.plan.schedule, session=session)
        self.state = state

    def run(self, until: int | None = None) -> None:
        """Run from the first page to the last, or to the beginning of the step with index ``until``."""
        if until == 0:
            return
        self._post(Begin(self._time.seconds))
        while self.state.phase not in FINAL and (until is None or self.state.index < until):
            match self.page:
                case TextPage() as page:
                    self._wait(reading_s(page))
                    self._post(Continue(self._time.seconds))
                case TaskPage(interval=Interval(resting=True)) | FeedbackPage():
                    self._wait(
                        max(0.0, (self.state.until_s or 0.0) - self._time.seconds) + 0.001
                    )  # time advances in whole ms
                    self._post(TimeUp(self._time.seconds))
                case TaskPage(adjusts=True) as page:
                    self._adjust_level(page)
                case TaskPage() as page:
                    self._wait(page.task.shortest_s)
                    self._post(TaskDone(self._time.seconds, "complete", {}))
                case QuestionnairePage() | DesignPage() as page:
                    self._fill_in(page)
                case PausePage():  # before the first trial of a resumed session
                    self._post(ResumeRequested(self._time.seconds, "participant"))
                case _:
                    raise SessionError(f"the session failed at {self.page}")

    def _adjust_level(self, page: TaskPage) -> None:
        """Adjust the level, which is sensed exactly, until the setting is done or its time is over."""
        observer, began_s = self._adjusting_observer(page.trial), self._time.seconds
        sensed = self._sensed[page.trial]
        self._wait(page.task.judged_from_s)
        while True:
            self._wait(LOOK_AT_SETTING_S)
            steps = observer.steps(sensed[-1], self._reference_magnitude(page.trial, sensed[-1]))
            timed_out = self._time.seconds - began_s >= page.task.limit_s
            if timed_out or not steps:
                break
            self._post(Stepped(self._time.seconds, steps))
        self._post(TaskDone(self._time.seconds, "timeout" if timed_out else "complete", {}))

    def _perceived_features(self, _trial: int | None) -> TrialFeatures:
        return self._features

    def _sensed_magnitudes(self, block: Block) -> Mapping[int, Sequence[float]]:
        return {number: sensed for number, sensed in self._sensed.items() if self._trials[number].block == block.id}

    def _store_percept(self, trial: int, presented: Stimulated) -> None:
        """Store the percept of a trial: a varied number exactly as requested, or drawn features of its condition."""
        block = self.state.trial.block
        if presented.vary is not None:
            self._sensed.setdefault(trial, []).append(as_requested(presented))
            return
        features = self._features_of(block, presented.condition)
        self._features = features[int(len(features) * self._stream(f"{trial}/felt")())]
        if self.state.due is not None:
            attended = Comparison.of(self._study, self._study.blocks[block], self.observer)
            self._sensed.setdefault(trial, []).append(attended.sensed(self._features))

    def _seconds(self) -> float:
        return self._time.seconds

    def _wait(self, seconds: float) -> None:
        """Advance the time, in whole milliseconds like a servo's clock."""
        self._time.seconds = round(self._time.seconds + seconds, 3)

    def _post(self, event: Event) -> None:
        self.state, commands = advance(self.state, event)
        for command in commands:
            self._carry_out(command, event.at_s)

    def _carry_out(self, command: Command, at_s: float) -> None:
        match command:
            case Write(line):
                self._store.append(line, t_s=at_s)
            case StartTrial(trial=trial, presented=presented):
                self._store_percept(trial, presented)
            case Adjust(presented=presented, line=line):
                self._sensed[line.trial].pop()
                self._store_percept(line.trial, presented)
                self._store.append(line, t_s=at_s)
            case ShowPage(page):
                self.page = page
            case Finish(status, reason):
                self._store.finish(status, reason)
            case _:
                pass  # commands for the servo, the recorder and the device have no effect without a device


def begin_session_at_step(results: Path, study: Protocol, source: bytes, start: SessionStart, step: int) -> Path:
    """Begin a session in a new study folder, simulate the answers before ``step``, and return the session's folder.

    The session is unfinished; when resumed exactly, it continues at ``step`` or the next step that is due.

    Parameters
    ----------
    results : Path
        The study folder, without sessions.
    study : Protocol
        The study.
    source : bytes
        Its source.
    start : SessionStart
        The initial data of the session.
    step : int
        The index of the step in the schedule of `preview.preview` with the same seed and participant.

    Raises
    ------
    SessionError
        The simulated participant does not reach that step.
    StoreError
        The folder cannot be written.
    """
    previewed = preview(study, start.seed, start.participant)
    state = initial_state(
        previewed.protocol, previewed.schedule, previewed.codes, start.language, secret=previewed.secret
    )
    lines, time_passed = _LinesBeforeStep(), SimulatedTime()
    answering = Answering(study, state, lines, time_passed, lambda _block, _condition: (NO_FEATURES,))
    lines.session = answering
    lines.until = step
    answering.run(until=step)
    if step and answering.state.index < step:
        raise SessionError(f"step {step + 1} cannot be reached: {lines.reason or 'the session ends before this step'}")
    clock = SessionClock(lambda: 0, datetime.now().astimezone() - timedelta(seconds=time_passed.seconds))
    with begin_session(results, study, source, start, clock=clock) as store:
        if store.key.codes != previewed.codes:
            raise SessionError(f"{results} contains sessions with a different seed: use a new folder")
        if step:
            text = f"A simulated participant completed steps 1 to {step} without force."
            store.append(Note(kind="note", text=text), t_s=0.0, waits=False)
        for event, at_s in lines.kept:
            store.append(event, t_s=at_s, waits=False)
        return store.folder.path


@dataclass
class _LinesBeforeStep:
    """A store that keeps only the lines before a given step."""

    kept: list[tuple[Line, float]] = field(default_factory=list)
    reason: str = ""
    session: Answering | None = None
    until: int = 0
    _begun: bool = False

    def append(self, event: Line, *, t_s: float | None = None) -> None:
        """Store a line, unless the step has begun."""
        assert self.session is not None  # noqa: S101 - set before the session runs
        self._begun = self._begun or (isinstance(event, _STEP_EVENTS) and self.session.state.index >= self.until)
        if not self._begun:
            self.kept.append((event, t_s or 0.0))

    def finish(self, _status: str, reason: str = "") -> None:
        """Store the reason why the session ended before the step."""
        self.reason = reason
