"""What is permitted in a block of levels and may still be a mistake: a sentence each, with its place in the file."""

from __future__ import annotations

import math
from collections.abc import Iterator

from study_app.protocol.blocks import Block
from study_app.protocol.checks.clipped_levels import PACED, clipped_unpaced
from study_app.protocol.checks.estimator_response import fastest_hz
from study_app.protocol.checks.expected_precision import imprecise
from study_app.protocol.model import Follow, Protocol
from study_app.protocol.trials.presented_levels import highest_damping
from study_app.protocol.trials.tracks import design_of, method_of, tracks_of


def level_warnings(protocol: Protocol, *, simulates: bool = True) -> Iterator[str]:
    """Yield what to think over of the blocks with a design; ``simulates``: also what takes simulated observers."""
    yielded: set[str] = set()
    for block in protocol.blocks_in_order:
        if block.design is not None:
            for sentence in (
                *_unbalanced(protocol, block),
                *_converging(protocol, block),
                *_without_catch(protocol, block),
                *_seen(protocol, block),
                *_unpaced(protocol, block),
                *(imprecise(protocol, block) if simulates else ()),
            ):
                if sentence not in yielded:
                    yielded.add(sentence)
                    yield sentence


def _unbalanced(protocol: Protocol, block: Block) -> Iterator[str]:
    """Yield that the trials of a track cannot present every arrangement equally often."""
    count = len(design_of(protocol, block).arrangements)
    track = tracks_of(protocol, block)[0]
    trials = track.slots - len(track.catch)
    if not design_of(protocol, block).has_noise and trials % count:
        place = f"blocks.{block.id}.repetitions" if block.stimulus is None else f"methods.{block.method}"
        wanted = "an even number" if count == 2 else f"a multiple of {count}"
        yield f"{place}: {trials} trials cannot balance {count} arrangements: choose {wanted}"


def _converging(protocol: Protocol, block: Block) -> Iterator[str]:
    """Yield what a block's method has to say of itself."""
    if block.stimulus is not None:
        for key, sentence in method_of(protocol, block).warnings():
            yield f"methods.{block.method}.{key}: {sentence}"


def _without_catch(protocol: Protocol, block: Block) -> Iterator[str]:
    """Yield that a track is too short for the share of catch trials."""
    track = tracks_of(protocol, block)[0]
    if block.catch is not None and not track.catch:
        share = math.ceil(100 / track.slots) / 100
        yield (
            f"blocks.{block.id}.catch.share: {block.catch.share:g} of {track.slots} trials gives no catch trial: "
            f"choose {share:g}"
        )


def _seen(protocol: Protocol, block: Block) -> Iterator[str]:
    """Yield that a double-blind study shows its operator which answers were correct."""
    if design_of(protocol, block).feedback == "always" and protocol.study.blinding == "double":
        yield (
            f'designs.{block.design}.feedback: "always" in a double-blind study: anyone who sees the participant\'s '
            'screen sees which answers were correct: choose feedback = "practice"'
        )


def _unpaced(protocol: Protocol, block: Block) -> Iterator[str]:
    """Yield that fast motions of a task without a pace are not delivered as requested."""
    task = protocol.tasks[block.task]
    if isinstance(task, Follow) or block.stimulus is None:
        return
    alike = [one for one in protocol.blocks.values() if (one.stimulus, one.task) == (block.stimulus, block.task)]
    if (said := clipped_unpaced(protocol, alike)) is not None:
        yield said
    error_percent = protocol.limits.level_error_percent
    if highest_damping(protocol, block) > 0 and error_percent is not None:
        fast_hz = fastest_hz(protocol.scene.velocity, protocol.device.rate_hz, 1 - error_percent / 100)
        yield (
            f"tasks.{block.task}: in motions above {fast_hz:.1f} Hz the velocity estimator takes more than "
            f"{error_percent:g} % of a damper's force: such trials are repeated: {PACED}"
        )
