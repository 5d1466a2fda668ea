"""The progress of a session and its events, computed only from its journal.

Code that resumes, shows or checks a session uses this module, so that all agree.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from study_app.protocol.model import Protocol
from study_app.protocol.presented import trial_result
from study_app.protocol.trials import TrialResult
from study_app.store.journals import journal_events as events
from study_app.store.session_progress.delivered import Broken, beyond_limits, late_device_text
from study_app.store.session_progress.missing_trials import MissingTrial, MissingTrials


@dataclass(frozen=True, slots=True)
class TrialAnswer:
    """The answer to a trial of intervals, and the response time [s]; None if it is unknown."""

    value: Any
    seconds: float | None


@dataclass(slots=True, kw_only=True)
class Progress:
    """The progress of a session and its events, computed from the journal lines given to `process_line`.

    ``start`` is the journal's first line. ``step`` is the index in the schedule of the first unfinished step, at which
    a session is resumed. If that step was begun, ``page`` (also for a form) or ``trial`` identifies it. For a trial,
    ``attempt`` counts the presentations; ``task_done`` tells whether the last task ran to the end, so that at most
    answers are missing; ``answers`` holds the choices since then; ``invalid`` counts the attempts that were not
    delivered as requested. ``presented`` maps trial numbers to the number of presentations, ``steps`` to step indices.
    ``ended`` is the status of a finished session. ``t_s`` is the latest time on the session's clock, ``language`` the
    participant's language.

    ``here`` is the index of the last step shown (−1 before the first), ``durations_s`` are the durations of finished
    steps, ``away_s`` is the time in which no program ran, which no duration includes. ``targets`` counts the targets
    reached in the latest trial. That trial began at ``trial_since_s``, None while a page is shown or after a gap; its
    task took ``trial_lasted_s``, None until it ended. ``answered`` counts the answers to each main trial (its last
    attempt) and form. ``broken`` has the violated limits of each finished trial. ``late`` has a text for each trial in
    which the device answered later than assumed. ``lost`` gives the reason for each trial whose recording was lost,
    ``lacking`` the number of samples missing from a recording. ``outlets_lost`` gives the reason for each outlet to
    other programs that failed since the session began or was resumed.

    ``of_intervals`` is the latest trial if it is one of intervals; ``trial_answers`` are the answers to all of them,
    ``repeated`` gives the reason for each repeated presentation, ``undelivered`` names the limits that intervals
    violated in every attempt that was not delivered as requested.
    """

    start: events.SessionStarted | None = None
    step: int = 0
    page: str | None = None
    trial: int | None = None
    attempt: int = 0
    task_done: bool = False
    answers: dict[str, events.Answer] = field(default_factory=dict)
    invalid: int = 0
    presented: dict[int, int] = field(default_factory=dict)
    steps: dict[int, int] = field(default_factory=dict)
    ended: str | None = None
    fingerprint: str = ""
    resumed: int = 0
    t_s: float = 0.0
    language: str = ""
    here: int = -1
    here_since_s: float = 0.0
    durations_s: dict[int, float] = field(default_factory=dict)
    away_s: float = 0.0
    trial_since_s: float | None = None
    trial_lasted_s: float | None = None
    targets: int = 0
    answered: dict[int | tuple[str, str | None], int] = field(default_factory=dict)
    broken: dict[int, tuple[Broken, ...]] = field(default_factory=dict)
    late: dict[int, str] = field(default_factory=dict)
    lost: dict[int, str] = field(default_factory=dict)
    lacking: dict[int, int] = field(default_factory=dict)
    outlets_lost: dict[str, str] = field(default_factory=dict)
    notes: list[events.Note] = field(default_factory=list)
    repeats: int = 0
    paused: bool = False
    broke: str = ""
    of_intervals: int | None = None
    trial_answers: dict[int, TrialAnswer] = field(default_factory=dict)
    repeated: dict[int, tuple[str, ...]] = field(default_factory=dict)
    undelivered: dict[int, tuple[str, ...]] = field(default_factory=dict)
    _main: dict[int, events.TrialStarted] = field(default_factory=dict)
    _failed: set[int] = field(default_factory=set)
    _reason: str = ""
    _phase: str = ""
    _left_open: dict[tuple[int, int], dict[str, events.Answer]] = field(default_factory=dict)

    @property
    def unconfirmed(self) -> dict[tuple[int, int], dict[str, events.Answer]]:
        """The unconfirmed choices, by trial and attempt."""
        choices = dict(self._left_open)
        chosen = {item: answer for item, answer in self.answers.items() if answer.given}
        if self.trial is not None and chosen:
            choices[self.trial, self.attempt] = chosen
        return choices

    @property
    def missing_trials(self) -> MissingTrials:
        """The main trials of intervals that were not delivered, out of those that are over."""
        limits = {} if self.start is None else self.start.limits
        # the current trial is presented again
        current = self.trial if self.invalid < limits.get("attempts", 1) else None
        missing = tuple(
            MissingTrial(
                trial=number,
                block=self._main[number].block,
                code=self._main[number].code,
                broken=tuple(dict.fromkeys(self.undelivered.get(number, ()))),
            )
            for number in sorted(self._failed & self._main.keys() - {current})
        )
        answered = sum(number in self.trial_answers for number in self._main)
        return MissingTrials(missing=missing, asked=answered + len(missing), limits=limits)

    @property
    def reached_end(self) -> bool:
        """Whether the session reached its last page, even if trials are missing."""
        return self.ended in events.REACHED_END

    def process_line(self, line: events.Event) -> None:
        """Process one more line."""
        at_s = line.t_s
        if isinstance(line, events.EndOfTask) and (text := late_device_text(line.others)):
            self.late[line.trial] = text
        match line:
            case events.SessionStarted():
                self.start, self.language = line, line.language
            case events.PageShown(page=page):
                self._show_page(page, at_s)
            case events.FormShown(form=form):
                self._show_page(form, at_s)
                self.answers = {}
            case events.PageLeft():
                self._leave_step()
            case events.TrialStarted():
                self._start_trial(line)
            case events.TrialEnded():
                self._end_trial(line)
            case events.IntervalEnded(trial=trial, invalid=limits) if limits:
                self.undelivered[trial] = (*self.undelivered.get(trial, ()), *limits)
            case events.TargetReached():
                self.targets += 1
            case events.ItemShown(item=item):
                self.answers[item] = self.answers.get(item, events.Answer()).shown(at_s)
            case events.Choice(item=item):
                self.answers[item] = self.answers.get(item, events.Answer()).chosen(at_s, line.value)
            case events.AnswerRemoved(item=item):
                self.answers[item] = self.answers.get(item, events.Answer()).removed()
            case events.Responses() | events.FormAnswered():
                self._confirm_answers(line)
            case events.PassedOver():
                self._go_to(line.page, line.trial)
                self._leave_step()
            case events.Recorded() if line.samples_unrecorded:
                self.lacking[line.trial] = line.samples_unrecorded
            case events.RecordingLost():
                self.lost[line.trial] = line.reason
            case events.OutletLost():
                self.outlets_lost[line.outlet] = line.reason
            case events.Note():
                self.notes.append(replace(line, t_s=at_s - self.away_s))
            case events.Repeat():
                self._forget_attempt(line.trial)
                self.repeats += 1
                self._reason = line.reason
            case events.Paused() | events.Resumed():
                self.paused = isinstance(line, events.Paused)
            case events.Broke():
                self.broke = line.what
            case events.DeviceReconnected():
                self.broke = ""
            case events.LanguageChosen():
                self.language = line.language
            case events.SessionResumed():
                self._continue_after_gap(max(0.0, at_s - self.t_s))
            case events.SessionEnded():
                self._record_duration(at_s)
                self.ended, self.fingerprint, self.paused = line.status, line.others.get("fingerprint", ""), False
        self.t_s = max(self.t_s, at_s)

    def _confirm_answers(self, line: events.Responses | events.FormAnswered) -> None:
        """Record the answers of a trial or form as confirmed."""
        key = (line.form, line.after) if isinstance(line, events.FormAnswered) else line.trial
        if isinstance(line, events.FormAnswered) or self._phase == "main":
            self.answered[key] = sum(item.first_s is not None for item in line.items)
        if isinstance(line, events.Responses) and line.items and line.trial == self.of_intervals:
            answer = line.items[0]
            seconds = None if answer.onset_s is None or answer.first_s is None else answer.first_s - answer.onset_s
            self.trial_answers[line.trial] = TrialAnswer(answer.value, seconds)
        self.answers = {}
        self._leave_step()

    def _go_to(self, page: str | None, trial: int | None) -> None:
        """Make a step the current one, leaving the previous step unless it is the same."""
        if (self.page, self.trial) != (page, trial):
            if (self.page, self.trial) != (None, None):
                self._leave_step()
            self.page, self.trial = page, trial

    def _leave_step(self) -> None:
        self._drop_answers()
        self.step, self.page, self.trial, self.attempt, self.task_done = self.step + 1, None, None, 0, False
        self.invalid = 0

    def _drop_answers(self) -> None:
        self._left_open = self.unconfirmed
        self.answers = {}

    def _show_page(self, page: str, at_s: float) -> None:
        self._go_to(page, None)
        self._enter_step(at_s)
        self.trial_since_s = self.trial_lasted_s = None

    def _start_trial(self, line: events.TrialStarted) -> None:
        """Apply the first or a repeated start of a trial; a return to an earlier trial repeats its whole block."""
        trial = line.trial
        self._go_to(None, trial)
        self._drop_answers()
        self._forget_attempt(trial)
        self.step = self.steps.setdefault(trial, self.step)
        self.attempt, self.task_done = line.attempt, False
        self.presented[trial] = max(line.attempt, self.presented.get(trial, 0))
        self._enter_step(line.t_s)
        self.trial_since_s, self.trial_lasted_s, self.targets, self.paused = line.t_s, None, 0, False
        self.of_intervals, self._phase = trial if line.has_intervals else None, line.phase
        if line.has_intervals and line.phase == "main":
            self._main[trial] = line
        if line.has_intervals and line.attempt > 1 and self._reason != events.UNDELIVERED:
            self.repeated[trial] = (*self.repeated.get(trial, ()), self._reason or "interrupted")
        self._reason = ""

    def _end_trial(self, line: events.TrialEnded) -> None:
        self.trial_lasted_s = None if self.trial_since_s is None else line.t_s - self.trial_since_s
        self.task_done = line.outcome in ("complete", "timeout")
        if line.outcome == events.UNDELIVERED:
            self.invalid += 1
            self._failed.add(line.trial)
        if self.task_done:
            self.broken[line.trial] = beyond_limits(line.others, {} if self.start is None else self.start.limits)
        else:
            self._reason = line.outcome

    def _forget_attempt(self, trial: int) -> None:
        """Clear the state of an earlier attempt of a trial."""
        self.answered.pop(trial, None)
        self.trial_answers.pop(trial, None)
        self.broken.pop(trial, None)
        self.late.pop(trial, None)
        self._failed.discard(trial)

    def _continue_after_gap(self, gap_s: float) -> None:
        """Continue after a gap, which the session's clock counts as a pause."""
        self.resumed += 1
        self._reason = "program ended"
        self.paused, self.broke, self.trial_since_s, self.trial_lasted_s = False, "", None, None
        self.outlets_lost = {}  # outlets were opened again
        self.here_since_s += gap_s
        self.away_s += gap_s

    def _enter_step(self, at_s: float) -> None:
        if self.step != self.here:
            self._record_duration(at_s)
            self.here, self.here_since_s = self.step, at_s

    def _record_duration(self, at_s: float) -> None:
        if self.here >= 0:
            self.durations_s[self.here] = at_s - self.here_since_s


def progress_of(lines: Sequence[events.Event]) -> Progress:
    """Return the progress of a session from its journal's lines.

    Raises
    ------
    StoreError
        The first line is not that of a session.
    """
    events.start_of(lines)
    progress = Progress()
    for line in lines:
        progress.process_line(line)
    return progress


def trial_results(protocol: Protocol, lines: Iterable[events.Event]) -> tuple[TrialResult, ...]:
    """Return the answered interval trials with their presented levels, by number; the last answer counts.

    Lines that do not fit the study, or whose sealed fields are not opened, raise KeyError or ValueError.
    """
    started: dict[tuple[int, int], events.TrialStarted] = {}
    results: dict[int, TrialResult] = {}
    for line in lines:
        if isinstance(line, events.TrialStarted):
            started[line.trial, line.attempt] = line
        elif isinstance(line, events.Responses):
            start = started[line.trial, line.attempt]
            block = protocol.blocks[start.block]
            if block.design is None:
                continue
            if start.arrangement is None or not line.items:
                raise KeyError("arrangement and answer")
            arrangement = protocol.design_of(block).arrangement_of(start.arrangement)
            answer: Any = line.items[0].value
            trial_fields = line.trial, start.code, start.level, arrangement
            results[line.trial] = trial_result(protocol, block, *trial_fields, answer, catch=bool(start.catch))
    return tuple(results[number] for number in sorted(results))


def recordable(lines: Iterable[events.Event]) -> list[events.Which]:
    """Return trial, attempt and interval of each task that a recording covers; the interval is None for a trial."""
    return [
        line.which
        for line in lines
        if isinstance(line, events.IntervalStarted)
        or (isinstance(line, events.TrialStarted) and not line.has_intervals)
    ]


def attempt_name(trial: int, attempt: int, interval: int | None) -> str:
    """Return the name of an attempt: "trial 3, attempt 1", followed by the interval in a trial of intervals."""
    return f"trial {trial}, attempt {attempt}" + ("" if interval is None else f", interval {interval}")
