"""The precision of thresholds that a study can expect, in simulated studies and in tables.

The observers answer through the block's method; what they show is estimated as in the report. The people of a study
differ by a factor of 1.2: in their thresholds about a mean that is drawn from the middle half of the levels, in d′, d_a
and exponents about the value that `check` assumes.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import Any, Final, TypeAlias

import numpy as np

from study_app import __version__
from study_app.analysis.data.blocks import decisions
from study_app.analysis.data.measures import Array
from study_app.analysis.planning.power_curves import OF_BLOCK, OF_STUDIES, interval
from study_app.analysis.planning.simulated_studies import group_shares
from study_app.analysis.planning.smallest_differences import form_differences, size_text, smallest_differences
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
"""Studies of one case; which studies these are does not depend on how many are asked for."""
_TRACKS_AT_ONCE: Final = 200

_Plan: TypeAlias = ThresholdPlan | MeanPlan
_PrecisionPlans: TypeAlias = Mapping[str, Mapping[int, _Plan]]
"""Block → trials of each standard → what is simulated."""


@dataclass(frozen=True)
class Case:
    """A batch of studies of one block with a given number of trials per standard."""

    block: str
    plan: _Plan
    seed: tuple[int, ...]


@dataclass
class PrecisionResult:
    """The results of studies of one block with a given number of trials per standard.

    ``errors`` are the errors of the participants' thresholds in each study, (participants, standards), in natural
    logarithms, or relative to the threshold on linear spacing, or to the mean d′, d_a or exponent. ``halves`` are half
    the group's 95 % interval relative to the mean, (sizes,); NaN below three participants, infinite if limits clip the
    levels above the mean threshold.
    """

    errors: list[Array] = field(default_factory=list)
    halves: list[Array] = field(default_factory=list)

    @property
    def spread(self) -> float:
        """The standard deviation of one participant's error at one standard: the median over studies.

        Infinite if nothing is measured.
        """
        spreads = [float(errors.std(ddof=1)) for errors in self.errors if np.isfinite(errors).all()]
        return float(np.median(spreads)) if spreads else math.inf

    def half(self, place: int) -> float:
        """Return the median of half the group's interval at the size with this index.

        Studies without an interval have a wider one than all others; NaN if none has any.
        """
        halves = np.array([half[place] for half in self.halves])
        return math.nan if np.isnan(halves).all() else float(np.median(np.nan_to_num(halves, nan=math.inf)))

    def within(self, place: int, precision: float) -> float:
        """Return the share of studies whose half interval is within the precision, at the size with this index."""
        return float(np.mean([half[place] <= precision for half in self.halves]))


def plans(protocol: Protocol, trials: Sequence[int]) -> _PrecisionPlans:
    """Return each block's plans by number of trials (default: its own), for thresholds, d′, d_a or exponents.

    AnalysisError is raised if a method cannot have so few trials.
    """
    planned = {}
    for block in protocol.main_blocks:
        plan = precision_plan(protocol, block)
        if plan is None:
            continue
        changed: list[_Plan] = [plan.with_trials(trial) for trial in trials] or [plan]
        for asked, one in zip(trials, changed, strict=False):
            if abs(one.trials - asked) > max(1, asked / 2):
                raise AnalysisError(
                    f"{asked} trials cannot be divided among the tracks and levels in {block.id}: specify at least "
                    f"{one.trials}"
                )
        planned[block.id] = {one.trials: one for one in changed}
    return planned


def study_batch(case: Case, sizes: Sequence[int]) -> PrecisionResult:
    """Return the results of the studies of a batch.

    ``sizes`` ascend; smaller studies have the first participants of the largest.
    """
    plan, rng, people = case.plan, np.random.default_rng(case.seed), sizes[-1]
    if not isinstance(plan, ThresholdPlan):
        return _means(plan, sizes, rng)
    low, high = plan.stimulus.domain
    means = low + (high - low) * (0.25 + 0.5 * rng.random((BATCH, 1, 1)))
    apart = math.log(BETWEEN_PEOPLE) * rng.standard_normal((BATCH, people, 1))
    log = plan.stimulus.spacing == "log"
    own = means + apart / math.log(10) if log else means * np.exp(apart)
    each, truth = plan.each_standard(), np.broadcast_to(own, (BATCH, people, plan.standards))
    first = case.seed[-1] * BATCH
    kinds = [_kind_of(plan, first + place) for place in range(BATCH)]
    parts = zip(each, np.split(truth, len(each), 2), strict=True)
    of_sizes = zip(*(_estimates(plan, part, kinds, sizes, rng) for plan, part in parts), strict=True)
    by_size = [tuple(np.concatenate(it, 2) for it in zip(*of_size, strict=True)) for of_size in of_sizes]
    precision, full = PrecisionResult(), plan.measures(means).ravel().tolist()
    errors = (by_size[-1][0] - truth) * (math.log(10) if log else 1 / truth)
    for study, measured in enumerate(full):
        halves = []
        for n, (medians, variances, shared) in zip(sizes, by_size, strict=True):
            of_people, of_variances = medians[study].mean(axis=1), variances[study].sum(axis=1) / plan.standards**2
            of_all = Z_95 * math.sqrt(float(shared[study].mean()))
            group = group_mean(of_people.tolist(), of_variances.tolist(), (of_all, of_all)) if n >= FEWEST else None
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


def _means(plan: MeanPlan, sizes: Sequence[int], rng: np.random.Generator) -> PrecisionResult:
    """Return the results of a batch for d′, d_a or exponents, whose means have Student's interval."""
    people, precision = sizes[-1], PrecisionResult()
    truth = plan.value * np.exp(math.log(BETWEEN_PEOPLE) * rng.standard_normal((BATCH, people)))
    estimates = plan.estimates(truth.reshape(-1), rng).reshape(BATCH, people)
    for own, true in zip(estimates, truth, strict=True):
        halves = []
        for n in sizes:
            (low, high), mean = student_interval(own[:n]), abs(float(own[:n].mean()))
            half = math.nan if low is None or high is None else (high - low) / 2
            halves.append(half / mean if mean else math.inf)
        precision.errors.append((own - true)[:, None] / plan.value)
        precision.halves.append(np.array(halves))
    return precision


def _kind_of(plan: ThresholdPlan, study: int) -> Person:
    """Return the kind of participants of a study; the kinds alternate."""
    return [*plan.kinds.values()][study % len(plan.kinds)]


def _estimates(
    plan: ThresholdPlan, truth: Array, kinds: Sequence[Person], sizes: Sequence[int], rng: np.random.Generator
) -> Iterator[tuple[Array, ...]]:
    """Yield for each size medians and variances (studies, participants, standards), and shared errors (studies, 1, …).

    Observers have thresholds ``truth`` (studies, participants, standards) [u]; all participants of a study are of one
    of ``kinds``. The first of them are the participants of the smaller studies, which estimate their own widths.
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
        yield tuple(np.concatenate(it).reshape(studies, standards, -1).transpose(0, 2, 1) for it in values)


def sweep(
    planned: _PrecisionPlans, sizes: Sequence[int], studies: int, seed: int, executor: Executor
) -> Iterator[tuple[int, dict[tuple[str, int], PrecisionResult]]]:
    """Yield after every round of batches the number of simulated studies so far, and their results.

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
    total = {key: PrecisionResult() for key in keys}
    found = executor.map(study_batch, cases, [tuple(sizes)] * len(cases))
    for number, (case, precision) in enumerate(zip(cases, found, strict=True), start=1):
        done = (number - 1) // len(keys) * BATCH
        kept = min(BATCH, studies - done)
        held = total[case.block, case.plan.trials]
        held.errors += precision.errors[:kept]
        held.halves += precision.halves[:kept]
        if number % len(keys) == 0:
            yield done + kept, total


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
        """The planned half interval relative to the mean."""
        decided = self.protocol.analysis
        return None if decided is None else decided.precision


def threshold_csv(precisions: Precisions) -> bytes:
    """Return a CSV row for every block, number of trials and size."""
    return csv_bytes(COLUMNS, _rows(precisions))


def _rows(all_of_it: Precisions) -> Iterator[dict[str, Any]]:
    precision = all_of_it.precision
    for (block, trials), found in all_of_it.found.items():
        for place, size in enumerate(all_of_it.sizes):
            half = found.half(place)
            known = precision is not None and not math.isnan(half)
            within = found.within(place, precision) if precision is not None and known else None
            low, high = (None, None) if within is None else interval(within, all_of_it.studies)
            yield {
                "study": all_of_it.protocol.study.name,
                "simulated": True,
                "block": block,
                "trials": trials,
                "participants": size,
                "studies": all_of_it.studies,
                "spread": round(found.spread, 4) if math.isfinite(found.spread) else None,
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
    lines = [
        f"# {PRECISION} for {text_in(study.title, language)} ({study.name} {study.version})",
        "",
        f"**SIMULATED.** Each row summarises {precisions.studies} studies (seed {precisions.seed}, liquid-study "
        f"{__version__}). True values differ between people by a factor of {BETWEEN_PEOPLE:g} (one standard "
        "deviation). Estimates are computed as in the report.",
    ]
    if precisions.studies < precisions.asked:
        lines += ["", f"**Preliminary: {precisions.studies} of {precisions.asked} studies were simulated.**"]
    participants = None if precisions.protocol.analysis is None else precisions.protocol.analysis.participants
    wanted = [] if precision is None else [f"studies within ±{100 * precision:g} %"]
    heads = ["participants", "SD for one participant", "half-width of the group's 95 % interval", *wanted]
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
        for (of_block, trials), found in precisions.found.items():
            if of_block != block:
                continue
            for place, size in enumerate(precisions.sizes):
                half = found.half(place)
                unknown |= not math.isfinite(half)
                share = "–" if math.isnan(half) else whole_percent(found.within(place, precision or 0.0))
                spread = whole_percent(found.spread) if math.isfinite(found.spread) else "–"
                cells = (
                    str(trials),
                    size_text(size, participants),
                    spread,
                    f"±{whole_percent(half)}" if math.isfinite(half) else "–",
                )
                lines.append(f"| {' | '.join((*cells, *([share] if wanted else [])))} |")
        if unknown:
            lines += ["", _NO_INTERVAL]
        lines += _of_kinds(precisions, block)
    lines += _contrasts(precisions)
    return "\n".join(lines) + "\n"


_NO_INTERVAL: Final = (
    "“–” means that at least half of the simulated studies do not have an interval, because there are fewer than "
    "three participants, because all estimates are equal or because limits clip the levels."
)


def _of_kinds(precisions: Precisions, block: str) -> Iterator[str]:
    """Yield the width of the largest group's interval with the most trials, over kinds: median and worst."""
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


_MEASURED: Final = {ThresholdPlan: "threshold", SensitivityPlan: "d_prime", EstimationPlan: "exponent"}


def _contrasts(precisions: Precisions) -> Iterator[str]:
    """Yield, for each contrast of planned blocks, a table of the smallest difference that 80 % of studies show."""
    if (decided := precisions.protocol.analysis) is None:
        return
    planned, titles = plans(precisions.protocol, ()), _titles(precisions.protocol)
    alpha, members = decisions(precisions.protocol).alphas[-1], len(decided.contrasts)
    for contrast in decided.contrasts:
        if contrast.form is not None:
            shares = group_shares(precisions.protocol, contrast)
            yield from form_differences(
                contrast, precisions.sizes, alpha, members, shares, decided.participants, titles
            )
            continue
        firsts = [next(iter(planned[block].values())) for block in contrast.blocks if block in planned]
        if len(firsts) < len(contrast.blocks) or any(_MEASURED.get(type(it)) != contrast.measure for it in firsts):
            continue
        first, ratio = firsts[0], contrast.measure == "threshold"
        what = contrast.measure.replace("d_prime", "d′")
        assumed = None if isinstance(first, ThresholdPlan) else (what, first.value)
        mean = 1.0 if assumed is None else assumed[1]
        written = (lambda end: f"×/÷ {math.exp(end):.2f}") if ratio else "±{:.2f}".format
        spreads = [(name, mean * spread) for name, spread in _spreads(precisions, contrast)]
        rows = [(name, written(spread).removeprefix("±"), spread) for name, spread in spreads]
        if not rows:
            continue
        share = "" if assumed is None else f", at a mean {what} of {mean:g}"
        whose = f"of one participant's {what}, from the estimation error and the variation between people"
        if contrast.within is not None:
            whose = "of one participant's difference, from both estimation errors and the variation between people"
        yield from smallest_differences(
            contrast, precisions.sizes, alpha, members, rows,
            f"trials{first.per}",
            f"SD: standard deviation {whose} (a factor of {BETWEEN_PEOPLE:g}){share}.",
            written,
            group_shares(precisions.protocol, contrast),
            _log_bound(precisions.protocol, contrast) if ratio else contrast.bound,
            bounds=sum(each.bound is not None for each in decided.contrasts),
            planned=decided.participants, assumed=assumed, titles=titles,
        )  # fmt: skip


def _titles(protocol: Protocol) -> dict[str, str]:
    """Return the titles of the blocks by ID, as in the report."""
    blocks = {name: {"phase": block.phase, "title": block.title} for name, block in protocol.blocks.items()}
    return block_titles({"study": {"languages": protocol.study.languages}, "blocks": blocks})


def _log_bound(protocol: Protocol, contrast: Contrast) -> float | None:
    """Return the logarithm of the equivalence bound; None if there is none, or if thresholds are not ratios."""
    stimuli = [protocol.stimulus_of(protocol.blocks[block]) for block in contrast.blocks]
    if contrast.bound is None or any(stimulus.spacing != "log" for stimulus in stimuli):
        return None
    return abs(math.log(contrast.bound))


def _spreads(precisions: Precisions, contrast: Contrast) -> Iterator[tuple[str, float]]:
    """Yield numbers of trials, and the resulting standard deviation of a participant's compared value."""
    protocol = precisions.protocol
    tracks = [
        () if contrast.measure == "exponent" else tracks_of(protocol, protocol.blocks[it]) for it in contrast.blocks
    ]
    averaged = [len({(track.standard, track.comparison) for track in of_block}) or 1 for of_block in tracks]
    for trials in (trials for block, trials in precisions.found if block == contrast.blocks[0]):
        held = [found for block in contrast.blocks if (found := precisions.found.get((block, trials))) is not None]
        spreads = [precision.spread / math.sqrt(count) for precision, count in zip(held, averaged, strict=False)]
        if len(held) == len(contrast.blocks) and all(map(math.isfinite, spreads)):
            yield str(trials), math.hypot(math.log(BETWEEN_PEOPLE), *spreads)


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
