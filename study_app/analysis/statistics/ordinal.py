"""Settings compared by a cumulative logit model with a random intercept for each participant.

Single missing answers are allowed. Settings are tested by the likelihood ratio; the standard errors come from the
curvature of the quadrature, not from Laplace's approximation, whose are too small.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import chi2 as chi_square
from scipy.stats import norm

from study_app.analysis.statistics.cumulative import NODES, Answers, Model, fit
from study_app.analysis.statistics.outcome import FEW, Array, Interval, Outcome, Whole, checked
from study_app.errors import AnalysisError

SURE: Final = 0.95
FAR: Final = 10.0
"""Log odds, or an error of them, beyond this mean that a setting separates the answers: no finite estimate."""

TOO_FEW: Final = f"no mixed model below {FEW} participants: its estimates and errors do not hold there"
SEPARATED: Final = "the settings separate the answers, or there are too few of them: no finite estimate"


@dataclass(frozen=True, slots=True)
class Coefficient:
    """A column's effect in log odds of a higher answer, its standard error, Wald's z interval; None without any."""

    column: int
    estimate: float
    error: float | None
    interval: Interval | None


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

    Raises
    ------
    AnalysisError
        The columns do not fit the settings.
    """
    array = np.asarray(values, dtype=np.float64)
    array = checked(array[..., None] if array.ndim == 2 else array, "participants, settings, presentations")
    design = _design(array.shape[1], columns)
    used = np.asarray(~np.isnan(array).all(axis=(1, 2)))
    rows = array[used]
    levels = np.unique(rows[~np.isnan(rows)])
    reason = _impossible(rows, levels, intercepts)
    if reason:
        return _outcome(rows, used, levels, design.shape[1], intercepts, None, 0.0, reason)
    answers = _answers(rows, levels, design, intercepts)
    of_sessions = _factor(None if sessions is None else np.asarray(sessions).reshape(array.shape)[used], rows, answers)
    site = None if sites is None else np.unique(list(sites), return_inverse=True)[1].astype(np.float64)[used]
    of_sites = _factor(None if site is None else np.broadcast_to(site[:, None, None], rows.shape), rows, answers)
    factor = _independent(answers.design, of_sessions, of_sites)
    factors = [
        *(["sessions"] if of_sessions.shape[1] else []),
        *(["sites"] if factor.shape[1] > of_sessions.shape[1] else []),
    ]
    whole = fit(Answers(answers.level, np.hstack([answers.design, factor]), answers.starts))
    without = fit(Answers(answers.level, factor, answers.starts))
    ratio = max(0.0, 2 * (whole.log_likelihood - without.log_likelihood))
    bad = whole.errors is None or bool((np.abs(whole.effects) > FAR).any() or (whole.errors > FAR).any())
    note = SEPARATED if bad else ""
    return _outcome(rows, used, levels, design.shape[1], intercepts, whole, ratio, note, factor.shape[1], factors)


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


def _answers(rows: Array, levels: Array, design: Array, intercepts: bool) -> Answers:
    """Return the given answers in a row, participant by participant, with levels that were not chosen left out."""
    there = ~np.isnan(rows)
    people, settings, _ = np.nonzero(there)
    level: Whole = np.searchsorted(levels, rows[there]).astype(np.int64)
    starts = np.flatnonzero(np.diff(people, prepend=-1)) if intercepts else None
    return Answers(level, design[settings], starts)


def _factor(sessions: Array | None, rows: Array, answers: Answers) -> Array:
    """Return a column (answers, sessions − 1) for each session but the first, none where they add nothing."""
    given = np.zeros(len(answers.level)) if sessions is None else sessions[~np.isnan(rows)]
    found = np.asarray(given[:, None] == np.unique(given)[1:], dtype=np.float64)
    together = np.column_stack([np.ones(len(given)), answers.design, found])
    return found if np.linalg.matrix_rank(together) == together.shape[1] else found[:, :0]


def _independent(design: Array, first: Array, second: Array) -> Array:
    """Return the columns of two factors; without the second where it adds nothing to the first and the settings."""
    both = np.hstack([first, second])
    together = np.column_stack([np.ones(len(design)), design, both])
    return both if np.linalg.matrix_rank(together) == together.shape[1] else first


def _outcome(
    rows: Array,
    used: NDArray[np.bool_],
    levels: Array,
    columns: int,
    intercepts: bool,
    model: Model | None,
    ratio: float,
    note: str,
    of_factors: int = 0,
    factors: Sequence[str] = (),
) -> Ordinal:
    found = None if note else model
    coefficients = () if found is None else _coefficients(found)[:columns]
    single = coefficients[0] if len(coefficients) == 1 else None
    parameters = columns + of_factors + max(0, len(levels) - 1) + intercepts
    errors = None if found is None else found.errors
    return Ordinal(
        test="cumulative logit" + (" mixed model" if intercepts else " model"),
        n=len(rows),
        dropped=int((~used).sum()),
        statistic_name="likelihood ratio",
        statistic=None if found is None else ratio,
        p=None if found is None else float(chi_square.sf(ratio, columns)),
        method=f"random intercepts, adaptive Gauss-Hermite quadrature, {NODES} nodes"
        + "".join(f"; {factor} as a factor" for factor in factors)
        if intercepts
        else "no intercepts",
        effect_name="log odds of a higher answer",
        effect=None if single is None else single.estimate,
        interval=None if single is None else single.interval,
        no_interval=note or ("" if single else "no single effect: one coefficient for each setting"),
        note=note,
        df=columns,
        coefficients=coefficients,
        thresholds=() if found is None else tuple(float(value) for value in found.thresholds),
        threshold_errors=() if errors is None else tuple(float(value) for value in errors[: len(levels) - 1]),
        sd=None if found is None or not intercepts else found.sd,
        log_likelihood=None if found is None else found.log_likelihood,
        aic=None if found is None else 2 * parameters - 2 * found.log_likelihood,
        levels=tuple(float(level) for level in levels),
        answers=int((~np.isnan(rows)).sum()),
        missing=int(np.isnan(rows).all(axis=2).sum()),
    )


def _coefficients(model: Model) -> tuple[Coefficient, ...]:
    if model.errors is None:
        return tuple(Coefficient(place, float(value), None, None) for place, value in enumerate(model.effects))
    errors = model.errors[len(model.thresholds) :]
    reach = float(norm.ppf((1 + SURE) / 2))
    return tuple(
        Coefficient(
            place,
            float(value),
            float(error),
            Interval(float(value - reach * error), float(value + reach * error), SURE, "Wald"),
        )
        for place, (value, error) in enumerate(zip(model.effects, errors, strict=False))
    )
