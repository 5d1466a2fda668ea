"""The operator's window: left where we are, in the middle whether it is healthy, right what can be done.

It draws an ``OperatorView`` and two plots, and says what the operator asks for; it knows no runner and no servo.
"""

from collections.abc import Callable
from functools import partial
from typing import Literal

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QCloseEvent, QGuiApplication, QResizeEvent
from PySide6.QtWidgets import QMainWindow, QWidget

from study_app.gui.operator.controls import ALL_ROWS, Actions, DeviceCard, NotesCard, ReasonQuestion, StopPanel
from study_app.gui.operator.operator_view import NOTES_SHOWN, OperatorView
from study_app.gui.operator.plots import ForceCard, HiddenForceCard, LatenessCard, PositionCard, Tiles
from study_app.gui.operator.servo_health import Forces, ServoHealth
from study_app.gui.operator.session_panels import NARROW, SLIM, WIDTH, Banner, Header, Rail
from study_app.gui.theme.theme import DARK, LIGHT, Theme
from study_app.gui.theme.themed import apply_theme
from study_app.gui.widgets.boxes import add_layout, grid, vbox
from study_app.gui.widgets.cards import Card, scrolled
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.dialogs import Notice
from study_app.gui.widgets.failed_panel import Panels
from study_app.gui.widgets.main_view import EscapeKey

Width = Literal["wide", "narrow", "slim"]
Height = Literal["high", "low", "lower", "least"]

SIDE = 350
MARGINS: dict[Width, int] = {"wide": 21, "narrow": 18, "slim": 9}
GAPS: dict[Width, int] = {"wide": 18, "narrow": 14, "slim": 9}
RAILS: dict[Width, int] = {"wide": WIDTH, "narrow": NARROW, "slim": SLIM}
NARROW_BELOW, SLIM_BELOW = 1500, 1320
LOW_BELOW, LOWER_BELOW, LEAST_BELOW = 870, 750, 705
STOPS: dict[Height, int] = {"high": 250, "low": 236, "lower": 236, "least": 236}
NOTES: dict[Height, int] = {"high": NOTES_SHOWN, "low": 2, "lower": 1, "least": 0}
DEVICE_ROWS: dict[Height, int] = {"high": ALL_ROWS, "low": 3, "lower": 2, "least": 2}
ACROSS_FROM = 640  # so wide a middle has four tiles, and two plots, side by side
SIGNS_FROM = 690  # so wide a row of buttons has room for their signs
GAP = 10


class Arrangement(QWidget):
    """The window's whole content: header, rail, middle and side."""

    def __init__(self, window: "OperatorWindow") -> None:
        super().__init__()
        self.setProperty("role", "window")
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setAccessibleName("Operator's window")
        self._parts = p = window
        self._arranged: tuple[object, ...] = ()
        self.now = Card(padding=14, gap=10)
        self._middle = grid(GAP, GAP, margins=0)
        for column in (0, 1):
            self._middle.setColumnStretch(column, 1)
        side = vbox(p.device, (p.notes, 1), spacing=GAP, margins=0)
        self.middle_area = scrolled(self._middle)
        self.side_area = scrolled(side)
        self.side_area.setFixedWidth(SIDE)
        right = vbox((self.side_area, 1), p.stop, spacing=GAP)
        self._body = grid(down=GAP)
        add_layout(self._body, right, 0, 2, 2, 1)
        self._body.setColumnStretch(1, 1)
        self._body.setRowStretch(0, 1)
        vbox(p.header, (self._body, 1), spacing=0, margins=0, parent=self)
        self._arrange(QSize(1600, 900))

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._arrange(event.size())

    def _arrange(self, size: QSize) -> None:
        width: Width = "wide" if size.width() >= NARROW_BELOW else "narrow" if size.width() >= SLIM_BELOW else "slim"
        steps: tuple[tuple[int, Height], ...] = ((LOW_BELOW, "high"), (LOWER_BELOW, "low"), (LEAST_BELOW, "lower"))
        height: Height = next((name for from_, name in steps if size.height() >= from_), "least")
        row = size.width() - 2 * MARGINS[width] - GAPS[width] - SIDE
        middle = row - RAILS[width] - GAPS[width]
        signs = (row if width == "slim" else middle) >= SIGNS_FROM
        across = middle >= ACROSS_FROM
        if (width, height, across, signs) == self._arranged:
            return
        self._arranged = (width, height, across, signs)
        self._set_width(width)
        self._set_height(height)
        self._parts.buttons.narrow(not signs)
        self._parts.buttons.hint.setVisible(width == "wide")
        self._fill_middle(across=across)

    def _set_width(self, width: Width) -> None:
        rail, slim = self._parts.rail, width == "slim"
        if slim:
            rail.give_away()
            self.now.column.addWidget(rail.now)
            self.now.column.addWidget(rail.tally)
        else:
            rail.take_back()
        self.now.setVisible(slim)
        rail.narrow(width != "wide")
        margin = MARGINS[width]
        self._body.setContentsMargins(margin, margin, margin, margin - 4)
        self._body.setHorizontalSpacing(GAPS[width])
        self._body.addWidget(rail, 0, 0, 1 if slim else 2, 1)
        self._body.addWidget(self.middle_area, 0, 1)
        self._body.addWidget(self._parts.buttons, 1, 0 if slim else 1, 1, 2 if slim else 1)

    def _set_height(self, height: Height) -> None:
        self._parts.stop.setFixedSize(SIDE, STOPS[height])
        self._parts.notes.show_lines(NOTES[height])
        self._parts.device.show_rows(DEVICE_ROWS[height])

    def _fill_middle(self, *, across: bool) -> None:
        p, span = self._parts, 1 if across else 2
        for card, least in ((p.lateness, 210), (p.force, 210), (p.position, 170)):
            card.setMinimumHeight(least)
        p.tiles.narrow(not across)
        self._middle.addWidget(p.banner, 0, 0, 1, 2)
        self._middle.addWidget(self.now, 1, 0, 1, 2)
        self._middle.addWidget(p.tiles, 2, 0, 1, 2)
        self._middle.addWidget(p.lateness, 3, 0, 1, span)
        self._middle.addWidget(p.force, *((3, 1) if across else (5, 0)), 1, span)
        self._middle.addWidget(p.position, 4, 0, 1, 2)
        for row, stretch in ((3, 30), (4, 26), (5, 0 if across else 30)):
            self._middle.setRowStretch(row, stretch)


FULL = QSize(1600, 900)
LEAST = QSize(1024, 640)


class OperatorWindow(QMainWindow):
    """The cockpit.

    Parameters
    ----------
    lateness_limit_s : the protocol's limit of the 99th percentile of lateness [s]
    reach_m : half of the longest edge of the tank [m], for the scale of the position plot
    pointer : whether positions are of the mouse pointer
    force_limit_n : largest force on the hand [N] in a single-blind study; None where the force is hidden
    """

    stop_asked = Signal()
    fade_in_asked = Signal()
    pause_asked = Signal()
    resume_asked = Signal()
    repeat_asked = Signal(str)
    exclude_asked = Signal(object, str)
    end_asked = Signal(str, str)
    note_written = Signal(str)
    mark_set = Signal()
    diagnose_asked = Signal()
    reconnect_asked = Signal()
    close_asked = Signal()
    page_asked = Signal()
    theme_changed = Signal(object)

    def __init__(
        self,
        study: str,
        *,
        lateness_limit_s: float,
        reach_m: float,
        pointer: bool,
        felt: bool = True,
        force_limit_n: float | None = None,
        theme: Theme = LIGHT,
    ) -> None:
        super().__init__()
        self.setWindowTitle(f"{study} – operator")
        self.setMinimumSize(LEAST)
        self.theme = theme
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
        self.stop = StopPanel(felt=felt)
        self.buttons = Actions()
        self.panels = Panels(
            {
                self.rail.now: "Now",
                self.rail.tally: "Counts",
                self.rail.steps_area: "Steps",
                self.rail: "Session",
                self.tiles: "Servo",
                self.lateness: "Tick lateness",
                self.force: "Force",
                self.position: "Position",
                self.device: "Device",
                self.notes: "Notes",
            }
        )
        self.question: ReasonQuestion | None = None
        self.escape = EscapeKey(self, anywhere=True)
        self.arrangement = Arrangement(self)
        self.setCentralWidget(self.arrangement)
        self.arrangement.setFocus()
        self._connect()
        self.resize(FULL)
        apply_theme(self, theme)

    def _connect(self) -> None:
        self.header.theme_button.clicked.connect(self._change_theme)
        self.header.page.clicked.connect(self.page_asked)
        # Pressed, not clicked: the force goes with the finger's first touch.
        self.stop.stop.pressed.connect(self.stop_asked)
        self.stop.fade_in.clicked.connect(self.fade_in_asked)
        self.escape.held.connect(self.stop_asked)
        self.buttons.pause_asked.connect(self.pause_asked)
        self.buttons.resume_asked.connect(self.resume_asked)
        self.buttons.repeat.clicked.connect(self.ask_to_repeat)
        self.buttons.exclude.clicked.connect(self.ask_to_exclude)
        self.buttons.end.clicked.connect(self.ask_to_end)
        self.buttons.close_session.clicked.connect(self.close)
        self.notes.note_written.connect(self.note_written)
        self.notes.mark.clicked.connect(self.mark_set)
        self.device.diagnose.clicked.connect(self.diagnose_asked)
        self.banner.reconnect.clicked.connect(self.reconnect_asked)

    def show_view(self, view: OperatorView) -> None:
        """Show everything but the plots; trouble first, for it may be that one of the parts cannot be shown."""
        if view == self._view:
            return
        self.banner.show_view(view)
        self.may_close = view.over
        asked = self.question
        if asked is not None and asked.about and not (view.may_repeat and asked.about == _setting(view)):
            asked.reject()  # the trial it was about is over: its answer would hit the next one
        for part in (self.stop, self.header, self.buttons):
            part.show_view(view)
        for panel in (self.rail.now, self.rail.tally, self.tiles, self.notes):
            self.panels.draw(panel, partial(panel.show_view, view))
        self.panels.draw(self.rail.steps_area, lambda: self.rail.show_view(view))
        self.panels.draw(self.device, lambda: self.device.show_device(view.device))
        self._view = view

    def show_traces(self, health: ServoHealth, now_s: float) -> None:
        self.position.show_health(health, now_s)

    def show_forces(self, forces: Forces, now_ns: int) -> None:
        """Draw force and wake (30 times a second), where they are not hidden."""
        if isinstance(self.force, ForceCard):
            self.force.show_forces(forces, now_ns)

    def show_lateness(self, health: ServoHealth) -> None:
        self.lateness.show_health(health)

    def ask_to_repeat(self) -> None:
        """Ask for the reason of a repetition; nothing happens without one."""
        if self._already_asked() or self._view is None or not self._view.may_repeat:
            return
        setting = _setting(self._view)
        self._ask(
            ReasonQuestion(
                self,
                self.theme,
                "Repeat this trial?",
                f"{setting} starts again from the beginning. The first recording is kept, together with your reason.",
                go_on=ActionButton("repeat", "Repeat trial", role="primary"),
                placeholder="Reason, for example: phone rang",
                about=setting,
            ),
            lambda question: self.repeat_asked.emit(question.reason.text().strip()),
        )

    def ask_to_exclude(self) -> None:
        """Ask what does not count, and why."""
        if self._already_asked() or self._view is None:
            return
        trial = self._view.trial
        self._ask(
            ReasonQuestion(
                self,
                self.theme,
                "Exclude this from the analysis?",
                "Nothing is deleted. The list of exclusions records what was excluded, by whom and why.",
                go_on=ActionButton("flag", "Exclude", role="primary"),
                placeholder="Reason, for example: talked during the trial",
                choices=(*([] if trial is None else [(trial, _setting(self._view))]), (None, "Whole session")),
                first=True,
            ),
            lambda question: self.exclude_asked.emit(question.choice, question.reason.text().strip()),
        )

    def show_message(self, title: str, sentence: str) -> None:
        notice = Notice(self, self.theme, title, sentence)
        notice.finished.connect(notice.deleteLater)
        notice.finished.connect(self._take_keyboard)
        notice.show()

    def ask_to_end(self) -> None:
        if self._already_asked() or self._view is None or self._view.over:
            return
        question = ReasonQuestion(
            self,
            self.theme,
            "End this session now?",
            f"{dict(self._view.counts)['Answers on disk']} answers are on disk and are kept. The force is turned off "
            "when the session ends.",
            go_on=ActionButton("cross", "End session", role="danger"),
            placeholder="Reason (optional)",
            choices=(("withdrawn", "The participant withdrew"), ("aborted", "Another reason")),
            back="Continue the session",
            required=False,
        )
        question.go_on.setDefault(False)
        question.back.setDefault(True)
        question.choices.button(1).setFocus()
        self._ask(question, lambda asked: self.end_asked.emit(asked.choice, asked.reason.text().strip()))

    def _ask(self, question: ReasonQuestion, answered: Callable[[ReasonQuestion], None]) -> None:
        self.question = question
        question.accepted.connect(lambda: answered(question))
        question.finished.connect(self._question_answered)
        question.show()

    def come_forward(self) -> None:
        self.raise_()
        self.activateWindow()

    def _already_asked(self) -> bool:
        if self.question is None:
            return False
        self.question.raise_()
        self.question.activateWindow()
        return True

    def _question_answered(self) -> None:
        if self.question is not None:
            self.question.deleteLater()
        self.question = None
        self._take_keyboard()

    def _take_keyboard(self) -> None:
        """Take the keyboard after a dialog: Esc must work without a window manager, too."""
        if QGuiApplication.focusWindow() is None:
            self.activateWindow()

    def _change_theme(self) -> None:
        self.theme = LIGHT if self.theme.dark else DARK
        apply_theme(self, self.theme)
        self.theme_changed.emit(self.theme)

    def closeEvent(self, event: QCloseEvent) -> None:
        """Close at once when the session is over; else leave it to who listens, with the window open."""
        if self.may_close:
            event.accept()
        else:
            event.ignore()
        self.close_asked.emit()


def _setting(view: OperatorView) -> str:
    """Return the neutral name of the trial under way, with its place so that it names one trial alone."""
    return f"{view.setting_line.split('  ·  ')[0]} ({view.heading.lower()})"
