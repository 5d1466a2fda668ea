"""The cards of the home page: studies, sessions, the interrupted session, device and lab."""

import math
from collections.abc import Sequence
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import TypeAlias

from PySide6.QtCore import QEvent, QPointF, QRectF, QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QColor, QLinearGradient, QPainter, QPainterPath, QPaintEvent, QPen, QRadialGradient
from PySide6.QtWidgets import QSizePolicy, QSpacerItem, QWidget

from study_app.gui.home.study_facts import BrokenFacts, DraftFacts, Interrupted, StudyFacts
from study_app.gui.kit.devices import DeviceShown
from study_app.gui.sessions.session_facts import KINDS, Column, SessionFacts
from study_app.gui.sessions.sessions_table import SessionsTable
from study_app.gui.theme.theme import RADIUS_CARD, SHADOW, TANK, font
from study_app.gui.theme.themed import give_ground, remove_widget
from study_app.gui.widgets.boxes import add_layout, add_parts, grid, hbox, vbox
from study_app.gui.widgets.cards import Card, Chip, Icon, smooth_painter
from study_app.gui.widgets.controls import ActionButton, Choice, IconButton
from study_app.gui.widgets.labels import Clamped, Elided, label, set_ink
from study_app.number_text import counted

PICTURE, INSET = 56, 8
_WAKE_POINTS = 48


class DeviceCard(Card):
    """The card with the device of new sessions, its state, and the screens."""

    def __init__(self) -> None:
        super().__init__(padding=20, gap=8)
        self.icon = Icon("device", "text2", 22)
        self.name = label("", "card")
        self.state = Chip(small=True)
        add_layout(self.column, hbox(self.icon, (self.name, 1), self.state, spacing=10))
        self.about, self.why, self.screens = (label("", "label", "text2", wraps=True) for _ in range(3))
        for line in (self.about, self.why, self.screens):
            line.setFont(font("label", weight=400, tabular=True))
            self.column.addWidget(line)
        self.devices = ActionButton("", "Devices", height=38)
        self.display = ActionButton("", "Display test", height=38)
        add_parts(self.column, 4, hbox((self.devices, 1), (self.display, 1), spacing=12))

    def show_device(self, device: DeviceShown) -> None:
        self.icon.show_icon(device.icon, "text2")
        self.name.setText(device.title)
        self.state.show_state(device.tone, device.sign, device.word)
        for line, text in ((self.about, device.can), (self.why, device.why)):
            line.setText(text)
            line.setVisible(bool(text))
        set_ink(self.why, "warn" if device.tone == "warn" else "bad" if device.tone == "bad" else "text2")

    def show_screens(self, lines: tuple[str, ...]) -> None:
        self.screens.setText("\n".join(lines))


class LabCard(Card):
    """The card that opens the liquid lab, with a picture of a ball and its wake that shrinks in a low window."""

    def __init__(self) -> None:
        super().__init__(padding=20, gap=6)
        self._picture = QSpacerItem(0, PICTURE - INSET, QSizePolicy.Policy.Minimum, QSizePolicy.Policy.Maximum)
        self.column.addSpacerItem(self._picture)
        about = label(
            "Tune a liquid by feel and save it.", "label", "text2"
        )  # with a wrapping line, the picture would not shrink
        about.setFont(font("label", weight=400))
        self.open = ActionButton("", "Open", height=38)
        self.open.setAccessibleName("Open the liquid lab")
        add_layout(self.column, hbox((vbox(label("Liquid lab", "card"), about, spacing=4), 1), self.open))

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        painter = smooth_painter(self)
        body = QRectF(self.rect()).adjusted(SHADOW, SHADOW - 1, -SHADOW, -SHADOW - 1).adjusted(1, 1, -1, -1)
        card = QPainterPath()
        card.addRoundedRect(body, RADIUS_CARD, RADIUS_CARD)
        painter.setClipPath(card)
        water = QRectF(body.left(), body.top(), body.width(), self._picture.geometry().height() + INSET)
        depth = QLinearGradient(water.topLeft(), water.bottomLeft())
        depth.setColorAt(0, QColor(TANK.water_light))
        depth.setColorAt(1, QColor(TANK.water_light).darker(200))
        painter.fillRect(water, depth)
        _paint_wake(painter, water)


def _paint_wake(painter: QPainter, water: QRectF) -> None:
    """Paint a wake that becomes wider and brighter towards the ball."""
    points = [
        QPointF(
            water.left() + water.width() * (0.08 + 0.74 * share),
            water.center().y() + 0.16 * water.height() * math.sin(5.6 * share + 0.4),
        )
        for share in (k / _WAKE_POINTS for k in range(_WAKE_POINTS + 1))
    ]
    ink = QColor(TANK.lit)
    for k, (start, end) in enumerate(pairwise(points)):
        share = k / _WAKE_POINTS
        ink.setAlphaF(0.15 + 0.8 * share)
        painter.setPen(QPen(ink, 1.0 + 3.0 * share, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
        painter.drawLine(start, end)
    middle, radius = points[-1], min(13.0, 0.4 * water.height())
    light = QRadialGradient(middle - QPointF(4, 5), 1.6 * radius)
    light.setColorAt(0, QColor(TANK.proxy_light))
    light.setColorAt(0.5, QColor(TANK.proxy))
    light.setColorAt(1, QColor(TANK.proxy).darker(190))
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(light)
    painter.drawEllipse(middle, radius, radius)


class ResumeBanner(QWidget):
    """A tinted strip about the session that can be resumed, if any; ``resume_asked`` carries the session."""

    resume_asked = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        give_ground(self, "warn tint")
        self._shown: Interrupted | None = None
        self.heading = label("", "strong", "text", wraps=True)
        self.line = label("", "label", "warn", wraps=True)
        self.resume = ActionButton("play", "Resume", role="primary")
        self.resume.clicked.connect(lambda: self.resume_asked.emit(self._shown))
        text = vbox(self.heading, self.line, spacing=4)
        margins = (SHADOW + 22, 14, SHADOW + 18, 14)
        hbox(Icon("clock", "warn", 26), (text, 1), self.resume, spacing=18, margins=margins, parent=self)
        self.hide()

    def minimumSizeHint(self) -> QSize:
        """Return the height at the current width, since wrapped texts report the height at their minimum width."""
        hint = super().minimumSizeHint()
        return QSize(hint.width(), self.heightForWidth(max(hint.width(), self.width())))

    def show_interrupted(self, session: Interrupted | None) -> None:
        self._shown = session
        self.setVisible(session is not None)
        if session is None:
            return
        self.heading.setText(session.heading)
        self.line.setText(session.line)
        self.resume.show_action("play", f"Resume {session.participant}")
        self.resume.setAccessibleName(f"Resume {session.participant}")


COLUMNS = (
    Column("participant", "Participant", 110, 62),
    Column("study", "Study", 130, 72),
    Column("started", "Started", 140, 74),
    Column("status", "Status", 140, 136),
    Column("validity", "Validity", 130, 134),
    Column("answers", "Answers", 80, 78),
)
_ALL = "every"
LEAST_HEIGHT = 200
_NONE = {
    "": "No participant sessions yet. The first session will appear here when it starts.",
    "pilot": "No pilot sessions.",
    "simulated": "No simulated sessions.",
    "sample": "No sample sessions.",
    _ALL: "No sessions yet. The first session will appear here when it starts.",
}


class SessionsCard(Card):
    """The card with the sessions: those that need attention, then the newest; a single line if there are none.

    ``open_asked`` carries the `SessionFacts` of a session; ``emptied`` is emitted when the table appears or disappears.
    """

    open_asked = Signal(object)
    emptied = Signal()

    def __init__(self) -> None:
        super().__init__(gap=8, padding=20)
        self.column.setContentsMargins(14, self.column.contentsMargins().top(), 14, 14)
        self._sessions: tuple[SessionFacts, ...] = ()
        self._now = datetime.now().astimezone()
        self.where = Elided("small", "text2")
        self.kind = Choice()
        self.kind.setAccessibleName("Sessions shown")
        self.kind.setFont(font("label"))
        self.kind.setProperty("dense", "true")
        self.kind.setSizeAdjustPolicy(Choice.SizeAdjustPolicy.AdjustToContents)
        self.details = ActionButton("file", "Details", role="plain", height=34)
        self.all = ActionButton("chevron", "All results", role="plain", height=34)
        self.nothing = label("", "body", "text2", wraps=True)
        parts = (label("Sessions", "card"), (self.nothing, 1), self.kind, (self.where, 1), self.details, self.all)
        self.rows = SessionsTable(COLUMNS, _NONE[""])
        add_parts(self.column, hbox(*parts, spacing=12, margins=(12, 0, 12, 0)), (self.rows, 1))
        self.kind.currentIndexChanged.connect(self._apply_filter)
        self.rows.opened.connect(self.open_asked)
        self.rows.chosen_changed.connect(lambda: self.details.setEnabled(self.rows.chosen is not None))
        self.details.clicked.connect(self.rows.open_chosen)
        self.details.setEnabled(False)
        self.details.setAccessibleName("Details of the selected session")
        self._show_kinds()
        self._apply_filter()

    @property
    def is_empty(self) -> bool:
        return not self.shown

    @property
    def shown(self) -> tuple[SessionFacts, ...]:
        return self.rows.shown

    def show_sessions(self, sessions: Sequence[SessionFacts], where: str, now: datetime) -> None:
        """Show the sessions in the results folder ``where``."""
        self._sessions, self._now = tuple(sessions), now
        self.where.show_text(f"in {where}")
        self._show_kinds()
        self._apply_filter()

    def show_kind(self, kind: str) -> None:
        """Show the sessions of a kind: "" for participants', one of `KINDS`, or `_ALL`."""
        self.kind.setCurrentIndex(self.kind.findData(kind))

    def _show_kinds(self) -> None:
        chosen = self.kind.currentData() or ""
        with QSignalBlocker(self.kind):
            self.kind.clear()
            for kind, plural in KINDS.items():
                count = sum(session.kind == kind for session in self._sessions)
                self.kind.addItem(f"{plural} ({count})", kind)
            self.kind.addItem(f"All ({len(self._sessions)})", _ALL)
            self.kind.setCurrentIndex(self.kind.findData(chosen))

    def _apply_filter(self) -> None:
        kind = str(self.kind.currentData() or "") if self._sessions else _ALL
        self.rows.show_rows((session for session in self._sessions if kind in (session.kind, _ALL)), self._now)
        hidden = [
            counted(count, f"{other or 'participant'} session")
            for other in KINDS
            if (count := sum(session.kind == other for session in self._sessions))
        ]
        self.nothing.setText(f"{_NONE[kind]} Not shown: {', '.join(hidden)}." if hidden else _NONE[kind])
        emptied = self.rows.isHidden() != self.is_empty
        self.nothing.setVisible(self.is_empty)
        for part in (self.where, self.details, self.rows):
            part.setVisible(not self.is_empty)
        self.kind.setVisible(bool(self._sessions))
        self.all.setVisible(bool(self._sessions))
        self.setMinimumHeight(0 if self.is_empty else LEAST_HEIGHT)
        if emptied:
            self.emptied.emit()


_LEAST_WIDTH = 330
_GAP = 18
TITLE_LINES, ABOUT_LINES = 2, 2
Facts: TypeAlias = StudyFacts | BrokenFacts | DraftFacts


class _FileCard(Card):
    """The card of a study with its title, origin and unsaved draft, if any; ``edit`` and ``discard`` carry its facts.

    Parameters
    ----------
    facts : the facts on the card
    title : the title; at most two lines
    copies : whether editing makes a copy
    first : whether the draft is the most recently edited one
    sign : the icon before the title, or ""
    """

    edit = Signal(object)
    discard = Signal(object)

    def __init__(self, facts: Facts, title: str, *, copies: bool = False, first: bool = False, sign: str = "") -> None:
        super().__init__(padding=20, gap=8)
        self.facts = facts
        self.title = Clamped(title, TITLE_LINES, "card", steady=False)
        self.title.setFont(font("card", scale=1.12))
        head = hbox(spacing=8)
        if sign:
            head.addWidget(Icon(sign, "warn", 20), 0, Qt.AlignmentFlag.AlignTop)
        head.addWidget(self.title, 1)
        self.origin = Elided("small", "text2")
        self.origin.show_text(f"{facts.origin}  ·  {Path(facts.source).stem}.toml")
        top = hbox((vbox(head, self.origin, spacing=2), 1))
        add_layout(self.column, top)
        self.draft = label("" if facts.draft is None else f"{facts.draft.words}.", "small", "warn", wraps=True)
        self.pen: ActionButton | IconButton
        self.bin: IconButton | None = None
        if facts.draft is None:
            tip, name = ("Make a copy", f"Make a copy of {title}") if copies else ("Edit", f"Edit {title}")
            self.pen = IconButton("copy" if copies else "pen", name, tip, size=36, role="plain")
            top.addWidget(self.pen, 0, Qt.AlignmentFlag.AlignTop)
            self.draft.hide()
        else:
            self.pen = ActionButton("pen", "Continue", role="primary" if first else "", height=38)
            self.pen.setAccessibleName(f"Continue {title}, {Path(facts.source).stem}")
            name = f"Discard the draft of {title}, {Path(facts.source).stem}…"
            self.bin = IconButton("trash", name, "Discard the draft…", size=38, role="danger")
            self.bin.clicked.connect(lambda: self.discard.emit(facts))
            row = hbox((self.draft, 1), self.pen, self.bin, spacing=12)
            for part in (self.draft, self.pen, self.bin):
                row.setAlignment(part, Qt.AlignmentFlag.AlignTop)
            add_layout(self.column, row)
        self.pen.clicked.connect(lambda: self.edit.emit(facts))


class StudyCard(_FileCard):
    """The card of a study that can be run; ``new_session`` and ``rehearsal`` carry its facts.

    ``shipped`` means that the study ships with the program, ``first`` that it is the most likely choice.
    """

    new_session = Signal(object)
    rehearsal = Signal(object)

    def __init__(self, facts: StudyFacts, *, first: bool, shipped: bool = False) -> None:
        super().__init__(facts, facts.title, copies=shipped, first=first)
        self.facts: StudyFacts = facts
        if facts.draft is None:
            self.column.addWidget(Clamped(facts.description or facts.title, ABOUT_LINES, "body", "text2"))
        else:
            self.draft.setText(f"{facts.draft.words}. Sessions use the saved file.")
        self.column.addStretch()
        time = f"{facts.duration}  ·  {facts.languages}"
        for icon, text in (("layers", facts.extent), ("clock", time), ("device", facts.needs)):
            add_layout(self.column, hbox(Icon(icon, "text2", 18), (label(text, "body"), 1), spacing=10))
        self.held = label("", "label", "text2")
        self.column.addWidget(self.held)
        self.new = ActionButton("plus", "New session", role="primary" if first and facts.draft is None else "")
        self.rehearse = ActionButton("fast_forward", "Rehearse")
        self.new.setAccessibleName(f"New session of {facts.title}, {facts.file_name}")
        self.rehearse.setAccessibleName(f"Rehearse {facts.title}, {facts.file_name}")
        self.new.clicked.connect(lambda: self.new_session.emit(facts))
        self.rehearse.clicked.connect(lambda: self.rehearsal.emit(facts))
        add_layout(self.column, hbox((self.new, 1), (self.rehearse, 1), spacing=12))


class BrokenCard(_FileCard):
    """The card of a protocol file that cannot be used, with the reason, or of a study that was never saved."""

    def __init__(self, facts: BrokenFacts | DraftFacts, *, first: bool = False) -> None:
        if isinstance(facts, DraftFacts):
            super().__init__(facts, facts.title, first=first)
            why = f"{Path(facts.source).name} will be created when the draft is saved."
        else:
            super().__init__(facts, Path(facts.source).stem, first=first, sign="warning")
            self.column.addWidget(label("This file cannot be used.", "strong", "warn"))
            why = facts.problem
        reason = label(why, "label", "text2", wraps=True)
        reason.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.column.addWidget(reason, 1)


class CardGrid(QWidget):
    """A grid of cards, as many per row as fit; ``laid_out`` is emitted when their heights may have changed."""

    laid_out = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.cards: list[QWidget] = []
        self._grid = grid(_GAP, _GAP, margins=0, parent=self)
        self._columns, self._least = 0, _LEAST_WIDTH
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)

    @property
    def row_height(self) -> int:
        """The height of the first row of cards at their current width."""
        card_width = (self.width() - self._grid.contentsMargins().right() + _GAP) // max(1, self._columns) - _GAP
        heights = (
            card.heightForWidth(card_width) if card.hasHeightForWidth() else card.sizeHint().height()
            for card in self.cards[: self._columns]
        )
        return max(heights, default=0)

    @property
    def whole_height(self) -> int:
        has_height_for_width = self._grid.hasHeightForWidth()
        return (
            self._grid.totalHeightForWidth(self.width())
            if has_height_for_width
            else self._grid.totalSizeHint().height()
        )

    def show_cards(self, cards: list[QWidget]) -> None:
        for card in self.cards:
            remove_widget(card)
        self.cards = cards
        self._columns = 0
        self._least = max([_LEAST_WIDTH, *(card.minimumSizeHint().width() for card in cards)])
        self.arrange(self.width())

    def set_right_margin(self, width: int) -> None:
        self._grid.setContentsMargins(0, 0, width, 0)

    def event(self, event: QEvent) -> bool:
        handled = super().event(event)
        if event.type() == QEvent.Type.LayoutRequest:
            self.laid_out.emit()
        return handled

    def arrange(self, width: int) -> None:
        """Place as many cards per row as fit ``width``; a single card is not stretched."""
        columns = max(1, (width + _GAP) // (self._least + _GAP))
        if columns == self._columns:
            return
        for column in range(self._grid.columnCount()):
            self._grid.setColumnStretch(column, 0)
        self._columns = columns
        for index, card in enumerate(self.cards):
            self._grid.addWidget(card, index // columns, index % columns)
        for column in range(min(columns, max(2, len(self.cards)))):
            self._grid.setColumnStretch(column, 1)
        self._grid.activate()  # at once, since the parent would otherwise use the old size
