"""The replay of a recorded trial: one moment with arrows, forces and time line; its window and its export as video."""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPointF, QSize, Qt, QTimer
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent, QPen, QPolygonF, QRegion
from PySide6.QtWidgets import QDialog, QSizePolicy, QStackedWidget, QWidget

from study_app.errors import StudyError
from study_app.gui.kit.commands import Command, connect_button
from study_app.gui.kit.dialogs import Work
from study_app.gui.kit.fields import Field
from study_app.gui.kit.opening import open_here
from study_app.gui.participant.tank.arrows import HEIGHTS, Arrow, arrows_area, paint_arrows
from study_app.gui.participant.tank.frame import DrawnPart
from study_app.gui.participant.tank_widget import TankWidget
from study_app.gui.theme.theme import LIGHT, TANK, Theme, font
from study_app.gui.theme.themed import Themed, apply_theme, remove_widget
from study_app.gui.widgets.accessible import describe_plot
from study_app.gui.widgets.background import Background
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.gui.widgets.cards import Chip, MaskedPanel, smooth_painter
from study_app.gui.widgets.controls import ActionButton, Choice, Toggle
from study_app.gui.widgets.labels import Elided, figures, label
from study_app.gui.widgets.live_plots import STROKE, Floats, Plot, draw_quickly, tick_step, tick_text
from study_app.gui.widgets.numbers import MARGIN, Range, Slider
from study_app.protocol.wording import words_or_english
from study_app.session.tasks import TankView
from study_app.session.watch import Kind, Watched, read_watched
from study_app.store.files import write_file
from study_app.video.encoding import VideoWriter

LEAST_N, LEAST_MPS = 0.05, 0.01  # lower peaks do not enlarge the scale
_MAX_POINTS: Final = 800  # of a curve
_AXIS_PX: Final = 60  # the width of the plot's numbers
_FORCES_HIDDEN: Final = "Hidden while the study is blinded"
_UNBLIND_HINT: Final = "Run liquid-study unblind RESULTS to show forces."


class _WatchedTank(TankWidget):
    """The participant's tank with arrows of force and velocity, which participants never see."""

    arrows: tuple[Arrow, ...] = ()

    def __init__(self, shown: Watched) -> None:
        super().__init__(shown.page, words_or_english(shown.language), photodiode=False)
        self.setMinimumSize(420, 240)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)

    def show_moment(self, view: TankView, arrows: tuple[Arrow, ...]) -> None:
        """Draw a view with arrows, whose vectors are relative to the water's height."""
        self._static_images()
        height_m = self._box.water - self._box.floor
        self.arrows = tuple(
            Arrow(name, start_m, (height_m * x, height_m * y, height_m * z), colour)
            for name, start_m, (x, y, z), colour in arrows
        )
        self.show_view(view)

    def _frame_parts(self) -> dict[str, DrawnPart]:
        parts = super()._frame_parts()
        if self.camera is not None and self.arrows:
            parts["arrows"] = DrawnPart(self.arrows, arrows_area(self.camera, self.arrows))
        return parts

    def _paint_parts(self, painter: QPainter, region: QRegion) -> None:
        if self.camera is not None:
            paint_arrows(painter, self.camera, self.arrows)
        super()._paint_parts(painter, region)


class _ForcePlot(Plot):
    """The sent force as a line and the requested force as an area behind it [N] over time [s], with a cursor."""

    def __init__(self, shown: Watched) -> None:
        super().__init__()
        sizes = [np.linalg.norm(np.nan_to_num(shown.samples[name]), axis=1) for name in ("force_n", "device_force_n")]
        times_s, (low, high) = _thin_out(shown.times_s, sizes[0])
        self.requested = pg.PlotCurveItem(times_s, high, fillLevel=0.0, antialias=True)
        times_s, (low, high) = _thin_out(shown.times_s, sizes[1])
        self.sent = pg.PlotCurveItem(np.repeat(times_s, 2), np.column_stack([low, high]).ravel(), antialias=True)
        draw_quickly(self.sent, solid=True)
        self.cursor = pg.InfiniteLine(angle=90)
        for item in (self.requested, self.sent, self.cursor):
            self.box.addItem(item)
        peak = max(LEAST_N, *(float(size.max()) for size in sizes))
        step_n, step_s = tick_step(peak, 3), tick_step(shown.ends_s - shown.begins_s, 8)
        self.show_ticks("left", [(step_n * k, tick_text(step_n * k)) for k in range(int(peak / step_n + 1e-9) + 1)])
        first, last = np.ceil(shown.begins_s / step_s), np.floor(shown.ends_s / step_s)
        self.show_ticks("bottom", [(step_s * k, f"{tick_text(step_s * k)} s") for k in np.arange(first, last + 1)])
        self.box.setXRange(shown.begins_s, shown.ends_s, padding=0)
        self.box.setYRange(0.0, 1.12 * peak, padding=0)
        description = f"Magnitude of the forces sent and requested during the trial, up to {peak:.2f} N."
        describe_plot(self, "Force on the hand", description)
        self.apply_theme(LIGHT)

    def apply_theme(self, theme: Theme) -> None:
        super().apply_theme(theme)
        area = QColor(theme.text3)
        self.requested.setPen(self.stroke(theme.text3, 1.0))
        area.setAlpha(70)
        self.requested.setBrush(area)
        self.sent.setPen(self.stroke(theme.accent, STROKE))
        self.cursor.setPen(self.stroke(theme.text, 1.4))


def _thin_out(times_s: Floats, values: Floats) -> tuple[Floats, tuple[Floats, Floats]]:
    """Return about `_MAX_POINTS` times (k,), and the least and greatest values (k,) from each to the next."""
    starts = np.arange(0, len(values), max(1, len(values) // _MAX_POINTS))
    return times_s[starts], (np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts))


class _TimeLine(Slider):
    """The time line of a trial with its marks: targets as triangles, answers as diamonds, events as lines."""

    def __init__(self, shown: Watched) -> None:
        super().__init__()
        self._shown = shown
        self._range = Range(shown.begins_s, shown.ends_s)
        self.setAccessibleName("Time in seconds")
        self.setFixedHeight(40)

    def show_time(self, at_s: float) -> None:
        self.show_number(self._range, at_s)

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        painter = smooth_painter(self)
        inks: dict[Kind, str] = {"target": self.theme.ok, "answer": self.theme.accent, "event": self.theme.text2}
        for mark in self._shown.marks:
            position, ink = QPointF(self._position_of(mark.at_s), 6), QColor(inks[mark.kind])
            painter.setPen(QPen(ink, 2))
            painter.setBrush(ink)
            if mark.kind == "event":
                painter.drawLine(position + QPointF(0, -5), position + QPointF(0, 6))
                continue
            corners = [(-4, -3), (4, -3), (0, 4)] if mark.kind == "target" else [(-4, 0), (0, -4), (4, 0), (0, 4)]
            painter.drawPolygon(QPolygonF([position + QPointF(*corner) for corner in corners]))


class Stage(QWidget):
    """The complete picture of one moment, also used for the exported video."""

    def __init__(self, shown: Watched) -> None:
        super().__init__()
        self.shown, self.at_s, self.as_seen = shown, shown.begins_s, False
        self.tank, self.line = _WatchedTank(shown), _TimeLine(shown)
        self.forces = None if shown.blinded else _ForcePlot(shown)
        self.numbers, self.happened = figures("", "label"), Elided("label", "text2")
        plot = self.forces or MaskedPanel(_FORCES_HIDDEN, _UNBLIND_HINT)
        plot.setMinimumHeight(88)
        plot.setMaximumHeight(190)
        key = label("" if shown.blinded else "N (line = sent, area = requested)", "small", "text2")
        caption_row = hbox(self.numbers, (self.happened, 1), key, spacing=16, margins=(0, 4, int(MARGIN), 0))
        plot_row = hbox((plot, 1), margins=(0, 0, int(MARGIN), 0))
        line_row = hbox((self.line, 1), margins=(_AXIS_PX - int(MARGIN), 0, 0, 0))
        vbox((self.tank, 3), caption_row, (plot_row, 1), line_row, spacing=4, margins=0, parent=self)
        self._peaks = {
            name: max(minimum, float(np.linalg.norm(np.nan_to_num(shown.samples[name]), axis=1).max()))
            for name, minimum in (("device_force_n", LEAST_N), ("velocity_mps", LEAST_MPS))
        }

    def show_moment(self, at_s: float) -> None:
        """Show a time [s], or the nearest one within the recording."""
        recording = self.shown
        self.at_s = at_s = min(max(at_s, recording.begins_s), recording.ends_s)
        view = recording.view(recording.drawn_s(at_s) if self.as_seen else at_s)
        sample = recording.samples[recording.index(at_s)]
        self.tank.show_moment(view, self._make_arrows(view, sample))
        if self.forces is not None:
            self.forces.cursor.setValue(at_s)
        self.line.show_time(at_s)
        speed = f"{np.linalg.norm(sample['velocity_mps']):.3f} m/s in the scene"
        sent, requested = (np.linalg.norm(sample[name]) for name in ("device_force_n", "force_n"))
        force = () if recording.blinded else (f"sent {sent:.3f} N", f"requested {requested:.3f} N")
        self.numbers.setText("   ".join((f"{at_s:.3f} s", f"sample {recording.index(at_s) + 1}", *force, speed)))
        earlier = [mark for mark in recording.marks if mark.at_s <= at_s]
        self.happened.show_text(f"{earlier[-1].at_s:.2f} s: {earlier[-1].text}" if earlier else "")

    def describe_moment(self) -> None:
        """Describe the displayed moment to screen readers."""
        self.line.setAccessibleDescription(f"{self.numbers.text()}. {self.happened.whole}")

    def _make_arrows(self, view: TankView, sample: Any) -> tuple[Arrow, ...]:
        start = tuple(float(part) for part in view.position_m)
        vectors = [("velocity", "velocity_mps", TANK.wake)]
        if not self.shown.blinded:
            vectors.insert(0, ("force", "device_force_n", TANK.proxy_light))
        return tuple(
            Arrow(word, start, tuple(HEIGHTS * np.nan_to_num(sample[name]) / self._peaks[name]), colour)  # type: ignore[arg-type]
            for word, name, colour in vectors
        )


_SIZE: Final = (1180, 800)
_PAINT_MS: Final = 15
_VIDEO_HZ: Final = 30
_SPEEDS: Final = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
_PLAY: Final = Command("play again", "Play, pause", ("Space",))
_STEPS: Final = (
    (Command("sample before", "Previous sample", (",",)), "sample", -1),
    (Command("frame before", "Previous frame", ("Left",)), "frame", -1),
    (Command("frame after", "Next frame", ("Right",)), "frame", 1),
    (Command("sample after", "Next sample", (".",)), "sample", 1),
)
"""Each command with the kind and direction of its step."""
_CAPS: Final = {"Left": "←", "Right": "→"}


class WatchWindow(Themed, QDialog):
    """Replays a trial of a session, which is read in a thread; a sentence replaces what cannot be read.

    Parameters
    ----------
    trial, attempt : numbers of the trial and of its presentation
    presented : the presented condition, for the heading
    """

    def __init__(
        self, parent: QWidget, theme: Theme, folder: Path, trial: int, *, attempt: int, presented: str
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle(f"Trial {trial}, replayed")
        self._folder, self._trial, self._attempt = folder, trial, attempt
        self.stage: Stage | None = None
        self.export_dialog: Work | None = None
        self._reader = Background(self)
        self._reader.done.connect(self._show_recording)
        self._reader.failed.connect(self._show_recording)
        self._timer = QTimer(self, interval=_PAINT_MS, timerType=Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._show_next_moment)
        self._clock_start = (0.0, 0.0)
        self._writing = QTimer(self, interval=0)
        self.sentence = label("Reading…", "body", "text2", wraps=True)
        self.sentence.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.lacking = label("", "label", "warn", wraps=True)
        self.room = QStackedWidget()
        self.room.addWidget(self.sentence)
        self.presented = Chip("neutral", "lock", "Blinded: shown as a code")
        self.interval = Choice()
        self.interval.setAccessibleName("Interval")
        self.seen = Toggle("As the participant saw it")
        self.seen.setToolTip(
            "Shows the ball with the delay that the participant saw; the arrows and curves are not delayed"
        )
        self.export = ActionButton("download", "Export as video…", height=40)
        self.play = ActionButton("play", "Play", cap="Space", height=40)
        self.speed = Choice()
        self.speed.setAccessibleName("Speed")
        for speed in _SPEEDS:
            self.speed.addItem(f"{speed:g}×", speed)
        self.speed.setCurrentIndex(_SPEEDS.index(1.0))
        self.steps = {
            command.id: ActionButton("", kind.capitalize(), cap=_CAPS.get(command.keys[0], command.keys[0]), height=40)
            for command, kind, _ in _STEPS
        }
        for command, *_ in _STEPS:
            self.steps[command.id].setAccessibleName(command.words)
        self.close_button = ActionButton("", "Close", height=40)
        self._lay_out(f"Trial {trial}  ·  {presented}")
        self._connect()
        apply_theme(self, theme)
        available = self.screen().availableSize()
        self.resize(min(_SIZE[0], available.width() - 40), min(_SIZE[1], available.height() - 60))
        self._read_interval(1)

    def _lay_out(self, heading: str) -> None:
        title = label(heading, "title_dense")
        for part in (self.interval, self.speed):
            part.setFont(font("body"))
        self.seen.setFont(font("body"))
        head = hbox(title, self.presented, STRETCH, self.interval, self.seen, self.export, spacing=12)
        before, after = [*self.steps.values()][:2], [*self.steps.values()][2:]
        foot = hbox(*before, self.play, *after, self.speed, STRETCH, self.close_button, spacing=8)
        vbox(head, self.lacking, (self.room, 1), foot, spacing=10, margins=(24, 16, 24, 16), parent=self)
        for button in (self.play, self.export, self.close_button, *self.steps.values()):
            button.setAutoDefault(False)
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # so that a click leaves the focus on the time line
        self._set_enabled(False)

    def _connect(self) -> None:
        actions = {_PLAY.id: _PLAY.action(self.room, self.toggle)}
        for command, kind, way in _STEPS:
            actions[command.id] = command.action(self.room, partial(self.step, kind, way))  # type: ignore[arg-type]
        actions[_PLAY.id].setShortcutContext(
            Qt.ShortcutContext.WidgetWithChildrenShortcut
        )  # otherwise Space would not press a focused button
        for name, button in {_PLAY.id: self.play, **self.steps}.items():
            connect_button(button, actions[name])
        self.interval.activated.connect(lambda at: self._read_interval(at + 1))
        self.seen.toggled.connect(self._show_as_seen)
        self.speed.activated.connect(lambda _at: self._start_clock())
        self.export.clicked.connect(self._ask_export)
        self.close_button.clicked.connect(self.accept)
        self.finished.connect(self._stop_timers)

    def _read_interval(self, interval: int) -> None:
        self.pause()
        self._reader.run(partial(read_watched, self._folder, self._trial, self._attempt, interval))

    def _show_recording(self, shown: Watched | Exception) -> None:
        if self.stage is not None:
            remove_widget(self.stage)
            self.stage = None
        self._set_enabled(isinstance(shown, Watched))
        if not isinstance(shown, Watched):
            sentence = str(shown) or type(shown).__name__
            self.sentence.setText(f"{sentence[:1].upper()}{sentence[1:]}.")
            return
        if self.interval.count() != shown.intervals:
            self.interval.clear()
            self.interval.addItems([f"Interval {number + 1}" for number in range(shown.intervals)])
        self.interval.setVisible(shown.intervals > 1)
        self.seen.setVisible(len(shown.painted_s) > 0)
        self.lacking.setText(shown.lacking)
        self.lacking.setVisible(bool(shown.lacking))
        self.presented.show()
        if not shown.blinded:
            self.presented.show_state("neutral", "eye", shown.presented)
        self.stage = Stage(shown)
        self.stage.line.slid.connect(lambda at_s, _held: self.go(at_s))
        self.room.addWidget(self.stage)
        self.room.setCurrentWidget(self.stage)
        self.stage.line.setFocus()
        self._show_as_seen(self.seen.isChecked())

    def _set_enabled(self, enabled: bool) -> None:
        for part in (self.play, self.export, self.seen, self.interval, self.speed, *self.steps.values()):
            part.setEnabled(enabled)
        if not enabled:
            for part in (self.interval, self.seen, self.presented, self.lacking):
                part.hide()
            self.room.setCurrentWidget(self.sentence)

    def go(self, at_s: float) -> None:
        """Show a time of the trial [s] and stop there."""
        self.pause()
        if self.stage is not None:
            self.stage.show_moment(at_s)
            self.stage.describe_moment()

    def step(self, kind: Literal["sample", "frame"], way: int) -> None:
        """Go to the next or previous sample or frame."""
        if self.stage is not None:
            times_s = self.stage.shown.steps_s(kind)
            side: Literal["left", "right"] = "right" if way > 0 else "left"
            index = int(np.searchsorted(times_s, self.stage.at_s, side)) - (way < 0)
            if 0 <= index < len(times_s):
                self.go(float(times_s[index]))

    @property
    def playing(self) -> bool:
        return self._timer.isActive()

    def toggle(self) -> None:
        """Pause, or play from the current time; from the beginning if it is at the end."""
        if self.playing or self.stage is None:
            self.pause()
            return
        if self.stage.at_s >= self.stage.shown.ends_s:
            self.stage.show_moment(self.stage.shown.begins_s)
        self._start_clock()
        self._timer.start()
        self.play.show_action("pause", "Pause")

    def pause(self) -> None:
        self._timer.stop()
        self.play.show_action("play", "Play")
        if self.stage is not None:
            self.stage.describe_moment()

    def _start_clock(self) -> None:
        """Restart the playback clock at the displayed time."""
        self._clock_start = (time.perf_counter(), 0.0 if self.stage is None else self.stage.at_s)

    def _show_next_moment(self) -> None:
        if self.stage is None:
            return
        started, at_s = self._clock_start
        self.stage.show_moment(at_s + (time.perf_counter() - started) * self.speed.currentData())
        if self.stage.at_s >= self.stage.shown.ends_s:
            self.pause()

    def _show_as_seen(self, as_seen: bool) -> None:
        if self.stage is not None:
            self.stage.as_seen = as_seen
            self.stage.show_moment(self.stage.at_s)

    def _ask_export(self) -> None:
        self.pause()
        dialog = Work(
            self,
            self.theme,
            "Export as video",
            f"{self._file_name} will show this view at {self.speed.currentText()} speed.",
            ActionButton("download", "Export", role="primary"),
            fields=(Field("to", "Folder", "folder", hint="An existing file will be overwritten."),),
            needs={"to": "Please choose a folder."},
            width=600,
        )
        dialog.editors["to"].show_value(str(self._folder.resolve().parents[3]))
        dialog.begun.connect(self._begin_export)
        dialog.stop_asked.connect(self._stop_export)
        dialog.opened.connect(lambda: open_here(Path(dialog.value("to"))))
        dialog.finished.connect(dialog.deleteLater)
        self.export_dialog = dialog
        dialog.open()

    @property
    def _file_name(self) -> str:
        interval = f"-interval-{self.interval.currentIndex() + 1}" if self.interval.count() > 1 else ""
        participant, session = self._folder.parent.name, self._folder.name
        return f"{participant}_{session}_trial-{self._trial:03}{interval}.mp4"

    def _begin_export(self) -> None:
        assert self.export_dialog is not None  # noqa: S101 - it has begun
        pictures = self._write_pictures(Path(self.export_dialog.value("to")).expanduser() / self._file_name)
        self._writing = QTimer(self, interval=0)
        self._writing.timeout.connect(lambda: self._write_next_picture(pictures))
        self._writing.start()

    def _write_next_picture(self, pictures: Iterator[float | Path]) -> None:
        """Write the next picture of the video; show the progress or the result."""
        dialog = self.export_dialog
        assert dialog is not None  # noqa: S101 - it has begun
        try:
            progress = next(pictures)
        except StudyError as error:
            self._writing.stop()
            dialog.show_refused(f"{str(error)[:1].upper()}{str(error)[1:]}.")
            return
        if isinstance(progress, Path):
            self._writing.stop()
            dialog.show_done(f"The video was saved as {progress}.", "Open the folder")
        else:
            dialog.show_progress("Painting…", progress)

    def _write_pictures(self, to: Path) -> Iterator[float | Path]:
        """Write a video; yield the fraction done after each picture, and finally the file."""
        stage = self.stage
        assert stage is not None  # noqa: S101 - the button is disabled without one
        shown_s, size = stage.at_s, stage.grab().size()
        writer = VideoWriter(size.toTuple(), _VIDEO_HZ)  # type: ignore[arg-type]  # a pair of int
        times_s = np.arange(stage.shown.begins_s, stage.shown.ends_s, self.speed.currentData() / _VIDEO_HZ)
        for count, at_s in enumerate(times_s):
            stage.show_moment(float(at_s))
            writer.add(_stage_pixels(stage, size))
            yield count / len(times_s)
        write_file(to, writer.finish())
        stage.show_moment(shown_s)
        yield to

    def _stop_export(self) -> None:
        self._writing.stop()
        if self.export_dialog is not None:
            self.export_dialog.close_stopped()

    def _stop_timers(self) -> None:
        self._timer.stop()
        self._writing.stop()


def _stage_pixels(stage: Stage, size: QSize) -> np.ndarray:
    """Return the pixels of the stage (height, width, 4): blue, green, red, unused."""
    image = stage.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
    if image.size() != size:  # the window was resized meanwhile
        image = image.scaled(size)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(size.height(), image.bytesPerLine() // 4, 4)
    return rows[:, : size.width()].copy()
