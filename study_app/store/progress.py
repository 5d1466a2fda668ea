"""The progress of a session and its events, computed only from its journal.

Code that resumes, shows or checks a session uses this module, so that all agree.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from study_app.errors import StoreError
from study_app.store.delivered import Broken, beyond_limits
from study_app.store.folders import locate
from study_app.store.journals import journal
from study_app.store.journals.journal import Line

UNDELIVERED: Final = "invalid"
"""The outcome of a trial of which an interval was not delivered as requested."""


@dataclass(frozen=True, slots=True)
class Given:
    """The answer to a statement so far; times on the session's clock [s], None before the event."""

    onset_s: float | None = None
    first_s: float | None = None
    last_s: float | None = None
    changes: int = 0
    value: Any = None


@dataclass(frozen=True, slots=True)
class TrialAnswer:
    """The answer to a trial of intervals, and how long it took [s]; None where that is not known."""

    value: Any
    seconds: float | None


@dataclass(frozen=True, slots=True)
class NoteLine:
    """A note or mark of the operator, ``at_s`` in working time of the session."""

    at_s: float
    kind: str
    text: str


@dataclass(slots=True)
class Progress:
    """The progress of a session and its events, from the lines of its journal given to `take`.

    ``start`` is its first line: participant, session, seed, language and the rest. ``step`` is the index in the
    schedule of the step to continue at: the first that was not left behind. ``page`` (or form) or ``trial`` names
    it where it was begun: of a trial, ``attempt`` counts how often it was presented, ``task_done`` says that the last
    time its task ran to the end (so only answers are missing, or, without a questionnaire, nothing), and ``answers``
    holds what was chosen since; ``invalid`` counts its attempts that were not delivered as requested. ``presented``
    says of each trial by number how often it was, ``steps`` which step it is. ``ended`` is the status of a finished
    session. ``t_s`` is the latest moment on its clock, ``language`` the participant's.

    ``here`` is the index of the step that was shown last (−1 before the first), ``durations_s`` how long the steps left
    behind were shown, ``away_s`` how long no program held the session, which no duration counts. ``targets`` counts
    those reached in the latest trial; it began at ``trial_since_s``, None while a page is shown or after a gap, and its
    task took ``trial_lasted_s``, None until it ended. ``answered`` counts the responses to each trial and form, of a
    trial's last attempt; ``broken`` has for each trial done the limits that it broke: column, value and limit. ``lost``
    says why a trial's recording could not be kept, ``lacking`` how many samples it lacks; ``outlets_lost`` why an
    outlet to other programs failed since the session began or was resumed.

    ``of_intervals`` is the latest trial if it is one of intervals; ``trial_answers`` are the answers to all of them,
    ``repeated`` says of each why it was presented again, ``undelivered`` names the limits that its intervals broke, in
    every attempt that was not delivered as requested.
    """

    start: Line = field(default_factory=dict)
    step: int = 0
    page: str | None = None
    trial: int | None = None
    attempt: int = 0
    task_done: bool = False
    answers: dict[str, Given] = field(default_factory=dict)
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
    answered: dict[int | str, int] = field(default_factory=dict)
    broken: dict[int, tuple[Broken, ...]] = field(default_factory=dict)
    lost: dict[int, str] = field(default_factory=dict)
    lacking: dict[int, int] = field(default_factory=dict)
    outlets_lost: dict[str, str] = field(default_factory=dict)
    notes: list[NoteLine] = field(default_factory=list)
    repeats: int = 0
    paused: bool = False
    broke: str = ""
    of_intervals: int | None = None
    trial_answers: dict[int, TrialAnswer] = field(default_factory=dict)
    repeated: dict[int, tuple[str, ...]] = field(default_factory=dict)
    undelivered: dict[int, tuple[str, ...]] = field(default_factory=dict)
    _reason: str = ""
    _left_open: dict[tuple[int, int], dict[str, Given]] = field(default_factory=dict)

    @property
    def unconfirmed(self) -> dict[tuple[int, int], dict[str, Given]]:
        """The choices without a confirmation, by trial and attempt."""
        found = dict(self._left_open)
        chosen = {item: given for item, given in self.answers.items() if given.first_s is not None}
        if self.trial is not None and chosen:
            found[self.trial, self.attempt] = chosen
        return found

    def take(self, line: Line) -> None:
        """Process one more line."""
        at_s = line["t_s"]
        match line["event"]:
            case "session_started":
                self.start, self.language = line, line.get("language", "")
            case "page_shown":
                self._show_page(line["page"], at_s)
            case "form_shown":
                self._show_page(line["form"], at_s)
                self.answers = {}
            case "page_left":
                self._leave()
            case "trial_started":
                self._start_trial(line["trial"], line["attempt"], at_s)
                self._note_repetition(line)
            case "trial_ended":
                self._end_trial(line)
            case "interval_ended" if line.get("invalid"):
                self.undelivered[line["trial"]] = (*self.undelivered.get(line["trial"], ()), *line["invalid"])
            case "target_reached":
                self.targets += 1
            case "item_shown" | "choice":
                self.answers[line["item"]] = _answered(self.answers.get(line["item"], Given()), line)
            case "answer_removed":
                self.answers[line["item"]] = Given(onset_s=self.answers.get(line["item"], Given()).onset_s)
            case "responses" | "form_answered":
                self.answered[line["form"] if "form" in line else line["trial"]] = len(line["items"])
                if self.of_intervals is not None and line.get("trial") == self.of_intervals:
                    item = line["items"][0]
                    onset_s, first_s = item.get("onset_s"), item.get("first_s")
                    seconds = None if onset_s is None or first_s is None else first_s - onset_s
                    self.trial_answers[self.of_intervals] = TrialAnswer(item.get("value"), seconds)
                self.answers = {}
                self._leave()
            case "passed_over":
                self._go_to(line.get("page"), line.get("trial"))
                self._leave()
            case "recorded" if line["samples_unrecorded"]:
                self.lacking[line["trial"]] = line["samples_unrecorded"]
            case "recording_lost":
                self.lost[line["trial"]] = line["reason"]
            case "outlet_lost":
                self.outlets_lost[line["outlet"]] = line["reason"]
            case "note":
                self.notes.append(NoteLine(at_s - self.away_s, line["kind"], line["text"]))
            case "repeat":
                self._forget(line["trial"])
                self.repeats += 1
                self._reason = str(line["reason"])
            case "paused" | "resumed":
                self.paused = line["event"] == "paused"
            case "broke":
                self.broke = str(line["what"])
            case "device_reconnected":
                self.broke = ""
            case "language_chosen":
                self.language = line["language"]
            case "session_resumed":
                self._resume(max(0.0, at_s - self.t_s))
            case "session_ended":
                self._close(at_s)
                self.ended, self.fingerprint, self.paused = line["status"], line.get("fingerprint", ""), False
        self.t_s = max(self.t_s, at_s)

    def _go_to(self, page: str | None, trial: int | None) -> None:
        """Go to a step, unless it is the current one, which is then shown again."""
        if (self.page, self.trial) != (page, trial):
            if (self.page, self.trial) != (None, None):
                self._leave()
            self.page, self.trial = page, trial

    def _leave(self) -> None:
        self._drop_answers()
        self.step, self.page, self.trial, self.attempt, self.task_done = self.step + 1, None, None, 0, False
        self.invalid = 0

    def _drop_answers(self) -> None:
        self._left_open = self.unconfirmed
        self.answers = {}

    def _show_page(self, page: str, at_s: float) -> None:
        self._go_to(page, None)
        self._enter(at_s)
        self.trial_since_s = self.trial_lasted_s = None

    def _start_trial(self, trial: int, attempt: int, at_s: float) -> None:
        """Present a trial; an earlier one is repeated if its whole block is."""
        self._go_to(None, trial)
        self._drop_answers()
        self._forget(trial)
        self.step = self.steps.setdefault(trial, self.step)
        self.attempt, self.task_done = attempt, False
        self.presented[trial] = max(attempt, self.presented.get(trial, 0))
        self._enter(at_s)
        self.trial_since_s, self.trial_lasted_s, self.targets, self.paused = at_s, None, 0, False

    def _end_trial(self, line: Line) -> None:
        self.trial_lasted_s = None if self.trial_since_s is None else line["t_s"] - self.trial_since_s
        self.task_done = line["outcome"] in ("complete", "timeout")
        self.invalid += line["outcome"] == UNDELIVERED
        if self.task_done:
            self.broken[line["trial"]] = beyond_limits(line, self.start.get("limits", {}))
        else:
            self._reason = str(line["outcome"])

    def _note_repetition(self, line: Line) -> None:
        """Store why a trial of intervals is presented again."""
        trial = line["trial"]
        self.of_intervals = trial if is_of_intervals(line) else None
        if self.of_intervals is not None and line["attempt"] > 1 and self._reason != UNDELIVERED:
            self.repeated[trial] = (*self.repeated.get(trial, ()), self._reason or "interrupted")
        self._reason = ""

    def _forget(self, trial: int) -> None:
        """Clear the state of an earlier attempt of a trial."""
        self.answered.pop(trial, None)
        self.trial_answers.pop(trial, None)
        self.broken.pop(trial, None)

    def _resume(self, gap_s: float) -> None:
        """Continue after a gap, which the session's clock counts as a pause."""
        self.resumed += 1
        self._reason = "program ended"
        self.paused, self.broke, self.trial_since_s, self.trial_lasted_s = False, "", None, None
        self.outlets_lost = {}  # they were opened again
        self.here_since_s += gap_s
        self.away_s += gap_s

    def _enter(self, at_s: float) -> None:
        if self.step != self.here:
            self._close(at_s)
            self.here, self.here_since_s = self.step, at_s

    def _close(self, at_s: float) -> None:
        if self.here >= 0:
            self.durations_s[self.here] = at_s - self.here_since_s


def progress(session_folder: Path) -> Progress:
    """Return the progress of the session in ``session_folder``; an incomplete last line of its journal is ignored.

    Raises
    ------
    StoreError
        It is not a session folder, or its journal is missing, empty or damaged.
    """
    _, session = locate(session_folder)
    return progress_of(journal.read(session.journal))


def progress_of(lines: Sequence[Line]) -> Progress:
    """Return the progress of a session from its journal's lines.

    Raises
    ------
    StoreError
        They do not begin as a session's do.
    """
    if not lines or lines[0]["event"] != "session_started":
        raise StoreError(
            "the journal does not begin with session_started: restore it from a copy, or use a new session number"
        )
    now = Progress()
    for line in lines:
        now.take(line)
    return now


def _answered(given: Given, line: Line) -> Given:
    at_s = line["t_s"]
    if line["event"] == "item_shown":
        return given if given.onset_s is not None else replace(given, onset_s=at_s)
    if given.first_s is None:
        return replace(given, first_s=at_s, last_s=at_s, value=line["value"])
    if given.value == line["value"]:
        return given
    return replace(given, last_s=at_s, value=line["value"], changes=given.changes + 1)


def is_of_intervals(started: Mapping[str, Any]) -> bool:
    """Return whether the line of a trial's start is of a trial of intervals, whose contents it lists."""
    return "sealed" in started or "arrangement" in started


def recordable(lines: Iterable[Line]) -> list[tuple[int, int, int | None]]:
    """Return trial, attempt and interval of all planned or existing recordings; the interval is None for a trial."""
    return [
        (line["trial"], line["attempt"], line.get("interval"))
        for line in lines
        if line["event"] == "interval_started" or (line["event"] == "trial_started" and not is_of_intervals(line))
    ]


def named(line: Mapping[str, Any]) -> str:
    """Return the subject of a line: "trial 3, attempt 1", in a trial of intervals with the interval."""
    interval = line.get("interval")
    return f"trial {line['trial']}, attempt {line['attempt']}" + ("" if interval is None else f", interval {interval}")
