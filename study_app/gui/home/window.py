"""The home window: choose a protocol and begin, or see what was held."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from PySide6.QtCore import QRectF, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QCloseEvent, QColor, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import (
    QBoxLayout,
    QFileDialog,
    QHBoxLayout,
    QMainWindow,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from study_app.errors import StudyError
from study_app.gui.cards import SHADOW, Card, Chip, Icon, Logo
from study_app.gui.choices import resumed
from study_app.gui.controls import ActionButton
from study_app.gui.dialogs import Notice
from study_app.gui.home.banner import ResumeBanner
from study_app.gui.home.cards import BrokenCard, CardGrid, StudyCard
from study_app.gui.home.facts import (
    BrokenFacts,
    Interrupted,
    StudyFacts,
    held,
    interrupted,
    sessions,
    sources,
    study_facts,
)
from study_app.gui.home.rehearsal import RehearsalDialog
from study_app.gui.home.table import SessionsCard
from study_app.gui.icons import draw_icon
from study_app.gui.labels import label
from study_app.gui.new_session import NewSessionDialog
from study_app.gui.theme import DARK, LIGHT, RADIUS_CONTROL, Theme, font
from study_app.gui.themed import Themed, dress, wear

FULL = QSize(1440, 900)
LEAST = QSize(1024, 640)
WIDE_RAIL, NARROW_RAIL, NARROW_BELOW = 216, 72, 1300


class RailButton(Themed, QPushButton):
    """A place to go, or a switch, in the rail: icon and word; beside each other when wide, one below the other else."""

    def __init__(self, icon: str, word: str, *, here: bool = False) -> None:
        super().__init__(word)
        self.icon_name, self.here = icon, here
        self._narrow = False
        self.setProperty("role", "plain")
        self.setAccessibleName(word)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.narrow(False)

    def narrow(self, yes: bool) -> None:
        """Stand in a narrow rail or a wide one."""
        self._narrow = yes
        self.setFixedHeight(58 if yes else 42)
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint the place one is at with its tint and mark, then icon and word."""
        t = self.theme
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        rect = QRectF(self.rect())
        if self.here or self.underMouse() or self.hasFocus():
            painter.setBrush(QColor(t.selected if self.here else t.hover))
            painter.drawRoundedRect(rect, RADIUS_CONTROL, RADIUS_CONTROL)
        if self.here and not self._narrow:
            painter.setBrush(QColor(t.accent))
            painter.drawRoundedRect(QRectF(0, 6, 3, rect.height() - 12), 1.5, 1.5)
        ink = t.accent if self.here else t.text2
        if self._narrow:
            draw_icon(painter, self.icon_name, QRectF(rect.width() / 2 - 10, 8, 20, 20), ink)
            words, align = QRectF(0, 30, rect.width(), 22), Qt.AlignmentFlag.AlignCenter
            painter.setFont(font("key"))
        else:
            draw_icon(painter, self.icon_name, QRectF(14, rect.height() / 2 - 10, 20, 20), ink)
            words, align = QRectF(46, 0, rect.width() - 46, rect.height()), Qt.AlignmentFlag.AlignVCenter
            painter.setFont(font("label", weight=600 if self.here else 500))
        painter.setPen(QColor(ink))
        painter.drawText(words, align, self.text())


class Rail(Themed, QWidget):
    """The strip at the left."""

    theme_asked = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.name = label("Liquid Study", "card")
        self.home = RailButton("home", "Home", here=True)
        self.home.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.switch = RailButton("moon", "Dark theme")
        self.switch.clicked.connect(self.theme_asked)
        head = QHBoxLayout()
        head.setSpacing(10)
        head.setContentsMargins(8, 0, 0, 0)
        head.addWidget(Logo())
        head.addWidget(self.name)
        head.addStretch()
        column = QVBoxLayout(self)
        column.setContentsMargins(12, 20, 12, 16)
        column.setSpacing(6)
        column.addLayout(head)
        column.addSpacing(22)
        column.addWidget(self.home)
        column.addStretch()
        column.addWidget(self.switch)

    def narrow(self, yes: bool) -> None:
        """Take less room in a small window."""
        self.setFixedWidth(NARROW_RAIL if yes else WIDE_RAIL)
        self.name.setVisible(not yes)
        self.home.narrow(yes)
        self.switch.narrow(yes)
        self._word(narrow=yes)

    def _word(self, *, narrow: bool) -> None:
        word = "Light" if self.theme.dark else "Dark"
        self.switch.setText(word if narrow else f"{word} theme")
        self.switch.icon_name = "sun" if self.theme.dark else "moon"

    def wear(self, theme: Theme) -> None:
        """Take the colours of ``theme`` and offer the other."""
        super().wear(theme)
        self._word(narrow=self.width() == NARROW_RAIL)

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint the strip and the hairline at its side."""
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(self.theme.surface))
        painter.fillRect(self.width() - 1, 0, 1, self.height(), QColor(self.theme.border))


class DeviceCard(Card):
    """What is there to feel with, and the screens."""

    def __init__(self, screens: tuple[str, ...]) -> None:
        super().__init__(padding=22, gap=8)
        row = QHBoxLayout()
        row.setSpacing(10)
        row.addWidget(Icon("mouse", "text2", 22))
        row.addWidget(label("Mouse", "card"))
        row.addStretch()
        row.addWidget(Chip("ok", "check", "Ready", small=True))
        self.column.addLayout(row)
        about = "Built in. The force is not felt but seen: the ball lags and coasts as the liquid commands."
        for words in (about, *screens):
            line = label(words, "label", "text2", wraps=True)
            line.setFont(font("label", weight=400, tabular=True))
            self.column.addWidget(line)
        self.column.addStretch()


class HomeWindow(QMainWindow):
    """Protocols, sessions, device.

    Parameters
    ----------
    results
        Folder that holds the studies' folders; it need not exist.
    """

    session_asked = Signal(object)
    closed = Signal()

    def __init__(self, results: Path, *, theme: Theme = LIGHT) -> None:
        super().__init__()
        self.setWindowTitle("Liquid Study")
        self.setMinimumSize(LEAST)
        self.results = results
        self.theme = theme
        self.dialog: NewSessionDialog | RehearsalDialog | None = None
        self.notice: Notice | None = None
        self._sources = list(sources())
        self._facts: list[StudyFacts | BrokenFacts] = []
        self.rail = Rail()
        self.banner = ResumeBanner()
        self.grid = CardGrid()
        self.sessions = SessionsCard()
        self.device = DeviceCard(_screens(self))
        self.open_protocol = ActionButton("file", "Open protocol …")
        self._lay_out()
        self.rail.theme_asked.connect(self._change_theme)
        self.open_protocol.clicked.connect(self._open_protocol)
        self.banner.resume_asked.connect(self._resume)
        self.resize(FULL)
        wear(self, theme)
        self.show_studies()
        QTimer.singleShot(0, self, self.show_sessions)

    def _lay_out(self) -> None:
        titles = QVBoxLayout()
        titles.setSpacing(4)
        titles.addWidget(label("Studies", "title"))
        titles.addWidget(label("Choose a protocol to start a session, or go on where one stopped.", "body", "text2"))
        head = QHBoxLayout()
        head.setContentsMargins(SHADOW, 0, SHADOW, 0)
        head.addLayout(titles)
        head.addStretch()
        head.addWidget(self.open_protocol)
        self._below = QBoxLayout(QBoxLayout.Direction.LeftToRight)
        self._below.setSpacing(18)
        self._below.addWidget(self.sessions, 1)
        self._below.addWidget(self.device, 0, Qt.AlignmentFlag.AlignTop)
        inside = QWidget()
        page = QVBoxLayout(inside)
        page.setContentsMargins(30, 30, 30, 22)
        page.setSpacing(20)
        page.addLayout(head)
        page.addWidget(self.banner)
        page.addWidget(self.grid)
        page.addLayout(self._below, 1)
        self._area = QScrollArea()
        self._area.setWidgetResizable(True)
        self._area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self._area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._area.setWidget(inside)
        whole = QWidget()
        whole.setProperty("role", "window")
        row = QHBoxLayout(whole)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(0)
        row.addWidget(self.rail)
        row.addWidget(self._area, 1)
        self.setCentralWidget(whole)
        whole.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        whole.setFocus()

    def show_studies(self) -> None:
        """Show a card for each protocol at hand."""
        self._facts = [study_facts(source) for source in self._sources]
        cards: list[QWidget] = []
        for facts in self._facts:
            if isinstance(facts, BrokenFacts):
                cards.append(BrokenCard(facts))
                continue
            card = StudyCard(facts, first=not any(isinstance(other, StudyCard) for other in cards))
            card.new_session.connect(self.ask_for_session)
            card.rehearsal.connect(self.ask_for_rehearsal)
            cards.append(card)
        for shown in cards:
            dress(shown, self.theme)
        self.grid.show_cards(cards)
        self._arrange()

    def show_sessions(self) -> None:
        """Read the results folder again."""
        studies = [facts for facts in self._facts if isinstance(facts, StudyFacts)]
        answers = {facts.protocol.study.name: facts.protocol.responses_per_participant() for facts in studies}
        found = sessions(self.results, answers)
        now = datetime.now().astimezone()
        self.sessions.show_sessions(found, str(self.results), now)
        self.banner.show_interrupted(interrupted(found, studies, now))
        for card in self.grid.cards:
            if isinstance(card, StudyCard):
                card.held.setText(held(found, card.facts.protocol.study.name))

    def ask_for_session(self, facts: StudyFacts) -> None:
        """Open the questions before a session; ``session_asked`` carries the answers."""
        dialog = NewSessionDialog(facts, self.results, theme=self.theme, parent=self)
        self._open(dialog)
        dialog.accepted.connect(lambda: self.session_asked.emit(dialog.chosen()))

    def _resume(self, session: Interrupted) -> None:
        """Ask to go on with a session as it was begun, on the screens there are now."""
        try:
            alone = len(self.screen().virtualSiblings()) == 1
            self.session_asked.emit(resumed(session.folder, protocol=session.source, windowed=alone))
        except StudyError as error:
            self.tell("The session cannot go on", f"{error}.")

    def ask_for_rehearsal(self, facts: StudyFacts) -> None:
        """Open the questions before a rehearsal; the table shows what it left."""
        dialog = RehearsalDialog(facts, self.results, theme=self.theme, parent=self)
        self._open(dialog)
        dialog.finished.connect(self.show_sessions)

    def _open(self, dialog: NewSessionDialog | RehearsalDialog) -> None:
        self.dialog = dialog
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()

    def _open_protocol(self) -> None:
        chosen, _ = QFileDialog.getOpenFileName(self, "Open protocol", "", "Protocols (*.toml)")
        if chosen and chosen not in self._sources:
            self._sources.insert(0, chosen)
            self.show_studies()
            self.show_sessions()

    def _change_theme(self) -> None:
        self.theme = LIGHT if self.theme.dark else DARK
        wear(self, self.theme)

    def _arrange(self) -> None:
        narrow = self.width() < NARROW_BELOW
        self.rail.narrow(narrow)
        sideways = QBoxLayout.Direction.TopToBottom if narrow else QBoxLayout.Direction.LeftToRight
        self._below.setDirection(sideways)
        self.device.setMinimumWidth(0 if narrow else 326)
        self.device.setMaximumWidth(16_777_215 if narrow else 326)
        self.grid.arrange(self.width() - (NARROW_RAIL if narrow else WIDE_RAIL) - 60)

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802 - Qt's name
        """Make room: the rail becomes narrow, cards go below each other."""
        super().resizeEvent(event)
        self._arrange()

    def closeEvent(self, event: QCloseEvent) -> None:  # noqa: N802 - Qt's name
        """Say that the operator is done."""
        super().closeEvent(event)
        self.closed.emit()

    def tell(self, title: str, sentence: str) -> None:
        """Say what went wrong, with one button."""
        notice = Notice(self, self.theme, title, sentence)
        notice.finished.connect(notice.deleteLater)
        self.notice = notice
        notice.show()


def _screens(window: QWidget) -> tuple[str, ...]:
    """Return a line for each screen: size, rate and scaling."""
    screens = window.screen().virtualSiblings()
    return tuple(
        f"Screen {number}: {screen.size().width()} × {screen.size().height()}, {screen.refreshRate():.0f} Hz, "
        f"{screen.devicePixelRatio():.0%}".replace("%", " %")
        for number, screen in enumerate(screens, start=1)
    )
