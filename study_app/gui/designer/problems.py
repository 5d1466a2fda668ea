"""The list of problems: where each is, the sentence of ``check``, its line, and its repairs."""

from __future__ import annotations

from collections.abc import Mapping

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtGui import QMouseEvent, QPaintEvent
from PySide6.QtWidgets import QHBoxLayout, QScrollArea, QVBoxLayout, QWidget

from study_app.gui.designer.repair_button import RepairButton
from study_app.gui.designer.segments import Segments
from study_app.gui.designer.tab_order import lead_by_tab
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import Themed, apply_theme_within, replace_inside
from study_app.gui.widgets.cards import Card, Icon, Rule, paint_ground
from study_app.gui.widgets.controls import ActionButton, IconButton, PressedByEnter
from study_app.gui.widgets.labels import Clamped, Elided, figures, label
from study_app.viewmodels.designer.keys import key_cap, tip
from study_app.viewmodels.designer.problem_rows import ProblemRow

HIGHEST, NARROW_BELOW = 290, 1000
HEAD_PX, ROW_PX, LINE_PX, REPAIR_PX, NARROW_REPAIR_PX = 92, 39, 56, 190, 110


class ProblemLine(Themed, QWidget):
    """One problem; ``opened`` when it is clicked, ``repair_asked`` with the words of a repair."""

    opened = Signal()
    repair_asked = Signal(str)

    def __init__(self, row: ProblemRow, repairs: tuple[str, ...], *, narrow: bool) -> None:
        super().__init__()
        self.row = row
        self.here = False
        self.go = PressedByEnter(row.title)
        self.go.setProperty("role", "plain")
        self.go.setProperty("dense", "true")
        self.go.setFont(font("label"))
        where = f"{row.title}, {row.field}" if row.field else row.title
        self.go.setAccessibleName(f"{where}: {row.message}")
        self.go.clicked.connect(self.opened)
        self.go.setFixedWidth(130 if narrow else 150)
        self.go.setStyleSheet("text-align: left; padding-left: 0;")
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        across = QHBoxLayout(self)
        across.setContentsMargins(10, 2, 6, 2)
        across.setSpacing(10)
        across.addWidget(Icon("warning", "bad", 18))
        across.addWidget(Icon(row.icon, "text2", 18))
        across.addWidget(self.go)
        field = Elided("label", "text2")
        field.show_text(row.field)
        field.setFixedWidth(90 if narrow else 130)
        across.addWidget(field)
        words = row.message if narrow or not row.hint else f"{row.message}  ({row.hint})"
        said = Clamped(words, 2, "label")
        self.setToolTip(f"{row.message}  ({row.hint})" if row.hint else row.message)
        said.setAlignment(Qt.AlignmentFlag.AlignVCenter)
        line = figures("" if row.line is None else f"line {row.line}", "small", "text2")
        line.setFixedWidth(LINE_PX)
        across.addWidget(line)  # before the sentence: repairs of different widths would shift it
        across.addWidget(said, 1)
        buttons = QWidget()
        buttons.setMinimumWidth(NARROW_REPAIR_PX if narrow else REPAIR_PX)
        self._repairs = QHBoxLayout(buttons)
        self._repairs.setContentsMargins(0, 0, 0, 0)
        self._repairs.setSpacing(6)
        self._repairs.addStretch()
        across.addWidget(buttons)
        self.repairs: list[RepairButton] = []
        self.setMinimumHeight(ROW_PX)
        self.show_repairs(repairs)

    def show_repairs(self, repairs: tuple[str, ...]) -> None:
        """Offer repairs, two at most."""
        for words in repairs[len(self.repairs) : 2]:
            made = RepairButton(self.row, words, f"{self.row.title}, {self.row.field}")
            made.clicked.connect(lambda _checked=False, words=words: self.repair_asked.emit(words))
            apply_theme_within(made, self.theme)
            self._repairs.addWidget(made)
            made.show()  # at once: Tab passes what a layout is still to show
            self.repairs.append(made)
        lead_by_tab(self.go, self.repairs)

    def mousePressEvent(self, event: QMouseEvent) -> None:  # noqa: N802 - Qt's name
        """Open the problem."""
        if event.button() == Qt.MouseButton.LeftButton:
            self.opened.emit()

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Tint the one that one is at."""
        if self.here:
            paint_ground(self, self.theme.selected)


class ProblemsCard(Card):
    """Signals: ``opened`` (a `ProblemRow`), ``repair_asked`` (row, words), ``close_asked``."""

    opened = Signal(object)
    repair_asked = Signal(object, str)
    close_asked = Signal()

    def __init__(self) -> None:
        super().__init__(padding=16, gap=8)
        self.setAccessibleName("Problems")
        self.rows: tuple[ProblemRow, ...] = ()
        self.lines: list[ProblemLine] = []
        self._element: object = None
        self._here_only = False
        self._listed: tuple[ProblemRow, ...] | None = None
        self._repairs: dict[ProblemRow, tuple[str, ...]] = {}
        self.at: ProblemRow | None = None
        self._number = 0
        self.heading = label("", "card")
        self.limit = Segments("Problems of")
        self.limit.chosen.connect(self._limit)
        self.next = ActionButton("", "Next", cap=key_cap("next problem"), height=36)
        self.next.setToolTip(tip("next problem"))
        self.next.setProperty("dense", "true")
        self.close_button = IconButton("cross", "Close the list of problems", size=36, role="plain")
        top = QHBoxLayout()
        top.setSpacing(10)
        top.addWidget(self.heading)
        top.addWidget(label("the same as liquid-study check prints", "small", "text2"))
        top.addStretch()
        for part in (self.limit, self.next, self.close_button):
            top.addWidget(part)
        self.column.addLayout(top)
        self.area = QScrollArea()
        self.area.setWidgetResizable(True)
        self.area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.column.addWidget(self.area, 1)
        self.next.clicked.connect(self.open_next)
        self.close_button.clicked.connect(self.close_asked)

    def show_problems(
        self, rows: tuple[ProblemRow, ...], element: object, repairs: Mapping[ProblemRow, tuple[str, ...]]
    ) -> None:
        """Show problems; ``element`` is the selected one."""
        self.rows, self._element, self._repairs = rows, element, dict(repairs)
        self.heading.setText(f"{len(rows)} problem{'s' * (len(rows) != 1)}" if rows else "No problems")
        self.limit.show_values(((False, "All"), (True, "Here only")), self._here_only)
        self.next.setEnabled(bool(rows))
        wanted = min(HIGHEST, HEAD_PX + (ROW_PX + 1) * max(1, len(rows)))
        self.setFixedHeight(max(wanted, self.height()) if self.under_pointer else wanted)
        listed = tuple(row for row in rows if not self._here_only or row.element == element)
        if listed == self._listed:
            return
        self._listed = listed
        inside = QWidget()
        column = QVBoxLayout(inside)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        self.lines = []
        for row in listed:
            made = ProblemLine(row, repairs.get(row, ()), narrow=(self.parentWidget() or self).width() < NARROW_BELOW)
            made.opened.connect(lambda row=row: self._open(row))
            made.repair_asked.connect(lambda words, row=row: self.repair_asked.emit(row, words))
            made.here = row == self.at
            column.addWidget(made)
            column.addWidget(Rule())
            self.lines.append(made)
        column.addStretch()
        apply_theme_within(inside, self.theme)
        replace_inside(self.area, inside)

    @property
    def under_pointer(self) -> bool:
        """Whether the pointer is over the list: it keeps its height then, else a click would hit what is below."""
        return self.isVisible() and self.underMouse()

    def leaveEvent(self, event: QEvent) -> None:  # noqa: N802 - Qt's name
        """Take the height that the problems need; without any the list is closed."""
        super().leaveEvent(event)
        self.show_problems(self.rows, self._element, self._repairs)
        if not self.rows:
            self.close_asked.emit()

    def show_repairs(self, row: ProblemRow, repairs: tuple[str, ...]) -> None:
        """Offer the repairs of a problem."""
        self._repairs[row] = repairs
        for line in self.lines:
            if line.row == row:
                line.show_repairs(repairs)

    def open_next(self) -> None:
        """Go to the next problem: where the last one is solved, to the one that took its place in the list."""
        if self.rows:
            at = self.rows.index(self.at) + 1 if self.at in self.rows else self._number
            self._open(self.rows[at % len(self.rows)])

    def repairs_of(self, problem: ProblemRow) -> list[RepairButton]:
        """Return the buttons that repair a problem."""
        return [button for line in self.lines for button in line.repairs if line.row == problem]

    def set_current(self, row: ProblemRow) -> None:
        """Take a problem as the one that one is at; `open_next` goes on from there."""
        if row in self.rows:
            self.at, self._number = row, self.rows.index(row)

    def _open(self, row: ProblemRow) -> None:
        self.set_current(row)
        for line in self.lines:
            line.here = line.row == row
            line.update()
            if line.here:
                self.area.ensureWidgetVisible(line)
        self.opened.emit(row)

    def _limit(self, here_only: object) -> None:
        self._here_only = bool(here_only)
        self.show_problems(self.rows, self._element, self._repairs)
