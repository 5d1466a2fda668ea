"""Whether intervals of thresholds hold for people: published answers of 16 observers, in the order of their trials.

Run it by itself: ``python -m tests.benchmarks.analysis.people [REPETITIONS] [SEED]``. Each `PIECE` consecutive trials
of an observer and condition are fitted alone; counted is how often the 95 % interval of the difference between two
consecutive fits holds zero. The control redraws the same trials' answers from the fit to all trials of the observer and
condition, so many times. Where both hold zero, widths are compared with those of profile likelihood with the same
spread between sessions. ``--spread`` prints how far thresholds are from one piece to the next, beyond the posterior.
Exit code 3 if any row exceeds a limit: people at least 90 %, stationary observers at least 93 %, intervals at most 1.3
times as wide. The spread between sessions and the median of widths were chosen by discrimination.
"""

import math
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from study_app.analysis.levels.thresholds import person_answers
from study_app.analysis.planning.power_curves import interval
from study_app.protocol.trials.designs import default_design
from study_app.protocol.trials.stimuli import SESSION_SD, WIDTH_PRIOR, Stimulus
from study_app.psychophysics.families import success
from study_app.psychophysics.grid import Z_95, Grid, Posterior, group_priors

DATA = Path(__file__).parents[2] / "data" / "serial_decision.csv.gz"
PIECE = 200
STUDIES = ("plaid", "checkerboard", "discrimination")
SPREADS = np.linspace(0.0, 0.2, 401)
DESIGN = default_design("2ifc")


WIDTHS, LAPSES = np.geomspace(0.05, 5.0, 40), np.array([0.0, 0.005, 0.01, 0.02, 0.03, 0.045, 0.06])
"""Of the functions whose profile likelihood is compared."""


class Ends(NamedTuple):
    """An estimate of a threshold, and the ends of its 95 % interval [decades]."""

    threshold: float
    low: float
    high: float


class Pair(NamedTuple):
    """Two consecutive fits: whether intervals hold zero, their widths, the difference and its variance."""

    holds: bool
    width: float
    profile_holds: bool
    profile_width: float
    difference: float
    variance: float


def difference(first: Ends, second: Ends) -> tuple[float, float]:
    """Return the ends of the 95 % interval of a difference, from those of both thresholds [decades].

    By the method of variance estimates recovery (Zou & Donner 2008, Stat. Med. 27, 1693–1702).
    """
    middle = second.threshold - first.threshold
    below = math.hypot(second.threshold - second.low, first.high - first.threshold)
    return middle - below, middle + math.hypot(second.high - second.threshold, first.threshold - first.low)


def profiled(own: pd.DataFrame, correct: np.ndarray) -> Ends:
    """Return the maximum of the likelihood, and where its profile has fallen by half of chi²; with `SESSION_SD`."""
    levels, places = np.unique(np.log10(own["stimulus"].to_numpy(dtype=float)), return_inverse=True)
    right, n = np.bincount(places, correct), np.bincount(places)
    thresholds = np.linspace(levels[0] - 0.6, levels[-1] + 0.6, 241)
    psi = success(
        "weibull", levels[:, None, None, None], thresholds[:, None, None], WIDTHS[:, None], 0.5, LAPSES
    ).clip(1e-9, 1 - 1e-9)  # fmt: skip
    log_likelihood = np.einsum("k,kawl->awl", right, np.log(psi)) + np.einsum("k,kawl->awl", n - right, np.log1p(-psi))
    profile = log_likelihood.max(axis=(1, 2))
    best, inside = float(thresholds[profile.argmax()]), thresholds[profile >= profile.max() - 1.9207]
    low, high = (math.hypot(best - end, Z_95 * SESSION_SD) for end in (inside[0], inside[-1]))
    return Ends(best, best - low, best + high)


def fitted(own: pd.DataFrame, correct: np.ndarray, stimulus: Stimulus, grid: Grid) -> Posterior:
    """Return the posterior of answers, without a preference for an interval or for the previous answer."""
    towards = np.where(own["target"] == 0, 1.0, -1.0)
    rows = pd.DataFrame({"level": own["stimulus"], "success": correct, "towards": towards})
    before = np.concatenate(([0.0], np.where(correct, towards, -towards)[:-1]))
    rows = rows.assign(level_delivered=rows["level"], before=before)
    flat = person_answers(stimulus, rows).fit(grid, two_intervals=True).flat
    return flat.reweighted(group_priors([flat], WIDTH_PRIOR).factors[0])


def pairs(trials: pd.DataFrame, size: int, draw: np.random.Generator | None = None) -> Iterator[Pair]:
    """Yield the pairs of consecutive fits to so many trials each; with ``draw`` answers are redrawn."""
    for _, own in trials.groupby(["study", "observer", "condition"]):
        levels = own["stimulus"].to_numpy(dtype=float)
        correct = (own["target"] == own["response"]).to_numpy()
        stimulus = Stimulus(vary="damping_nspm", levels=(levels.min(), levels.max()), standards=(1.0,))
        grid = stimulus.analysis_grid(DESIGN, stimulus.assumed(DESIGN))
        if draw is not None:
            correct = draw.random(len(levels)) < fitted(own, correct, stimulus, grid).success(np.log10(levels))
        pieces = [slice(first, first + size) for first in range(0, len(levels) - size + 1, size)]
        fits = [fitted(own.iloc[piece], correct[piece], stimulus, grid) for piece in pieces]
        profiles = [profiled(own.iloc[piece], correct[piece]) for piece in pieces]
        ends = [Ends(fit.threshold, *fit.interval) for fit in fits]
        alone = [replace(fit, grid=replace(grid, session_sd=0.0)) for fit in fits]
        for place in range(len(fits) - 1):
            (low, high), (left, right) = difference(*ends[place : place + 2]), difference(*profiles[place : place + 2])
            first_fit, second_fit = alone[place : place + 2]
            yield Pair(
                holds=low <= 0 <= high,
                width=high - low,
                profile_holds=left <= 0 <= right,
                profile_width=right - left,
                difference=second_fit.threshold - first_fit.threshold,
                variance=first_fit.variance + second_fit.variance,
            )


def spread(found: list[Pair]) -> tuple[float, float, float]:
    """Return the spread between pieces, and the ends of its 95 % interval [decades], by likelihood."""
    differences, variances = np.array([pair.difference for pair in found]), np.array([pair.variance for pair in found])
    total = variances + 2 * SPREADS[:, None] ** 2
    log_likelihood = -0.5 * (differences**2 / total + np.log(total)).sum(axis=1)
    weights = np.exp(log_likelihood - log_likelihood.max())
    low, high = np.interp((0.025, 0.975), np.cumsum(weights / weights.sum()), SPREADS)
    return float(SPREADS[log_likelihood.argmax()]), low, high


def main(*arguments: str) -> int:
    """Print a row for each selection; return the exit code."""
    trials = pd.read_csv(DATA)
    if arguments == ("--spread",):
        for size in (PIECE, 2 * PIECE):
            for study, own in trials.groupby("study"):
                best, low, high = spread(list(pairs(own, size)))
                print(f"{study:15s}{size:4d} trials: {best:.3f} [{low:.3f}, {high:.3f}] decades")
        return 0
    repetitions, seed = (int(argument) for argument in (*arguments, *("10", "1")[len(arguments) :]))
    draw, failed = np.random.default_rng(seed), False
    print("data             pairs  held %  [Wilson]       profile held %  times as wide  stationary %")
    for name in STUDIES:
        study_trials = trials[trials["study"] == name]
        people = list(pairs(study_trials, PIECE))
        control = [pair.holds for _ in range(repetitions) for pair in pairs(study_trials, PIECE, draw)]
        share, still = float(np.mean([pair.holds for pair in people])), float(np.mean(control))
        low, high = interval(share, len(people))
        both = [pair for pair in people if pair.holds and pair.profile_holds]
        wider = float(np.median([pair.width / pair.profile_width for pair in both]))
        failed |= share < 0.9 or still < 0.93 or wider > 1.3
        print(
            f"{name:15s}{len(people):7d}{100 * share:8.1f}  [{100 * low:.1f}, {100 * high:.1f}]"
            f"{100 * float(np.mean([pair.profile_holds for pair in people])):17.1f}{wider:15.2f}{100 * still:14.1f}"
        )
    return 3 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
