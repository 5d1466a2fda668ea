"""A separate program (``python -m``) that receives both streams like a recorder.

It prints "ready" once both streams are open, receives until its input ends, and then prints what it found as JSON: the
samples (count, SHA-256 of their channels, longest gap between their times), and of each marker its text, its time on
the servo's clock and the time of its arrival [ns].
"""

import hashlib
import json
import sys
import threading
import time
from typing import Any, Final

import numpy as np

from study_app.haptics.runtime.clocks.clock import SystemClock
from study_app.outlets.streams import MARKERS, SAMPLES, ClockMapping, library

FOUND_WITHIN_S: Final = 30.0
LOOK_S: Final = 0.002
QUIET_S: Final = 1.0
"""Time without data after the end of the input, after which all is received."""


def opened(lsl: Any, name: str) -> Any:
    """Return an open inlet of a stream."""
    found = lsl.resolve_byprop("name", name, 1, FOUND_WITHIN_S)
    if not found:
        sys.exit(f"no stream is called {name!r}")
    inlet = lsl.StreamInlet(found[0])
    inlet.open_stream(FOUND_WITHIN_S)
    return inlet


def _await_end(ending: threading.Event) -> None:
    """Set an event when the input ends."""
    sys.stdin.read()
    ending.set()


def listen() -> dict[str, Any]:
    """Receive both streams until the input ends; return the received data."""
    lsl, clock = library(), SystemClock()
    markers, samples = opened(lsl, MARKERS), opened(lsl, SAMPLES)
    correction_s = markers.time_correction(FOUND_WITHIN_S)
    mapping = ClockMapping(clock.now_ns, lsl.local_clock)
    ending = threading.Event()
    threading.Thread(target=_await_end, args=(ending,), daemon=True).start()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    said: list[tuple[str, float, int]] = []
    count, last_s, worst_gap_s, hashed = 0, 0.0, 0.0, hashlib.sha256()
    quiet_since = time.monotonic()
    while not ending.is_set() or time.monotonic() - quiet_since < QUIET_S:
        time.sleep(LOOK_S)
        texts, stamps_s = markers.pull_chunk(0.0, 64)
        now_ns = clock.now_ns()
        said += [(text[0], stamp_s, now_ns) for text, stamp_s in zip(texts, stamps_s, strict=True)]
        chunk, times_s = samples.pull_chunk(0.0, 4096)
        if times_s:
            worst_gap_s = max(worst_gap_s, float(np.diff([last_s or times_s[0], *times_s]).max()))
            count, last_s = count + len(times_s), times_s[-1]
            hashed.update(np.asarray(chunk, np.float32).tobytes())
        if times_s or texts:
            quiet_since = time.monotonic()
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


if __name__ == "__main__":
    json.dump(listen(), sys.stdout)
