"""Where the cockpit's parts stand at every size of its window, and what gives way first.

In this order: the notes that were written, lesser rows of the device, words in the rail, signs on buttons; then the
rail shows its dots alone, and where the session is stands at the head of the middle; last, the middle scrolls. The
force stop keeps its place and size in every state.
"""

from dataclasses import dataclass
from typing import Literal

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QGridLayout, QWidget

from study_app.gui.operator.actions import Actions
from study_app.gui.operator.banner import Banner
from study_app.gui.operator.device_card import ALL_ROWS, DeviceCard
from study_app.gui.operator.health_tiles import Tiles
from study_app.gui.operator.notes import NotesCard
from study_app.gui.operator.session_header import Header
from study_app.gui.operator.steps_card import NARROW, SLIM, WIDTH, Rail
from study_app.gui.operator.stop_panel import StopPanel
from study_app.gui.widgets.boxes import add_layout, vbox
from study_app.gui.widgets.cards import Card, scrolled
from study_app.viewmodels.operator import NOTES_SHOWN

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


@dataclass(frozen=True, slots=True)
class Pieces:
    """The cockpit's parts."""

    header: Header
    banner: Banner
    rail: Rail
    tiles: Tiles
    lateness: Card
    force: Card
    position: Card
    device: DeviceCard
    notes: NotesCard
    stop: StopPanel
    buttons: Actions


class Arrangement(QWidget):
    """The window's whole content: header, rail, middle and side."""

    def __init__(self, pieces: Pieces) -> None:
        super().__init__()
        self.setProperty("role", "window")
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setAccessibleName("Operator's window")
        self._pieces = p = pieces
        self._arranged: tuple[object, ...] = ()
        self.now = Card(padding=14, gap=10)
        self._middle = QGridLayout()
        self._middle.setContentsMargins(0, 0, 0, 0)
        self._middle.setSpacing(GAP)
        for column in (0, 1):
            self._middle.setColumnStretch(column, 1)
        side = vbox(p.device, (p.notes, 1), spacing=GAP, margins=0)
        self.middle_area = scrolled(self._middle)
        self.side_area = scrolled(side)
        self.side_area.setFixedWidth(SIDE)
        right = vbox((self.side_area, 1), p.stop, spacing=GAP)
        self._body = QGridLayout()
        self._body.setVerticalSpacing(GAP)
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
        self._pieces.buttons.narrow(not signs)
        self._pieces.buttons.hint.setVisible(width == "wide")
        self._fill_middle(across=across)

    def _set_width(self, width: Width) -> None:
        rail, slim = self._pieces.rail, width == "slim"
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
        self._body.addWidget(self._pieces.buttons, 1, 0 if slim else 1, 1, 2 if slim else 1)

    def _set_height(self, height: Height) -> None:
        self._pieces.stop.setFixedSize(SIDE, STOPS[height])
        self._pieces.notes.show_lines(NOTES[height])
        self._pieces.device.show_rows(DEVICE_ROWS[height])

    def _fill_middle(self, *, across: bool) -> None:
        p, span = self._pieces, 1 if across else 2
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
