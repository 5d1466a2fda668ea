"""Recompute the hypotheses of a report: t of one number of each participant, Holm, and equivalence as far as by t."""

import math

import numpy as np
import pandas as pd
from scipy import stats

from tests.analysis.oracle.fit import Mean, random_effects, width_priors
from tests.analysis.oracle.recomputed import Compared, Numbers, adjusted, named, read_csv

SIDES = {None: "two-sided", "higher": "greater", "lower": "less"}


def compare_hypotheses(compared: Compared, trials: pd.DataFrame, study: Numbers) -> None:
    """Recompute the hypotheses that the study's file states; p of the bootstrap is taken from the report."""
    told, contrasts = compared.results.get("contrasts", []), study.get("analysis", {}).get("contrasts", [])
    rows = read_csv(compared.folder / "tests.csv").fillna("")
    tested = [_tested(compared, contrast, trials[trials["here"]]) for contrast in contrasts]
    ps = adjusted([max(own["p"], one["p_bootstrap"]) for own, one in zip(tested, told, strict=True)])
    least = adjusted([own["equivalent"] for own in tested if own["equivalent"] is not None])
    for number, (own, p) in enumerate(zip(tested, ps, strict=True)):
        by_t = None if own.pop("equivalent") is None else least.pop(0)
        if by_t is not None and told[number]["p_equivalent"] < by_t - 1e-4:
            compared.differences.append((f"contrasts.{number}.p_equivalent", told[number]["p_equivalent"], by_t))
        own |= {"p_adjusted": p, "members": len(contrasts)}
        compared.check(f"results.contrasts.{number}", own, 1e-4)
        compared.rows[tuple(rows.loc[number, ["block", "question", "item", "comparison"]])] = own


def _tested(compared: Compared, contrast: Numbers, trials: pd.DataFrame) -> Numbers:
    """Return the numbers of a hypothesis; ``equivalent`` is p by t, or of a minority that was not drawn."""
    measure, blocks, groups = contrast["measure"], contrast["blocks"], contrast.get("groups")
    members = trials.groupby("participant")["group"].first()
    members = members[members.isin(groups)] if groups else members
    ratio, conditions = measure == "threshold", contrast.get("conditions", [None, None])
    if ratio and len(blocks) == 2:
        sides = _thresholds_of_two(compared, *blocks)
    else:
        sides = [
            _numbers(compared, *side)
            for side in zip(blocks * (2 // len(blocks)), [measure] * 2, conditions, strict=True)
        ]
    if groups:
        samples = [sides[0][sides[0].index.map(members) == group].dropna() for group in groups]
    else:
        variances = sides[0]["variance"] + sides[1]["variance"]
        samples = [pd.DataFrame({"value": sides[0]["value"] - sides[1]["value"], "variance": variances}).dropna()]
    means, freedom, n = [*map(_mean, samples)], min(map(len, samples)) - 1, sum(map(len, samples))
    mean, error = means[0].mean - sum(one.mean for one in means[1:]), math.hypot(*(one.error for one in means))
    student, scale = stats.t(freedom), math.exp if ratio else float
    sides_of_p = {"greater": student.sf(mean / error), "less": student.cdf(mean / error)}
    p = sides_of_p.get(SIDES[contrast.get("expected")], 2 * min(sides_of_p.values()))
    reach, bound = student.ppf(0.975) * error, contrast.get("bound")
    own = {"n": n, "dropped": len(members) - n, "statistic": mean / error, "p": p, "effect": scale(mean)}
    own |= named("interval", {"low": scale(mean - reach), "high": scale(mean + reach), "level": 0.95})
    if not groups:
        own["higher"] = (samples[0]["value"] > 0).sum()
    if bound is None:
        return own | {"equivalent": None}
    limit = abs(math.log(bound)) if ratio else bound
    minority = 0.2 if (blocks[0], "answers") in compared.values else min(0.2, limit / 6)
    p_t = max(student.sf((mean + limit) / error), student.cdf((mean - limit) / error))
    return own | {"contrast.bound": bound, "equivalent": max(p_t, (1 - minority) ** (freedom + 1))}


def _mean(sample: pd.DataFrame) -> Mean:
    if (sample["variance"] > 0).all():
        return random_effects(sample["value"].to_numpy(), sample["variance"].to_numpy())
    return Mean(sample["value"].mean(), stats.sem(sample["value"]))


def _numbers(compared: Compared, block: str, measure: str, condition: str | None) -> pd.DataFrame:
    """Return each person's number: the mean over standards, or over the conditions of a statement."""
    if (block, measure) in compared.values:
        wide = compared.values[block, measure]
        return pd.DataFrame(
            {"value": wide.mean(axis=1, skipna=False) if condition is None else wide[condition]}
        ).assign(variance=0.0)
    table = {"threshold": "thresholds", "d_prime": "sensitivities", "exponent": "exponents"}[measure]
    rows = compared.values[block, table]
    if measure != "threshold":
        return rows.groupby("participant")[[measure]].mean().set_axis(["value"], axis=1).assign(variance=0.0)
    people = rows.assign(value=np.log(rows["threshold"]), variance=rows["variance"] * math.log(10) ** 2).groupby(
        "participant"
    )
    return pd.DataFrame({"value": people["value"].mean(), "variance": people["variance"].sum() / people.size() ** 2})


def _thresholds_of_two(compared: Compared, *blocks: str) -> list[pd.DataFrame]:
    """Return ln thresholds in two blocks of the same levels, whose fits have their widths in common."""
    fits, lines = [compared.values[block, "fits"] for block in blocks], ([], [])
    for standard, people in fits[0].items():
        pooled = [*people.values(), *fits[1][standard].values()]
        pairs = zip(
            [(0, p) for p in people] + [(1, p) for p in fits[1][standard]], pooled, width_priors(pooled)[0], strict=True
        )
        for (side, person), fit, prior in pairs:
            weights, variance = fit.in_u(prior)
            lines[side].append((person, math.log(10) * fit.medians(weights)[0], math.log(10) ** 2 * variance))
    people = [pd.DataFrame(side, columns=["person", "value", "variance"]).groupby("person") for side in lines]
    return [
        pd.DataFrame({"value": one["value"].mean(), "variance": one["variance"].sum() / one.size() ** 2})
        for one in people
    ]
