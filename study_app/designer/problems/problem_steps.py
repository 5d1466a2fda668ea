"""From problem to problem, and from each to its repairs."""

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtWidgets import QWidget

from study_app.designer.form.element_form import FormCard
from study_app.designer.place.file_editor import FileCard
from study_app.designer.place.focus_areas import FocusAreas
from study_app.designer.place.tab_order import lead_by_tab
from study_app.designer.problems.problem_rows import ProblemRow
from study_app.designer.problems.problems_card import ProblemsCard
from study_app.designer.problems.repair_button import RepairButton


class ProblemSteps(QObject):
    """Opens problems at their fields and offers their repairs, at the field and in the list.

    Signals: ``selected`` (path of an element), ``repair_asked`` (row, words), ``repairs_wanted`` (a row whose repairs
    are to be shown at once).
    """

    selected = Signal(object)
    repair_asked = Signal(object, str)
    repairs_wanted = Signal(object)

    def __init__(self, card: ProblemsCard, form: FormCard, file: FileCard, areas: FocusAreas) -> None:
        super().__init__(card)
        self._card, self._form, self._file, self._areas = card, form, file, areas
        self._problems: tuple[ProblemRow, ...] = ()
        self._of_other_study: tuple[ProblemRow, ...] = ()
        self._repairs: dict[ProblemRow, tuple[str, ...]] = {}
        self._opened_at: QWidget | None = None
        card.opened.connect(self._open)
        card.next.clicked.connect(self.open_next)
        for part in (card, form):
            part.repair_asked.connect(self._repair)

    def begin(self) -> None:
        """Begin with another study, whose problems and then warnings are shown next: without any the list closes."""
        self._of_other_study, self._problems = self._card.rows, ()
        self._card.begin()

    def show_problems(self, problems: tuple[ProblemRow, ...], element: object) -> None:
        """Show problems; ``element`` is the selected one. The list closes when the last problem is solved."""
        before, self._problems = self._problems, problems
        self._repairs = {row: words for row, words in self._repairs.items() if row in problems}
        self._form.show_repairs(self._repairs)
        self._card.show_problems(problems, element, self._repairs)
        if before and not self._card.rows and not self._card.under_pointer:
            self._card.hide()

    def show_warnings(self, warnings: tuple[ProblemRow, ...]) -> None:
        """Show other warnings; the list closes when the last one is solved."""
        before, self._of_other_study = self._of_other_study or self._card.rows, ()
        self._card.show_warnings(warnings)
        if before and not self._card.rows and not self._card.under_pointer:
            self._card.hide()

    def show_repairs(self, row: ProblemRow, words: tuple[str, ...]) -> None:
        """Offer the repairs of a problem."""
        self._repairs[row] = words
        self._form.show_repairs(self._repairs)
        self._card.show_repairs(row, words)
        self._lead_to_repairs()

    def open_next(self) -> None:
        """Go to the next problem."""
        if coming := self._card.coming:
            self._open_repair(coming[0])

    def _open_repair(self, row: ProblemRow) -> None:
        """Go to the repair of a problem; where there is none, to its field."""
        self._card.open(row)
        self.repairs_wanted.emit(row)
        for button in (self._form.repairs_of(row) or self._card.repairs_of(row))[:1]:
            button.setFocus(Qt.FocusReason.ShortcutFocusReason)
            for area in (self._form.area, self._card.area):
                if area.isAncestorOf(button):
                    area.ensureWidgetVisible(button, 0, 8)  # its field stays in sight

    def _can_be_repaired(self, row: ProblemRow) -> bool:
        self.repairs_wanted.emit(row)
        return bool(self._repairs.get(row))

    def _open(self, row: ProblemRow) -> None:
        """Go to the field of a problem; where there is none, to its line in the file."""
        self._card.show()
        if row.element:
            self.selected.emit(row.element)
        in_form = bool(row.element) and self._areas.focus_row(row.fault.path)
        if row.line is not None and not in_form and not row.warning:
            self._areas.show_tab("file")
        if row.line is not None:
            self._file.editor.go_to(row.line - 1)
        self._opened_at = self._card.window().focusWidget()
        self._lead_to_repairs()

    def _lead_to_repairs(self) -> None:
        """Let Tab go to the repairs of a problem from where it was opened."""
        here, row = self._card.window().focusWidget(), self._card.at
        if here is not None and here is self._opened_at and row is not None:
            lead_by_tab(here, self._form.repairs_of(row) or self._card.repairs_of(row))

    def _repair(self, row: ProblemRow, words: str) -> None:
        """Make a repair; a key leads to the next one, or from the last one to its field, where a click leads."""
        here = self._card.window().focusWidget()
        by_keys = isinstance(here, RepairButton) and here.by_keys and here.problem == row
        self._card.set_current(row)
        self.repair_asked.emit(row, words)
        if row in self._problems:
            return
        coming = [one for one in self._card.coming if not one.warning]
        if by_keys and coming:
            self._open_repair(next(filter(self._can_be_repaired, coming), coming[0]))
        else:
            self._areas.focus_field(row.fault.path)
