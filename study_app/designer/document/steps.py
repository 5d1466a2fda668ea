"""The study designer's requests, each of which makes one undo step, and its other tasks."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import KW_ONLY, dataclass, fields, is_dataclass, replace
from functools import cache
from pathlib import Path as File
from typing import Any, Final, Literal, TypeAlias

from study_app.designer.document.additions import (
    check_values,
    edits_to_add,
    edits_to_add_language,
    edits_to_copy_with,
    edits_to_duplicate,
    edits_to_fill_in,
    edits_to_move,
    edits_to_remove_language,
    edits_to_switch,
    number_row,
    short_text_edits,
    surplus_edits,
    toml_types,
    with_required_edits,
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
    paths_to_delete,
    referenced_element,
    references_to,
    row_at,
    rows,
    unit_of,
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
"""Returns the IDs of an element and its neighbours under which answers have been recorded."""


@dataclass(frozen=True, slots=True)
class Step:
    """One undo step: edits of the study, and how the windows show them."""

    title: str  # such as "Move Honey up"
    edits: tuple[Edit, ...]
    select: Path | None = None  # the selection after the step; None keeps the current one
    continues: object = None  # steps with the same value are merged: typing in one field is one step
    text: str | None = None  # the text to edit; None for the current text
    _: KW_ONLY
    announcement: str = ""  # the text for screen readers
    removed: str = ""  # the title of what it deletes
    fresh: Literal["", "new", "copy"] = (
        ""  # whether the selected element is new: its first text takes the keyboard focus
    )
    entry: Path = ()  # the part that the step adds or changes in kind; it is unfinished until the focus leaves it


@dataclass(frozen=True, slots=True)
class StepContext:
    """The context of a step: the study, the selection, and ids with recorded answers."""

    study: Study
    selected: Path = ()
    recorded: Recorded = lambda _element: frozenset()


class Request:
    """A requested change; `step` raises Refused if it is impossible in the study."""

    __slots__ = ()

    def step(self, context: StepContext) -> Step:
        raise NotImplementedError


@dataclass(frozen=True, slots=True)
class SetValue(Request):
    """Set the value of a key or entry; consecutive changes while typing in one field are one step."""

    path: Path
    value: Any
    typing: bool = False

    def step(self, context: StepContext) -> Step:
        edits = with_required_edits(context.study, self.path, Set(self.path, self.value))
        entry = self.path[:2] if self.path[:1] == ("blocks",) and self.path[2:] == ("design",) else ()
        if self.typing and self.path[::2][:2] == ("scales", "labels"):
            entry = self.path[:3]  # a label alone is a problem until the others are typed
        return Step(f"Change {label_at(self.path)}", edits, None, self.path if self.typing else None, entry=entry)


@dataclass(frozen=True, slots=True)
class SetText(Request):
    """Set a text in one language; an empty text is removed if there is one in another language."""

    path: Path
    language: str
    text: str

    def step(self, context: StepContext) -> Step:
        languages = languages_of(context.study.document)
        value = value_at(context.study.document, self.path)
        edit: Edit
        title = f"Type {label_at(self.path)}"
        if isinstance(value, Mapping) and not self.text.strip() and value.keys() - {self.language}:
            removals = (Unset((*self.path, self.language)),) if self.language in value else ()
            return Step(title, removals, continues=(self.path, self.language))
        if isinstance(value, Mapping):
            edit = Set((*self.path, self.language), self.text)
        elif len(languages) == 1:
            edit = Set(self.path, self.text)
        else:
            texts = {languages[0]: value} if isinstance(value, str) else {}
            edit = Set(self.path, {**texts, self.language: self.text})
        edits = (edit, *short_text_edits(context.study, self.path, self.language, self.text))
        return Step(title, edits, continues=(self.path, self.language))


@dataclass(frozen=True, slots=True)
class LeaveText(Request):
    """Report that a text field was left; a new element then gets an id from its text."""

    path: Path


@dataclass(frozen=True, slots=True)
class RemoveKey(Request):
    """Remove a key or an entry of a list."""

    path: Path

    def step(self, context: StepContext) -> Step:
        edits = with_required_edits(context.study, self.path, Unset(self.path))
        title, last = label_at(self.path), self.path[-1]
        if isinstance(last, str):
            return Step(f"Remove {title}", edits, removed=title)
        removed, around = f"{element_noun(self.path[-2])} {title}", self.path[:-1]
        return Step(f"Remove {title}", edits, removed=removed, entry=around[:2])  # another entry may replace this one


@dataclass(frozen=True, slots=True)
class AddKey(Request):
    """Add an optional key with its default or an initial value."""

    path: Path

    def step(self, context: StepContext) -> Step:
        edits = with_required_edits(context.study, self.path, Set(self.path, _first_value(context.study, self.path)))
        return Step(f"Add {label_at(self.path)}", edits, entry=self.path)


@dataclass(frozen=True, slots=True)
class AddEntry(Request):
    """Append an entry to a list; None stands for an initial value."""

    path: Path
    value: Any = None

    def step(self, context: StepContext) -> Step:
        row = row_at(context.study.document, self.path)
        entries = row.value if row is not None and isinstance(row.value, tuple) else ()
        value = self.value
        if value is None:
            if row is None:
                raise Refused("new elements cannot be added here")
            if row.kind == "list":
                edits, path = edits_to_add(context.study, self.path)
                return Step(f"Add {element_noun(self.path[-1])}", edits, entry=path)
            first = initial_value({}, self.path) if not entries else entries[-1]
            value = toml_types(first[0] if not entries and isinstance(first, list | tuple) else first)
        edit: Edit = Insert((*self.path, len(entries)), value) if entries else Set(self.path, [value])
        edits = with_required_edits(context.study, self.path, edit)
        return Step(f"Add to {label_of(self.path[-1])}", edits, entry=(*self.path, len(entries)))


@dataclass(frozen=True, slots=True)
class SwitchKind(Request):
    """Change the kind of a table."""

    path: Path
    kind: str | None

    def step(self, context: StepContext) -> Step:
        title = f"Switch to {label_of(self.kind or 'nothing').lower()}"
        return Step(title, edits_to_switch(context.study, self.path, self.kind), entry=self.path)


@dataclass(frozen=True, slots=True)
class SwitchKey(Request):
    """Replace one key by another in a table in which exactly one of the two is given."""

    path: Path
    to: str

    def step(self, context: StepContext) -> Step:
        place = (*self.path[:-1], self.to)
        removals = () if value_at(context.study.document, self.path) is None else (Unset(self.path),)
        value = _first_value(context.study.with_edits(*removals)[0], place)
        if value in ("", []):
            raise Refused(f"{label_of(self.to)} refers to an element that does not exist yet: add that element first")
        edits = *removals, Set(place, value)
        edits = (*edits, *surplus_edits(context.study, place, edits))
        return Step(f"Specify {label_of(self.to)}", edits, entry=self.path[:-1])


@dataclass(frozen=True, slots=True)
class AddElement(Request):
    """Add an element to a section or list of tables, after the selected one of its kind."""

    section: Path

    def step(self, context: StepContext) -> Step:
        section, selected = self.section, context.selected
        is_inside = selected[: len(section)] == section and len(selected) > len(section)
        previous = selected[len(section)] if is_inside else None
        edits, path = edits_to_add(context.study, section, behind=previous)
        edits = _edits_next_to(context.study, edits, selected, path)
        title, announcement = f"Add {element_noun(section[-1])}", _addition_notice(context.study, edits, path)
        return Step(title, edits, path, announcement=announcement, fresh="new", entry=path)


def _addition_notice(study: Study, edits: tuple[Edit, ...], path: Path) -> str:
    """Return a sentence that lists the elements added together with the one at ``path``; "" if there are none."""
    after = study.with_edits(*edits)[0].document
    sections = [str(row.path[0]) for row in rows(after, ()) if row.kind == "tables"]
    added_paths = [(section, name) for section in sections for name in names(after, section)
           if name not in names(study.document, section) and (section, name) != path[:2]]  # fmt: skip
    names_added = ", ".join(unique_name(after, other) for other in added_paths)
    return (
        f"Also added, because the study needs it: {names_added}. {label_of(added_paths[0][0])} lists it."
        if added_paths
        else ""
    )


@dataclass(frozen=True, slots=True)
class AddNamed(Request):
    """Add an element to a section, and a reference to it at ``path``, in a list at its end."""

    path: Path
    section: str

    def step(self, context: StepContext) -> Step:
        row = row_at(context.study.document, self.path)
        edits, path = edits_to_add(context.study, (self.section,))
        if row is not None and row.kind == "references":
            references = value_at(context.study.with_edits(*edits)[0].document, self.path) or ()
            if path[1] not in references:
                entry = (*self.path, len(references))
                edits = (*edits, Insert(entry, path[1]) if references else Set(self.path, [path[1]]))
        else:
            edits = with_required_edits(context.study, self.path, *edits, Set(self.path, path[1]))
        return Step(f"Add {element_noun(self.section)}", edits, path, fresh="new", entry=path)


@dataclass(frozen=True, slots=True)
class AddInstrument(Request):
    """Add a standard questionnaire; if it lacks a language of the study, its texts are copied into the study."""

    name: str

    def step(self, context: StepContext) -> Step:
        table, edits = _instrument_edits(context.study, self.name)
        path = ("questionnaires", free_id(names(context.study.document, "questionnaires"), self.name.replace("-", "_")))
        codes, available = languages_of(context.study.document), Instrument(self.name).table["languages"]
        missing_languages, announcement = [language_name(code) for code in codes if code not in available], ""
        if 0 < len(missing_languages) < len(codes):
            hint = "The next problem (F8), or “Write…” at the study's languages, lists them"
            announcement = f"The program does not include the {' and '.join(missing_languages)} texts. {hint}."
        return Step(f"Add {self.name}", (*edits, Set(path, table)), path, announcement=announcement, entry=path)


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

    def step(self, context: StepContext) -> Step:
        element, key = self.path[:-1], self.path[-1]
        old_table: Any = value_at(context.study.document, element)
        edits: tuple[Edit, ...] = ()
        if key == "instrument":
            table, edits = _instrument_edits(context.study, self.name)
            table |= {"title": old_table["title"]} if "title" in old_table else {}
        else:
            file = self.name
            with suppress(ValueError):  # on another drive
                file = os.path.relpath(file, context.study.folder)
            table = {"file": File(file).as_posix()}
        removals = (Unset((*element, other)) for other in old_table if other not in table)
        settings = (Set((*element, other), toml_types(value)) for other, value in table.items())
        return Step(f"Use {label_of(key).lower()} {File(self.name).stem}", (*edits, *settings, *removals))


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

    If ``path`` is that of a block's conditions, the block lists the new condition. With ``path`` the selection stays. A
    study that does not state a scale gets that of the shipped study, since the device may not be able to present the
    liquid at another scale.
    """

    source: str
    name: str
    path: Path = ()

    @property
    def label(self) -> str:
        """The label that distinguishes shipped liquids: "Water liquid, 998.2 kg/m³, 0.001 Pa·s", or effects or kind."""
        table = shipped_liquids()[self.source, self.name]
        numbers = {**table, **table.get("drag", {})}.items()
        facts = [f"{value:.4g} {unit_of(key)}" for key, value in numbers if isinstance(value, int | float)]
        kind, effects = table.get("non_newtonian", {}).get("kind"), table.get("effects")
        named = (label_of(kind),) if kind else effects if isinstance(effects, tuple) else ()
        return ", ".join((f"{label_of(self.name)} liquid", *facts, *named))

    def help(self, study: Study) -> str:
        """Return the origin of the liquid, and whether the scale of the scene changes or the forces differ."""
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
        theirs, own = (value_at(document, _SCALE) or initial_value(document, _SCALE) for document in documents)
        return theirs, own

    def step(self, context: StepContext) -> Step:
        document = context.study.document
        name = free_id((*names(document, "liquids"), *names(document, "conditions")), self.name)
        edits: tuple[Edit, ...] = (Set(("liquids", name), toml_types(shipped_liquids()[self.source, self.name])),)
        in_conditions = self.path[::2] == ("blocks", "conditions")
        if names(document, "conditions") and (in_conditions or not self.path):
            edits = (*edits, Set(("conditions", name), {"liquid": name}))
        if in_conditions:
            condition_ids = value_at(document, self.path) or ()
            edits = (
                *edits,
                Insert((*self.path, len(condition_ids)), name) if condition_ids else Set(self.path, [name]),
            )
        elif self.path:
            edits = (*edits, Set(self.path, name))
        theirs, own = self._scales(context.study)
        if theirs != own and value_at(document, _SCALE) is None:
            edits = (*edits, Set(_SCALE, theirs))
        select: Path | None = None if self.path else ("liquids", name)
        announcement = self.help(context.study) if self.path else ""
        return Step(
            f"Add {label_of(self.name).lower()}", edits, select, announcement=announcement, entry=("liquids", name)
        )


def shipped_liquids_to_add(study: Study, path: Path = ()) -> tuple[AddLiquid, ...]:
    """Return a request for each shipped liquid; equal liquids with the same name are listed once."""
    by_text: dict[tuple[str, str], AddLiquid] = {}
    for source, name in shipped_liquids():
        request = AddLiquid(source, name, path)
        by_text.setdefault((request.label, request.help(study).replace(source, "")), request)
    return tuple(by_text.values())


@dataclass(frozen=True, slots=True)
class ChangeLanguage(Request):
    """Add a language to every text, fill its missing texts from the first language, or remove it."""

    how: Literal["add", "copy", "remove"]
    language: str

    def step(self, context: StepContext) -> Step:
        verb = {"add": "Add", "copy": "Fill in", "remove": "Remove"}[self.how]
        edits = {"add": edits_to_add_language, "copy": edits_to_fill_in, "remove": edits_to_remove_language}[self.how](
            context.study, self.language
        )
        return Step(f"{verb} {language_name(self.language)}", edits)


@dataclass(frozen=True, slots=True)
class DuplicateElement(Request):
    """Copy an element right after itself, and its session step right after that of the original.

    With ``stays`` the selection is kept, for example if an entry of a list in the form is copied.
    """

    path: Path
    stays: bool = False

    def step(self, context: StepContext) -> Step:
        path, value = self.path, value_at(context.study.document, self.path)
        if isinstance(value, Mapping) or not isinstance(path[-1], int):
            edits, copy = edits_to_duplicate(context.study, path)
        else:
            copy = (*path[:-1], path[-1] + 1)
            edits = (Insert(copy, list(value) if isinstance(value, tuple) else value),)
        title, edits = (
            f"Duplicate {title_of(context.study.document, path)}",
            _edits_next_to(context.study, edits, path, copy),
        )
        return Step(title, edits, entry=copy) if self.stays else Step(title, edits, copy, fresh="copy", entry=copy)


@dataclass(frozen=True, slots=True)
class MakeSeries(Request):
    """Copy an element once for each value of the number ``field``, which may be a number of a block's conditions.

    The blocks that list the element also list its copies, unless this would cause a problem.
    """

    path: Path
    field: Path
    values: tuple[int | float, ...]

    def step(self, context: StepContext) -> Step:
        study = context.study
        check_values(study.document, number_row(study.document, self.path, self.field), self.values)
        edits: tuple[Edit, ...] = ()
        paths, current = [self.path], study
        for value in self.values:
            row = number_row(current.document, paths[-1], self.field)
            copy_edits, copy = edits_to_copy_with(current, paths[-1], row, value)
            copy_edits = _edits_next_to(current, copy_edits, paths[-1], copy)
            current, _ = current.with_edits(*copy_edits)
            for place in references_to(current.document, paths[-1]):
                if place[0] != "blocks" or not isinstance(place[-1], int):
                    continue
                listing = Insert((*place[:-1], place[-1] + 1), copy[1])
                with_listing, _ = current.with_edits(listing)
                if len(with_listing.faults) <= len(current.faults):
                    current, copy_edits = with_listing, (*copy_edits, listing)
            edits = (*edits, *copy_edits)
            paths.append(copy)
        title = f"Make {counted_elements(len(self.values), self.path[0])} of {title_of(study.document, self.path)}"
        announcement = ", ".join(title_of(current.document, path) for path in paths[1:])
        return Step(title, edits, paths[1], announcement=announcement, entry=paths[1])


@dataclass(frozen=True, slots=True)
class MoveElement(Request):
    """Move an element among its neighbours by a number of places."""

    path: Path
    by: int

    def step(self, context: StepContext) -> Step:
        document, by = context.study.document, self.by
        entry, title = step_of(document, self.path), title_of(document, self.path)
        if entry is None:
            raise Refused(f"{title} is not part of an ordered list, so it cannot be moved")
        to = index_of(entry) + (by if by < 0 else 1 + by)
        if not 0 <= to <= len(value_at(document, entry[:-1])):
            raise Refused(f"{title} is already {'first' if by < 0 else 'last'} in the list")
        return _move_step(context.study, self.path, entry, to, f"Move {title} {'up' if by < 0 else 'down'}")


@dataclass(frozen=True, slots=True)
class MoveTo(Request):
    """Move an entry of a list before the one at the index ``to``; the list's length means its end.

    With ``stays`` the selection is kept.
    """

    entry: Path
    to: int
    stays: bool = False

    def step(self, context: StepContext) -> Step:
        element = referenced_element(context.study.document, self.entry) or self.entry
        step = _move_step(
            context.study, element, self.entry, self.to, f"Move {title_of(context.study.document, element)}"
        )
        return replace(step, select=None) if self.stays else step


@dataclass(frozen=True, slots=True)
class AddToSession(Request):
    """Add an element to the session before each of the steps at ``places``."""

    path: Path
    places: tuple[Path, ...]

    def step(self, context: StepContext) -> Step:
        title, places = title_of(context.study.document, self.path), sorted(self.places, key=index_of, reverse=True)
        announcement = f"{title}, now step {index_of(places[-1]) + 1}"
        return Step(
            f"Add {title} to the session",
            tuple(Insert(place, self.path[1]) for place in places),
            announcement=announcement,
        )


@dataclass(frozen=True, slots=True)
class DeleteElement(Request):
    """Delete an element: "all" with everything that requires it, "other" with a replacement, "gaps" alone."""

    path: Path
    how: Literal["all", "other", "gaps"] = "gaps"
    other: str = ""

    def step(self, context: StepContext) -> Step:
        path, document = self.path, context.study.document
        title = f"Delete {title_of(document, path)}"
        if self.how == "other":
            edits = edits_to_replace(document, path, self.other)
            return Step(title, edits, (*path[:-1], self.other), removed=title_of(document, path))
        if isinstance(path[-1], int):
            select: Path = path[:2]
        else:
            others = [name for name in names(document, str(path[0])) if name != path[1]]
            select = (path[0], others[0]) if others else path[:1]
        deleted = (path,) if self.how == "gaps" else paths_to_delete(document, path, context.study.is_required)
        if any(select[: len(path)] == path for path in deleted):
            select = ("study",)
        return Step(title, edits_to_delete(deleted), select, removed=title_of(document, path))


@dataclass(frozen=True, slots=True)
class RenameElement(Request):
    """Change the id of an element and all references to it."""

    path: Path
    name: str

    def step(self, context: StepContext) -> Step:
        edits = edits_to_rename(context.study.document, self.path, self.name, context.recorded(self.path))
        renamed_path = self.path if isinstance(self.path[-1], int) else (*self.path[:-1], self.name)
        reference_count = len(references_to(context.study.document, self.path))
        announcement = f"{counted(reference_count, 'place')} updated" if reference_count else ""
        return Step(
            ", ".join(filter(None, (f"Rename to {self.name}", announcement))),
            edits,
            renamed_path,
            announcement=announcement,
        )


@dataclass(frozen=True, slots=True)
class RetypeFile(Request):
    """Replace the file's text by that of the text editor."""

    text: str

    def step(self, context: StepContext) -> Step:
        return Step("Edit the file", (), continues="file", text=with_own_line_ends(context.study.text, self.text))


@dataclass(frozen=True, slots=True)
class Several(Request):
    """Several requests, executed in order as one step."""

    title: str
    requests: tuple[Request, ...]

    def step(self, context: StepContext) -> Step:
        edits: tuple[Edit, ...] = ()
        study = context.study
        for request in self.requests:
            step = request.step(replace(context, study=study))
            study, _ = study.with_edits(*step.edits)
            edits += step.edits
        only_removes = all(isinstance(request, RemoveKey) for request in self.requests)
        return Step(self.title, edits, removed=self.title.removeprefix("Remove ") if only_removes else "")


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
    """Return a request or path with the path of one element replaced, for example after a rename."""
    if isinstance(asked, tuple):
        if asked[: len(before)] == before:
            return (*after, *asked[len(before) :])
        return tuple(with_path(part, before, after) for part in asked)
    if is_dataclass(asked) and not isinstance(asked, type):
        parts = {part.name: getattr(asked, part.name) for part in fields(asked)}
        return replace(asked, **{name: with_path(value, before, after) for name, value in parts.items()})
    return asked


def _edits_next_to(study: Study, edits: tuple[Edit, ...], original: Path, copy: Path) -> tuple[Edit, ...]:
    """Return the edits that add an element, and the one that moves its session step after the original's."""
    after, _ = study.with_edits(*edits)
    original_step, copy_step = step_of(after.document, original), step_of(after.document, copy)
    if original_step is None or copy_step is None or copy_step == copy or copy_step[:-1] != original_step[:-1]:
        return edits
    target_index = index_of(original_step) + (index_of(copy_step) > index_of(original_step))
    return edits if index_of(copy_step) == target_index else (*edits, Move(copy_step, target_index))


def _move_step(study: Study, element: Path, entry: Path, to: int, title: str) -> Step:
    edits, after = edits_to_move(study, entry, to)
    count = len(value_at(study.document, entry[:-1]))
    announcement = f"{title_of(study.document, element)}, now {index_of(after) + 1} of {count}"
    return Step(title, edits, after if element == entry else element, announcement=announcement)


def index_of(path: Path) -> int:
    """Return the index of an entry of a list."""
    last = path[-1]
    if not isinstance(last, int):
        raise Refused(f"{label_of(last)} is not an entry in a list")
    return last


def _first_value(study: Study, path: Path) -> Any:
    """Return the default of a key, or an initial value; a table has the keys that it requires."""
    value = toml_types(initial_value(study.document, path))
    if value != {}:
        return value
    after, _ = study.with_edits(Set(path, {}))
    required_paths = [row.path for row in rows(after.document, path) if row.required]
    while required_paths:
        value |= {str(place[-1]): toml_types(initial_value(after.document, place)) for place in required_paths}
        after, _ = study.with_edits(Set(path, value))
        missing_paths = (fault.path for fault in after.faults if fault.path[:-1] == path)
        required_paths = [place for place in missing_paths if value_at(after.document, place) is None]
    return value
