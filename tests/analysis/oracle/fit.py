"""Fit thresholds by the model of docs/statistics.md: a posterior over a grid, without preferences and over changes."""

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy import interpolate, optimize, special, stats

from tests.analysis.oracle.recomputed import Floats, Numbers

Z_95 = stats.norm.ppf(0.975)
KAPPA = math.log10(math.log(20) / math.log(20 / 19))
LAPSES = np.array([0.0, 0.01, 0.02, 0.03, 0.045, 0.065, 0.09, 0.12, 0.16])
MEANS = np.array([0.002, 0.01, 0.02, 0.03, 0.045, 0.065, 0.09, 0.12])
MEAN_PRIOR = np.diff(stats.expon.cdf([0, *(MEANS[1:] + MEANS[:-1]) / 2, np.inf], scale=0.03))
OF_LAPSE = np.diff(stats.gamma.cdf([0, *(LAPSES[1:] + LAPSES[:-1]) / 2, np.inf], 2, scale=MEANS[:, None] / 2))
LAPSE_PRIOR = MEAN_PRIOR @ OF_LAPSE
GUESSES = {"2ifc": np.array([0.5]), "yesno": np.array([0.01, 0.02, 0.05, 0.1, 0.2, 0.3])}
WIDTHS = np.geomspace(0.15, 1.4 * 4, 17)
MEDIAN, FACTOR, ALIKE, APART = math.log(0.5), math.log(2.0), 0.6, np.array([0.05, 0.1, 0.2])
SESSION_SD, CHANGE_SD, PREFERENCE_SD, STEP, CLIP = 0.049, math.log10(1.5), 0.4, 0.01, 1e-9
PRIOR = stats.norm.pdf(np.log(WIDTHS), MEDIAN, FACTOR)[:, None] * LAPSE_PRIOR


def rise(design: str, distance: Floats) -> Floats:
    """Return the fraction of the rise of a Weibull (2ifc) or normal function at a distance from the threshold."""
    if design == "yesno":
        return np.asarray(special.ndtr(2 * stats.norm.ppf(0.95) * distance))
    return np.asarray(-np.expm1(-math.log(2) * 10 ** np.minimum(KAPPA * distance, 300)))


class Fit:
    """The posterior of one person's answers at one standard; ``weights`` has a flat prior on the width."""

    def __init__(self, rows: pd.DataFrame, design: str, ends: Sequence[float]) -> None:
        placed = rows.groupby("level")["delivered"].transform("mean").fillna(rows["level"]).to_numpy(float)
        self.u = np.log10(placed, where=placed > 0, out=np.full(len(rows), -np.inf))
        self.design, self.success, self.shifts = design, rows["success"].to_numpy(bool), np.zeros(len(rows))
        self.thresholds = np.linspace(math.log10(ends[0]) - 0.4, math.log10(ends[1]) + 0.4, 97)
        self.done = np.linspace(0, 1, len(rows))
        weights = self._posterior(np.zeros(1), PRIOR)
        for _ in range(2 if design == "2ifc" else 0):
            self.shifts = self._preferences(rows, weights)
            weights = self._posterior(np.zeros(1), PRIOR)
        score, information = self.score(weights, self.done)
        self.change = score / (information + CHANGE_SD**-2) if score**2 > 4 * information else 0.0
        self.sd = math.hypot(SESSION_SD / math.sqrt(rows["session"].nunique()), self.change / math.sqrt(12))
        self.weights = self._posterior(CHANGE_SD * np.linspace(-2.5, 2.5, 9), LAPSE_PRIOR)

    def score(self, weights: Floats, course: Floats) -> Floats:
        """Return the score and information, at zero, of a threshold that follows this course over the trials."""
        step, psi = STEP * self.medians(weights)[1], self.expected(weights)
        slope = (self.expected(weights, step) - self.expected(weights, -step)) / (2 * step)
        course = course - np.average(course, weights=slope**2 / (psi * (1 - psi)) + 1e-300)
        terms = [slope * course * (self.success - psi), (slope * course) ** 2]
        return np.asarray(np.sum(terms / (psi * (1 - psi)), axis=1))

    def _posterior(self, changes: Floats, prior: Floats) -> Floats:
        """Return the mean posterior of the halves of the trials, each moved by a quarter of a change."""
        guesses, parts = GUESSES[self.design], {}
        for (u, shift, half), right in pd.Series(self.success).groupby([self.u, self.shifts, np.sign(self.done - 0.5)]):
            share = rise(self.design, (u - self.thresholds[:, None]) / WIDTHS)[..., None, None]
            psi = np.clip(guesses + (1 - guesses - LAPSES[:, None]) * share, CLIP, 1 - CLIP)
            if shift:
                psi = preferred(np.clip((1 + share) / 2, CLIP, 1 - CLIP), LAPSES[:, None], shift)
            parts[half] = parts.get(half, 0) + right.sum() * np.log(psi) + (~right).sum() * np.log1p(-psi)
        logs = np.log(stats.norm.pdf(changes, scale=CHANGE_SD)[:, None, None, None, None] * prior[..., None])
        for half, part in parts.items():
            at = np.clip(self.thresholds + half / 4 * changes[:, None], *self.thresholds[[0, -1]])
            logs = logs + interpolate.make_interp_spline(self.thresholds, part, k=1)(at)
        return np.asarray(special.softmax(logs, axis=None).sum(axis=0))

    def quantile(self, weights: Floats, share: float) -> float:
        half = (self.thresholds[1] - self.thresholds[0]) / 2
        edges = np.append(self.thresholds[0] - half, self.thresholds + half)
        return float(np.interp(share, np.append(0, np.cumsum(weights.sum(axis=(1, 2, 3)))), edges))

    def medians(self, weights: Floats) -> list[float]:
        medians_of_grid = [self.quantile(weights, 0.5)]
        for axis, values in ((1, WIDTHS), (2, LAPSES), (3, GUESSES[self.design])):
            of_axis = weights.sum(axis=tuple({0, 1, 2, 3} - {axis}))
            medians_of_grid.append(float(np.interp(0.5, np.cumsum(of_axis) - of_axis / 2, values)))
        return medians_of_grid

    def expected(self, weights: Floats, further: float = 0.0) -> Floats:
        """Return the probability of success of each answer, of a threshold that is so much higher."""
        threshold, width, lapse, guess = self.medians(weights)
        share = rise(self.design, (self.u - threshold - further) / width)
        psi = np.clip(guess + (1 - guess - lapse) * share, CLIP, 1 - CLIP)
        return preferred((psi - lapse) / (1 - 2 * lapse), lapse, self.shifts) if self.shifts.any() else psi

    def _preferences(self, rows: pd.DataFrame, weights: Floats) -> Floats:
        """Return how far preferences move each decision, by a probit regression with lapses and a prior."""
        towards = rows["order"].map({"cs": 1.0, "sc": -1.0}).to_numpy()
        signs, lapse, self.shifts = np.where(self.success, towards, -towards), self.medians(weights)[2], 0 * self.u
        sensed = towards * special.ndtri(np.clip((self.expected(weights) - lapse) / (1 - 2 * lapse), 0.5, 0.999))
        causes = np.column_stack([np.ones(len(signs)), rows["before"]])

        def loss(mode: Floats) -> float:
            shares = lapse + (1 - 2 * lapse) * special.ndtr(signs * (sensed + causes @ mode))
            return float(mode @ mode / 2 / PREFERENCE_SD**2 - np.log(shares).sum())

        mode = optimize.minimize(loss, np.zeros(2), tol=1e-10).x
        return np.asarray(towards * np.round(causes @ mode, 1))

    def weights_under(self, prior: Floats) -> tuple[Floats, float]:
        """Return the weights under a prior on width and lapse rate, and the variance of the threshold."""
        weights = self.weights * (prior / LAPSE_PRIOR)[..., None]
        weights /= weights.sum()
        marginal = weights.sum(axis=(1, 2, 3))
        return weights, float(marginal @ (self.thresholds - marginal @ self.thresholds) ** 2) + self.sd**2

    def numbers(self, prior: Floats) -> Numbers:
        weights, variance = self.weights_under(prior)
        (threshold, width, lapse, guess), psi = self.medians(weights), self.expected(weights)
        ends = [math.hypot(self.quantile(weights, end) - threshold, Z_95 * self.sd) for end in (0.025, 0.975)]
        residuals = np.sign(self.success - psi) * np.sqrt(-2 * np.log(np.where(self.success, psi, 1 - psi)))
        own = {"n": len(psi), "threshold": 10**threshold, "width": width, "lapse": lapse, "guess": guess}
        own |= {"low": 10 ** (threshold - ends[0]), "high": 10 ** (threshold + ends[1]), "variance": variance}
        own |= {"flat_width": 10 ** self.quantile(self.weights, 0.5), "change": 10**self.change - 1}
        own["_early"] = self.score(weights, -np.exp(-np.arange(len(psi)) / 15))
        return own | {"drift": np.corrcoef(np.arange(len(psi)), residuals)[0, 1]}


def preferred(unbiased: Floats, lapse: Floats | float, shift: Floats | float) -> Floats:
    """Return the probability of success where a preference moves the decision."""
    psi = lapse + (1 - 2 * lapse) * special.ndtr(special.ndtri(np.clip(unbiased, CLIP, 1 - CLIP)) + shift)
    return np.clip(psi, CLIP, 1 - CLIP)


def group_priors(fits: Sequence[Fit]) -> tuple[Floats, Floats]:
    """Return each person's prior on width and lapse rate from the others' answers, and the bounds of a common error."""
    widths, thresholds = np.log(WIDTHS), fits[0].thresholds
    of_width = stats.norm.pdf(widths, widths[:, None], ALIKE * FACTOR)
    of_width /= of_width.sum(axis=1, keepdims=True)
    shared = stats.norm.logpdf(widths, MEDIAN, FACTOR * math.sqrt(1 - ALIKE**2))[:, None] + np.log(MEAN_PRIOR)
    about = np.vstack([stats.norm.pdf(thresholds, thresholds[::2, None], sd * np.ptp(thresholds)) for sd in APART])
    about /= about.sum(axis=1, keepdims=True)
    likelihoods = np.array([fit.weights.sum(axis=3) for fit in fits]) / LAPSE_PRIOR
    masses = np.einsum("pawl,cw,kl->pack", likelihoods, of_width, OF_LAPSE, optimize=True)
    evidence = np.log(np.maximum(np.einsum("ma,pack->pmck", about, masses, optimize=True), 1e-300))
    of_others = special.softmax(shared + evidence.sum(axis=0) - evidence, axis=(1, 2, 3)).sum(axis=1)
    of_others **= 2 if len(fits) > 1 else 1
    of_others /= of_others.sum(axis=(1, 2), keepdims=True)
    of_all = special.softmax(shared + evidence.sum(axis=0)).sum(axis=0).ravel()
    errors = np.average(np.tensordot(masses, thresholds, (1, 0)) / masses.sum(axis=1), axis=0).ravel()
    errors, order = errors - np.average(errors, weights=of_all**2), np.argsort(errors)
    ends = np.interp([0.025, 0.975], np.cumsum(of_all[order]) - of_all[order] / 2, errors[order])
    return np.einsum("pck,cw,kl->pwl", of_others, of_width, OF_LAPSE), ends


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
