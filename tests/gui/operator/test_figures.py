"""Figures of the tiles and points of the plots after each batch of samples, compared with a reviewed text."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from study_app.gui.operator.servo_health import ForceFigures, Forces, ServoHealth
from study_app.gui.settings.view import FrameTimes
from study_app.gui.widgets.live_plots import lateness_histogram
from study_app.haptics.model.layout import (
    LIMITER_FADE,
    LIMITER_NORM,
    LIMITER_SLEW,
    LIMITER_SLOPE,
    LIMITER_STOP,
    SAMPLE,
    records,
)
from tests.golden import check_kept
from tests.golden_values import value_lines

MS = 1_000_000
REFRESH_NS = 16_666_667


def samples(count: int, *, first: int = 0, period_ns: int = MS, **fields: Any) -> Any:
    batch = records(SAMPLE, count)
    batch.tick = np.arange(first, first + count)
    batch.time_ns = batch.tick * period_ns
    for name, value in ({"scene": 1, "lateness_ns": 15_000} | fields).items():
        setattr(batch, name, value)
    return batch


def ends(name: str, values: Any) -> str:
    """Return the count, first, last and mean of values, and whether they rise."""
    values = np.asarray(values)
    rises = "rise" if (np.diff(values, axis=0) > 0).all() else "do not rise"
    return f"{name}: {len(values)} {rises}, {values[0]} to {values[-1]}, mean {values.mean(axis=0)}"


def of_health(health: ServoHealth, now_s: float = 0.0) -> Iterator[str]:
    yield from value_lines(health.vitals())
    if health.vitals().ticks:
        edges, counts = lateness_histogram(health.latenesses_us)
        yield f"histogram: {counts.sum()} from {edges[0]} to {edges[-1]}"
        yield ends("sorted latenesses", np.sort(health.lateness_ns))
    if now_s:
        yield from (ends(*curve) for curve in zip(("times", "places"), health.trace(now_s), strict=True))


def healths() -> Iterator[str]:
    for name, rate_hz, batches in (
        ("800 ticks a second", 1000.0, [samples(2500, period_ns=1_250_000)]),
        (
            "a minute in odd batches after a late second",
            1000.0,
            [
                samples(1000, lateness_ns=9_000_000),
                *(samples(777, first=first, lateness_ns=20_000) for first in range(1000, 61_000, 777)),
            ],
        ),
        ("a batch longer than what is kept", 10.0, [samples(5000, lateness_ns=np.arange(5000))]),
        ("far apart", 1000.0, [samples(3000, lateness_ns=np.random.default_rng(1).integers(-500, 80_000_000, 3000))]),
    ):
        health = ServoHealth(rate_hz)
        for batch in batches:
            health.add_samples(batch)
        yield from (f"== {name}", *of_health(health))
    for name, gaps_ms in (("frames missed", (16, 17, 24, 26, 51, 2)), ("a page between", (0, 16))):
        health, at_ns = ServoHealth(1000.0, refresh_hz=60.0), 1
        for gap_ms in gaps_ms:
            health.add_frame(at_ns)
            at_ns += gap_ms * MS
            if gap_ms == 0:
                health.pause_frames()
                at_ns = 60_000_000_000
        health.add_frame(at_ns)
        yield from (f"== {name}", *of_health(health))
    for step in range(1600):
        health.add_hand_position(step * 0.0213, (step, 0.0, 0.0))
    yield from ("== a hand", *of_health(health, 1600 * 0.0213))


def forces() -> Iterator[str]:
    plays: dict[str, list[Any]] = {
        "shares of the limit": [
            samples(100, device_force_n=(0.0, 4.5, 0.0)),
            samples(100, first=100, device_force_n=(1.5, 0.0, 0.0)),
            samples(100, first=200, scene=0),
            samples(100, first=300, scene=2, device_force_n=(0.6, 0.0, 0.0)),
        ],
        "limiters of a trial": [
            samples(500, limiters=LIMITER_FADE, permitted_n=4.0, withheld_n=0.25),
            samples(30, first=500, limiters=LIMITER_SLOPE | LIMITER_SLEW),
            samples(5, first=530, limiters=LIMITER_NORM | LIMITER_STOP),
            samples(20, first=535, limiters=LIMITER_NORM, scene=np.where(np.arange(20) < 12, 1, 2)),
        ],
        "longer than the plot": [samples(613, first=first) for first in range(0, 31_000, 613)],
    }
    for name, batches in plays.items():
        it, end = Forces(6.0), 0
        yield f"== {name}"
        for batch in batches if len(batches) < 9 else [batches]:
            for part in batch if isinstance(batch, list) else [batch]:
                it.add_samples(part)
                end = int(part.time_ns[-1]) + MS
            yield from value_lines(it.figures())
        yield from (ends(*curve) for curve in zip(("times", "forces"), it.trace(end), strict=True))


def frame_times() -> Iterator[str]:
    even = [number * REFRESH_NS for number in range(240)]
    gaps_ms = [16] * 297 + [30] * 2 + [200]
    for name, times_ns in (
        ("too few", even[:20]),
        ("even", even),
        ("three refreshes once", even[:120] + [even[119] + (3 + number) * REFRESH_NS for number in range(120)]),
        ("every second one", even[::2]),
        ("one far longer", list(np.cumsum([0, *gaps_ms]) * MS)),
        ("longer than is kept", [number * REFRESH_NS for number in range(1800)]),
    ):
        frames = FrameTimes(60.0)
        for time_ns in times_ns:
            frames.add_frame(int(time_ns))
        yield from (f"== {name}", *value_lines(frames.figure_texts()))


@pytest.mark.parametrize("of", [healths, forces, frame_times], ids=lambda of: of.__name__)
def test_figures_are_the_reviewed_ones(of: Any) -> None:
    check_kept(Path(__file__).with_name(f"figures_of_{of.__name__}.txt"), of())


def test_rest_changes_only_the_force_of_now() -> None:
    forces = Forces(8.0)
    forces.add_samples(samples(3, scene=0, device_force_n=(0.0, 4.0, 0.0), limiters=LIMITER_NORM, permitted_n=1.0))
    assert forces.figures() == ForceFigures(share=0.5, most=0.0, limiters=())
    forces.add_samples(
        samples(5, scene=2, device_force_n=(0.0, 0.0, -6.0), limiters=LIMITER_NORM, permitted_n=4.0, withheld_n=1.0)
    )
    expected = ForceFigures(share=0.75, most=0.75, limiters=(("force", 5),), withheld=0.25)
    assert forces.figures() == expected
    forces.add_samples(samples(7, scene=0, device_force_n=(2.0, 0.0, 0.0), limiters=LIMITER_SLEW, withheld_n=9.0))
    assert forces.figures() == replace(expected, share=0.25)
    forces.add_samples(samples(0))
    assert forces.figures() == replace(expected, share=0.25)


def test_a_batch_of_two_scenes_counts_only_the_newest() -> None:
    forces = Forces(8.0)
    batch = samples(9, scene=np.array([1] * 4 + [0] + [2] * 3 + [0]), permitted_n=np.arange(1.0, 10.0))
    batch.device_force_n[:, 0] = (7.0, 7.5, 6.0, 5.0, 1.0, 2.0, 4.0, 3.0, 0.8)
    batch.limiters = [LIMITER_NORM] * 4 + [LIMITER_SLOPE] + [LIMITER_SLEW, LIMITER_SLEW | LIMITER_NORM, 0, 0]
    batch.withheld_n = (9.0, 9.0, 9.0, 9.0, 9.0, 0.6, 0.7, 0.8, 9.0)
    forces.add_samples(batch)
    assert forces.figures() == ForceFigures(
        share=0.1, most=0.5, limiters=(("slew", 2), ("force", 1)), withheld=pytest.approx(2.1 / 21)
    )
    forces.add_samples(samples(2, scene=2, device_force_n=(1.0, 0.0, 0.0), limiters=LIMITER_SLEW, permitted_n=4.5))
    assert forces.figures() == ForceFigures(
        share=0.125, most=0.5, limiters=(("slew", 4), ("force", 1)), withheld=pytest.approx(2.1 / 30)
    )
    forces.add_samples(samples(3, scene=3, device_force_n=(0.0, 3.0, 0.0), permitted_n=4.0, withheld_n=0.5))
    assert forces.figures() == ForceFigures(share=0.375, most=0.375, limiters=(), withheld=0.125)


def test_a_peak_of_one_tick_is_not_missed_however_it_came_in() -> None:
    pushed = samples(4000, device_force_n=(0.1, 0.0, 0.0))
    pushed.device_force_n[1234] = (0.0, -7.5, 0.0)
    traces = []
    for batch in (4000, 17, 16, 1):
        forces = Forces(8.0)
        for first in range(0, 4000, batch):
            forces.add_samples(pushed[first : first + batch])
        traces.append(np.column_stack(forces.trace(4000 * MS)))
    assert all(np.array_equal(trace, next_trace) for trace, next_trace in pairwise(traces))
    (peak,) = traces[0][traces[0][:, 4] == 7.5]
    assert peak[:5].tolist() == [pytest.approx(-(4000 - 1234) / 1000, abs=0.02), 0.0, -7.5, 0.0, 7.5]
