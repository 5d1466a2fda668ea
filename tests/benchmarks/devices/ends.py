"""The last force after each way in which a program with a force loop can end: python -m tests.benchmarks.devices.ends.

A program opens an emulated device with ``api.open_force``, strokes through honey, and ends. Its first exit function,
which runs last, prints the force that the emulated device then exerts. SIGKILL and ``os._exit`` run no exit function:
the device's watchdog, or the guard process (``tests/devices/falcon/test_guard.py``), ends the force.
"""

import subprocess
import sys
from typing import Final, NamedTuple

DEVICES: Final = ("falcon-emulated", "inverse3-emulated", "force-dimension-emulated")
WAYS: Final = {
    "the block ends": "with opened() as loop: stroke(loop)",
    "an exception in the block": "with opened() as loop:\n    stroke(loop)\n    raise RuntimeError",
    "sys.exit in the block": "with opened() as loop:\n    stroke(loop)\n    sys.exit()",
    "the block is never left": "block = opened(); stroke(block.__enter__())",
    "never left, then an exception": "block = opened(); stroke(block.__enter__()); raise RuntimeError",
    "SIGINT": "with opened() as loop: stroke(loop); send('SIGINT')",
    "SIGTERM": "with opened() as loop: stroke(loop); send('SIGTERM')",
    "SIGHUP": "with opened() as loop: stroke(loop); send('SIGHUP')",
    "SIGQUIT": "with opened() as loop: stroke(loop); send('SIGQUIT')",
    "never left, then SIGTERM": "block = opened(); stroke(block.__enter__()); send('SIGTERM')",
}
"""Programs by their way to end; ``opened``, ``stroke`` and ``send`` are below."""
PREAMBLE: Final = """
import atexit, os, signal, sys, time
import numpy as np

hands = []

@atexit.register
def show():
    print("at the end", *at_device())

from study_app import api
from study_app.devices.hand import hand_of

def at_device():
    hand = hands[0]
    return np.asarray(hand.torques if hasattr(hand, "torques") else hand.force_n, float)

def opened():
    for name in ("SIGINT", "SIGHUP", "SIGQUIT"):  # who started this may have switched them off
        signal.signal(getattr(signal, name), signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    return api.open_force("physical2", device=sys.argv[1])

def stroke(loop):
    hands.append(hand_of(loop._opened.device))
    loop.set_liquid("honey")
    times_s = np.arange(0.0, 20.0, 0.01)
    loop.follow(times_s, 0.03 * np.stack([np.sin(6 * times_s), 0 * times_s, 0 * times_s], axis=1))
    until_s = time.perf_counter() + 20.0
    while time.perf_counter() < until_s:
        time.sleep(0.05)
        samples = loop.read()
        if np.linalg.norm(samples["device_force_n"][-1]) > 0.5 and any(at_device()):
            print("before", *at_device(), flush=True)
            return
    raise TimeoutError

def send(name):
    os.kill(os.getpid(), getattr(signal, name))
    time.sleep(5)

"""
"""The beginning of each program."""


class End(NamedTuple):
    """The force or torques at a device before a way to end, and at the exit of the program; empty if not reached."""

    device: str
    way: str
    before: tuple[float, ...]
    last: tuple[float, ...]


def end_program(device: str, way: str) -> End:
    """Run a program that ends in one of `WAYS`, and return the forces of its device."""
    ended = subprocess.run(
        [sys.executable, "-c", PREAMBLE + WAYS[way], device], capture_output=True, text=True, timeout=180, check=False
    )
    forces: dict[str, tuple[float, ...]] = {"before": (), "at the end": ()}
    for line in ended.stdout.splitlines():
        label, *values = line.rsplit(None, 3)
        forces[label] = tuple(map(float, values))
    return End(device=device, way=way, before=forces["before"], last=forces["at the end"])


def main() -> int:
    """Print a table, and return the exit code."""
    failed = False
    print(f"| way to end | {' | '.join(DEVICES)} |\n| --- |{' --- |' * len(DEVICES)}")
    for way in WAYS:
        results = [end_program(device, way) for device in DEVICES]
        failed |= not all(any(result.before) and result.last and not any(result.last) for result in results)
        cells = ["not reached" if not result.last else f"{max(map(abs, result.last)):g}" for result in results]
        print(f"| {way} | {' | '.join(cells)} |", flush=True)
    return 3 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
