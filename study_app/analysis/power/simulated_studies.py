"""Simulated studies: the answer model of rehearsals over arrays, with its effects as they are, smaller, or greater.

A smaller effect draws the opinions of a person on all settings nearer to their mean; leanings and noise stay. The same
people with the same noise answer at every size of the effect, and the first of them are the smaller studies, so that
curves are smooth; the studies are independent of each other.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from study_app.analysis.power.plan import HIGHEST, LOWEST, Plan, Planned
from study_app.analysis.tables.measures import Array
from study_app.protocol.simulated_observer import Rater, opinions, rater

UNIFORM = 12
"""The answer model's noise is the sum of so many uniform numbers, less six."""


@dataclass(frozen=True)
class Opinions:
    """What people think in a block, and what else is in their answers (participants, repetitions, settings, items)."""

    thought: Array
    noise: Array

    def answers(self, effect: float) -> Array:
        """Return the answers (participants, settings, items) where settings differ ``effect`` times as much.

        The median over repetitions, as everywhere in the analysis.
        """
        middle = self.thought.mean(axis=2, keepdims=True)
        points = middle + effect * (self.thought - middle) + self.noise
        given = np.clip(np.floor(points + 0.5), LOWEST, HIGHEST)
        return np.asarray(given[:, 0] if given.shape[1] == 1 else np.median(given, axis=1))


def people(plan: Plan, participants: int, seed: int, study: int) -> tuple[Opinions, ...]:
    """Return what the participants of simulated study number ``study`` think in each block of the plan."""
    rng = np.random.default_rng([seed, study])
    found: list[list[tuple[Array, Array]]] = [[] for _ in plan.blocks]
    for _ in range(participants):
        person = rater(rng.random)
        for place, block in enumerate(plan.blocks):
            found[place].append(_person(block, person, rng))
    return tuple(
        Opinions(np.array([thought for thought, _ in block]), np.array([noise for _, noise in block]))
        for block in found
    )


def _person(block: Planned, person: Rater, rng: np.random.Generator) -> tuple[Array, Array]:
    items = [item.id for item in block.items]
    drawn = rng.random((block.repetitions, block.k))
    thought = [
        [
            opinions(items, felt[int(len(felt) * part)], person)
            for felt, part in zip(block.felt, parts.tolist(), strict=True)
        ]
        for parts in drawn
    ]
    noise = rng.random((block.repetitions, block.k, len(items), UNIFORM)).sum(axis=-1) - UNIFORM / 2
    return np.array(thought), person.leaning + person.noise * noise


def together(studies: Sequence[tuple[Opinions, ...]], place: int, effects: Sequence[float]) -> Array:
    """Return one block's answers (effects, studies, participants, settings, items)."""
    return np.array([[one[place].answers(effect) for one in studies] for effect in effects])
