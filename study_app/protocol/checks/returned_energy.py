"""The energy that a delayed force returns to the hand: levels beyond what the passivity controller leaves alone.

A damper b that is late by T returns E = (b V²/2ω)(sin ωT − ωT cos ωT) at each reversal of a sine with the peak speed V.
Of other liquids b is the force at V over V.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product
from typing import Final

from study_app.haptics.model.force_link import MOST_DELAY_MS
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.steady_state import steady
from study_app.protocol.blocks import Block
from study_app.protocol.model import Follow, Protocol
from study_app.protocol.source.problems import Fault
from study_app.protocol.trials.presentation import scene_of
from study_app.protocol.trials.stimuli import Stimulated
from study_app.protocol.trials.tasks import Stroke
from study_app.protocol.trials.tracks import condition_of, standards_of, stimulus_of

LIMIT_J: Final = 0.5e-3
"""A force that returns no more is delivered; measured in docs/late-force.md."""


def damping_nspm(scene: Scene, stroke: Stroke) -> float:
    """Return the damping of a scene's liquid at the greatest speed of a stroke, at the hand [N·s/m]."""
    return steady(scene, stroke.speed_mps).drag_n / stroke.speed_mps


def returned_j(damping: float, stroke: Stroke, delay_s: float) -> float:
    """Return what a damper [N·s/m] that is late returns to the hand at each reversal of a stroke [J]."""
    omega = 2 * math.pi * stroke.frequency_hz
    angle = omega * delay_s
    return damping * stroke.speed_mps**2 / (2 * omega) * (math.sin(angle) - angle * math.cos(angle))


def longest_ms(damping: float, stroke: Stroke) -> float:
    """Return the longest delay at which a damper [N·s/m] returns no more than the limit [whole ms]."""
    delays_ms = range(MOST_DELAY_MS + 1)
    beyond = (one for one in delays_ms if returned_j(damping, stroke, one / 1000) > LIMIT_J)
    return next(beyond, MOST_DELAY_MS + 1) - 1


def returned(protocol: Protocol) -> Iterator[Fault]:
    """Yield the blocks of levels in a paced motion whose late force returns more than the limit."""
    yielded: set[Fault] = set()
    for block in protocol.blocks.values():
        task = protocol.tasks[block.task]
        if block.stimulus is None or not isinstance(task, Follow):
            continue
        fault = _returned(protocol, block, task.fastest_stroke(protocol.device.workspace_m))
        if fault is not None and fault not in yielded:
            yielded.add(fault)
            yield fault


def _returned(protocol: Protocol, block: Block, stroke: Stroke) -> Fault | None:
    """Return the level of a block at which its force returns most, if that is beyond the limit."""
    stimulus = stimulus_of(protocol, block)
    condition = condition_of(protocol, stimulus)
    if len(protocol.conditions[condition].liquid_ids) > 1:
        return None
    presented: list[tuple[float, float, float]] = []
    for standard, level in product(standards_of(protocol, block), stimulus.levels):
        scene = scene_of(protocol, Stimulated(condition, stimulus.vary, stimulus.comparison(standard, level)))
        damping, delay_s = damping_nspm(scene, stroke), scene.link.mean_delay_s(scene.rate_hz)
        presented.append((returned_j(damping, stroke, delay_s), damping, delay_s))
    most_j, damping, delay_s = max(presented)
    if most_j <= LIMIT_J:
        return None
    return Fault(
        ("stimuli", str(block.stimulus), "levels"),
        f"{damping:.3g} N·s/m delayed by {1000 * delay_s:.3g} ms returns {1000 * most_j:.1f} mJ per motion reversal; "
        "the passivity controller removes it",
        f"at most {longest_ms(damping, stroke)} ms, which return {1000 * LIMIT_J:g} mJ",
    )
