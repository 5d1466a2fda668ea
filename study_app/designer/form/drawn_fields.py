"""Editors that draw: the axis of levels with the limits of the force, one trial of a block."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal, TypeAlias

from pydantic import ValidationError
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QBrush, QColor, QFontMetrics, QPainter, QPainterPath, QPaintEvent, QPen, QResizeEvent
from PySide6.QtWidgets import QAbstractButton, QWidget

from study_app.designer.document.fields import Row, label_of
from study_app.designer.document.steps import GoTo
from study_app.designer.document.study import Study
from study_app.designer.form.fields import Extra, Field, SpecialEditor
from study_app.designer.measures.levels import (
    LIMIT_NAMES,
    LevelFormat,
    Limit,
    Ticks,
    block_of,
    even_ticks,
    limit_colour,
    log_ticks,
    rounded,
)
from study_app.gui.theme import Themed, draw_icon, font
from study_app.gui.widgets import Range, smooth_painter
from study_app.number_text import capitalised, duration, exact_duration
from study_app.protocol.presented import level_limits
from study_app.protocol.source import Path, value_at
from study_app.protocol.trials import ORDINALS, AnyTask, Stimulus

_LIMIT_RANGE: Final = 3.0
"""A limit is drawn if it is below this multiple of the highest level, or within this many spans above it."""
MARGIN_RATIO: Final = 1.3
_MAX_TICKS: Final = 6


@dataclass(frozen=True, slots=True)
class _AxisLimit:
    """A limit: its name with its value, and the level at which it is reached."""

    label: str
    level: float


@dataclass(frozen=True, slots=True, kw_only=True)
class _LevelAxis:
    """An axis of levels."""

    # the lowest and the highest level
    low: float
    high: float
    # the ends of the axis
    least: float
    most: float
    logarithmic: bool  # whether levels are spaced logarithmically
    levels: tuple[float, ...]  # the levels from which a method chooses
    factor: float  # the display factor of levels
    unit: str  # the display unit of levels
    caption: str  # the kind of level and its spacing, as text
    standard: str  # the highest standard as text, "" without one
    # the levels of the force limit ("norm") and the slope limit, if near
    limits: Mapping[Limit, _AxisLimit]
    ticks: Ticks  # labelled levels of the axis
    sentence: str  # a sentence that describes the axis


def _level_axis(study: Study, row: Row) -> _LevelAxis | None:
    """Return the axis of a stimulus' levels; None if they are invalid."""
    try:
        stimulus = Stimulus.model_validate(value_at(study.document, row.path[:-1]))
    except ValidationError:
        return None
    scale = LevelFormat(stimulus)
    low, high = stimulus.levels
    standard, limits = _limits(study, row, scale)
    is_log = stimulus.spacing == "log"
    near_levels = [
        limit.level
        for limit in limits.values()
        if limit.level <= (_LIMIT_RANGE * high if is_log else high + _LIMIT_RANGE * (high - low))
    ]
    highest_shown = max(high, *near_levels) if near_levels else high
    axis_min, axis_max = (
        (low / MARGIN_RATIO**2, highest_shown * MARGIN_RATIO)
        if is_log
        else (low - 0.1 * (highest_shown - low), highest_shown + 0.15 * (highest_shown - low))
    )
    if not is_log and stimulus.level_kind != "value":
        axis_min = max(0.0, axis_min)
    factor = scale.factor
    ticks = (log_ticks if is_log else even_ticks)(axis_min * factor, axis_max * factor, _MAX_TICKS)
    shown_limits = {name: limit for name, limit in limits.items() if limit.level <= axis_max}
    spacing = "in ratio" if is_log else "even"
    limit_sentences = "".join(f" {capitalised(limit.label)}." for limit in shown_limits.values())
    return _LevelAxis(
        low=low,
        high=high,
        least=axis_min,
        most=axis_max,
        logarithmic=is_log,
        levels=stimulus.grid,
        factor=factor,
        unit=scale.unit,
        caption=f"{scale.kind}{f', {scale.unit}' if scale.unit else ''}, {'logarithmic' if is_log else 'linear'}",
        standard=standard,
        limits=shown_limits,
        ticks=tuple((value / factor, rounded(value)) for value in ticks),
        sentence=f"{stimulus.steps} levels from {scale.text(low)} to {scale.text(high)}, {spacing}.{limit_sentences}",
    )


def _limits(study: Study, row: Row, scale: LevelFormat) -> tuple[str, dict[Limit, _AxisLimit]]:
    """Return the highest standard as text, and the limits of the block that presents the levels."""
    protocol = study.formed
    block = block_of(protocol, row.path[:-1])
    if protocol is None or block is None or block.stimulus is None or block.design is None:
        return "", {}
    highest = max((standard for standard in protocol.standards_of(block) if standard is not None), default=None)
    standard = "" if highest is None else f"standard {rounded(highest)} {scale.value_unit}".rstrip()
    limits: dict[Limit, _AxisLimit] = {}
    if (reached_at := level_limits(protocol, block)) is not None:
        values: dict[Limit, float | None] = {"norm": reached_at.force, "slope": reached_at.loop}
        for name, value in values.items():
            if value is not None:
                level = scale.stimulus.level_between(highest, value)
                if math.isfinite(level) and level > 0:
                    limits[name] = _AxisLimit(
                        f"{LIMIT_NAMES[name]} {rounded(value)} {scale.value_unit}".rstrip(), level
                    )
    return standard, limits


HEIGHT, TRACK_Y, TRACK_PX, MARGIN = 104, 46.0, 12.0, 14


class _AxisView(Extra, Themed, QWidget):
    """The axis with its levels, ends and limits."""

    def __init__(self) -> None:
        super().__init__()
        self.axis: _LevelAxis | None = None
        self.setFixedHeight(HEIGHT)
        self.setAccessibleName("Level axis")

    def show_facts(self, facts: Any) -> None:
        self.axis = facts
        self.setAccessibleDescription(facts.sentence)
        self.update()

    def _x(self, level: float) -> float:
        assert self.axis is not None  # noqa: S101 - it is painted
        span = Range(self.axis.least, self.axis.most, logarithmic=self.axis.logarithmic)
        return MARGIN + span.fraction_of_range(level) * (self.width() - 2 * MARGIN)

    def sizeHint(self) -> QSize:
        return QSize(260, HEIGHT)

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self.axis is None:
            return
        painter, axis, theme = smooth_painter(self), self.axis, self.theme
        painter.setPen(Qt.PenStyle.NoPen)
        track = QRectF(MARGIN, TRACK_Y - TRACK_PX / 2, self.width() - 2 * MARGIN, TRACK_PX)
        painter.setBrush(QColor(theme.sunk))
        painter.drawRect(track)
        low, high = self._x(axis.low), self._x(axis.high)
        painter.setBrush(QColor(theme.selected))
        painter.drawRect(QRectF(low, track.top(), high - low, TRACK_PX))
        for name, limit in axis.limits.items():
            x = self._x(limit.level)
            painter.setBrush(QBrush(QColor(limit_colour(theme, name)), Qt.BrushStyle.BDiagPattern))
            painter.drawRect(QRectF(x, track.top(), track.right() - x, TRACK_PX))
        painter.setPen(QPen(QColor(theme.accent), 1.4))
        for level in axis.levels:
            x = self._x(level)
            painter.drawLine(QPointF(x, track.top()), QPointF(x, track.bottom()))
        painter.setPen(QPen(QColor(theme.accent), 2))
        painter.setBrush(QColor(theme.surface))
        for x in (low, high):
            painter.drawEllipse(QPointF(x, TRACK_Y), 7, 7)
        painter.setFont(font("small", tabular=True))
        self._paint_limits(painter, axis, track)
        painter.setPen(QColor(theme.text3))
        for level, label in axis.ticks:
            x = self._x(level)
            painter.drawLine(QPointF(x, track.bottom() + 6), QPointF(x, track.bottom() + 10))
            room = QRectF(x - 30, track.bottom() + 11, 60, 16)
            painter.drawText(room, Qt.AlignmentFlag.AlignHCenter, label)
        below = QRectF(MARGIN, HEIGHT - 20, self.width() - 2 * MARGIN, 18)
        painter.setPen(QColor(theme.text2))
        painter.drawText(below, Qt.AlignmentFlag.AlignLeft, axis.standard)
        painter.drawText(below, Qt.AlignmentFlag.AlignRight, axis.caption)

    def _paint_limits(self, painter: QPainter, axis: _LevelAxis, track: QRectF) -> None:
        """Paint a line and a name at each limit, the name of the higher one above that of the lower one."""
        limits = [(limit, limit_colour(self.theme, name)) for name, limit in axis.limits.items()]
        for row, (limit, ink) in enumerate(sorted(limits, key=lambda pair: pair[0].level)):
            x, top = self._x(limit.level), 14.0 * (1 - row)
            painter.setPen(QPen(QColor(ink), 1.6, Qt.PenStyle.SolidLine if row == 0 else Qt.PenStyle.DashLine))
            painter.drawLine(QPointF(x, top + 2), QPointF(x, track.bottom()))
            painter.setPen(QColor(ink))
            room = QRectF(0, top, x - 5, 16)
            painter.drawText(room, Qt.AlignmentFlag.AlignRight, limit.label)


LEVELS: Final = SpecialEditor((("Stimulus", "levels"),), adds=lambda _field: _AxisView(), wide=True, facts=_level_axis)


_PhaseKind: TypeAlias = Literal["interval", "pause", "question", "feedback"]


@dataclass(frozen=True, slots=True)
class _Phase:
    """A phase of a trial."""

    kind: _PhaseKind
    name: str
    caption: str  # the text in its picture
    duration_s: float
    field: Path = ()  # the path of its duration in the file; () if the program sets it
    about: bool = False  # whether the duration is approximate

    @property
    def opens(self) -> str:
        """The label of the field that it opens; "" if it has none."""
        return label_of(self.field[-1]) if self.field else ""

    @property
    def duration(self) -> str:
        exact = not self.about and bool(self.field) and str(self.field[-1]).endswith("_s")
        text = exact_duration(self.duration_s, self.duration_s) if exact else duration(self.duration_s, tenths=True)
        return f"{'about ' if self.about else ''}{text}"


@dataclass(frozen=True, slots=True)
class _TrialStrip:
    """The phases of a trial, and its duration with the following pause [s]."""

    phases: tuple[_Phase, ...]
    duration_s: float

    @property
    def sentence(self) -> str:
        listed = ", ".join(f"{phase.name} {phase.duration}" for phase in self.phases)
        return f"One trial takes {self.duration}: {listed}."

    @property
    def duration(self) -> str:
        return duration(self.duration_s, tenths=True)


def _trial_strip(study: Study, row: Row) -> _TrialStrip | None:
    """Return the strip for a trial of a block with a design; None if the study has faults."""
    protocol = study.formed
    block = None if protocol is None else protocol.blocks.get(str(row.path[1]))
    if protocol is None or block is None or block.design is None:
        return None
    design, task = protocol.design_of(block), protocol.tasks[block.task]
    phases: list[_Phase] = []
    is_approximate = task.expected_s != task.limit_s

    def design_field(key: str) -> Path:
        return ("designs", str(block.design), key) if block.design in protocol.designs else ()

    for number in range(design.intervals):
        if number:
            phases.append(_Phase("pause", label_of("pause_s"), "", design.pause_s, design_field("pause_s")))
        ordinal = ORDINALS[number] if design.intervals > 1 else ""
        phases.append(
            _Phase(
                "interval",
                "Interval",
                ordinal,
                task.expected_s,
                ("tasks", block.task, _duration_key(task)),
                is_approximate,
            )
        )
    method = protocol.method_of(block) if block.stimulus is not None else None
    if method is not None and method.adjusts:
        field = ("methods", str(block.method), "most_s") if block.method in protocol.methods else ()
        phases.append(_Phase("question", "Setting", "", method.setting_s, field, about=True))
    else:
        phases.append(
            _Phase("question", "Question", design.reply, design.answer_s, design_field("question"), about=True)
        )
    if design.shows_feedback(block.phase == "practice"):
        phases.append(_Phase("feedback", "Feedback", "", design.feedback_s, design_field("feedback_s")))
    phases.append(_Phase("pause", label_of("between_s"), "", design.between_s, design_field("between_s")))
    return _TrialStrip(tuple(phases), sum(phase.duration_s for phase in phases))


def _duration_key(task: AnyTask) -> str:
    """Return the key that determines the duration of a task."""
    return next((key for key in ("count", "duration_s", "cycles", "max_s") if getattr(task, key, None)), "kind")


PICTURE_PX, GAP = 52, 6


class _PhaseButton(Themed, QAbstractButton):
    """A phase of a trial; pressing it opens its field."""

    def __init__(self, strip: QWidget) -> None:
        super().__init__(strip)
        self.phase: _Phase | None = None

    def show_phase(self, phase: _Phase) -> None:
        self.phase = phase
        opens = f"Opens “{phase.opens}”" if phase.opens else ""
        self.setAccessibleName(f"{phase.name}, {phase.duration}")
        self.setAccessibleDescription(opens)
        self.setToolTip("\n".join(filter(None, (f"{phase.name}, {phase.duration}", opens))))
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus if phase.field else Qt.FocusPolicy.NoFocus)
        self.setCursor(Qt.CursorShape.PointingHandCursor if phase.field else Qt.CursorShape.ArrowCursor)
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self.phase is None:
            return
        painter, theme, phase = smooth_painter(self), self.theme, self.phase
        picture = QRectF(0, 0, self.width(), PICTURE_PX).adjusted(1, 1, -1, -1)
        is_highlighted = self.hasFocus() or (self.underMouse() and bool(phase.field))
        painter.setPen(QPen(QColor(theme.accent if is_highlighted else theme.border), 2 if self.hasFocus() else 1))
        painter.setBrush(QColor(theme.selected if phase.kind == "interval" else theme.sunk))
        painter.drawRoundedRect(picture, 6, 6)
        middle = picture.center()
        if phase.kind == "interval":
            self._paint_interval(painter, phase, picture)
        elif phase.kind == "question":
            draw_icon(painter, "list", QRectF(middle.x() - 9, middle.y() - 9, 18, 18), theme.accent, 2.0)
        elif phase.kind == "feedback":
            draw_icon(painter, "check", QRectF(middle.x() - 9, middle.y() - 9, 18, 18), theme.ok, 2.2)
        painter.setFont(font("small"))
        metrics = painter.fontMetrics()
        for ink, text, below in ((theme.text, phase.name, 15), (theme.text2, phase.duration, 30)):
            painter.setPen(QColor(ink))
            shown = metrics.elidedText(text, Qt.TextElideMode.ElideRight, self.width())
            painter.drawText(QPointF(0, picture.bottom() + below), shown)

    def _paint_interval(self, painter: QPainter, phase: _Phase, picture: QRectF) -> None:
        theme, path = self.theme, QPainterPath()
        middle = picture.center().y() - 5
        step = picture.width() / 4
        path.moveTo(picture.left() + 4, middle)
        for number in range(4):
            offset = 8 if number % 2 else -8
            begin = picture.left() + 4 + number * (step - 2)
            path.quadTo(QPointF(begin + step / 2, middle + offset), QPointF(begin + step - 2, middle))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(theme.text3), 1, Qt.PenStyle.DotLine))
        painter.drawPath(path)
        painter.setPen(QPen(QColor(theme.accent), 2))
        painter.setBrush(QColor(theme.surface))
        painter.drawEllipse(QPointF(picture.center().x(), middle), 6, 6)
        painter.setPen(QColor(theme.text2))
        painter.setFont(font("key"))
        painter.drawText(picture.adjusted(0, 0, 0, -3), Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignBottom,
                         phase.caption)  # fmt: skip


class _StripView(Extra, Themed, QWidget):
    """The phases of one trial; their widths grow with their durations, but fit their texts.

    ``opened`` carries the path of the field of the pressed phase.
    """

    opened = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.strip: _TrialStrip | None = None
        self.phases: list[_PhaseButton] = []
        self.setFixedHeight(HEIGHT)

    def show_facts(self, facts: Any) -> None:
        strip: _TrialStrip = facts
        self.strip = strip
        self.setAccessibleName("One trial")
        self.setAccessibleDescription(strip.sentence)
        while len(self.phases) < len(strip.phases):
            phase_button = _PhaseButton(self)
            phase_button.clicked.connect(lambda _checked=False, button=phase_button: self._open_phase(button))
            self.phases.append(phase_button)
        for index, button in enumerate(self.phases):
            button.setVisible(index < len(strip.phases))
            if index < len(strip.phases):
                button.show_phase(strip.phases[index])
        self._place_phases()
        self.update()

    def _open_phase(self, pressed: _PhaseButton) -> None:
        if pressed.phase is not None and pressed.phase.field:
            self.opened.emit(pressed.phase.field)

    def _place_phases(self) -> None:
        if self.strip is None:
            return
        phases, x = self.strip.phases, 0.0
        for button, width in zip(
            self.phases, _phase_widths(phases, self.width() - GAP * (len(phases) - 1)), strict=False
        ):
            button.setGeometry(round(x), 18, round(width), HEIGHT - 18)
            x += width + GAP

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._place_phases()

    def sizeHint(self) -> QSize:
        return QSize(260, HEIGHT)

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self.strip is None:
            return
        painter = QPainter(self)
        painter.setFont(font("small", weight=600))
        painter.setPen(QColor(self.theme.text2))
        head = QRectF(0, 0, self.width(), 16)
        painter.drawText(head, Qt.AlignmentFlag.AlignLeft, "One trial")
        painter.drawText(head, Qt.AlignmentFlag.AlignRight, self.strip.duration)


def _phase_widths(phases: tuple[_Phase, ...], total_px: float) -> list[float]:
    """Return the widths of the phases: wide enough for their texts, and longer phases are wider."""
    metrics = QFontMetrics(font("small"))
    least_widths = [max(map(metrics.horizontalAdvance, (phase.name, phase.duration))) + GAP for phase in phases]
    spare_px, total = max(0.0, total_px - sum(least_widths)), sum(phase.duration_s for phase in phases) or 1.0
    scale = min(1.0, total_px / sum(least_widths))
    return [
        scale * minimum + spare_px * phase.duration_s / total
        for minimum, phase in zip(least_widths, phases, strict=True)
    ]


def _trial_strip_below(field: Field) -> _StripView:
    strip = _StripView()
    strip.opened.connect(lambda path: field.asked.emit(GoTo(path[:2], path)))
    return strip


TRIAL: Final = SpecialEditor((("Block", "design"),), adds=_trial_strip_below, wide=True, facts=_trial_strip)
