"""What is resampled or fitted: other draws give the same, known truths are recovered, order and names do not matter."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from scipy import stats

from study_app.analysis.levels.thresholds import thresholds_of
from study_app.analysis.report.write_report import as_json_types
from study_app.analysis.statistics.equivalence import tost
from study_app.analysis.statistics.mean_tests import means_of, p_differs
from study_app.analysis.statistics.rank_tests import global_permutation
from study_app.analysis.statistics.recognition_tests import recognition
from study_app.analysis.statistics.thresholds import detection_threshold
from study_app.analysis.statistics.trend_tests import trend
from study_app.protocol.trials.designs import default_design
from study_app.protocol.trials.stimuli import Stimulus
from tests.analysis.oracle import studies
from tests.analysis.oracle.recomputed import leaves

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]

Floats = NDArray[np.float64]
DRAWS = 20_000
PEOPLE = 12


def errors_apart(p: float, own: float, draws: int) -> float:
    """Return how many standard errors of both draws two p are apart."""
    middle = (p * draws + own * DRAWS + 1) / (draws + DRAWS + 2)
    return abs(p - own) / math.sqrt(middle * (1 - middle) * (1 / draws + 1 / DRAWS))


def own_p(values: Floats, above: float, draw: np.random.Generator) -> float:
    """Return the p for a mean above a number, by random weights of all persons and of a copy of the lowest."""
    weights = draw.exponential(size=(DRAWS, len(values) + 1))
    means = weights @ np.append(values, values.min()) / weights.sum(axis=1)
    return float((1 + (means <= above).sum()) / (1 + DRAWS))


@pytest.mark.parametrize("seed", range(6))
def test_p_of_the_bootstrap_is_that_of_other_draws(seed: int) -> None:
    draw = np.random.default_rng(seed)
    values, others = draw.normal(0.6, 1, PEOPLE), draw.normal(0.2, 2, PEOPLE - 4)
    result = tost(values, 1.0)
    assert result.p_bootstrap is not None
    own = max(own_p(values, -1.0, draw), own_p(-values, -1.0, draw))
    assert errors_apart(result.p_bootstrap, own, 1999) < 4
    weights, of_others = (draw.exponential(size=(DRAWS, len(sample) + 1)) for sample in (values, others))
    first = weights @ np.append(values, values.min()) / weights.sum(axis=1)
    second = of_others @ np.append(others, others.max()) / of_others.sum(axis=1)
    between = means_of(values[None]) - means_of(others[None], group=1)
    p = p_differs(between, "greater").bootstrap
    assert errors_apart(float(p[0]), float((1 + (first <= second).sum()) / (1 + DRAWS)), 1999) < 4


@pytest.mark.parametrize("seed", range(3))
def test_p_over_all_statements_is_that_of_other_draws(seed: int) -> None:
    draw = np.random.default_rng(seed)
    answers = np.rint(draw.normal(4, 1.2, (5, PEOPLE, 4)) + 0.4 * np.arange(4) * (np.arange(5) == 0)[:, None, None])
    result = global_permutation(answers)

    ranks = stats.rankdata(answers, axis=2) - 2.5
    ranks *= np.sqrt(3 / (ranks**2).sum(axis=(1, 2), keepdims=True))
    statistic = sum(stats.friedmanchisquare(*item.T).statistic for item in answers)
    assert (ranks.sum(axis=1) ** 2).sum() == pytest.approx(statistic) == result.statistic
    sums = np.zeros((DRAWS, 5, 4))
    for person in range(PEOPLE):  # all statements move together
        sums += ranks[:, person][:, draw.permuted(np.tile(np.arange(4), (DRAWS, 1)), axis=1)].transpose(1, 0, 2)
    own = (1 + ((sums**2).sum(axis=(1, 2)) >= statistic - 1e-9).sum()) / (1 + DRAWS)
    assert errors_apart(result.p or 0.0, float(own), 9999) < 4


def test_intervals_of_resampled_people_are_those_of_other_draws() -> None:
    draw = np.random.default_rng(7)
    answers = np.rint(draw.normal(4, 1, (40, 5)) + 0.5 * np.arange(5))
    interval = trend(answers).interval
    ranks = stats.rankdata(answers, axis=1) - 3
    correlations = ranks @ np.arange(-2, 3) / 10
    ends = np.quantile(draw.choice(correlations, (DRAWS, 40)).mean(axis=1), [0.025, 0.975])
    assert interval is not None
    assert (interval.low, interval.high) == pytest.approx(ends, abs=0.1 * np.ptp(ends))
    names = np.where(draw.random((40, 3)) < 0.6, np.arange(3), draw.integers(0, 3, (40, 3)))
    of_names = recognition(names, [0, 1, 2], 3).interval
    tables = np.array([[(names[:, right] == label) for label in range(3)] for right in range(3)], float)
    shares = tables.sum(axis=2) / tables.sum()
    chance = float((shares.sum(axis=0) * shares.sum(axis=1)).sum())
    correct = np.array([*(names == np.arange(3)).mean(axis=1), 0.0])  # a further participant is never correct
    weights = draw.dirichlet(np.ones(41), 40_000)
    agreed = np.array([np.quantile(weights @ correct, 0.025), np.quantile(weights @ correct + weights[:, -1], 0.975)])
    ends = (agreed - chance) / (1 - chance)
    assert of_names is not None
    assert (of_names.low, of_names.high) == pytest.approx(ends, abs=0.1 * np.ptp(ends))


LEVELS_MS = (0.0, 50.0, 75.0, 100.0, 125.0, 150.0, 200.0)


def answers_of_people(people: int) -> Floats:
    """Return answers of people who notice half of the delays of 110 ms, guess in 5 % and lapse in 10 %."""
    chance = 0.05 + 0.85 * stats.logistic.cdf(np.array(LEVELS_MS), 110, 80 / (2 * math.log(19)))
    return np.where(np.random.default_rng(people).random((people, len(LEVELS_MS))) < chance, 6.0, 2.0)


def test_the_detection_threshold_is_that_of_the_people() -> None:
    answers = answers_of_people(2000)
    threshold = detection_threshold(answers, LEVELS_MS)
    assert threshold.effect == pytest.approx(110, rel=0.05)
    assert (threshold.width, threshold.guess, threshold.lapse) == pytest.approx((80, 0.05, 0.1), abs=0.1, rel=0.25)
    order = np.random.default_rng(1).permutation(len(answers))
    places = np.random.default_rng(2).permutation(len(LEVELS_MS))
    shuffled = detection_threshold(answers[order][:, places], [LEVELS_MS[place] for place in places])
    assert numbers_of(shuffled) == pytest.approx(numbers_of(threshold), rel=1e-9)
    in_seconds = detection_threshold(answers, [level / 1000 for level in LEVELS_MS])
    assert [in_seconds.effect, in_seconds.lower, in_seconds.upper, in_seconds.width] == pytest.approx(
        [(number or 0.0) / 1000 for number in (threshold.effect, threshold.lower, threshold.upper, threshold.width)]
    )


def numbers_of(found: Any) -> list[float]:
    return [number for _, number in leaves(as_json_types(found))]


TRUE = {"P001": 0.08, "P002": 0.15, "P003": 0.3, "P004": 0.2}


def trials(unit: float = 1.0) -> pd.DataFrame:
    """Return trials of people with known thresholds, whose answers follow a Weibull function of 1.4 decades."""
    draw, rows = np.random.default_rng(11), []
    slope = math.log10(math.log(20) / math.log(20 / 19)) / 1.4
    for person, threshold in TRUE.items():
        for level in np.tile(np.geomspace(0.03, 0.6, 10), 60):
            success = draw.random() < 1 - 0.5 * 2 ** -((level / threshold) ** slope)
            order = "CS" if draw.random() < 0.5 else "SC"
            rows.append({"participant": person, "level": unit * level, "success": success, "arrangement": order})
    return pd.DataFrame(rows)


def test_thresholds_are_those_of_the_people_in_any_order_and_unit() -> None:
    def estimated(rows: pd.DataFrame, unit: float = 1.0) -> dict[str | None, Any]:
        stimulus = Stimulus(vary="damping_nspm", level="difference", levels=(0.02 * unit, 0.6 * unit), standards=(8.0,))
        return {estimate.participant: estimate for estimate in thresholds_of(rows, stimulus, default_design("2ifc"))}

    original_estimates = estimated(trials())
    for person, threshold in TRUE.items():
        assert original_estimates[person].threshold == pytest.approx(threshold, rel=0.2)
        assert original_estimates[person].low < threshold < original_estimates[person].high
    assert original_estimates[None].threshold == pytest.approx(math.exp(np.log(list(TRUE.values())).mean()), rel=0.1)
    names = dict(zip(TRUE, reversed(TRUE), strict=True))
    renamed = estimated(trials().replace({"participant": names}))
    in_other_unit = estimated(trials(10.0), 10.0)
    for person in (None, *TRUE):
        original, relabelled = original_estimates[person], renamed[names.get(person, "") or None]
        for name in ("threshold", "low", "high", "width", "lapse", "variance", "drift", "fit_p"):
            if getattr(original, name) is not None:
                assert getattr(relabelled, name) == pytest.approx(getattr(original, name), rel=1e-6), name
        assert in_other_unit[person].threshold == pytest.approx(10 * original.threshold, rel=1e-6)


def test_names_of_people_and_codes_do_not_matter(tmp_path: Path) -> None:
    """The answers depend on person, condition and statement: other names, codes and orders give the same numbers."""
    numbers = []
    for name_of, key_seed in (("P{:03d}".format, 3), (lambda number: f"Q{99 - number}", 8)):
        folder = tmp_path / str(key_seed)
        folder.mkdir()
        study = studies.statements(folder, name_of, key_seed)
        report = studies.write("rek2024", study, folder / "report").report / "report.json"
        numbers.append(dict(numbers_by_condition(json.loads(report.read_text("utf-8"))["results"])))
    first, second = numbers
    assert first.keys() == second.keys()
    assert len(first) > 1500
    differing = {
        place: (number, second[place])
        for place, number in first.items()
        if number != pytest.approx(second[place], rel=1e-9, abs=1e-4 if ".cumulative." in place else None)  # an optimum
    }
    assert differing == {}


def numbers_by_condition(results: Any) -> Iterator[tuple[str, float]]:
    """Yield the numbers of the blocks that do not depend on the order of people in resamples, codes as conditions."""
    for block in results["blocks"]:
        conditions = {setting["code"]: setting["condition"] for setting in block["settings"]}
        text = json.dumps({name: part for name, part in block.items() if name not in ("overall", "settings")})
        for code, condition in conditions.items():
            text = text.replace(f'"{code}"', f'"{condition}"')
        for place, number in leaves(json.loads(text)):
            if "interval" not in place.split(".") or "against" in place:
                yield f"{block['id']}.{place}", number
