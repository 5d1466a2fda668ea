"""Sinks that fail or hang when a test wants it, and a recorder of streams in another process."""

import json
import subprocess
import sys
import threading
from collections.abc import Mapping
from typing import Any

from study_app.errors import OutletError
from study_app.outlets.markers import Marker, marker_of


def marker(trial: int = 1, event: str = "trial_started", time_s: float = 1.0) -> Marker:
    built_marker = marker_of(event, time_s, 0, {"trial": trial})
    assert built_marker is not None
    return built_marker


class Sink:
    """A sink that keeps its markers, and fails or hangs at the marker of a trial."""

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
        trial = dict(given.fields).get("trial")
        if trial == self.fails_at:
            raise OutletError("test:port failed: it was unplugged")
        if trial == self.hangs_at:
            self.hanging.set()
            assert self.go_on.wait(10)
        self.sent.append(given)

    def close(self) -> None:
        self.closed.set()


RECORDER = """
import json, sys, pylsl
name, count = sys.argv[1], int(sys.argv[2])
found = pylsl.resolve_byprop("name", name, 1, 30)
inlet = pylsl.StreamInlet(found[0])
info = inlet.info(10)
inlet.open_stream(10)
print("ready", flush=True)
samples = [inlet.pull_sample(20) for _ in range(count)]
print(json.dumps({"xml": info.as_xml(), "rate": info.nominal_srate(), "samples": samples}))
"""


class Recorder:
    """An independent recording program that receives a number of samples of a stream by name."""

    def __init__(self, name: str, count: int) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", RECORDER, name, str(count)], stdout=subprocess.PIPE, text=True
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == "ready\n"

    def kill(self) -> None:
        self._process.kill()
        self._process.communicate(timeout=60)

    def found(self) -> dict[str, Any]:
        return json.loads(self._process.communicate(timeout=60)[0])
