"""Recompute who took part, the orders as run, what was delivered, motion and force, and answers to other questions."""

import math
from itertools import groupby, pairwise
from pathlib import Path

import numpy as np
import pandas as pd

from tests.analysis.oracle.recomputed import SESSION, Compared, Numbers, named, numbered, quartiles, read_csv


def compare_conduct(compared: Compared, answers: pd.DataFrame, trials: pd.DataFrame, study: Path) -> None:
    """Recompute everything of a report that is about sessions, trials and forms."""
    people = trials[trials["here"]]["participant"].unique()
    listed = compared.report["exclusions"]
    whole = {(one["participant"], one["session"]) for one in listed if one["trial"] is None}
    sessions = sorted(set(zip(trials["participant"], trials["session"], strict=True)))
    left = sum(not complete and key not in whole for key, complete in _complete(trials).items())
    own = {"participants": len(people), "sessions": len(sessions), "sessions_left_out": left}
    compared.check("study", own | {"sessions_excluded": len(whole)})
    for number, (_, session) in enumerate(sessions):
        compared.check(f"sessions.{number}", {"session": session})
    blocks = {block["id"]: block for block in compared.codebook["blocks"]}
    for block, found in blocks.items():
        _orders(compared, block, sorted(setting["code"] for setting in found["settings"]), trials)
    counting = trials[trials["counts"]]
    _delivered(compared, blocks, counting)
    _motion(compared, counting)
    if "questions" in compared.results:
        _questions(compared, answers[answers["counts"]])
    _scores(compared, answers[answers["counts"]])


def _complete(trials: pd.DataFrame) -> dict[tuple[str, int], bool]:
    return {key: bool(rows["here"].any()) for key, rows in trials.groupby(SESSION)}  # type: ignore[misc]


def _orders(compared: Compared, block: str, codes: list[str], trials: pd.DataFrame) -> None:
    """Count how often each setting came at each position, and after each other one."""
    main = trials[trials["here"] & (trials["phase"] == "main") & (trials["block"] == block)]
    main = main.drop_duplicates([*SESSION, "trial"], keep="last").sort_values([*SESSION, "index"])
    orders = [list(rows["code"]) for _, rows in main.groupby(SESSION)]
    own: Numbers = {"orders": len(orders)}
    for position in range(max(map(len, orders))):
        at = [order[position] for order in orders if len(order) > position]
        own |= numbered(f"positions.{position}", map(at.count, codes))
    steps = [pair for order in orders for pair in pairwise(order)]
    for number, first in enumerate(codes):
        own |= numbered(f"follows.{number}", [steps.count((first, then)) for then in codes])
    own["longest_run"] = max(len(list(run)) for order in orders for _, run in groupby(order))
    apart = [here - before for order in orders for code in codes for before, here in pairwise(_places(order, code))]
    compared.check(f"results.orders.{block}", own | {"shortest_distance": min(apart, default=math.nan)})


def _places(order: list[str], code: str) -> list[int]:
    return [place for place, shown in enumerate(order) if shown == code]


def _delivered(compared: Compared, blocks: dict[str, Numbers], counting: pd.DataFrame) -> None:
    """Recompute how many trials kept to the protocol's limits, and the error of the delay."""
    settings = [(block, setting) for block, found in blocks.items() for setting in found["settings"]]
    for number, (block, setting) in enumerate(settings):
        rows = counting[(counting["block"] == block) & (counting["code"] == setting["code"])]
        errors = rows["delay_error_mean_ms"].dropna().to_numpy(float)
        own = {"delay_ms": setting["delay_ms"], "trials": len(rows), "measured": len(errors)}
        own |= {"judged": rows["valid"].notna().sum(), "valid": rows["valid"].eq(True).sum()}
        if len(errors):
            own |= {"error_mean_ms": errors.mean(), "error_worst_ms": errors[np.abs(errors).argmax()]}
            own |= {"achieved_ms": setting["delay_ms"] + errors.mean()}
        compared.check(f"results.delivered.{number}", own)


def _motion(compared: Compared, counting: pd.DataFrame) -> None:
    """Recompute quartiles over participants of their medians, in report.json and in motion.csv."""
    valid = counting["valid"]
    compared.check("results.performance", {"judged": valid.notna().sum(), "invalid": valid.eq(False).sum()})
    measured = counting.assign(path_m=counting["path_length_m"])
    measured["at_limit_percent"] = 100 * counting["limiter_norm"] / counting["ticks"].replace(0, np.nan)
    table = read_csv(compared.folder / "motion.csv")
    for number, row in enumerate(compared.results["performance"]["moved"]):
        rows = measured[(measured["block"] == row["block"]) & (measured["code"] == row["code"])]
        medians = rows.groupby("participant")[row["measure"]].median().dropna()
        own = {"n": len(medians), **quartiles(medians)}
        compared.check(f"results.performance.moved.{number}", own)
        own |= {"trials": len(rows), "judged": rows["valid"].notna().sum(), "valid": rows["valid"].eq(True).sum()}
        for name, value in own.items():
            compared.equal(f"motion.csv {number} {name}", table.loc[number, name], value)


def _questions(compared: Compared, answers: pd.DataFrame) -> None:
    for number, asked in enumerate(compared.results["questions"]):
        rows = answers[
            (answers["form" if asked["is_form"] else "block"] == asked["where"]) & (answers["item"] == asked["item"])
        ]
        for place, group in enumerate(asked["groups"]):
            own = _of_group(rows, asked, group["code"])
            given = own["response"].dropna()
            values = pd.to_numeric(own["value"]).dropna()
            cannot_judge = own["cannot_judge"].eq(True).sum()
            numbers = {"n": len(given), "participants": own.loc[given.index, "participant"].nunique()}
            numbers |= {"cannot_judge": cannot_judge, "missing": len(own) - len(given) - cannot_judge}
            if asked["measure"] in ("distribution", "rating"):
                numbers |= quartiles(values)
            if asked["measure"] == "distribution":
                numbers |= {"smallest": values.min(), "largest": values.max(), **numbered("values", sorted(values))}
            if "counts" in group["numbers"]:
                chosen = [option for response in given.astype(str) for option in response.removesuffix(".0").split()]
                numbers |= named("counts", {option: chosen.count(option) for option in group["numbers"]["counts"]})
            compared.check(f"results.questions.{number}.groups.{place}.numbers", numbers)


def _of_group(rows: pd.DataFrame, asked: Numbers, code: str | None) -> pd.DataFrame:
    """Return the answers about a setting, after a block, or all."""
    if code is None:
        return rows
    return rows[(rows["after_block"].fillna("0") if asked.get("is_form", True) else rows["code"]) == code]


def _scores(compared: Compared, answers: pd.DataFrame) -> None:
    """Score the raw NASA-TLX (mean of six scales), and the System Usability Scale (Brooke 1995)."""
    for number, score in enumerate(compared.results.get("scores", ())):
        rows = answers[answers["form"] == score["where"]]
        for place, group in enumerate(score["groups"]):
            own = _of_group(rows, score, group["code"])
            people = own.pivot_table(index=SESSION, columns="item", values="value", sort=True)
            if score["instrument"] == "sus":
                items = [f"sus{item}" for item in range(1, 11)]
                points = [people[item] - 1 if at % 2 == 0 else 5 - people[item] for at, item in enumerate(items)]
                scores = 2.5 * sum(points)
            else:
                scores = people.mean(axis=1)
            own = {"n": len(scores), "mean": scores.mean(), "sd": scores.std(), "smallest": scores.min()}
            compared.check(f"results.scores.{number}.groups.{place}.numbers", own | {"largest": scores.max()})
