"""How fast the designer is: python tests/benchmarks/windows/designer_speed.py [EDITS] prints milliseconds.

Times are wall and CPU time. A copy of ``rek2024`` and one with 60 times its questionnaire are edited in a window of
1600 × 1000 without a screen. An edit is one letter in the form's field of a question, until the participant's page is
painted with it.
"""

import os
import re
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
from PySide6.QtCore import QEventLoop, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit, QPlainTextEdit

from study_app.designer.controller import DesignerController
from study_app.gui.home.main_window import MainWindow
from study_app.gui.widgets.main_view import Place
from study_app.protocol.source.files import shipped_file

COPIES = 60
_ANY = QEventLoop.ProcessEventsFlag.AllEvents
SETTLES_MS = 80
"""After a selection the page and the numbers follow; the next selection is measured when they are painted."""
ITEM = ("questionnaires", "liquid", "items", 3)


def timed(act: Callable[[], object], paint: Callable[[], None] = QApplication.processEvents) -> tuple[float, float]:
    """Return the wall and CPU time [ms] until the change by an act is painted.

    `QApplication.sendPostedEvents` as ``paint`` paints what is changed at once, without what timers do afterwards.
    """
    wall, cpu = time.perf_counter(), time.process_time()
    act()
    paint()
    return (time.perf_counter() - wall) * 1e3, (time.process_time() - cpu) * 1e3


def grown(text: str) -> str:
    """Return a study with many questionnaires of its own, which no block asks."""
    match = re.search(r"(?ms)^\[questionnaires\.liquid\].*?(?=^\[(?!\[)[a-z]+\.(?!liquid))", text)
    assert match is not None
    copies = [match[0].replace("questionnaires.liquid", f"questionnaires.copy_{at}") for at in range(COPIES)]
    return text + "\n" + "\n".join(copies)


def main(edits: int = 60) -> None:
    """Edit, open and select, and print the table."""
    application = QApplication.instance() or QApplication([])
    assert isinstance(application, QApplication)
    rows: list[tuple[str, str, list[tuple[float, float]]]] = []
    with tempfile.TemporaryDirectory() as folder:
        os.environ["LIQUID_STUDY_WORKSPACE"] = folder
        protocols = Path(folder) / "protocols"
        protocols.mkdir()
        text = shipped_file("rek2024").read_text("utf-8").replace('name = "rek2024"', 'name = "edited"')
        (protocols / "edited.toml").write_text(text, encoding="utf-8", newline="\n")
        (protocols / "largest.toml").write_text(
            grown(text.replace('"edited"', '"largest"')), encoding="utf-8", newline="\n"
        )
        controllers: list[DesignerController] = []

        def enter() -> None:
            controllers.append(DesignerController(Path(folder) / "results"))
            window = MainWindow({"home": Place, "designer": lambda: controllers[0].place})
            window.resize(1600, 1000)
            window.show()
            window.activateWindow()
            window.go("designer")
            windows.append(window)

        windows: list[MainWindow] = []
        rows.append(("place entered first", "400", [timed(enter)]))
        controller, window = controllers[0], windows[0]
        lines = len((protocols / "largest.toml").read_text("utf-8").splitlines())
        rows.append((f"opening a study of {lines} lines", "500", [timed(lambda: controller.open("largest"))]))
        QTest.qWait(1000)
        controller.open("edited")
        paths = [row.path for row in controller.place.outline.rows if len(row.path) > 1]
        selected = []
        for path in paths:
            selected.append(timed(lambda at=path: controller.editing.select(at), QApplication.sendPostedEvents))
            QTest.qWait(SETTLES_MS)
        rows.append(("selection in outline → form painted", "50", selected))
        controller.editing.select(ITEM)
        QTest.qWait(500)
        row = next(row for row in controller.place.form.rows if row.row.path == (*ITEM, "text"))
        field = (row.field.findChildren(QLineEdit) or row.field.findChildren(QPlainTextEdit))[0]
        field.setFocus()
        keys = []
        for _ in range(edits):
            keys.append(timed(lambda: QTest.keyClick(field, Qt.Key.Key_A), QApplication.sendPostedEvents))
            QApplication.processEvents()
        rows.append(("key press → letter", "16", keys))
        painted = []
        for _ in range(edits):
            QTest.keyClick(field, Qt.Key.Key_B)
            painted.append(timed(controller.place.flush))
        assert "bb" in str(controller.preview.view.page)
        rows.append(("edit → live page painted", "100", painted))
        print("                                      goal   wall p50    p95    CPU p50    p95  [ms]")
        for what, goal, took in rows:
            wall, cpu = (np.percentile([pair[at] for pair in took], (50, 95)) for at in (0, 1))
            print(f"{what:<36} {goal:>6} {wall[0]:9.1f} {wall[1]:7.1f} {cpu[0]:9.1f} {cpu[1]:7.1f}")
        window.close()


if __name__ == "__main__":
    main(*(int(value) for value in sys.argv[1:]))
