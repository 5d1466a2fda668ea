"""The trial under way: prepared, then begun with the first painted frame of its tank, followed, and summed up.

Until that frame there is no force, the task's clock stands at zero and nothing is recorded, however long a window takes
to show the tank. Without a window, whoever runs the session reports the first frame at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from study_app.haptics.model.layout import LIMITER_GLITCH
from study_app.haptics.model.scene import Scene
from study_app.session.ports import ServoPort
from study_app.session.tasks import Outcome, TargetReached, TaskView, track
from study_app.session.transitions.commands import StartTrial
from study_app.session.trial_recording import Recording
from study_app.session.trial_statistics import TrialStatistics

# Everything is drawn this much later than the trial asks. Then the moment to draw lies between two samples at every
# delay, none included, and is met exactly; else the newest sample, up to a tick old, would stand in where there is no
# delay, and the error of the delay would tell such trials from all others. Two ticks at 1 kHz.
SETTLED_S = 0.002

FROZEN_S = 1.0
"""A tick or a frame that does not come for longer ends the attempt: no limit of a study permits more. [choice]"""


@dataclass(frozen=True, slots=True)
class TankView:
    """What is drawn in the tank: the proxy's place [m, hand frame] (3,), the task, and the time all this is of [ns]."""

    position_m: NDArray[np.float64]
    task: TaskView
    sample_time_ns: int


class RunningTrial:
    """One attempt of a trial, from its preparation to its end.

    Parameters
    ----------
    command : what is presented, and how late it is drawn
    scene : what is felt
    late_s : a frame counts as late if its delay is more than this over the one asked for
    servo : presents the scene
    reader : the telemetry's reader that the samples given to `follow` come from; it counts those that were lost
    recording : takes frames and samples from the first frame on
    paints : whether a window paints frames as long as the trial runs
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
    ) -> None:
        self.trial = command.trial
        self._command = command
        self._scene = scene
        self._servo = servo
        self._reader = reader
        self._recording = recording
        self._serial: int | None = None
        self._dropped_before = 0
        self._tracker = track(command.task)
        self._statistics = TrialStatistics(
            rate_hz=servo.rate_hz, delay_s=command.delay_s, late_s=late_s, due_ns=servo.now_ns(), paints=paints
        )

    @property
    def task(self) -> TaskView:
        """The task on the device's clock: to decide by, never for the participant."""
        return self._tracker.now()

    def view(self, now_ns: int) -> TankView:
        """Return what is to be drawn at ``now_ns`` (servo's clock), as late as asked and ``SETTLED_S`` more."""
        drawn_ns = now_ns - round((self._command.delay_s + SETTLED_S) * 1e9)
        position_m, shown_ns = self._servo.telemetry.position_at(drawn_ns)
        return TankView(position_m, self._tracker.at(shown_ns), shown_ns)

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
            self._recording.start(self.trial, self._command.attempt)
        self._statistics.frame(painted_ns, sample_ns)
        self._recording.frame(painted_ns, sample_ns)

    def follow(self, samples: Any) -> list[TargetReached]:
        """Take the newest samples, in order (array of ``layout.SAMPLE``); return which targets were reached."""
        if self._serial is None or self._tracker.done:
            return []
        mine = samples[samples["scene"] == self._serial]
        reached = self._tracker.feed(mine[mine["limiters"] & LIMITER_GLITCH == 0])
        end_ns = self._tracker.end_ns
        self._statistics.feed(mine if end_ns is None else mine[mine["time_ns"] <= end_ns])
        return reached

    def leave(self) -> None:
        """End the task because the participant wants to go on, if it may end so already."""
        self._tracker.leave()

    def outcome(self) -> Outcome | None:
        """Return how the task ended, once that was drawn, as late as it may be in this block; None before."""
        end_ns = self._tracker.end_ns
        linger_ns = round((self._command.linger_s + SETTLED_S) * 1e9)
        if end_ns is None or self._servo.now_ns() - end_ns < linger_ns:
            return None
        return self._tracker.outcome

    @property
    def frozen(self) -> bool:
        """Whether the program or the machine stood still for so long that nobody felt or saw the trial as it is.

        Telemetry cannot tell: it knows no tick that did not come. The servo does, and the frames say it of the window.
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
        return self._tracker.summary() | self._statistics.summary(
            samples_dropped=0 if self._serial is None else self._reader.dropped - self._dropped_before,
            worst_gap_s=self._servo.worst_gap_s,
            until_ns=self._until_ns,
        )
