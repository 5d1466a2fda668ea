"""The design of a block, with a picture of one trial: intervals, pauses, question and feedback."""

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFontMetrics, QPainter, QPainterPath, QPaintEvent, QPen, QResizeEvent
from PySide6.QtWidgets import QAbstractButton, QBoxLayout, QWidget

from study_app.designer.document.fields import Row, label_of
from study_app.designer.document.steps import GoTo
from study_app.designer.document.study import Study
from study_app.designer.form.fields import ChoiceField, SpecialEditor
from study_app.designer.form.rows import FormRow
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import add_parts, hbox
from study_app.number_text import duration, exact_duration
from study_app.protocol.model import Reach
from study_app.protocol.orders.durations import ANSWER_S, CHOICE_S
from study_app.protocol.source.document import Path
from study_app.protocol.trials.designs import ORDINALS
from study_app.protocol.trials.methods import Adjustment
from study_app.protocol.trials.tasks import AnyTask, Follow
from study_app.protocol.trials.tracks import design_of, method_of

PhaseKind: TypeAlias = Literal["interval", "pause", "question", "feedback"]


@dataclass(frozen=True, slots=True)
class Phase:
    """A phase of a trial."""

    kind: PhaseKind  # what it is
    # its name, and what is written in its picture
    name: str
    words: str
    duration_s: float  # how long it takes [s]
    field: Path = ()  # where the file says so; () where the program does
    about: bool = False  # whether it takes about as long

    @property
    def opens(self) -> str:
        """The label of its field; "" where it has none."""
        return label_of(self.field[-1]) if self.field else ""

    @property
    def duration(self) -> str:
        exact = not self.about and bool(self.field) and str(self.field[-1]).endswith("_s")
        found = exact_duration(self.duration_s, self.duration_s) if exact else duration(self.duration_s, tenths=True)
        return f"{'about ' if self.about else ''}{found}"


@dataclass(frozen=True, slots=True)
class TrialStrip:
    """A trial: its phases, and how long it takes with the pause after it [s]."""

    phases: tuple[Phase, ...]
    duration_s: float

    @property
    def sentence(self) -> str:
        listed = ", ".join(f"{phase.name} {phase.duration}" for phase in self.phases)
        return f"One trial of {self.duration}: {listed}."

    @property
    def duration(self) -> str:
        return duration(self.duration_s, tenths=True)


def trial_strip(study: Study, row: Row) -> TrialStrip | None:
    """Return a trial of a block with a design; None where the study has faults."""
    protocol = study.formed
    block = None if protocol is None else protocol.blocks.get(str(row.path[1]))
    if protocol is None or block is None or block.design is None:
        return None
    design, task = design_of(protocol, block), protocol.tasks[block.task]
    phases: list[Phase] = []
    free = task.expected_s != task.limit_s

    def of_design(key: str) -> Path:
        return ("designs", str(block.design), key) if block.design in protocol.designs else ()

    for number in range(design.intervals):
        if number:
            phases.append(Phase("pause", label_of("pause_s"), "", design.pause_s, of_design("pause_s")))
        words = ORDINALS[number] if design.intervals > 1 else ""
        phases.append(Phase("interval", "Interval", words, task.expected_s, ("tasks", block.task, _length(task)), free))
    method = method_of(protocol, block) if block.stimulus is not None else None
    if isinstance(method, Adjustment):
        field = ("methods", str(block.method), "most_s") if block.method in protocol.methods else ()
        phases.append(Phase("question", "Setting", "", method.most_s / 2, field, about=True))
    else:
        reply_s = CHOICE_S if design.reply == "choice" else ANSWER_S
        phases.append(Phase("question", "Question", design.reply, reply_s, of_design("question"), about=True))
    if design.shows_feedback(block.phase == "practice"):
        phases.append(Phase("feedback", "Feedback", "", design.feedback_s, of_design("feedback_s")))
    phases.append(Phase("pause", label_of("between_s"), "", design.between_s, of_design("between_s")))
    return TrialStrip(tuple(phases), sum(phase.duration_s for phase in phases))


def _length(task: AnyTask) -> str:
    """Return the key that says how long a task takes."""
    if isinstance(task, Reach):
        return "duration_s" if task.count is None else "count"
    return "cycles" if isinstance(task, Follow) else "max_s"


HEIGHT, PICTURE_PX, GAP = 104, 52, 6


class PhaseButton(Themed, QAbstractButton):
    """A phase of a trial; a press asks for its field."""

    def __init__(self, strip: QWidget) -> None:
        super().__init__(strip)
        self.phase: Phase | None = None

    def show_phase(self, phase: Phase) -> None:
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
        painter, t, phase = QPainter(self), self.theme, self.phase
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        picture = QRectF(0, 0, self.width(), PICTURE_PX).adjusted(1, 1, -1, -1)
        lit = self.hasFocus() or (self.underMouse() and bool(phase.field))
        painter.setPen(QPen(QColor(t.accent if lit else t.border), 2 if self.hasFocus() else 1))
        painter.setBrush(QColor(t.selected if phase.kind == "interval" else t.sunk))
        painter.drawRoundedRect(picture, 6, 6)
        middle = picture.center()
        if phase.kind == "interval":
            self._interval(painter, phase, picture)
        elif phase.kind == "question":
            draw_icon(painter, "list", QRectF(middle.x() - 9, middle.y() - 9, 18, 18), t.accent, 2.0)
        elif phase.kind == "feedback":
            draw_icon(painter, "check", QRectF(middle.x() - 9, middle.y() - 9, 18, 18), t.ok, 2.2)
        painter.setFont(font("small"))
        metrics = painter.fontMetrics()
        for ink, words, below in ((t.text, phase.name, 15), (t.text2, phase.duration, 30)):
            painter.setPen(QColor(ink))
            shown = metrics.elidedText(words, Qt.TextElideMode.ElideRight, self.width())
            painter.drawText(QPointF(0, picture.bottom() + below), shown)

    def _interval(self, painter: QPainter, phase: Phase, picture: QRectF) -> None:
        """Paint the ball on its way, and which interval it is."""
        t, way = self.theme, QPainterPath()
        middle = picture.center().y() - 5
        step = picture.width() / 4
        way.moveTo(picture.left() + 4, middle)
        for number in range(4):
            lift = 8 if number % 2 else -8
            begin = picture.left() + 4 + number * (step - 2)
            way.quadTo(QPointF(begin + step / 2, middle + lift), QPointF(begin + step - 2, middle))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(t.text3), 1, Qt.PenStyle.DotLine))
        painter.drawPath(way)
        painter.setPen(QPen(QColor(t.accent), 2))
        painter.setBrush(QColor(t.surface))
        painter.drawEllipse(QPointF(picture.center().x(), middle), 6, 6)
        painter.setPen(QColor(t.text2))
        painter.setFont(font("key"))
        painter.drawText(picture.adjusted(0, 0, 0, -3), Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignBottom,
                         phase.words)  # fmt: skip


class StripView(Themed, QWidget):
    """One trial, as wide as its phases are long, but each wide enough for its words.

    ``opened`` carries the path of the field of the phase that is pressed.
    """

    opened = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.strip: TrialStrip | None = None
        self.phases: list[PhaseButton] = []
        self.setFixedHeight(HEIGHT)

    def show_strip(self, strip: TrialStrip) -> None:
        self.strip = strip
        self.setAccessibleName("One trial")
        self.setAccessibleDescription(strip.sentence)
        while len(self.phases) < len(strip.phases):
            made = PhaseButton(self)
            made.clicked.connect(lambda _checked=False, made=made: self._open(made))
            made.apply_theme(self.theme)
            self.phases.append(made)
        for at, button in enumerate(self.phases):
            button.setVisible(at < len(strip.phases))
            if at < len(strip.phases):
                button.show_phase(strip.phases[at])
        self._place()
        self.update()

    def _open(self, pressed: PhaseButton) -> None:
        if pressed.phase is not None and pressed.phase.field:
            self.opened.emit(pressed.phase.field)

    def _place(self) -> None:
        if self.strip is None:
            return
        phases, x = self.strip.phases, 0.0
        for button, width in zip(self.phases, _widths(phases, self.width() - GAP * (len(phases) - 1)), strict=False):
            button.setGeometry(round(x), 18, round(width), HEIGHT - 18)
            x += width + GAP

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._place()

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


def _widths(phases: tuple[Phase, ...], whole: float) -> list[float]:
    """Return how wide each phase is: wide enough for its words, and the longer it is, the wider."""
    metrics = QFontMetrics(font("small"))
    words = [max(map(metrics.horizontalAdvance, (phase.name, phase.duration))) + GAP for phase in phases]
    rest, total = max(0.0, whole - sum(words)), sum(phase.duration_s for phase in phases) or 1.0
    share = min(1.0, whole / sum(words))
    return [share * least + rest * phase.duration_s / total for least, phase in zip(words, phases, strict=True)]


class DesignField(ChoiceField):
    """The choice of the design, and one trial below it."""

    def __init__(self, row: FormRow) -> None:
        self.view = StripView()
        super().__init__(row)
        choice = QWidget()
        parts = ((part, int(part is self.list)) for part in (self.segments, self.list, self.arrow) if part is not None)
        hbox(*parts, spacing=8, margins=0, parent=choice)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        add_parts(self.box, choice, self.view)
        self.view.opened.connect(lambda path: self.asked.emit(GoTo(path[:2], path)))
        self.show_value()

    def show_value(self) -> None:
        super().show_value()
        strip: TrialStrip | None = self.row.facts
        self.view.setVisible(strip is not None and self.view.parent() is not None)
        if strip is not None:
            self.view.show_strip(strip)


TRIAL: Final = SpecialEditor((("Block", "design"),), DesignField, wide=True, facts=trial_strip)
