"""From what is asked for to the edits of a study: one step each, with its words and what is selected after it."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Final, TypeAlias

from study_app.designer.document.additions import added
from study_app.designer.document.conversions import left_by, switched
from study_app.designer.document.edited_study import Study
from study_app.designer.document.fields import label_of, row_at, rows
from study_app.designer.document.initial_values import initial, singular
from study_app.designer.document.names import renamed
from study_app.designer.document.short_texts import followed
from study_app.designer.document.writer.edits import Edit, Insert, Set, Unset
from study_app.designer.document.writer.refused import Refused
from study_app.designer.place.element_steps import (
    Step,
    add,
    add_instrument,
    add_named,
    change_language,
    delete,
    duplicate,
    make_series,
    move,
    move_to,
    paste,
)
from study_app.designer.place.requests import (
    AddElement,
    AddEntry,
    AddInstrument,
    AddKey,
    AddNamed,
    ChangeLanguage,
    DeleteElement,
    DuplicateElement,
    DuplicateEntries,
    MakeSeries,
    MoveElement,
    MoveEntries,
    MoveTo,
    Paste,
    RemoveKey,
    RenameElement,
    Request,
    SetText,
    SetValue,
    Several,
    SwitchKey,
    SwitchKind,
)
from study_app.protocol.source.document import Path, entries, value_at

Recorded: TypeAlias = Callable[[Path], frozenset[str]]


def no_answers(_element: Path) -> frozenset[str]:
    """Return that no answers are recorded."""
    return frozenset()


class Steps:
    """Makes steps; keeps the values that a switch of kind removed.

    Parameters
    ----------
    recorded : callable
        Returns the ids beside an element under which answers are recorded: its own then stays.
    """

    def __init__(self, recorded: Recorded = no_answers) -> None:
        self._left: dict[Path, dict[str, Any]] = {}
        self._recorded = recorded

    def leave(self) -> None:
        """Forget what switches removed: another element is selected."""
        self._left.clear()

    def step(self, study: Study, asked: Request, selected: Path = ()) -> Step:
        """Return the step that is asked for while an element is selected.

        Raises
        ------
        Refused
            It makes no sense in this study.
        """
        if isinstance(asked, SetText):
            edits = (*_text(study, asked), *followed(study, asked.path, asked.language, asked.text))
            return Step(f"Type {label_of(asked.path[-1])}", edits, None, (asked.path, asked.language))
        if isinstance(asked, SwitchKind):
            return self._switch(study, asked)
        if isinstance(asked, SwitchKey):
            return self._switch_key(study, asked)
        if isinstance(asked, SetValue):
            name = label_of(asked.path[-1])
            return Step(f"Change {name}", (Set(asked.path, asked.value),), None, asked.path if asked.typing else None)
        if isinstance(asked, RemoveKey):
            return Step(f"Remove {label_of(asked.path[-1])}", (Unset(asked.path),))
        if isinstance(asked, AddKey):
            return Step(f"Add {label_of(asked.path[-1])}", (Set(asked.path, _first_value(study, asked.path)),))
        if isinstance(asked, AddEntry):
            return _add_entry(study, asked)
        if isinstance(asked, MoveEntries):
            return replace(move_to(study, MoveTo(asked.entries, asked.to)), select=None, several=())
        if isinstance(asked, DuplicateEntries):
            step = duplicate(study, DuplicateElement(asked.entries[0], asked.entries[1:]))
            return replace(step, select=None, several=(), fresh=False)
        if isinstance(asked, RenameElement):
            edits = renamed(study.document, asked.path, asked.name, self._recorded(asked.path))
            after = asked.path if isinstance(asked.path[-1], int) else (*asked.path[:-1], asked.name)
            return Step(f"Rename to {asked.name}", edits, after)
        if isinstance(asked, Several):
            return self._several(study, asked, selected)
        return _of_elements(study, asked, selected)

    def _several(self, study: Study, asked: Several, selected: Path) -> Step:
        edits: tuple[Edit, ...] = ()
        for one in asked.requests:
            step = self.step(study, one, selected)
            study, _ = study.edited(*step.edits)
            edits += step.edits
        return Step(asked.words, edits)

    def _switch(self, study: Study, asked: SwitchKind) -> Step:
        kept = self._left.get(asked.path, {})
        edits = switched(study, asked.path, asked.kind, kept)
        self._left[asked.path] = {**kept, **left_by(study, asked.path, asked.kind)}
        return Step(f"Switch to {label_of(asked.kind or 'nothing').lower()}", edits)

    def _switch_key(self, study: Study, asked: SwitchKey) -> Step:
        table, name = asked.path[:-1], str(asked.path[-1])
        before = value_at(study.document, asked.path)
        kept = {**self._left.get(table, {}), **({} if before is None else {name: before})}
        gone: tuple[Edit, ...] = () if before is None else (Unset(asked.path),)
        after, _ = study.edited(*gone)
        value = _listed(kept[asked.to]) if asked.to in kept else _first_value(after, (*table, asked.to))
        if value in ("", []):
            raise Refused(f"there is nothing that {label_of(asked.to)} can name: add it first")
        self._left[table] = kept
        return Step(f"Give {label_of(asked.to)}", (*gone, Set((*table, asked.to), value)))


_OF_ELEMENTS: Final[Mapping[type, Callable[[Study, Any], Step]]] = {
    AddNamed: add_named, AddInstrument: add_instrument, ChangeLanguage: change_language, DuplicateElement: duplicate,
    MoveElement: move, MoveTo: move_to, Paste: paste, DeleteElement: delete, MakeSeries: make_series,
}  # fmt: skip


def _of_elements(study: Study, asked: Request, selected: Path) -> Step:
    if isinstance(asked, AddElement):
        return add(study, asked, selected)
    if type(asked) in _OF_ELEMENTS:
        return _OF_ELEMENTS[type(asked)](study, asked)
    raise Refused("this cannot be done with a study")


def _text(study: Study, asked: SetText) -> tuple[Edit, ...]:
    languages = [str(code) for _, code in entries(study.document, "study.languages.*")] or [asked.language]
    value = value_at(study.document, asked.path)
    if isinstance(value, Mapping):
        return (Set((*asked.path, asked.language), asked.text),)
    if len(languages) == 1:
        return (Set(asked.path, asked.text),)
    before = {languages[0]: value} if isinstance(value, str) else {}
    return (Set(asked.path, {**before, asked.language: asked.text}),)


def _first_value(study: Study, path: Path) -> Any:
    """Return the default of a key, or an initial value; of a table with the keys that it needs."""
    value = _listed(initial(study.document, path))
    if value != {}:
        return value
    after, _ = study.edited(Set(path, {}))
    needed = (row for row in rows(after.document, path) if row.required)
    return {str(row.path[-1]): _listed(initial(after.document, row.path)) for row in needed}


def _add_entry(study: Study, asked: AddEntry) -> Step:
    row = row_at(study.document, asked.path)
    there = row.value if row is not None and isinstance(row.value, tuple) else ()
    value = asked.value
    if value is None:
        if row is None:
            raise Refused("nothing can be added here")
        if row.kind == "list":
            edits, _path = added(study, asked.path)
            return Step(f"Add {singular(asked.path[-1])}", edits)
        first = initial({}, asked.path) if not there else there[-1]
        value = _listed(first[0] if not there and isinstance(first, list | tuple) else first)
    edit: Edit = Insert((*asked.path, len(there)), value) if there else Set(asked.path, [value])
    return Step(f"Add to {label_of(asked.path[-1])}", (edit,))


def _listed(value: Any) -> Any:
    """Return a value as it is written: lists in place of tuples, and no keys of tables that are left out."""
    if isinstance(value, Mapping):
        return {key: _listed(part) for key, part in value.items() if part is not None}
    return [_listed(part) for part in value] if isinstance(value, list | tuple) else value
