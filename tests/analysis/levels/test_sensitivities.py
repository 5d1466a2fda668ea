"""d′, criterion and shares of answers per participant, standard, comparison and level, from rows of tracks."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binomtest, norm

from study_app.analysis.data.blocks import LevelBlock
from study_app.analysis.levels.sensitivities import Sensitivities, SensitivityEstimate, preferences, sensitivities
from study_app.protocol.trials.designs import Rated, default_design
from study_app.protocol.trials.stimuli import Stimulus
from study_app.psychophysics.detection import different_rate, proportion_correct
from tests.analysis.levels.level_studies import ONE, ROVING, block

pytestmark = pytest.mark.slow

NAMES = ["participant", "block", "standard", "track", "level", "arrangement", "response", "value", "analysed"]
TRIALS = 60_000


def rows(design: str, chosen: dict[int, float], answers: tuple[str, str], person: str = "P001") -> pd.DataFrame:
    """Return rows in which the first of two answers has a given share at each arrangement."""
    kind, trial_rows = default_design(design), []
    for arrangement, share in chosen.items():
        letters = kind.arrangement_text(arrangement)
        for number in range(TRIALS):
            answer = answers[0] if number < round(share * TRIALS) else answers[1]
            trial_rows.append((person, "b", 8.0, "8/1", 0.2, letters, answer, None, True))
    return pd.DataFrame(trial_rows, columns=NAMES)


def own(block: LevelBlock, frame: pd.DataFrame) -> SensitivityEstimate:
    _, estimate = sensitivities(block, frame)
    return estimate


def test_2ifc_has_d_prime_criterion_and_share_of_first() -> None:
    d_prime, bias = 1.3, 0.5
    first = {0: norm.cdf((d_prime + bias) / math.sqrt(2)), 1: norm.cdf((-d_prime + bias) / math.sqrt(2))}
    estimate = own(block("2ifc"), rows("2ifc", first, ("first", "second")))
    assert estimate.d_prime == pytest.approx(d_prime, abs=2e-3)
    assert estimate.criterion == pytest.approx(-bias / math.sqrt(2), abs=2e-3)
    assert estimate.shares["first"] == pytest.approx((first[0] + first[1]) / 2, abs=1e-4)
    assert estimate.low is not None
    assert estimate.high is not None
    assert estimate.high - estimate.low == pytest.approx(2 * (estimate.high - estimate.d_prime), abs=1e-9)
    assert (estimate.standard, estimate.n, estimate.participant) == (8.0, 2 * TRIALS, "P001")


@pytest.mark.parametrize(("bias", "least", "most"), [(0.0, 0.0, 0.08), (0.5, 0.4, 1.0), (1.0, 0.9, 1.0)])
def test_a_preference_for_an_interval_is_named(bias: float, least: float, most: float) -> None:
    """Of people with 100 trials whose criterion is 0.35 where the answers are shifted by 0.5."""
    draw, trial_rows = np.random.default_rng(4), []
    for person in range(200):
        for number in range(100):
            shift = (1.3 if number % 2 == 0 else -1.3) + bias
            first = draw.random() < norm.cdf(shift / math.sqrt(2))
            letters = default_design("2ifc").arrangement_text(number % 2)
            trial_rows.append((f"P{person}", "b", 8.0, "8/1", 0.2, letters, "first" if first else "second", None, True))
    _, *people = sensitivities(block("2ifc"), pd.DataFrame(trial_rows, columns=NAMES))
    biased = preferences(people)
    assert least <= len(biased) / len(people) <= most
    of_block = SimpleNamespace(title="Block", design="2ifc", vary="damping", statistics={Sensitivities.key: people})
    finding = Sensitivities(cast("Any", of_block))
    (limit,) = finding.limits()
    assert [person for person in (estimate.participant for estimate in people) if f"{person} (" in limit] == list(
        biased
    )


def test_yes_no_takes_false_alarms_from_the_noise_trials() -> None:
    estimate = own(block("yesno"), rows("yesno", {0: 0.8, 1: 0.4}, ("yes", "no")))
    assert estimate.d_prime == pytest.approx(1.095, abs=1e-3)
    assert estimate.criterion == pytest.approx(-0.294, abs=1e-3)


@pytest.mark.nightly
def test_same_different_is_differencing_where_standards_rove_and_independent_otherwise() -> None:
    d_prime, k = 1.8, 1.4
    high, low = different_rate(d_prime, k), different_rate(0, k)
    frame = rows("samedifferent", {0: 1 - low, 1: 1 - low, 2: 1 - high, 3: 1 - high}, ("same", "different"))
    roving, fixed = (
        own(block("samedifferent", settings=ROVING), frame),
        own(block("samedifferent", settings=ONE), frame),
    )
    assert (roving.model, fixed.model) == ("differencing", "independent")
    assert roving.d_prime == pytest.approx(d_prime, abs=3e-3)
    assert roving.criterion == pytest.approx(k, abs=3e-3)
    assert roving.other == fixed.d_prime
    assert fixed.other == roving.d_prime
    assert fixed.criterion is None


@pytest.mark.parametrize(("design", "task"), [("abx", "abx independent"), ("oddity", "oddity"), ("3ifc", "3ifc")])
def test_designs_without_a_criterion_have_d_prime_from_the_share_correct(design: str, task: str) -> None:
    kind, share = default_design(design), proportion_correct(task, 1.5)
    trial_rows = []
    for arrangement in range(len(kind.arrangements)):
        right = str(kind.correct(arrangement))
        wrong = next(answer for answer in kind.answers if answer != right)
        letters = kind.arrangement_text(arrangement)
        for number in range(5000):
            answer = right if number < share * 5000 else wrong
            trial_rows.append(("P001", "b", 8.0, "8/1", 0.2, letters, answer, None, True))
    estimate = own(block(design, settings=ONE), pd.DataFrame(trial_rows, columns=NAMES))
    assert estimate.d_prime == pytest.approx(1.5, abs=5e-3)
    assert estimate.criterion is None
    assert sum(estimate.shares.values()) == pytest.approx(1)
    correct, n = math.ceil(share * 5000) * len(kind.arrangements), 5000 * len(kind.arrangements)
    ends = binomtest(correct, n).proportion_ci(0.95, method="exact")
    assert estimate.low is not None
    assert estimate.high is not None
    assert [proportion_correct(task, end) for end in (estimate.low, estimate.high)] == pytest.approx(list(ends))


def test_a_d_prime_from_correct_answers_alone_is_called_a_lower_limit() -> None:
    kind, trial_rows = default_design("abx"), []
    for person, wrong_trials in (("P001", ()), ("P002", (3,)), ("P003", range(12))):
        for number in range(12):
            arrangement = number % len(kind.arrangements)
            right = str(kind.correct(arrangement))
            wrong = next(answer for answer in kind.answers if answer != right)
            letters = kind.arrangement_text(arrangement)
            answer = wrong if number in wrong_trials else right
            trial_rows.append((person, "b", 8.0, "8/1", 0.2, letters, answer, None, True))
    _, *people = sensitivities(block("abx", settings=ONE), pd.DataFrame(trial_rows, columns=NAMES))
    perfect, nearly, reversed_ = people
    assert perfect.d_prime == pytest.approx(-reversed_.d_prime)
    assert (perfect.low, reversed_.high) == (None, None)
    assert nearly.low < nearly.d_prime < nearly.high
    of_block = SimpleNamespace(title="Pairs", design="abx", vary="damping", statistics={Sensitivities.key: people})
    (limit,) = Sensitivities(cast("Any", of_block)).limits()
    assert limit.startswith("Pairs: P001 answered all trials correctly")
    others = [replace(estimate, standard=20.0) for estimate in (perfect, nearly)]
    of_block.statistics[Sensitivities.key] = [*people, *others]
    (limit,) = Sensitivities(cast("Any", of_block)).limits()
    assert "P001 (8) and P001 (20) answered all trials correctly" in limit


def test_the_explanation_of_abx_names_its_assumption_and_the_alternative_model() -> None:
    estimate = SensitivityEstimate(participant="P1", n=40, shares={"first": 0.73}, d_prime=0.0, model="independent")
    of_block = SimpleNamespace(
        block="b", design="abx", vary="damping", summary="share", statistics={Sensitivities.key: (estimate,)}
    )
    explanation = Sensitivities(cast("Any", of_block)).explanation()
    assert "assuming that participants do not have a response bias" in explanation
    assert "exported thresholds table" in explanation
    (row,) = Sensitivities(cast("Any", of_block)).export_rows()
    assert "d_prime_other" in row
    assert Sensitivities.table == "thresholds"


@pytest.mark.parametrize(("settings", "has_k"), [(ROVING, True), (ONE, False)])
def test_k_of_same_different_is_explained_only_if_the_table_shows_it(settings: Any, has_k: bool) -> None:
    frame = rows("samedifferent", {0: 0.8, 1: 0.8, 2: 0.3, 3: 0.3}, ("same", "different"))
    people = list(sensitivities(block("samedifferent", settings=settings), frame))
    statistics = {Sensitivities.key: people}
    of_block = SimpleNamespace(title="Pairs", design="samedifferent", vary="damping", summary="", statistics=statistics)
    note = Sensitivities(cast("Any", of_block)).explanation()
    assert ("k is the perceived difference" in note) is has_k


def test_without_a_correct_answer_only_shares_are_known() -> None:
    stimulus = Stimulus(vary="damping_nspm", level="value", levels=(1, 20), standards=(8.0,))
    estimate = own(block("2ifc", stimulus), rows("2ifc", {0: 0.7, 1: 0.5}, ("first", "second")))
    assert (estimate.d_prime, estimate.criterion, estimate.shares["first"]) == (None, None, pytest.approx(0.6))


def test_ratings_have_d_a_of_each_level_against_the_lowest() -> None:
    draw, trial_rows = np.random.default_rng(3), []
    for level, shift in ((1.0, 0.0), (2.0, 0.8), (4.0, 1.6)):
        values = draw.normal(shift, 1, 4000)
        trial_rows += [("P001", "b", None, "/1", level, "C", str(value), value, True) for value in values]
    stimulus = Stimulus(vary="damping_nspm", level="value", levels=(1, 4))
    people = [
        sensitivity
        for sensitivity in sensitivities(block(Rated(scale="five"), stimulus), pd.DataFrame(trial_rows, columns=NAMES))
        if sensitivity.participant
    ]
    assert [sensitivity.level for sensitivity in people] == [2.0, 4.0]
    assert [sensitivity.d_prime for sensitivity in people] == pytest.approx([0.8, 1.6], abs=0.06)
