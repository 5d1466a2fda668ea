"""Our posterior beside psignifit's, on the same answers and with the same prior.

psignifit's own defaults differ in more than the estimator: it adds overdispersion and has other priors, by which the
lower end of the interval moves by up to a third of the interval.
"""

import math
import warnings
from dataclasses import replace

import numpy as np
import pytest

from study_app.protocol.trials.designs import default_design
from study_app.protocol.trials.stimuli import Family, Stimulus
from study_app.psychophysics.families import success
from study_app.psychophysics.grid import fit

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]
SIGMOIDS = {"weibull": "gumbel", "normal": "norm", "logistic": "logistic"}  # Weibull's logarithm is Gumbel's
LOG = Stimulus(vary="damping_nspm", levels=(0.02, 0.6), standards=(8.0,))
LINEAR = Stimulus(vary="delay_ms", levels=(0, 100), spacing="linear", standards=(50.0,))
LAPSES = ((0.0, 0.01, 0.02, 0.03, 0.05, 0.06), (0.3, 0.3, 0.2, 0.15, 0.05, 0.0))
"""A density that has the weights of the analysis' lapse rates, as a function of the rate."""


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("family", "stimulus", "design", "levels", "each", "planted"),
    [
        ("weibull", LOG, "2ifc", 7, 60, (math.log10(0.2), 1.4, 0.01)),
        ("weibull", LOG, "3ifc", 9, 80, (math.log10(0.12), 1.2, 0.02)),
        ("weibull", LOG, "2ifc", 10, 100, (math.log10(0.16), 1.7, 0.0)),
        ("normal", LINEAR, "2ifc", 8, 50, (45.0, 60.0, 0.02)),
        ("logistic", LINEAR, "4ifc", 10, 60, (50.0, 50.0, 0.01)),
    ],
)
def test_threshold_and_interval_are_those_of_psignifit(
    family: Family, stimulus: Stimulus, design: str, levels: int, each: int, planted: tuple[float, float, float]
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        psignifit = pytest.importorskip("psignifit", reason="psignifit is in the test extra")
    guess = 1 / int(design[0])
    u = np.linspace(*stimulus.domain, levels)
    threshold, width, lapse = planted
    n = np.full(levels, each)
    assert n.sum() >= 300
    right = np.random.default_rng(levels).binomial(n, success(family, u, threshold, width, guess, lapse))
    assumed = replace(stimulus.assumed(default_design(design)), family=family)
    grid = stimulus.analysis_grid(default_design(design), assumed, sessions=math.inf)
    ours = fit(u, right, n - right, grid)
    median, factor = assumed.width_prior
    theirs = psignifit.psignifit(
        np.c_[u, right, n],
        sigmoid=SIGMOIDS[family],
        experiment_type=f"{design[0]}AFC",
        priors={
            "threshold": np.ones_like,
            "width": lambda x: np.exp(-0.5 * (np.log(x / median) / math.log(factor)) ** 2) / x,
            "lambda": lambda x: np.interp(x, *LAPSES),
        },
        bounds={
            "threshold": (grid.thresholds[0], grid.thresholds[-1]),
            "width": (grid.widths[0], grid.widths[-1]),
            "lambda": (0.0, 0.06),
        },
        fixed_parameters={"eta": 1e-4, "gamma": guess},
        grid_steps={"threshold": 60, "width": 50, "lambda": 20, "eta": 1, "gamma": 1},
    )
    mean = theirs.parameter_estimate_mean
    low, high = theirs.confidence_intervals["threshold"]["0.95"]
    assert ours.threshold == pytest.approx(mean["threshold"], abs=0.03 * mean["width"])
    assert ours.interval == pytest.approx((low, high), abs=0.1 * (high - low))
    assert ours.others[0] == pytest.approx(mean["width"], rel=0.05)
