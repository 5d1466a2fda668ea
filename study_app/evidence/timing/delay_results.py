"""What a participant's picture comes to: how much later than requested it was shown, delay by delay.

The error of a frame is all that lies between the requested moment and what is seen: from the sample that is drawn to
the end of its painting, or to the surface's swap, less the delay. It holds ``session.runner.SETTLED_S``, which is the
same at every delay.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from study_app.evidence.timing.machine_load import LoadName

DELAYS_S: Final = (0.0, 0.05, 0.075, 0.1, 0.125, 0.15, 0.2)
"""The delays of ``protocols/rek2024.toml``."""
VIRTUAL_HZ: Final = (60.0, 144.0)

BESIDE: Final[dict[LoadName, str]] = {
    "none": "tank alone",
    "gui": "with the cockpit",
    "gui+cpu": "with the cockpit and busy cores",
}

MEAN_FRAMES: Final = 0.5
TAIL_FRAMES: Final = 1.0
TAIL_PERCENT: Final = 99.0


@dataclass(frozen=True, slots=True)
class Shown:
    """The frames of one trial: when they were painted or swapped, and of which moment they were [ns] (n,).

    ``screen`` names the screen, ``paced`` says what its frames followed, ``load`` the concurrent load.
    """

    screen: str
    paced: str
    load: LoadName
    refresh_hz: float
    delay_s: float
    painted_ns: NDArray[np.int64]
    sample_ns: NDArray[np.int64]

    @property
    def frames(self) -> int:
        """How many frames were shown."""
        return len(self.painted_ns)

    @property
    def errors_ms(self) -> NDArray[np.float64]:
        """Achieved less requested delay of each frame [ms] (n,)."""
        ages_ms = np.asarray(self.painted_ns - self.sample_ns, np.float64) * 1e-6
        return np.asarray(ages_ms - 1e3 * self.delay_s, np.float64)

    @property
    def frame_ms(self) -> float:
        """How long a refresh of the screen lasts [ms]."""
        return 1e3 / self.refresh_hz

    @property
    def achieved_ms(self) -> float:
        """The mean delay of what was seen [ms]."""
        return 1e3 * self.delay_s + self.mean_ms

    @property
    def mean_ms(self) -> float:
        """The mean error [ms]."""
        return float(self.errors_ms.mean())

    @property
    def worst_ms(self) -> float:
        """The largest error [ms]."""
        return float(self.errors_ms.max())

    def percentile_ms(self, percent: float) -> float:
        """Return a percentile of the errors [ms]."""
        return float(np.percentile(self.errors_ms, percent))

    @property
    def late(self) -> int:
        """How many frames were shown more than a refresh later than requested."""
        return int((self.errors_ms > self.frame_ms).sum())

    @property
    def missed(self) -> int:
        """How many refreshes between the first frame and the last had no frame of their own."""
        gaps = np.rint(np.diff(self.painted_ns) * 1e-6 / self.frame_ms)
        return int(np.maximum(gaps - 1, 0).sum())

    @property
    def held(self) -> bool:
        """Whether the mean error is at most half a refresh, and its 99th percentile at most one."""
        return (
            abs(self.mean_ms) <= MEAN_FRAMES * self.frame_ms
            and self.percentile_ms(TAIL_PERCENT) <= TAIL_FRAMES * self.frame_ms
        )


@dataclass(frozen=True, slots=True)
class Delayed:
    """What one run found, trial by trial; ``size_px`` is that of the participant's window on a virtual screen."""

    machine: str
    seconds: float
    size_px: tuple[int, int]
    shown: tuple[Shown, ...]

    @property
    def screens(self) -> tuple[str, ...]:
        """The screens there are, in their order."""
        return tuple(dict.fromkeys(one.screen for one in self.shown))

    @property
    def loads(self) -> tuple[LoadName, ...]:
        """The concurrent loads, in their order."""
        return tuple(dict.fromkeys(one.load for one in self.shown))

    def on(self, screen: str, load: LoadName) -> tuple[Shown, ...]:
        """Return the trials on a screen under a load, from the shortest delay to the longest."""
        here = (one for one in self.shown if (one.screen, one.load) == (screen, load))
        return tuple(sorted(here, key=lambda one: one.delay_s))

    def limits(self) -> tuple[str, ...]:
        """Return the limits on each screen under each load, and whether they were met."""
        return tuple(self._of(screen, load) for screen in self.screens for load in self.loads)

    def _of(self, screen: str, load: LoadName) -> str:
        trials = self.on(screen, load)
        mean = max(abs(one.mean_ms) / one.frame_ms for one in trials)
        tail = max(one.percentile_ms(TAIL_PERCENT) / one.frame_ms for one in trials)
        means_ms = [one.mean_ms for one in trials]
        return (
            f"{screen}, {BESIDE[load]}: mean error at most {mean:.2f} of a frame (limit: {MEAN_FRAMES:g}), "
            f"99th percentile at most {tail:.2f} (limit: {TAIL_FRAMES:g}), "
            f"means within {max(means_ms) - min(means_ms):.2f} ms of each other: "
            f"{'met' if all(one.held for one in trials) else 'missed'}"
        )
