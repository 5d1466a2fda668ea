"""A recording of real streams (XDF) beside the study that sent them: what is lost, added or late is found."""

import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.outlets.markers import SinkThread
from study_app.outlets.session_outlets import open_sink
from study_app.outlets.streams import SampleStream
from study_app.session.simulated.rehearsal import rehearse
from tests.outlets.collector import collecting
from tests.outlets.sinks import Recorder
from tests.outlets.test_streams import Servo, samples_of
from tests.outlets.xdf_file import write_xdf

lsl = pytest.importorskip("pylsl", reason="pylsl is not installed: pip install 'liquid-study[lsl]'")
pytest.importorskip("pyxdf", reason="pyxdf is not installed: pip install 'liquid-study[lsl]'")
pytestmark = pytest.mark.slow

Rows = list[tuple[list[Any], float]]
OFFSETS = [(100.0 + 5 * number, 0.25 + 2e-6 * 5 * number) for number in range(20)]
LAST = 2**24
OF_LINE = "ms of a straight line"


@pytest.fixture(scope="module")
def streamed_session(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[tuple[str, Rows]]]:
    """A rehearsed study, and the markers and 300 samples of a session that a recorder process received."""
    study = tmp_path_factory.mktemp("streamed") / "study"
    with collecting() as collector:
        rehearse("demo", participants=2, seed=1, results=study)
    servo = Servo()
    thread = SinkThread(open_sink("lsl", servo.now_ns))
    stream = SampleStream(servo.telemetry, servo.rate_hz, servo.now_ns)
    markers = collector.markers[: 1 + [marker.event for marker in collector.markers].index("session_ended")]
    recorders = [Recorder(f"liquid-study {n}", c) for n, c in (("markers", len(markers)), ("samples", 300))]
    for marker in markers:
        thread.mark(marker)
    servo.telemetry.batches.append(samples_of(300, first=LAST - 100))
    streams = [recorder.found() for recorder in recorders]
    thread.close(5)
    stream.close()
    return study, [(stream["xml"], stream["samples"]) for stream in streams]


def without(first: int, last: int) -> Callable[[Rows], Rows]:
    return lambda rows: rows[:first] + rows[last:]


def late(delay_s: float) -> Callable[[Rows], Rows]:
    return lambda rows: rows[:50] + [(row, stamp_s + delay_s) for row, stamp_s in rows[50:]]


def added(place: int) -> Callable[[Rows], Rows]:
    return lambda rows: [*rows[:place], (['{"event":"note","t_s":0.5}'], rows[place][1]), *rows[place:]]


@pytest.mark.parametrize(
    ("markers", "samples", "said", "code"),
    [
        (list, list, "300 recorded, 0 lost, 0 late\n", 0),
        (list, late(0.004), "300 recorded, 0 lost, 1 late, at most 5 ms between two ticks\n", 0),
        (list, late(0.0006), "300 recorded, 0 lost, 1 late, at most 1.6 ms between two ticks\n", 0),
        (list, late(0.0004), "300 recorded, 0 lost, 0 late\n", 0),
        (list, without(90, 110), "20 samples lost in 1 gap; the first after 0.089 s\n", 3),
        (without(12, 13), list, "own.xdf does not contain 1 marker recorded in the journal; the first: {", 3),
        (
            added(9),
            list,
            'own.xdf contains 1 marker not recorded in the journal, starting with {"event":"note","t_s":0.5}: ',
            3,
        ),
        (added(0), list, "warning: own.xdf: contains 1 marker from outside this study's sessions\n", 0),
        (
            without(0, 8),
            list,
            "4 of the 32 markers fall outside the recording own.xdf: 4 before the recording and 0 after it",
            0,
        ),
        (without(0, 9999), list, "own.xdf: it does not contain markers from this study's sessions", 3),
    ],
)
def test_missing_parts_of_a_recording_are_found(
    streamed_session: Any, tmp_path: Path, markers: Any, samples: Any, said: str, code: int
) -> None:
    study, ((first, texts), (second, values)) = streamed_session
    file = write_xdf(tmp_path / "own.xdf", [(first, markers(texts), OFFSETS), (second, samples(values), OFFSETS)])
    result = CliRunner().invoke(commands, ["verify", str(study), "--xdf", str(file)])
    assert said in result.output
    assert result.exit_code == code
    clock = r"clock of 'liquid-study samples': 0 resets; drift \+2 ppm over 95 s, with offsets within (\S+) ms of"
    (offset_ms,) = re.findall(clock, result.output)
    assert float(offset_ms) < 1e-6
    if markers is list:
        assert re.search(
            r"sub-P001/ses-01: (\d+) of \1 recorded, 0 lost; times agree within [\d.e-]+ ms", result.output
        )
    assert "sub-P002" not in result.output


def test_an_empty_stream_beside_the_session_is_not_an_error(streamed_session: Any, tmp_path: Path) -> None:
    study, ((first, texts), _) = streamed_session
    for streams in ([(first, [], ()), (first, texts, OFFSETS)], [(first, texts, OFFSETS), (first, [], OFFSETS)]):
        file = write_xdf(tmp_path / "own.xdf", streams)
        result = CliRunner().invoke(commands, ["verify", str(study), "--xdf", str(file)])
        assert result.exit_code == 0
        assert "markers: none recorded\n" in result.output
        assert "no marker of this study's sessions" not in result.output


def test_a_reset_clock_is_reported(streamed_session: Any, tmp_path: Path) -> None:
    study, ((first, texts), _) = streamed_session
    offsets = [*OFFSETS, *((time_s - 99, offset_s + 60) for time_s, offset_s in OFFSETS)]
    file = write_xdf(tmp_path / "own.xdf", [(first, texts, offsets)])
    result = CliRunner().invoke(commands, ["verify", str(study), "--xdf", str(file)])
    assert "1 reset; drift +2 ppm over 95 s" in result.output
    assert "drift +2 ppm" in result.output.split("drift +2 ppm", 1)[1]


@pytest.mark.parametrize(
    ("times_s", "offsets_s", "drift"),
    [
        ((), (), "0 offsets measured, too few to estimate the drift"),
        ((7,), (0.25,), "1 offset measured, too few to estimate the drift"),
        ((7, 9), (0.25, 0.26), "0 resets"),
        ((7, 7, 7), (0.25, 0.26, 0.28), "0 resets"),
        # the middle offset is 3 ms below the line through the others, so 2 ms below the least-squares line
        (
            (100, 110, 120),
            (0.25, 0.2472, 0.2504),
            f"0 resets; drift +20 ppm over 20 s, with offsets within 2 {OF_LINE}",
        ),
        ((4, 4.5, 5), (0.25, 0.29, 0.27), f"0 resets; drift +2e+04 ppm over 1 s, with offsets within 20 {OF_LINE}"),
        ((0, 10, 20), (3, 3.98, 4.9), f"0 resets; drift +9.5e+04 ppm over 20 s, with offsets within 20 {OF_LINE}"),
        # the offset jumps at 30 s and 50 s, and the time steps back from 80 s to 60 s
        (
            (0, 10, 20, *(30, 40), *(50, 65, 80), *(60, 75)),
            (1, 0.99974, 1.00008, *(9, 9.1), *(7, 7.00051, 6.99982), *(6.9, 6.8)),
            f"3 resets; drift +4 ppm over 20 s, with offsets within 0.2 {OF_LINE}; "
            f"drift -6 ppm over 30 s, with offsets within 0.4 {OF_LINE}",
        ),
    ],
)
def test_the_drift_of_a_clock_is_fitted_to_three_offsets_or_more(
    streamed_session: Any, tmp_path: Path, times_s: tuple[float, ...], offsets_s: tuple[float, ...], drift: str
) -> None:
    study, (_, (samples_xml, samples)) = streamed_session
    offsets = tuple(zip(times_s, offsets_s, strict=True))
    file = write_xdf(tmp_path / "own.xdf", [(samples_xml, samples, offsets)])
    result = CliRunner().invoke(commands, ["verify", str(study), "--xdf", str(file)], catch_exceptions=False)
    assert f"clock of 'liquid-study samples': {drift}\n" in result.output


@pytest.mark.parametrize(
    "content",
    [
        *(None, b"", b"XDF:\x01", b"no recording", ("liquid-study markers", "EEG"), ("liquid-study markers", "")),
        *(("<channel_count>1<", "<channel_count>0<"), ("<nominal_srate>1000.0", "<nominal_srate>0"), ("label>", "x>")),
    ],
)
def test_a_file_that_cannot_be_used_ends_in_one_line(streamed_session: Any, tmp_path: Path, content: Any) -> None:
    study, streams = streamed_session
    file = tmp_path / "own.xdf"
    if isinstance(content, tuple):
        xml, rows = next(stream for stream in reversed(streams) if content[0] in stream[0])
        write_xdf(file, [(xml.replace(*content), rows, ())])
    elif content is not None:
        file.write_bytes(content)
    result = CliRunner().invoke(commands, ["verify", str(study), "--xdf", str(file)])
    assert "own.xdf" in str(result.exception)
    assert type(result.exception).__name__ == "StoreError"


def test_verify_without_the_xdf_reader_names_the_extra(streamed_session: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyxdf", None)
    result = CliRunner().invoke(commands, ["verify", str(streamed_session[0]), "--xdf", "own.xdf"])
    assert str(result.exception) == "reading an XDF file needs pyxdf: pip install 'liquid-study[lsl]'"
