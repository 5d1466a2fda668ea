"""The pointer as the hand, on a virtual display: no motion is lost where it is put back into the middle."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.end_to_end.real_windows import needs_display, virtual_display

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[3]
STEP_PX, STEPS = 300, 4

# Moves the pointer again before the program has seen that it was put back, as a quick hand does.
SCRIPT = f"""
import json, subprocess, time
from PySide6.QtCore import QPoint
from PySide6.QtGui import QCursor
from PySide6.QtWidgets import QApplication, QWidget
from study_app.gui.participant.pointer_capture import PointerCapture

app = QApplication([])
window = QWidget()
window.resize(1200, 800)
window.show()
def turn(seconds):
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        app.processEvents()
turn(0.5)
capture = PointerCapture()
places = []
capture.moved.connect(lambda x, y, z: places.append(x))
capture.take(window, (10_000.0, 100.0, 100.0))
turn(0.3)
for _ in range({STEPS}):
    subprocess.run(["xdotool", "mousemove_relative", "--", "{STEP_PX}", "0"], check=True)
    time.sleep(0.05)
    app.processEvents()
turn(0.3)
middle = window.mapToGlobal(window.rect().center())
left = QCursor.pos() - middle
print(json.dumps({{"moved": (places[-1] - places[0]) / capture.gain, "left": [left.x(), left.y()]}}))
"""


@needs_display
@pytest.mark.xvfb
def test_quick_motion_is_counted_whole_and_the_pointer_comes_back() -> None:
    with virtual_display() as display:
        environment = os.environ | {"DISPLAY": display, "QT_QPA_PLATFORM": "xcb", "PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            [sys.executable, "-c", SCRIPT], env=environment, cwd=ROOT, capture_output=True, text=True, check=False
        )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["moved"] == pytest.approx(STEP_PX * STEPS, abs=2)
    assert told["left"] == [0, 0]
