"""One run: all loops in short ticks, round about, so that what else the machine does strikes all alike."""

import threading
import time
from collections.abc import Callable
from typing import Final

from study_app.errors import StudyError
from study_app.evidence.computer import machine
from study_app.evidence.timing.lateness import Timed, lane
from study_app.evidence.timing.loops import PERIOD_NS, BareLoop, Loop, QtLoop, ServoLoop, Taken, ThreadLoop, granted
from study_app.evidence.timing.machine_load import LoadName, Windows, under_load
from study_app.haptics.runtime.clocks.clock import SystemClock

TICK_S: Final = 0.25
LEAST_S: Final = 0.5
MOST_S: Final = 3600.0


def timing(
    seconds: float,
    load: LoadName,
    windows: Windows | None,
    *,
    spin_us: float | None = None,
    ending: threading.Event | None = None,
    progress: Callable[[str], object] = lambda _line: None,
) -> Timed:
    """Time all loops for ``seconds`` each and return what was found.

    Parameters
    ----------
    load : what else is to go on; "gui" and "gui+cpu" need ``windows``
    windows : the windows' thread; None: no Qt here, so no timer of its either
    spin_us : how long before a deadline servo and bare loop look at the clock; default: the system's own
    ending : is set by whoever wants no more; what is under way is finished

    Raises
    ------
    StudyError
        Seconds or spin out of range.
    ServoFault
        The servo stopped itself.
    """
    if not LEAST_S <= seconds <= MOST_S:
        raise StudyError(f"each loop is timed for {LEAST_S:g} to {MOST_S:g} s, not {seconds:g}")
    run = _Run(seconds, load, windows, spin_us, ending or threading.Event(), progress)
    return under_load(load, windows, run.race)


class _Run:
    """The loops, and their ticks so far."""

    def __init__(
        self,
        seconds: float,
        load: LoadName,
        windows: Windows | None,
        spin_us: float | None,
        ending: threading.Event,
        progress: Callable[[str], object],
    ) -> None:
        self._seconds, self._load, self._windows, self._ending, self._progress = (
            seconds,
            load,
            windows,
            ending,
            progress,
        )
        classes = granted()
        ordinary, best = classes.normal, classes.best
        self._servos = [ServoLoop(ordinary, real_time=False, spin_us=spin_us)]
        self._loops: list[Loop] = [
            *self._servos,
            BareLoop(ordinary, real_time=False, clock=SystemClock(spin_us)),
            ThreadLoop(ordinary, real_time=False),
        ]
        if windows is not None:
            self._loops.append(QtLoop(ordinary, windows.timer))
        self._notes = [f"priority: {best or ordinary}"]
        if best is not None:
            self._servos.append(ServoLoop(best, real_time=True, spin_us=spin_us))
            self._loops += [
                self._servos[-1],
                BareLoop(best, real_time=True, clock=SystemClock(spin_us)),
                ThreadLoop(best, real_time=True),
            ]
        else:
            self._notes += ordinary.advice
        if windows is None:
            self._notes.append("Qt is not available: its timer was not measured")

    def race(self) -> Timed:
        """Let the loops take their ticks."""
        rounds = max(1, round(self._seconds / TICK_S))
        ticks = round(self._seconds / rounds * 1e9) // PERIOD_NS
        parts: list[list[Taken]] = [[] for _ in self._loops]
        frames, began_s = self._frames(), time.monotonic()
        for number in range(rounds):
            for loop, mine in zip(self._loops, parts, strict=True):
                if self._ending.is_set():
                    raise KeyboardInterrupt
                mine.append(loop.run(ticks))
            if number * 10 // rounds < (number + 1) * 10 // rounds:
                self._progress(f"{100 * (number + 1) // rounds:3} %")
        lasted_s = time.monotonic() - began_s
        clocks = [servo.clock for servo in self._servos]
        ticked_ns = len(self._servos) * rounds * ticks * PERIOD_NS
        return Timed(
            machine=machine(),
            load=self._load,
            seconds=rounds * ticks * PERIOD_NS * 1e-9,
            spin_us=clocks[0].spin_us,
            spun_share=sum(clock.spun_ns for clock in clocks) / ticked_ns,
            frames_hz=(self._frames() - frames) / lasted_s if self._load != "none" else None,
            lanes=tuple(lane(loop.kind, loop.grant, mine) for loop, mine in zip(self._loops, parts, strict=True)),
            notes=tuple(self._notes),
        )

    def _frames(self) -> int:
        return self._windows.frames if self._windows is not None else 0
