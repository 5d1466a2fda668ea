"""Recompute the blocks of statements of a report: counts, effects, and tests of settings, pairs, names and delays."""

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import combinations, permutations, product

import numpy as np
import pandas as pd
from scipy import stats
from statsmodels.stats.inter_rater import cohens_kappa
from statsmodels.stats.multitest import multipletests

from tests.analysis.oracle.cumulative import counts, fitted
from tests.analysis.oracle.recomputed import Compared, Floats, Numbers, exact_share, named, quartiles, student


class Block:
    """A block of statements: its place in the report, its answers that count, and each person's medians by item."""

    def __init__(self, compared: Compared, number: int, answers: pd.DataFrame, gate: float) -> None:
        self.compared, self.place, self.gate = compared, f"results.blocks.{number}", gate
        block_found, decided = compared.results["blocks"][number], compared.results["decided"]
        settings = next(block["settings"] for block in compared.codebook["blocks"] if block["id"] == block_found["id"])
        self.codes, self.delays = ([setting[name] for setting in settings] for name in ("code", "delay_ms"))
        self.answers = answers[(answers["block"] == block_found["id"]) & answers["counts"]]
        people, self.found, self.wide = (
            sorted(self.answers["participant"].unique()),
            block_found,
            dict[str, pd.DataFrame](),
        )
        for item in (item["id"] for item in block_found["items"]):
            own = self.answers[self.answers["item"] == item].groupby(["participant", "code"])["response"].median()
            self.wide[item] = own.unstack("code").reindex(people)[self.codes]
            conditions = {setting["code"]: setting["condition"] for setting in settings}
            compared.values[block_found["id"], item] = self.wide[item].rename(columns=conditions)
        self.primary = [item for item in self.wide if item in (decided["primary"] or self.wide)]
        self.sides = dict.fromkeys(decided["rising"], "greater") | dict.fromkeys(decided["falling"], "less")

    def record(self, name: str, recomputed: Numbers, question: str, item: str = "", comparison: str = "") -> None:
        self.compared.check(f"{self.place}.{name}", recomputed)
        own = {key.removeprefix("tested.").removeprefix("outcome."): value for key, value in recomputed.items()}
        self.compared.rows[self.found["id"], question, item, comparison] = own

    def record_family(self, name: str, question: str, outcomes: dict[str, Numbers], *, explored: bool = False) -> None:
        """Record tests of statements: primary ones by Holm, others by Benjamini and Hochberg, none below the gate."""
        corrected = {}
        for primary, method in ((True, "holm"), (False, "fdr_bh")):
            items = [item for item in outcomes if (item in self.primary and not explored) == primary]
            for item, p in zip(items, adjusted([outcomes[item]["p"] for item in items], method), strict=True):
                corrected[item] = {"p_adjusted": np.maximum(p, self.gate), "members": len(items)}
        for number, (item, outcome) in enumerate(outcomes.items()):
            self.record(f"{name}.{number}", named("outcome", outcome) | corrected[item], question, item)


def compare_statements(compared: Compared, answers: pd.DataFrame, trials: pd.DataFrame) -> None:
    answers = answers[answers["kind"] == "statement"] if "kind" in answers else answers
    answers = answers.assign(response=pd.to_numeric(answers["response"], errors="coerce"))
    gates = adjusted([(block_result["overall"] or {}).get("p") for block_result in compared.results["blocks"]])
    for number, gate in enumerate(gates):
        block = Block(compared, number, answers, gate)
        own, noticed = block.found, compared.results["decided"]["noticed"]
        _measures(block, trials[trials["block"] == own["id"]])
        _settings_differ(block)
        _pairs(block)
        _cumulative_models(block)
        if own["named"] is not None:
            _recognition(block)
        if own["kind"] == "delays":
            _trends(block)
            _equivalence(block)
        if own["threshold"] is not None:
            noticing = block.answers[block.answers["item"] == noticed].dropna(subset="response")
            block.record("threshold", {"n": noticing["participant"].nunique()}, "a delay is noticed")


def adjusted(ps: Sequence[float | None], method: str = "holm") -> list[float]:
    """Return adjusted p; a test without p is a member of the family."""
    known = np.array([math.nan if p is None else p for p in ps], float)
    corrected = multipletests(np.nan_to_num(known, nan=1.0), method=method)[1] if len(known) else known
    return list(np.where(np.isnan(known), math.nan, corrected))


def share_of_sums(people: Iterable[Iterable[float]], total: float) -> float:
    """Return the exact fraction of choices, one value per person, whose sum is at least ``total``."""
    chance, least = np.ones(1), 0
    for values in people:
        steps = np.rint(4 * np.array([*values])).astype(int)
        chance, least = np.convolve(chance, np.bincount(steps - steps.min()) / len(steps)), least + steps.min()
    return float(chance[max(0, round(4 * total) - least) :].sum())


def signed_ranks(all_differences: pd.Series) -> Numbers:
    differences = all_differences.dropna()
    nonzero = differences[differences != 0].to_numpy()
    ranks, n = stats.rankdata(np.abs(nonzero)), len(nonzero)
    statistic, total, signs = ranks[nonzero > 0].sum(), ranks.sum(), [(0.0, rank) for rank in ranks]
    effect = (2 * statistic - total) / total if n else math.nan
    own = {"n": len(differences), "dropped": len(all_differences) - len(differences), "zeros": len(differences) - n}
    own |= {"superiority": np.sign(differences).mean(), "median_difference": differences.median(), "effect": effect}
    own |= {"statistic": statistic, "p": min(1.0, 2 * share_of_sums(signs, max(statistic, total - statistic)))}
    own |= {"smallest_p": min(1.0, 2 * share_of_sums(signs, total))}
    if n >= 6 and abs(effect) < 1:
        reach = stats.norm.ppf(0.975) * math.sqrt((2 * n**3 + 3 * n**2 + n) / 6) / (n * (n + 1) / 2)
        ends = {"low": math.tanh(math.atanh(effect) - reach), "high": math.tanh(math.atanh(effect) + reach)}
        own |= named("interval", ends | {"level": 0.95})
    return own if n else own | dict.fromkeys(("statistic", "p", "smallest_p"), math.nan)


def _measures(block: Block, trials: pd.DataFrame) -> None:
    responses = block.answers.dropna(subset="response")
    times = responses.groupby(["item", "participant", "code"]).size()
    own = {"n": block.answers["participant"].nunique(), **named("presentations", enumerate([times.min(), times.max()]))}
    own |= named("sessions", enumerate(sorted(responses["session"].unique())))
    block.compared.check(block.place, own | {f"settings.{at}.delay_ms": ms for at, ms in enumerate(block.delays)})
    last = trials[trials["here"] & (trials["attempt"] == trials["last_attempt"])]
    for number, (code, item) in enumerate(product(block.codes, block.wide)):
        of_item = block.answers[(block.answers["code"] == code) & (block.answers["item"] == item)]
        values, cannot_judge = of_item["response"].dropna(), int(of_item["cannot_judge"].eq(True).sum())
        presented = int((trials["counts"] & (trials["code"] == code)).sum())
        own = {"n": len(values), "participants": of_item.loc[values.index, "participant"].nunique()}
        own |= {"presented": presented, "presented_excluded": (~last["kept"] & (last["code"] == code)).sum()}
        own |= {"cannot_judge": cannot_judge, "missing": presented - len(values) - cannot_judge, **quartiles(values)}
        own |= {f"count_{level}": (values == level).sum() for level in range(1, 8)}
        block.compared.check(f"{block.place}.measures.{number}", own | {"agree_percent": 100 * (values >= 5).mean()})
    for number, (item, code) in enumerate(product(block.wide, block.codes[1:])):
        d = (block.wide[item][code] - block.wide[item][block.codes[0]]).dropna()
        block.compared.check(f"{block.place}.effects.{number}", {"n": len(d), "mean": d.mean(), **student(d)})


def _settings_differ(block: Block) -> None:
    """Test each statement and all at once; the p over all is drawn, so that its minimum depends on the draws."""
    whole = {item: answers.dropna() for item, answers in block.wide.items()}
    people, k = set[str]().union(*(answers.index for answers in whole.values())), len(block.codes)
    tested = [(_friedman(answers), len(answers)) for answers in whole.values() if answers.nunique(axis=1).max() > 1]
    method = block.found["overall"]["method"].split()
    draws = int(method[3]) if "draws," in method else math.inf
    own = {"n": len(people), "dropped": len(block.wide[next(iter(whole))]) - len(people), "items": len(tested)}
    own |= {
        "statistic": sum(statistic for statistic, _ in tested),
        "effect": np.mean([statistic / n / (k - 1) for statistic, n in tested]),
    }
    own |= {"incomplete": len(people) * len(whole) - sum(map(len, whole.values()))}
    own |= {"smallest_p": max(1 / (1 + draws), math.factorial(k) ** (1.0 - len(people)))}
    block.record("overall", own, "conditions differ, all statements")
    delays = block.found["kind"] == "delays"
    design = np.array(block.delays)[:, None] / 100 if delays else np.eye(k)[:, 1:]
    slopes = {item: _slopes(answers, design, block.sides.get(item)) for item, answers in block.wide.items()}
    block.record_family("mixed", "means differ", slopes, explored=True)
    if not delays:
        block.record_family(
            "omnibus", "conditions differ", {item: _alike(answers) for item, answers in block.wide.items()}
        )


def _cumulative_models(block: Block) -> None:
    """Fit each primary statement; a maximum is found to about four digits, the table of tests repeats the report."""
    place = {code: number for number, code in enumerate(block.codes)}
    rows = block.answers.dropna(subset="response").assign(place=lambda answers: answers["code"].map(place))
    delays = block.found["kind"] == "delays"
    design = np.array(block.delays)[:, None] / 100 if delays else np.eye(len(place))[:, 1:]
    outcomes = {}
    for item, model in ((model["item"], model["outcome"]) for model in block.found["cumulative"]):
        own = rows[rows["item"] == item]
        if not delays:
            own = own.groupby(["participant", "place"], as_index=False)["response"].median()
        outcomes[item] = counts(own, len(place))
        if model["p"] is not None:
            outcomes[item] |= fitted(own, design, block.sides.get(item) if delays else None, slopes=delays)
    ps = adjusted([outcome["p"] for outcome in outcomes.values()], "fdr_bh")
    for number, ((item, outcome), p) in enumerate(zip(outcomes.items(), ps, strict=True)):
        own = named("outcome", outcome) | {"p_adjusted": np.maximum(p, block.gate), "members": len(outcomes)}
        block.compared.check(f"{block.place}.cumulative.{number}", own, 2e-3, 2e-3)
        reported = {
            name: block.found["cumulative"][number]["outcome"][name] for name in ("n", "statistic", "p", "effect")
        }
        block.compared.rows[block.found["id"], "answers differ, cumulative mixed model", item, ""] = reported


def _friedman(complete: pd.DataFrame) -> float:
    ranks, (n, k) = complete.rank(axis=1).to_numpy(), complete.shape
    return float((k - 1) * ((ranks.sum(0) - n * (k + 1) / 2) ** 2).sum() / ((ranks - (k + 1) / 2) ** 2).sum())


def _alike(answers: pd.DataFrame) -> Numbers:
    complete = answers.dropna()
    n, k = complete.shape
    if k == 2:
        return signed_ranks(answers.iloc[:, 0] - answers.iloc[:, 1])
    ranks, statistic, freedom = complete.rank(axis=1), stats.friedmanchisquare(*complete.to_numpy().T), k - 1 - 2 / n
    w, squares, shares = statistic.statistic / n / (k - 1), ranks.sum() - n * (k + 1) / 2, _rank_sums(ranks.to_numpy())
    f = (n - 1) * w / (1 - w)
    own = {"n": n, "dropped": len(answers) - n, "df": k - 1, "statistic": statistic.statistic, "effect": w, "f": f}
    own |= {"p": shares[shares.index >= (squares**2).sum() - 1e-9].sum(), "p_chi2": statistic.pvalue}
    own |= {"smallest_p": shares[shares.index >= max(shares.index) - 1e-9].sum()}
    return own | {"p_f": stats.f.sf(f, freedom, (n - 1) * freedom), **named("mean_ranks", enumerate(ranks.mean()))}


def _rank_sums(ranks: Floats) -> pd.Series:
    """Return the shares of the sums of squared rank sums (index) among all orders of all participants' ranks."""
    counts, middle = {(0.0,) * ranks.shape[1]: 1.0}, ranks.sum() / ranks.shape[1]
    for row in ranks.tolist():
        further, orders = Counter[tuple[float, ...]](), [*permutations(row)]
        for (sums, weight), order in product(counts.items(), orders):
            further[tuple(sorted(map(sum, zip(sums, order, strict=True))))] += weight / len(orders)
        counts = dict(further)
    return pd.Series([*counts.values()], [sum((rank_sum - middle) ** 2 for rank_sum in sums) for sums in counts])


def _slopes(answers: pd.DataFrame, design: Floats, direction: str | None) -> Numbers:
    """Fit each person's least-squares slopes; Student's t tests one slope, Hotelling's T² several."""
    complete, k = answers.dropna(), design.shape[1]
    n, row = len(complete), {"n": len(complete), "dropped": len(answers) - len(complete)}
    fitted = np.linalg.lstsq(np.column_stack([np.ones(len(design)), design]), complete.T, rcond=None)[0]
    own = fitted[1:].T
    covariance = np.atleast_2d(np.cov(own.T))
    if n < max(10, k + 1) or np.linalg.matrix_rank(covariance, tol=1e-9) < k:
        return row | dict.fromkeys(("statistic", "p"), math.nan)
    intervals = [student(slopes) | {"level": 0.95} for slopes in own.T]
    if k == 1:
        tested = stats.ttest_1samp(own[:, 0], 0, alternative=direction or "two-sided")
        row |= {"statistic": tested.statistic, "p": tested.pvalue, **named("interval", intervals[0])}
        row["effect"] = own.mean()
    else:
        f = n * own.mean(0) @ np.linalg.inv(covariance) @ own.mean(0) * (n - k) / (k * (n - 1))
        row |= {"statistic": f, "p": stats.f.sf(f, k, n - k)}
    for number, ends in enumerate(intervals):
        row |= named(f"intervals.{number}", ends)
    row["intercept_sd"] = fitted[0].std(ddof=1)
    return row | named("slopes", enumerate(own.mean(0))) | named("sds", enumerate(own.std(0, ddof=1)))


def _pairs(block: Block) -> None:
    """Compare pairs of settings in the statements that differ, as one Holm family."""
    differing = [test["item"] for test in block.found["omnibus"] if (test["p_adjusted"] or 0) <= 0.05]
    pairs = [(item, *two) for item in differing for two in combinations(block.codes, 2) if block.found["pairs"]]
    outcomes = [signed_ranks(block.wide[item][first] - block.wide[item][second]) for item, first, second in pairs]
    names = dict(zip(block.codes, block.found["names"], strict=True))
    for number, p in enumerate(adjusted([outcome["p"] for outcome in outcomes])):
        item, first, second = pairs[number]
        own = named("tested.outcome", outcomes[number]) | {"tested.p_adjusted": max(p, block.gate)}
        comparison = f"{names[first]} − {names[second]}"
        block.record(f"pairs.{number}", own | {"tested.members": len(pairs)}, "two conditions differ", item, comparison)


def _recognition(block: Block) -> None:
    """Recompute which name was rated highest, its hits among all exchanges of settings, and McNemar's tests."""
    labels, truth = block.found["named"]["labels"], [setting.get("label") for setting in block.found["settings"]]
    ratings = np.stack([block.wide[label].to_numpy() for label in labels], axis=2)
    highest = ratings == ratings.max(axis=2, keepdims=True)
    decided = np.where(highest.sum(axis=2) == 1, np.array(labels)[highest.argmax(axis=2)], "undecided")
    names = np.where(np.isnan(ratings).any(axis=2), "unanswered", decided).tolist()
    used = [person for person in names if set(person) != {"unanswered"}]
    label_pairs = [pair for person in used for pair in zip(truth, person, strict=True)]
    hits, people = sum(right == name for right, name in label_pairs), []
    for person in used:
        answered = [pair for pair in zip(truth, person, strict=True) if pair[1] != "unanswered"]
        orders = permutations([name for _, name in answered])
        people.append([sum(map(str.__eq__, (str(right) for right, _ in answered), order)) for order in orders])
    table = pd.crosstab(*zip(*[pair for pair in label_pairs if pair[1] in labels], strict=True))
    columns = [*labels, "undecided", "unanswered"]
    own = {"n": len(used), "dropped": len(names) - len(used), "statistic": hits, "p": share_of_sums(people, hits)}
    own |= {"smallest_p": share_of_sums(people, sum(map(max, people))), "expected": sum(map(np.mean, people))}
    own |= {"effect": cohens_kappa(table.reindex(index=labels, columns=labels, fill_value=0), return_results=False)}
    own |= {name: [name for _, name in label_pairs].count(name) for name in columns[-2:]}
    own["decided"] = len(label_pairs) - own["undecided"] - own["unanswered"]
    for number, column in enumerate(zip(*used, strict=True)):
        own |= named(f"table.{number}", enumerate(map(column.count, columns)))
    rates = [_rate(used, setting, truth) for setting, label in enumerate(truth) if label is not None]
    for number, (rate, p) in enumerate(zip(rates, adjusted([rate["p"] for rate in rates]), strict=True)):
        own |= named(f"rates.{number}", rate | {"p_adjusted": p})
    block.record("named.found", own, "liquids are recognised")


def _rate(used: Sequence[Sequence[str]], setting: int, truth: Sequence[str | None]) -> Numbers:
    """Return the rate of correct names of a setting, and McNemar's exact p against its strongest rival."""
    label, ps = truth[setting], {}
    answered = [person for person in used if person[setting] != "unanswered"]
    hits, n = sum(person[setting] == label for person in answered), len(answered)
    for other in (other for other, name in enumerate(truth) if name != label):
        both = [
            (labels[setting] == label, labels[other] == label) for labels in answered if labels[other] != "unanswered"
        ]
        more, less = both.count((True, False)), both.count((False, True))
        ps[other] = stats.binomtest(more, more + less, alternative="greater").pvalue if more + less else 1.0
    rival = max(ps, key=lambda other: ps[other])
    own = {"setting": setting, "hits": hits, "n": n, "rate": hits / n, "rival": rival, "p": ps[rival]}
    return own | named("interval", exact_share(hits, n) | {"level": 0.95})


def _trends(block: Block) -> None:
    """Test the trend of each statement; while it is significant, repeat the test without the longest delay."""
    outcomes = {item: _trend(answers, block.sides.get(item)) for item, answers in block.wide.items()}
    block.record_family("trends", "answers follow the delay", outcomes)
    for number, item in enumerate(lowest["item"] for lowest in block.found["lowest"]):
        answers, place, longest_ms = block.wide[item], f"lowest.{number}.steps", math.nan
        for step, last in enumerate(range(len(block.codes), 1, -1)):
            own = _trend(answers.where(answers.notna().all(axis=1)).iloc[:, :last], block.sides.get(item))
            longest = {"longest_ms": block.delays[last - 1]}
            block.compared.check(f"{block.place}.{place}.steps.{step}", longest)
            words = ("answers change with the delay, step-down test", item, f"up to {longest['longest_ms']:g} ms")
            block.record(f"{place}.steps.{step}.trend", own, *words)
            if own["p"] > 0.05:
                break
            longest_ms = longest["longest_ms"]
        own = {"steps.lowest_ms": longest_ms, "steps.alpha": 0.05, "members": len(block.primary)}
        block.compared.check(f"{block.place}.lowest.{number}", own)


def _trend(answers: pd.DataFrame, direction: str | None) -> Numbers:
    """Change the signs of the participants' correlations of rank and place; Page's p permutes their answers."""
    complete = answers.dropna()
    n, k = complete.shape
    ranks = (-complete if direction == "less" else complete).rank(axis=1).to_numpy()
    scores = ranks @ np.arange(1, k + 1)
    away = scores - k * (k + 1) ** 2 / 4
    sizes, above = np.abs(away[away != 0]), away[away > 0].sum()
    tail, sides = (max(above, sizes.sum() - above), 2) if direction is None else (above, 1)
    own = {"n": n, "dropped": len(answers) - n, "statistic": scores.sum()}
    own |= {"effect": away.mean() / (k * (k * k - 1) / 12), "smallest_p": min(1.0, sides * 0.5 ** len(sizes))}
    own |= {"p": min(1.0, sides * share_of_sums([(0.0, size) for size in sizes], tail))}
    if direction is not None:
        scores_of = [np.array([*permutations(row)]) @ np.arange(1, k + 1) for row in ranks]
        own["p_page"] = share_of_sums(scores_of, scores.sum())
    return own


def _equivalence(block: Block) -> None:
    """Run two one-sided t tests and count the participants who differ by more than the bound."""
    bound, alpha = (block.compared.results["decided"][name] for name in ("equivalence_bound", "alpha"))
    for number, (item, place) in enumerate(product(block.wide, range(1, len(block.codes))) if bound else ()):
        answers, delay, control = block.wide[item], block.delays[place], block.delays[0]
        differences = (answers[block.codes[place]] - answers[block.codes[0]]).dropna()
        n, count = len(differences), int((differences.abs() > bound).sum())
        own = {"n": n, "dropped": len(answers) - n, "effect": differences.mean(), "sd": differences.std()}
        own |= {"bound": bound, "alpha": alpha, "largest": 6, "p_unseen": (1 - min(0.2, bound / 6)) ** n}
        beyond = {"count": count, "n": n, "share": count / n}
        own |= named("beyond", beyond | named("interval", exact_share(count, n) | {"level": 0.95}))
        if differences.nunique() > 1:
            lower = stats.ttest_1samp(differences, -bound, alternative="greater")
            upper = stats.ttest_1samp(differences, bound, alternative="less")
            own |= {"p_lower": lower.pvalue, "p_upper": upper.pvalue, "p": max(lower.pvalue, upper.pvalue)}
            t_lower, t_upper = lower.statistic, upper.statistic
            own |= {"t_lower": t_lower, "t_upper": t_upper, "statistic": min(t_lower, -t_upper)}
            own |= named("interval", student(differences, 1 - 2 * alpha) | {"level": 1 - 2 * alpha})
        block.record(f"against.{number}.found", own, "a delay is equivalent", item, f"{delay:g} ms − {control:g} ms")
        block.compared.check(f"{block.place}.against.{number}", {"delay_ms": delay, "control_ms": control})
