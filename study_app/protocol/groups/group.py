"""The tables ``[groups.NAME]``, and where a protocol file names the steps of its sessions."""

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Final, Self, TypeAlias

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from study_app.haptics.model.ranges import within
from study_app.protocol.source.document import Path, entries
from study_app.protocol.table import ExtendedTable
from study_app.protocol.texts import Id

MOST_SHARE: Final = 20
SEQUENCES: Final = ("sequence", "sequences.*", "groups.*.sequence", "groups.*.sequences.*")
"""Places of lists of steps in a document, as patterns."""

Steps: TypeAlias = tuple[Id, ...]
Sequences: TypeAlias = tuple[Annotated[Steps, Field(min_length=1)], ...]


class Group(ExtendedTable):
    """A group of participants; a group without a sequence has that of the study."""

    LATER: ClassVar[frozenset[str]] = frozenset({"sequence", "sequences"})

    share: Annotated[int, within(1, MOST_SHARE, "a share is a small whole number")] = Field(
        default=1, description="How many participants of each round of allocations come into this group."
    )
    sequence: Steps = Field(default=(), min_length=1, description="Its pages, blocks and forms, in every session.")
    sequences: Sequences = Field(default=(), min_length=1, description="Its steps of session 1, 2 …")

    @model_validator(mode="after")
    def _one_of(self) -> Self:
        if self.sequence and self.sequences:
            message = "give either sequence or sequences, one of the two"
            raise PydanticCustomError("one_of", message, {"place": "sequences"})
        return self


def sequences_in(document: Any) -> Iterator[tuple[Path, tuple[Any, ...]]]:
    """Yield every list of steps of a document (of a file or a receipt) with its path."""
    for pattern in SEQUENCES:
        for path, steps in entries(document, pattern):
            if isinstance(steps, tuple):
                yield path, steps
