"""The operator's panels about the session: header, banner and rail, and the strip used on a single screen."""

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPaintEvent, QPen, QResizeEvent
from PySide6.QtWidgets import QLabel, QSizePolicy, QVBoxLayout, QWidget

from study_app.gui.kit.commands import key_cap
from study_app.gui.operator.operator_view import OperatorView, State, StepRow
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import Tone, TypeRole, font
from study_app.gui.theme.themed import Themed, give_ground
from study_app.gui.widgets.accessible import plain_tip
from study_app.gui.widgets.boxes import STRETCH, add_parts, grid, hbox, vbox
from study_app.gui.widgets.cards import Bar, Card, Chip, Icon, Logo, Rule, scrolled, smooth_painter
from study_app.gui.widgets.controls import ActionButton, CompactStop, IconButton
from study_app.gui.widgets.labels import Elided, figures, label, set_ink
from study_app.number_text import clock_text

_STATES: dict[State, tuple[Tone, str]] = {
    "preparing": ("neutral", "clock"),
    "running": ("accent", "play"),
    "paused": ("warn", "pause"),
    "force off": ("warn", "stop"),
    "trouble": ("bad", "warning"),
    "ended": ("ok", "check"),
}
_SWITCH_KEY = "F6"  # not every desktop has a key that switches windows in full screen
_BLINDINGS = {"double": ("lock", "Double-blind"), "single": ("eye", "Single-blind")}
_SAVED_RECENTLY_S = 2.0
_TRIALS_PX = 120


def _state_chip(view: OperatorView) -> tuple[Tone, str, str]:
    """Return tone, icon and word of the chip with a session's state."""
    tone, icon = _STATES[view.state]
    if view.state == "ended" and view.state_word != "Complete":
        tone, icon = "neutral", "cross"
    return tone, icon, view.state_word


class _ThemeButton(IconButton):
    """The button that switches between light and dark theme."""

    def __init__(self) -> None:
        super().__init__("moon", "Switch between light and dark theme", "Light or dark", size=40, role="plain")

    def paintEvent(self, event: QPaintEvent) -> None:
        self._icon = "sun" if self.theme.dark else "moon"
        super().paintEvent(event)


class Header(QWidget):
    """The strip at the top; ``page`` raises the participant's window, which covers it on a single screen."""

    def __init__(self) -> None:
        super().__init__()
        give_ground(self, "bar")
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
        self.bar = Bar()
        self.bar.setFixedWidth(_TRIALS_PX)
        self.trials = figures("", "small", "text2")
        self.theme_button = _ThemeButton()
        self.page = ActionButton("", "Participant's window", key=_SWITCH_KEY, height=40)
        self.page.hide()
        self._lay_out()

    def _lay_out(self) -> None:
        left = Logo(), _column(self.study, self.who), 8, self.state, self.blind, self.saved
        right = _column(self.clock, self.expected), _column(self.bar, self.trials), 8, self.page, self.theme_button
        hbox(*left, (STRETCH, 1), *right, spacing=12, margins=(24, 8, 24, 8), parent=self)

    def show_view(self, view: OperatorView) -> None:
        self.study.show_text(view.study)
        self.who.show_text(view.who)
        self.blind.show_state("neutral", *_BLINDINGS[view.blinding])
        self.state.show_state(*_state_chip(view))
        if view.saved_ago_s is None:
            self.saved.show_state("neutral", "ring", "Nothing to save yet")
        elif view.over or view.saved_ago_s > _SAVED_RECENTLY_S:
            self.saved.show_state("ok", "check", "All saved to disk")
        else:
            self.saved.show_state("ok", "check", "Just saved to disk")
        self.clock.setText(clock_text(view.elapsed_s))
        self.expected.setText(f"of about {max(1, round(view.expected_s / 60))} min")
        done, of = view.main_trials
        self.bar.show_share(done / max(1, of))
        self.trials.setText(view.trials_line)


def _column(*widgets: QWidget) -> QVBoxLayout:
    return vbox(STRETCH, *widgets, STRETCH, spacing=2)


_END_SESSION = (
    "The force is off and every answer so far is on disk. End the session, fix the cause, then start a new one."
)
_RECONNECT = (
    "The force is off and every answer so far is on disk. Plug in the device, then reconnect it. The session stays "
    "paused until you resume it; an interrupted trial starts again."
)
_WAITS = (
    "The force is off and nothing has been lost. Free up some disk space or reconnect the drive. The session will then "
    "be paused until you resume it."
)
_AFTERWARDS = "The session is closed and the force is off. Everything in the journal is safe."
_WAITS_AT_END = (
    "The force is off and the journal is complete. Free up some disk space, and leave this window open until the "
    "session's other files have been written."
)


class Banner(QWidget):
    """A tinted strip with the problem, its remedy, and a button if the device can be reconnected."""

    def __init__(self) -> None:
        super().__init__()
        give_ground(self, "bad tint")
        self.what = label("", "strong", "bad", wraps=True)
        self.then = label(_END_SESSION, "label", "text", wraps=True)
        text = vbox(self.what, self.then, spacing=4)
        sign = Icon("warning", "bad", 24), 0, Qt.AlignmentFlag.AlignTop
        self.reconnect = ActionButton("repeat", "Reconnect", key="C", role="primary")
        button = self.reconnect, 0, Qt.AlignmentFlag.AlignVCenter
        hbox(sign, (text, 1), button, spacing=14, margins=(20, 14, 20, 14), parent=self)
        self.reconnect.hide()
        self.hide()

    def show_view(self, view: OperatorView) -> None:
        if view.trouble != self.what.text():
            self.what.setText(view.trouble[:1].upper() + view.trouble[1:])
        offered = view.may_reconnect and not view.over
        advice = _RECONNECT if offered else _WAITS if view.waits else _END_SESSION
        afterwards = _WAITS_AT_END if view.waits else _AFTERWARDS
        self.then.setText(afterwards if view.over else view.reconnection or advice)
        self.reconnect.setVisible(offered)
        self.reconnect.setEnabled(not view.reconnects)
        self.setVisible(bool(view.trouble))


HEIGHT = 52


class Strip(QWidget):
    """A strip with the session's state and progress, a button for the operator's window, and the force stop.

    It never takes the focus. A session that is ``played`` has no operator's window; its stop button ends it.
    """

    def __init__(self, *, played: bool = False) -> None:
        super().__init__()
        give_ground(self, "bar")
        self.setFixedHeight(HEIGHT)
        self.state = Chip("neutral", "clock", "Preparing")
        self.where = Elided("label", "text2")
        self.operator = ActionButton("", "Operator's window", key=_SWITCH_KEY, height=40)
        self.stop = CompactStop("Stop playing", key_cap("stop")) if played else CompactStop()
        row = hbox(self.state, (self.where, 1), spacing=12, margins=(16, 4, 8, 4), parent=self)
        for button in (self.operator, self.stop):
            button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            row.addWidget(button)
        self.operator.setHidden(played)

    def show_view(self, view: OperatorView) -> None:
        self.state.show_state(*_state_chip(view))
        self.where.show_text(view.heading)


_HEADINGS: tuple[TypeRole, ...] = ("display", "title", "title_dense", "card")


class _Now(QWidget):
    """The current part, trial and activity, and the elapsed time."""

    def __init__(self) -> None:
        super().__init__()
        self.part = Elided("label", "text2")
        self.heading = label("", "display")
        self.heading.setMinimumWidth(1)
        self.setting = label("", "body", "text2", wraps=True)
        self.elapsed_word = label("Elapsed", "label", "text2")
        self.elapsed = figures("", "label")
        self.bar = Bar()
        policy = self.bar.sizePolicy()
        policy.setRetainSizeWhenHidden(True)
        self.bar.setSizePolicy(policy)
        self.least = figures("", "small", "text2")
        self._titles, self._timing = QWidget(), QWidget()
        row = hbox(self.elapsed_word, STRETCH, self.elapsed)
        vbox(self.part, self.heading, self.setting, STRETCH, spacing=6, margins=0, parent=self._titles)
        vbox(row, self.bar, self.least, STRETCH, spacing=6, margins=0, parent=self._timing)
        self._grid = grid(24, 12, margins=0, parent=self)
        self.set_flat(False)

    def set_flat(self, flat: bool) -> None:
        self._grid.addWidget(self._titles, 0, 0)
        self._grid.addWidget(self._timing, 0 if flat else 1, 1 if flat else 0)
        self._grid.setColumnStretch(0, 3)
        self._grid.setColumnStretch(1, 2 if flat else 0)

    def show_view(self, view: OperatorView) -> None:
        self.part.show_text(view.part_line)
        if view.heading != self.heading.text():
            self.heading.setText(view.heading)
            self._fit_heading()
        self.setting.setText(view.setting_line)
        self._show_time(view)

    def _show_time(self, view: OperatorView) -> None:
        time = view.trial_time
        self.elapsed_word.setText("Elapsed" if time else "")
        self.elapsed.setText(time.words if time else "")
        self.bar.setVisible(time is not None and bool(time.most_s))
        if time is None or not time.most_s:
            self.least.setText("")
            return
        self.bar.show_share(time.elapsed_s / time.most_s, time.least_s / time.most_s if time.least_s else None)
        self.least.setText(f"at least {clock_text(time.least_s)}" if time.least_s else "")

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit_heading()

    def _fit_heading(self) -> None:
        for role in _HEADINGS:
            self.heading.setFont(font(role, tabular=True))
            if self.heading.fontMetrics().horizontalAdvance(self.heading.text()) <= self._titles.width():
                break


class Tally(QWidget):
    """Counts of answers, trials, marks and repeats, the limit violated last, and the state of the track."""

    def __init__(self) -> None:
        super().__init__()
        self.counts: list[tuple[QLabel, QLabel]] = []
        self.beyond = label("", "small", "warn", wraps=True)
        self.beyond.hide()
        self.track = label("", "small", "text2", wraps=True)
        self.track.hide()
        self._flat = False
        self._grid = grid(8, 8, margins=0, parent=self)

    def set_flat(self, flat: bool) -> None:
        self._flat = flat
        self._place_counts()

    def show_view(self, view: OperatorView) -> None:
        """Show the counts, the newest violated limit (the tip lists all), and the track's state."""
        if len(self.counts) < len(view.counts):
            for _ in range(len(view.counts) - len(self.counts)):
                value = figures("", "label", weight=600)
                self.counts.append((label("", "label", "text2"), value))
            self._place_counts()
        for (name, value), (word, count) in zip(self.counts, view.counts, strict=True):
            name.setText(word)
            value.setText(count)
        self.beyond.setVisible(bool(view.beyond))
        self.beyond.setText(f"{view.beyond[0]}." if view.beyond else "")
        self.beyond.setToolTip(plain_tip("\n".join(view.beyond) if len(view.beyond) > 1 else ""))
        self.track.setVisible(bool(view.track))
        self.track.setText("  ·  ".join(view.track))

    def _place_counts(self) -> None:
        left, right = Qt.AlignmentFlag.AlignLeft, Qt.AlignmentFlag.AlignRight
        for index, (name, value) in enumerate(self.counts):
            row, column = (0, 3 * index) if self._flat else (index, 0)
            self._grid.addWidget(name, row, column, left)
            self._grid.addWidget(value, row, column + 1, left if self._flat else right)
        for column in range(9):
            self._grid.setColumnStretch(column, int(column in {2, 5} if self._flat else column == 1))
        for row, line in enumerate((self.beyond, self.track), start=len(self.counts)):
            self._grid.addWidget(line, row, 0, 1, 9 if self._flat else 2)


WIDTH, NARROW, SLIM = 318, 248, 72
_ROW_HEIGHT = 44
_LEAST_ROW_HEIGHT = 26
_DOT_RADIUS = 11


class _StepLine(Themed, QWidget):
    """A step of the rail: a dot on the line that connects all steps, its name, and its duration or progress."""

    def __init__(self) -> None:
        super().__init__()
        self.row = StepRow("", "open", "")
        self.first = self.last = False
        self.name = Elided("body")
        self.note = figures("", "label", "text2")
        layout = hbox((self.name, 1), self.note, margins=(37, 0, 0, 0), parent=self)
        self._layout = layout
        self.setMinimumHeight(_LEAST_ROW_HEIGHT)
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Preferred)

    def sizeHint(self) -> QSize:
        """Return the preferred size, which shrinks if there are many steps."""
        return QSize(super().sizeHint().width(), _ROW_HEIGHT)

    def set_slim(self, slim: bool) -> None:
        """Show only the dot if ``slim``; the tip has the text."""
        self._layout.setContentsMargins(0 if slim else 37, 0, 0, 0)
        for part in (self.name, self.note):
            part.setVisible(not slim)

    def show_row(self, row: StepRow, *, first: bool, last: bool) -> None:
        if (row, first, last) == (self.row, self.first, self.last):
            return
        self.row, self.first, self.last = row, first, last
        self.name.show_text(row.label)
        self.note.setText(row.note)
        self.name.setFont(font("body", weight=600 if row.state == "now" else 400, scale=0.94))
        set_ink(self.name, "text2" if row.state == "open" else "text")
        set_ink(self.note, "accent" if row.state == "now" else "text2")
        note = "" if row.note == row.state else row.note
        self.setAccessibleName(f"{row.label}, {row.state} {note}".strip())
        self.setToolTip(plain_tip(f"{row.label}  ·  {row.note}" if row.note else row.label))
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        t = self.theme
        painter = smooth_painter(self)
        middle = QPointF(12, self.height() / 2)
        reached = self.row.state != "open"
        if not self.first:
            painter.setPen(QPen(QColor(t.ok if reached else t.border), 1.6))
            painter.drawLine(QPointF(12, 0), QPointF(12, middle.y() - _DOT_RADIUS))
        if not self.last:
            painter.setPen(QPen(QColor(t.ok if self.row.state == "done" else t.border), 1.6))
            painter.drawLine(QPointF(12, middle.y() + _DOT_RADIUS), QPointF(12, self.height()))
        if self.row.state == "done":
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(t.ok_bg))
            painter.drawEllipse(middle, _DOT_RADIUS, _DOT_RADIUS)
            draw_icon(painter, "check", QRectF(5, middle.y() - 7, 14, 14), t.ok, 2.6)
        elif self.row.state == "now":
            painter.setPen(QPen(QColor(t.accent), 1.8))
            painter.setBrush(QColor(t.selected))
            painter.drawEllipse(middle, _DOT_RADIUS, _DOT_RADIUS)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(t.accent))
            painter.drawEllipse(middle, 4.5, 4.5)
        else:
            painter.setPen(QPen(QColor(t.ctl), 1.5))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawEllipse(middle, 7, 7)


class Rail(Card):
    """The current step, all steps and the counts; in slim mode, only the dots of the steps."""

    def __init__(self) -> None:
        super().__init__(gap=10)
        self.now, self.tally = _Now(), Tally()
        self.heading = self.now.heading
        self.lines: list[_StepLine] = []
        self._slim = False
        self._steps = QWidget()
        self._steps_column = vbox((STRETCH, 1), spacing=0, parent=self._steps)
        self.steps_area = scrolled(self._steps)
        self._rules = Rule(), Rule()
        add_parts(self.column, self._rules[0], (self.steps_area, 1), self._rules[1])
        self.show_panels()

    def show_panels(self) -> None:
        """Show the current step above the steps and the counts below them."""
        for part in (self.now, self.tally):
            part.set_flat(False)
        self.column.insertWidget(0, self.now)
        self.column.addWidget(self.tally)
        self._set_slim(slim=False)

    def show_dots_only(self) -> None:
        """Show only the dots of the steps; the caller must place the current step and the counts elsewhere."""
        for part in (self.now, self.tally):
            part.set_flat(True)
        self._set_slim(slim=True)

    def set_narrow(self, narrow: bool) -> None:
        self.setFixedWidth(SLIM if self._slim else NARROW if narrow else WIDTH)

    def _set_slim(self, *, slim: bool) -> None:
        self._slim = slim
        for part in self._rules:
            part.setVisible(not slim)
        self._steps_column.setContentsMargins(0, 0, 0 if slim else 8, 0)
        policy = Qt.ScrollBarPolicy
        self.steps_area.setVerticalScrollBarPolicy(policy.ScrollBarAlwaysOff if slim else policy.ScrollBarAsNeeded)
        for line in self.lines:
            line.set_slim(slim)

    def show_view(self, view: OperatorView) -> None:
        """Show the steps; ``now`` and ``tally`` are updated separately, since each may fail on its own."""
        rows = view.steps
        while len(self.lines) < len(rows):
            line = _StepLine()
            line.set_slim(self._slim)
            self.lines.append(line)
            self._steps_column.insertWidget(len(self.lines) - 1, line)
        for index, (line, row) in enumerate(zip(self.lines, rows, strict=True)):
            became_current = row.state == "now" != line.row.state
            line.show_row(row, first=index == 0, last=index == len(rows) - 1)
            if became_current:
                self.steps_area.ensureWidgetVisible(line, 0, 2 * _LEAST_ROW_HEIGHT)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        for line in self.lines:
            if line.row.state == "now":
                self.steps_area.ensureWidgetVisible(line, 0, _LEAST_ROW_HEIGHT)
