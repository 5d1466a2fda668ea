"""A separate program (``python -m``) that receives the outlets' data, like a recorder.

Without arguments it receives both streams of the Lab Streaming Layer until its input ends. It records the number of
samples, the SHA-256 of their channels and the longest gap between their times, and for each marker the text, the time
on the servo's clock and the time of arrival [ns]. With the number of a file descriptor it reads bytes until the other
end is closed, each with the time on the servo's clock [ns]. It prints "ready" once it can receive, and the results as
JSON at the end.
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
from study_app.outlets.streams import MARKERS, SAMPLES, ClockMapping, import_pylsl

_RESOLVE_TIMEOUT_S: Final = 30.0
_POLL_S: Final = 0.002
_QUIET_S: Final = 1.0
"""Time without data after the end of the input after which everything has been received [s]."""


def _open_inlet(lsl: Any, name: str) -> Any:
    """Open an inlet for a stream and return it."""
    streams = lsl.resolve_byprop("name", name, 1, _RESOLVE_TIMEOUT_S)
    if not streams:
        sys.exit(f"there is no stream named {name!r}")
    inlet = lsl.StreamInlet(streams[0])
    inlet.open_stream(_RESOLVE_TIMEOUT_S)
    return inlet


def _await_end(ending: threading.Event) -> None:
    """Set an event when the input ends."""
    sys.stdin.read()
    ending.set()


def _listen() -> dict[str, Any]:
    """Receive both streams until the input closes; return the received data."""
    lsl, clock = import_pylsl(), SystemClock()
    markers, samples = _open_inlet(lsl, MARKERS), _open_inlet(lsl, SAMPLES)
    correction_s = markers.time_correction(_RESOLVE_TIMEOUT_S)
    mapping = ClockMapping(clock.now_ns, lsl.local_clock)
    ending = threading.Event()
    threading.Thread(target=_await_end, args=(ending,), daemon=True).start()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    received: list[tuple[str, float, int]] = []
    count, last_s, worst_gap_s, digest = 0, 0.0, 0.0, hashlib.sha256()
    quiet_since = time.perf_counter()
    while not ending.is_set() or time.perf_counter() - quiet_since < _QUIET_S:
        time.sleep(_POLL_S)
        texts, stamps_s = markers.pull_chunk(0.0, 64)
        now_ns = clock.now_ns()
        received += [(text[0], stamp_s, now_ns) for text, stamp_s in zip(texts, stamps_s, strict=True)]
        chunk, times_s = samples.pull_chunk(0.0, 4096)
        if times_s:
            worst_gap_s = max(worst_gap_s, float(np.diff([last_s or times_s[0], *times_s]).max()))
            count, last_s = count + len(times_s), times_s[-1]
            digest.update(np.asarray(chunk, np.float32).tobytes())
        if times_s or texts:
            quiet_since = time.perf_counter()
        mapping.measure_if_due()
    return {
        "samples": count,
        "sha256": digest.hexdigest(),
        "worst_gap_ms": 1e3 * worst_gap_s,
        "correction_us": 1e6 * correction_s,
        "markers": [
            {"text": text, "time_ns": round(1e9 * (stamp_s + correction_s - mapping.offset_s)), "arrived_ns": at_ns}
            for text, stamp_s, at_ns in received
        ],
    }


def _receive_bytes(file: int) -> list[tuple[int, int]]:
    """Return the received bytes, each with the time at which it was read [ns]."""
    clock = SystemClock()
    clock.now_ns()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    events: list[tuple[int, int]] = []
    with suppress(OSError):  # a virtual port whose other end is closed
        while data := os.read(file, 64):
            now_ns = clock.now_ns()
            events += [(byte, now_ns) for byte in data]
    return events


if __name__ == "__main__":
    json.dump(_receive_bytes(int(sys.argv[1])) if len(sys.argv) > 1 else _listen(), sys.stdout)
