"""The cards of the tab Measures that hold words, numbers and bars."""

from collections.abc import Sequence

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QGridLayout, QSizePolicy, QWidget

from study_app.designer.measures.number_cards import (
    BalanceCard,
    BlocksCard,
    Line,
    LinesCard,
    NumberCard,
    Segment,
    SessionCard,
    TextsCard,
    Verdict,
)
from study_app.designer.outline.outline_rows import ElementPath
from study_app.gui.theme.theme import Tone, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox
from study_app.gui.widgets.cards import Bar, Card, Icon, Rule
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import Elided, Ink, figures, label, set_ink

INKS: dict[Tone, Ink] = {"ok": "ok", "warn": "warn", "bad": "bad", "accent": "accent", "neutral": "text2"}
NAME_PX = 132
MOST_LINES = 7
NARROW_CODES = 3


def verdict_line(verdict: Verdict) -> QWidget:
    """Return a state as icon and words that wrap."""
    tone, icon, words = verdict
    made = QWidget()
    sign = (Icon(icon or "info", INKS[tone], 16), 0, Qt.AlignmentFlag.AlignTop)
    said = label(words, "small", "text" if tone != "neutral" else "text2", wraps=True)
    hbox(sign, (said, 1), spacing=8, margins=0, parent=made)
    return made


class NumberPart(Card):
    """One number; grey while another one is computed."""

    def __init__(self) -> None:
        super().__init__(padding=14, gap=2)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.shown: tuple[NumberCard, str] | None = None
        self.title = Elided("small", "text2")
        self.number, self.unit = figures("", "number"), label("", "small", "text2")
        self.icon, self.note = Icon("info", "text2", 14), label("", "small", "text2", wraps=True)
        self.more = label("", "small", "text2", wraps=True)
        across = hbox(self.number, (self.unit, 0, Qt.AlignmentFlag.AlignBottom), STRETCH, spacing=6)
        below = hbox((self.icon, 0, Qt.AlignmentFlag.AlignTop), (self.note, 1), spacing=6)
        add_parts(self.column, self.title, across, below, self.more, STRETCH)

    def show_card(self, shown: NumberCard, waiting: str) -> None:
        """Show a number; ``waiting`` is said of one that is simulated."""
        waiting = waiting if shown.simulated else ""
        if (shown, waiting) == self.shown:
            return
        self.shown = (shown, waiting)
        self.title.show_text(shown.title)
        self.number.setText(shown.number)
        set_ink(self.number, "text3" if waiting else "text")
        self.unit.setText(shown.unit)
        note: Verdict = ("neutral", "clock", waiting)
        tone, icon, words = note if waiting else shown.note
        self.icon.show_icon(icon or "info", INKS[tone])
        self.note.setText(words)
        self.more.setText(shown.more)
        self.more.setVisible(bool(shown.more) and not waiting)
        also = f". {shown.more}" if self.more.isVisibleTo(self) else ""
        self.setAccessibleName(f"{shown.title}: {shown.number} {shown.unit}, {words}{also}")
        self._fit()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        margins = self.column.contentsMargins()
        room = self.width() - margins.left() - margins.right() - self.unit.sizeHint().width() - 6
        self.number.setFont(font("number", tabular=True))
        if self.number.sizeHint().width() > room:
            self.number.setFont(font("card", tabular=True))


class Strip(Themed, QWidget):
    """The steps of a session side by side, as wide as they are long; the one that is looked at in accent.

    ``open_asked`` carries the path of the step that is clicked.
    """

    open_asked = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.segments: tuple[Segment, ...] = ()
        self.setFixedHeight(14)
        self.setCursor(Qt.CursorShape.PointingHandCursor)

    def show_segments(self, segments: tuple[Segment, ...]) -> None:
        self.segments = segments
        listed = [words for words, *_ in segments]
        self.setAccessibleName("Session, in order: " + ", ".join(listed))
        self.setToolTip("\n".join((*listed, "Click a step to open it")))
        self.update()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() != Qt.MouseButton.LeftButton:
            return
        x = 0.0
        for _, share, _, path in self.segments:
            x += share * self.width()
            if event.position().x() < x:
                self.open_asked.emit(path)
                return

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter, x = QPainter(self), 0.0
        painter.setPen(Qt.PenStyle.NoPen)
        for _, share, chosen, _ in self.segments:
            width = share * self.width()
            painter.setBrush(QColor(self.theme.accent if chosen else self.theme.ctl))
            painter.setOpacity(1.0 if chosen else 0.45)
            painter.drawRect(QRectF(x, 0, max(1.0, width - 1.0), self.height()))
            x += width


class Made(Card):
    """A card whose content is made anew where it changes."""

    open_asked = Signal(object)
    wide = False
    """Whether it takes the width of two cards."""

    def __init__(self, title: str, aside: str = "") -> None:
        self.aside = Elided("small", "text2")
        self.aside.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.aside.show_text(aside)
        super().__init__(title, self.aside, padding=16, gap=8)
        self.buttons: list[ActionButton] = []
        self.setAccessibleName(title)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)  # columns are equally wide
        self.column.addStretch()
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

    def add(self, part: QWidget) -> None:
        """Add a part below the others."""
        self.column.insertWidget(self.column.count() - 1, part)

    def add_link(self, verdict: Verdict, action: str, path: ElementPath) -> None:
        """Add a state with a button that opens an element."""
        row = QWidget()
        made = ActionButton("", action, height=32)
        made.setProperty("dense", "true")
        made.setAccessibleName(f"{action}: {verdict[2]}")
        made.clicked.connect(lambda: self.open_asked.emit(path))
        hbox((verdict_line(verdict), 1, Qt.AlignmentFlag.AlignVCenter), made, margins=0, parent=row)
        self.buttons.append(made)
        self.add(row)


class SessionPart(Made):
    """A session in numbers."""

    def __init__(self, shown: SessionCard) -> None:
        super().__init__(shown.title, shown.aside)
        numbers = QWidget()
        row = hbox(spacing=6, margins=0, parent=numbers)
        for value, word in shown.figures:
            number = figures(value, "number")
            number.setAccessibleName(f"{value} {word}")
            add_parts(row, number, (label(word, "small", "text2"), 0, Qt.AlignmentFlag.AlignBottom), 8)
        row.addStretch()
        self.add(numbers)
        if shown.segments:
            self.strip = Strip()
            self.strip.open_asked.connect(self.open_asked)
            self.strip.show_segments(shown.segments)
            self.add(self.strip)
            notes = QWidget()
            line = hbox(margins=0, parent=notes)
            for at, words in enumerate(shown.notes):
                made = Elided("small", "text2")
                made.show_text(words)
                if at:
                    made.setAlignment(Qt.AlignmentFlag.AlignRight)
                line.addWidget(made)
            self.add(notes)
        if shown.verdicts:
            self.add(Rule())
        for verdict in shown.verdicts:
            self.add(verdict_line(verdict))


class BalancePart(Made):
    """How even the orders of a block are: two tables of counts."""

    def __init__(self, shown: BalanceCard) -> None:
        super().__init__("Balance", f"{shown.block}, {shown.people}")
        tables = QWidget()
        places = [str(number + 1) for number in range(len(shown.positions))]
        at = _table("position", shown.codes, places, shown.positions)
        after = _table("comes after", shown.codes, list(shown.codes), shown.follows)
        top = Qt.AlignmentFlag.AlignTop
        hbox((at, 0, top), (after, 0, top), STRETCH, spacing=18, margins=0, parent=tables)
        self.wide = len(shown.codes) > NARROW_CODES
        if shown.codes:
            self.add(tables)
        if shown.hidden:
            self.add(label(f"and {shown.hidden} more positions", "small", "text2"))
        self.add(verdict_line(shown.verdict))


def _table(name: str, codes: Sequence[str], places: Sequence[str], counts: Sequence[Sequence[int]]) -> QWidget:
    made = QWidget()
    grid = QGridLayout(made)
    grid.setContentsMargins(0, 0, 0, 0)
    grid.setSpacing(3)
    grid.addWidget(label(name, "small", "text2"), 0, 0, 1, len(codes) + 1)
    for across, code in enumerate(codes, start=1):
        grid.addWidget(label(code, "small", "text2"), 1, across, Qt.AlignmentFlag.AlignHCenter)
    for down, (place, line) in enumerate(zip(places, counts, strict=True), start=2):
        grid.addWidget(label(place, "small", "text2"), down, 0)
        for across, (code, count) in enumerate(zip(codes, line, strict=True), start=1):
            cell = _Cell(count, f"{code}, {name} {place}: {count} times")
            cell.setFixedSize(30 if len(codes) <= NARROW_CODES else 24, 17)
            grid.addWidget(cell, down, across)
    return made


class _Cell(Themed, QWidget):
    """A count on a coloured field."""

    def __init__(self, count: int, name: str) -> None:
        super().__init__()
        self._count = count
        self.setAccessibleName(name)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(self.theme.selected if self._count else self.theme.sunk))
        painter.drawRoundedRect(QRectF(self.rect()), 3, 3)
        painter.setPen(QColor(self.theme.accent if self._count else self.theme.text2))
        painter.setFont(font("small", weight=600, tabular=True))
        painter.drawText(QRectF(self.rect()), Qt.AlignmentFlag.AlignCenter, str(self._count))


class LinesPart(Made):
    """Lines with bars, and sentences below them."""

    def __init__(self, shown: LinesCard) -> None:
        super().__init__(shown.title, shown.waiting or shown.aside)
        if shown.lines:
            self.add(_lines(shown.lines, grey=bool(shown.waiting)))
        if shown.lines and shown.sentences:
            self.add(Rule())
        for verdict in shown.sentences:
            self.add(verdict_line(verdict))


def _lines(lines: Sequence[Line], *, grey: bool = False) -> QWidget:
    made = QWidget()
    grid = QGridLayout(made)
    grid.setContentsMargins(0, 0, 0, 0)
    grid.setVerticalSpacing(4)
    grid.setColumnStretch(1, 1)
    for at, line in enumerate(lines[:MOST_LINES]):
        name, bar = Elided("label", "text3" if grey else "text"), Bar(6)
        name.setFixedWidth(NAME_PX)
        name.show_text(line.title)
        bar.show_share(line.share)
        number = figures(line.number, ink="text3" if grey else "text")
        tone, icon, words = line.verdict
        number.setAccessibleName(f"{line.title}: {line.number}{f', {words}' if words else ''}")
        grid.addWidget(name, at, 0)
        grid.addWidget(bar, at, 1)
        grid.addWidget(number, at, 2, Qt.AlignmentFlag.AlignRight)
        if icon:
            mark = Icon(icon, INKS[tone], 16)
            mark.setToolTip(words)
            mark.setAccessibleName(f"{line.title}: {words}")
            grid.addWidget(mark, at, 3)
    if len(lines) > MOST_LINES:
        grid.addWidget(label(f"and {len(lines) - MOST_LINES} more", "small", "text2"), MOST_LINES, 0, 1, 2)
    return made


class TextsPart(Made):
    """Texts by language, and those that reveal a condition, each with a button that opens it."""

    def __init__(self, shown: TextsCard) -> None:
        super().__init__("Languages", "texts of the study")
        self.add(_lines(shown.languages))
        if shown.revealing:
            self.add(Rule())
        for words, path in shown.revealing[:MOST_LINES]:
            self.add_link(("warn", "warning", words), "Go there", path[:2])


class BlocksPart(Made):
    """The blocks that use an element, each with a button that opens it."""

    wide = True

    def __init__(self, shown: BlocksCard) -> None:
        super().__init__(shown.title)
        for words, path in shown.blocks:
            self.add_link(("neutral", "layers", words), "Open", path)


def part_of(card: object) -> Made:
    """Return the widget of a card."""
    if isinstance(card, SessionCard):
        return SessionPart(card)
    if isinstance(card, BalanceCard):
        return BalancePart(card)
    if isinstance(card, TextsCard):
        return TextsPart(card)
    if isinstance(card, BlocksCard):
        return BlocksPart(card)
    assert isinstance(card, LinesCard)  # noqa: S101 - the last kind
    return LinesPart(card)
