"""Tasks of a worker process that replace a rehearsal in the tests of its dialog."""

import signal
import sys
import threading
from pathlib import Path

from study_app.errors import StudyError
from study_app.session.simulated.rehearsal_worker import RehearsalOrder
from study_app.workers.server import Send, Stop


def fail(_order: RehearsalOrder, _send: Send, _stop: Stop) -> Path:
    """Refuse."""
    raise StudyError("no room left")


def end(_order: RehearsalOrder, _send: Send, _stop: Stop) -> Path:
    """End the process."""
    sys.exit(7)


def two(order: RehearsalOrder, send: Send, stop: Stop) -> Path:
    """Do one participant, then, once asked to, the other."""
    send("R1: 8 responses (simulated)")
    while not stop():
        threading.Event().wait(0.01)
    send("R2: 8 responses (simulated)")
    return order.results


def endless(_order: RehearsalOrder, _send: Send, _stop: Stop) -> Path:
    """Wait until the process is ended."""
    threading.Event().wait()
    raise AssertionError


def compiles(order: RehearsalOrder, send: Send, stop: Stop) -> Path:
    """Compile a quarter, and wait until the process is ended."""
    send(0.25)
    return endless(order, send, stop)


def deaf(order: RehearsalOrder, send: Send, stop: Stop) -> Path:
    """Wait until the process is killed."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    send("deaf")
    return endless(order, send, stop)
