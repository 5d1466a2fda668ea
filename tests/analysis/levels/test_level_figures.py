"""The figures of tracks and of Weber fractions, and what they are drawn from."""

import pandas as pd
import pytest

from study_app.analysis.levels.thresholds import counts_of, courses, thresholds
from study_app.analysis.statistics.thresholds import fitted, narrowing
from study_app.protocol.trials.designs import default_design
from study_app.protocol.trials.stimuli import analysis_grid, assumed_for
from tests.analysis.levels.level_studies import STIMULUS, block, rows


def test_the_interval_after_the_last_answer_is_that_of_all_answers() -> None:
    grid = analysis_grid(STIMULUS, default_design("2ifc"), assumed_for(STIMULUS, default_design("2ifc")))
    own = rows({"P001": 0.2}, trials=60)
    counts, right = counts_of(STIMULUS, own), own["success"].to_numpy(dtype=bool)
    low, high = narrowing(counts.levels, counts.places, right, grid)
    whole = fitted(counts.levels, counts.successes, counts.failures, grid)
    assert (low[-1], high[-1]) == pytest.approx((whole.low, whole.high))
    half = own.iloc[:30]
    fewer = counts_of(STIMULUS, half)
    first = fitted(fewer.levels, fewer.successes, fewer.failures, grid)
    assert (low[29], high[29]) == pytest.approx((first.low, first.high))
    assert (high - low)[-1] < 0.7 * (high - low)[0]


def test_courses_are_in_the_order_of_the_trials_and_end_at_the_threshold() -> None:
    frame = rows({"P001": 0.1, "P002": 0.2}, trials=40).assign(
        track="8/2", reversal=pd.NA, catch=False, arrangement="CS"
    )
    one, other = courses(block(), frame.sample(frac=1, random_state=3), most=5)
    assert (one.participant, other.participant, one.standard) == ("P001", "P002", 8.0)
    own = frame[frame["participant"] == "P001"]
    assert one.levels.tolist() == own["level"].tolist()
    assert one.successes.tolist() == own["success"].tolist()
    assert set(one.tracks) == {2}
    assert not one.reversals.any()
    _, estimated, _ = thresholds(block(), frame)
    assert (one.low[-1], one.high[-1]) == pytest.approx((estimated.low, estimated.high))
    assert len(list(courses(block(), frame, most=1))) == 1
