"""Figures of the tiles and the points of the plots; rate and gaps of frames, by hand."""

import numpy as np
import pytest

from study_app.gui.operator.servo_health import LATENESS_WINDOW_S, TRACE_WINDOW_S, ServoHealth
from study_app.gui.settings.display_test import KEPT_S, LEAST_S, FrameTimes
from study_app.gui.widgets.live_plots import lateness_histogram
from study_app.haptics.model.layout import SAMPLE, records


def samples(count, first=0, lateness_ns=15_000, period_ns=1_000_000):
    made = records(SAMPLE, count)
    made.tick = np.arange(first, first + count)
    made.time_ns = made.tick * period_ns
    made.lateness_ns = lateness_ns
    return made


def test_rate_is_ticks_over_time():
    health = ServoHealth(1000.0)
    health.take(samples(2500, period_ns=1_250_000))
    assert health.vitals().rate_hz == pytest.approx(800.0)


def test_lateness_is_of_the_last_minute_however_it_came_in():
    health = ServoHealth(1000.0)
    health.take(samples(1000, lateness_ns=9_000_000))
    for first in range(1000, 1000 + LATENESS_WINDOW_S * 1000, 777):
        health.take(samples(777, first=first, lateness_ns=20_000))
    assert health.vitals().lateness_p99_s == pytest.approx(20e-6)


def test_a_batch_longer_than_the_ring_keeps_its_newest():
    health = ServoHealth(10.0)
    late = np.arange(5000)
    health.take(samples(5000, lateness_ns=late))
    kept = np.sort(health.lateness_ns)
    assert kept.tolist() == late[-LATENESS_WINDOW_S * 10 :].tolist()


def test_the_histogram_counts_every_tick_kept_once():
    health = ServoHealth(1000.0)
    health.take(samples(3000, lateness_ns=np.random.default_rng(1).integers(-500, 80_000_000, 3000)))
    edges, counts = lateness_histogram(health.latenesses_us)
    assert counts.sum() == 3000
    assert edges[0] == 1.0
    assert edges[-1] >= 80_000.0 * 0.99


def test_a_refresh_is_missed_from_a_gap_of_one_and_a_half_on():
    health = ServoHealth(1000.0, refresh_hz=60.0)
    at = 1
    for gap_ms in (16, 17, 24, 26, 51, 2):
        health.frame(at)
        at += gap_ms * 1_000_000
    health.frame(at)
    vitals = health.vitals()
    assert (vitals.refreshes, vitals.refreshes_missed) == (6 + 1 + 2, 1 + 2)


def test_a_page_between_two_tanks_misses_no_refresh():
    health = ServoHealth(1000.0)
    health.frame(1)
    health.frames_rest()
    health.frame(60_000_000_000)
    health.frame(60_016_666_667)
    assert health.vitals().refreshes_missed == 0


def test_the_trace_is_in_order_and_no_longer_than_its_window():
    health = ServoHealth(1000.0)
    for step in range(1600):
        health.hand(step * 0.0213, (step, 0.0, 0.0))
    now = 1600 * 0.0213
    times, places = health.trace(now)
    assert np.all(np.diff(times) > 0)
    assert times[0] >= -TRACE_WINDOW_S
    assert times[0] < -TRACE_WINDOW_S + 0.1
    assert np.all(np.diff(places[:, 0]) == 1)


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
