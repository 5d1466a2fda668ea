"""How late the servo's ticks begin, beside a bare sleeping loop in the same seconds, and what a tick costs.

Run me: I print tables. ``--seconds N`` sets how long is listened (10), ``--load`` lets Python compute meanwhile.
"""

import argparse
import subprocess
import sys
import threading
import time

import numpy as np

from study_app.devices.mouse import MouseDevice
from study_app.haptics.kernels.c_functions import NOW, SLEEP, call_at
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.scene import Liquid, Scene
from study_app.haptics.runtime.clocks.clock import SystemClock, VirtualClock, raise_priority
from study_app.haptics.runtime.servo import Servo
from study_app.haptics.runtime.telemetry import timing

_now, _sleep = call_at(NOW), call_at(SLEEP)

PERIOD_NS = 1_000_000
WATER = Scene(
    liquids=(
        Liquid(
            id="water",
            density_kg_m3=1000,
            effects=("drag", "wake"),
            wake=Wake(length=1700, scaling=1700, exponent=0.75),
        ),
    )
)

WARM_START = """
import time
begin = time.perf_counter()
from study_app.devices.mouse import MouseDevice
from study_app.haptics.runtime.servo import Servo
imported = time.perf_counter()
Servo(MouseDevice()).prepare()
print(imported - begin, time.perf_counter() - imported)
"""


@kernel
def bare_loop(address, context, start_ns, lateness_ns):
    """Sleep from deadline to deadline and do nothing else."""
    for i in range(lateness_ns.shape[0]):
        deadline_ns = start_ns + (i + 1) * PERIOD_NS
        lateness_ns[i] = _sleep(address, context, deadline_ns) - deadline_ns


@kernel
def call_many(address, context, count):
    """Call a C function ``count`` times."""
    total = 0
    for _ in range(count):
        total += _now(address, context)
    return total


def lateness_of_bare_loop(clock, seconds):
    """Return lateness [ns] of a loop that only sleeps, in a thread of its own with the servo's priority."""
    lateness_ns = np.zeros(int(seconds * 1e9) // PERIOD_NS, np.int64)

    def listen():
        raise_priority()
        bare_loop(clock.sleep.address, clock.context, clock.now_ns(), lateness_ns)

    thread = threading.Thread(target=listen)
    thread.start()
    thread.join()
    return lateness_ns


def compute_until(stop):
    """Keep the interpreter busy."""
    while not stop.is_set():
        sum(i * i for i in range(10_000))


def listen(seconds, load):
    """Print the lateness of servo and bare loop, run side by side."""
    stop = threading.Event()
    if load:
        threading.Thread(target=compute_until, args=(stop,), daemon=True).start()
    device, clock = MouseDevice(), SystemClock()
    bare_loop(clock.sleep.address, clock.context, clock.now_ns(), np.zeros(0, np.int64))
    with Servo(device) as servo:
        reader = servo.telemetry.reader()
        servo.load(WATER)
        bare_ns = lateness_of_bare_loop(clock, seconds)
        samples = reader.read()
        print(f"\npriority granted: {servo.describe()['priority']}; Python computing: {'yes' if load else 'no'}")
    stop.set()
    seen = timing(samples, 1000)
    print(f"{'lateness':<12}{'p50 us':>10}{'p99 us':>10}{'max us':>10}")
    points = (50, 99, 100)
    servo_us, bare_us = np.percentile(samples.lateness_ns, points) / 1e3, np.percentile(bare_ns, points) / 1e3
    for name, row in (("servo", servo_us), ("bare loop", bare_us)):
        print(f"{name:<12}" + "".join(f"{value:>10.1f}" for value in row))
    print(f"{'ratio':<12}" + "".join(f"{value:>10.2f}" for value in servo_us / bare_us))
    busy_us = np.percentile(samples.busy_ns, points) / 1e3
    print(f"{'busy':<12}" + "".join(f"{value:>10.1f}" for value in busy_us))
    print(f"ticks {seen.ticks}, rate {seen.rate_hz:.3f} Hz, worst gap {1e3 * seen.worst_gap_s:.3f} ms, ", end="")
    print(f"overruns {seen.overruns}, dropped {reader.dropped}")


def cost():
    """Print what ticks, calls from Python and calls of C functions cost."""
    device, clock = MouseDevice(), VirtualClock()
    servo = Servo(device, clock=clock)
    servo.prepare()

    def per_tick_ns(ticks=100_000):
        servo.advance(1000)
        begin = time.perf_counter()
        servo.advance(ticks)
        return (time.perf_counter() - begin) / ticks * 1e9

    print(f"\n{'a tick at rest, with the mouse device':<48}{per_tick_ns():>10.0f} ns")
    servo.load(WATER)
    device.point_to(0.04, 0.0, 0.0)
    print(f"{'a tick in water, with the mouse device':<48}{per_tick_ns():>10.0f} ns")
    begin = time.perf_counter()
    for _ in range(2000):
        servo.advance(0)
    print(f"{'a call of advance from Python':<48}{(time.perf_counter() - begin) / 2000 * 1e9:>10.0f} ns")
    call_many(clock.now.address, clock.context, 1)
    begin = time.perf_counter()
    call_many(clock.now.address, clock.context, 10_000_000)
    print(f"{'a call of a C function by its address':<48}{(time.perf_counter() - begin) * 100:>10.1f} ns")


def main():
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--load", action="store_true")
    options = parser.parse_args()
    begin = time.perf_counter()
    Servo(MouseDevice()).prepare()
    print(f"{'first preparation in this process':<48}{time.perf_counter() - begin:>10.2f} s")
    shown = subprocess.run([sys.executable, "-c", WARM_START], capture_output=True, text=True, check=True)
    imports, prepared = (float(word) for word in shown.stdout.split())
    print(f"{'in a new process, with a warm cache: imports':<48}{imports:>10.2f} s")
    print(f"{'                                     preparation':<48}{prepared:>10.2f} s")
    cost()
    listen(options.seconds, options.load)


if __name__ == "__main__":
    main()
