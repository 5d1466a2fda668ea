"""Streams and triggers as other processes receive them: nothing is lost, and times are the servo's."""

import os
import threading

import numpy as np
import pytest

from study_app.errors import OutletError
from study_app.evidence.outlets import triggers
from study_app.evidence.outlets.streams import measure_streams
from tests.compiled import needs_servo

pytest.importorskip("pylsl", reason="pylsl is not installed: pip install 'liquid-study[lsl]'")
pytest.importorskip("serial", reason="pyserial is not installed: pip install 'liquid-study[triggers]'")
slow = pytest.mark.slow


@needs_servo
@pytest.mark.parametrize("seconds", [pytest.param(3, marks=slow), pytest.param(60, marks=[slow, pytest.mark.nightly])])
def test_every_sample_and_marker_arrives_with_the_servos_time(seconds: int) -> None:
    measured = measure_streams(seconds, ending=threading.Event())
    assert measured.samples_sent > 500 * seconds
    assert (measured.samples_lost, measured.intact) == (0, True)
    assert measured.markers_sent > 10 * seconds
    assert measured.markers_lost == 0
    assert len(measured.errors_us) == measured.markers_sent
    assert measured.error_p99_ms <= 1.0
    assert measured.arrivals_ms.min() > -1.0
    assert measured.met


@pytest.mark.nightly
@needs_servo
@slow
@pytest.mark.skipif(not hasattr(os, "openpty"), reason="this system has no virtual ports")
def test_each_event_is_one_byte_at_a_reader_of_a_virtual_port() -> None:
    measured = triggers.measure_triggers(triggers.VIRTUAL, 1.0, ending=threading.Event())
    assert measured.read_us is not None
    assert measured.high_ms is not None
    assert len(measured.read_us) == len(measured.written_us) >= 5
    assert measured.wrong == 0
    assert measured.read_us.min() > 0
    assert np.median(measured.high_ms) >= 9.0
    assert "wrong or missing bytes: 0" in triggers.triggers_evidence(measured).text


def test_a_port_that_is_not_there_is_named() -> None:
    with pytest.raises(OutletError, match="serial:/nowhere/ttyUSB7 cannot be opened"):
        triggers.measure_triggers("serial:/nowhere/ttyUSB7", 1.0, ending=threading.Event())
