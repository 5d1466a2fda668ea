"""How a study differs from a version of it: in sentences, what each does to the data, and the edits that revert it."""

import json
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path as Folder
from typing import Any, Final, Literal, TypeAlias

from study_app.authoring.edited_study import Study
from study_app.authoring.writer.edits import Edit, Insert, Move, Set, Unset
from study_app.protocol.differences import Difference, differences, document_differences
from study_app.protocol.model import Protocol
from study_app.protocol.source.document import Path
from study_app.protocol.source.files import TABLE, unbundled, with_liquid_files
from study_app.store.receipt import without_conditions

Effect: TypeAlias = Literal["comparable", "measured", "tables"]
"""What a difference does: answers stay comparable, what is measured changes, or tables do not fit together."""
UNKNOWN_CONDITIONS: Final = "conditions: may differ, no copy of this version is kept"
NOTATION: Final = "only comments, order or notation differ"
_TABLES: Final = re.compile(
    r"study\.name:"
    r"|questionnaires\.[^.:]+\.items\.[^.:]+: (new|gone)"
    r"|questionnaires\.[^.:]+\.items\.[^.:]+\.(kind|options\.[^.:]+)\b"
    r"|(questionnaires|blocks|pages|scales): (new|gone)"
    r"|(questionnaires|blocks|pages|scales)\.[^.:]+: (new|gone)"
    r"|blocks\.[^.:]+\.code(_prefix|s)\b"
    r"|blocks\.[^.:]+\.conditions: \d+ entries"
    r"|designs\.[^.:]+\.item:"
    r"|scales\.[^.:]+\.labels(\.[^.:]+)?: \d+ entries"
)
_COMPARABLE: Final = re.compile(
    r"study\.(title|description|version|languages)\b"
    r"|pages\.[^.:]+\.(title|body|button)\b"
    r"|(blocks|questionnaires)\.[^.:]+\.(title|setting_label)\b"
    r"|questionnaires\.[^.:]+\.items\.[^.:]+\.short\b"
    r"|analysis\b"
)


@dataclass(frozen=True, slots=True)
class Change:
    """One difference from a version.

    Attributes
    ----------
    sentence : str
        Its place and how it differs, as `protocol.differences` says it.
    effect : str
        What it does to the data.
    path : tuple of str or int
        The place in the study, or where it would be; () where there is none.
    revert : tuple
        The edits that take it back; none where the version is not known in full.
    """

    sentence: str
    effect: Effect
    path: Path = ()
    revert: tuple[Edit, ...] = ()


def changes(version: str, study: Study) -> tuple[Change, ...]:
    """Return how a study differs from the source of a version: its text, and its liquid files where it names some.

    Where both mean the same protocol every difference is one of notation, and answers stay comparable.
    """
    text, liquids = unbundled(version.encode())
    old = _document(version)
    if TABLE not in old:  # kept without its liquid files
        new = _document(study.text)
    else:
        new = _document(with_liquid_files(study.text.encode(), study.folder).decode())
    found = document_differences(old, new)
    same = bool(found) and not liquids and _same(_version(text.decode(), study.folder).protocol, study.protocol)
    return tuple(_change(one, old, new, comparable=same) for one in found)


def changes_from_receipt(protocol: Mapping[str, Any], study: Protocol) -> tuple[Change, ...]:
    """Return how a study differs from the protocol of a receipt, which does not say what blinding hides."""
    found = differences(protocol, json.loads(json.dumps(without_conditions(study))))
    return (*(Change(sentence, effect_of(sentence)) for sentence in found), Change(UNKNOWN_CONDITIONS, "measured"))


def effect_of(sentence: str) -> Effect:
    """Return what a difference does."""
    if _TABLES.match(sentence):
        return "tables"
    return "comparable" if _COMPARABLE.match(sentence) else "measured"


@lru_cache(maxsize=4)
def _document(text: str) -> dict[str, Any]:
    """Return the document of a text, which must not be changed."""
    return tomllib.loads(text)


@lru_cache(maxsize=2)
def _version(text: str, folder: Folder) -> Study:
    return Study(text, folder)


def _same(one: Protocol | None, other: Protocol | None) -> bool:
    return one is not None and one == other


def _change(found: Difference, old: Any, new: Any, *, comparable: bool) -> Change:
    effect: Effect = "comparable" if comparable else effect_of(found.sentence)
    path = _path(new, found.place)
    if found.place[0] == TABLE:
        return Change(found.sentence, effect)
    return Change(found.sentence, effect, path, tuple(_reverting(found, path, old, new)))


def _reverting(found: Difference, path: Path, old: Any, new: Any) -> Iterator[Edit]:
    was = _value(old, _path(old, found.place))
    if found.words.startswith("new, "):
        yield Unset(path)
    elif found.words == "in another order":
        yield from _moves(path, [one["id"] for one in was], [one["id"] for one in _value(new, path)])
    elif found.words.startswith("gone, ") and isinstance(_value(new, path[:-1]), list):
        at = next(index for index, one in enumerate(_value(old, _path(old, found.place[:-1]))) if one == was)
        yield Insert((*path[:-1], min(at, len(_value(new, path[:-1])))), was)
    else:
        yield Set(path, was)


def _moves(path: Path, before: Sequence[str], now: Sequence[str]) -> Iterator[Move]:
    """Yield the moves that put entries that stayed into their earlier order; new ones keep their places."""
    order = list(now)
    stayed = [name for name in before if name in order]
    places = [index for index, name in enumerate(order) if name in stayed]
    for index, name in zip(places, stayed, strict=True):
        at = order.index(name)
        if at == index:
            continue
        yield Move((*path, at), index)
        order.insert(index, order.pop(at))


def _path(document: Any, place: Sequence[str | int]) -> Path:
    """Return a place with indices in place of the ids of entries; an id that is not there stays."""
    path: list[str | int] = []
    node = document
    for step in place:
        found: str | int = step
        if isinstance(node, list) and isinstance(step, str):
            found = next((index for index, entry in enumerate(node) if entry.get("id") == step), step)
        path.append(found)
        node = _value(node, (found,))
    return tuple(path)


def _value(document: Any, path: Path) -> Any:
    for step in path:
        if isinstance(document, list):
            document = document[step] if isinstance(step, int) and step < len(document) else None
        else:
            document = document.get(step) if isinstance(document, Mapping) else None
    return document
