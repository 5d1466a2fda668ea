"""What the first windows load: neither the compiler, nor the plots, nor what the designer alone needs."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

HEAVY = ("matplotlib", "numba", "pandas", "pyarrow", "pyqtgraph", "scipy", "tomlkit")
PROGRAM = """
import gc, json, sys, threading
from pathlib import Path
from study_app.gui import display_check

def collections():
    return sum(generation["collections"] for generation in gc.get_stats())

before = collections()
from study_app import app
collected = collections() - before, gc.isenabled(), gc.get_freeze_count() > 0
from PySide6.QtCore import QObject

for_all = [name for name in ("main_controller", "lab_controller") if f"study_app.app.{name}" in sys.modules]
assert callable(app.run) and callable(app.run_home_window)

from study_app.app.main_controller import MainController
from study_app.app.session import live_session
from study_app.gui.application import application_here
from study_app.gui.theme.theme import LIGHT
from study_app.gui.widgets.background import wait_for_jobs
from study_app.session.start import NewSession

def loaded():
    return sorted({name.partition(".")[0] for name in sys.modules})

class Idle:
    def __init__(self, **_named): pass
    def start(self): pass
    def is_alive(self): return False
    def join(self, _timeout=None): pass

application, results, plain = application_here(), Path(sys.argv[1]), threading.Thread
threading.Thread = Idle
chosen = NewSession(
    source="demo", participant="P001", session=1, seed=1, operator="", language="en", device="scripted", windowed=True,
    screen=None, results=results,
)
live = live_session.LiveSession(chosen, LIGHT)
live.open()
application.processEvents()
assert live.note.isVisible()
at_note = loaded()
live.note.hide()
threading.Thread = plain
visit = MainController(results)
visit.window.show()
application.processEvents()
assert visit.window.isVisible()
at_home = loaded()
wait_for_jobs(60)
beside = threading.Thread(target=live_session.load_windows)
beside.start()
beside.join()
windows = {"study_app.app.session.preflight_controller", "study_app.app.session.bridge", "pyarrow.parquet"}
objects = [item for item in gc.get_objects() if isinstance(item, QObject)]
assert application in objects
elsewhere = [repr(item) for item in objects if item.thread() != application.thread()]
print(json.dumps([collected, for_all, at_home, at_note, sorted(windows - set(sys.modules)), elsewhere]))
"""


def test_home_and_the_note_before_a_session_stand_before_anything_heavy_is_loaded(tmp_path: Path) -> None:
    process = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(tmp_path / "results")],
        env=os.environ | {"QT_QPA_PLATFORM": "offscreen", "XDG_CONFIG_HOME": str(tmp_path)},
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )
    assert process.returncode == 0, process.stderr
    collected, for_all, at_home, at_note, not_loaded, elsewhere = json.loads(process.stdout.splitlines()[-1])
    assert collected == [0, True, True], "garbage is collected before and after the import, not in it"
    assert for_all == [], "a session by command loads neither the main window nor the devices"
    for loaded in (at_home, at_note):
        assert "PySide6" in loaded
        assert [name for name in HEAVY if name in loaded] == []
    assert not_loaded == [], "a thread loads a session's windows beside the note"
    assert elsewhere == [], "and makes no object of that thread"
