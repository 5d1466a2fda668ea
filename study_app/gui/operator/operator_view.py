"""The content of the operator's window as one immutable value, without Qt.

It never contains a liquid, a parameter or a delay nor, in a double-blind study, a force or the action of a limiter.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from statistics import median
from typing import Final, Literal

from study_app.devices.descriptor import Icon
from study_app.gui.operator.servo_health import ForceFigures, Tile, Vitals, force_rows, health_tiles
from study_app.gui.sessions.session_facts import broken_limit_text, operator_language, step_title
from study_app.number_text import clock_text, grouped
from study_app.protocol.model import Protocol
from study_app.protocol.orders import FormStep, Schedule, Step, Trial
from study_app.protocol.wording import words
from study_app.store.files import SEALED
from study_app.store.journals.journal_events import Note
from study_app.store.session_progress import REASONS, Broken, Progress, TrialAnswer

State = Literal["preparing", "running", "paused", "force off", "trouble", "ended"]
_StepState = Literal["done", "now", "open"]

NOTES_SHOWN = 3


@dataclass(frozen=True, slots=True)
class StepRow:
    """A row of the rail; ``note`` is its duration, "now" or its progress."""

    label: str
    state: _StepState
    note: str


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialTime:
    """Time in the task; ``most_s`` is None if the task has no time limit."""

    elapsed_s: float
    least_s: float | None
    most_s: float | None

    @property
    def words(self) -> str:
        """The elapsed time and its limit, if any: "1:08 of 2:00"."""
        elapsed = clock_text(self.elapsed_s)
        return f"{elapsed} of {clock_text(self.most_s)}" if self.most_s else elapsed


@dataclass(frozen=True, slots=True)
class DeviceView:
    """The device's card: its name, whether it responds, and rows of (label, value), most important first."""

    name: str
    icon: Icon
    ready: bool
    rows: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class OperatorView:
    """The content of the operator's window except the data of the plots.

    ``elapsed_s`` is the working time without the gap before a resumption. ``main_trials`` counts the finished main
    trials, and all. ``trial`` is the number of the trial being presented or answered. ``waits`` means that writing to
    the disk fails; the session continues when it succeeds again. ``beyond`` lists problems: a slower device, lost
    outlets and recordings, undelivered trials, and the limits violated by each trial, newest first. ``may_reconnect``
    means that a failed device can be reconnected, ``reconnects`` that this is under way, ``reconnection`` is its
    progress, or why it failed. ``track`` is the progress of the track of the latest trial with a design, without a
    level.
    """

    study: str
    who: str
    state: State
    state_word: str
    trouble: str
    saved_ago_s: float | None
    elapsed_s: float
    expected_s: float
    main_trials: tuple[int, int]
    part_line: str
    heading: str
    setting_line: str
    trial_time: TrialTime | None
    steps: tuple[StepRow, ...]
    counts: tuple[tuple[str, str], ...]
    tiles: tuple[Tile, ...]
    device: DeviceView
    notes: tuple[Note, ...]
    force_on: bool
    may_pause: bool
    may_resume: bool
    may_repeat: bool
    over: bool
    trial: int | None = None
    waits: bool = False
    beyond: tuple[str, ...] = ()
    blinding: Literal["double", "single"] = "double"
    may_reconnect: bool = False
    reconnects: bool = False
    reconnection: str = ""
    track: tuple[str, ...] = ()

    @property
    def trials_line(self) -> str:
        done, of = self.main_trials
        return f"{done} of {of} {'trial' if of == 1 else 'trials'}"


# A block with more trials is a single row of the rail ("Delay settings 1 to 7"), so that a long study fits.
_ROWS_PER_BLOCK = 4


@dataclass(frozen=True, slots=True)
class Stage:
    """One row of the rail: the schedule's steps from ``first`` to ``last`` under a neutral ``label``."""

    label: str
    first: int
    last: int


@dataclass(frozen=True, slots=True)
class Session:
    """The displayed data of a session that do not change: participant, device and limits."""

    protocol: Protocol
    schedule: Schedule
    stages: tuple[Stage, ...]
    who: str
    expected_s: float
    answers_of: int
    lateness_limit_s: float
    device_name: str
    device_icon: Icon
    device_rows: tuple[tuple[str, str], ...]

    @property
    def language(self) -> str:
        """The language of the operator's window: English if the study has it, otherwise the study's first."""
        return operator_language(self.protocol)

    def trial(self, progress: Progress) -> Trial | None:
        """Return the trial being presented or answered; None on a text page and before the first step."""
        step = self.schedule.steps[progress.here] if progress.here >= 0 else None
        return step if isinstance(step, Trial) else None

    def main_trials(self, progress: Progress) -> tuple[int, int]:
        """Return the number of finished main trials, and their total number."""
        main = [i for i, step in enumerate(self.schedule.steps) if isinstance(step, Trial) and step.phase == "main"]
        return sum(index < progress.here or progress.reached_end for index in main), len(main)

    def broken_limits(self, progress: Progress) -> dict[int, tuple[Broken, ...]]:
        """Return the limits violated by finished trials that the operator may know: only timing if double-blind."""
        hidden = SEALED if self.protocol.study.blinding == "double" else frozenset()
        return {
            trial: tuple(limit for limit in limits if limit[0] not in hidden)
            for trial, limits in progress.broken.items()
        }


def view_session(
    session: Session,
    progress: Progress,
    vitals: Vitals,
    *,
    now_s: float,
    force_on: bool,
    trouble: str = "",
    waits: bool = False,
    device_ready: bool = True,
    faults: int = 0,
    rate_hz: float = 1000.0,
    forces: ForceFigures | None = None,
    lost: Mapping[int, str] | None = None,
    dropped: int = 0,
    outlets_lost: Mapping[str, str] | None = None,
) -> OperatorView:
    """Return the operator's view at ``now_s`` on the session's clock.

    ``trouble`` is a problem that the journal does not contain; ``device_ready`` and ``faults`` (their number since the
    program was started) are those of the servo, regardless of other problems; ``forces`` are shown in single-blind
    studies; ``lost`` maps trials to the reasons for lost recordings, even before the journal contains them; ``dropped``
    counts the samples missing in the current recording; ``outlets_lost`` are the reasons why outlets to other programs
    failed.
    """
    trouble = trouble or progress.broke
    state = _state(progress, force_on=force_on, trouble=trouble)
    waits = waits and not progress.broke
    trial = session.trial(progress)
    answering = trial is not None and progress.trial_lasted_s is not None
    return OperatorView(
        study=session.protocol.study.name,
        who=session.who,
        state=state,
        state_word="Waiting for the disk" if waits and state == "trouble" else _state_word(state, progress),
        trouble=trouble,
        saved_ago_s=max(0.0, now_s - progress.t_s) if progress.start else None,
        elapsed_s=(progress.t_s if progress.ended else now_s) - progress.away_s,
        expected_s=session.expected_s,
        main_trials=session.main_trials(progress),
        part_line=_part_line(session, trial),
        heading=_heading(session, progress),
        setting_line=_setting_line(session, progress, answering=answering),
        trial_time=_trial_time(session, progress, now_s),
        steps=tuple(_step_row(stage, progress) for stage in session.stages),
        counts=_count_rows(session, progress),
        tiles=health_tiles(vitals, rate_hz, session.lateness_limit_s),
        device=DeviceView(
            session.device_name,
            session.device_icon,
            device_ready,
            (*force_rows(session.protocol, forces), ("Safety faults", str(faults)), *session.device_rows),
        ),
        notes=tuple(progress.notes[-NOTES_SHOWN:][::-1]),
        force_on=force_on,
        may_pause=state == "running" and progress.here >= 0,
        may_resume=state in {"paused", "force off"},
        may_repeat=trial is not None and state == "running",
        over=state == "ended",
        trial=None if trial is None else trial.number,
        waits=waits,
        beyond=(
            *_delay_sentences(vitals),
            *(f"{title}: {reason}" for title, reason in {**progress.outlets_lost, **(outlets_lost or {})}.items()),
            *_lost_recording_sentences(session, progress, {**progress.lost, **(lost or {})}),
            *_incomplete_recording_sentences(
                session, progress, {trial.number: dropped} if trial is not None and dropped else {}
            ),
            *filter(None, [str(progress.missing_trials)]),
            *_late_device_sentences(session, progress),
            *_limit_sentences(session, progress),
        ),
        blinding=session.protocol.study.blinding,
        track=_track_lines(session, progress),
    )


def _track_lines(session: Session, progress: Progress) -> tuple[str, ...]:
    trial = next((planned for planned in session.schedule.trials if planned.number == progress.of_intervals), None)
    if trial is None or progress.ended:
        return ()
    design = session.protocol.design_of(session.protocol.blocks[trial.block])
    names = words(session.language).design_answers
    lines = track_lines(progress, session.schedule, trial, {answer: names[answer] for answer in design.answers})
    is_coded_per_participant = session.protocol.study.codes == "participant"
    return (lines[0].replace(f" {trial.code}:", ":", 1), *lines[1:]) if is_coded_per_participant else lines


def _state(progress: Progress, *, force_on: bool, trouble: str) -> State:
    if progress.ended:
        return "ended"
    if trouble:
        return "trouble"
    if progress.here < 0:
        return "preparing"
    if not force_on:
        return "force off"
    return "paused" if progress.paused else "running"


def _state_word(state: State, progress: Progress) -> str:
    if progress.ended:
        return {
            "completed": "Complete",
            "incomplete": "Incomplete",
            "withdrawn": "Withdrawn",
            "aborted": "Ended early",
            "broken": "Ended after a fault",
        }.get(progress.ended, progress.ended.capitalize())
    return {
        "preparing": "Preparing",
        "running": "Running",
        "paused": "Paused",
        "force off": "Paused, force is off",
        "trouble": "Stopped by a fault",
    }[state]


def _part_line(session: Session, trial: Trial | None) -> str:
    if trial is None:
        return session.protocol.text(session.protocol.study.title, session.language)
    block = session.protocol.blocks[trial.block]
    title = session.protocol.text(block.title, session.language)
    parts = session.protocol.parts
    return f"Part {trial.part} of {parts}  ·  {title}" if trial.part and parts > 1 else title


def _heading(session: Session, progress: Progress) -> str:
    if progress.ended:
        return {"completed": "Session complete", "incomplete": "Session incomplete"}.get(
            progress.ended, "Session ended"
        )
    if progress.here < 0:
        return "Getting ready"
    trial = session.trial(progress)
    if trial is None:
        return next(s.label for s in session.stages if s.first <= progress.here <= s.last)
    if trial.phase != "main":
        return trial.label(session.protocol, session.language)
    main = [other.number for other in session.schedule.trials if other.phase == "main"]
    return f"Trial {main.index(trial.number) + 1} of {len(main)}"


def _setting_line(session: Session, progress: Progress, *, answering: bool) -> str:
    if progress.ended:
        fingerprint = f"Fingerprint {progress.fingerprint}" if progress.fingerprint else ""
        return "  ·  ".join(filter(None, ("All answers are on disk", str(progress.missing_trials), fingerprint)))
    trial = session.trial(progress)
    if trial is None:
        if progress.here < 0:
            return "The first page will appear shortly"
        is_form = isinstance(session.schedule.steps[progress.here], FormStep)
        return "The participant is filling in a form" if is_form else "The participant is reading"
    block = session.protocol.blocks[trial.block]
    task = session.protocol.tasks[block.task]
    doing = task.activity
    if progress.broke:
        doing = "stopped by a fault"
    elif progress.paused:
        doing = "paused"
    elif answering:
        doing = "answering"
    if task.targets_m and not (progress.start and progress.start.measures_sealed):  # their number would reveal a delay
        doing += f"  ·  {progress.targets} {'targets' if task.wanted is None else f'of {task.wanted} targets'}"
    if trial.phase != "main":
        return doing.capitalize()
    return f"{trial.label(session.protocol, session.language)}  ·  {doing}"


def _trial_time(session: Session, progress: Progress, now_s: float) -> TrialTime | None:
    trial = session.trial(progress)
    if trial is None or progress.ended:
        return None
    block = session.protocol.blocks[trial.block]
    task = session.protocol.tasks[block.task]
    elapsed = progress.trial_lasted_s
    if elapsed is None:
        elapsed = now_s - (progress.trial_since_s if progress.trial_since_s is not None else now_s)
    if progress.of_intervals == trial.number:  # the task's limits are those of each interval
        return TrialTime(elapsed_s=elapsed, least_s=None, most_s=None)
    return TrialTime(elapsed_s=elapsed, least_s=task.least_s, most_s=task.limit_s)


def _step_row(stage: Stage, progress: Progress) -> StepRow:
    count = stage.last - stage.first + 1
    spent_s = sum(progress.durations_s.get(step, 0.0) for step in range(stage.first, stage.last + 1))
    if progress.here > stage.last or progress.reached_end:
        return StepRow(stage.label, "done", clock_text(spent_s))
    if stage.first <= progress.here <= stage.last:
        position = f"{progress.here - stage.first + 1} of {count}" if count > 1 else "now"
        return StepRow(stage.label, "now", "" if progress.ended else position)
    return StepRow(stage.label, "open", "")


def _count_rows(session: Session, progress: Progress) -> tuple[tuple[str, str], ...]:
    broken, missing = session.broken_limits(progress).values(), progress.missing_trials
    return (
        ("Answers on disk", f"{sum(progress.answered.values())} of {session.answers_of}"),
        ("Trials within limits", f"{sum(not limits for limits in broken)} of {len(broken)}"),
        *([("Trials not delivered", f"{missing.count} of {missing.asked}")] if missing.count else []),
        ("Marks, repeats", f"{sum(note.kind == 'mark' for note in progress.notes)}, {progress.repeats}"),
    )


def _delay_sentences(vitals: Vitals) -> tuple[str, ...]:
    """Return a sentence if the device's delay is longer than at the start."""
    if vitals.delay_ticks <= vitals.first_delay_ticks:
        return ()
    return (
        f"The device now responds after {vitals.delay_ticks} ticks ({vitals.first_delay_ticks} at the start), so the "
        "force is limited to a level that is stable at this delay",
    )


def _lost_recording_sentences(session: Session, progress: Progress, lost: Mapping[int, str]) -> tuple[str, ...]:
    """Return a sentence for every trial whose recording was lost, newest first."""
    trials = {trial.number: trial for trial in session.schedule.trials}
    return tuple(
        f"The recording of {trials[number].label(session.protocol, session.language)} was lost: {reason}"
        for number, reason in sorted(lost.items(), reverse=True)
    )


def _incomplete_recording_sentences(
    session: Session, progress: Progress, current: Mapping[int, int]
) -> tuple[str, ...]:
    """Return a sentence for every trial whose recording lacks samples, newest first."""
    labels = {trial.number: trial.label(session.protocol, session.language) for trial in session.schedule.trials}
    return tuple(
        f"The recording of {labels[number]} is missing {grouped(count)} samples because the disk is too slow"
        for number, count in sorted({**progress.lacking, **current}.items(), reverse=True)
    )


def _late_device_sentences(session: Session, progress: Progress) -> tuple[str, ...]:
    """Return a sentence for every trial in which the device answered late, newest first; none if double-blind."""
    labels = {trial.number: trial.label(session.protocol, session.language) for trial in session.schedule.trials}
    late = {} if session.protocol.study.blinding == "double" else progress.late
    return tuple(
        f"{labels[number]}: {text}; measure the device with liquid-study devices bench"
        for number, text in sorted(late.items(), reverse=True)
    )


def _limit_sentences(session: Session, progress: Progress) -> tuple[str, ...]:
    """Return a sentence for every finished trial that violated a limit, newest first."""
    labels = {trial.number: trial.label(session.protocol, session.language) for trial in session.schedule.trials}
    return tuple(
        f"{labels[number]} exceeded limits: " + "; ".join(broken_limit_text(*limit) for limit in limits)
        for number, limits in reversed(session.broken_limits(progress).items())
        if limits
    )


def stages(protocol: Protocol, schedule: Schedule) -> tuple[Stage, ...]:
    """Return the rows of the rail: one for each page and setting, but only one for a long block."""
    language = operator_language(protocol)
    rows: list[Stage] = []
    index = 0
    while index < len(schedule.steps):
        step = schedule.steps[index]
        if not isinstance(step, Trial):
            rows.append(Stage(step_title(protocol, step, language), index, index))
            index += 1
            continue
        last = index
        while last + 1 < len(schedule.steps) and _is_in_same_block(step, schedule.steps[last + 1]):
            last += 1
        rows.extend(_block_rows(protocol, schedule, index, last, language))
        index = last + 1
    return tuple(rows)


def _is_in_same_block(trial: Trial, other: Step) -> bool:
    return isinstance(other, Trial) and other.block == trial.block


def _block_rows(protocol: Protocol, schedule: Schedule, first: int, last: int, language: str) -> list[Stage]:
    trials = [step for step in schedule.steps[first : last + 1] if isinstance(step, Trial)]
    if len(trials) <= _ROWS_PER_BLOCK:
        return [Stage(trial.label(protocol, language), first + i, first + i) for i, trial in enumerate(trials)]
    label = protocol.text(protocol.blocks[trials[0].block].setting_label, language)
    return [Stage(f"{label} {trials[0].index} to {trials[-1].index}", first, last)]


_LONG_RUN: Final = 8
"""The number of equal answers in a row from which a run is called unusually long."""
_FAST_S: Final = 0.3
"""The median response time below which it is called unusually short [s]."""


def track_lines(progress: Progress, schedule: Schedule, trial: Trial, choices: Mapping[str, str]) -> tuple[str, ...]:
    """Return lines about the progress of the track of ``trial``; ``choices`` maps its answers to labels.

    "unusually" in a line marks a result that deserves the operator's attention.
    """
    numbers = [
        planned.number for planned in schedule.trials if (planned.block, planned.code) == (trial.block, trial.code)
    ]
    answers = [progress.trial_answers[number] for number in numbers if number in progress.trial_answers]
    limits = Counter(limit for number in numbers for limit in progress.undelivered.get(number, ()))
    given_up = [lost for lost in progress.missing_trials.missing if lost.trial in numbers]
    reasons = Counter(reason for number in numbers for reason in progress.repeated.get(number, ()))
    return (
        f"Track {trial.code}: {len(answers)} of at most {grouped(len(numbers))} trials answered",
        *(_answer_lines(answers, choices) if answers else ()),
        *(f"{count} repeated: {reason}" for reason, count in reasons.items()),
        *(f"{count} not delivered: {REASONS.get(limit, limit)}" for limit, count in limits.items()),
        *([f"{len(given_up)} unanswered because no attempt was within limits"] if given_up else []),
    )


def _answer_lines(answers: Sequence[TrialAnswer], choices: Mapping[str, str]) -> list[str]:
    values = [str(answer.value) for answer in answers]
    shares = ", ".join(f"{label} {100 * values.count(choice) / len(values):.0f} %" for choice, label in choices.items())
    run = max(len(list(same)) for _, same in groupby(values))
    lines = [*([shares] if shares else []), f"longest run {run}" + (", unusually long" if run >= _LONG_RUN else "")]
    seconds = [answer.seconds for answer in answers if answer.seconds is not None]
    if seconds:
        median_s = median(seconds)
        lines.append(f"median response time {median_s:.2f} s" + (", unusually short" if median_s < _FAST_S else ""))
    return lines
