"""The captured pointer on a virtual display: no motion is lost when it is moved back to the centre."""

import pytest

from tests.end_to_end.real_windows import needs_display
from tests.gui.participant.driver import on_a_display

pytestmark = pytest.mark.slow

STEP_PX, STEPS = 300, 4

# Moves the pointer again before the program has seen that it was put back, as a quick hand does.
SCRIPT = f"""
import json, subprocess, time
from PySide6.QtCore import QPoint
from PySide6.QtGui import QCursor
from PySide6.QtWidgets import QApplication, QWidget
from study_app.gui.participant.window import PointerCapture

app = QApplication([])
window = QWidget()
window.resize(1200, 800)
window.show()
def turn(seconds):
    until = time.perf_counter() + seconds
    while time.perf_counter() < until:
        app.processEvents()
turn(0.5)
capture = PointerCapture()
places = []
capture.moved.connect(lambda x, y, z: places.append(x))
capture.capture(window, (10_000.0, 100.0, 100.0))
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
    result = on_a_display(SCRIPT)
    assert result["moved"] == pytest.approx(STEP_PX * STEPS, abs=2)
    assert result["left"] == [0, 0]
