"""Cards of measures with texts, numbers, bars and tables: their content, and the widgets that show it."""

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
"""The text of an unknown number."""
Verdict: TypeAlias = tuple[Tone, str, str]
"""Tone, icon and text."""
INKS: dict[Tone, Ink] = {"ok": "ok", "warn": "warn", "bad": "bad", "accent": "accent", "neutral": "text2"}
_NAME_PX = 132
_MAX_LINES = 7
FEW_CODES = 3


@dataclass(frozen=True, slots=True)
class Figures:
    """Numbers with their labels, side by side."""

    figures: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Segment:
    """A step of a session: label, share of the duration (0 to 1), whether it is selected, and path."""

    label: str
    share: float
    chosen: bool
    path: Path


@dataclass(frozen=True, slots=True)
class Segments:
    """The steps of a session in order, and the notes below them: left and right."""

    segments: tuple[Segment, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Line:
    """A line with a bar: title, number as text, length of the bar (0 to 1), and a verdict, shown if it has an icon."""

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
    """A table with the count of each code (column) in each place (row)."""

    name: str
    codes: tuple[str, ...]
    places: tuple[str, ...]
    counts: tuple[tuple[int, ...], ...]


Part: TypeAlias = Verdict | Figures | Segments | Lines | tuple[Table, ...] | str | None
"""A part of a card, one below the other; None is a rule."""


@dataclass(frozen=True, slots=True)
class MeasureCard:
    """A card: title, text to the right of it, parts, and whether the card takes two columns."""

    title: str
    aside: str = ""
    parts: tuple[Part, ...] = ()
    wide: bool = False


class _Strip(Themed, QWidget):
    """The steps of a session side by side, with widths in proportion to durations; a click opens a step."""

    def __init__(self, segments: tuple[Segment, ...], opens: Callable[[Path], None]) -> None:
        super().__init__()
        self.segments, self.opens = segments, opens
        self.setFixedHeight(14)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        listed = [segment.label for segment in segments]
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
    """Shows a card; ``opens`` is called with the path of a clicked step."""

    def __init__(self, shown: MeasureCard, opens: Callable[[Path], None]) -> None:
        self.aside = cut_text(shown.aside, "small", "text2", right=True)
        super().__init__(shown.title, self.aside, padding=16, gap=8)
        self.shown, self.opens = shown, opens
        self.setAccessibleName(shown.title)
        self.setSizePolicy(
            QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred
        )  # so that the columns are equally wide
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
        widget = QWidget()
        if isinstance(part, Figures):
            row = hbox(spacing=6, margins=0, parent=widget)
            for value, unit_text in part.figures:
                number = figures(value, "number")
                number.setAccessibleName(f"{value} {unit_text}")
                add_parts(row, number, (label(unit_text, "small", "text2"), 0, Qt.AlignmentFlag.AlignBottom), 8)
            row.addStretch()
        elif isinstance(part, Segments):
            notes = hbox(margins=0)
            for index, text in enumerate(part.notes):
                note = cut_text(text, "small", "text2")
                if index:
                    note.setAlignment(Qt.AlignmentFlag.AlignRight)
                notes.addWidget(note)
            vbox(_Strip(part.segments, self.opens), notes, spacing=8, margins=0, parent=widget)
        elif isinstance(part[0], Table):
            tables = (
                (_table_widget(table), 0, Qt.AlignmentFlag.AlignTop) for table in part if isinstance(table, Table)
            )
            hbox(*tables, STRETCH, spacing=18, margins=0, parent=widget)
        else:
            return _verdict_line(part)
        return widget


def _verdict_line(verdict: Verdict) -> QWidget:
    """Return a line with a verdict's icon and its wrapped text."""
    tone, icon, text = verdict
    widget = QWidget()
    icon_widget = (Icon(icon or "info", INKS[tone], 16), 0, Qt.AlignmentFlag.AlignTop)
    text_label = label(text, "small", "text" if tone != "neutral" else "text2", wraps=True)
    hbox(icon_widget, (text_label, 1), spacing=8, margins=0, parent=widget)
    return widget


def _table_widget(table: Table) -> QWidget:
    widget = QWidget()
    grid = grid_of(3, 3, margins=0, parent=widget)
    grid.addWidget(label(table.name, "small", "text2"), 0, 0, 1, len(table.codes) + 1)
    for across, code in enumerate(table.codes, start=1):
        grid.addWidget(label(code, "small", "text2"), 1, across, Qt.AlignmentFlag.AlignHCenter)
    for down, (place, counts) in enumerate(zip(table.places, table.counts, strict=True), start=2):
        grid.addWidget(label(place, "small", "text2"), down, 0)
        for across, (code, count) in enumerate(zip(table.codes, counts, strict=True), start=1):
            cell = _Cell(count, f"{code}, {table.name} {place}: {count} times")
            cell.setFixedSize(30 if len(table.codes) <= FEW_CODES else 24, 17)
            grid.addWidget(cell, down, across)
    return widget


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


def _lines_widget(lines_part: Lines) -> QWidget:
    widget = QWidget()
    grid = QGridLayout(widget)
    grid.setContentsMargins(0, 0, 0, 0)
    grid.setVerticalSpacing(4)
    grid.setColumnStretch(1, 1)
    for index, line in enumerate(lines_part.lines[:_MAX_LINES]):
        name, bar = Elided("label"), Bar(6)
        name.setFixedWidth(_NAME_PX)
        name.show_text(line.title)
        bar.show_share(line.share)
        number = figures(line.number)
        tone, icon, text = line.verdict
        number.setAccessibleName(f"{line.title}: {line.number}{f', {text}' if text else ''}")
        grid.addWidget(name, index, 0)
        grid.addWidget(bar, index, 1)
        grid.addWidget(number, index, 2, Qt.AlignmentFlag.AlignRight)
        if icon:
            verdict_icon = Icon(icon, INKS[tone], 16)
            verdict_icon.setToolTip(plain_tip(text))
            verdict_icon.setAccessibleName(f"{line.title}: {text}")
            grid.addWidget(verdict_icon, index, 3)
    if len(lines_part.lines) > _MAX_LINES:
        grid.addWidget(label(f"and {len(lines_part.lines) - _MAX_LINES} more", "small", "text2"), _MAX_LINES, 0, 1, 2)
    return widget


class CardGrid(Themed, QWidget):
    """Cards in two columns, or across both if wide; only changed cards are recreated.

    While the pointer is over them, no card becomes lower, so that the card under the pointer keeps its position.
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
        is_hovered = self.isVisible() and self.underMouse()
        heights = [(part.height(), part.accessibleName()) for part in self.parts] if is_hovered else []
        before, self.parts, self.cards = self.parts, [], cards
        for index, card in enumerate(cards):
            is_unchanged = index < len(before) and before[index].shown == card
            self.parts.append(before[index] if is_unchanged else _CardWidget(card, self.opens))
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
        for index, row in enumerate([*rows, pair]):
            self.grid.setRowStretch(index, 0)
            for column, part in enumerate(row):
                self.grid.addWidget(part, index, column, 1, 2 if part.shown.wide else 3 - len(row))
        self.grid.setRowStretch(len(rows) + 1, 1)
        for part, (height, title) in zip(self.parts, heights, strict=False):
            part.setMinimumHeight(height if title == part.accessibleName() else 0)

    def leaveEvent(self, event: QEvent) -> None:
        super().leaveEvent(event)
        self._release_heights()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self._release_heights()

    def _release_heights(self) -> None:
        for part in self.parts:
            part.setMinimumHeight(0)
