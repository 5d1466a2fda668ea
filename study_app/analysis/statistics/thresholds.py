"""Detection thresholds of pooled answers; goodness of fit and group means of single thresholds.

Wichmann & Hill 2001, Percept. Psychophys. 63, 1293–1313: deviance (eq. 4), its residuals (eq. 6), and their
correlation with the order of the trials. Between-person variance by Paule & Mandel 1982, interval by Hartung & Knapp
2001 with Student's t.

The detection threshold is the posterior median of a function fitted to the pooled answers of all participants, with
free rates of guesses and lapses. The ends of its interval are points of equal posterior density, at the height of a
normal density at its 95 % limits, widened for the differences between participants. A threshold outside the presented
levels is not reported.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import stdtrit, xlogy

from study_app.analysis.statistics.outcome import Array, Interval, Outcome, checked_values
from study_app.psychophysics.grid import Z_95, Grid, Posterior, Values, evenly, fit, geometric, tables

_NOTICED_FROM: Final = 5.0
"""The lowest scale point ("somewhat agree") that counts as having noticed the delay."""

_LEVEL: Final = 0.95
_RATES: Final[Values] = (0.0, 0.02, 0.06, 0.12, 0.2, 0.3, 0.4, 0.5)
"""Rates of guesses and of lapses, which may be high: people who never agree count as lapses of the pooled answers."""

_THRESHOLDS: Final = 121
"""Number of thresholds in the grid, from one span below the lowest level to one span above the highest."""

_WIDTHS: Final = (1 / 40, 3.0, 12)
"""The smallest and the largest width of the grid [spans], and their number."""

_WIDTH_PRIOR: Final = (0.3, 2.5)
"""Median of the width [spans], and factor."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Threshold(Outcome):
    """The detection threshold (``effect``, in ms): half-way between ``guess`` and 1 − ``lapse``.

    ``statistic`` is the deviance. ``yes`` of ``asked`` answers report a delay at each of ``levels``, where the curve
    predicts ``expected``. ``effect`` and all values of the curve are None if no threshold can be stated; ``note`` then
    gives the reason in one sentence, and otherwise a remark that must accompany the number. ``lower`` and ``upper`` are
    the existing ends of the interval: if one is None there is no interval, and ``no_interval`` says which end is open.
    ``dispersion`` is the variance of the participants' answers relative to independent answers (1: no more, or
    unknown).
    """

    levels: tuple[float, ...]
    yes: tuple[int, ...]
    asked: tuple[int, ...]
    expected: tuple[float, ...] = ()
    width: float | None = None
    guess: float | None = None
    lapse: float | None = None
    lower: float | None = None
    upper: float | None = None
    dispersion: float | None = None

    @property
    def half_way(self) -> float | None:
        """The proportion of agreement at the threshold according to the curve."""
        return None if self.guess is None or self.lapse is None else (1 + self.guess - self.lapse) / 2


def detection_threshold(values: ArrayLike, levels: Sequence[float]) -> Threshold:
    """Estimate the detection threshold of raw answers: `_NOTICED_FROM` or more means noticed, NaN is missing.

    Parameters
    ----------
    values : (participants, levels) or (participants, levels, presentations) array
        Answers in points of the scale.
    levels : sequence of float
        The presented levels; equal levels are replicates.

    Notes
    -----
    Another test decides whether noticing increases with the level; if it does not, the curve is meaningless.
    """
    array = np.asarray(values, float)
    array = checked_values(array[..., None] if array.ndim == 2 else array, "participants, levels, presentations")
    is_given, presented = ~np.isnan(array), np.asarray(levels, float)
    has_answers = is_given.any(axis=(1, 2))
    unique_levels = np.unique(presented[is_given.any(axis=(0, 2))])
    level_matches = np.asarray(presented[:, None] == unique_levels, float)
    yes, asked = (
        flags[has_answers].sum(axis=2, dtype=float) @ level_matches
        for flags in (is_given & (array >= _NOTICED_FROM), is_given)
    )
    all_yes, all_asked = yes.sum(axis=0), asked.sum(axis=0)
    estimate: dict[str, Any] = {}
    note = _unfittable_reason(unique_levels, all_yes, all_asked)
    if not note:
        curve, dispersion, (lower, upper) = _fit_pooled_answers(unique_levels, yes, asked)
        note = _out_of_range_reason(unique_levels, curve.threshold, lower, upper)
    if not note:
        others = curve.others
        expected = curve.success(unique_levels)
        interval = None
        if lower is not None and upper is not None:
            interval = Interval(
                low=lower,
                high=upper,
                level=_LEVEL,
                method="posterior density, widened for differences between participants",
            )
        note = "; ".join(_remarks(unique_levels, lower, upper, len(yes), dispersion))
        estimate = {
            "statistic": float(deviances(all_yes, all_asked, expected).sum()),
            "effect": curve.threshold,
            "interval": interval,
            "no_interval": "" if interval else _open_end_reason(lower, upper),
            "expected": tuple(expected.tolist()),
            "width": others.width,
            "guess": others.guess,
            "lapse": others.lapse,
            "lower": lower,
            "upper": upper,
            "dispersion": dispersion,
        }
    return Threshold(
        test="detection threshold",
        n=int(has_answers.sum()),
        dropped=int((~has_answers).sum()),
        statistic_name="deviance",
        method="posterior median of a logistic function of the delay",
        effect_name="detection threshold",
        note=note,
        levels=tuple(unique_levels.tolist()),
        yes=tuple(int(count) for count in all_yes),
        asked=tuple(int(count) for count in all_asked),
        **{"no_interval": note, **estimate},
    )


def _unfittable_reason(levels: Array, yes: Array, asked: Array) -> str:
    """Return the reason why the answers cannot determine a threshold, or ""."""
    if len(levels) < 3:
        return "there were answers at fewer than three levels"
    if not yes.any():
        return (
            f"no participant noticed a difference at any level up to {levels.max():g}, so the threshold is higher or "
            "does not exist"
        )
    return "all participants noticed a difference at every level" if (yes == asked).all() else ""


def _fit_pooled_answers(
    levels: Array, yes: Array, asked: Array
) -> tuple[Posterior, float, tuple[float | None, float | None]]:
    """Return the posterior of all answers, the dispersion, and the existing ends of the interval.

    The interval is scaled by the dispersion times the squared ratio of the t and normal quantiles (pooled clustered
    answers: Chandler & Bate 2007, Biometrika 94, 167–183).
    """
    low, span, people = float(levels[0]), float(np.ptp(levels)), len(yes)
    minimum, maximum, count = _WIDTHS
    uniform = (1 / len(_RATES),) * len(_RATES)
    median, factor = _WIDTH_PRIOR
    widths = geometric(minimum * span, maximum * span, count)
    grid = Grid(
        family="logistic",
        thresholds=evenly(low - span, low + 2 * span, _THRESHOLDS),
        widths=widths,
        width_prior=(median * span, factor),
        lapses=_RATES,
        lapse_prior=uniform,
        guesses=_RATES,
    )
    posterior = fit(levels, yes.sum(axis=0), (asked - yes).sum(axis=0), grid)
    if people < 2:
        return posterior, 1.0, _interval_ends(posterior, 1.0)
    dispersion = _dispersion(posterior, levels, yes, asked)
    return (
        posterior,
        dispersion,
        _interval_ends(posterior, dispersion * float(stdtrit(people - 1, (1 + _LEVEL) / 2) / Z_95) ** 2),
    )


def _dispersion(posterior: Posterior, levels: Array, yes: Array, asked: Array) -> float:
    """Return the variance of the participants' scores relative to the information of independent answers.

    A score is the difference of a participant's log likelihoods of the best curves at both ends of the interval for
    independent answers, divided by the distance of the ends. It exists even for the steepest curve of the grid.
    """
    _, log_yes, log_no = tables(posterior.grid, tuple(levels.tolist()))
    thresholds = posterior.grid.thresholds
    first, last = (int(np.searchsorted(np.cumsum(posterior.marginal), proportion)) for proportion in (0.025, 0.975))
    first = min(first, len(thresholds) - 2)
    last = min(max(last, first + 1), len(thresholds) - 1)
    at_ends = []
    for place in (first, last):
        best = (slice(None), place, *np.unravel_index(posterior.weights[place].argmax(), posterior.grid.shape[1:]))
        at_ends.append(yes @ log_yes[best] + (asked - yes) @ log_no[best])
    scores = (at_ends[1] - at_ends[0]) / (thresholds[last] - thresholds[first])
    low, high = posterior.interval
    return max(1.0, float(scores.var(ddof=1)) * len(scores) * ((high - low) / (2 * Z_95)) ** 2)


def _interval_ends(posterior: Posterior, scale: float) -> tuple[float | None, float | None]:
    """Return the ends of the interval; None if the threshold may lie beyond that end of the grid.

    At the ends the density is exp(−scale z²/2) of its maximum, like that of a normal distribution whose variance is
    ``scale`` times larger.
    """
    thresholds = np.array(posterior.grid.thresholds)
    heights = np.log(np.maximum(posterior.marginal, 1e-300)) - float(np.log(posterior.marginal.max()))
    cut = -scale * Z_95**2 / 2
    inside = np.flatnonzero(heights >= cut)
    ends: list[float | None] = []
    for within, beyond in ((inside[0], inside[0] - 1), (inside[-1], inside[-1] + 1)):
        if 0 <= beyond < len(heights):
            pair = [beyond, within]
            ends.append(float(np.interp(cut, heights[pair], thresholds[pair])))
        else:
            ends.append(None)
    return ends[0], ends[1]


def _out_of_range_reason(levels: Array, threshold: float, lower: float | None, upper: float | None) -> str:
    """Return the reason why the threshold is not reported if it is outside the presented levels, or ""."""
    low, high = float(levels[0]), float(levels[-1])
    if not low <= threshold <= high:
        return f"the fitted threshold lies outside the range of presented levels ({low:g} to {high:g})"
    if not any(end is not None and low <= end <= high for end in (lower, upper)):
        return f"both ends of the threshold's interval lie outside the range of presented levels ({low:g} to {high:g})"
    return ""


def _remarks(levels: Array, lower: float | None, upper: float | None, people: int, dispersion: float) -> Iterator[str]:
    """Yield remarks that must accompany a threshold."""
    if any(end is not None and not levels[0] <= end <= levels[-1] for end in (lower, upper)):
        yield (
            "the interval extends beyond the range of presented levels, where it depends only on the shape of the "
            "function"
        )
    if people == 1:
        yield "the answers come from one participant, so the interval applies only to this person"
    else:
        yield (
            "the answers from all participants are pooled, and the interval allows for differences between "
            f"participants (the answers vary {dispersion:.1f} times as much as independent answers would)"
        )


def _open_end_reason(lower: float | None, upper: float | None) -> str:
    end = "either end" if lower is None and upper is None else "the lower end" if lower is None else "the upper end"
    return f"no interval: the answers do not determine {end}"


SETS: Final = 999
SEED: Final = 1
WORST: Final = 0.05
"""The p of the goodness of fit below which the report states that the function does not fit."""


def deviances(successes: ArrayLike, n: ArrayLike, expected: ArrayLike) -> Array:
    """Return the deviance at each level: twice the log-likelihood ratio of the saturated model to the function.

    ``successes`` of ``n`` answers have shape (…, k), the function's shares (k,) lie strictly between 0 and 1.
    """
    y, m, psi = np.asarray(successes, float), np.asarray(n, float), np.asarray(expected, float)
    terms = 2.0 * (xlogy(y, y / (m * psi)) + xlogy(m - y, (m - y) / (m * (1.0 - psi))))
    return np.asarray(np.maximum(terms, 0.0), float)


def p_of_fit(successes: ArrayLike, n: ArrayLike, expected: ArrayLike) -> float:
    """Return the proportion of simulated answers (k,) with at least the observed deviance: (1 + #{D* ≥ D})/1000."""
    draw = np.random.default_rng(SEED)
    drawn = draw.binomial(np.asarray(n, np.int64), np.asarray(expected, float), (SETS, np.size(expected)))
    simulated = deviances(drawn, n, expected).sum(axis=-1)
    observed = float(deviances(successes, n, expected).sum())
    return float(1 + np.count_nonzero(simulated >= observed - 1e-9)) / (SETS + 1)


def drift(successes: ArrayLike, expected: ArrayLike) -> float | None:
    """Return the correlation of trial number and deviance residual; None if either does not vary.

    ``successes`` (n,) are in trial order; ``expected`` (n,) are the proportions that the function predicts.
    """
    y, psi = np.asarray(successes, float), np.asarray(expected, float)
    residuals = np.sign(y - psi) * np.sqrt(deviances(y, np.ones_like(y), psi))
    if len(y) < 3 or float(np.ptp(residuals)) == 0.0:
        return None
    return float(np.corrcoef(np.arange(len(y)), residuals)[0, 1])


FEWEST: Final = 3
"""The fewest estimates with an interval of their mean."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GroupMean:
    """The mean of ``n`` estimates, the ends of its 95 % interval, and the variance between them."""

    n: int
    mean: float
    low: float | None
    high: float | None
    between: float


def random_effects_weights(estimates: Array, variances: Array) -> tuple[Array, float]:
    """Return the weights (n,) of estimates in their random-effects mean, and the variance between them."""
    n, v = len(estimates), np.sqrt(variances * np.median(variances))

    def excess(between: float) -> float:
        weights = 1.0 / (v + between)
        mean = float((weights * estimates).sum() / weights.sum())
        return float((weights * (estimates - mean) ** 2).sum()) - (n - 1)

    between = 0.0
    if n > 1 and excess(0.0) > 0.0:
        between = float(brentq(excess, 0.0, float(np.var(estimates, ddof=1)) * n + 1e-12, xtol=1e-14))
    return 1.0 / (v + between), between


def group_mean(
    estimates: Sequence[float], variances: Sequence[float], shared: tuple[float, float] = (0.0, 0.0)
) -> GroupMean:
    """Return the random-effects mean of estimates, shape (n,), with their variances, each above zero.

    Each variance is replaced by its geometric mean with the median variance: variances are estimates, and overestimated
    thresholds have smaller ones. ``shared`` are the lower and upper parts of the 95 % interval of an error that all
    estimates share.
    """
    y, n = np.asarray(estimates, float), len(estimates)
    if n == 0:
        raise ValueError("a mean requires at least one estimate")
    weights, between = random_effects_weights(y, np.asarray(variances, float))
    mean = float((weights * y).sum() / weights.sum())
    if n < FEWEST:
        return GroupMean(n=n, mean=mean, low=None, high=None, between=between)
    variance = float((weights * (y - mean) ** 2).sum()) / ((n - 1) * float(weights.sum()))
    half, (below, above) = float(stdtrit(n - 1, 0.975)) * math.sqrt(variance), shared
    low, high = mean - math.hypot(half, below), mean + math.hypot(half, above)
    return GroupMean(n=n, mean=mean, low=low, high=high, between=between)
