"""Catch trials in the analysis: no reversal, no step of a track, and a mark of their own in figures."""

from pathlib import Path

import pandas as pd
import pytest

from study_app.analysis.data.study_tables import Study, load_study
from study_app.analysis.levels.evaluate import level_results
from study_app.analysis.levels.tracks import tracks
from study_app.analysis.results import LevelsResult

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def study(opened_catch: Path) -> Study:
    return load_study(opened_catch)


@pytest.fixture(scope="module")
def opened(study: Study) -> pd.DataFrame:
    return tracks(study)


@pytest.fixture(scope="module")
def staircase(study: Study) -> LevelsResult:
    return next(found for found in level_results(study) if found.block == "staircase")


def test_a_catch_trial_is_never_a_reversal(opened: pd.DataFrame) -> None:
    own = opened[opened["block"] == "staircase"]
    caught = own["catch"].astype(bool)
    assert caught.sum() >= 10
    assert own.loc[caught, "reversal"].isna().all()
    assert own.loc[~caught, "reversal"].notna().all()
    assert own.loc[~caught, "reversal"].sum() >= 10


def test_answers_to_catch_trials_are_apart_from_those_at_their_level(
    staircase: LevelsResult, opened: pd.DataFrame
) -> None:
    own = opened[(opened["block"] == "staircase") & (opened["participant"] == "P001") & (opened["standard"] == 4)]
    shown = [one for one in staircase.statistics["answers"] if one.participant == "P001" and one.standard == 4]
    assert sum(one.n for one in shown if one.catch) == own["catch"].astype(bool).sum()
    assert sum(one.n for one in shown) == len(own)
    assert {one.level for one in shown if one.catch} == {0.6}
