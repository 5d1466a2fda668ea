"""A cumulative (ordinal) logit mixed model of the answers to one statement, which keeps incomplete participants.

The log odds of an answer of at most k are θ_k - x·β - u: thresholds θ, effects β of the conditions x, and a normal
deviation u for each participant (McCullagh 1980, J. R. Stat. Soc. B 42, 109-142; Tutz & Hennevogl 1996, Comput. Stat.
Data Anal. 22, 537-557). With one predictor x, such as a delay, the effect also varies between participants.

The likelihood is integrated on a grid. The likelihood ratio is compared with t(n - 1) or F(k, k (n - 1)), not with χ²,
which with few participants rejects too often. R's ``ordinal::clmm`` fits the same model, with Laplace's approximation
if there are two random effects; statsmodels, pingouin and mord have no random effects in ordinal models.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import OptimizeResult, minimize
from scipy.special import expit, fdtrc, logsumexp, stdtrit

from study_app.analysis.statistics.outcome import Array, Interval, Outcome, checked_values
from study_app.analysis.statistics.slope_tests import student_test
from study_app.analysis.statistics.trend_tests import Direction
from study_app.errors import AnalysisError

_MODEL: Final = "cumulative mixed model"
_GRID_SDS: Final = 5.0
"""The grid ends at this many standard deviations of the participants."""
_NODES: Final = (31, 61, 121)
_MAX_CHANGE: Final = 5e-3
"""The largest change of the maximum log likelihood that is accepted if the grid has twice as many nodes."""
_LEVEL: Final = 0.95
_FEWEST: Final = 8
_SMALLEST: Final = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class CumulativeModel(Outcome):
    """The likelihood-ratio test of all effects; ``effect`` is the log odds ratio if there is only one.

    ``log_odds_ratios`` and ``intervals`` (95 %, Wald) have one entry per column, above 0 if answers rise. ``answers``
    is the number of answers; ``incomplete`` participants, who did not answer in all conditions, are included in ``n``.
    ``sds`` are the standard deviations of the participants' deviations and, with one predictor, of their own effects.
    """

    log_odds_ratios: tuple[float, ...] = ()
    intervals: tuple[Interval, ...] = ()
    sds: tuple[float, ...] = ()
    thresholds: tuple[float, ...] = ()
    log_likelihood: float | None = None
    answers: int = 0
    incomplete: int = 0


def cumulative_model(
    values: ArrayLike, columns: ArrayLike | None = None, direction: Direction | None = None
) -> CumulativeModel:
    """Fit the model, and test whether the conditions shift the answers.

    Parameters
    ----------
    values : (participants, conditions, presentations) array
        Answers on an ordinal scale, NaN if one is missing.
    columns : (conditions, predictors) array, optional
        The values of the predictors. With a single one, such as a delay in units of 100 ms, participants also differ
        in its effect. By default each condition is compared with the first, and participants do not differ in these
        effects: give one answer per condition, such as a median, because the test rejects too often otherwise.
    direction : "increasing" | "decreasing", optional
        Direction of a single effect that was stated in advance; the test is then one-sided.

    Raises
    ------
    AnalysisError
        If there are fewer than two conditions, or the shapes do not fit.
    """
    array = checked_values(values, "participants, conditions, presentations")
    conditions = array.shape[1]
    if conditions < 2:
        raise AnalysisError(f"too few conditions ({conditions}): at least 2 are needed for a cumulative model")
    design = np.eye(conditions)[:, 1:] if columns is None else np.asarray(columns, dtype=np.float64)
    if design.ndim != 2 or len(design) != conditions:
        raise AnalysisError(
            f"columns of shape {design.shape} do not match {conditions} conditions; specify one row for each condition"
        )
    is_given = ~np.isnan(array)
    has_answers = is_given.any(axis=(1, 2))
    answered: Array = array[has_answers]
    effects, n = design.shape[1], len(answered)
    model = CumulativeModel(
        test=_MODEL,
        n=n,
        dropped=len(array) - n,
        statistic_name="LR",
        effect_name="log odds ratio" if effects == 1 else "log odds ratios",
        answers=int(is_given.sum()),
        incomplete=int((is_given[has_answers].any(axis=2).sum(axis=1) < conditions).sum()),
    )
    if n < _FEWEST or len(np.unique(answered[~np.isnan(answered)])) < 2:
        too_few = (
            f"there are fewer than {_FEWEST} participants, and the error rate of the test has not been evaluated "
            "for such small samples"
        )
        note = too_few if n < _FEWEST else "all participants gave the same answer in all conditions"
        return replace(model, no_interval=note, note=note)
    return _add_fit(model, _Likelihood(answered, design, slopes=columns is not None and effects == 1), direction)


def _add_fit(model: CumulativeModel, likelihood: "_Likelihood", direction: Direction | None) -> CumulativeModel:
    effects = likelihood.effects
    null = likelihood.maximum(null=True)
    fitted = None if null is None else likelihood.maximum()
    errors = None if fitted is None else likelihood.standard_errors(fitted.x)
    if null is None or fitted is None or errors is None:
        return replace(model, no_interval=_SEPARATED, note=_SEPARATED)
    statistic = max(0.0, 2.0 * (null.fun - fitted.fun))
    betas = fitted.x[likelihood.effect_columns]
    if effects == 1:
        p, reference = student_test(math.copysign(math.sqrt(statistic), betas[0]), model.n - 1, direction)
    else:
        freedom = effects * (model.n - 1)
        p = float(fdtrc(effects, freedom, statistic / effects))
        reference = f"F({effects}, {freedom})"
    reach = float(stdtrit(model.n - 1, (1 + _LEVEL) / 2)) * errors
    ends = zip((betas - reach).tolist(), (betas + reach).tolist(), strict=True)
    intervals = tuple(Interval(low=low, high=high, level=_LEVEL, method="Wald, with Student's t") for low, high in ends)
    return replace(
        model,
        statistic=statistic,
        p=p,
        method=reference,
        effect=float(betas[0]) if effects == 1 else None,
        interval=intervals[0] if effects == 1 else None,
        no_interval="" if effects == 1 else _SEVERAL,
        log_odds_ratios=tuple(betas.tolist()),
        intervals=intervals,
        sds=tuple(sd if sd > _LEAST_SD else 0.0 for sd in fitted.x[likelihood.effect_columns.stop :].tolist()),
        thresholds=tuple(likelihood.thresholds(fitted.x).tolist()),
        log_likelihood=float(-fitted.fun),
    )


_MOST_LOG_ODDS: Final = 15.0
_LEAST_SD: Final = 1e-3
"""The search stops here, since at 0 the gradient is 0 even if the likelihood rises with the SD; it is reported as 0."""
_SEPARATED: Final = "the conditions or the participants separate the answers completely"
_SEVERAL: Final = "there is no single effect size, because there is one log odds ratio per condition"


class _Likelihood:
    """The negative log likelihood of the parameters: first threshold, log steps, effects, standard deviations.

    Answers enter as counts by participant, condition and category, so that the time hardly depends on their number.
    """

    def __init__(self, values: Array, design: Array, *, slopes: bool) -> None:
        people, conditions, _ = values.shape
        categories, codes = np.unique(values[~np.isnan(values)], return_inverse=True)
        self.design, self.categories, self.effects = design, len(categories), design.shape[1]
        self.effect_columns = slice(self.categories - 1, self.categories - 1 + self.effects)
        counts = np.zeros((people, conditions, self.categories))
        person, condition, _ = np.nonzero(~np.isnan(values))
        np.add.at(counts, (person, condition, codes), 1.0)
        self._totals = counts.sum(axis=(0, 1))
        self._counts = counts.reshape(people, -1)
        self._slope_predictor = design if slopes else None

    def _set_grid(self, nodes: int) -> None:
        """Set the integration grid: ``nodes`` values of each standard normal deviation of a participant."""
        grid = np.linspace(-_GRID_SDS, _GRID_SDS, nodes)
        first, second = np.meshgrid(grid, np.zeros(1) if self._slope_predictor is None else grid, indexing="ij")
        self._log_weights = -0.5 * (first**2 + second**2).ravel()
        self._log_weights -= logsumexp(self._log_weights)
        self._deviations = [np.broadcast_to(first.ravel(), (len(self.design), first.size))]
        if self._slope_predictor is not None:
            self._deviations.append(self._slope_predictor * second.ravel())

    def thresholds(self, parameters: Array) -> Array:
        """Return the thresholds between categories."""
        first, log_steps = parameters[0], parameters[1 : self.categories - 1]
        return np.concatenate([[first], first + np.cumsum(np.exp(log_steps))])

    def maximum(self, *, null: bool = False) -> OptimizeResult | None:
        """Return scipy's result of the maximisation, None if there is no maximum.

        Under the null hypothesis all effects are 0.
        """
        proportions = np.cumsum(self._totals)[:-1] / self._totals.sum()
        cuts = np.log(proportions / (1 - proportions))
        sds = 1 if self._slope_predictor is None else 2
        start = np.array(
            [cuts[0], *np.log(np.maximum(np.diff(cuts), 0.05)), *np.zeros(self.effects), *[1.0, 0.5][:sds]]
        )
        bounds = [(-_MOST_LOG_ODDS, _MOST_LOG_ODDS)] * len(start)
        if null:
            bounds[self.effect_columns] = [(0.0, 0.0)] * self.effects
        bounds[self.effect_columns.stop :] = [(_LEAST_SD, _MOST_LOG_ODDS)] * sds
        options = {"maxiter": 500, "ftol": 1e-12, "gtol": 1e-6}
        for nodes in _NODES:
            self._set_grid(nodes)
            result = minimize(
                self.value_and_gradient, start, jac=True, method="L-BFGS-B", bounds=bounds, options=options
            )
            start = result.x
            if np.abs(start[[0, *range(self.effect_columns.start, len(start))]]).max() > 0.99 * _MOST_LOG_ODDS:
                return None
            self._set_grid(2 * nodes - 1)
            is_exact = abs(self.value_and_gradient(start)[0] - result.fun) < _MAX_CHANGE
            self._set_grid(nodes)
            if is_exact:
                return result
        return result

    def value_and_gradient(self, parameters: Array) -> tuple[float, Array]:
        """Return the negative log likelihood and its gradient."""
        cuts = self.thresholds(parameters)
        sds = parameters[self.effect_columns.stop :]
        shift = (self.design @ parameters[self.effect_columns])[:, None] + sum(
            sd * deviation for sd, deviation in zip(sds, self._deviations, strict=True)
        )
        below = np.zeros((len(shift), self.categories + 1, shift.shape[1]))
        below[:, 1:-1] = expit(cuts[None, :, None] - shift[:, None, :])
        below[:, -1] = 1.0
        proportion = np.maximum(np.diff(below, axis=1), _SMALLEST)
        density = below * (1.0 - below)
        at_upper, at_lower = density[:, 1:] / proportion, density[:, :-1] / proportion
        logs = self._counts @ np.log(proportion).reshape(self._counts.shape[1], -1) + self._log_weights
        largest = logs.max(axis=1, keepdims=True)
        likelihoods = np.exp(logs - largest)
        person_likelihoods = likelihoods.sum(axis=1, keepdims=True)
        weights = (self._counts.T @ (likelihoods / person_likelihoods)).reshape(proportion.shape)
        upper_gradient, lower_gradient = (weights * at_upper).sum(axis=2), (weights * at_lower).sum(axis=2)
        cut_gradient = upper_gradient[:, :-1].sum(axis=0) - lower_gradient[:, 1:].sum(axis=0)
        steps = np.exp(parameters[1 : self.categories - 1])
        cumulative_gradient = np.cumsum(cut_gradient[::-1])[::-1]
        shift_gradient = (weights * (at_lower - at_upper)).sum(axis=1)
        gradient = np.concatenate(
            [
                [cumulative_gradient[0]],
                steps * cumulative_gradient[1:],
                self.design.T @ shift_gradient.sum(axis=1),
                [float((shift_gradient * deviation).sum()) for deviation in self._deviations],
            ]
        )
        return float(-(largest + np.log(person_likelihoods)).sum()), -gradient

    def standard_errors(self, parameters: Array) -> Array | None:
        """Return the standard errors of the effects, from the observed information; None if it is singular."""
        free = [
            place
            for place in range(len(parameters))
            if place < self.effect_columns.stop or parameters[place] > _LEAST_SD
        ]
        step = 1e-4
        columns = []
        for change in step * np.eye(len(parameters)):
            (_, above), (_, below) = (self.value_and_gradient(parameters + side * change) for side in (1, -1))
            columns.append((above - below) / (2 * step))
        information = np.array(columns)[np.ix_(free, free)]
        information = (information + information.T) / 2
        if np.linalg.eigvalsh(information)[0] <= _SMALLEST:
            return None
        errors: Array = np.sqrt(np.diag(np.linalg.inv(information))[self.effect_columns])
        return errors
