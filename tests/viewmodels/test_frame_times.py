"""What frames' times come to: rate, gaps and missed ones, by hand."""

import pytest

from study_app.viewmodels.frame_times import KEPT_S, LEAST_S, FrameTimes

REFRESH_NS = 16_666_667


def taken(times_ns, refresh_hz=60.0):
    frames = FrameTimes(refresh_hz)
    for time_ns in times_ns:
        frames.add(time_ns)
    return frames.figures()


def test_nothing_is_said_before_there_is_enough():
    assert FrameTimes(60.0).figures() is None
    short = [n * REFRESH_NS for n in range(int(LEAST_S * 60) - 1)]
    assert taken(short) is None


def test_even_frames_have_the_screens_rate_and_miss_none():
    found = taken([n * REFRESH_NS for n in range(240)])
    assert found.rate_hz == pytest.approx(60.0, rel=1e-6)
    assert found.median_ms == found.p99_ms == pytest.approx(16.667, abs=0.001)
    assert (found.missed, found.painted) == (0, 240)


def test_a_gap_of_three_refreshes_missed_two_frames():
    times = [n * REFRESH_NS for n in range(120)]
    times += [times[-1] + (3 + n) * REFRESH_NS for n in range(120)]
    found = taken(times)
    assert found.missed == 2
    assert found.median_ms == pytest.approx(16.667, abs=0.001)
    assert taken([times[0], *times[1::2]]).missed >= 118  # every second frame alone


def test_the_longest_of_99_percent_is_not_the_longest_of_all():
    gaps = [16] * 297 + [30] * 2 + [200]
    times, now = [0], 0
    for gap in gaps:
        now += gap * 1_000_000
        times.append(now)
    assert taken(times).p99_ms == 30


def test_old_frames_are_forgotten():
    frames = FrameTimes(60.0)
    for n in range(int(3 * KEPT_S * 60)):
        frames.add(n * REFRESH_NS)
    assert frames.figures().painted == pytest.approx(KEPT_S * 60, abs=2)
