"""A study that is being edited: its text, and everything that is computed from it."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path as File
from typing import Any, Final

from study_app.designer.document.toml_edits import Edit, Unset, apply_edit, check_encodable
from study_app.designer.document.toml_text import Refused, Splice, Splices, apply_splices, common_ends
from study_app.errors import Problem, ProtocolError
from study_app.protocol.load import located_problems, read_document, validate_document
from study_app.protocol.model import Protocol
from study_app.protocol.source import TABLE, Fault, Path, Places, is_utf16, with_liquid_files

_NOT_TOML: Final = "the file cannot be read: correct its text first"


@dataclass(frozen=True, slots=True)
class Entry:
    """A part of a study that is being added or changed in kind, and the path and message of each earlier fault."""

    path: Path
    known: frozenset[tuple[Path, str]]


def is_within(path: Path, entry: Path) -> bool:
    """Return whether a path is that of an entry or inside it."""
    return path[: len(entry)] == entry


@dataclass(frozen=True)
class Study:
    """A study's text and everything that is computed from it."""

    text: str  # the file's text, with its own line breaks
    folder: File = File()  # the folder of the liquid files that it names
    # the document of the last text that was valid TOML, used while this one is not
    before: Mapping[str, Any] = field(default_factory=dict, compare=False)
    # the entries that are being added or changed in kind: their new problems are not shown yet
    unfinished: tuple[Entry, ...] = field(default=(), compare=False)

    @cached_property
    def source(self) -> bytes:
        """The content that a session would use: the text and the liquid files that it names."""
        return with_liquid_files(self.text.encode(), self.folder)

    @cached_property
    def _read(self) -> tuple[dict[str, Any] | None, Places, tuple[Problem, ...]]:
        """The document with its liquid files and line numbers, or None and the problem if it is not TOML."""
        try:
            return *read_document(self.source, ""), ()
        except ProtocolError as error:
            return None, Places(""), error.problems

    @cached_property
    def _validated(self) -> tuple[Protocol | None, tuple[Fault, ...]]:
        document, _, broken = self._read
        if document is None:
            return None, tuple(Fault((), problem.message, problem.hint) for problem in broken)
        protocol, faults = validate_document(document)
        return protocol, tuple(faults)

    @cached_property
    def document(self) -> Mapping[str, Any]:
        """The tables of the text, with arrays as tuples; the last valid ones if the text is not TOML."""
        document = self._read[0]
        if document is None:
            return self.before
        bundled = self.source != self.text.encode()
        return {key: value for key, value in document.items() if key != TABLE} if bundled else document

    @property
    def protocol(self) -> Protocol | None:
        return None if self.faults else self.formed

    @property
    def formed(self) -> Protocol | None:
        """The protocol, even if it has forces beyond a limit; None if there are other faults."""
        return self._validated[0]

    @property
    def faults(self) -> tuple[Fault, ...]:
        return self._validated[1]

    @property
    def shown_faults(self) -> tuple[Fault, ...]:
        """The faults, without those that are new in unfinished entries."""
        return tuple(fault for fault in self.faults if not self.is_unfinished(fault))

    def is_in_entry(self, path: Path) -> bool:
        """Return whether a path is in an unfinished entry."""
        return any(is_within(path, entry.path) for entry in self.unfinished)

    def is_unfinished(self, fault: Fault) -> bool:
        """Return whether a fault is new in an unfinished entry."""
        return any(
            is_within(fault.path, entry.path) and (fault.path, fault.message) not in entry.known
            for entry in self.unfinished
        )

    def with_unfinished(self, entries: tuple[Entry, ...]) -> Study:
        """Return the study with other unfinished entries, keeping all computed properties."""
        same = copy(self)
        object.__setattr__(same, "unfinished", entries)
        return same

    @cached_property
    def problems(self) -> tuple[Problem, ...]:
        """The faults, as ``check`` prints them."""
        _, places, broken = self._read
        return broken or located_problems(self.faults, places)

    @property
    def is_toml(self) -> bool:
        """Whether the text is valid TOML; otherwise only the text can be edited."""
        return self._read[0] is not None

    @property
    def is_unreadable(self) -> bool:
        """Whether neither the text nor an earlier one is valid TOML."""
        return not self.is_toml and not self.before

    def is_required(self, place: Path) -> bool:
        """Return whether the element that contains a key would have new faults without it."""
        after, _ = self.with_edits(Unset(place))
        table = place[:2]
        without = {fault for fault in after.faults if fault.path[: len(table)] == table}
        return not without <= set(self.faults)

    def with_edits(self, *edits: Edit) -> tuple[Study, tuple[Splices, ...]]:
        if not self.is_toml:
            raise Refused(_NOT_TOML)
        text, steps = self.text, list[Splices]()
        for edit in edits:
            text, splices = apply_edit(text, edit)
            steps += splices
        return self._study_from_text(text), tuple(steps)

    def with_text(self, text: str) -> tuple[Study, tuple[Splices, ...]]:
        check_encodable(text)
        old = self.text
        first, last = common_ends(old, text)
        splice = Splice(first, old[first : len(old) - last], text[first : len(text) - last])
        return (self, ()) if old == text else (self._study_from_text(text), ((splice,),))

    def with_splices(self, steps: tuple[Splices, ...]) -> Study:
        text = self.text
        for step in steps:
            text = apply_splices(text, step)
        return self._study_from_text(text)

    def _study_from_text(self, text: str) -> Study:
        return Study(text, self.folder, self.document, self.unfinished)


def read_study(source: bytes, folder: File = File()) -> Study:
    """Return the study in a file's bytes, without a byte order mark."""
    if is_utf16(source):
        raise Refused("this is UTF-16 text: save the file as UTF-8")
    try:
        return Study(source.decode("utf-8-sig"), folder)
    except UnicodeDecodeError as error:
        line = source.count(b"\n", 0, error.start) + 1
        raise Refused(f"line {line} is not UTF-8 text: save the file as UTF-8") from error
