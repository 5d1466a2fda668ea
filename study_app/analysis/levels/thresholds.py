"""Thresholds of participants, groups and sites.

Fits use all counted answers of a participant at the levels delivered to the hand; the level of trials with the same
requested level is the mean of their delivered levels.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, cast

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from study_app.analysis.data.blocks import LevelBlock, compared_percent
from study_app.analysis.data.measures import number_or_none
from study_app.analysis.levels.answers import Answers
from study_app.analysis.levels.statistic import (
    MOTORS,
    PARTICIPANT_COLUMNS,
    LevelStatistic,
    TableColumn,
    digits,
    interval_phrase,
    level_text,
    unit,
    with_unit,
)
from study_app.analysis.levels.tracks import TRACK, answers_of, setting_of
from study_app.analysis.results import LevelsResult
from study_app.analysis.statistics.outcome import Array
from study_app.analysis.statistics.thresholds import FEWEST, SETS, WORST, GroupMean, drift, group_mean, p_of_fit
from study_app.analysis.wording import counted, listed
from study_app.protocol.trials import ANALYSIS_LAPSES, COMPARISON_CHOSEN, SESSION_SD, Assumed, Design, Stimulus
from study_app.psychophysics.families import Family, level_at, position
from study_app.psychophysics.grid import ALIKE, MANY_LAPSES, MEAN_LAPSE, NEAR_MODE, GroupPriors, Posterior, group_priors
from study_app.psychophysics.person_fit import (
    BEYOND_CHANCE,
    BURST_TRIALS,
    CHANGE_PRIOR,
    EARLY_TRIALS,
    MOST_CLUSTERED,
    PREFERENCE_SD,
    PersonAnswers,
    PersonFit,
    early_change,
    error_bursts,
)

FAMILIES: Final = {"weibull": "Weibull", "normal": "cumulative normal", "logistic": "logistic"}
_WIDTH_UNITS: Final = {"log": "decades", "linear": "level"}
BEYOND: Final = {None: "", "above": "above ", "below": "below "}
_OPEN_ENDS: Final = {(False, False): None, (True, False): "low", (False, True): "high", (True, True): "both"}
_SHIFT: Final = 0.1
"""The largest relative shift of a threshold by the prior on the width that is not reported."""
_NEGLIGIBLE: Final = 0.01
"""The largest relative change of a threshold by lapses that is not reported. [choice]"""
_FEW_ANSWERS: Final = 40
"""The fewest answers for which the coverage of the intervals was tested."""
_MOST_NAMED: Final = 6
REMOVED: Final = (
    "Bias towards one interval or towards repeating the previous answer {} estimated by probit regression with lapses "
    f"and removed (the between-participant standard deviation is assumed to be {PREFERENCE_SD:g} times the standard "
    "deviation of a single decision)."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ThresholdEstimate:
    """A participant's threshold at one standard, as in `columns.RESULTS`, or the group's of ``n`` participants.

    ``flat_width`` is the threshold under a flat prior on the width, and ``variance`` the posterior variance in u.
    ``change`` is the relative change of the threshold from the first to the last trial, 0 if no change was detected.
    ``open_end`` names the ends of the interval that the answers do not determine. ``compared`` is the level at the
    percentage of successes of the published value (see `compared_percent`). The group has only a threshold and
    ``compared``, with their intervals, ``early_change`` and ``error_bursts`` (see `person_fit`), and
    ``if_many_lapses``, the threshold for `grid.MANY_LAPSES`, None if the answers exclude so many lapses.
    """

    participant: str | None
    standard: float | None
    n: int
    threshold: float
    low: float | None
    high: float | None
    width: float | None = None
    lapse: float | None = None
    guess: float | None = None
    flat_width: float | None = None
    beyond: str | None = None
    variance: float | None = None
    fit_p: float | None = None
    drift: float | None = None
    change: float | None = None
    early_change: float | None = None
    error_bursts: float | None = None
    if_many_lapses: float | None = None
    open_end: str | None = None
    reversal_mean: float | None = None
    target_percent: float | None = None
    compared: float | None = None
    compared_low: float | None = None
    compared_high: float | None = None

    @property
    def fits(self) -> bool:
        """Whether the function fits the answers, according to simulated answers; true if unknown."""
        return self.fit_p is None or self.fit_p >= WORST

    @property
    def clustered(self) -> bool:
        """Whether errors of the group follow errors more often than expected."""
        return (self.error_bursts or 0.0) > MOST_CLUSTERED

    @property
    def learned(self) -> bool:
        """Whether the group's thresholds rose or fell after the first trials."""
        return abs(self.early_change or 0.0) > BEYOND_CHANCE

    @property
    def drifts(self) -> bool:
        """Whether the threshold changed over the trials."""
        return bool(self.change)


def person_answers(stimulus: Stimulus, rows: pd.DataFrame) -> PersonAnswers:
    """Return a participant's answers from rows of `tracks`, with mean delivered levels in the coordinate u."""
    requested, places = np.unique(rows["level"].to_numpy(dtype=float), return_inverse=True)
    delivered_levels = rows["level_delivered"].astype("Float64").to_numpy(dtype=float, na_value=math.nan)
    is_known, k = np.isfinite(delivered_levels), len(requested)
    measured = np.bincount(places[is_known], minlength=k)
    delivered = np.bincount(places[is_known], delivered_levels[is_known], minlength=k) / np.maximum(measured, 1)
    has_place = (measured > 0) & ((delivered > 0) | (stimulus.spacing == "linear"))
    mean_levels = np.where(has_place & (requested != 0), delivered, requested)
    return PersonAnswers(
        levels=np.array([stimulus.coordinate(float(level)) for level in mean_levels]),
        places=places,
        successes=rows["success"].to_numpy(dtype=bool),
        towards=rows["towards"].to_numpy(dtype=float),
        before=rows["before"].to_numpy(dtype=float),
        done=np.linspace(0.0, 1.0, len(rows)),
    )


def _ordered_answers(block: LevelBlock, opened: pd.DataFrame) -> pd.DataFrame:
    """Return the answers in trial order, with the correct interval and the previous answer as ±1."""
    rows = opened[(opened["block"] == block.id) & opened["success"].notna()]
    rows = rows.sort_values(["participant", "session", "trial"])
    letters = rows["arrangement"].astype("string")
    towards = np.select([letters.str.startswith("C"), letters == ""], [1.0, 0.0], -1.0)
    chosen = pd.Series(np.where(rows["success"].to_numpy(dtype=bool), towards, -towards), rows.index)
    return rows.assign(
        towards=towards, before=chosen.groupby([rows["participant"], rows["session"]]).shift(fill_value=0.0)
    )


def thresholds(block: LevelBlock, opened: pd.DataFrame) -> Iterator[ThresholdEstimate]:
    """Yield the group's threshold at each standard, followed by those of its participants."""
    assumed, stimulus = block.assumed, block.stimulus
    if assumed is None or stimulus is None:
        return
    for standard, at_standard in _ordered_answers(block, opened).groupby("standard", dropna=False, sort=True):
        fits, priors = _fit_participants(block, assumed, at_standard[at_standard["analysed"]])
        rows_by_person = dict(list(at_standard.groupby("participant")))
        estimates = [_estimate_participant(block, stimulus, standard, fit, rows_by_person[fit.person]) for fit in fits]
        if priors is not None:
            answers = [(fit.fit, fit.posterior) for fit in fits]
            group = _group_estimate(stimulus, standard, estimates, priors)
            yield replace(group, early_change=early_change(answers), error_bursts=error_bursts(answers))
        yield from estimates


def thresholds_of(trials: pd.DataFrame, stimulus: Stimulus, design: Design) -> Iterator[ThresholdEstimate]:
    """Yield thresholds as `thresholds` does, from a table of trials (n rows) in their order.

    Columns are ``level`` and ``success``, and optionally ``participant``, ``session``, ``standard`` and
    ``arrangement``.
    """
    block = LevelBlock("trials", "", "main", design, stimulus, ())
    defaults: dict[str, Any] = {"participant": "P001", "session": 1, "standard": math.nan, "arrangement": ""}
    missing = {name: value for name, value in defaults.items() if name not in trials}
    numbers = np.arange(len(trials))
    return thresholds(
        block, trials.assign(block="trials", trial=numbers, analysed=True, level_delivered=trials["level"], **missing)
    )


@dataclass(frozen=True, slots=True)
class _FittedPerson:
    """The fit to a participant's ``rows`` at a standard; ``factors`` are weights from all participants' answers."""

    person: Any
    rows: pd.DataFrame
    fit: PersonFit
    factors: Array

    @property
    def posterior(self) -> Posterior:
        return self.fit.flat.reweighted(self.factors)


def _fit_participants(
    block: LevelBlock, assumed: Assumed, rows: pd.DataFrame
) -> tuple[list[_FittedPerson], GroupPriors | None]:
    """Return the fit of each participant from the analysed rows of one standard, and the priors from the group."""
    fits, of_people = _flat_fits(block, rows), dict(list(rows.groupby("participant")))
    if not fits:
        return [], None
    priors = group_priors([fit.flat for fit in fits.values()], assumed.width_prior)
    return [
        _FittedPerson(person, of_people[person], fit, factors)
        for (person, fit), factors in zip(fits.items(), priors.factors, strict=True)
    ], priors


@dataclass(frozen=True, slots=True, kw_only=True)
class ThresholdInU:
    """A participant's threshold in u, the mean over standards, and the variance of its estimate."""

    value: float
    variance: float


def thresholds_compared(
    first: LevelBlock, second: LevelBlock, opened: pd.DataFrame
) -> tuple[tuple[Mapping[str, ThresholdInU], Mapping[str, ThresholdInU]], float]:
    """Return the thresholds of the participants in two blocks, and the variance that widths add to their difference.

    Blocks with the same levels, design and standards have a common width, whose prior shifts the thresholds in both
    blocks alike. Otherwise, the error of a block's width is shared by all of its thresholds.
    """
    blocks, fits_by_block = (first, second), []
    for block in blocks:
        rows = _ordered_answers(block, opened)
        at_standards = rows[rows["analysed"]].groupby("standard", dropna=False, sort=True)
        fits_by_block.append([_flat_fits(block, at_standard) for _, at_standard in at_standards])
    stimuli = [
        (block.stimulus and block.stimulus.model_copy(update={"condition": None}), block.assumed) for block in blocks
    ]
    alike = (
        stimuli[0] == stimuli[1] and first.design == second.design and len(fits_by_block[0]) == len(fits_by_block[1])
    )
    posteriors: tuple[dict[str, list[Posterior]], ...] = ({}, {})
    shared = 0.0
    for place, fits_by_standard in enumerate(fits_by_block):
        prior = blocks[place].assumed
        for standard, people in enumerate(fits_by_standard):
            others = fits_by_block[1 - place][standard] if alike else {}
            if prior is None or not people:
                continue
            fits = [fit.flat for fit in (*people.values(), *others.values())]
            priors = group_priors(fits, prior.width_prior)
            shared += 0.0 if alike else priors.variance / len(fits_by_standard)
            for (person, fit), factors in zip(people.items(), priors.factors, strict=False):
                posteriors[place].setdefault(str(person), []).append(fit.flat.reweighted(factors))
    first_thresholds, second_thresholds = (
        {
            person: ThresholdInU(
                value=float(np.mean([posterior.threshold for posterior in of_person])),
                variance=sum(posterior.variance for posterior in of_person) / len(of_person) ** 2,
            )
            for person, of_person in of_block.items()
        }
        for of_block in posteriors
    )
    return (first_thresholds, second_thresholds), shared


def _flat_fits(block: LevelBlock, rows: pd.DataFrame) -> dict[Any, PersonFit]:
    """Return the fit of each participant from the analysed rows of one standard, with a flat prior on the width."""
    if (stimulus := block.stimulus) is None or (assumed := block.assumed) is None:
        return {}
    two_intervals = block.design.kind == "2ifc" and block.has_correct_answer
    fits = {}
    for person, person_rows in rows.groupby("participant"):
        grid = stimulus.analysis_grid(block.design, assumed, person_rows["session"].nunique())
        fits[person] = person_answers(stimulus, person_rows).fit(grid, two_intervals=two_intervals)
    return fits


def _estimate_participant(
    block: LevelBlock, stimulus: Stimulus, standard: Any, fitted: _FittedPerson, all_rows: pd.DataFrame
) -> ThresholdEstimate:
    """Return a participant's threshold; ``all_rows`` includes the rows that are not analysed."""
    fit, posterior, rows = fitted.fit, fitted.posterior, fitted.rows
    given, grid = fit.answers, posterior.grid
    level_of, threshold, (low, high) = stimulus.level_of, posterior.threshold, posterior.interval
    others = posterior.others
    psi, (lowest, highest) = fit.expected(posterior), stimulus.domain
    _, first, cells = np.unique([given.places, fit.shifts], axis=1, return_index=True, return_inverse=True)
    decades = fit.change / (1.0 if stimulus.spacing == "log" else abs(threshold) * math.log(10))
    percent, compared = compared_percent(block.published), math.nan
    if percent is not None:
        compared = level_at(grid.family, percent, threshold, **others._asdict())
    return ThresholdEstimate(
        participant=str(fitted.person),
        standard=number_or_none(standard),
        n=len(rows),
        threshold=level_of(threshold),
        low=level_of(low),
        high=level_of(high),
        width=others.width,
        lapse=others.lapse,
        guess=others.guess,
        flat_width=level_of(fit.flat.threshold),
        beyond="above" if threshold > highest else "below" if threshold < lowest else None,
        variance=posterior.variance,
        open_end=_OPEN_ENDS[posterior.open_ends],
        fit_p=p_of_fit(np.bincount(cells, given.successes), np.bincount(cells), psi[first]),
        drift=drift(given.successes, psi),
        change=10.0**decades - 1.0 if fit.has_changed else 0.0,
        reversal_mean=_reversal_mean(block, stimulus, all_rows),
        target_percent=None if block.method is None else block.method.target_percent,
        compared=None if math.isnan(compared) else level_of(compared),
    )


def _reversal_mean(block: LevelBlock, stimulus: Stimulus, all_rows: pd.DataFrame) -> float | None:
    """Return the mean (in u) of the tracks' means of reversals, as a level; None if no track has one."""
    if block.method is None or block.method.target_percent is None:
        return None
    means = []
    for _, rows in all_rows.groupby(TRACK, sort=True):
        setting = setting_of(block, rows["track"].iloc[0])
        mean = None if setting is None else block.method.reversal_mean(setting, answers_of(rows))
        means += [] if mean is None else [stimulus.coordinate(mean)]
    return stimulus.level_of(float(np.mean(means))) if means else None


def _group_estimate(
    stimulus: Stimulus, standard: Any, estimates: Sequence[ThresholdEstimate], priors: GroupPriors
) -> ThresholdEstimate:
    """Return the random-effects mean of participants, also at the published percentage if all have a value there."""

    def level_of(end: float | None) -> float | None:
        return None if end is None else stimulus.level_of(end)

    def mean(levels: Sequence[float]) -> GroupMean:
        variances = [estimate.variance or 0.0 for estimate in estimates]
        return group_mean([*map(stimulus.coordinate, levels)], variances, (priors.below, priors.above))

    group_value = mean([estimate.threshold for estimate in estimates])
    group = ThresholdEstimate(
        participant=None,
        standard=number_or_none(standard),
        n=len(estimates),
        threshold=stimulus.level_of(group_value.mean),
        low=level_of(group_value.low),
        high=level_of(group_value.high),
        if_many_lapses=level_of(None if priors.if_many_lapses is None else group_value.mean + priors.if_many_lapses),
    )
    compared = [estimate.compared for estimate in estimates if estimate.compared is not None]
    if len(compared) < len(estimates):
        return group
    group_value = mean(compared)
    return replace(
        group,
        compared=stimulus.level_of(group_value.mean),
        compared_low=level_of(group_value.low),
        compared_high=level_of(group_value.high),
    )


_BAND_POINTS: Final = 40


def psychometric_bands(
    block: LevelBlock, opened: pd.DataFrame, people: tuple[str, ...], ends: tuple[float, float]
) -> Mapping[str, Array]:
    """Return the psychometric band of each participant (3, k): u, and the ends of the pointwise band at u.

    The block has one standard; ``ends`` are the smallest and the largest u.
    """
    assumed, stimulus = block.assumed, block.stimulus
    if assumed is None or stimulus is None:
        return {}
    u = np.linspace(*ends, _BAND_POINTS)
    rows = _ordered_answers(block, opened)
    fits, _ = _fit_participants(block, assumed, rows[rows["analysed"]])
    return {str(fit.person): np.array([u, *fit.posterior.band(u)]) for fit in fits if fit.person in people}


Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackCourse:
    """The answers of one participant at one standard in trial order, shape (n,) each.

    ``levels`` are requested levels; ``tracks`` are numbered from 1. ``catches`` marks catch trials and ``noises``
    presentations of the standard alone; tracks did not choose their levels. ``low`` and ``high`` are the ends, as
    levels, of the 95 % interval of the threshold from the answers so far, without the correction for changes over the
    session.
    """

    participant: str
    standard: float | None
    tracks: NDArray[np.int64]
    levels: Array
    successes: Flags
    reversals: Flags
    catches: Flags
    noises: Flags
    low: Array
    high: Array


def track_courses(block: LevelBlock, opened: pd.DataFrame, most: int) -> Iterator[TrackCourse]:
    """Yield the first ``most`` courses of a block by participant and standard, from the rows of `tracks`."""
    assumed, stimulus = block.assumed, block.stimulus
    if assumed is None or stimulus is None:
        return
    rows = _ordered_answers(block, opened)
    at_standards = rows[rows["analysed"]].groupby("standard", dropna=False, sort=True)
    fits: list[tuple[Any, _FittedPerson]] = [
        (standard, person)
        for standard, person_rows in at_standards
        for person in _fit_participants(block, assumed, person_rows)[0]
    ]
    for standard, fitted in sorted(fits, key=lambda fit: fit[1].person)[:most]:
        person_rows, ends = fitted.rows, []
        for n in range(1, len(person_rows) + 1):
            posterior = fitted.fit.posterior_after(n).reweighted(fitted.factors)
            ends.append([stimulus.level_of(end) for end in posterior.interval])
        low, high = np.array(ends).T
        yield TrackCourse(
            participant=str(fitted.person),
            standard=None if pd.isna(standard) else float(standard),
            tracks=np.array([int(name.rpartition("/")[2]) for name in person_rows["track"]], np.int64),
            levels=person_rows["level"].to_numpy(dtype=float),
            successes=fitted.fit.answers.successes,
            reversals=person_rows["reversal"].astype("boolean").to_numpy(dtype=bool, na_value=False),
            catches=person_rows["catch"].fillna(False).to_numpy(dtype=bool),
            noises=~person_rows["arrangement"].str.contains("C").to_numpy(dtype=bool),
            low=low,
            high=high,
        )


def percent_compared(result: LevelsResult) -> float | None:
    """Return the percentage correct at which thresholds are compared with published ones, or None."""
    return (
        compared_percent(result.published)
        if any(threshold.compared is not None for threshold in Thresholds.rows_in(result))
        else None
    )


def _has_jnd(result: LevelsResult) -> bool:
    """Return whether the spread of the function is a just-noticeable difference in the unit of the levels."""
    return result.has_pse and result.spacing == "linear"


def _jnd(result: LevelsResult, estimate: ThresholdEstimate) -> float | None:
    """Return half the distance between the levels chosen in 25 and 75 % of the trials without lapses."""
    if estimate.width is None or result.family is None:
        return None
    return estimate.width * position(cast(Family, result.family), 0.75)


def _session_sd_text(result: LevelsResult) -> str:
    """Return the standard deviation of a person's threshold between sessions."""
    if result.has_pse:
        return f"{100 * SESSION_SD * math.log(10):.0f} % of the just-noticeable difference (assumed)"
    return f"a factor of {10**SESSION_SD:.2f}"


def _change_prior_text(result: LevelsResult) -> str:
    """Return the standard deviation of the prior of a change over the trials."""
    if result.has_pse:
        return f"{100 * math.log(CHANGE_PRIOR):.0f} % of the just-noticeable difference"
    return f"a factor of {CHANGE_PRIOR:g}"


def _is_biased_by_lapses(group: ThresholdEstimate) -> bool:
    """Return whether `grid.MANY_LAPSES` lapses would change a group's threshold by a size that matters."""
    if group.if_many_lapses is None:
        return False
    half_width = 0.0 if group.low is None or group.high is None else (group.high - group.low) / 2
    shift = abs(group.if_many_lapses - group.threshold)
    return shift > max(_NEGLIGIBLE * abs(group.threshold), _SHIFT * half_width)


def _device_weber_fraction(result: LevelsResult, estimate: ThresholdEstimate) -> float | None:
    """Return the Weber fraction of damping relative to standard plus device damping, ΔB/(B + b); None if unknown."""
    if (
        result.device is None
        or estimate.standard is None
        or (result.vary, result.level_kind) != ("damping_nspm", "weber")
    ):
        return None
    return estimate.threshold * estimate.standard / (estimate.standard + result.device.damping_nspm)


def _participants_phrase(
    result: LevelsResult, estimates: Sequence[ThresholdEstimate], selected: Sequence[ThresholdEstimate]
) -> str:
    """Return a phrase that names the participants of ``selected`` estimates, or counts them if there are many."""
    if len(selected) > _MOST_NAMED:
        return f"{len(selected)} of {len(estimates)} thresholds"
    several = len({estimate.standard for estimate in estimates}) > 1
    return listed(
        [
            f"{estimate.participant} at {with_unit(result, estimate.standard)}"
            if several and estimate.standard is not None
            else str(estimate.participant)
            for estimate in selected
        ]
    )


class Thresholds(LevelStatistic[ThresholdEstimate]):
    """The group's threshold at each standard, followed by those of its participants."""

    key = "thresholds"
    place = 2
    title = "Thresholds"
    figures = ("tracks", "weber")

    compute = staticmethod(lambda block, opened, _study, _found: thresholds(block, opened))

    def heading(self) -> str:
        return "Points of subjective equality" if self.result.has_pse else self.title

    def table_columns(self) -> Sequence[TableColumn]:
        result, percent, compared = self.result, self._target_percent(), percent_compared(self.result)

        def fit(estimate: ThresholdEstimate) -> str:
            if estimate.error_bursts is not None:
                return f"{estimate.error_bursts:+.1f} SE{'!' if estimate.clustered else ''}".replace("-", "−")
            return (
                "–"
                if estimate.fit_p is None
                else f"{estimate.fit_p:.3f}{'' if estimate.fits else ' (the function does not fit)'}"
            )

        def interval(estimate: ThresholdEstimate) -> str:
            if estimate.low is None or estimate.high is None:
                return "–"
            below, above = estimate.open_end in ("low", "both"), estimate.open_end in ("high", "both")
            return f"{'< ' * below}{digits(estimate.low)} – {'> ' * above}{digits(estimate.high)}"

        def drift(estimate: ThresholdEstimate) -> str:
            if estimate.participant is None and estimate.early_change is not None:
                return f"{estimate.early_change:+.1f} SE{'!' if estimate.learned else ''}".replace("-", "−")
            return (
                "–"
                if estimate.drift is None
                else f"{estimate.drift:+.2f}{'!' if estimate.drifts else ''}".replace("-", "−")
            )

        return (
            self.standard_column(),
            *PARTICIPANT_COLUMNS,
            (
                "threshold (Weber fraction)"
                if result.level_kind == "weber"
                else f"{'PSE' if result.has_pse else 'threshold'}{unit(result)}",
                lambda row: f"{BEYOND[row.beyond]}{row.threshold:.3g}",
            ),
            ("95 % interval", interval),
            None if compared is None else (f"at {compared:g} %", lambda row: digits(row.compared)),
            ("with device damping", lambda row: digits(_device_weber_fraction(result, row)))
            if any(_device_weber_fraction(result, row) is not None for row in self.rows)
            else None,
            (f"width [{_WIDTH_UNITS[result.spacing]}]", lambda row: digits(row.width, 2)),
            (f"JND{unit(result)}", lambda row: digits(_jnd(result, row))) if _has_jnd(result) else None,
            ("flat width prior", lambda row: digits(row.flat_width)),
            None
            if percent is None
            else (f"mean of reversals ({percent:.1f} %)", lambda row: digits(row.reversal_mean)),
            ("fit (p)", fit),
            ("drift", drift),
        )

    def _target_percent(self) -> float | None:
        return next((estimate.target_percent for estimate in self.participant_rows(self.result)), None)

    def explanation(self) -> str:
        result, percent, compared = self.result, self._target_percent(), percent_compared(self.result)
        at = "" if result.guess_rate is None else f" ({50 * (1 + result.guess_rate):.3g} % {result.counts})"
        catch = ", including answers to catch trials" if any(answer.catch for answer in Answers.rows_in(result)) else ""
        reversals = (
            ""
            if percent is None
            else " The mean of the reversals is the classical estimate for an up–down track; it estimates the level "
            f"that yields {percent:.1f} % {result.counts}."
        )
        level = (
            ""
            if compared is None
            else f" “At {compared:g} %” is the level that yields {compared:g} % {result.counts}, the criterion used "
            "for the published value."
        )
        jnd = (
            "The JND is half the distance between the levels at which the comparison is chosen in 25 and 75 % of the "
            "trials. "
            if _has_jnd(result)
            else ""
        )
        function = FAMILIES[result.family or ""]
        return (
            f"A {'PSE' if result.has_pse else 'threshold'} is the level ({level_text(result)}) at which the {function} "
            f"function lies halfway between the guess rate and one minus the lapse rate{at}. The estimate is the "
            "posterior median with an equal-tailed 95 % interval, based on all analysed answers at the levels "
            "delivered to the hand. The width, from 5 to 95 % of the rise, has a log-normal prior; the column “flat "
            f"width prior” shows the threshold under a flat prior. {jnd}“Above” and “below” mark thresholds outside "
            "the range of the stimulus levels; “<” and “>” mark interval ends that the answers do not determine. The "
            "intervals allow for differences in a person’s threshold between sessions (one standard deviation is "
            f"{_session_sd_text(result)}) and for changes over the trials. The group value is the random-effects mean "
            "(Paule–Mandel), with the Hartung–Knapp interval if there are at least three participants. Each "
            "participant's variance is replaced by the geometric mean of that variance and the median "
            f"variance.{level}{reversals} Fit: p value of the deviance, based on {SETS} simulated data sets; for the "
            "group, how much more often errors follow one another than expected, in standard errors, marked “!” if "
            f"above {MOST_CLUSTERED:g}. Drift: correlation between trial number and deviance residual, marked “!” if "
            f"the threshold changes over the trials by more than {BEYOND_CHANCE:g} standard errors; for the group, the "
            "mean change of thresholds after the first trials, in standard errors. n is the number of "
            f"answers{catch}." + (f" {REMOVED.format('is')}" if result.design == "2ifc" else "")
        )

    def is_comparable_with(self, measure: str) -> bool:
        return measure != "exponent"

    def sentences(self) -> Iterator[str]:
        result = self.result
        for row in self.rows:
            if row.participant is None:
                where = "" if row.standard is None else f", standard {with_unit(result, row.standard)}"
                percent = (
                    "" if result.guess_rate is None else f" at {50 * (1 + result.guess_rate):.3g} % {result.counts}"
                )
                if row.compared is not None:
                    percent += f", {row.compared:.3g} at {percent_compared(result):g} %"
                yield (
                    f"{result.title}{where}: threshold {row.threshold:.3g}{percent} ({level_text(result)}; "
                    f"{interval_phrase(row, digits)}; {counted(row.n, 'participant')})."
                )

    def limits(self) -> Iterator[str]:
        estimates, title = self.participant_rows(self.result), self.result.title
        if not estimates:
            return

        def is_shifted(estimate: ThresholdEstimate) -> bool:
            return estimate.flat_width is not None and abs(estimate.flat_width - estimate.threshold) > _SHIFT * abs(
                estimate.threshold
            )

        kinds: tuple[tuple[Callable[[ThresholdEstimate], bool], str], ...] = (
            (
                is_shifted,
                f"because there are few answers, the prior on the width shifts the threshold by more than "
                f"{100 * _SHIFT:.0f} %",
            ),
            (
                lambda estimate: estimate.beyond == "above",
                "the threshold lies above the highest level of the stimulus by an unknown amount",
            ),
            (
                lambda estimate: estimate.beyond == "below",
                "the threshold lies below the lowest level of the stimulus by an unknown amount",
            ),
            (
                lambda estimate: not estimate.fits,
                "the function does not fit the answers, so the threshold may be biased",
            ),
            (
                lambda estimate: estimate.n < _FEW_ANSWERS,
                f"intervals are wide because there are fewer than {_FEW_ANSWERS} answers",
            ),
        )
        yield from self._limits_of_lapses()
        for applies, reason in kinds:
            if affected := [estimate for estimate in estimates if applies(estimate)]:
                yield f"{title}: {reason} ({_participants_phrase(self.result, estimates, affected)})."
        if affected := [estimate for estimate in estimates if estimate.open_end]:
            yield (
                f"{title}: the answers do not determine one or both ends of the 95 % interval, marked “<” or “>” in "
                f"the table ({_participants_phrase(self.result, estimates, affected)})."
            )
        for row in self.rows:
            if row.participant is None and row.learned:
                where = "" if row.standard is None else f" at standard {with_unit(self.result, row.standard)}"
                yield (
                    f"{title}: thresholds {'rose' if (row.early_change or 0.0) > 0 else 'fell'} by "
                    f"{abs(row.early_change or 0.0):.1f} standard errors after the first trials{where}. The group's "
                    "threshold may be biased, because the analysis assumes that thresholds are constant or change at "
                    "a constant rate."
                )
        if affected := [estimate for estimate in estimates if estimate.drifts]:
            sizes = listed(
                [f"{100 * (estimate.change or 0.0):+.0f} %".replace("-", "−") for estimate in affected[:_MOST_NAMED]]
            )
            yield (
                f"{title}: the threshold changed over the trials "
                f"({_participants_phrase(self.result, estimates, affected)}: {sizes} from the first trial to the "
                "last); the interval allows for this."
            )
        if (people := len({estimate.participant for estimate in estimates})) < FEWEST:
            yield (
                f"{title}: a group interval needs at least {FEWEST} participants, because differences between people "
                f"cannot be estimated from fewer. This block has {people}."
            )
        if self.result.level_kind == "weber":
            yield self._limit_of_device()
        yield f"{title}: {MOTORS}"

    def _limits_of_lapses(self) -> Iterator[str]:
        groups = [
            (row, "" if row.standard is None else f" at standard {with_unit(self.result, row.standard)}")
            for row in self.rows
            if row.participant is None
        ]
        if clusters := [
            f"{group.error_bursts:.1f} standard errors{where}" for group, where in groups if group.clustered
        ]:
            yield (
                f"{self.result.title}: errors are more clustered than the fitted functions predict, by "
                f"{listed(clusters)}. Participants may have answered at random for several trials in a row, so the "
                "group's threshold may be too high."
            )
        if thresholds := [
            f"{group.if_many_lapses:.3g} instead of {group.threshold:.3g}{where}"
            for group, where in groups
            if _is_biased_by_lapses(group)
        ]:
            has_catch = self.result.counts != COMPARISON_CHOSEN  # a forced choice without a correct answer has none
            advice = (
                " The more catch trials far above the threshold a block has, the better the lapse rate can be "
                "estimated."
            )
            yield (
                f"{self.result.title}: the answers do not rule out a mean lapse rate of {100 * MANY_LAPSES:g} %, at "
                f"which the group's threshold would be {listed(thresholds)}.{advice * has_catch}"
            )

    def _limit_of_device(self) -> str:
        """Return the sentence on the limitation due to the device's own dynamics."""
        result, own = self.result, self.result.device
        if own is None:
            return (
                f"{result.title}: the device's own damping, friction and mass are unknown, because they were not "
                "measured. Weber fractions refer to the force delivered by the motors; they would be smaller if they "
                "were relative to the sum of this force and the device's own resistance."
            )
        where = "" if own.sessions == own.of else f" (measured in {own.sessions} of {own.of} sessions)"
        words = (
            f"{result.title}: the device's own damping of {own.damping_nspm:.2g} N·s/m, friction of "
            f"{own.friction_n:.2g} N and mass of {own.mass_kg:.2g} kg{where} add to the force delivered by the "
            "motors. Weber fractions refer only to the force delivered by the motors"
        )
        proportions = [
            f"{proportion:.3g} instead of {row.threshold:.3g} at {row.standard:g} {result.unit}"
            for row in self.rows
            if row.participant is None and (proportion := _device_weber_fraction(result, row)) is not None
        ]
        if not proportions:
            return f"{words}."
        return (
            f"{words}; if the device's damping is included in the standard, the group's Weber fractions are "
            f"{listed(proportions)}."
        )

    def methods(self, block: LevelBlock) -> Iterator[str]:
        if not self.rows or block.assumed is None or block.stimulus is None:
            return
        median, factor = block.assumed.width_prior
        family, log = FAMILIES[block.assumed.family], block.stimulus.spacing == "log"
        yield (
            f"A {family} function of the {'logarithm of the ' if log else ''}level was fitted, with a flat prior on "
            f"the threshold, a log-normal prior on the width (median {median:.3g} "
            f"{'decades' if log else 'units of the level'}, factor {factor:.3g}) and lapse rates of up to "
            f"{100 * max(ANALYSIS_LAPSES):.0f} %. The participants’ mean lapse rate had an exponential prior (mean "
            f"{100 * MEAN_LAPSE:g} %)."
        )
        if block.design.kind == "2ifc":
            yield REMOVED.format("was")

    @classmethod
    def common_methods(cls, blocks: Sequence[LevelsResult]) -> Iterator[str]:
        if blocks := [block for block in blocks if cls.rows_in(block)]:
            yield (
                "Thresholds are posterior medians, computed on a grid, with equal-tailed 95 % intervals, based on all "
                "analysed answers at the levels delivered to the hand. The deviance was compared with the deviances "
                f"of {SETS} simulated data sets, and drift is the correlation between trial number and deviance "
                "residual (Wichmann & Hill 2001). The intervals allow for differences in a person’s threshold between "
                f"sessions (one standard deviation is {listed([*dict.fromkeys(map(_session_sd_text, blocks))])}; from "
                "data in Jäkel & Wichmann 2006), and for a change over the trials if it exceeded "
                f"{BEYOND_CHANCE:g} standard errors. The posterior averages over linear changes (prior: "
                f"{listed([*dict.fromkeys(map(_change_prior_text, blocks))])}), so the threshold "
                f"refers to the middle of the trials. We assumed that {100 * ALIKE:.0f} % of the standard deviation of "
                "log widths is due to differences between participants and that lapse rates vary around a common "
                "mean, so each participant’s width and lapse rate depend on all participants’ answers; the posterior "
                f"of the shared parameters was raised to the power of {NEAR_MODE}. Group means are random-effects "
                "means with the between-participant variance of Paule and Mandel (1982), after replacing each variance "
                f"by its geometric mean with the median variance. With at least {FEWEST} participants, they have the "
                "interval of Hartung and Knapp (2001), widened to include the uncertainty of the shared width and "
                f"lapse rate. A score test for a change that fades over {EARLY_TRIALS:g} trials was used to test "
                "whether thresholds rose or fell after the first trials. The clustering of errors was tested by "
                "comparing the observed errors with the expected errors, weighting each error by the probability that "
                f"the answers before it (at most {BURST_TRIALS - 1}) were random guesses."
            )
