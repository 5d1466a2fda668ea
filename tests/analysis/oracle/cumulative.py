"""Maximise the likelihood of a cumulative mixed model, integrated by adaptive Gauss-Hermite quadrature."""

import math
from itertools import product

import numpy as np
import pandas as pd
from scipy import optimize, special, stats

from tests.analysis.oracle.recomputed import Floats, Numbers, named

NODES, WEIGHTS = np.polynomial.hermite_e.hermegauss(9)


class Model:
    """Answers of each participant with the predictors; deviations are integrated about their most probable values."""

    def __init__(self, rows: pd.DataFrame, design: Floats, *, slopes: bool) -> None:
        categories = np.unique(rows["response"])
        self.k, self.effects, self.sds = len(categories), design.shape[1], 1 + slopes
        own = [group for _, group in rows.groupby("participant")]
        most = max(map(len, own))
        self.answers, self.x = np.zeros((len(own), most), int), np.zeros((len(own), most, self.effects))
        self.given = np.arange(most) < np.array([*map(len, own)])[:, None]
        for person, group in enumerate(own):
            self.answers[person, : len(group)] = np.searchsorted(categories, group["response"])
            self.x[person, : len(group)] = design[group["place"]]
        shares = np.cumsum(np.bincount(self.answers[self.given])) / len(rows)
        self.start = np.concatenate([special.logit(shares[:-1]), np.zeros(self.effects), [0.8, 0.4][: self.sds]])

    def joint(self, values: Floats, deviations: Floats) -> Floats:
        """Return the log density of each participant's answers and deviates (participants, nodes, deviations)."""
        cuts, effects, sds = np.split(values, [self.k - 1, self.k - 1 + self.effects])
        edges = np.concatenate([[-np.inf], np.sort(cuts), [np.inf]])
        shift = (self.x @ effects)[:, None] + deviations[..., [0]] * sds[0]
        if self.sds == 2:
            shift = shift + deviations[..., [1]] * sds[1] * self.x[:, None, :, 0]
        above, below = edges[self.answers + 1][:, None] - shift, shift - edges[self.answers][:, None]
        chances = special.log_expit(above) + special.log_expit(below) + np.log(-np.expm1(-above - below))
        return np.asarray(np.where(self.given[:, None], chances, 0).sum(axis=2) - (deviations**2).sum(axis=2) / 2)

    def centre(self, values: Floats) -> None:
        """Place the nodes about each participant's most probable deviations, as far apart as these are uncertain."""
        mode, h, units = np.zeros((len(self.answers), self.sds)), 1e-3, np.eye(self.sds)
        sides = [*product((1, -1), repeat=2)]

        def at(*steps: Floats) -> Floats:
            return self.joint(values, mode[:, None] + np.array(steps))

        for _ in range(30):
            slopes = np.stack([(at(h * unit) - at(-h * unit))[:, 0] / (2 * h) for unit in units], axis=1)
            curvature = np.array([
                [(at(*[s * h * unit + r * h * over for s, r in sides]) @ [s * r for s, r in sides]) for over in units]
                for unit in units
            ]).transpose(2, 0, 1) / (4 * h * h)  # fmt: skip
            step = np.linalg.solve(curvature, slopes[..., None])[..., 0]
            mode = mode - step * np.minimum(1, 1 / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-9))
        scale = np.linalg.cholesky(np.linalg.inv(-curvature))
        nodes = np.array([*product(NODES, repeat=self.sds)])
        weights = np.log(np.array([*product(WEIGHTS, repeat=self.sds)]).prod(axis=1)) + (nodes**2).sum(axis=1) / 2
        self.nodes = mode[:, None] + nodes @ scale.transpose(0, 2, 1)
        self.weights = weights + np.log(np.linalg.det(scale))[:, None] - self.sds / 2 * math.log(2 * math.pi)

    def log_likelihood(self, values: Floats) -> float:
        return float(special.logsumexp(self.joint(values, self.nodes) + self.weights, axis=1).sum())

    def maximum(self, *, null: bool = False) -> tuple[Floats, float]:
        """Return the parameters and the log likelihood at the maximum; under the null hypothesis without effects."""
        fixed = np.zeros(len(self.start), bool)
        fixed[self.k - 1 : self.k - 1 + self.effects] = null
        values = self.start.copy()

        def loss(free: Floats) -> float:
            values[~fixed] = free
            return -self.log_likelihood(values)

        for _ in range(2):
            self.centre(values)
            best = optimize.minimize(loss, values[~fixed], method="BFGS", options={"gtol": 1e-3})
            values[~fixed] = best.x
        return values, -float(best.fun)

    def standard_errors(self, values: Floats) -> Floats:
        """Return the standard errors of the effects, by the curvature at the maximum; a deviation of 0 is fixed."""
        free = [i for i in range(len(values)) if i < len(values) - self.sds or abs(values[i]) > 1e-2]
        steps, sides = 1e-3 * np.eye(len(values))[free], [*product((1, -1), repeat=2)]
        curvature = np.array([
            [sum(s * r * self.log_likelihood(values + s * step + r * across) for s, r in sides) for across in steps]
            for step in steps
        ]) / 4e-6  # fmt: skip
        return np.asarray(np.sqrt(np.diag(np.linalg.inv(-curvature)))[self.k - 1 : self.k - 1 + self.effects])


def counts(rows: pd.DataFrame, conditions: int) -> Numbers:
    answered = rows.groupby("participant")["place"].nunique()
    own = {"n": len(answered), "dropped": 0, "answers": len(rows), "incomplete": int((answered < conditions).sum())}
    return own | {"p": math.nan}


_FITS: dict[tuple[str, bytes, str | None, bool], Numbers] = {}


def fitted(rows: pd.DataFrame, design: Floats, direction: str | None, *, slopes: bool) -> Numbers:
    """Return the statistics of a model, compared with the model without effects; equal answers are fitted once."""
    key = (rows[["participant", "place", "response"]].to_csv(index=False), design.tobytes(), direction, slopes)
    if key not in _FITS:
        _FITS[key] = _fit(rows, design, direction, slopes=slopes)
    return _FITS[key]


def _fit(rows: pd.DataFrame, design: Floats, direction: str | None, *, slopes: bool) -> Numbers:
    model = Model(rows, design, slopes=slopes)
    values, most = model.maximum()
    cuts, effects, sds = np.split(values, [model.k - 1, model.k - 1 + model.effects])
    reach = stats.t.ppf(0.975, len(model.answers) - 1) * model.standard_errors(values)
    intervals = [
        {"low": effect - half, "high": effect + half, "level": 0.95}
        for effect, half in zip(effects, reach, strict=True)
    ]
    ratio = max(0.0, 2 * (most - model.maximum(null=True)[1]))
    n = len(model.answers)
    own = {"statistic": ratio, "log_likelihood": most, **named("thresholds", enumerate(np.sort(cuts)))}
    own |= named("log_odds_ratios", enumerate(effects)) | named("sds", enumerate(np.abs(sds)))
    for place, interval in enumerate(intervals):
        own |= named(f"intervals.{place}", interval)
    if len(effects) > 1:
        k = len(effects)
        return own | {"p": stats.f.sf(ratio / k, k, k * (n - 1))}
    root = math.copysign(math.sqrt(ratio), effects[0])
    tails = {
        "greater": stats.t.sf(root, n - 1),
        "less": stats.t.cdf(root, n - 1),
        None: 2 * stats.t.sf(abs(root), n - 1),
    }
    own |= named("interval", intervals[0])
    return own | {"effect": effects[0], "p": tails[direction]}
