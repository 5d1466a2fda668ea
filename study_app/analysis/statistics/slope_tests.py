"""Tests of mean answers by participants' slopes: Student's t for one slope, Hotelling's T² for several.

The answers of each participant in all settings give least-squares slopes; the test is whether their mean in the
population is 0 (Hotelling 1931, Ann. Math. Stat. 2, 360–378), even if slopes of individual people are not. Scale points
are treated as numbers with equal steps. Participants with a missing answer are left out.

Without missing answers the estimate is that of a linear mixed model with random intercepts and slopes by restricted
likelihood (Laird & Ware 1982, Biometrics 38, 963–974), unless that puts a variance of slopes at 0.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import fdtrc, stdtr, stdtrit

from study_app.analysis.statistics.outcome import FEW, NO_VARIATION, Array, Interval, Outcome, complete_rows
from study_app.analysis.statistics.trend_tests import Direction
from study_app.errors import AnalysisError

_LEVEL: Final = 0.95
T_TEST: Final = "t test of slopes"
PAIRED: Final = "t test of differences"
HOTELLING: Final = "Hotelling's T²"


@dataclass(frozen=True, slots=True, kw_only=True)
class SlopeTest(Outcome):
    """The test of all slopes; ``effect`` is the slope if there is only one, otherwise they are in ``slopes``.

    ``intervals`` are Student's 95 % intervals of the slopes [points per unit of the column], ``sds`` the standard
    deviations between the participants' own slopes, ``intercept_sd`` that between their answers where all columns
    are 0: without a delay, or in the first setting.
    """

    slopes: tuple[float, ...] = ()
    intervals: tuple[Interval, ...] = ()
    sds: tuple[float, ...] = ()
    intercept_sd: float | None = None


def slope_test(values: ArrayLike, columns: ArrayLike | None = None, direction: Direction | None = None) -> SlopeTest:
    """Test whether settings shift answers up or down in the population.

    Parameters
    ----------
    values : (participants, settings) array
        Participants with NaN, a missing answer, are dropped.
    columns : (settings, columns) array, optional
        The tested contrasts, such as a delay in units of 100 ms. By default every setting is compared with the first.
    direction : "increasing" | "decreasing", optional
        Direction of a single slope that was stated in advance; the test is then one-sided.
    """
    rows, dropped = complete_rows(values, at_least=2, why=" for a test of means")
    design = _design_matrix(rows.shape[1], columns)
    n, effects = len(rows), design.shape[1]
    test = SlopeTest(
        test=HOTELLING if effects > 1 else PAIRED if columns is None else T_TEST,
        n=n,
        dropped=dropped,
        statistic_name="t" if effects == 1 else "F",
        effect_name="differences" if effects > 1 else "difference" if columns is None else "slope",
    )
    intercepts, *slopes = np.linalg.pinv(np.column_stack([np.ones(len(design)), design])) @ rows.T
    person_slopes = np.array(slopes).T
    covariance = np.atleast_2d(np.cov(person_slopes, rowvar=False)) if n > 1 else np.zeros((effects, effects))
    fewest = max(FEW, effects + 1)
    if n < fewest or np.linalg.matrix_rank(covariance, tol=1e-12) < effects:
        too_few = (
            f"no test of means for fewer than {fewest} participants, because it relies on normally distributed "
            f"{'differences' if columns is None else 'slopes'}"
        )
        note = too_few if n < fewest else _NO_SPREAD
        note = NO_VARIATION if n and not np.ptp(rows, axis=1).any() else note
        return replace(test, no_interval=note, note=note)
    means, errors = person_slopes.mean(axis=0), np.sqrt(np.diag(covariance) / n)
    if effects == 1:
        statistic = float(means[0] / errors[0])
        p, method = student_test(statistic, n - 1, direction)
    else:
        statistic = float(means @ np.linalg.solve(covariance, means)) * n * (n - effects) / (effects * (n - 1))
        p, method = float(fdtrc(effects, n - effects, statistic)), f"F({effects}, {n - effects})"
    reach = float(stdtrit(n - 1, (1 + _LEVEL) / 2)) * errors
    ends = zip((means - reach).tolist(), (means + reach).tolist(), strict=True)
    intervals = tuple(Interval(low=low, high=high, level=_LEVEL, method="Student's t") for low, high in ends)
    return replace(
        test,
        statistic=statistic,
        p=p,
        method=method,
        effect=float(means[0]) if effects == 1 else None,
        interval=intervals[0] if effects == 1 else None,
        no_interval=""
        if effects == 1
        else "there is no single effect size, because there is one difference per condition",
        slopes=tuple(means.tolist()),
        intervals=intervals,
        sds=tuple(np.sqrt(np.diag(covariance)).tolist()),
        intercept_sd=float(np.std(intercepts, ddof=1)),
    )


def student_test(t: float, freedom: int, direction: Direction | None) -> tuple[float, str]:
    """Return p of a ``t`` with ``freedom`` degrees of freedom, and the name of the test with its sides."""
    upper, lower = float(stdtr(freedom, -t)), float(stdtr(freedom, t))
    p = {"increasing": upper, "decreasing": lower, None: 2 * min(upper, lower)}[direction]
    return p, f"t({freedom}), " + (f"one-sided ({direction})" if direction else "two-sided")


_NO_SPREAD: Final = "no spread: some differences between conditions are the same for all participants"


def _design_matrix(settings: int, columns: ArrayLike | None) -> Array:
    if columns is None:
        return np.eye(settings)[:, 1:]
    design = np.asarray(columns, dtype=np.float64)
    centred = design - design.mean(axis=0) if len(design) else design
    if len(design) != settings or np.isnan(design).any() or np.linalg.matrix_rank(centred) < design.shape[1]:
        raise AnalysisError(
            f"columns of shape {design.shape} do not distinguish {settings} conditions; specify one row per "
            "condition, without NaN, and linearly independent columns"
        )
    return design
