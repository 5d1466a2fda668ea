"""The trial under way: prepared, then begun with the first painted frame of its tank, followed, and summed up.

Until that frame there is no force, the task's clock stands at zero and nothing is recorded, however long a window takes
to show the tank. Without a window, whoever runs the session reports the first frame at once.
"""

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from study_app.haptics.model.layout import LIMITER_GLITCH
from study_app.haptics.model.scene import Scene
from study_app.protocol.trials.tasks import AnyTask, Follow
from study_app.session.ports import ServoPort
from study_app.session.tasks import Outcome, TargetReached, TaskView, track
from study_app.session.transitions.commands import StartTrial
from study_app.session.trial_recording import Recording
from study_app.session.trial_statistics import TrialStatistics
from study_app.store.delivered import JUDGED, delivered_error, judged
from study_app.video.frames import VideoFrame, VideoSource

# Everything is drawn this much later than the trial asks. Then the moment to draw lies between two samples at every
# delay, none included, and is met exactly; else the newest sample, up to a tick old, would stand in where there is no
# delay, and the error of the delay would tell such trials from all others. Two ticks at 1 kHz.
SETTLED_S = 0.002

LEAST_SET_S = 1.0
"""A setting takes at least so long after the task's lead: less could not be judged. [choice]"""
FROZEN_S = 1.0
"""A tick or a frame that does not come for longer ends the attempt: no limit of a study permits more. [choice]"""


@dataclass(frozen=True, slots=True)
class TankView:
    """What is drawn in the tank: the proxy's place [m, hand frame] (3,), the task, and the time all this is of [ns].

    ``ball_hidden`` is whether the proxy is not drawn; ``video`` is the frame of a video behind it, None without one.
    """

    position_m: NDArray[np.float64]
    task: TaskView
    sample_time_ns: int
    ball_hidden: bool = False
    video: VideoFrame | None = None


class RunningTrial:
    """One attempt of a trial, from its preparation to its end.

    Parameters
    ----------
    command : StartTrial
        What is presented, and how late it is drawn.
    scene : Scene
        What is felt.
    late_s : float
        A frame counts as late if its delay is more than this over the one asked for [s].
    servo : ServoPort
        Presents the scene.
    reader : telemetry.Reader
        The telemetry's, from which the samples given to `follow` come; it counts those that were lost.
    recording : Recording
        Takes frames and samples from the first frame on.
    paints : bool
        Whether a window paints frames as long as the trial runs.
    hides_ball : bool
        Whether the ball is not drawn once the lead of the task is over.
    video : VideoSource, optional
        The video that is seen.
    videos : bool
        Whether a condition of the study shows a video.
    """

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
        self._taken: list[bytes] = []
        self.command = command
        self._delay_s = self._drawn_delay_s = command.delay_s
        self._scene = scene
        self._servo = servo
        self._reader = reader
        self._recording = recording
        self._serial: int | None = None
        self._dropped_before = 0
        self._tracker = track(command.task)
        self._statistics = TrialStatistics(
            rate_hz=servo.rate_hz, late_s=late_s, due_ns=servo.now_ns(), paints=paints, videos=videos
        )

    @property
    def task(self) -> TaskView:
        """The task on the device's clock: to decide by, never for the participant."""
        return self._tracker.now()

    def view(self, now_ns: int) -> TankView:
        """Return what is to be drawn at ``now_ns`` (servo's clock), as late as asked and ``SETTLED_S`` more."""
        self._drawn_delay_s = self._delay_s
        drawn_ns = now_ns - round((self._delay_s + SETTLED_S) * 1e9)
        position_m, shown_ns = self._servo.telemetry.position_at(drawn_ns)
        task = self._tracker.at(shown_ns)
        hidden = self._hides_ball and task.elapsed_s >= self.command.task.lead_s
        self._drawn_video = None if self._video is None else self._video.frame_at(drawn_ns)
        return TankView(position_m, task, shown_ns, hidden, self._drawn_video)

    def frame(self, painted_ns: int, sample_ns: int) -> None:
        """Take a frame that was painted at one moment and showed another [ns, servo's clock]; the first one begins.

        Raises
        ------
        StudyError
            The servo cannot load the scene.
        """
        if self._serial is None:
            self._serial = self._servo.load(self._scene)
            self._dropped_before = self._reader.dropped
            self._recording.start(self.trial, self.command.attempt, self.command.interval)
            if self._video is not None:
                self._video.begin(painted_ns)
        self._statistics.frame(painted_ns, sample_ns, self._drawn_delay_s, self._drawn_video)
        self._recording.frame(painted_ns, sample_ns, self._drawn_video)

    def follow(self, samples: Any) -> list[TargetReached]:
        """Take the newest samples, in order (array of ``layout.SAMPLE``); return which targets were reached."""
        if self._serial is None or self._tracker.done:
            return []
        mine = samples[samples["scene"] >= self._serial]  # each adjustment adds one
        reached = self._tracker.feed(mine[mine["limiters"] & LIMITER_GLITCH == 0])
        end_ns = self._tracker.end_ns
        mine = mine if end_ns is None else mine[mine["time_ns"] <= end_ns]
        self._statistics.feed(mine)
        self._taken.append(judged(mine).tobytes())
        return reached

    @property
    def adjustable(self) -> bool:
        """Whether the participant can set what is presented now: since the first frame, until the task is over."""
        return self.command.adjusts and self._serial is not None and not self._tracker.done

    def adjust(self, scene: Scene | None, delay_s: float) -> int | None:
        """Present other numbers of the same scene (None: no force depends on what is set), and a delay [s].

        Returns the number of the scene in telemetry from then on; None where it stays what it is.

        Raises
        ------
        StudyError
            The servo cannot go on with these numbers.
        """
        self._delay_s = delay_s
        return None if scene is None else self._servo.adjust(scene)

    def leave(self) -> None:
        """End the task because the participant wants to go on, if it may end so already."""
        if self.command.adjusts:
            self._tracker.finish(self.command.task.lead_s + LEAST_SET_S)
        else:
            self._tracker.leave()

    def outcome(self) -> Outcome | None:
        """Return how the task ended, once that was drawn, as late as it may be in this block; None before."""
        end_ns = self._tracker.end_ns
        linger_ns = round((self.command.linger_s + SETTLED_S) * 1e9)
        if end_ns is None or self._servo.now_ns() - end_ns < linger_ns:
            return None
        by_limit = self.command.adjusts and self._tracker.now().elapsed_s >= self.command.task.limit_s
        return "timeout" if by_limit else self._tracker.outcome

    @property
    def samples(self) -> Any:
        """What is judged of the trial or interval so far (array of ``delivered.JUDGED``)."""
        return np.frombuffer(
            b"".join(self._taken), JUDGED
        )  # records are concatenated field by field, five times slower

    @property
    def frozen(self) -> bool:
        """Whether the program or the machine was suspended for so long that the trial was not presented as specified.

        Telemetry has no record of missing ticks. The servo knows its longest gap, and the frames show the window's.
        """
        if self._serial is None:
            return False
        gap_s = max(self._servo.worst_gap_s, self._statistics.frame_gap_ns(self._until_ns) * 1e-9)
        return gap_s > FROZEN_S

    @property
    def _until_ns(self) -> int:
        """When the task ended, or now [ns, servo's clock]."""
        return self._servo.now_ns() if self._tracker.end_ns is None else self._tracker.end_ns

    def summary(self) -> dict[str, Any]:
        """Return what its row records until now (``store.tables.columns``)."""
        return (
            self._tracker.summary()
            | self._statistics.summary(
                samples_dropped=0 if self._serial is None else self._reader.dropped - self._dropped_before,
                worst_gap_s=self._servo.worst_gap_s,
                until_ns=self._until_ns,
            )
            | {"delivered_error": self._delivered_error()}
        )

    def _delivered_error(self) -> float | None:
        """Return the error of the force sent; None where the participant set it, or the study delays it."""
        if self._serial is None or self.command.adjusts or self._scene.link.acts:
            return None
        from study_app.haptics.runtime.offline import law_along  # noqa: PLC0415 - the compiler: the servo has loaded it

        law_n = partial(law_along, self._scene)
        return delivered_error(self.samples, self._servo.rate_hz, self._scene.fade_s, law_n)


def resting_view(servo: ServoPort, task: AnyTask, now_ns: int) -> TankView:
    """Return what is drawn in a rest at ``now_ns`` (servo's clock): the ball, and the target where it starts."""
    position_m, shown_ns = servo.telemetry.position_at(now_ns - round(SETTLED_S * 1e9))
    lit = None if task.start_m is None else 0
    return TankView(
        position_m, TaskView(lit, reached=0, of=None, dwell=0.0, elapsed_s=0.0, target_m=task.start_m), shown_ns
    )


def ball_is_back(view: TankView, task: AnyTask) -> bool:
    """Return whether the ball is where the next interval of a task begins; tasks without such a place need none."""
    if not isinstance(task, Follow):
        return True
    return math.dist(view.position_m.tolist(), task.start_m) <= task.radius_m
