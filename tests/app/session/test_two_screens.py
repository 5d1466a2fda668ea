"""A session uses the screens set for the machine unless the command names one."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.compiled import needs_servo

pytestmark = [pytest.mark.slow, pytest.mark.nightly, needs_servo]

SCREENS = [
    {"name": name, "x": x, "y": 0, "width": 1600, "height": 1000, "logicalDpi": 96, "logicalBaseDpi": 96, "dpr": 1}
    for name, x in (("left", 0), ("right", 1600))
]

PROGRAM = """
import json, sys
from pathlib import Path
from PySide6.QtCore import QEventLoop, QTimer
from study_app.app.session.live_session import LiveSession
from study_app.gui.application import application_here
from study_app.gui.theme.theme import LIGHT
from study_app.session import start
from study_app.session.start import NewSession

start.MEASURED_S = 0.1
application_here()
chosen = NewSession(
    source="demo", participant="P001", session=1, seed=1, operator="", language="en", device="scripted", windowed=False,
    screen=None, results=Path(sys.argv[1]),
)
live, loop, facts = LiveSession(chosen, LIGHT), QEventLoop(), []
live.settings = live.settings.model_copy(update={"screen": "left", "screen_number": 1})

def look():
    if live.bridge is None or not live.bridge.participant.isVisible():
        return
    timer.stop()
    windows = live.bridge.participant, live.bridge.operator
    facts.extend([window.screen().name(), window.geometry().x()] for window in windows)
    facts.append(live.bridge.strip is None)
    live.bridge.participant.windowHandle().setScreen(live.bridge.operator.windowHandle().screen())
    live.bridge.participant.showFullScreen()
    timer.timeout.disconnect(look)
    timer.timeout.connect(look_again)
    timer.start()

def look_again():
    if live.bridge.runner.state.phase.name == "PAUSED":
        timer.stop()
        facts.append(live.bridge.operator.isActiveWindow())
        live.end_by_signal(15)

timer = QTimer()
timer.timeout.connect(look)
timer.start(20)
live.over.connect(loop.quit)
live.open()
loop.exec()
live.wait()
print(json.dumps(facts))
"""


def test_both_windows_use_the_configured_screens_until_one_is_removed(tmp_path: Path) -> None:
    screens = tmp_path / "screens.json"
    screens.write_text(json.dumps({"screens": SCREENS}), encoding="utf-8", newline="\n")
    process = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(tmp_path / "results")],
        env=os.environ | {"QT_QPA_PLATFORM": f"offscreen:configfile={screens}", "XDG_CONFIG_HOME": str(tmp_path)},
        cwd=Path(__file__).parents[3],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert process.returncode == 0, process.stderr
    (participant, participant_x), (operator, operator_x), no_strip, _ = json.loads(process.stdout.splitlines()[-1])
    assert (participant, operator, no_strip) == ("left", "right", True)
    assert participant_x < 1600 <= operator_x
