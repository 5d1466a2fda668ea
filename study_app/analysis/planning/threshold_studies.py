"""The expected precision of thresholds, d′, d_a and exponents, from simulated studies, and its tables.

Simulated observers answer trials of the block's method, and their answers are analysed as in the report. Participants
of a study differ by a factor of 1.2: in thresholds around a mean from the middle half of the levels, and in d′, d_a and
exponents around the value that `check` assumes.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final, TypeAlias

import numpy as np

from study_app import __version__
from study_app.analysis.data.blocks import decisions
from study_app.analysis.data.measures import Array
from study_app.analysis.planning.power_curves import OF_BLOCK, OF_STUDIES, interval
from study_app.analysis.planning.simulated_studies import group_shares, unsimulated_contrasts
from study_app.analysis.planning.smallest_differences import question_differences, size_text, smallest_differences
from study_app.analysis.statistics.outcome import student_interval
from study_app.analysis.statistics.thresholds import FEWEST, group_mean
from study_app.analysis.wording import whole_percent
from study_app.errors import AnalysisError
from study_app.protocol.blocks import block_titles, display_language
from study_app.protocol.model import Contrast, Protocol
from study_app.protocol.orders import tracks_of
from study_app.protocol.source import text_in
from study_app.protocol.warnings import (
    PRECISION,
    EstimationPlan,
    MeanPlan,
    RatingPlan,
    SensitivityPlan,
    ThresholdPlan,
    precision_plan,
)
from study_app.psychophysics.grid import Z_95
from study_app.psychophysics.people import BETWEEN_PEOPLE, ESTIMATE_NOISE, Estimates, Person
from study_app.store.files import Column, csv_bytes, optional

BATCH: Final = 10
"""Studies in a batch; batches do not depend on the requested number of studies."""
_TRACKS_AT_ONCE: Final = 200

_Plan: TypeAlias = ThresholdPlan | MeanPlan
_PrecisionPlans: TypeAlias = Mapping[str, Mapping[int, _Plan]]
"""The plans of simulations by block and by trials of each standard."""


@dataclass(frozen=True)
class Case:
    """The parameters of a batch of studies of one block, with a given number of trials for each standard."""

    block: str
    plan: _Plan
    seed: tuple[int, ...]


@dataclass
class PrecisionResult:
    """The results of studies of one block with a given number of trials per standard.

    ``errors`` are the errors of the participants' thresholds in each study, (participants, standards), in natural
    logarithms, or relative to the threshold if levels are spaced linearly, or to the mean d′, d_a or exponent.
    ``halves`` are half-widths of the group's 95 % interval relative to the mean, (sizes,); NaN for fewer than three
    participants, infinite if limits clip the levels above the mean threshold.
    """

    errors: list[Array] = field(default_factory=list)
    halves: list[Array] = field(default_factory=list)

    @property
    def spread(self) -> float:
        """The standard deviation of one participant's error at one standard: the median over studies.

        It is infinite if limits clip the levels in all studies.
        """
        spreads = [float(errors.std(ddof=1)) for errors in self.errors if np.isfinite(errors).all()]
        return float(np.median(spreads)) if spreads else math.inf

    def half(self, place: int) -> float:
        """Return the median half-width of the group's interval at the size with this index.

        Studies without an interval count as wider than all others; NaN if no study has one.
        """
        halves = np.array([half[place] for half in self.halves])
        return math.nan if np.isnan(halves).all() else float(np.median(np.nan_to_num(halves, nan=math.inf)))

    def within(self, place: int, precision: float) -> float:
        """Return the proportion of studies whose half-width is at most ``precision``, at the size with this index."""
        return float(np.mean([half[place] <= precision for half in self.halves]))


def plans(protocol: Protocol, trials: Sequence[int]) -> _PrecisionPlans:
    """Return the plans of each block by number of trials; without ``trials``, that of the protocol.

    Blocks without a threshold, d′, d_a or exponent are omitted. AnalysisError is raised if a method cannot have so few
    trials.
    """
    planned = {}
    for block in protocol.main_blocks:
        plan = precision_plan(protocol, block)
        if plan is None:
            continue
        changed: list[_Plan] = [plan.with_trials(trial) for trial in trials] or [plan]
        for asked, possible in zip(trials, changed, strict=False):
            if abs(possible.trials - asked) > max(1, asked / 2):
                raise AnalysisError(
                    f"{asked} trials cannot be divided among the tracks and levels in {block.id}: specify at least "
                    f"{possible.trials}"
                )
        planned[block.id] = {possible.trials: possible for possible in changed}
    return planned


def study_batch(case: Case, sizes: Sequence[int]) -> PrecisionResult:
    """Simulate the studies of a batch and return their results.

    ``sizes`` ascend; smaller studies consist of the first participants of the largest one.
    """
    plan, rng, people = case.plan, np.random.default_rng(case.seed), sizes[-1]
    if not isinstance(plan, ThresholdPlan):
        return _simulate_means(plan, sizes, rng)
    low, high = plan.stimulus.domain
    means = low + (high - low) * (0.25 + 0.5 * rng.random((BATCH, 1, 1)))
    deviations = math.log(BETWEEN_PEOPLE) * rng.standard_normal((BATCH, people, 1))
    log, kind = plan.stimulus.spacing == "log", plan.stimulus.decade_kind(plan.design)
    person_thresholds = (
        means * np.exp(deviations) if kind == "threshold" else means + deviations / math.log(10) * plan.decade(means)
    )
    standard_plans, truth = plan.each_standard(), np.broadcast_to(person_thresholds, (BATCH, people, plan.standards))
    first = case.seed[-1] * BATCH
    kinds = [_kind_of(plan, first + place) for place in range(BATCH)]
    parts = zip(standard_plans, np.split(truth, len(standard_plans), 2), strict=True)
    of_sizes = zip(*(_simulate_thresholds(plan, part, kinds, sizes, rng) for plan, part in parts), strict=True)
    by_size = [
        tuple(np.concatenate(arrays, 2) for arrays in zip(*parts_of_size, strict=True)) for parts_of_size in of_sizes
    ]
    precision, mean_measures = PrecisionResult(), plan.measures(means).ravel().tolist()
    errors = (by_size[-1][0] - truth) * (math.log(10) if log else 1 / truth)
    for study, measured in enumerate(mean_measures):
        halves = []
        for n, (medians, variances, shared) in zip(sizes, by_size, strict=True):
            person_medians, person_variances = (
                medians[study].mean(axis=1),
                variances[study].sum(axis=1) / plan.standards**2,
            )
            shared_error = Z_95 * math.sqrt(float(shared[study].mean()))
            group = (
                group_mean(person_medians.tolist(), person_variances.tolist(), (shared_error, shared_error))
                if n >= FEWEST
                else None
            )
            if group is None or group.low is None or group.high is None:
                halves.append(math.nan)
            elif not measured:
                halves.append(math.inf)
            else:
                half = (group.high - group.low) / 2
                halves.append(10.0**half - 1 if log else half / abs(group.mean))
        precision.errors.append(errors[study] if measured else np.full_like(errors[study], math.inf))
        precision.halves.append(np.array(halves))
    return precision


def _simulate_means(plan: MeanPlan, sizes: Sequence[int], rng: np.random.Generator) -> PrecisionResult:
    """Simulate a batch for d′, d_a or exponents, whose group intervals are Student's."""
    people, precision = sizes[-1], PrecisionResult()
    truth = plan.value * np.exp(math.log(BETWEEN_PEOPLE) * rng.standard_normal((BATCH, people)))
    estimates = plan.estimates(truth.reshape(-1), rng).reshape(BATCH, people)
    for estimated, true in zip(estimates, truth, strict=True):
        halves = []
        for n in sizes:
            (low, high), mean = student_interval(estimated[:n]), abs(float(estimated[:n].mean()))
            half = math.nan if low is None or high is None else (high - low) / 2
            halves.append(half / mean if mean else math.inf)
        precision.errors.append((estimated - true)[:, None] / plan.value)
        precision.halves.append(np.array(halves))
    return precision


def _kind_of(plan: ThresholdPlan, study: int) -> Person:
    """Return the kind of participants of a study; studies cycle through all kinds."""
    return [*plan.kinds.values()][study % len(plan.kinds)]


def _simulate_thresholds(
    plan: ThresholdPlan, truth: Array, kinds: Sequence[Person], sizes: Sequence[int], rng: np.random.Generator
) -> Iterator[tuple[Array, ...]]:
    """Yield for each size medians and variances (studies, participants, standards), and shared errors (studies, 1, …).

    ``truth`` are the observers' thresholds (studies, participants, standards) [u]; ``kinds`` has the kind of
    participants of each study. Smaller studies consist of the first participants, with their own group priors.
    """
    studies, people, standards = truth.shape
    own, at_once = truth.transpose(0, 2, 1).reshape(-1), max(1, _TRACKS_AT_ONCE // people) * people
    who = [kind for kind in kinds for _ in range(people * standards)]
    found: list[list[Estimates]] = [[] for _ in sizes]
    for first in range(0, len(own), at_once):
        fits = plan.fits(plan.answers(own[first : first + at_once], rng, who[first : first + at_once]))
        for n, of_size in zip(sizes, found, strict=True):
            some = [fit for start in range(0, len(fits), people) for fit in fits[start : start + n]]
            of_size.append(plan.grouped(some, n))
    for of_size in found:
        values = zip(
            *((estimates.medians, estimates.variances, estimates.shared) for estimates in of_size), strict=True
        )
        yield tuple(np.concatenate(arrays).reshape(studies, standards, -1).transpose(0, 2, 1) for arrays in values)


def sweep(
    planned: _PrecisionPlans, sizes: Sequence[int], studies: int, seed: int, executor: Executor
) -> Iterator[tuple[int, dict[tuple[str, int], PrecisionResult]]]:
    """Yield the number of simulated studies so far and their results after every round of batches.

    ``studies`` is the number for each block and number of trials; ``sizes`` ascend. Every batch has its own seed, so
    the numbers do not depend on the executor.
    """
    keys = [(block, trials) for block, of_trials in planned.items() for trials in of_trials]
    rounds = math.ceil(studies / BATCH)
    cases = [
        Case(block, planned[block][trials], (seed, place, trials, number))
        for number in range(rounds)
        for place, block in enumerate(planned)
        for trials in planned[block]
    ]
    pooled_results = {key: PrecisionResult() for key in keys}
    results = executor.map(study_batch, cases, [tuple(sizes)] * len(cases))
    for number, (case, precision) in enumerate(zip(cases, results, strict=True), start=1):
        done = (number - 1) // len(keys) * BATCH
        count = min(BATCH, studies - done)
        pooled = pooled_results[case.block, case.plan.trials]
        pooled.errors += precision.errors[:count]
        pooled.halves += precision.halves[:count]
        if number % len(keys) == 0:
            yield done + count, pooled_results


COLUMNS: Final = (
    *OF_BLOCK,
    Column(
        "trials",
        "integer",
        "Number of trials per standard, comparison or rated level; for magnitude estimation, the total number of "
        "trials.",
        minimum=1,
    ),
    *OF_STUDIES,
    optional(
        "spread",
        "number",
        "Standard deviation of the logarithm of one participant's threshold (median across the studies); for d′, d_a "
        "and exponents, the standard deviation relative to their value; empty if limits clip the levels.",
        minimum=0,
    ),
    optional(
        "half_interval",
        "number",
        "Half-width of the 95 % interval for the group mean, relative to the mean (median across the studies).",
        minimum=0,
    ),
    optional("precision", "number", "The planned half-width; n/a if no half-width is planned.", minimum=0),
    optional("within", "number", "Proportion of studies that reach the planned half-width.", minimum=0, maximum=1),
    optional(
        "within_low", "number", "Lower end of the 95 % confidence interval for the proportion.", minimum=0, maximum=1
    ),
    optional(
        "within_high", "number", "Upper end of the 95 % confidence interval for the proportion.", minimum=0, maximum=1
    ),
)


@dataclass(frozen=True, kw_only=True)
class Precisions:
    """The results of simulated studies of each size.

    ``found`` is by block and trials per standard; ``asked`` is the requested number of studies.
    """

    protocol: Protocol
    sizes: tuple[int, ...]
    studies: int
    asked: int
    seed: int
    found: Mapping[tuple[str, int], PrecisionResult]

    @property
    def precision(self) -> float | None:
        """The planned half-width of the interval, relative to the mean."""
        decided = self.protocol.analysis
        return None if decided is None else decided.precision


def threshold_csv(precisions: Precisions) -> bytes:
    """Return a CSV row for every block, number of trials and size."""
    return csv_bytes(COLUMNS, _csv_rows(precisions))


def _csv_rows(precisions: Precisions) -> Iterator[dict[str, Any]]:
    precision = precisions.precision
    for (block, trials), result in precisions.found.items():
        for place, size in enumerate(precisions.sizes):
            half = result.half(place)
            known = precision is not None and not math.isnan(half)
            within = result.within(place, precision) if precision is not None and known else None
            low, high = (None, None) if within is None else interval(within, precisions.studies)
            yield {
                "study": precisions.protocol.study.name,
                "simulated": True,
                "block": block,
                "trials": trials,
                "participants": size,
                "studies": precisions.studies,
                "spread": round(result.spread, 4) if math.isfinite(result.spread) else None,
                "half_interval": round(half, 4) if math.isfinite(half) else None,
                "precision": precision,
                "within": None if within is None else round(within, 4),
                "within_low": None if low is None else round(low, 4),
                "within_high": None if high is None else round(high, 4),
            }


def threshold_markdown(precisions: Precisions) -> str:
    """Return a table for each block, with its assumptions."""
    study, precision = precisions.protocol.study, precisions.precision
    language = display_language({"study": {"languages": study.languages}})
    lines = [f"# {PRECISION} for {text_in(study.title, language)} ({study.name} {study.version})"]
    if precisions.found:
        lines += [
            "",
            f"**SIMULATED.** Each row summarises {precisions.studies} studies (seed {precisions.seed}, liquid-study "
            f"{__version__}). True values differ between people by a factor of {BETWEEN_PEOPLE:g} (one standard "
            "deviation). Estimates are computed as in the report.",
        ]
    if precisions.studies < precisions.asked:
        lines += ["", f"**Preliminary: {precisions.studies} of {precisions.asked} studies were simulated.**"]
    participants = None if precisions.protocol.analysis is None else precisions.protocol.analysis.participants
    precision_heading = [] if precision is None else [f"studies within ±{100 * precision:g} %"]
    heads = ["participants", "SD for one participant", "half-width of the group's 95 % interval", *precision_heading]
    planned = plans(precisions.protocol, ())
    blocks = precisions.protocol.blocks
    for block in dict.fromkeys(block for block, _ in precisions.found):
        lines += [
            "",
            f"## {text_in(blocks[block].title, language)} (block {block})",
            "",
            _assumption_sentences(planned[block]),
            "",
        ]
        trials_of, unknown = "trials" + next(iter(planned[block].values())).per, False
        lines += [f"| {' | '.join((trials_of, *heads))} |", "|---:" * (1 + len(heads)) + "|"]
        for (result_block, trials), result in precisions.found.items():
            if result_block != block:
                continue
            for place, size in enumerate(precisions.sizes):
                half = result.half(place)
                unknown |= not math.isfinite(half)
                proportion = "–" if math.isnan(half) else whole_percent(result.within(place, precision or 0.0))
                spread = whole_percent(result.spread) if math.isfinite(result.spread) else "–"
                cells = (
                    str(trials),
                    size_text(size, participants),
                    spread,
                    f"±{whole_percent(half)}" if math.isfinite(half) else "–",
                )
                lines.append(f"| {' | '.join((*cells, *([proportion] if precision_heading else [])))} |")
        if unknown:
            lines += ["", _NO_INTERVAL]
        lines += _kind_sentences(precisions, block)
    lines += _contrast_tables(precisions)
    return "\n".join(lines) + "\n"


_NO_INTERVAL: Final = (
    "“–” means that at least half of the simulated studies do not have an interval, because there are fewer than "
    "three participants, because all estimates are equal or because limits clip the levels."
)


def _kind_sentences(precisions: Precisions, block: str) -> Iterator[str]:
    """Yield a sentence on the precision of the largest sample with the most trials: median and worst over kinds."""
    trials = max(trials for of_block, trials in precisions.found if of_block == block)
    halves = [half[-1] for half in precisions.found[block, trials].halves]
    plan = plans(precisions.protocol, (trials,))[block][trials]
    if not isinstance(plan, ThresholdPlan) or len(halves) < len(plan.kinds):
        return
    medians = {name: float(np.median(halves[place :: len(plan.kinds)])) for place, name in enumerate(plan.kinds)}
    worst = max(medians, key=lambda name: medians[name])
    if math.isfinite(medians[worst]):
        yield ""
        yield (
            f"With {precisions.sizes[-1]} participants and {trials} trials, the precision depends on the type of "
            f"participant: ±{whole_percent(sorted(medians.values())[len(medians) // 2])} (median across types), "
            f"±{whole_percent(medians[worst])} at worst ({worst})."
        )


_MEASURES: Final = {ThresholdPlan: "threshold", SensitivityPlan: "d_prime", EstimationPlan: "exponent"}


def _contrast_tables(precisions: Precisions) -> Iterator[str]:
    """Yield the table of smallest detectable differences of each contrast between planned blocks."""
    if (decided := precisions.protocol.analysis) is None:
        return
    planned, titles = plans(precisions.protocol, ()), _titles_by_block(precisions.protocol)
    alpha, members = decisions(precisions.protocol).alphas[-1], len(decided.contrasts)
    unsimulated = unsimulated_contrasts(precisions.protocol)
    bounds = sum(contrast.bound is not None for contrast in decided.contrasts)
    for contrast in decided.contrasts:
        if contrast in unsimulated:
            proportions = group_shares(precisions.protocol, contrast)
            yield from question_differences(
                contrast,
                precisions.sizes,
                alpha,
                members,
                proportions,
                decided.participants,
                titles,
                bounds=bounds,
                setting=precisions.protocol.measure_text(contrast) if contrast.measure == "pse" else "",
            )
            continue
        firsts = [next(iter(planned[block].values())) for block in contrast.blocks if block in planned]
        if len(firsts) < len(contrast.blocks) or any(_MEASURES.get(type(plan)) != contrast.measure for plan in firsts):
            continue
        first = firsts[0]
        ratio = isinstance(first, ThresholdPlan) and first.stimulus.spacing == "log"
        measure = contrast.measure.replace("d_prime", "d′")
        if isinstance(first, ThresholdPlan):
            measure = first.stimulus.threshold_term(first.design)
        mean = 1.0 if ratio else first.value
        assumed = None if ratio else (measure, mean)
        format_difference = _format_ratio if ratio else partial(_format_difference, unit=first.unit)
        spreads = [(name, mean * spread) for name, spread in _spreads_by_trials(precisions, contrast)]
        rows = [(name, format_difference(spread).removeprefix("±"), spread) for name, spread in spreads]
        if not rows:
            continue
        mean_note = "" if assumed is None else f", at a mean {measure} of {mean:g}{first.unit}"
        sd_note = f"of one participant's {measure}, from the estimation error and the variation between people"
        if contrast.within is not None:
            sd_note = "of one participant's difference, from both estimation errors and the variation between people"
        yield from smallest_differences(
            contrast, precisions.sizes, alpha, members, rows,
            f"trials{first.per}",
            f"SD: standard deviation {sd_note} (a factor of {BETWEEN_PEOPLE:g}){mean_note}.",
            format_difference,
            group_shares(precisions.protocol, contrast),
            _log_bound(precisions.protocol, contrast) if ratio else contrast.bound,
            bounds=bounds,
            planned=decided.participants, assumed=assumed, titles=titles,
        )  # fmt: skip


def _format_ratio(end: float) -> str:
    """Return the ratio of two thresholds from the difference of their natural logarithms."""
    return f"×/÷ {math.exp(end):.2f}"


def _format_difference(end: float, unit: str) -> str:
    return f"±{end:.2f}{unit}"


def _titles_by_block(protocol: Protocol) -> dict[str, str]:
    """Return the titles of the blocks by ID, as in the report."""
    blocks = {name: {"phase": block.phase, "title": block.title} for name, block in protocol.blocks.items()}
    return block_titles({"study": {"languages": protocol.study.languages}, "blocks": blocks})


def _log_bound(protocol: Protocol, contrast: Contrast) -> float | None:
    """Return the logarithm of the equivalence bound; None if there is none, or if thresholds are not ratios."""
    stimuli = [protocol.stimulus_of(protocol.blocks[block]) for block in contrast.blocks]
    if contrast.bound is None or any(stimulus.spacing != "log" for stimulus in stimuli):
        return None
    return abs(math.log(contrast.bound))


def _spreads_by_trials(precisions: Precisions, contrast: Contrast) -> Iterator[tuple[str, float]]:
    """Yield numbers of trials, with the resulting standard deviation of the value that a contrast compares."""
    protocol = precisions.protocol
    tracks = [
        () if contrast.measure == "exponent" else tracks_of(protocol, protocol.blocks[block])
        for block in contrast.blocks
    ]
    counts = [len({(track.standard, track.comparison) for track in of_block}) or 1 for of_block in tracks]
    for trials in (trials for block, trials in precisions.found if block == contrast.blocks[0]):
        results = [result for block in contrast.blocks if (result := precisions.found.get((block, trials))) is not None]
        spreads = [precision.spread / math.sqrt(count) for precision, count in zip(results, counts, strict=False)]
        if len(results) == len(contrast.blocks) and all(map(math.isfinite, spreads)):
            plan = plans(protocol, (trials,))[contrast.blocks[0]][trials]
            between = plan.between_people if isinstance(plan, ThresholdPlan) else math.log(BETWEEN_PEOPLE)
            yield str(trials), math.hypot(between, *spreads)


def _assumption_sentences(plans_of_block: Mapping[int, _Plan]) -> str:
    """Return sentences on the simulated participants of a block and on the group's interval."""
    plan = next(iter(plans_of_block.values()))
    if isinstance(plan, ThresholdPlan):
        preference = "the preference for one interval or for the last answer, " if plan.two_intervals else ""
        return (
            "Each simulated study uses one type of participant, and the studies cycle through all types. The types "
            "differ in the width of the psychometric function (0.5, 1, 1.5 or 2.5 times the median of the prior), "
            f"the rate of random answers (2 or 5 %), {preference}and the change in the threshold over the trials (a "
            "decrease or an increase). The mean threshold lies in the middle half of the levels. The group "
            "interval is the Hartung–Knapp interval for the mean across all standards."
        )
    group = "The group interval is a t-based confidence interval for the mean."
    if isinstance(plan, SensitivityPlan):
        return (
            f"Simulated observers are unbiased and have a mean d′ of {plan.value:g}. The SD is stated relative to this "
            f"mean, the half-width relative to the mean of the estimates. {group}"
        )
    if isinstance(plan, RatingPlan):
        return (
            f"Simulated observers have a mean d_a of {plan.value:g} between a level and the lowest level, and use all "
            f"{plan.points} points of the scale about equally often; the SD is stated relative to d_a. {group}"
        )
    return (
        f"Simulated observers follow a power law with a mean exponent of {plan.value:g}, and the natural logarithms of "
        f"their answers have a standard deviation of {ESTIMATE_NOISE:g}; the SD is stated relative to the mean "
        f"exponent. {group}"
    )
