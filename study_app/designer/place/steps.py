"""From what is asked for to the edits of a study: one step each, with its words and what is selected after it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, TypeAlias

from study_app.designer.document.additions import (
    added,
    check_values,
    copy_with,
    duplicated,
    fitted,
    listings,
    number_row,
    number_rows,
    titles_with,
)
from study_app.designer.document.changes import (
    filled_in,
    followed,
    languages_of,
    left_by,
    moved,
    switched,
    with_language,
    without_language,
)
from study_app.designer.document.elements import kind_and_title, step_of, title_of
from study_app.designer.document.fields import Row, counted_elements, initial, label_of, row_at, rows, singular
from study_app.designer.document.fragments import pasted
from study_app.designer.document.names import (
    deletions,
    left_without,
    named_at,
    references_to,
    renamed,
    replaced,
    with_references,
)
from study_app.designer.document.study import Study
from study_app.designer.document.toml_edits import Edit, Insert, Move, Set, Unset
from study_app.designer.document.toml_text import Refused
from study_app.designer.place import requests
from study_app.designer.problems.problems import element_of
from study_app.ids import free_id
from study_app.number_text import exact_text
from study_app.protocol.questionnaires import written_out
from study_app.protocol.source.document import Path, entries, names, value_at
from study_app.protocol.wording.languages import language_name


@dataclass(frozen=True, slots=True)
class DeletePrompt:
    """What refers to an element that is to be deleted."""

    path: Path  # the element
    title: str  # what it is called
    references: tuple[str, ...]  # the places that name it, in words
    others: tuple[tuple[str, str], ...] = ()  # id and title of what could be named in its place
    also: tuple[Path, ...] = ()  # others that are deleted with it
    together: tuple[str, ...] = ()  # elements that cannot be without it, with kind and title


@dataclass(frozen=True, slots=True)
class SeriesPrompt:
    """What a series is asked for with: the element, its title, and its numbers with their words and units."""

    path: Path
    title: str
    fields: tuple[tuple[Path, str], ...]


def series_prompt(study: Study, path: Path) -> SeriesPrompt | None:
    """Return what a series is asked for with; None where an element has no number."""
    fields = tuple((row.path, _in_words(row)) for row in number_rows(study.document, path))
    return SeriesPrompt(path, title_of(study.document, path), fields) if fields else None


def series_titles(study: Study, asked: requests.MakeSeries) -> tuple[tuple[str, ...], str]:
    """Return the title of each copy of a series; where there can be no copies with these values, why."""
    row = number_row(study.document, asked.path, asked.field)
    try:
        check_values(study.document, row, asked.values)
    except Refused as refusal:
        return (), f"{str(refusal)[:1].upper()}{str(refusal)[1:]}."
    own = title_of(study.document, asked.path)
    shown = []
    for value in asked.values:
        titles = dict(titles_with(study.document, asked.path, row, value))
        shown.append(next(iter(titles.values()), f"{own}, {exact_text(value)} {row.unit}".rstrip()))
    return tuple(shown), ""


def _in_words(row: Row) -> str:
    words = ", ".join(label_of(step) for step in row.path[2:])
    return f"{words} [{row.unit}]" if row.unit else words


@dataclass(frozen=True, slots=True)
class Step:
    """One step of a study."""

    words: str  # what it does
    edits: tuple[Edit, ...]  # its edits
    select: Path | None = None  # what is selected after it; None stands for the same
    continues: object = None  # what it may continue: typing in one field is one step
    text: str = ""  # the file's text that the edits are made in, "" for the text that there is
    several: tuple[Path, ...] = ()  # elements that are selected together after it
    said: str = ""  # what a screen reader says of it
    fresh: bool = False  # whether what is selected after it is new: its first text takes the keyboard


def add(study: Study, asked: requests.AddElement, selected: Path) -> Step:
    """Return the step that adds an element after the selected one of its kind, and beside its step in the session."""
    section = asked.section
    behind = selected[len(section)] if selected[: len(section)] == section and len(selected) > len(section) else None
    edits, path = added(study, section, dict([asked.kind]) if asked.kind else None, behind=behind)
    return Step(f"Add {singular(section[-1])}", beside(study, edits, selected, path), path, fresh=True)


def add_named(study: Study, asked: requests.AddNamed) -> Step:
    """Return the step that adds an element and names it at a place."""
    row = row_at(study.document, asked.path)
    edits, path = added(study, (asked.section,))
    if row is not None and row.kind == "references":
        after, _ = study.edited(*edits)
        listed = value_at(after.document, asked.path) or ()
        if path[1] not in listed:
            one: Edit = Insert((*asked.path, len(listed)), path[1]) if listed else Set(asked.path, [path[1]])
            edits = (*edits, one)
    else:
        edits = (*edits, Set(asked.path, path[1]))
    return Step(f"Add {singular(asked.section)}", edits, path, fresh=True)


def add_instrument(study: Study, asked: requests.AddInstrument) -> Step:
    """Return the step that adds a standard questionnaire; where texts are missing, the study writes what is known."""
    table, scales = written_out(asked.name, languages_of(study))
    path = ("questionnaires", free_id(names(study.document, "questionnaires"), asked.name.replace("-", "_")))
    there = names(study.document, "scales")
    edits = (Set(("scales", name), scale) for name, scale in scales.items() if name not in there)
    return Step(f"Add {asked.name}", (*edits, Set(path, table)), path)


def change_language(study: Study, asked: requests.ChangeLanguage) -> Step:
    """Return the step that adds a language, fills in its texts or takes it away."""
    code = asked.language
    words = {"add": "Add", "copy": "Fill in", "remove": "Remove"}[asked.how]
    edits = {"add": with_language, "copy": filled_in, "remove": without_language}[asked.how](study, code)
    return Step(f"{words} {language_name(code)}", edits)


def duplicate(study: Study, asked: requests.DuplicateElement) -> Step:
    """Return the step that copies elements; the step of each in the session comes right after that of the original."""
    edits: tuple[Edit, ...] = ()
    copies: list[Path] = []
    now = study
    for path in sorted((asked.path, *asked.also), key=lambda path: -path[-1] if isinstance(path[-1], int) else 0):
        made, copy = _copied(now, path)
        made = beside(now, made, path, copy)
        copies = [*(_after_insert(one, copy) for one in copies), copy]
        edits = (*edits, *made)
        now, _ = now.edited(*made)
    words = f"Duplicate {_titles(study, (asked.path, *asked.also))}"
    return Step(words, edits, copies[0], several=tuple(copies), fresh=len(copies) == 1)


def make_series(study: Study, asked: requests.MakeSeries) -> Step:
    """Return the step that makes copies of an element that differ in one number, one for each value.

    A copy is listed in the blocks that list the element, unless the block would then have a problem.
    """
    check_values(study.document, number_row(study.document, asked.path, asked.field), asked.values)
    edits: tuple[Edit, ...] = ()
    paths, now = [asked.path], study
    for value in asked.values:
        row = number_row(now.document, paths[-1], (*paths[-1], *asked.field[2:]))
        made, copy = copy_with(now, paths[-1], row, value)
        made = beside(now, made, paths[-1], copy)
        now, _ = now.edited(*made)
        for listing in listings(now, paths[-1], copy):
            listed, _ = now.edited(listing)
            if len(listed.faults) <= len(now.faults):
                now, made = listed, (*made, listing)
        edits = (*edits, *made)
        paths.append(copy)
    words = f"Make {counted_elements(len(asked.values), asked.path[0])} of {title_of(study.document, asked.path)}"
    said = ", ".join(title_of(now.document, one) for one in paths[1:])
    return Step(words, edits, paths[1], several=tuple(paths[1:]), said=said)


def _copied(study: Study, path: Path) -> tuple[tuple[Edit, ...], Path]:
    """Return the edits that copy an element, or a value of a list, right after itself, and the path of the copy."""
    value = value_at(study.document, path)
    if isinstance(value, Mapping) or not isinstance(path[-1], int):
        return duplicated(study, path)
    copy = (*path[:-1], path[-1] + 1)
    return (Insert(copy, list(value) if isinstance(value, tuple) else value),), copy


def beside(study: Study, edits: tuple[Edit, ...], original: Path, copy: Path) -> tuple[Edit, ...]:
    """Return edits that add an element, with its step in the session right after that of another one."""
    after, _ = study.edited(*edits)
    first, step = step_of(after.document, original), step_of(after.document, copy)
    if first is None or step is None or step == copy or step[:-1] != first[:-1]:
        return edits
    to = _index(first) + (_index(step) > _index(first))
    return edits if _index(step) == to else (*edits, Move(step, to))


def move(study: Study, asked: requests.MoveElement) -> Step:
    """Return the step that moves an element up or down by one place, with those of its list that move with it."""
    first = step_of(study.document, asked.path)
    if first is None:
        raise Refused(f"{title_of(study.document, asked.path)} is not in an order, so it cannot be moved")
    steps = {path: step_of(study.document, path) for path in (asked.path, *asked.also)}
    together = {path: step for path, step in steps.items() if step is not None and step[:-1] == first[:-1]}
    title, indices = _titles(study, tuple(together)), [_index(step) for step in together.values()]
    count = len(value_at(study.document, first[:-1]))
    to = min(indices) + asked.by if asked.by < 0 else max(indices) + 1 + asked.by
    if not 0 <= to <= count:
        raise Refused(f"{title} is the {'first' if asked.by < 0 else 'last'} already")
    words = f"Move {title} {'up' if asked.by < 0 else 'down'}"
    return _moved(study, tuple(together), tuple(together.values()), to, words)


def move_to(study: Study, asked: requests.MoveTo) -> Step:
    """Return the step that moves entries of a list to another place in it."""
    things = tuple((named_at(study.document, entry) or entry) for entry in asked.entries)
    return _moved(study, things, asked.entries, asked.to, f"Move {_titles(study, things)}")


def _moved(study: Study, things: Sequence[Path], entries: Sequence[Path], to: int, words: str) -> Step:
    edits, after = moved(study, entries, to)
    by_entry = dict(zip(sorted(entries, key=_index), after, strict=True))
    paths = tuple(by_entry[entry] if thing == entry else thing for thing, entry in zip(things, entries, strict=True))
    entry = by_entry[entries[0]]
    count = len(value_at(study.document, entry[:-1]))
    said = f"{title_of(study.document, things[0])}, now {_index(entry) + 1} of {count}"
    return Step(words, edits, paths[0], several=paths, said=said)


def paste(study: Study, asked: requests.Paste) -> Step:
    """Return the step that pastes elements after the selected one."""
    if not study.is_toml:
        raise Refused("the file cannot be read: correct its text first")
    found = pasted(study, asked.path, asked.text)
    after, _ = study.typed(found.text)
    edits: tuple[Edit, ...] = ()
    now = after
    for path in found.paths:
        if len(path) == 2:
            more = beside(now, fitted(study, now, path), asked.path, path)
            edits = (*edits, *more)
            now, _ = now.edited(*more)
    words = f"Paste {_titles(after, found.paths)}"
    return Step(words, edits, found.paths[0], text=found.text, several=found.paths)


def delete(study: Study, asked: requests.DeleteElement) -> Step:
    """Return the step that deletes elements."""
    path, document = asked.path, study.document
    paths = (path, *asked.also)
    words = f"Delete {_titles(study, paths)}"
    if asked.how == "other":
        return Step(words, replaced(document, path, asked.other), (*path[:-1], asked.other))
    if isinstance(path[-1], int):
        select: Path = path[:2]
    else:
        others = [name for name in names(document, str(path[0])) if (path[0], name) not in paths]
        select = (path[0], others[0]) if others else path[:1]
    if asked.how == "all":
        gone = tuple(one for each in paths for one in with_references(document, each, study.needs))
        if any(select[: len(one)] == one for one in gone):
            select = ("study",)
        return Step(words, deletions(gone), select)
    return Step(words, deletions(paths), select)


def delete_prompt(study: Study, paths: Sequence[Path]) -> DeletePrompt:
    """Return what names elements that are to be deleted, and what could be named in the place of a single one."""
    document, path = study.document, paths[0]
    named = (place for one in paths for place in references_to(document, one))
    places = (*named, *left_without(document, paths))
    outside = [place for place in places if not any(place[: len(one)] == one for one in paths)]
    references = (f"{kind_and_title(document, element_of(study, place))}: {_field(study, place)}" for place in outside)
    gone = {one: None for each in paths for one in with_references(document, each, study.needs)}
    elements = (one for one in gone if one not in paths and len(one) == 2 and isinstance(one[1], str))
    together = tuple(kind_and_title(document, one) for one in elements)
    others = (name for name in names(document, str(path[0])) if name != path[-1] and len(path) == 2)
    titles = tuple((name, title_of(document, (path[0], name))) for name in others) if len(paths) == 1 else ()
    words = tuple(dict.fromkeys(references))
    return DeletePrompt(path, _titles(study, paths), words, titles, tuple(paths[1:]), together)


def _field(study: Study, place: Path) -> str:
    inside = ", ".join(label_of(step) for step in place[len(element_of(study, place)) :])
    if value_at(study.document, place) is None:
        return f"{inside} (the only one)"
    return inside or f"entry {_index(place) + 1}"


def _titles(study: Study, paths: Sequence[Path]) -> str:
    if len(paths) == 1:
        return title_of(study.document, paths[0])
    return f"{len(paths)} elements"


def _after_insert(path: Path, new: Path) -> Path:
    """Return where a path is after an entry came into its list."""
    last, at = path[-1], new[-1]
    if path[:-1] == new[:-1] and isinstance(last, int) and isinstance(at, int) and last >= at:
        return (*path[:-1], last + 1)
    return path


def _index(path: Path) -> int:
    last = path[-1]
    if not isinstance(last, int):
        raise Refused(f"{label_of(last)} is not an entry of a list")
    return last


Recorded: TypeAlias = Callable[[Path], frozenset[str]]


def no_answers(_element: Path) -> frozenset[str]:
    """Return that no answers are recorded."""
    return frozenset()


class Steps:
    """Makes steps; keeps the values that a switch of kind removed."""

    def __init__(self, recorded: Recorded = no_answers) -> None:
        self._left: dict[Path, dict[str, Any]] = {}
        self._recorded = recorded

    def leave(self) -> None:
        """Forget what switches removed: another element is selected."""
        self._left.clear()

    def step(self, study: Study, asked: requests.Request, selected: Path = ()) -> Step:
        """Return the step that is asked for while an element is selected."""
        if isinstance(asked, requests.SetText):
            edits = (*_text(study, asked), *followed(study, asked.path, asked.language, asked.text))
            return Step(f"Type {label_of(asked.path[-1])}", edits, None, (asked.path, asked.language))
        if isinstance(asked, requests.SwitchKind):
            return self._switch(study, asked)
        if isinstance(asked, requests.SwitchKey):
            return self._switch_key(study, asked)
        if isinstance(asked, requests.SetValue):
            name = label_of(asked.path[-1])
            return Step(f"Change {name}", (Set(asked.path, asked.value),), None, asked.path if asked.typing else None)
        if isinstance(asked, requests.RemoveKey):
            return Step(f"Remove {label_of(asked.path[-1])}", (Unset(asked.path),))
        if isinstance(asked, requests.AddKey):
            return Step(f"Add {label_of(asked.path[-1])}", (Set(asked.path, _first_value(study, asked.path)),))
        if isinstance(asked, requests.AddEntry):
            return _add_entry(study, asked)
        if isinstance(asked, requests.RenameElement):
            edits = renamed(study.document, asked.path, asked.name, self._recorded(asked.path))
            after = asked.path if isinstance(asked.path[-1], int) else (*asked.path[:-1], asked.name)
            return Step(f"Rename to {asked.name}", edits, after)
        if isinstance(asked, requests.Several):
            return self._several(study, asked, selected)
        return _of_elements(study, asked, selected)

    def _several(self, study: Study, asked: requests.Several, selected: Path) -> Step:
        edits: tuple[Edit, ...] = ()
        for one in asked.requests:
            step = self.step(study, one, selected)
            study, _ = study.edited(*step.edits)
            edits += step.edits
        return Step(asked.words, edits)

    def _switch(self, study: Study, asked: requests.SwitchKind) -> Step:
        kept = self._left.get(asked.path, {})
        edits = switched(study, asked.path, asked.kind, kept)
        self._left[asked.path] = {**kept, **left_by(study, asked.path, asked.kind)}
        return Step(f"Switch to {label_of(asked.kind or 'nothing').lower()}", edits)

    def _switch_key(self, study: Study, asked: requests.SwitchKey) -> Step:
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
    requests.AddNamed: add_named,
    requests.AddInstrument: add_instrument,
    requests.ChangeLanguage: change_language,
    requests.DuplicateElement: duplicate,
    requests.MoveElement: move,
    requests.MoveTo: move_to,
    requests.Paste: paste,
    requests.DeleteElement: delete,
    requests.MakeSeries: make_series,
}


def _of_elements(study: Study, asked: requests.Request, selected: Path) -> Step:
    if isinstance(asked, requests.AddElement):
        return add(study, asked, selected)
    if type(asked) in _OF_ELEMENTS:
        step = _OF_ELEMENTS[type(asked)](study, asked)
        stays = isinstance(asked, requests.MoveTo | requests.DuplicateElement) and asked.stays
        return replace(step, select=None, several=(), fresh=False) if stays else step
    raise Refused("this cannot be done with a study")


def _text(study: Study, asked: requests.SetText) -> tuple[Edit, ...]:
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


def _add_entry(study: Study, asked: requests.AddEntry) -> Step:
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
