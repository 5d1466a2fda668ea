"""Editors of what is decided about the main blocks together: their order, and hypotheses as sentences with choices."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QBoxLayout, QWidget

from study_app.designer.document.elements import title_of
from study_app.designer.document.fields import Row
from study_app.designer.document.steps import AddEntry, RemoveKey, Request, SetValue, Several
from study_app.designer.document.study import Study
from study_app.designer.form.fields import ChoiceField, Field, SpecialEditor, add_button, kept, written
from study_app.designer.form.rows import FormRow
from study_app.designer.form.typed_fields import FIELD_PX, TypedLine
from study_app.designer.measures.study_facts import valid_part
from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import add_layout, hbox, vbox
from study_app.gui.widgets.controls import Choice, IconButton
from study_app.gui.widgets.labels import label
from study_app.number_text import capitalised, number_of
from study_app.protocol.model import OF_LEVELS
from study_app.protocol.orders.balance import block_order_words
from study_app.protocol.source.document import entries, names


def order_of_blocks(study: Study, _row: Row) -> str:
    """Return what the order of the blocks means for the planned participants; "" while that is not known."""
    protocol = valid_part(study).protocol
    if protocol is None or len(protocol.main_blocks) < 2:
        return ""
    return f"{capitalised(block_order_words(protocol).partition(': ')[2])}."


class BlockOrderField(ChoiceField):
    """Fixed, balanced or random, and below it what the planned participants get."""

    def __init__(self, row: FormRow) -> None:
        self.said = label("", "small", "text2", wraps=True)
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.box.setSpacing(2)
        self.box.addWidget(self.said)
        self.show_value()

    def show_value(self) -> None:
        super().show_value()
        self.said.setText(self.row.facts)
        self.said.setVisible(bool(self.row.facts) and self.box.indexOf(self.said) >= 0)


BLOCK_ORDER: Final = SpecialEditor((("StudyHead", "block_order"),), BlockOrderField, facts=order_of_blocks)

MEASURES: Final = tuple(zip(OF_LEVELS, ("Threshold", "Exponent", "Sensitivity d′", "Setting (PSE)"), strict=True))
RELATIONS: Final = (
    ("higher", "is higher than"), ("lower", "is lower than"), (None, "is different from"), ("equal", "is equal to"),
)  # fmt: skip
BOUND, RATIO = 0.5, 1.25
NOTHING_TO_COMPARE: Final = "It compares two main blocks, two conditions of a block, or two groups: add a second one."


@dataclass(frozen=True, slots=True)
class Compared:
    """A block, or a condition or group in a block, with the measures that it has, each with its words."""

    key: str  # the key of the file that names it
    block: str
    name: str
    words: str
    measures: tuple[tuple[str, str], ...]

    def others(self, every: tuple["Compared", ...]) -> tuple["Compared", ...]:
        """Return what it can be compared with: other blocks with a measure of its own, or what is in the same block."""
        alike = (one for one in every if one.key == self.key and one.name != self.name)
        return tuple(one for one in alike if self.shared(one) and (self.key == "blocks" or one.block == self.block))

    def shared(self, other: "Compared") -> tuple[tuple[str, str], ...]:
        """Return the measures that both have."""
        return tuple(one for one in self.measures if one in other.measures)


def compared(study: Study, _row: Row) -> tuple[Compared, ...]:
    """Return what hypotheses can compare, in the order of the file; blocks of one title are told apart by their ids."""
    every = tuple(_compared(study.document))
    times = Counter(one.words for one in every)
    every = tuple(replace(one, words=f"{one.words} ({one.block})") if times[one.words] > 1 else one for one in every)
    return tuple(one for one in every if one.others(every))


def _compared(document: Mapping[str, Any]) -> Iterator[Compared]:
    for place, block in entries(document, "blocks.*"):
        if not isinstance(block, Mapping) or block.get("phase", "main") != "main":
            continue
        name, title, measures = str(place[1]), title_of(document, place), MEASURES
        if "design" not in block:
            asked = entries(document, f"questionnaires.{block.get('questionnaire')}.items.*")
            items = ((item, path) for path, item in asked if isinstance(item, Mapping) and "kind" not in item)
            measures = tuple((str(item.get("id")), title_of(document, path)) for item, path in items)
        if not measures:
            continue
        yield Compared("blocks", name, name, title, measures)
        conditions = block.get("conditions") if "design" not in block else ()
        for key, inner in (("conditions", conditions), ("groups", names(document, "groups"))):
            for one in inner if isinstance(inner, tuple | list) else ():
                words = f"{title_of(document, (key, str(one)))} in {title}"
                yield Compared(key, name, str(one), words, measures)


class Hypothesis(QWidget):
    """One hypothesis; ``changed`` carries its table as it is chosen."""

    changed = Signal(object)
    refused = Signal(str)  # why the bound that was typed is none; "" where it is one

    def __init__(self, name: str) -> None:
        super().__init__()
        self.measures = MEASURES
        self.known: tuple[Compared, ...] = ()
        self.others: tuple[Compared, ...] = ()
        self.value: Mapping[str, Any] = {}
        boxes = self.measure, self.first, self.relation, self.second = [Choice() for _ in range(4)]
        for box, part in zip(boxes, ("measure", "of what", "relation", "than what"), strict=True):
            box.setAccessibleName(f"{name}, {part}")
            box.setProperty("dense", "true")
            box.setFont(font("label", weight=400))
            box.setFixedHeight(FIELD_PX)
            box.setSizeAdjustPolicy(Choice.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
            box.setMinimumContentsLength(6)
            box.activated.connect(self._take)
        self.within = label("within", "label")
        self.bound = TypedLine(f"{name}, largest difference that would not matter")
        self.bound.setFixedWidth(64)
        self.bound.typed.connect(self._take_bound)
        self.away = IconButton("cross", f"Remove {name}", size=FIELD_PX, role="plain")
        above = hbox((self.measure, 2), label("of", "label"), (self.first, 3), self.away, spacing=8)
        below = hbox((self.relation, 2), (self.second, 3), self.within, self.bound, spacing=8)
        below.addSpacing(FIELD_PX + 8)
        vbox(above, below, spacing=4, margins=(0, 0, 0, 6), parent=self)

    def show_value(self, value: Mapping[str, Any], known: tuple[Compared, ...]) -> None:
        self.value, self.known = value, known
        key = next((key for key in ("conditions", "groups") if value.get(key)), "blocks")
        listed = (value.get(one) for one in ("blocks", key))
        blocks, named = (tuple(map(str, one)) if isinstance(one, tuple) else () for one in listed)
        at = [(key, name if key == "blocks" else next(iter(blocks), ""), name) for name in named]
        found = [next((one for one in known if (one.key, one.block, one.name) == place), None) for place in at]
        first, second = (*found, None, None)[:2]
        self.others = () if first is None else first.others(known)
        self.measures = MEASURES if first is None else first.measures if second is None else first.shared(second)
        measure, relation = value.get("measure", "threshold"), _relation(value)
        one, two = (*named, "", "")[:2]
        for box, word in ((self.measure, measure), (self.first, one), (self.second, two)):
            box.setPlaceholderText(str(word))  # shown where it is not among the choices
        self._fill(self.measure, self.measures, measure)
        self._fill(self.relation, RELATIONS, relation)
        self._fill(self.first, tuple((one, one.words) for one in known), first)
        self._fill(self.second, tuple((one, one.words) for one in self.others), second)
        self.bound.show_text("" if (bound := value.get("bound")) is None else written(bound))
        for part in (self.within, self.bound):
            part.setVisible(bound is not None)

    @staticmethod
    def _fill(box: Choice, values: tuple[tuple[Any, str], ...], chosen: Any) -> None:
        words = [word for _, word in values]
        if words != [box.itemText(at) for at in range(box.count())]:
            box.clear()
            box.addItems(words)
        box.setCurrentIndex(next((at for at, (value, _) in enumerate(values) if value == chosen), -1))

    def _take(self) -> None:
        """Say the hypothesis as it is chosen; what does not fit the first of the two any more is chosen anew."""
        relation = RELATIONS[max(0, self.relation.currentIndex())][0]
        if not self.known or self.first.currentIndex() < 0:  # what it compares is not among the choices
            keys = ("measure", "blocks", "conditions", "groups")
            table = {key: self.value[key] for key in keys if key in self.value}
            self.changed.emit(table | _related(relation, self._bound(relation, str(self.value.get("measure")))))
            return
        first, others, at = self.known[self.first.currentIndex()], self.others, self.second.currentIndex()
        fitting = first.others(self.known)
        second = others[at] if 0 <= at < len(others) and others[at] in fitting else fitting[0]
        chosen, shared = self.measures[max(0, self.measure.currentIndex())], first.shared(second)
        measure = (chosen if chosen in shared else shared[0])[0]
        self.changed.emit(_table(first, second, measure) | _related(relation, self._bound(relation, measure)))

    def _bound(self, relation: Any, measure: str) -> Any:
        """Return the bound that stays, the usual one of a new equality, or None."""
        before = self.value.get("bound")
        if relation == "equal" and before is None:
            return RATIO if measure in {"threshold", "pse"} else BOUND
        return before if relation == "equal" or _relation(self.value) != "equal" else None

    def _take_bound(self, text: str) -> None:
        bound = number_of(text)
        self.refused.emit("" if bound is not None else f"“{text}” is not a number. {kept(self.value.get('bound'))}")
        if bound is not None:
            self.changed.emit({**self.value, "bound": bound})


def _related(relation: Any, bound: Any) -> dict[str, Any]:
    """Return the keys of a hypothesis that say its relation."""
    table = {} if relation in {None, "equal"} else {"expected": relation}
    return table if bound is None else {**table, "bound": bound}


def _table(first: Compared, second: Compared, measure: str) -> dict[str, Any]:
    """Return the keys of a hypothesis that say what it compares."""
    pair = [first.name, second.name]
    table: dict[str, Any] = {"measure": measure, "blocks": pair if first.key == "blocks" else [first.block]}
    return table if first.key == "blocks" else {**table, first.key: pair}


def _relation(value: Mapping[str, Any]) -> Any:
    return value.get("expected", None if value.get("bound") is None else "equal")


class HypothesesField(Field):
    """A sentence with choices for each hypothesis."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.lines = [Hypothesis(f"Hypothesis {at + 1}") for at in range(count_of(row))]
        for at, line in enumerate(self.lines):
            line.changed.connect(lambda value, at=at: self._change(at, value))
            line.refused.connect(self._refuse)
            line.away.clicked.connect(lambda _on=False, at=at: self._remove(at))
            self.box.addWidget(line)
        self.add, self.why = add_button("Add a hypothesis", "Hypothesis"), label("", "small", "text2", wraps=True)
        self.add.clicked.connect(self._add)
        add_layout(self.box, hbox(self.add, (self.why, 1), spacing=8))
        self.setFocusProxy(self.lines[-1].measure if self.lines else self.add)
        self.show_value()

    def show_value(self) -> None:
        for line, value in zip(self.lines, self.row.row.value if self.lines else (), strict=False):
            line.show_value(value if isinstance(value, Mapping) else {}, self.row.facts)
        self.add.setEnabled(bool(self.row.facts))
        self.why.setText("" if self.row.facts else NOTHING_TO_COMPARE)

    def _add(self) -> None:
        first: Compared = self.row.facts[0]
        second = first.others(self.row.facts)[0]
        value = _table(first, second, first.shared(second)[0][0]) | _related(RELATIONS[0][0], None)
        self.asked.emit(AddEntry(self.row.row.path, value))

    def _refuse(self, why: str) -> None:
        if why != self.refusal:
            self.refusal = why
            self.came.emit()

    def _remove(self, at: int) -> None:
        path = self.row.row.path
        self.asked.emit(RemoveKey(path if len(self.lines) == 1 else (*path, at)))

    def _change(self, at: int, value: Mapping[str, Any]) -> None:
        path, before = (*self.row.row.path, at), self.row.row.value[at]
        if not isinstance(before, Mapping):
            self.asked.emit(SetValue(path, value))
            return
        asked: list[Request] = [
            SetValue((*path, key), one)
            for key, one in value.items()
            if (tuple(one) if isinstance(one, list) else one) != before.get(key)
        ]
        asked += [RemoveKey((*path, key)) for key in before if key not in value]
        if asked:
            self.asked.emit(Several("Change hypothesis", tuple(asked)))


def count_of(row: FormRow) -> int:
    """Return how many hypotheses a row has; 0 where the file has something else there."""
    return len(row.row.value) if isinstance(row.row.value, tuple) else 0


HYPOTHESES: Final = SpecialEditor(
    (("Analysis", "contrasts"),), HypothesesField, wide=True, structure=count_of, facts=compared
)
