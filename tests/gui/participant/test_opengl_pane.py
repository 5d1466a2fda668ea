"""The tank on an OpenGL surface of a virtual display: same picture, one swap per frame, frames in step with swaps."""

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
result = {{"renderer": opengl_renderer(), "card": has_graphics_card(), "painted": [], "swaps": 0}}
if result["renderer"] is None:
    print(json.dumps(result)); sys.exit()
tanks = [TankWidget(task_page(), words("en"), on_card=on_card) for on_card in (False, True)]
plain, tank = tanks
for each_tank in tanks:
    each_tank.resize(960, 640)
    each_tank.show()
frames = Frames(60.0)
loop = QEventLoop()
tank.painted.connect(result["painted"].append)
tank.swapped.connect(frames.note_swap)
def swapped():
    result["swaps"] += 1
tank.swapped.connect(swapped)
def due():
    result["locked"] = frames.is_locked
    if len(result["painted"]) == {FRAMES}:
        frames.stop(); loop.quit(); return
    place = (0.001 * len(result["painted"]), 0.0, 0.0)
    for each_tank in tanks:
        each_tank.show_view(view(place, sample_ns=len(result["painted"])))
frames.due.connect(due)
frames.start()
QTimer.singleShot(60_000, loop.quit)
loop.exec()
surface, drawn = pixels(tank.grab().toImage()).astype(int), pixels(plain.grab().toImage()).astype(int)
result["apart"] = [float((np.abs(surface - drawn) > 60).any(2).mean()), float(np.abs(surface - drawn).mean())]
print(json.dumps(result))
"""


@pytest.fixture(scope="module")
def result():
    measured = on_a_display(SCRIPT)
    if measured["renderer"] is None:
        pytest.skip("no OpenGL on this display")
    return measured


@needs_display
@pytest.mark.xvfb
def test_the_surface_shows_the_same_picture_and_reports_each_view_after_its_swap(result):
    share, mean = result["apart"]
    assert mean < 1.0
    assert share < 0.005  # edges may be smoothed differently
    assert result["painted"] == list(range(FRAMES))
    assert result["swaps"] >= FRAMES
    assert result["locked"], "frames follow the swaps"
    assert result["card"] == (not any(word in result["renderer"].lower() for word in SOFTWARE_RENDERERS))


def test_without_a_screen_no_graphics_card_is_found(qapp):
    assert opengl_renderer() is None
    assert not has_graphics_card()
