"""One batch of simulated studies, from people to counts of what the protocol's tests found; counts add up."""

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from functools import partial
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.analysis.power import permutation_tests
from study_app.analysis.power.plan import Plan, Planned
from study_app.analysis.power.simulated_studies import people, together
from study_app.analysis.tables.measures import Array
from study_app.analysis.tables.planned_analysis import Decided

EFFECTS: Final = (0.0, 0.125, 0.25, 0.375, 0.5, 0.75, 1.0, 1.5, 2.0, 4.0, 8.0)
"""How many times the effects of the answer model; at 0 every finding is a false alarm."""

FULL: Final = EFFECTS.index(1.0)
BATCH: Final = 20
"""Studies that are tested together; which studies these are does not depend on how many are asked for."""

Counts: TypeAlias = dict[tuple[str, str], NDArray[np.float64]]
"""(Block, what is counted) → numbers of studies.

``found`` (sizes, effects, items): a test of the statement shows it; ``any``, ``all`` (sizes, effects): at least one
does, the test over all does; ``lowest`` (sizes, items, delays): a trend is shown up to this delay or a shorter one;
``equivalent`` (sizes, 2, items, delays): to the shortest, without effect and with the full one. ``means`` (effects,
settings, items) are sums of mean answers.
"""


def count(plan: Plan, sizes: Sequence[int], seed: int, batch: int, studies: int) -> Counts:
    """Simulate the studies of one batch and count what is found at every size.

    Parameters
    ----------
    batch : number of the batch, from 0
    studies : how many of its studies, at most ``BATCH``
    """
    held = [people(plan, max(sizes), seed, batch * BATCH + number) for number in range(studies)]
    counts: Counts = {}
    for place, block in enumerate(plan.blocks):
        answers = together(held, place, EFFECTS)
        rngs = [np.random.default_rng([seed, batch, place, n]) for n in sizes]
        judge = _delays if block.kind == "delays" else _liquids
        found = judge(block, plan.decided, answers, sizes, rngs)
        found["means"] = answers.mean(axis=2).sum(axis=1)
        counts |= {(block.id, what): np.asarray(number, dtype=np.float64) for what, number in found.items()}
    return counts


def _liquids(
    block: Planned, decided: Decided, answers: Array, sizes: Sequence[int], rngs: Sequence[np.random.Generator]
) -> dict[str, Array]:
    effects, studies, _, k, items = answers.shape
    flat = answers.reshape(effects * studies, *answers.shape[2:])
    ranked = permutation_tests.ranks(flat)
    found, over_all = [], []
    for n, rng in zip(sizes, rngs, strict=True):
        if k == 2:
            ps, p_all = permutation_tests.signed(flat[:, :n], rng), None
        else:
            ps, p_all = permutation_tests.friedman(ranked[:, :n], rng)
        found.append(_family(block, decided, ps, range(len(block.items))).reshape(effects, studies, items))
        if p_all is not None:
            over_all.append((p_all <= decided.alpha).reshape(effects, studies))
    counted = {"found": np.array([one.sum(axis=1) for one in found])}
    counted["any"] = np.array([one.any(axis=2).sum(axis=1) for one in found])
    if over_all:
        counted["all"] = np.array([one.sum(axis=1) for one in over_all])
    return counted


def _delays(
    block: Planned, decided: Decided, answers: Array, sizes: Sequence[int], rngs: Sequence[np.random.Generator]
) -> dict[str, Array]:
    effects, studies, _, _, items = answers.shape
    flat = answers.reshape(effects * studies, *answers.shape[2:])
    directed = [place for place, item in enumerate(block.items) if decided.direction(item.id) is not None]
    rising = flat[..., directed] * _signs(block, decided, directed)
    ranked = permutation_tests.ranks(rising)
    counted: dict[str, list[Array]] = {}
    for n, rng in zip(sizes, rngs, strict=True):
        if directed:
            only = _family(block, decided, permutation_tests.trend(ranked[:, :n], rng), directed)
            found = np.zeros((effects, studies, items), dtype=bool)
            found[..., directed] = only.reshape(effects, studies, len(directed))
            lowest = np.zeros((items, len(block.names)))
            full = rising.reshape(effects, studies, *rising.shape[1:])[FULL, :, :n]
            lowest[directed] = _step_down(full, found[FULL][:, directed], decided.alpha, rng)
            counted.setdefault("found", []).append(found.sum(axis=1))
            counted.setdefault("any", []).append(found.any(axis=2).sum(axis=1))
            counted.setdefault("lowest", []).append(lowest)
        if decided.equivalence_bound is not None:
            here = answers[[0, FULL], :, :n]
            away = here[:, :, :, 1:] - here[:, :, :, :1]
            bound = decided.equivalence_bound
            shown = [permutation_tests.equivalent(one, bound, decided.alpha, rng).sum(axis=0) for one in away]
            counted.setdefault("equivalent", []).append(np.array(shown).transpose(0, 2, 1))
    return {what: np.array(numbers) for what, numbers in counted.items()}


def _signs(block: Planned, decided: Decided, directed: Sequence[int]) -> Array:
    return np.array([1.0 if decided.direction(block.items[place].id) == "increasing" else -1.0 for place in directed])


def _step_down(rising: Array, shown: NDArray[np.bool_], alpha: float, rng: np.random.Generator) -> Array:
    """Return how often a trend is shown up to each delay or a shorter one (items, delays).

    ``shown`` (studies, items) says where the trend over all delays is; the steps after it are not corrected.
    """
    _, _, k, items = rising.shape
    counted = np.zeros((items, k))
    going = shown
    for longest in range(k - 1, 0, -1):
        if longest < k - 1:
            going = going & (
                permutation_tests.trend(permutation_tests.ranks(rising[:, :, : longest + 1]), rng) <= alpha
            )
        counted[:, longest] = going.sum(axis=0)
    return counted


def _family(block: Planned, decided: Decided, ps: Array, places: Sequence[int]) -> NDArray[np.bool_]:
    """Return what is significant of ``ps`` (studies, tests): primary statements by Holm, the others by their rate.

    Without any decision all are tested as if they were primary: planning asks what the study could show.
    """
    primary = np.array([not decided.made or decided.is_primary(block.items[place].id) for place in places])
    found = np.zeros(ps.shape, dtype=bool)
    if primary.any():
        found[:, primary] = permutation_tests.holm(ps[:, primary], decided.alpha)
    if not primary.all():
        found[:, ~primary] = permutation_tests.false_discovery(ps[:, ~primary], decided.alpha)
    return found


def sweep(
    plan: Plan, sizes: Sequence[int], studies: int, seed: int, executor: Executor
) -> Iterator[tuple[int, Counts]]:
    """Yield after every batch how many studies of each size were simulated so far, and what was counted in them all.

    Every batch draws from a stream of its own, so the counts do not depend on the executor.
    """
    starts = range(0, studies, BATCH)
    sizes_of_batches = [min(BATCH, studies - first) for first in starts]
    counted = executor.map(partial(count, plan, tuple(sizes), seed), range(len(starts)), sizes_of_batches)
    done, total = 0, Counts()
    for many, numbers in zip(sizes_of_batches, counted, strict=True):
        done += many
        total = {what: total.get(what, 0) + number for what, number in numbers.items()}
        yield done, total
