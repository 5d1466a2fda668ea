"""What is asked for in the study designer: requests, each of which makes one step of undo, and other tasks."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import KW_ONLY, dataclass, fields, is_dataclass, replace
from functools import cache
from pathlib import Path as File
from typing import Any, Final, Literal, TypeAlias

from study_app.designer.document.additions import (
    as_written,
    check_values,
    edits_that_follow,
    edits_to_add,
    edits_to_copy_with,
    edits_to_duplicate,
    edits_to_fill_in,
    edits_to_move,
    edits_to_switch,
    number_row,
    short_text_edits,
    surplus_edits,
    with_language,
    without_language,
)
from study_app.designer.document.elements import step_of, title_of, unique_name
from study_app.designer.document.fields import (
    counted_elements,
    edits_to_delete,
    edits_to_rename,
    edits_to_replace,
    element_noun,
    initial_value,
    label_at,
    label_of,
    named_at,
    references_to,
    row_at,
    rows,
    unit_of,
    with_references,
)
from study_app.designer.document.study import Study, read_study
from study_app.designer.document.toml_edits import Edit, Insert, Move, Set, Unset
from study_app.designer.document.toml_text import Refused, with_own_line_ends
from study_app.ids import free_id
from study_app.number_text import counted
from study_app.protocol.questionnaires import Instrument
from study_app.protocol.source import Path, names, shipped, value_at
from study_app.protocol.wording import language_name, languages_of

Recorded: TypeAlias = Callable[[Path], frozenset[str]]
"""Returns the ids beside an element under which answers are recorded: its own then stays."""


@dataclass(frozen=True, slots=True)
class Step:
    """One step of a study."""

    words: str  # what it does
    edits: tuple[Edit, ...]  # its edits
    select: Path | None = None  # the selection after it; None keeps the present one
    continues: object = None  # the step that it may continue: typing in one field is one step
    text: str | None = None  # the text to edit, None for the present text
    _: KW_ONLY
    said: str = ""  # the text for screen readers
    removed: str = ""  # what it deletes
    fresh: Literal["", "new", "copy"] = ""  # whether the selection is new: its first text takes the keyboard focus
    entry: Path = ()  # what it adds, gives another kind or removes an entry from: it is unfinished until it is left


@dataclass(frozen=True, slots=True)
class Situation:
    """The context of a step: the study, the selection, and ids with recorded answers."""

    study: Study
    selected: Path = ()
    recorded: Recorded = lambda _element: frozenset()


class Request:
    """A requested change; `step` rejects it if it is impossible in the study."""

    __slots__ = ()

    def step(self, at: Situation) -> Step:
        raise NotImplementedError


@dataclass(frozen=True, slots=True)
class SetValue(Request):
    """Set the value of a key or entry; consecutive changes while typing in one field are one step."""

    path: Path
    value: Any
    typing: bool = False

    def step(self, at: Situation) -> Step:
        edits = edits_that_follow(at.study, self.path, Set(self.path, self.value))
        entry = self.path[:2] if self.path[:1] == ("blocks",) and self.path[2:] == ("design",) else ()
        if self.typing and self.path[::2][:2] == ("scales", "labels"):
            entry = self.path[:3]  # a label alone is a problem until the others are typed
        return Step(f"Change {label_at(self.path)}", edits, None, self.path if self.typing else None, entry=entry)


@dataclass(frozen=True, slots=True)
class SetText(Request):
    """Set a text in one language; an empty one is removed if the text exists in another language."""

    path: Path
    language: str
    text: str

    def step(self, at: Situation) -> Step:
        languages = languages_of(at.study.document)
        value = value_at(at.study.document, self.path)
        edit: Edit
        title = f"Type {label_at(self.path)}"
        if isinstance(value, Mapping) and not self.text.strip() and value.keys() - {self.language}:
            gone = (Unset((*self.path, self.language)),) if self.language in value else ()
            return Step(title, gone, continues=(self.path, self.language))
        if isinstance(value, Mapping):
            edit = Set((*self.path, self.language), self.text)
        elif len(languages) == 1:
            edit = Set(self.path, self.text)
        else:
            before = {languages[0]: value} if isinstance(value, str) else {}
            edit = Set(self.path, {**before, self.language: self.text})
        edits = (edit, *short_text_edits(at.study, self.path, self.language, self.text))
        return Step(title, edits, continues=(self.path, self.language))


@dataclass(frozen=True, slots=True)
class LeaveText(Request):
    """Report that a text field was left; a new element then gets an id from its text."""

    path: Path


@dataclass(frozen=True, slots=True)
class RemoveKey(Request):
    """Remove a key or an entry of a list."""

    path: Path

    def step(self, at: Situation) -> Step:
        edits = edits_that_follow(at.study, self.path, Unset(self.path))
        title, last = label_at(self.path), self.path[-1]
        if isinstance(last, str):
            return Step(f"Remove {title}", edits, removed=title)
        removed, around = f"{element_noun(self.path[-2])} {title}", self.path[:-1]
        return Step(f"Remove {title}", edits, removed=removed, entry=around[:2])  # another entry may replace this one


@dataclass(frozen=True, slots=True)
class AddKey(Request):
    """Add an optional key with its default or an initial value."""

    path: Path

    def step(self, at: Situation) -> Step:
        edits = edits_that_follow(at.study, self.path, Set(self.path, _first_value(at.study, self.path)))
        return Step(f"Add {label_at(self.path)}", edits, entry=self.path)


@dataclass(frozen=True, slots=True)
class AddEntry(Request):
    """Add an entry at the end of a list: the given value, or (None) an initial one."""

    path: Path
    value: Any = None

    def step(self, at: Situation) -> Step:
        row = row_at(at.study.document, self.path)
        entries = row.value if row is not None and isinstance(row.value, tuple) else ()
        value = self.value
        if value is None:
            if row is None:
                raise Refused("new elements cannot be added here")
            if row.kind == "list":
                edits, path = edits_to_add(at.study, self.path)
                return Step(f"Add {element_noun(self.path[-1])}", edits, entry=path)
            first = initial_value({}, self.path) if not entries else entries[-1]
            value = as_written(first[0] if not entries and isinstance(first, list | tuple) else first)
        edit: Edit = Insert((*self.path, len(entries)), value) if entries else Set(self.path, [value])
        edits = edits_that_follow(at.study, self.path, edit)
        return Step(f"Add to {label_of(self.path[-1])}", edits, entry=(*self.path, len(entries)))


@dataclass(frozen=True, slots=True)
class SwitchKind(Request):
    """Change the kind of a table."""

    path: Path
    kind: str | None

    def step(self, at: Situation) -> Step:
        title = f"Switch to {label_of(self.kind or 'nothing').lower()}"
        return Step(title, edits_to_switch(at.study, self.path, self.kind), entry=self.path)


@dataclass(frozen=True, slots=True)
class SwitchKey(Request):
    """Replace one key by another in a table in which exactly one of the two is given."""

    path: Path
    to: str

    def step(self, at: Situation) -> Step:
        place = (*self.path[:-1], self.to)
        gone = () if value_at(at.study.document, self.path) is None else (Unset(self.path),)
        value = _first_value(at.study.with_edits(*gone)[0], place)
        if value in ("", []):
            raise Refused(f"{label_of(self.to)} refers to an element that does not exist yet: add that element first")
        edits = *gone, Set(place, value)
        edits = (*edits, *surplus_edits(at.study, place, edits))
        return Step(f"Specify {label_of(self.to)}", edits, entry=self.path[:-1])


@dataclass(frozen=True, slots=True)
class AddElement(Request):
    """Add an element to a section or list of tables, after the selected one of its kind."""

    section: Path

    def step(self, at: Situation) -> Step:
        section, selected = self.section, at.selected
        inside = selected[: len(section)] == section and len(selected) > len(section)
        behind = selected[len(section)] if inside else None
        edits, path = edits_to_add(at.study, section, behind=behind)
        edits = _edits_beside(at.study, edits, selected, path)
        title, said = f"Add {element_noun(section[-1])}", _also_added(at.study, edits, path)
        return Step(title, edits, path, said=said, fresh="new", entry=path)


def _also_added(study: Study, edits: tuple[Edit, ...], path: Path) -> str:
    """Return a sentence with the other elements that are added with the one at ``path``; "" if there are none."""
    after = study.with_edits(*edits)[0].document
    sections = [str(row.path[0]) for row in rows(after, ()) if row.kind == "tables"]
    new = [(section, name) for section in sections for name in names(after, section)
           if name not in names(study.document, section) and (section, name) != path[:2]]  # fmt: skip
    added = ", ".join(unique_name(after, other) for other in new)
    return f"Also added, because the study needs it: {added}. {label_of(new[0][0])} lists it." if new else ""


@dataclass(frozen=True, slots=True)
class AddNamed(Request):
    """Add an element to a section and refer to it in the reference at ``path``, or at the end of the list there."""

    path: Path
    section: str

    def step(self, at: Situation) -> Step:
        row = row_at(at.study.document, self.path)
        edits, path = edits_to_add(at.study, (self.section,))
        if row is not None and row.kind == "references":
            listed = value_at(at.study.with_edits(*edits)[0].document, self.path) or ()
            if path[1] not in listed:
                end = (*self.path, len(listed))
                edits = (*edits, Insert(end, path[1]) if listed else Set(self.path, [path[1]]))
        else:
            edits = edits_that_follow(at.study, self.path, *edits, Set(self.path, path[1]))
        return Step(f"Add {element_noun(self.section)}", edits, path, fresh="new", entry=path)


@dataclass(frozen=True, slots=True)
class AddInstrument(Request):
    """Add a standard questionnaire; if texts are missing, all its known parts are written into the study."""

    name: str

    def step(self, at: Situation) -> Step:
        table, edits = _instrument_edits(at.study, self.name)
        path = ("questionnaires", free_id(names(at.study.document, "questionnaires"), self.name.replace("-", "_")))
        codes, known = languages_of(at.study.document), Instrument(self.name).table["languages"]
        lacking, said = [language_name(code) for code in codes if code not in known], ""
        if 0 < len(lacking) < len(codes):
            where = "The next problem (F8), or “Write …” at the study's languages, lists them"
            said = f"The program does not include the {' and '.join(lacking)} texts. {where}."
        return Step(f"Add {self.name}", (*edits, Set(path, table)), path, said=said, entry=path)


def _instrument_edits(study: Study, name: str) -> tuple[dict[str, Any], tuple[Edit, ...]]:
    """Return the table of a standard questionnaire, and the edits that add the scales it needs."""
    table, scales = Instrument(name).tables_in(languages_of(study.document))
    known = names(study.document, "scales")
    return table, tuple(Set(("scales", scale), value) for scale, value in scales.items() if scale not in known)


@dataclass(frozen=True, slots=True)
class UseSource(Request):
    """Replace a liquid by the one in a file, or a questionnaire's content by a standard questionnaire.

    ``path`` is that of the key ``file`` or ``instrument``, ``name`` the path of the file or the name of the instrument.
    """

    path: Path
    name: str

    def step(self, at: Situation) -> Step:
        element, key = self.path[:-1], self.path[-1]
        before: Any = value_at(at.study.document, element)
        edits: tuple[Edit, ...] = ()
        if key == "instrument":
            table, edits = _instrument_edits(at.study, self.name)
            table |= {"title": before["title"]} if "title" in before else {}
        else:
            file = self.name
            with suppress(ValueError):  # on another drive
                file = os.path.relpath(file, at.study.folder)
            table = {"file": File(file).as_posix()}
        gone = (Unset((*element, other)) for other in before if other not in table)
        new = (Set((*element, other), as_written(value)) for other, value in table.items())
        return Step(f"Use {label_of(key).lower()} {File(self.name).stem}", (*edits, *new, *gone))


_SCALE: Final = ("scene", "scale")


@cache
def _shipped_documents() -> dict[str, Mapping[str, Any]]:
    return {name: read_study(file.read_bytes(), file.parent).document for name, file in shipped().items()}


@cache
def shipped_liquids() -> dict[tuple[str, str], Mapping[str, Any]]:
    """Return the shipped studies' liquids by study and id."""
    return {
        (study, name): table
        for study, document in _shipped_documents().items()
        for name, table in document.get("liquids", {}).items()
    }


@dataclass(frozen=True, slots=True)
class AddLiquid(Request):
    """Add a shipped study's liquid, and name it in the reference at ``path``, or in a new condition if there are any.

    A new condition is listed in a block if ``path`` is that of its conditions. With ``path`` the form stays there.
    A study without a scale of its own gets that of the shipped study: at another scale the device may not be able to
    present the liquid.
    """

    source: str
    name: str
    path: Path = ()

    @property
    def words(self) -> str:
        """What tells the shipped liquids apart: "Water liquid, 998.2 kg/m³, 0.001 Pa·s", or effects or kind."""
        table = shipped_liquids()[self.source, self.name]
        numbers = {**table, **table.get("drag", {})}.items()
        facts = [f"{value:.4g} {unit_of(key)}" for key, value in numbers if isinstance(value, int | float)]
        kind, effects = table.get("non_newtonian", {}).get("kind"), table.get("effects")
        named = (label_of(kind),) if kind else effects if isinstance(effects, tuple) else ()
        return ", ".join((f"{label_of(self.name)} liquid", *facts, *named))

    def help(self, study: Study) -> str:
        """Return where the liquid comes from, and whether the scale of the scene changes or its forces differ."""
        theirs, own = self._scales(study)
        origin = f"Copied from the shipped study {self.source}, with all its values"
        if theirs == own:
            return origin
        if value_at(study.document, _SCALE) is None:
            return f"{origin}. The scene's scale changes to {theirs:g} for all liquids, as in that study."
        return (
            f"{origin}. The forces differ, because the scene's scale is {theirs:g} in that study and {own:g} in this "
            "one."
        )

    def _scales(self, study: Study) -> tuple[float, float]:
        """Return the scale of the scene in the shipped study and in this one."""
        documents = (_shipped_documents()[self.source], study.document)
        theirs, own = (value_at(it, _SCALE) or initial_value(it, _SCALE) for it in documents)
        return theirs, own

    def step(self, at: Situation) -> Step:
        document = at.study.document
        name = free_id((*names(document, "liquids"), *names(document, "conditions")), self.name)
        edits: tuple[Edit, ...] = (Set(("liquids", name), as_written(shipped_liquids()[self.source, self.name])),)
        listed = self.path[::2] == ("blocks", "conditions")
        if names(document, "conditions") and (listed or not self.path):
            edits = (*edits, Set(("conditions", name), {"liquid": name}))
        if listed:
            before = value_at(document, self.path) or ()
            edits = (*edits, Insert((*self.path, len(before)), name) if before else Set(self.path, [name]))
        elif self.path:
            edits = (*edits, Set(self.path, name))
        theirs, own = self._scales(at.study)
        if theirs != own and value_at(document, _SCALE) is None:
            edits = (*edits, Set(_SCALE, theirs))
        select: Path | None = None if self.path else ("liquids", name)
        said = self.help(at.study) if self.path else ""
        return Step(f"Add {label_of(self.name).lower()}", edits, select, said=said, entry=("liquids", name))


def shipped_liquids_to_add(study: Study, path: Path = ()) -> tuple[AddLiquid, ...]:
    """Return the requests for the shipped liquids, equal ones of one name once."""
    first: dict[tuple[str, str], AddLiquid] = {}
    for source, name in shipped_liquids():
        asked = AddLiquid(source, name, path)
        first.setdefault((asked.words, asked.help(study).replace(source, "")), asked)
    return tuple(first.values())


@dataclass(frozen=True, slots=True)
class ChangeLanguage(Request):
    """Add a language to every text, fill its missing texts from the first language, or remove it."""

    how: Literal["add", "copy", "remove"]
    language: str

    def step(self, at: Situation) -> Step:
        verb = {"add": "Add", "copy": "Fill in", "remove": "Remove"}[self.how]
        edits = {"add": with_language, "copy": edits_to_fill_in, "remove": without_language}[self.how](
            at.study, self.language
        )
        return Step(f"{verb} {language_name(self.language)}", edits)


@dataclass(frozen=True, slots=True)
class DuplicateElement(Request):
    """Copy an element right after itself, and its session step right after that of the original.

    With ``stays`` the form stays at its element, for example if an entry of one of its lists is copied.
    """

    path: Path
    stays: bool = False

    def step(self, at: Situation) -> Step:
        path, value = self.path, value_at(at.study.document, self.path)
        if isinstance(value, Mapping) or not isinstance(path[-1], int):
            edits, copy = edits_to_duplicate(at.study, path)
        else:
            copy = (*path[:-1], path[-1] + 1)
            edits = (Insert(copy, list(value) if isinstance(value, tuple) else value),)
        title, edits = f"Duplicate {title_of(at.study.document, path)}", _edits_beside(at.study, edits, path, copy)
        return Step(title, edits, entry=copy) if self.stays else Step(title, edits, copy, fresh="copy", entry=copy)


@dataclass(frozen=True, slots=True)
class MakeSeries(Request):
    """Copy an element once for each value of the number ``field``, which may be one of a block's conditions.

    A copy is added to the blocks that list the element, unless this would cause a problem in the block.
    """

    path: Path
    field: Path
    values: tuple[int | float, ...]

    def step(self, at: Situation) -> Step:
        study = at.study
        check_values(study.document, number_row(study.document, self.path, self.field), self.values)
        edits: tuple[Edit, ...] = ()
        paths, now = [self.path], study
        for value in self.values:
            row = number_row(now.document, paths[-1], self.field)
            made, copy = edits_to_copy_with(now, paths[-1], row, value)
            made = _edits_beside(now, made, paths[-1], copy)
            now, _ = now.with_edits(*made)
            for place in references_to(now.document, paths[-1]):
                if place[0] != "blocks" or not isinstance(place[-1], int):
                    continue
                listing = Insert((*place[:-1], place[-1] + 1), copy[1])
                listed, _ = now.with_edits(listing)
                if len(listed.faults) <= len(now.faults):
                    now, made = listed, (*made, listing)
            edits = (*edits, *made)
            paths.append(copy)
        title = f"Make {counted_elements(len(self.values), self.path[0])} of {title_of(study.document, self.path)}"
        said = ", ".join(title_of(now.document, path) for path in paths[1:])
        return Step(title, edits, paths[1], said=said, entry=paths[1])


@dataclass(frozen=True, slots=True)
class MoveElement(Request):
    """Move an element among its neighbours by a number of places."""

    path: Path
    by: int

    def step(self, at: Situation) -> Step:
        document, by = at.study.document, self.by
        entry, title = step_of(document, self.path), title_of(document, self.path)
        if entry is None:
            raise Refused(f"{title} is not part of an ordered list, so it cannot be moved")
        to = index_of(entry) + (by if by < 0 else 1 + by)
        if not 0 <= to <= len(value_at(document, entry[:-1])):
            raise Refused(f"{title} is already {'first' if by < 0 else 'last'} in the list")
        return _move_step(at.study, self.path, entry, to, f"Move {title} {'up' if by < 0 else 'down'}")


@dataclass(frozen=True, slots=True)
class MoveTo(Request):
    """Move an entry of a list before the one at the index ``to``; the list's length means its end.

    With ``stays`` the form stays at its element.
    """

    entry: Path
    to: int
    stays: bool = False

    def step(self, at: Situation) -> Step:
        thing = named_at(at.study.document, self.entry) or self.entry
        step = _move_step(at.study, thing, self.entry, self.to, f"Move {title_of(at.study.document, thing)}")
        return replace(step, select=None) if self.stays else step


@dataclass(frozen=True, slots=True)
class AddToSession(Request):
    """Add an element to the session before each of the steps at ``places``."""

    path: Path
    places: tuple[Path, ...]

    def step(self, at: Situation) -> Step:
        title, places = title_of(at.study.document, self.path), sorted(self.places, key=index_of, reverse=True)
        said = f"{title}, now step {index_of(places[-1]) + 1}"
        return Step(f"Add {title} to the session", tuple(Insert(place, self.path[1]) for place in places), said=said)


@dataclass(frozen=True, slots=True)
class DeleteElement(Request):
    """Delete an element: with everything that requires it, with a replacement, or leaving gaps."""

    path: Path
    how: Literal["all", "other", "gaps"] = "gaps"
    other: str = ""

    def step(self, at: Situation) -> Step:
        path, document = self.path, at.study.document
        title = f"Delete {title_of(document, path)}"
        if self.how == "other":
            edits = edits_to_replace(document, path, self.other)
            return Step(title, edits, (*path[:-1], self.other), removed=title_of(document, path))
        if isinstance(path[-1], int):
            select: Path = path[:2]
        else:
            others = [name for name in names(document, str(path[0])) if name != path[1]]
            select = (path[0], others[0]) if others else path[:1]
        gone = (path,) if self.how == "gaps" else with_references(document, path, at.study.needs)
        if any(select[: len(path)] == path for path in gone):
            select = ("study",)
        return Step(title, edits_to_delete(gone), select, removed=title_of(document, path))


@dataclass(frozen=True, slots=True)
class RenameElement(Request):
    """Change the id of an element and all references to it."""

    path: Path
    name: str

    def step(self, at: Situation) -> Step:
        edits = edits_to_rename(at.study.document, self.path, self.name, at.recorded(self.path))
        after = self.path if isinstance(self.path[-1], int) else (*self.path[:-1], self.name)
        followed = len(references_to(at.study.document, self.path))
        said = f"{counted(followed, 'place')} updated" if followed else ""
        return Step(", ".join(filter(None, (f"Rename to {self.name}", said))), edits, after, said=said)


@dataclass(frozen=True, slots=True)
class RetypeFile(Request):
    """Replace the file's text by that of the text editor."""

    text: str

    def step(self, at: Situation) -> Step:
        return Step("Edit the file", (), continues="file", text=with_own_line_ends(at.study.text, self.text))


@dataclass(frozen=True, slots=True)
class Several(Request):
    """Several requests, executed in order as one step."""

    words: str
    requests: tuple[Request, ...]

    def step(self, at: Situation) -> Step:
        edits: tuple[Edit, ...] = ()
        study = at.study
        for request in self.requests:
            step = request.step(replace(at, study=study))
            study, _ = study.with_edits(*step.edits)
            edits += step.edits
        removes = all(isinstance(request, RemoveKey) for request in self.requests)
        return Step(self.words, edits, removed=self.words.removeprefix("Remove ") if removes else "")


Task: TypeAlias = Literal[
    "select", "write", "back", "find", "undo", "redo", "save", "open", "new", "begin", "banner", "add", "copy",
    "delete", "duplicate", "series", "judge id", "repair", "repairs", "leave entries",
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class Do:
    """A task that is not a step of the study, with its arguments: ``Do("select", (path,))``."""

    what: Task
    arguments: tuple[Any, ...] = ()


@dataclass(frozen=True, slots=True)
class GoTo:
    """Select an element and focus one of its fields; this changes the view, not the study."""

    element: Path
    field: Path


def with_path(asked: Any, before: Path, after: Path) -> Any:
    """Return a request or path in which one element's path is replaced, for example after a rename."""
    if isinstance(asked, tuple):
        if asked[: len(before)] == before:
            return (*after, *asked[len(before) :])
        return tuple(with_path(part, before, after) for part in asked)
    if is_dataclass(asked) and not isinstance(asked, type):
        parts = {part.name: getattr(asked, part.name) for part in fields(asked)}
        return replace(asked, **{name: with_path(value, before, after) for name, value in parts.items()})
    return asked


def _edits_beside(study: Study, edits: tuple[Edit, ...], original: Path, copy: Path) -> tuple[Edit, ...]:
    """Return the edits that add an element, with its session step right after the original's."""
    after, _ = study.with_edits(*edits)
    first, step = step_of(after.document, original), step_of(after.document, copy)
    if first is None or step is None or step == copy or step[:-1] != first[:-1]:
        return edits
    to = index_of(first) + (index_of(step) > index_of(first))
    return edits if index_of(step) == to else (*edits, Move(step, to))


def _move_step(study: Study, thing: Path, entry: Path, to: int, title: str) -> Step:
    edits, after = edits_to_move(study, entry, to)
    count = len(value_at(study.document, entry[:-1]))
    said = f"{title_of(study.document, thing)}, now {index_of(after) + 1} of {count}"
    return Step(title, edits, after if thing == entry else thing, said=said)


def index_of(path: Path) -> int:
    """Return the index of an entry of a list."""
    last = path[-1]
    if not isinstance(last, int):
        raise Refused(f"{label_of(last)} is not an entry in a list")
    return last


def _first_value(study: Study, path: Path) -> Any:
    """Return the default of a key, or an initial value; for a table with the keys without which it is incomplete."""
    value = as_written(initial_value(study.document, path))
    if value != {}:
        return value
    after, _ = study.with_edits(Set(path, {}))
    needed = [row.path for row in rows(after.document, path) if row.required]
    while needed:
        value |= {str(place[-1]): as_written(initial_value(after.document, place)) for place in needed}
        after, _ = study.with_edits(Set(path, value))
        inner = (fault.path for fault in after.faults if fault.path[:-1] == path)
        needed = [place for place in inner if value_at(after.document, place) is None]
    return value
