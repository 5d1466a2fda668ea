"""The operator's window: the progress on the left, the session's health in the middle, the actions on the right.

It shows an ``OperatorView`` and plots, and emits the operator's requests; it does not depend on runner or servo.
"""

import re
from collections.abc import Callable
from functools import partial
from traceback import clear_frames
from typing import Any, Final, Literal

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QCloseEvent, QGuiApplication, QResizeEvent
from PySide6.QtWidgets import QMainWindow, QWidget

from study_app.gui.kit.dialogs import REASON, Question
from study_app.gui.kit.fields import Field
from study_app.gui.operator.controls import ALL_ROWS, Actions, DeviceCard, NotesCard, StopPanel
from study_app.gui.operator.operator_view import NOTES_SHOWN, OperatorView
from study_app.gui.operator.plots import ForceCard, HiddenForceCard, LatenessCard, PositionCard, Tiles
from study_app.gui.operator.servo_health import Forces, ServoHealth
from study_app.gui.operator.session_panels import NARROW, SLIM, WIDTH, Banner, Header, Rail
from study_app.gui.theme.theme import DARK, LIGHT, Theme
from study_app.gui.theme.themed import Themed, apply_theme
from study_app.gui.widgets.boxes import add_layout, grid, vbox
from study_app.gui.widgets.cards import Card, scrolled
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.main_view import EscapeKey

_Width = Literal["wide", "narrow", "slim"]
_Height = Literal["high", "low", "lower", "least"]

_SIDE = 350
_MARGINS: dict[_Width, int] = {"wide": 21, "narrow": 18, "slim": 9}
_GAPS: dict[_Width, int] = {"wide": 18, "narrow": 14, "slim": 9}
_RAILS: dict[_Width, int] = {"wide": WIDTH, "narrow": NARROW, "slim": SLIM}
NARROW_BELOW, SLIM_BELOW = 1500, 1320
LOW_BELOW, LOWER_BELOW, LEAST_BELOW = 870, 750, 705
_STOPS: dict[_Height, int] = {"high": 250, "low": 236, "lower": 236, "least": 236}
_NOTES: dict[_Height, int] = {"high": NOTES_SHOWN, "low": 2, "lower": 1, "least": 0}
_DEVICE_ROWS: dict[_Height, int] = {"high": ALL_ROWS, "low": 3, "lower": 2, "least": 2}
_SIDE_BY_SIDE_FROM = 640  # minimum width for four tiles, and two plots, side by side
_ICONS_FROM = 690  # minimum width of the buttons with icons
_GAP = 10
_END_REASONS: Final = (("aborted", "Another reason"), ("withdrawn", "The participant withdrew"))


class _Arrangement(QWidget):
    """The layout of the window, which adapts to its size: header, rail, middle and side."""

    def __init__(self, window: "OperatorWindow") -> None:
        super().__init__()
        self.setProperty("role", "window")
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setAccessibleName("Operator's window")
        self._parts = p = window
        self._arranged: tuple[object, ...] = ()
        self.now = Card(padding=14, gap=10)
        self._middle = grid(_GAP, _GAP, margins=0)
        for column in (0, 1):
            self._middle.setColumnStretch(column, 1)
        side = vbox(p.device, (p.notes, 1), spacing=_GAP, margins=0)
        self.middle_area = scrolled(self._middle)
        self.side_area = scrolled(side)
        self.side_area.setFixedWidth(_SIDE)
        right = vbox((self.side_area, 1), p.stop, spacing=_GAP)
        self._body = grid(down=_GAP)
        add_layout(self._body, right, 0, 2, 2, 1)
        self._body.setColumnStretch(1, 1)
        self._body.setRowStretch(0, 1)
        vbox(p.header, (self._body, 1), spacing=0, margins=0, parent=self)
        self._arrange(QSize(1600, 900))

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._arrange(event.size())

    def _arrange(self, size: QSize) -> None:
        width: _Width = "wide" if size.width() >= NARROW_BELOW else "narrow" if size.width() >= SLIM_BELOW else "slim"
        steps: tuple[tuple[int, _Height], ...] = ((LOW_BELOW, "high"), (LOWER_BELOW, "low"), (LEAST_BELOW, "lower"))
        height: _Height = next((name for minimum, name in steps if size.height() >= minimum), "least")
        row = size.width() - 2 * _MARGINS[width] - _GAPS[width] - _SIDE
        middle = row - _RAILS[width] - _GAPS[width]
        has_icons = (row if width == "slim" else middle) >= _ICONS_FROM
        side_by_side = middle >= _SIDE_BY_SIDE_FROM
        if (width, height, side_by_side, has_icons) == self._arranged:
            return
        self._arranged = (width, height, side_by_side, has_icons)
        self._set_width(width)
        self._parts.stop.setFixedSize(_SIDE, _STOPS[height])
        self._parts.notes.set_note_count(_NOTES[height])
        self._parts.device.set_row_limit(_DEVICE_ROWS[height])
        self._parts.buttons.set_narrow(not has_icons)
        self._parts.buttons.hint.setVisible(width == "wide")
        self._fill_middle(side_by_side=side_by_side)

    def _set_width(self, width: _Width) -> None:
        header, rail, slim = self._parts.header, self._parts.rail, width == "slim"
        for part in (header.bar, header.trials):  # the card of the current step shows the same
            part.setHidden(slim)
        if slim:
            rail.show_dots_only()
            self.now.column.addWidget(rail.now)
            self.now.column.addWidget(rail.tally)
        else:
            rail.show_panels()
        self.now.setVisible(slim)
        rail.set_narrow(width != "wide")
        margin = _MARGINS[width]
        self._body.setContentsMargins(margin, margin, margin, margin - 4)
        self._body.setHorizontalSpacing(_GAPS[width])
        self._body.addWidget(rail, 0, 0, 1 if slim else 2, 1)
        self._body.addWidget(self.middle_area, 0, 1)
        self._body.addWidget(self._parts.buttons, 1, 0 if slim else 1, 1, 2 if slim else 1)

    def _fill_middle(self, *, side_by_side: bool) -> None:
        p, span = self._parts, 1 if side_by_side else 2
        for card, minimum in ((p.lateness, 210), (p.force, 210), (p.position, 170)):
            card.setMinimumHeight(minimum)
        p.tiles.set_narrow(not side_by_side)
        self._middle.addWidget(p.banner, 0, 0, 1, 2)
        self._middle.addWidget(self.now, 1, 0, 1, 2)
        self._middle.addWidget(p.tiles, 2, 0, 1, 2)
        self._middle.addWidget(p.lateness, 3, 0, 1, span)
        self._middle.addWidget(p.force, *((3, 1) if side_by_side else (5, 0)), 1, span)
        self._middle.addWidget(p.position, 4, 0, 1, 2)
        for row, stretch in ((3, 30), (4, 26), (5, 0 if side_by_side else 30)):
            self._middle.setRowStretch(row, stretch)


_FULL = QSize(1600, 900)
_LEAST = QSize(1024, 640)

_OVERRIDE_PREFIX: Final = re.compile(r"^(Error calling Python override of [\w:]+\(\): )+")
"""The prefix that PySide 6.10 and newer add to the message of an exception that passes through a Qt call."""


class OperatorWindow(Themed, QMainWindow):
    """The operator's window during a session.

    Parameters
    ----------
    lateness_limit_s : the protocol's limit of the 99th percentile of lateness [s]
    reach_m : half of the longest edge of the tank [m], for the scale of the position plot
    pointer : whether positions are those of the mouse pointer
    felt : whether the device exerts force
    stop_button : the device's button that also stops the force, or ""
    force_limit_n : the largest force on the hand [N] in a single-blind study; None if the force is hidden
    """

    asked = Signal(str, tuple)

    def __init__(
        self,
        study: str,
        *,
        lateness_limit_s: float,
        reach_m: float,
        pointer: bool,
        felt: bool = True,
        stop_button: str = "",
        force_limit_n: float | None = None,
        theme: Theme = LIGHT,
    ) -> None:
        super().__init__()
        self.setWindowTitle(f"{study} – operator")
        self.setMinimumSize(_LEAST)
        self.may_close = False
        self._view: OperatorView | None = None
        self.header = Header()
        self.banner = Banner()
        self.rail = Rail()
        self.tiles = Tiles()
        self.lateness = LatenessCard(lateness_limit_s)
        self.force = HiddenForceCard() if force_limit_n is None else ForceCard(force_limit_n)
        self.position = PositionCard(reach_m, pointer=pointer)
        self.device = DeviceCard()
        self.notes = NotesCard()
        self.stop = StopPanel(felt=felt, device_button=stop_button)
        self.buttons = Actions()
        self.question: Question | None = None
        self._question_trial = ""  # the trial that the open question is about
        self._failures: set[str] = set()
        self.escape = EscapeKey(self, anywhere=True)
        self.arrangement = _Arrangement(self)
        self.setCentralWidget(self.arrangement)
        self.arrangement.setFocus()
        self._connect()
        self.resize(_FULL)
        apply_theme(self, theme)

    def _connect(self) -> None:
        ask, buttons = self.ask, self.buttons
        # The stop is connected to pressed, not clicked, so that the force stops at the first touch.
        for signal, request in (
            (self.stop.stop.pressed, "stop"),
            (self.escape.held, "stop"),
            (self.stop.fade_in.clicked, "resume"),
            (self.notes.mark.clicked, "mark"),
            (self.device.diagnose.clicked, "diagnose"),
            (self.banner.reconnect.clicked, "reconnect"),
            (self.header.page.clicked, "page"),
        ):
            signal.connect(partial(self._ask_by_button, request))
        buttons.pause.clicked.connect(lambda: ask(buttons.pause_request))
        buttons.repeat.clicked.connect(self.ask_to_repeat)
        buttons.end.clicked.connect(self.ask_to_end)
        buttons.close_session.clicked.connect(self.close)
        self.notes.note_written.connect(partial(ask, "note"))
        self.header.theme_button.clicked.connect(self._change_theme)

    def ask(self, request: str, *details: Any) -> None:
        """Emit a request with its details."""
        self.asked.emit(request, details)

    def _ask_by_button(self, request: str, _checked: bool = False) -> None:
        self.ask(request)

    def show_guarded(self, show: Callable[..., object], *shown: object) -> None:
        """Call ``show``; if it fails, report the error and let the session continue."""
        try:
            show(*shown)
        except Exception as error:  # noqa: BLE001 - reported, logged and recorded in the journal
            self.report_failure(error)

    def report_failure(self, error: BaseException) -> None:
        """Report once that a part of the window failed."""
        clear_frames(error.__traceback__)  # a painter that a frame keeps alive would block Qt's painting
        if (message := f"{type(error).__name__}: {_OVERRIDE_PREFIX.sub('', str(error))}") not in self._failures:
            self._failures.add(message)
            self.show_message("Part of this window failed", f"{message}. The session continues.")
            self.ask("failed", message, error)

    def show_view(self, view: OperatorView) -> None:
        """Show everything except the plots; first the banner with the problem, since other parts may fail."""
        if view == self._view:
            return
        self.banner.show_view(view)
        self.may_close = view.over
        if self.question is not None and self._question_trial not in {
            "",
            _setting_name(view) if view.may_repeat else None,
        }:
            self.question.reject()  # its trial is over, so the answer would apply to the next one
        for part in (self.stop, self.header, self.buttons):
            part.show_view(view)
        for show in (self.rail.now, self.rail.tally, self.tiles, self.notes, self.rail, self.device):
            self.show_guarded(show.show_view, view)
        self._view = view

    def show_traces(self, health: ServoHealth, now_s: float) -> None:
        self.show_guarded(self.position.show_health, health, now_s)

    def show_forces(self, forces: Forces, now_ns: int) -> None:
        """Draw the force unless it is hidden; called 30 times a second."""
        if isinstance(self.force, ForceCard):
            self.show_guarded(self.force.show_forces, forces, now_ns)

    def show_lateness(self, health: ServoHealth) -> None:
        self.show_guarded(self.lateness.show_health, health)

    def ask_to_repeat(self) -> None:
        """Ask for the reason to repeat the trial, which is required."""
        if self._view is not None and self._view.may_repeat:
            setting = _setting_name(self._view)
            self._open_question(
                "repeat",
                "Repeat this trial?",
                f"{setting} restarts from the beginning. The first recording is kept, together with your reason.",
                ActionButton("repeat", "Repeat trial", role="primary"),
                fields=(Field("reason", "Reason", placeholder="For example: the phone rang"),),
                needs={"reason": REASON},
            )
            self._question_trial = setting

    def ask_to_end(self) -> None:
        if self._view is not None and not self._view.over:
            self._open_question(
                "end",
                "End this session now?",
                f"{dict(self._view.counts)['Answers on disk']} answers are on disk and will be kept. The force will "
                "be turned off when the session ends.",
                ActionButton("cross", "End session", role="danger"),
                back="Continue the session",
                fields=(
                    Field("status", "What happened", "radio", _END_REASONS),
                    Field("reason", "Reason", placeholder="Optional"),
                ),
            )
            assert self.question is not None  # noqa: S101 - just made
            self.question.back.setDefault(True)

    def _open_question(self, request: str, title: str, explanation: str, go_on: ActionButton, **more: Any) -> None:
        """Open a question unless one is open; accepting it emits the ``request`` with the answers."""
        if self.question is not None:
            self.question.raise_()
            self.question.activateWindow()
            return
        question = self.question = Question(self, self.theme, title, explanation, go_on, **more)
        question.accepted.connect(lambda: self.ask(request, *map(question.value, question.editors)))
        question.finished.connect(self._discard_question)
        question.show()

    def show_message(self, title: str, sentence: str) -> None:
        notice = Question(self, self.theme, title, sentence)
        notice.finished.connect(notice.deleteLater)
        notice.finished.connect(self._regain_focus)
        notice.show()

    def bring_forward(self) -> None:
        self.raise_()
        self.activateWindow()

    def _discard_question(self) -> None:
        if self.question is not None:
            self.question.deleteLater()
        self.question, self._question_trial = None, ""
        self._regain_focus()

    def _regain_focus(self) -> None:
        """Regain the focus after a dialog, since Esc must also work without a window manager."""
        if QGuiApplication.focusWindow() is None:
            self.activateWindow()

    def _change_theme(self) -> None:
        apply_theme(self, LIGHT if self.theme.dark else DARK)

    def closeEvent(self, event: QCloseEvent) -> None:
        """Close at once after the session; otherwise stay open and emit the request "close"."""
        if self.may_close:
            event.accept()
        else:
            event.ignore()
        self.ask("close")


def _setting_name(view: OperatorView) -> str:
    """Return the neutral name of the current trial with its number, which makes it unique."""
    return f"{view.setting_line.split('  ·  ')[0]} ({view.heading.lower()})"
