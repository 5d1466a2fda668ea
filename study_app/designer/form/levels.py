"""The levels of a stimulus: two numbers, and an axis with the limits of the force, on which they are dragged."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from pydantic import ValidationError
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QBrush, QColor, QFocusEvent, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen, QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QSlider, QWidget

from study_app.designer.document.fields import Row
from study_app.designer.document.study import Study
from study_app.designer.form.fields import LineField, SpecialEditor
from study_app.designer.form.rows import FormRow
from study_app.designer.measures.levels import (
    LIMIT_NAMES,
    LevelWords,
    Limit,
    Ticks,
    even_ticks,
    level_block,
    limit_colour,
    log_ticks,
    rounded,
)
from study_app.designer.measures.simulation import focus_of
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.numbers import Range
from study_app.protocol.trials.designs import default_design
from study_app.protocol.trials.stimuli import Stimulus

FARTHEST: Final = 3.0
"""A limit is drawn up to so many times the highest level, or spans above it."""
ROOM: Final = 1.3
MOST_TICKS: Final = 6


@dataclass(frozen=True, slots=True)
class AxisLimit:
    """A limit: its name with its value, and the level that reaches it."""

    words: str
    level: float


@dataclass(frozen=True, slots=True)
class LevelAxis:
    """An axis of levels."""

    # the ends of the levels
    low: float
    high: float
    # the ends of the axis
    least: float
    most: float
    logarithmic: bool  # whether levels are in ratio, not even
    levels: tuple[float, ...]  # the levels between which a method chooses
    factor: float  # what a level is multiplied by where it is written
    unit: str  # the unit of a written level
    caption: str  # what a level is, and how the levels are spaced
    standard: str  # the highest standard in words, "" without one
    # where the force limit ("norm") and the slope limit begin, if that is near the levels
    limits: Mapping[Limit, AxisLimit]
    ticks: Ticks  # levels at which the axis is written at
    sentence: str  # the axis in a sentence


def level_axis(study: Study, row: Row) -> LevelAxis | None:
    """Return the axis of a stimulus' levels; None where they make no sense."""
    table: Any = study.document
    for step in row.path[:-1]:
        table = table.get(step) if isinstance(table, Mapping) else None
    try:
        stimulus = Stimulus.model_validate(table)
    except ValidationError:
        return None
    words = LevelWords(stimulus, default_design("2ifc"))
    low, high = stimulus.levels
    standard, limits = _limits(study, row, words)
    log = stimulus.spacing == "log"
    near = [
        one.level
        for one in limits.values()
        if one.level <= (FARTHEST * high if log else high + FARTHEST * (high - low))
    ]
    top = max(high, *near) if near else high
    least, most = (low / ROOM**2, top * ROOM) if log else (low - 0.1 * (top - low), top + 0.15 * (top - low))
    if not log and stimulus.level_kind != "value":
        least = max(0.0, least)
    factor = words.factor
    ticks = (log_ticks if log else even_ticks)(least * factor, most * factor, MOST_TICKS)
    shown = {name: one for name, one in limits.items() if one.level <= most}
    spacing = "in ratio" if log else "even"
    beyond = "".join(f" {one.words[:1].upper()}{one.words[1:]}." for one in shown.values())
    return LevelAxis(
        low,
        high,
        least,
        most,
        log,
        stimulus.grid,
        factor,
        words.unit,
        f"{words.kind}{f', {words.unit}' if words.unit else ''}, {'logarithmic' if log else 'linear'}",
        standard,
        shown,
        tuple((value / factor, rounded(value)) for value in ticks),
        f"{stimulus.steps} levels from {words.words(low)} to {words.words(high)}, {spacing}.{beyond}",
    )


def _limits(study: Study, row: Row, words: LevelWords) -> tuple[str, dict[Limit, AxisLimit]]:
    """Return the highest standard in words, and the limits of the block that presents the levels."""
    protocol = study.formed
    focus = focus_of(protocol, row.path[:-1])
    of = None if protocol is None or focus.block is None else level_block(protocol, focus.block)
    if of is None:
        return "", {}
    standard = "" if of.standard is None else f"standard {rounded(of.standard)} {words.value_unit}".rstrip()
    found: dict[Limit, AxisLimit] = {}
    if of.limits is not None:
        values: dict[Limit, float | None] = {"norm": of.limits.force, "slope": of.limits.loop}
        for name, value in values.items():
            if value is not None:
                level = words.stimulus.level_between(of.standard, value)
                if math.isfinite(level) and level > 0:
                    found[name] = AxisLimit(f"{LIMIT_NAMES[name]} {rounded(value)} {words.value_unit}".rstrip(), level)
    return standard, found


HEIGHT, TRACK_Y, TRACK_PX = 104, 46.0, 12.0
HANDLE_PX, MARGIN = 24, 14
NAMES = ("Lowest level", "Highest level")
KEYS = {Qt.Key.Key_Left: -1, Qt.Key.Key_Down: -1, Qt.Key.Key_Right: 1, Qt.Key.Key_Up: 1,
        Qt.Key.Key_PageDown: -10, Qt.Key.Key_PageUp: 10}  # fmt: skip


class End(Themed, QSlider):
    """An end of the levels, a handle on the axis; ``moved`` carries a level, and whether the handle is held."""

    moved = Signal(float, bool)

    def __init__(self, name: str, axis: QWidget) -> None:
        super().__init__(Qt.Orientation.Horizontal, axis)
        self.axis = axis
        self.setAccessibleName(name)
        self.setFixedSize(HANDLE_PX, HANDLE_PX)
        self.setCursor(Qt.CursorShape.SizeHorCursor)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.span, self.level, self.held = Range(0.0, 1.0), 0.0, False

    def show_level(self, span: Range, level: float) -> None:
        """Stand at a level, unless the handle is held."""
        if self.held:
            return
        self.span, self.level = span, level
        self.blockSignals(True)
        self.setRange(0, span.steps)
        self.setValue(round(span.share(level) * span.steps))
        self.blockSignals(False)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        step = KEYS.get(Qt.Key(event.key()))
        if step is None:
            event.ignore()
            return
        self.moved.emit(self.span.value(self.span.share(self.level) + step / self.span.steps), False)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self.held = event.button() == Qt.MouseButton.LeftButton

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self.held:
            self.moved.emit(self._at(event), True)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if self.held:
            self.held = False
            self.moved.emit(self.level, False)

    def _at(self, event: QMouseEvent) -> float:
        x = self.axis.mapFromGlobal(event.globalPosition()).x()
        return self.span.value((x - MARGIN) / max(1.0, self.axis.width() - 2 * MARGIN))

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter, middle = QPainter(self), QPointF(HANDLE_PX / 2, HANDLE_PX / 2)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(QColor(self.theme.accent if self.isEnabled() else self.theme.ctl), 2))
        painter.setBrush(QColor(self.theme.surface))
        painter.drawEllipse(middle, 7, 7)
        if self.hasFocus():
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawEllipse(middle, 10.5, 10.5)


class AxisView(Themed, QWidget):
    """The axis; ``asked`` carries both ends, and whether more of the same move may follow; ``came`` the keyboard."""

    asked = Signal(float, float, bool)
    came = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.axis: LevelAxis | None = None
        self.setFixedHeight(HEIGHT)
        self.ends = tuple(End(name, self) for name in NAMES)
        for at, end in enumerate(self.ends):
            end.moved.connect(lambda level, held, at=at: self._move(at, level, held=held))

    def show_axis(self, axis: LevelAxis) -> None:
        self.axis = axis
        span = self._span
        for end, level in zip(self.ends, (axis.low, axis.high), strict=True):
            end.show_level(span, level)
            end.setAccessibleDescription(f"{level * axis.factor:.4g} {axis.unit}. {axis.sentence}")
        self.setAccessibleName("Axis of the levels")
        self.setAccessibleDescription(axis.sentence)
        self._place()
        self.update()

    @property
    def _span(self) -> Range:
        axis = self.axis
        return Range(0.0, 1.0) if axis is None else Range(axis.least, axis.most, logarithmic=axis.logarithmic)

    def _move(self, at: int, level: float, *, held: bool) -> None:
        axis = self.axis
        if axis is None:
            return
        low, high = (end.level for end in self.ends)
        if (at == 0 and level >= high) or (at == 1 and level <= low):
            return
        changed = level != self.ends[at].level
        self.ends[at].level = level
        self._place()
        self.update()
        shown = (axis.low, axis.high)
        ends = (level, high) if at == 0 else (low, level)
        if not held and (changed or ends != shown):
            self.asked.emit(*ends, True)
            self.came.emit()

    def _x(self, level: float) -> float:
        return MARGIN + self._span.share(level) * (self.width() - 2 * MARGIN)

    def _place(self) -> None:
        for end in self.ends:
            end.move(round(self._x(end.level) - HANDLE_PX / 2), round(TRACK_Y - HANDLE_PX / 2))

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._place()

    def sizeHint(self) -> QSize:
        return QSize(260, HEIGHT)

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self.axis is None:
            return
        painter, axis, t = QPainter(self), self.axis, self.theme
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        track = QRectF(MARGIN, TRACK_Y - TRACK_PX / 2, self.width() - 2 * MARGIN, TRACK_PX)
        painter.setBrush(QColor(t.sunk))
        painter.drawRect(track)
        low, high = (self._x(end.level) for end in self.ends)
        painter.setBrush(QColor(t.selected))
        painter.drawRect(QRectF(low, track.top(), high - low, TRACK_PX))
        for name, limit in axis.limits.items():
            x = self._x(limit.level)
            painter.setBrush(QBrush(QColor(limit_colour(t, name)), Qt.BrushStyle.BDiagPattern))
            painter.drawRect(QRectF(x, track.top(), track.right() - x, TRACK_PX))
        painter.setPen(QPen(QColor(t.accent), 1.4))
        if (self.ends[0].level, self.ends[1].level) == (axis.low, axis.high):
            for level in axis.levels:
                x = self._x(level)
                painter.drawLine(QPointF(x, track.top()), QPointF(x, track.bottom()))
        painter.setFont(font("small", tabular=True))
        self._limits(painter, axis, track)
        painter.setPen(QColor(t.text3))
        for level, words in axis.ticks:
            x = self._x(level)
            painter.drawLine(QPointF(x, track.bottom() + 6), QPointF(x, track.bottom() + 10))
            room = QRectF(x - 30, track.bottom() + 11, 60, 16)
            painter.drawText(room, Qt.AlignmentFlag.AlignHCenter, words)
        below = QRectF(MARGIN, HEIGHT - 20, self.width() - 2 * MARGIN, 18)
        painter.setPen(QColor(t.text2))
        painter.drawText(below, Qt.AlignmentFlag.AlignLeft, axis.standard)
        painter.drawText(below, Qt.AlignmentFlag.AlignRight, axis.caption)

    def _limits(self, painter: QPainter, axis: LevelAxis, track: QRectF) -> None:
        """Paint where the limits begin, the name of the higher one above that of the lower one."""
        found = [(limit, limit_colour(self.theme, name)) for name, limit in axis.limits.items()]
        for row, (limit, ink) in enumerate(sorted(found, key=lambda pair: pair[0].level)):
            x, top = self._x(limit.level), 14.0 * (1 - row)
            painter.setPen(QPen(QColor(ink), 1.6, Qt.PenStyle.SolidLine if row == 0 else Qt.PenStyle.DashLine))
            painter.drawLine(QPointF(x, top + 2), QPointF(x, track.bottom()))
            painter.setPen(QColor(ink))
            room = QRectF(0, top, x - 5, 16)
            painter.drawText(room, Qt.AlignmentFlag.AlignRight, limit.words)


class LevelsField(LineField):
    """Both ends as numbers, and the axis below them."""

    def __init__(self, row: FormRow) -> None:
        self.view = AxisView()
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.box.addWidget(self.view)
        self.view.asked.connect(lambda low, high, typing: self.set_value([_plain(low), _plain(high)], typing=typing))
        self.view.came.connect(self.came)
        self.show_value()

    def show_value(self) -> None:
        super().show_value()
        axis: LevelAxis | None = self.row.facts
        self.view.setVisible(axis is not None and self.box.indexOf(self.view) >= 0)
        if axis is not None:
            self.view.show_axis(axis)


def _plain(value: float) -> float | int:
    """Return a level as it is written: whole where it is."""
    return int(value) if value.is_integer() else float(f"{value:.6g}")


LEVELS: Final = SpecialEditor((("Stimulus", "levels"),), LevelsField, wide=True, facts=level_axis)
