"""The loop's memory, its thread, and the ways it ends.

The loop and the force end with the host: by a stop, an exception, the last reference to the servo, the interpreter's
exit, and signals that would otherwise kill the process at once.
"""

import signal
import threading
import time
import weakref
from collections.abc import Callable
from functools import cached_property
from types import FrameType
from typing import Any

from study_app.ending_signals import ENDING_SIGNALS
from study_app.errors import DeviceError, ServoFault
from study_app.haptics.kernels.c_functions import Driver
from study_app.haptics.kernels.compiled import entry_of
from study_app.haptics.kernels.loop import (
    CONTROL,
    ClockCalls,
    DeviceCalls,
    Output,
    Records,
    offer_numbers,
    offer_scene,
    run,
    send_zero_force,
)
from study_app.haptics.kernels.safety import new_safety
from study_app.haptics.model.device_dynamics import MOST_DELAY
from study_app.haptics.model.layout import STATUS_OK, new_command, new_reading, records
from study_app.haptics.model.scene import Scene
from study_app.haptics.runtime.clocks.clock import Clock, raise_priority
from study_app.haptics.runtime.grants import NO_THREAD, Blocks, Grant, allow_suspension, refuse_suspension
from study_app.haptics.runtime.pack import pack, pack_into
from study_app.haptics.runtime.telemetry import Telemetry

_FOREVER = -1
_PATIENCE_S = 2.0  # time limit for the loop to end on request [s]; it takes one tick
_STUCK_NS = 75_000_000  # lateness that counts as hanging: checked every frame, it is detected within 100 ms
_SUSPENDED_NS = 100_000_000  # less is the error of reading two clocks in sequence
_THAW_S = 0.25  # time for the loop to continue after the whole process stood still


class LoopThread:
    """The loop's data and thread, kept apart from the servo so that an unreferenced servo is garbage-collected.

    Parameters
    ----------
    driver : Driver
        The device that the loop reads and writes.
    clock : Clock
        The clock of the ticks.
    rest : Scene
        The initial scene, without liquids.
    elements : int
        Capacity of each of the two slots for wake elements.
    telemetry : Telemetry
        Receives every tick's sample.
    real_time : bool
        Whether to request a higher priority of the thread.
    """

    def __init__(
        self, driver: Driver, clock: Clock, rest: Scene, elements: int, telemetry: Telemetry, *, real_time: bool = True
    ) -> None:
        self.clock = clock
        self._driver = driver  # both kept alive: the loop has only their addresses
        self.live = False  # started and not ended
        self.thread: threading.Thread | None = None
        self.grant: Grant = NO_THREAD
        self.control = records(CONTROL, 1)
        self.control[0].period_ns = round(1e9 / rest.rate_hz)
        self._rest = rest
        self._real_time = real_time
        self._rate_hz = rest.rate_hz
        self._suspended_ns = clock.suspended_ns()
        self._stuck_at = -1  # the count of ticks at which it was found stuck
        self.safety = self._new_safety()
        self.slots = (pack(rest, capacity=elements), pack(rest, capacity=elements))
        self._output = Output(telemetry.ring, telemetry.written)
        self._exchanged = Records(new_reading(), new_command())
        self._device = DeviceCalls(context=driver.context, read=driver.read.address, write=driver.write.address)
        self._arguments = (
            self.control,
            self.slots,
            self.safety,
            self._exchanged,
            self._output,
            self._device,
            ClockCalls(context=clock.context, now=clock.now.address, sleep=clock.sleep.address),
        )

    def compile(self) -> None:
        """Compile the loop for its arguments, or load it from the cache: zero force is written, no tick is run."""
        send_zero_force(self._exchanged.command, self._device)
        self._run(*self._arguments, 0)

    @cached_property
    def _run(self) -> Callable[..., int]:
        return entry_of(run, *self._arguments, 0)

    @property
    def stuck(self) -> bool:
        """Whether the loop hangs: the tick that is due or running is too late.

        If the whole process was paused, the caller may run before the loop; then the loop gets time to continue.
        """
        ticks = int(self.control[0].ticks)
        late_ns = self._late_ns
        if late_ns <= _STUCK_NS or ticks == self._stuck_at:
            return late_ns > _STUCK_NS
        until_s = time.perf_counter() + (_THAW_S if late_ns > 2 * _STUCK_NS else 0.0)
        while self._late_ns > _STUCK_NS:
            if time.perf_counter() >= until_s:
                self._stuck_at = ticks
                return True
            time.sleep(1e-3)
        return False

    @property
    def _late_ns(self) -> int:
        """The lateness of the next tick while the loop runs [ns]."""
        running = self.thread is not None and self.live and self.control[0].run != 0
        return self.clock.now_ns() - int(self.control[0].deadline_ns) if running else 0

    @property
    def worst_gap_ns(self) -> int:
        """The longest time between two ticks since the newest scene was handed over, up to now [ns].

        The loop measures it, even if telemetry loses samples. Suspensions of the machine count, during which the loop's
        clock stops (`Clock.suspended_ns`).
        """
        host = self.control[0]
        now_ns = self.clock.now_ns() - int(host.began_ns)
        kept_ns = int(host.worst_gap_ns) if host.taken == host.request else 0
        suspended_ns = self.clock.suspended_ns() - self._suspended_ns
        return max(now_ns, kept_ns, suspended_ns if suspended_ns > _SUSPENDED_NS else 0)

    def start(self) -> None:
        """Run in a separate thread until `end`; meanwhile Ctrl-Z does not suspend the process."""
        self._begin()
        refuse_suspension(self)
        ready = threading.Event()
        self.thread = threading.Thread(target=self._tick, args=(ready,), name="servo", daemon=True)
        self.thread.start()
        ready.wait()

    def advance(self, ticks: int) -> int:
        """Run ``ticks`` in the calling thread; return the number completed."""
        if not self.live:
            self._begin()
        return int(self._run(*self._arguments, max(ticks, 0)))

    def hand_over(self, scene: Scene, serial: int, *, goes_on: bool = False) -> None:
        """Pack ``scene`` into the spare slot for the next tick, after the previous scene was taken.

        With ``goes_on`` the tick takes only its parameters.
        """
        host = self.control[0]
        patience = time.perf_counter() + _PATIENCE_S
        while self.thread is not None and self.thread.is_alive() and not self._all_taken:
            if time.perf_counter() > patience:
                raise self._silence()
            time.sleep(host.period_ns * 1e-9)
        spare = (int(host.request) + 1) % 2
        pack_into(self.slots[spare], scene, dynamics=self._driver.dynamics)
        if not goes_on:
            self._suspended_ns = self.clock.suspended_ns()
        (offer_numbers if goes_on else offer_scene)(self.control, spare, serial)

    @property
    def delay_ticks(self) -> int:
        return int(self.safety[0].delay_ticks)

    @property
    def _all_taken(self) -> bool:
        host = self.control[0]
        return bool(host.taken == host.request and host.numbers_taken == host.numbers)

    def end(self) -> None:
        """End the loop, wait for it, write zero force once more, and load rest for the next start.

        Raises
        ------
        ServoFault
            The loop does not respond: the device's driver hangs.
        """
        if not self.live:
            return
        self.control[0].run = 0
        if self.thread is not None and self.thread is not threading.current_thread():
            self.thread.join(_PATIENCE_S)
            if self.thread.is_alive():
                raise self._silence()
        self.thread = None
        self.live = False
        send_zero_force(self._exchanged.command, self._device)
        allow_suspension(self)
        self.hand_over(self._rest, 0)

    def _blocks(self) -> Blocks:
        models = (array for model in self.slots for array in model.arrays)
        arrays = (self.control, *models, self.safety, *self._exchanged, *self._output)
        return [(array.ctypes.data, array.nbytes) for array in arrays if array.nbytes]

    def _silence(self) -> ServoFault:
        return ServoFault(
            f"the servo is stuck: its device '{self._driver.name}' has not responded for {_PATIENCE_S:g} s; turn "
            "the device off"
        )

    def _new_safety(self) -> Any:
        """Return the safety record of a loop that begins, for the delay that the device measured."""
        driver = self._driver
        delay_ticks = driver.dynamics.delay_ticks(self._rate_hz)
        if delay_ticks > MOST_DELAY:
            raise DeviceError(
                f"the device '{driver.name}' responds {delay_ticks} ticks late at {self._rate_hz:g} Hz, but forces "
                f"are unstable beyond {MOST_DELAY} ticks: connect the device without a hub, close other programs that "
                "use the bus, and restart"
            )
        return new_safety(driver.force_limit_n, delay_ticks)

    def _begin(self) -> None:
        _leave_by_the_exit()
        _live.add(self)
        self.safety[0] = self._new_safety()[0]
        host = self.control[0]
        host.status = STATUS_OK
        host.began_ns = self.clock.now_ns()
        host.deadline_ns = host.began_ns + host.period_ns
        host.run = 1
        self.live = True

    def _tick(self, ready: threading.Event) -> None:
        try:
            self.grant = raise_priority(self._blocks(), real_time=self._real_time)
            self.control[0].began_ns = self.clock.now_ns()
            self.control[0].deadline_ns = self.control[0].began_ns + self.control[0].period_ns
        finally:
            ready.set()
        try:
            self._run(*self._arguments, _FOREVER)
        finally:
            send_zero_force(self._exchanged.command, self._device)


_live: weakref.WeakSet[LoopThread] = weakref.WeakSet()


def _leave_by_the_exit() -> None:
    """Handle signals that would kill the process at once like ``sys.exit``; keep handlers already set."""
    if threading.current_thread() is not threading.main_thread():
        return
    for number in ENDING_SIGNALS:
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _leave)


def _leave(number: int, _frame: FrameType | None) -> None:
    for loop in tuple(_live):
        loop.control[0].run = 0
    raise SystemExit(128 + number)
