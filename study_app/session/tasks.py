"""The tasks in the tank, tracked on the device's clock and drawn later.

A tracker processes samples and answers two questions: whether the task is over, and how it looked at any time since it
began. Drawing code requests the time now minus the delay, so that lit target, dwell arc and count are as old as the
proxy. Decisions use the newest sample and never wait for the screen.

The task begins with the first sample. A target is entered by the first sample with the proxy's centre within its radius
(border included), and reached by the first sample at which the proxy has been inside without interruption for the dwell
time. Leaving the target restarts the dwell time. The next target lights up with the sample that reached the previous
one, and only a later sample can enter it.
"""

from bisect import bisect_right
from dataclasses import dataclass
from pkgutil import resolve_name
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.protocol.trials import Point, Reach, Task
from study_app.video.frames import VideoFrame

Outcome: TypeAlias = Literal["complete", "timeout"]

_NS = 1_000_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskView:
    """The view of a task at one time.

    ``lit`` is the index of the lit target or None, ``reached`` the number of reached targets out of ``of`` (None if
    time ends the task), ``dwell`` the closed fraction of the ring, 0 … 1, ``elapsed_s`` the time since the task began.
    ``target_m`` is the position of a moving target [m, hand frame]; None for static targets.
    """

    lit: int | None
    reached: int
    of: int | None
    dwell: float
    elapsed_s: float
    target_m: Point | None = None


@dataclass(frozen=True, slots=True)
class TankView:
    """The view of the tank: the proxy's position (3,) [m, hand frame], the task, and the time of both [ns].

    With ``ball_hidden`` the proxy is not drawn; ``video`` is the frame of a video behind it, None without one.
    """

    position_m: NDArray[np.float64]
    task: TaskView
    sample_time_ns: int
    ball_hidden: bool = False
    video: VideoFrame | None = None


@dataclass(frozen=True, slots=True)
class TargetReached:
    """Target ``target`` (index into the task's list) was reached ``t_task_s`` after the task began."""

    target: int
    t_task_s: float


class Tracker:
    """Track one task through the samples of its trial; `new_tracker` chooses the subclass.

    ``outcome`` and ``end_ns`` (time of the sample that ended the task) are None while the task runs.
    """

    def __init__(self, limit_s: float, at_limit: Outcome) -> None:
        self.outcome: Outcome | None = None
        self.end_ns: int | None = None
        self._limit_ns = _to_nanoseconds(limit_s)
        self._at_limit = at_limit
        self._start_ns: int | None = None
        self._newest_ns = 0

    @property
    def done(self) -> bool:
        return self.outcome is not None

    def feed(self, samples: Any) -> list[TargetReached]:
        """Process the next samples in order (fields ``time_ns`` and ``position_m``); return the reached targets."""
        if self.done or len(samples) == 0:
            return []
        times: NDArray[np.int64] = samples["time_ns"]
        if self._start_ns is None:
            self._start_ns = self._newest_ns = int(times[0])
        limit_ns = self._start_ns + self._limit_ns
        count = int(np.searchsorted(times, limit_ns)) + 1
        times = times[:count]
        reached = self._process_samples(times, samples["position_m"][:count])
        if not self.done:
            self._newest_ns = int(times[-1])
            if self._newest_ns >= limit_ns:
                self._finish(self._at_limit, self._newest_ns)
        return reached

    def leave(self) -> bool:
        """End the task at the participant's request if that is allowed; return whether it was."""
        return False

    def finish(self, least_s: float) -> bool:
        """End the task if it has lasted for ``least_s``; return whether it has."""
        if self.done or self._start_ns is None or self._newest_ns - self._start_ns < _to_nanoseconds(least_s):
            return False
        self._finish("complete", self._newest_ns)
        return True

    def at(self, time_ns: int) -> TaskView:
        """Return the view of the task at ``time_ns``, limited to the time from its start to the newest sample."""
        start_ns = self._start_ns
        if start_ns is None:
            return self._task_view(0, 0)
        time_ns = min(max(time_ns, start_ns), self._newest_ns)
        return self._task_view(time_ns, time_ns - start_ns)

    def now(self) -> TaskView:
        """Return the view at the newest sample, for decisions; the participant sees an older one."""
        return self.at(self._newest_ns)

    def summary(self) -> dict[str, Any]:
        """Return the task's columns of the trial row: duration so far [s], targets reached and required."""
        duration_ns = 0 if self._start_ns is None else self._newest_ns - self._start_ns
        return {"duration_s": duration_ns / _NS, "targets_reached": None, "targets": None}

    def _process_samples(self, _times: NDArray[np.int64], _positions: NDArray[np.float64]) -> list[TargetReached]:
        return []

    def _task_view(self, _time_ns: int, elapsed_ns: int) -> TaskView:
        return TaskView(lit=None, reached=0, of=None, dwell=0.0, elapsed_s=elapsed_ns / _NS)

    def _finish(self, outcome: Outcome, end_ns: int) -> None:
        self.outcome, self.end_ns, self._newest_ns = outcome, end_ns, end_ns


class TimedTracker(Tracker):
    """Tracker of a task that ends by time or, after its least time, at the participant's request."""

    def __init__(self, task: Task) -> None:
        super().__init__(task.limit_s, "complete")
        self._task = task

    def leave(self) -> bool:
        return self._task.least_s is not None and self.finish(self._task.least_s)

    def _task_view(self, _time_ns: int, elapsed_ns: int) -> TaskView:
        elapsed_s = elapsed_ns / _NS
        target_m = self._task.target_m(elapsed_s)
        return TaskView(
            lit=None if target_m is None else 0, reached=0, of=None, dwell=0.0, elapsed_s=elapsed_s, target_m=target_m
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Mark:
    """The state from one time onwards: number of targets reached, the lit one, and when the proxy entered it [ns]."""

    reached: int
    lit: int | None
    entered_ns: int | None = None


class ReachTracker(Tracker):
    """Tracker of a reaching task: targets light up in turn until enough were reached or the time is over."""

    def __init__(self, task: Reach) -> None:
        if task.duration_s is None:
            super().__init__(task.timeout_s, "timeout")
        else:
            super().__init__(task.duration_s, "complete")
        self._targets_m = np.asarray(task.targets_m, np.float64)
        self._radius_m = task.radius_m
        self._dwell_ns = _to_nanoseconds(task.dwell_s)
        self._count = task.count
        self._marks = [_Mark(reached=0, lit=0)]
        self._mark_times = [0]

    def summary(self) -> dict[str, Any]:
        return super().summary() | {"targets_reached": self._marks[-1].reached, "targets": self._count}

    def _task_view(self, time_ns: int, elapsed_ns: int) -> TaskView:
        mark = self._marks[max(bisect_right(self._mark_times, time_ns) - 1, 0)]
        dwell = 0.0
        if mark.entered_ns is not None and self._dwell_ns:
            dwell = min((time_ns - mark.entered_ns) / self._dwell_ns, 1.0)
        return TaskView(lit=mark.lit, reached=mark.reached, of=self._count, dwell=dwell, elapsed_s=elapsed_ns / _NS)

    def _process_samples(self, times: NDArray[np.int64], positions: NDArray[np.float64]) -> list[TargetReached]:
        reached: list[TargetReached] = []
        row = 0
        while row < len(times) and (lit := self._marks[-1].lit) is not None:
            from_target_m = positions[row:] - self._targets_m[lit]
            inside = np.einsum("ij,ij->i", from_target_m, from_target_m) <= self._radius_m**2
            entered_ns = self._marks[-1].entered_ns
            if entered_ns is None:
                if not inside.any():
                    break
                offset_rows = int(inside.argmax())
                row, inside = row + offset_rows, inside[offset_rows:]
                entered_ns = int(times[row])
                self._add_mark(entered_ns, entered_ns)
            left_row = len(times) if inside.all() else row + int(inside.argmin())
            reached_row = row + int(np.searchsorted(times[row:], entered_ns + self._dwell_ns))
            if reached_row < left_row:
                reached.append(self._reach_target(int(times[reached_row]), lit))
            elif left_row < len(times):
                self._add_mark(int(times[left_row]), None)
            row = min(reached_row, left_row) + 1
        return reached

    def _add_mark(self, time_ns: int, entered_ns: int | None) -> None:
        previous = self._marks[-1]
        self._mark_times.append(time_ns)
        self._marks.append(_Mark(reached=previous.reached, lit=previous.lit, entered_ns=entered_ns))

    def _reach_target(self, time_ns: int, lit: int) -> TargetReached:
        reached = self._marks[-1].reached + 1
        is_complete = reached == self._count
        self._mark_times.append(time_ns)
        self._marks.append(_Mark(reached=reached, lit=None if is_complete else reached % len(self._targets_m)))
        if is_complete:
            self._finish("complete", time_ns)
        return TargetReached(lit, (time_ns - (self._start_ns or 0)) / _NS)


def new_tracker(task: Task) -> Tracker:
    """Return a tracker at the beginning of ``task``."""
    tracker: Tracker = resolve_name(task.tracker)(task)
    return tracker


def _to_nanoseconds(seconds: float) -> int:
    return round(seconds * _NS)
