"""Statistics of the frames of a trial, from times that a person can subtract."""

import pytest

from study_app.session.trial import _FrameStatistics

MS = 1_000_000


def test_frames_are_counted_with_their_errors_and_gaps() -> None:
    """Frames are painted 5, 12 and 42 ms after the due time with ages of 30, 33 and 61 ms; 30 ms are requested."""
    frames = _FrameStatistics(late_s=0.002, due_ns=1_000 * MS)
    assert frames.frame_gap_ns(1_400 * MS) == 0
    for painted_ms, age_ms in ((1_005, 30), (1_012, 33), (1_042, 61)):
        frames.frame(painted_ms * MS, (painted_ms - age_ms) * MS, 0.030)
    assert frames.columns(1_050 * MS) == {
        "frames": 3,
        "frames_late": 2,
        "delay_error_mean_ms": pytest.approx((0 + 3 + 31) / 3),
        "delay_error_p95_ms": pytest.approx(3 + 0.9 * 28),
        "delay_error_max_ms": pytest.approx(31),
        "first_frame_gap_ms": pytest.approx(5),
        "worst_frame_gap_ms": pytest.approx(30),
    }
    assert frames.frame_gap_ns(1_142 * MS) == 100 * MS


@pytest.mark.parametrize(("paints", "worst_ms"), [(True, 395), (False, None)])
def test_a_single_frame_without_a_window_has_no_gap(*, paints: bool, worst_ms: float | None) -> None:
    frames = _FrameStatistics(late_s=0.002, due_ns=1_000 * MS, paints=paints)
    frames.frame(1_005 * MS, 1_004 * MS, 0.0)
    columns = frames.columns(1_400 * MS)
    assert columns["worst_frame_gap_ms"] == (None if worst_ms is None else pytest.approx(worst_ms))
    assert columns["first_frame_gap_ms"] == pytest.approx(5)
    frames.frame(1_012 * MS, 1_012 * MS, 0.0)
    assert frames.frame_gap_ns(1_400 * MS) == 388 * MS


def test_statistics_without_frames_are_empty() -> None:
    columns = _FrameStatistics(late_s=0.002, due_ns=1_000 * MS).columns(1_400 * MS)
    assert columns.pop("frames") == columns.pop("frames_late") == 0
    assert set(columns.values()) == {None}
