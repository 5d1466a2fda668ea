"""Groups of participants and sessions that differ: whose steps a session has."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping
from typing import Annotated, Any, Final, Literal, Protocol, Self, TypeAlias

from pydantic import Field, model_validator

from study_app.errors import StudyError
from study_app.haptics.model.ranges import later, within
from study_app.protocol.source.document import Path, entries
from study_app.protocol.source.table import Id, Table, invalid

GroupAssignment: TypeAlias = Literal["randomised", "pre-existing"]
ASSIGNMENT: Final = ("study", "group_assignment")
EACH_GROUP: Final = "*"
"""In place of a group's name, which is an ID: figures compare all groups."""
_MOST_SHARE: Final = 20
SEQUENCES: Final = ("sequence", "sequences.*", "groups.*.sequence", "groups.*.sequences.*")
"""Places of lists of steps in a document, as patterns."""

Steps: TypeAlias = tuple[Id, ...]
Sequences: TypeAlias = tuple[Annotated[Steps, Field(min_length=1)], ...]


class Group(Table):
    """A group of participants; a group without its own sequence uses the study's sequence."""

    share: Annotated[int, within(1, _MOST_SHARE, "shares are small whole numbers")] = Field(
        default=1,
        description=(
            "Number of participants from this group in each randomisation block; for a pre-existing group, its share "
            "in the planned ratio."
        ),
    )
    sequence: Steps = later(
        default=(), min_length=1, description=("The group's pages, blocks and forms in every session, in order.")
    )
    sequences: Sequences = later(default=(), min_length=1, description="The group's steps in sessions 1, 2 and so on.")

    @model_validator(mode="after")
    def _one_of(self) -> Self:
        if self.sequence and self.sequences:
            message = "specify either sequence or sequences, not both"
            raise invalid(message, "sequences")
        return self


def sequences_in(document: Any) -> Iterator[tuple[Path, tuple[Any, ...]]]:
    """Yield every list of steps of a document (of a file or a receipt) with its path."""
    for pattern in SEQUENCES:
        for path, steps in entries(document, pattern):
            if isinstance(steps, tuple):
                yield path, steps


def next_group(shares: Mapping[str, int], sizes: Mapping[str, int]) -> str:
    """Return the group furthest below its share (the first in a tie); `sizes` may omit empty groups."""
    return min(shares, key=lambda name: sizes.get(name, 0) / shares[name])


class HasSteps(Protocol):
    """A protocol, read from its file or from a receipt."""

    @property
    def sequence(self) -> Steps: ...  # noqa: D102
    @property
    def sequences(self) -> Sequences: ...  # noqa: D102
    @property
    def groups(self) -> Mapping[str, Group]: ...  # noqa: D102


def sessions_differ(protocol: HasSteps) -> bool:
    """Return whether sessions of this study can have different steps."""
    return bool(protocol.groups or protocol.sequences)


def session_count(protocol: HasSteps, group: str | None) -> int | None:
    """Return the number of sessions of a participant in a group; None: unlimited, all with the same steps."""
    return len(_sequences(protocol, group)) or None


def steps_of(protocol: HasSteps, group: str | None, session: int) -> Steps:
    """Return the steps of a participant's session (from 1) in a group; StudyError if there are fewer sessions."""
    sequences = _sequences(protocol, group)
    if not sequences:
        own = () if group is None else protocol.groups[group].sequence
        return own or protocol.sequence
    if session > len(sequences):
        raise _session_number_error(session, len(sequences))
    return sequences[session - 1]


def _sequences(protocol: HasSteps, group: str | None) -> Sequences:
    own = None if group is None else protocol.groups[group]
    return protocol.sequences if own is None or not (own.sequence or own.sequences) else own.sequences


def _session_number_error(session: int, last: int) -> StudyError:
    """Return the error about a session number beyond the last session."""
    permitted = "only session 1" if last == 1 else f"1 to {last}"
    return StudyError(
        f"session {session} does not exist: the key sequences defines "
        f"{'1 session' if last == 1 else f'{last} sessions'} for each participant; permitted: {permitted}"
    )


def check_session_number(protocol: HasSteps, session: int) -> None:
    """Raise StudyError if no group has this session."""
    counts = [session_count(protocol, group) for group in protocol.groups or (None,)]
    known = [count for count in counts if count is not None]
    if len(known) == len(counts) and session > max(known):
        raise _session_number_error(session, max(known))


def every_step(protocol: HasSteps) -> Steps:
    """Return the steps of all groups and sessions without duplicates, in order of first use."""
    if not sessions_differ(protocol):
        return protocol.sequence
    of_groups = (_steps_of_group(protocol, group) for group in protocol.groups or (None,))
    return tuple(dict.fromkeys(step for steps in of_groups for step in steps))


def follows(
    protocol: HasSteps, form: str, blocks: Container[str], exchanged: Container[str] = ()
) -> tuple[str | None, ...]:
    """Return the blocks before each use of a form, None before the first; empty if no session has it twice.

    After one of the blocks that are ``exchanged``, any of them that a session has can follow.
    """
    preceding: dict[str | None, None] = {}
    again = False
    for steps in session_steps(protocol):
        again |= steps.count(form) > 1
        for before in blocks_before(steps, form, blocks):
            exchange = [block for block in steps if block in exchanged] if before in exchanged else [before]
            preceding |= dict.fromkeys(exchange)
    return tuple(preceding) if again else ()


def blocks_before(steps: Steps, form: str, blocks: Container[str]) -> Iterator[str | None]:
    """Yield the last block before each use of a form in a session, None before the first block."""
    before: str | None = None
    for step in steps:
        if step == form:
            yield before
        before = step if step in blocks else before


def session_steps(protocol: HasSteps) -> Iterator[Steps]:
    """Yield the steps of each session of each group."""
    for group in protocol.groups or (None,):
        yield from _sequences(protocol, group) or (steps_of(protocol, group, 1),)


def groups_with(protocol: HasSteps, step: str) -> tuple[str, ...]:
    """Return the groups whose sessions contain a step; empty in a study without groups."""
    return tuple(group for group in protocol.groups if step in _steps_of_group(protocol, group))


def _steps_of_group(protocol: HasSteps, group: str | None) -> Steps:
    return sum(_sequences(protocol, group) or (steps_of(protocol, group, 1),), ())


def parts_by_block(steps: Iterable[str], parts: Mapping[str, int | None]) -> dict[str, int]:
    """Return the part number of each block in a session with these steps: 1, 2 … in order of appearance."""
    numbers: dict[int, int] = {}
    part_numbers: dict[str, int] = {}
    for step in steps:
        part = parts.get(step)
        if part is not None:
            part_numbers[step] = numbers.setdefault(part, len(numbers) + 1)
    return part_numbers
