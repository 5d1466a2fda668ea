"""Plans of studies from protocols, simulated studies of a plan, and counts of the significant findings in them.

A smaller effect moves a person's opinions on all settings towards their mean; response bias and noise stay the same.
All sizes of the effect and all kinds of participants use the same random numbers, and smaller studies consist of the
first participants of the largest one, so that curves are smooth. The studies are independent of each other.

All studies use the same random permutations of participants' answers, so that sums over participants are products of
integer matrices, which are exact in single precision.
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
from study_app.analysis.wording import listed
from study_app.errors import AnalysisError
from study_app.protocol import simulated
from study_app.protocol.blocks import Block, display_language
from study_app.protocol.model import Contrast, Protocol
from study_app.protocol.participants import LAPSE_POINTS, SimulatedParticipants, compared_kinds
from study_app.protocol.questions import POINTS, Question
from study_app.protocol.source import text_in

LOWEST, HIGHEST = 1, POINTS
ConditionFeatures: TypeAlias = Mapping[tuple[str, str], Sequence[simulated.TrialFeatures]]
"""Features of rehearsed trials by (block, condition)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedBlock(StatementBlock):
    """A main block with statements: its settings in the order of the tests, delays ascending.

    ``features`` has the features of rehearsed trials of each setting; ``groups`` are the groups that have the block,
    empty if all do.
    """

    features: tuple[tuple[simulated.TrialFeatures, ...], ...]
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
        """The number of settings."""
        return len(self.settings)


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A planned study, its within-participant contrasts of statements, and the number of its other contrasts.

    ``kinds`` are the kinds of participants whose power is computed, by name, the main kind first; ``participants`` is
    their planned number. Contrasts of statements ``between`` groups come with the proportion of participants in each of
    the two groups; so do contrasts ``of_questions``, with None within participants. Of the others, ``untested_bounds``
    have an equivalence bound.
    """

    name: str
    title: str
    version: str
    blocks: tuple[PlannedBlock, ...]
    decided: Decided
    kinds: Mapping[str, SimulatedParticipants]
    participants: int | None = None
    contrasts: tuple[Contrast, ...] = ()
    untested: int = 0
    between: tuple[tuple[Contrast, tuple[float, float]], ...] = ()
    untested_bounds: int = 0
    of_questions: tuple[tuple[Contrast, tuple[float, float] | None], ...] = ()

    @property
    def unknown(self) -> tuple[str, ...]:
        """The items that the answer model does not cover, so that no effect on them is simulated."""
        return tuple(
            dict.fromkeys(item.id for block in self.blocks for item in block.items if item.id not in simulated.OPINIONS)
        )


def plan(protocol: Protocol, features: ConditionFeatures) -> Plan:
    """Return the plan for a protocol; raise AnalysisError if no block compares settings by questions."""
    language = display_language({"study": {"languages": protocol.study.languages}})
    blocks = _compared_blocks(protocol)
    if not blocks:
        raise AnalysisError(
            f"the power of {protocol.study.name} cannot be estimated, because {_why_no_power(protocol)}; power is "
            "available for statements in blocks with two or more conditions, for hypotheses about other questions, and "
            "for thresholds, d′, ratings of certainty and magnitude estimation"
        )
    table = None if protocol.analysis is None else protocol.analysis.model_dump(mode="json")
    contrasts = () if protocol.analysis is None else protocol.analysis.contrasts
    items = {block.id: {item.id for item in _statements(protocol, block)} for block in blocks}
    stated = [
        contrast
        for contrast in contrasts
        if contrast.form is None and all(contrast.measure in items.get(block, ()) for block in contrast.blocks)
    ]
    within = tuple(contrast for contrast in stated if contrast.groups is None)
    return Plan(
        name=protocol.study.name,
        title=text_in(protocol.study.title, language),
        version=protocol.study.version,
        blocks=tuple(_plan_block(protocol, block, features, language) for block in blocks),
        decided=read_decided([table]),
        kinds=compared_kinds(protocol.simulated_participants),
        participants=None if protocol.analysis is None else protocol.analysis.participants,
        contrasts=within,
        untested=len(contrasts) - len(within),
        between=tuple(
            (contrast, proportions)
            for contrast in stated
            if (proportions := group_shares(protocol, contrast)) is not None
        ),
        untested_bounds=sum(contrast.bound is not None for contrast in contrasts if contrast not in within),
        of_questions=tuple((contrast, group_shares(protocol, contrast)) for contrast in question_contrasts(protocol)),
    )


def _why_no_power(protocol: Protocol) -> str:
    """Return why no result of a study is simulated: its designs, single conditions, or its questions."""
    designs = [protocol.design_of(block).paper_name for block in protocol.main_blocks if block.design is not None]
    if designs:
        return f"results of {listed(list(dict.fromkeys(designs)))} are not simulated"
    if not any(len(block.conditions) > 1 for block in protocol.main_blocks):
        return "no main block has two conditions to compare"
    return "no main block with two or more conditions asks statements, and there is no hypothesis about other questions"


def group_shares(protocol: Protocol, contrast: Contrast) -> tuple[float, float] | None:
    """Return the proportions of participants in the two compared groups; None if no groups are compared."""
    if contrast.groups is None:
        return None
    whole = sum(group.share for group in protocol.groups.values())
    first, second = (protocol.groups[name].share / whole for name in contrast.groups)
    return first, second


def question_contrasts(protocol: Protocol) -> tuple[Contrast, ...]:
    """Return the contrasts of answers and scores, except of statements after trials; the others are simulated."""
    return tuple(
        contrast
        for contrast in (() if protocol.analysis is None else protocol.analysis.contrasts)
        if not contrast.is_of_levels and not protocol.compares_statement(contrast)
    )


def unsimulated_contrasts(protocol: Protocol) -> tuple[Contrast, ...]:
    """Return the contrasts of answers and scores, and of levels that participants set; neither are simulated."""
    contrasts = () if protocol.analysis is None else protocol.analysis.contrasts
    of_questions = question_contrasts(protocol)
    return tuple(contrast for contrast in contrasts if contrast in of_questions or contrast.measure == "pse")


def compares_statements(protocol: Protocol) -> bool:
    """Return whether a main block compares conditions by statements."""
    return bool(_compared_blocks(protocol))


def _compared_blocks(protocol: Protocol) -> list[Block]:
    return [block for block in protocol.main_blocks if _statements(protocol, block) and len(block.conditions) > 1]


def _plan_block(protocol: Protocol, block: Block, features: ConditionFeatures, language: str) -> PlannedBlock:
    conditions = {name: protocol.conditions[name] for name in block.conditions}
    kind = protocol.compared_in(block.id)
    assert kind is not None  # noqa: S101 - true of main blocks
    groups = protocol.groups_with(block.id)
    names = sorted(conditions, key=lambda name: conditions[name].delay_ms) if kind == "delays" else list(conditions)
    return PlannedBlock(
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
        groups=groups if len(groups) < len(protocol.groups) else (),
    )


def _statements(protocol: Protocol, block: Block) -> tuple[Question, ...]:
    """Return the statements of a block, the only questions for which power is planned."""
    questionnaire = protocol.questionnaire_of(block.id)
    return () if questionnaire is None else questionnaire.statements


@dataclass(frozen=True, kw_only=True)
class Opinions:
    """Participants' opinions in a block, and other components of their answers.

    Arrays have the shape (participants, repetitions, settings, items), except ``bias`` and ``slopes`` (participants,).
    These two and ``noise`` are standardised. An answer is a lapse if ``lapse``, from 0 to 1, is below the lapse rate.
    """

    thought: Array
    noise: Array
    lapse: Array
    bias: Array
    slopes: Array

    def answers(self, effect: float, kind: SimulatedParticipants) -> Array:
        """Return the answers (participants, settings, items) with the effect multiplied by ``effect``.

        ``kind`` determines noise, bias, slopes and lapses. Repetitions are reduced to their median, as in the analysis.
        """
        middle = self.thought.mean(axis=2, keepdims=True)
        slopes, bias = (values[:, None, None, None] for values in (1.0 + kind.slope_sd * self.slopes, self.bias))
        points = middle + effect * slopes * (self.thought - middle) + kind.bias_sd * bias + kind.noise_sd * self.noise
        points += LAPSE_POINTS * (self.lapse < kind.lapse_rate)
        given = np.clip(np.floor(points + 0.5), LOWEST, HIGHEST)
        return np.asarray(given[:, 0] if given.shape[1] == 1 else np.median(given, axis=1))


_STANDARD: Final = SimulatedParticipants(noise_sd=1, bias_sd=1)
_OF_SLOPES: Final = 1
"""The random stream of slopes, which is separate from all others."""


def draw_opinions(plan: Plan, participants: int, seed: int, study: int) -> tuple[Opinions, ...]:
    """Return the opinions of the participants of simulated study number ``study`` in each block of the plan."""
    rng = np.random.default_rng([seed, study])
    slopes = np.random.default_rng([seed, study, _OF_SLOPES]).standard_normal(participants)
    people_by_block: list[list[tuple[Array, Array, Array]]] = [[] for _ in plan.blocks]
    bias = []
    for _ in range(participants):
        person = simulated.rater(rng.random, _STANDARD)
        bias.append(person.leaning)
        for place, block in enumerate(plan.blocks):
            items = [item.id for item in block.items]
            thought, noise = simulated.simulate_ratings(items, block.features, block.repetitions, person, rng)
            people_by_block[place].append((thought, noise, rng.random(noise.shape)))
    return tuple(
        Opinions(thought=thought, noise=noise, lapse=lapse, bias=np.array(bias), slopes=slopes)
        for thought, noise, lapse in (map(np.array, zip(*block, strict=True)) for block in people_by_block)
    )


def stacked_answers(
    studies: Sequence[tuple[Opinions, ...]], place: int, effects: Sequence[float], kind: SimulatedParticipants
) -> Array:
    """Return the answers of a kind of participants in a block (effects, studies, participants, settings, items)."""
    return np.array([[study[place].answers(effect, kind) for study in studies] for effect in effects])


PLANNED_DRAWS: Final = 1999
"""Random permutations; the report enumerates all of them, or uses more."""

_Ranks = NDArray[np.float32]


def ranks(answers: Array) -> _Ranks:
    """Return the (doubled) ranks of answers among the settings; both have the shape (…, settings, items)."""
    doubled: Any = np.ones(answers.shape, dtype=np.float32)
    for other in range(answers.shape[-2]):
        compared = answers[..., other : other + 1, :]
        doubled += (compared < answers) * np.float32(2) + (compared == answers)
    return np.asarray(doubled)


def friedman(ranked: _Ranks, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return Friedman's p of every item (studies, items), and of the global test on the sum of their statistics.

    The ranks are (studies, participants, settings, items).
    """
    studies, n, k, items = ranked.shape
    orders = rng.random((PLANNED_DRAWS, n, k)).argsort(axis=-1)
    columns = np.ascontiguousarray(ranked.transpose(1, 2, 0, 3)).reshape(n * k, studies * items)
    middle = np.float32(n * (k + 1))
    observed = ((ranked.sum(axis=1) - middle) ** 2).sum(axis=1)
    squares = np.zeros((PLANNED_DRAWS, studies * items), dtype=np.float32)
    selected = np.zeros((PLANNED_DRAWS, n, k), dtype=np.float32)
    for setting in range(k):
        selected[:] = 0
        np.put_along_axis(selected, orders[..., setting : setting + 1], np.float32(1), axis=-1)
        sums = selected.reshape(PLANNED_DRAWS, n * k) @ columns
        sums -= middle
        sums *= sums
        squares += sums
    squares = squares.reshape(PLANNED_DRAWS, studies, items)
    spread = ((ranked - np.float32(k + 1)) ** 2).sum(axis=(1, 2))
    weights = np.divide(1.0, spread, out=np.zeros(spread.shape), where=spread > 0)
    weighted_sums = np.einsum("dsi,si->ds", squares, weights.astype(np.float32))
    observed_sum = np.einsum("si,si->s", observed, weights.astype(np.float32))
    return p_of_draws(squares, observed), p_of_draws(weighted_sums, observed_sum * np.float32(1 - 1e-5))


def trend(ranked: _Ranks, both_ways: NDArray[np.bool_], rng: np.random.Generator) -> Array:
    """Return the p (studies, items) of an increasing trend; ``ranked``: (studies, participants, settings, items).

    Two-sided for the items (items,) in ``both_ways``.
    """
    studies, n, k, items = ranked.shape
    scores = np.einsum("snki,k->sin", ranked, np.arange(1, k + 1, dtype=np.float32)).reshape(-1, n)
    deviations = scores - np.float32(k * (k + 1) ** 2 / 2)
    positive_signs = (rng.random((PLANNED_DRAWS, n)) < 0.5).astype(np.float32)
    rising, falling = (
        _one_sided_p(np.abs(deviations), side * deviations > 0, positive_signs).reshape(studies, items)
        for side in (1, -1)
    )
    return np.where(both_ways, np.minimum(1.0, 2 * np.minimum(rising, falling)), rising)


def slopes(rising: Array, block: PlannedBlock, both_ways: NDArray[np.bool_]) -> Array:
    """Return the p (studies, items) of increasing slopes over the delay; like `trend`, by t tests of the slopes."""
    from scipy.stats import ttest_1samp  # noqa: PLC0415 - takes half a second, and reports do not need it

    delays_ms = np.array([setting.delay_ms for setting in block.settings])
    delays = delays_ms - delays_ms.mean()
    person_slopes = np.einsum("snki,k->sin", rising, delays)
    rising_p, falling_p = np.ones((2, *person_slopes.shape[:2]))
    varied = (np.ptp(person_slopes, axis=-1) > 0) & (person_slopes.shape[-1] >= FEW)
    rising_p[varied] = ttest_1samp(person_slopes[varied], 0.0, axis=-1, alternative="greater").pvalue
    falling_p[varied] = 1 - rising_p[varied]
    return np.asarray(np.where(both_ways, np.minimum(1.0, 2 * np.minimum(rising_p, falling_p)), rising_p))


def signed(answers: Array, rng: np.random.Generator) -> Array:
    """Return the p (studies, items) of Wilcoxon's signed-rank test of ``answers`` (studies, participants, 2, items)."""
    differences = answers[:, :, 0] - answers[:, :, 1]
    studies, n, items = differences.shape
    flat = differences.transpose(0, 2, 1).reshape(-1, n)
    ranked = difference_ranks(flat).astype(np.float32)
    all_ranks = ranked.sum(axis=1)
    rank_sums = (rng.random((PLANNED_DRAWS, n)) < 0.5).astype(np.float32) @ ranked.T
    observed = np.where(flat > 0, ranked, 0).sum(axis=1)
    p = p_of_draws(np.maximum(rank_sums, all_ranks - rank_sums), np.maximum(observed, all_ranks - observed))
    return p.reshape(studies, items)


def difference_ranks(differences: Array) -> Array:
    """Return the (doubled) ranks of the non-zero differences (rows, n); zero differences have rank 0."""
    if not len(differences):
        return differences
    ranked = doubled_ranks(np.abs(differences)) - 2 * (differences == 0).sum(axis=1, keepdims=True)
    return np.where(differences == 0, 0, ranked)


def _one_sided_p(values: Array, positive: NDArray[np.bool_], positive_signs: NDArray[np.float32]) -> Array:
    """Return the one-sided p (rows,) of the ``positive`` values among ``values`` (rows, n).

    ``positive_signs`` (draws, n) are random signs, 1 for positive.
    """
    observed = np.where(positive, values, 0).sum(axis=1).astype(np.float32) * np.float32(1 - 1e-6)
    drawn = positive_signs @ values.T.astype(np.float32)
    return p_of_draws(drawn, observed)


def _are_equivalent(differences: Array, bound: float, alpha: float) -> NDArray[np.bool_]:
    """Return whether differences (studies, participants, …) are equivalent within ± ``bound``, as in the report."""
    rows = np.moveaxis(differences, 1, -1)
    shown = shows_equivalence(rows.reshape(-1, rows.shape[-1]), bound, alpha)
    return np.asarray(shown.reshape(rows.shape[:-1]))


EFFECTS: Final = (0.0, 0.125, 0.25, 0.375, 0.5, 0.75, 1.0, 1.5, 2.0, 4.0, 8.0)
"""Multiples of the effects of the answer model; at 0 every finding is a false alarm."""

FULL: Final = EFFECTS.index(1.0)
BATCH: Final = 20
"""Studies that are tested together; batches do not depend on the requested number of studies."""

Counts: TypeAlias = dict[tuple[str, str], NDArray[np.float64]]
"""Numbers of studies with a finding, by (block, kind of finding):

``found`` (sizes, effects, items): a test of the statement is significant; ``any`` (sizes, effects): at least one of
them is; ``all`` (sizes, effects): the test over all statements is; ``lowest`` (sizes, items, delays): a trend is shown
up to this delay or a shorter one; ``equivalent`` (sizes, 2, items, delays): a delay is equivalent to the shortest one,
without an effect and with the full effect. ``means`` (effects, settings, items) are sums of mean answers instead.
The keys of contrasts are (text, ``contrast``), with the shape (sizes, effects). If looks are planned, the sizes are
those of the looks, and a finding counts if it is shown at that look or an earlier one.
"""


def count_findings(plan: Plan, sizes: Sequence[int], seed: int, batch: int, studies: int) -> dict[str, Counts]:
    """Simulate ``studies`` studies of a batch (from 0, of `BATCH`) and count their findings at every size.

    The result has the counts for each of the plan's kinds of participants.
    """
    opinions = [draw_opinions(plan, max(sizes), seed, batch * BATCH + number) for number in range(studies)]
    return {
        name: _count_in_answers(
            plan,
            sizes,
            [stacked_answers(opinions, place, EFFECTS, kind) for place, _ in enumerate(plan.blocks)],
            seed,
            batch,
        )
        for name, kind in plan.kinds.items()
    }


def _count_in_answers(
    plan: Plan, sizes: Sequence[int], block_answers: Sequence[Array], seed: int, batch: int
) -> Counts:
    """Count the findings at every size in the answers of each block."""
    flat = [answers.reshape(-1, *answers.shape[2:]) for answers in block_answers]
    ranked = [ranks(answers) for answers in flat]
    shown_by_size: dict[tuple[str, str], list[NDArray[np.bool_]]] = {}
    for n in sizes:
        decided = plan.decided.at(n)
        rngs = [np.random.default_rng([seed, batch, place, n]) for place, _ in enumerate(plan.blocks)]
        ps = [friedman(block_ranks[:, :n], rng) for block_ranks, rng in zip(ranked, rngs, strict=True)]
        gates = np.array([holm(of_study) for of_study in np.array([p_all for _, p_all in ps]).T.tolist()], float).T
        for place, block in enumerate(plan.blocks):
            find = _delay_findings if block.kind == "delays" else _condition_findings
            shown = gates[place] <= decided.alpha
            findings = find(block, decided, block_answers[place][:, :, :n], ps[place][0], shown, rngs[place])
            for kind_of_finding, shown_in_studies in findings.items():
                shown_by_size.setdefault((block.id, kind_of_finding), []).append(shown_in_studies)
        for name, shown in _shown_contrasts(
            plan, [answers[:, :, :n] for answers in block_answers], decided.alpha
        ).items():
            shown_by_size.setdefault((name, "contrast"), []).append(shown)
    for numbers in shown_by_size.values() if plan.decided.looks else ():
        numbers[:] = np.logical_or.accumulate(numbers)  # a study stops at the first look with the finding
    counts = {
        kind_of_finding: np.array(numbers, np.float64).sum(axis=1) for kind_of_finding, numbers in shown_by_size.items()
    }
    means = {
        (block.id, "means"): answers.mean(axis=2).sum(axis=1)
        for block, answers in zip(plan.blocks, block_answers, strict=True)
    }
    return counts | means


IF_EQUAL: Final = "if there is no difference"


def _shown_contrasts(plan: Plan, block_answers: Sequence[Array], alpha: float) -> dict[str, NDArray[np.bool_]]:
    """Return for each contrast of statements, by its text, the studies (studies, effects) that show it.

    For contrasts with a bound, there is an entry with `IF_EQUAL` for equivalence. Both are Holm-corrected, as in the
    report. ``block_answers`` has the answers of each block (effects, studies, participants, settings, items).
    """
    if not plan.contrasts:
        return {}
    ps, equivalence_ps, with_bound = [], [], [contrast for contrast in plan.contrasts if contrast.bound is not None]
    members = len(plan.contrasts) + plan.untested
    for contrast in plan.contrasts:
        first, second = contrast_sides(plan, block_answers, contrast)
        differences = first - second
        ps.append(_p_of_contrast(differences, contrast, alpha / members).T)
        if contrast.bound is not None:
            means = means_of(differences[0] - differences[0].mean(), resamples=resamples_for(alpha / members))
            equivalence_ps.append(p_equivalent(means, contrast.bound, differences.shape[-1], STEPS))
    shown = _holm_adjusted(ps, plan.untested) <= alpha
    shown_by_text = {contrast.described(): shown[..., place] for place, contrast in enumerate(plan.contrasts)}
    if with_bound:
        equal = np.repeat(
            (_holm_adjusted(equivalence_ps, plan.untested_bounds) <= alpha)[:, None], len(block_answers[0]), axis=1
        )
        shown_by_text |= {
            f"{contrast.described()}, {IF_EQUAL}": equal[..., place] for place, contrast in enumerate(with_bound)
        }
    return shown_by_text


def contrast_sides(plan: Plan, block_answers: Sequence[Array], contrast: Contrast) -> tuple[Array, Array]:
    """Return the participants' values (effects, studies, participants) in both conditions or blocks of a contrast.

    ``block_answers`` has the answers of each block (effects, studies, participants, settings, items). Both arrays are
    equal if a contrast only compares groups.
    """
    blocks = {block.id: (block, answers) for block, answers in zip(plan.blocks, block_answers, strict=True)}

    def values_in(name: str, condition: str | None) -> Array:
        block, answers = blocks[name]
        rows = [place for place, setting in enumerate(block.settings) if condition in (None, setting.condition)]
        item = [item.id for item in block.items].index(contrast.measure)
        return np.asarray(answers[:, :, :, rows, item].mean(axis=-1))

    first, second = contrast.conditions or (None, None)
    return values_in(contrast.blocks[0], first), values_in(contrast.blocks[-1], second)


def _p_of_contrast(differences: Array, contrast: Contrast, strictest: float) -> Array:
    """Return the p (effects, studies) of differences (effects, studies, participants); 1 if all are equal."""
    rows = differences.reshape(-1, differences.shape[-1])
    differ = np.ptp(rows, axis=-1) > 0
    p_values = np.ones(len(rows))
    if differ.any():
        means = means_of(rows[differ], resamples=resamples_for(strictest))
        p_values[differ] = np.max(p_differs(means, SIDES[contrast.expected]), axis=0)
    return p_values.reshape(differences.shape[:-1])


def _holm_adjusted(ps: Sequence[Array], others: int) -> Array:
    """Return Holm-adjusted p (…, contrasts) in a family with ``others`` tests that are not significant."""
    family = np.stack([*ps, *[np.ones_like(ps[0])] * others], axis=-1)
    return np.asarray(np.apply_along_axis(lambda ps: np.array(holm(ps.tolist())), -1, family))


def _findings_by_effect(
    significant: NDArray[np.bool_], globally_shown: NDArray[np.bool_], effects: int
) -> dict[str, NDArray[np.bool_]]:
    """Return which studies (studies, effects, …) find an effect: in each statement, in any, and in the global test."""
    by_effect = significant.reshape(effects, -1, significant.shape[-1]).swapaxes(0, 1)
    return {"found": by_effect, "any": np.any(by_effect, axis=2), "all": globally_shown.reshape(effects, -1).T}


def _condition_findings(
    block: PlannedBlock, decided: Decided, answers: Array, ps: Array, shown: NDArray[np.bool_], rng: np.random.Generator
) -> dict[str, NDArray[np.bool_]]:
    """Return findings about conditions; ``shown`` (studies,) is whether the global test is significant."""
    effects = len(answers)
    if block.k == 2:
        ps = signed(answers.reshape(-1, *answers.shape[2:]), rng)
    return _findings_by_effect(_is_significant(block, decided, ps) & shown[:, None], shown, effects)


def _delay_findings(
    block: PlannedBlock,
    decided: Decided,
    answers: Array,
    _ps: Array,
    shown: NDArray[np.bool_],
    rng: np.random.Generator,
) -> dict[str, NDArray[np.bool_]]:
    effects, studies = answers.shape[:2]
    directions = [decided.direction(item.id) for item in block.items]
    rising = answers * np.array([-1.0 if direction == "decreasing" else 1.0 for direction in directions])
    both_ways = np.array([direction is None for direction in directions])
    flat = rising.reshape(-1, *rising.shape[2:])
    ps = slopes(flat, block, both_ways) if decided.trends == "slopes" else trend(ranks(flat), both_ways, rng)
    significant = _is_significant(block, decided, ps) & shown[:, None]
    findings = _findings_by_effect(significant, shown, effects)
    with_full_effect = significant.reshape(effects, studies, -1)[FULL]
    first = rising.shape[3] if decided.trends == "slopes" else rising.shape[3] - 1
    findings["lowest"] = _step_down(rising[FULL], with_full_effect, both_ways, decided.alpha, rng, first)
    if decided.equivalence_bound is not None:
        no_and_full_effect = answers[[0, FULL]]
        differences = no_and_full_effect[:, :, :, 1:] - no_and_full_effect[:, :, :, :1]
        equal = [_are_equivalent(rows, decided.equivalence_bound, decided.alpha) for rows in differences]
        findings["equivalent"] = np.array(equal).transpose(1, 0, 3, 2)
    return findings


def _step_down(
    rising: Array,
    shown: NDArray[np.bool_],
    both_ways: NDArray[np.bool_],
    alpha: float,
    rng: np.random.Generator,
    first: int,
) -> NDArray[np.bool_]:
    """Return whether a trend is shown up to each delay or a shorter one (studies, items, delays).

    ``shown`` (studies, items) is whether the trend over all delays is significant. Rank correlations over fewer than
    ``first`` delays are then tested without a correction.
    """
    _, _, k, items = rising.shape
    rejected = np.zeros((len(shown), items, k), dtype=bool)
    continuing = shown
    for longest in range(k - 1, 0, -1):
        if longest < first:
            continuing = continuing & (trend(ranks(rising[:, :, : longest + 1]), both_ways, rng) <= alpha)
        rejected[:, :, longest] = continuing
    return rejected


def _is_significant(block: PlannedBlock, decided: Decided, ps: Array) -> NDArray[np.bool_]:
    """Return whether each of ``ps`` (studies, items) is significant: primary statements by Holm, others by FDR.

    Without an analysis plan, all statements are treated as primary.
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
    """Yield the number of simulated studies of each size so far and their counts after every batch.

    Every batch has its own random stream, so the counts do not depend on the executor.
    """
    starts = range(0, studies, BATCH)
    sizes_of_batches = [min(BATCH, studies - first) for first in starts]
    counted = executor.map(partial(count_findings, plan, tuple(sizes), seed), range(len(starts)), sizes_of_batches)
    done, total = 0, dict[str, Counts]()
    for number, numbers in zip(sizes_of_batches, counted, strict=True):
        done += number
        total = total_counts(total, numbers)
        yield done, total


def total_counts(total: Mapping[str, Counts], more: Mapping[str, Counts]) -> dict[str, Counts]:
    """Return the sums of the counts for each kind of participants; ``total`` is empty before the first batch."""
    return {
        kind: {what: total.get(kind, {}).get(what, 0) + number for what, number in counts.items()}
        for kind, counts in more.items()
    }
