"""The page "This machine": the settings of this computer and its screens, which apply to every study.

`FIELDS` and the titles in `MachineSettings` describe the settings; `MachinePlace` arranges them. It reads and writes no
file.

The display test paints the tank's photodiode patch full-screen on the participant's screen. It requests frames as a
session does, and records when each is painted.
"""

from __future__ import annotations

import re
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Final, get_args

from PySide6.QtCore import QRect, QSize, Qt, QTimer, Signal
from PySide6.QtGui import (  # fmt: skip
    QCloseEvent,
    QColor,
    QGuiApplication,
    QKeyEvent,
    QKeySequence,
    QPainter,
    QPaintEvent,
    QResizeEvent,
    QScreen,
    QShortcut,
)
from PySide6.QtWidgets import QBoxLayout, QButtonGroup, QFileDialog, QLabel, QWidget

from study_app.devices.registry import list_devices, title_of
from study_app.gui.display.screens import Frames, ScreenShown, screens_shown
from study_app.gui.kit.fields import MIN_TEXT_WIDTH, Editor, Field, choice_field, number_field
from study_app.gui.participant.tank.layers import paint_patch, patch_rectangle
from study_app.gui.theme.theme import PARTICIPANT, RADIUS_CONTROL, SHADOW, font
from study_app.gui.theme.themed import apply_theme, remove_widget
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, grid, hbox, vbox
from study_app.gui.widgets.cards import Card, Rule, scrolled
from study_app.gui.widgets.controls import ActionButton, Radio
from study_app.gui.widgets.labels import Elided, figures, label
from study_app.gui.widgets.main_view import Place
from study_app.gui.widgets.numbers import write_number
from study_app.outlets.session_outlets import is_port
from study_app.store.workstation import (
    CAMERA_LENGTH,
    DEFAULTS,
    DISTANCE_MM,
    LEAST_X_HEIGHT_DEG,
    OFFSET_MS,
    SPREAD_MS,
    WIDTH_MM,
    DisplayOffset,
    MachineSettings,
)  # fmt: skip
from study_app.video.sources import USUAL

_LEAST_S: Final = 2.0
_KEPT_S: Final = 10.0
_LATE: Final = 1.5  # gap [refreshes] above which at least one refresh was missed


class FrameTimes:
    """Records the times of frames and computes figures.

    Parameters
    ----------
    refresh_hz : refresh rate reported by the system
    least_s : minimum duration before figures are shown
    """

    def __init__(self, refresh_hz: float, least_s: float = _LEAST_S) -> None:
        self.refresh_hz = refresh_hz if refresh_hz > 0 else 60.0
        self._least_ns = round(1e9 * least_s)
        self._times: deque[int] = deque()

    def add_frame(self, time_ns: int) -> None:
        """Add a frame's time [ns]; times older than ten seconds are dropped."""
        self._times.append(time_ns)
        while time_ns - self._times[0] > 1e9 * _KEPT_S:
            self._times.popleft()

    def figure_texts(self) -> tuple[str, ...]:
        """Return rate, median and 99th percentile of the gaps, and missed refreshes; dashes until enough is known."""
        times = list(self._times)
        if len(times) < 3 or times[-1] - times[0] < self._least_ns:
            return ("–",) * len(_NAMES)
        gaps_ms = sorted((late - early) / 1e6 for early, late in pairwise(times))
        refresh_ms = 1000 / self.refresh_hz
        return (
            f"{1e9 * (len(times) - 1) / (times[-1] - times[0]):.1f} of {self.refresh_hz:.1f} Hz",
            f"{gaps_ms[len(gaps_ms) // 2]:.2f} ms",
            f"{gaps_ms[min(len(gaps_ms) - 1, int(0.99 * len(gaps_ms)))]:.2f} ms",
            str(sum(round(gap / refresh_ms) - 1 for gap in gaps_ms if gap > _LATE * refresh_ms)),
        )


_REPORT_MS = 500
_INTERVAL_MS = (50.0, 5000.0)
_FIRST_MS = 500.0
_FORM_PX = 320
_NAMES = ("Frames painted", "Median gap", "99 % of gaps within", "Missed in the last 10 s")
_LEAST = QSize(960, 600)
_METHODS = ("photodiode", "high-speed camera", "data sheet")
_DECIMALS = 2


class _OffsetForm(QWidget):
    """The form of the display offset: ``kept(mean [ms], spread [ms], how)`` saves it, ``forgotten`` deletes it."""

    kept = Signal(float, float, str)
    forgotten = Signal()

    def __init__(self) -> None:
        super().__init__()
        fields = (
            number_field("mean", "Mean", "ms", OFFSET_MS, _DECIMALS, may_miss=False),
            number_field("spread", "Spread", "ms", SPREAD_MS, _DECIMALS),
            choice_field("how", "Measured by", {method: method.capitalize() for method in _METHODS}),
        )
        self.editors = {field.name: Editor(field) for field in fields}
        self.said = label("", "label", "text2", wraps=True, weight=400, tabular=True)
        self.said.setMinimumWidth(MIN_TEXT_WIDTH)
        self.keep = ActionButton("save", "Save offset", height=38)
        self.forget = ActionButton("", "Forget", height=38)
        foot = hbox(self.keep, self.forget, STRETCH, spacing=12)
        vbox(self.said, *self.editors.values(), foot, spacing=8, margins=0, parent=self)
        self.keep.clicked.connect(self._submit_offset)
        self.forget.clicked.connect(self.forgotten)

    def show_offset(self, offset: DisplayOffset | None, screen: str) -> None:
        """Show the measured offset, and if it was measured on a screen other than ``screen``."""
        self.forget.setEnabled(offset is not None)
        self.said.setText(_offset_sentence(offset, screen))
        if offset is not None:
            for name, value in (("mean", offset.mean_ms), ("spread", offset.spread_ms), ("how", offset.how)):
                self.editors[name].show_value(value)

    def _submit_offset(self) -> None:
        values = []
        for editor in self.editors.values():
            try:
                values.append(editor.value)
            except ValueError as refusal:
                editor.show_refusal(str(refusal))
                editor.control.setFocus()
                return
        mean_ms, spread_ms, method = values
        self.kept.emit(mean_ms, spread_ms or 0.0, method)


def _offset_sentence(offset: DisplayOffset | None, screen: str) -> str:
    """Return a sentence about the measured offset of a screen."""
    if offset is None:
        return (
            "Not measured. Every screen shows frames with a slight delay; receipts record this delay as “not measured”."
        )
    text = f"{write_number(offset.mean_ms, _DECIMALS)} ± {write_number(offset.spread_ms, _DECIMALS)} ms"
    when = f", {offset.measured}" if offset.measured else ""
    note = (
        "" if offset.screen == screen else f" It was measured on another screen ({offset.screen}) and is not used here."
    )
    return f"{text} ({offset.how}{when}).{note}"


class DisplayTest(QWidget):
    """The display test on one screen; Esc closes it, and ``left`` is emitted when it has closed.

    Parameters
    ----------
    screen_text : description of the screen, for the heading
    refresh_hz : refresh rate reported by the system
    least_s : minimum duration before figures are shown
    """

    left = Signal()

    def __init__(
        self,
        screen_text: str,
        refresh_hz: float,
        *,
        now_ns: Callable[[], int] = time.perf_counter_ns,
        least_s: float = _LEAST_S,
    ) -> None:
        super().__init__()
        self.setWindowTitle("Display test")
        self.setMinimumSize(_LEAST)
        self._now_ns = now_ns
        self.times = FrameTimes(refresh_hz, least_s)
        self.lit = False
        self.toggles = 0
        self._toggled_ns = now_ns()
        self.interval_ms = _FIRST_MS
        self._unpainted = False
        self.interval = Editor(number_field("interval", "Interval", "ms", _INTERVAL_MS))
        self.interval.setFixedWidth(_FORM_PX)
        self.interval.show_value(_FIRST_MS)
        self.values: list[QLabel] = [figures("–", "number") for _ in _NAMES]
        self.leave = ActionButton("", "Leave (Esc)", height=40)
        self._lay_out(screen_text)
        self.leave.clicked.connect(self.close)
        self.interval.changed.connect(lambda _name, value: self._set_interval(value))
        apply_theme(self, PARTICIPANT)
        self.frames = Frames(self.times.refresh_hz, now_ns=now_ns, parent=self)
        self.frames.due.connect(self.draw_frame)
        self.report_timer = QTimer(self, interval=_REPORT_MS)
        self.report_timer.timeout.connect(self.show_figures)

    def _lay_out(self, screen_text: str) -> None:
        titles = vbox(label("Display test", "title"), label(screen_text, "body", "text2"), spacing=2)
        head = hbox(titles, STRETCH, (self.leave, 0, Qt.AlignmentFlag.AlignTop))
        cells = grid(40, 2)
        for place, (name, value) in enumerate(zip(_NAMES, self.values, strict=True)):
            value.setAccessibleName(name)
            cells.addWidget(label(name, "label", "text2"), 0, place)
            cells.addWidget(value, 1, place)
        cells.setColumnStretch(len(_NAMES), 1)
        toggling = vbox(label("Photodiode's patch", "card"), self.interval, spacing=6)
        foot = hbox(toggling, STRETCH)
        vbox(head, cells, foot, STRETCH, spacing=14, margins=(40, 20, 40, 20), parent=self)

    def open_on(self, screen: QScreen) -> None:
        self.setScreen(screen)
        self.setGeometry(screen.geometry())
        self.showFullScreen()
        self.activateWindow()
        self.start_frames()

    def start_frames(self) -> None:
        self._toggled_ns = self._now_ns()
        self.frames.start()
        self.report_timer.start()

    def draw_frame(self) -> None:
        """Request a frame, as a session does, and toggle the patch if it is due."""
        now_ns = self._now_ns()
        if now_ns - self._toggled_ns >= 1e6 * self.interval_ms:
            self._toggled_ns = now_ns
            self.lit = not self.lit
            self.toggles += 1
        self._unpainted = True
        self.update(self.patch_area())

    def show_figures(self) -> None:
        for value, text in zip(self.values, self.times.figure_texts(), strict=True):
            value.setText(text)

    def patch_area(self) -> QRect:
        return patch_rectangle(self.width(), self.height()).toAlignedRect()

    def _set_interval(self, value: float | None) -> None:
        self.interval_ms = value or _FIRST_MS
        self.interval.show_value(self.interval_ms)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(event.rect(), QColor(PARTICIPANT.window))
        paint_patch(painter, patch_rectangle(self.width(), self.height()), lit=self.lit)
        painter.end()
        if self._unpainted:
            self._unpainted = False
            self.times.add_frame(self._now_ns())

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


_STACKED_BELOW = 1000
_SAMPLE = "I think this feels like interacting with a liquid."
_MOST_SAMPLE = 2.4
_STAMPS = "For example https://freetsa.org/tsr. Leave empty to disable."
_PORTS = "One byte per event: serial:/dev/ttyUSB0, serial:COM3 or parallel:/dev/parport0. Leave empty to disable."


def _check_port(text: str) -> str:
    if text and not is_port(text):
        raise ValueError(f"This is not a port address. {_PORTS}")
    return text


def _check_server(text: str) -> str:
    if not re.fullmatch(r"(https?://\S+)?", text):
        raise ValueError(f"This is not a server address. {_STAMPS}")
    return text


def _check_path(text: str) -> str | None:
    if text and not Path(text).exists():
        raise ValueError(f"{text} does not exist: choose another file, or leave the field empty.")
    return text or None


def _text_or_empty(value: str | None) -> str:
    return value or ""


_SAMPLES = {
    "off": "Off",
    "single-blind": "On, except in double-blind studies",
    "always": "On, even in double-blind studies",
}
FIELDS = (
    number_field("viewing_distance_mm", "Viewing distance from eye to screen", "mm", DISTANCE_MM),
    number_field("screen_width_mm", "Width of the screen's visible area", "mm", WIDTH_MM),
    Field("lsl_markers", "Markers over the Lab Streaming Layer (LSL)", "switch"),
    choice_field("lsl_samples", "Position and force samples over LSL", _SAMPLES),
    Field("triggers", "Trigger port", hint=_PORTS, parse=_check_port),
    Field("photodiode", "Square in the tank's corner for a photodiode", "switch"),
    choice_field("device", "Device", {name: title_of(name) for name in list_devices()}),
    Field("camera", "Camera for conditions that show a camera image", longest=CAMERA_LENGTH, placeholder=USUAL),
    Field(
        "proofs", "Folder for the proof that is written when a session ends", "folder",
        hint="A folder that people with access to the results cannot change. Leave empty to disable.",
        parse=_check_path, write=_text_or_empty,
    ),
    Field("stamps", "Time-stamp server for proofs (RFC 3161)", hint=_STAMPS, parse=_check_server),
    Field(
        "stamp_root", "The server's root certificate (PEM), for verifying its time stamps", "file",
        file_filter="Certificates (*.pem *.crt *.cer)", parse=_check_path, write=_text_or_empty,
    ),
)  # fmt: skip
_PROGRAM_FIELDS = tuple(  # of the fields of `MachineSettings` with a title: choices and switches
    choice_field(name, setting.title, {choice: choice.capitalize() for choice in choices})
    if (choices := get_args(setting.annotation))
    else Field(name, setting.title, "switch")
    for name, setting in MachineSettings.model_fields.items()
    if setting.title
)


class _ScreensCard(Card):
    """The card with all screens, of which one is the participant's; ``chosen`` carries a newly chosen one."""

    chosen = Signal(object)

    def __init__(self) -> None:
        super().__init__("Participant's screen", gap=10)
        self.radios: list[Radio] = []
        self.note = label("", "label", "warn", wraps=True)
        self.note.setMinimumWidth(MIN_TEXT_WIDTH)
        self.test = ActionButton("screen", "Display test…", height=38)
        self._rows = QWidget()
        self._shown: tuple[ScreenShown, ...] = ()
        self._host = vbox(self._rows)
        add_parts(self.column, self._host, self.note, hbox(self.test, STRETCH))

    def show_screens(self, screens: tuple[ScreenShown, ...], chosen: int, missing: str) -> None:
        """Show the screens; ``chosen`` is the number of the participant's, ``missing`` the name of an unplugged one."""
        if screens != self._shown:
            self._shown, old, self._rows = screens, self._rows, QWidget()
            group, rows = QButtonGroup(self._rows), vbox(spacing=8, margins=0, parent=self._rows)
            self.radios = []
            for screen in screens:
                radio = Radio(f"Screen {screen.number}")
                radio.setFont(font("strong"))
                radio.setAccessibleName(f"Screen {screen.number}, {screen.name}, {screen.words}")
                radio.clicked.connect(partial(self.chosen.emit, screen))
                group.addButton(radio)
                size = f"{screen.width_mm:.0f} × {screen.height_mm:.0f} mm" if screen.width_mm > 0 else "size unknown"
                about = label(f"{screen.words}  ·  {size}", "label", "text2", wraps=True, weight=400, tabular=True)
                about.setMinimumWidth(MIN_TEXT_WIDTH)
                name = Elided("label", "text2")
                name.show_text(screen.name)
                name.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
                below = hbox(about, margins=(30, 0, 0, 0))
                add_parts(rows, *([Rule()] if self.radios else []), vbox(hbox(radio, (name, 1)), below, spacing=0))
                self.radios.append(radio)
            self._host.addWidget(self._rows)
            remove_widget(old)
        for number, radio in enumerate(self.radios, start=1):
            radio.setChecked(number == chosen)
        self.note.setText(
            f"{missing} is not connected, so the last screen in the list is used instead." if missing else ""
        )
        self.note.setVisible(bool(missing))


class MachinePlace(Place):
    """The page with the settings of this computer.

    ``changed(values)`` carries new values by their names in `MachineSettings`; ``offset_measured(mean [ms], spread
    [ms], how, screen)`` carries the display offset of a screen. ``undo_asked`` reverts the last change, and
    ``check_asked`` opens the check of this computer.
    """

    changed = Signal(dict)
    offset_measured = Signal(float, float, str, str)
    undo_asked = Signal()
    check_asked = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.settings = DEFAULTS
        self._screens: tuple[ScreenShown, ...] = ()
        self.test: DisplayTest | None = None
        self.devices = ActionButton("", "Devices", height=40)
        self.change = ActionButton("", "Change…", height=40)
        self.editors = {
            field.name: Editor(field, self.devices if field.name == "device" else None)
            for field in (*FIELDS, *_PROGRAM_FIELDS)
        }
        for editor in self.editors.values():
            editor.changed.connect(lambda name, value: self.changed.emit({name: value}))
        self.screens, self.offset = _ScreensCard(), _OffsetForm()
        self.sample = label(_SAMPLE, "statement", wraps=True)
        self.sample.setAccessibleName(f"A sample statement at the size that participants see: {_SAMPLE}")
        self.sample.setFixedHeight(112)
        self.sample.setIndent(0)
        self.sample.setStyleSheet(
            f"background: {PARTICIPANT.window}; color: {PARTICIPANT.text}; padding: 7px 15px;"
            f"border: 1px solid {PARTICIPANT.border}; border-radius: {RADIUS_CONTROL}px"
        )
        self.said = label("", "label", "text2", wraps=True, weight=400, tabular=True)
        self.said.setMinimumWidth(MIN_TEXT_WIDTH)
        self.folder, self.kept_in = Elided("label", "text"), Elided("label", "text2")
        self.kept_in.setFont(font("label", weight=400))
        self.undo = ActionButton("undo", "Undo")
        self.check = ActionButton("check", "Check this computer…")
        self._lay_out()
        self.screens.chosen.connect(
            lambda screen: self.changed.emit({"screen": screen.name, "screen_number": screen.number})
        )
        self.screens.test.clicked.connect(self.open_test)
        self.devices.clicked.connect(lambda: self.go_asked.emit("devices"))
        self.change.clicked.connect(self._choose_folder)
        self.offset.kept.connect(lambda *measured: self.offset_measured.emit(*measured, self.participants.name))
        self.offset.forgotten.connect(lambda: self.changed.emit({"display_offset": None}))
        self.undo.clicked.connect(self.undo_asked)
        self.check.clicked.connect(self.check_asked)
        QShortcut(QKeySequence.StandardKey.Undo, self, self.undo.click, context=Qt.ShortcutContext.WindowShortcut)

    def _lay_out(self) -> None:
        def card(title: str, *parts: str | QWidget | QBoxLayout) -> Card:
            new_card = Card(title, gap=10)
            add_parts(new_card.column, *(self.editors[part] if isinstance(part, str) else part for part in parts))
            return new_card

        workspace = label("Workspace, the folder for protocols and results", "label", "text2")
        folder = vbox(workspace, hbox((self.folder, 1), self.change, spacing=8), spacing=6)
        text_size = "viewing_distance_mm", "screen_width_mm", self.sample, self.said
        columns = (
            (
                self.screens,
                card("Text size for the participant", *text_size),
                card("Other programs", "lsl_markers", "lsl_samples", Rule(), "triggers"),
                card("Proofs kept elsewhere", "proofs", "stamps", "stamp_root"),
            ),
            (
                card("Display offset", self.offset, Rule(), "photodiode"),
                card("New sessions", "device", folder, "camera"),
                card("This program", *(field.name for field in _PROGRAM_FIELDS)),
            ),
        )
        self._body = QBoxLayout(QBoxLayout.Direction.LeftToRight)
        self._body.setSpacing(18)
        for column in columns:
            add_layout(self._body, vbox(*column, STRETCH, spacing=18), 1)
        about = "Settings for this computer and its screens; they apply to every study. Changes are saved immediately."
        titles = vbox(label("This machine", "title"), label(about, "body", "text2", wraps=True), spacing=4)
        head = hbox((titles, 1), self.check, self.undo, spacing=16, margins=(SHADOW, 0, SHADOW, 0))
        foot = hbox(self.kept_in, margins=(SHADOW, 0, SHADOW, 0))
        content = QWidget()
        vbox(head, (self._body, 1), foot, spacing=20, margins=(30, 30, 30, 22), parent=content)
        vbox(scrolled(content), margins=0, parent=self)

    def enter(self) -> None:
        """Show the screens again, since one may have been plugged in."""
        self._show_all()

    def leave(self) -> None:
        if self.test is not None:
            self.test.close()

    @property
    def participants(self) -> ScreenShown:
        return self._screens[self.settings.screen_among([screen.name for screen in self._screens]) - 1]

    def show_settings(self, settings: MachineSettings, *, folder: str, undo: str, kept_in: str) -> None:
        """Show settings; ``undo`` names the change to undo ("" if none), ``folder`` is the workspace."""
        self.settings = settings
        self.undo.setEnabled(bool(undo))
        self.undo.show_action("undo", f"Undo {undo}" if undo else "Undo")
        self.folder.show_text(folder)
        self.kept_in.show_text(f"Saved in {kept_in}")
        self._show_all()

    def _show_all(self) -> None:
        self._screens = screens_shown()
        settings, screen = self.settings, self.participants
        for name, editor in self.editors.items():
            editor.show_value(settings.device.partition(":")[0] if name == "device" else getattr(settings, name))
        self.editors["screen_width_mm"].show_value(settings.screen_width_mm, _width_sentence(settings, screen))
        missing = settings.screen if settings.screen not in {"", *(screen.name for screen in self._screens)} else ""
        self.screens.show_screens(self._screens, screen.number, missing)
        scale = settings.text_scale(screen.width_px, screen.width_mm)
        self.sample.setFont(font("statement", scale=min(scale, _MOST_SAMPLE)))
        self.said.setText(_text_size_sentence(settings, screen, scale))
        self.offset.show_offset(settings.display_offset, screen.name)

    def _choose_folder(self) -> None:
        if chosen := QFileDialog.getExistingDirectory(self, "Workspace", self.folder.whole):
            self.changed.emit({"workspace": chosen})

    def open_test(self) -> None:
        if self.test is not None:
            return
        screen, screens = self.participants, QGuiApplication.screens()
        if screen.number > len(screens):  # the screen was unplugged
            self._show_all()
            return
        text = "  ·  ".join(filter(None, (f"Screen {screen.number}", screen.name, screen.words)))
        self.test = DisplayTest(text, screen.refresh_hz)
        self.test.left.connect(self._forget_test)
        self.test.open_on(screens[screen.number - 1])

    def _forget_test(self) -> None:
        test, self.test = self.test, None
        if test is not None:
            test.deleteLater()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        stacked = self.width() < _STACKED_BELOW
        self._body.setDirection(QBoxLayout.Direction.TopToBottom if stacked else QBoxLayout.Direction.LeftToRight)


def _width_sentence(settings: MachineSettings, screen: ScreenShown) -> str:
    """Return a sentence about the screen width that the system reports."""
    reported = screen.width_mm > 0
    sentence = f"The system reports {screen.width_mm:.0f} mm." if reported else "The system does not report the width."
    return sentence if settings.screen_width_mm is None else f"{sentence} The measured value is used instead."


def _text_size_sentence(settings: MachineSettings, screen: ScreenShown, scale: float) -> str:
    """Return a sentence about the size of the participant's text."""
    angle_deg, recommended = settings.x_height_deg(screen.width_px, screen.width_mm), f"{LEAST_X_HEIGHT_DEG:g}°"
    if angle_deg is None:
        enlarged = f"Measure the viewing distance; text is then enlarged until the letter x subtends {recommended}."
        return f"{enlarged} Until then, text is shown at its default size."
    if scale == 1.0:
        return f"Default size: the letter x subtends {angle_deg:.2f}°; at least {recommended} is recommended."
    return f"{scale:.2f} times the default size: the letter x subtends {recommended} instead of {angle_deg:.2f}°."
