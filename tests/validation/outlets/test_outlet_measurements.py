"""Streams and triggers as other processes receive them: nothing is lost, and times are the servo's."""

import os
import threading

import numpy as np
import pytest

from study_app.errors import OutletError
from study_app.validation.outlets import trigger_delays
from study_app.validation.outlets.lateness import Ratio, ratio_of
from study_app.validation.outlets.outlet_report import stream_text, trigger_text
from study_app.validation.outlets.streams import Streamed, stream
from study_app.validation.outlets.trigger_delays import VIRTUAL
from tests.compiled import needs_servo

pytest.importorskip("pylsl", reason="pylsl is not installed: pip install 'liquid-study[lsl]'")
pytest.importorskip("serial", reason="pyserial is not installed: pip install 'liquid-study[triggers]'")
slow = pytest.mark.slow


@needs_servo
@pytest.mark.parametrize("seconds", [pytest.param(3, marks=slow), pytest.param(60, marks=[slow, pytest.mark.nightly])])
def test_every_sample_and_marker_arrives_with_the_servos_time(seconds: int) -> None:
    found = stream(seconds, ending=threading.Event())
    assert found.samples_sent > 500 * seconds
    assert (found.samples_lost, found.intact) == (0, True)
    assert found.markers_sent > 10 * seconds
    assert found.markers_lost == 0
    assert len(found.errors_us) == found.markers_sent
    assert found.error_p99_ms <= 1.0
    assert found.arrivals_ms.min() > -1.0
    assert found.met


@pytest.mark.nightly
@needs_servo
@slow
@pytest.mark.skipif(not hasattr(os, "openpty"), reason="this system has no virtual ports")
def test_each_event_is_one_byte_at_a_reader_of_a_virtual_port() -> None:
    found = trigger_delays.measure(VIRTUAL, 1.0, ending=threading.Event())
    assert found.read_us is not None
    assert found.high_ms is not None
    assert len(found.read_us) == len(found.written_us) >= 5
    assert found.wrong == 0
    assert found.read_us.min() > 0
    assert np.median(found.high_ms) >= 9.0
    assert "wrong or missing bytes: 0" in trigger_text(found)


def test_a_port_that_is_not_there_is_named() -> None:
    with pytest.raises(OutletError, match="serial:/nowhere/ttyUSB7 cannot be opened"):
        trigger_delays.measure("serial:/nowhere/ttyUSB7", 1.0, ending=threading.Event())


@pytest.mark.parametrize(
    ("slower", "verdict"), [(1.0, "met"), (1.04, "met"), (1.5, "missed"), (1.1, "undecided: measure for longer")]
)
def test_a_ratio_of_lateness_is_judged_by_its_interval(slower: float, verdict: str) -> None:
    rng = np.random.default_rng(7)
    turns = [(1e4 * rng.lognormal(0, 0.5, 250)).astype(np.int64) for _ in range(400)]
    found = ratio_of([(slower * turn).astype(np.int64) for turn in turns[::2]], turns[1::2], 50)
    assert found.low < slower < found.high
    assert found.verdict == verdict


def streamed(**changed: object) -> Streamed:
    given = {
        "seconds": 3.0,
        "samples_sent": 3000,
        "samples_lost": 0,
        "intact": True,
        "worst_gap_ms": 1.5,
        "markers_sent": 60,
        "markers_lost": 0,
        "errors_us": np.full(60, 30.0),
        "arrivals_ms": np.full(60, 2.0),
    }
    return Streamed(**(given | changed))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("changed", "met"),
    [
        ({}, True),
        ({"samples_lost": 1}, False),
        ({"markers_lost": 1}, False),
        ({"intact": False}, False),
        ({"errors_us": np.full(60, 1001.0)}, False),
        ({"errors_us": np.append(np.full(199, 30.0), 5000.0)}, True),
        ({"errors_us": np.empty(0)}, False),
    ],
)
def test_streams_are_judged_and_reported(changed: dict[str, object], met: bool) -> None:
    found = streamed(**changed)
    assert found.met == met
    text = stream_text(found, (Ratio(50, 27.0, 26.0, 1.01, 0.97, 1.06),))
    assert ("  met\n" in text, "  missed\n" in text) == (met, not met)
    assert "p50: 27 us with, 26 us without, ratio 1.010 (0.970 to 1.060), limit 1.1: met" in text
