"""What the first windows load: neither the compiler, nor the plots, nor what the designer alone needs."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

HEAVY = ("matplotlib", "numba", "pandas", "pyarrow", "pyqtgraph", "scipy", "tomlkit")

HOME = """
import sys
from pathlib import Path
from PySide6.QtWidgets import QApplication
from study_app.app.main_controller import MainController
from study_app.gui.application import application_here
from study_app.gui.widgets.background import wait_for_jobs

application = application_here()
visit = MainController(Path(sys.argv[1]))
visit.window.show()
application.processEvents()
assert visit.window.isVisible()
print(sorted({name.partition(".")[0] for name in sys.modules}))
wait_for_jobs(60)
"""

NOTE = """
import sys, threading
from pathlib import Path
from PySide6.QtWidgets import QApplication
from study_app.app.session.live_session import LiveSession
from study_app.gui.application import application_here
from study_app.session.request import NewSession
from study_app.gui.theme.theme import LIGHT

class Idle:
    def __init__(self, **_named): pass
    def start(self): pass
    def is_alive(self): return False

application = application_here()
threading.Thread = Idle
live = LiveSession(NewSession("demo", "P001", 1, 1, "", "en", "scripted", True, None, Path(sys.argv[1])), LIGHT)
live.open()
application.processEvents()
assert live.note.isVisible()
print(sorted({name.partition(".")[0] for name in sys.modules}))
"""

COMMAND = """
import sys
from study_app import app
before = {name for name in sys.modules if name.startswith("study_app.app.")}
assert callable(app.run) and callable(app.home)
print(sorted(before & {"study_app.app.main_controller", "study_app.app.devices_controller"}))
"""

BESIDE = """
import gc, sys, threading
from PySide6.QtCore import QObject
from study_app.app.session.live_session import load_windows
from study_app.gui.application import application_here

application = application_here()
beside = threading.Thread(target=load_windows)
beside.start()
beside.join()
windows = {"study_app.app.session.preflight_controller", "study_app.app.session.session_windows"}
assert windows | {"pyarrow.parquet"} <= set(sys.modules)
objects = [one for one in gc.get_objects() if isinstance(one, QObject)]
assert application in objects
print([one for one in objects if one.thread() != application.thread()])
"""


def said(program: str, folder: Path) -> str:
    """Return the last line of a program."""
    done = subprocess.run(
        [sys.executable, "-c", program, str(folder / "results")],
        env=os.environ | {"QT_QPA_PLATFORM": "offscreen", "XDG_CONFIG_HOME": str(folder)},
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()[-1]


def loaded(program: str, folder: Path) -> list[str]:
    """Return the heavy packages that are loaded once the first window of a program stands."""
    names = said(program, folder)
    assert "'PySide6'" in names
    return [name for name in HEAVY if f"'{name}'" in names]


def test_home_stands_before_anything_heavy_is_loaded(tmp_path: Path) -> None:
    assert loaded(HOME, tmp_path) == []


def test_a_session_by_command_loads_neither_the_main_window_nor_the_devices(tmp_path: Path) -> None:
    assert said(COMMAND, tmp_path) == "[]"


def test_the_note_before_a_session_stands_before_anything_heavy_is_loaded(tmp_path: Path) -> None:
    assert loaded(NOTE, tmp_path) == []


def test_loading_a_sessions_windows_beside_the_note_makes_no_object_of_that_thread(tmp_path: Path) -> None:
    assert said(BESIDE, tmp_path) == "[]"
