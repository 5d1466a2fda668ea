"""The participant's tank: a still backdrop, and the few things that move before it.

Everything drawn here is as old as the view that is given: proxy, lit target, dwell arc and count run on the same
delayed clock, and nothing is smoothed or eased. Nothing here knows which liquid is felt.
"""

from __future__ import annotations

import math
from threading import Thread
from typing import TYPE_CHECKING

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QRegion, QResizeEvent
from PySide6.QtWidgets import QWidget

from study_app.gui.participant.pages.page_widget import page_painter
from study_app.gui.participant.tank import sprites
from study_app.gui.participant.tank.backdrop import Backdrop, backdrop
from study_app.gui.participant.tank.camera import Box, Camera
from study_app.gui.participant.tank.captions import Captions
from study_app.gui.participant.tank.frame import (
    DEPTH_STEPS,
    BallPlace,
    BallPlacer,
    Placed,
    TargetPlace,
    TaskShown,
    ball_things,
    changes,
    target_place,
)
from study_app.gui.participant.tank.onset_patch import OnsetPatch
from study_app.gui.participant.tank.photodiode_patch import paint_patch, patch_place
from study_app.gui.theme.theme import TANK
from study_app.protocol.model import Explore, Reach
from study_app.session.pages import TaskPage

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words
    from study_app.session.trial import TankView

# Where the tank lies in the window, in shares of it.
AREA = (0.075, 0.122, 0.85, 0.712)
BESIDE_RADII = 2.0  # of a target: within them the ball is before or behind it
ALWAYS = QRegion(0, 0, 1, 1)  # a frame in which nothing moved is a frame too


def look(page: TaskPage, captions: Captions, width: int, height: int) -> tuple[Box, Camera]:
    """Return the tank of a page and the camera that shows it in a window of ``width`` × ``height`` [px]."""
    box = Box.around(page.workspace_m, page.body_radius_m)
    left, top, wide, high = AREA
    top = max(top, captions.above(width, height) / height)
    room = (1 - top) * height - captions.below(width, height)
    return box, Camera.fitted(box, left * width, top * height, wide * width, min(high * height, room))


def paint_ahead(page: TaskPage, words: Words, text_scale: float, size: QSize, ratio: float) -> Thread:
    """Paint the still images of a page that is to come, in a thread of their own, so that it comes at once."""
    width, height = size.width(), size.height()
    box, camera = look(page, Captions(page, words, text_scale), width, height)
    painting = Thread(target=backdrop, args=((width, height), ratio, box, camera), name="backdrop")
    painting.start()
    return painting


class TankWidget(QWidget):
    """Draws a task page and, on it, the views that it is shown, at once.

    ``painted(sample_ns)`` comes once for every view with the time of what was drawn: when it was painted and handed to
    the window's system, or with ``on_card``, on a surface of the graphics card, when that swapped. ``swapped`` comes
    with each swap. ``photodiode`` is whether a corner toggles with each movement that begins;
    ``by_mouse`` whether a wheel moves the hand in depth: where only the depth is wrong, that is told.
    """

    painted = Signal(object)
    swapped = Signal()

    def __init__(
        self,
        page: TaskPage,
        words: Words,
        parent: QWidget | None = None,
        *,
        text_scale: float = 1.0,
        on_card: bool = False,
        photodiode: bool = True,
        by_mouse: bool = False,
    ) -> None:
        super().__init__(parent)
        self._by_mouse = by_mouse
        self._photodiode = photodiode
        self._pane: QWidget | None = self._made_pane() if on_card else None
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.setAccessibleName(page.instruction)
        self._page = page
        self._box = Box.around(page.workspace_m, page.body_radius_m)
        self._captions = Captions(page, words, text_scale)
        self._patch = OnsetPatch()
        self._view: TankView | None = None
        self._unpainted = False
        self._showing = False
        self._drawn_ns: int | None = None
        self._things: dict[str, Placed] = {}
        self._ball: BallPlace | None = None
        self._camera: Camera | None = None
        self._targets: tuple[TargetPlace, ...] = ()
        self._placer: BallPlacer | None = None
        self._stroke = 1.0

    @property
    def page(self) -> TaskPage:
        """The page that is drawn."""
        return self._page

    @property
    def may_leave(self) -> bool:
        """Whether the exploration shown has had its least time, so that the participant may go on."""
        task = self._page.task
        return isinstance(task, Explore) and self._view is not None and self._view.task.elapsed_s >= task.min_s

    @property
    def time_is_up(self) -> bool:
        """Whether the task shown ended because its time is over."""
        return self._view is not None and self._view.task.elapsed_s >= self._page.task.limit_s

    def sizeHint(self) -> QSize:  # noqa: N802
        """Return the size that the tank was drawn for."""
        return QSize(1920, 1080)

    def prepare(self) -> None:
        """Paint the still images now, so that the first frame does not wait for them."""
        self._ready()

    def show_view(self, view: TankView) -> None:
        """Draw the proxy where ``view`` says, with the task as it was then."""
        self._view = view
        self._unpainted = True
        x, y, z = (float(value) for value in view.position_m)
        self._patch.follow((x, y, z), view.sample_time_ns)
        self._ready()
        things = self._frame()
        changed = changes(self._things, things) + ALWAYS
        self._things = things
        if self._pane is None:
            self._repaint(changed)
        else:
            self._pane.update()

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802
        """Find the tank's place anew."""
        super().resizeEvent(event)
        self._camera = None
        if self._pane is not None:
            self._pane.setGeometry(self.rect())

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: N802
        """Paint what lies in the region asked for, and tell when."""
        if self._pane is not None:
            return
        painter = page_painter(self)
        self._paint(painter, event.region())
        painter.end()
        if not self._showing:
            self._tell()

    def _repaint(self, region: QRegion) -> None:
        """Paint the view at once, for whatever waits to be done would make it older; tell when it is handed over."""
        self._drawn_ns, self._showing = None, True
        self.repaint(region)
        self._showing = False
        self._tell()

    def _made_pane(self) -> QWidget:
        """Return a surface of the graphics card that fills the widget."""
        from study_app.gui.participant.tank.opengl_pane import (  # noqa: PLC0415 - OpenGL: only where it is drawn with
            Pane,
        )

        pane = Pane(self, self._paint)
        pane.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        pane.swapped.connect(self._swapped)
        return pane

    def _swapped(self) -> None:
        self.swapped.emit()
        self._tell()

    def _tell(self) -> None:
        """Say once of every view that it was painted."""
        if self._unpainted and self._drawn_ns is not None:
            self._unpainted = False
            self.painted.emit(self._drawn_ns)

    def _paint(self, painter: QPainter, region: QRegion) -> None:
        still = self._ready()
        painter.drawImage(QPointF(0, 0), still.back)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        self._paint_things(painter, region)
        if region.intersects(still.front_at.toAlignedRect()):
            painter.drawImage(still.front_at.topLeft(), still.front)
        self._captions.draw(painter, region, self._task, self._depth())
        self._paint_patch(painter, region)
        self._drawn_ns = None if self._view is None else self._view.sample_time_ns

    @property
    def _task(self) -> TaskShown | None:
        return None if self._view is None else self._view.task

    def _depth(self) -> int:
        """Return -1 where the ball shown must go further away to be in the lit target, 1 where it must come nearer.

        0 where its depth is right, where it is beside the target, too, or where no wheel moves it.
        """
        todo, view = self._page.task, self._view
        if not self._by_mouse or not isinstance(todo, Reach) or view is None or view.task.lit is None:
            return 0
        target = todo.targets_m[view.task.lit]
        x, y, z = (there - float(here) for there, here in zip(target, view.position_m, strict=True))
        off = math.hypot(x, y) <= BESIDE_RADII * todo.radius_m and abs(z) > todo.radius_m
        return int(math.copysign(1, z)) if off else 0

    def _ready(self) -> Backdrop:
        """Return the still images for the present size and screen; lay everything out if they changed."""
        ratio = self.devicePixelRatioF()
        if self._camera is None:
            self._lay_out(ratio)
        assert self._camera is not None  # noqa: S101  # _lay_out has just set it
        return backdrop((self.width(), self.height()), ratio, self._box, self._camera)

    def _lay_out(self, ratio: float) -> None:
        width, height = self.width(), self.height()
        self._box, self._camera = look(self._page, self._captions, width, height)
        self._captions.lay_out(width, height, self._camera.point((0, self._box.floor, self._box.z))[1])
        self._placer = BallPlacer(self._camera, self._box, self._page.body_radius_m)
        for step in range(DEPTH_STEPS):
            radius, haze = self._placer.size(step)
            sprites.ball(radius, ratio, haze)
        task = self._page.task
        self._targets = ()
        if isinstance(task, Reach):
            around = task.radius_m + self._page.body_radius_m  # the ball is inside the ring while its centre counts
            self._targets = tuple(target_place(self._camera, self._box, centre, around) for centre in task.targets_m)
        self._stroke = max(2.0, self._camera.scale((0, 0, 0)) * 0.0010)
        self._things = self._frame()

    def _frame(self) -> dict[str, Placed]:
        """Return the things of the present view."""
        task = self._task
        lit = task.lit if task else None
        things: dict[str, Placed] = {}
        for index, target in enumerate(self._targets):
            is_lit = index == lit
            things[f"target {index}"] = Placed((is_lit, task.dwell if task and is_lit else 0.0), target.place)
            things[f"marks {index}"] = Placed(is_lit, target.marks)
        self._ball = None
        if self._view is not None and self._placer is not None:
            x, y, z = (float(value) for value in self._view.position_m)
            self._ball = self._placer.place((x, y, z))
            things |= ball_things(self._ball)
        things |= self._captions.things(task, self._depth())
        if self._photodiode:
            things["patch"] = Placed(self._patch.lit, self._patch_place())
        return things

    def _paint_things(self, painter: QPainter, region: QRegion) -> None:
        """Paint floor marks, shadow, then ball and targets from the far ones to the near ones."""
        lit = self._task.lit if self._task else None
        for index, target in enumerate(self._targets):
            if region.intersects(target.marks.toAlignedRect()):
                self._paint_marks(painter, target, is_lit=index == lit)
        ratio = self.devicePixelRatioF()
        ball = self._ball
        if ball is not None and region.intersects(self._things["shadow"].place.toAlignedRect()):
            dark = sprites.shadow(ball.floor_radius, ratio, ball.floor_flat)
            sprites.draw(painter, dark, ball.floor, opacity=ball.shade, grown=ball.spread)
        order = sorted(range(len(self._targets)), key=lambda index: -self._targets[index].depth_m)
        drawn = False
        for index in order:
            target = self._targets[index]
            if ball is not None and not drawn and target.depth_m < ball.depth_m:
                self._paint_ball(painter, region, ball)
                drawn = True
            if region.intersects(target.place.toAlignedRect()):
                self._paint_target(painter, target, is_lit=index == lit)
        if ball is not None and not drawn:
            self._paint_ball(painter, region, ball)

    def _paint_marks(self, painter: QPainter, target: TargetPlace, *, is_lit: bool) -> None:
        painter.setBrush(Qt.BrushStyle.NoBrush)
        ink = QColor(TANK.lit if is_lit else TANK.dim)
        ink.setAlphaF(0.62 if is_lit else 0.55)
        if is_lit:
            painter.setPen(QPen(ink, self._stroke * 0.36))
            painter.drawPolygon(target.circle)
            return
        thin = self._stroke * 0.3
        points = target.diamond.toList()
        for start, end in zip(points, points[1:] + points[:1], strict=True):
            along = end - start
            painter.setPen(sprites.dashes(ink, thin, (along.x() ** 2 + along.y() ** 2) ** 0.5, 4))
            painter.drawLine(start, end)
        ink.setAlphaF(0.45)
        painter.setPen(QPen(ink, self._stroke * 0.3, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
        painter.drawPoints(target.feet)

    def _paint_target(self, painter: QPainter, target: TargetPlace, *, is_lit: bool) -> None:
        ratio = self.devicePixelRatioF()
        if not is_lit:
            sprites.draw(painter, sprites.diamond(target.radius, ratio, self._stroke * 0.42), target.middle)
            return
        sprites.draw(painter, sprites.ring(target.radius, ratio, self._stroke), target.middle)
        dwell = self._task.dwell if self._task else 0.0
        if dwell > 0:
            pen = QPen(QColor(TANK.lit), self._stroke * 1.3, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap)
            painter.setPen(pen)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            radius = target.radius
            circle = QRectF(target.middle.x() - radius, target.middle.y() - radius, 2 * radius, 2 * radius)
            painter.drawArc(circle, 90 * 16, -round(min(dwell, 1.0) * 360 * 16))

    def _paint_ball(self, painter: QPainter, region: QRegion, ball: BallPlace) -> None:
        if region.intersects(self._things["plumb"].place.toAlignedRect()):
            ink = QColor(TANK.proxy_light)
            ink.setAlphaF(0.62)
            painter.setPen(QPen(ink, self._stroke * 0.36, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
            painter.drawPoints(ball.feet)
        if region.intersects(self._things["ball"].place.toAlignedRect()):
            sprite = sprites.ball(ball.radius, self.devicePixelRatioF(), ball.haze)
            sprites.draw(painter, sprite, ball.middle)

    def _patch_place(self) -> QRectF:
        return patch_place(self.width(), self.height())

    def _paint_patch(self, painter: QPainter, region: QRegion) -> None:
        place = self._patch_place()
        if self._photodiode and region.intersects(place.toAlignedRect()):
            paint_patch(painter, place, lit=self._patch.lit)
