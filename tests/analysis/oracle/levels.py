"""Recompute the blocks of levels of a report, from answers to exponents, and the hypotheses of any study."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from scipy import integrate, optimize, stats

from tests.analysis.oracle.fit import Z_95, Fit, group_priors, random_effects
from tests.analysis.oracle.recomputed import SESSION, TRIAL, Compared, Numbers, exact_share, named, quartiles, student
from tests.analysis.oracle.statements import adjusted

ANSWERS = {"2ifc": {"cs": "first", "sc": "second"}, "yesno": {"c": "yes", "s": "no"}}
"""Correct answers by what the intervals present: the standard (s) or the comparison (c)."""
TABLES = {"d_prime": "sensitivities", "exponent": "exponents"}
MEASURED = ["pace_mps", "apparent_mass_kg"]


def compare_levels(compared: Compared, answers: pd.DataFrame, intervals: pd.DataFrame, study: Numbers) -> None:
    """Recompute the numbers of all blocks of levels from the study file and its tables."""
    for number, level_result in enumerate(compared.results["levels"]):
        place, key, design = f"results.levels.{number}", level_result["block"], level_result["design"]
        block = study["blocks"][key]
        stimulus, wrong = study["stimuli"][block["stimulus"]], block.get("catch", {}).get("wrong_most")
        here = [rows[(rows["block"] == key) & rows["counts"]] for rows in (intervals, answers)]
        rows = _trials(*here, design, stimulus.get("level", "weber"))
        compared.check(place, {"guess_rate": 0.5 if design == "2ifc" else math.nan})
        for which, times in enumerate(level_result["times"]):
            seconds = rows.loc[rows["code"] == times["code"], "response_s"]
            compared.check(f"{place}.times.{which}.numbers", {"n": len(seconds), **quartiles(seconds)})
        parts = {"answers": _answers(rows, design), "conduct": _delivery(rows), "catches": []}
        for (_, session), right in rows[rows["catch"].eq(True)].groupby(SESSION)["right"] if wrong else ():
            parts["catches"].append({"session": session, "n": len(right), "wrong": (~right).sum(), "most": wrong})
        if design in ANSWERS:
            people = rows.groupby(["standard", "participant"])
            fits = compared.values[key, "fits"] = {of: Fit(own, design, stimulus["levels"]) for of, own in people}
            parts |= {"sensitivities": _sensitivities(rows, design), "thresholds": _thresholds(fits)}
        parts["exponents"] = _exponents(parts.get("thresholds", parts["answers"]))
        for name, lines in parts.items():
            assert len(lines) == len(level_result[name]), (
                f"{place}.{name}: {len(level_result[name])} rows, recomputed {len(lines)}"
            )
            for line, own in enumerate(lines):
                compared.check(f"{place}.{name}.{line}", own, 1e-4)
            compared.values[key, name] = pd.DataFrame(line for line in lines if "_person" in line)


def _trials(intervals: pd.DataFrame, answers: pd.DataFrame, design: str, kind: str) -> pd.DataFrame:
    """Return one row per trial: presented level, delivered level, and answer."""
    ordered = intervals.sort_values([*TRIAL, "interval"])
    delivered = ordered.pivot_table(index=TRIAL, columns="presented", values="value_delivered")
    rows = ordered.groupby(TRIAL)[["standard", "level", "catch", "code"]].first()
    rows[MEASURED] = ordered.groupby(TRIAL)[MEASURED].mean()
    rows["order"] = ordered["presented"].str[0].groupby([ordered[name] for name in TRIAL]).agg("".join)
    rows["comparison"], rows["delivered"] = rows["level"], delivered["comparison"]
    if kind == "weber":
        standard = rows["standard"] if design == "yesno" else delivered["standard"]
        rows["comparison"], rows["delivered"] = rows["standard"] * (1 + rows["level"]), rows["delivered"] / standard - 1
    timed_answers = answers.assign(response_s=(answers["first_choice_s"] - answers["onset_s"]).round(6)).set_index(
        TRIAL
    )
    rows = rows.join(timed_answers[["response", "value", "response_s"]], how="inner").dropna(subset="response")
    rows = rows.sort_index().reset_index()
    rows["right"] = rows["response"] == rows["order"].map(ANSWERS.get(design, {}))
    rows["success"] = rows["response"] == "yes" if design == "yesno" else rows["right"]
    signs = rows["response"].map({"first": 1.0, "second": -1.0}).fillna(0.0)
    return rows.assign(before=signs.groupby([rows[name] for name in SESSION]).shift(fill_value=0.0))


def _delivery(rows: pd.DataFrame) -> list[Numbers]:
    lines = []
    for standard, own in rows.groupby("standard", dropna=False):
        errors = (own["delivered"] - own["level"])[own["level"] != 0].dropna()
        delivery = {"standard": standard, "trials": len(own), "repeated": 0, "measured": len(errors)}
        lines.append(
            delivery | {"error_mean": errors.mean(), "error_largest": errors.abs().max(), **own[MEASURED].mean()}
        )
    return lines


def _answers(rows: pd.DataFrame, design: str) -> list[Numbers]:
    """Return shares, or geometric means without the units that participants chose, at each level: of all, of each."""
    is_share, lines = design in ANSWERS, []
    rows = rows.assign(number=rows["success"].astype(float) if is_share else np.log(rows["value"].astype(float)))
    units = rows.groupby(["participant", "level"])["number"].mean().groupby("participant").mean()
    units = 0 * units if is_share else units - units.mean()
    for (standard, level, _), here in rows.groupby(["standard", "level", "catch"], dropna=False):
        where = {"standard": standard, "level": level, "comparison": here["comparison"].iloc[0]}
        people = here.groupby("participant")
        means = people["number"].mean() - units[people["number"].mean().index]
        own = [where | {"n": len(here), "participants": len(people), "value": means.mean(), **student(means)}]
        ends = {end: np.clip(own[0][end], 0, 1) for end in ("low", "high")}
        own[0] |= ends | {"count": here["success"].sum()} if is_share else {}
        for person, person_rows in people:
            own.append(
                where
                | {"n": len(person_rows), "participants": 1, "value": person_rows["number"].mean(), "_person": person}
            )
            count, hidden = person_rows["success"].sum(), {"_delivered": person_rows["delivered"].mean()}
            own[-1] |= (
                {"count": count, **exact_share(count, len(person_rows))}
                if is_share
                else student(person_rows["number"]) | hidden
            )
        for line in own if not is_share else ():
            line |= {name: math.exp(line[name]) for name in ("value", "low", "high")}
        lines += own
    return lines


def _sensitivities(rows: pd.DataFrame, design: str) -> list[Numbers]:
    """Return d′ and c of all and of each, from rates with the log-linear correction (Hautus 1995)."""
    (_, second_answer), *_ = ANSWERS[design].items()
    root, lines = math.sqrt(2 if design == "2ifc" else 1), []
    for standard, here in rows.groupby("standard"):
        own = []
        for person, person_rows in here.groupby("participant"):
            sides = [
                person_rows.loc[person_rows["order"] == order, "response"] == second_answer for order in ANSWERS[design]
            ]
            n = np.array([*map(len, sides)])
            rates = (np.array([*map(sum, sides)]) + 0.5) / (n + 1)
            z = stats.norm.ppf(rates)
            variance, d_prime = (rates * (1 - rates) / n / stats.norm.pdf(z) ** 2).sum(), (z[0] - z[1]) / root
            reach = Z_95 * math.sqrt(variance) / root
            shares = {answer: (person_rows["response"] == answer).mean() for answer in ANSWERS[design].values()}
            mean_row = {"d_prime": d_prime, "low": d_prime - reach, "high": d_prime + reach, "criterion": -z.mean()}
            own.append(
                mean_row | named("shares", shares) | {"n": len(person_rows), "standard": standard, "_person": person}
            )
        means = pd.DataFrame(own).drop(columns="_person").mean()
        lines += [{**means, **student(row["d_prime"] for row in own), "n": len(own)}, *own]
    return lines


def _thresholds(fits: dict[tuple[float, str], Fit]) -> list[Numbers]:
    lines = []
    for standard in dict.fromkeys(standard for standard, _ in fits):
        people = {person: fit for (at, person), fit in fits.items() if at == standard}
        priors, ends = group_priors([*people.values()])
        own = [fit.numbers(prior) | {"standard": standard} for fit, prior in zip(people.values(), priors, strict=True)]
        table = pd.DataFrame(own)
        mean, error = random_effects(table.assign(value=np.log10(table["threshold"])))
        low, high = np.hypot(stats.t.ppf(0.975, len(own) - 1) * error, ends)
        score, information = table["_early"].sum()
        group = {"threshold": 10**mean, "low": 10 ** (mean - low), "high": 10 ** (mean + high), "standard": standard}
        lines += [group | {"n": len(own), "early_change": score / math.sqrt(information)}]
        lines += [estimate | {"_person": person} for person, estimate in zip(people, own, strict=True)]
    return lines


def _exponents(lines: Sequence[Numbers]) -> list[Numbers]:
    """Return the slopes of ln JND on ln standard, or of mean ln answer on ln level as delivered: of all, of each."""
    table, own = pd.DataFrame(line for line in lines if "_person" in line), []
    if "threshold" in table:
        table = table.assign(_delivered=table["standard"], value=table["threshold"] * table["standard"])
    for person, person_rows in table.groupby("_person"):
        if len(person_rows) > 1:
            slope = np.polyfit(np.log(person_rows["_delivered"]), np.log(person_rows["value"]), 1)[0]
            own.append({"exponent": slope, "n": len(person_rows), "_person": person})
    slopes = [row["exponent"] for row in own]
    return [{"exponent": np.mean(slopes), "n": len(own), **student(slopes)}, *own] if own else []


def compare_hypotheses(compared: Compared, trials: pd.DataFrame, study: Numbers) -> None:
    """Recompute the stated hypotheses; p of the bootstrap and p for skewness are taken from the report."""
    reported, contrasts = compared.results.get("contrasts", []), study["analysis"].get("contrasts", [])
    rows = compared.tests()
    tested = [_tested(compared, contrast, trials[trials["here"]]) for contrast in contrasts]
    others = [max(test["p_bootstrap"], test["p_skewed"]) for test in reported]
    ps = adjusted([max(own["p"], p) for own, p in zip(tested, others, strict=True)])
    for number, (own, p) in enumerate(zip(tested, ps, strict=True)):
        own.update(p_adjusted=p, members=len(contrasts), **_limits(contrasts, number, study["analysis"]))
        compared.check(f"results.contrasts.{number}", own, 1e-4)
        compared.rows[tuple(rows.loc[number, ["block", "question", "item", "comparison"]])] = own


def _limits(contrasts: Sequence[Numbers], number: int, analysis: Numbers) -> Numbers:
    """Return the largest individual difference, and the sample size that includes one of each relevant minority."""
    contrast, bounds = contrasts[number], sum("bound" in contrast for contrast in contrasts)
    is_statement = contrast["measure"] not in ("threshold", "exponent", "d_prime", "pse") and "form" not in contrast
    limits = {"largest": 6} if is_statement else {}
    if "bound" in contrast:
        minority = min(0.2, contrast["bound"] / 6) if is_statement else 0.2
        people = 1
        while (1 - minority) ** people > analysis.get("alpha", 0.05) / bounds:
            people += 1
        limits["fewest"] = people
    return limits


def _tested(compared: Compared, contrast: Numbers, trials: pd.DataFrame) -> Numbers:
    groups, ratio = contrast.get("groups"), contrast["measure"] == "threshold"
    members = trials.groupby("participant")["group"].first()
    members = members[members.isin(groups)] if groups else members
    sides = (_in_ln if ratio else _numbers)(compared, contrast)
    if groups:
        samples = [sides[0][sides[0].index.map(members) == group].dropna() for group in groups]
    else:
        variance = sides[0]["variance"] + sides[1]["variance"]
        samples = [pd.DataFrame({"value": sides[0]["value"] - sides[1]["value"], "variance": variance}).dropna()]
    mean_of = random_effects if ratio else lambda sample: (sample["value"].mean(), stats.sem(sample["value"]))
    means, errors = zip(*map(mean_of, samples), strict=True)
    mean, error, freedom = means[0] - sum(means[1:]), math.hypot(*errors), min(map(len, samples)) - 1
    t, scale = stats.t(freedom), math.exp if ratio else float
    above, below, reach = t.sf(mean / error), t.cdf(mean / error), t.ppf(0.975) * error
    p = {"higher": above, "lower": below}.get(contrast.get("expected", ""), 2 * min(above, below))
    n = sum(map(len, samples))
    own = {"n": n, "dropped": len(members) - n, "statistic": mean / error, "p": p, "effect": scale(mean)}
    own |= {"standard_error": error, "freedom": freedom}
    own |= named("interval", {"low": scale(mean - reach), "high": scale(mean + reach), "level": 0.95})
    if not groups:
        own |= {"higher": (samples[0]["value"] > 0).sum(), "sd": samples[0]["value"].std()}
    compared_samples = samples if groups else [side.loc[samples[0].index] for side in sides]
    for number, (middle, spread) in enumerate(map(mean_of, compared_samples)):
        values, reach = (
            compared_samples[number]["value"],
            stats.t.ppf(0.975, len(compared_samples[number]) - 1) * spread,
        )
        side = {"mean": scale(middle), "low": scale(middle - reach), "high": scale(middle + reach), "sd": values.std()}
        people = {str(who): scale(value) for who, value in values.items()}
        side["standard_error"] = spread
        own |= named(f"sides.{number}", side) | named(f"sides.{number}.values", people)
    return own | _standardised([sample["value"].to_numpy() for sample in samples])


def _standardised(samples: Sequence[Any]) -> Numbers:
    """Return d_z or Hedges' g, and the Bayes factor as an integral over effect sizes."""
    n, *m = map(len, samples)
    size, freedom = (n * m[0] / (n + m[0]), n + m[0] - 2) if m else (n, n - 1)
    t = (stats.ttest_ind(*samples) if m else stats.ttest_1samp(*samples, 0)).statistic
    bias = math.exp(math.lgamma(freedom / 2) - math.lgamma((freedom - 1) / 2)) / math.sqrt(freedom / 2) if m else 1.0
    ends = [optimize.brentq(lambda at, p=p: stats.nct.sf(t, freedom, at) - p, t - 9, t + 9) for p in (0.025, 0.975)]
    own = dict(zip(("value", "low", "high"), np.array([t, *ends]) * bias / math.sqrt(size), strict=True)) | {"t": t}
    prior = stats.cauchy(scale=math.sqrt(0.5)).pdf
    over = integrate.quad(lambda d: stats.nct.pdf(t, freedom, d * size**0.5) * prior(d), -8, 8, limit=200, points=(0,))
    return named("standardised", own) | {"bayes_factor": over[0] / stats.t.pdf(t, freedom)}


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


def _in_ln(compared: Compared, contrast: Numbers) -> list[pd.DataFrame]:
    """Return ln thresholds, means over standards, in blocks of the same levels: their widths are in common."""
    fits, lines = [compared.values[block, "fits"] for block in contrast["blocks"]], []
    for standard in {standard for standard, _ in fits[0]}:
        people = [(side, who, fit) for side, own in enumerate(fits) for (at, who), fit in own.items() if at == standard]
        for (side, person, fit), prior in zip(people, group_priors([fit for *_, fit in people])[0], strict=True):
            weights, variance = fit.weights_under(prior)
            lines.append((side, person, math.log(10) * fit.medians(weights)[0], math.log(10) ** 2 * variance))
    table = pd.DataFrame(lines, columns=["side", "person", "value", "variance"]).groupby(["side", "person"])
    means = pd.DataFrame({"value": table["value"].mean(), "variance": table["variance"].sum() / table.size() ** 2})
    return [means.loc[side] for side in range(len(fits))]
