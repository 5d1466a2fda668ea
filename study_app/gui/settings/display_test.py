"""The display test: the photodiode's patch, greys, lines and frames, full-screen where a participant would look.

Frames are asked for as a session asks for them, and the time of each painting is kept; the patch is the tank's own.
"""

import time
from collections.abc import Callable

from PySide6.QtCore import QRect, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QCloseEvent, QColor, QKeyEvent, QPainter, QPaintEvent, QScreen
from PySide6.QtWidgets import QBoxLayout, QGridLayout, QLabel, QWidget

from study_app.gui.display.frame_clock import Frames
from study_app.gui.participant.tank.photodiode_patch import paint_patch, patch_place
from study_app.gui.settings.display_offset import OffsetForm
from study_app.gui.settings.measured_number import LEAST_WORDS
from study_app.gui.settings.pixel_patterns import GreyRamp, LineField
from study_app.gui.theme.theme import PARTICIPANT
from study_app.gui.theme.themed import apply_theme
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import figures, label
from study_app.gui.widgets.number_field import NumberField, write_number
from study_app.store.workstation import DisplayOffset
from study_app.viewmodels.frame_times import LEAST_S, FrameFigures, FrameTimes

REPORT_MS = 500
INTERVAL_MS = (50.0, 5000.0)
FIRST_MS = 500.0
NAMES = ("Frames painted", "Median gap", "99 % of gaps within", "Missed in 10 s")
LEAST = QSize(960, 600)


class DisplayTest(QWidget):
    """One screen under test; Esc leaves.

    ``kept(mean [ms], spread [ms], how)`` where an offset is to be kept, ``forgotten`` where it is not to be; ``left``
    when the window has gone.

    Parameters
    ----------
    screen_words
        Which screen it is, for the heading.
    refresh_hz
        How often it shows a frame, as the system says.
    least_s
        So long frames are counted before anything is said of them.
    """

    kept = Signal(float, float, str)
    forgotten = Signal()
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
        self.interval = NumberField()
        self.interval.setFixedWidth(88)
        self.interval.setAccessibleName("Interval of the patch, ms")
        self.interval.show_text(write_number(FIRST_MS, 0))
        self.values: list[QLabel] = [figures("–", "number") for _ in NAMES]
        self.offset = OffsetForm()
        self.leave = ActionButton("", "Leave (Esc)", height=40)
        self._lay_out(screen_words)
        self._connect()
        apply_theme(self, PARTICIPANT)
        self.frames = Frames(self.times.refresh_hz, now_ns=now_ns, parent=self)
        self.frames.due.connect(self.frame)
        self.report_timer = QTimer(self)
        self.report_timer.setInterval(REPORT_MS)
        self.report_timer.timeout.connect(self.show_figures)

    def _lay_out(self, screen_words: str) -> None:
        titles = vbox(label("Display test", "title"), label(screen_words, "body", "text2"), spacing=2)
        head = hbox(titles, STRETCH, (self.leave, 0, Qt.AlignmentFlag.AlignTop))
        ramp, fields = (GreyRamp(), 2), (self._fields(), 3)
        vbox(head, self._figures(), ramp, fields, self._foot(), spacing=18, margins=(40, 32, 40, 32), parent=self)

    def _figures(self) -> QGridLayout:
        """Return the live figures, a name over each."""
        grid = QGridLayout()
        grid.setHorizontalSpacing(40)
        grid.setVerticalSpacing(2)
        for place, (name, value) in enumerate(zip(NAMES, self.values, strict=True)):
            value.setAccessibleName(name)
            grid.addWidget(label(name, "label", "text2"), 0, place)
            grid.addWidget(value, 1, place)
        grid.setColumnStretch(len(NAMES), 1)
        return grid

    def _fields(self) -> QBoxLayout:
        """Return the fields of lines, and what to look for in them."""
        fields = [(LineField(thick, standing=standing), 2) for thick in (1, 2) for standing in (True, False)]
        words = label(
            "Every line is 1 or 2 pixels wide. If a field looks uniformly grey, shimmers or shows broad bands, the "
            "system scales the picture: set the screen to its native resolution. All seventeen greys above should "
            "differ.",
            "body",
            "text2",
            wraps=True,
        )
        words.setMinimumWidth(LEAST_WORDS)
        return hbox(*fields, (words, 3), spacing=16)

    def _foot(self) -> QBoxLayout:
        """Return the patch's interval and the offset, left of where the patch is."""
        self.why = label("", "label", "bad", wraps=True)
        titles = label("Photodiode's patch", "card"), label("Interval, ms", "label", "text2")
        toggling = vbox(*titles, self.interval, self.why, STRETCH, spacing=6)
        measured = vbox(label("Display offset", "card"), self.offset, STRETCH, spacing=6)
        return hbox(toggling, (measured, 1), spacing=48, margins=(0, 0, 120, 0))  # the patch's corner is free

    def _connect(self) -> None:
        self.leave.clicked.connect(self.close)
        self.interval.entered.connect(self._set_interval)
        self.interval.unread.connect(lambda _text: self._refuse_interval())
        self.offset.kept.connect(self.kept)
        self.offset.forgotten.connect(self.forgotten)

    def open_on(self, screen: QScreen) -> None:
        """Fill a screen and begin."""
        self.setScreen(screen)
        self.setGeometry(screen.geometry())
        self.showFullScreen()
        self.activateWindow()
        self.begin()

    def begin(self) -> None:
        """Begin to paint and to count."""
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
        """Show what the frames come to."""
        for value, words in zip(self.values, figures_words(self.times.figures(), self.times.refresh_hz), strict=True):
            value.setText(words)

    def show_offset(self, offset: DisplayOffset | None, screen: str) -> None:
        """Show the offset that is kept."""
        self.offset.show_offset(offset, screen)

    def patch_area(self) -> QRect:
        """Return where the photodiode's patch is."""
        return patch_place(self.width(), self.height()).toAlignedRect()

    def _set_interval(self, value: float) -> None:
        if not INTERVAL_MS[0] <= value <= INTERVAL_MS[1]:
            self._refuse_interval()
            return
        self.interval_ms = value
        self.interval.show_state("")
        self.interval.show_text(write_number(value, 0))
        self.why.setText("")

    def _refuse_interval(self) -> None:
        self.interval.show_state("refused")
        self.why.setText(f"From {INTERVAL_MS[0]:g} to {INTERVAL_MS[1]:g} ms.")

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint ground and patch, and keep the time of a frame that was asked for."""
        painter = QPainter(self)
        painter.fillRect(event.rect(), QColor(PARTICIPANT.window))
        paint_patch(painter, patch_place(self.width(), self.height()), lit=self.lit)
        painter.end()
        if self._unpainted:
            self._unpainted = False
            self.times.add(self._now_ns())

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802 - Qt's name
        """Leave on Esc."""
        if event.key() == Qt.Key.Key_Escape:
            self.close()
        else:
            super().keyPressEvent(event)

    def closeEvent(self, event: QCloseEvent) -> None:  # noqa: N802 - Qt's name
        """Stop painting."""
        self.frames.stop()
        self.report_timer.stop()
        super().closeEvent(event)
        self.left.emit()


def figures_words(found: FrameFigures | None, refresh_hz: float) -> tuple[str, str, str, str]:
    """Return the figures as they are shown; dashes until there are enough frames."""
    if found is None:
        return "–", "–", "–", "–"
    return (
        f"{found.rate_hz:.1f} of {refresh_hz:.1f} Hz",
        f"{found.median_ms:.2f} ms",
        f"{found.p99_ms:.2f} ms",
        str(found.missed),
    )
