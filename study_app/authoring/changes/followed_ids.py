"""Ids of elements that were added while a study is open: each follows its element's text until it is edited by hand."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from study_app.authoring.changes.languages import languages_of
from study_app.authoring.edited_study import Study
from study_app.authoring.names import renamed, taken_beside
from study_app.authoring.writer.edits import Edit
from study_app.ids import MAX_FROM_TEXT, free_id, id_of
from study_app.protocol.source.document import Path, value_at


class FollowedIds:
    """Knows elements by section and id: a place in a list changes as others come before it.

    An id that an element had before is known, too, since a step may be undone.
    """

    def __init__(self) -> None:
        self._first: dict[Path, Path] = {}

    def add(self, study: Study, path: Path) -> None:
        """Let the id of a new element follow its text."""
        key = _key(study.document, path)
        self._first[key] = key

    def forget(self, study: Study, path: Path, name: str) -> None:
        """Let an id that is given by hand stay."""
        self._first.pop((*_key(study.document, path)[:-1], name), None)

    def first(self, study: Study, path: Path) -> Path | None:
        """Return section and id that a new element began with; None where its id does not follow its text."""
        return self._first.get(_key(study.document, path))

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
            Its language, and what it will be; of several languages the first one counts.
        recorded : sequence of str
            Ids beside it under which answers are recorded: none of them changes, or is given to another element.
        """
        element, document = path[:-1], study.document
        wanted, key = id_of(text, MAX_FROM_TEXT), _key(document, element)
        own = str(key[-1])
        of_element = path[-1] == ("text" if isinstance(element[-1], int) else "title")
        if key not in self._first or not of_element or language not in languages_of(study)[:1]:
            return (), element
        name = free_id(taken_beside(document, element) | recorded, wanted) if wanted else own
        if name == own or own in recorded:
            return (), element
        new = (*key[:-1], name)
        self._first |= {(*new, *one[len(key) :]): began for one, began in self._first.items() if one[: len(key)] == key}
        return renamed(document, element, name), element if isinstance(element[-1], int) else new


def _key(document: Mapping[str, Any], path: Path) -> Path:
    """Return section and id of an element."""
    name = value_at(document, (*path, "id")) if isinstance(path[-1], int) else path[-1]
    return (*path[:-1], str(name))
