"""What a protocol plans, simulated studies of it, and counts of what its tests find in them.

A smaller effect draws the opinions of a person on all settings nearer to their mean; response bias and noise stay. The
same people with the same noise answer at every size of the effect and as every kind of people, and the first of them
are the smaller studies, so that curves are smooth; the studies are independent of each other.

All of them meet the same random rearrangements of participants' answers; sums over participants are then products of
matrices of whole numbers, exact in single precision.
"""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.analysis.data.blocks import Block as StatementBlock
from study_app.analysis.data.blocks import Decided, Item, Setting, read_decided
from study_app.analysis.data.measures import Array
from study_app.analysis.statistics.equivalence import STEPS, p_equivalent, shows_equivalence
from study_app.analysis.statistics.mean_tests import means_of, p_differs, resamples_for
from study_app.analysis.statistics.outcome import FEW, SIDES, doubled_ranks, false_discovery, holm, p_of_draws
from study_app.errors import AnalysisError
from study_app.protocol.blocks import Block, display_language
from study_app.protocol.model import Contrast, Protocol
from study_app.protocol.participants import LAPSE_POINTS, SimulatedParticipants, compared_kinds
from study_app.protocol.questions import POINTS, Question
from study_app.protocol.simulated import OPINIONS, TrialFeatures, rater, simulate_ratings
from study_app.protocol.source import text_in

LOWEST, HIGHEST = 1, POINTS
ConditionFeatures: TypeAlias = Mapping[tuple[str, str], Sequence[TrialFeatures]]
"""(Block, condition) → features of rehearsed trials."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Planned(StatementBlock):
    """A main block with questions: its settings in the order of the tests, delays ascending.

    ``features`` are those of rehearsed trials of each setting; ``groups`` those that have the block, if not all do.
    """

    features: tuple[tuple[TrialFeatures, ...], ...]
    repetitions: int
    groups: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The delays, or the conditions, of its settings as text."""
        if self.kind == "delays":
            return tuple(f"{setting.delay_ms:g} ms" for setting in self.settings)
        return tuple(str(setting.condition).replace("_", " ") for setting in self.settings)

    @property
    def k(self) -> int:
        """How many settings there are."""
        return len(self.settings)


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A planned study, its within-participant contrasts of statements, and the number of its other contrasts.

    ``kinds`` are the kinds of participants whose power is computed, by name, the main kind first; ``participants`` is
    their planned number. Contrasts of statements ``between`` groups come with the share of participants in each of the
    two groups; so do contrasts ``of_forms``, with None within participants. Of the others, ``untested_bounds`` have an
    equivalence bound.
    """

    name: str
    title: str
    version: str
    blocks: tuple[Planned, ...]
    decided: Decided
    kinds: Mapping[str, SimulatedParticipants]
    participants: int | None = None
    contrasts: tuple[Contrast, ...] = ()
    untested: int = 0
    between: tuple[tuple[Contrast, tuple[float, float]], ...] = ()
    untested_bounds: int = 0
    of_forms: tuple[tuple[Contrast, tuple[float, float] | None], ...] = ()

    @property
    def unknown(self) -> tuple[str, ...]:
        """The items that the answer model does not cover, so that no effect on them is simulated."""
        return tuple(dict.fromkeys(it.id for block in self.blocks for it in block.items if it.id not in OPINIONS))


def plan(protocol: Protocol, features: ConditionFeatures) -> Plan:
    """Return the plan for a protocol; raise AnalysisError if no block compares settings by questions."""
    language = display_language({"study": {"languages": protocol.study.languages}})
    asked = _compared_blocks(protocol)
    if not asked:
        raise AnalysisError(
            f"{protocol.study.name} does not contain any comparisons: a power analysis needs a main block with two or "
            "more conditions and a questionnaire with statements"
        )
    table = None if protocol.analysis is None else protocol.analysis.model_dump(mode="json")
    every = () if protocol.analysis is None else protocol.analysis.contrasts
    items = {block.id: {item.id for item in _statements(protocol, block)} for block in asked}
    asked_of = [it for it in every if it.form is None]
    stated = [it for it in asked_of if all(it.measure in items.get(block, ()) for block in it.blocks)]
    within = tuple(contrast for contrast in stated if contrast.groups is None)
    return Plan(
        name=protocol.study.name,
        title=text_in(protocol.study.title, language),
        version=protocol.study.version,
        blocks=tuple(_plan_block(protocol, block, features, language) for block in asked),
        decided=read_decided([table]),
        kinds=compared_kinds(protocol.simulated_participants),
        participants=None if protocol.analysis is None else protocol.analysis.participants,
        contrasts=within,
        untested=len(every) - len(within),
        between=tuple(
            (contrast, shares) for contrast in stated if (shares := group_shares(protocol, contrast)) is not None
        ),
        untested_bounds=sum(contrast.bound is not None for contrast in every if contrast not in within),
        of_forms=tuple((it, group_shares(protocol, it)) for it in every if it.form is not None),
    )


def group_shares(protocol: Protocol, contrast: Contrast) -> tuple[float, float] | None:
    """Return the shares of participants in the two compared groups; None if no groups are compared."""
    if contrast.groups is None:
        return None
    whole = sum(group.share for group in protocol.groups.values())
    first, second = (protocol.groups[name].share / whole for name in contrast.groups)
    return first, second


def compares_statements(protocol: Protocol) -> bool:
    """Return whether a main block compares conditions by statements."""
    return bool(_compared_blocks(protocol))


def _compared_blocks(protocol: Protocol) -> list[Block]:
    return [block for block in protocol.main_blocks if _statements(protocol, block) and len(block.conditions) > 1]


def _plan_block(protocol: Protocol, block: Block, features: ConditionFeatures, language: str) -> Planned:
    conditions = {name: protocol.conditions[name] for name in block.conditions}
    kind = protocol.compared_in(block.id)
    assert kind is not None  # noqa: S101 - a main block
    having = protocol.groups_with(block.id)
    names = sorted(conditions, key=lambda name: conditions[name].delay_ms) if kind == "delays" else list(conditions)
    return Planned(
        id=block.id,
        title=text_in(block.title, language),
        kind=kind,
        settings=tuple(
            Setting(
                code=f"S{number}",
                condition=name,
                liquid=" + ".join(condition.liquid_ids),
                delay_ms=condition.delay_ms,
                label=condition.label,
            )
            for number, name in enumerate(names, start=1)
            for condition in (conditions[name],)
        ),
        items=tuple(
            Item(id=item.id, text=text_in(item.text, language), short=text_in(item.short, language))
            for item in _statements(protocol, block)
        ),
        labels=tuple(map(str, range(LOWEST, HIGHEST + 1))),
        cannot_judge=None,
        features=tuple(tuple(features[block.id, name]) for name in names),
        repetitions=block.repetitions,
        groups=having if len(having) < len(protocol.groups) else (),
    )


def _statements(protocol: Protocol, block: Block) -> tuple[Question, ...]:
    """Return the statements of a block, the only questions for which power is planned."""
    questionnaire = protocol.questionnaire_of(block.id)
    return () if questionnaire is None else questionnaire.statements


@dataclass(frozen=True, kw_only=True)
class Opinions:
    """Participants' opinions in a block, and other components of their answers.

    Arrays have the shape (participants, repetitions, settings, items); response bias and slopes belong to participants.
    Both, and noise, are standardised; an answer is a lapse if ``lapse``, from 0 to 1, is below the lapse rate.
    """

    thought: Array
    noise: Array
    lapse: Array
    bias: Array
    slopes: Array

    def answers(self, effect: float, kind: SimulatedParticipants) -> Array:
        """Return the answers (participants, settings, items) with the effect multiplied by ``effect``.

        The participants are of a ``kind``. Repetitions are reduced to their median, as in the analysis.
        """
        middle = self.thought.mean(axis=2, keepdims=True)
        slopes, bias = (one[:, None, None, None] for one in (1.0 + kind.slope_sd * self.slopes, self.bias))
        points = middle + effect * slopes * (self.thought - middle) + kind.bias_sd * bias + kind.noise_sd * self.noise
        points += LAPSE_POINTS * (self.lapse < kind.lapse_rate)
        given = np.clip(np.floor(points + 0.5), LOWEST, HIGHEST)
        return np.asarray(given[:, 0] if given.shape[1] == 1 else np.median(given, axis=1))


_STANDARD: Final = SimulatedParticipants(noise_sd=1, bias_sd=1)
_OF_SLOPES: Final = 1
"""The stream of random numbers of slopes, which are drawn apart from everything else."""


def draw_opinions(plan: Plan, participants: int, seed: int, study: int) -> tuple[Opinions, ...]:
    """Return the opinions of the participants of simulated study number ``study`` in each block of the plan."""
    rng = np.random.default_rng([seed, study])
    slopes = np.random.default_rng([seed, study, _OF_SLOPES]).standard_normal(participants)
    people_of: list[list[tuple[Array, Array, Array]]] = [[] for _ in plan.blocks]
    bias = []
    for _ in range(participants):
        person = rater(rng.random, _STANDARD)
        bias.append(person.leaning)
        for place, block in enumerate(plan.blocks):
            items = [item.id for item in block.items]
            thought, noise = simulate_ratings(items, block.features, block.repetitions, person, rng)
            people_of[place].append((thought, noise, rng.random(noise.shape)))
    return tuple(
        Opinions(thought=thought, noise=noise, lapse=lapse, bias=np.array(bias), slopes=slopes)
        for thought, noise, lapse in (map(np.array, zip(*block, strict=True)) for block in people_of)
    )


def stacked_answers(
    studies: Sequence[tuple[Opinions, ...]], place: int, effects: Sequence[float], kind: SimulatedParticipants
) -> Array:
    """Return one block's answers (effects, studies, participants, settings, items) by participants of a kind."""
    return np.array([[study[place].answers(effect, kind) for study in studies] for effect in effects])


PLANNED_DRAWS: Final = 1999
"""Rearrangements; the report goes through all of them, or draws more."""

_Single = NDArray[np.float32]


def ranks(answers: Array) -> _Single:
    """Return (doubled) ranks among the settings of ``answers`` (…, settings, items): (…, settings, items)."""
    doubled: Any = np.ones(answers.shape, dtype=np.float32)
    for other in range(answers.shape[-2]):
        there = answers[..., other : other + 1, :]
        doubled += (there < answers) * np.float32(2) + (there == answers)
    return np.asarray(doubled)


def friedman(ranked: _Single, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return Friedman's p of every item (studies, items), and of the global test on the sum of their statistics.

    The ranks are (studies, participants, settings, items).
    """
    studies, n, k, items = ranked.shape
    orders = rng.random((PLANNED_DRAWS, n, k)).argsort(axis=-1)
    columns = np.ascontiguousarray(ranked.transpose(1, 2, 0, 3)).reshape(n * k, studies * items)
    middle = np.float32(n * (k + 1))
    seen = ((ranked.sum(axis=1) - middle) ** 2).sum(axis=1)
    squares = np.zeros((PLANNED_DRAWS, studies * items), dtype=np.float32)
    picked = np.zeros((PLANNED_DRAWS, n, k), dtype=np.float32)
    for setting in range(k):
        picked[:] = 0
        np.put_along_axis(picked, orders[..., setting : setting + 1], np.float32(1), axis=-1)
        sums = picked.reshape(PLANNED_DRAWS, n * k) @ columns
        sums -= middle
        sums *= sums
        squares += sums
    squares = squares.reshape(PLANNED_DRAWS, studies, items)
    spread = ((ranked - np.float32(k + 1)) ** 2).sum(axis=(1, 2))
    weights = np.divide(1.0, spread, out=np.zeros(spread.shape), where=spread > 0)
    of_all = np.einsum("dsi,si->ds", squares, weights.astype(np.float32))
    seen_of_all = np.einsum("si,si->s", seen, weights.astype(np.float32))
    return p_of_draws(squares, seen), p_of_draws(of_all, seen_of_all * np.float32(1 - 1e-5))


def trend(ranked: _Single, both_ways: NDArray[np.bool_], rng: np.random.Generator) -> Array:
    """Return the p (studies, items) of an increasing trend; ``ranked``: (studies, participants, settings, items).

    Two-sided for the items (items,) in ``both_ways``.
    """
    studies, n, k, items = ranked.shape
    scores = np.einsum("snki,k->sin", ranked, np.arange(1, k + 1, dtype=np.float32)).reshape(-1, n)
    away = scores - np.float32(k * (k + 1) ** 2 / 2)
    up = (rng.random((PLANNED_DRAWS, n)) < 0.5).astype(np.float32)
    rising, falling = (_p_above(np.abs(away), side * away > 0, up).reshape(studies, items) for side in (1, -1))
    return np.where(both_ways, np.minimum(1.0, 2 * np.minimum(rising, falling)), rising)


def slopes(rising: Array, block: Planned, both_ways: NDArray[np.bool_]) -> Array:
    """Return the p (studies, items) of increasing slopes over the delay; like `trend`, by t tests of the slopes."""
    from scipy.stats import ttest_1samp  # noqa: PLC0415 - half a second, and a report does not need it

    delays = np.array(block.delays_ms) - np.mean(np.array(block.delays_ms))
    own = np.einsum("snki,k->sin", rising, delays)
    rising_p, falling_p = np.ones((2, *own.shape[:2]))
    varied = (np.ptp(own, axis=-1) > 0) & (own.shape[-1] >= FEW)
    rising_p[varied] = ttest_1samp(own[varied], 0.0, axis=-1, alternative="greater").pvalue
    falling_p[varied] = 1 - rising_p[varied]
    return np.asarray(np.where(both_ways, np.minimum(1.0, 2 * np.minimum(rising_p, falling_p)), rising_p))


def signed(answers: Array, rng: np.random.Generator) -> Array:
    """Return the p (studies, items) of Wilcoxon's signed-rank test of ``answers`` (studies, participants, 2, items)."""
    differences = answers[:, :, 0] - answers[:, :, 1]
    studies, n, items = differences.shape
    flat = differences.transpose(0, 2, 1).reshape(-1, n)
    ranked = difference_ranks(flat).astype(np.float32)
    whole = ranked.sum(axis=1)
    up = (rng.random((PLANNED_DRAWS, n)) < 0.5).astype(np.float32) @ ranked.T
    seen = np.where(flat > 0, ranked, 0).sum(axis=1)
    p = p_of_draws(np.maximum(up, whole - up), np.maximum(seen, whole - seen))
    return p.reshape(studies, items)


def difference_ranks(differences: Array) -> Array:
    """Return the (doubled) ranks of the non-zero differences (rows, n); those of zero differences are 0."""
    if not len(differences):
        return differences
    ranked = doubled_ranks(np.abs(differences)) - 2 * (differences == 0).sum(axis=1, keepdims=True)
    return np.where(differences == 0, 0, ranked)


def _p_above(values: Array, positive: NDArray[np.bool_], up: NDArray[np.float32]) -> Array:
    """Return the one-sided p (rows,) of the ``positive`` values among ``values`` (rows, n).

    ``up`` (draws, n) are random signs, 1 for positive.
    """
    seen = np.where(positive, values, 0).sum(axis=1).astype(np.float32) * np.float32(1 - 1e-6)
    drawn = up @ values.T.astype(np.float32)
    return p_of_draws(drawn, seen)


def equivalent(differences: Array, bound: float, alpha: float) -> NDArray[np.bool_]:
    """Return whether differences (studies, participants, …) are equivalent within ± ``bound`` as in the report."""
    rows = np.moveaxis(differences, 1, -1)
    shown = shows_equivalence(rows.reshape(-1, rows.shape[-1]), bound, alpha)
    return np.asarray(shown.reshape(rows.shape[:-1]))


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
settings, items) are sums of mean answers. (Contrast in words, ``contrast``) (sizes, effects): it is shown. Where looks
are planned the sizes are theirs, and what counts is shown at one of them or an earlier one.
"""


def count_findings(plan: Plan, sizes: Sequence[int], seed: int, batch: int, studies: int) -> dict[str, Counts]:
    """Simulate ``studies`` studies of a batch (from 0, of `BATCH`) and count their findings at every size.

    They are counted for each of the plan's kinds of participants.
    """
    held = [draw_opinions(plan, max(sizes), seed, batch * BATCH + number) for number in range(studies)]
    return {
        name: _counted_in(
            plan,
            sizes,
            [stacked_answers(held, place, EFFECTS, kind) for place, _ in enumerate(plan.blocks)],
            seed,
            batch,
        )
        for name, kind in plan.kinds.items()
    }


def _counted_in(plan: Plan, sizes: Sequence[int], given: Sequence[Array], seed: int, batch: int) -> Counts:
    """Count the findings at every size in the answers of each block."""
    flat = [answers.reshape(-1, *answers.shape[2:]) for answers in given]
    ranked = [ranks(answers) for answers in flat]
    of_sizes: dict[tuple[str, str], list[NDArray[np.bool_]]] = {}
    for n in sizes:
        decided = plan.decided.at(n)
        rngs = [np.random.default_rng([seed, batch, place, n]) for place, _ in enumerate(plan.blocks)]
        ps = [friedman(one[:, :n], rng) for one, rng in zip(ranked, rngs, strict=True)]
        gates = np.array([holm(of_study) for of_study in np.array([p_all for _, p_all in ps]).T.tolist()], float).T
        for place, block in enumerate(plan.blocks):
            judge = _delays if block.kind == "delays" else _liquids
            shown = gates[place] <= decided.alpha
            found = judge(block, decided, given[place][:, :, :n], ps[place][0], shown, rngs[place])
            for what, of_studies in found.items():
                of_sizes.setdefault((block.id, what), []).append(of_studies)
        for name, shown in _shown_contrasts(plan, [one[:, :, :n] for one in given], decided.alpha).items():
            of_sizes.setdefault((name, "contrast"), []).append(shown)
    for numbers in of_sizes.values() if plan.decided.looks else ():
        numbers[:] = np.logical_or.accumulate(numbers)  # a study that shows it at a look is stopped
    counts = {what: np.array(numbers, np.float64).sum(axis=1) for what, numbers in of_sizes.items()}
    means = {(block.id, "means"): here.mean(axis=2).sum(axis=1) for block, here in zip(plan.blocks, given, strict=True)}
    return counts | means


IF_EQUAL: Final = "if there is no difference"


def _shown_contrasts(plan: Plan, given: Sequence[Array], alpha: float) -> dict[str, NDArray[np.bool_]]:
    """Return which studies (studies, effects) show each contrast of statements, by its text, as in the report.

    For a contrast with a bound, equivalence within it is included as `IF_EQUAL`. Both are corrected by Holm. ``given``
    are each block's answers (effects, studies, participants, settings, items).
    """
    if not plan.contrasts:
        return {}
    ps, of_equal, with_bound = [], [], [contrast for contrast in plan.contrasts if contrast.bound is not None]
    members = len(plan.contrasts) + plan.untested
    for contrast in plan.contrasts:
        first, second = contrast_sides(plan, given, contrast)
        away = first - second
        ps.append(_p_of_contrast(away, contrast, alpha / members).T)
        if contrast.bound is not None:
            means = means_of(away[0] - away[0].mean(), resamples=resamples_for(alpha / members))
            of_equal.append(p_equivalent(means, contrast.bound, away.shape[-1], STEPS))
    shown = _holm(ps, plan.untested) <= alpha
    shown_of = {contrast.described(): shown[..., place] for place, contrast in enumerate(plan.contrasts)}
    if with_bound:
        equal = np.repeat((_holm(of_equal, plan.untested_bounds) <= alpha)[:, None], len(given[0]), axis=1)
        shown_of |= {
            f"{contrast.described()}, {IF_EQUAL}": equal[..., place] for place, contrast in enumerate(with_bound)
        }
    return shown_of


def contrast_sides(plan: Plan, given: Sequence[Array], contrast: Contrast) -> tuple[Array, Array]:
    """Return each participant's number (effects, studies, participants) in the two conditions or blocks of a contrast.

    ``given`` are each block's answers (effects, studies, participants, settings, items); both numbers are equal in a
    contrast of groups alone.
    """
    blocks = {block.id: (block, answers) for block, answers in zip(plan.blocks, given, strict=True)}

    def numbers(name: str, condition: str | None) -> Array:
        block, answers = blocks[name]
        rows = [place for place, setting in enumerate(block.settings) if condition in (None, setting.condition)]
        item = [item.id for item in block.items].index(contrast.measure)
        return np.asarray(answers[:, :, :, rows, item].mean(axis=-1))

    first, second = contrast.conditions or (None, None)
    return numbers(contrast.blocks[0], first), numbers(contrast.blocks[-1], second)


def _p_of_contrast(away: Array, contrast: Contrast, strictest: float) -> Array:
    """Return the p (effects, studies) of differences (effects, studies, participants); 1 if all are equal."""
    rows = away.reshape(-1, away.shape[-1])
    differ = np.ptp(rows, axis=-1) > 0
    p_values = np.ones(len(rows))
    if differ.any():
        means = means_of(rows[differ], resamples=resamples_for(strictest))
        p_values[differ] = np.max(p_differs(means, SIDES[contrast.expected]), axis=0)
    return p_values.reshape(away.shape[:-1])


def _holm(ps: Sequence[Array], others: int) -> Array:
    """Return p (…, contrasts) corrected together with ``others`` tests that are not significant."""
    family = np.stack([*ps, *[np.ones_like(ps[0])] * others], axis=-1)
    return np.asarray(np.apply_along_axis(lambda each: np.array(holm(each.tolist())), -1, family))


def _count_findings(found: NDArray[np.bool_], shown: NDArray[np.bool_], effects: int) -> dict[str, NDArray[np.bool_]]:
    """Return which studies (studies, effects, …) show the findings (effects · studies, items), in all and each."""
    by_effect = found.reshape(effects, -1, found.shape[-1]).swapaxes(0, 1)
    return {"found": by_effect, "any": np.any(by_effect, axis=2), "all": shown.reshape(effects, -1).T}


def _liquids(
    block: Planned, decided: Decided, answers: Array, ps: Array, shown: NDArray[np.bool_], rng: np.random.Generator
) -> dict[str, NDArray[np.bool_]]:
    """Return the findings if the global test (studies,) shows a difference; ``ps`` are Friedman's."""
    effects = len(answers)
    if block.k == 2:
        ps = signed(answers.reshape(-1, *answers.shape[2:]), rng)
    return _count_findings(_family(block, decided, ps) & shown[:, None], shown, effects)


def _delays(
    block: Planned, decided: Decided, answers: Array, _ps: Array, shown: NDArray[np.bool_], rng: np.random.Generator
) -> dict[str, NDArray[np.bool_]]:
    effects, studies = answers.shape[:2]
    directions = [decided.direction(item.id) for item in block.items]
    rising = answers * np.array([-1.0 if direction == "decreasing" else 1.0 for direction in directions])
    both_ways = np.array([direction is None for direction in directions])
    flat = rising.reshape(-1, *rising.shape[2:])
    ps = slopes(flat, block, both_ways) if decided.trends == "slopes" else trend(ranks(flat), both_ways, rng)
    found = _family(block, decided, ps) & shown[:, None]
    counted = _count_findings(found, shown, effects)
    at_full = found.reshape(effects, studies, -1)[FULL]
    first = rising.shape[3] if decided.trends == "slopes" else rising.shape[3] - 1
    counted["lowest"] = _step_down(rising[FULL], at_full, both_ways, decided.alpha, rng, first)
    if decided.equivalence_bound is not None:
        here = answers[[0, FULL]]
        away = here[:, :, :, 1:] - here[:, :, :, :1]
        equal = [equivalent(one, decided.equivalence_bound, decided.alpha) for one in away]
        counted["equivalent"] = np.array(equal).transpose(1, 0, 3, 2)
    return counted


def _step_down(
    rising: Array,
    shown: NDArray[np.bool_],
    both_ways: NDArray[np.bool_],
    alpha: float,
    rng: np.random.Generator,
    first: int,
) -> NDArray[np.bool_]:
    """Return whether a trend is shown up to each delay or a shorter one (studies, items, delays).

    ``shown`` (studies, items) tells where the trend over all delays is significant; rank correlations over fewer than
    ``first`` delays are tested, without a correction.
    """
    _, _, k, items = rising.shape
    rejected = np.zeros((len(shown), items, k), dtype=bool)
    going = shown
    for longest in range(k - 1, 0, -1):
        if longest < first:
            going = going & (trend(ranks(rising[:, :, : longest + 1]), both_ways, rng) <= alpha)
        rejected[:, :, longest] = going
    return rejected


def _family(block: Planned, decided: Decided, ps: Array) -> NDArray[np.bool_]:
    """Return which of ``ps`` (studies, items) are significant: primary statements by Holm, the others by FDR.

    Without an analysis plan all are tested as primary, since planning asks what the study could show.
    """
    primary = np.array([not decided.made or decided.is_primary(item.id) for item in block.items])
    rejected = np.zeros(ps.shape, dtype=bool)
    for members, adjusted in ((primary, holm), (~primary, false_discovery)):
        if members.any():
            of_studies = [adjusted(of_study) for of_study in ps[:, members].tolist()]
            rejected[:, members] = np.array(of_studies, float) <= decided.alpha + 1e-12
    return rejected


def sweep(
    plan: Plan, sizes: Sequence[int], studies: int, seed: int, executor: Executor
) -> Iterator[tuple[int, dict[str, Counts]]]:
    """Yield after every batch the number of simulated studies of each size so far, and their counts.

    Every batch has its own random stream, so the counts do not depend on the executor.
    """
    starts = range(0, studies, BATCH)
    sizes_of_batches = [min(BATCH, studies - first) for first in starts]
    counted = executor.map(partial(count_findings, plan, tuple(sizes), seed), range(len(starts)), sizes_of_batches)
    done, total = 0, dict[str, Counts]()
    for many, numbers in zip(sizes_of_batches, counted, strict=True):
        done += many
        total = total_counts(total, numbers)
        yield done, total


def total_counts(total: Mapping[str, Counts], more: Mapping[str, Counts]) -> dict[str, Counts]:
    """Return the sums of the counts for each kind of participants; ``total`` is empty before the first batch."""
    return {
        kind: {what: total.get(kind, {}).get(what, 0) + number for what, number in counts.items()}
        for kind, counts in more.items()
    }
