"""The operator's header: study, participant and state, the banner of trouble, the strip over one screen."""

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QPushButton, QVBoxLayout, QWidget

from study_app.gui.kit.commands import key_cap
from study_app.gui.operator.operator_view import OperatorView, State
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import PARTICIPANT, RADIUS_CARD, Tone, font
from study_app.gui.theme.themed import Themed, apply_theme_within
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.gui.widgets.cards import SHADOW, Chip, Icon, Logo
from study_app.gui.widgets.controls import ActionButton, CompactStop
from study_app.gui.widgets.labels import Elided, figures, label
from study_app.number_text import minutes

STATES: dict[State, tuple[Tone, str]] = {
    "preparing": ("neutral", "clock"),
    "running": ("accent", "play"),
    "paused": ("warn", "pause"),
    "force off": ("warn", "stop"),
    "trouble": ("bad", "warning"),
    "ended": ("ok", "check"),
}
OTHER_WINDOW = "F6"  # not every desktop has a key for it, above all not in full screen
BLINDINGS = {"double": ("lock", "Double-blind"), "single": ("eye", "Single-blind")}
SAVED_RECENTLY_S = 2.0
PARTS_WIDTH = 120
PARTS_GAP = 4


def shown_state(view: OperatorView) -> tuple[Tone, str, str]:
    """Return tone, icon and word of a session's state."""
    tone, icon = STATES[view.state]
    if view.state == "ended" and view.state_word != "Complete":
        tone, icon = "neutral", "cross"
    return tone, icon, view.state_word


class ThemeButton(Themed, QPushButton):
    """Changes between light and dark; a moon in light, a sun in dark."""

    def __init__(self) -> None:
        super().__init__()
        self.setFixedSize(40, 40)
        self.setProperty("role", "plain")
        self.setToolTip("Light or dark")
        self.setAccessibleName("Switch between light and dark theme")

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        name = "sun" if self.theme.dark else "moon"
        draw_icon(QPainter(self), name, QRectF(10, 10, 20, 20), self.theme.text2)


class PartsBar(Themed, QWidget):
    """A bar for each part, as long as its share of all trials, filled as far as its trials are done."""

    def __init__(self) -> None:
        super().__init__()
        self.main_trials: tuple[tuple[int, int], ...] = ()
        self.setFixedSize(PARTS_WIDTH, 14)

    def show_trials(self, main_trials: tuple[tuple[int, int], ...]) -> None:
        if main_trials != self.main_trials:
            self.main_trials = main_trials
            self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        room = self.width() - PARTS_GAP * (len(self.main_trials) - 1)
        x = 0.0
        for done, of in self.main_trials:
            width = room * of / sum(trials for _, trials in self.main_trials)
            for colour, filled in ((self.theme.sunk, width), (self.theme.accent, width * done / of)):
                painter.setBrush(QColor(colour))
                painter.drawRoundedRect(QRectF(x, 3, filled, 8), 4, 4)
            x += width + PARTS_GAP


class Header(Themed, QWidget):
    """The strip at the top; ``theme_asked`` when the operator wants the other theme.

    ``page_asked`` when the operator wants the participant's window in front, which covers this one on a single screen.
    """

    theme_asked = Signal()
    page_asked = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setFixedHeight(64)
        self.study = Elided("card")
        self.who = Elided("label", "text2")
        self.who.setFont(font("label", tabular=True))
        self.state = Chip("neutral", "clock", "Preparing")
        self.blind = Chip("neutral", "lock", "Double-blind")
        self.saved = Chip("neutral", "ring", "Nothing to save yet")
        self.clock = figures("0:00", "card")
        self.clock.setAlignment(Qt.AlignmentFlag.AlignRight)
        self.expected = figures("", "small", "text2")
        self.expected.setAlignment(Qt.AlignmentFlag.AlignRight)
        self.bar = PartsBar()
        self.trials = figures("", "small", "text2")
        self.theme_button = ThemeButton()
        self.theme_button.clicked.connect(self.theme_asked)
        self.page = ActionButton("", "Participant's window", key=OTHER_WINDOW, height=40)
        self.page.clicked.connect(self.page_asked)
        self.page.hide()
        self._lay_out()

    def _lay_out(self) -> None:
        whose, how_long = _column(self.study, self.who), _column(self.clock, self.expected)
        chips = self.state, self.blind, self.saved
        left = Logo(), whose, 8, *chips
        right = how_long, _column(self.bar, self.trials), 8, self.page, self.theme_button
        hbox(*left, (STRETCH, 1), *right, spacing=12, margins=(24, 8, 24, 8), parent=self)

    def show_view(self, view: OperatorView) -> None:
        self.study.show_text(view.study)
        self.who.show_text(view.who)
        self.blind.show_state("neutral", *BLINDINGS[view.blinding])
        self.state.show_state(*shown_state(view))
        if view.saved_ago_s is None:
            self.saved.show_state("neutral", "ring", "Nothing to save yet")
        elif view.over or view.saved_ago_s > SAVED_RECENTLY_S:
            self.saved.show_state("ok", "check", "All saved to disk")
        else:
            self.saved.show_state("ok", "check", "Saved to disk now")
        self.clock.setText(minutes(view.elapsed_s))
        self.expected.setText(f"of about {max(1, round(view.expected_s / 60))} min")
        self.bar.show_trials(view.main_trials)
        self.trials.setText(view.trials_line)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(self.theme.surface))
        painter.fillRect(0, self.height() - 1, self.width(), 1, QColor(self.theme.border))


def _column(*widgets: QWidget) -> QVBoxLayout:
    return vbox(STRETCH, *widgets, STRETCH, spacing=2)


WHAT_TO_DO = (
    "The force is off and every answer so far is on disk. End the session, fix the cause, then start a new one."
)
RECONNECT = (
    "The force is off and every answer so far is on disk. Plug in the device, then reconnect it. The session stays "
    "paused until you resume it; an interrupted trial starts again."
)
WAITS = (
    "The force is off and nothing is lost. Free disk space or reconnect the drive; the session then continues, paused."
)
AFTERWARDS = "The session is closed and the force is off. Everything in the journal is safe."


class Banner(Themed, QWidget):
    """A tinted strip with a sign, what happened, what to do, and a button where the device can be reconnected."""

    reconnect_asked = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.what = label("", "strong", "bad", wraps=True)
        self.then = label(WHAT_TO_DO, "label", "text", wraps=True)
        words = vbox(self.what, self.then, spacing=4)
        sign = Icon("warning", "bad", 24), 0, Qt.AlignmentFlag.AlignTop
        self.reconnect = ActionButton("repeat", "Reconnect", key="C", role="primary")
        self.reconnect.clicked.connect(self.reconnect_asked)
        button = self.reconnect, 0, Qt.AlignmentFlag.AlignVCenter
        hbox(sign, (words, 1), button, spacing=14, margins=(20, 14, 20, 14), parent=self)
        self.reconnect.hide()
        self.hide()

    def show_view(self, view: OperatorView) -> None:
        if view.trouble != self.what.text():
            self.what.setText(view.trouble[:1].upper() + view.trouble[1:])
        offered = view.may_reconnect and not view.over
        advice = RECONNECT if offered else WAITS if view.waits else WHAT_TO_DO
        self.then.setText(AFTERWARDS if view.over else view.reconnection or advice)
        self.reconnect.setVisible(offered)
        self.reconnect.setEnabled(not view.reconnects)
        self.setVisible(bool(view.trouble))

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(self.theme.bad_bg))
        strip = QRectF(self.rect()).adjusted(SHADOW, 0, -SHADOW, 0)
        painter.drawRoundedRect(strip, RADIUS_CARD, RADIUS_CARD)


HEIGHT = 52


class Strip(Themed, QWidget):
    """State, where the session is, the way to the operator's window and the force stop; it never takes the keyboard.

    A session that is ``played`` has no operator's window; its stop ends it.
    """

    stop_asked = Signal()
    operator_asked = Signal()

    def __init__(self, *, played: bool = False) -> None:
        super().__init__()
        self.setFixedHeight(HEIGHT)
        self.state = Chip("neutral", "clock", "Preparing")
        self.where = Elided("label", "text2")
        self.operator = ActionButton("", "Operator's window", key=OTHER_WINDOW, height=40)
        self.stop = CompactStop("Stop playing", key_cap("stop")) if played else CompactStop()
        self.operator.clicked.connect(self.operator_asked)
        self.stop.pressed.connect(self.stop_asked)
        row = hbox(self.state, (self.where, 1), spacing=12, margins=(16, 4, 8, 4), parent=self)
        for button in (self.operator, self.stop):
            button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            row.addWidget(button)
        self.operator.setHidden(played)
        apply_theme_within(self, PARTICIPANT)

    def show_view(self, view: OperatorView) -> None:
        self.state.show_state(*shown_state(view))
        self.where.show_text(view.heading)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(self.theme.surface))
        painter.fillRect(0, self.height() - 1, self.width(), 1, QColor(self.theme.border))
