"""The participant's tank: a static backdrop and the moving parts in front of it.

Proxy, lit target, dwell arc and count are drawn as of the time of the view, so that they share its delay; nothing is
smoothed. The tank does not know which liquid is presented.
"""

from __future__ import annotations

import math
from dataclasses import replace
from threading import Thread

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QRegion, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QWidget

from study_app.gui.participant.intervals.answer_page import SettingControls
from study_app.gui.participant.pages.page_widget import page_painter
from study_app.gui.participant.tank import sprites
from study_app.gui.participant.tank.captions import Captions
from study_app.gui.participant.tank.frame import (
    DEPTH_STEPS,
    BallPlacer,
    Box,
    Camera,
    DrawnBall,
    DrawnPart,
    DrawnTarget,
    Point,
    TaskShown,
    ball_parts,
    changed_region,
    drawn_target,
    paint_marks,
)
from study_app.gui.participant.tank.layers import (
    Backdrop,
    OnsetPatch,
    Pane,
    VideoLayer,
    paint_backdrop,
    paint_patch,
    patch_rectangle,
    video_area,
)
from study_app.gui.theme.theme import TANK
from study_app.gui.widgets.accessible import announce
from study_app.protocol.wording import Words
from study_app.session.pages import TaskPage
from study_app.session.tasks import TankView, new_tracker

# Left, top, width and height of the tank, relative to the window.
_AREA = (0.075, 0.122, 0.85, 0.712)
_NEAR_RADII = 2.0  # the ball is in front of or behind a target within this distance [target radii]
_ALWAYS = QRegion(0, 0, 1, 1)  # repainted in every frame, so that frames without motion are painted, too


def _tank_and_camera(page: TaskPage, captions: Captions, width: int, height: int) -> tuple[Box, Camera]:
    """Return the tank of a page and the camera for a window of ``width`` × ``height`` [px]."""
    box = Box.around(page.workspace_m, page.body_radius_m)
    left, top, wide, high = _AREA
    top = max(top, captions.height_above(width, height) / height)
    room = (1 - top) * height - captions.height_below(width, height)
    return box, Camera.fitted(box, left * width, top * height, wide * width, min(high * height, room))


def paint_ahead(page: TaskPage, wording: Words, text_scale: float, size: QSize, ratio: float) -> Thread:
    """Start a thread that paints the static images of the next page, so that it appears at once; return the thread."""
    width, height = size.width(), size.height()
    box, camera = _tank_and_camera(page, Captions(page, wording, text_scale), width, height)
    painting = Thread(target=paint_backdrop, args=((width, height), ratio, box, camera), name="backdrop")
    painting.start()
    return painting


class TankWidget(QWidget):
    """Draws a task page and, on it, each new view at once.

    ``painted(sample_ns)`` is emitted once per view with its sample time, as soon as the window system has received it.
    With ``on_card`` the tank is a surface of the graphics card, ``painted`` is emitted after the buffer swap, and
    ``swapped`` after each swap. ``photodiode`` adds a corner that toggles at each movement onset. With ``by_mouse`` a
    mouse moves the hand: a click continues, there is no force to stop, and if only the depth is wrong, a hint tells
    which way to turn the wheel.
    """

    painted = Signal(object)
    swapped = Signal()

    def __init__(
        self,
        page: TaskPage,
        wording: Words,
        parent: QWidget | None = None,
        *,
        text_scale: float = 1.0,
        on_card: bool = False,
        photodiode: bool = True,
        by_mouse: bool = False,
    ) -> None:
        super().__init__(parent)
        if by_mouse:
            for_mouse = {"continue_now": wording.click_now, "pause_hint": wording.pause_title}
            wording = type(wording)({**vars(wording), **for_mouse})
        self._words = wording
        self._by_mouse = by_mouse
        self._photodiode = photodiode
        self._pane: QWidget | None = self._make_pane() if on_card else None
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.setAccessibleName(page.instruction)
        self._page = page
        self._box = Box.around(page.workspace_m, page.body_radius_m)
        self._captions = Captions(page, wording, text_scale)
        self.patch = OnsetPatch()
        self.video = VideoLayer()
        self.view: TankView | None = None
        self._unpainted = False
        self._showing = False
        self._drawn_ns: int | None = None
        self.parts: dict[str, DrawnPart] = {}
        self.ball: DrawnBall | None = None
        self.camera: Camera | None = None
        self.targets: tuple[DrawnTarget, ...] = ()
        self.placer: BallPlacer | None = None
        self._stroke = 1.0
        self.controls: SettingControls | None = None

    @property
    def page(self) -> TaskPage:
        return self._page

    @property
    def resting(self) -> bool:
        return self._page.interval is not None and self._page.interval.resting

    @property
    def may_leave(self) -> bool:
        """Whether the minimum exploration time is over, so that the participant may continue."""
        least_s = self._page.task.least_s
        return (
            not self.resting and least_s is not None and self.view is not None and self.view.task.elapsed_s >= least_s
        )

    @property
    def time_is_up(self) -> bool:
        return self.view is not None and self.view.task.elapsed_s >= self._page.task.limit_s

    def sizeHint(self) -> QSize:
        return QSize(1920, 1080)

    def show_interval(self, page: TaskPage) -> None:
        """Show another interval of the same trial, or the rest before it; earlier views are discarded."""
        self._page = page
        self._captions.show_interval(page)
        if self.controls is not None:
            self.controls.show_interval(page)
        if self.view is not None:  # until the next view, the ball stays where it is
            self.view = replace(self.view, task=new_tracker(page.task).now(), ball_hidden=False)
        self._unpainted = False
        self.video.show_frame(None)
        self.parts = self._frame_parts()
        self._announce()
        if self._pane is None:
            self.repaint()
        else:
            self._pane.update()

    def _announce(self) -> None:
        interval = self._page.interval
        if interval is not None:
            self.setAccessibleName(f"{interval.announced}. {self._page.said}")
            announce(self, self.accessibleName() if self._page.adjusts else interval.announced)

    def paint_ahead(self) -> None:
        """Paint the static images now, so that the first frame is not delayed."""
        self._static_images()

    def show_view(self, view: TankView) -> None:
        """Draw the proxy's position in ``view``, and the task at that time."""
        self.view = view
        self._unpainted = True
        x, y, z = (float(value) for value in view.position_m)
        self.patch.follow_motion((x, y, z), view.sample_time_ns)
        self.video.show_frame(view.video)
        self._static_images()
        parts = self._frame_parts()
        changed = changed_region(self.parts, parts) + _ALWAYS
        self.parts = parts
        if self._pane is None:
            self._drawn_ns, self._showing = None, True
            self.repaint(changed)  # at once, since queued events would delay the view
            self._showing = False
            self._emit_painted()
        else:
            self._pane.update()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._announce()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.camera = None
        if self._pane is not None:
            self._pane.setGeometry(self.rect())

    def paintEvent(self, event: QPaintEvent) -> None:
        if self._pane is not None:
            return
        painter = page_painter(self)
        self._paint(painter, event.region())
        painter.end()
        if not self._showing:
            self._emit_painted()

    def _make_pane(self) -> QWidget:
        pane = Pane(self, self._paint)
        pane.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        pane.swapped.connect(self._handle_swap)
        return pane

    def _handle_swap(self) -> None:
        self.swapped.emit()
        self._emit_painted()

    def _emit_painted(self) -> None:
        """Emit ``painted``, once for every view."""
        if self._unpainted and self._drawn_ns is not None:
            self._unpainted = False
            self.painted.emit(self._drawn_ns)

    def _paint(self, painter: QPainter, region: QRegion) -> None:
        backdrop = self._static_images()
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        if self._page.video:
            self.video.paint(painter, region)
        else:
            painter.drawImage(QPointF(0, 0), backdrop.back)
        if self._page.overlay:
            self._paint_parts(painter, region)
        if not self._page.video and region.intersects(backdrop.front_at.toAlignedRect()):
            painter.drawImage(backdrop.front_at.topLeft(), backdrop.front)
        self._captions.draw(painter, region, self._task, self._hint_text())
        place = self.patch_area()
        if self._photodiode and region.intersects(place.toAlignedRect()):
            paint_patch(painter, place, lit=self.patch.lit)
        self._drawn_ns = None if self.view is None else self.view.sample_time_ns

    @property
    def _task(self) -> TaskShown | None:
        return None if self.view is None else self.view.task

    def _hint_text(self) -> str:
        """Return the hint how to move the ball to the target, or "" if none is needed.

        With a mouse, it says "nearer" or "further away" if only the depth is wrong. In a rest that waits for the ball,
        it says to return.
        """
        definition, view, wording = self._page.task, self.view, self._words
        if self._page.adjusts:
            return self._captions.setting_keys if self._by_mouse else ""
        is_paced = definition.paced and not self.resting
        if view is None or view.task.lit is None or is_paced:
            return ""
        target = definition.targets_m[view.task.lit] if definition.targets_m else definition.start_m
        if target is None:
            return ""
        x, y, z = (goal - float(current) for goal, current in zip(target, view.position_m, strict=True))
        if self._by_mouse and math.hypot(x, y) <= _NEAR_RADII * definition.radius_m and abs(z) > definition.radius_m:
            return wording.nearer if z > 0 else wording.further_away
        return wording.back_to_target if self.resting and math.hypot(x, y, z) > definition.radius_m else ""

    def _static_images(self) -> Backdrop:
        """Return the static images for the current size and screen; update the layout if they changed."""
        ratio = self.devicePixelRatioF()
        if self.camera is None:
            self._lay_out(ratio)
        assert self.camera is not None  # noqa: S101  # _lay_out has just set it
        return paint_backdrop((self.width(), self.height()), ratio, self._box, self.camera)

    def _lay_out(self, ratio: float) -> None:
        width, height = self.width(), self.height()
        self._box, self.camera = _tank_and_camera(self._page, self._captions, width, height)
        self._captions.lay_out(width, height, self.camera.point((0, self._box.floor, self._box.z))[1])
        if self.controls is not None:
            self.controls.lay_out_controls(self._captions.small_scale, self._captions.controls_middle)
        self.placer = BallPlacer(self.camera, self._box, self._page.body_radius_m)
        self.video.place = video_area(self.camera, self._box)
        for step in range(DEPTH_STEPS):
            radius, haze = self.placer.size(step)
            sprites.ball_sprite(radius, ratio, haze)
        self.targets = self._placed_targets(self._page.task.targets_m)
        self._stroke = max(2.0, self.camera.scale((0, 0, 0)) * 0.0010)
        self.parts = self._frame_parts()

    def _placed_targets(self, centres_m: tuple[Point, ...]) -> tuple[DrawnTarget, ...]:
        if self.camera is None:
            return ()
        # The ball is inside the ring as long as its centre is in the target.
        radius_m = self._page.task.radius_m + self._page.body_radius_m
        return tuple(drawn_target(self.camera, self._box, centre, radius_m) for centre in centres_m)

    def _frame_parts(self) -> dict[str, DrawnPart]:
        task = self._task
        lit = task.lit if task else None
        if (moving_m := (task and task.target_m) or self._page.task.target_m(0.0)) is not None:
            self.targets = self._placed_targets((moving_m,))
        parts: dict[str, DrawnPart] = {}
        for index, target in enumerate(self.targets):
            is_lit, x = index == lit, target.middle.x()
            parts[f"target {index}"] = DrawnPart((is_lit, task.dwell if task and is_lit else 0.0, x), target.place)
            parts[f"marks {index}"] = DrawnPart((is_lit, x), target.marks)
        self.ball = None
        if self.view is not None and not self.view.ball_hidden and self.placer is not None:
            x, y, z = (float(value) for value in self.view.position_m)
            self.ball = self.placer.place((x, y, z))
            parts |= ball_parts(self.ball)
        parts |= self._captions.parts(task, self._hint_text())
        if self._page.video:
            parts["video"] = self.video.placed_frame
        if self._photodiode:
            parts["patch"] = DrawnPart(self.patch.lit, self.patch_area())
        return parts

    def _paint_parts(self, painter: QPainter, region: QRegion) -> None:
        """Paint floor marks and shadow, then ball and targets from far to near."""
        lit = self._task.lit if self._task else None
        for index, target in enumerate(self.targets):
            if region.intersects(target.marks.toAlignedRect()):
                paint_marks(painter, target, self._stroke, is_lit=index == lit)
        ratio = self.devicePixelRatioF()
        ball = self.ball
        if ball is not None and region.intersects(self.parts["shadow"].place.toAlignedRect()):
            sprite = sprites.shadow_sprite(ball.floor_radius, ratio, ball.floor_flat)
            sprites.draw_sprite(painter, sprite, ball.floor, opacity=ball.shade, scale=ball.spread)
        order = sorted(range(len(self.targets)), key=lambda index: -self.targets[index].depth_m)
        drawn = False
        for index in order:
            target = self.targets[index]
            if ball is not None and not drawn and target.depth_m < ball.depth_m:
                self._paint_ball(painter, region, ball)
                drawn = True
            if region.intersects(target.place.toAlignedRect()):
                self._paint_target(painter, target, is_lit=index == lit)
        if ball is not None and not drawn:
            self._paint_ball(painter, region, ball)

    def _paint_target(self, painter: QPainter, target: DrawnTarget, *, is_lit: bool) -> None:
        ratio = self.devicePixelRatioF()
        if not is_lit:
            sprites.draw_sprite(
                painter, sprites.diamond_sprite(target.radius, ratio, self._stroke * 0.42), target.middle
            )
            return
        sprites.draw_sprite(painter, sprites.ring_sprite(target.radius, ratio, self._stroke), target.middle)
        dwell = self._task.dwell if self._task else 0.0
        if dwell > 0:
            pen = QPen(QColor(TANK.lit), self._stroke * 1.3, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap)
            painter.setPen(pen)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            radius = target.radius
            circle = QRectF(target.middle.x() - radius, target.middle.y() - radius, 2 * radius, 2 * radius)
            painter.drawArc(circle, 90 * 16, -round(min(dwell, 1.0) * 360 * 16))

    def _paint_ball(self, painter: QPainter, region: QRegion, ball: DrawnBall) -> None:
        if region.intersects(self.parts["plumb"].place.toAlignedRect()):
            ink = QColor(TANK.proxy_light)
            ink.setAlphaF(0.62)
            painter.setPen(QPen(ink, self._stroke * 0.36, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
            painter.drawPoints(ball.feet)
        if region.intersects(self.parts["ball"].place.toAlignedRect()):
            sprite = sprites.ball_sprite(ball.radius, self.devicePixelRatioF(), ball.haze)
            sprites.draw_sprite(painter, sprite, ball.middle)

    def patch_area(self) -> QRectF:
        return patch_rectangle(self.width(), self.height())
