"""Footage from a file: which frame is shown when, from the beginning of each trial, again and again."""

import time
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from study_app.errors import VideoError

pytest.importorskip("av", reason="the optional extra video is not installed")

from study_app.video import sources
from study_app.video.encoding import VideoWriter
from study_app.video.sources import Footage
from tests.video.clips import number_in, write_clip

FRAMES, RATE_HZ = 12, 30
PERIOD_NS = round(1e9 / RATE_HZ)
SIZE = (320, 180)


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("clips") / "clip.mp4"
    write_clip(path, frames=FRAMES, size=SIZE, rate_hz=RATE_HZ)
    return path


@pytest.fixture
def footage(clip: Path) -> Iterator[Footage]:
    opened_footage = Footage(clip)
    yield opened_footage
    opened_footage.close()
    assert not opened_footage.thread.is_alive()


def pixels_of(frame: Any) -> Any:
    return np.frombuffer(frame.pixels, np.uint8).reshape(frame.height, frame.stride)[:, : 4 * frame.width]


def decoded_frame(footage: Footage, moment_ns: int, number: int | None = None) -> Any:
    """Return the frame of a moment once it is decoded; with ``number``, wait for that frame."""
    until = time.perf_counter() + 10
    while time.perf_counter() < until:
        frame = footage.frame_at(moment_ns)
        if frame is not None and number in (None, frame.number):
            return frame
        time.sleep(0.002)
    raise AssertionError(f"frame {number} was not decoded: {footage.frame_at(moment_ns)}")


def test_footage_runs_from_the_beginning_of_the_trial_and_again(footage: Footage) -> None:
    footage.rewind()
    first = decoded_frame(footage, 5_000)
    assert (first.number, number_in(pixels_of(first)), first.age_ns) == (0, 0, 0)
    assert decoded_frame(footage, 900_000_000_000).number == 0  # it stands until the trial begins
    footage.begin(1_000)
    for number in range(2 * FRAMES + 3):
        frame = decoded_frame(footage, 1_000 + number * PERIOD_NS + PERIOD_NS // 2, number)
        assert number_in(pixels_of(frame)) == number % FRAMES
        assert abs(frame.due_ns - (1_000 + number * PERIOD_NS)) < 1_000_000


def test_a_rewound_footage_shows_its_first_frame_before_anything_is_decoded_again(footage: Footage) -> None:
    footage.begin(0)
    decoded_frame(footage, 5 * PERIOD_NS + 1_000_000, 5)
    with footage._changed:  # the decoder waits for this lock
        footage.rewind()
        first = footage.frame_at(7 * PERIOD_NS)
    for frame in (first, decoded_frame(footage, 7 * PERIOD_NS)):
        assert frame is not None
        assert (frame.number, number_in(pixels_of(frame))) == (0, 0)


def test_frames_that_are_overdue_are_skipped_and_keep_their_numbers(footage: Footage) -> None:
    footage.rewind()
    footage.begin(0)
    later = decoded_frame(footage, 200 * PERIOD_NS + 1_000_000, 200)
    assert number_in(pixels_of(later)) == 200 % FRAMES


def test_frames_are_scaled_to_the_tank_with_their_own_ratio(footage: Footage) -> None:
    footage.fit(640, 200)
    footage.rewind()
    footage.begin(0)
    frame = decoded_frame(footage, 20 * PERIOD_NS + 1_000_000, 20)
    assert frame.height == 200
    assert abs(frame.width / frame.height - SIZE[0] / SIZE[1]) < 0.01
    assert number_in(pixels_of(frame)) == 20 % FRAMES


def test_a_written_video_has_each_picture_in_its_place_size_and_colour(tmp_path: Path) -> None:
    """Of odd sizes the last row and column are lost; blue, green and red are exchanged nowhere."""
    import av

    colours = [(40, 90, 200), (200, 40, 90), (90, 200, 40)]
    writer = VideoWriter((67, 49), 25)
    for colour in colours:
        picture = np.zeros((49, 67, 4), np.uint8)
        picture[:24, :33, :3] = colour
        writer.add(picture)
    file = tmp_path / "written.mp4"
    file.write_bytes(writer.finish())
    with av.open(str(file)) as container:
        stream = container.streams.video[0]
        assert stream.average_rate == 25
        pictures = [frame.to_ndarray(format="bgr24").astype(int) for frame in container.decode(stream)]
    assert [picture.shape for picture in pictures] == [(48, 66, 3)] * 3
    for picture, colour in zip(pictures, colours, strict=True):
        assert np.median(picture[4:20, 4:28], axis=(0, 1)) == pytest.approx(colour, abs=12)
        assert picture[30:, 40:].mean() < 12
    assert Footage(file).size == (66, 48)


def test_a_file_that_fails_later_stops_without_its_name(clip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opens = vars(sources)["open_video"]

    def once(source: str, **options: str) -> Any:
        monkeypatch.setattr(sources, "open_video", gone)
        return opens(source, **options)

    def gone(*_: object, **__: object) -> Any:
        raise VideoError("it is gone")

    monkeypatch.setattr(sources, "open_video", once)
    footage = Footage(clip)
    footage.thread.join(10)
    with pytest.raises(VideoError, match=r"one of the study's videos stopped \(it is gone\)") as refused:
        footage.frame_at(0)
    assert clip.name not in str(refused.value)


def test_an_ffmpeg_error_that_is_not_a_system_error_stops_it_too(clip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from av.error import ExternalError

    footage = Footage(clip)

    def fail(_scaler: Any, _frame: Any) -> Any:
        raise ExternalError(1, "generic error in an external library")

    monkeypatch.setattr("study_app.video.sources.Scaler.pixels", fail)
    footage.rewind()
    footage.thread.join(10)
    with pytest.raises(VideoError, match=r"stopped \(generic error in an external library\)"):
        footage.frame_at(0)
    footage.close()


def unreadable_name(clip: bytes) -> bytes:
    """Damage the name of the handler; PyAV ignores it from version 19 on."""
    if int(version("av").partition(".")[0]) >= 19:
        pytest.skip("this version of PyAV reads such a file")
    return clip.replace(b"VideoHandler", b"\xff" * 12)


@pytest.mark.parametrize(
    "damage",
    [
        lambda _clip: b"",
        lambda _clip: b"no video at all" * 100,
        lambda clip: clip[: len(clip) // 2],
        lambda clip: clip.replace(b"avc1", b"zzzz"),  # a codec that there is not
        lambda clip: clip.replace(b"trak", b"zzzz"),
        unreadable_name,
        lambda _clip: b"ffconcat version 1.0\nfile clip.mp4\n",
        lambda _clip: b"#EXTM3U\n#EXTINF:1,\nclip.mp4\n",
    ],
)
def test_an_invalid_video_file_is_refused_in_one_line(tmp_path: Path, damage: Callable[[bytes], bytes]) -> None:
    write_clip(tmp_path / "clip.mp4", frames=6, size=(64, 48))
    broken = tmp_path / "broken.mp4"
    broken.write_bytes(damage((tmp_path / "clip.mp4").read_bytes()))
    with pytest.raises(VideoError, match=r"broken\.mp4 cannot be shown: .+; specify a playable video file") as refused:
        Footage(broken)
    assert "\n" not in str(refused.value)
    assert not any(word in str(refused.value) for word in ("NoneType", "codec can't", "Invalid argument"))
