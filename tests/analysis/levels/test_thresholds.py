"""Thresholds of a block of levels, from rows of tracks: planted ones are found at the levels delivered."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from scipy.stats import norm

from study_app.analysis.levels.thresholds import ThresholdEstimate, Thresholds, person_answers, thresholds
from study_app.analysis.results import LevelsResult
from study_app.analysis.statistics.thresholds import group_mean, p_of_fit
from study_app.protocol.model import Published
from study_app.protocol.trials.designs import COMPARISON_CHOSEN, default_design
from study_app.protocol.trials.methods import QuestPlus, TrackSetting, TrialResult, UpDown
from study_app.protocol.trials.stimuli import LINEAR_WIDTH, SESSION_SD, WIDTH_PRIOR, Stimulus
from study_app.psychophysics.families import Floats, rise, success
from study_app.psychophysics.grid import evenly, fit, group_priors
from study_app.psychophysics.person_fit import (
    BURST_TRIALS,
    MOST_CLUSTERED,
    PersonAnswers,
    PersonFit,
    early_change,
    error_bursts,
)
from tests.analysis.levels.level_studies import LEVELS, NAMES, STIMULUS, arranged, block, rows

GRID = STIMULUS.analysis_grid(default_design("2ifc"), STIMULUS.assumed(default_design("2ifc")))


def test_planted_thresholds_are_found_per_participant_and_for_the_group() -> None:
    people = {"P001": 0.1, "P002": 0.14, "P003": 0.2, "P004": 0.28}
    group, *own = thresholds(block(), rows(people))
    assert [estimate.participant for estimate in own] == list(people)
    for estimate, planted in zip(own, people.values(), strict=True):
        assert estimate.n == 400
        assert estimate.low is not None
        assert estimate.high is not None
        assert estimate.low < planted < estimate.high
        assert estimate.threshold == pytest.approx(planted, rel=0.25)
        assert estimate.guess == 0.5
        assert estimate.beyond is None
    assert (group.participant, group.n, group.standard) == (None, 4, 8.0)
    assert group.threshold == pytest.approx(math.prod(people.values()) ** 0.25, rel=0.15)
    assert group.low is not None
    assert group.high is not None
    assert group.low < group.threshold < group.high


def published(*percents: float | None, measure: str = "weber") -> tuple[Published, ...]:
    return tuple(Published(block="b", measure=measure, value=0.19, percent=percentage) for percentage in percents)


def test_thresholds_are_compared_with_published_ones_at_their_percentage() -> None:
    people = {"P001": 0.1, "P002": 0.14, "P003": 0.2}
    known = replace(block(), published=published(71.0, 71.0))
    group, *own = thresholds(known, rows(people))
    for estimate in own:
        assert estimate.compared is not None
        assert estimate.width is not None
        assert estimate.lapse is not None
        psi = success(
            "weibull",
            math.log10(estimate.compared),
            math.log10(estimate.threshold),
            estimate.width,
            0.5,
            estimate.lapse,
        )
        assert psi == pytest.approx(0.71)
        assert estimate.compared < estimate.threshold
    mean = group_mean(
        [math.log10(estimate.compared or 0) for estimate in own], [estimate.variance or 0 for estimate in own]
    )
    assert group.compared == pytest.approx(10**mean.mean)
    ends = (group.compared_low or 0, 10 ** (mean.low or 0), 10 ** (mean.high or 0), group.compared_high or 0)
    assert 0 < ends[0] < ends[1] < ends[2] < ends[3], "the width that all share is not known"


@pytest.mark.parametrize(("planted", "width", "beyond"), [(60.0, 60.0, None), (104.0, 20.0, "above")])
def test_levels_that_are_evenly_spaced_have_widths_and_thresholds_in_their_unit(
    planted: float, width: float, beyond: str | None
) -> None:
    stimulus = Stimulus(vary="delay_ms", levels=(10, 100), standards=(100.0,), spacing="linear")
    levels = np.linspace(10, 100, 10)
    psi = success("normal", levels, planted, width, 0.5, 0.0)
    frame = pd.DataFrame(
        [
            ("P001", "b", 100.0, level, level, True, number < round(40 * share))
            for level, share in zip(levels, psi, strict=True)
            for number in range(40)
        ],
        columns=["participant", "block", "standard", "level", "level_delivered", "analysed", "success"],
    )
    frame = arranged(frame.sample(frac=1, random_state=1).assign(session="01", trial=range(1, len(frame) + 1)))
    _, estimate = thresholds(block(stimulus=stimulus), frame)
    assert estimate.beyond == beyond
    assert estimate.threshold == pytest.approx(planted, rel=0.03 if beyond is None else 0.15)
    assert estimate.low is not None
    assert estimate.high is not None
    assert estimate.low < planted < estimate.high
    if beyond is None:
        assert estimate.width == pytest.approx(width, rel=0.7)


def test_a_level_that_was_not_measured_counts_as_requested() -> None:
    trial_rows = rows({"P001": 0.2}).assign(level_delivered=pd.NA).astype({"level_delivered": "Float64"})
    assert person_answers(STIMULUS, trial_rows.assign(towards=0.0, before=0.0)).levels == pytest.approx(
        np.log10(LEVELS)
    )


def test_noise_trials_determine_the_guess_rate_of_yes_no() -> None:
    draw, trial_rows = np.random.default_rng(2), []
    for number in range(600):
        level = (0.0, *LEVELS)[number % 10] if number % 3 else 0.0
        u = STIMULUS.coordinate(level)
        trial_rows.append(
            (
                "P001", "01", number, "b", 8.0, level, level, True,
                bool(draw.random() < success("normal", u, -0.7, 1, 0.2, 0)),
            )
        )  # fmt: skip
    _, estimate = thresholds(block("yesno"), arranged(pd.DataFrame(trial_rows, columns=NAMES)))
    assert estimate.guess == pytest.approx(0.2, abs=0.06)
    assert estimate.threshold == pytest.approx(0.2, rel=0.25)


def test_family_and_prior_on_the_width_are_those_that_questplus_states() -> None:
    plain = rows({"P001": 0.2}, trials=60).assign(arrangement="")
    _, default = thresholds(replace(block(), method=QuestPlus()), plain)
    assert default == list(thresholds(block(), plain))[1]
    _, logistic = thresholds(replace(block(), method=QuestPlus(family="logistic")), plain)
    u = [math.log10(level) for level in LEVELS]
    psi = success("logistic", u, math.log10(logistic.threshold), logistic.width or 0, 0.5, logistic.lapse or 0)
    successes, answers = (plain.groupby("level")["success"].agg(what) for what in ("sum", "count"))
    assert logistic.fit_p == pytest.approx(p_of_fit(successes, answers, psi), abs=1e-9)
    _, wide = thresholds(replace(block(), method=QuestPlus(width_prior=(3.5, 1.05))), plain)
    assert wide.width == pytest.approx(3.5, rel=0.1)
    _, narrow = thresholds(replace(block(), method=QuestPlus(widths=(0.1, 0.3), width_prior=(0.2, 1.05))), plain)
    assert narrow.width == pytest.approx(0.2, rel=0.1)
    assert wide.flat_width == pytest.approx(default.flat_width, rel=0.05)  # the change removed depends on the prior


def test_a_function_that_does_not_fit_and_answers_that_drift_are_said_to() -> None:
    plain = rows({"P001": 0.2})
    _, good = thresholds(block(), plain)
    assert good.fits
    assert not good.drifts
    assert good.drift is not None
    odd = plain.assign(success=(plain["level"] < 0.1) | (plain["trial"] % 2 == 0)).astype({"success": "boolean"})
    _, bad = thresholds(block(), odd)
    assert bad.fit_p == 0.001
    assert not bad.fits
    late = plain.assign(success=plain["success"] & (plain["trial"] > 120)).astype({"success": "boolean"})
    _, later = thresholds(block(), late)
    assert later.drifts
    _, shuffled = thresholds(block(), late.sample(frac=1, random_state=2))
    assert shuffled.drift == later.drift
    second = late.assign(session=["02" if trial <= 200 else "01" for trial in late["trial"]])
    _, turned = thresholds(block(), second)
    assert turned.drift is not None
    assert turned.drift < 0


def test_a_threshold_that_changes_is_named_with_its_size_and_widens_the_interval() -> None:
    draw, levels = np.random.default_rng(4), np.tile(LEVELS, 60)
    change = np.linspace(0.3, -0.3, len(levels))  # by a factor of four
    psi = success("weibull", np.log10(levels), math.log10(0.15) + change, 1.4, 0.5, 0.01)
    steady = rows({"P001": 0.15}, trials=len(levels))
    learns = steady.assign(level=levels, level_delivered=levels, success=draw.random(len(levels)) < psi)
    learns = learns.astype({"level_delivered": "Float64", "success": "boolean"})
    (_, changing), (_, steady_estimate) = thresholds(block(), learns), thresholds(block(), steady)
    assert changing.drifts
    assert changing.change == pytest.approx(-0.75, abs=0.15)
    assert (steady_estimate.drifts, steady_estimate.change) == (False, 0.0)
    assert math.log(changing.high / changing.low) > 1.3 * math.log(steady_estimate.high / steady_estimate.low)
    learner_fit = person_answers(STIMULUS, learns.assign(towards=0.0, before=0.0)).fit(GRID, two_intervals=False)
    assert learner_fit.change == pytest.approx(math.log10(1 + changing.change), abs=0.02)
    in_middle = np.log10(levels) + np.repeat(
        [learner_fit.change / 4, -learner_fit.change / 4], len(levels) // 2
    )  # then easier
    right = learns["success"].to_numpy(dtype=float)
    pooled_fit = fit(in_middle, right, 1.0 - right, replace(GRID, width_prior=None))
    assert learner_fit.flat.threshold == pytest.approx(pooled_fit.threshold, abs=1e-3)
    assert learner_fit.flat.variance == pytest.approx(pooled_fit.variance + learner_fit.change**2 / 12, rel=0.01)


@pytest.mark.parametrize(("criterion", "repeats"), [(0.0, 0.0), (0.6, 0.0), (0.0, 0.6)])
def test_a_preference_for_an_interval_or_the_previous_answer_does_not_shift_the_threshold(
    criterion: float, repeats: float
) -> None:
    frame, draw = rows({f"P{number}": 0.2 for number in range(8)}, trials=200), np.random.default_rng(8)
    right = []
    for _, own in frame.groupby("participant"):
        share, last = 0.5 + 0.5 * rise("weibull", np.log10(own["level"]), math.log10(0.2), 1.4), 0.0
        for sensed, comparison_first in zip(norm.ppf(share), own["arrangement"] == "CS", strict=True):
            evidence = (sensed if comparison_first else -sensed) + criterion + repeats * last + draw.normal()
            said_first = evidence > 0 if draw.random() > 0.02 else draw.random() < 0.5
            last = 1.0 if said_first else -1.0
            right.append(said_first == comparison_first)
    group, *_ = thresholds(block(), frame.assign(success=pd.array(right, dtype="boolean")))
    assert group.threshold == pytest.approx(0.2, rel=0.1)


def test_errors_of_people_with_wide_functions_are_not_mistaken_for_preferences() -> None:
    levels, n, draw, squares = np.log10([0.1, 0.2, 0.4]), 60, np.random.default_rng(31), []
    sensed = norm.ppf(0.5 + 0.5 * rise("weibull", levels, math.log10(0.2), 2.5 * LINEAR_WIDTH))
    for _ in range(40):
        places, towards = draw.integers(0, len(levels), n), draw.permuted(np.tile((1.0, -1.0), n // 2))
        right = sensed[places] + draw.normal(size=n) > 0
        before = np.append(0.0, np.where(right, towards, -towards)[:-1])
        person_answers = PersonAnswers(levels, places, right, towards, before, np.linspace(0, 1, n))
        squares += (person_answers.fit(GRID, two_intervals=True).shifts ** 2).tolist()
    information = np.mean(norm.pdf(sensed) ** 2 / (norm.cdf(sensed) * norm.cdf(-sensed)))
    by_chance = math.sqrt(2 / (n * information))  # the standard errors of two preferences
    assert math.sqrt(np.mean(squares)) < 1.2 * by_chance


def test_answers_of_two_sessions_tell_more_about_a_person_than_those_of_one() -> None:
    trial_rows = rows({"P001": 0.2}, trials=400)
    two = trial_rows.assign(session=np.where(trial_rows["trial"] <= 200, "01", "02"))
    abx = block("abx")  # without a preference for the answer before, which the first answer of a session does not have
    (_, alone), (_, both) = thresholds(abx, trial_rows), thresholds(abx, two)
    assert both.threshold == alone.threshold
    assert both.variance == pytest.approx(alone.variance - SESSION_SD**2 / 2, rel=0.01)


def tracks_of_staircases(method: UpDown, trials: int) -> pd.DataFrame:
    """Return rows of two interleaved tracks of one participant; each level follows from the earlier answers."""
    draw, results = np.random.default_rng(9), {1: list[TrialResult](), 2: list[TrialResult]()}
    all_tracks = []
    for trial in range(1, trials + 1):
        number = 1 + trial % 2
        level = method.after(TrackSetting(STIMULUS, default_design("2ifc"), number), results[number])
        assert level is not None
        right = bool(draw.random() < success("weibull", math.log10(level), math.log10(0.15), 1.4, 0.5, 0.01))
        results[number].append(TrialResult(trial=trial, code=f"A{number}", level=level, success=right, correct=right))
        all_tracks.append(("P001", "01", trial, "b", 8.0, level, level, True, right, f"A{number}", f"8/{number}"))
    frame = pd.DataFrame(all_tracks, columns=[*NAMES, "code", "track"]).assign(catch=False, arrangement="CS")
    return frame.astype({"level_delivered": "Float64", "success": "boolean"})


def test_trials_that_are_excluded_leave_the_fit_and_not_the_track() -> None:
    method = UpDown(tracks=2, trials=80, step_up=1.4)
    frame = tracks_of_staircases(method, 80)
    _, whole = thresholds(replace(block(), method=method), frame)
    _, fewer = thresholds(replace(block(), method=method), frame.assign(analysed=frame["trial"] % 5 > 0))
    assert (whole.n, fewer.n) == (80, 64)
    assert fewer.reversal_mean == whole.reversal_mean
    assert fewer.threshold != whole.threshold


@pytest.mark.parametrize(("planted", "end"), [(0.6, "high"), (0.1, None)])
def test_an_end_of_an_interval_that_the_answers_leave_open_is_marked(planted: float, end: str | None) -> None:
    frame = rows({"P001": planted}, trials=60)
    _, *own = thresholds(block(), frame)
    low, high = STIMULUS.domain
    wider = replace(GRID, thresholds=evenly(low - 1.5, high + 1.5, 199))
    answers = [
        person_answers(STIMULUS, person_rows.assign(towards=0.0, before=0.0))
        for _, person_rows in frame.groupby("participant")
    ]
    flat = [person.fit(wider, two_intervals=False).flat for person in answers]
    for estimate, track_fit, factors in zip(own, flat, group_priors(flat, WIDTH_PRIOR).factors, strict=True):
        _, further = track_fit.reweighted(factors).interval
        assert estimate.high is not None
        assert estimate.open_end == end
        assert (10**further > 1.3 * estimate.high) == (end is not None), (
            "the mass beyond the grid moves an open end alone"
        )


def test_a_report_marks_and_explains_open_interval_ends() -> None:
    level_result = LevelsResult(
        block="b", title="B", design="2ifc", revealed=True, times=(), summary="share", counts="correct",
        level_kind="weber", quantity="damping",
    )  # fmt: skip
    estimates = [
        ThresholdEstimate(
            participant=None,
            standard=None,
            n=3,
            threshold=0.5,
            low=0.3,
            high=0.9,
            early_change=-3.14,
            error_bursts=1.52,
            if_many_lapses=0.444,
        ),
        ThresholdEstimate(
            participant="P001", standard=None, n=60, threshold=0.5, low=0.2, high=0.95, open_end="high", fit_p=0.5
        ),
    ]
    finding = Thresholds(replace(level_result, statistics={"thresholds": tuple(estimates)}))
    cells = dict(column for column in finding.table_columns() if column is not None)
    assert [cells["95 % interval"](estimate) for estimate in estimates] == ["0.3 – 0.9", "0.2 – > 0.95"]
    assert cells["drift"](estimates[0]) == "−3.1 SE!"
    assert [cells["fit (p)"](estimate) for estimate in estimates] == ["+1.5 SE!", "0.500"]
    sentences = " ".join(finding.limits())
    assert "do not determine one or both ends of the 95 % interval" in sentences
    assert "thresholds fell by 3.1 standard errors after the first trials" in sentences
    assert "errors are more clustered than the fitted functions predict, by 1.5 standard errors." in sentences
    assert "a mean lapse rate of 9 %, at which the group's threshold would be 0.444 instead of 0.5" in sentences
    assert "The more catch trials" in sentences
    without_catch = Thresholds(replace(finding.result, counts=COMPARISON_CHOSEN))
    assert "The more catch trials" not in " ".join(without_catch.limits())
    hardly_changed = (replace(estimates[0], if_many_lapses=0.501), estimates[1])
    finding = Thresholds(replace(level_result, statistics={"thresholds": hardly_changed}))
    assert "a mean lapse rate" not in " ".join(finding.limits())


def fit_of(u: Floats, right: NDArray[np.bool_]) -> PersonFit:
    """Return the fit to the answers at the levels of each trial."""
    levels, places = np.unique(u, return_inverse=True)
    nothing, share_done = np.zeros(len(u)), np.linspace(0, 1, len(u))
    person_answers = PersonAnswers(
        levels=levels, places=places, successes=right, towards=nothing, before=nothing, done=share_done
    )
    return person_answers.fit(GRID, two_intervals=False)


def test_thresholds_that_fall_after_the_first_trials_are_reported_for_the_group() -> None:
    draw, flags = np.random.default_rng(20), []
    for factor in (1.0, 3.0):
        drifts = []
        for _ in range(12):
            fits = []
            for _ in range(10):
                u = np.log10(0.2) + draw.choice([-0.3, -0.1, 0.1, 0.3], 80)
                threshold = np.log10(0.2) + math.log10(factor) * np.exp(-np.arange(80) / 15)
                fits.append(fit_of(u, draw.random(80) < 0.5 + 0.48 * rise("weibull", u, threshold, 0.8)))
            factors = group_priors([fit.flat for fit in fits], WIDTH_PRIOR).factors
            drifts.append(
                early_change([(fit, fit.flat.reweighted(weights)) for fit, weights in zip(fits, factors, strict=True)])
            )
        flags.append(sum((drift or 0.0) < -2 for drift in drifts))
    assert flags[0] <= 2
    assert flags[1] >= 10


def test_easy_trials_identify_the_lapse_rate_of_a_group() -> None:
    """With catch trials far above the threshold the group's mean lapse rate is known, and moves no threshold."""
    draw, estimates = np.random.default_rng(21), {}
    for lapse in (0.0, 0.08):
        fits = []
        for _ in range(10):
            u = np.concatenate([np.log10(0.1) + draw.choice([-0.3, -0.1, 0.1, 0.3], 60), np.full(20, np.log10(0.6))])
            fits.append(fit_of(u, draw.random(80) < success("weibull", u, math.log10(0.1), 0.6, 0.5, lapse)).flat)
        priors = group_priors(fits, WIDTH_PRIOR)
        assert (priors.if_many_lapses is None) == (lapse == 0.0), "easy answers exclude that many are wrong, or show it"
        own = [fit.reweighted(weights) for fit, weights in zip(fits, priors.factors, strict=True)]
        estimates[lapse] = [float(np.mean([10**threshold_fit.threshold for threshold_fit in own])), own[0].others.lapse]
    assert estimates[0.0] == pytest.approx([0.1, 0.0], abs=0.015)
    assert estimates[0.08] == pytest.approx([0.1, 0.08], abs=0.04)


def test_clusters_of_errors_are_reported_unless_due_to_chance() -> None:
    draw, flags = np.random.default_rng(23), []
    for burst in (0, 10):
        clusterings = []
        for _ in range(10):
            fits = []
            for _ in range(10):
                u = np.log10(0.2) + draw.choice([-0.2, 0.0, 0.2, 0.4], 80)
                psi, begin = 0.5 + 0.49 * rise("weibull", u, math.log10(0.2), 0.9), draw.integers(0, 70)
                psi[begin : begin + burst] = 0.5
                fits.append(fit_of(u, draw.random(80) < psi))
            clusterings.append(error_bursts([(fit, fit.flat) for fit in fits]))
        flags.append(sum((clustering or 0.0) > MOST_CLUSTERED for clustering in clusterings))
    assert flags[0] <= 2
    assert flags[1] >= 8


def test_clusters_are_weighted_by_the_answers_just_before() -> None:
    draw = np.random.default_rng(24)
    fits = [fit_of(draw.choice([-1.0, -0.7, -0.4], 40), draw.random(40) < 0.75) for _ in range(3)]
    score = information = 0.0
    for person in fits:
        psi, right = person.expected(person.flat), person.answers.successes
        for trial in range(40):
            evidence = 0.0
            for begin in range(max(0, trial - BURST_TRIALS + 1), trial):
                of_answers = np.where(right, psi, 1 - psi)[begin:trial]
                evidence += 0.5 ** len(of_answers) / np.prod(of_answers)
            weight = evidence / (evidence + 200)
            score += weight * (psi[trial] - right[trial])
            information += weight**2 * psi[trial] * (1 - psi[trial])
    assert error_bursts([(person, person.flat) for person in fits]) == pytest.approx(score / math.sqrt(information))
