"""The sidebar of the sessions: haptic devices, and the way into the lab."""

import math
from itertools import pairwise

from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QLinearGradient, QPainter, QPainterPath, QPaintEvent, QPen, QRadialGradient
from PySide6.QtWidgets import QSizePolicy, QSpacerItem

from study_app.gui.theme.theme import RADIUS_CARD, TANK, font
from study_app.gui.widgets.boxes import add_layout, add_parts, hbox, vbox
from study_app.gui.widgets.cards import SHADOW, Card, Chip, Icon
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label, set_ink
from study_app.viewmodels.devices.list_view import DeviceShown

PICTURE, INSET = 56, 8
WAKE_POINTS = 48


class DeviceCard(Card):
    """What sessions begin with, whether it can be felt with now, and the screens."""

    devices_asked = Signal()
    display_asked = Signal()

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
        self.devices.clicked.connect(self.devices_asked)
        self.display.clicked.connect(self.display_asked)
        add_parts(self.column, 4, hbox((self.devices, 1), (self.display, 1), spacing=12))

    def show_device(self, shown: DeviceShown) -> None:
        self.icon.show_icon(shown.icon, "text2")
        self.name.setText(shown.title)
        self.state.show_state(shown.tone, shown.sign, shown.word)
        for line, words in ((self.about, shown.can), (self.why, shown.why)):
            line.setText(words)
            line.setVisible(bool(words))
        set_ink(self.why, "warn" if shown.tone == "warn" else "bad" if shown.tone == "bad" else "text2")

    def show_screens(self, lines: tuple[str, ...]) -> None:
        self.screens.setText("\n".join(lines))


class LabCard(Card):
    """The way into the liquid lab, under a picture of a ball and its wake, which is lower in a low window."""

    lab_asked = Signal()

    def __init__(self) -> None:
        super().__init__(padding=20, gap=6)
        self._picture = QSpacerItem(0, PICTURE - INSET, QSizePolicy.Policy.Minimum, QSizePolicy.Policy.Maximum)
        self.column.addSpacerItem(self._picture)
        about = label(
            "Tune a liquid by feel and save it.", "label", "text2"
        )  # a line that wraps keeps the picture high
        about.setFont(font("label", weight=400))
        self.open = ActionButton("", "Open", height=38)
        self.open.setAccessibleName("Open the liquid lab")
        self.open.clicked.connect(self.lab_asked)
        add_layout(self.column, hbox((vbox(label("Liquid lab", "card"), about, spacing=4), 1), self.open))

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
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
    """Paint a wake that thickens and brightens toward the ball at its newest end."""
    points = [
        QPointF(
            water.left() + water.width() * (0.08 + 0.74 * share),
            water.center().y() + 0.16 * water.height() * math.sin(5.6 * share + 0.4),
        )
        for share in (k / WAKE_POINTS for k in range(WAKE_POINTS + 1))
    ]
    ink = QColor(TANK.lit)
    for k, (start, end) in enumerate(pairwise(points)):
        share = k / WAKE_POINTS
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
