"""The part of a faulty study that is sound, so that its pages are shown while something else is being mended."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from typing import Any, Final

from study_app.designer.document.additions import is_unknown_name
from study_app.designer.document.fields import initial
from study_app.designer.document.names import named_at
from study_app.designer.document.study import Study, read, with_value, without_value
from study_app.designer.document.toml_text import Refused
from study_app.designer.place.editing import OpenStudy
from study_app.errors import ProtocolError
from study_app.protocol.load import examined, read_document
from study_app.protocol.model import Protocol
from study_app.protocol.source.document import Path, entries, has
from study_app.protocol.source.files import unbundled, with_liquid_files
from study_app.protocol.source.problems import Fault
from study_app.store.study_versions import kept_content, kept_versions

ROUNDS: Final = 12
"""What is left out may be missing elsewhere: so often faults are looked for again."""
MOST_EARLIER: Final = 5
"""So many kept versions are looked at for one without faults."""
_NOTHING: Final = object()
_MARK: Final = "\u200b"


def sound_part(study: Study, before: Mapping[str, Any]) -> Protocol | None:
    """Return the protocol of a study, of a faulty one that of its sound part; None where too little is sound.

    A text that a language lacks is that of another language, and one that repeats another text stays. Any other faulty
    value is the one that ``before`` has, as is what a name names. Without one it has an initial value, or is left out
    with what cannot be without it.

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
    filled: set[Path] = set()
    for _ in range(ROUNDS):
        protocol, faults = examined(document)
        if protocol is not None:
            return protocol
        mended = _mended(document, faults, before, filled)
        if mended == document:
            return None
        document = mended
    return None


def last_valid(opened: OpenStudy) -> Study | None:
    """Return the study as its file or the newest kept version of it has it, of those without faults."""
    for text in _earlier(opened):
        with suppress(Refused):
            study = read(text, opened.study.folder)
            if study.protocol is not None:
                return study
    return None


def _earlier(opened: OpenStudy) -> Iterator[bytes]:
    yield opened.saved.encode()
    for version in list(reversed(kept_versions(opened.file)))[:MOST_EARLIER]:
        yield unbundled(kept_content(version.hash) or b"")[0]


def _mended(
    document: dict[str, Any], faults: Iterable[Fault], before: Mapping[str, Any], filled: set[Path]
) -> dict[str, Any]:
    """Return a document without some faults; ``filled`` are the keys that were given an initial value."""
    languages = [str(code) for _, code in entries(document, "study.languages.*")]
    left_out: set[Path] = set()
    found: Any = document
    for fault in faults:
        value, sound = _at(found, fault.path), _at(before, _path_before(found, fault.path, before))
        named = named_at(before, fault.path) if is_unknown_name(fault) and sound == value else None
        if fault.in_one_language and isinstance(value, str):
            found = with_value(found, fault.path, dict.fromkeys(languages, value))
        elif (lacking := fault.missing_language) and isinstance(value, Mapping) and value:
            found = with_value(found, fault.path, {**value, lacking: next(iter(value.values()))})
        elif fault.reads_alike:
            found = with_value(found, fault.path, _told_apart(value, fault.path))
        elif named is not None and _at(found, named[:1]) is not _NOTHING:
            found = with_value(found, named, _at(before, named))
        elif sound is not _NOTHING and sound != value:
            found = with_value(found, fault.path, sound)
        elif value is not _NOTHING:
            left_out.add(fault.path)
        elif fault.path not in filled and (first := _first_value(found, fault.path)) is not _NOTHING:
            filled.add(fault.path)
            found = with_value(found, fault.path, first)
        else:
            parent = fault.path[:-1]
            while len(parent) > 1 and _at(found, parent) is _NOTHING:
                parent = parent[:-1]
            left_out.add(parent)
    for path in sorted((path for path in left_out if path), key=str, reverse=True):
        found = without_value(found, path)
    return dict(found)


def _told_apart(text: Any, path: Path) -> Any:
    """Return a text that looks the same and reads as no other: each place has its number of zero-width spaces."""
    marks = _MARK * (1 + max((step for step in path if isinstance(step, int)), default=0))
    return {code: f"{one}{marks}" for code, one in text.items()} if isinstance(text, Mapping) else f"{text}{marks}"


def _path_before(document: Any, path: Path, before: Any) -> Path:
    """Return where an element of a document was before: a question is found by its id, not by its number."""
    found: list[str | int] = []
    for step in path:
        document = _at(document, (step,))
        name = document.get("id") if isinstance(document, Mapping) and path[-1] != "id" else None
        if isinstance(step, int) and name is not None:
            entries_before = before if isinstance(before, list | tuple) else ()
            same = (at for at, one in enumerate(entries_before) if isinstance(one, Mapping) and one.get("id") == name)
            step = next(same, len(entries_before))  # noqa: PLW2901 - the step of the other document
        found.append(step)
        before = _at(before, (step,))
    return tuple(found)


def _first_value(document: Any, path: Path) -> Any:
    """Return an initial value for a key of a table that is there."""
    if not path or not isinstance(_at(document, path[:-1]), Mapping):
        return _NOTHING
    try:
        return initial(document, path)
    except Refused:
        return _NOTHING


def _at(node: Any, path: Path) -> Any:
    for step in path:
        if not has(node, step):
            return _NOTHING
        node = node[step]
    return node
