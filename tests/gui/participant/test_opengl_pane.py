"""The tank on an OpenGL surface, on a virtual display: the same picture, a swap for every frame, frames in step."""

import pytest

from study_app.gui.display.screens import SOFTWARE_RENDERERS, has_graphics_card, opengl_renderer
from tests.end_to_end.real_windows import needs_display
from tests.gui.participant.driver import on_a_display

pytestmark = pytest.mark.slow

FRAMES = 30

# Shows the same views in a window with and one without the surface, and prints what came of it.
SCRIPT = f"""
import json, os, sys
import numpy as np
from PySide6.QtCore import QEventLoop, QTimer
from PySide6.QtWidgets import QApplication
from study_app.gui.display.screens import Frames
from study_app.gui.display.screens import has_graphics_card, opengl_renderer
from study_app.gui.participant.tank_widget import TankWidget
from study_app.protocol.wording.languages import words
from tests.gui.small import task_page, view
from tests.gui.drawn import pixels

sys.excepthook = lambda *error: (sys.__excepthook__(*error), os._exit(1))
app = QApplication([])
told = {{"renderer": opengl_renderer(), "card": has_graphics_card(), "painted": [], "swaps": 0}}
if told["renderer"] is None:
    print(json.dumps(told)); sys.exit()
tanks = [TankWidget(task_page(), words("en"), on_card=on_card) for on_card in (False, True)]
plain, tank = tanks
for one in tanks:
    one.resize(960, 640)
    one.show()
frames = Frames(60.0)
loop = QEventLoop()
tank.painted.connect(told["painted"].append)
tank.swapped.connect(frames.note_swap)
def swapped():
    told["swaps"] += 1
tank.swapped.connect(swapped)
shown = []
def due():
    told["locked"] = frames.is_locked
    if len(told["painted"]) == {FRAMES}:
        frames.stop(); loop.quit(); return
    place = (0.001 * len(told["painted"]), 0.0, 0.0)
    for one in tanks:
        one.show_view(view(place, sample_ns=len(told["painted"])))
frames.due.connect(due)
frames.start()
QTimer.singleShot(60_000, loop.quit)
loop.exec()
seen, drawn = pixels(tank.grab().toImage()).astype(int), pixels(plain.grab().toImage()).astype(int)
told["apart"] = [float((np.abs(seen - drawn) > 60).any(2).mean()), float(np.abs(seen - drawn).mean())]
print(json.dumps(told))
"""


@pytest.fixture(scope="module")
def told():
    found = on_a_display(SCRIPT)
    if found["renderer"] is None:
        pytest.skip("no OpenGL on this display")
    return found


@needs_display
@pytest.mark.xvfb
def test_the_picture_on_a_surface_is_the_same_and_every_view_is_told_of_once_after_its_swap(told):
    share, mean = told["apart"]
    assert mean < 1.0
    assert share < 0.005  # edges may be smoothed differently
    assert told["painted"] == list(range(FRAMES))
    assert told["swaps"] >= FRAMES
    assert told["locked"], "frames follow the swaps"
    assert told["card"] == (not any(word in told["renderer"].lower() for word in SOFTWARE_RENDERERS))


def test_without_a_screen_there_is_no_card(qapp):
    assert opengl_renderer() is None
    assert not has_graphics_card()
