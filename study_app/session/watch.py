"""Playback of a trial or interval from its recording and its session's journal.

An encrypted recording can be opened only after the study is unblinded. Before that, the key is used in memory only to
read the task, and a recording of an earlier version, which is not encrypted, is shown without forces, delay and
condition.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.devices.registry import DEVICES
from study_app.errors import StoreError
from study_app.haptics.model.layout import LIMITER_GLITCH
from study_app.protocol.orders import Trial
from study_app.protocol.trials import Task
from study_app.session.pages import Interval, TaskPage
from study_app.session.tasks import TankView, Tracker, new_tracker
from study_app.session.transitions.page_builder import task_page
from study_app.store import receipt
from study_app.store.blinded import (
    Key,
    complete_protocol,
    open_events,
    opened_key,
    participant_group,
    protocol_errors,
    read_key,
)
from study_app.store.files import StudyFolder, locate_session
from study_app.store.journals import journal
from study_app.store.journals import journal_events as events
from study_app.store.session_progress import progress_of

_MOTION_HIDDEN: Final = (
    "Hidden while the study is blinded, because with this device the recorded motion would reveal the liquid."
)
_ASSUMED_FRAME_S: Final = 1 / 60  # frame rate for a session whose frames are unknown
Kind: TypeAlias = Literal["target", "answer", "event"]


@dataclass(frozen=True, slots=True)
class Mark:
    """An event ``at_s`` after the task began [s]."""

    at_s: float
    kind: Kind
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Watched:
    """A recorded trial, or one of its ``intervals`` (0 if it has none); all times are since its task began [s].

    ``presented`` is the condition or the interval's contents. While the study is ``blinded`` it is "", and forces and
    delay are hidden, too. ``samples`` (n,), at ``times_s``, have valid positions. Frames were painted at ``painted_s``
    (k,) and showed the hand at ``shown_s`` (k,); ``lacking`` is the reason if the frames cannot be read.
    """

    page: TaskPage
    language: str
    blinded: bool
    presented: str
    intervals: int
    samples: Any
    times_s: NDArray[np.float64]
    tracker: Tracker
    marks: tuple[Mark, ...]
    painted_s: NDArray[np.float64] = field(default_factory=partial(np.empty, 0))
    shown_s: NDArray[np.float64] = field(default_factory=partial(np.empty, 0))
    lacking: str = ""

    @property
    def begins_s(self) -> float:
        """The time of the first sample, which comes before the task."""
        return float(self.times_s[0])

    @property
    def ends_s(self) -> float:
        """The time of the last sample or event."""
        return max(float(self.times_s[-1]), *(mark.at_s for mark in self.marks), 0.0)

    def index(self, at_s: float) -> int:
        """Return the index of the newest sample at a time [s]."""
        return max(int(np.searchsorted(self.times_s, at_s, "right")) - 1, 0)

    def drawn_s(self, at_s: float) -> float:
        """Return the time of the hand in the frame visible at ``at_s`` [s]; before the first frame return ``at_s``."""
        frame = int(np.searchsorted(self.painted_s, at_s, "right")) - 1
        return at_s if frame < 0 else float(self.shown_s[frame])

    def view(self, at_s: float) -> TankView:
        """Return the view of the tank at a time [s]; the hand's position is interpolated between samples."""
        places = self.samples["position_m"]
        position_m = np.array([np.interp(at_s, self.times_s, places[:, axis]) for axis in range(3)])
        time_ns = int(self.samples["time_ns"][0]) + round((at_s - self.begins_s) * 1e9)
        return TankView(position_m, self.tracker.at(time_ns), time_ns)

    def steps_s(self, kind: Literal["sample", "frame"]) -> NDArray[np.float64]:
        """Return the times of samples or painted frames [s]."""
        if kind == "sample":
            return self.times_s
        if len(self.painted_s) > 1:
            return self.painted_s
        return np.arange(self.begins_s, self.ends_s, _ASSUMED_FRAME_S)


def reason_motion_is_hidden(start: events.SessionStarted, key: Key | None) -> str:
    """Return the reason why a session's motion cannot be shown, or ""; ``key`` is None while the study is sealed."""
    device = DEVICES.get(start.device or "")
    is_visible = device is not None and not device.motion_shows_force
    return "" if is_visible or key is not None else _MOTION_HIDDEN


def read_watched(session_folder: Path, trial: int, attempt: int = 1, interval: int = 1) -> Watched:
    """Read an attempt at a trial, or its interval with this number.

    Raises
    ------
    StoreError
        The attempt has no recording, or a file cannot be read; `SealedRecording` if it is readable after unblinding.
    """
    from study_app.store import recordings  # noqa: PLC0415 - pyarrow: only once it is needed

    study, session = locate_session(session_folder)
    key, lines = opened_key(study), journal.read(session.journal)
    trial_name = f"trial {trial}"
    start_rows = [at for at, line in enumerate(lines) if isinstance(line, events.TrialStarted)]
    first = next((at for at in start_rows if lines[at].which[:2] == (trial, attempt)), None)  # type: ignore[attr-defined]
    if first is None:
        raise StoreError(f"{session.journal} does not contain attempt {attempt} of {trial_name}: choose another trial")
    _, *trial_lines = open_events([lines[0], *lines[first : next((at for at in start_rows if at > first), None)]], key)
    started = trial_lines[0]
    assert isinstance(started, events.TrialStarted)  # noqa: S101 - checked before
    which: events.Which = (trial, attempt, interval if started.has_intervals else None)
    recording_line = next((line for line in lines if isinstance(line, _RECORDING_EVENTS) and line.which == which), None)
    if not isinstance(recording_line, events.Recorded):
        reason = (
            "no recording was requested, or the recording was interrupted"
            if recording_line is None
            else recording_line.reason
        )
        raise StoreError(f"{trial_name} does not have a recording ({reason}): choose another trial")
    secret = None if key is None else key.nonce
    recorded_samples = recordings.read_samples(session.path / recording_line.recording, secret)
    if reason := reason_motion_is_hidden(events.start_of(lines), key):
        raise StoreError(reason.rstrip("."))
    starts = [line for line in trial_lines if isinstance(line, _START_EVENTS)][started.has_intervals :]
    at = next(number for number, line in enumerate(starts) if line.which == which)
    ended = next((line for line in trial_lines if isinstance(line, _END_EVENTS) and line.which == which), None)
    samples, times_s = _timed_samples(recorded_samples, trial_lines, last=at + 1 == len(starts))
    if not len(samples):
        raise StoreError(f"the recording for {trial_name} is empty: choose another trial")
    page = _page(study, session.receipt, lines, started, which[-1])
    duration_s = None if ended is None else ended.others.get("duration_s")
    tracker = new_tracker(page.task)
    tracker.feed(samples[(times_s >= 0) & (times_s <= (np.inf if duration_s is None else duration_s))])
    until_s = starts[at + 1].t_s if at + 1 < len(starts) else np.inf
    watched_task = Watched(
        page=page,
        language=progress_of(lines).language,
        blinded=key is None,
        presented=_presented_condition(started, which[-1], key),
        intervals=len(starts) if started.has_intervals else 0,
        samples=samples,
        times_s=times_s,
        tracker=tracker,
        marks=tuple(
            sorted(
                [*_marks(trial_lines, starts[at], ended, until_s), *_target_marks(ended, page.task)],
                key=lambda mark: mark.at_s,
            )
        ),
    )
    if key is None:  # the delay between a sample and its frame is sealed
        return watched_task
    try:
        frames = recordings.read_frames(session.path / recording_line.recording_frames, secret)
    except StoreError as error:
        return replace(watched_task, lacking=f"The frames of the participant's screen are missing: {error}.")
    start_ns = samples["time_ns"][0] - round(watched_task.begins_s * 1e9)
    painted_s, shown_s = ((frames[name] - start_ns) * 1e-9 for name in ("painted_ns", "sample_ns"))
    return replace(watched_task, painted_s=painted_s, shown_s=shown_s)


_RECORDING_EVENTS: Final = events.Recorded | events.RecordingLost
_START_EVENTS: Final = events.TrialStarted | events.IntervalStarted
_END_EVENTS: Final = events.TrialEnded | events.IntervalEnded


def _timed_samples(
    recorded: Any, trial_lines: Sequence[events.Event], *, last: bool
) -> tuple[Any, NDArray[np.float64]]:
    """Return the valid samples, with their times since the first one of the task's scene [s].

    An adjustment, of the ``last`` interval, changes the scene's number from its first step on.
    """
    samples = recorded[np.isfinite(recorded["position_m"]).all(axis=1)]
    samples = samples[samples["limiters"] & LIMITER_GLITCH == 0]
    steps = [
        line.scene - 1 for line in trial_lines if isinstance(line, events.Stepped) and line.scene is not None and last
    ]
    in_task = samples["scene"] >= min([*steps, samples["scene"].max(initial=0)])
    start_ns = samples["time_ns"][int(in_task.argmax())] if len(samples) else 0
    return samples, (samples["time_ns"] - start_ns) * 1e-9


def _marks(
    trial_lines: Sequence[events.Event], start_line: events.Event, end_line: Any, until_s: float
) -> Iterator[Mark]:
    """Yield the marks of events after ``start_line`` and before ``until_s`` [s, session's clock].

    Targets have times on the task's own clock. The task begins with its first frame, whose time is known to within a
    few milliseconds.
    """
    gap_ms = (end_line.others.get("first_frame_gap_ms") if end_line is not None else None) or 0.0
    for line in trial_lines:
        if start_line.n < line.n and line.t_s < until_s and (mark_text := _mark_text(line)) is not None:
            at_s = line.t_s - start_line.t_s - gap_ms * 1e-3
            if isinstance(line, events.TargetReached) and line.t_task_s is not None:
                at_s = line.t_task_s
            if line is end_line or not isinstance(line, _END_EVENTS):
                kind, text = mark_text
                yield Mark(at_s, kind, text)


def _target_marks(ended: events.EndOfTask | None, task: Task) -> Iterator[Mark]:
    """Yield the marks of targets whose times were sealed until unblinding, in the order in which they lit up."""
    for number, at_s in enumerate((ended.reached_s if ended is not None else None) or ()):
        yield Mark(at_s, "target", f"target {number % len(task.targets_m) + 1} reached")


def _mark_text(line: events.Event) -> tuple[Kind, str] | None:
    """Return kind and text of the mark for a journal event, or None."""
    match line:
        case events.TargetReached():
            return "target", f"target {line.target + 1} reached"
        case events.Stepped():
            return "answer", f"set {line.steps:+d} {'step' if abs(line.steps) == 1 else 'steps'}"
        case events.Choice():
            return "answer", f"{line.item}: {'cannot judge' if line.value is None else line.value}"
        case events.AnswerRemoved():
            return "answer", f"{line.item}: answer removed"
        case events.Responses():
            return "answer", "answers confirmed"
        case events.TrialEnded() | events.IntervalEnded():
            return "event", f"task ended: {line.outcome}"
        case events.Note():
            return "event", f"note: {line.text or 'marked'}"
        case events.Paused() | events.Resumed() | events.ForceStopped() | events.ForceRestored():
            return "event", line.event.replace("_", " ")
    return None


def _page(
    study: StudyFolder, path: Path, lines: Sequence[events.Event], started: events.TrialStarted, interval: int | None
) -> TaskPage:
    """Return the tank page of a trial or interval; while the study is sealed the ball has the scene's own size."""
    start, key = events.start_of(lines), read_key(study.path)
    group = participant_group(start, key)
    with protocol_errors(path):
        protocol = complete_protocol(receipt.read(path)["protocol"], key).for_session(group, start.session)
    body = protocol.scene.body
    if opened_key(study) is not None:
        condition = key.condition(started.block, started.code) if interval is None else None
        body = protocol.scene_for(condition or protocol.conditions_in(started.block)[0]).body
    trial_fields = {name: getattr(started, name) for name in ("block", "phase", "part", "index", "of", "code")}
    trial = Trial(number=started.trial, **trial_fields, items=())
    page = task_page(protocol, progress_of(lines).language, trial, body)
    if interval is None:
        return page
    interval_count = protocol.design_of(protocol.blocks[started.block]).intervals
    return replace(page, interval=Interval(interval, interval_count, resting=False, announced=""))


def _presented_condition(started: events.TrialStarted, interval: int | None, key: Key | None) -> str:
    if key is None or interval is None:
        return "" if key is None else key.condition(started.block, started.code)
    return {"S": "standard", "C": "comparison"}.get((started.arrangement or "")[interval - 1], "")
