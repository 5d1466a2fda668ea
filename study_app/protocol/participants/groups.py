"""Groups of participants, and the steps of sessions that differ."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Self, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, model_validator

from study_app.errors import StudyError
from study_app.haptics.model.ranges import later, within
from study_app.protocol.source.document import Path, entries
from study_app.protocol.source.table import Id, Table, invalid

GroupAssignment: TypeAlias = Literal["randomised", "pre-existing"]
ASSIGNMENT: Final = ("study", "group_assignment")
EACH_GROUP: Final = "*"
"""Stands for all groups in place of a group's name; not a valid ID."""
_MOST_SHARE: Final = 20
SEQUENCES: Final = ("sequence", "sequences.*", "groups.*.sequence", "groups.*.sequences.*")
"""Patterns of the lists of steps in a document."""

Steps: TypeAlias = tuple[Id, ...]
Sequences: TypeAlias = tuple[Annotated[Steps, Field(min_length=1)], ...]


class Group(Table):
    """A group of participants; a group without its own sequence uses the study's sequence."""

    share: Annotated[int, within(1, _MOST_SHARE, "shares are small whole numbers", of_most=True)] = Field(
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
    def _check_sequence_keys(self) -> Self:
        if self.sequence and self.sequences:
            message = "specify either sequence or sequences, not both"
            raise invalid(message, "sequences")
        return self


def sequences_in(document: Any) -> Iterator[tuple[Path, tuple[Any, ...]]]:
    """Yield every list of steps in the document of a file or a receipt, with its path."""
    for pattern in SEQUENCES:
        for path, steps in entries(document, pattern):
            if isinstance(steps, tuple):
                yield path, steps


def next_group(shares: Mapping[str, int], sizes: Mapping[str, int]) -> str:
    """Return the group furthest below its share (the first in a tie); `sizes` may omit empty groups."""
    return min(shares, key=lambda name: sizes.get(name, 0) / shares[name])


class Sessions:
    """The steps of a study's sessions, in its file or in a receipt."""

    if TYPE_CHECKING:
        sequence: Steps
        sequences: Sequences
        groups: dict[str, Group]
        blocks: Any
        study: Any

    @property
    def steps(self) -> Steps:
        """The pages, blocks and forms in session order; those of all groups and sessions if these differ."""
        if not self.sessions_differ:
            return self.sequence
        return tuple(dict.fromkeys(step for group in self.groups or (None,) for step in self._steps_of_group(group)))

    @property
    def sessions_differ(self) -> bool:
        """Whether sessions of this study can have different steps."""
        return bool(self.groups or self.sequences)

    @property
    def exchanged_blocks(self) -> tuple[str, ...]:
        """The blocks whose order differs between participants: the main blocks, unless their order is fixed."""
        main = (name for name, block in self.blocks.items() if block.phase == "main")
        return () if self.study.block_order == "fixed" else tuple(main)

    def session_count(self, group: str | None) -> int | None:
        """Return the number of sessions of a participant in a group; None for any number of equal sessions."""
        return len(self._sequences_of(group)) or None

    def session_steps(self, group: str | None, session: int) -> Steps:
        """Return the steps of a participant's session (from 1) in a group; raise StudyError if there are fewer."""
        sequences = self._sequences_of(group)
        if not sequences:
            group_sequence = () if group is None else self.groups[group].sequence
            return group_sequence or self.sequence
        if session > len(sequences):
            raise _session_number_error(session, len(sequences))
        return sequences[session - 1]

    def check_session_number(self, session: int) -> None:
        """Raise StudyError if no group has this session."""
        counts = [self.session_count(group) for group in self.groups or (None,)]
        limited = [count for count in counts if count is not None]
        if len(limited) == len(counts) and session > max(limited):
            raise _session_number_error(session, max(limited))

    def every_session(self) -> Iterator[Steps]:
        """Yield the steps of each session of each group."""
        yield from (steps for _, steps in self._numbered_sessions())

    def groups_with(self, step: str) -> tuple[str, ...]:
        """Return the groups whose sessions contain a step; empty in a study without groups."""
        return tuple(group for group in self.groups if step in self._steps_of_group(group))

    def blocks_before(self, form: str, steps: Steps) -> Iterator[str | None]:
        """Yield the last block before each use of a form in a session, None before the first block."""
        previous: str | None = None
        for step in steps:
            if step == form:
                yield previous
            previous = step if step in self.blocks else previous

    def is_repeated(self, form: str) -> bool:
        """Return whether participants of any group complete a form more than once."""
        return any(self._steps_of_group(group).count(form) > 1 for group in self.groups or (None,))

    def form_uses(self, form: str) -> tuple[tuple[str | None, int], ...]:
        """Return the preceding block (None: the start) and the session (from 1) of each use of a form.

        If the order of the main blocks varies, any of those in the session can precede the form.
        """
        uses: dict[tuple[str | None, int], None] = {}
        for session, steps in self._numbered_sessions():
            exchanged = [block for block in steps if block in self.exchanged_blocks]
            for previous in self.blocks_before(form, steps):
                blocks = exchanged if previous in exchanged else [previous]
                uses |= dict.fromkeys((block, session) for block in blocks)
        return tuple(uses)

    def blocks_followed_by(self, form: str) -> tuple[str, ...]:
        """Return the blocks after which a form is always completed, whatever the order of the main blocks."""
        followed: dict[str, None] = {}
        for _, steps in self._numbered_sessions():
            exchanged = [block for block in steps if block in self.exchanged_blocks]
            preceding = list(filter(None, self.blocks_before(form, steps)))
            if not {*exchanged} <= {*preceding}:
                preceding = [block for block in preceding if block not in exchanged]
            followed |= dict.fromkeys(preceding)
        return tuple(followed)

    def _numbered_sessions(self) -> Iterator[tuple[int, Steps]]:
        """Yield number and steps of each session of each group."""
        for group in self.groups or (None,):
            yield from enumerate(self._sequences_of(group) or (self.session_steps(group, 1),), start=1)

    def _sequences_of(self, group: str | None) -> Sequences:
        own_group = None if group is None else self.groups[group]
        return (
            self.sequences
            if own_group is None or not (own_group.sequence or own_group.sequences)
            else own_group.sequences
        )

    def _steps_of_group(self, group: str | None) -> Steps:
        return sum(self._sequences_of(group) or (self.session_steps(group, 1),), ())


class _Recorded(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore")


class _RecordedStudy(_Recorded):
    block_order: str = "fixed"


class _RecordedBlock(_Recorded):
    phase: str = "main"


class RecordedSessions(Sessions, _Recorded):
    """The sessions of the protocol in a receipt (ValueError: it has none)."""

    study: _RecordedStudy = _RecordedStudy()
    blocks: dict[str, _RecordedBlock] = {}
    sequence: tuple[str, ...] = ()
    sequences: tuple[tuple[str, ...], ...] = ()
    groups: dict[str, Group] = {}

    @property
    def steps(self) -> Steps:
        """The steps of all groups and sessions without duplicates, in order of first use."""
        return tuple(dict.fromkeys(super().steps))


def _session_number_error(session: int, last: int) -> StudyError:
    """Return the error about a session number beyond the last session."""
    permitted = "only session 1" if last == 1 else f"1 to {last}"
    return StudyError(
        f"session {session} does not exist: the key sequences defines "
        f"{'1 session' if last == 1 else f'{last} sessions'} for each participant; permitted: {permitted}"
    )


def parts_by_block(steps: Iterable[str], parts: Mapping[str, int | None]) -> dict[str, int]:
    """Return the part number of each block in a session with these steps: 1, 2 … in order of appearance."""
    numbers: dict[int, int] = {}
    part_numbers: dict[str, int] = {}
    for step in steps:
        part = parts.get(step)
        if part is not None:
            part_numbers[step] = numbers.setdefault(part, len(numbers) + 1)
    return part_numbers
