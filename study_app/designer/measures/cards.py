"""Cards of measures: words, numbers, bars and tables, as values and as the widgets that show them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, TypeAlias

from PySide6.QtCore import QEvent, QRectF, Qt
from PySide6.QtGui import QColor, QHideEvent, QMouseEvent, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QGridLayout, QSizePolicy, QWidget

from study_app.designer.parts import cut_text
from study_app.gui.theme import Themed, Tone, font, remove_widget
from study_app.gui.widgets import (
    STRETCH,
    Bar,
    Card,
    Elided,
    Icon,
    Ink,
    Rule,
    add_parts,
    figures,
    fill_rounded,
    hbox,
    label,
    plain_tip,
    smooth_painter,
    vbox,
)
from study_app.gui.widgets import grid as grid_of
from study_app.protocol.source import Path

UNKNOWN: Final = "–"
"""Stands for a number that is not known."""
Verdict: TypeAlias = tuple[Tone, str, str]
"""Tone, icon and words."""
INKS: dict[Tone, Ink] = {"ok": "ok", "warn": "warn", "bad": "bad", "accent": "accent", "neutral": "text2"}
_NAME_PX = 132
_MOST_LINES = 7
NARROW_CODES = 3


@dataclass(frozen=True, slots=True)
class Figures:
    """Numbers with their words, side by side."""

    figures: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Segment:
    """A step of a session: its words, its share of the time, whether it is looked at, and the element."""

    words: str
    share: float
    chosen: bool
    path: Path


@dataclass(frozen=True, slots=True)
class Segments:
    """The steps of a session in order, and what is written below them: left and right."""

    segments: tuple[Segment, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Line:
    """A line with a bar: its title, its number in words, its share (0 to 1), and its verdict where it has an icon."""

    title: str
    number: str
    share: float
    verdict: Verdict = ("neutral", "", "")


@dataclass(frozen=True, slots=True)
class Lines:
    """Lines with bars."""

    lines: tuple[Line, ...]


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of counts: how often each code is at a place."""

    name: str
    codes: tuple[str, ...]
    places: tuple[str, ...]
    counts: tuple[tuple[int, ...], ...]


Part: TypeAlias = Verdict | Figures | Segments | Lines | tuple[Table, ...] | str | None
"""What is on a card, one below the other; None is a rule."""


@dataclass(frozen=True, slots=True)
class MeasureCard:
    """A card: title, what stands at its right, parts, and whether it is as wide as two."""

    title: str
    aside: str = ""
    parts: tuple[Part, ...] = ()
    wide: bool = False


class _Strip(Themed, QWidget):
    """The steps of a session side by side, as wide as they are long; a click opens one."""

    def __init__(self, segments: tuple[Segment, ...], opens: Callable[[Path], None]) -> None:
        super().__init__()
        self.segments, self.opens = segments, opens
        self.setFixedHeight(14)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        listed = [segment.words for segment in segments]
        self.setAccessibleName("Session order: " + ", ".join(listed))
        self.setToolTip(plain_tip("\n".join((*listed, "Click a step to open it"))))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() != Qt.MouseButton.LeftButton:
            return
        x = 0.0
        for segment in self.segments:
            x += segment.share * self.width()
            if event.position().x() < x:
                self.opens(segment.path)
                return

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter, x = QPainter(self), 0.0
        painter.setPen(Qt.PenStyle.NoPen)
        for segment in self.segments:
            width = segment.share * self.width()
            painter.setBrush(QColor(self.theme.accent if segment.chosen else self.theme.ctl))
            painter.setOpacity(1.0 if segment.chosen else 0.45)
            painter.drawRect(QRectF(x, 0, max(1.0, width - 1.0), self.height()))
            x += width


class _CardWidget(Card):
    """Shows a card; ``opens`` is called with the path of an element whose step is clicked."""

    def __init__(self, shown: MeasureCard, opens: Callable[[Path], None]) -> None:
        self.aside = cut_text(shown.aside, "small", "text2", right=True)
        super().__init__(shown.title, self.aside, padding=16, gap=8)
        self.shown, self.opens = shown, opens
        self.setAccessibleName(shown.title)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)  # columns are equally wide
        add_parts(self.column, *map(self._part_widget, shown.parts), STRETCH)
        self._beside = True

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        margins = self.column.contentsMargins()
        needed = self.heading.sizeHint().width() + self.aside.sizeHint().width() + 2 * self.title_row.spacing()
        beside = needed <= self.width() - margins.left() - margins.right()
        if beside != self._beside:
            self._beside = beside
            side = Qt.AlignmentFlag.AlignRight if beside else Qt.AlignmentFlag.AlignLeft
            self.aside.setAlignment(side | Qt.AlignmentFlag.AlignVCenter)
            if beside:
                self.title_row.addWidget(self.aside)
            else:
                self.column.insertWidget(1, self.aside)

    def _part_widget(self, part: Part) -> QWidget:
        if part is None:
            return Rule()
        if isinstance(part, str):
            return label(part, "small", "text2")
        if isinstance(part, Lines):
            return _lines_widget(part)
        made = QWidget()
        if isinstance(part, Figures):
            row = hbox(spacing=6, margins=0, parent=made)
            for value, word in part.figures:
                number = figures(value, "number")
                number.setAccessibleName(f"{value} {word}")
                add_parts(row, number, (label(word, "small", "text2"), 0, Qt.AlignmentFlag.AlignBottom), 8)
            row.addStretch()
        elif isinstance(part, Segments):
            notes = hbox(margins=0)
            for at, text in enumerate(part.notes):
                note = cut_text(text, "small", "text2")
                if at:
                    note.setAlignment(Qt.AlignmentFlag.AlignRight)
                notes.addWidget(note)
            vbox(_Strip(part.segments, self.opens), notes, spacing=8, margins=0, parent=made)
        elif isinstance(part[0], Table):
            tables = (
                (_table_widget(table), 0, Qt.AlignmentFlag.AlignTop) for table in part if isinstance(table, Table)
            )
            hbox(*tables, STRETCH, spacing=18, margins=0, parent=made)
        else:
            return _verdict_line(part)
        return made


def _verdict_line(verdict: Verdict) -> QWidget:
    """Return a line with a verdict's icon and its wrapped text."""
    tone, icon, text = verdict
    made = QWidget()
    sign = (Icon(icon or "info", INKS[tone], 16), 0, Qt.AlignmentFlag.AlignTop)
    said = label(text, "small", "text" if tone != "neutral" else "text2", wraps=True)
    hbox(sign, (said, 1), spacing=8, margins=0, parent=made)
    return made


def _table_widget(table: Table) -> QWidget:
    made = QWidget()
    grid = grid_of(3, 3, margins=0, parent=made)
    grid.addWidget(label(table.name, "small", "text2"), 0, 0, 1, len(table.codes) + 1)
    for across, code in enumerate(table.codes, start=1):
        grid.addWidget(label(code, "small", "text2"), 1, across, Qt.AlignmentFlag.AlignHCenter)
    for down, (place, line) in enumerate(zip(table.places, table.counts, strict=True), start=2):
        grid.addWidget(label(place, "small", "text2"), down, 0)
        for across, (code, count) in enumerate(zip(table.codes, line, strict=True), start=1):
            cell = _Cell(count, f"{code}, {table.name} {place}: {count} times")
            cell.setFixedSize(30 if len(table.codes) <= NARROW_CODES else 24, 17)
            grid.addWidget(cell, down, across)
    return made


class _Cell(Themed, QWidget):
    """A count on a coloured field."""

    def __init__(self, count: int, name: str) -> None:
        super().__init__()
        self._count = count
        self.setAccessibleName(name)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = smooth_painter(self)
        fill_rounded(painter, QRectF(self.rect()), 3, self.theme.selected if self._count else self.theme.sunk)
        painter.setPen(QColor(self.theme.accent if self._count else self.theme.text2))
        painter.setFont(font("small", weight=600, tabular=True))
        painter.drawText(QRectF(self.rect()), Qt.AlignmentFlag.AlignCenter, str(self._count))


def _lines_widget(shown: Lines) -> QWidget:
    made = QWidget()
    grid = QGridLayout(made)
    grid.setContentsMargins(0, 0, 0, 0)
    grid.setVerticalSpacing(4)
    grid.setColumnStretch(1, 1)
    for at, line in enumerate(shown.lines[:_MOST_LINES]):
        name, bar = Elided("label"), Bar(6)
        name.setFixedWidth(_NAME_PX)
        name.show_text(line.title)
        bar.show_share(line.share)
        number = figures(line.number)
        tone, icon, text = line.verdict
        number.setAccessibleName(f"{line.title}: {line.number}{f', {text}' if text else ''}")
        grid.addWidget(name, at, 0)
        grid.addWidget(bar, at, 1)
        grid.addWidget(number, at, 2, Qt.AlignmentFlag.AlignRight)
        if icon:
            mark = Icon(icon, INKS[tone], 16)
            mark.setToolTip(plain_tip(text))
            mark.setAccessibleName(f"{line.title}: {text}")
            grid.addWidget(mark, at, 3)
    if len(shown.lines) > _MOST_LINES:
        grid.addWidget(label(f"and {len(shown.lines) - _MOST_LINES} more", "small", "text2"), _MOST_LINES, 0, 1, 2)
    return made


class CardGrid(Themed, QWidget):
    """Cards in two columns, wide ones across both; only those that changed are made anew.

    While the pointer is over them, none becomes lower: what is pointed at stays where it is.
    """

    def __init__(self, opens: Callable[[Path], None]) -> None:
        super().__init__()
        self.opens = opens
        self.cards: tuple[MeasureCard, ...] = ()
        self.parts: list[_CardWidget] = []
        self.grid = grid_of(8, 8, margins=0, parent=self)
        for column in range(2):
            self.grid.setColumnStretch(column, 1)

    def show_cards(self, cards: tuple[MeasureCard, ...]) -> None:
        if cards == self.cards:
            return
        pointed = self.isVisible() and self.underMouse()
        heights = [(part.height(), part.accessibleName()) for part in self.parts] if pointed else []
        before, self.parts, self.cards = self.parts, [], cards
        for at, card in enumerate(cards):
            kept = at < len(before) and before[at].shown == card
            self.parts.append(before[at] if kept else _CardWidget(card, self.opens))
        for part in before:
            self.grid.removeWidget(part)
            if part not in self.parts:
                remove_widget(part)
        rows: list[list[_CardWidget]] = []
        pair: list[_CardWidget] = []
        for part in self.parts:
            pair += [] if part.shown.wide else [part]
            if part.shown.wide or len(pair) == 2:
                rows.append([part] if part.shown.wide else pair)
                pair = pair if part.shown.wide else []
        for at, line in enumerate([*rows, pair]):
            self.grid.setRowStretch(at, 0)
            for column, part in enumerate(line):
                self.grid.addWidget(part, at, column, 1, 2 if part.shown.wide else 3 - len(line))
        self.grid.setRowStretch(len(rows) + 1, 1)
        for part, (height, title) in zip(self.parts, heights, strict=False):
            part.setMinimumHeight(height if title == part.accessibleName() else 0)

    def leaveEvent(self, event: QEvent) -> None:
        super().leaveEvent(event)
        self._let_shrink()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self._let_shrink()

    def _let_shrink(self) -> None:
        for part in self.parts:
            part.setMinimumHeight(0)
