"""The problems of a study, as ``check`` prints them: the search for repairs, the list, and the repair buttons."""

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

from PySide6.QtCore import QEvent, QObject, Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent, QMouseEvent, QPaintEvent
from PySide6.QtWidgets import QScrollArea, QVBoxLayout, QWidget

from study_app.designer.document.additions import Repair, addition_repairs, repairs
from study_app.designer.document.elements import FIRST, STUDY_LANGUAGES, element_of, kind_and_title, place_text
from study_app.designer.document.fields import key_order, label_of
from study_app.designer.document.study import Study
from study_app.designer.outline import icon_of
from study_app.designer.parts import Segments, small_button
from study_app.gui.kit import command_tip, key_cap
from study_app.gui.theme import Coloured, Theme, font, replace_inside
from study_app.gui.widgets import (
    STRETCH,
    ActionButton,
    Card,
    Clamped,
    Elided,
    Icon,
    IconButton,
    PressedByEnter,
    Rule,
    add_parts,
    hbox,
    label,
    paint_ground,
    vbox,
)
from study_app.number_text import capitalised, counted
from study_app.protocol.source import Fault, Path, Places, names
from study_app.protocol.warnings import untranslated_texts
from study_app.protocol.wording import language_name

_STATED_PATH: Final = re.compile(r"([a-z]\w*(?:\.\w+)+): (.+)", re.DOTALL)
"""The path and the rest of a warning that begins with a path."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ProblemRow:
    """One problem."""

    fault: Fault
    element: Path  # the element whose form shows it; () if the file cannot be read
    # names of element and field ("Block Liquids, Order"), and the element's icon
    name: str
    icon: str
    message: str  # the sentence of ``check``
    hint: str
    line: int | None  # the line in the file, from 1
    warning: bool = False  # whether ``check`` reports it as a warning

    @property
    def identity(self) -> tuple[Path, str, bool]:
        """The values that do not change when lines are inserted above: path, message and kind."""
        return self.fault.path, self.message, self.warning

    @property
    def place(self) -> str:
        """Its path and line in the file, such as ``blocks.liquids.order · line 385``."""
        return place_text(self.fault.path, self.line)


def problem_rows(study: Study) -> tuple[ProblemRow, ...]:
    """Return the problems of a study outside unfinished entries, in the order of `fault_rows`.

    Several missing texts in a language are one problem, which opens the list of texts to write.
    """
    rows = [row for row in fault_rows(study) if not study.is_unfinished(row.fault)]
    missing = Counter(row.fault.missing_language for row in rows if row.fault.kind == "no text")
    copied = Counter(text.language for text in untranslated_texts(study.document))
    rows_shown: dict[object, ProblemRow] = {}
    for row in rows:
        code = row.fault.missing_language
        if row.fault.kind == "no text" and missing[code] > 1:
            message = f"{missing[code]} texts are missing in {language_name(code)}"
            if code in copied:
                message += f", and {counted(copied[code], 'copied text')} must be translated"
            fault, name = row.fault._replace(message=message, hint=""), f"Texts in {language_name(code)}"
            text_row = replace(
                row, element=STUDY_LANGUAGES, name=name, icon="list", message=message, hint="", fault=fault
            )
            rows_shown.setdefault(code, text_row)
        else:
            rows_shown[row] = row
    return tuple(rows_shown.values())


@lru_cache(maxsize=2)
def fault_rows(study: Study) -> tuple[ProblemRow, ...]:
    """Return a row for each fault of a study: elements in the order of the file, their fields in that of the form."""
    if not study.is_toml:
        return tuple(
            ProblemRow(
                fault=fault,
                element=(),
                name="The file",
                icon="file",
                message=problem.message,
                hint=problem.hint,
                line=problem.line,
            )
            for fault, problem in zip(study.faults, study.problems, strict=True)
        )
    places = Places.of(study.text)
    rows = [_problem_row(study, fault, places.line(fault.path)) for fault in study.faults]
    orders = {element: key_order(study.document, element) for element in {row.element for row in rows}}

    def field_order(row: ProblemRow) -> int:
        key = str(row.fault.path[len(row.element)]) if len(row.fault.path) > len(row.element) else ""
        return orders[row.element].get(key, -1)

    return tuple(sorted(rows, key=lambda row: (places.line(row.element) or 0, field_order(row), row.line or 0)))


def warning_rows(study: Study, sentences: Iterable[str]) -> tuple[ProblemRow, ...]:
    """Return a row for each warning of ``check``, in the same order, with the first element that it names."""
    places = Places.of(study.text) if study.is_toml else None
    rows = []
    for sentence in dict.fromkeys(sentences):
        path, text = _path_and_sentence(study, sentence)
        line = None if places is None else places.line(path)
        rows.append(replace(_problem_row(study, Fault(path, text), line), warning=True))
    return tuple(rows)


def _path_and_sentence(study: Study, sentence: str) -> tuple[Path, str]:
    """Return the path of a warning and its sentence: the path stated in it, or that of the first element it names."""
    if (stated := _STATED_PATH.match(sentence)) is not None:
        return tuple(int(step) - 1 if step.isdecimal() else step for step in stated[1].split(".")), stated[2]
    for word in re.findall(r"\w+", sentence):
        for section in ("liquids", "blocks"):
            if word in names(study.document, section):
                return (section, word), sentence
    return FIRST, sentence


def _problem_row(study: Study, fault: Fault, line: int | None) -> ProblemRow:
    element = element_of(study, fault.path)
    inside = fault.path[len(element) :]
    message = capitalised(fault.message)
    name = ", ".join((kind_and_title(study.document, element), *map(label_of, inside)))
    return ProblemRow(
        fault=fault,
        element=element,
        name=name,
        icon=icon_of(element, study.document),
        message=message,
        hint=fault.hint,
        line=line,
    )


_PAUSE_MS: Final = 500
"""Delay of the search after an edit, because each repair is tried on the whole study [ms]."""


class RepairSearch(QObject):
    """Searches for the repairs of problems; ``found`` carries a problem and the labels of its repairs."""

    found = Signal(object, object)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._study: Study | None = None
        self._waiting: list[ProblemRow] = []
        self._problems: tuple[ProblemRow, ...] = ()
        self._known: dict[ProblemRow, tuple[Repair, ...]] = {}
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.timeout.connect(self._search_next)

    def begin_search(self, study: Study, problems: tuple[ProblemRow, ...]) -> None:
        if study is self._study:
            return
        self._study, self._known, self._problems = study, {}, problems
        self._waiting = list(problems) if study.is_toml else []
        if self._waiting:
            self._timer.start(_PAUSE_MS)
        else:
            self._timer.stop()

    def find_repair(self, row: ProblemRow, sentence: str) -> Repair | None:
        """Return the repair of a problem with this label; if it is not known yet, it is searched for at once."""
        self._find_repairs(row)
        return next((repair for repair in self._known.get(row, ()) if repair.label == sentence), None)

    def show_repairs(self, row: ProblemRow) -> None:
        self._find_repairs(row)
        if row in self._known:
            self.found.emit(row, tuple(repair.label for repair in self._known[row]))

    def _find_repairs(self, row: ProblemRow) -> None:
        study = self._study
        if row in self._problems and row not in self._known and study is not None and study.is_toml:
            self._known[row] = (*repairs(study, row.fault), *addition_repairs(study, row.fault))

    def _search_next(self) -> None:
        if self._waiting:
            self.show_repairs(self._waiting.pop(0))
        if self._waiting:
            self._timer.start(0)


class RepairButton(ActionButton):
    """A button that repairs ``problem``; ``typed`` carries the key event of a letter, which the field should get."""

    typed = Signal(object)

    def __init__(self, problem: ProblemRow, sentence: str) -> None:
        super().__init__("", sentence, height=32)
        self.setProperty("dense", "true")
        self.setFont(font("label"))
        self.problem = problem
        self.show_repair(sentence)

    def show_repair(self, sentence: str) -> None:
        self.show_action("", sentence)
        self.setAccessibleName(f"{sentence}: {self.problem.name}")

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.text().strip() and event.text().isprintable():
            self.typed.emit(event)
        else:
            super().keyPressEvent(event)


MAX_LIST_PX, NARROW_BELOW = 290, 1000
HEAD_PX, ROW_PX, NAME_PX, NARROW_NAME_PX, REPAIR_PX, NARROW_REPAIR_PX = 92, 47, 300, 240, 190, 110


class ProblemLine(Coloured, QWidget):
    """One problem; ``opened`` is emitted when it is clicked, ``repair_asked`` carries the label of a repair."""

    opened = Signal()
    repair_asked = Signal(str)

    def __init__(self, row: ProblemRow, repairs: tuple[str, ...], *, narrow: bool) -> None:
        super().__init__()
        self.row = row
        self.here = False
        self.go = PressedByEnter()
        self.go.setProperty("role", "plain")
        self.go.setProperty("dense", "true")
        self.go.setFont(font("label"))
        self.go.clicked.connect(self.opened)
        self.go.setFixedSize(NARROW_NAME_PX if narrow else NAME_PX, 24)
        self._place = Elided("small", "text2")
        self._place.setFixedWidth(self.go.width())
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        icons = Icon("warning", "warn" if row.warning else "bad", 18), Icon(row.icon, "text2", 18)
        message_label, hint = Clamped(row.message, 2, "label", steady=False), Elided("small", "text2")
        buttons = QWidget()
        buttons.setMinimumWidth(NARROW_REPAIR_PX if narrow else REPAIR_PX)
        self._repairs = hbox(STRETCH, spacing=6, margins=0, parent=buttons)
        parts = (*icons, _column(self.go, self._place), (_column(message_label, hint), 1), buttons)
        hbox(*parts, spacing=10, margins=(10, 2, 6, 2), parent=self)
        self.repairs: list[RepairButton] = []
        self.show_repairs(repairs)
        self.go.setAccessibleName(f"{row.name}: {row.message}")
        elided = self.go.fontMetrics().elidedText(row.name, Qt.TextElideMode.ElideRight, self.go.width() - 4)
        self.go.setText(elided)
        self.show_row(row)
        hint.show_text(row.hint)
        hint.setVisible(bool(row.hint))
        self.setToolTip("\n".join(filter(None, (row.name, row.message, row.hint))))

    def show_row(self, row: ProblemRow) -> None:
        """Show the same problem with its new line in the file."""
        self.row = row
        self._place.show_text(row.place)

    def show_repairs(self, repairs: tuple[str, ...]) -> None:
        for button, sentence in zip(self.repairs, repairs, strict=False):
            button.show_repair(sentence)
        for sentence in repairs[len(self.repairs) : 2]:
            new_button = RepairButton(self.row, sentence)
            new_button.clicked.connect(lambda _checked=False, button=new_button: self.repair_asked.emit(button.text()))
            self._repairs.addWidget(new_button)
            new_button.show()  # at once: Tab skips widgets that a layout has not shown yet
            self.repairs.append(new_button)

    def apply_theme(self, theme: Theme) -> None:
        style = f"QPushButton {{ text-align: left; padding: 0; color: {theme.text}; }}"
        self.go.setStyleSheet(f"{style} QPushButton:disabled {{ color: {theme.text3}; }}")

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self.opened.emit()

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self.here:
            paint_ground(self, self.theme.selected)


def _column(*parts: QWidget) -> QVBoxLayout:
    """Return lines of text, vertically centred."""
    return vbox(STRETCH, *parts, STRETCH, spacing=0)


class ProblemsCard(Card):
    """The list of problems. Signals: ``opened`` (a `ProblemRow`), ``repair_asked`` (row, label), ``close_asked``."""

    opened = Signal(object)
    repair_asked = Signal(object, str)
    close_asked = Signal()

    def __init__(self) -> None:
        super().__init__(padding=16, gap=8)
        self.setAccessibleName("Problems")
        self.problems: tuple[ProblemRow, ...] = ()
        self._warnings: tuple[ProblemRow, ...] = ()
        self._had_rows = False
        self._repairing = False  # whether a pressed repair is being made
        self._repaired = False  # whether the last edit was a repair pressed here
        self.lines: list[ProblemLine] = []
        self._element: object = None
        self._here_only = False
        self._listed_rows: tuple[ProblemRow, ...] | None = None
        self.repairs: dict[ProblemRow, tuple[str, ...]] = {}
        self._current: ProblemRow | None = None
        self._number = 0
        self.heading = label("", "card")
        self.limit = Segments("Problems of")
        self.limit.chosen.connect(self._limit_to_element)
        self.next = small_button("", "Next", cap=key_cap("next problem"), height=36)
        self.next.setToolTip(command_tip("next problem"))
        self.close_button = IconButton("cross", "Close the list of problems", size=36, role="plain")
        titles = self.heading, label("also listed by liquid-study check", "small", "text2")
        top = hbox(*titles, STRETCH, self.limit, self.next, self.close_button, spacing=10)
        self.area = QScrollArea()
        self.area.setWidgetResizable(True)
        self.area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        add_parts(self.column, top, (self.area, 1))
        self.close_button.clicked.connect(self.close_asked)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Update the lines after a click beside them or on a solved problem."""
        self._repaired = False
        self._show_lines()
        super().mousePressEvent(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            self.close_asked.emit()
        else:
            super().keyPressEvent(event)

    def begin(self) -> None:
        """Reset the list for another study; it closes if that has no problems and warnings."""
        self._had_rows = bool(self.rows)
        self.problems = self._warnings = ()
        self.lines, self._listed_rows = [], None
        self._current, self._number = None, 0
        self.area.verticalScrollBar().setValue(0)

    def show_problems(self, rows: tuple[ProblemRow, ...], element: object) -> None:
        """Show problems, of which "Here only" shows those of ``element``; close when the last one is solved."""
        self._repaired = self._repairing or (self._repaired and rows == self.problems)
        had_problems, self.problems, self._element = bool(self.problems), rows, element
        rows_by_identity = {row.identity: row for row in rows}
        self.repairs = {
            rows_by_identity[row.identity]: sentences
            for row, sentences in self.repairs.items()
            if row.identity in rows_by_identity
        }
        self._show_lines(closes=had_problems)

    def show_warnings(self, rows: tuple[ProblemRow, ...]) -> None:
        """Show warnings; close when the last one is solved."""
        had_rows, self._had_rows, self._warnings = self._had_rows or bool(self.rows), False, rows
        self._show_lines(closes=had_rows)

    @property
    def rows(self) -> tuple[ProblemRow, ...]:
        return (*self.problems, *self._warnings)

    def _show_lines(self, *, closes: bool = False) -> None:
        rows = self.rows
        if self._current is not None:  # its line number may have changed
            self._current = next((row for row in rows if row.identity == self._current.identity), self._current)
        if closes and not rows and not self.keeps_lines_still:
            self.hide()
        counts = ((len(self.problems), "problem"), (len(self._warnings), "warning"))
        counted = [f"{count} {word}{'s' * (count != 1)}" for count, word in counts if count]
        self.heading.setText(", ".join(counted) or "No problems")
        self.limit.show_values(((False, "All"), (True, "Here only")), self._here_only)
        self.next.setEnabled(bool(rows))
        listed = tuple(row for row in rows if not self._here_only or row.element == self._element)
        needed_px = min(MAX_LIST_PX, HEAD_PX + (ROW_PX + 1) * max(1, len(listed)))
        self.setFixedHeight(max(needed_px, self.height()) if self.keeps_lines_still else needed_px)
        if listed == self._listed_rows:
            return
        if self.keeps_lines_still and self.lines:
            remaining = {row.identity: row for row in listed}
            for line in self.lines:
                row = remaining.get(line.row.identity)
                line.setEnabled(row is not None)
                if row is not None:
                    line.show_row(row)
            return
        self._listed_rows = listed
        inside = QWidget()
        self._column = column = vbox(spacing=0, margins=0, parent=inside)
        if rows and not listed:
            column.addWidget(
                label(f"This element does not have any problems; the other elements have {len(rows)}", "label", "text2")
            )
        column.addStretch()
        self.lines = []
        for row in listed:
            self._add_line(row)
        replace_inside(self.area, inside)

    def _add_line(self, row: ProblemRow) -> None:
        narrow = (self.parentWidget() or self).width() < NARROW_BELOW
        line = ProblemLine(row, self.repairs.get(row, ()), narrow=narrow)
        line.opened.connect(lambda: self.open_problem(line.row))
        line.repair_asked.connect(lambda sentence: self._ask_to_repair(line.row, sentence))
        line.here = row == self._current
        for part in (line, Rule()):
            self._column.insertWidget(self._column.count() - 1, part)
        self.lines.append(line)

    def _ask_to_repair(self, row: ProblemRow, sentence: str) -> None:
        self._repairing = True
        self.repair_asked.emit(row, sentence)
        self._repairing = False

    @property
    def keeps_lines_still(self) -> bool:
        """Whether lines keep their positions, so that a click on the next repair does not miss it."""
        return self._repaired and self.isVisible() and self.underMouse()

    def leaveEvent(self, event: QEvent) -> None:
        super().leaveEvent(event)
        self._repaired = False
        QTimer.singleShot(
            0, self, self._show_lines
        )  # Qt also reports this when the widget under the pointer is replaced
        if not self.rows:
            self.close_asked.emit()

    def show_repairs(self, row: ProblemRow, repairs: tuple[str, ...]) -> None:
        self.repairs[row] = repairs
        for line in self.lines:
            if line.row == row:
                line.show_repairs(repairs)

    @property
    def current(self) -> ProblemRow | None:
        """The problem that was opened last, until it is solved."""
        return self._current if self._current in self.rows else None

    @property
    def rows_after_current(self) -> tuple[ProblemRow, ...]:
        """All rows, beginning after the current one, or at its former position if it was solved."""
        index = self.rows.index(self._current) + 1 if self._current in self.rows else self._number
        index %= max(1, len(self.rows))
        return (*self.rows[index:], *self.rows[:index])

    def repairs_of(self, problem: ProblemRow) -> list[RepairButton]:
        return [button for line in self.lines for button in line.repairs if line.row == problem]

    def set_current(self, row: ProblemRow) -> None:
        """Make a problem the current one, after which `rows_after_current` begins."""
        if row in self.rows:
            self._current, self._number = row, self.rows.index(row)

    def open_problem(self, row: ProblemRow) -> None:
        self.set_current(row)
        self._repaired = False
        self._show_lines()
        for line in self.lines:
            line.here = line.row == row
            line.update()
            if line.here:
                self.area.ensureWidgetVisible(line)
        self.opened.emit(row)

    def _limit_to_element(self, here_only: object) -> None:
        self._here_only, self._listed_rows = bool(here_only), None
        self.lines = []
        self._show_lines()
