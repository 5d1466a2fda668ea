"""Catch trials in the analysis: no reversal, no step of a track, and a mark of their own in figures."""

from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from study_app.analysis.data.study_tables import Study, load_study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.levels.evaluate import level_results
from study_app.analysis.levels.tracks import tracks
from study_app.analysis.report.methods import methods
from study_app.analysis.results import LevelsResult
from study_app.store.exclusions import Exclusion

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def study(opened_catch: Path) -> Study:
    return load_study(opened_catch)


@pytest.fixture(scope="module")
def opened_tracks(study: Study) -> pd.DataFrame:
    return tracks(study)


@pytest.fixture(scope="module")
def staircase(study: Study) -> LevelsResult:
    return next(level_result for level_result in level_results(study) if level_result.block == "staircase")


def test_a_catch_trial_is_never_a_reversal(opened_tracks: pd.DataFrame) -> None:
    own = opened_tracks[opened_tracks["block"] == "staircase"]
    is_catch = own["catch"].astype(bool)
    assert is_catch.sum() >= 10
    assert own.loc[is_catch, "reversal"].isna().all()
    assert own.loc[~is_catch, "reversal"].notna().all()
    assert own.loc[~is_catch, "reversal"].sum() >= 10


def test_answers_to_catch_trials_are_apart_from_those_at_their_level(
    staircase: LevelsResult, opened_tracks: pd.DataFrame
) -> None:
    own = opened_tracks[
        (opened_tracks["block"] == "staircase")
        & (opened_tracks["participant"] == "P001")
        & (opened_tracks["standard"] == 4)
    ]
    counts_at_level = [
        counts for counts in staircase.statistics["answers"] if counts.participant == "P001" and counts.standard == 4
    ]
    assert sum(counts.n for counts in counts_at_level if counts.catch) == own["catch"].astype(bool).sum()
    assert sum(counts.n for counts in counts_at_level) == len(own)
    assert {counts.level for counts in counts_at_level if counts.catch} == {0.6}


def test_the_methods_state_the_rule_on_catch_trials_and_the_sessions_that_it_excluded(study: Study) -> None:
    stricter = tuple(replace(level, wrong_most=0.15 if level.wrong_most else None) for level in study.levels)
    out = Exclusion(
        participant="P002",
        session=1,
        trial=None,
        rule_or_person="catch",
        reason="3 of 8 catch trials",
        excluded_at="2026-03-02T09:00:00+00:00",
    )
    results = evaluate(study, recordings=False)
    words = methods(replace(study, levels=stricter, exclusions=(out,)), results)
    titles = " and ".join(f"“{level.title}”" for level in study.levels if level.wrong_most)
    assert f"excludes sessions with more than 15 % incorrect answers to the catch trials in {titles}." in words
    assert "1 session was excluded automatically because of errors in catch trials." in words
    assert "excluded automatically" not in methods(study, results)
