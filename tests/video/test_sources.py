"""The videos of a study: closed completely, and described without login data."""

from __future__ import annotations

import errno
import os
import threading
import time
from collections import deque
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.errors import VideoError
from study_app.protocol.load import parse
from study_app.protocol.model import Protocol
from study_app.protocol.source.files import source_bytes
from study_app.protocol.trials import MOST_DELAY_MS
from study_app.session.transitions.events import Broke, broken
from study_app.store import workstation
from study_app.store.workstation import MachineSettings
from study_app.video import sources
from study_app.video.frames import VideoFrame, VideoStatistics, stopped_error
from study_app.video.sources import NOT_SHOWN, Camera, Videos, missing_on_computer, without_login
from tests.video.clips import write_clip


class FakeCamera:
    """A camera that opens on a signal of the test."""

    opens: threading.Event
    opened_cameras: list[FakeCamera]
    fault = ""

    def __init__(self, source: str, _now_ns: Any, holds_s: float) -> None:
        if self.fault:
            raise VideoError(f"the camera {source} cannot be used: {self.fault}")
        self.opened_cameras.append(self)
        self.works = True
        assert self.opens.wait(10)
        self.source, self.size, self.closed, self.held_s = source, (640, 480), False, holds_s
        self.newest = VideoFrame(
            number=0, width=2, height=2, stride=8, pixels=bytes(16), due_ns=0, age_ns=None, period_ns=33_333_333
        )

    def fit(self, width: int, height: int) -> None:
        self.fitted = (width, height)

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def camera(monkeypatch: pytest.MonkeyPatch) -> type[FakeCamera]:
    monkeypatch.setattr(FakeCamera, "opens", threading.Event(), raising=False)
    monkeypatch.setattr(FakeCamera, "opened_cameras", [], raising=False)
    monkeypatch.setattr(FakeCamera, "fault", "")
    monkeypatch.setattr(sources, "Camera", FakeCamera)
    return FakeCamera


def with_camera() -> bytes:
    """Return the demo in format 2, with a condition that shows the camera."""
    text = source_bytes("demo").decode()
    head = '[conditions.thick]\nliquid = "thick"'
    assert head in text
    return text.replace(head, '[conditions.thick]\nliquid = "thin"\nview = "camera"').encode()


@pytest.fixture
def study() -> Protocol:
    return parse(with_camera(), "demo.toml")


@pytest.fixture
def camera_study(tmp_path: Path) -> Path:
    file = tmp_path / "demo.toml"
    file.write_bytes(with_camera())
    return file


class Unknown(Exception):
    """An error of the system that FFmpeg does not know."""

    errno, strerror = errno.EACCES, f"Error number -{errno.EACCES} occurred"


@pytest.mark.parametrize(
    ("error", "reason"), [(OSError("device is busy"), "device is busy"), (Unknown(), os.strerror(errno.EACCES))]
)
def test_a_camera_that_fails_before_its_first_frame_is_refused_at_once(
    monkeypatch: pytest.MonkeyPatch, error: Exception, reason: str
) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        time.sleep(0.02)  # who opens it waits by now
        raise error

    monkeypatch.setattr(sources, "open_video", refuse)
    began = time.perf_counter()
    with pytest.raises(VideoError, match=f"v4l2:/dev/video9 cannot be used: {reason}$"):
        Camera("v4l2:/dev/video9", time.perf_counter_ns, 0.5)
    assert time.perf_counter() - began < sources.OPENS_S / 2


def videos(study: Protocol, camera: str = "v4l2:/dev/video0") -> Videos:
    return Videos(study, Path("/nowhere"), camera, lambda: 0)


def test_a_camera_that_opens_after_all_were_closed_is_closed_too(study: Protocol, camera: type[FakeCamera]) -> None:
    every = videos(study)
    opening = threading.Thread(target=every.open)
    opening.start()
    every.close()  # does not wait for the camera
    camera.opens.set()
    opening.join(10)
    (opened_camera,) = camera.opened_cameras
    assert opened_camera.closed


def test_a_camera_is_described_by_its_size_rate_and_age(study: Protocol, camera: type[FakeCamera]) -> None:
    camera.opens.set()
    every = videos(study, "v4l2:/dev/video3")
    assert every.views == ("camera",)
    assert every.open().about == "camera, 640 × 480, 30 Hz, age unknown"
    described = {"source": "v4l2:/dev/video3", "size": [640, 480], "rate_hz": 30.0, "age": "unknown"}
    assert every.describe() == {"camera": described}
    (opened_camera,) = camera.opened_cameras
    assert every.source("camera") is opened_camera
    opened_camera.newest = replace(opened_camera.newest, age_ns=12_400_000, period_ns=16_000_000)
    assert every.open().about == "camera, 640 × 480, 62.5 Hz, 12 ms old"
    assert every.describe() == {"camera": described | {"rate_hz": 62.5, "age": "from the source's time stamps"}}
    every.fit(1152, 648)
    assert opened_camera.fitted == (1152, 648)


def test_a_camera_holds_frames_for_the_longest_delay_of_a_condition_that_shows_it(camera: type[FakeCamera]) -> None:
    camera.opens.set()

    def held_s(*delays_ms: float, varied: str = "force_delay_ms") -> float:
        conditions_shown = [
            SimpleNamespace(shows_video=True, view="camera", footage_sha256="", delay_ms=ms) for ms in delays_ms
        ]
        drawn = SimpleNamespace(shows_video=False, view="drawn", footage_sha256="", delay_ms=900.0)
        study: Any = SimpleNamespace(
            conditions=dict(enumerate([*conditions_shown, drawn])), stimuli={"delays": SimpleNamespace(vary=varied)}
        )
        every = videos(study, "")
        assert every.views == ("camera",)
        every.open()
        assert camera.opened_cameras[-1].source == sources.USUAL
        return camera.opened_cameras[-1].held_s

    assert [held_s(250, 137.5), held_s(137.5, 250), held_s(0)] == [0.25, 0.25, 0.0]
    assert held_s(250, varied="delay_ms") == MOST_DELAY_MS / 1000


def test_a_missing_camera_is_reported_and_missing_footage_is_an_error(
    study: Protocol, camera: type[FakeCamera], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sources, "is_installed", lambda: True)
    camera.opens.set()
    nowhere = Path("/nowhere")
    assert missing_on_computer(study, nowhere, "v4l2:/dev/video3", lambda: 0) == ""
    assert [
        (opened_camera.source, opened_camera.held_s, opened_camera.closed) for opened_camera in camera.opened_cameras
    ] == [("v4l2:/dev/video3", 0.0, True)]
    camera.fault = "no such device"
    assert missing_on_computer(study, nowhere, "dshow:video=A", lambda: 0) == (
        "the camera dshow:video=A cannot be used: no such device"
    )
    files: Any = SimpleNamespace(conditions={"sea": SimpleNamespace(shows_video=True, view="waves.mp4")})
    with pytest.raises(VideoError, match=r"^\S+waves\.mp4 cannot be shown: "):
        missing_on_computer(files, nowhere, "", lambda: 0)
    monkeypatch.setattr(sources, "is_installed", lambda: False)
    assert missing_on_computer(files, nowhere, "", lambda: 0).startswith("a video needs the optional video extra")
    assert missing_on_computer(parse(source_bytes("demo"), "demo.toml"), nowhere, "", lambda: 0) == ""


def test_the_receipt_has_neither_name_nor_password_of_a_camera(study: Protocol, camera: type[FakeCamera]) -> None:
    camera.opens.set()
    every = videos(study, "rtsp://operator:se@cret@192.168.0.7:554/live?key=secret")
    assert every.open().fault == ""
    assert every.describe()["camera"]["source"] == "rtsp://192.168.0.7:554"
    every.close()
    assert camera.opened_cameras[0].closed


@pytest.mark.parametrize(
    ("source", "public_address"),
    [
        ("rtsp://operator:secret@camera.example/live", "rtsp://camera.example"),
        ("rtsp://operator:se@cret@camera.example:554/live", "rtsp://camera.example:554"),
        ("http://camera.example/live?user=operator&password=secret#secret", "http://camera.example"),
        ("http://operator:secret@[fd00::1]:8080/secret", "http://[fd00::1]:8080"),
        ("tcp://127.0.0.1:9", "tcp://127.0.0.1:9"),
        ("v4l2:/dev/video0", "v4l2:/dev/video0"),
        ("dshow:video=NAME", "dshow:video=NAME"),
        *(
            (unclear, NOT_SHOWN)
            for unclear in (
                "rtsp://operator:se/cret@camera.example/live",
                "rtsp://operator:1/cret@camera.example/live",  # 1 could be a port
                "rtsp://operator:1?cret@camera.example/live",
                "rtsp://operator:1#cret@camera.example/live",
                "rtsp://operator:secret",
                "rtsp://operator:secret@",
                "rtsp://operator%3Asecret%40camera.example/live",
                "rtsp://operator:123456",
                "rtsp://operator:secret@camera.example:port/live",
                "rtsp://operator:secret@[fd00::1/live",
                "rtsp://operator:secret@fd00::1]/live",
                "rtsp://operator:secret@[secret]/live",
                "rtsp://operator:secret@a\u2100b/live",  # a sign that Unicode writes as a/c
                "//operator:secret@camera.example/live",
                "operator:secret@camera.example/live",
                "async:http://operator:secret@camera.example/live",
                "rtsp:\\\\operator:secret@camera.example\\live",
                "/home/operator/secret.ts",
                "",
            )
        ),
    ],
)
def test_only_scheme_and_host_of_an_address_are_shown(source: str, public_address: str) -> None:
    assert without_login(source) == public_address


@pytest.mark.parametrize(
    ("installed", "words"),
    [(True, "Note: the camera tcp://127.0.0.1:9 cannot be used: "), (False, "pip install 'liquid-study[video]'")],
)
def test_check_notes_why_this_machine_cannot_show_the_camera(
    camera_study: Path, installed: bool, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:

    workstation.save_settings(MachineSettings(camera="tcp://127.0.0.1:9"))
    if not installed:
        monkeypatch.setattr(sources, "is_installed", lambda: False)
    checked = CliRunner().invoke(commands, ["check", str(camera_study)])
    assert checked.exit_code == 0, checked.output
    assert "Statements" in checked.output
    assert words in checked.output.splitlines()[-1]


def test_a_video_that_failed_is_opened_again_without_its_name(study: Protocol, camera: type[FakeCamera]) -> None:
    camera.opens.set()
    every = videos(study)
    every.open()
    every.reopen()
    assert len(camera.opened_cameras) == 1
    camera.opened_cameras[0].works = False
    every.reopen()
    assert [opened_camera.closed for opened_camera in camera.opened_cameras] == [True, False]
    camera.opened_cameras[1].works = False
    camera.fault = "no such device"
    with pytest.raises(
        VideoError,
        match=r"^one of the study's videos cannot be opened: check the camera and the "
        r"files$",
    ):
        every.reopen()


def test_footage_that_was_replaced_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("av", reason="the optional extra video is not installed")
    clip = tmp_path / "waves.mp4"
    write_clip(clip, frames=2, size=(64, 48))
    file = tmp_path / "demo.toml"
    file.write_bytes(with_camera().replace(b'"camera"', b'"waves.mp4"'))
    every = Videos(parse(source_bytes(file), str(file)), tmp_path, "", lambda: 0)
    try:
        assert every.open().fault == ""
    finally:
        every.close()
    write_clip(clip, frames=3, size=(64, 48))
    again = Videos(parse(source_bytes(file), str(file)), tmp_path, "", lambda: 0)
    write_clip(clip, frames=4, size=(64, 48))
    assert again.open().fault == f"{clip} has changed since the study began: restore the original file"


def test_the_row_of_a_trial_counts_late_and_lost_frames_and_states_their_age() -> None:
    def frame(number: int, age_ms: float | None) -> VideoFrame:
        age_ns = None if age_ms is None else round(1e6 * age_ms)
        return VideoFrame(
            number=number,
            width=2,
            height=2,
            stride=8,
            pixels=bytes(16),
            due_ns=30_000_000 * number,
            age_ns=age_ns,
            period_ns=30_000_000,
        )

    statistics = VideoStatistics()
    assert set(statistics.columns().values()) == {None}
    for number, painted_ms, age_ms in ((0, 10.0, 80.0), (0, 99.0, 80.0), (1, 41.5, 90.0), (5, 191.0, None)):
        statistics.frame(round(1e6 * painted_ms), frame(number, age_ms), 0.01)
    assert statistics.columns() == {
        "video_frames": 3,
        "video_frames_late": 1,
        "video_frames_lost": 3,
        "video_delay_error_max_ms": pytest.approx(31.0),
        "video_age_mean_ms": pytest.approx(85.0),
    }


def test_a_video_that_stops_can_be_reconnected() -> None:
    error = stopped_error("it ended")
    assert isinstance(error, VideoError)
    assert broken(1.0, error) == Broke(1.0, str(error), "device")


def test_frames_are_counted_by_the_median_of_ten_gaps_once_there_are_ten() -> None:
    numbers = sources._FrameNumbers(100_000_000)
    frame_numbers = [numbers.next_number(0.02 * place) for place in range(10)]
    assert (frame_numbers, numbers.period_ns) == ([*range(10)], 100_000_000)
    assert [numbers.next_number(stamp_s) for stamp_s in (0.20, 0.26, 0.25, 0.27)] == [10, 13, 14, 15]
    assert numbers.period_ns == 20_000_000


@pytest.mark.parametrize(
    ("average_hz", "guessed_hz", "period_ns"),
    [
        (25, 50, 40_000_000),
        (None, 50, 20_000_000),
        (0.5, 50, 20_000_000),
        (90_000, None, 33_333_333),
        (1, None, 1_000_000_000),
        (240, None, 4_166_667),
        (None, 241, 33_333_333),
    ],
)
def test_the_period_is_that_of_the_header_between_1_and_240_hz_else_of_30_hz(
    average_hz: float | None, guessed_hz: float | None, period_ns: int
) -> None:
    stream = SimpleNamespace(average_rate=average_hz, guessed_rate=guessed_hz)
    assert sources.period_ns(stream) == period_ns


@pytest.mark.parametrize(
    ("stamp_s", "age_ns"),
    [(99.5, 500_000_000), (100.0005, 0), (100.002, None), (1e6 - 0.25, 250_000_000), (20.0, None), (None, None)],
)
def test_the_age_of_a_frame_is_by_the_clock_that_its_stamp_is_from(
    stamp_s: float | None, age_ns: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sources, "time", SimpleNamespace(perf_counter=lambda: 100.0, time=lambda: 1e6))
    assert sources._age_ns(stamp_s) == age_ns


def test_a_camera_shows_the_newest_ready_frame_and_states_why_it_ended() -> None:
    camera = Camera.__new__(Camera)
    now_ns = [40]
    camera._now_ns, camera._changed, camera._failure = lambda: now_ns[0], threading.Condition(), ""
    camera._frames = deque(
        VideoFrame(number=due_ns, width=2, height=2, stride=8, pixels=b"", due_ns=due_ns, age_ns=None, period_ns=10)
        for due_ns in (10, 20, 30)
    )
    frames = [camera.frame_at(moment_ns) for moment_ns in (9, 10, 29, 30, 99)]
    assert [frame and frame.due_ns for frame in frames] == [None, 10, 20, 30, 30]
    now_ns[0] = 30 + round(sources.STALLS_S * 1e9)
    assert camera.frame_at(30) is not None
    now_ns[0] += 1
    with pytest.raises(VideoError, match="no frame arrived for 1 s"):
        camera.frame_at(30)
    camera._failure = "it ended"
    with pytest.raises(VideoError, match="it ended"):
        camera.frame_at(30)
