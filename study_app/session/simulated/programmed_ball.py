"""A ball that moves through a task along a programmed path, without a device: what the tank shows meanwhile."""

from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.protocol.orders.schedule import stream
from study_app.protocol.trials.tasks import AnyTask, Explore, Follow, Reach
from study_app.session.simulated.exploration import RATE_HZ, exploration
from study_app.session.tasks import track
from study_app.session.trial import TankView

Floats: TypeAlias = NDArray[np.float64]

LONGEST_S: Final = 60.0
"""The path begins anew after so long, or shortly before the task would end by time."""
BEFORE_END_S: Final = 0.1
MOVE_S: Final = 0.8
STAY_S: Final = 0.2
"""From one target to the next, and how long the ball stays there beyond the dwell time."""
_SAMPLE = np.dtype([("time_ns", np.int64), ("position_m", np.float64, 3)])


class ProgrammedBall:
    """A ball on a path of ``duration_s`` [s], which repeats.

    Parameters
    ----------
    task : AnyTask
        The task that it moves through.
    workspace_m : tuple of float
        Full sizes of the tank along x, y, z [m].
    hidden_after_lead : bool
        Whether the ball is not drawn once the lead of the task is over.
    seed : int
        What the path of an exploration is drawn from.
    """

    def __init__(
        self, task: AnyTask, workspace_m: tuple[float, float, float], *, hidden_after_lead: bool = False, seed: int = 1
    ) -> None:
        self._task, self._hides = task, hidden_after_lead
        times_s, self._positions_m = _path(task, workspace_m, min(LONGEST_S, task.limit_s - BEFORE_END_S), seed)
        self.duration_s = float(times_s[-1])
        self._times_ns = np.round(times_s * 1e9).astype(np.int64)
        samples = np.zeros(len(times_s), _SAMPLE)
        samples["time_ns"], samples["position_m"] = self._times_ns, self._positions_m
        self._tracker = track(task)
        self._tracker.feed(samples)

    def view(self, elapsed_s: float) -> TankView:
        """Return what the tank shows ``elapsed_s`` after the ball began to move [s]."""
        now_ns = round(elapsed_s % self.duration_s * 1e9)
        position_m = np.array([np.interp(now_ns, self._times_ns, axis) for axis in self._positions_m.T])
        shown = self._tracker.at(now_ns)
        return TankView(position_m, shown, now_ns, self._hides and shown.elapsed_s >= self._task.lead_s)


def _path(
    task: AnyTask, workspace_m: tuple[float, float, float], duration_s: float, seed: int
) -> tuple[Floats, Floats]:
    """Return times (n,) [s] and positions (n, 3) [m, hand frame] of a path of about ``duration_s``."""
    if isinstance(task, Explore):
        x, y, z = (size / 2 for size in workspace_m)
        times_s, positions_m = exploration(stream(seed, "preview/hand").random, (x, y, z), duration_s)
        kept = times_s <= duration_s
        return times_s[kept], positions_m[kept]
    if isinstance(task, Follow):
        times_s = np.arange(0.0, duration_s, 1 / RATE_HZ)
        return times_s, np.array([task.target_m(float(time_s)) for time_s in times_s])
    return _reaches(task, duration_s)


def _reaches(task: Reach, duration_s: float) -> tuple[Floats, Floats]:
    """Return minimum-jerk movements from target to target (Flash & Hogan 1985), with a stay in each."""
    each_s = MOVE_S + task.dwell_s + STAY_S
    count = max(1, min(int(duration_s / each_s), task.count or int(duration_s / each_s)))
    ends_m = np.array([(0.0, 0.0, 0.0), *(task.targets_m[at % len(task.targets_m)] for at in range(count))])
    times_s = np.arange(0.0, min(count * each_s, duration_s), 1 / RATE_HZ)
    at = np.minimum((times_s / each_s).astype(int), count - 1)
    share = np.clip((times_s - at * each_s) / MOVE_S, 0.0, 1.0)
    way = share**3 * (10 - 15 * share + 6 * share**2)
    return times_s, ends_m[at] + way[:, None] * (ends_m[at + 1] - ends_m[at])
