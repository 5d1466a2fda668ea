"""A study while it is edited: its text, what the text says, and its protocol or its faults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path as File
from typing import Any

from study_app.authoring.writer.edits import Edit, Unset, WriterError, apply, check_encodable
from study_app.authoring.writer.refused import Refused
from study_app.authoring.writer.splices import Splice, Splices, applied
from study_app.errors import Problem, ProtocolError
from study_app.protocol.load import examined, located, read_document
from study_app.protocol.model import Protocol
from study_app.protocol.source.document import Path
from study_app.protocol.source.liquid_files import TABLE, with_liquid_files
from study_app.protocol.source.problems import Fault

__all__ = ["Refused", "Study", "WriterError", "read"]


@dataclass(frozen=True)
class Study:
    """A study's text; everything else follows from it.

    Attributes
    ----------
    text : str
        The file's text, with its own line breaks.
    folder : Path
        Where the liquid files are that it names.
    before : mapping
        The document of the last text that was TOML, which stands in while this one is not.
    """

    text: str
    folder: File = File()
    before: Mapping[str, Any] = field(default_factory=dict, compare=False)

    @cached_property
    def _read(self) -> tuple[Mapping[str, Any], Protocol | None, tuple[Fault, ...], tuple[Problem, ...]]:
        own = self.text.encode()
        source = with_liquid_files(own, self.folder)
        try:
            document, places = read_document(source, "")
        except ProtocolError as error:
            faults = tuple(Fault((), problem.message, problem.hint) for problem in error.problems)
            return self.before, None, faults, error.problems
        protocol, found = examined(document)
        if source != own:
            document = {key: value for key, value in document.items() if key != TABLE}
        return document, protocol, tuple(found), located(found, places)

    @property
    def document(self) -> Mapping[str, Any]:
        """The tables of the text, arrays as tuples; those of the last text that was TOML where this one is not."""
        return self._read[0]

    @property
    def protocol(self) -> Protocol | None:
        """The protocol, None where there are faults."""
        return None if self.faults else self._read[1]

    @property
    def formed(self) -> Protocol | None:
        """The protocol, also where forces beyond a limit are its only faults; None where there are others."""
        return self._read[1]

    @property
    def faults(self) -> tuple[Fault, ...]:
        """What is wrong, by path."""
        return self._read[2]

    @property
    def problems(self) -> tuple[Problem, ...]:
        """What is wrong, as ``check`` prints it."""
        return self._read[3]

    @property
    def is_toml(self) -> bool:
        """Whether the text can be read; otherwise only its text can be edited."""
        return all(problem.place != "file" for problem in self.problems)

    def needs(self, place: Path) -> bool:
        """Return whether a table of a section would be incomplete without one of its keys."""
        text, _ = apply(self.text, Unset(place))
        table = place[:2]
        without = {fault for fault in self._with(text).faults if fault.path[: len(table)] == table}
        return not without <= set(self.faults)

    def edited(self, *edits: Edit) -> tuple[Study, tuple[Splices, ...]]:
        """Return the study after some edits, one after the other, and their splices.

        Raises
        ------
        Refused
            The text is not TOML, or an edit makes no sense.
        """
        if not self.is_toml:
            raise Refused("the file cannot be read: correct its text first")
        text, steps = self.text, list[Splices]()
        for edit in edits:
            text, found = apply(text, edit)
            steps += found
        return self._with(text), tuple(steps)

    def typed(self, text: str) -> tuple[Study, tuple[Splices, ...]]:
        """Return the study with another text, and the one splice that makes it.

        Raises
        ------
        Refused
            The text cannot be written as UTF-8.
        """
        check_encodable(text)
        old, shortest, first, last = self.text, min(len(self.text), len(text)), 0, 0
        while first < shortest and old[first] == text[first]:
            first += 1
        while last < shortest - first and old[-1 - last] == text[-1 - last]:
            last += 1
        splice = Splice(first, old[first : len(old) - last], text[first : len(text) - last])
        return (self, ()) if old == text else (self._with(text), ((splice,),))

    def spliced(self, steps: tuple[Splices, ...]) -> Study:
        """Return the study with splices applied, each to the text that the ones before it made."""
        text = self.text
        for step in steps:
            text = applied(text, step)
        return self._with(text)

    def _with(self, text: str) -> Study:
        return Study(text, self.folder, self.document)


def read(source: bytes, folder: File = File()) -> Study:
    """Return the study that a file's bytes hold.

    Raises
    ------
    Refused
        They are not UTF-8 text.
    """
    try:
        return Study(source.decode("utf-8"), folder)
    except UnicodeDecodeError as error:
        line = source.count(b"\n", 0, error.start) + 1
        raise Refused(f"line {line} is not UTF-8 text: save the file as UTF-8") from error
