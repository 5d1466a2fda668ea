"""Recompute the blocks of levels of a report: answers, sensitivity, thresholds, exponents, catch trials and delivery."""

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy import stats

from tests.analysis.oracle.fit import Z_95, Fit, random_effects, width_priors
from tests.analysis.oracle.recomputed import SESSION, TRIAL, Compared, Numbers, exact_share, named, quartiles, student

ANSWERS = {"2ifc": {"cs": "first", "sc": "second"}, "yesno": {"c": "yes", "s": "no"}}
"""Correct answers by what the intervals present: the standard (s) or the comparison (c)."""
TARGETS = {"updown": {"target_percent": 80.35}}
"""Percentage to which weighted 2-down-1-up tracks converge (García-Pérez 1998, Vision Research 38, 1861)."""
MEASURED = ["pace_mps", "apparent_mass_kg"]


def compare_levels(compared: Compared, answers: pd.DataFrame, intervals: pd.DataFrame, study: Numbers) -> None:
    """Recompute the numbers of all blocks of levels of a study, given by its file."""
    for number, found in enumerate(compared.results["levels"]):
        place, key, design, block = (
            f"results.levels.{number}",
            found["block"],
            found["design"],
            study["blocks"][found["block"]],
        )
        stimulus, method = study["stimuli"][block["stimulus"]], study["methods"][block["method"]]["kind"]
        here = [rows[(rows["block"] == key) & rows["counts"]] for rows in (intervals, answers)]
        rows = _trials(*here, design, stimulus.get("level", "weber"))
        compared.check(place, {"guess_rate": 0.5 if design == "2ifc" else math.nan})
        for which, times in enumerate(found["times"]):
            seconds = rows.loc[rows["code"] == times["code"], "response_s"]
            compared.check(f"{place}.times.{which}.numbers", {"n": len(seconds), **quartiles(seconds)})
        published = [one for one in study["analysis"].get("published", ()) if one["block"] == key]
        for which, value in enumerate(published):
            compared.check(f"{place}.published.{which}", {name: value[name] for name in ("value", "percent", "n")})
        parts = {"answers": _answers(rows, design), "conduct": _delivery(rows)}
        caught = rows[rows["catch"].eq(True)].groupby(SESSION) if "catch" in block else ()
        wrong = block.get("catch", {}).get("wrong_most")
        parts["catches"] = [
            {"session": session, "n": len(one), "wrong": (~one["right"]).sum(), "most": wrong}
            for (_, session), one in caught
        ]
        if design in ANSWERS:
            fits = compared.values[key, "fits"] = {
                standard: {
                    person: Fit(own, design, stimulus["levels"]) for person, own in of_standard.groupby("participant")
                }
                for standard, of_standard in rows.groupby("standard")
            }
            parts["sensitivities"] = _sensitivities(rows, design)
            parts["thresholds"] = _thresholds(
                fits, published[0]["percent"] if published else None, TARGETS.get(method, {})
            )
        parts["exponents"] = _exponents(parts.get("thresholds", parts["answers"]))
        for name, lines in parts.items():
            assert len(lines) == len(found[name]), f"{place}.{name}: {len(found[name])} rows, recomputed {len(lines)}"
            for line, own in enumerate(lines):
                compared.check(f"{place}.{name}.{line}", own, 1e-4)
            compared.values[key, name] = pd.DataFrame(line for line in lines if "_person" in line)


def _trials(intervals: pd.DataFrame, answers: pd.DataFrame, design: str, kind: str) -> pd.DataFrame:
    """Return a row a trial: what was presented, what was delivered, and the answer."""
    ordered = intervals.sort_values([*TRIAL, "interval"])
    delivered = ordered.pivot_table(index=TRIAL, columns="presented", values="value_delivered")
    rows = ordered.groupby(TRIAL)[["standard", "level", "catch", "code"]].first()
    rows[MEASURED] = ordered.groupby(TRIAL)[MEASURED].mean()
    rows["order"] = ordered["presented"].str[0].groupby([ordered[name] for name in TRIAL]).agg("".join)
    rows["comparison"], rows["delivered"] = rows["level"], delivered["comparison"]
    if kind == "weber":
        standard = rows["standard"] if design == "yesno" else delivered["standard"]
        rows["comparison"], rows["delivered"] = rows["standard"] * (1 + rows["level"]), rows["delivered"] / standard - 1
    given = answers.assign(response_s=(answers["first_choice_s"] - answers["onset_s"]).round(6)).set_index(TRIAL)
    rows = rows.join(given[["response", "value", "response_s"]], how="inner").dropna(subset="response")
    rows = rows.sort_index().reset_index()
    rows["right"] = rows["response"] == rows["order"].map(ANSWERS.get(design, {}))
    rows["success"] = rows["response"] == "yes" if design == "yesno" else rows["right"]
    said = rows["response"].map({"first": 1.0, "second": -1.0}).fillna(0.0)
    return rows.assign(before=said.groupby([rows[name] for name in SESSION]).shift(fill_value=0.0))


def _delivery(rows: pd.DataFrame) -> list[Numbers]:
    lines = []
    for standard, own in rows.groupby("standard", dropna=False):
        errors = (own["delivered"] - own["level"])[own["level"] != 0].dropna()
        found = {"standard": standard, "trials": len(own), "repeated": 0, "measured": len(errors)}
        found |= {"error_mean": errors.mean(), "error_largest": errors.abs().max()}
        lines.append(found | dict(own[MEASURED].mean()))
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
        own[0] |= {end: np.clip(own[0][end], 0, 1) for end in ("low", "high")} if is_share else {}
        own[0] |= {"count": here["success"].sum()} if is_share else {}
        for person, one in people:
            own.append(where | {"n": len(one), "participants": 1, "value": one["number"].mean(), "_person": person})
            count, hidden = one["success"].sum(), {"_delivered": one["delivered"].mean()}
            own[-1] |= {"count": count, **exact_share(count, len(one))} if is_share else student(one["number"]) | hidden
        for line in own if not is_share else ():
            line |= {name: math.exp(line[name]) for name in ("value", "low", "high")}
        lines += own
    return lines


def _sensitivities(rows: pd.DataFrame, design: str) -> list[Numbers]:
    """Return d′ and c of all and of each, from rates with the log-linear correction (Hautus 1995)."""
    (_, said), *_ = ANSWERS[design].items()
    root, lines = math.sqrt(2 if design == "2ifc" else 1), []
    for standard, here in rows.groupby("standard"):
        own = []
        for person, one in here.groupby("participant"):
            sides = [one.loc[one["order"] == order, "response"] == said for order in ANSWERS[design]]
            rates, n = (
                np.array([*map(count, sides)]) for count in (lambda side: (side.sum() + 0.5) / (len(side) + 1), len)
            )
            z = stats.norm.ppf(rates)
            d_prime, reach = (
                (z[0] - z[1]) / root,
                Z_95 * np.sqrt((rates * (1 - rates) / n / stats.norm.pdf(z) ** 2).sum()) / root,
            )
            shares = {answer: (one["response"] == answer).mean() for answer in ANSWERS[design].values()}
            found = {"d_prime": d_prime, "low": d_prime - reach, "high": d_prime + reach, "criterion": -z.mean()}
            own.append(found | named("shares", shares) | {"n": len(one), "standard": standard, "_person": person})
        means = pd.DataFrame(own).drop(columns="_person").mean()
        lines += [{**means, **student(one["d_prime"] for one in own), "n": len(own)}, *own]
    return lines


def _thresholds(fits: dict[float, dict[str, Fit]], percent: float | None, target: Numbers) -> list[Numbers]:
    """Return the thresholds of all and of each."""
    lines = []
    for standard, people in fits.items():
        priors, shared = width_priors([*people.values()])
        own = [fit.numbers(prior, percent) for fit, prior in zip(people.values(), priors, strict=True)]
        group = {"n": len(own), "standard": standard}
        for name, low, high in (("threshold", "low", "high"), ("compared", "compared_low", "compared_high")):
            if name in own[0]:
                logs, variances = np.log10([one[name] for one in own]), np.array([one["variance"] for one in own])
                mean, error = random_effects(logs, variances)
                reach = math.hypot(stats.t.ppf(0.975, len(own) - 1) * error, Z_95 * math.sqrt(shared))
                group |= {name: 10**mean, low: 10 ** (mean - reach), high: 10 ** (mean + reach)}
        lines += [
            group,
            *(one | target | {"standard": standard, "_person": who} for who, one in zip(people, own, strict=True)),
        ]
    return lines


def _exponents(lines: Sequence[Numbers]) -> list[Numbers]:
    """Return the slopes of ln JND on ln standard, or of mean ln answer on ln level as delivered: of all, of each."""
    table, own = pd.DataFrame(line for line in lines if "_person" in line), []
    if "threshold" in table:
        table = table.assign(_delivered=table["standard"], value=table["threshold"] * table["standard"])
    for person, one in table.groupby("_person"):
        if len(one) > 1:
            slope = np.polyfit(np.log(one["_delivered"]), np.log(one["value"]), 1)[0]
            own.append({"exponent": slope, "n": len(one), "_person": person})
    slopes = [one["exponent"] for one in own]
    return [{"exponent": np.mean(slopes), "n": len(own), **student(slopes)}, *own] if own else []
