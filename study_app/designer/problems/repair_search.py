"""The repairs of a study's problems: found one after the other, while the window goes on."""

from typing import Final

from PySide6.QtCore import QObject, QTimer, Signal

from study_app.designer.document.additions import additions_for
from study_app.designer.document.edited_study import Study
from study_app.designer.problems.problem_rows import ProblemRow
from study_app.designer.problems.repairs import Repair, repairs

REST_MS: Final = 500
"""So long after the last edit the search begins: each repair is tried on the whole study."""


class RepairSearch(QObject):
    """Finds the repairs of problems; ``found`` carries the problem and the words of its repairs."""

    found = Signal(object, object)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._study: Study | None = None
        self._waiting: list[ProblemRow] = []
        self._problems: tuple[ProblemRow, ...] = ()
        self._known: dict[ProblemRow, tuple[Repair, ...]] = {}
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.timeout.connect(self._find)

    def begin(self, study: Study, problems: tuple[ProblemRow, ...]) -> None:
        """Search for the repairs of a study's problems, anew where the study changed."""
        if study is self._study:
            return
        self._study, self._known, self._problems = study, {}, problems
        self._waiting = list(problems) if study.is_toml else []
        if self._waiting:
            self._timer.start(REST_MS)
        else:
            self._timer.stop()

    def repair(self, row: ProblemRow, words: str) -> Repair | None:
        """Return a repair by its words; one that was offered before the last edit is looked for at once."""
        self._look(row)
        return next((one for one in self._known.get(row, ()) if one.words == words), None)

    def show(self, row: ProblemRow) -> None:
        """Look for the repairs of a problem at once."""
        self._look(row)
        if row in self._known:
            self.found.emit(row, tuple(one.words for one in self._known[row]))

    def _look(self, row: ProblemRow) -> None:
        study = self._study
        if row in self._problems and row not in self._known and study is not None and study.is_toml:
            self._known[row] = (*repairs(study, row.fault), *additions_for(study, row.fault))

    def _find(self) -> None:
        if self._waiting:
            self.show(self._waiting.pop(0))
        if self._waiting:
            self._timer.start(0)
