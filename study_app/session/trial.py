"""The running trial: prepared, started by the first painted frame of its tank, tracked, recorded and summarised.

Before that frame there is no force, the task's clock is at zero and nothing is recorded, however long a window takes to
show the tank. Without a window, the caller reports the first frame at once. A recording begins shortly before the first
frame and contains every tick, so that all forces of the trial, including the fade from an earlier force, can be
computed from the recording alone. Measures contain only the error of the delay, never the requested delay.
"""

import math
from collections import deque
from functools import partial
from typing import Any

import numpy as np

from study_app.haptics.model.layout import LIMITER_GLITCH, LIMITER_NAMES, SAMPLE
from study_app.haptics.model.scene import Scene
from study_app.haptics.runtime.telemetry import timing
from study_app.protocol.trials import AnyTask
from study_app.session.ports import RecorderPort, ServoPort
from study_app.session.tasks import Outcome, TankView, TargetReached, TaskView, new_tracker
from study_app.session.transitions.events import StartTrial
from study_app.store.session_progress import JUDGED, delivered_error, judged_fields, late_device_ticks
from study_app.video.frames import VideoFrame, VideoSource, VideoStatistics

_LEAD_S = 0.6  # time of samples kept for the next recording [s]: longer than the slowest fade
_ROW_FIELDS = ("tick", "lateness_ns", "permitted_n", "withheld_n", "delay_ticks")
_STORED_SAMPLE = np.dtype([(name, SAMPLE[name]) for name in (*(JUDGED.names or ()), *_ROW_FIELDS)])
"""The fields of a trial's samples that are stored: 128 of 320 bytes."""
# Everything is drawn this much later than requested (two ticks at 1 kHz), so that the drawn time always lies between
# two samples and is met exactly. Otherwise a trial without a delay would draw the newest sample, which is up to a tick
# old, and the error of its delay would identify it.
SETTLED_S = 0.002
_MIN_SETTING_S = 1.0
"""Minimum time of a setting after the task's lead-in [s], since a shorter one could not be evaluated. [choice]"""
_FROZEN_S = 1.0
"""Longest time without a tick or frame that does not end the attempt [s]; no study permits more. [choice]"""


class Recording:
    """Pass samples and frames of trials to the recorder; without a recorder do nothing."""

    def __init__(self, recorder: RecorderPort | None, rate_hz: float) -> None:
        self._recorder = recorder
        self._rate_hz = rate_hz
        self._lead = round(_LEAD_S * rate_hz)
        self._before: deque[Any] = deque()
        self._sample_count = 0
        self._running = False

    def add_samples(self, samples: Any) -> None:
        """Add the newest samples in order (array of ``layout.SAMPLE``), which must not be changed afterwards."""
        if self._recorder is None or len(samples) == 0:
            return
        if self._running:
            self._recorder.append(samples)
        self._before.append(samples)
        self._sample_count += len(samples)
        while self._sample_count - len(self._before[0]) >= self._lead:
            self._sample_count -= len(self._before.popleft())

    def forget(self) -> None:
        """Discard earlier samples after a restart of the servo, since the force does not continue from them."""
        self._before.clear()
        self._sample_count = 0

    def start(self, trial: int, attempt: int, interval: int | None = None) -> None:
        """Begin the recording of a trial or of one of its intervals with the samples just before it."""
        if self._recorder is None:
            return
        self._recorder.start(trial, attempt, self._rate_hz, interval)
        self._running = True
        surplus = max(self._sample_count - self._lead, 0)
        for index, samples in enumerate(self._before):
            self._recorder.append(samples[surplus:] if index == 0 else samples)

    def frame(self, painted_ns: int, sample_ns: int, video: VideoFrame | None = None) -> None:
        """Record a painted frame, the time that it shows [ns], and its video frame."""
        if self._recorder is not None and self._running:
            self._recorder.frame(painted_ns, sample_ns, video)

    def stop(self) -> None:
        if self._recorder is not None and self._running:
            self._recorder.stop()
        self._running = False


class _FrameStatistics:
    """Statistics of the frames of a trial. Without a window only the first frame needs to be reported."""

    def __init__(self, *, late_s: float, due_ns: int, paints: bool = True, videos: bool = False) -> None:
        self._video = VideoStatistics() if videos else None
        self._late_s = late_s
        self._min_frames = 1 if paints else 2  # a gap before the first frame does not count
        self._errors_s: list[float] = []
        self._painted_ns = due_ns
        self._first_gap_ns = 0
        self._frame_gap_ns = 0

    def frame(self, painted_ns: int, shown_ns: int, delay_s: float, video: VideoFrame | None = None) -> None:
        """Add a painted frame, the time that it shows [ns], and the requested delay [s].

        ``video`` is the frame of a video in it.
        """
        if self._video is not None and video is not None:
            self._video.frame(painted_ns, video, delay_s)
        gap_ns = painted_ns - self._painted_ns
        if self._errors_s:
            self._frame_gap_ns = max(self._frame_gap_ns, gap_ns)
        else:
            self._first_gap_ns = gap_ns
        self._painted_ns = painted_ns
        self._errors_s.append((painted_ns - shown_ns) * 1e-9 - delay_s)

    def frame_gap_ns(self, until_ns: int) -> int:
        """Return the longest time between frames, including the one since the newest [ns]; 0 before the first frame."""
        return max(self._frame_gap_ns, until_ns - self._painted_ns) if len(self._errors_s) >= self._min_frames else 0

    def columns(self, until_ns: int) -> dict[str, Any]:
        """Return the frame columns of a trial's row; the last frame was shown until ``until_ns``."""
        errors_s = np.asarray(self._errors_s, np.float64)
        has_frames = errors_s.size > 0
        return {
            "frames": int(errors_s.size),
            "frames_late": int((errors_s > self._late_s).sum()),
            "delay_error_mean_ms": float(errors_s.mean()) * 1e3 if has_frames else None,
            "delay_error_p95_ms": float(np.percentile(errors_s, 95)) * 1e3 if has_frames else None,
            "delay_error_max_ms": float(errors_s.max()) * 1e3 if has_frames else None,
            "first_frame_gap_ms": self._first_gap_ns * 1e-6 if has_frames else None,
            "worst_frame_gap_ms": self.frame_gap_ns(until_ns) * 1e-6 if errors_s.size >= self._min_frames else None,
            **({} if self._video is None else self._video.columns()),
        }


def _sample_columns(samples: Any, rate_hz: float, samples_dropped: int, worst_gap_s: float) -> dict[str, Any]:
    """Return the sample columns of a trial's row (array of ``layout.SAMPLE``); most are None without samples.

    ``worst_gap_s`` is the longest time between two ticks, as recorded by the servo.
    """
    trial_timing = timing(samples.view(np.recarray), rate_hz)
    ticks = trial_timing.ticks
    elapsed_s = float(samples["time_ns"][-1] - samples["time_ns"][0]) * 1e-9 if ticks else 0.0
    positions_m = samples["position_m"][samples["limiters"] & LIMITER_GLITCH == 0]
    steps = np.diff(positions_m[np.isfinite(positions_m).all(axis=1)], axis=0)
    path_m = float(np.sqrt(np.einsum("ij,ij->i", steps, steps)).sum())
    force_n = np.sqrt(np.einsum("ij,ij->i", samples["device_force_n"], samples["device_force_n"]))
    permitted_n, delay_ticks = float(samples["permitted_n"].sum()), samples["delay_ticks"]
    return {
        "ticks": ticks,
        "tick_rate_hz": trial_timing.rate_hz if ticks > 1 else None,
        "lateness_p99_ms": trial_timing.lateness_p99_s * 1e3 if ticks else None,
        "worst_gap_ms": worst_gap_s * 1e3 if ticks else None,
        "overruns": trial_timing.overruns,
        "samples_dropped": samples_dropped,
        "path_length_m": path_m,
        "mean_speed_mps": path_m / elapsed_s if elapsed_s > 0 else None,
        "force_mean_n": float(force_n.sum()) / ticks if ticks else None,
        "force_peak_n": float(force_n.max()) if ticks else None,
        "withheld_share": float(samples["withheld_n"].sum()) / permitted_n if permitted_n > 0 else None,
        "loop_delay_ticks": int(delay_ticks.max()) if ticks else None,
        "loop_delay_changes": int(np.count_nonzero(np.diff(delay_ticks))) if ticks else None,
        "device_delay_ticks": late_device_ticks(samples, rate_hz) if ticks else None,
        **{
            f"limiter_{name}": int(np.count_nonzero(samples["limiters"] >> bit & 1))
            for bit, name in enumerate(LIMITER_NAMES)
        },
    }


class RunningTrial:
    """One attempt of a trial, from its preparation to its end."""

    def __init__(
        self,
        command: StartTrial,
        scene: Scene,
        *,
        late_s: float,
        servo: ServoPort,
        reader: Any,
        recording: Recording,
        paints: bool,
        hides_ball: bool = False,
        video: VideoSource | None = None,
        videos: bool = False,
    ) -> None:
        self.trial = command.trial
        self._video = video
        self._drawn_video: VideoFrame | None = None
        if video is not None:
            video.rewind()
        self._hides_ball = hides_ball
        self._chunks: list[bytes] = []
        self.command = command
        self._delay_s = self._drawn_delay_s = command.delay_s
        self._scene = scene
        self._servo = servo
        self._reader = reader
        self._recording = recording
        self._serial: int | None = None
        self._dropped_before = 0
        self._tracker = new_tracker(command.task)
        self._frames = _FrameStatistics(late_s=late_s, due_ns=servo.now_ns(), paints=paints, videos=videos)

    @property
    def task(self) -> TaskView:
        """The task at the newest sample, for decisions; the participant sees a delayed view."""
        return self._tracker.now()

    def view(self, now_ns: int) -> TankView:
        """Return the view to draw at ``now_ns`` (servo's clock), with the requested delay plus ``SETTLED_S``."""
        self._drawn_delay_s = self._delay_s
        drawn_ns = now_ns - round((self._delay_s + SETTLED_S) * 1e9)
        position_m, shown_ns = self._servo.telemetry.position_at(drawn_ns)
        task = self._tracker.at(shown_ns)
        hidden = self._hides_ball and task.elapsed_s >= self.command.task.judged_from_s
        self._drawn_video = None if self._video is None else self._video.frame_at(drawn_ns)
        return TankView(position_m, task, shown_ns, hidden, self._drawn_video)

    def frame(self, painted_ns: int, sample_ns: int) -> None:
        """Add a painted frame and the time that it shows [ns, servo's clock]; the first one begins the trial."""
        if self._serial is None:
            self._serial = self._servo.load(self._scene)
            self._dropped_before = self._reader.dropped
            self._recording.start(self.trial, self.command.attempt, self.command.interval)
            if self._video is not None:
                self._video.begin(painted_ns)
        self._frames.frame(painted_ns, sample_ns, self._drawn_delay_s, self._drawn_video)
        self._recording.frame(painted_ns, sample_ns, self._drawn_video)

    def follow(self, samples: Any) -> list[TargetReached]:
        """Process the newest samples in order (array of ``layout.SAMPLE``); return the reached targets."""
        if self._serial is None or self._tracker.done:
            return []
        trial_samples = samples[samples["scene"] >= self._serial]  # each adjustment adds one
        reached = self._tracker.feed(trial_samples[trial_samples["limiters"] & LIMITER_GLITCH == 0])
        end_ns = self._tracker.end_ns
        trial_samples = trial_samples if end_ns is None else trial_samples[trial_samples["time_ns"] <= end_ns]
        stored = np.empty(len(trial_samples), _STORED_SAMPLE)
        for name in _STORED_SAMPLE.names or ():
            stored[name] = trial_samples[name]
        self._chunks.append(stored.tobytes())
        return reached

    @property
    def adjustable(self) -> bool:
        """Whether the participant can adjust the level now: from the first frame until the task is over."""
        return self.command.adjusts and self._serial is not None and not self._tracker.done

    def adjust(self, scene: Scene | None, delay_s: float) -> int | None:
        """Change the parameters of the scene (None if they do not affect a force) and the delay [s].

        Return the new number of the scene in telemetry; None if it does not change.
        """
        self._delay_s = delay_s
        return None if scene is None else self._servo.adjust(scene)

    def leave(self) -> None:
        """End the task at the participant's request, if that is allowed."""
        if self.command.adjusts:
            self._tracker.finish(self.command.task.judged_from_s + _MIN_SETTING_S)
        else:
            self._tracker.leave()

    def outcome(self) -> Outcome | None:
        """Return the outcome of the task once its end was visible with the block's longest delay; None before that."""
        end_ns = self._tracker.end_ns
        linger_ns = round((self.command.linger_s + SETTLED_S) * 1e9)
        if end_ns is None or self._servo.now_ns() - end_ns < linger_ns:
            return None
        at_limit = self.command.adjusts and self._tracker.now().elapsed_s >= self.command.task.limit_s
        return "timeout" if at_limit else self._tracker.outcome

    @property
    def samples(self) -> Any:
        """The samples of the trial or interval so far (array of ``delivered.JUDGED``)."""
        return judged_fields(self._samples)

    @property
    def _samples(self) -> Any:
        # np.concatenate copies records field by field, five times slower
        return np.frombuffer(b"".join(self._chunks), _STORED_SAMPLE)

    @property
    def frozen(self) -> bool:
        """Whether the program or computer was suspended so long that the trial was not presented as specified.

        This is computed from the servo's longest gap and the frame intervals, since telemetry shows no missing ticks.
        """
        if self._serial is None:
            return False
        gap_s = max(self._servo.worst_gap_s, self._frames.frame_gap_ns(self._until_ns) * 1e-9)
        return gap_s > _FROZEN_S

    @property
    def _until_ns(self) -> int:
        return self._servo.now_ns() if self._tracker.end_ns is None else self._tracker.end_ns

    def summary(self) -> dict[str, Any]:
        """Return the columns of the trial's row so far (see ``store.files.columns``)."""
        dropped = 0 if self._serial is None else self._reader.dropped - self._dropped_before
        columns = {
            **_sample_columns(self._samples, self._servo.rate_hz, dropped, self._servo.worst_gap_s),
            **self._frames.columns(self._until_ns),
        }
        columns = {name: round(value, 6) if isinstance(value, float) else value for name, value in columns.items()}
        force_error = None  # stays None if the participant set the force, or the study delays it
        if self._serial is not None and not self.command.adjusts and not self._scene.link.acts:
            from study_app.haptics.runtime.offline import law_along  # noqa: PLC0415 - the compiler: the servo loaded it

            law_n = partial(law_along, self._scene)
            force_error = delivered_error(self.samples, self._servo.rate_hz, self._scene.fade_s, law_n)
        return self._tracker.summary() | columns | {"delivered_error": force_error}


def resting_view(servo: ServoPort, task: AnyTask, now_ns: int) -> TankView:
    """Return the view in a rest at ``now_ns`` (servo's clock): the ball, and the target at its start."""
    position_m, shown_ns = servo.telemetry.position_at(now_ns - round(SETTLED_S * 1e9))
    lit = None if task.start_m is None else 0
    return TankView(
        position_m, TaskView(lit=lit, reached=0, of=None, dwell=0.0, elapsed_s=0.0, target_m=task.start_m), shown_ns
    )


def is_ball_at_start(view: TankView, task: AnyTask) -> bool:
    """Return whether the ball is at the start of the task's next interval; True for tasks without a fixed start."""
    if task.start_m is None:
        return True
    return math.dist(view.position_m.tolist(), task.start_m) <= task.radius_m
