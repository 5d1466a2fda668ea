"""Recompute who took part, orders, what was delivered, motion and force, other questions, and captions of figures."""

import math
import re
from itertools import groupby, pairwise
from typing import Any

import numpy as np
import pandas as pd

from tests.analysis.oracle.recomputed import SESSION, TRIAL, Compared, Numbers, named, numbered, quartiles, read_csv

SMALL = "zero one two three four five six seven eight nine ten eleven twelve".split()  # noqa: SIM905


def compare_conduct(compared: Compared, answers: pd.DataFrame, trials: pd.DataFrame) -> None:
    """Recompute everything of a report that is about sessions, trials and forms."""
    sessions = trials.groupby(SESSION)[["here", "excluded_session"]].any()
    left_out = (~sessions["here"] & ~sessions["excluded_session"]).sum()
    own = {"participants": trials[trials["here"]]["participant"].nunique(), "sessions": len(sessions)}
    compared.check(
        "study", own | {"sessions_left_out": left_out, "sessions_excluded": sessions["excluded_session"].sum()}
    )
    for number, (_, session) in enumerate(sessions.index):
        compared.check(f"sessions.{number}", {"session": session})
    counting, number = trials[trials["counts"]], 0
    for block in compared.codebook["blocks"]:
        main = trials[trials["here"] & (trials["phase"] == "main") & (trials["block"] == block["id"])]
        main = main.drop_duplicates(TRIAL, keep="last").sort_values([*SESSION, "index"])
        orders = [list(rows["code"]) for _, rows in main.groupby(SESSION)]
        compared.check(
            f"results.orders.{block['id']}", _orders(sorted(one["code"] for one in block["settings"]), orders)
        )
        for setting in block["settings"]:
            rows = counting[(counting["block"] == block["id"]) & (counting["code"] == setting["code"])]
            errors = rows["delay_error_mean_ms"].dropna().to_numpy(float)
            own = _validity(rows) | {"delay_ms": setting["delay_ms"], "measured": len(errors)}
            if len(errors):
                own |= {"error_mean_ms": errors.mean(), "error_worst_ms": errors[np.abs(errors).argmax()]}
                own |= {"achieved_ms": setting["delay_ms"] + errors.mean()}
            compared.check(f"results.delivered.{number}", own)
            number += 1
    _motion(compared, counting)
    for name, recompute in (("questions", _question), ("scores", _score)):
        for number, asked in enumerate(compared.results.get(name, ())):
            is_form = asked.get("is_form", True)
            rows = answers[answers["counts"] & (answers["form" if is_form else "block"] == asked["where"])]
            places = rows["after_block"].fillna("0") if is_form else rows["code"]
            for place, group in enumerate(asked["groups"]):
                own = recompute(
                    asked, rows if group["code"] is None else rows[places == group["code"]], group["numbers"]
                )
                compared.check(f"results.{name}.{number}.groups.{place}.numbers", own)


def _orders(codes: list[str], orders: list[list[str]]) -> Numbers:
    """Count how often each setting came at each position, and after each other one."""
    own: Numbers = {"orders": len(orders)}
    for position in range(max(map(len, orders))):
        at = [order[position] for order in orders if len(order) > position]
        own |= numbered(f"positions.{position}", map(at.count, codes))
    steps = [pair for order in orders for pair in pairwise(order)]
    for number, first in enumerate(codes):
        own |= numbered(f"follows.{number}", [steps.count((first, then)) for then in codes])
    own["longest_run"] = max(len(list(run)) for order in orders for _, run in groupby(order))
    places = [[at for at, shown in enumerate(order) if shown == code] for order in orders for code in codes]
    return own | {"shortest_distance": min((b - a for each in places for a, b in pairwise(each)), default=math.nan)}


def _validity(rows: pd.DataFrame) -> Numbers:
    return {"trials": len(rows), "judged": rows["valid"].notna().sum(), "valid": rows["valid"].eq(True).sum()}


def _motion(compared: Compared, counting: pd.DataFrame) -> None:
    """Recompute quartiles over participants of their medians, in report.json and in motion.csv."""
    judged = {"judged": counting["valid"].notna().sum(), "invalid": counting["valid"].eq(False).sum()}
    compared.check("results.performance", judged)
    measured = counting.assign(path_m=counting["path_length_m"])
    measured["at_limit_percent"] = 100 * counting["limiter_norm"] / counting["ticks"].replace(0, np.nan)
    table = read_csv(compared.folder / "motion.csv")
    for number, row in enumerate(compared.results["performance"]["moved"]):
        rows = measured[(measured["block"] == row["block"]) & (measured["code"] == row["code"])]
        medians = rows.groupby("participant")[row["measure"]].median().dropna()
        own = {"n": len(medians), **quartiles(medians)}
        compared.check(f"results.performance.moved.{number}", own)
        for name, value in (own | _validity(rows)).items():
            compared.equal(f"motion.csv {number} {name}", table.loc[number, name], value)


def _question(asked: Numbers, rows: pd.DataFrame, told: Numbers) -> Numbers:
    rows = rows[rows["item"] == asked["item"]]
    given, values, cannot = rows["response"].dropna(), rows["value"].dropna(), rows["cannot_judge"].eq(True).sum()
    own = {"n": len(given), "participants": rows.loc[given.index, "participant"].nunique()}
    own |= {"cannot_judge": cannot, "missing": len(rows) - len(given) - cannot}
    if "counts" in told:
        chosen = [option for response in given.astype(str) for option in response.removesuffix(".0").split()]
        own |= named("counts", {option: chosen.count(option) for option in told["counts"]})
    if "values" in told:
        own |= {"smallest": values.min(), "largest": values.max(), **numbered("values", sorted(values))}
    return own | (quartiles(values) if "median" in told else {})


def _score(asked: Numbers, rows: pd.DataFrame, _told: Numbers) -> Numbers:
    """Return the raw NASA-TLX (mean of six scales), or the System Usability Scale (Brooke 1995)."""
    answers = rows.pivot_table(index=SESSION, columns="item", values="value")
    scores = answers.mean(axis=1)
    if asked["instrument"] == "sus":
        odd, even = ([f"sus{item}" for item in range(first, 11, 2)] for first in (1, 2))
        scores = 2.5 * ((answers[odd] - 1).sum(axis=1) + (5 - answers[even]).sum(axis=1))
    own = {"n": len(scores), "mean": scores.mean(), "sd": scores.std()}
    return own | {"smallest": scores.min(), "largest": scores.max()}


def compare_captions(compared: Compared, trials: pd.DataFrame) -> None:
    """Compare the numbers in the texts of the figures: people, missing answers, errors of the delay, and hits."""
    people, counting = trials[trials["here"]]["participant"].nunique(), trials[trials["counts"]]
    hits = [own for (_, question, *_), own in compared.rows.items() if question == "liquids are recognised"]
    measures = {block["id"]: pd.DataFrame(block["measures"]).sum() for block in compared.results["blocks"]}
    for path in compared.folder.glob("*.txt"):
        errors = counting.loc[counting["block"] == path.stem, "delay_error_mean_ms"]
        sums = measures.get(path.stem.removeprefix("liquids-"), {})
        for pattern, *own in (
            (r"(?:n = |people; |of )(\w+) participants", [people]),
            (r"Cannot judge: (\d+); not answered: (\d+)\.", [sums.get("cannot_judge"), sums.get("missing")]),
            (r"by (\S+) ms on average \(trials: (\S+) to (\S+) ms", [errors.mean(), errors.min(), errors.max()]),
            (r"Right: (\d+); (\S+) would .* p = (\S+)\)", *([one[name] for name in SHOWN] for one in hits)),
        ):
            for told in (found.groups() for found in re.finditer(pattern, path.read_text("utf-8"))):
                if not any(all(map(_is_rounded, told, one)) for one in own):
                    compared.differences.append((path.name, told, own))


SHOWN = ("statistic", "expected", "p")


def _is_rounded(told: str, own: float) -> bool:
    """Return whether a number in words or digits is this one."""
    number = SMALL.index(told) if told in SMALL else float(told.replace("−", "-"))
    return abs(number - own) <= 0.5000001 * 10.0 ** -len(told.partition(".")[2])
