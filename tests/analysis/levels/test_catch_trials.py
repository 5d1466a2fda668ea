"""Catch trials in the analysis: no reversal, no step of a track, and a mark of their own in figures."""

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from study_app.analysis.data.study_tables import Study, load_study
from study_app.analysis.figures.level_figures import level_pictures
from study_app.analysis.figures.page_layout import Picture
from study_app.analysis.levels.answers import Answers, of_group
from study_app.analysis.levels.evaluate import level_results
from study_app.analysis.levels.thresholds import Thresholds
from study_app.analysis.levels.tracks import TRACK, answers_of, tracks
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


def test_answers_to_catch_trials_enter_no_step_of_a_track(opened: pd.DataFrame) -> None:
    """Levels of the other trials follow from each other by the rule's steps: 2down1up, a factor of 2 up."""
    own = opened[opened["block"] == "staircase"]
    for _, rows in own.groupby(TRACK):
        answers = answers_of(rows)
        assert len(answers) == (~rows["catch"].astype(bool)).sum()
        in_a_row = 0
        for (level, right), (following, _) in pairwise(answers):
            in_a_row = in_a_row + 1 if right else 0
            factor = 2.0 if not right else 2.0**-0.5488 if in_a_row == 2 else 1.0
            in_a_row %= 2
            assert following == pytest.approx(float(np.clip(level * factor, 0.02, 0.6)))


def test_answers_to_catch_trials_are_apart_from_those_at_their_level(
    staircase: LevelsResult, opened: pd.DataFrame
) -> None:
    own = opened[(opened["block"] == "staircase") & (opened["participant"] == "P001") & (opened["standard"] == 4)]
    shown = [one for one in Answers.of(staircase) if one.participant == "P001" and one.standard == 4]
    assert sum(one.n for one in shown if one.catch) == own["catch"].astype(bool).sum()
    assert sum(one.n for one in shown) == len(own)
    assert {one.level for one in shown if one.catch} == {0.6}
    assert not any(one.catch for one in of_group(staircase))


def test_figures_mark_catch_trials_by_crosses(study: Study, staircase: LevelsResult, opened: pd.DataFrame) -> None:
    own = opened[opened["block"] == "staircase"]
    caught = own["catch"].astype(bool)
    pictures = {picture.name: picture for picture in level_pictures(study, [staircase], ["svg"])}
    tracks_drawn, levels_drawn = pictures["tracks-staircase"], pictures["levels-staircase"]
    assert "× and +: catch trials, answered correctly and not." in tracks_drawn.caption
    assert _crosses(tracks_drawn) == caught.sum()
    assert "crosses: catch trials" in levels_drawn.caption
    assert _crosses(levels_drawn) == len({(one.participant, one.standard) for one in Thresholds.own(staircase)})


def _crosses(picture: Picture) -> int:
    """Return how many marks of two crossing lines a figure has."""
    svg = picture.files["svg"].decode()
    two_lines = re.compile(r'<path id="(\w+)" d="M \S+ \S+\s+L \S+ \S+\s+M \S+ \S+\s+L \S+ \S+\s*"')
    return sum(len(re.findall(f'<use xlink:href="#{name}"', svg)) for name in set(two_lines.findall(svg)))
