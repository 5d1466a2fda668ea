"""A bridge between two windows and a controlled world."""

import re
import sys
from pathlib import Path

import pytest
from PySide6.QtCore import QCoreApplication, QEvent, QTimer
from PySide6.QtWidgets import QApplication
from shiboken6 import isValid

from study_app.protocol.load import load
from study_app.protocol.source.files import source_bytes
from study_app.session import start
from tests.app.world import World, begin_bridge

PATIENCE_MS = 150_000  # less than pytest's timeout


@pytest.fixture
def world():
    return World()


@pytest.fixture
def make(qapp, world):
    def build(blinding="double", **parts):
        protocol = load("demo")
        protocol = protocol.model_copy(update={"study": protocol.study.model_copy(update={"blinding": blinding})})
        made_bridges.append(
            begin_bridge(protocol, **({"servo": world, "journal": world, "clock": world.seconds} | parts))
        )
        return made_bridges[-1]

    made_bridges = []
    hook = sys.excepthook
    yield build
    for bridge in made_bridges:
        if isValid(bridge):
            bridge.leave_without_asking()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    assert sys.excepthook is hook


@pytest.fixture
def bridge(make):
    return make()


@pytest.fixture
def nobody_stays():
    """Let no simulated person of one test look at the windows of the next, and no window wait for ever.

    The timeout of pytest raises in a slot, where it ends no event loop.
    """
    late = QTimer(singleShot=True, interval=PATIENCE_MS)
    late.timeout.connect(lambda: QCoreApplication.exit(1))
    late.start()
    yield
    late.stop()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


@pytest.fixture
def quick_preflight(monkeypatch):
    """Shorten the measurement to a tenth of a second; its verdicts are tested separately."""
    monkeypatch.setattr(start, "MEASURED_S", 0.1)


@pytest.fixture
def short_demo(tmp_path: Path) -> str:
    """Return the demo protocol with tasks of a second."""
    text = source_bytes("demo").decode()
    for key, value in (("min_s", "0.3"), ("count", "1"), ("dwell_s", "0.05")):
        text, count = re.subn(rf"^{key} = [\d.]+", f"{key} = {value}", text, flags=re.MULTILINE)
        assert count == 1
    path = tmp_path / "demo.toml"
    path.write_text(text, encoding="utf-8", newline="\n")
    return str(path)


@pytest.fixture
def results(tmp_path: Path) -> Path:
    return tmp_path / "results" / "demo"
