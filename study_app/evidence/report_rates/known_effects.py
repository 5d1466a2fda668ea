"""Simulated studies whose truth is known: empty, partially empty, and full of effects, by two generators.

One generator is the answer model of rehearsals, the other an ordinal probit model with random effects of people, which
shares nothing with it. In an empty study no setting differs from another; in a partial one the last liquid equals the
first, and delays of the lower half equal the shortest; a full one has all effects.
"""

from collections.abc import Mapping
from typing import Final, Literal, TypeAlias, get_args

import numpy as np

from study_app.analysis.data.blocks import Block
from study_app.analysis.data.measures import Array
from study_app.analysis.planning.simulated_studies import Opinions, Plan, people

Generator: TypeAlias = Literal["answer model", "ordinal probit"]
Extent: TypeAlias = Literal["empty", "partial", "full"]
GENERATORS: Final[tuple[Generator, ...]] = get_args(Generator)
EXTENTS: Final[tuple[Extent, ...]] = get_args(Extent)

LEVELS: Final = np.array([-2.0, -1.2, -0.4, 0.4, 1.2, 2.0])
"""Where the latent answer of the probit model goes from one of the seven levels to the next."""

LEANING: Final = 0.7
SLOPE: Final = 0.3
"""Standard deviations between people: of their response bias, and of their sensitivity to an effect."""

TRUTH: Final = 4000
"""The true differences of means are those of so many simulated people."""


def alike(block: Block, extent: Extent) -> Mapping[int, int]:
    """Return which settings (places) are equal in truth to which earlier one."""
    k = len(block.settings)
    if extent == "empty":
        return dict.fromkeys(range(1, k), 0)
    if extent == "full":
        return {}
    return dict.fromkeys(range(1, k // 2 + 1), 0) if block.kind == "delays" else {k - 1: 0}


def answers(
    simulation: Plan, generator: Generator, extent: Extent, participants: int, seed: int, study: int
) -> tuple[Array, ...]:
    """Return the answers (participants, settings, items) of one simulated study, block by block."""
    if generator == "answer model":
        thought = people(simulation, participants, seed, study)
        return tuple(_opined(block, one, extent) for block, one in zip(simulation.blocks, thought, strict=True))
    rng = np.random.default_rng([seed, study])
    leaning, slope = LEANING * rng.normal(size=participants), 1 + SLOPE * rng.normal(size=participants)
    return tuple(_probit(simulation, block, extent, leaning, slope, rng) for block in simulation.blocks)


def _opined(block: Block, opinions: Opinions, extent: Extent) -> Array:
    """Return the answer model's answers; equal settings have equal effects."""
    if extent == "empty":
        return opinions.answers(0.0)
    thought = opinions.thought.copy()
    for place, other in alike(block, extent).items():
        thought[:, :, place] = thought[:, :, other]
    return Opinions(thought, opinions.noise).answers(1.0)


def _probit(
    simulation: Plan, block: Block, extent: Extent, leaning: Array, slope: Array, rng: np.random.Generator
) -> Array:
    effects = _effects(simulation, block)
    for place, other in alike(block, extent).items():
        effects[place] = effects[other]
    latent = leaning[:, None, None] + slope[:, None, None] * effects + rng.normal(size=(len(leaning), *effects.shape))
    return np.add(np.searchsorted(LEVELS, latent), 1, dtype=np.float64)


def _effects(simulation: Plan, block: Block) -> Array:
    """Return the latent effect of each setting on each item (settings, items)."""
    k, items = len(block.settings), len(block.items)
    if block.kind == "delays":
        signs = [
            {"increasing": 1.0, "decreasing": -1.0, None: 0.0}[simulation.decided.direction(it.id)]
            for it in block.items
        ]
        return np.outer(np.linspace(-1.0, 1.0, k), signs)
    found = np.outer(np.resize([0.0, 1.5, -0.8], k), np.resize([1.0, -1.0], items))
    for place, setting in enumerate(block.settings):
        for column, item in enumerate(block.items):
            if item.id in simulation.decided.names:
                found[place, column] = 1.0 if setting.label == item.id else -1.0
    return np.asarray(found)


def true_differences(simulation: Plan, generator: Generator, extent: Extent) -> tuple[Array, ...]:
    """Return the true differences of mean answers to the first setting (settings, items), block by block."""
    found = []
    for block, given in zip(simulation.blocks, answers(simulation, generator, extent, TRUTH, 0, 0), strict=True):
        means = given.mean(axis=0)
        for place, other in alike(block, extent).items():
            means[place] = means[other]
        found.append(np.asarray(means - means[0]))
    return tuple(found)
