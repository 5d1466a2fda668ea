"""The display test: the photodiode's patch and frames, full-screen where a participant would look.

Frames are asked for as a session asks for them, and the time of each painting is kept; the patch is the tank's own.
"""

import time
from collections import deque
from collections.abc import Callable
from itertools import pairwise
from typing import Final

from PySide6.QtCore import QRect, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QCloseEvent, QColor, QKeyEvent, QPainter, QPaintEvent, QScreen
from PySide6.QtWidgets import QLabel, QWidget

from study_app.gui.display.screens import Frames
from study_app.gui.kit.fields import LEAST_WORDS, Editor, choice, number
from study_app.gui.participant.tank.layers import paint_patch, patch_place
from study_app.gui.theme.theme import PARTICIPANT
from study_app.gui.theme.themed import apply_theme
from study_app.gui.widgets.boxes import STRETCH, grid, hbox, vbox
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import figures, label
from study_app.gui.widgets.numbers import write_number
from study_app.store.workstation import OFFSET_MS, SPREAD_MS, DisplayOffset

LEAST_S: Final = 2.0
KEPT_S: Final = 10.0
LATE: Final = 1.5  # so many refreshes of the screen apart, at least one was missed


class FrameTimes:
    """Takes the time of every frame.

    Parameters
    ----------
    refresh_hz : how often the screen shows one, as the system says
    least_s : so long frames are taken before anything is said of them
    """

    def __init__(self, refresh_hz: float, least_s: float = LEAST_S) -> None:
        self.refresh_hz = refresh_hz if refresh_hz > 0 else 60.0
        self._least_ns = round(1e9 * least_s)
        self._times: deque[int] = deque()

    def add(self, time_ns: int) -> None:
        """Take a frame's time [ns]; older than ten seconds are forgotten."""
        self._times.append(time_ns)
        while time_ns - self._times[0] > 1e9 * KEPT_S:
            self._times.popleft()

    def words(self) -> tuple[str, ...]:
        """Return rate, median gap, 99th percentile of the gaps and refreshes missed; dashes until there are enough."""
        times = list(self._times)
        if len(times) < 3 or times[-1] - times[0] < self._least_ns:
            return ("–",) * len(NAMES)
        gaps_ms = sorted((late - early) / 1e6 for early, late in pairwise(times))
        refresh_ms = 1000 / self.refresh_hz
        return (
            f"{1e9 * (len(times) - 1) / (times[-1] - times[0]):.1f} of {self.refresh_hz:.1f} Hz",
            f"{gaps_ms[len(gaps_ms) // 2]:.2f} ms",
            f"{gaps_ms[min(len(gaps_ms) - 1, int(0.99 * len(gaps_ms)))]:.2f} ms",
            str(sum(round(gap / refresh_ms) - 1 for gap in gaps_ms if gap > LATE * refresh_ms)),
        )


REPORT_MS = 500
INTERVAL_MS = (50.0, 5000.0)
FIRST_MS = 500.0
FORM_PX = 320
NAMES = ("Frames painted", "Median gap", "99 % of gaps within", "Missed in 10 s")
LEAST = QSize(960, 600)
HOWS = ("photodiode", "high-speed camera", "data sheet")
DECIMALS = 2


class OffsetForm(QWidget):
    """Two numbers and a way; ``kept(mean [ms], spread [ms], how)``, and ``forgotten``."""

    kept = Signal(float, float, str)
    forgotten = Signal()

    def __init__(self) -> None:
        super().__init__()
        fields = (
            number("mean", "Mean", "ms", OFFSET_MS, DECIMALS, may_miss=False),
            number("spread", "Spread", "ms", SPREAD_MS, DECIMALS),
            choice("how", "Measured by", {way: way.capitalize() for way in HOWS}),
        )
        self.editors = {one.name: Editor(one) for one in fields}
        self.said = label("", "label", "text2", wraps=True, weight=400, tabular=True)
        self.said.setMinimumWidth(LEAST_WORDS)
        self.keep = ActionButton("save", "Save offset", height=38)
        self.forget = ActionButton("", "Forget", height=38)
        foot = hbox(self.keep, self.forget, STRETCH, spacing=12)
        vbox(self.said, *self.editors.values(), foot, spacing=8, margins=0, parent=self)
        self.keep.clicked.connect(self._keep)
        self.forget.clicked.connect(self.forgotten)

    def show_offset(self, offset: DisplayOffset | None, screen: str) -> None:
        """Show what was measured; of another screen than ``screen`` it is said so."""
        self.forget.setEnabled(offset is not None)
        self.said.setText(offset_words(offset, screen))
        if offset is not None:
            for name, value in (("mean", offset.mean_ms), ("spread", offset.spread_ms), ("how", offset.how)):
                self.editors[name].show_value(value)

    def _keep(self) -> None:
        found = []
        for editor in self.editors.values():
            try:
                found.append(editor.value)
            except ValueError as refusal:
                editor.show_refusal(str(refusal))
                editor.control.setFocus()
                return
        mean_ms, spread_ms, how = found
        self.kept.emit(mean_ms, spread_ms or 0.0, how)


def offset_words(offset: DisplayOffset | None, screen: str) -> str:
    """Return what is known of a screen's offset, in a sentence."""
    if offset is None:
        return (
            "Not measured. The screen shows each frame slightly later; the delay is recorded as “not measured” in "
            "every receipt."
        )
    text = f"{write_number(offset.mean_ms, DECIMALS)} ± {write_number(offset.spread_ms, DECIMALS)} ms"
    when = f", {offset.measured}" if offset.measured else ""
    where = "" if offset.screen == screen else f" for another screen ({offset.screen}): not used here"
    return f"{text} by {offset.how}{when}{where}."


class DisplayTest(QWidget):
    """One screen under test; Esc leaves, and ``left`` comes when the window has gone.

    Parameters
    ----------
    screen_words : which screen it is, for the heading
    refresh_hz : how often it shows a frame, as the system says
    least_s : so long frames are counted before anything is said of them
    """

    left = Signal()

    def __init__(
        self,
        screen_words: str,
        refresh_hz: float,
        *,
        now_ns: Callable[[], int] = time.perf_counter_ns,
        least_s: float = LEAST_S,
    ) -> None:
        super().__init__()
        self.setWindowTitle("Display test")
        self.setMinimumSize(LEAST)
        self._now_ns = now_ns
        self.times = FrameTimes(refresh_hz, least_s)
        self.lit = False
        self.toggles = 0
        self._toggled_ns = now_ns()
        self.interval_ms = FIRST_MS
        self._unpainted = False
        self.interval = Editor(number("interval", "Interval", "ms", INTERVAL_MS))
        self.interval.setFixedWidth(FORM_PX)
        self.interval.show_value(FIRST_MS)
        self.values: list[QLabel] = [figures("–", "number") for _ in NAMES]
        self.leave = ActionButton("", "Leave (Esc)", height=40)
        self._lay_out(screen_words)
        self.leave.clicked.connect(self.close)
        self.interval.changed.connect(lambda _name, value: self._set_interval(value))
        apply_theme(self, PARTICIPANT)
        self.frames = Frames(self.times.refresh_hz, now_ns=now_ns, parent=self)
        self.frames.due.connect(self.frame)
        self.report_timer = QTimer(self, interval=REPORT_MS)
        self.report_timer.timeout.connect(self.show_figures)

    def _lay_out(self, screen_words: str) -> None:
        titles = vbox(label("Display test", "title"), label(screen_words, "body", "text2"), spacing=2)
        head = hbox(titles, STRETCH, (self.leave, 0, Qt.AlignmentFlag.AlignTop))
        cells = grid(40, 2)
        for place, (name, value) in enumerate(zip(NAMES, self.values, strict=True)):
            value.setAccessibleName(name)
            cells.addWidget(label(name, "label", "text2"), 0, place)
            cells.addWidget(value, 1, place)
        cells.setColumnStretch(len(NAMES), 1)
        toggling = vbox(label("Photodiode's patch", "card"), self.interval, spacing=6)
        foot = hbox(toggling, STRETCH)
        vbox(head, cells, foot, STRETCH, spacing=14, margins=(40, 20, 40, 20), parent=self)

    def open_on(self, screen: QScreen) -> None:
        self.setScreen(screen)
        self.setGeometry(screen.geometry())
        self.showFullScreen()
        self.activateWindow()
        self.begin()

    def begin(self) -> None:
        self._toggled_ns = self._now_ns()
        self.frames.start()
        self.report_timer.start()

    def frame(self) -> None:
        """Ask for a frame, as a session does; the patch toggles when its time has come."""
        now_ns = self._now_ns()
        if now_ns - self._toggled_ns >= 1e6 * self.interval_ms:
            self._toggled_ns = now_ns
            self.lit = not self.lit
            self.toggles += 1
        self._unpainted = True
        self.update(self.patch_area())

    def show_figures(self) -> None:
        for value, words in zip(self.values, self.times.words(), strict=True):
            value.setText(words)

    def patch_area(self) -> QRect:
        return patch_place(self.width(), self.height()).toAlignedRect()

    def _set_interval(self, value: float | None) -> None:
        self.interval_ms = value or FIRST_MS
        self.interval.show_value(self.interval_ms)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(event.rect(), QColor(PARTICIPANT.window))
        paint_patch(painter, patch_place(self.width(), self.height()), lit=self.lit)
        painter.end()
        if self._unpainted:
            self._unpainted = False
            self.times.add(self._now_ns())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            self.close()
        else:
            super().keyPressEvent(event)

    def closeEvent(self, event: QCloseEvent) -> None:
        self.frames.stop()
        self.report_timer.stop()
        super().closeEvent(event)
        self.left.emit()
