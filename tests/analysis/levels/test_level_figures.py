"""The figures of tracks and of Weber fractions, and what they are drawn from."""

import pandas as pd
import pytest

from study_app.analysis.levels.thresholds import thresholds, track_courses
from tests.analysis.levels.level_studies import block, rows


def test_courses_are_in_the_order_of_the_trials_and_end_at_the_threshold() -> None:
    frame = rows({"P001": 0.1, "P002": 0.2}, trials=40).assign(track="8/2", reversal=pd.NA, catch=False, arrangement="")
    one, other = track_courses(block(), frame.sample(frac=1, random_state=3), most=5)
    assert (one.participant, other.participant, one.standard) == ("P001", "P002", 8.0)
    own = frame[frame["participant"] == "P001"]
    assert one.levels.tolist() == own["level"].tolist()
    assert one.successes.tolist() == own["success"].tolist()
    assert set(one.tracks) == {2}
    assert not one.reversals.any()
    _, estimated, _ = thresholds(block(), frame)
    assert (one.low[-1], one.high[-1]) == pytest.approx((estimated.low, estimated.high))
    so_far = frame[(frame["trial"] <= own["trial"].iloc[19]) | (frame["participant"] == "P002")]
    _, first, _ = thresholds(block(), so_far)
    assert (one.low[19], one.high[19]) == pytest.approx((first.low, first.high), rel=0.02)  # without the whole change
    assert len(list(track_courses(block(), frame, most=1))) == 1
