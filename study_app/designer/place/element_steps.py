"""Steps that add, copy, move, paste and delete whole elements, one or several at once."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from study_app.designer.document.additions import added, duplicated, fitted
from study_app.designer.document.edited_study import Study
from study_app.designer.document.elements import title_of
from study_app.designer.document.fields import label_of, row_at
from study_app.designer.document.fragments import pasted
from study_app.designer.document.initial_values import counted_elements, singular
from study_app.designer.document.languages import filled_in, languages_of, with_language, without_language
from study_app.designer.document.moves import moved
from study_app.designer.document.names import (
    deletions,
    left_without,
    named_at,
    references_to,
    replaced,
    with_references,
)
from study_app.designer.document.series import check_values, copy_with, listings, number_row
from study_app.designer.document.writer.edits import Edit, Insert, Move, Set
from study_app.designer.document.writer.refused import Refused
from study_app.designer.form.element_facts import kind_and_title
from study_app.designer.form.form_rows import step_of
from study_app.designer.place.prompt_facts import DeletePrompt
from study_app.designer.place.requests import (
    AddElement,
    AddInstrument,
    AddNamed,
    ChangeLanguage,
    DeleteElement,
    DuplicateElement,
    MakeSeries,
    MoveElement,
    MoveTo,
    Paste,
)
from study_app.designer.problems.problem_rows import element_of
from study_app.ids import free_id
from study_app.protocol.questionnaires import instrument
from study_app.protocol.source.document import Path, names, value_at
from study_app.protocol.wording.languages import language_name


@dataclass(frozen=True, slots=True)
class Step:
    """One step of a study.

    Attributes
    ----------
    words : str
        What it does.
    edits : tuple of Edit
        Its edits.
    select : tuple of str or int or None
        What is selected after it; None stands for the same.
    continues : object
        What it may continue: typing in one field is one step.
    text : str
        The file's text that the edits are made in, "" for the text that there is.
    several : tuple of path
        Elements that are selected together after it.
    said : str
        What a screen reader says of it.
    fresh : bool
        Whether what is selected after it is new: its first text takes the keyboard.
    """

    words: str
    edits: tuple[Edit, ...]
    select: Path | None = None
    continues: object = None
    text: str = ""
    several: tuple[Path, ...] = ()
    said: str = ""
    fresh: bool = False


def add(study: Study, asked: AddElement, selected: Path) -> Step:
    """Return the step that adds an element after the selected one of its kind, and beside its step in the session."""
    section = asked.section
    behind = selected[len(section)] if selected[: len(section)] == section and len(selected) > len(section) else None
    edits, path = added(study, section, dict([asked.kind]) if asked.kind else None, behind=behind)
    return Step(f"Add {singular(section[-1])}", beside(study, edits, selected, path), path, fresh=True)


def add_named(study: Study, asked: AddNamed) -> Step:
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


def add_instrument(study: Study, asked: AddInstrument) -> Step:
    """Return the step that adds a standard questionnaire; its questions are listed where the study writes texts."""
    source, languages = instrument(asked.name), languages_of(study)
    table: dict[str, Any] = {"instrument": asked.name}
    if not set(languages) <= set(source["languages"]):
        table["items"] = [{"id": item["id"]} for item in source["items"]]
    path = ("questionnaires", free_id(names(study.document, "questionnaires"), asked.name.replace("-", "_")))
    return Step(f"Add {asked.name}", (Set(path, table),), path)


def change_language(study: Study, asked: ChangeLanguage) -> Step:
    """Return the step that adds a language, fills in its texts or takes it away."""
    code = asked.language
    words = {"add": "Add", "copy": "Fill in", "remove": "Remove"}[asked.how]
    edits = {"add": with_language, "copy": filled_in, "remove": without_language}[asked.how](study, code)
    return Step(f"{words} {language_name(code)}", edits)


def duplicate(study: Study, asked: DuplicateElement) -> Step:
    """Return the step that copies elements; the step of each in the session comes right after that of the original."""
    edits: tuple[Edit, ...] = ()
    copies: list[Path] = []
    now = study
    for path in _last_first((asked.path, *asked.also)):
        made, copy = _copied(now, path)
        made = beside(now, made, path, copy)
        copies = [*(_after_insert(one, copy) for one in copies), copy]
        edits = (*edits, *made)
        now, _ = now.edited(*made)
    words = f"Duplicate {_titles(study, (asked.path, *asked.also))}"
    return Step(words, edits, copies[0], several=tuple(copies), fresh=len(copies) == 1)


def make_series(study: Study, asked: MakeSeries) -> Step:
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


def move(study: Study, asked: MoveElement) -> Step:
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


def move_to(study: Study, asked: MoveTo) -> Step:
    """Return the step that moves entries of a list to another place in it."""
    things = tuple(_named(study, entry) for entry in asked.entries)
    return _moved(study, things, asked.entries, asked.to, f"Move {_titles(study, things)}")


def _moved(study: Study, things: Sequence[Path], entries: Sequence[Path], to: int, words: str) -> Step:
    edits, after = moved(study, entries, to)
    by_entry = dict(zip(sorted(entries, key=_index), after, strict=True))
    paths = tuple(by_entry[entry] if thing == entry else thing for thing, entry in zip(things, entries, strict=True))
    entry = by_entry[entries[0]]
    count = len(value_at(study.document, entry[:-1]))
    said = f"{title_of(study.document, things[0])}, now {_index(entry) + 1} of {count}"
    return Step(words, edits, paths[0], several=paths, said=said)


def _named(study: Study, entry: Path) -> Path:
    """Return the element that an entry of the session stands for; the entry itself where it is the element."""
    return named_at(study.document, entry) or entry


def paste(study: Study, asked: Paste) -> Step:
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


def delete(study: Study, asked: DeleteElement) -> Step:
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


def _last_first(paths: Sequence[Path]) -> list[Path]:
    """Return paths with later entries of a list before earlier ones, so that the places of the others stay."""
    return sorted(paths, key=lambda path: -path[-1] if isinstance(path[-1], int) else 0)


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
