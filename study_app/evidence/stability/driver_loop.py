"""Cases through the driver of a Falcon and its emulator, compared with the scripted device in the same hand.

The servo's own compiled loop runs with the driver's C functions. Grip and hand are the emulator's, with mass and
friction of the case. Samples, encoders and delay are those of the Falcon. The criteria are those of `verdict`, with
these changes:

- *energy*: a case is also unstable if the net energy that the motors give to a released grip, until it reaches an end
  stop, exceeds that of a scripted device with the same delay by 2 mJ. A light handle swings until the passivity
  controller damps it, so this energy depends on micrometres and milliseconds (9 to 19 mJ in honey). A release that
  exceeds the worst of three encoder counts is therefore repeated up to 10 ticks earlier and later: it is unstable if it
  exceeds all of these releases of the scripted device, or if the mean over the driver's releases exceeds the scripted
  mean by 2 mJ;
- *sustained force*, *noise*: compared with the scripted device, and with the grip's motion without feedback with each
  encoder count undecided. A grip without friction can rest between two counts, where the scripted one may not.
"""

import dataclasses
import threading
from typing import Any, Final

import numpy as np

from study_app.devices.emulators.falcon import EmulatedFalcon
from study_app.devices.emulators.falcon_emulator import Emulator
from study_app.devices.simulated import ScriptedDevice
from study_app.evidence.stability.bench import FORCE_LIMIT_N, Bench, given_out_j, lasts_s, lowest_balance
from study_app.evidence.stability.stability_cases import GRIPS, LETS_GO, Case, scene_of
from study_app.evidence.stability.verdict import (
    ALLOWANCE_J,
    SWING_MPS,
    Verdict,
    acted,
    compare_fast,
    low_pass_trace,
    not_finite,
    reasons_of,
    swing,
    windows,
    with_count_error,
    worst_of,
)
from study_app.haptics.kernels import Driver
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.runtime.closed_loop import trace_driver

_DELAY: Final = 1
"""Delay of a Falcon's force [ticks]."""
_BEYOND_SCRIPTED_J: Final = 2e-3
_NEIGHBOURS: Final = 10
"""Ticks before and after a release at which it is repeated."""
_COUNTS_M: Final = (38e-6, 48e-6, 57e-6)
"""Encoder counts of a Falcon at the grip, over its workspace [m]."""
_STOP_M: Final = (0.055, 0.055, 0.05)
_AT_STOP: Final = 0.999
_MOTOR_STEP_N: Final = 0.1
"""Force by which the quantisation of three motors may exceed the limit [N]."""

_APPROACH_S = 0.3  # time in which the hand moves to the start of the motion [s]
_LEAD_IN_S = 0.6  # time until the motion begins, in which the force fades in [s]
_ROW_S = 0.5e-3

_thread_state = threading.local()


class _Falcon(EmulatedFalcon):
    """An emulated Falcon in the hand of a case; it is reset for each case."""

    def __init__(self) -> None:
        super().__init__(emulator=Emulator(running=True, tremor_m=0.0))

    def open(self) -> None:
        super().open()
        self._opened = self.memory.copy(), self.hand.memory.copy()

    def renew(self) -> None:
        """Reset the device to its state after opening."""
        self.memory[:], self.hand.memory[:] = self._opened


class _Scripted(ScriptedDevice):
    """The scripted device with the delay of a Falcon."""

    def __init__(self, count_m: float) -> None:
        super().__init__(tremor_m=0.0, quantum_m=count_m)
        self.state.handle.delay = _DELAY


def judge_driven(case: Case) -> Verdict:
    """Run a case through the Falcon driver and return the verdict on its stability."""
    falcon = _opened_falcon()
    dynamics = falcon.dynamics
    trace = _driven_trace(case, falcon)
    if not (np.isfinite(trace.sent_n).all() and np.isfinite(trace.position_m).all()):
        return not_finite(case, trace, safe=True)
    scripted = _scripted_traces(case, dynamics)
    balance_j, strongest_n, longest_m = lowest_balance(trace)
    permitted_j = -ALLOWANCE_J - (1 + _DELAY) * strongest_n * longest_m
    lacks_energy = balance_j < permitted_j
    if case.hand == LETS_GO:
        balance_j = -_energy_given_out_j(case, trace)
        permitted_j = -_BEYOND_SCRIPTED_J - max(_energy_given_out_j(case, other) for other in scripted)
        if balance_j < permitted_j:
            given_j, scripted_j = _neighbouring_energies(case, falcon)
            permitted_j = -_BEYOND_SCRIPTED_J - max(scripted_j)
            if balance_j >= permitted_j:
                balance_j, permitted_j = -float(np.mean(given_j)), -_BEYOND_SCRIPTED_J - float(np.mean(scripted_j))
    swing_mps = swing(trace, case)
    controls = [*scripted, *_traces_with_count_error(case, trace, dynamics)]
    fast_force = worst_of(
        [
            compare_fast(trace.sent_n[:ends], [control.sent_n[:ends] for control in controls], case.rate_hz, begins)
            for begins, ends in (np.searchsorted(trace.t_s, window_s) for window_s in windows(case))
        ]
    )
    reasons = reasons_of(
        limit=np.linalg.norm(trace.sent_n, axis=1).max() > FORCE_LIMIT_N + _MOTOR_STEP_N,
        energy=lacks_energy or balance_j < permitted_j,
        oscillation=swing_mps > SWING_MPS,
        fast_force=fast_force,
    )
    return Verdict(
        case=case,
        safe=True,
        reasons=reasons,
        balance_j=balance_j,
        permitted_j=permitted_j,
        swing_mps=swing_mps,
        fast_n=fast_force.fast_n,
        played_n=fast_force.control_n,
        acted=acted(trace),
    )


def _driven_trace(case: Case, falcon: _Falcon) -> Any:
    """Return the trace of a case that uses the driver."""
    falcon.renew()
    trace = _trace_on_device(case, falcon, falcon.hand, falcon.dynamics)
    trace.acting_n[:-1] = trace.acting_n[1:]  # the handle records each force one row late
    return trace


def _neighbouring_energies(case: Case, falcon: _Falcon) -> tuple[list[float], list[float]]:
    """Return the energies [J] that the driver and the scripted devices give out in releases at neighbouring ticks."""
    driven_j, scripted_j = [], []
    released = round(case.release_s * case.rate_hz)
    for tick in range(released - _NEIGHBOURS, released + _NEIGHBOURS + 1):
        neighbour = dataclasses.replace(case, release_s=tick / case.rate_hz)
        driven_j.append(_energy_given_out_j(neighbour, _driven_trace(neighbour, falcon)))
        scripted_j += [_energy_given_out_j(neighbour, other) for other in _scripted_traces(neighbour, falcon.dynamics)]
    return driven_j, scripted_j


def _scripted_traces(case: Case, dynamics: Dynamics) -> list[Any]:
    """Return the traces of a case on scripted devices, one per encoder count."""
    devices = [_Scripted(count_m) for count_m in _COUNTS_M]
    return [_trace_on_device(case, device, device, dynamics) for device in devices]


def _traces_with_count_error(case: Case, trace: Any, dynamics: Dynamics) -> list[Any]:
    """Return the traces of the same motion without feedback, one per encoder count, with that count undecided."""
    smooth, traces = low_pass_trace(trace), []
    smooth.fresh[:] = smooth.measured[:] = 1
    for count_m in _COUNTS_M:
        count_um = count_m * 1e6
        replayed, bench = smooth.copy(), Bench(dataclasses.replace(case, quantum_um=count_um), dynamics=dynamics)
        bench.begin()
        bench.play(replayed, with_count_error(smooth.position_m, count_um))
        traces.append(replayed)
    return traces


def _opened_falcon() -> _Falcon:
    """Return this thread's open emulated Falcon."""
    if not hasattr(_thread_state, "falcon"):
        _thread_state.falcon = _Falcon()
        _thread_state.falcon.open()
    falcon: _Falcon = _thread_state.falcon
    return falcon


def _trace_on_device(case: Case, device: Driver, hand: Any, dynamics: Dynamics) -> Any:
    """Return the trace of a case, from the start of its motion, on a device and its hand."""
    handle, grip = hand.state.handle, GRIPS[case.hand]
    handle.mass_kg, handle.viscous_nspm, handle.coulomb_n = case.mass_kg, case.viscous_nspm, case.coulomb_n
    handle.hand_kg, handle.stiffness_npm, handle.damping_nspm = grip.mass_kg, grip.stiffness_npm, grip.damping_nspm
    handle.stop_m = _STOP_M
    hand.follow(*_hand_motion(case))
    lead_in, rows = round(_LEAD_IN_S * case.rate_hz), round(lasts_s(case) * case.rate_hz)
    released = round(case.release_s * case.rate_hz) if case.hand == LETS_GO else rows
    trace = trace_driver(device, handle, scene_of(case), dynamics, lead_in=lead_in, released=released, rows=rows)
    trace.delay = _DELAY
    return trace


def _hand_motion(case: Case) -> tuple[Any, Any]:
    """Return times (n,) [s] and positions (n, 3) [m] of the hand: to the start, a rest there, and the case's motion."""
    t_s = np.arange(0.0, _LEAD_IN_S + lasts_s(case), _ROW_S)
    places_m = Bench(case).places_m(np.maximum(t_s - _LEAD_IN_S, 0.0))
    return t_s, places_m * np.minimum(t_s / _APPROACH_S, 1.0)[:, np.newaxis]


def _energy_given_out_j(case: Case, trace: Any) -> float:
    """Return the most energy given to the handle from its release until it met an end stop [J]."""
    first = int(np.searchsorted(trace.t_s, case.release_s - 1e-9))
    at_stop = (np.abs(trace.position_m[first:]) >= _AT_STOP * np.array(_STOP_M)).any(axis=1)
    last = first + int(np.argmax(at_stop)) if at_stop.any() else len(trace)
    return float(given_out_j(trace[first:last]))
