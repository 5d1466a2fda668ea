"""The figures of tracks and of Weber fractions, and what they are drawn from."""

from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest
from matplotlib.figure import Figure

from study_app.analysis.figures import level_figures
from study_app.analysis.levels.thresholds import thresholds, track_courses
from tests.analysis.levels.level_studies import block, rows


def test_courses_are_in_the_order_of_the_trials_and_end_at_the_threshold() -> None:
    frame = rows({"P001": 0.1, "P002": 0.2}, trials=40).assign(track="8/2", reversal=pd.NA, catch=False, arrangement="")
    course, other_course = track_courses(block(), frame.sample(frac=1, random_state=3), most=5)
    assert (course.participant, other_course.participant, course.standard) == ("P001", "P002", 8.0)
    own = frame[frame["participant"] == "P001"]
    assert course.levels.tolist() == own["level"].tolist()
    assert course.successes.tolist() == own["success"].tolist()
    assert set(course.tracks) == {2}
    assert not course.reversals.any()
    _, estimated, _ = thresholds(block(), frame)
    assert (course.low[-1], course.high[-1]) == pytest.approx((estimated.low, estimated.high))
    so_far = frame[(frame["trial"] <= own["trial"].iloc[19]) | (frame["participant"] == "P002")]
    _, first, _ = thresholds(block(), so_far)
    assert (course.low[19], course.high[19]) == pytest.approx(
        (first.low, first.high), rel=0.02
    )  # without the whole change
    assert len(list(track_courses(block(), frame, most=1))) == 1


def test_circles_at_the_ends_of_the_axes_are_drawn_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(level_figures.Thresholds, "participant_rows", lambda _result: ["a threshold"])
    points: Any = [SimpleNamespace(level=level, value=value, n=40) for level, value in ((2.5, 0.0), (7.5, 1.0))]
    axes, result = Figure().add_subplot(), SimpleNamespace(summary="share")
    level_figures._draw_answer_points(axes, points, {2.5: 0.3, 7.5: 0.9}, result, "black")  # type: ignore[arg-type]
    (circles,) = axes.collections
    assert not circles.get_clip_on()
