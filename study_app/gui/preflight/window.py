"""The pre-flight window: every check with its value, the coming session, and a button that names accepted warnings."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Final

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QAccessible, QCloseEvent, QColor, QKeyEvent, QPaintEvent, QPen
from PySide6.QtWidgets import QAbstractSlider, QBoxLayout, QLabel, QProgressBar, QWidget

from study_app.devices.descriptor import NOT_AVAILABLE, Backend
from study_app.gui.kit.dialogs import Question
from study_app.gui.sessions.session_facts import extent_of, operator_language, step_title
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import LIGHT, Theme, font
from study_app.gui.theme.themed import Themed, apply_theme, remove_widget
from study_app.gui.widgets.accessible import describe_plot, give_role
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, grid, hbox, vbox
from study_app.gui.widgets.cards import Bar, Card, Chip, Rule, scrolled, smooth_painter
from study_app.gui.widgets.controls import ActionButton, Choice, Number
from study_app.gui.widgets.labels import Ink, figures, label
from study_app.gui.widgets.live_plots import LatenessPlot, lateness_histogram
from study_app.protocol.descriptions import number_range
from study_app.protocol.model import Protocol
from study_app.protocol.orders import Schedule, Trial, orders_of
from study_app.session.preflight import (
    LOUDEST_DB,
    MEANS,
    QUIETEST_DB,
    USUAL_DB,
    Check,
    Masking,
    Measurements,
    preflight_checks,
)
from study_app.session.resume import resume_at
from study_app.store.journals.journal_events import Event
from study_app.store.session_progress import progress_of

_WAITING = "measuring…"


@dataclass(frozen=True, slots=True)
class PreflightView:
    """The content of the window.

    ``rows`` are labels and values about the coming session and ``facts`` the measurements; the session cannot be
    started while ``busy``.
    """

    study: str
    who: str
    facts: Measurements
    checks: tuple[Check, ...]
    rows: tuple[tuple[str, str], ...]
    busy: bool = False

    @property
    def warnings(self) -> int:
        return sum(check.verdict == "warning" for check in self.checks)

    @property
    def failures(self) -> int:
        return sum(check.verdict == "failure" for check in self.checks)

    @property
    def passed_text(self) -> str:
        passed = len(self.checks) - self.warnings - self.failures
        return f"{passed} of {len(self.checks)} passed"

    @property
    def start_text(self) -> str:
        """The text of the start button, which names the warnings that pressing it accepts."""
        if self.failures:
            return "Cannot start"
        if self.warnings:
            return f"Start with {self.warnings} warning{'s' if self.warnings > 1 else ''}"
        return "Start"


def resumed_rows(protocol: Protocol, schedule: Schedule, events: Iterable[Event]) -> tuple[tuple[str, str], ...]:
    """Return the rows about a resumed session: where it continues, and how many answers are kept.

    Raises
    ------
    SessionError
        The journal does not fit this schedule.
    """
    journal = list(events)
    start = resume_at(protocol, schedule, journal)
    language = operator_language(protocol)
    step = schedule.steps[start.step] if start.step < len(schedule.steps) else None
    if isinstance(step, Trial):
        attempt = start.presented.get(step.number, 0) + 1
        position = step.label(protocol, language) + (f", attempt\u00a0{attempt}" if attempt > 1 else "")
    else:
        position = "the end" if step is None else step_title(protocol, step, language)
    answers = f"{sum(progress_of(journal).answered.values())} of {orders_of(protocol).answers} answers"
    return ("Continues at", position), ("Kept", answers)


def planned_rows(
    protocol: Protocol, now: datetime, error_n: float | None, *, asked_error: bool = True
) -> tuple[tuple[str, str], ...]:
    """Return the rows about the coming session.

    ``error_n`` is the largest difference of a scene's force from the exact definition [N], None until it is known; its
    row is omitted if ``asked_error`` is false.
    """
    extent = extent_of(protocol)
    ends = now + timedelta(seconds=max(extent.expected_s))
    error = _WAITING if error_n is None else "< 0.01 N" if error_n < 0.01 else f"{error_n:.2f} N"
    return (
        ("Parts", number_range(extent.parts)),
        (f"{extent.setting.capitalize()}s", number_range(extent.settings)),
        ("Answers", number_range(extent.answers)),
        ("Expected time", extent.duration),
        ("Force limit", f"{protocol.device.force_limit_n:g} N"),
        *((("Expected force error", error),) if asked_error else ()),
        ("Ends about", f"{ends:%H:%M}"),
    )


COMPUTER_CHECK_NAMES: Final = ("Servo rate", "Servo lateness", "Priority", "Screen", "Results folder", "Free space")
"""The names of the pre-flight checks that depend neither on the study nor on its device."""

_RECOMPILES: Final = (
    "The model is compiled at every start, which takes up to a minute. Set NUMBA_CACHE_DIR to a writable folder."
)


def computer_checks(
    facts: Measurements, protocol: Protocol, devices: Sequence[Backend], *, cache: Path | None, compiled: int
) -> tuple[Check, ...]:
    """Return the checks of a computer, with the limits of ``protocol``.

    ``facts`` were measured with the simulated hand, for which ``compiled`` functions had to be compiled. ``cache`` is
    the folder of compiled code, or None if it cannot be stored.
    """
    checks = {check.name: check for check in preflight_checks(facts, protocol)}
    results = [checks[name] for name in COMPUTER_CHECK_NAMES]
    return (*results, _device_check(devices), _compiled_check(cache, compiled))


def _device_check(devices: Sequence[Backend]) -> Check:
    """Return the check that a haptic device is connected; a session without one uses the mouse."""
    haptic = [device for device in devices if device.state.startswith("connected")]
    missing = [device.name for device in devices if device.state == NOT_AVAILABLE]
    about = f"not available now: {', '.join(missing)}" if missing else "all devices are available"
    if haptic:
        return Check("Haptic devices", "ok", ", ".join(device.name for device in haptic), about=about)
    advice = "Connect a device, then open Devices; without a device you can use only the mouse and the simulated hand."
    return Check("Haptic devices", "warning", "none connected", about=about, advice=advice)


def _compiled_check(cache: Path | None, compiled: int) -> Check:
    if cache is None:
        return Check("Compiled code", "warning", "not stored", about="no folder is writable", advice=_RECOMPILES)
    value = f"{compiled} functions compiled" if compiled else "stored"
    return Check("Compiled code", "ok", value, about=f"the force model for this processor, in {cache}")


_ROW_HEIGHT = 42
_DOT = 13.0
LEFT = 70
NAME, BAR = 148, 160
_MIN_TEXT_WIDTH = 160  # narrower wrapped text would become too high
_VERDICT_STYLES: dict[str, tuple[str, Ink, str]] = {
    "ok": ("check", "ok", "passed"),
    "warning": ("warning", "warn", "warning"),
    "failure": ("cross", "bad", "cannot start"),
}


class _CheckRow(Themed, QWidget):
    """A row with a check; a warning or failure is tinted and has advice below it."""

    def __init__(self, check: Check, *, last: bool) -> None:
        super().__init__()
        self.check, self._last = check, last
        _, ink, word = _VERDICT_STYLES[check.verdict]
        name = label(check.name, "body")
        name.setFont(font("body", weight=600, scale=0.97))
        name.setFixedWidth(NAME)
        about = label(check.about, "label", "text2", wraps=True, weight=400, tabular=True)
        about.setMinimumWidth(_MIN_TEXT_WIDTH)
        value = figures(check.value, "body", "text" if check.verdict == "ok" else ink)
        value.setFont(font("body", weight=600, tabular=True, scale=0.97))
        value.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        middle = vbox(STRETCH, about, spacing=6)
        if check.share is not None:
            share = Bar(height=6)
            share.setFixedWidth(BAR)
            share.show_share(min(1.0, check.share))
            middle.addWidget(share, 0, Qt.AlignmentFlag.AlignLeft)
        middle.addStretch()
        self._head = holder = QWidget()
        holder.setMinimumHeight(_ROW_HEIGHT)
        hbox(name, (middle, 1), value, spacing=14, margins=(0, 4, 0, 4), parent=holder)
        column = vbox(holder, spacing=0, margins=(LEFT, 0, 24, 0 if check.verdict == "ok" else 14), parent=self)
        if check.advice:
            advice = label(check.advice, "label", "text", wraps=True, weight=500)
            column.addWidget(advice)
        self.setAccessibleName(f"{check.name}, {word}, {check.said}")

    def paintEvent(self, _event: QPaintEvent) -> None:
        t = self.theme
        icon, ink, _ = _VERDICT_STYLES[self.check.verdict]
        painter = smooth_painter(self)
        tint = QColor(getattr(t, f"{ink}_bg"))
        if self.check.verdict != "ok":
            painter.fillRect(self.rect().adjusted(4, 0, -4, 0), tint)
        middle = QPointF(40, self._head.geometry().center().y() + 0.5)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(tint if self.check.verdict == "ok" else QColor(t.surface))
        painter.drawEllipse(middle, _DOT, _DOT)
        draw_icon(painter, icon, QRectF(middle.x() - 8, middle.y() - 8, 16, 16), getattr(t, ink), 2.4)
        if self._last:
            return
        painter.setPen(QPen(QColor(t.grid), 1))
        painter.drawLine(24, self.height() - 1, self.width() - 24, self.height() - 1)


def _check_rows(checks: Sequence[Check], before: list[_CheckRow], column: QBoxLayout) -> list[_CheckRow]:
    """Replace the rows ``before`` in a column with rows of ``checks``, and return these."""
    for row in before:
        remove_widget(row)
    rows = [_CheckRow(check, last=check is checks[-1]) for check in checks]
    for index, row in enumerate(rows):
        column.insertWidget(index, row)
    return rows


FULL, LEAST = QSize(1200, 800), QSize(1024, 640)
_SIDE_WIDTH = 352
_PAGES = {
    Qt.Key.Key_PageDown: QAbstractSlider.SliderAction.SliderPageStepAdd,
    Qt.Key.Key_PageUp: QAbstractSlider.SliderAction.SliderPageStepSub,
}
_NOT_STARTED = "Nothing is created until you start."


class PreflightWindow(QWidget):
    """The window with the checks before a session, while device and servo are ready and at rest.

    ``start_asked`` means that the displayed warnings are accepted, ``again_asked`` requests a new measurement.
    With ``asks_masking`` the window asks whether the device's motor noise is masked.
    """

    start_asked = Signal()
    again_asked = Signal()
    cancelled = Signal()

    def __init__(self, limit_us: float, *, asks_masking: bool = False, theme: Theme = LIGHT) -> None:
        super().__init__()
        self.setWindowTitle("Liquid Study")
        self.setProperty("role", "window")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setMinimumSize(LEAST)
        self.resize(FULL)
        self.who = label("", "label", "text2")
        self.chip = Chip("ok", "check", "")
        self.checks = Card(padding=10, gap=0)
        self.rows: list[_CheckRow] = []
        self.masking = _MaskingQuestion() if asks_masking else None
        self.plot = LatenessPlot(limit_us)
        describe_plot(self.plot, "Tick lateness", "Histogram of tick lateness over two seconds, in µs.")
        self.cancel = ActionButton("", "Cancel", height=46)
        self.again = ActionButton("repeat", "Check again", height=46)
        self.start = ActionButton("play", "Start", role="primary", height=46)
        self._names: dict[str, QLabel] = {}
        self._values: dict[str, QLabel] = {}
        self._done = False
        self._busy = False
        margins = self.checks.column.contentsMargins()
        self.checks.column.setContentsMargins(4, margins.top(), 4, margins.bottom())
        self._lay_out()
        self.cancel.clicked.connect(self.close)
        self.again.clicked.connect(self.again_asked)
        self.start.clicked.connect(self._ask_to_start)
        apply_theme(self, theme)
        give_role(self, QAccessible.Role.Window)
        self.start.setFocus()

    def _lay_out(self) -> None:
        titles = vbox(label("Ready to begin?", "title_dense"), self.who, spacing=4)
        head = hbox((titles, 1), (self.chip, 0, Qt.AlignmentFlag.AlignVCenter))
        content = QWidget()
        vbox(self.checks, STRETCH, margins=0, parent=content)
        area = self._area = scrolled(content)
        middle = hbox((area, 1), self._make_side_column(), spacing=20)
        foot = hbox(self.cancel, self.again, spacing=16)
        self.note = label(_NOT_STARTED, "label", "text2")
        add_parts(foot, self.note, STRETCH, self.start)
        vbox(head, (middle, 1), Rule(), foot, spacing=16, margins=(32, 22, 32, 20), parent=self)

    def _make_side_column(self) -> QWidget:
        """Return the scroll area beside the checks, with the servo's lateness and the coming session."""
        lateness = Card("Servo lateness", label("measured at rest, µs", "small", "text2"), padding=18, gap=6)
        self.plot.setMinimumHeight(150)
        lateness.column.addWidget(self.plot, 1)
        self.runs = Card("What will run", padding=18, gap=8)
        self._grid = grid(down=9)
        self._grid.setColumnStretch(1, 1)
        add_layout(self.runs.column, self._grid)
        if self.masking is not None:
            self.runs.column.addWidget(self.masking)
        side = scrolled(vbox((lateness, 1), self.runs, spacing=12, margins=0))
        side.setFixedWidth(_SIDE_WIDTH)
        return side

    def show_view(self, view: PreflightView) -> None:
        self.who.setText(f"{view.study}  ·  {view.who}")
        self._show_chip(view)
        self.start.show_action("play", view.start_text)
        self.start.setEnabled(not view.busy and not view.failures)
        self.again.setEnabled(not view.busy)
        if self._busy and not view.busy:
            self.start.setFocus()  # the disabled button lost the focus to Cancel
        self._busy = view.busy
        if [row.check for row in self.rows] != list(view.checks):
            self.rows = _check_rows(view.checks, self.rows, self.checks.column)
        self._show_rows(view)
        late_us = view.facts.lateness_ns / 1e3
        p99_us = float(np.percentile(late_us, 99)) if len(late_us) else None
        self.plot.show_histogram(*lateness_histogram(late_us), p99_us)

    def _show_chip(self, view: PreflightView) -> None:
        if view.busy:
            self.chip.show_state("neutral", "clock", _WAITING.capitalize())
        elif view.failures:
            self.chip.show_state("bad", "cross", view.passed_text)
        elif view.warnings:
            self.chip.show_state("warn", "warning", view.passed_text)
        else:
            self.chip.show_state("ok", "check", view.passed_text)

    def _show_rows(self, view: PreflightView) -> None:
        """Show the rows about the session; a row that is no longer known is hidden."""
        for row, (name, text) in enumerate(view.rows):
            if name not in self._values:
                value = figures("", "label", weight=600)
                value.setAlignment(Qt.AlignmentFlag.AlignRight)
                value.setWordWrap(True)
                self._names[name] = label(name, "label", "text2")
                self._grid.addWidget(self._names[name], row, 0)
                self._grid.addWidget(value, row, 1)
                self._values[name] = value
            self._values[name].setText(text)
        shown = dict(view.rows)
        for name, value in self._values.items():
            self._names[name].setVisible(name in shown)
            value.setVisible(name in shown)

    def values(self) -> tuple[QLabel, ...]:
        return tuple(self._values.values())

    def _ask_to_start(self) -> None:
        if not self._done and self.start.isEnabled():
            self._done = True
            self.start_asked.emit()

    def finish(self) -> None:
        """Close without a signal, because the session begins or was cancelled elsewhere."""
        self._done = True
        self.close()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            self.close()
        elif event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            chosen = next((button for button in (self.cancel, self.again) if button.hasFocus()), self.start)
            chosen.click()
        elif event.key() in _PAGES:
            self._area.verticalScrollBar().triggerAction(_PAGES[Qt.Key(event.key())])
        else:
            super().keyPressEvent(event)

    def closeEvent(self, event: QCloseEvent) -> None:
        super().closeEvent(event)
        if not self._done:
            self._done = True
            self.cancelled.emit()


class _MaskingQuestion(QWidget):
    """A choice of how the motors are masked and, for masking noise, its level in dB."""

    def __init__(self) -> None:
        super().__init__()
        self.means = Choice()
        self.means.setAccessibleName("Motors masked?")
        for means, text in MEANS.items():
            self.means.addItem(text, means)
        self.noise_db = Number(QUIETEST_DB, LOUDEST_DB, USUAL_DB)
        self.noise_db.setAccessibleName("Noise level in dB")
        self.noise_db.setSuffix(" dB")
        self.noise_db.setVisible(False)
        self.means.currentIndexChanged.connect(lambda: self.noise_db.setVisible(self._is_noise))
        row = hbox((self.means, 1), self.noise_db)
        vbox(label("Motors masked?", "label", "text2"), row, margins=0, parent=self)

    @property
    def _is_noise(self) -> bool:
        return bool(self.means.currentData() == "noise")

    def answer(self) -> Masking:
        return Masking(self.means.currentData(), self.noise_db.value() if self._is_noise else None)


_SIZE = (860, 620)
_ABOUT = (
    "These values are measured over two seconds with the simulated hand. Each session measures them again with its own "
    "device and limits. This page is also available under This machine."
)
_MEASURING = "Measuring… On first use the force model is compiled, which may take a minute."


class ComputerWindow(Question):
    """The dialog with the checks of this computer; ``asked`` requests to repeat them."""

    asked = Signal()

    def __init__(self, parent: QWidget, theme: Theme) -> None:
        self.rows: list[_CheckRow] = []
        self.state = label(_MEASURING, "body", "text2", wraps=True)
        self.bar = QProgressBar(textVisible=False)
        self.bar.setFixedHeight(8)
        self._rows = vbox(STRETCH, spacing=0, margins=0)
        area = scrolled(self._rows)
        area.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        area.setAccessibleName("Checks")
        content, close = QWidget(), ActionButton("", "Close", role="primary")
        vbox(self.state, self.bar, (area, 1), spacing=12, margins=0, parent=content)
        super().__init__(parent, theme, "Computer check", _ABOUT, close, back="Check again", inside=content)
        self.setModal(True)
        self.back.clicked.disconnect(self.reject)
        self.back.clicked.connect(self.asked)
        self.resize(*_SIZE)

    def show_measuring(self) -> None:
        self.state.setText(_MEASURING)
        self.back.setEnabled(False)
        self.bar.setRange(0, 0)
        self.bar.show()

    def show_compiled(self, share: float) -> None:
        self.bar.setRange(0, 100)
        self.bar.setValue(round(100 * share))

    def show_checks(self, checks: tuple[Check, ...]) -> None:
        self.rows = _check_rows(checks, self.rows, self._rows)
        passed = sum(check.verdict == "ok" for check in checks)
        self.show_sentence(f"{passed} of {len(checks)} passed.")

    def show_sentence(self, sentence: str) -> None:
        self.state.setText(sentence)
        self.back.setEnabled(True)
        self.bar.hide()
