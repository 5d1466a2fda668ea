"""The lab's estimation: source of the force, estimated parameters, and their application to the selected setting.

Applies an estimate to the selected scene, at once or continuously, within the slope and force limits.

With the constant law of drag, F = c w², the damping F/w grows up to √(F_max c) at the force limit F_max. The drag
coefficient is applied up to the value at which this equals the slope limit of the loop: so no estimate causes the slope
limit to act. The force limit always acts. In continuous application a value changes by at most `MOST_PER_S`. The length
of the wake is only applied at once, because another length clears the wake.
"""

from __future__ import annotations

import math
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from study_app.errors import StudyError
from study_app.haptics.model.device_dynamics import MOST_DELAY, Dynamics
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import LIGHTER, MEASURED_KG, slope_limit
from study_app.lab.ab_comparison import Workbench, other
from study_app.lab.estimation.estimator import NOTHING, Estimate, OnlineEstimator
from study_app.lab.estimation.fits import DRAG, LENGTH, NAMES, PLACES, SCALING, values_of
from study_app.lab.estimation.sources import (
    DeviceForce,
    GrowingCsv,
    LslForce,
    OtherLiquidForce,
    Rows,
    as_measured,
    no_rows,
)
from study_app.lab.parameters import changed

if TYPE_CHECKING:
    from study_app.haptics.runtime.telemetry import Reader
    from study_app.lab.live import Live


MOST_PER_S: Final = 0.5
"""Greatest rate of change of the logarithm of a value."""
UNCHANGED: Final = 2e-3
"""A value whose relative difference from the estimate is less than this stays."""


def most_drag_coefficient(scene: Scene, dynamics: Dynamics, device_limit_n: float) -> float:
    """Return the greatest drag coefficient that may be applied to a scene with one liquid: at least its present one."""
    delay = min(dynamics.delay_ticks(scene.rate_hz), MOST_DELAY)
    lighter = min(dynamics.mass_kg / MEASURED_KG, 1.0) ** LIGHTER
    slope_nspm: float = lighter * slope_limit(1 / scene.rate_hz, delay, scene.velocity) / scene.scale
    limit_n = min(device_limit_n, scene.force_limit_n)
    by_one_kg_m: float = 0.5 * scene.liquids[0].density_kg_m3 * math.pi / 4 * scene.body.diameter_m**2
    return float(max(slope_nspm**2 / (limit_n * by_one_kg_m), scene.body.drag_coefficient))


def applicable(scene: Scene, estimate: Estimate, dynamics: Dynamics, device_limit_n: float) -> dict[str, float]:
    """Return the values of an estimate within the limits, by name; none if the motion identifies none."""
    if not estimate.identified:
        return {}
    values = dict(estimate.values)
    values[DRAG] = min(values[DRAG], most_drag_coefficient(scene, dynamics, device_limit_n))
    if SCALING in values:
        length = values.get(LENGTH, values_of(scene).get(LENGTH, 1.0))
        values[SCALING] = max(values[SCALING], length)
    return values


def stepped(
    scene: Scene, estimate: Estimate, dynamics: Dynamics, device_limit_n: float, elapsed_s: float
) -> dict[str, float]:
    """Return the values that continuous application sets next, by name; none without a change."""
    now, most = values_of(scene), MOST_PER_S * elapsed_s
    found = {}
    for name, target in applicable(scene, estimate, dynamics, device_limit_n).items():
        if name == LENGTH or now.get(name, 0.0) <= 0:
            continue
        wanted = max(target, now[LENGTH]) if name == SCALING else target  # the length is not changed
        way = math.log(wanted / now[name])
        if abs(way) > UNCHANGED:
            found[name] = wanted if abs(way) <= most else now[name] * math.exp(math.copysign(most, way))
    return found


Source: TypeAlias = Literal["off", "other", "device", "file", "lsl"]

OF_TELEMETRY: Final = ("other", "device")
NO_LIVE: Final = "no device is open"


@dataclass(frozen=True, slots=True)
class Chosen:
    """Source of the force (``path`` for a file), and the parameters to estimate."""

    source: Source = "off"
    names: tuple[str, ...] = (DRAG,)
    path: Path | None = None


class LiveEstimation:
    """An estimation that runs with the lab's servo; its owner calls `poll` with each frame.

    ``executor`` searches for the wake, and connects to streams; by default `poll` does so itself.
    """

    def __init__(self, executor: Executor | None = None) -> None:
        self._executor = executor
        self.chosen = Chosen()
        self.follows = False
        self.trouble = ""
        self._live: Live | None = None
        self._basis: tuple[Scene, Scene | None] | None = None
        self._estimator: OnlineEstimator | None = None
        self._file: GrowingCsv | None = None
        self._lsl: LslForce | None = None
        self._device_force = DeviceForce()
        self._sensor: OtherLiquidForce | None = None
        self._last_ns: int | None = None
        self._reader: Reader | None = None

    def choose(self, chosen: Chosen) -> None:
        """Start to estimate from another source, or other parameters.

        Raises
        ------
        StudyError
            The source cannot be opened; then none is.
        """
        self.close()
        if chosen.source == "file" and chosen.path is not None:
            self._file = GrowingCsv(chosen.path)
        elif chosen.source == "lsl":
            self._lsl = LslForce(executor=self._executor)
        self.chosen = chosen

    def close(self) -> None:
        if self._lsl is not None:
            self._lsl.close()
        self._file = self._lsl = self._basis = self._estimator = None
        self.chosen, self.follows, self.trouble = replace(self.chosen, source="off"), False, ""

    @property
    def estimate(self) -> Estimate:
        return NOTHING if self._estimator is None else self._estimator.estimate

    @property
    def applies(self) -> bool:
        return self.chosen.source not in {"off", "device"}

    def poll(self, live: Live | None, bench: Workbench) -> dict[str, float]:
        """Process new measurements; return the values that continuous application sets now, by the lab's names."""
        if self.chosen.source == "off":
            return {}
        if bench.blind:
            self._basis = self._estimator = None  # restarts afterwards: no data meanwhile
            self.follows = False
            return {}
        try:
            self._begin(live, bench)
            rows = self._rows(bench)
            if self._estimator is not None:
                if self._device_force.began:
                    self._estimator.restart()
                self._estimator.take(rows)
        except StudyError as error:
            self.close()
            self.trouble = str(error)
            return {}
        return self._following(bench)

    def applied(self, bench: Workbench) -> Workbench:
        """Return a workbench whose selected setting has the estimated values within their limits."""
        if self._live is None or not self.applies:
            return bench
        scene, live = bench.in_hand.scene, self._live
        values = applicable(scene, self.estimate, live.device.dynamics, live.device.force_limit_n)
        return set_values(bench, values)

    def _begin(self, live: Live | None, bench: Workbench) -> None:
        """Restart if the device or parameters that are not estimated changed."""
        scene = bench.in_hand.scene
        reference = bench.setting(other(bench.presented)).scene if self.chosen.source == "other" else None
        basis = (_without(scene, self.chosen.names), reference)
        if basis == self._basis and live is self._live:
            return
        if live is None and self.chosen.source in OF_TELEMETRY:
            raise StudyError(NO_LIVE)
        self._basis, self._live = basis, live
        self._last_ns = None
        of_telemetry = self.chosen.source in OF_TELEMETRY
        self._estimator = OnlineEstimator(
            as_measured(scene) if of_telemetry else scene, self.chosen.names, executor=self._executor
        )
        self._device_force = DeviceForce()
        self._sensor = None if reference is None else OtherLiquidForce(reference)
        self._reader = None if live is None else live.servo.telemetry.reader()

    def _rows(self, bench: Workbench) -> Rows:
        if self._file is not None:
            return self._file.poll()
        if self._lsl is not None:
            return self._lsl.poll()
        if self._reader is None:
            return no_rows()
        samples = self._reader.read()
        if self._sensor is not None:
            return self._sensor.take(samples)
        return self._device_force.take(samples, bench.in_hand.scene)

    def _following(self, bench: Workbench) -> dict[str, float]:
        """Return the values that continuous application sets now."""
        if not self.follows or self._live is None or not self.applies:
            return {}
        now_ns = self._live.servo.now_ns()
        before_ns, self._last_ns = self._last_ns, now_ns
        if before_ns is None:
            return {}
        live, elapsed_s = self._live, min((now_ns - before_ns) * 1e-9, 0.1)
        return stepped(bench.in_hand.scene, self.estimate, live.device.dynamics, live.device.force_limit_n, elapsed_s)


def set_values(bench: Workbench, values: dict[str, float], *, held: bool = False) -> Workbench:
    """Return a workbench whose selected setting has these values, by the names of the estimation.

    With held, successive changes are one undo step.

    Raises
    ------
    StudyError
        The setting cannot have them.
    """
    order = NAMES[::-1] if values.get(SCALING, 0.0) > values_of(bench.in_hand.scene).get(SCALING, 0.0) else NAMES
    scene = bench.in_hand.scene
    for name in order:  # the scaling first if it grows: it is never below the length
        if name in values:
            scene = changed(scene, PLACES[name], values[name])
    return bench.put(scene, key="estimate" if held else None)


def _without(scene: Scene, names: tuple[str, ...]) -> Scene:
    """Return the scene with fixed values of the estimated parameters."""
    body = scene.body.model_copy(update={"drag_coefficient": 1.0})
    scene = scene.model_copy(update={"body": body})
    wake = scene.liquids[0].wake
    if wake is None or names == (DRAG,):
        return scene
    fixed = {"length": 1, "scaling": 1.0} if set(names) == set(NAMES) else {}
    liquid = scene.liquids[0].model_copy(update={"wake": wake.model_copy(update=fixed)})
    return scene.model_copy(update={"liquids": (liquid,)})
