"""The window in which a recorded trial is watched again, and exported as a video."""

import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Final, Literal

import numpy as np
from PySide6.QtCore import QSize, Qt, QTimer
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QDialog, QStackedWidget, QWidget

from study_app.errors import StudyError
from study_app.gui.application import open_here
from study_app.gui.kit.commands import Command, press
from study_app.gui.kit.dialogs import Work
from study_app.gui.kit.fields import Field
from study_app.gui.theme.theme import Theme, font
from study_app.gui.theme.themed import Themed, apply_theme, remove_widget
from study_app.gui.watch.stage import Stage
from study_app.gui.widgets.background import Background
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.gui.widgets.cards import Chip
from study_app.gui.widgets.controls import ActionButton, Choice, Toggle
from study_app.gui.widgets.labels import label
from study_app.session.watch import Watched, watched
from study_app.store.atomic import write_file
from study_app.video.encoding import VideoWriter

SIZE: Final = (1180, 800)
PAINT_MS: Final = 15
VIDEO_HZ: Final = 30
SPEEDS: Final = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
PLAY: Final = Command("play again", "Play, pause", ("Space",))
STEPS: Final = (
    (Command("sample before", "Previous sample", (",",)), "sample", -1),
    (Command("frame before", "Previous frame", ("Left",)), "frame", -1),
    (Command("frame after", "Next frame", ("Right",)), "frame", 1),
    (Command("sample after", "Next sample", (".",)), "sample", 1),
)
"""Each with what it steps by, and which way."""
CAPS: Final = {"Left": "←", "Right": "→"}


class WatchWindow(Themed, QDialog):
    """Plays a trial of a session's folder, read in a thread; what cannot be read is one sentence in its place.

    Parameters
    ----------
    trial, attempt : the trial's number, and which of its presentations
    presented : what was presented, for the heading
    """

    def __init__(
        self, parent: QWidget, theme: Theme, folder: Path, trial: int, *, attempt: int, presented: str
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle(f"Trial {trial}, watched again")
        self._folder, self._trial, self._attempt = folder, trial, attempt
        self.stage: Stage | None = None
        self.export_dialog: Work | None = None
        self._reader = Background(self)
        self._reader.done.connect(self._show)
        self._reader.failed.connect(self._show)
        self._timer = QTimer(self, interval=PAINT_MS, timerType=Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._play_on)
        self._since = (0.0, 0.0)
        self._writing = QTimer(self, interval=0)
        self.sentence = label("Reading …", "body", "text2", wraps=True)
        self.sentence.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.lacking = label("", "label", "warn", wraps=True)
        self.room = QStackedWidget()
        self.room.addWidget(self.sentence)
        self.presented = Chip("neutral", "lock", "Blinded: shown by code")
        self.interval = Choice()
        self.interval.setAccessibleName("Interval")
        self.seen = Toggle("As on the screen")
        self.seen.setToolTip("The ball as late as the participant saw it; arrows and curves are of the moment")
        self.export = ActionButton("download", "Export as video …", height=40)
        self.play = ActionButton("play", "Play", cap="Space", height=40)
        self.speed = Choice()
        self.speed.setAccessibleName("Speed")
        for speed in SPEEDS:
            self.speed.addItem(f"{speed:g}×", speed)
        self.speed.setCurrentIndex(SPEEDS.index(1.0))
        self.steps = {
            command.id: ActionButton("", kind.capitalize(), cap=CAPS.get(command.keys[0], command.keys[0]), height=40)
            for command, kind, _ in STEPS
        }
        for command, *_ in STEPS:
            self.steps[command.id].setAccessibleName(command.words)
        self.close_button = ActionButton("", "Close", height=40)
        self._lay_out(f"Trial {trial}  ·  {presented}")
        self._connect()
        apply_theme(self, theme)
        available = self.screen().availableSize()
        self.resize(min(SIZE[0], available.width() - 40), min(SIZE[1], available.height() - 60))
        self._read(1)

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
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # a click leaves the keys with the time line
        self._enable(False)

    def _connect(self) -> None:
        actions = {PLAY.id: PLAY.action(self.room, self.toggle)}
        for command, kind, way in STEPS:
            actions[command.id] = command.action(self.room, partial(self.step, kind, way))  # type: ignore[arg-type]
        actions[PLAY.id].setShortcutContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)  # else a button's own key
        for name, button in {PLAY.id: self.play, **self.steps}.items():
            press(button, actions[name])
        self.interval.activated.connect(lambda at: self._read(at + 1))
        self.seen.toggled.connect(self._show_as_seen)
        self.speed.activated.connect(lambda _at: self._set_off())
        self.export.clicked.connect(self._ask_export)
        self.close_button.clicked.connect(self.accept)
        self.finished.connect(self._end)

    def _read(self, interval: int) -> None:
        self.pause()
        self._reader.run(partial(watched, self._folder, self._trial, self._attempt, interval))

    def _show(self, shown: Watched | Exception) -> None:
        if self.stage is not None:
            remove_widget(self.stage)
            self.stage = None
        self._enable(isinstance(shown, Watched))
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

    def _enable(self, able: bool) -> None:
        for part in (self.play, self.export, self.seen, self.interval, self.speed, *self.steps.values()):
            part.setEnabled(able)
        if not able:
            for part in (self.interval, self.seen, self.presented, self.lacking):
                part.hide()
            self.room.setCurrentWidget(self.sentence)

    def go(self, at_s: float) -> None:
        """Show a time of the trial [s], and stay there."""
        self.pause()
        if self.stage is not None:
            self.stage.show_moment(at_s)
            self.stage.describe()

    def step(self, kind: Literal["sample", "frame"], way: int) -> None:
        """Go to the next sample or frame, or to the one before."""
        if self.stage is not None:
            times_s = self.stage.shown.steps_s(kind)
            side: Literal["left", "right"] = "right" if way > 0 else "left"
            at = int(np.searchsorted(times_s, self.stage.at_s, side)) - (way < 0)
            if 0 <= at < len(times_s):
                self.go(float(times_s[at]))

    @property
    def playing(self) -> bool:
        return self._timer.isActive()

    def toggle(self) -> None:
        """Play from here, from the beginning where it is over, or pause."""
        if self.playing or self.stage is None:
            self.pause()
            return
        if self.stage.at_s >= self.stage.shown.ends_s:
            self.stage.show_moment(self.stage.shown.begins_s)
        self._set_off()
        self._timer.start()
        self.play.show_action("pause", "Pause")

    def pause(self) -> None:
        self._timer.stop()
        self.play.show_action("play", "Play")
        if self.stage is not None:
            self.stage.describe()

    def _set_off(self) -> None:
        """Count time from here on, at the speed that is chosen."""
        self._since = (time.perf_counter(), 0.0 if self.stage is None else self.stage.at_s)

    def _play_on(self) -> None:
        if self.stage is None:
            return
        began, at_s = self._since
        self.stage.show_moment(at_s + (time.perf_counter() - began) * self.speed.currentData())
        if self.stage.at_s >= self.stage.shown.ends_s:
            self.pause()

    def _show_as_seen(self, yes: bool) -> None:
        if self.stage is not None:
            self.stage.as_seen = yes
            self.stage.show_moment(self.stage.at_s)

    def _ask_export(self) -> None:
        self.pause()
        dialog = Work(
            self,
            self.theme,
            "Export as video",
            f"{self._name} will show what is seen here at {self.speed.currentText()} speed.",
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
    def _name(self) -> str:
        interval = f"-interval-{self.interval.currentIndex() + 1}" if self.interval.count() > 1 else ""
        participant, session = self._folder.parent.name, self._folder.name
        return f"{participant}_{session}_trial-{self._trial:03}{interval}.mp4"

    def _begin_export(self) -> None:
        assert self.export_dialog is not None  # noqa: S101 - it has begun
        pictures = self._pictures(Path(self.export_dialog.value("to")).expanduser() / self._name)
        self._writing = QTimer(self, interval=0)
        self._writing.timeout.connect(lambda: self._write_on(pictures))
        self._writing.start()

    def _write_on(self, pictures: Iterator[float | Path]) -> None:
        """Write one picture more; say how far that is, or what came of it."""
        dialog = self.export_dialog
        assert dialog is not None  # noqa: S101 - it has begun
        try:
            found = next(pictures)
        except StudyError as refused:
            self._writing.stop()
            dialog.show_refused(f"{str(refused)[:1].upper()}{str(refused)[1:]}.")
            return
        if isinstance(found, Path):
            self._writing.stop()
            dialog.show_done(f"The video is {found}.", "Open the folder")
        else:
            dialog.show_progress("Painting …", found)

    def _pictures(self, to: Path) -> Iterator[float | Path]:
        """Write a video; yield the share that is done, then the file."""
        stage = self.stage
        assert stage is not None  # noqa: S101 - the button is off without one
        back, size = stage.at_s, stage.grab().size()
        writer = VideoWriter(size.toTuple(), VIDEO_HZ)  # type: ignore[arg-type]  # a pair of int
        times_s = np.arange(stage.shown.begins_s, stage.shown.ends_s, self.speed.currentData() / VIDEO_HZ)
        for count, at_s in enumerate(times_s):
            stage.show_moment(float(at_s))
            writer.add(_pixels(stage, size))
            yield count / len(times_s)
        write_file(to, writer.finish())
        stage.show_moment(back)
        yield to

    def _stop_export(self) -> None:
        self._writing.stop()
        if self.export_dialog is not None:
            self.export_dialog.stopped()

    def _end(self) -> None:
        self._timer.stop()
        self._writing.stop()


def _pixels(stage: Stage, size: QSize) -> np.ndarray:
    """Return what is seen now (height, width, 4): blue, green, red, unused."""
    image = stage.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
    if image.size() != size:  # the window was resized meanwhile
        image = image.scaled(size)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(size.height(), image.bytesPerLine() // 4, 4)
    return rows[:, : size.width()].copy()
