"""The measurable part of a faulty study: without its broken elements, and with a text in place of each faulty one."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

from study_app.designer.document.additions import is_unknown_name
from study_app.designer.document.fields import initial
from study_app.designer.document.names import named_at
from study_app.designer.document.study import Study, with_value, without_value
from study_app.designer.document.toml_text import Refused
from study_app.designer.measures.participant_texts import text_keys
from study_app.protocol.load import examined
from study_app.protocol.model import Protocol
from study_app.protocol.source.document import Path, entries, has, value_at
from study_app.protocol.source.problems import Fault

ROUNDS: Final = 8
"""Leaving one element out may break those that name it: so often the rest is examined again."""
_PART: Final = re.compile(r"must be (\d+) at its place in sequence")
TEXT: Final = "…"
_STAND_IN: Final = {
    ("study", "version"): "1", ("study", "name"): "study", ("study", "title"): TEXT,
    ("device", "workspace_mm"): (1000, 1000, 1000),
}  # fmt: skip
_LEFT_OUT: Final = (("analysis",), ("limits",))
"""Tables that no session needs."""
_OF_FORCES: Final = (("device",), ("scene",))
"""Tables on which every force depends, and no sum over the session."""
_APART: Final = (*_LEFT_OUT, *_OF_FORCES)
_MARK: Final = "\u034f"
"""The combining grapheme joiner: nothing is seen of it, and texts with it are not taken as alike."""


@dataclass(frozen=True, slots=True)
class ValidPart:
    """The study without its broken elements, None where everything depends on what is broken.

    It is ``whole`` where no element was left out, so that sums over the session are known; ``forces`` are known where
    no value of device and scene was left out.
    """

    protocol: Protocol | None
    whole: bool
    forces: bool = True


@lru_cache(maxsize=2)
def valid_part(study: Study) -> ValidPart:
    """Return what can be measured of a study."""
    return restored_part(study, {})


def restored_part(study: Study, before: Mapping[str, Any]) -> ValidPart:
    """Return what can be measured or shown of a study: a faulty value is the one of the document ``before``, if any."""
    if study.formed is not None or not (study.is_toml or before):
        return ValidPart(study.formed, whole=study.formed is not None)
    document: Any = study.document
    faults: list[Fault] = list(study.faults) if study.is_toml else examined(document)[1]
    whole = forces = True
    for number in range(ROUNDS):
        for fault in sorted(faults, key=_place, reverse=True):
            place, value = _restored(document, fault, before) or _mended(document, fault, of_others=number > 0)
            known = value is not None or fault.message == "unknown key" or place[:1] in _APART
            if not place:
                place, value = fault.path[:2], _initial(document, fault.path[:2])
                if value is None:
                    return ValidPart(None, whole=False)
            if value_at(document, place) is None and value is None:
                continue  # another fault of the same element left it out
            whole = whole and known
            forces = forces and (fault.message == "unknown key" or fault.path[:1] not in _OF_FORCES)
            document = without_value(document, place) if value is None else with_value(document, place, value)
        protocol, faults = examined(document)
        if protocol is not None:
            return ValidPart(protocol, whole, forces)
    return ValidPart(None, whole=False)


def _restored(document: Any, fault: Fault, before: Mapping[str, Any]) -> tuple[Path, Any] | None:
    """Return the place to change because of a fault, and the value that it had before; None where it had none."""
    if not before or fault.missing_language:
        return None
    path, value = fault.path, value_at(document, fault.path)
    sound = value_at(before, _path_before(document, path, before))
    if fault.in_one_language and isinstance(value, str):
        return path, dict.fromkeys((str(code) for _, code in entries(document, "study.languages.*")), value)
    if fault.reads_alike:  # each place gets its number of marks: the text looks the same and reads as no other
        marks = _MARK * (1 + max((step for step in path if isinstance(step, int)), default=0))
        texts = value.items() if isinstance(value, Mapping) else ()
        return path, {code: f"{one}{marks}" for code, one in texts} or f"{value}{marks}"
    named = named_at(before, path) if is_unknown_name(fault) and sound == value else None
    if named is not None and value_at(document, named[:1]) is not None:
        return named, value_at(before, named)
    return (path, sound) if sound is not None and sound != value else None


def _path_before(document: Any, path: Path, before: Any) -> Path:
    """Return where an element of a document was before: a question is found by its id, not by its number."""
    found: list[str | int] = []
    for step in path:
        document = document[step] if has(document, step) else None
        name = document.get("id") if isinstance(document, Mapping) and path[-1] != "id" else None
        if isinstance(step, int) and name is not None:
            entries_before = before if isinstance(before, list | tuple) else ()
            same = (at for at, one in enumerate(entries_before) if isinstance(one, Mapping) and one.get("id") == name)
            step = next(same, len(entries_before))  # noqa: PLW2901 - the step of the other document
        found.append(step)
        before = before[step] if has(before, step) else None
    return tuple(found)


def _place(fault: Fault) -> tuple[str, ...]:
    """Return a key by which later entries of a list come after earlier ones."""
    return tuple(f"{step:06}" if isinstance(step, int) else step for step in fault.path)


def _mended(document: Any, fault: Fault, *, of_others: bool) -> tuple[Path, Any]:
    """Return the place to change because of a fault, and its value (None leaves it out); () where nothing helps.

    A key that is wrong only because another element was left out (``of_others``) is left out before its own element.
    """
    path = fault.path
    if (missing := fault.missing_language) and path and path[-1] != missing:
        known = value_at(document, path)
        others = known.values() if isinstance(known, Mapping) else ()
        return (*path, missing), next(iter(others), TEXT)
    if fault.message == "unknown key":
        return path, None
    if (part := _PART.search(fault.message)) is not None:
        return path, int(part[1])
    named = 0 if path[:1] == ("study",) else 1  # the name of an element may be that of a text
    for length in range(len(path), 1 + named, -1):
        if path[length - 1] in text_keys():
            return path[:length], _text(document)
    if path[:2] in _STAND_IN:
        return path[:2], _STAND_IN[path[0], path[1]]  # type: ignore[index]
    if path[:1] == ("questionnaires",) and path[2:3] == ("items",) and len(path) > 3:
        return (path[:5], f"item_{path[3]}") if path[4:] == ("id",) else (path[:4], None)
    if path[:1] == ("scales",) and path[2:3] == ("labels",) and len(path) == 4:
        labels = value_at(document, path[:3])
        by_language = labels.items() if isinstance(labels, Mapping) else ()
        return path, next((own for code, own in by_language if code != path[3]), None)
    if path[:1] in _LEFT_OUT:
        return path[:1], None
    if path[:1] in _OF_FORCES:
        return path[:2], None if value_at(document, path[:2]) is not None else _initial(document, path[:2])
    listed = len(path) > 1 and isinstance(path[-1], int) and isinstance(value_at(document, path), str)
    if listed:
        return path, None
    if of_others and len(path) > 2 and value_at(document, path[:3]) is not None:
        return path[:3], None
    return (path[:2], None) if len(path) > 1 and isinstance(value_at(document, path[:2]), Mapping) else ((), None)


def _initial(document: Any, path: Path) -> Any:
    """Return a valid value for a key; None where there is none."""
    try:
        return initial(document, path) if path else None
    except Refused:
        return None


def _text(document: Any) -> Any:
    codes = [str(code) for _, code in entries(document, "study.languages.*")]
    return dict.fromkeys(codes, TEXT) if len(codes) > 1 else TEXT
