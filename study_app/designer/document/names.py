"""What names what in a study, both ways; and the edits that rename, replace or delete a thing with what names it."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from study_app.designer.document.toml_edits import Edit, Rename, Set, Unset
from study_app.designer.document.toml_text import Refused
from study_app.ids import MAX_FROM_TEXT, MAX_ID, free_id, id_of
from study_app.protocol.checks.cross_references import CHOICES, ITEM_REFERENCES
from study_app.protocol.source.document import Path, entries, has, names, value_at

Document = Mapping[str, Any]
ITEMS = "items"
_BESIDE = {"sequence", "groups", "analysis"}
"""Tables that name elements without presenting them."""
_MAY_LEAVE_OUT = (("blocks", "task"), ("stimuli", "condition"))
"""Sections whose tables may leave a key out, which then stands for the only table that it may name."""


def named_at(document: Document, place: Path) -> Path | None:
    """Return the path of what the text at ``place`` names; None where it names nothing that is there."""
    name = value_at(document, place)
    if not isinstance(name, str):
        return None
    for pattern in CHOICES:
        if _matches(place, pattern):
            for section in _sections(document, pattern):
                if has(document.get(section), name):
                    return section, name
    if any(_matches(place, pattern) for pattern in ITEM_REFERENCES):
        return next((path for path, item in _items(document) if item["id"] == name and _in_reach(place, path)), None)
    return None


def references_to(document: Document, thing: Path) -> tuple[Path, ...]:
    """Return the places of the texts that name a table, as ``("liquids", "water")``, or an item."""
    return tuple(place for place, named in named_places(document) if named == thing)


def blocks_using(document: Document, element: Path) -> tuple[str, ...]:
    """Return the blocks that use an element: themselves, or by a condition, stimulus, questionnaire that names it."""
    naming: dict[Path, list[Path]] = {}
    for place, named in uses(document):
        naming.setdefault(named[:2], []).append(place[:2])
    around = [element[:2]]
    for inner in around:  # grows while it is read
        if inner[0] != "blocks":
            around += [one for one in naming.get(inner, ()) if one not in around and one[0] not in _BESIDE]
    users = {name for section, *rest in around if section == "blocks" for name in rest}
    return tuple(name for name in names(document, "blocks") if name in users)


def choices_at(document: Document, place: Path) -> tuple[str, ...] | None:
    """Return the names that a text at ``place`` may have; None where it is not a reference."""
    for pattern in CHOICES:
        if _matches(place, pattern):
            return tuple(name for section in _sections(document, pattern) for name in names(document, section))
    if any(_matches(place, pattern) for pattern in ITEM_REFERENCES):
        found = (item for path, item in _items(document) if _in_reach(place, path))
        return tuple(dict.fromkeys(str(item["id"]) for item in found))
    return None


def sections_at(place: Path) -> tuple[str, ...]:
    """Return the sections whose tables a text at ``place`` may name; none where it names no table."""
    return next((sections for pattern, sections in CHOICES.items() if _matches(place, pattern)), ())


def renamed(document: Document, thing: Path, name: str, recorded: frozenset[str] = frozenset()) -> tuple[Edit, ...]:
    """Return the edits that rename a table or item, and every text that names it.

    Where the name is refused, a free one is proposed that is not one of those with ``recorded`` answers.
    """
    item = _item_id(document, thing)
    taken = taken_beside(document, thing)
    title = value_at(document, (*thing, "text" if item is not None else "title"))
    text = next(iter(title.values()), "") if isinstance(title, Mapping) else title
    own = str(item or thing[-1])
    wanted = id_of(name) or id_of(str(text or ""), MAX_FROM_TEXT) or id_of(own) or "question"
    free = free_id(taken | (recorded - {own}), wanted)
    check_id(name, free)
    if name in taken:
        where = "" if item is None else " by another item of this questionnaire"
        raise Refused(f'the name "{name}" is taken{where}: "{free}" is free', free)
    if item is None:
        return (Rename(thing, name, references_to(document, thing)),)
    return (Set((*thing, "id"), name), *(Set(place, name) for place in references_to(document, thing)))


def languages_of(document: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the languages of a study; a file that names none has English."""
    return tuple(str(code) for _, code in entries(document, "study.languages.*")) or ("en",)


def id_at(document: Document, thing: Path) -> str:
    """Return the id of a table or item; "" where there is none."""
    return str(_item_id(document, thing) or thing[-1]) if value_at(document, thing) is not None else ""


def suggested_id(document: Document, thing: Path, recorded: frozenset[str] = frozenset()) -> str:
    """Return the free id that the text of a table or item gives in the first language; "" for its own, or no text."""
    text = value_at(document, (*thing, "text" if _item_id(document, thing) is not None else "title"))
    if isinstance(text, Mapping):
        text = text.get(languages_of(document)[0])
    wanted = id_of(text, MAX_FROM_TEXT) if isinstance(text, str) else ""
    own = id_at(document, thing)
    free = free_id(taken_beside(document, thing) | (recorded - {own}), wanted) if wanted else ""
    return "" if free == own else free


def taken_beside(document: Document, thing: Path) -> set[str]:
    """Return the names that a table or item cannot have, since others have them."""
    if _item_id(document, thing) is None:
        node: Any = document
        for step in thing[:-1]:
            node = node[step] if has(node, step) else {}
        return {*(tuple(node) if isinstance(node, Mapping) else ())} - {str(thing[-1])}
    return {str(other["id"]) for path, other in _items(document) if (thing[:2] == path[:2]) and path != thing}


def replaced(document: Document, thing: Path, other: str) -> tuple[Edit, ...]:
    """Return the edits that delete a thing and let everything that named it name another one."""
    return (*(Set(place, other) for place in references_to(document, thing)), Unset(thing))


def with_references(document: Document, thing: Path, needs: Callable[[Path], bool]) -> tuple[Path, ...]:
    """Return the paths of all that must go with a thing, itself last: list entries, keys and whole tables.

    A table whose key ``needs`` says that it cannot be without goes too, and so does one whose list would be empty.
    """
    named: dict[Path, list[Path]] = {}
    for place, target in _uses_in_turn(document):
        named.setdefault(place, []).append(target)
    gone = [thing]
    for inner in gone:  # grows while it is read
        for place, targets in named.items():
            touched = any(_within(target, inner) for target in targets)
            if not touched or _covered(place, gone) or not all(_covered(target, gone) for target in targets):
                continue
            array = place[:-1]
            if not isinstance(place[-1], int):
                gone.append(place if value_at(document, place) is not None and not needs(place) else place[:2])
                continue
            gone.append(place)
            empty = all(_covered((*array, at), gone) for at in range(len(value_at(document, array))))
            if empty and len(array) > 2:
                gone.append(array[:2] if needs(array) else array)
    outermost = [one for one in gone[1:] if not _covered(one, (other for other in gone if other != one))]
    return (*outermost[::-1], thing)


def deletions(paths: Iterable[Path]) -> tuple[Edit, ...]:
    """Return the edits that remove all of these paths: later entries of an array first, nothing twice."""
    every = set(paths)
    outer = [path for path in every if not any(path[:length] in every for length in range(1, len(path)))]
    return tuple(
        Unset(path)
        for path in sorted(
            outer,
            key=lambda path: tuple((step, 0) if isinstance(step, str) else ("", step) for step in path),
            reverse=True,
        )
    )


def check_id(name: str, free: str = "") -> None:
    """Refuse what is not an id, and propose one that is."""
    plain = name.isascii() and name.replace("_", "a").isalnum() and name == name.lower()
    if not plain or not name[:1].isalpha() or len(name) > MAX_ID:
        rule = f"at most {MAX_ID} small letters, digits and underscores, a letter first"
        proposed = f'; "{free}" is free' if free else ""
        raise Refused(f'"{name}" is not an id: write {rule}{proposed}', free)


def _within(path: Path, outer: Path) -> bool:
    return path[: len(outer)] == outer


def _covered(path: Path, outer: Iterable[Path]) -> bool:
    return any(_within(path, one) for one in outer)


def named_places(document: Document) -> Iterator[tuple[Path, Path]]:
    """Yield every place of a text that names something, with what it names."""
    for pattern in CHOICES:
        for place, name in entries(document, pattern):
            for section in _sections(document, pattern):
                if isinstance(name, str) and has(document.get(section), name):
                    yield place, (section, name)
    items = list(_items(document))
    for pattern in ITEM_REFERENCES:
        for place, name in entries(document, pattern):
            for path, item in items:
                if item["id"] == name and _in_reach(place, path):
                    yield place, path


def uses(document: Document) -> Iterator[tuple[Path, Path]]:
    """Yield what `named_places` does, and each key that is left out with the only table that it may name."""
    yield from named_places(document)
    for section, key in _MAY_LEAVE_OUT:
        (of,) = _sections(document, f"{section}.*.{key}")
        yield from _left_out(document, section, key, of)


def left_without(document: Document, things: Iterable[Path]) -> tuple[Path, ...]:
    """Return the keys that are left out and mean nothing any more once all of these tables are gone."""
    gone = set(things)
    meant: dict[Path, set[Path]] = {}
    for place, named in _uses_in_turn(document):
        if value_at(document, place) is None:
            meant.setdefault(place, set()).add(named)
    return tuple(place for place, named in meant.items() if named <= gone)


def _uses_in_turn(document: Document) -> Iterator[tuple[Path, Path]]:
    """Yield what `uses` does, and what a key that is left out means once a study has no conditions any more."""
    yield from uses(document)
    if "conditions" in document:
        yield from _left_out(document, "stimuli", "condition", "liquids")


def _left_out(document: Document, section: str, key: str, of: str) -> Iterator[tuple[Path, Path]]:
    if len(only := names(document, of)) == 1:
        tables = entries(document, f"{section}.*")
        yield from (((*path, key), (of, only[0])) for path, table in tables if not has(table, key))


def _sections(document: Document, pattern: str) -> tuple[str, ...]:
    """Return the sections whose tables places may name; where a study has no conditions, each liquid is one."""
    sections = CHOICES[pattern]
    return ("liquids",) if sections == ("conditions",) and "conditions" not in document else sections


def _items(document: Document) -> Iterator[tuple[Path, Mapping[str, Any]]]:
    for path, item in entries(document, f"questionnaires.*.{ITEMS}.*"):
        if isinstance(item, Mapping) and isinstance(item.get("id"), str):
            yield path, item


def _item_id(document: Document, thing: Path) -> str | None:
    return next((item["id"] for path, item in _items(document) if path == thing), None)


def _in_reach(place: Path, item: Path) -> bool:
    """Return whether a text can name an item: within a questionnaire only those of the same one."""
    return place[0] != item[0] or place[1] == item[1]


def _matches(place: Path, pattern: str) -> bool:
    steps = pattern.split(".")
    return len(steps) == len(place) and all(step in {"*", str(one)} for step, one in zip(steps, place, strict=True))
