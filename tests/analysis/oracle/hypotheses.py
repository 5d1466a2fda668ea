"""Recompute the hypotheses of a report: t of one number of each participant, Holm, and equivalence as far as by t."""

import math

import numpy as np
import pandas as pd
from scipy import stats

from tests.analysis.oracle.fit import Mean, random_effects, width_priors
from tests.analysis.oracle.recomputed import Compared, Numbers, named, read_csv
from tests.analysis.oracle.statements import adjusted

TABLES = {"d_prime": "sensitivities", "exponent": "exponents"}


def compare_hypotheses(compared: Compared, trials: pd.DataFrame, study: Numbers) -> None:
    """Recompute the hypotheses that the study's file states; p of the bootstrap is taken from the report."""
    told, contrasts = compared.results.get("contrasts", []), study["analysis"].get("contrasts", [])
    rows = read_csv(compared.folder / "tests.csv").astype(object).fillna("")
    tested = [_tested(compared, contrast, trials[trials["here"]]) for contrast in contrasts]
    ps = adjusted([max(own["p"], one["p_bootstrap"]) for own, one in zip(tested, told, strict=True)])
    bounded = [number for number, own in enumerate(tested) if "_equivalent" in own]
    for number, p in zip(bounded, adjusted([tested[number]["_equivalent"] for number in bounded]), strict=True):
        if told[number]["p_equivalent"] < p - 1e-4:
            compared.differences.append((f"contrasts.{number}.p_equivalent", told[number]["p_equivalent"], p))
    for number, (own, p) in enumerate(zip(tested, ps, strict=True)):
        own |= {"p_adjusted": p, "members": len(contrasts)}
        compared.check(f"results.contrasts.{number}", own, 1e-4)
        compared.rows[tuple(rows.loc[number, ["block", "question", "item", "comparison"]])] = own


def _tested(compared: Compared, contrast: Numbers, trials: pd.DataFrame) -> Numbers:
    """Return the numbers of a hypothesis; ``_equivalent`` is p by t, or of a minority that was not drawn."""
    groups, ratio = contrast.get("groups"), contrast["measure"] == "threshold"
    members = trials.groupby("participant")["group"].first()
    members = members[members.isin(groups)] if groups else members
    sides = (_thresholds if ratio else _numbers)(compared, contrast)
    if groups:
        samples = [sides[0][sides[0].index.map(members) == group].dropna() for group in groups]
    else:
        variance = sides[0]["variance"] + sides[1]["variance"]
        samples = [pd.DataFrame({"value": sides[0]["value"] - sides[1]["value"], "variance": variance}).dropna()]
    means, freedom, n = [*map(_mean, samples)], min(map(len, samples)) - 1, sum(map(len, samples))
    mean, error = means[0].mean - sum(one.mean for one in means[1:]), math.hypot(*(one.error for one in means))
    student, scale = stats.t(freedom), math.exp if ratio else float
    above, below, reach = student.sf(mean / error), student.cdf(mean / error), student.ppf(0.975) * error
    p = {"higher": above, "lower": below}.get(contrast.get("expected", ""), 2 * min(above, below))
    own = {"n": n, "dropped": len(members) - n, "statistic": mean / error, "p": p, "effect": scale(mean)}
    own |= named("interval", {"low": scale(mean - reach), "high": scale(mean + reach), "level": 0.95})
    own |= {} if groups else {"higher": (samples[0]["value"] > 0).sum()}
    if (bound := contrast.get("bound")) is not None:
        limit = abs(math.log(bound)) if ratio else bound
        minority = 0.2 if ratio or contrast["measure"] in TABLES else min(0.2, limit / 6)
        p_t = max(student.sf((mean + limit) / error), student.cdf((mean - limit) / error))
        own |= {"contrast.bound": bound, "_equivalent": max(p_t, (1 - minority) ** (freedom + 1))}
    return own


def _mean(sample: pd.DataFrame) -> Mean:
    if (sample["variance"] > 0).all():
        return random_effects(sample["value"].to_numpy(), sample["variance"].to_numpy())
    return Mean(mean=sample["value"].mean(), error=stats.sem(sample["value"]))


def _numbers(compared: Compared, contrast: Numbers) -> list[pd.DataFrame]:
    """Return each person's numbers: means over standards, or over the conditions of a statement."""
    blocks, measure, sides = contrast["blocks"] * (2 // len(contrast["blocks"])), contrast["measure"], []
    for block, condition in zip(blocks, contrast.get("conditions", [None, None]), strict=True):
        if measure in TABLES:
            value = compared.values[block, TABLES[measure]].groupby("_person")[measure].mean()
        else:
            wide = compared.values[block, measure]
            value = wide.mean(axis=1, skipna=False) if condition is None else wide[condition]
        sides.append(pd.DataFrame({"value": value, "variance": 0.0}))
    return sides


def _thresholds(compared: Compared, contrast: Numbers) -> list[pd.DataFrame]:
    """Return ln thresholds, means over standards, in blocks of the same levels: their widths are in common."""
    fits, lines = [compared.values[block, "fits"] for block in contrast["blocks"]], []
    for standard in fits[0]:
        people = [(side, *one) for side, of_block in enumerate(fits) for one in of_block[standard].items()]
        for (side, person, fit), prior in zip(people, width_priors([fit for *_, fit in people])[0], strict=True):
            weights, variance = fit.under(prior)
            lines.append((side, person, math.log(10) * fit.medians(weights)[0], math.log(10) ** 2 * variance))
    table = pd.DataFrame(lines, columns=["side", "person", "value", "variance"]).groupby(["side", "person"])
    means = pd.DataFrame({"value": table["value"].mean(), "variance": table["variance"].sum() / table.size() ** 2})
    return [means.loc[side] for side in range(len(fits))]
