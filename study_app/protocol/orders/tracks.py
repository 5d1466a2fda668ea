"""The tracks of a block with a design, for which its codes stand, and their numbers of slots."""

from __future__ import annotations

from dataclasses import dataclass

from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol


@dataclass(frozen=True, slots=True)
class Track:
    """A sequence of at most ``slots`` trials whose levels are chosen together.

    Its code stands for ``name``: the standard and a number ("8/1", "/1" without a standard), or a condition.
    ``comparison`` is the condition that is compared with the block's standard, None if a number is varied; ``number``
    counts the tracks of its standard from 1; ``catch`` has, for each catch trial, the range of slots (from 0) from
    which its slot is drawn.
    """

    name: str
    standard: float | None
    comparison: str | None
    slots: int
    number: int = 1
    catch: tuple[range, ...] = ()


def tracks_of(protocol: Protocol, block: Block) -> tuple[Track, ...]:
    """Return the tracks of a block with a design, in file order."""
    design = protocol.design_of(block)
    if block.stimulus is None:
        return tuple(Track(name, None, name, block.repetitions) for name in block.conditions if name != block.standard)
    stimulus, method = protocol.stimulus_of(block), protocol.method_of(block)
    comparisons = method.presentations(stimulus)
    other_slots = comparisons + design.noise(comparisons) + (design.first is not None)
    catch = (
        ()
        if (rule := block.catch) is None
        else tuple(rule.stretch(number) for number in range(rule.count(other_slots)))
    )
    slots = other_slots + len(catch)
    return tuple(
        Track(f"{'' if standard is None else f'{standard:.17g}'}/{number}", standard, None, slots, number, catch)
        for standard in protocol.standards_of(block)
        for number in range(1, method.tracks + 1)
    )


def track_of(protocol: Protocol, block: Block, name: str) -> Track:
    """Return the track with a name (StopIteration if there is none)."""
    return next(track for track in tracks_of(protocol, block) if track.name == name)
