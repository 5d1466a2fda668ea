"""Noise, response bias and spread of slopes of people in published ratings, for ``protocol.participants.raters``.

Run it by itself: ``python tests/benchmarks/analysis/rating_data.py FOLDER``, with the data sets written from R:
``write.csv(lmerTest::TVbo, "TVbo.csv")`` and ``data(chocolates, package = "SensoMineR"); write.csv(sensochoc,
"sensochoc.csv")``. A linear mixed model (REML) of each attribute has random intercepts and slopes of assessors over the
mean rating of the others. Needs statsmodels. Exit code 3 if a value differs from that of the program by 0.01.
"""

import sys
import warnings
from pathlib import Path

import numpy as np
import pandas as pd

from study_app.protocol.participants.raters import CONSISTENT, NOISY, PUBLISHED, TYPICAL

STEPS = 6
"""Of a seven-point scale."""
VALUES = ("noise_sd", "bias_sd", "slope_sd")


def fitted_spreads(
    ratings: pd.DataFrame, assessor: str, product: pd.Series, attribute: str, scale: float
) -> list[float]:
    """Return residual SD, SD of intercepts [points of seven], and SD of slopes as a share of the mean slope."""
    from statsmodels.formula.api import mixedlm

    rows = pd.DataFrame({"who": ratings[assessor], "what": product, "y": ratings[attribute] * STEPS / scale})
    every, own = rows.groupby("what")["y"], rows.groupby(["what", "who"])["y"]
    others = every.transform("sum") - own.transform("sum")
    rows["x"] = others / (every.transform("count") - own.transform("count"))
    rows["x"] -= rows["x"].mean()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # an intercept without variance lies on the boundary
        model = mixedlm("y ~ x", rows, groups="who", re_formula="~x").fit(reml=True)
    spread = np.sqrt(np.diag(model.cov_re))
    return [float(np.sqrt(model.scale)), float(spread[0]), float(spread[1] / model.fe_params["x"])]


def main(folder: str) -> int:
    """Print the values of each attribute and their summary; return the exit code."""
    screens, chocolates = (pd.read_csv(Path(folder) / f"{name}.csv") for name in ("TVbo", "sensochoc"))
    product = screens["TVset"].astype(str) + screens["Picture"].astype(str)
    first = list(screens).index("Coloursaturation")
    panel = np.array(
        [fitted_spreads(screens, "Assessor", product, name, 15) for name in list(screens)[first : first + 15]]
    )
    first = list(chocolates).index("CocoaA")
    names = list(chocolates)[first : first + 14]
    rated = np.array([fitted_spreads(chocolates, "Panelist", chocolates["Product"], name, 10) for name in names])
    for name, row in zip(names, rated, strict=True):
        print(f"{name:12s} {row.round(2)}")
    computed = {CONSISTENT: np.median(panel, axis=0), TYPICAL: np.median(rated, axis=0), NOISY: rated.max(axis=0)}
    differs = False
    for kind, values in computed.items():
        used = [getattr(PUBLISHED[kind], value) for value in VALUES]
        differs |= bool(np.abs(values - used).max() > 0.01)
        print(f"{kind:12s} {dict(zip(VALUES, values.round(3).tolist(), strict=True))}, used: {used}")
    return 3 if differs else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
