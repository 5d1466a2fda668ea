"""Whether intervals of thresholds hold for people: published answers of 16 observers, in the order of their trials.

Run it by itself: ``python tests/benchmarks/analysis/people.py [REPETITIONS]``. Each `PIECE` consecutive trials of an
observer and condition are fitted alone; counted is how often the 95 % interval of the difference between two
consecutive fits holds zero. The control redraws the same trials' answers from the fit to all trials of the observer and
condition, so many times. ``--spread`` prints how far thresholds are from one piece to the next, beyond the posterior.
Exit code 3 if plaid and checkerboard together exceed a limit: people at least 90 %, lower end of the Wilson interval
at least 80 %; stationary observers 93 to 99 %, and their intervals at most 1.5 times as wide as without the spread
between sessions. That spread was chosen by the other data, discrimination.
"""

import math
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from study_app.analysis.levels.thresholds import given_by
from study_app.analysis.planning.power_curves import interval
from study_app.protocol.trials.designs import default_design
from study_app.protocol.trials.stimuli import Stimulus, analysis_grid, assumed_for
from study_app.psychophysics.grid import Grid, Posterior

DATA = Path(__file__).parents[2] / "data" / "serial_decision.csv.gz"
PIECE = 200
JUDGED = "plaid, checkerboard"
STUDIES = ("plaid", "checkerboard", "discrimination")
SPREADS = np.linspace(0.0, 0.2, 401)
DESIGN = default_design("2ifc")


class Pair(NamedTuple):
    """Two consecutive fits: whether the interval holds zero, its width, that without a spread, difference, variance."""

    holds: bool
    width: float
    narrow: float
    difference: float
    variance: float


def difference(first: Posterior, second: Posterior) -> tuple[float, float]:
    """Return the ends of the 95 % interval of a difference, from those of both thresholds [decades].

    By the method of variance estimates recovery (Zou & Donner 2008, Stat. Med. 27, 1693–1702).
    """
    (low, high), (other_low, other_high) = first.interval, second.interval
    middle = second.threshold - first.threshold
    below = math.hypot(second.threshold - other_low, high - first.threshold)
    return middle - below, middle + math.hypot(other_high - second.threshold, first.threshold - low)


def fitted(own: pd.DataFrame, correct: np.ndarray, stimulus: Stimulus, grid: Grid) -> Posterior:
    """Return the posterior of answers, without a preference for an interval or for the previous answer."""
    towards = np.where(own["target"] == 0, 1.0, -1.0)
    rows = pd.DataFrame({"level": own["stimulus"], "success": correct, "towards": towards})
    before = np.concatenate(([0.0], np.where(correct, towards, -towards)[:-1]))
    rows = rows.assign(level_delivered=rows["level"], before=before)
    return given_by(stimulus, rows).fit(grid, two_intervals=True).flat.with_widths(grid.prior[0, :, 0, 0])


def pairs(trials: pd.DataFrame, size: int, draw: np.random.Generator | None = None) -> Iterator[Pair]:
    """Yield the pairs of consecutive fits to so many trials each; with ``draw`` answers are redrawn."""
    for _, own in trials.groupby(["study", "observer", "condition"]):
        levels = own["stimulus"].to_numpy(dtype=float)
        correct = (own["target"] == own["response"]).to_numpy()
        stimulus = Stimulus(vary="damping_nspm", levels=(levels.min(), levels.max()), standards=(1.0,))
        grid = analysis_grid(stimulus, DESIGN, assumed_for(stimulus, DESIGN))
        if draw is not None:
            correct = draw.random(len(levels)) < fitted(own, correct, stimulus, grid).success(np.log10(levels))
        pieces = [slice(first, first + size) for first in range(0, len(levels) - size + 1, size)]
        fits = [fitted(own.iloc[piece], correct[piece], stimulus, grid) for piece in pieces]
        alone = [replace(one, grid=replace(grid, session_sd=(0.0, 0.0))) for one in fits]
        for place in range(len(fits) - 1):
            low, high = difference(*fits[place : place + 2])
            ends, (one, other) = difference(*alone[place : place + 2]), alone[place : place + 2]
            yield Pair(
                low <= 0 <= high, high - low, ends[1] - ends[0],
                other.threshold - one.threshold, one.variance + other.variance,
            )  # fmt: skip


def spread(found: list[Pair]) -> tuple[float, float, float]:
    """Return the spread between pieces, and the ends of its 95 % interval [decades], by likelihood."""
    differences, variances = np.array([one.difference for one in found]), np.array([one.variance for one in found])
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
    repetitions, draw, failed = int(arguments[0]) if arguments else 10, np.random.default_rng(1), False
    print("data                       pairs  held %  [Wilson]       stationary %  times as wide")
    for name in (*STUDIES, JUDGED):
        chosen = trials[[study in name for study in trials["study"]]]
        people = list(pairs(chosen, PIECE))
        control = [one for _ in range(repetitions) for one in pairs(chosen, PIECE, draw)]
        share, still = (float(np.mean([one.holds for one in found])) for found in (people, control))
        low, high = interval(share, len(people))
        wider = sum(one.width for one in control) / sum(one.narrow for one in control)
        failed |= name == JUDGED and (share < 0.9 or low < 0.8 or not 0.93 <= still <= 0.99 or wider > 1.5)
        print(
            f"{name:25s}{len(people):7d}{100 * share:8.1f}  [{100 * low:.1f}, {100 * high:.1f}]"
            f"{100 * still:14.1f}{wider:15.2f}"
        )
    return 3 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
