"""Fit thresholds by the model of docs/statistics.md: a posterior over a grid, without preferences and without drift."""

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy import optimize, special, stats

from tests.analysis.oracle.recomputed import Floats, Numbers

Z_95 = stats.norm.ppf(0.975)
KAPPA = math.log10(math.log(20) / math.log(20 / 19))
LAPSES, LAPSE_PRIOR = np.array([0.0, 0.01, 0.02, 0.03, 0.05]), np.array([0.25, 0.3, 0.2, 0.15, 0.1])[:, None]
GUESSES = {"2ifc": np.array([0.5]), "yesno": np.array([0.01, 0.02, 0.05, 0.1, 0.2, 0.3])}
WIDTHS = np.geomspace(0.7 * 0.5, 1.4 * 4, 17)
MEDIAN, FACTOR, ALIKE, APART = math.log(1.4), math.log(2.0), 1 / 3, np.array([0.05, 0.1, 0.2])
SESSION_SD, CHANGE_SD, STEP, CLIP = 0.049, math.log10(1.5), 0.01, 1e-9


def rise(design: str, distance: Floats) -> Floats:
    """Return the share of the rise of a Weibull function (2ifc) or a normal one, so many widths above the threshold."""
    if design == "yesno":
        return np.asarray(special.ndtr(2 * stats.norm.ppf(0.95) * distance))
    return np.asarray(-np.expm1(-math.log(2) * 10 ** np.minimum(KAPPA * distance, 300)))


class Fit:
    """What the answers of a person at one standard say, in ``weights`` under a flat prior on the width."""

    def __init__(self, rows: pd.DataFrame, design: str, ends: Sequence[float]) -> None:
        placed = rows.groupby("level")["delivered"].transform("mean").fillna(rows["level"]).to_numpy(float)
        self.u = np.log10(placed, where=placed > 0, out=np.full(len(rows), -np.inf))
        self.design, self.success, self.shifts = design, rows["success"].to_numpy(bool), np.zeros(len(rows))
        self.thresholds = np.linspace(math.log10(ends[0]) - 0.2, math.log10(ends[1]) + 0.2, 81)
        self.done, prior = np.linspace(0, 1, len(rows)), stats.norm.pdf(np.log(WIDTHS), MEDIAN, FACTOR)
        weights = self._posterior(0.0, prior)
        for _ in range(2 if design == "2ifc" else 0):
            self.shifts = self._preferences(rows, weights)
            weights = self._posterior(0.0, prior)
        step, psi = STEP * self.medians(weights)[1], self.expected(weights)
        slope = (self.expected(weights, -step) - self.expected(weights, step)) / (2 * step)
        information = slope**2 / (psi * (1 - psi))
        time = self.done - np.average(self.done, weights=information)
        score = -slope / (psi * (1 - psi)) @ ((self.success - psi) * time)
        change = score / (information @ time**2 + CHANGE_SD**-2)
        self.change = change if score**2 > 4 * information @ time**2 else 0.0
        self.sd = math.hypot(SESSION_SD / math.sqrt(rows["session"].nunique()), self.change / math.sqrt(12))
        self.weights = self._posterior(change, np.ones(len(WIDTHS)))

    def _posterior(self, change: float, prior: Floats) -> Floats:
        """Return the posterior from the halves of the trials, each moved by a quarter of the change."""
        step, last = self.thresholds[1] - self.thresholds[0], len(self.thresholds) - 1
        logs, table = 0.0, pd.DataFrame({"u": self.u, "shift": self.shifts, "half": np.sign(self.done - 0.5)})
        guesses = GUESSES[self.design]
        for (u, shift, half), right in pd.Series(self.success).groupby([table[name] for name in table]):
            share = rise(self.design, (u - self.thresholds[:, None]) / WIDTHS)[..., None, None]
            psi = guesses + (1 - guesses - LAPSES[:, None]) * share
            if shift:
                psi = preferred(np.clip((1 + share) / 2, CLIP, 1 - CLIP), LAPSES[:, None], shift)
            psi = np.clip(psi, CLIP, 1 - CLIP)
            of_cells = right.sum() * np.log(psi) + (~right).sum() * np.log1p(-psi)
            at = np.clip(np.arange(last + 1) + half * change / 4 / step, 0, last)
            low = np.minimum(at.astype(int), last - 1)
            further = (at - low)[:, None, None, None]
            logs = logs + of_cells[low] * (1 - further) + of_cells[low + 1] * further
        weights = np.exp(logs - np.max(logs)) * LAPSE_PRIOR * prior[:, None, None]
        return np.asarray(weights / weights.sum())

    def quantile(self, weights: Floats, share: float) -> float:
        half = (self.thresholds[1] - self.thresholds[0]) / 2
        edges = np.append(self.thresholds[0] - half, self.thresholds + half)
        return float(np.interp(share, np.append(0, np.cumsum(weights.sum(axis=(1, 2, 3)))), edges))

    def medians(self, weights: Floats) -> list[float]:
        found = [self.quantile(weights, 0.5)]
        for axis, values in ((1, WIDTHS), (2, LAPSES), (3, GUESSES[self.design])):
            of_axis = weights.sum(axis=tuple({0, 1, 2, 3} - {axis}))
            found.append(float(np.interp(0.5, np.cumsum(of_axis) - of_axis / 2, values)))
        return found

    def expected(self, weights: Floats, further: float = 0.0) -> Floats:
        """Return the probability of success of each answer, of a threshold that is so much higher."""
        threshold, width, lapse, guess = self.medians(weights)
        share = rise(self.design, (self.u - threshold - further) / width)
        psi = np.clip(guess + (1 - guess - lapse) * share, CLIP, 1 - CLIP)
        return preferred((psi - lapse) / (1 - 2 * lapse), lapse, self.shifts) if self.shifts.any() else psi

    def _preferences(self, rows: pd.DataFrame, weights: Floats) -> Floats:
        """Return how far preferences move each decision: the mode of a probit regression with a normal prior."""
        towards = rows["order"].map({"cs": 1.0, "sc": -1.0}).to_numpy()
        said, lapse, self.shifts = np.where(self.success, towards, -towards), self.medians(weights)[2], 0 * self.u
        sensed = towards * special.ndtri(np.clip((self.expected(weights) - lapse) / (1 - 2 * lapse), 0.5, 0.999))
        causes = np.column_stack([np.ones(len(said)), rows["before"]])

        def loss(mode: Floats) -> float:
            return float(mode @ mode / 2 - special.log_ndtr(said * (sensed + causes @ mode)).sum())

        mode = optimize.minimize(loss, np.zeros(2), tol=1e-10).x
        agreed = said * (sensed + causes @ mode)
        hazard = np.exp(stats.norm.logpdf(agreed) - special.log_ndtr(agreed))
        errors = np.sqrt(np.diag(np.linalg.inv((causes.T * hazard * (hazard + agreed)) @ causes + np.eye(2))))
        return np.asarray(towards * np.round(causes @ np.where(abs(mode) > 2 * errors, mode, 0.0), 1))

    def under(self, prior: Floats) -> tuple[Floats, float]:
        """Return the weights under a prior on the width, and the variance of the threshold."""
        weights = self.weights * prior[:, None, None] / (self.weights * prior[:, None, None]).sum()
        marginal = weights.sum(axis=(1, 2, 3))
        return weights, float(marginal @ (self.thresholds - marginal @ self.thresholds) ** 2) + self.sd**2

    def numbers(self, prior: Floats) -> Numbers:
        weights, variance = self.under(prior)
        (threshold, width, lapse, guess), psi = self.medians(weights), self.expected(weights)
        ends = [math.hypot(self.quantile(weights, end) - threshold, Z_95 * self.sd) for end in (0.025, 0.975)]
        residuals = np.sign(self.success - psi) * np.sqrt(-2 * np.log(np.where(self.success, psi, 1 - psi)))
        own = {"n": len(psi), "threshold": 10**threshold, "width": width, "lapse": lapse, "guess": guess}
        own |= {"low": 10 ** (threshold - ends[0]), "high": 10 ** (threshold + ends[1]), "variance": variance}
        own |= {"flat_width": 10 ** self.quantile(self.weights, 0.5), "change": 10**self.change - 1}
        return own | {"drift": np.corrcoef(np.arange(len(psi)), residuals)[0, 1]}


def preferred(unbiased: Floats, lapse: Floats | float, shift: Floats | float) -> Floats:
    """Return the probability of success where a preference moves the decision."""
    psi = lapse + (1 - 2 * lapse) * special.ndtr(special.ndtri(np.clip(unbiased, CLIP, 1 - CLIP)) + shift)
    return np.clip(psi, CLIP, 1 - CLIP)


def width_priors(fits: Sequence[Fit]) -> tuple[Floats, float]:
    """Return each person's prior on the width from the answers of the others, and the variance of what all share."""
    widths, thresholds = np.log(WIDTHS), fits[0].thresholds
    own = stats.norm.pdf(widths, widths[:, None], ALIKE * FACTOR)
    own /= own.sum(axis=1, keepdims=True)
    centres = stats.norm.logpdf(widths, MEDIAN, FACTOR * math.sqrt(1 - ALIKE**2))
    spreads = APART * np.ptp(thresholds)
    about = np.vstack([stats.norm.pdf(thresholds, thresholds[::2, None], spread) for spread in spreads])
    about /= about.sum(axis=1, keepdims=True)
    joint = np.array([fit.weights.sum(axis=(2, 3)) for fit in fits])
    evidence = np.log(np.maximum(np.einsum("ma,paw,cw->pmc", about, joint, own, optimize=True), 1e-300))
    of_others = special.softmax(centres + evidence.sum(axis=0) - evidence, axis=(1, 2)).sum(axis=1)
    of_all = special.softmax(centres + evidence.sum(axis=0)).sum(axis=0)
    masses = np.einsum("paw,cw->pac", joint, own)
    means = (np.einsum("pac,a->pc", masses, thresholds) / masses.sum(axis=1)).mean(axis=0)
    return of_others @ own, float(of_all @ (means - of_all @ means) ** 2)


def random_effects(sample: pd.DataFrame) -> tuple[float, float]:
    """Return the mean of value and variance by Paule and Mandel, and its standard error by Hartung and Knapp."""
    estimates, variances = sample["value"].to_numpy(), sample["variance"].to_numpy()
    smoothed, n = np.sqrt(variances * np.median(variances)), len(sample)

    def excess(between: float) -> float:
        mean = np.average(estimates, weights=1 / (smoothed + between))
        return float(((estimates - mean) ** 2 / (smoothed + between)).sum()) - (n - 1)

    weights = 1 / (smoothed + (optimize.brentq(excess, 0, 100, xtol=1e-14) if excess(0) > 0 else 0.0))
    mean = float(np.average(estimates, weights=weights))
    return mean, math.sqrt(weights @ (estimates - mean) ** 2 / ((n - 1) * weights.sum()))
