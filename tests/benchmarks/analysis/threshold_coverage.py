"""Coverage and error of thresholds: 1,000 simulated observers whose levels QUEST+ chose, at 40, 80 and 160 trials.

Run it by itself: ``python tests/benchmarks/analysis/threshold_coverage.py [OBSERVERS] [SEED]``. The observers answer
two-interval forced choice with d′ proportional to the level, lapse in 2 % of trials, and differ by a factor of 1.2.
Exit code 3 if the coverage of a 95 % interval is not within 93 to 99 %, or the mean error is above 5 %.
"""

import math
import sys
import time
from statistics import NormalDist

import numpy as np

from study_app.protocol.trials.designs import default_design
from study_app.protocol.trials.stimuli import LAPSES, Stimulus, analysis_grid, assumed_for, running_grid
from study_app.psychophysics.adaptive import Search
from study_app.psychophysics.grid import fit

TRIALS = (40, 80, 160)
STIMULUS = Stimulus(vary="damping_nspm", levels=(0.02, 0.6), standards=(8.0,))
DESIGN = default_design("2ifc")
MEDIAN_75 = 0.2
BETWEEN = 1.2
LAPSE = 0.02
COVERAGE = (0.93, 0.99)
MOST_ERROR = 0.05


def proportion(level: float, level_75: float) -> float:
    """Return P(correct) of an observer who compares ln(1 + level) with normal noise."""
    z_75 = NormalDist().inv_cdf(0.75)
    right = NormalDist().cdf(z_75 * math.log1p(level) / math.log1p(level_75))
    return LAPSE / 2 + (1 - LAPSE) * right


def main(observers: str = "1000", seed: str = "1") -> int:
    """Print a row for each number of trials; return the exit code."""
    draw = np.random.default_rng(int(seed))
    assumed = assumed_for(STIMULUS, DESIGN)
    running = running_grid(STIMULUS, DESIGN, assumed, LAPSES)
    analysis = analysis_grid(STIMULUS, DESIGN, assumed)
    levels = STIMULUS.grid
    coordinates = tuple(STIMULUS.coordinate(level) for level in levels)
    search = Search(running, coordinates, "threshold")
    planted = MEDIAN_75 * BETWEEN ** draw.normal(size=int(observers))
    found: dict[int, list[tuple[float, float, float]]] = {trials: [] for trials in TRIALS}
    began = time.process_time()
    fits_s = 0.0
    for level_75 in planted:
        counts = ([0] * len(levels), [0] * len(levels))
        shares = [proportion(level, level_75) for level in levels]
        for trial in range(1, max(TRIALS) + 1):
            at = search.next(*counts)
            counts[0 if draw.random() < shares[at] else 1][at] += 1
            if trial in TRIALS:
                start = time.process_time()
                one = fit(coordinates, *counts, analysis)
                fits_s += time.process_time() - start
                found[trial].append((one.threshold, *one.interval))
    truth = np.log10(planted)
    print(f"{len(planted)} observers, 2IFC, 75 % at {MEDIAN_75} (factor {BETWEEN}), QUEST+, seed {seed}")
    print("trials  coverage %   mean error %   SD of one %")
    failed = False
    for trials, ones in found.items():
        threshold, low, high = np.array(ones).T
        coverage = float(((low <= truth) & (truth <= high)).mean())
        error = 10 ** float((threshold - truth).mean()) - 1
        spread = 10 ** float((threshold - truth).std(ddof=1)) - 1
        failed |= not (COVERAGE[0] <= coverage <= COVERAGE[1]) or abs(error) > MOST_ERROR
        print(f"{trials:6d} {100 * coverage:11.1f} {100 * error:+14.1f} {100 * spread:13.0f}")
    fits = len(planted) * len(TRIALS)
    print(
        f"{time.process_time() - began:.0f} s of the processor, {1000 * fits_s / fits:.1f} ms for each of {fits} fits"
    )
    return 3 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
