"""What is wrong with blocks whose levels participants set: designs and methods that do not fit, numbers that are fixed.

These checks need a sound protocol, whose stimuli can be presented at the ends of their levels.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.source.problems import Fault
from study_app.protocol.trials.presentation import scene_of
from study_app.protocol.trials.stimuli import DELAY, OF_LINK, Stimulated
from study_app.protocol.trials.tracks import condition_of, design_of, method_of, standards_of, stimulus_of


def misfits(protocol: Protocol, block: Block) -> Iterator[Fault]:
    """Yield that a design without a method, or a method without a design, is about settings."""
    design, place = design_of(protocol, block), ("blocks", block.id)
    if block.stimulus is None:
        if design.adjusts:
            yield Fault(
                (*place, "design"),
                "adjusts a number, and the block varies none",
                'give stimulus = "…" instead of conditions',
            )
    elif design.adjusts and not method_of(protocol, block).adjusts:
        yield Fault(
            (*place, "method"), f'levels of "{block.design}" are set by the participant', 'method = "adjustment"'
        )
    elif method_of(protocol, block).adjusts and not design.adjusts:
        message = f'"{block.method}" needs a level that the participant sets, and "{block.design}" has none'
        yield Fault((*place, "method"), message, 'design = "adjustment", or method = "constant"')


def settings(protocol: Protocol, block: Block) -> Iterator[Fault]:
    """Yield why a number cannot be set while it is presented, or a standard not be matched."""
    design, stimulus = design_of(protocol, block), stimulus_of(protocol, block)
    if not design.adjusts:
        return
    for standard in standards_of(protocol, block):
        values = sorted(stimulus.comparison(standard, level) for level in stimulus.levels)
        if standard is not None and design.intervals > 1 and not values[0] < standard < values[1]:
            yield Fault(
                ("stimuli", str(block.stimulus), "levels"),
                f"settings from {values[0]:g} to {values[1]:g} are not on both sides of the standard {standard:g}",
                'level = "value", with levels below and above the standard',
            )
            return
        if stimulus.vary != DELAY and not _can_change(
            protocol, condition_of(protocol, stimulus), stimulus.vary, values
        ):
            yield Fault(
                ("methods", str(block.method), "step_size"),
                f'"{stimulus.vary}" cannot change while it is presented',
                "vary a number that can, such as drag.coefficient, or present levels by another method",
            )
            return


def _can_change(protocol: Protocol, condition: str, vary: str, values: list[float]) -> bool:
    """Return whether the servo can go on from each of the values to the next, with the state that it has.

    Of a force that is late it cannot: the forces on the way are those of the delay before.
    """
    from study_app.haptics.runtime.pack import built_alike  # noqa: PLC0415 - loads numpy

    if vary in OF_LINK:
        return False
    scenes = [scene_of(protocol, Stimulated(condition, vary, value)) for value in values]
    return all(built_alike(one, other) for one, other in pairwise(scenes))
