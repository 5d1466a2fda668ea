"""Sinks that fail or hang when a test wants it."""

import threading
from collections.abc import Mapping
from typing import Any

from study_app.errors import OutletError
from study_app.outlets.marker import Marker, marker_of


def marker(trial: int = 1, event: str = "trial_started", time_s: float = 1.0) -> Marker:
    made = marker_of(event, time_s, 0, {"trial": trial})
    assert made is not None
    return made


class Sink:
    """Keeps what it is sent; fails at, or hangs in, the marker of a trial."""

    title = "Test port"
    listens = None

    def __init__(self, fails_at: int = 0, hangs_at: int = 0) -> None:
        self.sent: list[Marker] = []
        self.fails_at, self.hangs_at = fails_at, hangs_at
        self.hanging, self.go_on, self.closed = threading.Event(), threading.Event(), threading.Event()

    @property
    def described(self) -> Mapping[str, Any]:
        return {"address": "test:port"}

    def send(self, given: Marker) -> None:
        trial = dict(given.said).get("trial")
        if trial == self.fails_at:
            raise OutletError("test:port failed: it was unplugged")
        if trial == self.hangs_at:
            self.hanging.set()
            assert self.go_on.wait(10)
        self.sent.append(given)

    def close(self) -> None:
        self.closed.set()
