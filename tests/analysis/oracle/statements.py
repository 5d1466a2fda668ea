"""Recompute the report of a study of statements from its exported tables, with pandas and scipy alone.

Nothing of the program is imported: an error that it makes in every place is not made here.
"""

import json
import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats

Floats = NDArray[np.float64]
TOLERANCE = 1e-6
TIED = 1e-9
"""Sums of ranks that differ by less are equal."""


@dataclass
class Compared:
    """The numbers of a report that were recomputed, by place, and those that differ: (place, report, recomputed)."""

    report: dict[str, Any]
    places: set[str] = field(default_factory=set)
    differences: list[tuple[str, Any, Any]] = field(default_factory=list)

    def check(self, place: str, reported: Any, recomputed: dict[str, Any]) -> None:
        """Compare the named numbers of a part of the report; None and NaN are the same."""
        for name, number in recomputed.items():
            path, value = f"{place}.{name}", reported
            for key in name.split("."):
                value = value[int(key)] if isinstance(value, list) else value[key]
            self.places.add(path)
            told, own = (math.nan if it is None else float(it) for it in (value, number))
            both_missing = math.isnan(told) and math.isnan(own)
            if not both_missing and not math.isclose(told, own, rel_tol=TOLERANCE, abs_tol=1e-9):
                self.differences.append((path, value, number))

    @property
    def share(self) -> float:
        """The share of the report's numbers that were recomputed."""
        numbers = set(leaves(self.report))
        return len(numbers & self.places) / len(numbers)

    def missing(self) -> Counter[str]:
        """Return how many numbers of each name were not recomputed."""
        return Counter(re.sub(r"\.\d+", "", place) for place in leaves(self.report) if place not in self.places)


def leaves(value: Any, place: str = "") -> Iterator[str]:
    """Yield the places of all numbers in a report."""
    if isinstance(value, dict | list):
        for key, part in value.items() if isinstance(value, dict) else enumerate(value):
            yield from leaves(part, f"{place}.{key}" if place else str(key))
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield place


def compare(folder: Path) -> Compared:
    """Recompute the numbers of ``report.json`` from the tables next to it."""
    compared = Compared(json.loads((folder / "report.json").read_text(encoding="utf-8")))
    answers, trials = (_table(folder, name) for name in ("responses", "trials"))
    answers["response"] = pd.to_numeric(answers["response"], errors="coerce")
    answers, trials = answers[answers["counted"]], trials[trials["counted"]]
    results = compared.report["results"]
    for number, block in enumerate(results["blocks"]):
        own = answers[answers["block"] == block["id"]]
        place = f"results.blocks.{number}"
        _measures(compared, place, block, own, trials[trials["block"] == block["id"]])
        wide = {item["id"]: _by_participant(own, item["id"], block) for item in block["items"]}
        _effects(compared, place, block, wide)
        _friedman(compared, place, block, wide)
        _pairs(compared, place, block, wide)
        _equivalence(compared, place, block, wide)
    _motion(compared, results["performance"]["moved"], trials)
    _delivered(compared, results["delivered"], trials)
    return compared


def _table(folder: Path, name: str) -> pd.DataFrame:
    (path,) = folder.glob(f"*_description-{name}_data.csv")
    return pd.read_csv(path, na_values=["n/a"], keep_default_na=False, low_memory=False)


def _by_participant(answers: pd.DataFrame, item: str, block: dict[str, Any]) -> pd.DataFrame:
    """Return each participant's median answer to a statement, a column for each setting."""
    of_item = answers[answers["item"] == item]
    medians = of_item.groupby(["participant", "code"])["response"].median().unstack("code")
    return medians.reindex(columns=[setting["code"] for setting in block["settings"]])


def _quartiles(values: pd.Series) -> dict[str, float]:
    return {"q1": values.quantile(0.25), "median": values.median(), "q3": values.quantile(0.75)}


def _measures(
    compared: Compared, place: str, block: dict[str, Any], answers: pd.DataFrame, trials: pd.DataFrame
) -> None:
    for number, measure in enumerate(block["measures"]):
        own = answers[(answers["code"] == measure["code"]) & (answers["item"] == measure["item"])]
        values, cannot_judge = own["response"].dropna(), int(own["cannot_judge"].astype(bool).sum())
        presented = int((trials["code"] == measure["code"]).sum())
        recomputed = {
            "n": len(values),
            "participants": own.loc[values.index, "participant"].nunique(),
            "presented": presented,
            "presented_excluded": 0,
            "cannot_judge": cannot_judge,
            "missing": presented - len(values) - cannot_judge,
            "agree_percent": 100 * (values >= 5).mean(),
            **{f"count_{level}": (values == level).sum() for level in range(1, 8)},
            **_quartiles(values),
        }
        compared.check(f"{place}.measures.{number}", measure, recomputed)


def _effects(compared: Compared, place: str, block: dict[str, Any], wide: dict[str, pd.DataFrame]) -> None:
    for number, effect in enumerate(block["effects"]):
        answered = wide[effect["item"]]
        differences = (answered[effect["code"]] - answered.iloc[:, 0]).dropna()
        recomputed = {"n": len(differences), "mean": differences.mean()}
        if differences.nunique() > 1:
            mean, error = differences.mean(), stats.sem(differences)
            low, high = stats.t.interval(0.95, len(differences) - 1, mean, error)
            recomputed |= {"low": low, "high": high}
        compared.check(f"{place}.effects.{number}", effect, recomputed)


def _friedman(compared: Compared, place: str, block: dict[str, Any], wide: dict[str, pd.DataFrame]) -> None:
    for number, tested in enumerate(block.get("omnibus") or []):
        complete, outcome = wide[tested["item"]].dropna(), tested["outcome"]
        if outcome["test"] != "Friedman" or outcome["statistic"] is None:
            continue
        n, k = complete.shape
        found = stats.friedmanchisquare(*complete.to_numpy().T)
        ranks = complete.rank(axis=1).mean()
        recomputed = {
            "n": n,
            "dropped": compared.report["study"]["participants"] - n,
            "df": k - 1,
            "statistic": found.statistic,
            "p_chi2": found.pvalue,
            "effect": found.statistic / n / (k - 1),
            **{f"mean_ranks.{place_}": rank for place_, rank in enumerate(ranks)},
        }
        compared.check(f"{place}.omnibus.{number}.outcome", outcome, recomputed)


def _pairs(compared: Compared, place: str, block: dict[str, Any], wide: dict[str, pd.DataFrame]) -> None:
    """Wilcoxon's signed ranks with the distribution of all signs, zeros left out."""
    for number, pair in enumerate(block.get("pairs") or []):
        answered, outcome = wide[pair["tested"]["item"]], pair["tested"]["outcome"]
        differences = (answered[pair["first"]] - answered[pair["second"]]).dropna()
        nonzero = differences[differences != 0].to_numpy()
        ranks = stats.rankdata(np.abs(nonzero))
        statistic = ranks[nonzero > 0].sum()
        recomputed = {
            "n": len(differences),
            "dropped": len(answered) - len(differences),
            "zeros": len(differences) - len(nonzero),
            "statistic": statistic,
            "effect": (2 * statistic - ranks.sum()) / ranks.sum(),
            "p": min(1.0, 2 * _share_at_least(ranks, max(statistic, ranks.sum() - statistic))),
        }
        compared.check(f"{place}.pairs.{number}.tested.outcome", outcome, recomputed)


def _share_at_least(ranks: Floats, statistic: float) -> float:
    """Return the share of all choices of signs whose sum of positive ranks is at least ``statistic``."""
    sums = np.zeros(1)
    for rank in ranks:
        sums = np.concatenate([sums, sums + rank])
    return float((sums >= statistic - TIED).mean())


def _equivalence(compared: Compared, place: str, block: dict[str, Any], wide: dict[str, pd.DataFrame]) -> None:
    """Two one-sided t tests, and the share of participants who differ by more than the bound."""
    codes = {setting["delay_ms"]: setting["code"] for setting in block["settings"]}
    for number, against in enumerate(block.get("against") or []):
        answered, found = wide[against["item"]], against["found"]
        differences = (answered[codes[against["delay_ms"]]] - answered[codes[against["control_ms"]]]).dropna()
        n, mean, bound = len(differences), differences.mean(), found["bound"]
        recomputed = {"n": n, "dropped": len(answered) - n, "effect": mean, "sd": differences.std()}
        if differences.nunique() > 1:
            lower = stats.ttest_1samp(differences, -bound, alternative="greater")
            upper = stats.ttest_1samp(differences, bound, alternative="less")
            level = found["interval"]["level"]
            low, high = stats.t.interval(level, n - 1, mean, stats.sem(differences))
            recomputed |= {
                "t_lower": lower.statistic,
                "t_upper": upper.statistic,
                "p_lower": lower.pvalue,
                "p_upper": upper.pvalue,
                "p": max(lower.pvalue, upper.pvalue),
                "interval.low": low,
                "interval.high": high,
                "interval.level": 1 - 2 * found["alpha"],
            }
        if found.get("beyond"):
            count = int((differences.abs() > bound).sum())
            exact = stats.binomtest(count, n).proportion_ci(0.95, "exact")
            recomputed |= {
                "beyond.count": count,
                "beyond.n": n,
                "beyond.share": count / n,
                "beyond.interval.low": exact.low,
                "beyond.interval.high": exact.high,
            }
        compared.check(f"{place}.against.{number}.found", found, recomputed)


def _motion(compared: Compared, moved: list[dict[str, Any]], trials: pd.DataFrame) -> None:
    """Quartiles over participants of their medians, from the columns of the trials."""
    ticks = trials["ticks"].replace(0, np.nan)
    measured = trials.assign(path_m=trials["path_length_m"], at_limit_percent=100 * trials["limiter_norm"] / ticks)
    for number, row in enumerate(moved):
        if row["measure"] not in measured.columns:
            continue  # of reaches: they are in the recordings, not in the tables
        own = measured[(measured["block"] == row["block"]) & (measured["code"] == row["code"])]
        medians = own.groupby("participant")[row["measure"]].median().dropna()
        recomputed = {"n": len(medians), **_quartiles(medians)}
        compared.check(f"results.performance.moved.{number}", row, recomputed)


def _delivered(compared: Compared, delivered: list[dict[str, Any]], trials: pd.DataFrame) -> None:
    """How many trials kept to the protocol's limits, and the error of the delay."""
    for number, row in enumerate(delivered):
        own = trials[(trials["block"] == row["block"]) & (trials["code"] == row["code"])]
        recomputed = {"trials": len(own), "judged": own["valid"].notna().sum(), "valid": own["valid"].eq(True).sum()}
        if row["error_mean_ms"] is not None:
            recomputed["error_mean_ms"] = own["delay_error_mean_ms"].mean()
        compared.check(f"results.delivered.{number}", row, recomputed)
