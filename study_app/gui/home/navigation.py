"""The strip at the left of the main window: the places one can go to, and the switch of the theme."""

from collections.abc import Iterable
from typing import NamedTuple

from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import RADIUS_CONTROL, Theme, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.gui.widgets.cards import Logo
from study_app.gui.widgets.controls import PressedByEnter
from study_app.gui.widgets.labels import label

WIDE_RAIL, NARROW_RAIL = 216, 72
WIDE_MARGIN, NARROW_MARGIN = 12, 4
FOCUS_RING = 2  # px


class Destination(NamedTuple):
    """A place by its name in the program, with its icon, its word, and the word for a narrow rail."""

    name: str
    icon: str
    word: str
    short: str


DESTINATIONS = (
    Destination("home", "home", "Home", "Home"),
    Destination("designer", "designer", "Study designer", "Designer"),
    Destination("results", "bars", "Results", "Results"),
    Destination("lab", "sliders", "Liquid lab", "Lab"),
    Destination("devices", "device", "Devices", "Devices"),
    Destination("machine", "screen", "This machine", "Machine"),
    Destination("help", "info", "Help", "Help"),
)


class RailButton(Themed, PressedByEnter):
    """A place to go, or a switch, in the rail: icon and word; side by side when wide, one below the other else."""

    def __init__(self, icon: str, word: str, short: str) -> None:
        super().__init__(word)
        self.icon_name, self.word, self.short = icon, word, short
        self._here = False
        self._narrow = False
        self.setProperty("role", "plain")
        self.setAccessibleName(word)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.narrow(False)

    def narrow(self, yes: bool) -> None:
        """Stand in a narrow rail or a wide one."""
        self._narrow = yes
        self.setText(self.short if yes else self.word)
        self.updateGeometry()
        self.update()

    def sizeHint(self) -> QSize:
        """Return the room for icon and word; a fixed height would not outlast a change of theme."""
        return QSize(NARROW_RAIL - 2 * NARROW_MARGIN, 58) if self._narrow else QSize(WIDE_RAIL - 2 * WIDE_MARGIN, 42)

    def minimumSizeHint(self) -> QSize:
        return self.sizeHint()

    @property
    def here(self) -> bool:
        """Whether this is the place one is at."""
        return self._here

    @here.setter
    def here(self, yes: bool) -> None:
        self._here = yes
        self.setAccessibleDescription("You are here" if yes else "")
        self.update()

    def say(self, icon: str, word: str, short: str) -> None:
        """Offer something else from now on."""
        self.icon_name, self.word, self.short = icon, word, short
        self.setAccessibleName(word)
        self.narrow(self._narrow)

    def paintEvent(self, _event: QPaintEvent) -> None:
        t = self.theme
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        rect = QRectF(self.rect())
        if self.here or self.underMouse():
            painter.setBrush(QColor(t.selected if self.here else t.hover))
            painter.drawRoundedRect(rect, RADIUS_CONTROL, RADIUS_CONTROL)
        if self.here and not self._narrow:
            painter.setBrush(QColor(t.accent))
            painter.drawRoundedRect(QRectF(0, 6, 3, rect.height() - 12), 1.5, 1.5)
        if self.hasFocus():
            painter.setPen(QPen(QColor(t.accent), FOCUS_RING))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRoundedRect(rect.adjusted(1, 1, -1, -1), RADIUS_CONTROL - 1, RADIUS_CONTROL - 1)
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
    """The strip; ``go_asked`` carries the name of a place.

    Parameters
    ----------
    names
        The places there are, of `DESTINATIONS`.
    """

    go_asked = Signal(str)
    theme_asked = Signal()

    def __init__(self, names: Iterable[str]) -> None:
        super().__init__()
        names = set(names)
        self.name = label("Liquid Study", "card")
        self.switch = RailButton("moon", "Dark theme", "Dark")
        self.switch.clicked.connect(self.theme_asked)
        self._head = hbox(Logo(), self.name, STRETCH, spacing=10)
        self.buttons = {place.name: self._button(place) for place in DESTINATIONS if place.name in names}
        self._column = vbox(self._head, 22, *self.buttons.values(), STRETCH, self.switch, spacing=6, parent=self)

    def _button(self, place: Destination) -> RailButton:
        made = RailButton(place.icon, place.word, place.short)
        made.clicked.connect(lambda: self.go_asked.emit(place.name))
        return made

    def mark(self, name: str) -> None:
        """Show at which place one is."""
        for other, button in self.buttons.items():
            button.here = other == name

    def narrow(self, yes: bool) -> None:
        """Take less room in a small window."""
        self.setFixedWidth(NARROW_RAIL if yes else WIDE_RAIL)
        margin = NARROW_MARGIN if yes else WIDE_MARGIN
        self._column.setContentsMargins(margin, 20, margin, 16)
        self._head.setContentsMargins(20 - margin, 0, 0, 0)
        self.name.setVisible(not yes)
        for button in (*self.buttons.values(), self.switch):
            button.narrow(yes)

    def apply_theme(self, theme: Theme) -> None:
        """Take the colours of ``theme`` and offer the other."""
        super().apply_theme(theme)
        word = "Light" if theme.dark else "Dark"
        self.switch.say("sun" if theme.dark else "moon", f"{word} theme", word)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(self.theme.surface))
        painter.fillRect(self.width() - 1, 0, 1, self.height(), QColor(self.theme.border))
