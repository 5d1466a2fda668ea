"""The servo's interface to the program: start and stop, scenes, faults and telemetry."""

import threading
import weakref
from types import TracebackType
from typing import Any, Self

from study_app.errors import DeviceLost, ServoFault, StudyError
from study_app.haptics.kernels.c_functions import Driver
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.force_rules import FORCE_RULES
from study_app.haptics.model.layout import STATUS_DEVICE_LOST, STATUS_NON_FINITE, STATUS_OK, STATUS_STALE_FAULT
from study_app.haptics.model.scene import Scene
from study_app.haptics.runtime.clocks.clock import Clock, SystemClock
from study_app.haptics.runtime.grants import Grant
from study_app.haptics.runtime.pack import elements_needed, is_built_alike, takes_device_velocity
from study_app.haptics.runtime.telemetry import Telemetry
from study_app.haptics.runtime.thread import LoopThread

_ELEMENTS = 10_000

_FAULTS = {
    STATUS_DEVICE_LOST: (
        "stopped responding or lost its guard process; turn it off if it is still pushing, and reconnect it"
    ),
    STATUS_STALE_FAULT: "sent no usable data for 50 ms; check its cable",
    STATUS_NON_FINITE: "would have received a non-finite force (NaN or infinite); check the scene's parameters",
}


_STUCK = (
    "or the computer stalled the servo loop, which has not run for 75 ms; turn the device off if it is still pushing"
)


class Servo:
    """One device's servo: start it, load scenes, read its telemetry, and stop it.

    As a context manager it starts on entry, on a clock that runs by itself, and stops on exit. On a ``VirtualClock`` it
    runs only within `advance`, in the calling thread, by the same compiled loop.

    Parameters
    ----------
    device : Driver
        An opened device; it must stay open until the servo has stopped.
    clock : Clock, optional
        ``SystemClock`` (default) or ``VirtualClock``.
    rate_hz : float
        Ticks per second; every scene must be made for this rate.
    elements : int
        The greatest number of wake elements of a scene (``pack.elements_needed``).
    real_time : bool
        False: the thread keeps the ordinary priority.
    """

    def __init__(
        self,
        device: Driver,
        *,
        clock: Clock | None = None,
        rate_hz: float = 1000.0,
        elements: int = _ELEMENTS,
        real_time: bool = True,
    ) -> None:
        self.rate_hz = rate_hz
        self.elements = elements
        self.telemetry = Telemetry()
        self._device = device
        self._scene = Scene(rate_hz=rate_hz)
        self.serial = 0
        self._rests = True
        self._loading = threading.Lock()
        self.loop = LoopThread(
            device, clock or SystemClock(), self._scene, elements, self.telemetry, real_time=real_time
        )
        self._ending = weakref.finalize(self, self.loop.end)

    def prepare(self) -> None:
        """Compile all functions that run later, or load them from the cache; takes seconds after a change."""
        self.loop.compile()
        self.telemetry.position_at(0)
        self.telemetry.reader().read()

    def start(self) -> None:
        """Start in a separate thread, at rest unless a scene is loaded; the force fades in."""
        if not self.loop.clock.runs:
            raise StudyError("a servo on a virtual clock does not run by itself: call advance(ticks)")
        if self.loop.live:
            raise StudyError("this servo has already been started: stop it first")
        self.prepare()
        self.loop.start()

    def advance(self, ticks: int) -> int:
        """Run ``ticks`` ticks in this thread; return the number completed: fewer after a fault (see `check`)."""
        if self.loop.thread is not None:
            raise StudyError("this servo runs in its own thread: stop it before advancing it manually")
        return self.loop.advance(ticks)

    def stop(self) -> None:
        """End the loop and wait for it; the last force written is zero. A stopped servo may be started again."""
        self._rests = True
        self.loop.end()

    def load(self, scene: Scene) -> int:
        """Load ``scene`` from the next tick on; return its serial number in telemetry.

        Raises
        ------
        StudyError
            The scene has another rate, or needs more wake elements than this servo has.
        ServoFault, DeviceLost
            The servo has stopped itself.
        """
        return self._present(scene, goes_on=False)

    def adjust(self, scene: Scene) -> int:
        """Change the parameters of the active scene to those of ``scene`` at the next tick; keep its wake and force.

        The force changes by at most the slew limit per tick, and the passivity controller continues: no more energy
        than the hand supplied is returned with any parameters. Returns the new serial number in telemetry.

        Raises
        ------
        StudyError
            The scene is not built like the active one (``pack.is_built_alike``), or cannot be loaded.
        ServoFault, DeviceLost
            The servo has stopped itself.
        """
        if not self.may_adjust(scene):
            raise StudyError(
                "the scene differs from the current one in more than its numerical values: load the scene instead "
                "of updating it"
            )
        return self._present(scene, goes_on=True)

    def may_adjust(self, scene: Scene) -> bool:
        """Return whether `adjust` accepts a scene now."""
        return not self._rests and is_built_alike(self._scene, scene)

    def _present(self, scene: Scene, *, goes_on: bool) -> int:
        if scene.rate_hz != self.rate_hz:
            raise StudyError(
                f"the scene is designed for {scene.rate_hz:g} Hz, but the servo runs at {self.rate_hz:g} Hz: set "
                "the same "
                "rate_hz for both"
            )
        needed = elements_needed(scene)
        if needed > self.elements:
            raise StudyError(
                f"the scene needs {needed} wake elements, but the servo has room for {self.elements}: "
                "create the servo with more elements, or shorten the wake"
            )
        self.check()
        with self._loading:
            self.serial += 1
            self._scene, self._rests = scene, False
            self.loop.hand_over(scene, self.serial, goes_on=goes_on)
            return self.serial

    def rest(self) -> None:
        """Load no liquid (scene 0) at the next tick: the force fades to zero."""
        with self._loading:
            self._rests = True
            self.loop.hand_over(self._scene.model_copy(update={"liquids": ()}), 0)

    def stop_force(self) -> None:
        """Send zero force from the next tick on, without a fade, until `fade_in`."""
        self.loop.control[0].stop = 1

    def fade_in(self) -> None:
        """Fade the force in after `stop_force`, as slowly as at a start."""
        self.loop.control[0].stop = 0

    @property
    def force_is_on(self) -> bool:
        """Whether forces are sent: not stopped manually, and no fault."""
        return bool(self.loop.control[0].stop == 0) and self.fault is None

    @property
    def fault(self) -> str | None:
        """The reason why the servo stopped itself, or hangs, as a sentence; None without a fault.

        A device that knows the cause reports it as its ``failure``.
        """
        status = int(self.loop.control[0].status)
        reason = _STUCK if status == STATUS_OK and self.loop.stuck else _FAULTS.get(status)
        if status in {STATUS_DEVICE_LOST, STATUS_STALE_FAULT}:
            own = self._device.failure
            reason = reason if own is None else f"stopped: {own}"
        return None if reason is None else f"the device '{self._device.name}' {reason}"

    @property
    def overruns(self) -> int:
        return int(self.loop.control[0].overruns)

    @property
    def worst_gap_s(self) -> float:
        """The longest time between two ticks since the newest scene was loaded, up to now [s]: a suspension counts."""
        return self.loop.worst_gap_ns * 1e-9

    def check(self) -> None:
        """Raise ``DeviceLost`` or ``ServoFault`` if the servo has stopped itself."""
        fault = self.fault
        if fault is not None:
            status = int(self.loop.control[0].status)
            if status == STATUS_OK:  # hanging: the device's state is unknown
                raise ServoFault(fault)
            raise (DeviceLost if status == STATUS_DEVICE_LOST else ServoFault)(f"{fault}; the force is zero")

    def now_ns(self) -> int:
        return self.loop.clock.now_ns()

    @property
    def dynamics(self) -> Dynamics:
        return self._device.dynamics

    @property
    def delay_ticks(self) -> int:
        return self.loop.delay_ticks

    @property
    def grant(self) -> Grant:
        return self.loop.grant

    def describe(self) -> dict[str, Any]:
        """Return the values for a receipt: rate, priority, assumed delay of a force, version of the force rules.

        ``estimator`` is "device" if the device measures the velocity, else "scene": the protocol names it. No value
        depends on the liquids: they are blinded.
        """
        return {
            "rate_hz": self.rate_hz,
            "priority": self.loop.grant.priority,
            "delay_ticks": self.delay_ticks,
            "force_rules": FORCE_RULES,
            "estimator": "device" if takes_device_velocity(self.rate_hz, self.dynamics) else "scene",
        }

    def __enter__(self) -> Self:
        if self.loop.clock.runs:
            self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
