"""A separate program (``python -m``) that receives what goes to other programs, like a recorder.

Without arguments it receives both streams of the Lab Streaming Layer until its input ends: the samples (count, SHA-256
of their channels, longest gap between their times), and of each marker its text, its time on the servo's clock and the
time of its arrival [ns]. With the number of a file descriptor it reads that until its other end is closed: each byte
with the time on the servo's clock [ns]. It prints "ready" once it receives, and at the end what it found as JSON.
"""

import hashlib
import json
import os
import sys
import threading
import time
from contextlib import suppress
from typing import Any, Final

import numpy as np

from study_app.haptics.runtime.clocks import SystemClock
from study_app.outlets.streams import MARKERS, SAMPLES, ClockMapping, library

_FOUND_WITHIN_S: Final = 30.0
_LOOK_S: Final = 0.002
_QUIET_S: Final = 1.0
"""Time without data after the end of the input, after which all is received."""


def _open_inlet(lsl: Any, name: str) -> Any:
    """Open an inlet for a stream and return it."""
    streams = lsl.resolve_byprop("name", name, 1, _FOUND_WITHIN_S)
    if not streams:
        sys.exit(f"there is no stream named {name!r}")
    inlet = lsl.StreamInlet(streams[0])
    inlet.open_stream(_FOUND_WITHIN_S)
    return inlet


def _await_end(ending: threading.Event) -> None:
    """Set an event when the input ends."""
    sys.stdin.read()
    ending.set()


def _listen() -> dict[str, Any]:
    """Receive both streams until the input closes; return the received data."""
    lsl, clock = library(), SystemClock()
    markers, samples = _open_inlet(lsl, MARKERS), _open_inlet(lsl, SAMPLES)
    correction_s = markers.time_correction(_FOUND_WITHIN_S)
    mapping = ClockMapping(clock.now_ns, lsl.local_clock)
    ending = threading.Event()
    threading.Thread(target=_await_end, args=(ending,), daemon=True).start()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    said: list[tuple[str, float, int]] = []
    count, last_s, worst_gap_s, hashed = 0, 0.0, 0.0, hashlib.sha256()
    quiet_since = time.perf_counter()
    while not ending.is_set() or time.perf_counter() - quiet_since < _QUIET_S:
        time.sleep(_LOOK_S)
        texts, stamps_s = markers.pull_chunk(0.0, 64)
        now_ns = clock.now_ns()
        said += [(text[0], stamp_s, now_ns) for text, stamp_s in zip(texts, stamps_s, strict=True)]
        chunk, times_s = samples.pull_chunk(0.0, 4096)
        if times_s:
            worst_gap_s = max(worst_gap_s, float(np.diff([last_s or times_s[0], *times_s]).max()))
            count, last_s = count + len(times_s), times_s[-1]
            hashed.update(np.asarray(chunk, np.float32).tobytes())
        if times_s or texts:
            quiet_since = time.perf_counter()
        mapping.measure_if_due()
    return {
        "samples": count,
        "sha256": hashed.hexdigest(),
        "worst_gap_ms": 1e3 * worst_gap_s,
        "correction_us": 1e6 * correction_s,
        "markers": [
            {"text": text, "time_ns": round(1e9 * (stamp_s + correction_s - mapping.offset_s)), "arrived_ns": at_ns}
            for text, stamp_s, at_ns in said
        ],
    }


def read(file: int) -> list[tuple[int, int]]:
    """Return the received bytes, each with the time at which it was read [ns]."""
    clock = SystemClock()
    clock.now_ns()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    events: list[tuple[int, int]] = []
    with suppress(OSError):  # a virtual port whose other end is closed
        while came := os.read(file, 64):
            now_ns = clock.now_ns()
            events += [(byte, now_ns) for byte in came]
    return events


if __name__ == "__main__":
    json.dump(read(int(sys.argv[1])) if len(sys.argv) > 1 else _listen(), sys.stdout)
