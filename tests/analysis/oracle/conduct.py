"""Recompute who took part, what was delivered, motion and force, other questions, and captions of figures."""

import re

import numpy as np
import pandas as pd

from tests.analysis.oracle.recomputed import SESSION, Compared, Numbers, named, quartiles, read_csv

SMALL = "zero one two three four five six seven eight nine ten eleven twelve".split()  # noqa: SIM905


def compare_conduct(compared: Compared, answers: pd.DataFrame, trials: pd.DataFrame) -> None:
    sessions = trials.groupby(SESSION)[["here", "excluded_session"]].any()
    own = {"participants": trials[trials["here"]]["participant"].nunique(), "sessions": len(sessions)}
    own |= {"sessions_left_out": (~sessions.any(axis=1)).sum(), "sessions_excluded": sessions["excluded_session"].sum()}
    compared.check("study", own)
    counting, blocks = trials[trials["counts"]], compared.codebook["blocks"]
    settings_of_blocks = [(block["id"], setting) for block in blocks for setting in block["settings"]]
    for number, (block, setting) in enumerate(settings_of_blocks):
        rows = counting[(counting["block"] == block) & (counting["code"] == setting["code"])]
        errors = rows["delay_error_mean_ms"].dropna().to_numpy(float)
        own = _validity(rows) | {"delay_ms": setting["delay_ms"], "measured": len(errors)}
        if len(errors):
            own |= {"error_mean_ms": errors.mean(), "error_worst_ms": max(errors, key=abs)}
            own |= {"achieved_ms": setting["delay_ms"] + errors.mean()}
        compared.check(f"results.delivered.{number}", own)
    _motion(compared, counting)
    for number, question in enumerate(compared.results.get("questions", ())):
        rows = answers[answers["counts"] & (answers["form" if question["is_form"] else "block"] == question["where"])]
        rows = rows[rows["item"] == question["item"]]
        places = rows["after_block"].fillna("0") if question["is_form"] else rows["code"]
        for place, group in enumerate(question["groups"]):
            own = _question(rows if group["code"] is None else rows[places == group["code"]], group["numbers"])
            compared.check(f"results.questions.{number}.groups.{place}.numbers", own)


def _validity(rows: pd.DataFrame) -> Numbers:
    return {"trials": len(rows), "judged": rows["valid"].notna().sum(), "valid": rows["valid"].eq(True).sum()}


def _motion(compared: Compared, counting: pd.DataFrame) -> None:
    judgements = {"judged": counting["valid"].notna().sum(), "invalid": counting["valid"].eq(False).sum()}
    compared.check("results.performance", judgements)
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


def _question(rows: pd.DataFrame, reported: Numbers) -> Numbers:
    responses, values, cannot = rows["response"].dropna(), rows["value"].dropna(), rows["cannot_judge"].eq(True).sum()
    own = {"n": len(responses), "participants": rows.loc[responses.index, "participant"].nunique()}
    own |= {"cannot_judge": cannot, "missing": len(rows) - len(responses) - cannot}
    if "counts" in reported:
        options = [option for response in responses.astype(str) for option in response.removesuffix(".0").split()]
        own |= named("counts", {option: options.count(option) for option in reported["counts"]})
    if "values" in reported:
        own |= {"smallest": values.min(), "largest": values.max(), **named("values", enumerate(sorted(values)))}
    return own | (quartiles(values) if "median" in reported else {})


def compare_captions(compared: Compared, trials: pd.DataFrame) -> None:
    """Compare the numbers in the licence of the figures: people, missing answers, errors of the delay, and hits."""
    people, counting = trials[trials["here"]]["participant"].nunique(), trials[trials["counts"]]
    of_names = [own for (_, question, *_), own in compared.rows.items() if question == "liquids are recognised"]
    hits = [[own[name] for name in ("statistic", "expected", "p")] for own in of_names]
    compared_people = [[contrast["n"]] for contrast in compared.results.get("contrasts", [])]
    measures = {block["id"]: pd.DataFrame(block["measures"]).sum() for block in compared.results["blocks"]}
    for path in compared.folder.glob("*.txt"):
        errors = counting.loc[counting["block"] == path.stem, "delay_error_mean_ms"]
        sums = measures.get(path.stem.removeprefix("liquids-"), {})
        for pattern, *own in (
            (rf"(?:n = |people; |of )(\d+|{'|'.join(SMALL)}) participants", [people], *compared_people),
            (r"Cannot judge: (\d+); not answered: (\d+)\.", [sums.get("cannot_judge"), sums.get("missing")]),
            (
                r"by (\S+) ms on average \(range across trials: (\S+) to (\S+) ms",
                [errors.mean(), errors.min(), errors.max()],
            ),
            (r"Correct: (\d+); (\S+) expected .* p = (\S+)\)", *hits),
        ):
            for reported in (match.groups() for match in re.finditer(pattern, path.read_text("utf-8"))):
                if not any(all(map(_is_rounded, reported, numbers)) for numbers in own):
                    compared.differences.append((path.name, reported, own))


def _is_rounded(reported: str, own: float) -> bool:
    number = SMALL.index(reported) if reported in SMALL else float(reported.replace("−", "-"))
    return abs(number - own) <= 0.5000001 * 10.0 ** -len(reported.partition(".")[2])
