"""The right column: what a tick of the felt setting costs, how far it is from its reference, which limiter acts."""

from typing import Literal

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QGridLayout, QLabel, QStackedLayout, QVBoxLayout, QWidget

from study_app.gui.lab.parameter_form import HIDDEN
from study_app.gui.theme.theme import RADIUS_CONTROL, font
from study_app.gui.theme.themed import Themed, apply_theme_within
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Bar, Card, Icon, Rule
from study_app.gui.widgets.labels import Elided, figures, label, set_ink
from study_app.gui.widgets.masked_panel import MaskedPanel
from study_app.lab.limiters import Limiter
from study_app.viewmodels.lab import CostRow, ErrorRow, LabView
from study_app.viewmodels.number_words import grouped

NAME_WIDTH = 84
LINE = 26
COST_HEIGHT, ERROR_HEIGHT = 252, 3 * LINE + 6  # of what is usual, kept free until it is measured
UNKNOWN = "–"
LEAST_NS = 1.0  # the smallest cost that a measurement next to a running servo resolves
LimiterState = Literal["acting", "acted", "quiet"]


class ReadingCard(Card):
    """A card whose content is hidden, in the same place, while the comparison is blind."""

    def __init__(self, title: str, aside: QLabel, why: str) -> None:
        super().__init__(title, aside, padding=15, gap=6)
        self.aside = aside
        self._shown = QWidget()
        self.content = vbox(spacing=4, margins=0, parent=self._shown)
        self.stack = QStackedLayout()
        self.stack.addWidget(self._shown)
        self.stack.addWidget(MaskedPanel(HIDDEN, why))
        add_layout(self.column, self.stack, 1)

    def show_blind(self, blind: bool) -> bool:
        """Show the content, or that it is hidden; return which.

        Hidden content stays as it was before: its size would tell when another setting is felt.
        """
        self.stack.setCurrentIndex(int(blind))
        self.aside.setVisible(not blind)
        return blind


class CostLine(QWidget):
    """An effect, a bar as long as its share of the most expensive, and its ns."""

    def __init__(self) -> None:
        super().__init__()
        self.name = Elided("label")
        self.name.setFixedWidth(NAME_WIDTH)
        self.bar = Bar()
        self.ns = figures("", "label")
        self.ns.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.ns.setMinimumWidth(56)
        hbox(self.name, (self.bar, 1), self.ns, spacing=10, margins=0, parent=self)
        self.setFixedHeight(LINE)

    def show_cost(self, cost: CostRow, most_ns: float) -> None:
        ns = cost.ns or 0.0
        self.name.show_text(cost.effect)
        self.bar.show_share(ns / most_ns if most_ns > 0 else 0.0)
        words = f"{ns:.0f} ns" if ns >= LEAST_NS else f"< {LEAST_NS:g} ns"
        self.ns.setText(words)
        self.setAccessibleName(f"{cost.effect}: {words}")

    def show_waiting(self) -> None:
        self.bar.show_share(0.0)
        self.ns.setText(UNKNOWN)
        self.setAccessibleName(f"{self.name.accessibleName()}: measuring")


class AbsentLine(QWidget):
    """An effect that takes nothing, and why."""

    def __init__(self) -> None:
        super().__init__()
        self.name = label("", "label", "text2")
        self.why = Elided("small", "text2")
        self.why.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        hbox(Icon("minus", "text3", 14), self.name, (self.why, 1), spacing=8, margins=0, parent=self)
        self.setFixedHeight(LINE - 3)

    def show_cost(self, cost: CostRow) -> None:
        self.name.setText(cost.effect)
        self.why.show_text(cost.why)


class CostCard(ReadingCard):
    """What each effect takes of a tick."""

    def __init__(self) -> None:
        super().__init__("Cost per tick", label("", "small", "text2"), "Costs would reveal which is which.")
        self.lines: list[CostLine] = []
        self.absent: list[AbsentLine] = []
        self._costs = vbox(spacing=0)
        self._absent = vbox(spacing=0)
        self.sum_name = label("Sum", "label")
        self.sum_name.setFont(font("label", weight=600))
        self.sum = figures("", "label")
        self.sum.setFont(font("label", weight=600, tabular=True))
        self.sum.setAlignment(Qt.AlignmentFlag.AlignRight)
        whole = hbox(self.sum_name, (self.sum, 1))
        add_parts(self.content, self._costs, Rule(), whole, self._absent, STRETCH)
        self.stack.widget(1).setMinimumHeight(COST_HEIGHT)  # of the hidden page: the lines may need more

    def show_view(self, view: LabView) -> None:
        if self.show_blind(view.workbench.blind):
            return
        self.aside.setText(_aside(view))
        if view.measuring and not view.cost and self.lines:
            self._wait()
            return
        here = [row for row in view.cost if row.ns is not None]
        away = [row for row in view.cost if row.ns is None]
        most_ns = max((row.ns or 0.0 for row in here), default=0.0)
        _fit(self.lines, len(here), CostLine, self._costs, self)
        _fit(self.absent, len(away), AbsentLine, self._absent, self)
        for line, row in zip(self.lines, here, strict=True):
            line.show_cost(row, most_ns)
        for gone, row in zip(self.absent, away, strict=True):
            gone.show_cost(row)
        tick_ns = view.tick_ns if view.tick_ns is not None else sum(row.ns or 0.0 for row in here)
        period_ms = 1000 / view.workbench.in_hand.scene.rate_hz
        self.sum.setText(f"{grouped(round(tick_ns))} ns of {period_ms:g} ms" if view.cost else "not measured yet")

    def _wait(self) -> None:
        """Take the numbers away and leave the lines, so that nothing below jumps while a slider is dragged."""
        for line in self.lines:
            line.show_waiting()
        self.sum.setText(UNKNOWN)


class ErrorCard(ReadingCard):
    """How far the felt setting is from its reference."""

    def __init__(self) -> None:
        why = "Errors would reveal which is which."
        super().__init__("Error against the reference", label("", "small", "text2"), why)
        self._grid = QGridLayout()
        self._grid.setColumnStretch(0, 1)
        self._grid.setVerticalSpacing(2)
        self.lines: list[tuple[Elided, QLabel]] = []
        add_parts(self.content, self._grid, STRETCH)
        self.stack.widget(0).setMinimumHeight(ERROR_HEIGHT)

    def show_view(self, view: LabView) -> None:
        if self.show_blind(view.workbench.blind):
            return
        rows = view.errors or (ErrorRow("Not measured yet", ""),)
        if view.measuring and not view.errors and self.lines and self.lines[0][1].text():
            for name, value in self.lines:
                value.setText(UNKNOWN if name.isVisibleTo(self) else "")
            return
        while len(self.lines) < len(rows):
            name, value = Elided("label", "text2"), figures("", "label")
            value.setFont(font("label", weight=600, tabular=True))
            name.setFixedHeight(LINE)
            self._grid.addWidget(name, len(self.lines), 0)
            self._grid.addWidget(value, len(self.lines), 1, Qt.AlignmentFlag.AlignRight)
            self.lines.append((name, value))
        for number, (name, value) in enumerate(self.lines):
            shown = number < len(rows)
            name.setVisible(shown)
            value.setVisible(shown)
            if shown:
                name.show_text(rows[number].measure)
                value.setText(rows[number].value)
                value.setToolTip(rows[number].note)


class LimiterLine(Themed, QWidget):
    """A limiter: a mark, its name, and in how many ticks it acted; tinted while it acts."""

    def __init__(self) -> None:
        super().__init__()
        self._state: LimiterState = "quiet"
        self.name = Elided("label")
        self.word = label("", "small", "warn")
        self.count = figures("0", "label", "text2")
        self.count.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.count.setMinimumWidth(40)
        hbox((self.name, 1), self.word, self.count, spacing=6, margins=(34, 0, 10, 0), parent=self)
        self.setFixedHeight(LINE + 2)

    def show_limiter(self, limiter: Limiter) -> None:
        state: LimiterState = "acting" if limiter.acting else "acted" if limiter.ticks else "quiet"
        self.name.show_text(limiter.name)
        self.count.setText(grouped(limiter.ticks))
        if state != self._state:
            self._state = state
            self.word.setText({"acting": "acting now", "acted": "acted", "quiet": ""}[state])
            set_ink(self.count, "text2" if state == "quiet" else "warn")
            weight = 600 if state == "acting" else None
            self.name.setFont(font("label", weight=weight))
            self.count.setFont(font("label", weight=weight, tabular=True))
            self.update()
        self.setAccessibleName(f"{limiter.name}: {self.word.text() or 'did not act'}, {limiter.ticks} ticks")

    def paintEvent(self, _event: QPaintEvent) -> None:
        t = self.theme
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if self._state == "acting":
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(t.warn_bg))
            painter.drawRoundedRect(QRectF(self.rect()), RADIUS_CONTROL, RADIUS_CONTROL)
        mark = QRectF(12, self.height() / 2 - 6, 12, 12)
        ink = QColor(t.text3 if self._state == "quiet" else t.warn)
        painter.setPen(ink)
        painter.setBrush(ink if self._state == "acting" else Qt.BrushStyle.NoBrush)
        painter.drawEllipse(mark)
        if self._state == "acted":
            painter.setBrush(ink)
            painter.drawChord(mark, 90 * 16, 180 * 16)


class LimiterCard(ReadingCard):
    """Which limiter acts, and in how many ticks of the last ten seconds each did."""

    def __init__(self) -> None:
        why = "Limiters would reveal which is which."
        super().__init__("Limiters", label("ticks, last 10 s", "small", "text2"), why)
        self.lines: list[LimiterLine] = []
        self._lines = vbox(spacing=0, margins=(-8, 0, -8, 0))
        add_parts(self.content, self._lines, STRETCH)

    def show_view(self, view: LabView) -> None:
        if self.show_blind(view.workbench.blind):
            return
        _fit(self.lines, len(view.limiters), LimiterLine, self._lines, self)
        for line, limiter in zip(self.lines, view.limiters, strict=True):
            line.show_limiter(limiter)


def _aside(view: LabView) -> str:
    if view.measuring:
        return f"{view.felt}, measuring …"
    return f"{view.felt}, measured" if view.cost else ""


def _fit(lines: list, count: int, kind: type, layout: QVBoxLayout, whole: ReadingCard) -> None:
    """Have so many lines of a kind in a layout."""
    while len(lines) > count:
        gone = lines.pop()
        layout.removeWidget(gone)
        gone.hide()
        gone.deleteLater()
    while len(lines) < count:
        line = kind()
        layout.addWidget(line)
        lines.append(line)
        apply_theme_within(line, whole.theme)
