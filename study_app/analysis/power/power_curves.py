"""From counts to what a planner reads: the power of every test at every size, and the smallest effect it finds."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

import numpy as np

from study_app.analysis.power.batch_counts import FULL, Counts
from study_app.analysis.power.plan import Plan, Planned
from study_app.analysis.tables.measures import Array

Question: TypeAlias = Literal["settings differ", "trend", "lowest delay", "equivalence"]

WANTED: Final = 0.8
"""The power that "smallest detectable effect" and "participants needed" are about."""

OVER_ALL: Final = "all statements at once"
Z95: Final = 1.959964


@dataclass(frozen=True, slots=True)
class Curve:
    """The power of one test over the sizes.

    ``item`` is None for tests over several statements, which ``over`` then names; ``setting`` the delay that a test is
    about, where it is about one. ``power`` holds shares of studies, ``alarms`` the same without any effect, which for
    equivalence is the power where there is truly no difference. ``effect`` is the effect that was simulated, in points
    of the scale: between the two settings whose mean answers differ most. ``detectable`` is the smallest one, in the
    same points, that is found in 80 % of studies, None where it is beyond eight times the simulated one.
    """

    block: str
    question: Question
    item: str | None
    over: str
    setting: str | None
    power: tuple[float, ...]
    alarms: tuple[float, ...] | None
    effect: float | None
    detectable: tuple[float | None, ...] | None

    def needed(self, sizes: Sequence[int]) -> int | None:
        """Return the smallest of the sizes from which on the power is 80 %."""
        enough = [share >= WANTED for share in self.power]
        for place, size in enumerate(sizes):
            if all(enough[place:]):
                return size
        return None


@dataclass(frozen=True)
class Powers:
    """What so many simulated studies of each size found."""

    plan: Plan
    sizes: tuple[int, ...]
    studies: int
    asked: int
    seed: int
    curves: tuple[Curve, ...]

    @property
    def complete(self) -> bool:
        """Whether all studies that were asked for were simulated."""
        return self.studies == self.asked


def powers(plan: Plan, sizes: Sequence[int], studies: int, asked: int, seed: int, counts: Counts) -> Powers:
    """Return what ``studies`` of ``asked`` studies found, from their counts."""
    curves = tuple(curve for block in plan.blocks for curve in _curves(block, counts, studies))
    return Powers(plan, tuple(sizes), studies, asked, seed, curves)


def interval(share: float, studies: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a share of simulated studies (Wilson 1927)."""
    middle = (share + Z95**2 / (2 * studies)) / (1 + Z95**2 / studies)
    reach = Z95 / (1 + Z95**2 / studies) * math.sqrt(share * (1 - share) / studies + Z95**2 / (4 * studies**2))
    return max(0.0, middle - reach), min(1.0, middle + reach)


def _curves(block: Planned, counts: Counts, studies: int) -> Iterator[Curve]:
    question: Question = "trend" if block.kind == "delays" else "settings differ"
    means = counts[block.id, "means"] / studies
    for what, over in (("any", "at least one statement"), ("all", OVER_ALL)):
        if (block.id, what) in counts:
            shares = counts[block.id, what] / studies
            yield Curve(block.id, question, None, over, None, *_shares(shares), None, None)
    if (block.id, "found") in counts:
        found = counts[block.id, "found"] / studies
        for place, item in enumerate(block.items):
            effects = _effects(block, means[:, :, place])
            known = effects[FULL] - effects[0] > 0.05
            yield Curve(
                block.id,
                question,
                item.id,
                "",
                None,
                *_shares(found[:, :, place]),
                float(effects[FULL]),
                tuple(_detectable(found[at, :, place], effects) for at in range(len(found))) if known else None,
            )
    yield from _lowest(block, counts, studies)
    yield from _equivalent(block, counts, studies)


def _shares(shares: Array) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return tuple(shares[:, FULL].tolist()), tuple(shares[:, 0].tolist())


def _effects(block: Planned, means: Array) -> Array:
    """Return the difference of mean answers (effects, settings) that is the effect: first to last, or the largest."""
    if block.kind == "delays":
        return np.asarray(np.abs(means[:, -1] - means[:, 0]))
    return np.asarray(np.ptp(means, axis=1))


def _detectable(found: Array, effects: Array) -> float | None:
    """Return the effect at which the share of studies that find it reaches 80 %, between those that were simulated."""
    rising = np.maximum.accumulate(found)
    reached = np.flatnonzero(rising >= WANTED)
    if not len(reached):
        return None
    at = int(reached[0])
    if at == 0:
        return float(effects[0])
    part = (WANTED - rising[at - 1]) / (rising[at] - rising[at - 1])
    return float(effects[at - 1] + part * (effects[at] - effects[at - 1]))


def _lowest(block: Planned, counts: Counts, studies: int) -> Iterator[Curve]:
    if (block.id, "lowest") not in counts:
        return
    shares = counts[block.id, "lowest"] / studies
    for place, item in enumerate(block.items):
        if shares[:, place].any():
            for delay in range(1, block.k):
                power = tuple(shares[:, place, delay].tolist())
                yield Curve(block.id, "lowest delay", item.id, "", block.names[delay], power, None, None, None)


def _equivalent(block: Planned, counts: Counts, studies: int) -> Iterator[Curve]:
    if (block.id, "equivalent") not in counts:
        return
    shares = counts[block.id, "equivalent"] / studies
    means = counts[block.id, "means"][FULL] / studies
    for place, item in enumerate(block.items):
        for delay in range(1, block.k):
            none, full = (tuple(shares[:, effect, place, delay - 1].tolist()) for effect in (0, 1))
            away = float(means[delay, place] - means[0, place])
            yield Curve(block.id, "equivalence", item.id, "", block.names[delay], full, none, away, None)
