"""A separate program (``python -m``) that reads bytes of a file descriptor and reports their times.

It prints "ready", reads the file descriptor until its other end is closed, and prints each byte with the time on the
servo's clock [ns], as JSON.
"""

import json
import os
import sys
from contextlib import suppress

from study_app.haptics.runtime.clocks.clock import SystemClock


def read(file: int) -> list[tuple[int, int]]:
    """Return the bytes that come, each with the time at which it was read [ns]."""
    clock = SystemClock()
    clock.now_ns()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    found: list[tuple[int, int]] = []
    with suppress(OSError):  # a virtual port whose other end is closed
        while came := os.read(file, 64):
            now_ns = clock.now_ns()
            found += [(byte, now_ns) for byte in came]
    return found


if __name__ == "__main__":
    json.dump(read(int(sys.argv[1])), sys.stdout)
