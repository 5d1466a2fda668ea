"""Cumulative logit models of ordered answers with a random intercept for each participant.

logit P(answer ≤ j) = θ_j − x·β − σ u, u ~ N(0, 1); McCullagh (1980), J. R. Stat. Soc. B 42, 109–142. The integral over
u is an adaptive Gauss-Hermite quadrature around each participant's mode; Liu & Pierce (1994), Biometrika 81, 624–629.

Single missing answers are allowed. Settings are tested by the likelihood ratio; the standard errors come from the
curvature of the quadrature, not from Laplace's approximation, whose are too small.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize
from scipy.special import expit, logsumexp
from scipy.stats import chi2 as chi_square
from scipy.stats import norm

from study_app.analysis.statistics.outcome import FEW, MINIMISER, Array, Interval, Outcome, Whole, checked
from study_app.errors import AnalysisError

NODES: Final = 10
ENDLESS: Final = 1e6
"""What lies below the first and above the last threshold: as good as infinite, and no infinity minus infinity."""

NEAR: Final = 1e-3
"""After a shorter step the curvature is still the same."""

LOG_SD: Final = (-5.0, 3.0)
"""Where the logarithm of the random intercept's spread may lie; at the lower end there is none."""


@dataclass(frozen=True, slots=True)
class Answers:
    """Answers sorted by participant: ``level`` (n,) from 0, each level used; ``design`` (n, columns); ``starts``.

    ``starts`` are the places of each participant's first answer; None for a model without participants.
    """

    level: Whole
    design: Array
    starts: Whole | None

    @property
    def cuts(self) -> int:
        """The number of thresholds."""
        return int(self.level.max())


@dataclass(frozen=True, slots=True)
class Model:
    """A fit: parameters, their covariance (of θ, β and, with participants, σ; None if singular), log-likelihood."""

    thresholds: Array
    effects: Array
    sd: float
    log_likelihood: float
    covariance: Array | None

    @property
    def errors(self) -> Array | None:
        """The standard errors of (θ, β, σ); None where the likelihood has no curvature to tell them."""
        return None if self.covariance is None else np.sqrt(np.diag(self.covariance))


def fit(answers: Answers, nodes: int = NODES) -> Model:
    """Return the model of maximum likelihood."""
    cuts, columns = answers.cuts, answers.design.shape[1]
    shares = np.cumsum(np.bincount(answers.level))[:-1] / len(answers.level)
    first = np.log(shares / (1 - shares))
    begun = np.concatenate(
        [first[:1], np.log(np.diff(first)), np.zeros(columns), [] if answers.starts is None else [0.0]]
    )
    bounds = [(-30.0, 30.0)] + [(-12.0, 4.0)] * (cuts - 1) + [(-25.0, 25.0)] * columns
    bounds += [] if answers.starts is None else [LOG_SD]
    result = minimize(
        _objective,
        begun,
        (answers, nodes),
        MINIMISER,
        jac=True,
        bounds=bounds,
        options={"ftol": 1e-13, "gtol": 1e-7, "maxfun": 2000},
    )
    natural = _natural(result.x, cuts, answers.starts is not None)
    if answers.starts is not None and result.x[-1] <= LOG_SD[0] + 1e-3:
        plain = fit(Answers(answers.level, answers.design, None), nodes)
        return Model(plain.thresholds, plain.effects, 0.0, plain.log_likelihood, plain.covariance)
    natural, covariance = _curvature(natural, answers, nodes)
    sd = float(natural[-1]) if answers.starts is not None else 0.0
    value, _ = log_likelihood(natural, answers, nodes)
    return Model(natural[:cuts], natural[cuts : cuts + columns], sd, value, covariance)


_quadrature: Final = lru_cache(np.polynomial.hermite.hermgauss)
"""Places and weights of the Gauss-Hermite quadrature: 0.2 ms each time, a fifth of what a small likelihood takes."""


def log_likelihood(values: Array, answers: Answers, nodes: int = NODES) -> tuple[float, Array]:
    """Return the log-likelihood and its gradient at thresholds θ ascending, β, and, with participants, σ > 0.

    One node is Laplace's approximation (its gradient is then that of the true integral only roughly).
    """
    cuts = answers.cuts
    cut, effects = values[:cuts], values[cuts : cuts + answers.design.shape[1]]
    eta = answers.design @ effects
    if answers.starts is None:
        parts = _cells(cut, eta[:, None], answers.level)
        return float(parts[0].sum()), _gathered(parts, np.ones((len(eta), 1)), answers, None)
    sd = float(values[-1])
    counts = np.diff(np.append(answers.starts, len(eta)))
    mode, curvature = _modes(cut, eta, sd, answers.level, answers.starts)
    places, weights = _quadrature(nodes)
    u = mode[:, None] + np.sqrt(2 / curvature)[:, None] * places
    at = np.repeat(u, counts, axis=0)
    parts = _cells(cut, eta[:, None] + sd * at, answers.level)
    joint = np.add.reduceat(parts[0], answers.starts, axis=0) - u**2 / 2 + places**2 + np.log(weights)
    each = logsumexp(joint, axis=1)
    total = float((each - 0.5 * np.log(curvature) - 0.5 * np.log(np.pi)).sum())
    posterior = np.repeat(np.exp(joint - each[:, None]), counts, axis=0)
    return total, _gathered(parts, posterior, answers, at)


def _cells(cut: Array, eta: Array, level: Whole) -> tuple[Array, Array, Array, Array, Array]:
    """Return log P of each answer (n, nodes) and its derivatives by η (first, second), upper and lower threshold.

    P = F(u) − F(l) is formed as F(u) (1 − F(l)) (1 − e^(l − u)), which does not cancel.
    """
    ends = np.concatenate([[-ENDLESS], cut, [ENDLESS]])
    low, up = ends[level][:, None] - eta, ends[level + 1][:, None] - eta
    part = -np.expm1(-(ends[level + 1] - ends[level]))[:, None]
    soft_low, soft_up = np.logaddexp(0.0, low), np.logaddexp(0.0, up)
    log_p = up - soft_up - soft_low + np.log(part)
    first, second = _slopes(low, up)
    upper = np.exp(soft_low - soft_up) / part
    lower = -np.exp(soft_up - up - soft_low + low) / part
    return log_p, first, second, upper, lower


def _slopes(low: Array, up: Array) -> tuple[Array, Array]:
    """Return the first and the second derivative of log P by η, from θ − η of the lower and the upper threshold."""
    below, above = expit(low), expit(-up)
    return below - above, -(below * (1 - below) + above * (1 - above))


def _modes(cut: Array, eta: Array, sd: float, level: Whole, starts: Whole) -> tuple[Array, Array]:
    """Return the mode of u given each participant's answers and the negative curvature there, by Newton's steps."""
    counts = np.diff(np.append(starts, len(eta)))
    u: Array = np.zeros(len(counts))
    curvature: Array = np.ones(len(counts))
    ends = np.concatenate([[-ENDLESS], cut, [ENDLESS]])
    lower, upper = ends[level], ends[level + 1]
    for _ in range(50):
        at = eta + sd * np.repeat(u, counts)
        first, second = _slopes(lower - at, upper - at)
        slope = sd * np.add.reduceat(first, starts) - u
        curvature = 1 - sd * sd * np.add.reduceat(second, starts)
        step = np.clip(slope / curvature, -2.0, 2.0)
        u = u + step
        if np.abs(step).max() < 1e-9:
            break
    return u, curvature


def _gathered(parts: tuple[Array, ...], posterior: Array, answers: Answers, at: Array | None) -> Array:
    """Return the gradient by (θ, β, σ): the derivatives of log P, weighted by what each node is worth."""
    _, first, _, upper, lower = parts
    cuts = answers.cuts
    slope = (first * posterior).sum(axis=1)
    by_cut = np.bincount(answers.level, (upper * posterior).sum(axis=1), cuts + 1)[:cuts]
    by_cut = by_cut + np.bincount(answers.level, (lower * posterior).sum(axis=1), cuts + 1)[1:]
    by_sd = [] if at is None else [(first * posterior * at).sum()]
    return np.concatenate([by_cut, answers.design.T @ slope, by_sd])


def _objective(values: Array, answers: Answers, nodes: int) -> tuple[float, Array]:
    """Return −log-likelihood and gradient by (θ_1, log gaps of θ, β, log σ)."""
    cuts, random = answers.cuts, answers.starts is not None
    natural = _natural(values, cuts, random)
    value, gradient = log_likelihood(natural, answers, nodes)
    chained = gradient.copy()
    chained[:cuts] = np.cumsum(gradient[:cuts][::-1])[::-1]
    chained[1:cuts] *= np.exp(values[1:cuts])
    if random:
        chained[-1] *= natural[-1]
    return -value, -chained


def _natural(values: Array, cuts: int, random: bool) -> Array:
    natural = values.copy()
    natural[1:cuts] = np.exp(values[1:cuts])
    natural[:cuts] = np.cumsum(natural[:cuts])
    if random:
        natural[-1] = np.exp(values[-1])
    return natural


def _curvature(natural: Array, answers: Answers, nodes: int) -> tuple[Array, Array | None]:
    """Return the parameters after one more Newton step, and their covariance, None where there is no maximum."""
    hessian = _hessian(natural, answers, nodes)
    if np.linalg.eigvalsh(-hessian).min() <= 1e-8:
        return natural, None
    step = np.linalg.solve(-hessian, log_likelihood(natural, answers, nodes)[1])
    better = natural + step
    if (np.diff(better[: answers.cuts]) > 0).all() and np.abs(step).max() < 0.1:
        natural = better
        if np.abs(step).max() > NEAR:
            hessian = _hessian(better, answers, nodes)
    covariance = np.asarray(np.linalg.inv(-hessian), dtype=np.float64)
    return natural, covariance if (np.diag(covariance) > 0).all() else None


def _hessian(natural: Array, answers: Answers, nodes: int) -> Array:
    """Return the second derivatives of the log-likelihood, by central differences of its gradient."""
    size = len(natural)
    hessian = np.empty((size, size))
    gap = 1e-4
    if answers.cuts > 1:
        gap = min(gap, float(np.diff(natural[: answers.cuts]).min()) / 4)
    for place in range(size):
        moved = np.zeros(size)
        moved[place] = gap
        after = log_likelihood(natural + moved, answers, nodes)[1]
        before = log_likelihood(natural - moved, answers, nodes)[1]
        hessian[place] = (after - before) / (2 * gap)
    return (hessian + hessian.T) / 2


SURE: Final = 0.95
FAR: Final = 10.0
"""Log odds, or an error of them, beyond this mean that a setting separates the answers: no finite estimate."""

TOO_FEW: Final = f"no mixed model below {FEW} participants: its estimates and errors do not hold there"
SEPARATED: Final = "the settings separate the answers, or there are too few of them: no finite estimate"


@dataclass(frozen=True, slots=True)
class Coefficient:
    """A column's effect in log odds of a higher answer, its standard error, and Wald's z interval."""

    column: int
    estimate: float
    error: float
    interval: Interval


@dataclass(frozen=True, slots=True, kw_only=True)
class Ordinal(Outcome):
    """The likelihood ratio (``statistic``) of a model against the one without ``columns``, with ``df``.

    ``effect`` is the coefficient where there is one column; otherwise they are in ``coefficients``, each against the
    first setting. ``levels`` are the levels that were chosen at all, ``thresholds`` lie between them
    (``threshold_errors``: theirs). ``sd`` is the spread of the participants' intercepts in log odds (None: a model
    without). ``answers`` were given, and ``missing`` settings
    of participants were not answered.
    """

    df: int
    coefficients: tuple[Coefficient, ...]
    thresholds: tuple[float, ...]
    threshold_errors: tuple[float, ...]
    sd: float | None
    log_likelihood: float | None
    aic: float | None
    levels: tuple[float, ...]
    answers: int
    missing: int


def ordinal(
    values: ArrayLike,
    columns: ArrayLike | None = None,
    *,
    sessions: ArrayLike | None = None,
    sites: Sequence[str] | None = None,
    intercepts: bool = True,
) -> Ordinal:
    """Test whether settings move answers up or down.

    Parameters
    ----------
    values : (participants, settings) or (participants, settings, presentations) array
        NaN where an answer is missing; the others of that participant are used.
    columns : (settings, columns) array, optional
        What is tested: 0 and 1 for factors, numbers for amounts (a delay in units of 100 ms). Without, every setting is
        compared with the first.
    sessions : array of the shape of ``values``, optional
        In which session each answer was given: a factor besides the settings, which is not tested. It is left out where
        all answers are of one, or where the effects of sessions and settings cannot be separated.
    sites : sequence of str, optional
        The site of each participant of a merged study: another such factor.
    intercepts : bool
        Whether each participant has an intercept of his or her own. Without, answers are taken as independent, which
        shrinks the effects: for comparison only.
    """
    array = np.asarray(values, dtype=np.float64)
    array = checked(array[..., None] if array.ndim == 2 else array, "participants, settings, presentations")
    design = _design(array.shape[1], columns)
    used = np.asarray(~np.isnan(array).all(axis=(1, 2)))
    rows = array[used]
    levels = np.unique(rows[~np.isnan(rows)])
    method = f"random intercepts, adaptive Gauss-Hermite quadrature, {NODES} nodes" if intercepts else "no intercepts"
    untested = Ordinal(
        test="cumulative logit" + (" mixed model" if intercepts else " model"),
        n=len(rows),
        dropped=int((~used).sum()),
        statistic_name="likelihood ratio",
        method=method,
        effect_name="log odds of a higher answer",
        df=design.shape[1],
        coefficients=(),
        thresholds=(),
        threshold_errors=(),
        sd=None,
        log_likelihood=None,
        aic=None,
        levels=tuple(levels.tolist()),
        answers=int((~np.isnan(rows)).sum()),
        missing=int(np.isnan(rows).all(axis=2).sum()),
    )
    if reason := _impossible(rows, levels, intercepts):
        return replace(untested, no_interval=reason, note=reason)
    people, settings, _ = np.nonzero(~np.isnan(rows))  # levels that were not chosen are left out
    level: Whole = np.searchsorted(levels, rows[~np.isnan(rows)]).astype(np.int64)
    starts = np.flatnonzero(np.diff(people, prepend=-1)) if intercepts else None
    site = None if sites is None else np.unique(list(sites), return_inverse=True)[1].astype(np.float64)[used]
    given = {
        "sessions": None if sessions is None else np.asarray(sessions).reshape(array.shape)[used],
        "sites": None if site is None else np.broadcast_to(site[:, None, None], rows.shape),
    }
    factor, factors = _factors(
        design[settings], {name: values[~np.isnan(rows)] for name, values in given.items() if values is not None}
    )
    if intercepts:
        untested = replace(untested, method=method + "".join(f"; {factor} as a factor" for factor in factors))
    whole = fit(Answers(level, np.hstack([design[settings], factor]), starts))
    errors = whole.errors
    if errors is None or (np.abs(whole.effects) > FAR).any() or (errors > FAR).any():
        return replace(untested, no_interval=SEPARATED, note=SEPARATED)
    ratio = max(0.0, 2 * (whole.log_likelihood - fit(Answers(level, factor, starts)).log_likelihood))
    cuts, reach = len(whole.thresholds), float(norm.ppf((1 + SURE) / 2))
    coefficients = tuple(
        Coefficient(place, value, error, Interval(value - reach * error, value + reach * error, SURE, "Wald"))
        for place, (value, error) in enumerate(
            zip(whole.effects[: untested.df].tolist(), errors[cuts : cuts + untested.df].tolist(), strict=True)
        )
    )
    single = coefficients[0] if len(coefficients) == 1 else None
    return replace(
        untested,
        statistic=ratio,
        p=float(chi_square.sf(ratio, untested.df)),
        effect=None if single is None else single.estimate,
        interval=None if single is None else single.interval,
        no_interval="" if single else "no single effect: one coefficient for each setting",
        coefficients=coefficients,
        thresholds=tuple(whole.thresholds.tolist()),
        threshold_errors=tuple(errors[:cuts].tolist()),
        sd=whole.sd if intercepts else None,
        log_likelihood=whole.log_likelihood,
        aic=2 * (untested.df + factor.shape[1] + cuts + intercepts) - 2 * whole.log_likelihood,
    )


def _design(settings: int, columns: ArrayLike | None) -> Array:
    if columns is None:
        return np.eye(settings)[:, 1:]
    design = checked(columns, "settings, columns")
    centred = design - design.mean(axis=0) if len(design) else design
    if len(design) != settings or np.isnan(design).any() or np.linalg.matrix_rank(centred) < design.shape[1]:
        raise AnalysisError(
            f"columns of shape {design.shape} do not distinguish {settings} settings; give one row a setting, without "
            "NaN, and columns of which none follows from the others"
        )
    return design


def _impossible(rows: Array, levels: Array, intercepts: bool) -> str:
    if len(rows) == 0:
        return "no participant answered"
    if len(levels) < 2:
        return "no variation: all answers are equal"
    if intercepts and len(rows) < FEW:
        return TOO_FEW
    if np.isnan(rows).all(axis=(0, 2)).any():
        return "a setting was not answered by anybody"
    return ""


def _factors(design: Array, given: Mapping[str, Array]) -> tuple[Array, list[str]]:
    """Return a column for each level but the first of each factor, and which factors have any.

    A factor that adds nothing to the settings and to those before it is left out.
    """
    held, names = design[:, :0], []
    for name, levels in given.items():
        both = np.hstack([held, np.asarray(levels[:, None] == np.unique(levels)[1:], dtype=np.float64)])
        together = np.column_stack([np.ones(len(design)), design, both])
        if both.shape[1] > held.shape[1] and np.linalg.matrix_rank(together) == together.shape[1]:
            held = both
            names.append(name)
    return held, names
