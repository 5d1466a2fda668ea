"""How far the servo's wakes are from their definition, followed from scene to scene."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from study_app.evidence.soak.exact_wake import Ledger, wake_of
from study_app.haptics.model.scene import Scene


@dataclass(slots=True)
class Drift:
    """How far the wakes of a servo were from their definition at most, in units of Σ|e|/S, looked at now and then.

    ``longest_s`` is the longest time that one of them ran on without being emptied.
    """

    comparisons: int = 0
    worst: float = 0.0
    longest_s: float = 0.0
    _scenes: dict[int, Scene] = field(default_factory=dict)  # not yet seen in samples, by serial
    _serial: int = 0
    _ledger: Ledger | None = None
    _next_tick: int = -1

    def expect(self, serial: int, scene: Scene) -> None:
        """Register the scene that telemetry calls ``serial``."""
        if wake_of(scene) is not None:
            self._scenes[serial] = scene

    def take(self, samples: Any) -> None:
        """Follow ``samples`` (recarray of ``SAMPLE``), those after the last ones.

        A scene of which some are missing is followed no further.
        """
        for part in np.split(samples, np.flatnonzero(np.diff(samples.scene)) + 1):
            if len(part) > 0:
                self._take_part(part)

    def _take_part(self, samples: Any) -> None:
        serial = int(samples.scene[0])
        if serial != self._serial:
            scene = self._scenes.get(serial)
            self._scenes = {later: it for later, it in self._scenes.items() if later > serial}
            self._ledger = Ledger(scene) if scene is not None else None
            self._serial = serial
        elif samples.tick[0] != self._next_tick:
            self._ledger = None
        self._next_tick = int(samples.tick[-1]) + 1
        if self._ledger is None:
            return
        if (np.diff(samples.tick) != 1).any():
            self._ledger = None
            return
        error = self._ledger.take(samples)
        self.longest_s = max(self.longest_s, self._ledger.age_s)
        if error is not None:
            self.comparisons += 1
            self.worst = max(self.worst, error)
