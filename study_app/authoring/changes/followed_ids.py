"""Ids of elements that were added while a study is open: each follows its element's text until it is edited by hand."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from study_app.authoring.changes.languages import languages_of
from study_app.authoring.edited_study import Study
from study_app.authoring.names import renamed, taken_beside
from study_app.authoring.writer.edits import Edit
from study_app.ids import MAX_FROM_TEXT, free_id, id_of
from study_app.protocol.source.document import Path, value_at


@dataclass(frozen=True, eq=False)
class _New:
    """A new element, and its initial id."""

    began: str | int


class FollowedIds:
    """Identifies elements by section and id, since an index in a list changes with insertions.

    The initial id of an element stays known, since its steps may be undone; later ids are known again only if undo or
    redo restores them.
    """

    def __init__(self) -> None:
        self._known: dict[Path, _New] = {}
        self._left: dict[Path, _New] = {}

    def add(self, study: Study, path: Path) -> None:
        """Let the id of a new element follow its text."""
        key = _key(study.document, path)
        self._known[key] = _New(key[-1])

    def rename(self, study: Study, path: Path, name: str) -> None:
        """Stop an id entered by the user from following; elements below it continue."""
        key = _key(study.document, path)
        new = (*key[:-1], name)
        below = {one: its for one, its in self._below(key, new).items() if one != new}
        self._forget(new)
        self._left.pop(new, None)
        self._known |= below

    def forget_brought(self, before: Study, after: Study) -> None:
        """Stop ids in a typed or pasted text from following."""
        for key in _brought({**self._known, **self._left}, before, after):
            self._known.pop(key, None)
            self._left.pop(key, None)

    def go_on(self, before: Study, after: Study) -> None:
        """Let ids that undo or redo restores follow again."""
        for key in _brought(self._left, before, after):
            self._known[key] = self._left.pop(key)

    def element(self, study: Study, path: Path) -> object:
        """Return the key of a new element, which does not depend on its id; None if its id does not follow its text."""
        return self._known.get(_key(study.document, path))

    def followed(
        self, study: Study, path: Path, language: str, text: str, recorded: frozenset[str]
    ) -> tuple[tuple[Edit, ...], Path]:
        """Return the edits that give an element the id of its text, and its path after them.

        Parameters
        ----------
        study : Study
            The study before the text is typed.
        path : tuple of str or int
            The text.
        language, text : str
            Its language, and the new text; with several languages the first one counts.
        recorded : sequence of str
            Ids of the same table with recorded answers: none is changed or given to another element.
        """
        element, document = path[:-1], study.document
        wanted, key = id_of(text, MAX_FROM_TEXT), _key(document, element)
        own = str(key[-1])
        of_element = path[-1] == ("text" if isinstance(element[-1], int) else "title")
        if key not in self._known or not of_element or language not in languages_of(study)[:1]:
            return (), element
        name = free_id(taken_beside(document, element) | recorded, wanted) if wanted else own
        if name == own or own in recorded:
            return (), element
        new = (*key[:-1], name)
        moved = self._below(key, new)
        for one in [one for one, its in self._known.items() if its is moved[new] and one[-1] != its.began]:
            self._left |= self._forget(one)
        self._known |= moved
        return renamed(document, element, name), element if isinstance(element[-1], int) else new

    def _below(self, key: Path, new: Path) -> dict[Path, _New]:
        """Return an element and those below it, under the element's new id."""
        return {(*new, *one[len(key) :]): its for one, its in self._known.items() if one[: len(key)] == key}

    def _forget(self, key: Path) -> dict[Path, _New]:
        """Remove an element and those below it, and return them."""
        gone = self._below(key, key)
        self._known = {one: its for one, its in self._known.items() if one not in gone}
        return gone


def _key(document: Mapping[str, Any], path: Path) -> Path:
    """Return section and id of an element."""
    name = value_at(document, (*path, "id")) if isinstance(path[-1], int) else path[-1]
    return (*path[:-1], str(name))


def _brought(known: Iterable[Path], before: Study, after: Study) -> list[Path]:
    """Return the elements that are only in the later study."""
    return [key for key in known if _has(after.document, key) and not _has(before.document, key)]


def _has(document: Mapping[str, Any], key: Path) -> bool:
    """Return whether a section has an element of an id."""
    inside = value_at(document, key[:-1])
    if isinstance(inside, tuple):
        return any(isinstance(one, Mapping) and one.get("id") == key[-1] for one in inside)
    return isinstance(inside, Mapping) and key[-1] in inside
