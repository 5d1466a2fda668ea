"""Whole sessions with simulated participants, faster than real time, with the same code as real sessions.

The transitions, the runner, the servo's compiled loop, the store and the checks of every questionnaire are the same;
only the device, the clock, the screen and the participant are simulated. Time is the servo's virtual clock, so that the
same call with another folder gives the same tables except for wall-clock times. Every row is marked as simulated.

The actions and answers of a participant in a trial are drawn from random streams of that trial. A rehearsal that was
killed and resumed has the same answers as an uninterrupted one, because the percepts of the whole session are computed
again. The percepts of each condition come from a few whole sessions that are not stored. A formula for the force of a
steady motion would not suffice, since answers also depend on the push of the wake, the roughness of the force and the
delay of the image.
"""

import itertools
import operator
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any, Final, Self, TypeAlias

import numpy as np

from study_app.devices.hand import hand_of
from study_app.devices.registry import all_devices, descriptor_of
from study_app.devices.rig import Rig, open_rig, study_settings
from study_app.ending_signals import ENDING_SIGNALS
from study_app.errors import SessionError, StoreError
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.number_text import counted
from study_app.protocol.blocks import Block
from study_app.protocol.load import parse, source_bytes
from study_app.protocol.model import Protocol
from study_app.protocol.orders import Schedule, Trial, build_schedule, draw_key
from study_app.protocol.presented import next_level
from study_app.protocol.questions import Value, shown_questions
from study_app.protocol.randomization import Key as LevelKey
from study_app.protocol.randomization import stream
from study_app.protocol.simulated import NO_FEATURES, Comparison, Observer, TrialFeatures
from study_app.session.pages import (
    DesignPage,
    FeedbackPage,
    Interval,
    Page,
    PausePage,
    QuestionnairePage,
    TaskPage,
    TextPage,
)
from study_app.session.ports import KeptSession, Ports
from study_app.session.resume import (
    FIRST,
    REHEARSED_SCREENS,
    Start,
    begun_schedule,
    find_protocol,
    is_rehearsal,
    resume_at,
    source_to_resume,
)
from study_app.session.runner import Runner
from study_app.session.simulated.observers import (
    Choice,
    Draw,
    SensedTrial,
    answer_choices,
    hand_behaviour,
    reading_s,
    rest_hand,
)
from study_app.session.simulated.participant import LOOK_AT_SETTING_S, AdjustingObserver, SimulatedParticipant
from study_app.session.tasks import TankView
from study_app.session.transitions.events import Begin, Continue, Event, ResumeRequested, Stepped, Submitted
from study_app.store import receipt
from study_app.store.blinded import Key, planned_sessions, session_protocol, simulated_groups
from study_app.store.files import StudyFolder, is_there, locate_session, rehearsal_folder
from study_app.store.integrity import is_never_begun, place_of, read_list
from study_app.store.journals import journal, journal_events
from study_app.store.journals.journal import SessionClock
from study_app.store.journals.journal_events import Event as Line
from study_app.store.session_progress import progress_of
from study_app.store.sessions import SessionStart, SessionStore, begin_session, rebuild_session, reopen_store, used_ids
from study_app.store.tables import check_study
from study_app.store.withdrawals import tombstones
from study_app.workspace import workspace

_TASK_POLL_S = 0.05  # interval between polls of the device during a task [s]
_IDLE_POLL_S = 0.5  # the same while reading and answering [s]
_FRAME_S = 1 / 60
_PAINT_S = (0.002, 0.006)  # time from reading the clock to the frame on the screen
Where: TypeAlias = tuple[str, str]
"""A block and a condition."""
ConditionFeatures: TypeAlias = Mapping[Where, tuple[TrialFeatures, ...]]
"""The features of each trial by block and condition."""
REHEARSED_PEOPLE: Final = 4
"""The number of simulated participants that rehearse all conditions."""


@dataclass(frozen=True, slots=True)
class Question:
    """The page of a question, and the features felt in each interval of its trial; empty for a separate form.

    For an adjustment it is the page of the task, and the last features are those felt since the last steps.
    """

    page: QuestionnairePage | DesignPage | TaskPage
    felt: tuple[TrialFeatures, ...]


Answer: TypeAlias = Callable[[Question], Value | Mapping[str, Value] | None]
"""An observer: return the answer, or the answers by item id, or None to let the simulated participant answer.

In an adjustment the answer is the number of steps, positive towards more; 0 confirms the level.
"""


def _plain_answer(value: Any) -> Any:
    """Return an answer as Python numbers and texts; a list or array becomes a tuple."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    return tuple(_plain_answer(item) for item in value) if isinstance(value, list | tuple) else value


class _HeldSignals:
    """Hold back signals that end the program, such as Ctrl+C, until `obey`, which a session calls between its writes.

    Without this, an exception during a write could leave a line that the journal does not count. A second signal ends
    the program at once. Only the main thread receives signals, so this has no effect in other threads.
    """

    def __init__(self) -> None:
        self._before: dict[int, Any] = {}
        self._pending: int | None = None

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            handlers = {number: signal.getsignal(number) for number in ENDING_SIGNALS}
            self._before = {
                number: handler for number, handler in handlers.items() if handler not in {signal.SIG_IGN, None}
            }
            for number in self._before:
                signal.signal(number, self._hold_signal)
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._restore_handlers()
        if kind is None:
            self.obey()

    def obey(self) -> None:
        """Act on a signal that was held back."""
        if self._pending is None:
            return
        number, self._pending = self._pending, None
        handler = self._before[number]
        if callable(handler):
            handler(number, None)
        raise SystemExit(128 + number)

    def _hold_signal(self, number: int, _frame: object) -> None:
        self._pending = number
        self._restore_handlers()

    def _restore_handlers(self) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)


class _DiscardingStore:
    """A session store that discards everything."""

    recorder = None
    fingerprint = ""

    def __init__(self, now_ns: Callable[[], int], codes: dict[str, dict[str, str]], secret: bytes) -> None:
        self.clock = SessionClock(now_ns)
        self.key = Key(hash="", drawn="seed", codes=codes, tables={}, tables_hash="", nonce=secret)

    def append(self, event: Line, *, t_s: float | None = None, waits: bool = True) -> None:
        """Keep nothing."""

    def check_flushed(self) -> None:
        """Do nothing."""

    def write_tables(self) -> None:
        """Keep nothing."""

    def finish(self, status: str, reason: str = "") -> None:
        """Keep nothing."""


def rehearsal_rig(study: Protocol, participant: str, seed: int, device: str) -> Rig:
    """Return a device with a simulated hand, and its servo on a virtual clock that only the servo advances."""
    if not descriptor_of(device).moves_by_itself:
        devices = " or ".join(device.name for device in all_devices() if device.moves_by_itself)
        raise SessionError(f"device '{device}' needs a person to move it: rehearse with {devices}")
    settings = study_settings(study, stream(seed, f"rehearsal/{participant}/hand"))
    rig = open_rig(device, settings, clock=VirtualClock())
    if hand_of(rig.device) is None:
        rig.stop()
        raise SessionError(f"device '{device}' does not have a simulated hand, so it cannot be used in a rehearsal")
    return rig


@dataclass(slots=True)
class _Setting:
    """The state of a setting: its observer, the magnitudes sensed since the last steps, and their time [s]."""

    observer: AdjustingObserver
    scale: float
    judged_s: float = 0.0
    done: bool = False
    senses: SensedTrial = field(init=False)

    def __post_init__(self) -> None:
        self.senses = SensedTrial(scale=self.scale)


class RehearsedSession(SimulatedParticipant):
    """One session and its simulated participant."""

    def __init__(
        self,
        study: Protocol,
        schedule: Schedule,
        rig: Rig,
        store: KeptSession,
        start: Start = FIRST,
        features: Callable[[int, tuple[TrialFeatures, ...]], object] | None = None,
        known: Mapping[int, tuple[TrialFeatures, ...]] | None = None,
        observer: Observer | None = None,
        answer: Answer | None = None,
        *,
        session: int = 1,
    ) -> None:
        super().__init__(study, schedule, observer, session=session)
        self._answer = answer
        self.signals = _HeldSignals()
        self._known = known or {}
        self._on_features = features
        self.rig = rig
        hand = hand_of(rig.device)
        assert hand is not None  # noqa: S101 - checked by `rehearsal_rig`
        self._hand = hand
        self._now_s = store.clock.seconds
        self._features_of: dict[int, tuple[TrialFeatures, ...]] = {}
        self._reader = rig.servo.telemetry.reader()
        self._next_frame_ns = 0
        self._period_s = 1 / study.device.rate_hz if study.has_imperfect_link else None
        self._paint: Draw = self._stream("screen")
        ports = Ports(rig.servo, store, self._show_page, self._now_s, store.recorder)
        self._runner = Runner(study, schedule, store.key.codes, ports, study.study.languages[0], start, store.key.nonce)

    def _seconds(self) -> float:
        return self._now_s()

    def _post(self, event: Event) -> None:
        self._runner.post(event)
        self._end_if_stalled()

    def _poll(self) -> None:
        self._runner.poll()
        self._end_if_stalled()

    def _end_if_stalled(self) -> None:
        """Raise an error if the session stalled, since nobody waits for the disk in a rehearsal."""
        if self._runner.stalled is not None:
            raise StoreError(self._runner.stalled)

    def run(self) -> None:
        """Run from the first page to the last."""
        for _ in self.pages():
            pass

    def pages(self) -> Iterator[Page]:
        """Yield each page when it is shown; respond to it when the caller requests the next one."""
        self._post(Begin(self._now_s()))
        if isinstance(self.page, PausePage):  # before the first trial of a resumed session
            self._post(ResumeRequested(self._now_s(), "participant"))
        yielded: Page | None = None
        while not self._runner.finished:
            if self.page is not None and self.page is not yielded:
                yielded = self.page
                yield yielded
            match self.page:
                case TextPage() as page:
                    self._wait(reading_s(page))
                    if page is self.page:
                        self._post(Continue(self._now_s()))
                case FeedbackPage() | TaskPage(interval=Interval(resting=True)):
                    self._wait(_TASK_POLL_S)
                case TaskPage() as page:
                    self._perform_task(page)
                case QuestionnairePage() | DesignPage() as page:
                    self._fill_in(page)
                case _:
                    reason = self.rig.servo.fault or self._runner.cause or self._runner.stalled or self.page
                    raise SessionError(f"the rehearsal failed: {reason}")

    def _show_page(self, page: Page) -> None:
        self.page = page

    def _wait(self, seconds: float) -> None:
        """Let time pass without any action."""
        end_s = self._now_s() + seconds
        page = self.page
        while self._now_s() < end_s and page is self.page:
            self._advance(min(_IDLE_POLL_S, end_s - self._now_s()))
            self._poll()

    def _advance(self, seconds: float) -> None:
        """Run the servo for a time [s]; a signal that ends the program stops it."""
        self.signals.obey()
        servo = self.rig.servo
        if servo.advance(max(1, round(seconds * servo.rate_hz))) == 0 and servo.fault is None:
            raise SessionError("another program stopped the rehearsal")

    def _perform_task(self, page: TaskPage) -> None:
        """Perform a task until its page is left, observing every frame and every tick."""
        interval = page.interval
        stream_name = str(page.trial) if interval is None else f"{page.trial}/{interval.number}"
        hand, draw = self._hand, self._stream(f"{stream_name}/behaviour")
        self._paint = self._stream(f"{stream_name}/screen")
        senses = SensedTrial(scale=self._study.scene.scale, period_s=self._period_s)
        self._reader.read()
        self._next_frame_ns = self.rig.servo.now_ns()
        behaviour = hand_behaviour(page.task, hand, draw, self._now_s())
        setting = _Setting(self._adjusting_observer(page.trial), self._study.scene.scale) if page.adjusts else None
        self.look(senses)  # the first frame, which begins the trial, is painted at once
        while page is self.page:
            self._advance(_TASK_POLL_S)
            view = self.look(senses)
            continues = view is not None and behaviour.act(self._now_s(), view)
            samples = np.asarray(self._reader.read())
            senses.feel(samples)
            self._poll()
            if setting is not None and view is not None and page is self.page:
                self._adjust_level(page, setting, view, samples)
            if continues and page is self.page:
                self._post(Continue(self._now_s()))
        rest_hand(page.task, hand)
        earlier = () if interval is None or interval.number == 1 else self._features_of.get(page.trial, ())
        self._features_of[page.trial] = (*earlier, senses.features())
        if self._on_features is not None:
            self._on_features(page.trial, self._features_of[page.trial])

    def _adjust_level(self, page: TaskPage, setting: _Setting, view: TankView, samples: Any) -> None:
        """Make the next steps of a setting from the magnitudes sensed since the last ones, or confirm it."""
        setting.senses.feel(samples)
        setting.senses.see(self.rig.servo.now_ns(), view)
        since_s = view.task.elapsed_s - setting.judged_s
        judged_s = view.task.elapsed_s - page.task.judged_from_s
        if setting.done or since_s < LOOK_AT_SETTING_S or judged_s < LOOK_AT_SETTING_S:
            return
        steps = self._next_steps(page, setting)
        setting.senses.clear()
        setting.judged_s = view.task.elapsed_s
        if steps:
            self._post(Stepped(self._now_s(), steps))
        else:
            setting.done = True
            self._post(Submitted(self._now_s()))

    def _next_steps(self, page: TaskPage, setting: _Setting) -> int:
        """Return the next steps of a setting, or 0 if it is done."""
        current = setting.senses.features()
        earlier = self._features_of.get(page.trial, ()) if page.interval and page.interval.number > 1 else ()
        answer = None if self._answer is None else self._answer(Question(page, (*earlier, current)))
        if answer is None:
            sensed = self._comparison_of(page.trial).sensed(current)
            return setting.observer.steps(sensed, self._reference_magnitude(page.trial, sensed))
        try:
            return operator.index(answer)  # type: ignore[arg-type]  # also for numpy integers
        except TypeError:
            raise SessionError(
                f"{answer!r} is not a valid number of steps: specify a whole number, or 0 to leave the level unchanged"
            ) from None

    def look(self, senses: SensedTrial) -> TankView | None:
        """Show the frames due since the last call; return the view of the newest one, or None."""
        view = None
        while self._next_frame_ns <= self.rig.servo.now_ns():
            view = self._runner.view(self._next_frame_ns)
            if view is not None:
                low, high = _PAINT_S
                painted_ns = self._next_frame_ns + round(1e9 * (low + (high - low) * self._paint()))
                self._runner.frame_shown(painted_ns, view.sample_time_ns)
                senses.see(painted_ns, view)
            self._next_frame_ns += round(1e9 * _FRAME_S)
        return view

    def _answers_to(self, page: QuestionnairePage | DesignPage) -> list[Choice]:
        felt = () if page.trial is None else {**self._known, **self._features_of}[page.trial]
        answer = None if self._answer is None else self._answer(Question(page, felt))
        if answer is None:
            return super()._answers_to(page)
        answer_by_item = answer if isinstance(answer, Mapping) else {page.items[0].id: answer}
        answers = {item: _plain_answer(value) for item, value in answer_by_item.items()}
        if unknown := answers.keys() - {item.id for item in page.items}:
            possible = ", ".join(item.id for item in page.items)
            raise SessionError(
                f"this page does not contain {', '.join(map(repr, sorted(unknown)))}; its questions are {possible}"
            )
        visible = [
            item for item in page.items if item.id in shown_questions(page.items, answers) and item.id in answers
        ]
        return answer_choices(visible, answers, self._stream(page.stream), changes_mind=False)

    def _perceived_features(self, trial: int | None) -> TrialFeatures:
        return NO_FEATURES if trial is None else {**self._features_of, **self._known}[trial][-1]

    def _sensed_magnitudes(self, block: Block) -> Mapping[int, Sequence[float]]:
        sensed = Comparison.of(self._study, block, self.observer).sensed
        features_by_trial = {**self._features_of, **self._known}
        return {
            number: [*map(sensed, features)]
            for number, features in features_by_trial.items()
            if self._trials[number].block == block.id
        }


def condition_features(
    protocol: Protocol, *, seed: int, people: int = REHEARSED_PEOPLE, progress: Callable[[str], object] | None = None
) -> ConditionFeatures:
    """Rehearse every condition of the blocks with ``people`` simulated participants and return the features.

    Raises
    ------
    DeviceError
        The simulated device cannot be opened.
    SessionError
        A session broke.
    """
    codes = draw_key(protocol, stream(seed, "blinding").random)
    key = LevelKey(codes, b"what each condition feels like")
    by_condition: dict[Where, list[TrialFeatures]] = {}
    for number in range(1, people + 1):
        participant = f"P{number:03d}"
        schedule = build_schedule(protocol, participant, seed)
        presented = {trial.number: _presented_conditions(protocol, key, schedule, trial) for trial in schedule.trials}

        def add_features(
            trial: int, features: tuple[TrialFeatures, ...], presented: Mapping[int, tuple[Where, ...]] = presented
        ) -> None:
            by_condition.setdefault(presented[trial][len(features) - 1], []).append(features[-1])

        with rehearsal_rig(protocol, participant, seed, "scripted") as rig:
            RehearsedSession(
                protocol, schedule, rig, _DiscardingStore(rig.servo.now_ns, codes, key.secret), features=add_features
            ).run()
        if progress is not None:
            progress(f"{number} of {people} sessions simulated")
    return {where: tuple(features) for where, features in by_condition.items()}


def _presented_conditions(protocol: Protocol, key: LevelKey, schedule: Schedule, trial: Trial) -> tuple[Where, ...]:
    """Return block and condition of each interval of a trial, empty if it is skipped for all possible answers."""
    if protocol.blocks[trial.block].design is None:
        return ((trial.block, key.codes[trial.block][trial.code]),)
    due = next_level(protocol, key, schedule, trial, ())
    return () if due is None else tuple((trial.block, stimulus.condition) for stimulus in due.intervals)


def rehearse(
    protocol: str | Path,
    *,
    participants: int,
    seed: int,
    device: str = "scripted",
    results: Path | None = None,
    recordings: bool = True,
    group: str | None = None,
    progress: Callable[[str], object] | None = None,
    observer: Observer | None = None,
) -> Path:
    """Run all planned sessions of P001, P002 … and return the study folder.

    A participant whose session ends early has no further sessions.

    Parameters
    ----------
    protocol : str or Path
        File or name of a protocol.
    participants : int
        Number of participants.
    seed : int
        Seed of all randomness, including the key's.
    device : str
        A simulated device.
    results : Path, optional
        Study folder; by default a new ``results/<study>-rehearsal-<n>`` of the workspace.
    recordings : bool
        Whether every tick of the servo and every frame of a trial is recorded.
    group : str, optional
        The pre-existing group of all participants; by default they are divided in the planned ratio.
    progress : callable, optional
        Called with a line for each session, after the last session of each participant.
    observer : Observer, optional
        The observer of interval trials; by default each participant's is drawn at random.

    Raises
    ------
    ProtocolError
        The protocol cannot be used.
    StoreError
        The folder holds another study or an id is used already, and nothing was changed; or results cannot be
        written.
    DeviceError
        The device is not known, or cannot be opened.
    SessionError
        The device does not move by itself, or a session broke; earlier data are safe.
    """
    source = source_bytes(protocol)
    study = parse(source, str(protocol))
    folder = rehearsal_folder(workspace().results, study.study.name) if results is None else Path(results)
    check_study(StudyFolder(folder), study.study.name)
    participant_ids = [f"P{number:03d}" for number in range(1, participants + 1)]
    used_ids(StudyFolder(folder)).check_rehearsal(participant_ids)
    for participant, participant_group in simulated_groups(StudyFolder(folder), study, participant_ids, group).items():
        label = participant if participant_group is None else f"{participant} (group {participant_group})"
        lines: list[str] = []
        for session in itertools.count(1):
            session_context = open_session(
                study,
                source,
                participant,
                session=session,
                seed=seed,
                device=device,
                results=folder,
                recordings=recordings,
                group=participant_group,
                observer=observer,
            )
            store = _run_to_end(label if session == 1 else f"{label}, session {session}", session_context, lines.append)
            session_count = planned_sessions(StudyFolder(folder), study, participant)
            if session == session_count or progress_of(store.lines).ended != "completed":
                break
        if progress is not None:
            progress("\n".join(lines))
    return folder


def finish_session(
    protocol: str | Path,
    participant: str,
    *,
    seed: int,
    device: str,
    results: Path,
    progress: Callable[[str], object] | None = None,
) -> None:
    """Complete a participant's first session: begin it, or resume it after an interruption.

    An interrupted session is resumed with its own seed and device. Finished sessions are not changed, and none is begun
    for a withdrawn participant.

    Parameters
    ----------
    protocol : str or Path
        File or name of a protocol.
    participant : str
        The participant's id.
    seed : int
        Seed of all randomness of a new session, including the key's.
    device : str
        A simulated device, for a new session.
    results : Path
        The study folder.
    progress : callable, optional
        Called with a line about the session that was run; not called if there was nothing to do.

    Raises
    ------
    StudyError
        As for `rehearse` and `reopen_session`; earlier data are safe.
    """
    folder = StudyFolder(results)
    session = folder.session(participant, 1)
    is_finished = place_of(folder, session) in {place for _, place in read_list(folder.fingerprints)}
    if is_finished or participant in tombstones(folder):
        return
    if not is_there(session.path) or is_never_begun(session.path):
        source = source_bytes(protocol)
        study = parse(source, str(protocol))
        session_context = open_session(study, source, participant, seed=seed, device=device, results=results)
        _run_to_end(participant, session_context, progress)
    elif progress_of(journal.read(session.journal)).ended is None:
        _run_to_end(participant, reopen_session(session.path, protocol=protocol), progress)
    else:  # the program was killed between the session's last line and its proofs
        rebuild_session(session.path)
        if progress is not None:
            progress(f"{participant}: rebuilt the tables and checksums of the finished session")


def _run_to_end(
    participant: str,
    session_context: AbstractContextManager[tuple[RehearsedSession, SessionStore]],
    progress: Callable[[str], object] | None,
) -> SessionStore:
    """Run an open session to its last page; ``progress`` gets a line with its responses and missing trials."""
    began = time.perf_counter()
    with _HeldSignals() as signals, session_context as (rehearsal, store):
        rehearsal.signals = signals
        rehearsal.run()
    if progress is not None:
        took_s = time.perf_counter() - began
        duration = f"{store.clock.seconds() / 60:.1f} min of session time simulated in {took_s:.1f} s"
        missing = f"; {store.missing_trials}" if store.missing_trials.count else ""
        lost = [line.reason for line in store.lines if isinstance(line, journal_events.RecordingLost)]
        if lost:
            missing += f"; {counted(len(lost), 'recording')} could not be stored: {', '.join(dict.fromkeys(lost))}"
        answers = sum(progress_of(store.lines).answered.values())
        progress(f"{participant}: {answers} responses, {duration}, fingerprint {store.fingerprint}{missing}")
    return store


@contextmanager
def open_session(
    study: Protocol,
    source: bytes,
    participant: str,
    *,
    results: Path,
    seed: int,
    session: int = 1,
    device: str = "scripted",
    recordings: bool = True,
    group: str | None = None,
    row_of: str | None = None,
    observer: Observer | None = None,
    answer: Answer | None = None,
) -> Iterator[tuple[RehearsedSession, SessionStore]]:
    """Begin a session with a simulated hand; yield it and its store. It stays unfinished if left before its end.

    Parameters
    ----------
    study : Protocol
        The study to run.
    source : bytes
        Its source.
    participant : str
        The participant's id.
    results : Path
        The study folder.
    seed : int
        Seed of all its randomness.
    session : int
        The number of the participant's session.
    device : str
        A simulated device.
    recordings : bool
        Whether every tick and frame of a trial is recorded.
    group : str, optional
        The participant's pre-existing group; in a later session by default the recorded one.
    row_of : str, optional
        The id of the participant who is replaced.
    observer : Observer, optional
        The observer of interval trials; by default each participant's is drawn at random.
    answer : callable, optional
        Answers the question pages instead of the simulated participant.

    Raises
    ------
    StudyError
        The id or the folder cannot be used, the device cannot be opened, or the session broke.
    """
    with rehearsal_rig(study, participant, seed, device) as rig:
        start = SessionStart(
            participant,
            session=session,
            seed=seed,
            operator="",
            language=study.study.languages[0],
            device=rig.described,
            screens=REHEARSED_SCREENS,
            simulated=True,
            recordings=recordings,
            row_of=row_of,
            group=group,
        )
        store = begin_session(results, study, source, start, clock=SessionClock(rig.servo.now_ns))
        protocol = session_protocol(StudyFolder(results), store.as_recorded(study), participant, session)
        with store:
            schedule = begun_schedule(protocol, journal_events.start_of(store.lines), store.key)
            rehearsed = RehearsedSession(
                protocol, schedule, rig, store, observer=observer, answer=answer, session=session
            )
            with _updated_tables(store):
                yield rehearsed, store


@contextmanager
def _updated_tables(store: SessionStore) -> Iterator[None]:
    """Update the tables of a session that is left unfinished."""
    try:
        yield
    finally:
        if not store.fingerprint:
            with suppress(StoreError):  # resuming writes them again
                store.write_tables()


def resume_rehearsal(session_folder: Path, *, protocol: str | Path | None = None) -> None:
    """Resume an interrupted rehearsed session and run it to its last page; errors as in `reopen_session`."""
    with reopen_session(session_folder, protocol=protocol) as (rehearsal, _):
        rehearsal.run()


@contextmanager
def reopen_session(
    session_folder: Path, *, protocol: str | Path | None = None, answer: Answer | None = None
) -> Iterator[tuple[RehearsedSession, SessionStore]]:
    """Resume an interrupted rehearsed session; yield it and its store.

    Parameters
    ----------
    session_folder : Path
        The session's ``ses-NN`` folder.
    protocol : str or Path, optional
        File or name of its protocol; by default it is searched for.
    answer : callable, optional
        Answers the question pages instead of the simulated participant.

    Raises
    ------
    StoreError
        The session cannot be opened, is finished, or began with another protocol.
    SessionError
        No available protocol is the session's, or the session broke; earlier data are safe.
    """
    lines = journal.read(locate_session(session_folder)[1].journal)
    session_started = journal_events.start_of(lines)
    if not is_rehearsal(receipt.read(locate_session(session_folder)[1].receipt)):
        raise SessionError(
            f"{session_folder} is a participant's session, not a simulated one: resume it in the program's session "
            "window"
        )
    read = partial(source_to_resume, session_folder)
    name = find_protocol(session_started, read=read) if protocol is None else str(protocol)
    source = read(name)
    study = parse(source, name)
    participant, seed = session_started.participant, session_started.seed
    with rehearsal_rig(study, participant, seed, session_started.device or "") as rig:
        store = reopen_store(
            session_folder,
            study,
            source,
            operator="",
            device=rig.described,
            screens=REHEARSED_SCREENS,
            now_ns=rig.servo.now_ns,
            now=max(datetime.now().astimezone(), datetime.fromisoformat(lines[-1].at)),
        )
        own_protocol = session_protocol(
            locate_session(session_folder)[0], store.as_recorded(study), participant, session_started.session
        )
        schedule = begun_schedule(own_protocol, session_started, store.key)
        with store:
            start = resume_at(own_protocol, schedule, lines, store.key)
            known = _features_of_whole_session(
                own_protocol,
                schedule,
                rig.device.name,
                store.key.codes,
                store.key.nonce,
                session=session_started.session,
            )
            with _updated_tables(store):
                rehearsed = RehearsedSession(
                    own_protocol,
                    schedule,
                    rig,
                    store,
                    start,
                    known=known,
                    answer=answer,
                    session=session_started.session,
                )
                yield rehearsed, store


def _features_of_whole_session(
    study: Protocol, schedule: Schedule, device: str, codes: dict[str, dict[str, str]], secret: bytes, *, session: int
) -> dict[int, tuple[TrialFeatures, ...]]:
    """Run the session without interruption and return the features felt in each trial, by its number."""
    features: dict[int, tuple[TrialFeatures, ...]] = {}
    with rehearsal_rig(study, schedule.participant, schedule.seed, device) as rig:
        RehearsedSession(
            study,
            schedule,
            rig,
            _DiscardingStore(rig.servo.now_ns, codes, secret),
            features=features.__setitem__,
            session=session,
        ).run()
    return features
