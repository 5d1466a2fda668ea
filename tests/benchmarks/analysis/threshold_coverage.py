"""Coverage and error of thresholds of simulated people, whose levels QUEST+ chose, after 40, 80 and 160 trials.

Run it by itself: ``python tests/benchmarks/analysis/threshold_coverage.py [OBSERVERS] [SEED] [TRIALS …]``. The
observers answer two-interval forced choice and differ by a factor of 1.2. Those that the analysis assumes have a d′
proportional to the level and answer 2 % of trials at random; the others of `KINDS` differ from them in one respect
each; those of `INATTENTIVE` answer more trials at random, or ten in a row, and are also tested with one catch trial
among ten. A threshold that changes does so over all trials, and the mean over those that are counted is the true one;
ten observers are a group. Exit code 3 if, after 80 trials, less than 90 % of the groups' 95 % intervals hold, but for
chance, or the mean error of observers or groups of `KINDS` is above 8 %. The errors of `INATTENTIVE` people are not
judged: answers near the threshold say too little about lapses, which intervals include.
"""

import math
import sys
from collections.abc import Iterator
from statistics import NormalDist

import numpy as np
import pandas as pd
from scipy.special import ndtr

from study_app.analysis.data.blocks import LevelBlock
from study_app.analysis.levels.thresholds import ThresholdEstimate, thresholds
from study_app.analysis.planning.power_curves import interval
from study_app.protocol.trials.designs import default_design
from study_app.protocol.trials.methods import default_method
from study_app.protocol.trials.stimuli import LAPSES, Stimulus, assumed_for, running_grid
from study_app.psychophysics.adaptive import Search
from study_app.psychophysics.people import KINDS, Person

TRIALS = ("40", "80", "160")
JUDGED = 80
STIMULUS = Stimulus(vary="damping_nspm", levels=(0.02, 0.6), standards=(8.0,))
DESIGN = default_design("2ifc")
MEDIAN_75 = 0.2
BETWEEN = 1.2
PEOPLE = 10
LEAST_HELD = 0.9
MOST_ERROR = 0.08
CATCH_EVERY = 10
INATTENTIVE = {
    "none at random": (Person(lapse=0.0), 0),
    "10 % at random": (Person(lapse=0.1), 0),
    "16 % at random": (Person(lapse=0.16), 0),
    "ten in a row": (Person(), 10),
}
"""People, and how many consecutive trials each answers at random: of two answers half of these are wrong."""
CASES = {
    **{name: (person, 0, 0) for name, person in KINDS.items()},
    **{name: (person, row, 0) for name, (person, row) in INATTENTIVE.items()},
    **{f"{name}, catch": (person, row, CATCH_EVERY) for name, (person, row) in INATTENTIVE.items()},
}
"""People, how many consecutive trials each answers at random, and how many trials have one catch trial among them."""


def search() -> Search:
    """Return how QUEST+ chooses levels by default."""
    coordinates = tuple(STIMULUS.coordinate(level) for level in STIMULUS.grid)
    return Search(running_grid(STIMULUS, DESIGN, assumed_for(STIMULUS, DESIGN), LAPSES), coordinates, "threshold")


def answered(
    person: Person,
    planted: np.ndarray,
    search: Search,
    draw: np.random.Generator,
    trials: int,
    row: int = 0,
    every: int = 0,
) -> tuple[np.ndarray, ...]:
    """Return the places of the levels presented, whether answers were right, and the first interval was (n, trials).

    Each observer answers ``row`` consecutive trials, from a random one on, at random. One of ``every`` trials, at a
    random place, is a catch trial, at the highest level; QUEST+ does not count it.
    """
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
        place = np.where(catch[:, trial], len(search.levels) - 1, search.next_of(posterior))
        now = planted * person.at(trial / (trials - 1))
        ratio = np.log1p(np.array(STIMULUS.grid)[place]) / np.log1p(now)
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


def studies(places: np.ndarray, rights: np.ndarray, firsts: np.ndarray) -> Iterator[tuple[ThresholdEstimate, ...]]:
    """Yield what the report estimates of each `PEOPLE` observers, of the group first."""
    block = LevelBlock("b", "b", "main", DESIGN, STIMULUS, (), default_method("questplus"))
    for start in range(0, len(places), PEOPLE):
        own = slice(start, start + PEOPLE)
        shape = places[own].shape
        levels = np.array(STIMULUS.grid)[places[own]].ravel()
        frame = pd.DataFrame({"level": levels, "level_delivered": levels, "success": rights[own].ravel()})
        frame["arrangement"] = np.where(firsts[own].ravel(), "CS", "SC")
        frame["participant"], frame["trial"] = (one.ravel() for one in np.indices(shape))
        frame = frame.astype({"level_delivered": "Float64", "success": "boolean"})
        yield tuple(thresholds(block, frame.assign(block="b", standard=8.0, session=1, analysed=True, track="8/1")))


def main(observers: str = "1000", seed: str = "1", *stops: str) -> int:
    """Print a row for each kind and number of trials; return the exit code."""
    numbers, failed = [int(one) for one in stops or TRIALS], False
    print(f"{observers} observers, 2IFC, 75 % at {MEDIAN_75} (factor {BETWEEN}), QUEST+, seed {seed}")
    print("                   trials  held %   error %    SD %   groups held % [Wilson]  error %  half interval %")
    for name, (person, row, every) in CASES.items():
        draw = np.random.default_rng(int(seed))
        planted = MEDIAN_75 * BETWEEN ** draw.normal(size=int(observers))
        presented = answered(person, planted, search(), draw, max(numbers), row, every)
        for trials in numbers:
            moved = math.log10(person.change) * ((trials - 1) / (max(numbers) - 1) - 1) / 2  # the mean of these trials
            truth, true_mean = np.log10(planted) + moved, math.log10(MEDIAN_75) + moved
            found = list(studies(*(one[:, :trials] for one in presented)))
            threshold, low, high = np.log10([(it.threshold, it.low, it.high) for _, *own in found for it in own]).T
            ends = np.log10([(group.low, group.high) for group, *_ in found])
            held, error = float(((low <= truth) & (truth <= high)).mean()), 10 ** float((threshold - truth).mean()) - 1
            of_all = np.log10([group.threshold for group, *_ in found]) - truth.reshape(-1, PEOPLE).mean(axis=1)
            error_of_groups = 10 ** float(of_all.mean()) - 1
            spread = 10 ** float((threshold - truth).std(ddof=1)) - 1
            of_groups = float(((ends[:, 0] <= true_mean) & (true_mean <= ends[:, 1])).mean())
            least, most = interval(of_groups, len(ends))
            half = 10 ** float(np.median(np.diff(ends, axis=1)) / 2) - 1
            if trials == JUDGED:
                failed |= most < LEAST_HELD
                failed |= name in KINDS and max(abs(error), abs(error_of_groups)) > MOST_ERROR
            print(
                f"{name:21s}{trials:4d}{100 * held:8.1f}{100 * error:+10.1f}{100 * spread:8.0f}"
                f"{100 * of_groups:16.1f} [{100 * least:.1f}, {100 * most:.1f}]"
                f"{100 * error_of_groups:+9.1f}{100 * half:12.0f}",
                flush=True,
            )
    return 3 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
