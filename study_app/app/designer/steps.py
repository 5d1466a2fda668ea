"""From what is asked for to the edits of a study: one step each, with its words and what is selected after it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from study_app.authoring.additions import added, duplicated, initial, singular
from study_app.authoring.conversions import left_by, switched
from study_app.authoring.fields import label_of, row_at, rows
from study_app.authoring.names import deletions, references_to, renamed, replaced, with_references
from study_app.authoring.outline import title_of
from study_app.authoring.study import Study
from study_app.authoring.writer.edits import Edit, Insert, Move, Set, Unset
from study_app.authoring.writer.refused import Refused
from study_app.protocol.source.document import Path, entries, names
from study_app.viewmodels.designer.form_rows import step_of, value_at
from study_app.viewmodels.designer.problem_rows import element_of
from study_app.viewmodels.designer.prompts import DeletePrompt
from study_app.viewmodels.designer.requests import (
    AddElement,
    AddEntry,
    AddKey,
    DeleteElement,
    DuplicateElement,
    MoveElement,
    MoveEntry,
    RemoveKey,
    RenameElement,
    Request,
    SetText,
    SetValue,
    Several,
    SwitchKey,
    SwitchKind,
)


@dataclass(frozen=True, slots=True)
class Step:
    """The edits of one step: its words, what is selected after it (None: the same), and what it may continue."""

    words: str
    edits: tuple[Edit, ...]
    select: Path | None = None
    continues: object = None


class Steps:
    """Makes steps; keeps the values that a switch of kind removed, for a switch back."""

    def __init__(self) -> None:
        self._left: dict[Path, dict[str, Any]] = {}

    def leave(self) -> None:
        """Forget what switches removed: another element is selected."""
        self._left.clear()

    def step(self, study: Study, asked: Request) -> Step:
        """Return the step that is asked for.

        Raises
        ------
        Refused
            It makes no sense in this study.
        """
        if isinstance(asked, SwitchKind):
            return self._switch(study, asked)
        if isinstance(asked, SwitchKey):
            return self._switch_key(study, asked)
        if isinstance(asked, SetValue):
            name = label_of(asked.path[-1])
            return Step(f"Change {name}", (Set(asked.path, asked.value),), None, asked.path if asked.typing else None)
        if isinstance(asked, SetText):
            return Step(f"Type {label_of(asked.path[-1])}", _text(study, asked), None, (*asked.path, asked.language))
        if isinstance(asked, RemoveKey):
            return Step(f"Remove {label_of(asked.path[-1])}", (Unset(asked.path),))
        if isinstance(asked, AddKey):
            return Step(f"Add {label_of(asked.path[-1])}", (Set(asked.path, _first_value(study, asked.path)),))
        if isinstance(asked, AddEntry):
            return _add_entry(study, asked)
        if isinstance(asked, AddElement):
            edits, path = added(study, asked.section)
            return Step(f"Add {singular(asked.section[-1])}", edits, path)
        if isinstance(asked, DuplicateElement):
            return _duplicate(study, asked.path)
        if isinstance(asked, MoveElement):
            return _move(study, asked)
        if isinstance(asked, MoveEntry):
            return Step(f"Move entry {_index(asked.path) + 1}", (Move(asked.path, asked.to),))
        if isinstance(asked, RenameElement):
            edits = renamed(study.document, asked.path, asked.name)
            after = asked.path if isinstance(asked.path[-1], int) else (*asked.path[:-1], asked.name)
            return Step(f"Rename to {asked.name}", edits, after)
        if isinstance(asked, DeleteElement):
            return _delete(study, asked)
        if isinstance(asked, Several):
            return self._several(study, asked)
        raise Refused("this cannot be done to a study")

    def _several(self, study: Study, asked: Several) -> Step:
        edits: tuple[Edit, ...] = ()
        for one in asked.requests:
            step = self.step(study, one)
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


def _duplicate(study: Study, path: Path) -> Step:
    """Return the step that copies an element; its step in the session comes right after that of the original."""
    edits, copy = duplicated(study, path)
    after, _ = study.edited(*edits)
    original, step = step_of(after.document, path), step_of(after.document, copy)
    if original is not None and step is not None and step != copy and step[:-1] == original[:-1]:
        to = _index(original) + (_index(step) > _index(original))
        edits = edits if _index(step) == to else (*edits, Move(step, to))
    return Step(f"Duplicate {title_of(study.document, path)}", edits, copy)


def _move(study: Study, asked: MoveElement) -> Step:
    step = step_of(study.document, asked.path)
    title = title_of(study.document, asked.path)
    if step is None:
        raise Refused(f"{title} has no place in an order: it is not moved")
    to, count = _index(step) + asked.by, len(value_at(study.document, step[:-1]))
    if not 0 <= to < count:
        raise Refused(f"{title} is the {'first' if asked.by < 0 else 'last'} already")
    select = (*step[:-1], to) if step == asked.path else asked.path
    return Step(f"Move {title} {'up' if asked.by < 0 else 'down'}", (Move(step, to),), select)


def _delete(study: Study, asked: DeleteElement) -> Step:
    path, document = asked.path, study.document
    words = f"Delete {title_of(document, path)}"
    if asked.how == "other":
        return Step(words, replaced(document, path, asked.other), (*path[:-1], asked.other))
    if isinstance(path[-1], int):
        select: Path = path[:2]
    else:
        others = [name for name in names(document, str(path[0])) if name != path[-1]]
        select = (path[0], others[0]) if others else path[:1]
    if asked.how == "all":
        gone = with_references(document, path, study.needs)
        if any(select[: len(one)] == one for one in gone):
            select = ("study",)
        return Step(words, deletions(gone), select)
    return Step(words, (Unset(path),), select)


def delete_prompt(study: Study, path: Path) -> DeletePrompt:
    """Return what names an element, and what could be named in its place."""
    document = study.document
    places = references_to(document, path)
    references = (f"{title_of(document, element_of(study, place))}: {_field(study, place)}" for place in places)
    others = (name for name in names(document, str(path[0])) if name != path[-1] and len(path) == 2)
    titles = tuple((name, title_of(document, (path[0], name))) for name in others)
    return DeletePrompt(path, title_of(document, path), tuple(dict.fromkeys(references)), titles)


def _field(study: Study, place: Path) -> str:
    inside = [label_of(step) for step in place[len(element_of(study, place)) :]]
    return ", ".join(inside) or f"entry {_index(place) + 1}"


def _index(path: Path) -> int:
    last = path[-1]
    if not isinstance(last, int):
        raise Refused(f"{label_of(last)} is not an entry of a list")
    return last


def _listed(value: Any) -> Any:
    """Return a value as it is written: lists in place of tuples, and no keys of tables that are left out."""
    if isinstance(value, Mapping):
        return {key: _listed(part) for key, part in value.items() if part is not None}
    return [_listed(part) for part in value] if isinstance(value, list | tuple) else value
