"""How fast the designer's place is: python tests/benchmarks/windows/designer_place.py [STUDY] prints milliseconds.

A copy of the study (rek2024) is opened without a screen, every element of its outline is selected twice, and texts are
edited. Where other programs keep the cores busy, the processor's time says more than the clock's.
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[3]))
os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

BUDGETS = {"place entered first": 400, "open": 500, "select": 50, "key press": 16, "edit to form and file": 100}


def main(name: str) -> None:
    """Print the table for a study that ships with the program."""
    folder = Path(tempfile.mkdtemp())
    os.environ["LIQUID_STUDY_WORKSPACE"], os.environ["LIQUID_STUDY_DATA"] = str(folder), str(folder / "data")
    from PySide6.QtTest import QTest

    import study_app.app.main_controller  # noqa: F401 - what the running program has loaded before
    from study_app.gui.application import application_here
    from study_app.protocol.source.files import shipped_file
    from study_app.viewmodels.designer.requests import SetValue

    application = application_here()
    (folder / "protocols").mkdir()
    text = shipped_file(name).read_text(encoding="utf-8").replace(f'name = "{name}"', 'name = "measured"')
    (folder / "protocols" / "measured.toml").write_text(text, encoding="utf-8")
    times: dict[str, list[tuple[float, float]]] = {what: [] for what in BUDGETS}

    def measure(what: str, act: Callable[[], object]) -> None:
        begin, cpu = time.perf_counter(), time.process_time()
        act()
        application.processEvents()
        times[what].append((1e3 * (time.perf_counter() - begin), 1e3 * (time.process_time() - cpu)))

    def enter() -> None:
        from study_app.app.designer.controller import DesignerController

        nonlocal designer
        designer = DesignerController(folder / "results")
        designer.place.resize(1528, 1000)
        designer.place.show()
        designer.place.enter()

    designer: object = None
    measure("place entered first", enter)
    measure("open", lambda: designer.open("measured"))
    paths = [row.path for row in designer.place.outline.rows if row.path]
    for path in [*paths, *paths]:
        measure("select", lambda path=path: designer.editing.select(path))
    designer.editing.select(("study",))
    for version in range(30):
        asked = SetValue(("study", "version"), f"0.{version}")
        measure("edit to form and file", lambda asked=asked: designer.editing.ask(asked))
    line = next(row for row in designer.place.form.rows if row.row.row.path[-1] == "version").field.line
    line.setFocus()
    for key in "0123456789" * 2:
        measure("key press", lambda key=key: QTest.keyClicks(line, key))
    print("| | budget ms | median ms | 95 % ms | median of a core ms | 95 % of a core ms |")
    print("| --- | --- | --- | --- | --- | --- |")
    for what, budget in BUDGETS.items():
        clock, core = ([one[at] for one in times[what]] for at in (0, 1))
        last = [sorted(one)[int(0.95 * (len(one) - 1))] for one in (clock, core)]
        middle = [statistics.median(one) for one in (clock, core)]
        print(f"| {what} | {budget} | {middle[0]:.0f} | {last[0]:.0f} | {middle[1]:.0f} | {last[1]:.0f} |")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "rek2024")
