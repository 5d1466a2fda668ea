"""Coverage and error of thresholds of simulated people, whose levels QUEST+ chose, after 40, 80 and 160 trials.

Run it by itself: ``python tests/benchmarks/analysis/threshold_coverage.py [OBSERVERS] [SEED] [TRIALS …]``. The
observers answer two-interval forced choice and differ by a factor of 1.2. Those that the analysis assumes have a d′
proportional to the level and answer 2 % of trials at random; the others of `KINDS` differ from them in one respect
each; those of `INATTENTIVE` answer more trials at random, or ten in a row, and are also tested with one catch trial
among ten, at three times or ("easy") at ten times the median threshold. A threshold that changes does so over all
trials, and the mean over those that are counted is the true one; ten observers are a group. "Told" is the share of
groups whose interval fails for which the report names clusters of errors, or the threshold for a lapse rate of 9 %;
"bursts" is that of all groups with clusters of errors. Exit code 3 if, after 80 trials, less than 90 % of the groups'
95 % intervals hold, but for chance, the mean error of observers or groups of `KINDS` is above 8 %, less than 80 % of
the groups of `INATTENTIVE` that fail are told, or more than 5 % of the groups as assumed have clusters, but for chance.
The errors of `INATTENTIVE` people are not judged: answers near the threshold say too little about lapses (``--exact``
prints the power of the likelihood ratio of 2 and 16 % at random for the exact function).
"""

import math
import sys
from collections.abc import Iterator
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.special import ndtr

from study_app.analysis.data.blocks import LevelBlock
from study_app.analysis.levels.thresholds import ThresholdEstimate, thresholds
from study_app.analysis.planning.power_curves import interval
from study_app.protocol.trials.designs import default_design
from study_app.protocol.trials.methods import default_method
from study_app.protocol.trials.stimuli import LAPSES, Stimulus
from study_app.psychophysics.adaptive import Search
from study_app.psychophysics.people import KINDS, Person

TRIALS = ("40", "80", "160")
JUDGED = 80
STIMULUS = Stimulus(vary="damping_nspm", levels=(0.02, 0.6), standards=(8.0,))
EASY = Stimulus(vary="damping_nspm", levels=(0.02, 2.0), standards=(8.0,))
DESIGN = default_design("2ifc")
MEDIAN_75 = 0.2
BETWEEN = 1.2
PEOPLE = 10
LEAST_HELD = 0.9
MOST_ERROR = 0.08
LEAST_TOLD = 0.8
MOST_FALSE = 0.05
CATCH_EVERY = 10
INATTENTIVE = {
    "none at random": (Person(lapse=0.0), 0),
    "10 % at random": (Person(lapse=0.1), 0),
    "16 % at random": (Person(lapse=0.16), 0),
    "ten in a row": (Person(), 10),
}
"""People, and how many consecutive trials each answers at random: of two answers half of these are wrong."""


class Case(NamedTuple):
    """Observers, and how they are measured.

    Each answers ``row`` consecutive trials, from a random one on, at random. One of ``every`` trials, at a random
    place, is a catch trial, at the highest level; QUEST+ does not count it.
    """

    person: Person
    row: int = 0
    every: int = 0
    stimulus: Stimulus = STIMULUS

    def search(self) -> Search:
        """Return how QUEST+ chooses levels by default."""
        stimulus = self.stimulus
        coordinates = tuple(stimulus.coordinate(level) for level in stimulus.grid)
        return Search(stimulus.running_grid(DESIGN, stimulus.assumed(DESIGN), LAPSES), coordinates, "threshold")


CASES = {
    **{name: Case(person) for name, person in KINDS.items()},
    **{name: Case(*inattentive) for name, inattentive in INATTENTIVE.items()},
    **{f"{name}, catch": Case(*inattentive, CATCH_EVERY) for name, inattentive in INATTENTIVE.items()},
    **{f"{name}, easy": Case(*inattentive, CATCH_EVERY, EASY) for name, inattentive in INATTENTIVE.items()},
}


def answered(case: Case, planted: np.ndarray, draw: np.random.Generator, trials: int) -> tuple[np.ndarray, ...]:
    """Return the places of the levels presented, whether answers were right, and the first interval was (n, trials)."""
    (person, row, every, stimulus), search = case, case.search()
    begins = draw.integers(0, trials - row + 1, len(planted)) if row else np.full(len(planted), trials)
    catch = np.zeros((len(planted), trials), bool)
    for start in range(0, trials - every + 1, every or trials + 1):
        catch[np.arange(len(planted)), start + draw.integers(0, every or 1, len(planted))] = bool(every)
    psi = search.psi.reshape(len(search.levels), len(search.grid.thresholds), -1)
    posterior = np.tile(search.grid.prior.reshape(1, *psi.shape[1:]), (len(planted), 1, 1))
    places, rights, last = [], [], np.zeros(len(planted))
    firsts = draw.permuted(np.tile((True, False), (len(planted), trials // 2)), axis=1)
    for trial, first in enumerate(firsts.T):
        posterior /= posterior.sum(axis=(1, 2), keepdims=True)
        place = np.where(catch[:, trial], len(search.levels) - 1, search.choose_levels(posterior))
        now = planted * person.relative_threshold(trial / (trials - 1))
        ratio = np.log1p(np.array(stimulus.grid)[place]) / np.log1p(now)
        sensed = NormalDist().inv_cdf(0.75) * ratio ** (1 / person.width)
        towards_first = np.where(first, sensed, -sensed) + person.criterion + person.repeats * last
        lapse = np.where((begins <= trial) & (trial < begins + row), 1.0, person.lapse)
        said_first = draw.random(len(planted)) < lapse / 2 + (1 - lapse) * ndtr(towards_first)
        right, last = said_first == first, np.where(said_first, 1.0, -1.0)
        likelihood = np.where(right[:, None, None], psi[place], 1.0 - psi[place])
        posterior *= np.where(catch[:, trial, None, None], 1.0, likelihood)
        places.append(place)
        rights.append(right)
    return np.array(places).T, np.array(rights).T, firsts


def studies(
    stimulus: Stimulus, places: np.ndarray, rights: np.ndarray, firsts: np.ndarray
) -> Iterator[tuple[ThresholdEstimate, ...]]:
    """Yield the report's estimates of each `PEOPLE` observers, the group first."""
    block = LevelBlock("b", "b", "main", DESIGN, stimulus, (), default_method("questplus"))
    for start in range(0, len(places), PEOPLE):
        own = slice(start, start + PEOPLE)
        shape = places[own].shape
        levels = np.array(stimulus.grid)[places[own]].ravel()
        frame = pd.DataFrame({"level": levels, "level_delivered": levels, "success": rights[own].ravel()})
        frame["arrangement"] = np.where(firsts[own].ravel(), "CS", "SC")
        frame["participant"], frame["trial"] = (indices.ravel() for indices in np.indices(shape))
        frame = frame.astype({"level_delivered": "Float64", "success": "boolean"})
        yield tuple(thresholds(block, frame.assign(block="b", standard=8.0, session=1, analysed=True, track="8/1")))


def power_of_exact_ratio(observers: int, seed: int) -> float:
    """Return how often groups answering 16 % at random exceed 95 % of those answering 2 %, by the likelihood ratio.

    It knows the observers' functions and how they differ; the mean threshold is free.
    """
    thresholds, levels = np.linspace(math.log10(0.04), 0.0, 121), np.log1p(STIMULUS.grid)
    sensed = ndtr(NormalDist().inv_cdf(0.75) * levels / np.log1p(10**thresholds)[:, None])
    about = np.exp(-0.5 * ((thresholds - thresholds[::2, None]) / math.log10(BETWEEN)) ** 2)
    ratios = []
    for person in (KINDS["as assumed"], INATTENTIVE["16 % at random"][0]):
        draw = np.random.default_rng(seed)
        planted = MEDIAN_75 * BETWEEN ** draw.normal(size=observers)
        places, rights, _ = answered(Case(person), planted, draw, JUDGED)
        right, wrong = (
            np.array([np.bincount(*cells, len(levels)) for cells in zip(places, some, strict=True)])
            for some in (rights, ~rights)
        )
        evidence = []
        for lapse in (0.02, 0.16):
            psi = lapse / 2 + (1 - lapse) * sensed
            of_people = np.log(np.exp(right @ np.log(psi).T + wrong @ np.log1p(-psi).T) @ about.T)
            evidence.append(np.logaddexp.reduce(of_people.reshape(-1, PEOPLE, len(about)).sum(axis=1), axis=1))
        ratios.append(evidence[1] - evidence[0])
    return float((ratios[1] > np.quantile(ratios[0], 0.95)).mean())


def main(observers: str = "1000", seed: str = "1", *stops: str) -> int:
    """Print a row for each kind and number of trials; return the exit code."""
    if stops == ("--exact",):
        print(f"power {100 * power_of_exact_ratio(int(observers), int(seed)):.1f} % where 5 % are false, seed {seed}")
        return 0
    numbers, failed = [int(number) for number in stops or TRIALS], False
    print(f"{observers} observers, 2IFC, 75 % at {MEDIAN_75} (factor {BETWEEN}), QUEST+, seed {seed}")
    print(
        "                   trials  held %   error %    SD %   groups held % [Wilson]  error %  half interval %"
        "  clusters, told of failing  clusters %"
    )
    for name, case in CASES.items():
        draw = np.random.default_rng(int(seed))
        planted = MEDIAN_75 * BETWEEN ** draw.normal(size=int(observers))
        presented = answered(case, planted, draw, max(numbers))
        for trials in numbers:
            moved = (
                math.log10(case.person.change) * ((trials - 1) / (max(numbers) - 1) - 1) / 2
            )  # the mean of these trials
            truth, true_mean = np.log10(planted) + moved, math.log10(MEDIAN_75) + moved
            group_fits = list(studies(case.stimulus, *(values[:, :trials] for values in presented)))
            threshold, low, high = np.log10(
                [(fit.threshold, fit.low, fit.high) for _, *own in group_fits for fit in own]
            ).T
            ends = np.log10([(group.low, group.high) for group, *_ in group_fits])
            held, error = float(((low <= truth) & (truth <= high)).mean()), 10 ** float((threshold - truth).mean()) - 1
            of_all = np.log10([group.threshold for group, *_ in group_fits]) - truth.reshape(-1, PEOPLE).mean(axis=1)
            error_of_groups = 10 ** float(of_all.mean()) - 1
            spread = 10 ** float((threshold - truth).std(ddof=1)) - 1
            holds = (ends[:, 0] <= true_mean) & (true_mean <= ends[:, 1])
            clusters = np.array([group.clustered for group, *_ in group_fits])
            warned = clusters | [group.if_many_lapses is not None for group, *_ in group_fits]
            of_groups = float(holds.mean())
            least, most = interval(of_groups, len(ends))
            half = 10 ** float(np.median(np.diff(ends, axis=1)) / 2) - 1
            if trials == JUDGED:
                failed |= most < LEAST_HELD
                failed |= name in KINDS and max(abs(error), abs(error_of_groups)) > MOST_ERROR
                missed = warned[~holds]
                if name in INATTENTIVE and len(missed):
                    failed |= interval(float(missed.mean()), len(missed))[1] < LEAST_TOLD
                failed |= name == "as assumed" and interval(float(clusters.mean()), len(clusters))[0] > MOST_FALSE
            print(
                f"{name:21s}{trials:4d}{100 * held:8.1f}{100 * error:+10.1f}{100 * spread:8.0f}"
                f"{100 * of_groups:16.1f} [{100 * least:.1f}, {100 * most:.1f}]"
                f"{100 * error_of_groups:+9.1f}{100 * half:12.0f}"
                f"{clusters[~holds].sum():10d}, {warned[~holds].sum()} of {(~holds).sum()}"
                f"{100 * clusters.mean():17.1f}",
                flush=True,
            )
    return 3 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
