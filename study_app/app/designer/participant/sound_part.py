"""The part of a faulty study that is sound, so that its pages are shown while something else is being mended."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final

from study_app.authoring.document_values import with_value, without_value
from study_app.authoring.edited_study import Study
from study_app.errors import ProtocolError
from study_app.protocol.load import examined, read_document
from study_app.protocol.model import Protocol
from study_app.protocol.source.document import Path, entries, has
from study_app.protocol.source.liquid_files import with_liquid_files
from study_app.protocol.source.problems import Fault

ROUNDS: Final = 12
"""What is left out may be missing elsewhere: so often faults are looked for again."""
_NOTHING: Final = object()


def sound_part(study: Study, before: Mapping[str, Any]) -> Protocol | None:
    """Return the protocol of a study, of a faulty one that of its sound part; None where too little is sound.

    A text that a language lacks is that of another language. Any other faulty value is the one that ``before`` has, and
    is left out where that has none, together with what cannot be without it.

    Parameters
    ----------
    study : Study
        The study.
    before : mapping
        The document of the study when it was last sound; empty where it never was.
    """
    if study.protocol is not None:
        return study.protocol
    try:
        document, _ = read_document(with_liquid_files(study.text.encode(), study.folder), "")
    except ProtocolError:
        document = dict(before)
    for _ in range(ROUNDS):
        protocol, faults = examined(document)
        if protocol is not None:
            return protocol
        mended = _mended(document, faults, before)
        if mended == document:
            return None
        document = mended
    return None


def _mended(document: dict[str, Any], faults: Iterable[Fault], before: Mapping[str, Any]) -> dict[str, Any]:
    languages = [str(code) for _, code in entries(document, "study.languages.*")]
    left_out: set[Path] = set()
    found: Any = document
    for fault in faults:
        value, sound = _at(found, fault.path), _at(before, fault.path)
        if fault.in_one_language and isinstance(value, str):
            found = with_value(found, fault.path, dict.fromkeys(languages, value))
        elif (lacking := fault.missing_language) and isinstance(value, Mapping) and value:
            found = with_value(found, fault.path, {**value, lacking: next(iter(value.values()))})
        elif sound is not _NOTHING and sound != value:
            found = with_value(found, fault.path, sound)
        elif value is not _NOTHING:
            left_out.add(fault.path)
        else:
            parent = fault.path[:-1]
            while len(parent) > 1 and _at(found, parent) is _NOTHING:
                parent = parent[:-1]
            left_out.add(parent)
    for path in sorted((path for path in left_out if path), key=str, reverse=True):
        found = without_value(found, path)
    return dict(found)


def _at(node: Any, path: Path) -> Any:
    for step in path:
        if not has(node, step):
            return _NOTHING
        node = node[step]
    return node
