"""Simulations of a closed loop, and their traces: one row per tick, as seen from outside.

`ClosedLoop` runs the servo's tick with a simulated handle, hand and encoder. `trace_driver` runs the servo's whole loop
with a device's own functions.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any, Self

import numpy as np

from study_app.haptics.kernels import vector
from study_app.haptics.kernels.c_functions import Driver
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.kernels.loop import CONTROL, ClockCalls, DeviceCalls, Output, Records, run
from study_app.haptics.kernels.plant import new_handle, new_schedule
from study_app.haptics.kernels.safety import new_safety
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.force_rules import CURRENT, ForceRules
from study_app.haptics.model.layout import SAMPLE, new_command, new_reading, records
from study_app.haptics.model.motion import Floats
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import DampingLimits
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.haptics.runtime.closed_loop import loop
from study_app.haptics.runtime.closed_loop.arm import Arm, new_arm
from study_app.haptics.runtime.pack import Model, pack
from study_app.haptics.runtime.telemetry import Telemetry


def empty_trace(rows: int) -> Any:
    """Return a trace with room for so many ticks: (rows,) recarray of `loop.TRACE`."""
    return records(loop.TRACE, rows)


class ClosedLoop:
    """The servo's tick with a simulated handle, hand and encoder; set hand and encoder in ``loop`` before a run.

    Parameters
    ----------
    scene : Scene
        The scene that the hand feels.
    dynamics : Dynamics
        What the device reports of itself.
    delay_ticks : int
        The delay of a force that the loop assumes at the start.
    handle : mapping
        The arguments of `new_handle`: the handle with its friction, motors, delay and encoder, and the hand.
    arm : Arm, optional
        An arm that moves the handle instead of the hand: the second plant.
    jitter, missed : float
        Greatest lateness of a tick in periods, and the fraction of missed ticks.
    limits : DampingLimits, optional
        Replace those of the table.
    rules : ForceRules
        The version of the force rules.
    """

    def __init__(
        self,
        scene: Scene,
        dynamics: Dynamics,
        *,
        delay_ticks: int,
        handle: Mapping[str, Any],
        arm: Arm | None = None,
        jitter: float = 0.0,
        missed: float = 0.0,
        limits: DampingLimits | None = None,
        rules: ForceRules = CURRENT,
    ) -> None:
        self.safety = new_safety(handle["motor_limit_n"], delay_ticks)
        self.safety[0].fade, self.safety[0].fade_s = 1.0, 0.0
        self.loop = records(loop.LOOP, 1)[0]
        if arm is not None:
            self.loop.arm = new_arm(arm, handle)
        self.handle = new_handle(**handle)
        self.model: Model = pack(scene, limits=limits, dynamics=dynamics, rules=rules)
        self.pace = new_schedule(1.0 / scene.rate_hz, jitter_s=jitter / scene.rate_hz, missed=missed)
        self.sample = records(SAMPLE, 1)

    @property
    def _records(self) -> tuple[Model, Any, Any, Any, Any, Any]:
        return self.model, self.safety[0], self.sample[0], self.handle, self.pace, self.loop

    def copy(self) -> Self:
        """Return an independent copy of this loop in the same state."""
        other = copy.copy(self)
        rows = type(self.model.rows)(*(array.copy() for array in self.model.rows))
        other.model = Model._make([*(array.copy() for array in self.model[:-1]), rows])
        for name in ("safety", "sample", "handle", "pace", "loop"):
            setattr(other, name, getattr(self, name).copy())
        return other

    def begin(self) -> None:
        """Move hand and handle to the start of the motion, with its initial speed."""
        loop.begin(self.loop, self.handle)

    def run(self, trace: Any, first: int, until_s: float) -> int:
        """Run ticks until ``until_s`` [s], writing rows of ``trace`` from ``first``; return the next row."""
        self.loop.until_s = until_s
        return int(loop.run(*self._records, trace, first))

    def follow(self, path_m: Floats, *, rigid: bool = False) -> Any:
        """Return the trace of a hand that follows ``path_m`` (ticks, 3) [m], one row per tick.

        With ``rigid`` the handle follows the path regardless of the force.
        """
        self.loop.rigid = rigid
        trace = empty_trace(len(path_m))
        loop.follow(*self._records, trace, path_m)
        return trace

    def play(self, trace: Any, places_m: Floats) -> None:
        """Run the tick along a given motion (rows, 3) [m] at the times of ``trace``; see `loop.play`."""
        loop.play(*self._records, trace, places_m)

    def places_m(self, t_s: Floats) -> Floats:
        """Return the hand's intended positions (n, 3) [m] at times (n,) [s]."""
        places_m = np.zeros((len(t_s), 3))
        loop.write_places(self.loop, t_s, places_m)
        return places_m


def trace_driver(
    driver: Driver, handle: Any, scene: Scene, dynamics: Dynamics, *, lead_in: int, released: int, rows: int
) -> Any:
    """Return the trace of a driver's device in the servo's own loop, on a virtual clock, after ``lead_in`` ticks.

    ``handle`` is the record of the handle that the driver's device moves; it is let go before row ``released``. A
    trace with less than ``rows`` rows ends where the loop ended itself. Its delay is not known: it is 0.
    """
    clock, control = VirtualClock(), records(CONTROL, 1)
    control[0].period_ns = control[0].deadline_ns = round(1e9 / scene.rate_hz)
    control[0].run, control[0].serial[:] = 1, 1
    telemetry = Telemetry(history=16)
    servo = (
        control,
        tuple(pack(scene, dynamics=dynamics) for _ in range(2)),
        new_safety(driver.force_limit_n, dynamics.delay_ticks(scene.rate_hz)),
        Records(new_reading(), new_command()),
        Output(telemetry.ring, telemetry.written),
        DeviceCalls(context=driver.context, read=driver.read.address, write=driver.write.address),
        ClockCalls(context=clock.context, now=clock.now.address, sleep=clock.sleep.address),
    )
    run(*servo, lead_in)
    trace = empty_trace(rows)
    return trace[: _trace_ticks(servo, handle, trace, released)]


@kernel
def _trace_ticks(servo: Any, handle: Any, trace: Any, released: int) -> int:
    """Run one servo tick per row of ``trace`` and release before row ``released``; return the number of ticks."""
    control, models, safety, exchanged, output, device, clock = servo
    one: Any = np.int64(1)  # a literal would compile the loop a second time
    for k in range(trace.shape[0]):
        if k == released:
            handle.held = 0
        if run(control, models, safety, exchanged, output, device, clock, one) < 1:
            return k
        sample = output.ring[(output.written[0] - 1) % output.ring.shape[0]]
        loop.write_row(models[0], safety[0], sample, handle, trace[k])
        trace[k].t_s = k * 1e-9 * control[0].period_ns
        vector.copy(safety[0].passivity.lift_n, trace[k].lift_n)
    return int(trace.shape[0])
