"""The protocol of one session: the study's, with the steps of a group's session alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from study_app.protocol.groups.session_steps import numbered_parts, session_count, sessions_differ, steps_of
from study_app.protocol.model import Protocol


def own_protocol(protocol: Protocol, group: str | None, session: int) -> Protocol:
    """Return the protocol of a session of a participant of ``group``, which has one sequence and no groups.

    Parts are numbered in the order of this session. A study whose sessions do not differ is returned as it is.

    Raises
    ------
    StudyError
        The participant has fewer sessions.
    """
    if not sessions_differ(protocol):
        return protocol
    steps = steps_of(protocol, group, session)
    parts = numbered_parts(steps, {name: block.part for name, block in protocol.blocks.items()})
    blocks = {
        name: block.model_copy(update={"part": parts[name]}) if name in parts else block
        for name, block in protocol.blocks.items()
    }
    return protocol.model_copy(update={"sequence": steps, "sequences": (), "groups": {}, "blocks": blocks})


@dataclass(frozen=True, slots=True)
class Variant:
    """One kind of session of a study: of a group (None: of everybody), with a number (None: any)."""

    group: str | None
    session: int | None
    protocol: Protocol

    @property
    def name(self) -> str:
        """The group and the session in words; empty where all sessions are alike."""
        named = [f"group {self.group}"] if self.group is not None else []
        return ", ".join([*named, f"session {self.session}"] if self.session is not None else named)


def variants(protocol: Protocol) -> Iterator[Variant]:
    """Yield each kind of session of a study; one where all sessions are alike."""
    for group in protocol.groups or (None,):
        count = session_count(protocol, group)
        for session in range(1, (count or 1) + 1):
            own = own_protocol(protocol, group, session)
            yield Variant(group, session if count is not None else None, own)
