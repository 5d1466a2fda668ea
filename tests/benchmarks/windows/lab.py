"""How long a refresh of the liquid lab takes, in software, at 1600 × 900: run me, I print a table.

A refresh is what 30 times a second brings: the view is shown and everything it changed is painted, tank with tail,
both plots, limiters. A change of a parameter also writes the form anew. Times are this thread's own, whatever else the
machine does, with Qt's share and without the transport to a screen; the last column is the median over the aim.
"""

import dataclasses
import os
import statistics
import time
from collections.abc import Callable
from typing import Any

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from PySide6.QtWidgets import QApplication

from study_app.gui.lab.view import LabPlace
from study_app.gui.theme.theme import LIGHT
from study_app.gui.theme.themed import apply_theme
from tests.gui.lab.sample import lab_view, workbench

SIZE = (1600 - 72, 900)  # the rail takes the rest
FRAMES = 150
LIMIT_MS = 8.0


def row(name: str, times_ms: list[float]) -> str:
    """Return a line of the table."""
    ordered = sorted(times_ms)
    p95 = ordered[round(0.95 * (len(ordered) - 1))]
    median = statistics.median(ordered)
    return f"{name:<28}{median:>9.2f}{p95:>9.2f}{ordered[-1]:>9.2f}{median / LIMIT_MS:>9.2f}"


def timed(app: Any, count: int, act: Callable[[int], None]) -> list[float]:
    """Return how long each of ``count`` calls took together with the painting that it asked for [ms]."""
    times = []
    for number in range(count):
        start = time.thread_time()
        act(number)
        app.processEvents()
        times.append(1e3 * (time.thread_time() - start))
    return times


def main() -> None:
    """Paint and print."""
    app = QApplication.instance() or QApplication([])
    views = [lab_view(cut=900 + 40 * step) for step in range(30)]
    place = LabPlace()
    apply_theme(place, LIGHT)
    place.resize(*SIZE)
    place.show()
    first = timed(app, 1, lambda _: place.show_view(views[0]))
    rows = {"refresh": timed(app, FRAMES, lambda k: place.show_view(views[k % len(views)]))}
    plots = {"force": place.force.plot.viewport(), "speed": place.speed.plot.viewport()}
    for name, part in {"tank": place.tank, **plots, "limiters": place.limiters}.items():
        rows[f"  repaint of {name}"] = timed(app, FRAMES, lambda _, it=part: it.repaint())
    benches = [workbench(scaling=2000.0 + 10 * step) for step in range(30)]
    changed = [dataclasses.replace(views[0], workbench=bench) for bench in benches]
    rows["refresh with a change"] = timed(app, FRAMES, lambda k: place.show_view(changed[k % len(changed)]))
    print(f"lab at {SIZE[0]} x {SIZE[1]}, {app.platformName()}, {FRAMES} frames [ms]")
    print(f"{'':<28}{'median':>9}{'p95':>9}{'most':>9}{'of aim':>9}")
    for name, times in rows.items():
        print(row(name, times))
    print(f"first view {first[0]:.0f} ms; aim for a refresh {LIMIT_MS:g} ms")


if __name__ == "__main__":
    main()
