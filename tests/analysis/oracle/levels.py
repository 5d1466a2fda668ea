"""Recompute the blocks of levels of a report: answers, sensitivity, thresholds, exponents, catch trials and delivery."""

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy import stats

from tests.analysis.oracle.fit import Z_95, Fit, random_effects, width_priors
from tests.analysis.oracle.recomputed import SESSION, TRIAL, Compared, Numbers, exact_share, named, quartiles, student

ANSWERS = {"2ifc": ("first", "second"), "yesno": ("yes", "no")}
ORDERS = {"2ifc": ("cs", "sc"), "yesno": ("c", "s")}
TWO_DOWN_ONE_UP = 80.35
"""Percentage to which weighted 2-down-1-up tracks converge (García-Pérez 1998, Vision Research 38, 1861)."""


def compare_levels(compared: Compared, answers: pd.DataFrame, intervals: pd.DataFrame, study: Numbers) -> None:
    """Recompute the numbers of all blocks of levels of a study, given by its file."""
    for number, found in enumerate(compared.results.get("levels", ())):
        place, block = f"results.levels.{number}", study["blocks"][found["block"]]
        stimulus, design, method = (
            study["stimuli"][block["stimulus"]],
            found["design"],
            study["methods"][block["method"]],
        )
        here = [rows[(rows["block"] == found["block"]) & rows["counts"]] for rows in (intervals, answers)]
        rows = _trials(*here, design, stimulus.get("level", "weber"))
        compared.check(place, {"guess_rate": 0.5 if design == "2ifc" else math.nan})
        for which, times in enumerate(found["times"]):
            seconds = rows.loc[rows["code"] == times["code"], "response_s"]
            compared.check(f"{place}.times.{which}.numbers", {"n": len(seconds), **quartiles(seconds)})
        published = [one for one in study["analysis"].get("published", ()) if one["block"] == found["block"]]
        for which, value in enumerate(published):
            compared.check(f"{place}.published.{which}", {name: value[name] for name in ("value", "percent", "n")})
        _delivery(compared, place, rows, block)
        parts, key = {"answers": _answers(rows, design)}, found["block"]
        if design in ANSWERS:
            parts["sensitivities"] = _sensitivities(rows, design)
            percent = published[0]["percent"] if published else None
            fits, parts["thresholds"] = _thresholds(rows, design, stimulus["levels"], percent, method["kind"])
            compared.values[key, "fits"] = fits
            parts["exponents"] = _exponents(parts["thresholds"]) if "standards" not in block else []
        else:
            parts["exponents"] = _exponents(parts["answers"])
        for name, lines in parts.items():
            assert len(lines) == len(found[name]), f"{place}.{name}: {len(found[name])} rows, recomputed {len(lines)}"
            for line, own in enumerate(lines):
                compared.check(f"{place}.{name}.{line}", {k: v for k, v in own.items() if k not in SKIPPED}, 1e-4)
            compared.values[key, name] = pd.DataFrame(line for line in lines if "participant" in line)


SKIPPED = ("participant", "placed", "log_threshold")


def _trials(intervals: pd.DataFrame, answers: pd.DataFrame, design: str, kind: str) -> pd.DataFrame:
    """Return a row a trial: what was presented, what was delivered, and the answer."""
    ordered = intervals.sort_values([*TRIAL, "interval"])
    delivered = ordered.pivot_table(index=TRIAL, columns="presented", values="value_delivered")
    rows = ordered.groupby(TRIAL)[["standard", "level", "catch", "code"]].first()
    rows[["pace_mps", "apparent_mass_kg"]] = ordered.groupby(TRIAL)[["pace_mps", "apparent_mass_kg"]].mean()
    rows["order"] = ordered["presented"].str[0].groupby([ordered[name] for name in TRIAL]).agg("".join)
    rows["comparison"], rows["delivered"] = rows["level"], delivered["comparison"]
    if kind == "weber":
        rows["comparison"] = rows["standard"] * (1 + rows["level"])
        standard = rows["standard"] if design == "yesno" else delivered["standard"]
        rows["delivered"] = delivered["comparison"] / standard - 1
    given = answers.assign(response_s=(answers["first_choice_s"] - answers["onset_s"]).round(6))
    rows = rows.join(given.set_index(TRIAL)[["response", "value", "response_s"]].dropna(subset="response"), how="inner")
    rows = rows.sort_index().reset_index()
    rows["right"] = rows["response"] == rows["order"].map(dict(zip(ORDERS.get(design, ()), ANSWERS.get(design, ()))))
    rows["success"] = rows["response"] == "yes" if design == "yesno" else rows["right"]
    said = rows["response"].map({"first": 1.0, "second": -1.0}).fillna(0.0)
    return rows.assign(before=said.groupby([rows[name] for name in SESSION]).shift(fill_value=0.0))


def _delivery(compared: Compared, place: str, rows: pd.DataFrame, block: Numbers) -> None:
    for number, (standard, own) in enumerate(rows.groupby("standard", dropna=False)):
        errors = (own["delivered"] - own["level"])[own["level"] != 0].dropna()
        found = {"standard": standard, "trials": len(own), "repeated": 0, "measured": len(errors)}
        found |= {"error_mean": errors.mean(), "error_largest": errors.abs().max()}
        compared.check(f"{place}.conduct.{number}", found | dict(own[["pace_mps", "apparent_mass_kg"]].mean()))
    if "catch" in block:
        for number, ((_, session), own) in enumerate(rows[rows["catch"].eq(True)].groupby(SESSION)):
            found = {"session": session, "n": len(own), "wrong": (~own["right"]).sum()}
            compared.check(f"{place}.catches.{number}", found | {"most": block["catch"]["wrong_most"]})


def _answers(rows: pd.DataFrame, design: str) -> list[Numbers]:
    """Return shares, or geometric means without the units that participants chose, at each level: of all, of each."""
    share, lines = design in ANSWERS, []
    rows = rows.assign(number=rows["success"].astype(float) if share else np.log(rows["value"].astype(float)))
    own = rows.groupby(["participant", "level"])["number"].mean().groupby("participant").mean()
    units = 0 * own if share else own - own.mean()
    for (standard, level, _), here in rows.groupby(["standard", "level", "catch"], dropna=False):
        where = {"standard": standard, "level": level, "comparison": here["comparison"].iloc[0]}
        people = here.groupby("participant")["number"]
        means = people.mean() - units.reindex(people.mean().index)
        for person, numbers in (("", means), *people):
            found = {"value": numbers.mean(), **student(numbers)}
            if share:
                counted = here["success"][here["participant"].eq(person) | (person == "")]
                ends = {end: np.clip(found[end], 0, 1) for end in ("low", "high")}
                found |= {"count": counted.sum(), **(exact_share(counted.sum(), len(counted)) if person else ends)}
            else:
                found = {name: math.exp(value) for name, value in found.items()}
            found |= {"n": len(numbers) if person else len(here), "participants": 1 if person else len(means)}
            lines.append(
                found
                | where
                | (
                    {"participant": person, "placed": here.loc[here["participant"] == person, "delivered"].mean()}
                    if person
                    else {}
                )
            )
    return lines


def _sensitivities(rows: pd.DataFrame, design: str) -> list[Numbers]:
    """Return d′ and c of all and of each, from rates with the log-linear correction (Hautus 1995)."""
    lines, (said, _), (signal, noise) = [], ANSWERS[design], ORDERS[design]
    for standard, here in rows.groupby("standard"):
        own = []
        for person, one in here.groupby("participant"):
            sides = [one.loc[one["order"] == order, "response"] == said for order in (signal, noise)]
            rates, n = np.array([(side.sum() + 0.5) / (len(side) + 1) for side in sides]), np.array([*map(len, sides)])
            z, root = stats.norm.ppf(rates), math.sqrt(2 if design == "2ifc" else 1)
            d_prime, reach = (
                (z[0] - z[1]) / root,
                Z_95 * math.sqrt((rates * (1 - rates) / n / stats.norm.pdf(z) ** 2).sum()) / root,
            )
            shares = {answer: (one["response"] == answer).mean() for answer in ANSWERS[design]}
            found = {"d_prime": d_prime, "low": d_prime - reach, "high": d_prime + reach, "criterion": -z.mean()}
            own.append(found | named("shares", shares) | {"n": len(one), "standard": standard})
            own[-1]["participant"] = person
        means = pd.DataFrame(own).drop(columns="participant").mean()
        lines += [{**means, **student(one["d_prime"] for one in own), "n": len(own)}, *own]
    return lines


def _thresholds(
    rows: pd.DataFrame, design: str, ends: Sequence[float], percent: float | None, method: str
) -> tuple[dict[float, dict[str, Fit]], list[Numbers]]:
    """Return the fits by standard and person, and the thresholds of all and of each."""
    fits, lines = {}, []
    for standard, here in rows.groupby("standard"):
        fits[standard] = {person: Fit(own, design, ends) for person, own in here.groupby("participant")}
        priors, shared = width_priors([*fits[standard].values()])
        own = []
        for (person, fit), prior in zip(fits[standard].items(), priors, strict=True):
            own.append(fit.numbers(prior, percent) | {"standard": standard, "participant": person})
            own[-1] |= {"target_percent": TWO_DOWN_ONE_UP} if method == "updown" else {}
        group = {"n": len(own), "standard": standard}
        for name, low, high in (("threshold", "low", "high"), ("compared", "compared_low", "compared_high")):
            if name in own[0]:
                mean, error = random_effects(
                    np.log10([one[name] for one in own]), np.array([one["variance"] for one in own])
                )
                reach = math.hypot(stats.t.ppf(0.975, len(own) - 1) * error, Z_95 * math.sqrt(shared))
                group |= {name: 10**mean, low: 10 ** (mean - reach), high: 10 ** (mean + reach)}
        lines += [group, *own]
    return fits, lines


def _exponents(lines: Sequence[Numbers]) -> list[Numbers]:
    """Return the slopes of ln JND on ln standard, or of mean ln answer on ln level as delivered: of all, of each."""
    own = []
    for person, one in pd.DataFrame(line for line in lines if "participant" in line).groupby("participant"):
        x, y = (
            (one["placed"], one["value"]) if "placed" in one else (one["standard"], one["threshold"] * one["standard"])
        )
        own.append({"exponent": np.polyfit(np.log(x), np.log(y), 1)[0], "n": len(one), "participant": person})
    slopes = [one["exponent"] for one in own]
    return [{"exponent": np.mean(slopes), "n": len(own), **student(slopes)}, *own]
