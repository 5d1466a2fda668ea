"""The questionnaire: all statements of a setting on one page, which can be answered by mouse, keyboard or touch."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeAlias

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFocusEvent, QFont, QFontMetricsF, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QHBoxLayout, QWidget

from study_app.gui.participant.forms.question_field import NO_WORDS, QuestionField, ScaleField
from study_app.gui.participant.forms.questions_page import QuestionsPage
from study_app.gui.participant.pages.page_widget import PageContext, font_scale, page_painter, page_scale
from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.gui.widgets.boxes import add_layout
from study_app.protocol.questions import ItemView
from study_app.protocol.wording import Words
from study_app.session.pages import QuestionnairePage

_LEAST_CELL = 44.0
_NARROW = 900.0
_FEW = 5  # maximum statements per page in a window that is too narrow for all
_NUMBER = 32.0
_AFTER_STATEMENT = 16.0
_CELL_GAP = 6.0
_POINTS = 7


@dataclass(frozen=True, slots=True, kw_only=True)
class TextWidths:
    """The widths of a questionnaire's texts at scale 1 [px].

    ``statement`` is the width of the longest statement on one line, ``judge`` that of the longest word in "cannot
    judge" (0 without it), and ``word`` that of the longest word in the scale's labels.
    """

    statement: float
    judge: float = 0.0
    word: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """The widths of a row's columns, from its number to "cannot judge" [logical px].

    ``scale`` applies to spaces, ``text`` to texts; ``judge_gap`` separates the scale and "cannot judge", whose width is
    0 without it; ``pitch`` is a row's height, 0 until it is known.
    """

    scale: float
    text: float
    tight: bool
    number_width: float
    statement_width: float
    cell_pitch: float
    judge_gap: float
    judge_width: float
    pitch: float = 0.0

    @property
    def cell_width(self) -> float:
        return self.cell_pitch - _CELL_GAP * self.scale

    @property
    def cell_height(self) -> float:
        return min(self.pitch - (4 if self.tight else 7) * self.scale, 50 * max(self.scale, 0.8 * self.text))

    @property
    def can_be_hit(self) -> bool:
        return min(self.cell_height, self.cell_width) >= _LEAST_CELL * self.scale - 0.01

    def divide_rows(self, room: float, per_page: int) -> Grid:
        """Return the sizes with ``room`` [px] divided among ``per_page`` rows."""
        return replace(self, pitch=math.floor(min(room / per_page, 68 * self.text)))


def _part_sizes(items: int, width: float) -> Iterator[int]:
    """Yield the numbers of statements per page to try: all, then those that divide the statements evenly."""
    if width >= _NARROW:
        yield items
    for most in range(min(_FEW, items), 0, -1):
        yield math.ceil(items / math.ceil(items / most))


def grid(width: float, height: float, texts: TextWidths, margin: float, *, text_scale: float = 1.0) -> Grid:
    """Return the column widths in a window, with ``margin`` between its edges and the text [logical px].

    Texts are enlarged by at least ``text_scale``. Rows may be too low for their texts or cells (see `Grid.can_be_hit`).
    """
    scale = page_scale(width, height)
    text = font_scale(width, height, text_scale)
    content = width - 2 * margin
    is_wide = content >= 1100
    judge = max((112 if is_wide else 92) * scale, texts.judge * text + 8 * scale) if texts.judge else 0.0
    gap = (42 if is_wide else 24) * scale if texts.judge else 0.0
    number_width, statement_gap = _NUMBER * text, _AFTER_STATEMENT * scale
    available = content - number_width - statement_gap - judge - gap
    statements = 400 * scale if text <= scale else 480 * text  # cells shrink before statements do
    narrowest = max(52 * scale, texts.word * text / 2 + 2)  # a label may be as wide as two columns
    fewest = min(max((available - statements) / _POINTS, narrowest), max(98 * scale, narrowest))
    pitch = min(max((available - texts.statement * text - 8) / _POINTS, fewest), 120 * max(scale, 0.8 * text))
    return Grid(
        scale=scale,
        text=text,
        tight=height < 740 * text,
        number_width=number_width,
        statement_width=available - _POINTS * pitch + _CELL_GAP * scale,
        cell_pitch=pitch,
        judge_gap=gap,
        judge_width=judge,
    )


_SHRINKING = (1.0, 0.94, 0.88, 0.82, 0.76)  # factors by which text is reduced if the window is too small
_WRAP_LEFT = int(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap)

_Fitted: TypeAlias = tuple[QFont, QFont, float, float]


@lru_cache(maxsize=256)
def _statement_height(text: str, scale: float, weight: int, width_px: int) -> float:
    """Return the height of a statement wrapped at a width [px]; cached, since pages recur."""
    room = QRectF(0, 0, width_px, 1e4)
    return QFontMetricsF(font("statement", scale=scale, weight=weight)).boundingRect(room, _WRAP_LEFT, text).height()


class StatementField(ScaleField):
    """A row with a statement and its cells; the labels are shown once, above the columns of all statements."""

    def __init__(
        self, view: ItemView, labels: tuple[str, ...], judge: str | None, wording: Words, parent: QWidget
    ) -> None:
        self.sizes: Grid | None = None
        super().__init__(view, wording, parent)
        self.build_options(labels, judge, NO_WORDS)
        self.statement.fill_row()
        self.cells, self.row = QHBoxLayout(), QHBoxLayout()
        mirrored = self.layoutDirection() == Qt.LayoutDirection.RightToLeft
        for point in reversed(self.points) if mirrored else self.points:  # a scale has the same order in every language
            self.cells.addWidget(point)
            if mirrored:
                point.setLayoutDirection(Qt.LayoutDirection.LeftToRight)
        add_layout(self.row, self.cells)
        if self.judge is not None:
            self.row.addWidget(self.judge)
        add_layout(self.grid, self.row, 0, self.ANSWER, Qt.AlignmentFlag.AlignVCenter)
        self.grid.setColumnStretch(self.ANSWER, 0)

    @property
    def note(self) -> str:
        """The note below the statement; if a missing one has the focus, with the keys that answer it."""
        if self.missing and self.hasFocus():
            return f"{self._words.please_answer} · {self._words.press_keys}"
        return super().note

    @property
    def columns(self) -> list[tuple[float, float]]:
        """The left edge and width of each cell in the row [px]."""
        return [(cell.x(), cell.width()) for cell in self.options]

    @property
    def rule(self) -> float | None:
        """The position of the rule between the scale and "cannot judge" [px]; None without that answer."""
        if self.judge is None:
            return None
        (first, _), (last, width), (left, judge_width) = (self.columns[place] for place in (0, -2, -1))
        return (left + judge_width + first) / 2 if left < first else (last + width + left) / 2

    def set_sizes(self, sizes: Grid) -> None:
        self.sizes, self.scale = sizes, sizes.scale
        margin = self.horizontal_margin
        self.grid.setContentsMargins(margin, 0, margin, 0)
        self.set_column_widths(sizes.number_width, _AFTER_STATEMENT * sizes.scale)
        width, height = math.floor(sizes.cell_width), math.floor(sizes.cell_height + 0.01)
        self.cells.setSpacing(round(_CELL_GAP * sizes.scale))
        for point in self.points:
            point.set_scale(sizes.text)
            point.setFixedSize(width, height)
        if self.judge is not None:
            self.judge.set_scale(sizes.text)
            self.judge.setFixedSize(math.floor(sizes.judge_width), height)
        self.row.setSpacing(round(sizes.judge_gap))
        self.setFixedHeight(math.floor(sizes.pitch))
        self._update_state()

    def fits(self, sizes: Grid, note: str) -> bool:
        """Return whether statement and ``note`` are legible in a row of these sizes."""
        return self.fitted_fonts(sizes, note) is not None

    def fitted_fonts(self, sizes: Grid, note: str) -> _Fitted | None:
        """Return the largest fonts with which statement and note fit the row, and their heights [px], or None.

        Text that has a required size (``sizes.text`` beyond ``sizes.scale``) is not reduced; a note may be.
        """
        is_required = sizes.text > sizes.scale
        factors = (
            ((1.0, 1.0), (1.0, sizes.scale / sizes.text)) if is_required else ((s, max(s, 0.88)) for s in _SHRINKING)
        )
        for shrink, note_shrink in factors:
            fitted = self._measure_fonts(sizes, note, shrink, note_shrink)
            if fitted[2] + fitted[3] <= sizes.pitch - 3 * sizes.scale:
                return fitted
        return None

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self._update_state()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self._update_state()

    def _smallest_fonts(self, sizes: Grid, note: str) -> _Fitted:
        """Return the fonts for a row that is too low even as the only one on its page."""
        for percent in range(95, 30, -5):
            fitted = self._measure_fonts(sizes, note, percent / 100, percent / 100)
            if fitted[2] + fitted[3] <= sizes.pitch - 3 * sizes.scale:
                break
        return fitted

    def _measure_fonts(self, sizes: Grid, note: str, shrink: float, note_shrink: float) -> _Fitted:
        weight = 500 if self.missing or self.hasFocus() else 400
        face = font("statement", scale=sizes.text * shrink, weight=weight)
        note_face = font("label", scale=sizes.text * note_shrink, weight=600)
        height = _statement_height(self.view.text, sizes.text * shrink, weight, math.floor(sizes.statement_width))
        metrics = QFontMetricsF(note_face)
        room = sizes.statement_width - _NOTE_SIGN * metrics.height() * self.missing
        lines = 0 if not note else 1 if metrics.horizontalAdvance(note) <= room else 2
        return face, note_face, height, lines * metrics.height()

    def _update_state(self) -> None:
        super()._update_state()
        if self.sizes is not None:
            face, note_face, *_ = self.fitted_fonts(self.sizes, self.note) or self._smallest_fonts(
                self.sizes, self.note
            )
            self.set_fonts(face, note_face, self.sizes.text)

    def _paint_ground(self, painter: QPainter) -> None:
        super()._paint_ground(painter)
        if self.rule is None or self.judge is None:
            return
        painter.setPen(QPen(QColor(PARTICIPANT.border), 1))
        x, half, middle = round(self.rule) + 0.5, self.judge.height() * 0.4, self.height() / 2
        painter.drawLine(QPointF(x, middle - half), QPointF(x, middle + half))


_NOTE_SIGN = 1.6  # width of a note's sign and its gap, in line heights of the note
_LABEL_WIDTH = 98.0  # width at which a label above a column wraps if there is space [px at scale 1]
_LABEL_WIDTHS = (1.0, 1.2, 1.4, 1.6, 1.8)


def _label_height(labels: tuple[str, ...], widest: float) -> float:
    """Return the height of labels at scale 1 wrapped at ``widest`` px [px]."""
    metrics = QFontMetricsF(font("label", weight=600))
    room = QRectF(0, 0, min(_LABEL_WIDTH, 0.95 * widest), 1e3)  # letter widths do not quite scale
    return max((metrics.boundingRect(room, _WRAP_LEFT, text).height() for text in labels), default=0.0)


def _widest_word(metrics: QFontMetricsF, text: str) -> float:
    """Return the width [px] of the widest word of a text, 0 without any."""
    return max((metrics.horizontalAdvance(word) for word in text.split()), default=0.0)


class _Heading(QWidget):
    """The labels above the columns: the ends, the middle, and the label of the column that is pointed at.

    ``row`` returns a displayed row, whose cells define the columns.
    """

    def __init__(
        self, labels: tuple[str, ...], judge: str | None, row: Callable[[], StatementField], parent: QWidget
    ) -> None:
        super().__init__(parent)
        self._labels = (*labels, judge) if judge is not None else labels
        self._fixed = {0, len(labels) // 2, len(labels) - 1, *({len(labels)} if judge is not None else ())}
        self._pointed = -1
        self._row = row
        self._sizes: Grid | None = None
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)

    @property
    def shown(self) -> tuple[str, ...]:
        """The labels that are visible now, from left to right."""
        return tuple(self._labels[column] for column in sorted(self.columns()))

    def set_sizes(self, sizes: Grid) -> None:
        self._sizes = sizes
        self.update()

    def show_pointed(self, column: int) -> None:
        """Show the label of ``column`` as well; -1 for none."""
        if column != self._pointed:
            self._pointed = column
            self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self._sizes is None:
            return
        painter = page_painter(self)
        painter.setFont(font("label", scale=self._sizes.text, weight=600))
        flags = int(Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignBottom | Qt.TextFlag.TextWordWrap)
        for column in self.columns():
            if column == self._pointed:
                ink = PARTICIPANT.accent
            else:
                ink = PARTICIPANT.text2 if column == _POINTS else PARTICIPANT.text
            painter.setPen(QColor(ink))
            painter.drawText(self.column_area(column), flags, self._labels[column])
        painter.end()

    def columns(self) -> set[int]:
        """Return the columns with a visible label; labels that would overlap the pointed one are hidden."""
        if self._pointed < 0:
            return self._fixed
        neighbours = {
            column
            for column in self._fixed
            if abs(column - self._pointed) == 1 and _POINTS not in (column, self._pointed)
        }
        if neighbours and self._sizes is not None:
            room = self._sizes.cell_pitch
            if not all(self._fits(column, room) for column in (*neighbours, self._pointed)):
                return (self._fixed - neighbours) | {self._pointed}
        return self._fixed | {self._pointed}

    def _fits(self, column: int, width: float) -> bool:
        """Return whether a label fits ``width`` [px] and the height of the heading."""
        assert self._sizes is not None  # noqa: S101  # called only after layout
        metrics = QFontMetricsF(font("label", scale=self._sizes.text, weight=600))
        bounds = metrics.boundingRect(QRectF(0, 0, width, 1e4), _WRAP_LEFT, self._labels[column])
        return bounds.width() <= width and bounds.height() <= self.height() + 1

    def _bounds(self, column: int) -> tuple[float, float]:
        """Return the left and right limits of a label [px]; labels of the scale end at the rule."""
        row = self._row()
        if row.rule is None or column == _POINTS:
            return 0.0, self.width()
        return (row.rule, self.width()) if row.columns[_POINTS] < row.columns[0] else (0.0, row.rule)

    def column_area(self, column: int) -> QRectF:
        """Return the area of a label: its column, extended on either side as needed, within the row."""
        assert self._sizes is not None  # noqa: S101  # called only after layout
        left, width = self._row().columns[column]
        pitch = min(self._sizes.cell_pitch, _LABEL_WIDTH * self._sizes.text) if column < _POINTS else width
        label_width = next((pitch * share for share in _LABEL_WIDTHS if self._fits(column, pitch * share)), 2 * pitch)
        low, high = self._bounds(column)
        middle = max(min(left + width / 2, high - label_width / 2), low + label_width / 2)
        return QRectF(middle - label_width / 2, 0, label_width, self.height())


class QuestionnaireWidget(QuestionsPage):
    """A page of statements that are rated on one scale, with the scale's labels above the columns."""

    fields: tuple[StatementField, ...]

    def __init__(self, page: QuestionnairePage, context: PageContext) -> None:
        super().__init__(page, context)
        self._heading = _Heading(page.labels, page.cannot_judge, self._visible_row, self)
        self.questions.insertWidget(0, self._heading)
        for field in self.fields:
            field.pointed_at.connect(self._heading.show_pointed)

    def make_field(self, item: ItemView) -> QuestionField:
        return StatementField(item, self._page.labels, self._page.cannot_judge, self._words, self)

    def missing_message(self, numbers: Sequence[int]) -> str:
        return self._words.missing(numbers)

    @property
    def heading(self) -> tuple[str, ...]:
        return self._heading.shown

    def arrange_parts(self, asked: Sequence[QuestionField]) -> list[list[QuestionField]]:
        """Set the rows' sizes, with as many legible and clickable statements per part as possible."""
        sizes, per_page = self._sizes()
        self._heading.set_sizes(sizes)
        for field in self.fields:
            field.set_sizes(sizes)
        return [list(asked[first : first + per_page]) for first in range(0, len(asked), per_page)]

    def lead_height(self) -> int:
        """Return the height above the statements [px]; a few statements start at a third of the page's height."""
        room = self.room_height(tabs=False)
        needed = self._heading.height() + sum(field.minimumHeight() for field in self.fields)
        is_short = len(self.parts) == 1 and 2 * needed <= room
        return max(0, self.foot.height() + room - 2 * self.height() // 3) if is_short else 0

    def _visible_row(self) -> StatementField:
        part = self.part
        return next((field for field in self.fields if field in part), self.fields[0])

    def _sizes(self) -> tuple[Grid, int]:
        """Return the sizes of the rows, and the number of rows per part."""
        page, count = self._page, len(self.fields)
        metrics, label_metrics = QFontMetricsF(font("statement")), QFontMetricsF(font("label", weight=600))
        judge_labels = () if page.cannot_judge is None else (page.cannot_judge,)
        texts = TextWidths(
            statement=max(metrics.horizontalAdvance(field.view.text) for field in self.fields),
            judge=_widest_word(label_metrics, page.cannot_judge or ""),
            word=max(_widest_word(label_metrics, text) for text in page.labels),
        )
        columns = grid(self.width(), self.height(), texts, self.margin, text_scale=self._text_scale)
        text, scale, tight = columns.text, columns.scale, columns.tight
        named, judged = 2 * columns.cell_pitch / text, columns.judge_width / text
        labels = max(_label_height(page.labels, named), _label_height(judge_labels, judged)) * text * 1.03
        self._heading.setFixedHeight(round(labels + (2 if tight else 10) * scale))
        note = self._words.please_answer
        for per_page in _part_sizes(count, self.width()):
            room = self.room_height(tabs=per_page < count) - self._heading.height()
            sizes = columns.divide_rows(room - (2 if tight else 8) * scale, per_page)
            if sizes.can_be_hit and all(field.fits(sizes, note) for field in self.fields):
                break
        return sizes, per_page
