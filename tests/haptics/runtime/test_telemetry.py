import threading

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

if numba.config.DISABLE_JIT:
    pytest.skip("telemetry is written by compiled code", allow_module_level=True)

from study_app.haptics.kernels.c_functions import fence
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.model.layout import LIMITER_GLITCH, SAMPLE, records
from study_app.haptics.runtime.telemetry import Telemetry, timing

MS = 1_000_000


def push(telemetry, count=1, *, position=None):
    """Write as the servo does; by default sample i is at i ms and at x = i mm."""
    for _ in range(count):
        i = int(telemetry.written[0])
        slot = telemetry.ring[i % telemetry.ring.size]
        slot.tick, slot.time_ns = i, i * MS
        slot.position_m = (i * 1e-3, 0.0, -i * 2e-3) if position is None else position
        telemetry.written[0] += 1


def test_a_reader_gets_the_new_samples_in_order():
    telemetry = Telemetry(64)
    push(telemetry, 5)
    reader = telemetry.reader()
    assert reader.read().size == 0
    push(telemetry, 3)
    assert reader.read().tick.tolist() == [5, 6, 7]
    push(telemetry, 2)
    assert reader.read().tick.tolist() == [8, 9]
    assert reader.dropped == 0


@pytest.mark.slow
@settings(deadline=None)  # the first example compiles
@given(st.lists(st.integers(0, 20), max_size=20))
def test_every_sample_is_read_once_or_counted_as_dropped(bursts):
    telemetry = Telemetry(8)
    reader = telemetry.reader()
    ticks_read = []
    for burst in bursts:
        push(telemetry, burst)
        samples = reader.read()
        assert samples.size == min(burst, 7)  # the eighth slot is the writer's
        ticks_read += samples.tick.tolist()
    assert len(ticks_read) + reader.dropped == sum(bursts)
    assert ticks_read == sorted(set(ticks_read))


@kernel
def write_fast(ring, written, count):
    for _ in range(count):
        i = written[0]
        sample = ring[i % ring.shape[0]]
        sample.tick = i
        for axis in range(3):
            sample.position_m[axis] = i
            sample.device_force_n[axis] = i
        sample.status = i
        fence()
        written[0] += 1


def test_beside_a_racing_writer_every_sample_read_is_whole():
    telemetry = Telemetry(64)
    count = 300_000
    write_fast(telemetry.ring, telemetry.written, 0)
    reader = telemetry.reader()
    writer = threading.Thread(target=write_fast, args=(telemetry.ring, telemetry.written, count))
    writer.start()
    read_count, running = 0, True
    while running:
        running = writer.is_alive()
        samples = reader.read()
        assert samples.tick.tolist() == list(
            range(read_count + reader.dropped, read_count + reader.dropped + samples.size)
        )
        read_count += samples.size
        for name in ("position_m", "device_force_n"):
            assert (samples[name] == samples.tick[:, None]).all()
        assert (samples.status == samples.tick).all()
    writer.join()
    assert read_count > 0
    assert read_count + reader.dropped == count


@pytest.mark.slow
@settings(deadline=None)  # the first example compiles
@given(st.integers(40, 99), st.floats(0, 1, exclude_max=True))
def test_even_motion_is_interpolated_exactly(before, share):
    telemetry = Telemetry(64)  # the ring has gone round: samples 37 … 99 are kept
    push(telemetry, 100)
    time_ns = before * MS + int(share * MS)
    if before == 99:
        time_ns = 99 * MS
    position, moment = telemetry.position_at(time_ns)
    assert moment == time_ns
    assert position == pytest.approx([time_ns * 1e-9, 0, -2e-9 * time_ns], abs=1e-16, rel=1e-15)


def test_outside_the_history_the_nearest_sample_is_given_with_its_own_time():
    telemetry = Telemetry(8)
    push(telemetry, 20)
    position, moment = telemetry.position_at(25 * MS)
    assert (position[0], moment) == (pytest.approx(19e-3), 19 * MS)
    position, moment = telemetry.position_at(2 * MS)
    assert (position[0], moment) == (pytest.approx(13e-3), 13 * MS)


def test_non_finite_positions_are_skipped():
    telemetry = Telemetry(16)
    push(telemetry, 3)
    push(telemetry, 2, position=(np.nan, 0, 0))
    push(telemetry, 1)
    assert telemetry.position_at(3 * MS)[0][0] == pytest.approx(3e-3)
    assert telemetry.position_at(4_500_000)[0][0] == pytest.approx(4.5e-3)
    push(telemetry, 1, position=(np.nan, 0, 0))
    position, moment = telemetry.position_at(6 * MS)
    assert (position[0], moment) == (5e-3, 5 * MS)
    only = Telemetry(8)
    push(only, 1, position=(np.inf, 0, 0))
    assert only.position_at(0)[1] == 0


def test_positions_that_were_refused_are_passed_over():
    telemetry = Telemetry(16)
    push(telemetry, 6)
    telemetry.ring[3].position_m = (1.0, 1.0, 1.0)
    telemetry.ring[3].limiters = LIMITER_GLITCH
    assert telemetry.position_at(3 * MS)[0] == pytest.approx([3e-3, 0, -6e-3])
    telemetry.ring[5].limiters = LIMITER_GLITCH
    position, moment = telemetry.position_at(6 * MS)
    assert (position[0], moment) == (4e-3, 4 * MS)


def ticks(times_ms, lateness_ms=None, first_tick=0):
    samples = records(SAMPLE, len(times_ms))
    samples.tick = first_tick + np.arange(len(times_ms))
    samples.time_ns = np.asarray(times_ms) * MS
    samples.lateness_ns = 0 if lateness_ms is None else np.asarray(lateness_ms) * MS
    return samples


def test_timing_tells_lateness_gap_and_deadlines_passed_over():
    lateness = np.zeros(100)
    lateness[50] = 0.4
    times = np.arange(100) + lateness
    times[50:] += 4  # deadlines 50 to 53 were passed over
    result = timing(ticks(times, lateness), 1000)
    assert result.overruns == 4
    assert result.worst_gap_s == pytest.approx(0.0054)
    assert result.lateness_p99_s == pytest.approx(np.percentile(lateness, 99) * 1e-3)
    assert result.rate_hz == pytest.approx(99 / 0.103)


@pytest.mark.parametrize("count", [0, 1])
def test_too_few_samples_have_no_timing(count):
    result = timing(ticks(np.arange(count)), 1000)
    assert (result.ticks, result.rate_hz, result.worst_gap_s, result.overruns) == (count, 0, 0, 0)
