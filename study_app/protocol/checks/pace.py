"""What is wrong with paced motions: forces beyond the limits at the pace, swings that the estimator lags behind.

These checks need a sound protocol; a hidden ball in a reaching task is found here, too.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from study_app.haptics.model.device_dynamics import BELIEVED_TICKS
from study_app.haptics.model.scene import Scene
from study_app.protocol.checks.clipped_levels import by_stimulus, clipped, clipped_at_pace, floored
from study_app.protocol.checks.estimator_response import fastest_hz, passed_share
from study_app.protocol.model import Follow, Protocol, Reach
from study_app.protocol.source.problems import Fault

LEAST_SHARE: Final = 0.99
"""Of a damper, that the velocity estimator must pass."""


def paced(protocol: Protocol, delay_ticks: int = BELIEVED_TICKS) -> Iterator[Fault]:
    """Yield what is wrong with tasks of kind "follow", and with balls that are hidden where a hand must aim.

    Parameters
    ----------
    protocol : Protocol
        The study, sound but for this.
    delay_ticks : int
        How many ticks late a force acts.
    """
    yield from _hidden(protocol)
    yield from _lagging(protocol)
    for blocks in by_stimulus(protocol):
        yield from clipped(protocol, blocks, delay_ticks)
    for block in protocol.blocks.values():
        task = protocol.tasks[block.task]
        if block.stimulus is None and isinstance(task, Follow):
            for index, name in enumerate(block.conditions):
                for message, hint in clipped_at_pace(protocol.scene_for(name), task, f'"{name}" is'):
                    yield Fault(("blocks", block.id, "conditions", index), message, hint)


def _hidden(protocol: Protocol) -> Iterator[Fault]:
    for block in protocol.blocks.values():
        if not isinstance(protocol.tasks[block.task], Reach):
            continue
        for name in protocol.conditions_in(block.id):
            if protocol.conditions[name].ball == "hidden":
                message = f'is hidden, but block "{block.id}" has a reaching task: it cannot be aimed'
                yield Fault(("conditions", name, "ball"), message, 'a task of kind "follow" or "explore"')


def _lagging(protocol: Protocol) -> Iterator[Fault]:
    """Check that the velocity estimator passes a damper at the frequency of each target."""
    velocity, rate_hz = protocol.scene.velocity, protocol.device.rate_hz
    felt: dict[str, list[Scene]] = {}
    for block in protocol.blocks.values():
        felt.setdefault(block.task, []).extend(protocol.scene_for(name) for name in protocol.conditions_in(block.id))
    for name, scenes in felt.items():
        task = protocol.tasks[name]
        if not isinstance(task, Follow) or not any(_is_damper(scene) for scene in scenes):
            continue
        if (share := passed_share(velocity, rate_hz, task.frequency_hz)) < LEAST_SHARE:
            most_hz = floored(fastest_hz(velocity, rate_hz, LEAST_SHARE), 1)
            yield Fault(
                ("tasks", name, "frequency_hz"),
                f"at {task.frequency_hz:g} Hz the velocity estimator passes {100 * share:.1f} % of a damper's force",
                f"at most {most_hz:g} Hz, where it passes {100 * LEAST_SHARE:g} %",
            )


def _is_damper(scene: Scene) -> bool:
    return any(liquid.drag.law == "linear" for liquid in scene.liquids)
