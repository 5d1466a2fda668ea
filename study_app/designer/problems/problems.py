"""The problems of a study, as ``check`` prints them, each with its element, field and repairs."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

from PySide6.QtCore import QObject, QTimer, Signal

from study_app.designer.document.additions import Repair, additions_for, repairs
from study_app.designer.document.elements import FIRST, element_of, kind_and_title, place_words
from study_app.designer.document.fields import label_of
from study_app.designer.document.study import Study
from study_app.designer.outline.outline_rows import icon_of
from study_app.protocol.source.document import Path, names, places_of
from study_app.protocol.source.problems import Fault

_PLACE: Final = re.compile(r"([a-z]\w*(?:\.\w+)+): (.+)", re.DOTALL)
"""The place in the file that a warning begins with."""
_NUMBERS: Final = re.compile(r"[-\u2212]?\d+(?:[.,\u2009]\d+)*")


@dataclass(frozen=True, slots=True)
class ProblemRow:
    """One problem."""

    fault: Fault  # what is wrong, by path
    element: Path  # the element whose form shows it; () where the file cannot be read
    # what element and field are called ("Block Liquids, Order"), and the name of the element's icon
    name: str
    icon: str
    # the sentence of ``check``, and its hint
    message: str
    hint: str
    line: int | None  # the line in the file, from 1
    warning: bool = False  # whether ``check`` only warns of it

    @property
    def place(self) -> str:
        """Its place in the file, such as ``blocks.liquids.order · line 385``."""
        return place_words(self.fault.path, self.line)

    @property
    def kind(self) -> tuple[bool, Path, str]:
        """What stays the same while the numbers in its sentence change, and what helps."""
        return self.warning, self.fault.path, _NUMBERS.sub("", self.message.split(": ")[0])


def followed(before: Sequence[ProblemRow], now: Iterable[ProblemRow]) -> list[ProblemRow | None]:
    """Return what each problem is now: of the same words, else the same but for its numbers; None: it is solved."""
    rest, found = list(now), dict[int, ProblemRow]()
    for exact in (True, False):
        for at, row in enumerate(before):
            same = (one for one in rest if one.kind == row.kind and (one.message == row.message or not exact))
            if at not in found and (match := next(same, None)) is not None:
                found[at] = match
                rest.remove(match)
    return [found.get(at) for at in range(len(before))]


@lru_cache(maxsize=2)
def problem_rows(study: Study) -> tuple[ProblemRow, ...]:
    """Return the problems of a study, in the order of their lines."""
    if not study.is_toml:
        return tuple(
            ProblemRow(fault, (), "The file", "file", problem.message, problem.hint, problem.line)
            for fault, problem in zip(study.faults, study.problems, strict=True)
        )
    places = places_of(study.text)
    found = [_row(study, fault, places.line(fault.path)) for fault in study.faults]
    return tuple(sorted(found, key=lambda row: row.line or 0))


def warning_rows(study: Study, sentences: Iterable[str]) -> tuple[ProblemRow, ...]:
    """Return the warnings of ``check``, in its order, each with the element that it names first."""
    places = places_of(study.text) if study.is_toml else None
    found = []
    for sentence in dict.fromkeys(sentences):
        path, words = _placed(study, sentence)
        line = None if places is None else places.line(path)
        found.append(replace(_row(study, Fault(path, words), line), warning=True))
    return tuple(found)


def _placed(study: Study, sentence: str) -> tuple[Path, str]:
    """Return the place of a warning, and what it says of it."""
    if (stated := _PLACE.match(sentence)) is not None:
        return tuple(int(step) - 1 if step.isdecimal() else step for step in stated[1].split(".")), stated[2]
    for word in re.findall(r"\w+", sentence):
        for section in ("liquids", "blocks"):
            if word in names(study.document, section):
                return (section, word), sentence
    return FIRST, sentence


def _row(study: Study, fault: Fault, line: int | None) -> ProblemRow:
    element = element_of(study, fault.path)
    inside = fault.path[len(element) :]
    message = f"{fault.message[:1].upper()}{fault.message[1:]}"
    name = ", ".join((kind_and_title(study.document, element), *map(label_of, inside)))
    return ProblemRow(fault, element, name, icon_of(element, study.document), message, fault.hint, line)


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
