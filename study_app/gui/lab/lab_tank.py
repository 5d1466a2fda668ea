"""The lab's tank: the participant's glass and ball, with what they never see: tail, breaks, force and wake.

With the mouse as the device a click takes the pointer for the ball, as in a session; a click or Esc lets it go.
"""

import math
from functools import lru_cache
from typing import TypeAlias

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QFontMetricsF,
    QHideEvent,
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPainterPath,
    QPaintEvent,
    QPen,
    QResizeEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from study_app.gui.lab.tail_painting import TailPlaces, draw_head, draw_ring, paint_floor, paint_tail, tail_places
from study_app.gui.participant.pointer_capture import PointerCapture
from study_app.gui.participant.tank import sprites
from study_app.gui.participant.tank.backdrop import Backdrop, backdrop
from study_app.gui.participant.tank.camera import Box, Camera
from study_app.gui.participant.tank.frame import BallPlace, BallPlacer
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import PARTICIPANT, RADIUS_CARD, TANK, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.background import Background
from study_app.viewmodels.lab import LabView, Point
from study_app.viewmodels.number_words import grouped

WORKSPACE_M: Point = (0.1, 0.06, 0.06)
BALL_M = 0.0034  # radius that the glass is made for: it stays where it is while the ball's own is changed
RING = "break"
Words: TypeAlias = tuple[str, str]
"""What a plate says, and the icon before it."""

MARGIN_X, MARGIN_TOP, MARGIN_BOTTOM = 36.0, 26.0, 22.0
CHIP_HEIGHT, CHIP_EDGE = 30.0, 14.0
ARROW_HEIGHTS = 0.55  # of the water, for a force at the limit and for the wake below
WAKE_MPS = 2.0
PITCH = math.radians(27)  # higher than the participant's eye: wakes are mostly horizontal
LEAST_ARROW_PX = 9.0


class LabTank(Themed, QWidget):
    """Draws the tank of a `LabView`; ``moved`` and ``pressed`` are the hand's while the pointer is taken."""

    moved = Signal(float, float, float)
    pressed = Signal(int)

    def __init__(self) -> None:
        super().__init__()
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMinimumSize(420, 260)
        self._view: LabView | None = None
        self.camera: Camera | None = None
        self._workspace_m, self._radius_m = WORKSPACE_M, BALL_M
        self.box = Box.around(WORKSPACE_M, BALL_M)
        self._placer: BallPlacer | None = None
        self.still: Backdrop | None = None
        self._wanted: object = None
        self._painting = Background(self)
        self._painting.done.connect(self._take_still)
        self._name_font = font("label", weight=600)
        self.pointer = PointerCapture(self)
        self.pointer.moved.connect(self.moved)
        self.pointer.pressed.connect(self._press)

    def sizeHint(self) -> QSize:
        return QSize(784, 470)

    def show_view(self, view: LabView) -> None:
        """Draw the tank as of now."""
        self._view = view
        if view.workspace_m != self._workspace_m:
            self._workspace_m = view.workspace_m
            self.box = Box.around(view.workspace_m, BALL_M)
            self.camera = None
        if view.body_radius_m != self._radius_m:
            self._radius_m, self._placer = view.body_radius_m, None
        if self.pointer.held and not self._takes_pointer:
            self.pointer.release()
        self.setAccessibleName(f"Tank. {self._first_words()}. {self._hint()}".replace("..", "."))
        self.update()

    def let_go(self) -> None:
        """Give the pointer back."""
        if self.pointer.held:
            self.pointer.release()
            self.update()

    @property
    def _takes_pointer(self) -> bool:
        view = self._view
        return view is not None and view.device.pointer and view.path is None and not view.busy

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self._take()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in {Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Space} and not self.pointer.held:
            self._take()
        elif event.key() == Qt.Key.Key_Escape and self.pointer.held:
            self.let_go()
        else:
            event.ignore()

    def hideEvent(self, event: QHideEvent) -> None:
        self.let_go()
        super().hideEvent(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.camera = None

    def _take(self) -> None:
        self.setFocus(Qt.FocusReason.MouseFocusReason)
        if self._takes_pointer and self._view is not None and not self.pointer.held:
            self.pointer.take(self, self._view.workspace_m)
            self.update()

    def _press(self, bits: int) -> None:
        self.pressed.emit(bits)
        if bits & 1:
            self.let_go()

    def _ready(self) -> Camera:
        """Return the camera of the present size."""
        if self.camera is None:
            room = (self.width() - 2 * MARGIN_X, self.height() - MARGIN_TOP - MARGIN_BOTTOM)
            self.camera = Camera.fitted(self.box, MARGIN_X, MARGIN_TOP, *room, pitch=PITCH)
            self._placer = None
        if self._placer is None:
            self._placer = BallPlacer(self.camera, self.box, self._radius_m)
        return self.camera

    def paintEvent(self, _event: QPaintEvent) -> None:
        camera = self._ready()
        still = self._still_of(camera)
        painter = QPainter(self)
        if still is None:
            painter.fillRect(self.rect(), QColor(PARTICIPANT.window))
            return
        painter.drawImage(QPointF(0, 0), still.back)
        painter.setRenderHints(QPainter.RenderHint.Antialiasing | QPainter.RenderHint.SmoothPixmapTransform)
        view = self._view
        open_view = view if view is not None and not view.workbench.blind else None
        tail = open_view.tail if open_view is not None else None
        places = tail_places(tail, camera, self.box) if tail is not None else None
        if places is not None:
            paint_floor(painter, places)
        ball = self._ball()
        self._paint_ball_below(painter, ball)
        if places is not None:
            paint_tail(painter, places)
        if ball is not None:
            if open_view is not None:
                self._paint_arrows(painter, camera, open_view)
            sprite = sprites.ball(ball.radius, self.devicePixelRatioF(), ball.haze)
            sprites.draw(painter, sprite, ball.middle)
        painter.drawImage(still.front_at.topLeft(), still.front)
        self._paint_words(painter, places)
        self._paint_corners(painter)

    def _still_of(self, camera: Camera) -> Backdrop | None:
        """Return what stands still, painted for this size; None while it is being painted in the background."""
        wanted = ((self.width(), self.height()), self.devicePixelRatioF(), self.box, camera)
        if wanted != self._wanted:
            self._wanted, self.still = wanted, None
            self._painting.run(lambda: (wanted, backdrop(*wanted)))
        return self.still

    def _take_still(self, painted: tuple[object, Backdrop]) -> None:
        if painted[0] == self._wanted:
            self.still = painted[1]
            self.update()

    def _ball(self) -> BallPlace | None:
        if self._view is None or self._view.now is None or self._placer is None:
            return None
        return self._placer.place(self._view.now.position_m)

    def _paint_ball_below(self, painter: QPainter, ball: BallPlace | None) -> None:
        if ball is None:
            return
        dark = sprites.shadow(ball.floor_radius, self.devicePixelRatioF(), ball.floor_flat)
        sprites.draw(painter, dark, ball.floor, opacity=ball.shade, grown=ball.spread)
        ink = QColor(TANK.proxy_light)
        ink.setAlphaF(0.62)
        painter.setPen(QPen(ink, 1.6, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
        painter.drawPoints(ball.feet)

    def _paint_arrows(self, painter: QPainter, camera: Camera, view: LabView) -> None:
        if view.now is None:
            return
        high = ARROW_HEIGHTS * (self.box.water - self.box.floor)
        limit_n = max(view.workbench.in_hand.scene.force_limit_n, 1e-9)
        taken = QRectF()
        for word, vector, most, colour in (
            ("force", view.now.force_n, limit_n, TANK.proxy_light),
            ("wake", view.now.wake_mps, WAKE_MPS, TANK.wake),
        ):
            start = view.now.position_m
            end = _beyond(start, vector, high / most)
            from_px, to_px = QPointF(*camera.point(start)), QPointF(*camera.point(end))
            taken = self._paint_arrow(painter, from_px, to_px, QColor(colour), word, taken)

    def _paint_arrow(
        self, painter: QPainter, start: QPointF, tip: QPointF, ink: QColor, word: str, taken: QRectF
    ) -> QRectF:
        """Paint an arrow with its name beyond its head, not on the place ``taken``; return the name's place."""
        along = tip - start
        length = math.hypot(along.x(), along.y())
        if length < LEAST_ARROW_PX:
            return taken
        for colour, width in ((QColor(TANK.shadow), 6.0), (ink, 3.2)):
            painter.setPen(QPen(colour, width, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
            painter.drawLine(start, tip - along * (5.0 / length))
        draw_head(painter, tip, math.atan2(along.y(), along.x()), ink, 13.0)
        wide = QFontMetricsF(self._name_font).horizontalAdvance(word)
        middle = tip + along * ((12.0 + wide / 2) / length)
        place = QRectF(middle.x() - wide / 2, middle.y() - 9, wide, 18)
        if place.intersects(taken):
            place.moveTop(taken.bottom() + 2 if middle.y() >= taken.center().y() else taken.top() - 20)
        letters = QPainterPath()
        letters.addText(place.left(), place.bottom() - 4.5, self._name_font, word)
        painter.strokePath(letters, QPen(QColor(TANK.shadow), 2.6))
        painter.fillPath(letters, ink)
        return place

    def _first_words(self) -> str:
        view = self._view
        if view is None:
            return ""
        if view.workbench.blind:
            return "Tail and arrows are hidden during a blind comparison"
        if view.tail is None:
            return "No tail yet" if "wake" in view.workbench.in_hand.scene.liquids[0].effects else "No wake, no tail"
        if view.tail.segments == 0:
            return f"At rest, {grouped(view.tail.alive)} of {grouped(view.tail.elements)} elements"
        segments = "1 segment" if view.tail.segments == 1 else f"{view.tail.segments} segments"
        return f"{segments}, {grouped(view.tail.alive)} of {grouped(view.tail.elements)} elements"

    def _hint(self) -> str:
        if self.pointer.held:
            return "The mouse moves the ball: click or press Esc to release it"
        return "Click to move the ball with the mouse" if self._takes_pointer else ""

    def _paint_words(self, painter: QPainter, places: TailPlaces | None) -> None:
        view = self._view
        if view is None:
            return
        bench = view.workbench
        hint = self._hint()
        angle = bench.in_hand.value("wake.breaking_angle_deg") if places is not None else None
        pairs: list[tuple[Words, Words]] = [
            (
                (self._first_words(), "lock" if bench.blind else ""),
                (f"break: turn of more than {angle:g}°" if isinstance(angle, int | float) else "", RING),
            ),
            (
                (
                    hint or ("Newer parts are brighter and thicker" if places is not None else ""),
                    "mouse" if hint else "",
                ),
                (f"Tail of {view.felt}" if places is not None else "", ""),
            ),
        ]
        for row, (left, right) in enumerate(pairs):
            both = left[0] and right[0]
            crowded = both and self._wide(left) + self._wide(right) > self.width() - 2.5 * CHIP_EDGE
            top = CHIP_EDGE if row == 0 else self.height() - CHIP_EDGE - CHIP_HEIGHT
            y = top + (CHIP_HEIGHT + 6) * (1 if row == 0 else -1) if crowded else top
            self._chip(painter, left, CHIP_EDGE, top)
            self._chip(painter, right, self.width() - CHIP_EDGE - self._wide(right), y)

    def _wide(self, words: Words) -> float:
        return plate(words, self.devicePixelRatioF()).width() / self.devicePixelRatioF() if words[0] else 0.0

    def _chip(self, painter: QPainter, words: Words, left: float, top: float) -> None:
        if words[0]:
            painter.drawImage(QPointF(left, top), plate(words, self.devicePixelRatioF()))

    def _paint_corners(self, painter: QPainter) -> None:
        """Round the corners with the window's colour, and paint the focus ring."""
        whole = QRectF(self.rect())
        outside = QPainterPath()
        outside.addRect(whole)
        outside.addRoundedRect(whole, RADIUS_CARD, RADIUS_CARD)  # odd-even: what lies between both
        painter.fillPath(outside, QColor(self.theme.window))
        if self.hasFocus():
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(QPen(QColor(PARTICIPANT.accent), 2))
            painter.drawRoundedRect(whole.adjusted(2, 2, -2, -2), RADIUS_CARD - 2, RADIUS_CARD - 2)


def _beyond(start: Point, vector: Point, scale: float) -> Point:
    """Return where an arrow from ``start`` ends."""
    x, y, z = (a + scale * v for a, v in zip(start, vector, strict=True))
    return x, y, z


@lru_cache(maxsize=64)
def plate(words: Words, ratio: float) -> QImage:
    """Return words with their icon on a dark plate, for a screen of pixel ratio ``ratio``."""
    text, icon = words
    face = font("label", weight=600, tabular=True)
    wide = QFontMetricsF(face).horizontalAdvance(text) + (24 if icon else 0) + 24
    image = QImage(math.ceil(wide * ratio), math.ceil(CHIP_HEIGHT * ratio), QImage.Format.Format_ARGB32_Premultiplied)
    image.setDevicePixelRatio(ratio)
    image.fill(Qt.GlobalColor.transparent)
    painter = QPainter(image)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    ground = QColor(PARTICIPANT.window)
    ground.setAlphaF(0.74)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(ground)
    painter.drawRoundedRect(QRectF(0, 0, wide, CHIP_HEIGHT), 7, 7)
    if icon == RING:
        draw_ring(painter, QPointF(18, CHIP_HEIGHT / 2))
    elif icon:
        draw_icon(painter, icon, QRectF(10, 7, 16, 16), PARTICIPANT.text, 2.0)
    painter.setPen(QColor(PARTICIPANT.text))
    painter.setFont(face)
    room = QRectF(36 if icon else 12, 0, wide, CHIP_HEIGHT)
    painter.drawText(room, Qt.AlignmentFlag.AlignVCenter, text)
    painter.end()
    return image
