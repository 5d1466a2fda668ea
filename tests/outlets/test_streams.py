"""Both streams as a recorder in another process gets them, on this computer alone."""

from __future__ import annotations

import threading
import time
from collections import deque
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from study_app.errors import OutletError
from study_app.haptics.model.layout import LIMITER_ENERGY, LIMITER_SLEW, SAMPLE
from study_app.outlets.markers import SinkKind, SinkThread
from study_app.outlets.session_outlets import Outlets, OutletStatus, open_sink
from study_app.outlets.streams import CHANNELS, SampleStream, channels_of
from tests.outlets.sinks import Recorder, Sink, marker
from tests.strangers import PATIENCE_S, visited

pylsl = pytest.importorskip("pylsl", reason="pylsl is not installed: pip install 'liquid-study[lsl]'")
slow = pytest.mark.slow

START_NS = 7_000_000_000


class Telemetry:
    """Gives samples in batches, as a servo's telemetry does."""

    def __init__(self) -> None:
        self.batches: deque[Any] = deque()
        self.dropped = 0

    def reader(self) -> Telemetry:
        return self

    def read(self) -> Any:
        return self.batches.popleft() if self.batches else samples_of(0)


class Servo:
    rate_hz = 1000.0

    def __init__(self) -> None:
        self.telemetry = Telemetry()

    def now_ns(self) -> int:
        return time.perf_counter_ns()


def samples_of(count: int, first: int = 0) -> Any:
    recording = np.zeros(count, SAMPLE)
    ticks = first + np.arange(count)
    recording["tick"], recording["time_ns"] = ticks, START_NS + 1_000_000 * ticks
    for axis in range(3):
        recording["position_m"][:, axis] = 0.001 * ticks + axis
        recording["velocity_mps"][:, axis] = 0.01 * ticks + 10 * axis
        recording["device_force_n"][:, axis] = 0.1 * ticks + 100 * axis
    recording["limiters"] = np.where(ticks % 2, LIMITER_ENERGY | LIMITER_SLEW, 0)
    return recording


def test_channels_are_position_velocity_force_sent_limiters_and_tick() -> None:
    samples = samples_of(2, first=1)
    samples["tick"] += 2**24  # as 32-bit floats, the last would be even
    samples["command_n"], samples["force_n"] = -5, -6
    expected = [
        [0.001, 1.001, 2.001, 0.01, 10.01, 20.01, 0.1, 100.1, 200.1, LIMITER_ENERGY | LIMITER_SLEW, 1],
        [0.002, 1.002, 2.002, 0.02, 10.02, 20.02, 0.2, 100.2, 200.2, 0, 2],
    ]
    np.testing.assert_allclose(channels_of(samples), expected, rtol=1e-6)
    assert len(CHANNELS) == 11


@slow
def test_a_recorder_gets_every_sample_with_the_time_of_its_reading() -> None:
    servo = Servo()
    stream = SampleStream(servo.telemetry, servo.rate_hz, servo.now_ns)
    assert not stream.listens
    recorder = Recorder("liquid-study samples", 250)
    assert stream.listens
    servo.telemetry.batches.extend((samples_of(17), samples_of(232, first=17), samples_of(1, first=249)))
    stream_content = recorder.found()
    servo.telemetry.dropped = 12
    stream.close()
    assert not stream.listens
    values, stamps_s = zip(*stream_content["samples"], strict=True)
    np.testing.assert_array_equal(np.array(values, np.float32), channels_of(samples_of(250)))
    offset_s = pylsl.local_clock() - 1e-9 * time.perf_counter_ns()
    np.testing.assert_allclose(np.array(stamps_s), 1e-9 * samples_of(250)["time_ns"] + offset_s, atol=1e-3)
    assert np.diff(stamps_s) == pytest.approx(1e-3, abs=1e-6)
    assert stream_content["rate"] == 1000.0
    assert stream.sent == 250
    assert stream.lost == "12 samples could not be sent in time: this computer is too busy"
    for label, unit in (("position_x", "m"), ("velocity_z", "m/s"), ("force_y", "N")):
        assert f"<label>{label}</label>\n\t\t\t\t<unit>{unit}</unit>" in stream_content["xml"]
    assert "<label>limiters</label>" in stream_content["xml"]


@slow
def test_a_recorder_gets_markers_with_the_times_of_their_events() -> None:
    thread = SinkThread(open_sink("lsl", time.perf_counter_ns))
    assert thread.sink.listens is False
    recorder = Recorder("liquid-study markers", 3)
    assert thread.sink.listens is True
    markers = [marker(trial, time_s=START_NS * 1e-9 + trial) for trial in (1, 2, 3)]
    for sent_marker in markers:
        thread.mark(sent_marker)
    stream = recorder.found()
    thread.close(5)
    assert thread.lost == ""
    offset_s = pylsl.local_clock() - 1e-9 * time.perf_counter_ns()
    for (texts, stamp_s), sent_marker in zip(stream["samples"], markers, strict=True):
        assert texts == [sent_marker.text]
        assert stamp_s == pytest.approx(1e-9 * sent_marker.time_ns + offset_s, abs=1e-3)
    assert stream["rate"] == 0.0
    assert "<trial_started>10</trial_started>" in stream["xml"]


@slow
def test_strangers_at_the_port_of_a_stream_disturb_neither_its_recorder_nor_its_end() -> None:
    thread = SinkThread(open_sink("lsl", time.perf_counter_ns))
    description = thread.sink._outlet.get_info().as_xml()
    with visited(int(description.partition("<v4data_port>")[2].partition("<")[0])):
        recorder = Recorder("liquid-study markers", 3)
        for trial in (1, 2, 3):
            thread.mark(marker(trial))
        assert [texts for texts, _ in recorder.found()["samples"]] == [[marker(trial).text] for trial in (1, 2, 3)]
        began_s = time.perf_counter()
        thread.close(5)
        assert time.perf_counter() - began_s < PATIENCE_S
    assert thread.lost == ""


@slow
@pytest.mark.nightly
def test_a_killed_recorder_does_not_affect_the_next() -> None:
    thread = SinkThread(open_sink("lsl", time.perf_counter_ns))
    servo = Servo()
    stream = SampleStream(servo.telemetry, servo.rate_hz, servo.now_ns)
    recorders = [Recorder(f"liquid-study {name}", 10_000) for name in ("markers", "samples")]
    for recorder in recorders:
        recorder.kill()
    servo.telemetry.batches.append(samples_of(20))
    thread.mark(marker(1))
    later = [Recorder(f"liquid-study {name}", 1) for name in ("markers", "samples")]
    thread.mark(marker(2))
    servo.telemetry.batches.append(samples_of(1, first=20))
    texts, values = [recorder.found()["samples"][-1][0] for recorder in later]
    assert texts == [marker(2).text]
    np.testing.assert_array_equal(np.array(values, np.float32), channels_of(samples_of(1, first=20))[0])
    thread.close(5)
    stream.close()
    assert (thread.lost, stream.lost, stream.sent) == ("", "", 21)
    assert not [
        thread_of_outlet for thread_of_outlet in threading.enumerate() if thread_of_outlet.name.startswith("outlet")
    ]


@slow
@pytest.mark.parametrize(
    ("choice", "blinding", "streams", "withheld"),
    [
        ("off", "single", False, False),
        ("single-blind", "single", True, False),
        ("single-blind", "double", False, True),
        ("always", "double", True, False),
    ],
)
def test_samples_are_off_in_double_blind_studies_unless_they_are_asked_for(
    choice: Any, blinding: str, streams: bool, withheld: bool
) -> None:
    outlets = Outlets((), choice, Servo(), blinding)
    status_rows = [(status.title, status.listens, status.withheld, status.shows_force) for status in outlets.statuses()]
    descriptions = outlets.described
    outlets.close()
    assert not [
        thread_of_outlet for thread_of_outlet in threading.enumerate() if thread_of_outlet.name.startswith("outlet")
    ]
    assert (list(descriptions) == ["LSL samples"]) == streams
    if streams or withheld:
        assert status_rows == [("LSL samples", None if withheld else False, withheld, streams and blinding == "double")]
    else:
        assert status_rows == []


def test_an_unexpected_driver_error_does_not_stop_the_session(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_place: str, _now_ns: Any) -> Any:
        raise RuntimeError("could not create the stream outlet")

    kinds = {"lsl": SinkKind("lsl", "LSL markers", example="lsl", open=fail)}
    monkeypatch.setattr("study_app.outlets.session_outlets.SINKS", kinds)
    outlets = Outlets(("lsl",), "off", Servo(), "double")
    assert outlets.lost == {"LSL markers": "RuntimeError: could not create the stream outlet"}
    outlets.close()


def test_the_state_of_each_outlet_has_its_own_title_and_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    ports = {"first": Sink(fails_at=7), "second": Sink()}
    ports["first"].title, ports["second"].title, ports["second"].listens = "First port", "Second port", True
    samples = SimpleNamespace(title="LSL samples", listens=False, described={"stream": "s"}, lost="busy", closed=False)
    samples.close = lambda: setattr(samples, "closed", True)
    stream = SimpleNamespace(opened=[])

    def open_stream(telemetry: Any, rate_hz: float, now_ns: Any) -> Any:
        stream.opened.append((telemetry, rate_hz, now_ns()))
        return samples

    open_stream.title = "LSL samples"  # type: ignore[attr-defined]
    kinds = {
        name: SinkKind(name, sink.title, example=f"{name}:1", open=lambda _place, _now_ns, sink=sink: sink)
        for name, sink in ports.items()
    }

    def refuse(place: str, _now_ns: Any) -> Any:
        raise OutletError(f"{place} is not there")

    kinds["fourth"] = SinkKind("fourth", "Fourth port", example="fourth:1", open=refuse)
    monkeypatch.setattr("study_app.outlets.session_outlets.SINKS", kinds)
    monkeypatch.setattr("study_app.outlets.session_outlets.SampleStream", open_stream)
    servo = SimpleNamespace(telemetry=Telemetry(), rate_hz=987.0, now_ns=lambda: 456)
    outlets = Outlets(("first:1", "second:1", "third:1", "fourth:COM7"), "always", servo, "double")
    assert stream.opened == [(servo.telemetry, 987.0, 456)]
    for trial in (6, 7, 8):
        outlets.mark(marker(trial))
    assert ports["first"].closed.wait(5)
    unplugged, unknown = "test:port failed: it was unplugged", outlets.lost["Triggers"]
    lost = {"First port": unplugged, "LSL samples": "busy", "Triggers": unknown, "Fourth port": "COM7 is not there"}
    assert outlets.lost == lost
    assert unknown == "'third:1' is not a marker address: use one such as first:1, second:1, fourth:1"
    assert outlets.statuses() == (
        OutletStatus(title="First port", lost=unplugged),
        OutletStatus(title="Second port", listens=True),
        OutletStatus(title="LSL samples", listens=False, lost="busy", shows_force=True),
        OutletStatus(title="Triggers", lost=unknown),
        OutletStatus(title="Fourth port", lost="COM7 is not there"),
    )
    port = {"address": "test:port"}
    assert list(outlets.described.items()) == [
        ("First port", port),
        ("Second port", port),
        ("LSL samples", {"stream": "s"}),
        ("Triggers", {"failed": unknown}),
        ("Fourth port", {"failed": "COM7 is not there"}),
    ]
    outlets.close()
    assert ports["second"].closed.is_set()
    assert samples.closed
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("outlet")]
    assert [sink.sent for sink in ports.values()] == [[marker(6)], [marker(6), marker(7), marker(8)]]
