"""How long the participant's pages take to paint, in software, at 1920 × 1080: run me, I print two tables.

The tank: whole frames are painted as after a change of page; dirty updates as between two frames of a moving ball in
the ring whose dwell arc grows. The changes of page: from the order to show a page until it is painted whole, each kind
of page many times; the tank's still images are painted ahead while a text is read, as in a session. Times are of the
widgets' work including Qt's own share, without the transport to a screen.
"""

import math
import os
import statistics
import time

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from PySide6.QtWidgets import QApplication

from study_app.gui.participant.tank_widget import TankWidget
from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.load import load
from study_app.protocol.model import Protocol
from study_app.protocol.questions.question import ItemView
from study_app.protocol.trials.tasks.reach import Reach
from study_app.protocol.wording.languages import words
from study_app.session.pages import Page, PausePage, Progress, QuestionnairePage, TaskPage, TextPage
from study_app.session.tasks import TaskView
from study_app.session.trial import TankView

SIZE = (1920, 1080)
FRAMES = 400
LIMIT_MS = 4.0
CHANGES = 20
LIMIT_CHANGE_MS = 50.0


def page() -> TaskPage:
    """Return a reaching task as in part 2 of the thesis' study."""
    instruction = "Hold the ball in the lit ring until it closes"
    task = Reach(
        kind="reach", targets_mm=((-30, 0, 0), (30, 0, 0)), radius_mm=6, dwell_s=0.5, count=12, instruction=instruction
    )
    return TaskPage(
        trial=6,
        instruction=instruction,
        task=task,
        workspace_m=(0.1, 0.06, 0.06),
        body_radius_m=0.0034,
        progress=Progress(2, 2, "Delay setting 3", 3, 7),
    )


def view(frame: int) -> TankView:
    """Return the view of a frame: the ball sways through the tank, the dwell arc grows."""
    tick = math.tau * frame / 120
    position = (0.03 * math.sin(tick), 0.015 * math.sin(1.3 * tick), 0.02 * math.cos(0.7 * tick))
    task = TaskView(lit=frame // 90 % 2, reached=frame // 90, of=12, dwell=frame % 30 / 30, elapsed_s=frame / 60)
    return TankView(position_m=position, task=task, sample_time_ns=frame * 16_666_667)


def row(name: str, times_ms: list[float]) -> str:
    """Return a line of the table."""
    ordered = sorted(times_ms)
    p95 = ordered[round(0.95 * (len(ordered) - 1))]
    return f"{name:<28}{statistics.median(ordered):>9.2f}{p95:>9.2f}{ordered[-1]:>9.2f}"


def pages() -> list[tuple[str, Page]]:
    """Return the pages of the thesis' study in the order in which they follow each other, with a pause."""
    study = load("rek2024")
    asked = study.questionnaires["liquid"]
    items = tuple(
        ItemView(item.id, n, study.text(item.text, "en"), item.required) for n, item in enumerate(asked.items, 1)
    )
    answers = QuestionnairePage(
        trial=6,
        title="Liquid setting 1",
        intro=study.text(asked.intro, "en"),
        items=items,
        labels=study.labels(asked.scale, "en"),
        cannot_judge=None,
        progress=Progress(1, 2, "Liquid setting 1", 1, 3),
    )
    return [
        ("consent", text(study, "consent")),
        ("instructions", text(study, "instructions")),
        ("tank", page()),
        ("questionnaire, nine items", answers),
        ("pause over it", PausePage(force_off=False)),
        ("questionnaire, back again", answers),
    ]


def text(study: Protocol, name: str) -> TextPage:
    """Return a page of the study, with the tank coming after it."""
    shown = study.pages[name]
    paragraphs = study.paragraphs(shown.body, "en")
    return TextPage(name, shown.kind, study.text(shown.title, "en"), paragraphs, "Continue", coming=page())


def change_pages(app: QApplication) -> dict[str, list[float]]:
    """Return how long each kind of page took from the order to show it until it was painted whole [ms]."""
    window = ParticipantWindow(words("en"), clock=time.monotonic, windowed=True)
    window.resize(*SIZE)
    window.show()
    app.processEvents()
    took: dict[str, list[float]] = {name: [] for name, _ in pages()}
    for _ in range(CHANGES):
        for name, shown in pages():
            if isinstance(shown, TaskPage):
                read_until_painted(app, window)
            start = time.perf_counter()
            window.show_page(shown)
            app.processEvents()
            took[name].append(1e3 * (time.perf_counter() - start))
    window.may_close = True
    window.close()
    return took


def read_until_painted(app: QApplication, window: ParticipantWindow) -> None:
    """Let the text be read until the tank after it is painted."""
    until = time.monotonic() + 5
    while window.painting is None and time.monotonic() < until:
        app.processEvents()
    if window.painting is not None:
        window.painting.join()


def main() -> None:
    """Paint and print."""
    app = QApplication.instance() or QApplication([])
    assert isinstance(app, QApplication)
    paint_tank(app)
    print()
    print(f"change of page, {CHANGES} of each [ms]")
    print(f"{'':<28}{'first':>9}{'median':>9}{'p95':>9}{'most':>9}")
    for name, times in change_pages(app).items():
        print(f"{row(name, times)[:28]}{times[0]:>9.2f}{row(name, times)[28:]}")
    print(f"limit for a change of page {LIMIT_CHANGE_MS:g} ms")


def paint_tank(app: QApplication) -> None:
    """Paint the tank and print how long it took."""
    tank = TankWidget(page(), words("en"))
    tank.resize(*SIZE)
    start = time.perf_counter()
    tank.show()
    tank.show_view(view(0))
    app.processEvents()
    tank.repaint()
    first = 1e3 * (time.perf_counter() - start)
    whole: list[float] = []
    dirty: list[float] = []
    place: list[float] = []
    for frame in range(1, FRAMES + 1):
        start = time.perf_counter()
        tank.show_view(view(frame))
        shown = time.perf_counter()
        app.processEvents()
        dirty.append(1e3 * (time.perf_counter() - shown))
        place.append(1e3 * (shown - start))
        start = time.perf_counter()
        tank.repaint()
        whole.append(1e3 * (time.perf_counter() - start))
    ratio = tank.devicePixelRatioF()
    print(f"tank at {SIZE[0]} x {SIZE[1]}, pixel ratio {ratio:g}, {app.platformName()}, {FRAMES} frames [ms]")
    print(f"{'':<28}{'median':>9}{'p95':>9}{'most':>9}")
    print(row("whole frame", whole))
    print(row("dirty update", dirty))
    print(row("placing (show_view)", place))
    print(f"first frame with its images  {first:.0f} ms; limit for a whole frame {LIMIT_MS:g} ms")


if __name__ == "__main__":
    main()
