"""Error rates of the report's verdicts on simulated studies, counted and compared with limits.

The truth of a study is known. One generator is the answer model of rehearsals, the other an independent ordinal probit
model with random effects of people. In an "empty" study no setting differs from another. In one with "own trends" each
person has individual trends over the delay and opinions of the liquids, whose means are zero. In a "partial" one the
last liquid equals the first, and the delays of the lower half equal the shortest. A "full" one has all effects. Batches
of the cells alternate, so that partial results are balanced.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Final, Literal, TypeAlias, get_args

import numpy as np
from scipy.special import expit
from scipy.stats import binomtest

from study_app.analysis.data import SPENDINGS, Array, Block, Decided
from study_app.analysis.evaluate import evaluate_block
from study_app.analysis.findings import (
    FOUND,
    BlockAnswers,
    ContrastsWithControl,
    DelayTrend,
    DetectionThreshold,
    LiquidRecognition,
    LowestDelay,
    MeanTests,
    OverAll,
    Pairs,
    SettingsDiffer,
    add_gates,
    answers_from_tables,
    common_ms,
)
from study_app.analysis.planning.power_curves import interval
from study_app.analysis.planning.simulated_studies import Opinions, Plan, draw_opinions
from study_app.analysis.report import answers as answered
from study_app.analysis.results import BlockResult, Failures, Results
from study_app.analysis.statistics import detection_threshold, tost
from study_app.evidence.report_rates.hypotheses import false_claims, true_claims
from study_app.evidence.table import Evidence, Table
from study_app.protocol.participants import REHEARSED

Generator: TypeAlias = Literal["answer model", "ordinal probit"]
_Extent: TypeAlias = Literal["empty", "own trends", "partial", "full"]
GENERATORS: Final[tuple[Generator, ...]] = get_args(Generator)
EXTENTS: Final[tuple[_Extent, ...]] = get_args(_Extent)
_NO_EFFECT: Final[tuple[_Extent, ...]] = ("empty", "own trends")
"""Extents in which no setting differs from another in the mean over all people."""

_LEVELS: Final = np.array([-2.0, -1.2, -0.4, 0.4, 1.2, 2.0])
"""Thresholds of the latent answer between the seven levels of the probit model."""

PEOPLE: Final = REHEARSED.model_copy(update={"lapse_rate": 0.1})
"""The people of the answer model."""
_BIAS_SD: Final = 0.7
_SLOPE_SD: Final = 0.3
"""Standard deviations between people of the response bias, and of the sensitivity to an effect."""

TRUTH: Final = 4000
"""Number of simulated people from whom the true differences of means are computed."""


def _equal_settings(block: Block, extent: _Extent) -> Mapping[int, int]:
    """Return a map from the index of each condition that equals an earlier one to the earlier index."""
    k = len(block.settings)
    if extent in _NO_EFFECT:
        return dict.fromkeys(range(1, k), 0)
    if extent == "full":
        return {}
    return dict.fromkeys(range(1, k // 2 + 1), 0) if block.kind == "delays" else {k - 1: 0}


def simulate_answers(
    simulation: Plan, generator: Generator, extent: _Extent, participants: int, seed: int, study: int
) -> tuple[Array, ...]:
    """Return the answers (participants, settings, items) of one simulated study, block by block."""
    if generator == "answer model":
        thought = draw_opinions(simulation, participants, seed, study)
        rng = np.random.default_rng([seed, study, participants])
        return tuple(
            _simulate_answers(block, opinions, extent, rng)
            for block, opinions in zip(simulation.blocks, thought, strict=True)
        )
    rng = np.random.default_rng([seed, study])
    bias, slope = _BIAS_SD * rng.normal(size=participants), 1 + _SLOPE_SD * rng.normal(size=participants)
    return tuple(_simulate_probit(simulation, block, extent, bias, slope, rng) for block in simulation.blocks)


def _simulate_answers(block: Block, opinions: Opinions, extent: _Extent, rng: np.random.Generator) -> Array:
    """Return the answers of the answer model; equal conditions have equal effects."""
    if extent == "empty":
        return opinions.answers(0.0, PEOPLE)
    values = opinions.thought.copy()
    if extent == "own trends":
        effects = _draw_individual_effects(block, (len(values), *values.shape[2:]), rng)
        return replace(opinions, thought=values.mean(axis=2, keepdims=True) + effects[:, None]).answers(1.0, PEOPLE)
    for index, equal_index in _equal_settings(block, extent).items():
        values[:, :, index] = values[:, :, equal_index]
    return replace(opinions, thought=values).answers(1.0, PEOPLE)


def _simulate_probit(
    simulation: Plan, block: Block, extent: _Extent, bias: Array, slope: Array, rng: np.random.Generator
) -> Array:
    effects = _latent_effects(simulation, block)
    if extent == "own trends":
        latent = bias[:, None, None] + _draw_individual_effects(block, (len(bias), *effects.shape), rng)
        latent += rng.normal(size=latent.shape)
        return np.add(np.searchsorted(_LEVELS, latent), 1, dtype=np.float64)
    for index, equal_index in _equal_settings(block, extent).items():
        effects[index] = effects[equal_index]
    latent = bias[:, None, None] + slope[:, None, None] * effects + rng.normal(size=(len(bias), *effects.shape))
    return np.add(np.searchsorted(_LEVELS, latent), 1, dtype=np.float64)


def _draw_individual_effects(block: Block, shape: tuple[int, ...], rng: np.random.Generator) -> Array:
    """Return individual effects (participants, settings, items) with mean zero: trends or opinions."""
    n, k, items = shape
    if block.kind == "delays":
        return np.linspace(-1.0, 1.0, k)[:, None] * rng.normal(size=(n, 1, items))
    return rng.normal(size=shape)


def _latent_effects(simulation: Plan, block: Block) -> Array:
    """Return the latent effect of each condition on each item (settings, items)."""
    k, items = len(block.settings), len(block.items)
    if block.kind == "delays":
        signs = [
            {"increasing": 1.0, "decreasing": -1.0, None: 0.0}[simulation.decided.direction(item.id)]
            for item in block.items
        ]
        return np.outer(np.linspace(-1.0, 1.0, k), signs)
    effects = np.outer(np.resize([0.0, 1.5, -0.8], k), np.resize([1.0, -1.0], items))
    for place, setting in enumerate(block.settings):
        for column, item in enumerate(block.items):
            if item.id in simulation.decided.names:
                effects[place, column] = 1.0 if setting.label == item.id else -1.0
    return np.asarray(effects)


def _true_differences(simulation: Plan, generator: Generator, extent: _Extent) -> tuple[Array, ...]:
    """Return the true mean differences from the first condition (settings, items), block by block."""
    differences = []
    for block, answers in zip(
        simulation.blocks, simulate_answers(simulation, generator, extent, TRUTH, 0, 0), strict=True
    ):
        means = answers.mean(axis=0)
        for index, equal_index in _equal_settings(block, extent).items():
            means[index] = means[equal_index]
        differences.append(np.asarray(means - means[0]))
    return tuple(differences)


_Limit: TypeAlias = Literal["none", "at most 5 %", "at least 93 %", "60 to 80 %", "counted"]

_Verdict: TypeAlias = Literal["yes", "no", "too few studies", "counted"]

_MAX_COMPARED_RATES: Final = 400
"""Upper bound on the number of rates that are compared with limits."""

_CONFIDENCE: Final = 1 - 0.05 / _MAX_COMPARED_RATES
"""Confidence of the interval that must lie beyond a limit for a rate to count as exceeding it.

If all rates are exactly at their limits, none exceeds its limit by chance in 95 % of runs (Bonferroni).
"""

_PERMITTED_RANGES: Final[dict[_Limit, tuple[float, float, float, float]]] = {
    "at most 5 %": (0.0, 0.05, 0.0, 0.075),
    "at least 93 %": (0.93, 1.0, 0.905, 1.0),
    "60 to 80 %": (0.6, 0.8, 0.0, 1.0),
}
"""For each limit, the range that the interval of a rate must overlap, and the range that it must not leave."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rate:
    """Number of ``hits`` among the simulated ``studies`` of one cell; ``what`` names the counted event."""

    cell: str
    participants: int
    what: str
    limit: _Limit
    hits: int
    studies: int

    def __add__(self, other: Rate) -> Rate:
        """Return the pooled rate of two counts of the same event in the same cell."""
        return replace(self, hits=self.hits + other.hits, studies=self.studies + other.studies)

    def __str__(self) -> str:
        low, high = (100 * end for end in self.interval)
        return (
            f"{self.cell}, n = {self.participants}, {self.what}: {self.hits} of {self.studies}, "
            f"{100 * self.share:.1f} % ({low:.1f} to {high:.1f}), {self.limit} {self.holds}"
        )

    @property
    def share(self) -> float:
        return self.hits / self.studies if self.studies else 0.0

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval of the proportion."""
        return interval(self.share, self.studies) if self.studies else (0.0, 1.0)

    @property
    def holds(self) -> _Verdict:
        """Whether the rate meets its limit.

        "no" if the interval with confidence `_CONFIDENCE` lies beyond the limit, since among a hundred rates exactly at
        their limit some 95 % intervals miss it by chance. "yes" if the 95 % interval lies within the limit; otherwise
        there are too few studies.
        """
        if self.limit == "counted":
            return "counted"
        if self.limit == "none":
            return "no" if self.hits else "yes"
        if not self.studies:
            return "too few studies"
        lowest, highest, minimum, maximum = _PERMITTED_RANGES[self.limit]
        low, high = binomtest(self.hits, self.studies).proportion_ci(_CONFIDENCE, method="wilson")
        if high < lowest or low > highest:
            return "no"
        low, high = self.interval
        return "yes" if low >= minimum and high <= maximum else "too few studies"


def report_rates_evidence(rates: Sequence[Rate], heading: str) -> Evidence:
    """Return the rates with their Wilson intervals and whether their limits are met, as Markdown and as CSV."""
    rows = []
    for rate in sorted(rates, key=lambda rate: (rate.cell, rate.what, rate.participants)):
        low, high = (f"{100 * end:.1f}" for end in rate.interval)
        proportion = (f"{100 * rate.share:.1f} %", f"{low} to {high} %", rate.studies)
        rows.append((rate.cell, rate.participants, rate.what, *proportion, rate.limit, rate.holds))
    table = Table(("studies", "n", "what happened", "share", "95 % interval", "of", "limit", "holds"), rows, left=8)
    text = f"{heading}\n\n{table.markdown()}\n"
    cells = [
        (
            *(rate.cell, rate.participants, rate.what, rate.limit, rate.hits, rate.studies),
            *(f"{number:.6f}" for number in (rate.share, *rate.interval)),
            rate.holds,
        )
        for rate in rates
    ]
    names = ("studies", "participants", "what", "limit", "hits", "of", "share", "low", "high", "holds")
    beyond, undecided = (sum(rate.holds == verdict for rate in rates) for verdict in ("no", "too few studies"))
    limited = sum(rate.holds != "counted" for rate in rates)
    closing = "every rate is within its limit"
    if not limited:
        closing = "no rate was computed"
    elif beyond:
        closing = f"{beyond} of {limited} rates exceed their limits, {undecided} undecided"
    elif undecided:
        closing = f"{undecided} of {limited} rates undecided: simulate more studies"
    files = {"rates.md": text, "rates.csv": Table(names, cells).csv()}
    return Evidence(text, files, missed=beyond > 0, undecided=undecided > 0 or not limited, closing=closing)


_BATCH: Final = 25
_DRAWS: Final = 999
"""Number of permutations in the test over all statements, whose error rate does not depend on it."""

Event: TypeAlias = tuple[str, _Limit]
"""The name of a counted event, and its limit."""

_Truth: TypeAlias = tuple[Array, ...]
"""The true differences of means from the first setting (settings, items), for each block."""

LOST: Final[Event] = ("part of the report is missing", "none")
CLAIMED: Final = "the first page claims an effect"
_ANYWHERE: Final = "any part of the report claims an effect"


@dataclass(frozen=True, slots=True)
class Cell:
    """Studies of one kind: the answer model, true effects, number of participants and planned looks, if any."""

    generator: Generator
    extent: _Extent
    participants: int
    looks: tuple[int, ...] = ()
    spending: str = "obrien-fleming"

    @property
    def name(self) -> str:
        looks = f", looks at {', '.join(map(str, self.looks))} by {self.spending}" if self.looks else ""
        return f"{self.generator}, {self.extent}{looks}"


def true_effects(simulation: Plan, cell: Cell) -> _Truth:
    """Return the true effects in the studies of a cell, which do not depend on their size."""
    return _true_differences(simulation, cell.generator, cell.extent)


def count_studies(simulation: Plan, cell: Cell, truth: _Truth, seed: int, batch: int, studies: int) -> tuple[Rate, ...]:
    """Return the rates in the studies of one batch of a cell."""
    events: dict[Event, int] = {}
    for study in range(batch * _BATCH, batch * _BATCH + studies):
        for event, happened in _simulate_study(simulation, cell, truth, seed, study).items():
            events[event] = events.get(event, 0) + happened
    return tuple(
        Rate(cell=cell.name, participants=cell.participants, what=what, limit=limit, hits=hits, studies=studies)
        for (what, limit), hits in events.items()
    )


def _simulate_study(simulation: Plan, cell: Cell, truth: _Truth, seed: int, study: int) -> dict[Event, bool]:
    failures = Failures()
    answers = simulate_answers(simulation, cell.generator, cell.extent, cell.participants, seed, study)
    if cell.looks:
        planned = replace(simulation.decided, looks=cell.looks, spending=cell.spending)
        results_by_look = (
            report(simulation, planned.at(n), [values[:n] for values in answers], study, failures)[1]
            for n in cell.looks
        )
        claimed = any(any(map(_claims, results)) for results in results_by_look)
        return {(f"{_ANYWHERE}, at any look", "at most 5 %"): claimed, LOST: bool(failures.found)}
    decisions = simulation.decided if cell.extent != "partial" else replace(simulation.decided, noticed=None)
    answers_by_block, results = report(simulation, decisions, answers, study, failures)
    events: dict[Event, bool] = {}
    for index, (block, result) in enumerate(zip(simulation.blocks, results, strict=True)):
        events_of = _delay_events if block.kind == "delays" else _liquid_events
        for (name, at_most), hit in events_of(answers_by_block[index], result, cell, truth[index]):
            events[f"{name} ({block.kind})", at_most] = hit
        if cell.extent == "empty":
            test = OverAll.value_in(result)
            differs = test is not None and (test.p or 1.0) <= simulation.decided.alpha
            events[f"test over all statements ({block.kind})", "at most 5 %"] = differs
    events[LOST] = bool(failures.found)
    if cell.extent != "partial":
        people = answers_by_block[0].people
        all_results = Results(simulation.decided, people, results, delivered=(), orders={}, performance=None, seed=1)
        limit: _Limit = "counted" if cell.extent == "full" else "at most 5 %"
        events[CLAIMED, limit] = any(answer.claims for answer in answered(all_results))
        events[_ANYWHERE, limit] = any(map(_claims, results))
    return events


def report(
    simulation: Plan, decided: Decided, answers: Sequence[Array], study: int, failures: Failures
) -> tuple[list[BlockAnswers], tuple[BlockResult, ...]]:
    """Return the answers of each block, and the findings that the report derives from them."""
    people = tuple(f"P{number:03d}" for number in range(len(answers[0])))
    tables = [
        answers_from_tables(
            block,
            decided,
            people,
            {item.id: values[:, :, [column]] for column, item in enumerate(block.items)},
            seed=1 + study,  # separate draws, since the same draws in all studies would bias the rate
            failures=failures,
            verdicts_only=True,
        )
        for block, values in zip(simulation.blocks, answers, strict=True)
    ]
    gated = [replace(answers, seed=1) for answers in add_gates(tables, _DRAWS)]
    return gated, tuple(evaluate_block(None, answers) for answers in gated)


def _claims(result: BlockResult) -> bool:
    """Return whether a block's section claims that conditions differ or that a delay is noticed."""
    pairs = [pair.tested for pair in Pairs.value_in(result)]
    tests = [*SettingsDiffer.value_in(result), *DelayTrend.value_in(result), *MeanTests.value_in(result), *pairs]
    low = any(lowest.over_all_ms is not None for lowest in LowestDelay.value_in(result))
    return (
        any(test.verdict in FOUND for test in tests) or low or _is_liquid_recognised(result) or _has_threshold(result)
    )


def _mean_test_events(result: BlockResult) -> Iterator[tuple[Event, bool]]:
    """Yield, for each statement, whether the test of means finds a difference."""
    yield (
        ("difference found by the test of means", "at most 5 %"),
        any(test.verdict in FOUND for test in MeanTests.value_in(result)),
    )


def _liquid_events(asked: BlockAnswers, result: BlockResult, cell: Cell, _truth: Array) -> Iterator[tuple[Event, bool]]:
    if cell.extent in _NO_EFFECT:
        yield (
            ("conditions differ in a statement", "at most 5 %"),
            any(test.verdict in FOUND for test in SettingsDiffer.value_in(result)),
        )
        yield ("liquids recognised", "at most 5 %"), _is_liquid_recognised(result)
        yield from _mean_test_events(result)
    equal = _equal_pairs(asked.block, cell.extent)
    if equal:
        found_equal = any(
            pair.tested.verdict in FOUND and (pair.first, pair.second) in equal for pair in Pairs.value_in(result)
        )
        yield ("equal liquids distinguished", "at most 5 %"), found_equal
    if cell.extent == "full":
        yield (
            ("some liquids distinguished", "counted"),
            any(pair.tested.verdict in FOUND for pair in Pairs.value_in(result)),
        )
        yield ("liquids recognised", "counted"), _is_liquid_recognised(result)


def _is_liquid_recognised(result: BlockResult) -> bool:
    recognition = LiquidRecognition.value_in(result)
    return recognition is not None and recognition.verdict in FOUND


def _equal_pairs(block: Block, extent: _Extent) -> set[tuple[str, str]]:
    """Return the pairs of codes whose conditions are truly equal."""
    equal_index = _equal_settings(block, extent)
    codes = block.codes
    return {
        (first, second)
        for first_index, first in enumerate(codes)
        for second_index, second in enumerate(codes)
        if first_index < second_index
        and equal_index.get(first_index, first_index) == equal_index.get(second_index, second_index)
    }


def _delay_events(asked: BlockAnswers, result: BlockResult, cell: Cell, truth: Array) -> Iterator[tuple[Event, bool]]:
    block = asked.block
    equal_delays_ms = [block.settings[index].delay_ms or 0.0 for index in _equal_settings(block, cell.extent)]
    if cell.extent in _NO_EFFECT:
        yield (
            ("trend in a statement", "at most 5 %"),
            any(test.verdict in FOUND for test in DelayTrend.value_in(result)),
        )
        yield ("detection threshold printed", "at most 5 %"), _has_threshold(result)
        yield from _mean_test_events(result)
    if equal_delays_ms:
        low = any(
            lowest.over_all_ms is not None and lowest.over_all_ms <= max(equal_delays_ms)
            for lowest in LowestDelay.value_in(result)
        )
        yield ("stated shortest delay with a trend is too short", "at most 5 %"), low
    if cell.extent not in _NO_EFFECT:
        yield from _equivalence(asked, result, truth)
    if cell.extent == "full":
        yield (
            ("shortest delay with a trend stated", "counted"),
            any(lowest.over_all_ms is not None for lowest in LowestDelay.value_in(result)),
        )
        yield ("detection threshold printed", "counted"), _has_threshold(result)


def _has_threshold(result: BlockResult) -> bool:
    threshold = DetectionThreshold.value_in(result)
    return threshold is not None and threshold.effect is not None


def _equivalence(asked: BlockAnswers, result: BlockResult, truth: Array) -> Iterator[tuple[Event, bool]]:
    """Yield whether a delay is wrongly called equivalent: the delay nearest to the bound, and on the first page."""
    bound = asked.decided.equivalence_bound
    if bound is None or not ContrastsWithControl.value_in(result):
        return
    truly_different = {
        (item.id, setting.delay_ms or 0.0): float(difference)
        for setting, row in zip(asked.block.settings, np.abs(truth), strict=True)
        for item, difference in zip(asked.block.items, row, strict=True)
        if difference >= bound
    }
    if not truly_different:
        return
    nearest = min(truly_different, key=truly_different.__getitem__)
    is_called_equivalent = {
        (tested.item, tested.delay_ms): tested.verdict == "equivalent"
        for tested in ContrastsWithControl.value_in(result)
    }
    yield ("smallest difference beyond the bound called equivalent", "at most 5 %"), is_called_equivalent[nearest]
    longest_ms = common_ms(result)
    is_too_long = longest_ms is not None and any(delay <= longest_ms for _, delay in truly_different)
    yield ("“unchanged up to” states too long a delay", "at most 5 %"), is_too_long


_Case: TypeAlias = tuple[str, int]
"""The name of the simulated case, and its number of participants."""

Trial: TypeAlias = Callable[[np.random.Generator], float | None]
"""Simulate one study: return 1 for a hit, else 0; for an interval its error over its half width, None without one."""

COVERS: Final = "interval covers the threshold, if one is printed"
HALF: Final = "interval of half the width covers the threshold"
"""67 % for a normal distribution; 51 % if intervals are 30 % too narrow, 80 % if they are 30 % too wide."""
PRINTED: Final = "threshold printed, with its interval"

_BOUND: Final = 1.0
_LEVELS_MS: Final = np.array([0, 50, 75, 100, 125, 150, 200])
_TRUE_MS: Final = 120.0
_WIDTH_MS: Final = 60.0
_LAPSE: Final = 0.02


@cache
def _single_tests() -> Mapping[_Case, tuple[_Limit, str, Trial]]:
    """Return all cases with the limit of their rate, the counted event, and the simulation of one study."""
    tests: dict[_Case, tuple[_Limit, str, Trial]] = {}
    for n in (5, 12, 24):
        for words, most in (("-1, 0, 1", (-1.0, 0.0, 1.0)), ("0", (0.0,))):
            tests[f"one participant in five differs by 5 points, the others by {words}", n] = (
                "at most 5 %",
                "called equivalent",
                _outlier_trial(n, most),
            )
    for n, spread_ms, never, words in (
        (5, 0.0, 0.0, "the same threshold for all"),
        (12, 0.0, 0.0, "the same threshold for all"),
        (12, 35.0, 0.0, "participants' thresholds, SD 35 ms"),
        (12, 60.0, 0.0, "participants' thresholds, SD 60 ms"),
        (12, 15.0, 1 / 6, "one participant in six never agrees"),
    ):
        tests[words, n] = ("at least 93 %", COVERS, _new_coverage_trial(n, spread_ms, never))
    for claim in false_claims():
        tests[claim.name, claim.participants] = ("at most 5 %", claim.claim, claim.trial)
    for power in true_claims():
        tests[power.name, power.participants] = ("counted", power.claim, power.trial)
    return tests


def count_single(case: _Case, seed: int, batch: int, studies: int) -> tuple[Rate, ...]:
    """Return the rates in the studies of one batch of a case."""
    limit, what, trial = _single_tests()[case]
    number = list(_single_tests()).index(case)
    rng = np.random.default_rng([seed, number, batch])
    p_values = [result for _ in range(studies) if (result := trial(rng)) is not None]
    rate = partial(Rate, cell=case[0], participants=case[1])
    if what != COVERS:
        return (rate(what=what, limit=limit, hits=sum(map(bool, p_values)), studies=len(p_values)),)
    # with five participants t intervals are wide
    half_limit: _Limit = "counted" if case[1] == _SIZES[0] else "60 to 80 %"
    return (
        rate(what=PRINTED, limit="at least 93 %", hits=len(p_values), studies=studies),
        rate(what=what, limit=limit, hits=sum(result <= 1.0 for result in p_values), studies=len(p_values)),
        rate(what=HALF, limit=half_limit, hits=sum(result <= 0.5 for result in p_values), studies=len(p_values)),
    )


def _outlier_trial(n: int, most: tuple[float, ...]) -> Trial:
    def trial(rng: np.random.Generator) -> bool:
        return tost(np.where(rng.random(n) < 0.2, 5.0, rng.choice(most, n)), _BOUND).verdict == "equivalent"

    return trial


def _new_coverage_trial(n: int, spread_ms: float, never: float) -> Trial:
    def trial(rng: np.random.Generator) -> float | None:
        threshold = detection_threshold(_draw_answers(rng, n, spread_ms, never), _LEVELS_MS.tolist())
        if threshold.interval is None or threshold.effect is None:
            return None
        error = _TRUE_MS - threshold.effect
        end = threshold.interval.high if error > 0 else threshold.interval.low
        return abs(error) / abs(end - threshold.effect)

    return trial


def _draw_answers(rng: np.random.Generator, n: int, spread_ms: float, never: float) -> Array:
    """Return answers (n, levels), 6 for noticed and 2 otherwise, of participants with varying thresholds."""
    threshold_ms = _TRUE_MS + spread_ms * rng.normal(size=(n, 1))
    chance = _LAPSE + (1 - 2 * _LAPSE) * expit(2 * np.log(19) * (_LEVELS_MS - threshold_ms) / _WIDTH_MS)
    chance[rng.random(n) < never] = _LAPSE
    return np.where(rng.random(chance.shape) < chance, 6.0, 2.0)


_SIZES: Final = (5, 12, 24)

_LOOKS: Final = (12, 18, 24)
_ROUNDS: Final = 4
"""A cell with an undecided rate is continued up to this multiple of the requested number of studies."""

_Key: TypeAlias = tuple[str, int]
"""The name of a cell and its number of participants."""

_Count: TypeAlias = Callable[[int, int, int], tuple[Rate, ...]]
"""Return the rates of a batch from the seed, the number of the batch and the number of its studies."""


def cells(sizes: Sequence[int] = _SIZES) -> tuple[Cell, ...]:
    """Return every kind of study with every generator and size, and null studies with planned looks."""
    all_cells = [Cell(generator, extent, n) for generator in GENERATORS for extent in EXTENTS for n in sizes]
    planned_looks = [Cell("ordinal probit", "empty", _LOOKS[-1], _LOOKS, spending) for spending in SPENDINGS]
    return (*all_cells, *planned_looks)


def measure_report_rates(
    simulation: Plan,
    studies: int,
    executor: Executor,
    *,
    seed: int = 1,
    sizes: Sequence[int] = _SIZES,
    progress: Callable[[str], object] = str,
) -> Iterator[tuple[int, tuple[Rate, ...]]]:
    """After every batch, yield the number of simulated studies so far and their rates.

    Cells with an undecided rate are extended by the same number of studies, up to ``_ROUNDS`` times as many in total.
    All rates of an extended cell are counted further, including decided ones; ``progress`` is called with one line per
    extended cell. Every batch has its own random stream, so the counts do not depend on the executor.
    """
    counts = _cell_counts(simulation, sizes)
    done, total = 0, dict[tuple[str, int, str], Rate]()
    for round_number in range(_ROUNDS):
        futures = [
            executor.submit(count, seed, batch, size)
            for batch, size in _batch_sizes(studies, round_number)
            for count in counts.values()
        ]
        for future in futures:
            rates = future.result()
            done += rates[0].studies
            for rate in rates:
                key = (rate.cell, rate.participants, rate.what)
                total[key] = total[key] + rate if key in total else rate
            yield done, tuple(total.values())
        undecided = [rate for rate in total.values() if rate.holds == "too few studies"]
        counts = {key: counts[key] for key in dict.fromkeys((rate.cell, rate.participants) for rate in undecided)}
        if not counts:
            return
        if round_number + 1 < _ROUNDS:
            for rate in undecided:
                progress(f"continued: {rate}")


def _cell_counts(simulation: Plan, sizes: Sequence[int]) -> Mapping[_Key, _Count]:
    """Return the function that counts the rates of each cell."""
    all_cells = cells(sizes)
    kinds = {(cell.generator, cell.extent): cell for cell in all_cells}
    truths = {kind: true_effects(simulation, cell) for kind, cell in kinds.items()}
    return {
        **{
            (cell.name, cell.participants): partial(
                count_studies, simulation, cell, truths[cell.generator, cell.extent]
            )
            for cell in all_cells
        },
        **{case: partial(count_single, case) for case in _single_tests()},
    }


def _batch_sizes(studies: int, finished: int) -> list[tuple[int, int]]:
    """Return numbers and sizes of the batches of a round, after ``finished`` rounds."""
    starts = range(0, studies, _BATCH)
    return [(number, min(_BATCH, studies - start)) for number, start in enumerate(starts, start=finished * len(starts))]
