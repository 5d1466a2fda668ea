"""The lab's tank: the participant's tank with tail, breaks, force and wake, which participants never see.

If the mouse is the device, a click captures the pointer, as in a session; another click or Esc releases it.
"""

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QObject, QPointF, QRectF, QSize, Qt, QTimer, Signal
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
    QPolygonF,
    QResizeEvent,
)
from PySide6.QtWidgets import QProgressBar, QSizePolicy, QWidget

from study_app.gui.lab.lab_state import Floats, LabView, Point
from study_app.gui.participant.tank import sprites
from study_app.gui.participant.tank.arrows import HEIGHTS, Arrow, draw_head, paint_arrows
from study_app.gui.participant.tank.frame import BallPlacer, Box, Camera, DrawnBall
from study_app.gui.participant.tank.layers import Backdrop, paint_backdrop
from study_app.gui.participant.window import PointerCapture
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import PARTICIPANT, RADIUS_CARD, TANK, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.background import Background
from study_app.gui.widgets.boxes import add_parts, hbox
from study_app.gui.widgets.cards import Card, Icon
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import Ink, label
from study_app.lab.shadow import Tail
from study_app.number_text import grouped

_SHADES = 14  # number of shades that represent age
THICKEST_PX, THINNEST_PX = 5.0, 1.6
_RING_PX = 4.6
_HEAD_PX = 11.0
_STEP_PX = 2.5
_LEAST_FOR_HEAD_PX = 46.0  # minimum length of a segment with an arrow head


@dataclass(frozen=True, slots=True)
class _DrawnTail:
    """The parts of a tail on the screen [px].

    ``runs`` are lines of one shade, from old to new, ``breaks`` the starts of segments, and ``heads`` the position,
    direction [rad] and shade of arrow heads. ``floor`` is the tail's shadow.
    """

    runs: tuple[tuple[int, QPolygonF], ...]
    breaks: tuple[QPointF, ...]
    heads: tuple[tuple[QPointF, float, int], ...]
    floor: tuple[QPolygonF, ...]


def _drawn_tail(tail: Tail, camera: Camera, box: Box) -> _DrawnTail:
    """Return the parts of a tail on the screen."""
    count = len(tail.positions_m)
    inside = (-box.x, box.x), (box.floor, box.water), (-box.z, box.z)
    x, y, z = (np.clip(tail.positions_m[:, k], *span) for k, span in enumerate(inside))
    pixels = _pixels(camera, x, y, z)
    floor = _pixels(camera, x, np.full(count, box.floor), z)
    shades = np.minimum((tail.ages * _SHADES).astype(int), _SHADES - 1)
    bounds = [0, *(int(start) for start in np.flatnonzero(tail.breaks) if start), count]
    runs: list[tuple[int, QPolygonF]] = []
    shadows: list[QPolygonF] = []
    heads: list[tuple[QPointF, float, int]] = []
    for first, end in itertools.pairwise(bounds if count else ()):
        rows = np.arange(max(0, first - 1), end)  # a segment starts at the end of the previous one
        rows = rows[_drawn_rows(pixels[rows])]
        runs += _shade_runs(_points(pixels[rows]), shades[rows])
        shadows.append(QPolygonF(_points(floor[rows])))
        head = _arrow_head(pixels[rows])
        if head is not None:
            position, direction, row = head
            heads.append((position, direction, int(shades[rows[row]])))
    starts = [0, *(bound - 1 for bound in bounds[1:-1])] if count else []
    return _DrawnTail(tuple(runs), tuple(_points(pixels[starts])), tuple(heads), tuple(shadows))


def _paint_floor(painter: QPainter, places: _DrawnTail) -> None:
    """Paint the tail's shadow on the floor."""
    ink = QColor(TANK.shadow)
    ink.setAlphaF(0.44)
    painter.setPen(QPen(ink, 3.0, Qt.PenStyle.SolidLine, Qt.PenCapStyle.FlatCap, Qt.PenJoinStyle.BevelJoin))
    for points in places.floor:
        painter.drawPolyline(points)


def _paint_tail(painter: QPainter, places: _DrawnTail) -> None:
    """Paint the segments from oldest to newest, then their arrow heads and the breaks."""
    painter.setBrush(Qt.BrushStyle.NoBrush)
    for shade, points in places.runs:
        ink, width = _shade_style(shade)
        painter.setPen(QPen(ink, width, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap, Qt.PenJoinStyle.RoundJoin))
        painter.drawPolyline(points)
    for place, turn, shade in places.heads:
        ink, width = _shade_style(shade)
        draw_head(painter, place, turn, ink.lighter(112), _HEAD_PX + width)
    for place in places.breaks:
        _draw_ring(painter, place)


def _draw_ring(painter: QPainter, place: QPointF) -> None:
    """Paint the ring that marks a break."""
    painter.setPen(QPen(QColor(TANK.proxy_light), 2.0))
    painter.setBrush(QColor(TANK.shadow))
    painter.drawEllipse(place, _RING_PX, _RING_PX)


@lru_cache(maxsize=_SHADES)
def _shade_style(shade: int) -> tuple[QColor, float]:
    """Return the colour and line width of a shade; 0 is the newest."""
    newness = 1.0 - shade / (_SHADES - 1)
    old, new, mix = QColor(TANK.tail_old), QColor(TANK.tail), newness**1.6
    red, green, blue = (
        a + (b - a) * mix
        for a, b in ((old.redF(), new.redF()), (old.greenF(), new.greenF()), (old.blueF(), new.blueF()))
    )
    ink = QColor.fromRgbF(red, green, blue, 0.55 + 0.45 * newness)
    return ink, THINNEST_PX + (THICKEST_PX - THINNEST_PX) * newness


def _shade_runs(points: list[QPointF], shades: NDArray[np.int_]) -> list[tuple[int, QPolygonF]]:
    """Return the lines of one shade, each beginning at the end of the previous one."""
    cuts = [0, *(int(cut) for cut in np.flatnonzero(np.diff(shades)) + 1), len(points) - 1]
    return [
        (int(shades[start]), QPolygonF(points[start : end + 1]))
        for start, end in itertools.pairwise(cuts)
        if end > start
    ]


def _arrow_head(pixels: Floats) -> tuple[QPointF, float, int] | None:
    """Return position, direction [rad] and row of a segment's arrow head, or None if the segment is too short."""
    steps = np.hypot(*np.diff(pixels, axis=0).T)
    length = float(steps.sum())
    if length < _LEAST_FOR_HEAD_PX:
        return None
    row = int(np.searchsorted(np.cumsum(steps), 0.55 * length))
    right, down = pixels[min(len(pixels) - 1, row + 1)] - pixels[max(0, row - 1)]
    return QPointF(*pixels[row].tolist()), math.atan2(down, right), row


def _drawn_rows(pixels: Floats) -> NDArray[np.int_]:
    """Return the rows that are drawn: both ends, and one every `_STEP_PX` between them."""
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(pixels, axis=0).T))])
    kept = np.flatnonzero(np.diff(np.floor(arc / _STEP_PX), prepend=-1.0))
    return np.unique(np.append(kept, len(pixels) - 1))


def _pixels(camera: Camera, x: Floats, y: Floats, z: Floats) -> Floats:
    """Return the screen positions of points (n, 2) [px]."""
    place: Any = camera.point((x, y, z))  # type: ignore[arg-type]  # arrays, too
    return np.column_stack(place)


def _points(pixels: Floats) -> list[QPointF]:
    return [QPointF(across, down) for across, down in pixels.tolist()]


_WORKSPACE_M: Point = (0.1, 0.06, 0.06)
_BALL_M = 0.0034  # radius for which the glass is drawn, regardless of the ball's
_RING = "break"
Note: TypeAlias = tuple[str, str]
"""The text of a note and the icon before it."""

MARGIN_X, MARGIN_TOP, MARGIN_BOTTOM = 36.0, 26.0, 22.0
CHIP_HEIGHT, CHIP_EDGE = 30.0, 14.0
_WAKE_MPS = 2.0
_PITCH = math.radians(27)  # steeper than in sessions, since wakes are mostly horizontal


class LabTank(Themed, QWidget):
    """Draws the tank of a `LabView`; ``moved`` and ``pressed`` report the hand while the pointer is captured."""

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
        self._workspace_m, self._radius_m = _WORKSPACE_M, _BALL_M
        self.box = Box.around(_WORKSPACE_M, _BALL_M)
        self._placer: BallPlacer | None = None
        self.still: Backdrop | None = None
        self._requested: object = None
        self._painting = Background(self)
        self._painting.done.connect(self._show_backdrop)
        self.pointer = PointerCapture(self)
        self.pointer.moved.connect(self.moved)
        self.pointer.pressed.connect(self._press_buttons)

    def sizeHint(self) -> QSize:
        return QSize(784, 470)

    def show_view(self, view: LabView) -> None:
        self._view = view
        if view.workspace_m != self._workspace_m:
            self._workspace_m = view.workspace_m
            self.box = Box.around(view.workspace_m, _BALL_M)
            self.camera = None
        if view.body_radius_m != self._radius_m:
            self._radius_m, self._placer = view.body_radius_m, None
        if self.pointer.is_held and not self._can_capture:
            self.pointer.release()
        self.setAccessibleName(f"Tank. {self._first_note()}. {self._hint()}".replace("..", "."))
        self.update()

    def release_pointer(self) -> None:
        if self.pointer.is_held:
            self.pointer.release()
            self.update()

    @property
    def _can_capture(self) -> bool:
        view = self._view
        return view is not None and view.device.pointer and view.path is None and not view.busy

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self._capture_pointer()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in {Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Space} and not self.pointer.is_held:
            self._capture_pointer()
        elif event.key() == Qt.Key.Key_Escape and self.pointer.is_held:
            self.release_pointer()
        else:
            event.ignore()

    def hideEvent(self, event: QHideEvent) -> None:
        self.release_pointer()
        super().hideEvent(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.camera = None

    def _capture_pointer(self) -> None:
        self.setFocus(Qt.FocusReason.MouseFocusReason)
        if self._can_capture and self._view is not None and not self.pointer.is_held:
            self.pointer.capture(self, self._view.workspace_m)
            self.update()

    def _press_buttons(self, bits: int) -> None:
        self.pressed.emit(bits)
        if bits & 1:
            self.release_pointer()

    def _ready_camera(self) -> Camera:
        if self.camera is None:
            room = (self.width() - 2 * MARGIN_X, self.height() - MARGIN_TOP - MARGIN_BOTTOM)
            self.camera = Camera.fitted(self.box, MARGIN_X, MARGIN_TOP, *room, pitch=_PITCH)
            self._placer = None
        if self._placer is None:
            self._placer = BallPlacer(self.camera, self.box, self._radius_m)
        return self.camera

    def paintEvent(self, _event: QPaintEvent) -> None:
        camera = self._ready_camera()
        backdrop = self._static_image(camera)
        painter = QPainter(self)
        if backdrop is None:
            painter.fillRect(self.rect(), QColor(PARTICIPANT.window))
            return
        painter.drawImage(QPointF(0, 0), backdrop.back)
        painter.setRenderHints(QPainter.RenderHint.Antialiasing | QPainter.RenderHint.SmoothPixmapTransform)
        view = self._view
        visible_view = view if view is not None and not view.workbench.blind else None
        tail = visible_view.tail if visible_view is not None else None
        tail_parts = _drawn_tail(tail, camera, self.box) if tail is not None else None
        if tail_parts is not None:
            _paint_floor(painter, tail_parts)
        ball = self._drawn_ball()
        self._paint_shadow(painter, ball)
        if tail_parts is not None:
            _paint_tail(painter, tail_parts)
        if ball is not None:
            if visible_view is not None:
                paint_arrows(painter, camera, self._arrows(visible_view))
            sprite = sprites.ball_sprite(ball.radius, self.devicePixelRatioF(), ball.haze)
            sprites.draw_sprite(painter, sprite, ball.middle)
        painter.drawImage(backdrop.front_at.topLeft(), backdrop.front)
        self._paint_notes(painter, tail_parts)
        self._paint_corners(painter)

    def _static_image(self, camera: Camera) -> Backdrop | None:
        """Return the image of the static parts, or None while it is painted in the background."""
        requested = ((self.width(), self.height()), self.devicePixelRatioF(), self.box, camera)
        if requested != self._requested:
            self._requested, self.still = requested, None
            self._painting.run(lambda: (requested, paint_backdrop(*requested)))
        return self.still

    def _show_backdrop(self, painted: tuple[object, Backdrop]) -> None:
        if painted[0] == self._requested:
            self.still = painted[1]
            self.update()

    def _drawn_ball(self) -> DrawnBall | None:
        if self._view is None or self._view.now is None or self._placer is None:
            return None
        return self._placer.place(self._view.now.position_m)

    def _paint_shadow(self, painter: QPainter, ball: DrawnBall | None) -> None:
        if ball is None:
            return
        sprite = sprites.shadow_sprite(ball.floor_radius, self.devicePixelRatioF(), ball.floor_flat)
        sprites.draw_sprite(painter, sprite, ball.floor, opacity=ball.shade, scale=ball.spread)
        ink = QColor(TANK.proxy_light)
        ink.setAlphaF(0.62)
        painter.setPen(QPen(ink, 1.6, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
        painter.drawPoints(ball.feet)

    def _arrows(self, view: LabView) -> list[Arrow]:
        if view.now is None:
            return []
        height_m = HEIGHTS * (self.box.water - self.box.floor)
        start = view.now.position_m
        limit_n = max(view.workbench.in_hand.scene.force_limit_n, 1e-9)
        return [
            Arrow(word, start, (height_m * u / most, height_m * v / most, height_m * w / most), colour)
            for word, (u, v, w), most, colour in (
                ("force", view.now.force_n, limit_n, TANK.proxy_light),
                ("wake", view.now.wake_mps, _WAKE_MPS, TANK.wake),
            )
        ]

    def _first_note(self) -> str:
        view = self._view
        if view is None:
            return ""
        if view.workbench.blind:
            return "Tail and arrows are hidden during a blind comparison"
        if view.tail is None:
            return (
                "No tail yet"
                if "wake" in view.workbench.in_hand.scene.liquids[0].effects
                else "This liquid does not leave a wake"
            )
        if view.tail.segments == 0:
            return f"At rest, {grouped(view.tail.alive)} of {grouped(view.tail.elements)} elements"
        segments = "1 segment" if view.tail.segments == 1 else f"{view.tail.segments} segments"
        return f"{segments}, {grouped(view.tail.alive)} of {grouped(view.tail.elements)} elements"

    def _hint(self) -> str:
        if self.pointer.is_held:
            return "The mouse moves the ball: click or press Esc to release it"
        return "Click to move the ball with the mouse" if self._can_capture else ""

    def _paint_notes(self, painter: QPainter, places: _DrawnTail | None) -> None:
        view = self._view
        if view is None:
            return
        bench = view.workbench
        hint = self._hint()
        angle = bench.in_hand.value("wake.breaking_angle_deg") if places is not None else None
        pairs: list[tuple[Note, Note]] = [
            (
                (self._first_note(), "lock" if bench.blind else ""),
                (f"a turn over {angle:g}° starts a new segment" if isinstance(angle, int | float) else "", _RING),
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
            has_both = left[0] and right[0]
            overlap = has_both and self._note_width(left) + self._note_width(right) > self.width() - 2.5 * CHIP_EDGE
            top = CHIP_EDGE if row == 0 else self.height() - CHIP_EDGE - CHIP_HEIGHT
            y = top + (CHIP_HEIGHT + 6) * (1 if row == 0 else -1) if overlap else top
            self._draw_note(painter, left, CHIP_EDGE, top)
            self._draw_note(painter, right, self.width() - CHIP_EDGE - self._note_width(right), y)

    def _note_width(self, note: Note) -> float:
        return _note_plate(note, self.devicePixelRatioF()).width() / self.devicePixelRatioF() if note[0] else 0.0

    def _draw_note(self, painter: QPainter, note: Note, left: float, top: float) -> None:
        if note[0]:
            painter.drawImage(QPointF(left, top), _note_plate(note, self.devicePixelRatioF()))

    def _paint_corners(self, painter: QPainter) -> None:
        """Paint the area outside the rounded corners in the window's colour, and the focus ring."""
        area = QRectF(self.rect())
        corners = QPainterPath()
        corners.addRect(area)
        corners.addRoundedRect(area, RADIUS_CARD, RADIUS_CARD)  # odd-even fill: the area between both
        painter.fillPath(corners, QColor(self.theme.window))
        if self.hasFocus():
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(QPen(QColor(PARTICIPANT.accent), 2))
            painter.drawRoundedRect(area.adjusted(2, 2, -2, -2), RADIUS_CARD - 2, RADIUS_CARD - 2)


@lru_cache(maxsize=64)
def _note_plate(note: Note, ratio: float) -> QImage:
    """Return an image of a note on a dark plate, for a screen with pixel ratio ``ratio``."""
    text, icon = note
    note_font = font("label", weight=600, tabular=True)
    width = QFontMetricsF(note_font).horizontalAdvance(text) + (24 if icon else 0) + 24
    image = QImage(math.ceil(width * ratio), math.ceil(CHIP_HEIGHT * ratio), QImage.Format.Format_ARGB32_Premultiplied)
    image.setDevicePixelRatio(ratio)
    image.fill(Qt.GlobalColor.transparent)
    painter = QPainter(image)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    ground = QColor(PARTICIPANT.window)
    ground.setAlphaF(0.74)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(ground)
    painter.drawRoundedRect(QRectF(0, 0, width, CHIP_HEIGHT), 7, 7)
    if icon == _RING:
        _draw_ring(painter, QPointF(18, CHIP_HEIGHT / 2))
    elif icon:
        draw_icon(painter, icon, QRectF(10, 7, 16, 16), PARTICIPANT.text, 2.0)
    painter.setPen(QColor(PARTICIPANT.text))
    painter.setFont(note_font)
    room = QRectF(36 if icon else 12, 0, width, CHIP_HEIGHT)
    painter.drawText(room, Qt.AlignmentFlag.AlignVCenter, text)
    painter.end()
    return image


_SHOWN_AFTER_MS = 300
WIDTH, WIDEST, HIGH = 380, 640, 110
EDGE, FOOT = 16, 56


class TankNote(Card):
    """A sentence and its buttons, shown if there is a problem or, after 300 ms, while the lab is busy."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(padding=12, gap=8)
        self.setParent(parent)
        self._view: LabView | None = None
        self.sign = Icon("clock", "text2", 18)
        self.words = label("", "strong", wraps=True)
        self.cancel = ActionButton("", "Cancel", height=36)
        self.fade_in = ActionButton("", "Fade in again", role="primary", height=36)
        self.dismiss = ActionButton("", "Close", height=36)
        self.diagnose = ActionButton("", "Diagnose…", height=36)
        self._dismissed = ""
        self.bar = QProgressBar(textVisible=False)
        self.bar.setRange(0, 0)
        self.bar.setFixedHeight(6)
        row = hbox(self.sign, (self.words, 1), self.cancel, self.diagnose, self.fade_in, self.dismiss, spacing=10)
        add_parts(self.column, row, self.bar)
        self.dismiss.clicked.connect(self._dismiss)
        self._wait = QTimer(self, singleShot=True, interval=_SHOWN_AFTER_MS)
        self._wait.timeout.connect(self._show_note)
        parent.installEventFilter(self)
        self.hide()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.Resize:
            self.place()
        return super().eventFilter(watched, event)

    def show_view(self, view: LabView) -> None:
        previous, self._view = self._view, view
        if view.busy and not view.trouble:
            if self.isHidden() and not self._wait.isActive():
                self._wait.start()
            if not self.isHidden():
                self._show_note()
            return
        self._wait.stop()
        self._dismissed = self._dismissed if view.trouble == self._dismissed else ""
        if view.force_on and view.trouble == self._dismissed:
            self.hide()
        elif self.isHidden() or previous is None or _note_parts(previous) != _note_parts(view):
            self._show_note()

    def place(self) -> None:
        """Place the note above the tank's lower edge, wide enough for its text."""
        parent = self.parentWidget()
        if parent is not None and not self.isHidden():
            room = parent.width() - 2 * EDGE
            width = min(WIDTH, room)
            if self.heightForWidth(width) > HIGH:
                width = min(WIDEST, room)
            self.resize(width, max(self.minimumSizeHint().height(), self.heightForWidth(width)))
            foot = min(FOOT, parent.height() - self.height() - EDGE)
            self.move((parent.width() - width) // 2, max(0, parent.height() - self.height() - foot))

    def _dismiss(self) -> None:
        """Hide the note about the current problem."""
        if self._view is not None:
            self._dismissed = self._view.trouble
        self.hide()

    def _show_note(self) -> None:
        view = self._view
        if view is None:
            return
        icon, ink, sentence = _note_parts(view)
        self.sign.show_icon(icon, ink)
        self.words.setText(sentence)
        self.setAccessibleName(sentence)
        waiting = bool(view.busy) and not view.trouble
        self.bar.setVisible(waiting)
        self.cancel.setVisible(waiting)
        self.fade_in.setVisible(not waiting and not view.force_on and view.may_fade_in)
        self.fade_in.show_action("", "Try again" if view.trouble else "Fade in again")
        self.dismiss.setVisible(bool(view.trouble) and view.force_on)
        stopped = view.device.state == "stopped"
        self.diagnose.setVisible(self.fade_in.isVisibleTo(self) and stopped and view.device.diagnosable)
        self.show()
        self.raise_()
        self.place()


def _note_parts(view: LabView) -> tuple[str, Ink, str]:
    if view.trouble:
        return "warning", "bad", view.trouble
    if view.busy:
        return "clock", "text2", f"{view.busy}…"
    return "stop", "warn", "Force is off"
